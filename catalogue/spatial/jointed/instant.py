"""Instantaneous motion of a body while given scalars are held, for axes and centres.

The freedoms of a motion span its rates (Hunt, Kinematic Geometry of Mechanisms, ch. 12).  Held
scalars select one rate; the motion is determined where no other rate of the body keeps them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ...errors import InvalidRequest
from ...kinematics.types import Array
from ..geometry.rotation import cross
from .curve import pivots
from .elements import GuideCoordinate, Length, Scalar, Sum, expand_sums, identity, title
from .hard_points import HardPoints
from .motion import Motion
from .scalars import ScalarFunction

#: Ratio to the largest below which singular values and residuals are rounding: rates have about 12
#: digits.
RANK_TOLERANCE = 1e-8
#: Least determinant of unit rows for a direct solution, without singular values: rates keep their
#: digits.
MIN_DETERMINANT = 1e-3


class Instant(NamedTuple):
    """Motion of a body per unit of a scalar, in the units of the user.

    Attributes
    ----------
    velocity, spin : ndarray, shape (3, n s)
        Velocity of a point [length] and angular velocity of the body [rad]; NaN if not determined.
    reason : str
        Reason for any NaN; empty without NaN.
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
    at : ndarray, shape (3, n s)
        Position of the point of the body in each pose [length].
    moving : scalar
    still : sequence of scalars
        Held scalars; more than the freedoms are permitted if they are compatible.
    what : str
        Name of the body in `reason`.

    Returns
    -------
    Instant
    """
    system, twists = motion.curve.system, motion.twists()[:, motion.body_number(body)]
    rates, reason = _rates_along(motion, twists, moving, still, what)
    unit = system.unit / motion.function(moving)[0].unit
    twist = rates.T * unit
    local = at / system.unit - (system.centre / system.unit)[:, None]
    return Instant(twist[:3] + cross(twist[3:], local), twist[3:] / system.unit, reason)


def ratio(motion: Motion, scalar: Scalar, moving: Scalar, still: Sequence[Scalar]) -> tuple[Array, str]:
    """Compute the rate of a scalar per unit of another; the scalars `still` are held.

    Returns
    -------
    rates : ndarray, shape (n s,)
        In the units of both scalars, length or radians.
    reason : str
    """
    units = [motion.function(s)[0].unit for s in (scalar, moving)]
    rate, reason = _rates_along(motion, gradient(motion, scalar)[:, None], moving, still, title(scalar))
    return rate[:, 0] * (units[0] / units[1]), reason


def value(motion: Motion, scalar: Scalar) -> Array:
    """Evaluate any scalar over a motion, (n s,) [length or rad]."""
    curve, y = motion.flat()
    stated = motion.stated
    if identity(scalar) in stated:
        k = stated.index(identity(scalar))
        return np.asarray(curve.values(y)[:, k] * curve.system.scalars[k].unit)
    function, points = _function(motion, scalar)
    x, d = _place_attached(motion, points)
    return np.asarray(function.value(x[None], d[None], y[None])[0] * function.unit)


def _rates_along(
    motion: Motion, readings: Array, moving: Scalar, still: Sequence[Scalar], what: str
) -> tuple[Array, str]:
    """Compute rates (n, r) of readings (n, r, f) per unit of a scalar, `still` held.

    Return the rates, and the reason for any NaN.
    """
    quick = _rates_by_names(motion, moving, still)
    if quick is not None:
        return np.asarray(quick(readings)), ""
    rows = np.stack([gradient(motion, s) for s in (moving, *still, *motion.mechanism.couplings)], axis=1)
    size = np.sqrt(np.einsum("nkf,nkf->nk", rows, rows))
    rate, stray = np.full((len(rows), rows.shape[2]), np.nan), np.zeros(len(rows), bool)
    known = np.isfinite(size).all(1)
    moves = known & (size[:, 0] > RANK_TOLERANCE)
    if moves.any():
        some = slice(None) if moves.all() else np.flatnonzero(moves)
        scaled = rows[some] / np.where(size[some] > RANK_TOLERANCE, size[some], 1)[..., None]
        rate[some], moves[some], free = _solve_rates(scaled, 1 / size[some, 0])
        if free is not None:
            strays = np.sqrt(((readings[some] @ free) ** 2).sum((1, 2)))
            stray[some] = strays > RANK_TOLERANCE * np.sqrt((readings[some] ** 2).sum((1, 2)))
    rate[~moves | stray] = np.nan
    told = ", ".join(title(s) for s in still) or "nothing"
    reason = ""
    if (known & ~moves).any():
        reason = f"{title(moving)} cannot move while {told} stands still"
    elif (moves & stray).any():
        reason = f"{what} is still free while {title(moving)} moves and {told} stands still: hold more"
    return (readings @ rate[..., None])[..., 0], reason


def _rates_by_names(motion: Motion, moving: Scalar, still: Sequence[Scalar]) -> Callable[[Array], Array] | None:
    """Return a function from readings (n, r, f) to rates (n, r) without a rank decision.

    Each scalar of the motion fixes its own freedom.  One other scalar may fix the last freedom if
    it is far from singular in every pose and all others agree.  None in other cases.
    """
    stated, asked = motion.stated, (moving, *still)
    names = [identity(s) for s in asked]
    given = {stated.index(name): k for k, name in enumerate(names) if name in stated}
    given |= {stated.index(identity(s)): -1 for s in motion.mechanism.couplings}
    free = [k for k in range(len(stated)) if k not in given]
    rest = [s for s, name in zip(asked, names, strict=True) if name not in stated]
    moved = [k for k, position in given.items() if position == 0]
    if names[0] in names[1:] or len(free) > 1 or len(rest) < len(free):
        return None
    rows = [gradient(motion, s) for s in rest]
    if not free:
        if not moved or any((np.abs(row[:, moved[0]]) > RANK_TOLERANCE).any() for row in rows):
            return None
        return lambda readings: readings[..., moved[0]]
    own = rows[0][:, free[0]]
    size = np.sqrt(np.einsum("nf,nf->n", rows[0], rows[0]))
    if ((np.abs(own) < MIN_DETERMINANT * size) | (size < RANK_TOLERANCE)).any():
        return None
    first = 1 / own if not moved else -rows[0][:, moved[0]] / own

    def read(readings: Array) -> Array:
        last = first[:, None] * readings[..., free[0]]
        return last + readings[..., moved[0]] if moved else last

    goal = RANK_TOLERANCE * (1.0 if moved else 1 / size)
    for row in rows[1:]:
        size = np.sqrt(np.einsum("nf,nf->n", row, row))
        if (np.abs(read(row[:, None])[:, 0]) > goal * np.where(size > RANK_TOLERANCE, size, 1)).any():
            return None
    return read


def _solve_rates(rows: Array, first: Array) -> tuple[Array, Array, Array | None]:
    """Solve unit rows (n, k, f) for rates (n, f) that change the first row only.

    Besides: a mask of feasible rates, and a projector on the rates that remain free.

    The projector is None if the rows selected in the middle pose are far from singular in every
    pose.
    """
    n, k, f = rows.shape
    goal = np.zeros((n, k))
    goal[:, 0] = first
    if k >= f:
        best = pivots(rows[n // 2 : n // 2 + 1, 1:], f - 1)[0] + 1
        own = rows if k == f else rows[:, [0, *best]]
        if (np.abs(np.linalg.det(own)) > MIN_DETERMINANT).all():
            rate = np.linalg.inv(own)[:, :, 0] * first[:, None]
            return rate, _meets_goals(rows, rate, goal), None
    u, s, v = np.linalg.svd(rows, full_matrices=False)
    keep = s > RANK_TOLERANCE
    share = np.where(keep, u[:, 0] / np.where(keep, s, 1), 0.0)
    rate = (share[:, None] @ v)[:, 0] * first[:, None]
    free = np.eye(f) - np.swapaxes(v, 1, 2) @ (keep[..., None] * v)
    return rate, _meets_goals(rows, rate, goal), free


def _meets_goals(rows: Array, rate: Array, goal: Array) -> Array:
    """Return whether rates meet the goals of all rows."""
    return np.asarray(np.abs((rows @ rate[..., None])[..., 0] - goal).max(1) <= RANK_TOLERANCE * goal[:, 0])


def gradient(motion: Motion, scalar: Scalar) -> Array:
    """Return rates (n s, f) of a scalar per unit of each freedom, without dimensions."""
    stated, one = motion.stated, identity(scalar)
    if one in stated:
        row = np.eye(len(stated))[stated.index(one)]
        return np.where(np.isfinite(motion.basis()[:, 0]), row, np.nan)
    if isinstance(scalar, Sum):
        parts = zip(scalar.parts, _function(motion, scalar)[0].weights, strict=True)  # type: ignore[attr-defined]
        return np.asarray(sum(weight * gradient(motion, part) for part, weight in parts))
    function, points = _function(motion, scalar)
    if function.unknown is not None:
        return np.asarray(motion.basis()[:, function.unknown])
    first, second = function.bodies
    twist = motion.twists()[:, second]
    if first:
        twist = twist - motion.twists()[:, first]
    return np.asarray(np.einsum("ni,nif->nf", function.wrench(*_place_attached(motion, points)), twist))


def _function(motion: Motion, scalar: Scalar) -> tuple[ScalarFunction, HardPoints]:
    """Return a scalar as a function of the pose, and its points.

    Raise if it exists only where it drives or is held, and it does not.
    """
    for part in expand_sums([scalar]):
        if isinstance(part, GuideCoordinate) or (isinstance(part, Length) and part.link):
            raise InvalidRequest(f"{title(part)} is neither driven nor held in this motion: give two points instead")
    return motion.function(scalar)


def _place_attached(motion: Motion, points: HardPoints) -> tuple[Array, Array]:
    """Return dimensionless points (n s, e, 3) and directions (n s, v, 3) in all poses."""
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
