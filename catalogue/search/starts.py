"""The starts of a stage: stored guides with the least estimated cost and violation, linkages made to measure, and
perturbed copies of the best that was found; of each kind the most promising that are unlike each other, as many as the
extent of a search allows."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ..candidates.batch import CandidateBatch, measured
from ..candidates.feasibility import PIVOT_REGIONS, cost, feasibility
from ..candidates.select import distances, normal_form, unlike
from ..kinematics.batch import join, take
from ..kinematics.linkage import Linkage
from ..kinematics.types import Floats, Indices
from ..problem.problem import Problem
from ..store import Database
from . import euler_savary, exact_guides, retrieve, rotating_crank, turning_cranks
from .draws import allowed
from .report import SearchReport

#: Exact guides drawn in the first stage.
EXACT_GUIDES = 200
#: Of how many linkages drawn for other paths one is drawn for an arc beyond a half circle: it costs as much more.
CIRCLING = 8
#: How often stored guides are read at most while builds replace them.
READS = 5
#: How many of the best points are perturbed, how often each, and by what, as powers of ten of the stroke.
BEST, COPIES, BY = 8, 12, (-2.0, -0.5)
#: Price of what is broken when starts are compared.
PENALTY = 4.0
#: How many starts of each kind race.
RACED = 60
#: How many starts are most like a candidate, and most promising, where an answer is likely to be near it.
LIKELY = 4
#: Constraints that choose among sorts of guides.
SORTS = ("families", "series", "configurations", "pins_only", "order", "slots", "returns")


def is_constrained(problem: Problem) -> bool:
    """Return whether more is asked for than sorts of guides."""
    return any(name not in SORTS for name in problem.constraints.active())


def is_narrow(problem: Problem) -> bool:
    """Return whether few designs are left: pivots are to stand in a region, a crank is to turn fully, or the coupler
    hardly at all."""
    wanted = problem.constraints
    limited = any(getattr(wanted, name) is not None for name in ("max_rotation", *PIVOT_REGIONS))
    return bool(wanted.full_rotation) or limited


@dataclass(frozen=True)
class Extent:
    """How far a search goes."""

    measured: int  #: stored starts of a stage that are measured
    drawn: int  #: linkages drawn to measure for a stage, of each kind
    tried: int  #: starts of each kind that are refined for a round, and of all kinds for another
    kept: tuple[int, int, int]  #: starts refined farther, of the first stage, of the first two together, of later ones
    #: points that may be measured in refinement where nothing was found, and where less than enough: a bound in time
    #: would make answers depend on the machine
    in_vain: int
    points: int

    @classmethod
    def of(cls, problem: Problem) -> Extent:
        """Return the extent of a search for a problem."""
        if not is_constrained(problem):
            return FREE
        return SCORED if problem.ranking.only == "score" else CONSTRAINED


#: Where sorts of guides are asked for; where there are other constraints, which leave many best places that are no
#: better than their neighbours, so that it is the number of starts that finds the best of them; and where those are
#: ranked by score, of which the best places have nearly the same, so that a brief search may be enough.
FREE = Extent(60, 600, 24, (12, 32, 16), 700, 2000)
CONSTRAINED = Extent(200, 2500, 90, (30, 60, 30), 2000, 6000)
SCORED = Extent(200, 1200, 40, (24, 40, 24), 2000, 6000)
BRIEF = replace(FREE, tried=30, kept=(15, 32, 16))


@dataclass
class Starts:
    """Where the starts of a search come from, stage by stage; no stored guide is one twice."""

    problem: Problem
    database: Database
    report: SearchReport
    extent: Extent  #: how many starts a stage has
    effort: int = 1  #: which search for the problem this is, from 1: the seed of what is drawn
    refines: bool = True  #: whether starts are refined; else they must meet the constraints
    given: CandidateBatch | None = None  #: starts from elsewhere
    taken: Indices = field(default_factory=lambda: np.zeros(0, int))  #: stored guides that were starts

    def __post_init__(self) -> None:
        self._random = np.random.default_rng(19 + self.effort)

    def gathered(self, first: int, stages: int, found: CandidateBatch | None) -> CandidateBatch | None:
        """Return the starts of so many stages from the `first` on, None if there are none; `found` is what was found
        before."""
        parts = [self._of_stage(stage, found) for stage in range(first, first + stages)]
        parts = [part for part in parts if part is not None and len(part)]
        return join(*parts) if parts else None

    def few(self) -> CandidateBatch | None:
        """Return the starts of the first stage of a brief search; they remain starts of later stages."""
        return replace(self, extent=BRIEF).gathered(0, 1, None)

    def every(self, found: CandidateBatch | None) -> CandidateBatch | None:
        """Return the starts that promise most of all that can be made, and those nearest to the constraints so far;
        None if there are none."""
        made = [euler_savary.starts(self.problem, name, self.extent.drawn, self._random) for name in self._families]
        parts = [self.promising(part, RACED) for part in (*made, self._stored(0), found) if part is not None]
        parts = [part for part in parts if len(part)]
        return join(*parts) if parts else None

    def likely(self, near: CandidateBatch) -> CandidateBatch | None:
        """Return those stored starts of the first two stages that are most like one candidate, and the most promising;
        None if there are none."""
        known = self._circling() if self.problem.is_wide else map(self._stored, (0, 1))
        parts = [self.promising(part, self.extent.tried) for part in known if part is not None]
        parts = [part for part in parts if len(part)]
        if not parts:
            return None
        starts = join(*parts)
        one, designs = (normal_form(batch.linkage.pivots, 1.0) for batch in (near, starts))
        away = distances(one, designs, mirror=self.problem.curvature == 0)[0]
        return starts[np.unique([np.argsort(by, kind="stable")[:LIKELY] for by in (away, self._merits(starts))])]

    def _of_stage(self, stage: int, found: CandidateBatch | None) -> CandidateBatch | None:
        """Return measured starts of a stage, of each kind the most promising first."""
        problem, extent = self.problem, self.extent
        parts = self._circling() if problem.is_wide else [self._stored(stage)]
        local = stage or (is_narrow(problem) and extent is not BRIEF) or problem.fixed_curvature is not None
        if local and not problem.is_wide:
            parts += [euler_savary.starts(problem, name, extent.drawn, self._random) for name in self._families]
        if stage == 0 and self._exact and not problem.is_wide:  # a parallelogram passes its dead points there
            parts.append(exact_guides.starts(problem, EXACT_GUIDES, self._random))
        if problem.constraints.full_rotation and "four-bar" in self._families:
            parts.append(rotating_crank.starts(problem, extent.drawn, self._random))
        if stage >= 2:
            parts.append(self.perturbed(found))
        kept = [self.promising(part, extent.tried) for part in parts if part is not None and len(part)]
        if stage == 0 and self.given is not None and len(self.given):
            kept.append(self.given)
        return join(*kept) if kept else None

    def _circling(self) -> list[CandidateBatch | None]:
        """Return starts for an arc near a half circle or beyond, of each family."""
        count = self.extent.drawn // CIRCLING
        names = turning_cranks.families(self.problem)
        return [turning_cranks.starts(self.problem, name, count, self._random) for name in names]

    @cached_property
    def _families(self) -> list[str]:
        """Families of which starts are made to measure."""
        return allowed(self.problem, euler_savary.PINNED)

    @property
    def _exact(self) -> bool:
        """Whether exact guides are wanted, be they trivial: of arcs of a given radius, for the least deviation, or of
        bodies that hardly turn."""
        problem = self.problem
        steady = problem.constraints.max_rotation is not None
        return steady or problem.fixed_curvature is not None or problem.ranking.only == "deviation"

    def _stored(self, stage: int) -> CandidateBatch | None:
        """Return stored starts of a stage; where a build replaces them meanwhile, those that it made."""
        count = self.extent.measured // (1 + stage % 2)
        for _ in range(READS - 1):
            try:
                return self._shortlisted(count)
            except retrieve.ChangedError:
                del self._ranked  # they are read again
        return self._shortlisted(count)

    def _shortlisted(self, count: int) -> CandidateBatch | None:
        """Return the most promising stored guides that were no starts yet."""
        reaches, merit, stretch = self._ranked
        chosen = retrieve.shortlist(reaches, merit, count, self.taken)
        if not len(chosen):
            return None
        starts = retrieve.candidates_of(self.problem, self.database, reaches, chosen, stretch[chosen])
        self.taken = np.concatenate([self.taken, reaches.guide[chosen]])
        return starts

    @cached_property
    def _ranked(self) -> tuple[retrieve.Reaches, Floats, Floats]:
        """Stored reaches with their merits, infinite of those that are not eligible, and stretches, each (n,)."""
        reaches = retrieve.stored_reaches(self.problem, self.database, self.effort)
        merit, stretch = retrieve.estimate(self.problem, reaches)
        merit = np.where(retrieve.eligible(self.problem, reaches), merit, np.inf)
        self.report.eligible = int(np.isfinite(merit).sum())
        return reaches, merit, stretch

    def perturbed(self, found: CandidateBatch | None) -> CandidateBatch | None:
        """Return copies of the best points found, moved at random; None of points that return, which they then do no
        more, and where guides are given as they are stored."""
        if found is None or not self.refines or self.problem.constraints.returns:
            return None
        merit = self._merits(found)
        best = np.argsort(merit)[:BEST]
        best = best[np.isfinite(merit[best])]
        if not len(best):
            return None
        copies = found[np.repeat(best, COPIES)]
        scale = 10 ** self._random.uniform(*BY, len(copies))
        pivots = copies.linkage.pivots.copy()
        pivots[..., :2] += scale[:, None, None, None] * self._random.normal(size=(len(copies), 2, 2, 2))
        linkage, valid = Linkage.valid(pivots)
        return measured(self.problem, take(copies.origin, valid), linkage, copies.point[valid], copies.pole[valid])

    def promising(self, starts: CandidateBatch, count: int) -> CandidateBatch:
        """Return the best by cost and violation that are unlike each other."""
        merit = self._merits(starts)
        self.report.measured += len(starts)
        pivots, mirror = starts.linkage.pivots, self.problem.curvature == 0
        return starts[unlike(pivots, merit, count, mirror=mirror)]

    def _merits(self, candidates: CandidateBatch) -> Floats:
        """Return what candidates cost and break together, shape (n,)."""
        broken = feasibility(self.problem, candidates)
        with np.errstate(invalid="ignore"):
            merit = cost(self.problem, candidates) + PENALTY * broken.total
        return np.where(np.isnan(merit) | (not self.refines and ~broken.all), np.inf, merit)
