"""How the path of a guided point changes with the pivots: first derivatives in closed form.

In the pose z -> z + D + x z, x = exp(i theta) - 1, each dyad (A, w), (A*, w*) demands (see `motion`)

    w w* |D|^2 + 2 Re(conj(w (1 + x) A* - w* A) D) - 2 Re(conj(A) A* x) = 0

for whatever pivots stand in the reference position.  A change of the pivots therefore changes D and theta by a linear
equation of each dyad; the third one keeps the guided point from running along its nominal, so that what is left is its
displacement across, at the same place of the stroke.  No chart enters, and nothing is singular but cusps of the path
and change points.
"""

from __future__ import annotations

import numpy as np

from ..linkage import Array, Linkage
from ..motion import Motion

#: Coordinates that vary: x and y of A1, A1*, A2, A2* and of the guided point.
COUNT = 10


def across_nominal(moving: Motion, point: Array, t: Array, tangent: Array) -> Array:
    """Return the derivatives of the distance of a guided point from its nominal, at fixed places along it.

    Parameters
    ----------
    moving : Motion of n
    point : complex ndarray, shape (n,)
        Guided points in the reference position.
    t : ndarray, shape (m, n)
        Parameters of the positions.
    tangent : complex ndarray, shape (n,) or (m, n)
        Unit vectors along the nominal at those positions.

    Returns
    -------
    ndarray, shape (m, n, 10)
        By x and y of A1, A1*, A2, A2*, and the guided point, in the reference position; distances are positive to the
        left.  A pivot at infinity turns only: of its direction the derivative along it is 0.
    """
    linkage = moving.linkage
    d, x = moving.pose(t)
    d = d - x * moving.origin
    turn = 1 + x
    tangent = np.broadcast_to(tangent, t.shape)
    spin = 1j * turn * point  # of the guided point, by theta
    left = np.empty((*t.shape, 3, 3))
    right = np.zeros((*t.shape, 3, COUNT))
    for i in (0, 1):
        (a, b), (w, v) = linkage.points[:, i].T, linkage.finite[:, i].T.astype(float)
        normal = w * v * d + w * turn * b - v * a
        by_theta = (np.conj(w * b * 1j * turn) * d).real - (np.conj(a) * b * 1j * turn).real
        left[..., i, :] = np.stack([normal.real, normal.imag, by_theta], axis=-1)
        by_fixed, by_moving = -(v * d + b * x), w * np.conj(turn) * d - a * np.conj(x)
        for k, by in ((4 * i, by_fixed), (4 * i + 2, by_moving)):
            right[..., i, k], right[..., i, k + 1] = -by.real, -by.imag
    along = np.conj(tangent)
    left[..., 2, :] = np.stack([tangent.real, tangent.imag, (along * spin).real], axis=-1)
    carried = along * turn  # of the point itself
    right[..., 2, 8], right[..., 2, 9] = -carried.real, carried.imag
    normal = 1j * tangent
    across = np.conj(normal)
    with np.errstate(all="ignore"):
        pose = _solved(left, right)
        out = normal.real[..., None] * pose[..., 0, :] + normal.imag[..., None] * pose[..., 1, :]
        out += (across * spin).real[..., None] * pose[..., 2, :]
    out[..., 8] += (across * turn).real
    out[..., 9] -= (across * turn).imag
    return _turning_only(linkage, out)


def _solved(left: Array, right: Array) -> Array:
    """Solve many equations in three unknowns, NaN where they are singular."""
    rows = [left[..., i, :] for i in range(3)]
    cross = np.stack([np.cross(rows[1], rows[2]), np.cross(rows[2], rows[0]), np.cross(rows[0], rows[1])], axis=-1)
    determinant = (rows[0] * cross[..., 0]).sum(-1)
    return np.asarray(cross @ right / determinant[..., None, None])


def _turning_only(linkage: Linkage, by: Array) -> Array:
    """Return derivatives whose part along the directions of pivots at infinity is taken away."""
    for i in (0, 1):
        for j in (0, 1):
            k, z = 4 * i + 2 * j, linkage.points[:, i, j]
            far = ~linkage.finite[:, i, j]
            along = by[..., k] * z.real + by[..., k + 1] * z.imag
            by[..., k] -= np.where(far, along * z.real, 0)
            by[..., k + 1] -= np.where(far, along * z.imag, 0)
    return by


def displaced(linkage: Linkage, point: Array, step: Array) -> tuple[Linkage, Array, Array]:
    """Return linkages and guided points moved by steps (n, 10), those that are valid, and the mask (n,) of them."""
    pivots = linkage.pivots.copy()
    pivots[..., :2] += step[:, :8].reshape(-1, 2, 2, 2)
    made, good = Linkage.valid(pivots)
    return made, (point + step[:, 8] + 1j * step[:, 9])[good], good
