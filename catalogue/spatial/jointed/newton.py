"""Newton's method onto the curve of poses: across it, or to where the drive has given values."""

from __future__ import annotations

import numpy as np

from ...kinematics.types import Array
from . import compiled
from .curve import Curve, around

#: A Newton step below this is the last: the next would be less than a rounding error.
LAST = 1e-8
#: A pose that is farther than this from where it was looked for is that of another assembly.
NEAR = 0.05
#: A pose is found if its last Newton step is no larger.
ENOUGH = 1e-6
#: Poses that are corrected together: their arrays stay in the cache.
BLOCK = 2048


def accuracy() -> tuple[float, float, float]:
    """Return the constants of a pose, as the kernel takes them."""
    return LAST, NEAR, ENOUGH


def solve(a: Array, b: Array) -> Array:
    try:
        return np.asarray(np.linalg.solve(a, b))
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.pinv(a) @ b)


def newton_step(f: Array, j: Array, tangent: Array) -> tuple[Array, Array]:
    """Return Newton's step across a tangent, and the unit vector along the curve."""
    right = np.zeros((*tangent.shape, 2))
    right[:, :-1, 0], right[:, -1, 1] = -f, 1
    z = solve(np.concatenate([j, tangent[:, None]], axis=1), right)
    off, new = z[..., 0], z[..., 1]
    return off, new / np.sqrt((new * new).sum(1, keepdims=True))


def across(curve: Curve, y: Array, tangent: Array) -> tuple[Array, Array, Array]:
    """Return states corrected across tangents (n, m), the tangents there and the slope of the drive."""
    y = curve.system.unitary(y)
    curve = curve.selected(y)
    for _ in range(8):
        f, j, _, by = curve(y)
        off, new = newton_step(f, j, tangent)
        y = curve.system.moved(y, off)
        if not np.abs(off).max() > LAST:
            break
    return y, new, (new * by).sum(1)


def solved(curve: Curve, y: Array, target: Array) -> tuple[Array, Array]:
    """Correct states (n, numbers) so that the drive has given values (n,); return them and where that was possible."""
    if curve.system.fast:
        out, good, singular = compiled.solved(curve.system.fast, curve.held, y, target, accuracy())
        if singular.any():
            some = np.flatnonzero(singular)
            out[some], good[some] = _solved(curve.take(some), y[some], target[some])
        return out, good
    return _solved(curve, y, target)


def _solved(curve: Curve, y: Array, target: Array) -> tuple[Array, Array]:
    """The same by numpy."""
    y = curve.system.unitary(y)
    found = np.zeros(len(y), bool)
    for low in range(0, len(y), BLOCK):
        some = np.arange(low, min(low + BLOCK, len(y)))
        sub = curve.take(some).selected(y[some])
        at, periodic = y[some], curve.system.scalars[-1].periodic
        near = np.ones(len(some), bool)
        for k in range(8):
            f, j, value, by = sub(at)
            off = value - target[some]
            right = -np.concatenate([f, (around(off) if periodic else off)[:, None]], axis=1)
            step = solve(np.concatenate([j, by[:, None]], axis=1), right[..., None])[..., 0]
            with np.errstate(all="ignore"):
                size = np.abs(step).max(1)
                at = curve.system.moved(at, step)
            near &= (size <= NEAR) | (k > 0)
            if not (size > LAST).any():
                break
        y[some], found[some] = at, (size <= ENOUGH) & near
    return y, found


def _rough(a: Array, b: Array) -> Array:
    """Solve equations (n, k, m) with as many unknowns or fewer, by least squares if fewer: no pose is near."""
    return solve(a, b[..., None])[..., 0] if a.shape[1] == a.shape[2] else (np.linalg.pinv(a) @ b[..., None])[..., 0]


def newton(curve: Curve, y: Array, target: Array, steps: int = 60) -> tuple[Array, Array]:
    """Solve from rough states (n, numbers), damped; return states and where that was possible."""
    y, periodic = y.copy(), curve.system.scalars[-1].periodic
    open_ = np.arange(len(y))
    found = np.zeros(len(y), bool)
    for _ in range(steps):
        sub = curve.take(open_)
        f, j, value, by = sub.every(y[open_])
        off = value - target[open_]
        right = -np.concatenate([f, (around(off) if periodic else off)[:, None]], axis=1)
        with np.errstate(all="ignore"):
            step = _rough(np.concatenate([j, by[:, None]], axis=1), right)
            size = np.sqrt((step * step).sum(1))
            step *= np.minimum(1, 0.7 / size)[:, None]
        y[open_] = curve.system.unitary(curve.system.moved(y[open_], np.nan_to_num(step)))
        found[open_] = size < LAST
        open_ = open_[~(size < LAST) & np.isfinite(size)]
        if not len(open_):
            break
    return y, found
