"""Guides to refine: stored ones that were laid along a path, whatever they break."""

from __future__ import annotations

from typing import Any

import numpy as np

from catalogue import Catalogue
from catalogue.candidates.batch import CandidateBatch
from catalogue.kinematics.types import Array
from catalogue.problem.constraints import Constraints
from catalogue.problem.path import PathRequest
from catalogue.problem.problem import Problem
from catalogue.problem.ranking import Ranking
from catalogue.search.search import Search


def problem_of(request: PathRequest, rank_by: Any = "score", **wish: Any) -> Problem:
    return Problem.of(request, Constraints(**wish), Ranking.of(request, rank_by))


def started(small: Catalogue, problem: Problem, count: int) -> CandidateBatch:
    """Return starts of a search that reach over the stroke and are not symmetric.

    Of a symmetric linkage either crank drives as well, and a step decides which is the better one.
    """
    search = Search(problem, small.database, refines=False, enough=10**9).run()
    assert search.found is not None
    reach = np.isfinite(search.found.deviation) & ~_symmetric(search.found)
    found = search.found[np.flatnonzero(reach)[:count]]
    assert len(found) >= min(count, 4)
    return found


def _symmetric(found: CandidateBatch) -> Array:
    z = found.linkage.points
    links = np.abs(z[:, :, 1] - z[:, :, 0])
    return np.asarray(found.linkage.finite.all((1, 2)) & (np.abs(links[:, 0] - links[:, 1]) < 1e-6 * links[:, 0]))
