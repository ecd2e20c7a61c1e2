"""Answer a request: search, refine and select candidates."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..candidates.batch import CandidateBatch, final, mirror_image
from ..candidates.feasibility import cost, feasibility
from ..candidates.select import select_top
from ..errors import InvalidRequest
from ..guides.results import Found
from ..kinematics.batch import join
from ..kinematics.types import Integers
from ..problem.constraints import PRESCRIBED, Constraints
from ..problem.problem import Problem, Request
from ..refine.certificate import Certificate, Drifts, certified
from ..search.search import BUDGET, Search
from ..search.starts import SearchReport
from ..store import Database
from .explain import Explanation
from .follow import EXPLORING, followed
from .listing import candidates
from .names import check_names, option

if TYPE_CHECKING:
    from .opened import Opened


#: Arguments not available for arcs near a half circle or beyond, which are synthesised, not
#: retrieved.
NOT_WIDE = ("series", "configurations", "order", "slots", "returns", *PRESCRIBED, "cognates", "round_to")


@dataclass(frozen=True)
class Selection:
    """Selected candidates, best first."""

    found: CandidateBatch
    front: Integers  #: number of the Pareto front of each candidate, shape (n,); 0 without fronts
    certificate: Certificate | None = None


class SearchOptions(NamedTuple):
    """Options of the search for a problem."""

    refine: bool = True  #: refine candidates; otherwise only retrieve them
    cognates: bool = False  #: add the cognates of all candidates
    #: round lengths to multiples of this, and keep candidates that still meet the constraints
    #: [strokes]
    round_to: float | None = None
    given: CandidateBatch | None = None  #: further starts
    #: whether `given` are answers to a tighter problem: the search ends early where they are good
    #: enough
    warm: bool = False
    follow: bool = False  #: whether to omit the search if such answers fill the list within the gap


def find(
    catalogue: Opened, request: Request, starts: Iterable[Any] = (), *, warm: bool = False, follow: bool = False
) -> Found:
    """Answer a request; see `catalogue.Catalogue.find`.

    With `warm` the starts are answers to a tighter request, and the search ends once its answers
    are as good. With `follow` too, no search is run where the starts fill the list within the gap.
    """
    report, options = SearchReport(), _options(catalogue, request, starts, warm=warm, follow=follow)
    if request.constraints.given:
        return _with_given_pivots(catalogue, request, report)
    return _as_answers(catalogue, request, report, searched(catalogue.database, request.problem, report, options))


def improving(catalogue: Opened, request: Request, starts: Iterable[Any] = ()) -> Iterator[Found]:
    """Yield better and better answers to a request; see `catalogue.Catalogue.improving`."""
    report, options = SearchReport(), _options(catalogue, request, starts)
    if request.constraints.given:
        yield _with_given_pivots(catalogue, request, report)
        return
    problem, every, seen, best = request.problem, list[Search](), set[tuple[int, float]](), np.inf
    for every in _searches(catalogue.database, problem, report, options):
        now = {(number, search.least) for number, search in enumerate(every) if np.isfinite(search.least)}
        if not now <= seen and (chosen := selected(problem, every, report, options)) is not None:
            value = float(cost(problem, chosen.found)[0])
            if problem.ranking.front or value <= best:  # a full measurement may show that an answer is no better
                best = value
                yield _as_answers(catalogue, request, report, chosen)
        seen |= now
    yield _as_answers(catalogue, request, report, _search_again(catalogue.database, problem, every, report, options))


def _options(
    catalogue: Opened, request: Request, starts: Iterable[Any], *, warm: bool = False, follow: bool = False
) -> SearchOptions:
    """Check a request, and return the options of its search."""
    problem, constraints = request.problem, request.constraints
    step = None if request.round_to is None else request.round_to / problem.stroke
    if problem.is_wide:
        _check_wide(constraints, cognates=request.cognates, round_to=step)
    if constraints.given and (request.cognates or step is not None):
        raise InvalidRequest("cognates and round_to move the pivots: they cannot be asked for where pivots are given")
    if not constraints.given and (constraints.families or constraints.series or constraints.configurations):
        check_names(catalogue.database, constraints)
    given = None
    if not isinstance(starts, tuple) or starts:
        from .starts import start_batch

        given = start_batch(problem, starts)
    return SearchOptions(request.refine, request.cognates, step, given, warm, follow)


def _with_given_pivots(catalogue: Opened, request: Request, report: SearchReport) -> Found:
    """Answer a request that prescribes pivots."""
    from .prescribed_pivots import with_prescribed_pivots

    return _as_answers(
        catalogue, request, report, with_prescribed_pivots(catalogue.registry.series, request.problem, report)
    )


def _as_answers(catalogue: Opened, request: Request, report: SearchReport, chosen: Selection | None) -> Found:
    """Return a selection as answers, in the unit of the user.

    Plugins are loaded only when the drift of a candidate is read.
    """
    problem, constraints, listed = request.problem, request.constraints, []
    if chosen is not None:
        drifts = None
        if request.refine and not constraints.given:
            drifts = Drifts(chosen.found, lambda: catalogue.registry.series, constraints.slots)
        listed = candidates(problem, request.path, chosen, drifts)
    told = Explanation(
        catalogue.database, problem, request.path, report, len(listed), lambda: catalogue.registry.series
    )
    least = None if chosen is None else float(cost(problem, chosen.found[:1])[0])
    return Found(listed, told, request, least)


def _check_wide(constraints: Constraints, *, cognates: bool, round_to: float | None) -> None:
    """Refuse arguments not available for arcs near a half circle or beyond."""
    asked = {*constraints.active(), *["cognates"] * cognates, *["round_to"] * (round_to is not None)}
    if wrong := [option(name) for name in NOT_WIDE if name in asked]:
        raise InvalidRequest(
            f"{', '.join(wrong)} cannot be asked for along an arc near a half circle or beyond, for which guides are "
            "made to measure: leave it out"
        )


def searched(database: Database, problem: Problem, report: SearchReport, options: SearchOptions) -> Selection | None:
    """Search, refine and select candidates, verified on their finite motion; None if there is none.

    The report is filled with counts and times.
    """
    if options.follow and (known := _select_from_known(problem, report, options)) is not None:
        return known
    *_, every = _searches(database, problem, report, options)
    return _search_again(database, problem, every, report, options)


def is_answered(database: Database, problem: Problem) -> bool:
    """Tell whether a search finds an answer; stop at the first one."""
    report, options, every = SearchReport(), SearchOptions(), list[Search]()
    for every in _searches(database, problem, report, options):
        if np.isfinite(every[-1].least) and selected(problem, every, report, options) is not None:
            return True
    return _search_again(database, problem, every, report, options) is not None


def _search_again(
    database: Database, problem: Problem, every: Sequence[Search], report: SearchReport, options: SearchOptions
) -> Selection | None:
    """Select from all searches; if no first answer lasts with effort 0, search with effort 1.

    Without a feasible candidate both efforts search alike.
    """
    chosen = selected(problem, every, report, options)
    exhausted = all(search.status == "exhausted" for search in every)
    if chosen is not None or problem.effort or report.nearest is None or exhausted:
        return chosen
    return searched(database, replace(problem, effort=1), report, options)


def _searches(
    database: Database, problem: Problem, report: SearchReport, options: SearchOptions
) -> Iterator[list[Search]]:
    """Search round by round; after each round yield all searches begun so far."""
    sought, starts = _search_problem(problem, options)
    budget = EXPLORING if options.warm and not options.follow else BUDGET
    every: list[Search] = []
    for name in problem.ranking.front or (None,):
        ranking = problem.ranking if name is None else replace(problem.ranking, weights={name: 1.0}, front=())
        this = replace(sought, ranking=ranking)
        how: dict[str, Any] = {"refines": options.refine, "given": starts, "warm": options.warm, "budget": budget}
        search = Search(this, database, report, **how)
        for number in range(max(problem.effort, 1)):
            search = search.again() if number else search
            every.append(search)
            while search.status == "searching":
                search.step()
                yield every


def selected(
    problem: Problem, every: Sequence[Search], report: SearchReport, options: SearchOptions
) -> Selection | None:
    """Select from searches the feasible candidates, verified on their finite motion."""
    parts = [part for search in every if (part := search.so_far) is not None]
    if not parts:
        return None
    return _select_verified(problem, join(*parts), report, options)


def _search_problem(problem: Problem, options: SearchOptions) -> tuple[Problem, CandidateBatch | None]:
    """Return the problem of a search and its further starts, mirrored to one side."""
    within, mirrors, starts = problem.tightened(), problem.mirrors, options.given
    if not any(mirrors):
        return within, starts
    sought = within.mirrored(*mirrors)
    return sought, None if starts is None else mirror_image(sought, starts, *mirrors)


def _select_from_known(problem: Problem, report: SearchReport, options: SearchOptions) -> Selection | None:
    """Select from the answers to a tighter problem; None if they are too few or too costly."""
    sought, known = _search_problem(problem, options)
    if known is None or not options.refine:
        return None
    with report.timed("refine"):
        found = followed(sought, known)
    return None if found is None else _select_verified(problem, found, report, options)


def _select_verified(
    problem: Problem, found: CandidateBatch, report: SearchReport, options: SearchOptions
) -> Selection | None:
    """Select the feasible candidates, verified on their finite motion."""
    if any(mirrors := problem.mirrors):
        found = mirror_image(problem.tightened(), found, *mirrors)
    report.nearest = found
    refine, step = options.refine, options.round_to
    if options.cognates:
        from .postprocess import with_cognates

        found = with_cognates(problem.tightened(), found, refine=refine)
    if step is not None:
        from .postprocess import with_round_lengths

        with report.timed("round lengths"):
            found = with_round_lengths(problem, found, step)
    found = found[np.flatnonzero(feasibility(problem, found).all)]
    if not len(found):
        return None
    with report.timed("verify"):
        found = final(problem, found, rigid=step is not None)
        found = found[np.flatnonzero(feasibility(problem, found).all)]
        if not len(found):
            return None
        found, front = select_top(problem, found)
        certificate = certified(problem, found) if refine and step is None else None
    return Selection(found, front, certificate)
