"""Starts of a phase: stored guides, synthesised ones, and perturbed copies of the best.

Each kind contributes its most promising starts that are unlike each other; stored guides are
compared by estimated cost and violation.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..candidates.batch import CandidateBatch, measured
from ..candidates.feasibility import cost, feasibility
from ..candidates.select import distances, normal_form, unlike
from ..kinematics.batch import join, take
from ..kinematics.linkage import Linkage
from ..kinematics.types import Floats, Indices
from ..problem.problem import Problem
from ..store import Database
from . import euler_savary, exact_guides, retrieve, rotating_crank, turning_cranks
from .draws import allowed

#: Number of stored guides that are measured in a phase.
STORED_STARTS = 200
#: Number of linkages of each family that are drawn in a phase, to be measured.
DRAWN_LINKAGES = 2500
#: Number of exact guides drawn.
EXACT_GUIDES = 200
#: Number of stored guides among which similar ones to a candidate are sought.
LIKELY_POOL = 90
#: Divisor of the number of linkages drawn for an arc beyond a half circle: each costs as many times
#: more.
CIRCLING_DIVISOR = 8
#: Largest number of attempts to read stored guides while builds replace them.
MAX_READS = 5
#: Number of best points that are perturbed.
PERTURBED_POINTS = 8
#: Number of perturbed copies of each point.
COPIES = 12
#: Range of the perturbations, as powers of ten [strokes].
PERTURBATIONS = (-2.0, -0.5)
#: Penalty of violations when starts are compared.
PENALTY = 4.0
#: Constraints that select kinds of guides.
KIND_CONSTRAINTS = ("families", "series", "configurations", "pins_only", "order", "slots", "returns")


def is_constrained(problem: Problem) -> bool:
    """Tell whether a problem has constraints other than those on the kind of guide."""
    return any(name not in KIND_CONSTRAINTS for name in problem.constraints.active())


@dataclass
class SearchReport:
    """Statistics of a search."""

    seconds: dict[str, float] = field(default_factory=dict)  #: wall time of each step; steps do not overlap
    eligible: int = 0  #: number of stored reaches of a requested family, series, configuration and order
    measured: int = 0  #: number of starts placed along the path and measured
    raced: int = 0  #: number of rounds in races, summed over starts
    refined: int = 0  #: number of programmes solved by the refinement, each for a measured trial point
    solved: int = 0  #: number of linkages that series gave in closed form, for prescribed pivots
    completed: int = 0  #: number of linkages completed along the path, for prescribed pivots
    #: candidates nearest to the constraints, feasible or not
    nearest: CandidateBatch | None = field(default=None, repr=False)

    @contextmanager
    def timed(self, step: str) -> Iterator[None]:
        """Add the wall time of a block to a step."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[step] = self.seconds.get(step, 0.0) + time.perf_counter() - start


