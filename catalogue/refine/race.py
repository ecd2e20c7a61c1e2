"""A race: move many starts inside the constraints in cheap rounds, then to a lower cost.

Linkages are evaluated at a few stations along the nominal (`catalogue.guidance.stations`), where
their errors, limits and measures are linear in the coordinates of the pivots (`race_model`). A
round computes a step that brings these inside their bounds (`hinges`), corrects it by the errors
after it, and solves for the new poses. A start is first moved inside with a margin, whatever its
cost. Then its measures are reduced, and it may violate the constraints a little on the way. The
result is not yet an answer: the refinement (`sqp`) checks circuits and the path between the
stations.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..candidates.batch import CandidateBatch, measured
from ..candidates.select import unlike
from ..guidance.sensitivity import COUNT, displaced
from ..guidance.stations import Stationed
from ..kinematics.batch import put, take
from ..kinematics.types import Floats, Indices, Mask
from ..problem.problem import Problem
from .hinges import bring_inside
from .race_model import Linear
from .subproblem import GRID, units


@dataclass(frozen=True)
class TrustRegion:
    """Control of the trust radius by the gain of steps [`units` of the coordinates]."""

    first: float = 0.1  #: radius of the first round
    widest: float = 0.6  #: largest radius
    wider: float = 2.5  #: factor after a round that lowered the merit
    narrower: float = 0.25  #: factor after a round that did not lower the merit
    damping: float = 0.1  #: damping of the first step
    least: float = 1e-9  #: step below which the radius is no longer reduced


TRUST = TrustRegion()
#: Bounds of the reduction of measures at which a step aims; between them it is the trust radius.
#: Shorter steps would follow the largest pieces alone [strokes, right angles, `PART`].
TARGET_REDUCTION = (0.01, 0.5)

#: Numbers of Newton steps of a round, before and after an update of the multipliers.
NEWTON_STEPS = (4, 2)
#: Number of Newton steps of the correction of a round.
CORRECTION_STEPS = (3,)


@dataclass
class Race:
    """State of a race of n linkages; arrays of shape (n, ...)."""

    problem: Problem
    here: Linear
    best: Linear  #: cheapest state of each linkage within all limits; without one, the state nearest to them
    inside: Mask  #: whether the linkages have met all limits
    start: Indices  #: number of the start of each linkage
    multipliers: Floats  #: multipliers of errors and limits, (n, m + l) [tolerances, `UNIT`]
    radius: Floats
    damping: Floats
    taken: int = 0  #: number of rounds so far, summed over linkages

    @classmethod
    def of(cls, problem: Problem, starts: CandidateBatch) -> Race:
        """Start a race of candidates along the path.

        Candidates that lack a pose at any station are dropped.
        """
        linkage, point = starts.linkage, starts.point
        fit, bend = starts.traced.fit, problem.curvature
        if bend is None:
            way = np.where(fit.along.real < 0, -1.0, 1.0)
            curvature = way * fit.curvature.astype(float)
            curvature = np.where(curvature < -1 / GRID.flattest, curvature, -1 / GRID.flattest)
        else:
            curvature = np.full(len(starts), float(bend))
        with np.errstate(all="ignore"):
            machine = Stationed.followed(linkage, point, curvature)
            some = np.flatnonzero(machine.reached)
            here = Linear.of(problem, machine[some])
        n = len(some)
        damping, radius = np.full(n, TRUST.damping), np.full(n, TRUST.first)
        return cls(problem, here, here, here.violation <= 0, some, np.zeros((n, here.bounded)), radius, damping)

    def __len__(self) -> int:
        return len(self.start)

    @property
    def merit(self) -> Floats:
        """Cost of the best state of each linkage.

        An infeasible state costs more than all feasible ones.
        """
        cost, violation = self.best.cost, self.best.violation
        met = violation <= 0
        worst = np.max(cost, where=met, initial=0.0)
        return np.where(met, cost, worst + 1 + violation)

    def denser(self) -> Race:
        """Return the race at twice as many stations."""
        with np.errstate(all="ignore"):
            here, best = (Linear.of(self.problem, every.machine.denser()) for every in (self.here, self.best))
        inside = self.inside & (here.violation <= 0)
        none = np.zeros((len(self), here.bounded))
        return replace(self, here=here, best=best, inside=inside, multipliers=none)

    def leaders(self, count: int) -> Race:
        """Continue with the best linkages that are unlike each other."""
        pivots, mirror = self.best.machine.linkage.pivots, self.problem.curvature == 0
        return self._some(unlike(pivots, self.merit, count, mirror=mirror))

    def finalists(self, starts: CandidateBatch) -> CandidateBatch:
        """Return the best state of each linkage as a candidate, measured on its finite motion.

        Linkages with paths shorter than the stroke are dropped.
        """
        machine = self.best.machine
        nothing = np.full(len(self), complex(np.nan, np.nan))
        origin = take(starts.origin, self.start)
        found = measured(self.problem, origin, machine.linkage, machine.point, nothing)
        return found[np.flatnonzero(np.isfinite(found.deviation))]

    def _some(self, index: Indices) -> Race:
        """Select linkages and reset their multipliers, which leads to better answers."""
        here, best, dyads = self.here[index], self.best[index], self.here.machine.linkage.dyads
        if len(np.unique(dyads[index], axis=0)) < len(np.unique(dyads, axis=0)):
            # the remaining kinds of dyads may have fewer limits and measures
            with np.errstate(all="ignore"):
                here, best = (Linear.of(self.problem, every.machine) for every in (here, best))
        names = ("inside", "start", "radius", "damping")
        kept = {name: getattr(self, name)[index] for name in names}
        return replace(self, here=here, best=best, multipliers=np.zeros((len(index), here.bounded)), **kept)

    def take_rounds(self, count: int) -> None:
        """Take a given number of rounds."""
        for _ in range(count):
            self.round()

    def round(self) -> None:
        """Take a step of every linkage where it lowers the merit."""
        here, inside = self.here, self.inside
        self.taken += len(here)
        with np.errstate(all="ignore"):
            aspired = np.clip(self.radius, *TARGET_REDUCTION)
            hinges, none = here.hinges(inside, aspired), np.zeros(here.slope.shape[::2])
            step, multipliers, damping = bring_inside(
                hinges, none, self.multipliers, self.damping, self.radius, NEWTON_STEPS
            )
            first = self._after_step(step)
            straight = first.error - (here.slope @ step[..., None])[..., 0]
            errors = np.where(first.reached[:, None], straight, here.machine.error)
            step, multipliers, damping = bring_inside(
                here.hinges(inside, aspired, errors), step, multipliers, damping, self.radius, CORRECTION_STEPS
            )
            laid = self._after_step(step).laid(any_radius=self.problem.curvature is None)
            there = Linear.of(self.problem, laid)
            gained = np.flatnonzero(there.merit(inside) < here.merit(inside))
        self._advance(gained, there[gained], step, multipliers, damping)

    def _after_step(self, step: Floats) -> Stationed:
        """Displace linkages by steps (n, p); linkages that would become invalid stay in place."""
        here, machine = self.here, self.here.machine
        coordinates = step[:, :COUNT] * units(machine.linkage, machine.point)
        linkage, point, valid = displaced(machine.linkage, machine.point, coordinates)
        error = machine.error + (here.slope @ step[..., None])[..., 0]
        bend = machine.curvature
        if step.shape[1] > COUNT:
            bend = bend + step[:, COUNT]
        if not valid.all():
            linkage = put(machine.linkage, valid, linkage)
            point = put(machine.point, valid, point)
        return Stationed.settled(linkage, point, bend, error, machine.angle)

    def _advance(self, gained: Indices, to: Linear, step: Floats, multipliers: Floats, damping: Floats) -> None:
        """Accept the steps that gained; reduce the radius of other linkages."""
        length = np.abs(step).max(1)
        self.here = put(self.here, gained, to)
        radius = np.minimum(self.radius, np.maximum(length, TRUST.least)) * TRUST.narrower
        radius[gained] = np.minimum(np.maximum(length * TRUST.wider, self.radius), TRUST.widest)[gained]
        self.radius = radius
        self.multipliers = 0.5 * self.multipliers
        self.multipliers[gained] = multipliers[gained]
        self.damping = damping
        here, best = self.here, self.best
        met = here.violation <= 0
        better = np.where(best.violation <= 0, met & (here.cost < best.cost), met | (here.violation < best.violation))
        self.best = put(best, better, here[better])
        self.inside = self.inside | met
