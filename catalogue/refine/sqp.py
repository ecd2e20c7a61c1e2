"""Refinement on the finite motion: sequential programming with elastic constraints.

Each round linearises the distances from the nominal at Chebyshev points, all constraints and ranked
measures (`subproblem`), and solves for the steps of least cost within several trust radii (`step`).
A second step from the end of the best one corrects errors of the linearisation. All trial points
are placed and measured on their finite motion. A guide may violate constraints on the way, at a
rising penalty; an answer meets all of them as measured.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..candidates.batch import CandidateBatch, curves, in_best_charts, near_path
from ..candidates.feasibility import EXACT_DEVIATION, cost, feasibility
from ..guidance.fixed_nominal import Nominal
from ..kinematics.batch import join, take
from ..kinematics.types import Array, Floats, Indices, Mask
from ..problem.problem import Problem
from .step import take_step
from .subproblem import Parametrisation, PivotCoordinates, linearise


class SqpOptions(NamedTuple):
    """Trust radius, penalty and termination of the optimiser."""

    radius: float = 0.1  #: first trust radius [units of `Parametrisation`]
    second: float = 0.5  #: factor of the radius of the second step
    #: Number of rounds after which charts are chosen again: in each a guide moves little farther
    #: than a radius.
    charted: int = 4
    #: Largest margin of the second step inside the tolerance [tolerances]: the amount by which the
    #: first step missed it.
    missed: float = 0.1
    short: float = 1e-5  #: trust radius below which a candidate has converged
    #: Number of successive rounds of little gain after which a candidate has converged; if `hasty`
    #: one, after a better round, where no constraint is violated.
    patience: int = 2
    stalled: float = 1e-3  #: relative gain below which a round counts as one of little gain
    penalty: float = 10.0  #: first penalty [1/stroke, 1/rad]
    #: penalty of feasible guides; with 30, 100 or 300 the answers are alike
    feasible_penalty: float = 100.0
    max_penalty: float = 1e4  #: largest penalty
    steeper: float = 4.0  #: factor of the penalty where the violation decreases too little
    falls: float = 0.7  #: ratio of successive violations above which the decrease is too small
    least_gain: float = 1e-9  #: gain of the merit below which a step has gained nothing


SQP = SqpOptions()

#: Trial factors of the trust radius.
RADIUS_FACTORS = (0.2, 0.7, 2.5)


@dataclass(frozen=True)
class Trials:
    """n measured trial points; arrays of shape (n,).

    Attributes
    ----------
    of : ndarray of int
        Number of the guide of each trial.
    factor : ndarray
        Factor of the guide's trust radius.
    cost, violation, met : ndarray
        Cost and violation of the trial; whether it meets all constraints.
    """

    candidates: CandidateBatch
    of: Indices
    factor: Floats
    cost: Floats
    violation: Floats
    met: Mask

    def merit(self, penalty: Floats) -> Floats:
        """Return cost plus penalty times violation; infinite for NaN.

        `penalty` (n,) is that of the guides.
        """
        merit = self.cost + penalty[self.of] * self.violation
        return np.where(np.isnan(merit), np.inf, merit)


@dataclass
class Refinement:
    """Candidates (n,) in refinement by `step`; arrays of shape (n,)."""

    problem: Problem
    current: CandidateBatch  #: current linkages
    moves: Parametrisation
    nominal: Nominal | None
    best: CandidateBatch  #: the cheapest feasible linkage of each so far, else the one of least violation
    best_cost: Floats  #: cost of `best`, infinite where no linkage was feasible
    nearest: Floats  #: least violation so far
    violation: Floats  #: sum of the violations of the current linkages
    radius: Floats
    penalty: Floats
    active: Mask  #: candidates that have not converged
    stalled: Array  #: number of rounds without a gain of merit
    hasty: bool = False  #: whether candidates converge after the first round of little gain
    rounds: int = 0
    evaluated: int = 0  #: number of candidates measured so far

    @classmethod
    def of(
        cls,
        problem: Problem,
        start: CandidateBatch,
        moves: Parametrisation | None = None,
        nominal: Nominal | None = None,
        penalty: float = SQP.penalty,
        hasty: bool = False,
    ) -> Refinement:
        """Start the refinement of placed guides, feasible or not.

        Returning points are not refined.

        Parameters
        ----------
        moves : Parametrisation, optional
            Coordinates of the moves; by default all pivots and the point are free.
        nominal : Nominal, optional
            The path itself: distances are then measured from it, and guides stay in place.
        penalty : float
            First penalty of a violation, per stroke or radian.
        hasty : bool
            Stop after the first round with little gain.
        """
        n = len(start)
        broken = feasibility(problem, start)
        met = broken.all
        value = np.where(met, cost(problem, start), np.inf)
        active = ((start.traced.relative > EXACT_DEVIATION) | ~met) & np.isfinite(start.deviation) & ~start.curve.cusp
        if problem.ranking.only != "deviation":
            active = np.isfinite(start.deviation) & ~start.curve.cusp
        prices = np.where(met, max(SQP.feasible_penalty, penalty), penalty)
        return cls(
            problem,
            start,
            moves or PivotCoordinates(),
            nominal,
            start,
            value,
            broken.total.copy(),
            broken.total.copy(),
            np.full(n, SQP.radius),
            prices,
            np.asarray(active),
            np.zeros(n, int),
            hasty,
        )

    def __getitem__(self, index: Array) -> Refinement:
        """Return the refinement of some candidates, from their current points."""
        names = ("current", "best", "best_cost", "nearest", "violation", "radius", "penalty", "active", "stalled")
        return replace(self, rounds=0, evaluated=0, **{name: take(getattr(self, name), index) for name in names})

    @property
    def merit(self) -> Floats:
        """Cost of the best feasible point of each candidate; else its violation plus 1,000."""
        return np.where(np.isfinite(self.best_cost), self.best_cost, 1e3 + self.nearest)

    def run(self, rounds: int) -> Refinement:
        """Run up to a number of rounds."""
        for _ in range(rounds):
            if not self.step():
                break
        return self

    def step(self, followed: int = len(RADIUS_FACTORS)) -> bool:
        """Take one round; return whether any guide has not yet converged.

        The best steps of each guide, up to `followed` of them, are followed by a second one.
        """
        at = np.flatnonzero(self.active)
        if not len(at):
            return False
        with np.errstate(all="ignore"):  # steps and traces that fail are NaN, and give no trial
            trials = self._trials(at, followed)
        self.rounds += 1
        of, total, merit = trials.of, trials.violation, trials.merit(self.penalty[at])
        self.evaluated += len(of)
        self._keep(at[of], trials)
        here = self.current[at]
        before = cost(self.problem, here) + self.penalty[at] * self.violation[at]
        first = least(merit, of)
        gained = first[merit[first] < np.where(np.isnan(before), np.inf, before)[of[first]] - SQP.least_gain]
        to = at[of[gained]]
        fell = np.ones(len(self.active), bool)
        fell[at] = self.violation[at] <= 0
        fell[to] |= total[gained] <= SQP.falls * self.violation[to]
        self.current = self.current.replaced(to, trials.candidates[gained])
        if self.nominal is None and self.rounds % SQP.charted == 0:
            self.current = self.current.replaced(at, in_best_charts(self.problem, self.current[at]))
        self.violation[to] = total[gained]
        steeper = np.where(fell[at], 1.0, SQP.steeper)
        self.penalty[at] = np.minimum(self.penalty[at] * steeper, SQP.max_penalty)
        self.penalty = np.where(self.violation <= 0, np.maximum(self.penalty, SQP.feasible_penalty), self.penalty)
        by = np.full(len(self.active), RADIUS_FACTORS[0] ** 2)
        by[to] = trials.factor[gained]
        self.radius[at] = np.minimum(self.radius[at] * by[at], 1.0)
        gain = np.zeros(len(self.active))
        gain[to] = np.where(np.isfinite(before), before, np.inf)[of[gained]] - merit[gained]
        soon = self.hasty & (self.violation[at] <= 0)
        self.stalled[at] = np.where(gain[at] < SQP.stalled, self.stalled[at] + 1, soon.astype(int))
        self.active = self.active & (self.radius > SQP.short) & (self.stalled < SQP.patience)
        return bool(self.active.any())

    def _keep(self, at: Indices, trials: Trials) -> None:
        """Store the cheapest feasible trials, else those nearest to feasibility."""
        total, met = trials.violation, trials.met
        for key, held in ((np.where(met, trials.cost, np.inf), self.best_cost), (total, self.nearest)):
            may = met if held is self.best_cost else ~np.isfinite(self.best_cost)[at] & np.isfinite(total)
            first = least(np.where(may, key, np.inf), at)
            first = first[may[first] & (key[first] < held[at[first]])]
            held[at[first]] = key[first]
            self.best = self.best.replaced(at[first], trials.candidates[first])

    def _trials(self, at: Indices, followed: int) -> Trials:
        """Return trials of the guides `at` within all radii, and second steps from the best."""
        here, n = self.current[at], len(at)
        each, factor = np.tile(np.arange(n), len(RADIUS_FACTORS)), np.repeat(RADIUS_FACTORS, n)
        penalty, radius = self.penalty[at], self.radius[at]
        one = self._stepped(here, each, factor, factor * radius[each], penalty)
        rank, merit = np.empty(len(one.of), int), one.merit(penalty)
        order = np.lexsort((merit, one.of))
        rank[order] = np.arange(len(order)) - np.searchsorted(one.of[order], one.of[order])
        led = np.flatnonzero((rank < followed) & np.isfinite(merit))
        if not len(led):
            return one
        from_, of, factor = one.candidates[led], one.of[led], one.factor[led]
        missed = np.clip(from_.deviation / self.problem.deviation - 1, 0.0, SQP.missed)
        each = np.arange(len(led))
        two = self._stepped(from_, each, factor, SQP.second * factor * radius[of], penalty[of], 1 - missed)
        return join(one, replace(two, of=of[two.of]))

    def _stepped(
        self,
        here: CandidateBatch,
        each: Indices,
        factor: Floats,
        radius: Floats,
        penalty: Floats,
        share: Floats | float = 1.0,
    ) -> Trials:
        """Take one step within each trust radius, and measure the trials.

        `each` numbers the candidate of a trial; `share` is the part of the tolerance to use.
        """
        guides = here.curve
        linear = linearise(self.problem, here, guides, self.moves, self.nominal)
        found = take_step(linear[each], radius, penalty[each], share=share)
        step = np.nan_to_num(found.displacement[:, :-1] if self.problem.curvature is None else found.displacement)
        many = here[each]
        linkage, point, valid = self.moves.moved(many, step)
        kept = np.flatnonzero(valid)
        moved = curves(linkage, point, many.pole[kept], guides.motion.chart[each[kept]])
        trials = near_path(self.problem, take(many.origin, kept), moved, self.nominal)
        broken = feasibility(self.problem, trials)
        return Trials(trials, each[kept], factor[kept], cost(self.problem, trials), broken.total, broken.all)


def least(value: Floats, group: Indices) -> Indices:
    """Return the index of the least value of each group."""
    order = np.lexsort((value, group))
    return np.asarray(order[np.unique(group[order], return_index=True)[1]])
