"""The least-squares search: hard points inside boxes, so that targets are met best and bounds are
kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from ...errors import InvalidRequest, NotMovable
from ...given import instance, several, whole
from ...kinematics.types import Array
from ..jointed.hard_points import FAR
from ..jointed.mechanism import Mechanism
from .boxes import Box, Variables
from .outcome import KEPT, Fit
from .targets import Bound, Target
from .trials import Trial, Trials

#: Change of the sum of squares at which a search stops.
FTOL = 1e-8
#: Change of the variables at which a search stops.
XTOL = 1e-13
#: Gradient at which a search stops.
GTOL = 1e-15
#: Part of the tolerances below which all deviations count as none: the search is over.
ENOUGH = 1e-6
#: Updates of the multipliers of bounds.
ROUNDS = 20
#: First weight of bounds.
WEIGHT = 100.0
#: Starts at most.
MOST = 1_000_000
#: How many of the starts are searched from, besides the mechanism as it was given.
SEARCHED = 2


def fit(
    mechanism: Mechanism,
    targets: Sequence[Target],
    boxes: Sequence[Box],
    bounds: Sequence[Bound] = (),
    starts: int = 16,
    steps: int = 50,
    seed: int = 1,
) -> Fit:
    """Move hard points inside boxes so that curves are met best.

    The sum over targets of the mean square of their deviations, each over its tolerance, becomes
    least (trust regions, `scipy.optimize.least_squares`); bounds are kept by multipliers (Powell,
    Hestenes).  Every trial is swept from its own design pose: one that a sweep does not get
    through, or whose design pose is on the other side of a singular one, is refused and counted.
    The mechanism as given is searched from first; if a target or a bound is then missed, the best
    of other starts in the boxes are, too.  Of many solutions one nearby is found.  Points that are
    read off, such as the centre of a wheel, keep their places in the design pose.

    Parameters
    ----------
    mechanism : Mechanism
    targets : sequence of Target
    boxes : sequence of Box
        Hard points that may move; all others stay.
    bounds : sequence of Bound, optional
    starts : int
        Points in the boxes from which a search may begin, the given one among them.
    steps : int
        Trials in one search at most.
    seed : int
        Of the other starts.

    Raises
    ------
    InvalidRequest
        If a name, a size, a value or a reading means nothing.
    NotMovable
        If neither the mechanism as given nor any other start gets through all sweeps.
    """
    targets, bounds = several("targets", targets, Target), several("bounds", bounds, Bound)
    starts, steps, seed = whole("starts", starts, 1, MOST), whole("steps", steps, 1), whole("seed", seed, 0)
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
        for other in others[:SEARCHED]:
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
    """Residuals, their derivatives, and searches with them."""

    def __init__(self, trials: Trials, targets: Sequence[Target], bounds: Sequence[Bound], steps: int) -> None:
        self.trials, self.targets, self.bounds, self.steps = trials, tuple(targets), tuple(bounds), steps
        self.last: dict[bytes, Trial | None] = {}

    # -- what counts -----------------------------------------------------------------------------
    def deviations(self, trial: Trial) -> list[Array]:
        """Return deviations from each target (s, c), in its unit."""
        return [t.deviations(r[None])[0] for t, r in zip(self.targets, trial.read, strict=False)]

    def excesses(self, trial: Trial) -> list[Array]:
        """Return by how much each bound is broken, (s, c), in its unit."""
        return [b.excess(r[None])[0] for b, r in zip(self.bounds, trial.read[len(self.targets) :], strict=True)]

    def residual(self, trial: Trial) -> Array:
        """Return deviations over tolerances, so that their squares add up to the sum of mean
        squares.
        """
        return _flat(self.deviations(trial), self.targets)

    def merit(self, trial: Trial) -> float:
        """Return the objective: bounds count as targets of a hundredth of the tolerance."""
        broken = _flat([np.maximum(e, 0) for e in self.excesses(trial)], self.bounds)
        return float((self.residual(trial) ** 2).sum() + 1e4 * (broken**2).sum())

    def broken(self, trial: Trial) -> float:
        """Return the largest excess of a bound, in its tolerance, 0 if all are kept."""
        return max(
            (float(e.max()) / b.tolerance for e, b in zip(self.excesses(trial), self.bounds, strict=True)), default=0.0
        )

    def off(self, trial: Trial) -> float:
        """Return the largest deviation from a target, in its tolerance."""
        pairs = zip(self.deviations(trial), self.targets, strict=True)
        return max(float(np.sqrt((d * d).sum(1)).max()) / t.tolerance for d, t in pairs)

    def done(self, trial: Trial) -> bool:
        """Return whether all targets are met within their tolerances and all bounds are kept."""
        return self.off(trial) <= 1 and self.broken(trial) <= KEPT

    def slopes(self, trial: Trial) -> tuple[Array, Array]:
        """Return derivatives of residuals, and of excesses over tolerances, by the variables: (m,
        k), (b, k).
        """
        read = self.trials.gradient(trial)
        one = [d - d.mean(0, keepdims=True) if t.offset else d for t, d in zip(self.targets, read, strict=False)]
        other = []
        for b, d in zip(self.bounds, read[len(self.targets) :], strict=True):
            sides = [sign * d for end, sign in ((b.least, -1), (b.most, 1)) if np.isfinite(end)]
            other.append(np.concatenate(sides, axis=1))
        return _flat(one, self.targets, d_by=True), _flat(other, self.bounds, d_by=True)

    # -- searching -------------------------------------------------------------------------------
    def at(self, u: Array) -> Trial | None:
        """Return the trial at variables, made once."""
        key = u.tobytes()
        if key not in self.last:
            self.last = {key: self.trials.at(u)}
        return self.last[key]

    def run(self, trial: Trial) -> Trial:
        """Return where a search from a trial ends: one least-squares problem, or several with
        multipliers of bounds.
        """
        if not self.bounds:
            return self._least(trial, np.zeros(0), 0.0)
        multiplier, weight = np.zeros(len(self._excess(trial))), WEIGHT
        worst = np.inf
        for _ in range(ROUNDS):
            trial = self._least(trial, multiplier, weight)
            excess = self._excess(trial)
            change = float(np.maximum(excess, -multiplier / weight).max(initial=0))
            multiplier = np.maximum(0, multiplier + weight * excess)
            if change <= 0.1 * KEPT / max(1.0, np.sqrt(len(excess))):
                break
            weight, worst = (10 * weight if change > 0.3 * worst else weight), change
        return trial

    def _excess(self, trial: Trial) -> Array:
        return _flat(self.excesses(trial), self.bounds)

    def _least(self, trial: Trial, multiplier: Array, weight: float) -> Trial:
        """Minimise the sum of squares of residuals and shifted excesses from a trial."""

        def shifted(one: Trial) -> Array:
            return (
                np.maximum(0, np.sqrt(weight) * self._excess(one) + multiplier / np.sqrt(weight))
                if weight
                else np.zeros(0)
            )

        begun = np.concatenate([self.residual(trial), shifted(trial)])
        if not (np.abs(begun) < FAR).all():
            raise InvalidRequest(f"what is read, less what is wanted, over its tolerance must be numbers below {FAR:g}")

        def residual(u: Array) -> Array:
            one = self.at(u)
            if one is None:
                return np.full(len(begun), np.nan)  # a step that is refused: the trust region shrinks
            if not weight and self.off(one) <= ENOUGH:
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
        """Move variables next to an end of their boxes there, if that costs nothing."""
        u = np.where(np.abs(trial.u) > 1 - 1e-4, np.sign(trial.u), trial.u)
        other = self.at(u) if (u != trial.u).any() else None
        return other if other and self.merit(other) <= self.merit(trial) * (1 + 1e-6) else trial


class _Enough(Exception):
    """All targets are met exactly."""

    def __init__(self, trial: Trial) -> None:
        self.trial = trial


def _flat(parts: Sequence[Array], of: Sequence[Target | Bound], d_by: bool = False) -> Array:
    """Scale parts (s, c), or derivatives (s, c, k), by tolerance and number of poses, flat."""
    scaled = [v / (t.tolerance * np.sqrt(len(v))) for v, t in zip(parts, of, strict=True)]
    if d_by:
        return np.concatenate([v.reshape(-1, v.shape[-1]) for v in scaled]) if scaled else np.zeros((0, 0))
    return np.concatenate([v.ravel() for v in scaled]) if scaled else np.zeros(0)
