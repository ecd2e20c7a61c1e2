"""Batches of stored guides laid along a path, and the second measurement of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from catalogue import Candidate, Catalogue
from catalogue.candidates.batch import CandidateBatch
from catalogue.find.find import Selection
from catalogue.find.listing import candidates
from catalogue.problem.constraints import Constraints
from catalogue.problem.path import PathRequest
from catalogue.problem.problem import Problem
from catalogue.problem.ranking import Ranking
from catalogue.search.retrieve import candidates_of, eligible, estimate, shortlist, stored_reaches
from tests.find.conftest import again

__all__ = ["again"]

Batch = tuple[Problem, CandidateBatch]


@pytest.fixture(scope="session")
def batch(small: Catalogue) -> Callable[..., Batch]:
    """Return a maker of batches: the most promising stored guides, laid along the path of a request as starts."""

    def make(request: PathRequest, count: int = 60, rank_by: Any = "score", **wanted: Any) -> Batch:
        how = {name: wanted.pop(name) for name in ("per_series", "distinct") if name in wanted}
        problem = Problem.of(request, Constraints(**wanted), Ranking.of(request, rank_by, **how))
        reaches = stored_reaches(problem, small.database)
        merit, stretch = estimate(problem, reaches)
        chosen = shortlist(reaches, np.where(eligible(problem, reaches), merit, np.inf), count)
        return problem, candidates_of(problem, small.database, reaches, chosen, stretch[chosen])

    return make


@pytest.fixture(scope="session")
def shown() -> Callable[[Problem, PathRequest, CandidateBatch], list[Candidate]]:
    """Return what shows each of a batch as a user sees it."""

    def show(problem: Problem, request: PathRequest, found: CandidateBatch) -> list[Candidate]:
        return candidates(problem, request, Selection(found, np.zeros(len(found), int)))

    return show
