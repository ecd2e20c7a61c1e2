"""Solve for poses at given values of the drive, from near or rough states."""

from __future__ import annotations

import numpy as np

from ...kinematics.types import Array
from ..continuation.curve import around
from ..continuation.newton import LAST, Accuracy, corrected, solve
from . import compiled
from .curve import Curve

#: Accuracy of poses; a pose farther than 0.05 from its start is another assembly.
ACCURACY = Accuracy(last=LAST, near=0.05, enough=1e-6)
#: Poses corrected together: their arrays fit in the cache.
BLOCK = 2048


def solved(curve: Curve, y: Array, target: Array) -> tuple[Array, Array]:
    """Solve for states (n, numbers) at values (n,) of the drive; return them and success (n,)."""
    if curve.system.fast:
        out, good, singular = compiled.solved(curve.system.fast, curve.held, y, target, ACCURACY)
        if singular.any():
            some = np.flatnonzero(singular)
            out[some], good[some] = _solve_in_blocks(curve.take(some), y[some], target[some])
        return out, good
    return _solve_in_blocks(curve, y, target)


def _solve_in_blocks(curve: Curve, y: Array, target: Array) -> tuple[Array, Array]:
    """Solve by numpy, in blocks; see `solved`."""
    out, found = np.empty_like(y), np.zeros(len(y), bool)
    for low in range(0, len(y), BLOCK):
        some = np.arange(low, min(low + BLOCK, len(y)))
        out[some], found[some] = corrected(curve.take(some), y[some], target[some], ACCURACY)
    return out, found


def _least_squares(a: Array, b: Array) -> Array:
    """Solve linear equations (n, k, m), by least squares if not square."""
    return solve(a, b[..., None])[..., 0] if a.shape[1] == a.shape[2] else (np.linalg.pinv(a) @ b[..., None])[..., 0]


def newton(curve: Curve, y: Array, target: Array, steps: int = 60) -> tuple[Array, Array]:
    """Solve from rough states (n, numbers) by a damped method; return states and success."""
    y, periodic = y.copy(), curve.system.scalars[-1].periodic
    open_ = np.arange(len(y))
    found = np.zeros(len(y), bool)
    for _ in range(steps):
        sub = curve.take(open_)
        f, j, value, by = sub.every(y[open_])
        off = value - target[open_]
        right = -np.concatenate([f, (around(off) if periodic else off)[:, None]], axis=1)
        with np.errstate(all="ignore"):
            step = _least_squares(np.concatenate([j, by[:, None]], axis=1), right)
            size = np.sqrt((step * step).sum(1))
            step *= np.minimum(1, 0.7 / size)[:, None]
        y[open_] = curve.system.unitary(curve.system.moved(y[open_], np.nan_to_num(step)))
        found[open_] = size < LAST
        open_ = open_[~(size < LAST) & np.isfinite(size)]
        if not len(open_):
            break
    return y, found
