"""Correct states onto curves of poses, across the tangent or at given values of the drive."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...kinematics.types import Array
from . import elimination
from .curve import Curve, around

#: Size of a Newton step at which the iteration stops: the next step would be rounding.
LAST = 1e-8


class Accuracy(NamedTuple):
    """Step sizes of Newton's method on poses [rad, units]."""

    last: float  # size of a step at which the iteration stops
    near: float | Array  # largest first step; a pose farther away is another assembly
    enough: float  # largest final step with which a pose still counts as a solution


def newton_step(f: Array, j: Array, tangent: Array, signed: bool = False) -> tuple[Array, Array, Array]:
    """Solve for Newton's step across a tangent.

    Returns
    -------
    step : ndarray, shape (n, m)
    along : ndarray, shape (n, m)
        Unit vector along the curve, on the side of the tangent.
    sign : ndarray, shape (n,)
        Sign of the determinant of the Jacobian bordered by `tangent`, if `signed`; 0 where
        singular.
    """
    bordered = np.concatenate([j, tangent[:, None]], axis=1)
    right = np.zeros((*tangent.shape, 2))
    right[:, :-1, 0], right[:, -1, 1] = -f, 1
    if len(f) <= elimination.MAX_LAPACK:
        z, sign = solve(bordered, right), np.linalg.slogdet(bordered)[0] if signed else right[:, 0, 1]
    else:
        z, sign = elimination.solve(np.moveaxis(bordered, 0, -1), np.moveaxis(right, 0, -1))
        z = np.moveaxis(z, -1, 0)
        singular = np.flatnonzero((sign == 0) & np.isfinite(bordered).all((1, 2)))
        if len(singular):
            z[singular] = np.linalg.pinv(bordered[singular]) @ right[singular]
    off, along = z[..., 0], z[..., 1]
    return off, along / np.sqrt((along * along).sum(1, keepdims=True)), sign


def across(curve: Curve, y: Array, tangent: Array) -> tuple[Array, Array, Array]:
    """Correct states across tangents (n, m); return them, new tangents and slopes of the drive."""
    y = curve.unitary(y)
    curve = curve.selected(y)
    for _ in range(8):
        f, j, _, by = curve(y)
        off, along, _ = newton_step(f, j, tangent)
        y = curve.moved(y, off)
        if not np.abs(off).max() > LAST:
            break
    return y, along, (along * by).sum(1)


def corrected(curve: Curve, y: Array, target: Array, accuracy: Accuracy) -> tuple[Array, Array]:
    """Solve for states (n, numbers) at values (n,) of the drive; return them and success (n,)."""
    y = curve.unitary(y)
    curve = curve.selected(y)
    near, size = np.ones(len(y), bool), np.zeros(len(y))
    for k in range(8):
        f, j, value, by = curve(y)
        off = value - target
        right = -np.concatenate([f, (around(off) if curve.periodic else off)[:, None]], axis=1)
        step = solve(np.concatenate([j, by[:, None]], axis=1), right[..., None])[..., 0]
        with np.errstate(all="ignore"):
            size = np.abs(step).max(1)
            y = curve.moved(y, step)
        near &= (size <= accuracy.near) | (k > 0)
        if not (size > accuracy.last).any():
            break
    return y, (size <= accuracy.enough) & near


def solve(a: Array, b: Array) -> Array:
    """Solve linear systems (n, m, m), by least squares if one is singular."""
    try:
        return np.asarray(np.linalg.solve(a, b))
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.pinv(a) @ b)
