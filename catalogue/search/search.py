"""The search: starts in stages, each refined a little; the promising ones farther, until enough is found or spent.

A state is an object with `step` and `status`, driven from outside.  Its stages: stored guides with the least estimated
cost and violation; if these do not give enough, starts made to measure and further stored ones, round after round,
with perturbed copies of the best points found (a population search with Deb's rules, feasible before infeasible).  What
a score is at best is known: where a few starts lead to answers of which the first is nearly as good, there are no more
stages.  Of the starts of a stage fewer are refined the farther it goes (successive halving, K. Jamieson and A.
Talwalkar, AISTATS 2016, 240-248).  The best of what was found are perturbed for as long as that pays (basin hopping,
D. J. Wales and J. P. K. Doye, J. Phys. Chem. A 101 (1997) 5111-5116).  Each further unit of effort is a search anew,
from other starts.  Where nothing meets the constraints, starts race into them (`catalogue.refine.race`).
"""

from __future__ import annotations

from collections import Counter
from dataclasses import InitVar, dataclass, field, replace

import numpy as np

from ..candidates.batch import CandidateBatch
from ..candidates.feasibility import cost, faults, feasibility
from ..kinematics.batch import join
from ..kinematics.types import Array, Floats
from ..problem.problem import Problem
from ..refine.sqp import RADIUS_FACTORS, Refinement
from ..store import Database
from .report import SearchReport
from .starts import BRIEF, LIKELY, Extent, Starts, is_constrained, is_narrow

#: How many answers are enough to look no farther, and stages at most.  Fewer would make the first answer worse where
#: fewer are shown.
AMPLE, STAGES = 6, 10
#: A search in which the least violation is above this, and in so many stages has not fallen to this part of what it
#: was, is given up.
FAR, WAITING, NEARER = 0.1, 1, 0.9

#: Optimality gap: a search by score, which costs 0 at best, ends when its best costs no more, unless more effort is
#: asked for.
GAP = 0.05

#: Successive halving: most rounds of refinement for those that are kept; so many that are left alone, none of them the
#: best, are not worth a round, which costs nearly as much as one of all of them.
MORE_ROUNDS, FEW = 6, 3
#: Restoring feasibility: candidates that break the constraints by less than this, all together, are refined once more,
#: at this price; where nothing has met them, so many, the nearest, and halfway to that no more than these go on.
NEAR, LEADING, LED = 0.1, 1e3, 24
#: Rounds of a race, more of them at twice as many stations, and how many of its leaders are refined.
RACED, DENSE, LEADERS = 15, 4, 14
#: Tolerance of a race to the least deviation [strokes].
LOOSEST = 0.01
#: How many of those that came nearest are refined once more where nothing met the constraints.
NEAREST = 8

#: Basin hopping: how often at most, how often in a row without a gain of such a part of the cost, or of 1 where it is
#: less and not a deviation, and how many of the perturbed copies are refined.
HOPS, HOPS_IN_VAIN, GAIN, HOPPED = 6, 2, 3e-3, 24


def by_deviation(problem: Problem) -> Problem:
    """Return the problem of the least deviation under all other constraints, within a tolerance that leaves it open; an
    allowance is one within the tolerance that was asked for."""
    ranking = replace(problem.ranking, weights={"deviation": 1.0}, front=())
    loosest = problem.deviation if problem.constraints.min_allowance else max(problem.deviation, LOOSEST)
    return replace(problem, ranking=ranking, path=replace(problem.path, deviation=loosest))


