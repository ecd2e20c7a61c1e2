"""Fit hard points inside boxes to targets and bounds by least squares."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from ...errors import InvalidRequest, NotMovable
from ...given import instance, several, whole
from ...kinematics.types import Array
from ..jointed.hard_points import MAX_COORDINATE
from ..jointed.mechanism import Mechanism
from .boxes import Box, Variables
from .outcome import BOUND_TOLERANCE, Fit
from .targets import Bound, Target
from .trials import Trial, Trials

#: Change of the sum of squares at which a search stops.
FTOL = 1e-8
#: Change of the variables at which a search stops.
XTOL = 1e-13
#: Gradient at which a search stops.
GTOL = 1e-15
#: Deviation at which a target is met exactly and the search ends [tolerances].
EXACT_DEVIATION = 1e-6
#: Largest number of updates of the multipliers of bounds.
MAX_UPDATES = 20
#: Initial penalty weight of bounds.
PENALTY = 100.0
#: Starts at most.
MAX_COUNT = 1_000_000
#: Number of random starts with a search, besides the given mechanism.
SEARCHED_STARTS = 2


def fit(
    mechanism: Mechanism,
    targets: Sequence[Target],
    boxes: Sequence[Box],
    bounds: Sequence[Bound] = (),
    starts: int = 16,
    steps: int = 50,
    seed: int = 1,
) -> Fit:
    """Fit hard points inside boxes to target curves.

    Minimises the sum over targets of the mean square of deviation / tolerance (trust regions,
    `scipy.optimize.least_squares`); bounds are kept by multipliers (Powell, Hestenes).  Every trial
    is swept from its own design pose; it is refused and counted if a sweep ends early or its design
    pose is beyond a singular one.  The first search starts from the given mechanism; if it misses a
    target or a bound, others start from the best of random points in the boxes.  Of several
    solutions one nearby is found.  Points of readings, such as the centre of a wheel, keep their
    positions in the design pose.

    Parameters
    ----------
    mechanism : Mechanism
    targets : sequence of Target
    boxes : sequence of Box
        Hard points that may move; all others are fixed.
    bounds : sequence of Bound, optional
    starts : int
        Number of points in the boxes that are tried as starts, including the given one.
    steps : int
        Largest number of trials of one search.
    seed : int
        Seed of the random starts.

    Raises
    ------
    InvalidRequest
        If a name is unknown, or a size, a value or a reading is invalid.
    NotMovable
        If neither the given mechanism nor any other start completes all sweeps.
    """
    targets, bounds = several("targets", targets, Target), several("bounds", bounds, Bound)
    starts, steps, seed = whole("starts", starts, 1, MAX_COUNT), whole("steps", steps, 1), whole("seed", seed, 0)
    if not targets:
        raise InvalidRequest("there is nothing to meet: give a Target")
    variables = Variables(instance("mechanism", mechanism, Mechanism), several("boxes", boxes, Box))
    trials = Trials(variables, [*targets, *bounds])
    search = Search(trials, targets, bounds, steps)
    home = np.zeros(len(variables.half))
    given = trials.at(home)
    best = search.run(given) if given else None
    if starts > 1 and (best is None or not search.done(best)):
        drawn = np.random.default_rng(seed).uniform(-1, 1, (starts - 1, len(home)))
        others = sorted((t for t in trials.batch(drawn) if t), key=search.merit)
        for other in others[:SEARCHED_STARTS]:
            found = search.run(other)
            if best is None or search.merit(found) < search.merit(best) * (1 - 1e-6):
                best = found
            if search.done(best):
                break
    if best is None:
        reasons = "; ".join(f"{n} trials: {reason}" for reason, n in trials.refused.most_common(3))
        raise NotMovable(f"no start gets through all sweeps ({reasons}): shorten a sweep or give other boxes")
    return Fit(search, given, search.settled(best))


class Search:
    """Residuals, their derivatives, and least-squares searches."""

    def __init__(self, trials: Trials, targets: Sequence[Target], bounds: Sequence[Bound], steps: int) -> None:
        self.trials, self.targets, self.bounds, self.steps = trials, tuple(targets), tuple(bounds), steps
        self.last: dict[bytes, Trial | None] = {}

    # -- objective -------------------------------------------------------------------------------
    def deviations(self, trial: Trial) -> list[Array]:
        """Return deviations from each target (s, c), in its unit."""
        return [t.deviations(r[None])[0] for t, r in zip(self.targets, trial.read, strict=False)]

    def excesses(self, trial: Trial) -> list[Array]:
        """Return the violation of each bound, (s, c), in its unit."""
        return [b.excess(r[None])[0] for b, r in zip(self.bounds, trial.read[len(self.targets) :], strict=True)]

    def residual(self, trial: Trial) -> Array:
        """Return residuals whose squares add up to the sum of mean squares of deviation /
        tolerance.
        """
        return _flatten(self.deviations(trial), self.targets)

    def merit(self, trial: Trial) -> float:
        """Return the objective; a bound counts as a target with a hundredth of its tolerance."""
        broken = _flatten([np.maximum(e, 0) for e in self.excesses(trial)], self.bounds)
        return float((self.residual(trial) ** 2).sum() + 1e4 * (broken**2).sum())

    def broken(self, trial: Trial) -> float:
        """Return the largest violation of a bound [tolerances]; 0 if all are kept."""
        return max(
            (float(e.max()) / b.tolerance for e, b in zip(self.excesses(trial), self.bounds, strict=True)), default=0.0
        )

    def off(self, trial: Trial) -> float:
        """Return the largest deviation from a target [tolerances]."""
        pairs = zip(self.deviations(trial), self.targets, strict=True)
        return max(float(np.sqrt((d * d).sum(1)).max()) / t.tolerance for d, t in pairs)

    def done(self, trial: Trial) -> bool:
        """Return whether all targets are met within their tolerances and all bounds are kept."""
        return self.off(trial) <= 1 and self.broken(trial) <= BOUND_TOLERANCE

    def slopes(self, trial: Trial) -> tuple[Array, Array]:
        """Return derivatives of residuals (m, k) and of excesses / tolerances (b, k) by the
        variables.
        """
        read = self.trials.gradient(trial)
        one = [d - d.mean(0, keepdims=True) if t.offset else d for t, d in zip(self.targets, read, strict=False)]
        other = []
        for b, d in zip(self.bounds, read[len(self.targets) :], strict=True):
            sides = [sign * d for end, sign in ((b.least, -1), (b.most, 1)) if np.isfinite(end)]
            other.append(np.concatenate(sides, axis=1))
        return _flatten(one, self.targets, d_by=True), _flatten(other, self.bounds, d_by=True)

    # -- searching -------------------------------------------------------------------------------
    def at(self, u: Array) -> Trial | None:
        """Return the trial at variables u; cached."""
        key = u.tobytes()
        if key not in self.last:
            self.last = {key: self.trials.at(u)}
        return self.last[key]

    def run(self, trial: Trial) -> Trial:
        """Search from a trial and return the last one.

        With bounds the search is a series of least-squares problems with updated multipliers.
        """
        if not self.bounds:
            return self._least(trial, np.zeros(0), 0.0)
        multiplier, weight = np.zeros(len(self._excess(trial))), PENALTY
        worst = np.inf
        for _ in range(MAX_UPDATES):
            trial = self._least(trial, multiplier, weight)
            excess = self._excess(trial)
            change = float(np.maximum(excess, -multiplier / weight).max(initial=0))
            multiplier = np.maximum(0, multiplier + weight * excess)
            if change <= 0.1 * BOUND_TOLERANCE / max(1.0, np.sqrt(len(excess))):
                break
            weight, worst = (10 * weight if change > 0.3 * worst else weight), change
        return trial

    def _excess(self, trial: Trial) -> Array:
        return _flatten(self.excesses(trial), self.bounds)

    def _least(self, trial: Trial, multiplier: Array, weight: float) -> Trial:
        """Minimise the sum of squares of residuals and shifted excesses from a trial."""

        def shifted(one: Trial) -> Array:
            return (
                np.maximum(0, np.sqrt(weight) * self._excess(one) + multiplier / np.sqrt(weight))
                if weight
                else np.zeros(0)
            )

        begun = np.concatenate([self.residual(trial), shifted(trial)])
        if not (np.abs(begun) < MAX_COORDINATE).all():
            raise InvalidRequest(
                f"what is read, less what is wanted, over its tolerance must be numbers below {MAX_COORDINATE:g}"
            )

        def residual(u: Array) -> Array:
            one = self.at(u)
            if one is None:
                return np.full(len(begun), np.nan)  # the step is refused: the trust region shrinks
            if not weight and self.off(one) <= EXACT_DEVIATION:
                raise _Enough(one)
            return np.concatenate([self.residual(one), shifted(one)])

        def jacobian(u: Array) -> Array:
            one = self.at(u)
            assert one is not None
            by, other = self.slopes(one)
            return np.concatenate([by, np.sqrt(weight) * other * (shifted(one) > 0)[:, None]]) if weight else by

        self.last = {trial.u.tobytes(): trial}
        inside = np.clip(trial.u, -1 + 1e-12, 1 - 1e-12)
        if self.at(inside) is None:
            return trial
        try:
            found: Any = least_squares(
                residual, inside, jacobian, (-1, 1), ftol=FTOL, xtol=XTOL, gtol=GTOL, max_nfev=self.steps
            )
        except _Enough as enough:
            return enough.trial
        return self.at(found.x) or trial

    def settled(self, trial: Trial) -> Trial:
        """Move variables near a bound of their box onto it, if the objective allows."""
        u = np.where(np.abs(trial.u) > 1 - 1e-4, np.sign(trial.u), trial.u)
        other = self.at(u) if (u != trial.u).any() else None
        return other if other and self.merit(other) <= self.merit(trial) * (1 + 1e-6) else trial


class _Enough(Exception):
    """Raised when all targets are met exactly."""

    def __init__(self, trial: Trial) -> None:
        self.trial = trial


def _flatten(parts: Sequence[Array], of: Sequence[Target | Bound], d_by: bool = False) -> Array:
    """Flatten parts (s, c), or derivatives (s, c, k), scaled by tolerance and number of poses."""
    scaled = [v / (t.tolerance * np.sqrt(len(v))) for v, t in zip(parts, of, strict=True)]
    if d_by:
        return np.concatenate([v.reshape(-1, v.shape[-1]) for v in scaled]) if scaled else np.zeros((0, 0))
    return np.concatenate([v.ravel() for v in scaled]) if scaled else np.zeros(0)
