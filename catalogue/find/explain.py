"""Explain the result of a search.

For an empty one compute which constraints to relax, to which values.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import combinations, product
from operator import itemgetter
from typing import TYPE_CHECKING, Any

import numpy as np

from ..candidates.batch import CandidateBatch
from ..candidates.feasibility import (
    PIVOT_REGIONS,
    SWEPT_GRID,
    WEIGHTS,
    Feasibility,
    bounded,
    farthest,
    feasibility,
    machine,
    region_places,
)
from ..guidance.drive import SampledPoses
from ..guidance.swept_area import link_segments
from ..kinematics.types import Complexes, Floats
from ..problem.constraints import Constraints
from ..problem.path import PathRequest
from ..problem.problem import SEARCH_TOLERANCE, Problem
from ..problem.region import FAR, Region
from ..quantities import BOUNDS, LENGTHS
from ..refine.sqp import Refinement
from ..search.search import Search
from ..search.starts import KIND_CONSTRAINTS, SearchReport
from ..store import Database
from .grid_synthesis import reaches
from .names import EMPTY_DATABASE, contradiction, option

if TYPE_CHECKING:
    from ..series.series import Series

#: Number of starting points for each relaxation.
STARTS = 8
#: Rounds of refinement of each relaxation.
ROUNDS = 6
#: Margins by which a bound is relaxed beyond the point found, so that a search finds it again. The
#: first margin that gives an answer is offered; after a first offer the narrowest is left out.
BOUND_MARGINS = (0.01, 0.05, 0.2)
#: Relaxation above which a smaller one is tried [e-folds of the deviation, strokes, radians,
#: fraction of a bound].
LARGE_RELAXATION = 0.2
#: Largest number of attempts at a smaller relaxation.
MAX_REDUCTIONS = 3
#: Relaxation that is offered only if no pair of constraints needs a smaller one: twenty times the
#: deviation.
ABSURD_RELAXATION = 3.0
#: Note on offers: each was tested; none is proved to be minimal.
LESS = "a smaller change may suffice"
#: Beginning of the offers.
REMEDIES = "tested remedies"


@dataclass(frozen=True)
class Relaxation:
    """An option of the command with a looser bound.

    Without a `value` the option must be omitted.
    """

    option: str
    value: str = ""
    asked: str = ""

    def __str__(self) -> str:
        if not self.value:
            return f"without {self.option}"
        return f"{self.option} {self.value}" + f" (asked {self.asked})" * bool(self.asked)


@dataclass(frozen=True)
class Advice:
    """The reason for an empty result, and alternative sets of relaxations that give an answer."""

    reason: str
    alternatives: tuple[tuple[Relaxation, ...], ...] = ()

    def __str__(self) -> str:
        offers = ", or ".join(" with ".join(map(str, one)) for one in self.alternatives)
        return f"{self.reason}; {REMEDIES}: {offers}; {LESS}" if offers else self.reason


@dataclass(frozen=True)
class Told:
    """An explanation independent of the database: its text, and the advice on an empty result."""

    text: str
    given: Advice | None = None

    def __str__(self) -> str:
        return self.text

    def advice(self) -> Advice:
        """Return the constraints to relax; none if there are answers."""
        return self.given or Advice("there are answers")


@dataclass(frozen=True)
class Explanation:
    """The explanation of a search, computed when printed."""

    database: Database
    problem: Problem
    request: PathRequest
    report: SearchReport
    count: int  #: number of answers
    series: Callable[[], Mapping[str, Series]] = dict  #: returns the series by code, for prescribed pivots

    def __str__(self) -> str:
        return "\n".join(self._lines())

    def __reduce__(self) -> tuple[type[Told], tuple[str, Advice | None]]:
        """Reduce to text and advice: a copy may be read where the database is missing."""
        advice = None if self.count else self.advice()
        return Told, ("\n".join(self._lines(advice)), advice)

    def _lines(self, advice: Advice | None = None) -> Iterator[str]:
        report, prescribed = self.report, self.problem.constraints.given
        if prescribed:
            what = "one crank" if prescribed == "crank" else f"both {prescribed} pivots"
            yield (
                f"{describe(self.request)}, {what} given: {report.solved} linkages from the series, "
                f"{report.completed} more completed along the path"
            )
        else:
            yield f"{describe(self.request)}: {report.eligible} stored reaches are eligible"
        yield f"  {report.measured} starts measured, {report.refined} points by the optimiser; {self.count} answers"
        if report.nearest is not None:
            for name, number in feasibility(self.problem, report.nearest).counts.items():
                yield f"  {option(name)} is violated by {number} of {len(report.nearest)} refined candidates"
        if not self.count:
            yield str(advice or self.advice())
        source = "no database read" if prescribed else f"database {self.database.path}; no plugin loaded"
        yield f"{source}; {', '.join(f'{step} {1000 * s:.0f} ms' for step, s in report.seconds.items())}"

    def advice(self) -> Advice:
        """Return the constraints to relax for an empty result, with values."""
        nearest = self.report.nearest
        if nearest is None or not np.isfinite(nearest.deviation).any():
            return Advice(self._advise_nothing())
        found = self.relaxations(nearest)
        if not found:
            counts = feasibility(self.problem, nearest).counts
            worst = max(counts, key=lambda name: counts[name], default="deviation")
            return Advice(
                f"no guide found, none close: {option(worst)} excludes most candidates; relax several constraints"
            )
        return Advice("no guide found", tuple(found))

    def _advise_nothing(self) -> str:
        wanted = self.problem.constraints
        if against := contradiction(wanted):
            name, lacking = against
            which = " or ".join(wanted.families)
            return f"no guide found: no {which} has {lacking}, which {option(name)} asks for; leave one of them out"
        if wanted.given:
            return self._nothing_in_place()
        if self.problem.is_wide:
            return (
                "no guide found: none is stored along an arc near a half circle or beyond; guides are made to measure "
                "there: leave --no-refine out"
            )
        if not self.database.has_guides:
            return f"no guide found: {EMPTY_DATABASE}"
        if self.report.eligible and not self.report.refined:
            bounds = [option(name) for name in wanted.active() if name not in KIND_CONSTRAINTS]
            remedy = "relax a bound" if wanted.returns else "leave --no-refine out"
            return (
                f"no guide found: none of {self.report.eligible} stored reaches meets {', '.join(bounds) or 'this'} as "
                f"it is; {remedy}"
            )
        sorts = ("families", "series", "configurations", "order", "slots", "returns", "pins_only")
        names = [_with_value(name, getattr(wanted, name)) for name in sorts if getattr(wanted, name)]
        if not names:
            return (
                "no guide found: no stored guide follows such a path; `catalogue build` with a larger --count adds some"
            )
        remedy = "leave it out" if len(names) == 1 else "leave one of them out"
        return f"no guide found: none is stored for {' with '.join(names)} and such a path; {remedy}"

    def _nothing_in_place(self) -> str:
        wanted = self.problem.constraints
        if wanted.given == "crank" and not reaches(wanted.places, self.problem.path):
            return (
                "no guide found: this crank with its arm to the point is too short for the path, or in line with the "
                "arm in mid-stroke; lengthen or move it"
            )
        if wanted.families and "four-bar" not in wanted.families:
            return (
                f"no guide found: with pivots given, a {' or '.join(wanted.families)} comes from a series in closed "
                "form alone, and none of them fits; ask for a four-bar, or leave the pivots free"
            )
        return (
            "no guide found: no linkage with these pivots carries the point from end to end; move them, or give a "
            "tolerance (--within)"
        )

    def relaxations(self, nearest: CandidateBatch) -> list[tuple[Relaxation, ...]]:
        """Compute relaxations of single constraints, else of pairs, that give an answer.

        Each is tested.

        An absurdly large relaxation of one constraint is offered only if no pair needs less.
        """
        refined = {}
        wanted = self.problem.constraints
        implied = {"full_rotation"} if wanted.needs_turn else set()
        for name, amount in feasibility(self.problem, nearest).amounts.items():
            if (amount > WEIGHTS.rounding).any() and not name.startswith("distance ") and name not in implied:
                found = nearest if self.problem.constraints.given else relaxed(self.problem, nearest, name)
                refined[name] = found, feasibility(self.problem, found)
        # with prescribed pivots all entries are equal
        every = [*refined.values()][: 1 if self.problem.constraints.given else None]
        trials = [
            (float(self._least(source[1], names).min()), names, source)
            for names in (*combinations(refined, 1), *combinations(refined, 2))
            for source in ([refined[names[0]]] if len(names) == 1 else every)
        ]
        trials.sort(key=itemgetter(0))
        for absurd, count in product((False, True), (1, 2)):
            offered: dict[tuple[str, ...], tuple[Relaxation, ...]] = {}
            for least, names, source in trials:
                if len(names) != count or (least > ABSURD_RELAXATION) != absurd or names in offered:
                    continue
                if best := self._best(*source, names, BOUND_MARGINS[1:] if offered else BOUND_MARGINS):
                    offered[names] = best
            if offered:
                return [*offered.values()]
        return []

    @staticmethod
    def _least(broken: Feasibility, names: tuple[str, ...]) -> Floats:
        """Sum the violations of some constraints, shape (n,).

        It is infinite where other constraints are violated too.
        """
        amount = np.sum([broken.amounts[name] for name in names], axis=0)
        rest = [broken.amounts[name] for name in broken.amounts if name not in names]
        others = np.sum([np.zeros_like(amount), *rest], axis=0)
        return np.where(others <= WEIGHTS.rounding, amount, np.inf)

    def _best(
        self, found: CandidateBatch, broken: Feasibility, names: tuple[str, ...], rooms: tuple[float, ...]
    ) -> tuple[Relaxation, ...] | None:
        """Find the least relaxation of some constraints that admits a candidate."""
        amount = self._least(broken, names)
        best = int(np.argmin(amount))
        if not np.isfinite(amount[best]):
            return None
        one = found[np.array([best])]
        for room in rooms if amount[best] > WEIGHTS.rounding else ():
            bounds = {name: self._value(name, one, room) for name in names}
            if (answers := self._answers(bounds, one)) is None:
                continue
            offers = [bounds]
            if len(names) == 1 and amount[best] > LARGE_RELAXATION and not self.problem.constraints.given:
                closer = self._tighten(names[0], bounds, amount[best], answers)
                offers = offers if closer is bounds else [closer, bounds]
            for offer in offers:
                if self._has_answer(offer):
                    return tuple(self._relaxation(name, bound) for name, bound in offer.items())
        return None

    def _tighten(self, name: str, bounds: dict[str, Any], amount: float, answers: CandidateBatch) -> dict[str, Any]:
        """Reduce the relaxation of one constraint, starting from the answers it gave."""
        for _ in range(MAX_REDUCTIONS):
            found = relaxed(self.problem, answers, name)
            broken = feasibility(self.problem, found)
            less = self._least(broken, (name,))
            best = int(np.argmin(less))
            if not WEIGHTS.rounding < less[best] < amount - LARGE_RELAXATION:
                break
            one = found[np.array([best])]
            nearer = {name: self._value(name, one, BOUND_MARGINS[0])}
            again = self._answers(nearer, one)
            if again is None:
                break
            bounds, amount, answers = nearer, less[best], again
        return bounds

    def _answers(self, bounds: dict[str, Any], one: CandidateBatch) -> CandidateBatch | None:
        """Search with constraints relaxed to these bounds; None if there is no answer.

        With prescribed pivots this is the full search.  Otherwise only starts close to the
        candidate are refined: other starts seldom find an answer that these miss, and take longest
        where no answer exists.
        """
        looser = self._relaxed_problem(bounds)
        if looser.constraints.given:
            from .prescribed_pivots import with_prescribed_pivots

            chosen = with_prescribed_pivots(self.series(), looser, SearchReport())
            return None if chosen is None else chosen.found
        return Search(looser, self.database, enough=1).answers_near(one)

    def _has_answer(self, bounds: dict[str, Any]) -> bool:
        """Tell whether a search under these bounds finds an answer when the user runs it."""
        from .find import is_answered

        looser = replace(
            self._relaxed_problem(bounds), effort=0
        )  # a search with effort 0 is the first part of a longer one
        if looser.constraints.given:  # `_answers` has run the full search
            return True
        return is_answered(self.database, looser)

    def _relaxed_problem(self, bounds: dict[str, Any]) -> Problem:
        """Return the problem for one answer under other bounds."""
        problem = self.problem
        changes: dict[str, Any] = {}
        path, stroke = problem.path, problem.stroke
        for name, value in bounds.items():
            if name == "deviation":
                path = replace(path, deviation=min(float(value) / stroke, 0.1))
            elif isinstance(value, Region):
                changes[name] = value.carried(1 / problem.scale, -problem.shift / problem.scale)
            elif value is None:
                changes[name] = getattr(Constraints(), name)
            else:
                changes[name] = value / stroke if name in LENGTHS else value
        return replace(problem, path=path, limit=1).with_constraints(**changes)

    def _value(self, name: str, one: CandidateBatch, room: float) -> Any:
        """Compute the bound that admits a candidate, in the user's unit and few digits.

        A constraint on a region gives a region; None means that it must be omitted.
        """
        problem, s, m = self.problem, self.problem.stroke, one.measures
        if name in PIVOT_REGIONS:
            return _widened(problem, name, region_places(name, one.linkage, m.slides), room)
        if name == "swept_in":
            poses = SampledPoses.of(one.curve, one.traced, SWEPT_GRID.intervals, inverse=problem.constraints.slots)
            return _widened(problem, name, link_segments(machine(problem, one), poses), room)
        if name == "deviation":
            value = s * one.deviation / SEARCH_TOLERANCE
        elif name in BOUNDS:
            value = bounded(problem, one, BOUNDS[name]) * (s if name in LENGTHS else 1.0)
        else:
            return None
        return rounded(float(value[0]), room, up=name not in BOUNDS or BOUNDS[name].is_upper)

    def _relaxation(self, name: str, value: object) -> Relaxation:
        """Format a relaxed bound as an option, beside the requested bound."""
        if value is None:
            return Relaxation(option(name))
        if isinstance(value, Region):
            return Relaxation(option(name), " ".join(f"{number:.5g}" for number in value.box))
        asked = self.request.deviation if name == "deviation" else getattr(self.problem.constraints, name)
        if asked is None:
            told = f"none: {self.problem.stroke * farthest(self.problem):g} at most"
            return Relaxation(option(name), f"{value:.4g}", told)
        asked = self.problem.stroke * asked if name in LENGTHS else asked
        return Relaxation(option(name), f"{value:.4g}", f"{asked:g}")


def relaxed(problem: Problem, nearest: CandidateBatch, name: str) -> CandidateBatch:
    """Minimise the violation of one constraint subject to the others."""
    loose = replace(problem, relaxed=name)
    total = feasibility(loose, nearest).total
    first = np.argsort(np.where(np.isnan(total), np.inf, total), kind="stable")[:STARTS]
    return Refinement.of(loose, nearest[first[np.isfinite(total[first])]]).run(ROUNDS).best


def _with_value(name: str, value: object) -> str:
    """Format the option of a constraint with its values; a switch has none."""
    if value is True:
        return option(name)
    values = value if isinstance(value, list | tuple) else [value]
    return " ".join(f"{option(name)} {one}" for one in values)


def rounded(value: float, room: float, *, up: bool) -> float | None:
    """Round a bound up or down, with a margin, to four digits; None if not positive."""
    value = value * (1 + room if up else 1 - room)
    if not (math.isfinite(value) and value > 0):
        return None
    unit = 10.0 ** (math.floor(math.log10(value)) - 3)
    return float(f"{(math.ceil if up else math.floor)(value / unit) * unit:.4g}")


def _widened(problem: Problem, name: str, places: Complexes, room: float) -> Region:
    """Return the bounding box of a region and positions, in the user's unit and frame."""
    region: Region = getattr(problem.constraints, name)
    x0, y0, x1, y1 = region.carried(problem.scale, problem.shift).box
    there, room = places * problem.scale + problem.shift, room * problem.stroke
    sides = (
        min(x0, np.nanmin(there.real) - room),
        min(y0, np.nanmin(there.imag) - room),
        max(x1, np.nanmax(there.real) + room),
        max(y1, np.nanmax(there.imag) + room),
    )
    infinite = 0.5 * FAR * problem.stroke  # beyond it a side is at infinity
    return Region.of(name, [float(f"{v:.5g}") if abs(v) < infinite else math.copysign(math.inf, v) for v in sides])


def describe(request: PathRequest) -> str:
    """Describe a request in words."""
    if request.kind == "line":
        return f"straight line of {request.stroke:g} within {request.deviation:g}"
    radius = "any radius" if request.radius is None else f"radius {request.radius:g}"
    angle = f", {request.angle:g}\u00b0," if request.is_wide else ""
    return f"arc of chord {request.stroke:g} and {radius}{angle} within {request.deviation:g}"