@dataclass
class Starts:
    """Supply the starts of a search: each stored guide once, and synthesised ones."""

    problem: Problem
    database: Database
    report: SearchReport
    effort: int = 1  #: number of the search for this problem, from 1: seed of the random starts
    refines: bool = True  #: whether starts are refined; else they must be feasible
    given: CandidateBatch | None = None  #: further starts
    taken: Indices = field(default_factory=lambda: np.zeros(0, int))  #: stored guides returned so far

    def __post_init__(self) -> None:
        self._random = np.random.default_rng(19 + self.effort)

    def short(self, count: int) -> CandidateBatch | None:
        """Return the most promising stored guides; later phases may return them again."""
        before = self.taken
        parts = self._wide_arc_starts() if self.problem.is_wide else [self._stored(2 * count), *self._made_at_once()]
        self.taken = before
        return self._joined(parts, count)

    def broad(self, number: int, each: int, found: CandidateBatch | None) -> CandidateBatch | None:
        """Return at most `each` starts of every kind for a broad phase."""
        if self.problem.is_wide:
            parts = self._wide_arc_starts()
        else:
            parts = [self._stored(STORED_STARTS)]
            if number == 0:
                parts += self._made_at_once()
            if self.refines or number:  # without refinement stored guides come first
                parts += self._made()
        if self.problem.constraints.full_rotation and "four-bar" in self._families:
            parts.append(rotating_crank.starts(self.problem, DRAWN_LINKAGES, self._random))
        if number:
            parts.append(self._copies(found))
        return self._joined(parts, each, with_given=number == 0)

    def perturbed(self, found: CandidateBatch | None, count: int) -> CandidateBatch | None:
        """Return the most promising copies of the best points found, moved at random."""
        return self._joined([self._copies(found)], count)

    def likely(self, near: CandidateBatch, count: int) -> CandidateBatch | None:
        """Return the `count` stored starts most similar to a candidate, and the `count` best."""
        parts = (
            self._wide_arc_starts()
            if self.problem.is_wide
            else [self._stored(STORED_STARTS), self._stored(STORED_STARTS // 2)]
        )
        starts = self._joined(parts, LIKELY_POOL)
        if starts is None:
            return None
        one, designs = (normal_form(batch.linkage.pivots, 1.0) for batch in (near, starts))
        away = distances(one, designs, mirror=self.problem.curvature == 0)[0]
        order = (np.argsort(by, kind="stable")[:count] for by in (away, self._merits(starts)))
        return starts[np.unique([*order])]

    def best(self, starts: CandidateBatch, count: int) -> CandidateBatch:
        """Return the best starts by cost and violation."""
        return starts[np.argsort(self._merits(starts), kind="stable")[:count]]

    def _joined(
        self, parts: Sequence[CandidateBatch | None], count: int, *, with_given: bool = False
    ) -> CandidateBatch | None:
        """Join the `count` most promising starts of each part, and on request the given ones."""
        kept = [self.promising(part, count) for part in parts if part is not None and len(part)]
        if with_given and self.given is not None and len(self.given):
            kept.append(self.given)
        kept = [part for part in kept if len(part)]
        return join(*kept) if kept else None

    def _made_at_once(self) -> list[CandidateBatch | None]:
        """Return exact guides, where they are suitable."""
        return [exact_guides.starts(self.problem, EXACT_GUIDES, self._random)] if self._suits_exact_guides else []

    def _made(self) -> list[CandidateBatch | None]:
        """Return linkages of each family with second-order contact in mid-stroke."""
        return [euler_savary.starts(self.problem, name, DRAWN_LINKAGES, self._random) for name in self._families]

    def _wide_arc_starts(self) -> list[CandidateBatch | None]:
        """Return starts for an arc near a half circle or beyond, of each family."""
        count = DRAWN_LINKAGES // CIRCLING_DIVISOR
        names = turning_cranks.families(self.problem)
        return [turning_cranks.starts(self.problem, name, count, self._random) for name in names]

    @cached_property
    def _families(self) -> list[str]:
        """Families of which starts are synthesised."""
        return allowed(self.problem, euler_savary.PINNED)

    @property
    def _suits_exact_guides(self) -> bool:
        """Whether exact guides are suitable, even trivial ones.

        They are for arcs of a given radius, for the least deviation, and for bodies that hardly
        turn.
        """
        problem = self.problem
        steady = problem.constraints.max_rotation is not None
        return steady or problem.fixed_curvature is not None or problem.ranking.only == "deviation"

    def _stored(self, count: int) -> CandidateBatch | None:
        """Return stored starts; read them again if a build has replaced them meanwhile."""
        for _ in range(MAX_READS - 1):
            try:
                return self._shortlisted(count)
            except retrieve.ChangedError:
                del self._ranked  # read them again on the next use
        return self._shortlisted(count)

    def _shortlisted(self, count: int) -> CandidateBatch | None:
        """Return the most promising stored guides that have not been starts yet."""
        reaches, merit, stretch = self._ranked
        chosen = retrieve.shortlist(reaches, merit, count, self.taken)
        if not len(chosen):
            return None
        starts = retrieve.candidates_of(self.problem, self.database, reaches, chosen, stretch[chosen])
        self.taken = np.concatenate([self.taken, reaches.guide[chosen]])
        return starts

    @cached_property
    def _ranked(self) -> tuple[retrieve.Reaches, Floats, Floats]:
        """Stored reaches, with their merits and stretches, (n,) each.

        The merit of a reach that is not eligible is infinite.
        """
        reaches = retrieve.stored_reaches(self.problem, self.database, self.effort)
        merit, stretch = retrieve.estimate(self.problem, reaches)
        merit = np.where(retrieve.eligible(self.problem, reaches), merit, np.inf)
        self.report.eligible = int(np.isfinite(merit).sum())
        return reaches, merit, stretch

    def _copies(self, found: CandidateBatch | None) -> CandidateBatch | None:
        """Return randomly perturbed copies of the best points found.

        None without refinement, and for returning points: a perturbed one does not return.
        """
        if found is None or not self.refines or self.problem.constraints.returns:
            return None
        merit = self._merits(found)
        best = np.argsort(merit)[:PERTURBED_POINTS]
        best = best[np.isfinite(merit[best])]
        if not len(best):
            return None
        copies = found[np.repeat(best, COPIES)]
        scale = 10 ** self._random.uniform(*PERTURBATIONS, len(copies))
        pivots = copies.linkage.pivots.copy()
        pivots[..., :2] += scale[:, None, None, None] * self._random.normal(size=(len(copies), 2, 2, 2))
        linkage, valid = Linkage.valid(pivots)
        return measured(self.problem, take(copies.origin, valid), linkage, copies.point[valid], copies.pole[valid])

    def promising(self, starts: CandidateBatch, count: int) -> CandidateBatch:
        """Return the best starts by cost and violation that are unlike each other."""
        merit = self._merits(starts)
        self.report.measured += len(starts)
        pivots, mirror = starts.linkage.pivots, self.problem.curvature == 0
        return starts[unlike(pivots, merit, count, mirror=mirror)]

    def _merits(self, candidates: CandidateBatch) -> Floats:
        """Return the sum of cost and violation of candidates, shape (n,)."""
        broken = feasibility(self.problem, candidates)
        with np.errstate(invalid="ignore"):
            merit = cost(self.problem, candidates) + PENALTY * broken.total
        return np.where(np.isnan(merit) | (not self.refines and ~broken.all), np.inf, merit)
