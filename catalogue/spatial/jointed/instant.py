"""How a body moves at an instant while given scalars keep their values: what axes and centres are made of.

The freedoms of a motion span its rates (Hunt, Kinematic Geometry of Mechanisms, ch. 12).  Rows that fix scalars choose
one rate; it counts where the body has no other that keeps them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...errors import InvalidRequest
from ...kinematics.types import Array
from .drives import scalar_function
from .elements import GuideCoordinate, Length, Scalar, identity, title
from .hard_points import HardPoints
from .motion import Motion
from .scalars import ScalarFunction
from .vectors import cross

#: Singular values, and residuals, below this part of the largest are rounding: rates have about 12 digits.
RANK = 1e-8


class Instant(NamedTuple):
    """Motion of a body per unit of a scalar, in the units of the user.

    Attributes
    ----------
    velocity, spin : ndarray, shape (n s, 3)
        Of a point of the body [length], and of the body [rad]; NaN where they are not determined.
    reason : str
        Why any is NaN; empty if none is.
    """

    velocity: Array
    spin: Array
    reason: str


def instant(
    motion: Motion, body: str, at: Array, moving: Scalar, still: Sequence[Scalar], what: str = "the body"
) -> Instant:
    """Compute the motion of a body per unit of a scalar while others keep their values.

    Parameters
    ----------
    motion : Motion
    body : str
    at : ndarray, shape (n s, 3)
        The point of the body, where it is in each pose [length].
    moving : scalar
    still : sequence of scalars
        Any number, also more than there are freedoms if they can all keep their values together.
    what : str
        The body as `reason` calls it.

    Returns
    -------
    Instant
    """
    basis, system = motion.basis(), motion.curve.system
    twists = _twists(motion, basis, motion.body_number(body))
    rows = np.stack([gradient(motion, s, basis) for s in (moving, *still)], axis=1)
    size = np.sqrt((rows * rows).sum(2, keepdims=True))
    good = np.isfinite(rows).all((1, 2)) & np.isfinite(twists).all((1, 2))
    rate, stray = np.full((len(rows), basis.shape[2]), np.nan), np.zeros(len(rows), bool)
    moves = good & (size[:, 0, 0] > RANK)
    scaled = rows[moves] / np.where(size[moves] > RANK, size[moves], 1)
    rate[moves], can, free = _chosen(scaled, 1 / size[moves, 0, 0])
    reach = np.sqrt((twists[moves] ** 2).sum((1, 2)))
    stray[moves] = np.sqrt(((twists[moves] @ free) ** 2).sum((1, 2))) > RANK * reach
    possible = moves.copy()
    possible[moves] = can
    rate[~possible | stray] = np.nan
    twist = (twists @ rate[..., None])[..., 0]
    unit = system.unit / _function(motion, moving)[0].unit
    local = (at - system.centre) / system.unit
    velocity, spin = (twist[:, :3] + cross(twist[:, 3:], local)) * unit, twist[:, 3:] * (unit / system.unit)
    told = ", ".join(title(s) for s in still) or "nothing"
    reason = ""
    if (good & ~possible).any():
        reason = f"{title(moving)} cannot move while {told} stands still"
    elif (possible & stray).any():
        reason = f"{what} is still free while {title(moving)} moves and {told} stands still: hold more"
    return Instant(velocity, spin, reason)


def _chosen(rows: Array, first: Array) -> tuple[Array, Array, Array]:
    """Return rates (n, f) at which the first of unit rows (n, k, f) moves, which can, and what they leave free."""
    u, s, v = np.linalg.svd(rows, full_matrices=False)
    keep = s > RANK
    share = np.where(keep, u[:, 0] / np.where(keep, s, 1), 0.0)
    rate = (share[:, None] @ v)[:, 0] * first[:, None]
    goal = np.zeros(rows.shape[:2])
    goal[:, 0] = first
    missed = np.abs((rows @ rate[..., None])[..., 0] - goal).max(1)
    free = np.eye(rows.shape[2]) - np.swapaxes(v, 1, 2) @ (keep[..., None] * v)
    return rate, missed <= RANK * first, free


def _twists(motion: Motion, basis: Array, b: int) -> Array:
    """Return twists (n s, 6, f) of a body, velocity of the origin first, per unit of each freedom."""
    carried = motion.carries(b)[:, None] * basis
    return np.asarray(np.swapaxes(motion.screws(), 1, 2) @ carried)


def gradient(motion: Motion, scalar: Scalar, basis: Array) -> Array:
    """Return rates (n s, f) of a scalar per unit of each freedom, without dimensions."""
    stated = [identity(s) for s in motion.scalars]
    if identity(scalar) in stated:
        row = np.eye(len(stated))[stated.index(identity(scalar))]
        return np.where(np.isfinite(basis).all(1), row, np.nan)
    if isinstance(scalar, GuideCoordinate) or (isinstance(scalar, Length) and scalar.link):
        raise InvalidRequest(f"{title(scalar)} is neither driven nor held in this motion: give two points instead")
    function, points = _function(motion, scalar)
    if function.unknown is not None:
        return np.asarray(basis[:, function.unknown])
    first, second = (_twists(motion, basis, b) for b in function.bodies)
    wrench = function.wrench(*_attached(motion, points))
    return np.asarray((wrench[:, None] @ (second - first))[:, 0])


def _function(motion: Motion, scalar: Scalar) -> tuple[ScalarFunction, HardPoints]:
    """Return a scalar as a function of the pose, and the points and directions on which it is."""
    made = motion.formulation()
    made.points = HardPoints()
    return scalar_function(scalar, made), made.points


def _attached(motion: Motion, points: HardPoints) -> tuple[Array, Array]:
    """Return where points (n s, e, 3) and directions (n s, v, 3) of bodies are, without dimensions."""
    system = motion.curve.system
    rotation, shift = (v[0] for v in motion.poses())
    ends = [
        (rotation[:, b] @ ((motion.each(points.points[p], "a point") - system.centre) / system.unit)[..., None])[..., 0]
        + shift[:, b]
        for b, p in points.ends
    ]
    vectors = [
        (rotation[:, b] @ motion.each(points.directions[d], "a direction")[..., None])[..., 0]
        for b, d in points.vectors
    ]
    nothing = np.zeros((len(rotation), 0, 3))
    return np.stack(ends, axis=1) if ends else nothing, np.stack(vectors, axis=1) if vectors else nothing
