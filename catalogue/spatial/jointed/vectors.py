"""Vectors, rotations and their power series, for batches; vector and matrix axes come last."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...kinematics.types import Array
from ..geometry.power_series import Taylor, coefficients

#: Tensor of the vector product: a vector times it is the skew matrix, row by row.
LEVI_CIVITA = np.zeros((3, 9))
for _i, _j, _k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    LEVI_CIVITA[_i, 3 * _k + _j], LEVI_CIVITA[_i, 3 * _j + _k] = 1, -1
EYE = np.eye(3)


def skew(a: Array) -> Array:
    """Return cross-product matrices (..., 3, 3) of vectors (..., 3)."""
    return np.asarray((a @ LEVI_CIVITA).reshape(*a.shape, 3))


def cross(a: Array, b: Array) -> Array:
    """Return the vector product along the last axis.

    Small arrays use one matrix product each, large ones component by component.
    """
    if a.size + b.size < 512:
        return np.asarray((skew(a) @ b[..., None])[..., 0])
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    (ax, ay, az), (bx, by, bz) = np.moveaxis(a, -1, 0), np.moveaxis(b, -1, 0)
    np.subtract(ay * bz, az * by, out=out[..., 0])
    np.subtract(az * bx, ax * bz, out=out[..., 1])
    np.subtract(ax * by, ay * bx, out=out[..., 2])
    return out


def series(a: Array, b: Array, product: Callable[[Array, Array], Array] = np.multiply) -> Array:
    """Return the product of two series along the first axis."""
    if len(a) == 1:
        return product(a, b)
    return np.stack([sum(product(a[j], b[k - j]) for j in range(k + 1)) for k in range(len(a))])


def dots(a: Array, b: Array) -> Array:
    """Return the scalar products of series of vectors."""
    return np.asarray(series(a, b).sum(-1))


def waves(q: Array) -> tuple[Array, Array]:
    """Return the series of sines and cosines of angles given as series, to multiply matrices."""
    t = Taylor(q)
    return np.sin(t).c[..., None, None], np.cos(t).c[..., None, None]


def cayley(turn: Array) -> Array:
    """Return the series of rotations of Cayley vectors `turn`: 2 tan(angle / 2) along the axis."""
    h = skew(turn / 2)
    square = dots(turn / 2, turn / 2)
    square[0] += 1
    share = coefficients(2.0 / Taylor(square), len(turn) - 1, square.shape[1:])
    out = series(share[..., None, None], h + series(h, h, np.matmul))
    out[0] += np.eye(3)
    return out


def rotation(q: Array) -> Array:
    """Return rotation matrices (..., 3, 3) of unit quaternions (..., 4)."""
    v = q[..., 1:]
    s = q[..., :1, None]
    return np.asarray(2 * (v[..., :, None] * v[..., None, :] + s * skew(v)) + (2 * s * s - 1) * EYE)