@dataclass
class Search:
    """A search for a problem, and what it found: of all that were refined the cheapest that met the constraints, or the
    nearest to that."""

    problem: Problem
    database: Database
    report: SearchReport = field(default_factory=SearchReport)
    refines: bool = True  #: whether starts are refined; else they are given as they are stored
    enough: int = AMPLE  #: how many answers end the search
    given: InitVar[CandidateBatch | None] = None  #: starts from elsewhere
    effort: int = 1  #: which search for the problem this is, from 1
    stage: int = 0
    found: CandidateBatch | None = None
    cost: Floats = field(default_factory=lambda: np.zeros(0))  #: of the found ones; infinite outside the constraints
    status: str = "searching"  #: then ``found`` or ``exhausted``

    def __post_init__(self, given: CandidateBatch | None) -> None:
        self.extent = Extent.of(self.problem)
        self.starts = Starts(self.problem, self.database, self.report, self.extent, self.effort, self.refines, given)
        self._begun = self.stage, self.report.refined
        self._nearest: list[float] = []  # least violation of each stage

    def run(self) -> Search:
        """Search until enough is found or the budget is spent."""
        if self.stage == 0 and is_constrained(self.problem) and self._has_bound:
            self._try_few()
        while self.status == "searching":
            self.step()
        if self.status == "found" and is_constrained(self.problem) and not self._in_gap:  # else there is little to gain
            self._hop_basins()
        return self

    def again(self) -> Search:
        """Return a search for the same from other starts, made to measure ones among the first."""
        another = Search(self.problem, self.database, self.report, self.refines, self.enough, effort=self.effort + 1,
                         stage=2)  # fmt: skip
        another.starts.taken = self.starts.taken
        return another

    def step(self) -> None:
        """Refine the starts of one more stage, or of some together, as rounds of many cost little more than of few."""
        together = 2 if self.stage or is_narrow(self.problem) else 1
        with self.report.timed("starts"):
            starts = self.starts.gathered(self.stage, together, self.found)
        self.stage += together
        if starts is not None:
            first = self.stage == together
            self._refine(starts, self._halves(together, self.extent.kept[together - 1 if first else 2]))
        if starts is None or self._should_stop:
            if not self._feasible and self.refines:
                self._race()
            if not self._feasible and self.refines:
                self._refine_nearest()
            self.status = "found" if self._feasible else "exhausted"

    def answers_near(self, candidate: CandidateBatch) -> CandidateBatch | None:
        """Return answers that are found from those few of the first stored starts which are most like a candidate, or
        most promising; None if there are none."""
        starts = self.starts.likely(candidate)
        if starts is not None:
            self._refine(starts, (len(starts), LIKELY))
        return self.found[np.flatnonzero(np.isfinite(self.cost))] if self.found is not None and self._feasible else None

    def _try_few(self) -> None:
        """Refine a few starts, and be content with what comes of them if that is a list of answers of as many series as
        are asked for, with a first one than which none can be much better."""
        with self.report.timed("starts"):
            starts = self.starts.few()
        if starts is None:
            return
        wanted = max(self.enough, self.problem.limit)
        with self.report.timed("refine"):
            refinement = Refinement.of(self.problem, starts, hasty=True)
            refinement.step(1)
            self.report.refined += refinement.evaluated
            if np.isfinite(refinement.best_cost).sum() < wanted:
                return
            best = np.argsort(refinement.merit, kind="stable")[: max(BRIEF.tried, wanted)]
            self._add(*self._halve_successively(refinement[best], (max(BRIEF.kept[0], wanted),)))
        if self._worth_something.sum() >= wanted and self._in_gap and self._is_varied:
            self.status = "found"

    @property
    def _has_bound(self) -> bool:
        """Whether it is known how good an answer can be at best."""
        return self.refines and self.problem.ranking.only == "score"

    @property
    def _in_gap(self) -> bool:
        """Whether no answer can be much better than the best that was found, and none needs to be."""
        return self._has_bound and self.problem.effort == 1 and self._least <= GAP

    @property
    def _should_stop(self) -> bool:
        """Whether enough was found, or too little to go on."""
        first, refined = self._begun
        stages, points = self.stage - first, self.report.refined - refined
        least = 1 if self.enough == 1 else self._least_stages
        most = self.extent.points if self._feasible else self.extent.in_vain
        ample = self._worth_something.sum() >= self.enough and (stages >= least or self._in_gap)
        return ample or (stages > 1 and points > most) or stages >= STAGES or self._stagnates

    @property
    def _least_stages(self) -> int:
        """How many stages there are in any case: where few designs are left, the next one differs; where a crank is to
        turn fully, what is best differs from search to search by several times as much as elsewhere."""
        return 3 if self.problem.constraints.full_rotation else 1 + is_narrow(self.problem)

    @property
    def _feasible(self) -> bool:
        """Whether anything was found that meets the constraints."""
        return bool(np.isfinite(self.cost).any())

    @property
    def _worth_something(self) -> Array:
        """Which of those found meet the constraints and have no faults."""
        if self.found is None:
            return np.zeros(0, bool)
        return np.asarray(np.isfinite(self.cost) & (faults(self.problem, self.found) == 0))

    @property
    def _is_varied(self) -> bool:
        """Whether what was found fills the list with no more of a series than are asked for."""
        most, series = self.problem.ranking.per_series, self.problem.constraints.series
        if self.found is None or not most:
            return True
        count = Counter(self.found.origin.series[self._worth_something])
        wanted = min(self.problem.limit, most * len(series)) if series else self.problem.limit
        return sum(min(each, most) for each in count.values()) >= wanted

    @property
    def _stagnates(self) -> bool:
        """Whether all are far from the constraints, and the last stages came no nearer."""
        least = np.minimum.accumulate(self._nearest)
        return len(least) > WAITING and least[-1] > FAR and least[-1] > NEARER * least[-1 - WAITING]

    def _add(self, candidates: CandidateBatch, costs: Floats) -> None:
        """Add candidates to what was found."""
        self.found = candidates if self.found is None else join(self.found, candidates)
        self.cost = np.concatenate([self.cost, costs])

    def _halves(self, together: int, kept: int) -> tuple[int, int]:
        """Return how many of the starts of so many stages are refined for a second round, and how many farther."""
        tried = self.extent.tried
        return together * tried, max(kept, min(self.problem.limit, tried))

    def _refine(self, starts: CandidateBatch, halves: tuple[int, int]) -> None:
        """Refine all starts for a round, as many of the best as are told for a second one and farther."""
        if not self.refines:
            met = feasibility(self.problem, starts).all
            self._add(starts, np.where(met, cost(self.problem, starts), np.inf))
            return
        with self.report.timed("refine"):
            refinement = Refinement.of(self.problem, starts, hasty=self.effort == 1)
            refined, costs = self._halve_successively(refinement, halves)
        self._add(refined, costs)
        violation = feasibility(self.problem, refined).total
        self._nearest.append(float(np.fmin.reduce(violation, initial=np.inf)))

    def _halve_successively(self, refinement: Refinement, halves: tuple[int, ...]) -> tuple[CandidateBatch, Floats]:
        """Return what comes of candidates, fewer of which are refined the farther it goes, and what they cost."""
        parts: list[tuple[CandidateBatch, Floats]] = []
        # one is enough to tell the best from the rest, but of deviations, which fall by orders of magnitude at first
        followed = len(RADIUS_FACTORS) if self.problem.ranking.only == "deviation" else 1
        for keep in halves:
            refinement.step(followed)
            order = np.argsort(refinement.merit, kind="stable")
            rest = refinement[order[keep:]]
            parts.append((rest.best, rest.best_cost))
            self.report.refined += refinement.evaluated
            refinement = refinement[order[:keep]]
            if self._one_suffices(refinement):
                break
        self._refine_farther(refinement)
        parts.append((refinement.best, refinement.best_cost))
        met = np.isfinite(refinement.best_cost)
        near = np.flatnonzero(~met & (refinement.nearest < NEAR))
        if not met.any():
            near = near[np.argsort(refinement.nearest[near], kind="stable")[:LED]]
        if len(near) and met.sum() < self.enough:
            parts.append(self._restore_feasibility(refinement.best[near], refinement.hasty))
        return join(*(candidates for candidates, _ in parts)), np.concatenate([costs for _, costs in parts])

    def _refine_farther(self, refinement: Refinement) -> None:
        """Take more rounds, as long as more than a few are on their way, or the best is."""
        for taken in range(MORE_ROUNDS):
            if 2 * taken == MORE_ROUNDS and not np.isfinite(refinement.best_cost).any():
                refinement.active[np.argsort(refinement.nearest, kind="stable")[LED:]] = False
            left = np.flatnonzero(refinement.active)
            few = len(left) <= FEW and np.argmin(refinement.merit) not in left
            if few or self._one_suffices(refinement):
                break
            refinement.step()
        self.report.refined += refinement.evaluated

    def _one_suffices(self, refinement: Refinement) -> bool:
        """Whether no more than one answer is wanted, and it is there."""
        return self.enough == 1 and bool(np.isfinite(refinement.best_cost).any())

    def _restore_feasibility(self, near: CandidateBatch, hasty: bool) -> tuple[CandidateBatch, Floats]:
        """Return what comes of candidates hardly outside the constraints that are led in, whatever they cost, and then
        refined; and what it costs."""
        inward = replace(self.problem, relaxed="ranking")
        restored = Refinement.of(inward, near, penalty=LEADING)
        for _ in range(MORE_ROUNDS):
            if self._one_suffices(restored) or not restored.step():
                break
        refinement = Refinement.of(self.problem, restored.best, hasty=hasty)
        refinement.active &= np.isfinite(restored.best_cost)
        if not self._one_suffices(refinement):
            refinement.run(MORE_ROUNDS)
        self.report.refined += restored.evaluated + refinement.evaluated
        return refinement.best, refinement.best_cost

    def _race(self) -> None:
        """Have starts of all kinds race into the constraints, which nothing has met, and refine the leaders; where that
        is in vain too, race them to the least deviation under all others, the same within any tolerance."""
        from ..refine.race import is_raced  # few searches get here

        if not is_raced(self.problem):
            return
        with self.report.timed("starts"):
            starts = self.starts.every(self.found)
        if starts is None:
            return
        before = self.found, self.cost
        self._refine_leaders(starts, self.problem)
        if not self._feasible:
            self._refine_leaders(starts, by_deviation(self.problem))
        if not self._feasible:  # what is nearest, which advice starts from, is nearer without
            self.found, self.cost = before

    def _refine_leaders(self, starts: CandidateBatch, problem: Problem) -> None:
        """Refine the leaders of a race for a problem until they are within the constraints, and then for this one."""
        from ..refine.race import Race

        with self.report.timed("race"):
            race = Race.of(problem, starts)
            race.take_rounds(RACED)
            race = race.leaders(2 * LEADERS).denser()
            race.take_rounds(DENSE)
            self.report.raced += race.taken
            leaders = race.leaders(LEADERS).finalists(starts)
        if problem is not self.problem and len(leaders):
            with self.report.timed("refine"):
                refinement = Refinement.of(problem, leaders)
                for _ in range(MORE_ROUNDS):
                    if feasibility(self.problem, refinement.best).all.any() or not refinement.step():
                        break
                self.report.refined += refinement.evaluated
                leaders = refinement.best
        if len(leaders):
            self._refine(leaders, (LEADERS, LEADERS))

    def _refine_nearest(self) -> None:
        """Refine those that came nearest to the constraints once more."""
        if (found := self.found) is None:
            return
        violation = feasibility(self.problem, found).total
        nearest = np.argsort(violation, kind="stable")[:NEAREST]
        nearest = nearest[violation[nearest] < FAR]
        if not len(nearest):
            return
        with self.report.timed("refine"):
            refinement = Refinement.of(self.problem, found[nearest]).run(MORE_ROUNDS)
        self.report.refined += refinement.evaluated
        self._add(refinement.best, refinement.best_cost)

    def _hop_basins(self) -> None:
        """Refine perturbed copies of the best until that is in vain."""
        in_vain = 0
        for _ in range(HOPS):
            with self.report.timed("starts"):
                copies = self.starts.perturbed(self.found)
                starts = None if copies is None else self.starts.promising(copies, HOPPED)
            if starts is None or not len(starts):
                return
            before = self._least
            self._refine(starts, self._halves(1, self.extent.kept[2]))
            in_vain = 0 if self._gained(before) else in_vain + 1
            if in_vain == HOPS_IN_VAIN:
                return

    @property
    def _least(self) -> float:
        """The least cost of what was found, infinite before."""
        return float(np.min(self.cost, initial=np.inf))

    def _gained(self, before: float) -> bool:
        """Whether the least cost has fallen since it was as given."""
        unit = abs(before) if self.problem.ranking.only == "deviation" else max(abs(before), 1.0)
        return self._least < (before - GAIN * unit if np.isfinite(before) else before)
