"""Answer a request: search, refine and select candidates."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..candidates.batch import CandidateBatch, final, mirror_image
from ..candidates.feasibility import feasibility
from ..candidates.select import select_top
from ..errors import InvalidRequest
from ..kinematics.batch import join
from ..kinematics.types import Integers
from ..problem.constraints import PRESCRIBED, Constraints
from ..problem.problem import Problem, Request
from ..refine.certificate import Certificate, Drifts, certified
from ..search.search import Search
from ..search.starts import SearchReport
from ..store import Database
from .explain import Explanation
from .names import check_names, option
from .results import Found, candidates

if TYPE_CHECKING:
    from ..api import Catalogue


#: Arguments not available for arcs near a half circle or beyond, which are synthesised, not
#: retrieved.
NOT_WIDE = ("series", "configurations", "order", "slots", "returns", *PRESCRIBED, "cognates", "round_to")


@dataclass(frozen=True)
class Selection:
    """Selected candidates, best first."""

    found: CandidateBatch
    front: Integers  #: number of the Pareto front of each candidate, shape (n,); 0 without fronts
    certificate: Certificate | None = None


def find(catalogue: Catalogue, request: Request, starts: Iterable[Any] = (), *, warm: bool = False) -> Found:
    """Answer a request; see `catalogue.Catalogue.find`.

    With `warm` the starts are answers to a tighter request, and the search ends with answers as
    good as these.  Plugins are loaded only for prescribed pivots, or when the drift of a candidate
    is read.
    """
    database, constraints, problem = catalogue.database, request.constraints, request.problem
    refine, cognates = request.refine, request.cognates
    step = None if request.round_to is None else request.round_to / problem.stroke
    if problem.is_wide:
        _check_wide(constraints, cognates=cognates, round_to=step)
    report, given = SearchReport(), None
    if not isinstance(starts, tuple) or starts:
        from .starts import start_batch

        given = start_batch(problem, starts)
    if constraints.given:
        if cognates or step is not None:
            raise InvalidRequest(
                "cognates and round_to move the pivots: they cannot be asked for where pivots are given"
            )
        from .prescribed_pivots import with_prescribed_pivots

        chosen = with_prescribed_pivots(catalogue.registry.series, problem, report)
        drifts = None
    else:
        if constraints.families or constraints.series or constraints.configurations:
            check_names(database, constraints)
        chosen = searched(
            database, problem, report, refine=refine, cognates=cognates, round_to=step, given=given, warm=warm
        )
        drifts = (
            Drifts(chosen.found, lambda: catalogue.registry.series, constraints.slots)
            if chosen is not None and refine
            else None
        )
    listed = [] if chosen is None else candidates(problem, request.path, chosen, drifts)
    told = Explanation(database, problem, request.path, report, len(listed), lambda: catalogue.registry.series)
    return Found(listed, told, request)


def _check_wide(constraints: Constraints, *, cognates: bool, round_to: float | None) -> None:
    """Refuse arguments not available for arcs near a half circle or beyond."""
    asked = {*constraints.active(), *["cognates"] * cognates, *["round_to"] * (round_to is not None)}
    if wrong := [option(name) for name in NOT_WIDE if name in asked]:
        raise InvalidRequest(
            f"{', '.join(wrong)} cannot be asked for along an arc near a half circle or beyond, for which guides are "
            "made to measure: leave it out"
        )


def searched(
    database: Database,
    problem: Problem,
    report: SearchReport,
    *,
    refine: bool,
    cognates: bool,
    round_to: float | None,
    given: CandidateBatch | None,
    warm: bool = False,
) -> Selection | None:
    """Search, refine and select candidates, verified on their finite motion; None if there is none.

    Parameters
    ----------
    database : Database
    problem : Problem
    report : SearchReport
        Filled with counts and times.
    refine : bool
        Refine candidates; otherwise only retrieve them.
    cognates : bool
        Add the cognates of all candidates.
    round_to : float, optional
        Round lengths to multiples of this, and keep candidates that still meet the constraints
        [length].
    given : CandidateBatch, optional
        Further starts.
    warm : bool
        Whether the further starts are answers to a tighter problem: the search ends early then
        where they are good enough.
    """
    within, mirrors = problem.tightened(), problem.mirrors
    sought = within.mirrored(*mirrors) if any(mirrors) else within
    starts = mirror_image(sought, given, *mirrors) if given is not None and any(mirrors) else given
    every = []
    for name in problem.ranking.front or (None,):
        ranking = problem.ranking if name is None else replace(problem.ranking, weights={name: 1.0}, front=())
        search = Search(
            replace(sought, ranking=ranking), database, report, refines=refine, given=starts, warm=warm
        ).run()
        every.append(search)
        for _ in range(1, problem.effort):
            every.append(every[-1].again().run())
    parts = [search.found for search in every if search.found is not None]
    if not parts:
        return None
    found = join(*parts)
    if any(mirrors):
        found = mirror_image(within, found, *mirrors)
    report.nearest = found
    if cognates:
        from .postprocess import with_cognates

        found = with_cognates(within, found, refine=refine)
    if round_to is not None:
        from .postprocess import with_round_lengths

        with report.timed("round lengths"):
            found = with_round_lengths(problem, found, round_to)
    found = found[np.flatnonzero(feasibility(problem, found).all)]
    if not len(found):
        return None
    with report.timed("verify"):
        found = final(problem, found, rigid=round_to is not None)
        found = found[np.flatnonzero(feasibility(problem, found).all)]
    if not len(found):
        if problem.effort:
            return None
        how: dict[str, Any] = {"cognates": cognates, "round_to": round_to, "given": given, "warm": warm}
        return searched(database, replace(problem, effort=1), report, refine=refine, **how)
    with report.timed("verify"):
        found, front = select_top(problem, found)
        certificate = certified(problem, found) if refine and round_to is None else None
    return Selection(found, front, certificate)
