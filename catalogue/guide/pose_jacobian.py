"""How the path of a guided point changes with the pivots: first derivatives in closed form.

In the pose z -> z + D + x z, x = exp(i theta) - 1, each dyad (A, w), (A*, w*) demands (see `motion`)

    w w* |D|^2 + 2 Re(conj(w (1 + x) A* - w* A) D) - 2 Re(conj(A) A* x) = 0

for whatever pivots stand in the reference position.  A change of the pivots therefore changes D and theta by a linear
equation of each dyad; the third one keeps the guided point from running along its nominal, so that what is left is its
displacement across, at the same place of the stroke.  No chart enters, and nothing is singular but cusps of the path
and change points.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..kinematics.linkage import Linkage
from ..kinematics.motion import Motion
from ..kinematics.types import Array

#: Coordinates that vary: x and y of A1, A1*, A2, A2* and of the guided point.
COUNT = 10


@dataclass(frozen=True)
class PoseJacobian:
    """How the poses of n guides at m fixed places along their nominals change with the pivots, to first order.

    The last axis holds the derivatives by x and y of A1, A1*, A2, A2*, and the guided point, in the reference position;
    by a pivot at infinity, which turns only, the derivative along its direction is 0.

    Attributes
    ----------
    shift : complex ndarray, shape (m, n, 10)
        Of the displacement D of the pose z -> z + D + x z.
    angle : ndarray, shape (m, n, 10)
        Of the angle of the coupler [rad].
    across : ndarray, shape (m, n, 10)
        Of the distance of the guided point from the nominal, positive to the left.
    """

    shift: Array
    angle: Array
    across: Array

    def every(self, step: int) -> PoseJacobian:
        """Return only every so many places."""
        return PoseJacobian(self.shift[::step], self.angle[::step], self.across[::step])


def pose_jacobian(moving: Motion, point: Array, t: Array, tangent: Array) -> PoseJacobian:
    """Return the derivatives of the poses in which a guided point is at fixed places along its nominal.

    Parameters
    ----------
    moving : Motion of n
    point : complex ndarray, shape (n,)
        Guided points in the reference position.
    t : ndarray, shape (m, n)
        Parameters of the positions.
    tangent : complex ndarray, shape (n,) or (m, n)
        Unit vectors along the nominal at those positions.
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
    _turn_only(linkage, right)
    with np.errstate(all="ignore"):
        pose = _solved(left, right)
        shift, angle = pose[..., 0, :] + 1j * pose[..., 1, :], pose[..., 2, :]
        moved = shift + spin[..., None] * angle
        moved[..., 8:] += turn[..., None] * np.array([1, 1j])
        across = (moved * (-1j * along)[..., None]).real
    return PoseJacobian(shift, angle, across)


def across_nominal(moving: Motion, point: Array, t: Array, tangent: Array) -> Array:
    """Return `PoseJacobian.across` alone."""
    return pose_jacobian(moving, point, t, tangent).across


def _solved(left: Array, right: Array) -> Array:
    """Solve many equations in three unknowns, NaN where they are singular."""
    rows = [left[..., i, :] for i in range(3)]
    cross = np.stack([np.cross(rows[1], rows[2]), np.cross(rows[2], rows[0]), np.cross(rows[0], rows[1])], axis=-1)
    determinant = (rows[0] * cross[..., 0]).sum(-1)
    return np.asarray(cross @ right / determinant[..., None, None])


def _turn_only(linkage: Linkage, by: Array) -> None:
    """Take away from derivatives, in place, the part along the directions of pivots at infinity."""
    for i in (0, 1):
        for j in (0, 1):
            far = ~linkage.finite[:, i, j]
            if far.any():
                k, z = 4 * i + 2 * j, linkage.points[:, i, j][:, None]
                along = by[..., k] * z.real + by[..., k + 1] * z.imag
                by[..., k] -= np.where(far[:, None], along * z.real, 0)
                by[..., k + 1] -= np.where(far[:, None], along * z.imag, 0)


def displaced(linkage: Linkage, point: Array, step: Array) -> tuple[Linkage, Array, Array]:
    """Return linkages and guided points moved by steps (n, 10), those that are valid, and the mask (n,) of them."""
    pivots = linkage.pivots.copy()
    pivots[..., :2] += step[:, :8].reshape(-1, 2, 2, 2)
    made, good = Linkage.valid(pivots)
    return made, (point + step[:, 8] + 1j * step[:, 9])[good], good
