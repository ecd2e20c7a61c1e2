"""The search: starts in stages, each refined a little; the promising ones farther, until enough is found or spent.

A state is an object with `step` and `status`, driven from outside.  Its stages: stored guides with the least estimated
cost and violation; if these do not give enough, starts made to measure and further stored ones, round after round,
with perturbed copies of the best points found (a population search with Deb's rules, feasible before infeasible).  The
best of what was found are perturbed for as long as that pays (basin hopping, D. J. Wales and J. P. K. Doye, J. Phys.
Chem. A 101 (1997) 5111-5116).  Each further unit of effort is a search anew, from other starts.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ..candidates.batch import CandidateBatch, measured
from ..candidates.feasibility import STANDING, cost, faults, feasibility
from ..candidates.select import distances, normal_form
from ..kinematics.batch import join, take
from ..kinematics.linkage import Linkage
from ..kinematics.types import Floats, Indices
from ..problem.problem import Problem
from ..refine.sqp import RADIUS_FACTORS, Refinement
from ..store import Database
from . import euler_savary, exact_guides, retrieve, rotating_crank
from .draws import allowed
from .report import SearchReport

#: Most rounds of refinement for those that are kept; so many that are left alone, none of them the best, are not worth
#: a round, which costs nearly as much as one of all of them.
MORE_ROUNDS, FEW = 6, 3
#: Candidates that break the constraints by less than this, all together, are refined once more, at
#: this price.
NEAR, LEADING = 0.1, 1e3
#: A search in which the least violation is above this, and in so many stages has not fallen to this part of what it
#: was, is given up.
FAR, WAITING, NEARER = 0.1, 1, 0.9
#: How often stored guides are read at most while builds replace them.
READS = 5
#: Price of what is broken when starts are compared.
PENALTY = 4.0
#: Exact guides drawn in the first stage.
EXACT_GUIDES = 200
#: Stages at most, and how many answers are enough to look no farther.  Fewer would make the first answer worse where
#: fewer are shown.
STAGES, AMPLE = 10, 6
#: How many starts are most like a candidate, and most promising, where an answer is likely to be near it.
LIKELY = 12
#: Constraints that choose among sorts of guides.
SORTS = ("families", "series", "configurations", "pins_only", "order", "slots", "returns")
#: How many of the best points are perturbed, how often each, and by what, as powers of ten of the stroke; how many of
#: these are refined in the end.
BEST, COPIES, BY, HOPPED = 8, 12, (-2.0, -0.5), 24
#: How often that is done at most, and how often in a row without a gain of such a part of the cost.
HOPS, HOPS_IN_VAIN, GAIN = 6, 2, 3e-3


@dataclass(frozen=True)
class Extent:
    """How far a search goes."""

    measured: int  #: stored starts that are measured in a stage
    drawn: int  #: linkages drawn to measure in a stage, of each kind
    tried: int  #: starts of each kind that are refined for a round, and of all kinds for another
    kept: tuple[int, int, int]  #: those refined farther, of the first stage, of the first two together, of later ones
    #: points that may be measured in refinement where nothing was found, and where less than enough: a bound in time
    #: would make answers depend on the machine
    in_vain: int
    points: int


#: Where sorts of guides are asked for, and where there are other constraints: these leave many best places that are no
#: better than their neighbours, so that it is the number of starts that finds the best of them.
FREE, CONSTRAINED = Extent(60, 600, 24, (12, 32, 16), 700, 2000), Extent(200, 2500, 90, (30, 60, 30), 2000, 6000)


@dataclass
class Search:
    """A search for a problem, and what it found: of all that were refined the cheapest that met the constraints, or the
    nearest to that."""

    problem: Problem
    database: Database
    report: SearchReport = field(default_factory=SearchReport)
    found: CandidateBatch | None = None
    cost: Floats = field(default_factory=lambda: np.zeros(0))  #: of the found ones; infinite outside the constraints
    status: str = "searching"  #: then ``found`` or ``exhausted``
    effort: int = 1  #: which search for the problem this is, from 1
    stage: int = 0
    refines: bool = True  #: whether starts are refined; else they are given as they are stored
    enough: int = AMPLE  #: how many answers end the search
    near: CandidateBatch | None = None  #: where an answer is likely: starts like it are refined, and few others
    given: CandidateBatch | None = None  #: starts from elsewhere
    taken: Indices = field(default_factory=lambda: np.zeros(0, int))  #: stored guides that were starts

    def __post_init__(self) -> None:
        self._random = np.random.default_rng(19 + self.effort)
        self._reaches: retrieve.Reaches | None = None
        self._begun = self.stage, self.report.refined
        self._nearest: list[float] = []  # least violation of each stage

    def run(self) -> Search:
        """Search until enough is found or the budget is spent."""
        while self.status == "searching":
            self.step()
        if self.status == "found" and self._constrained:  # else what is found leaves little to gain
            self._hop()
        return self

    def again(self) -> Search:
        """Return a search for the same from other starts, made to measure ones among the first."""
        return Search(self.problem, self.database, self.report, effort=self.effort + 1, stage=2, refines=self.refines,
                      enough=self.enough, taken=self.taken)  # fmt: skip

    def _hop(self) -> None:
        """Refine perturbed copies of the best until that is in vain."""
        in_vain = 0
        for _ in range(HOPS):
            with self.report.timed("starts"):
                copies = self._perturbed()
                starts = None if copies is None else self._promising(copies, HOPPED)
            if starts is None or not len(starts):
                return
            before = self._least
            self._refine(starts, 1)
            in_vain = 0 if self._gained(before) else in_vain + 1
            if in_vain == HOPS_IN_VAIN:
                return

    def step(self) -> None:
        """Refine the starts of one more stage, or of some together, as rounds of many cost little more than of few."""
        together = 2 if self.stage or self._narrow or self.near is not None else 1
        with self.report.timed("starts"):
            starts = self._gathered(together)
        if starts is not None:
            self._refine(starts, together)
        if starts is None or self._over:
            if not self._feasible and self.refines and self.found is not None:
                self._insist(self.found)
            self.status = "found" if self._feasible else "exhausted"

    @property
    def _over(self) -> bool:
        """Whether enough was found, or too little to go on."""
        first, refined = self._begun
        stages, points = self.stage - first, self.report.refined - refined
        least = 1 if self.enough == 1 else 1 + self._narrow  # few designs are left: the next stage differs
        most = self._extent.points if self._feasible else self._extent.in_vain
        ample = self._sound >= self.enough and stages >= least
        return ample or (stages > 1 and points > most) or stages >= STAGES or self._hopeless

    @property
    def _feasible(self) -> bool:
        """Whether anything was found that meets the constraints."""
        return bool(np.isfinite(self.cost).any())

    def _insist(self, found: CandidateBatch) -> None:
        """Refine those that came nearest to the constraints once more."""
        violation = feasibility(self.problem, found).total
        nearest = np.argsort(violation, kind="stable")[:BEST]
        nearest = nearest[violation[nearest] < FAR]
        if not len(nearest):
            return
        with self.report.timed("refine"):
            farther = Refinement.of(self.problem, found[nearest]).run(MORE_ROUNDS)
        self.report.refined += farther.evaluated
        self.found = join(found, farther.best)
        self.cost = np.concatenate([self.cost, farther.best_cost])

    @property
    def _sound(self) -> int:
        """How many were found that meet the constraints and are worth something."""
        if self.found is None:
            return 0
        return int((np.isfinite(self.cost) & (faults(self.problem, self.found) == 0)).sum())

    @property
    def _least(self) -> float:
        """The least cost of what was found, infinite before."""
        return float(np.min(self.cost, initial=np.inf))

    def _gained(self, before: float) -> bool:
        """Whether the least cost has fallen since it was as given."""
        return self._least < (before - GAIN * abs(before) if np.isfinite(before) else before)

    @property
    def _hopeless(self) -> bool:
        """Whether all are far from the constraints, and the last stages came no nearer."""
        least = np.minimum.accumulate(self._nearest)
        return len(least) > WAITING and least[-1] > FAR and least[-1] > NEARER * least[-1 - WAITING]

    @property
    def _constrained(self) -> bool:
        """Whether more is asked for than sorts of guides."""
        return any(name not in SORTS for name in self.problem.constraints.active())

    @cached_property
    def _extent(self) -> Extent:
        extent = CONSTRAINED if self._constrained else FREE
        return extent if self.near is None else replace(extent, kept=(LIKELY, LIKELY, LIKELY))

    @property
    def _exact(self) -> bool:
        """Whether exact guides are wanted, be they trivial: of arcs of a given radius, or for the least deviation."""
        return self.problem.fixed_curvature is not None or self.problem.ranking.only == "deviation"

    @property
    def _narrow(self) -> bool:
        """Whether few designs are left: pivots are to stand in a region, or a crank is to turn fully."""
        wanted = self.problem.constraints
        return bool(wanted.full_rotation) or any(getattr(wanted, name) is not None for name in STANDING)

    @cached_property
    def _made(self) -> list[str]:
        """Families of which starts are made to measure."""
        return allowed(self.problem, euler_savary.PINNED)

    def _gathered(self, stages: int) -> CandidateBatch | None:
        """Return the starts of so many stages."""
        parts = []
        for _ in range(stages):
            parts.append(self._starts())
            self.stage += 1
        parts = [part for part in parts if part is not None and len(part)]
        starts = join(*parts) if parts else None
        return starts if starts is None or self.near is None else starts[self._likely(starts, self.near)]

    def _starts(self) -> CandidateBatch | None:
        """Return measured starts of the present stage, the most promising first."""
        problem, extent = self.problem, self._extent
        parts = [self._stored(extent.measured // (1 + self.stage % 2))]
        if self.stage or self._narrow or problem.fixed_curvature is not None:
            parts += [euler_savary.starts(problem, name, extent.drawn, self._random) for name in self._made]
        if self.stage == 0 and self._exact:
            parts.append(exact_guides.starts(problem, EXACT_GUIDES, self._random))
        if problem.constraints.full_rotation and "four-bar" in self._made:
            parts.append(rotating_crank.starts(problem, extent.drawn, self._random))
        if self.stage >= 2:
            parts.append(self._perturbed())
        kept = [self._promising(part, extent.tried) for part in parts if part is not None and len(part)]
        if self.stage == 0 and self.given is not None and len(self.given):
            kept.append(self.given)
        return join(*kept) if kept else None

    def _stored(self, count: int, reads: int = READS) -> CandidateBatch | None:
        """Return stored starts; where a build replaces them meanwhile, those that it made."""
        try:
            return self._shortlisted(count)
        except retrieve.ChangedError:
            if reads == 1:
                raise
            self._reaches = None
            return self._stored(count, reads - 1)

    def _shortlisted(self, count: int) -> CandidateBatch | None:
        if self._reaches is None:
            self._reaches = retrieve.stored_reaches(self.problem, self.database, self.effort)
            merit, self._stretch = retrieve.estimate(self.problem, self._reaches)
            self._merit = np.where(retrieve.eligible(self.problem, self._reaches), merit, np.inf)
            self.report.eligible = int(np.isfinite(self._merit).sum())
        chosen = retrieve.shortlist(self._reaches, self._merit, count, self.taken)
        if not len(chosen):
            return None
        found = retrieve.candidates_of(self.problem, self.database, self._reaches, chosen, self._stretch[chosen])
        self.taken = np.concatenate([self.taken, self._reaches.guide[chosen]])
        return found

    def _perturbed(self) -> CandidateBatch | None:
        """Return copies of the best points found, moved at random; None of points that return, which they then do no
        more, and where guides are given as they are stored."""
        if self.found is None or not self.refines or self.problem.constraints.returns:
            return None
        merit = self._merits(self.found)
        best = np.argsort(merit)[:BEST]
        best = best[np.isfinite(merit[best])]
        if not len(best):
            return None
        each = np.repeat(best, COPIES)
        some = self.found[each]
        scale = 10 ** self._random.uniform(*BY, len(each))
        pivots = some.linkage.pivots.copy()
        pivots[..., :2] += scale[:, None, None, None] * self._random.normal(size=(len(each), 2, 2, 2))
        linkage, good = Linkage.valid(pivots)
        bend = some.traced.fit.curvature[good]
        return measured(
            self.problem, take(some.origin, good), linkage, some.point[good], some.pole[good], -np.abs(bend)
        )

    def _merits(self, found: CandidateBatch) -> Floats:
        """Return what candidates cost and break together, shape (n,)."""
        broken = feasibility(self.problem, found)
        with np.errstate(invalid="ignore"):
            merit = cost(self.problem, found) + PENALTY * broken.total
        return np.where(np.isnan(merit) | (not self.refines and ~broken.all), np.inf, merit)

    def _promising(self, found: CandidateBatch, count: int) -> CandidateBatch:
        """Return the best by cost and violation that are unlike each other."""
        merit = self._merits(found)
        self.report.measured += len(found)
        order = np.argsort(merit, kind="stable")
        order = order[np.isfinite(merit[order])][: 4 * count]
        designs = normal_form(found.linkage.pivots[order], 1.0)
        kept: list[int] = []
        like = np.zeros(len(order), bool)
        for i in range(len(order)):
            if not like[i] and len(kept) < count:
                kept.append(i)
                like |= distances(designs[i : i + 1], designs, mirror=self.problem.curvature == 0)[0] < 0.03
        return found[order[kept]]

    def _likely(self, starts: CandidateBatch, near: CandidateBatch) -> Indices:
        """Return the starts that are most like one candidate, and the most promising."""
        given, designs = (normal_form(some.linkage.pivots, 1.0) for some in (near, starts))
        away = distances(given, designs, mirror=self.problem.curvature == 0)[0]
        return np.unique([np.argsort(by, kind="stable")[:LIKELY] for by in (away, self._merits(starts))])

    def _refine(self, starts: CandidateBatch, together: int) -> None:
        """Refine all starts of so many stages for some rounds, the best of them farther."""
        if not self.refines:
            broken = feasibility(self.problem, starts)
            first_cost = np.where(broken.all, cost(self.problem, starts), np.inf)
            self.found = starts if self.found is None else join(self.found, starts)
            self.cost = np.concatenate([self.cost, first_cost])
            return
        with self.report.timed("refine"):
            found, value = self._halved(Refinement.of(self.problem, starts, hasty=self.effort == 1), together)
        self.found = found if self.found is None else join(self.found, found)
        self.cost = np.concatenate([self.cost, value])
        violation = feasibility(self.problem, found).total
        self._nearest.append(float(np.fmin.reduce(violation, initial=np.inf)))

    def _halved(self, refinement: Refinement, together: int) -> tuple[CandidateBatch, Floats]:
        """Return what comes of candidates, fewer of which are refined the farther it goes, and what they cost."""
        parts: list[tuple[CandidateBatch, Floats]] = []
        # one is enough to tell the best from the rest, but of deviations, which fall by orders of magnitude at first
        followed = len(RADIUS_FACTORS) if self.problem.ranking.only == "deviation" else 1
        extent = self._extent
        kept = extent.kept[2 if self.stage > together else together - 1]
        for keep in (together * extent.tried, max(kept, min(self.problem.limit, extent.tried))):
            refinement.step(followed)
            order = np.argsort(refinement.merit, kind="stable")
            rest = refinement[order[keep:]]
            parts.append((rest.best, rest.best_cost))
            self.report.refined += refinement.evaluated
            refinement = refinement[order[:keep]]
            if self._one_suffices(refinement):
                break
        for _ in range(MORE_ROUNDS):
            left = np.flatnonzero(refinement.active)
            few = len(left) <= FEW and np.argmin(refinement.merit) not in left
            if few or self._one_suffices(refinement):
                break
            refinement.step()
        self.report.refined += refinement.evaluated
        parts.append((refinement.best, refinement.best_cost))
        near = np.flatnonzero(~np.isfinite(refinement.best_cost) & (refinement.nearest < NEAR))
        if len(near) and np.isfinite(refinement.best_cost).sum() < self.enough:
            parts.append(self._led_in(refinement.best[near], refinement.hasty))
        return join(*(found for found, _ in parts)), np.concatenate([value for _, value in parts])

    def _one_suffices(self, refinement: Refinement) -> bool:
        """Whether no more than one answer is wanted, and it is there."""
        return self.enough == 1 and bool(np.isfinite(refinement.best_cost).any())

    def _led_in(self, near: CandidateBatch, hasty: bool) -> tuple[CandidateBatch, Floats]:
        """Return what comes of candidates hardly outside the constraints that are led in, whatever they cost, and then
        refined; and what it costs."""
        inward = replace(self.problem, relaxed="ranking")
        led = Refinement.of(inward, near, penalty=LEADING).run(MORE_ROUNDS)
        back = Refinement.of(self.problem, led.best, hasty=hasty)
        back.active &= np.isfinite(led.best_cost)
        back.run(MORE_ROUNDS)
        self.report.refined += led.evaluated + back.evaluated
        return back.best, back.best_cost
