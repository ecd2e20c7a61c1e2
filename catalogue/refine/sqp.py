"""Refinement on the finite motion: sequential programming with elastic constraints.

Each round linearises the distances from the nominal, all constraints and ranked measures of the
guides (`model`), and solves for the steps of least cost within several trust radii (`step`). A
second step from the end of the best one corrects errors of the linearisation. All trial points are
measured on their finite motion. A guide may violate constraints on the way, at a rising penalty; an
answer meets all of them as measured.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Generic, NamedTuple

import numpy as np

from ..candidates.batch import CandidateBatch
from ..guidance.fixed_nominal import Nominal
from ..kinematics.batch import join, take
from ..kinematics.types import Array, Floats, Indices, Mask
from ..problem.problem import Problem
from .model import Guides, Model
from .step import take_step
from .subproblem import LinkageModel, Parametrisation, PivotCoordinates


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
    stalled: float = 1e-3  #: relative gain below which a round has little gain
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
class Trials(Generic[Guides]):
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

    guides: Guides
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
class Refinement(Generic[Guides]):
    """Guides (n,) in refinement by `step`; arrays of shape (n,)."""

    model: Model[Guides]
    current: Guides
    best: Guides  #: cheapest feasible point of each guide so far; without one, the point of least violation
    best_cost: Floats  #: cost of `best`, infinite where no point was feasible
    nearest: Floats  #: least violation so far
    cost: Floats  #: costs of the current points
    violation: Floats  #: sums of their violations
    radius: Floats
    penalty: Floats
    active: Mask  #: guides that have not converged
    stalled: Array  #: number of rounds without a gain of merit
    hasty: bool = False  #: whether guides converge after the first round of little gain
    rounds: int = 0
    evaluated: int = 0  #: number of guides measured so far

    @classmethod
    def of(
        cls,
        problem: Problem,
        start: CandidateBatch,
        moves: Parametrisation | None = None,
        nominal: Nominal | None = None,
        penalty: float = SQP.penalty,
        hasty: bool = False,
    ) -> Refinement[CandidateBatch]:
        """Start the refinement of placed linkages of two dyads, feasible or not.

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
        model = LinkageModel(problem, moves or PivotCoordinates(), nominal)
        return Refinement.started(model, start, penalty, hasty)

    @staticmethod
    def started(
        model: Model[Guides], start: Guides, penalty: float = SQP.penalty, hasty: bool = False
    ) -> Refinement[Guides]:
        """Start the refinement of any guides."""
        judged = model.judged(start)
        return Refinement(
            model,
            start,
            start,
            np.where(judged.met, judged.cost, np.inf),
            judged.violation.copy(),
            judged.cost.copy(),
            judged.violation.copy(),
            np.full(len(start), SQP.radius),
            np.where(judged.met, max(SQP.feasible_penalty, penalty), penalty),
            model.refinable(start, judged.met),
            np.zeros(len(start), int),
            hasty,
        )

    def __getitem__(self, index: Array) -> Refinement[Guides]:
        """Return the refinement of some guides, from their current points."""
        state = ("radius", "penalty", "active", "stalled")
        names = ("current", "best", "best_cost", "nearest", "cost", "violation", *state)
        return replace(self, rounds=0, evaluated=0, **{name: take(getattr(self, name), index) for name in names})

    @property
    def merit(self) -> Floats:
        """Cost of the best feasible point of each guide; else its violation plus 1,000."""
        return np.where(np.isfinite(self.best_cost), self.best_cost, 1e3 + self.nearest)

    def run(self, rounds: int) -> Refinement[Guides]:
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
        with np.errstate(all="ignore"):  # failed steps and traces are NaN and yield no trial
            trials = self._trials(at, followed)
        self.rounds += 1
        of, total, merit = trials.of, trials.violation, trials.merit(self.penalty[at])
        self.evaluated += len(of)
        self._accept(at[of], trials)
        before = self.cost[at] + self.penalty[at] * self.violation[at]
        first = least(merit, of)
        gained = first[merit[first] < np.where(np.isnan(before), np.inf, before)[of[first]] - SQP.least_gain]
        to = at[of[gained]]
        fell = np.ones(len(self.active), bool)
        fell[at] = self.violation[at] <= 0
        fell[to] |= total[gained] <= SQP.falls * self.violation[to]
        self.current = self.current.replaced(to, trials.guides[gained])
        if self.rounds % SQP.charted == 0:
            self.current = self.current.replaced(at, self.model.charted(self.current[at]))
        self.cost[to], self.violation[to] = trials.cost[gained], total[gained]
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

    def _accept(self, at: Indices, trials: Trials[Guides]) -> None:
        """Store the cheapest feasible trials or, without any, those of least violation."""
        total, met = trials.violation, trials.met
        for key, held in ((np.where(met, trials.cost, np.inf), self.best_cost), (total, self.nearest)):
            may = met if held is self.best_cost else ~np.isfinite(self.best_cost)[at] & np.isfinite(total)
            first = least(np.where(may, key, np.inf), at)
            first = first[may[first] & (key[first] < held[at[first]])]
            held[at[first]] = key[first]
            self.best = self.best.replaced(at[first], trials.guides[first])

    def _trials(self, at: Indices, followed: int) -> Trials[Guides]:
        """Return trials of the guides `at` within all radii, and second steps from the best."""
        here, n = self.current[at], len(at)
        each, factor = np.tile(np.arange(n), len(RADIUS_FACTORS)), np.repeat(RADIUS_FACTORS, n)
        penalty, radius = self.penalty[at], self.radius[at]
        one = self._take_step(here, each, factor, factor * radius[each], penalty)
        rank, merit = np.empty(len(one.of), int), one.merit(penalty)
        order = np.lexsort((merit, one.of))
        rank[order] = np.arange(len(order)) - np.searchsorted(one.of[order], one.of[order])
        led = np.flatnonzero((rank < followed) & np.isfinite(merit))
        if not len(led):
            return one
        from_, of, factor = one.guides[led], one.of[led], one.factor[led]
        missed = np.clip(self.model.deviation(from_) - 1, 0.0, SQP.missed)
        each = np.arange(len(led))
        two = self._take_step(from_, each, factor, SQP.second * factor * radius[of], penalty[of], 1 - missed)
        return join(one, replace(two, of=of[two.of]))

    def _take_step(
        self,
        here: Guides,
        each: Indices,
        factor: Floats,
        radius: Floats,
        penalty: Floats,
        share: Floats | float = 1.0,
    ) -> Trials[Guides]:
        """Take one step within each trust radius, and measure the trials.

        `each` numbers the guide of a trial; `share` is the part of the tolerance to use.
        """
        linear = self.model.linearised(here)
        found = take_step(linear[each], radius, penalty[each], share=share)
        trials, kept = self.model.moved(here[each], np.nan_to_num(found.displacement))
        judged = self.model.judged(trials)
        return Trials(trials, each[kept], factor[kept], judged.cost, judged.violation, judged.met)


def least(value: Floats, group: Indices) -> Indices:
    """Return the index of the least value of each group."""
    order = np.lexsort((value, group))
    return np.asarray(order[np.unique(group[order], return_index=True)[1]])
