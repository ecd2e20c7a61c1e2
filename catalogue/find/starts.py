"""Placed guides, such as earlier answers, as starts of a search."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from ..candidates.batch import CandidateBatch, Origin, measured
from ..errors import InvalidRequest, quoted
from ..given import listed
from ..guides.candidate import Candidate
from ..kinematics.linkage import SLIDING, Linkage
from ..kinematics.types import Array
from ..problem.constraints import Constraints
from ..problem.problem import Problem


def start_batch(problem: Problem, guides: Iterable[Candidate]) -> CandidateBatch:
    """Convert guides of the requested kinds that cover the stroke to candidates.

    Raises
    ------
    InvalidRequest
        If one has no path, or the request prescribes pivots, slots or returning points.
    """
    every = listed(guides)
    if every is None:
        raise InvalidRequest(f"starts are several guides, not {quoted(guides)}")
    if wrong := [one for one in every if not isinstance(one, Candidate)]:
        raise InvalidRequest(f"a search starts from answers, as find and measure give them, not {quoted(wrong[0])}")
    wanted = problem.constraints
    if every and (wanted.given or wanted.slots or wanted.returns):
        raise InvalidRequest("given pivots, slots and returning points are found without starts: leave these out")
    found = place_guides(problem, [one for one in every if _is_requested_kind(one, wanted)])
    return found[np.flatnonzero(np.isfinite(found.deviation))]


def _is_requested_kind(one: Candidate, wanted: Constraints) -> bool:
    """Tell whether a guide is of a requested kind."""
    named = ((one.family, wanted.families), (one.series, wanted.series), (one.configuration, wanted.configurations))
    slides = wanted.pins_only and one.family in SLIDING
    return all(not names or name in names for name, names in named) and not slides and (one.order or 2) >= wanted.order


def place_guides(problem: Problem, guides: Sequence[Candidate], series: str = "") -> CandidateBatch:
    """Place guides along the path from 0 to 1 and measure them.

    `series`, if given, replaces the series of the guides.
    """
    home = [one.at_home() for one in guides]
    stroke = np.array([one.extent if problem.is_wide else one.stroke for one in home], float)
    linkage = Linkage([one.pivots for one in home] or np.zeros((0, 2, 2, 3))).moved(1 / stroke)
    nowhere = (np.nan, np.nan)
    point, pole = (
        np.array([complex(*(getattr(one, name) or nowhere)) for one in home], complex) / stroke
        for name in ("guided", "pole")
    )
    origin = Origin.made(linkage, series) if series else _origin(guides)
    return measured(problem, origin, linkage, point, pole)


def _origin(guides: Sequence[Candidate]) -> Origin:
    def said(name: str, kind: Any, blank: Any) -> Array:
        return np.array([getattr(one, name) or blank for one in guides], dtype=kind)

    family, series, configuration = (said(name, object, "") for name in ("family", "series", "configuration"))
    return Origin(said("id", int, -1), family, series, configuration, said("order", int, 2), said("cognate", int, 0))
