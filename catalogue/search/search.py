"""The search: phases that gather starts and refine the promising ones.

The starts of a phase are stored guides, synthesised guides, or perturbed copies of the best point
found.  A race leads them into the constraints (`catalogue.refine.race`), and the leaders are
refined on their finite motion (`catalogue.refine.sqp`), in decreasing number (successive halving,
K. Jamieson and A. Talwalkar, AISTATS 2016, 240-248). If a family has few starts, they are refined
without a race.

The first phase is short: it ends the search if the list is full and no answer can become much
better. The best answer is perturbed as long as that gains (basin hopping, D. J. Wales and J. P. K.
Doye, J. Phys. Chem. A 101 (1997) 5111-5116). Each further unit of effort is a search from other
starts. All budgets are counts, so that answers are equal on every machine.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import InitVar, dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from ..candidates.batch import CandidateBatch
from ..candidates.feasibility import EXACT_DEVIATION, cost, faults, feasibility
from ..candidates.select import unlike
from ..kinematics.batch import join
from ..kinematics.types import Array, Floats, Mask
from ..problem.problem import Problem
from ..refine.sqp import RADIUS_FACTORS, Refinement
from ..refine.subproblem import is_raced
from ..store import Database
from .starts import SearchReport, Starts, is_constrained


@dataclass(frozen=True)
class Budget:
    """Budget of a search."""

    short: int = 30  #: number of starts of the short phase
    followed: int = 15  #: number of starts of the short phase refined to the end
    per_kind: int = 60  #: number of starts of each kind in a race
    raced: int = 150  #: number of starts of a race
    rounds: int = 15  #: number of rounds of a race
    dense: int = 4  #: number of further rounds at twice as many stations
    leaders: int = 16  #: number of leaders of a race that are refined
    tried: int = 40  #: number of starts of each kind refined without a race, and of all in a second round
    kept: int = 16  #: number of starts refined to the end after the second round
    farther: int = 4  #: number of rounds of refinement after the second
    broad: int = 3  #: number of broad phases after the first, where there are too few answers
    hops: int = 10  #: number of phases of perturbed copies
    hopped: int = 80  #: number of perturbed copies of a phase
    hop_rounds: int = 5  #: number of rounds of a race of perturbed copies, which begin near the constraints
    landed: int = 16  #: number of leaders of a race of perturbed copies
    rare: int = 40  #: number of starts of a family below which no race is run
    known: int = 4  #: number of answers to a tighter problem that are refined
    beside: int = 10  #: number of stored starts besides answers to a tighter problem
    known_followed: int = 8  #: number of starts of a tighter problem refined to the end


BUDGET = Budget()


class Cuts(NamedTuple):
    """Numbers of starts that a race drops."""

    after: tuple[float, ...] = (1 / 3, 2 / 3)  #: fractions of its rounds after which a race drops starts
    kept: float = 0.6  #: fraction of the starts that are kept


class LeadIn(NamedTuple):
    """Lead-in: a search for the least deviation until it approaches a tolerance that was missed."""

    loosest: float = 0.01  #: tolerance of the lead-in, whatever the request [strokes]
    nearest: int = 12  #: number of candidates nearest to the constraints that are refined before and after the lead-in
    fall: float = 0.05  #: decrease of the logarithm of the deviation in a broad phase that promises further gain
    #: Ratio of least deviation to tolerance above which the search gives up where there is no such
    #: decrease. Some requests that were answered in the end had a ratio of 1.6 for two phases.
    far_off: float = 3.0


CUTS = Cuts()
LEAD_IN = LeadIn()

#: Number of answers that suffices to end the search.
ENOUGH_ANSWERS = 6
#: Number of answers that is never reached: all broad phases are run.
UNREACHABLE_COUNT = 1_000_000
#: Number of candidates in a refinement, none of them the best, that are not worth a further round.
MIN_REFINED = 3
#: Least gain of a phase, relative to the cost, or to 1 for a smaller cost that is no deviation.
MIN_GAIN = 3e-3
#: Number of starts most like a candidate, and of most promising ones, where an answer is likely
#: near it.
LIKELY_STARTS = 4


def by_deviation(problem: Problem) -> Problem:
    """Return the problem of the least deviation, whatever the requested tolerance."""
    ranking = replace(problem.ranking, weights={"deviation": 1.0}, front=())
    path = replace(problem.path, deviation=max(problem.deviation, LEAD_IN.loosest))
    wanted = problem.constraints
    if wanted.min_allowance:  # an allowance depends on the tolerance
        path = problem.path
    return replace(problem, path=path, ranking=ranking)


@dataclass
class Search:
    """A search for a problem, with its answers.

    For each refined start the cheapest feasible point is kept, else the one of least violation.
    """

    problem: Problem
    database: Database
    report: SearchReport = field(default_factory=SearchReport)
    refines: bool = True  #: whether starts are refined; otherwise they are returned as stored
    enough: int = ENOUGH_ANSWERS  #: number of answers that ends the search
    given: InitVar[CandidateBatch | None] = None  #: further starts
    effort: int = 1  #: number of this search for the problem, from 1
    warm: bool = False  #: whether the further starts are answers to a tighter problem
    budget: Budget = BUDGET
    found: CandidateBatch | None = None
    refining: Refinement[CandidateBatch] | None = None  #: refinement in progress
    broad: int = 0  #: number of broad phases so far
    cost: Floats = field(default_factory=lambda: np.zeros(0))  #: costs of the answers, infinite outside the constraints
    #: `searching`, then `found`, `good enough`, `no gain`, or `exhausted` without an answer
    status: str = "searching"

    def __post_init__(self, given: CandidateBatch | None) -> None:
        self._asked = self.problem
        if self._by_deviation and self.refines:
            self.problem = by_deviation(self.problem)
        self.starts = Starts(self.problem, self.database, self.report, self.effort, self.refines, given)
        self._phases = self._every_phase()

    def run(self) -> Search:
        """Run all rounds."""
        while self.status == "searching":
            self.step()
        return self

    def step(self) -> None:
        """Run the next round; answers `so_far` never become worse."""
        ended = next(self._phases, "found")
        if ended:
            self._drop_repeated()
            self.status = ended if self._has_feasible else "exhausted"

    def _drop_repeated(self) -> None:
        """Set the cost of answers outside the requested tolerance to infinity."""
        if self.found is not None and self.problem is not self._asked:
            met = feasibility(self._asked, self.found).all
            self.cost = np.where(met, self.cost, np.inf)

    def again(self) -> Search:
        """Return a new search of this problem, from other starts."""
        how: dict[str, Any] = {"enough": self.enough, "effort": self.effort + 1, "budget": self.budget}
        another = Search(self._asked, self.database, self.report, self.refines, **how)
        another.starts.taken = self.starts.taken
        return another

    def answers_near(self, candidate: CandidateBatch) -> CandidateBatch | None:
        """Refine a candidate, stored starts like it, and the most promising stored starts.

        None if there are none.
        """
        starts = self.starts.likely(candidate, LIKELY_STARTS)
        for _ in self._take(candidate if starts is None else join(candidate, starts), LIKELY_STARTS):
            pass
        if self.found is None or not self._has_feasible:
            return None
        return self.found[np.flatnonzero(np.isfinite(self.cost))]

    # -- phases ----------------------------------------------------------------------------
    def _every_phase(self) -> Iterator[str]:
        """Run the phases; after each round yield the reason to stop, or an empty text."""
        if (known := self._meeting_constraints(self.starts.given)) is not None:
            self._add(known, cost(self.problem, known))
            if self.warm and self.refines:
                yield from self._from_known(known)
        if self.effort == 1 and self._may_be_short:
            yield from self._take(self._gather(self.starts.short, self.budget.short), self.budget.followed)
            yield self._enough_already
        each = self.budget.per_kind if self._is_racing else self.budget.tried
        if not self.refines:
            each = max(each, self.problem.limit)
        for number in range(1 + self.budget.broad):
            starts = self._gather(self.starts.broad, number, each, self.found)
            if not (self.refines or self.report.eligible):
                break
            yield from self._race(starts, self.budget.raced, self.budget.leaders, self.budget.rounds)
            self.broad += 1
            if self.refines and not self._has_feasible and not self._by_deviation:
                yield from self._lead_in()
                break
            if self._acceptable.sum() >= self.enough or (self._has_feasible and not self.problem.effort):
                break
            yield ""
        yield self._enough_for_all
        yield from self._perturbation_phases()

    def _from_known(self, known: CandidateBatch) -> Iterator[str]:
        """Refine the best answers to a tighter problem, and a few stored starts.

        A full list ends the search, after hops from its best answer if that is beyond the gap.
        Broad phases are omitted, as tighter problems have had them.
        """
        best = known[np.argsort(cost(self.problem, known), kind="stable")[: self.budget.known]]
        beside = self._gather(self.starts.short, self.budget.beside)
        yield from self._take(best if beside is None else join(best, beside), self.budget.known_followed)
        if self._acceptable.sum() >= self.problem.limit:
            yield self._enough_for_all
            yield from self._perturbation_phases()
            yield "found"

    def _perturbation_phases(self) -> Iterator[str]:
        """Refine perturbed copies of the best answer until none is better."""
        for _ in range(self.budget.hops):
            before = self._least
            starts = self._gather(self.starts.perturbed, self.found, self.budget.hopped)
            if starts is None:
                return
            yield from self._race(starts, self.budget.hopped, self.budget.landed, self.budget.hop_rounds)
            yield "" if self._gained(before) else "no gain"

    def _gather(self, gather: Callable[..., CandidateBatch | None], *how: Any) -> CandidateBatch | None:
        """Return the starts that a function gathers; None if there are none."""
        with self.report.timed("starts"):
            starts = gather(*how)
        return starts if starts is not None and len(starts) else None

    def _race(self, starts: CandidateBatch | None, count: int, leaders: int, rounds: int) -> Iterator[str]:
        """Race at most `count` starts and refine the leaders; refine all where no race is run."""
        wanted = max(leaders, self.problem.limit)
        starts = self._without_exact(starts)
        if starts is None or not self._is_racing or len(starts) <= wanted:
            yield from self._take(starts, max(self.budget.kept, self.problem.limit))
            return
        rare = self._is_rare_family(starts)
        racing = starts[np.flatnonzero(~rare)]
        finalists = starts[np.flatnonzero(rare)]
        if len(racing):
            with self.report.timed("race"):
                finalists = join(finalists, self._leaders(self.starts.best(racing, count), wanted, rounds))
        yield from self._take(finalists, wanted // 2)

    def _leaders(self, starts: CandidateBatch, wanted: int, rounds: int) -> CandidateBatch:
        """Race starts with successive cuts; return the leaders, measured on their finite motion."""
        from ..refine.race import Race  # a brief search runs no race

        race = Race.of(self.problem, starts)
        for number in range(rounds):
            race.round()
            if number + 1 in [round(cut * rounds) for cut in CUTS.after]:
                race = race.leaders(max(int(CUTS.kept * len(race)), wanted))
        race = race.denser()
        race.take_rounds(self.budget.dense)
        self.report.raced += race.taken
        return race.leaders(wanted).finalists(starts)

    def _without_exact(self, starts: CandidateBatch | None) -> CandidateBatch | None:
        """Move exact guides from the starts to the answers, if deviation is ranked."""
        if starts is None or not self._by_deviation:
            return starts
        exact = (starts.traced.relative <= EXACT_DEVIATION) & feasibility(self.problem, starts).all
        done = starts[np.flatnonzero(exact)]
        self._add(done, cost(self.problem, done))
        return starts[np.flatnonzero(~exact)]

    def _is_rare_family(self, starts: CandidateBatch) -> Mask:
        """Mark starts of families with too few starts for a race, shape (n,)."""
        _, family, count = np.unique(starts.linkage.family, return_inverse=True, return_counts=True)
        return np.asarray((count <= self.budget.rare)[family])

    def _take(self, starts: CandidateBatch | None, kept: int) -> Iterator[str]:
        """Refine starts for two rounds and the best of them further, or accept them as stored."""
        if starts is None or not len(starts):
            return
        if not self.refines:
            met = feasibility(self.problem, starts).all
            self._add(starts, np.where(met, cost(self.problem, starts), np.inf))
            return
        self.refining = Refinement.of(self.problem, starts, hasty=self.effort == 1)
        for keep in (self.budget.tried, kept):
            yield from self._refined(self._followed_count)
            order = np.argsort(self.refining.merit, kind="stable")
            self._put_aside(self.refining[order[keep:]])
            self.refining = self.refining[order[:keep]]
            if self._one_suffices:
                break
        for _ in range(self.budget.farther):
            left = np.flatnonzero(self.refining.active)
            few = len(left) <= MIN_REFINED and np.argmin(self.refining.merit) not in left
            if few or self._one_suffices:
                break
            yield from self._refined()
        self._put_aside(self.refining)
        self.refining = None

    def _refined(self, *followed: int) -> Iterator[str]:
        """Yield the reason to stop, if there is one already; then run a round."""
        assert self.refining is not None
        yield ""
        before = self.refining.evaluated
        with self.report.timed("refine"):
            self.refining.step(*followed)
        self.report.refined += self.refining.evaluated - before

    def _lead_in(self) -> Iterator[str]:
        """Minimise the deviation under the other constraints until it is small enough, then refine.

        So a tolerance is met whenever a search for the least deviation would meet it.
        """
        how: dict[str, Any] = {"enough": UNREACHABLE_COUNT, "effort": self.effort, "budget": self.budget}
        problem = replace(by_deviation(self.problem), effort=max(self.problem.effort, 1))
        least = Search(problem, self.database, self.report, **how)
        yield from least._take(self._nearest_to_constraints(self.found), LEAD_IN.nearest)
        far_off = np.log(LEAD_IN.far_off * self.problem.deviation / problem.deviation)
        ends: list[float] = []
        while least.status == "searching" and not self._meeting_constraints(least.found):
            least.step()
            yield ""
            if least.broad > len(ends):
                ends.append(least.least)
                if len(ends) > 1 and not ends[-1] < max(ends[-2] - LEAD_IN.fall, far_off):
                    break
        found = self._meeting_constraints(least.found)
        nearest = self._nearest_to_constraints(least.found if found is None else found)
        yield from self._take(nearest, LEAD_IN.nearest)

    def _nearest_to_constraints(self, found: CandidateBatch | None) -> CandidateBatch | None:
        """Return the candidates nearest to the constraints that are unlike each other."""
        if found is None or not len(found):
            return None
        away, mirror = feasibility(self.problem, found).total, self.problem.curvature == 0
        return found[unlike(found.linkage.pivots, away, LEAD_IN.nearest, mirror=mirror)]

    def _meeting_constraints(self, found: CandidateBatch | None) -> CandidateBatch | None:
        """Return the feasible candidates, None if there are none."""
        if found is None or not len(found):
            return None
        met = np.flatnonzero(feasibility(self.problem, found).all)
        return found[met] if len(met) else None

    # -- what was found --------------------------------------------------------------------
    @property
    def so_far(self) -> CandidateBatch | None:
        """Return the candidates found, with those in refinement."""
        if self.refining is None:
            return self.found
        return self.refining.best if self.found is None else join(self.found, self.refining.best)

    @property
    def least(self) -> float:
        """Least cost so far; infinite before the first answer."""
        return min(self._least, np.inf if self.refining is None else float(self.refining.best_cost.min()))

    def _put_aside(self, refinement: Refinement[CandidateBatch]) -> None:
        """Add the best points of a refinement to the answers."""
        self._add(refinement.best, refinement.best_cost)

    def _add(self, candidates: CandidateBatch, costs: Floats) -> None:
        """Add candidates with their costs to the answers."""
        if len(candidates):
            self.found = candidates if self.found is None else join(self.found, candidates)
            self.cost = np.concatenate([self.cost, costs])

    @property
    def _by_deviation(self) -> bool:
        """Whether the deviation is ranked alone."""
        return self.problem.ranking.only == "deviation"

    @property
    def _is_racing(self) -> bool:
        """Whether starts race."""
        return self.refines and is_raced(self.problem)

    @property
    def _is_hard(self) -> bool:
        """Whether there are constraints, or a ranked measure whose least value is unknown."""
        return is_constrained(self.problem) or not (self._by_deviation or self.problem.ranking.only == "score")

    @property
    def _followed_count(self) -> int:
        """Number of trials of each candidate that are continued in the first rounds.

        It is larger for a ranked deviation, which falls by orders of magnitude in these rounds.
        """
        return len(RADIUS_FACTORS) if self._by_deviation else 1

    @property
    def _enough_already(self) -> str:
        """Reason to end the search after its short phase; else empty."""
        worth = int(self._acceptable.sum())
        if not self._is_hard:
            return "found" if worth >= self.enough else ""
        full = worth >= max(self.enough, self.problem.limit) and self._is_varied
        return "good enough" if full and self._is_within_gap else ""

    @property
    def _enough_for_all(self) -> str:
        """Reason to end the search after its broad phases; else empty."""
        ends = not self.problem.effort or not self._is_hard or self.enough == 1
        if ends or not self.refines or not self._has_feasible:
            return "found"
        return "good enough" if self._is_within_gap else ""

    @property
    def _has_feasible(self) -> bool:
        """Whether a feasible candidate was found."""
        return bool(np.isfinite(self.cost).any())

    @property
    def _may_be_short(self) -> bool:
        """Whether a few stored starts often suffice: without constraints, or for a score."""
        scored = self._is_racing and self.problem.ranking.only == "score"
        return self.refines and (scored or not is_constrained(self.problem))

    @property
    def _is_within_gap(self) -> bool:
        """Whether the best answer is near the bound of the cost.

        For a ranked deviation, whether it is exact.
        """
        if self.problem.effort > 1:
            return False
        exact = np.log(2 * EXACT_DEVIATION / self.problem.deviation)
        return self._least <= (exact if self._by_deviation else self.problem.ranking.good)

    @property
    def _acceptable(self) -> Array:
        """Mask of the feasible answers without faults."""
        if self.found is None:
            return np.zeros(0, bool)
        return np.asarray(np.isfinite(self.cost) & (faults(self.problem, self.found) == 0))

    @property
    def _is_varied(self) -> bool:
        """Whether the answers fill the list within the quota of each series."""
        most, series = self.problem.ranking.per_series, self.problem.constraints.series
        if self.found is None or not most:
            return True
        count = Counter(self.found.origin.series[self._acceptable])
        limit = self.problem.limit
        wanted = min(limit, most * len(series)) if series else limit
        return sum(min(each, most) for each in count.values()) >= wanted

    @property
    def _one_suffices(self) -> bool:
        """Whether one answer is requested and a feasible one is found."""
        return self.enough == 1 and bool(np.isfinite(self.least))

    @property
    def _least(self) -> float:
        """Least cost of the answers, infinite if there are none."""
        return float(np.min(self.cost, initial=np.inf))

    def _gained(self, before: float) -> bool:
        """Whether the least cost is below a former one by more than `MIN_GAIN`."""
        unit = abs(before) if self._by_deviation else max(abs(before), 1.0)
        return self._least < (before - MIN_GAIN * unit if np.isfinite(before) else before)
