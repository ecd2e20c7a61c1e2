"""Damped Newton method for a batch; each mechanism has its own step length and end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...kinematics.types import Array
from ..continuation.elimination import solve
from ..continuation.newton import LAST
from .equations import System
from .unknowns import Equations, moved

#: Least attainable residual [largest lengths of the mechanism].
NOISE = 8 * float(np.finfo(float).eps)
#: Largest step [rad, units].
MAX_STEP = 0.7
#: Shortest fraction of a step that is tried.
MIN_FRACTION = 2.0**-12
#: Steps after which a start is abandoned.
MAX_STEPS = 60


@dataclass(frozen=True)
class Root:
    """Result of Newton's method: states (4 + f, n), success (n,) and counts of evaluations (n,)."""

    state: Array
    found: Array
    evaluations: Array


def newton(system: System, start: Array, q: Array, steps: int = MAX_STEPS) -> Root:
    """Solve the equations from a start at the driver values q (k, n).

    A step is shortened to `MAX_STEP`, then halved until the residual falls by a quarter of the
    predicted decrease.  A root is found if the last full step is below `LAST`, or if the residual
    is noise and steps no longer shrink, as near a singular position.
    """
    n = len(system)
    state = start.copy()
    found, evaluations = np.zeros(n, bool), np.zeros(n, int)
    who, sub, values = np.arange(n), system, q
    at = start.copy()
    now = sub.evaluate(at, values)
    step, length = _step(now)
    part, before = _first_factor(length), np.full(n, np.inf)
    for _ in range(steps):
        with np.errstate(invalid="ignore"):
            trial = moved(at, part * step, now.metric)
        then = sub.evaluate(trial, values)
        evaluations[who] += 1
        noise = NOISE * sub.reach
        with np.errstate(invalid="ignore"):
            last = (part == 1) & ((length < LAST) | ((now.distance < noise) & (length > 0.3 * before)))
            better = np.linalg.norm(then.residual, axis=0) <= (1 - part / 4) * np.linalg.norm(now.residual, axis=0)
            better |= (then.distance < noise) | last
        stop = last | (part < MIN_FRACTION) | ~np.isfinite(length)
        at[:, better] = trial[:, better]
        next_step, next_length = _step(then)
        before = np.where(better, length, before)
        step, length = np.where(better, next_step, step), np.where(better, next_length, length)
        now = Equations(*(np.where(better, new, old) for new, old in zip(then, now, strict=True)))
        part = np.where(better, _first_factor(length), part / 2)
        if stop.any():
            done = np.flatnonzero(stop)
            state[:, who[done]] = at[:, done]
            found[who[done]] = last[done] & np.isfinite(at[:4, done]).all(0)
            keep = np.flatnonzero(~stop)
            if not len(keep):
                break
            who, sub, at, values = who[keep], sub.take(keep), at[:, keep], values[:, keep]
            step, length, part, before = step[:, keep], length[keep], part[keep], before[keep]
            now = Equations(*(v[..., keep] for v in now))
    else:
        state[:, who] = at
    return Root(state, found, evaluations)


def _step(now: Equations) -> tuple[Array, Array]:
    step = -solve(now.jacobian, now.residual[:, None])[0][:, 0]
    with np.errstate(all="ignore"):
        return step, np.sqrt((step**2).sum(0))


def _first_factor(length: Array) -> Array:
    with np.errstate(all="ignore"):
        return np.minimum(1, MAX_STEP / length)
