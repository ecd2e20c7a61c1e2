"""Rotations as unit quaternions (4, n), scalar first, with the batch last."""

from __future__ import annotations

import numpy as np

from ...kinematics.types import Array


def matrix(q: Array) -> Array:
    """Return the rotation matrices (3, 3, n) of quaternions (4, n) of any length but 0."""
    s, x, y, z = q
    k = 2 / (q * q).sum(0)
    out = np.empty((3, 3, *q.shape[1:]))
    out[0, 0], out[0, 1], out[0, 2] = 1 - k * (y * y + z * z), k * (x * y - s * z), k * (x * z + s * y)
    out[1, 0], out[1, 1], out[1, 2] = k * (x * y + s * z), 1 - k * (x * x + z * z), k * (y * z - s * x)
    out[2, 0], out[2, 1], out[2, 2] = k * (x * z - s * y), k * (y * z + s * x), 1 - k * (x * x + y * y)
    return out


def turning(q: Array, turn: Array) -> Array:
    """Return the derivative (4, n) of q at angular velocity ``turn`` (3, n)."""
    half, v = turn / 2, q[1:]
    return np.concatenate([-(half * v).sum(0)[None], q[0] * half + cross(half, v)])


def turned(q: Array, turn: Array) -> Array:
    """Return q followed by the Cayley rotation of ``turn`` (3, n).

    To second order ``turn`` is the rotation vector [rad].
    """
    out = q + turning(q, turn)
    return np.asarray(out / np.sqrt((out * out).sum(0)))


def cross(a: Array, b: Array) -> Array:
    """Return the vector product along the first axis."""
    first = a[1] * b[2] - a[2] * b[1]
    out = np.empty((3, *first.shape))
    out[0] = first
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]
    return out


def quaternion(r: Array) -> Array:
    """Return the unit quaternions (4, n) of rotation matrices (3, 3, n), without loss of digits."""
    t = r[0, 0] + r[1, 1] + r[2, 2]
    d = np.stack([t, r[0, 0], r[1, 1], r[2, 2]])
    squares = np.stack([1 + t, *(1 - t + 2 * r[i, i] for i in range(3))])
    a = np.stack([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    b = np.stack([r[2, 1] + r[1, 2], r[0, 2] + r[2, 0], r[1, 0] + r[0, 1]])
    each = np.stack(
        [
            np.stack([squares[0], a[0], a[1], a[2]]),
            np.stack([a[0], squares[1], b[2], b[1]]),
            np.stack([a[1], b[2], squares[2], b[0]]),
            np.stack([a[2], b[1], b[0], squares[3]]),
        ]
    )
    q = each[d.argmax(0), :, np.arange(r.shape[-1])].T
    return np.asarray(q / np.sqrt((q * q).sum(0)))


def fitted(body: Array, world: Array) -> Array:
    """Fit quaternions (4, n) of rotations that carry points onto points, both (p, 3, n).

    Source: Kabsch 1976; the mirror image is excluded, so that a body keeps its handedness.
    """
    from_, to = (v - v.mean(0) for v in (body, world))
    left, _, right = np.linalg.svd(np.einsum("pin,pjn->nij", to, from_))
    right[:, 2] *= np.sign(np.linalg.det(left @ right))[:, None]
    return quaternion(np.moveaxis(left @ right, 0, -1))
