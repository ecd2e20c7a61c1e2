"""Power series of a motion: one linear system per order, all with one Jacobian.

Every unknown is a truncated series in time.  If the coefficients below order k are known, those of
order k follow from the Jacobian of the position and the residual of order k, evaluated with them at
zero.  The rotation is represented by the series of the angular velocity: points r of the body,
relative to the base, have  k r_k = sum_j w_j x r_(k-1-j),  so one solve gives angular velocity and
acceleration too.
"""

from __future__ import annotations

import numpy as np

from ...kinematics.types import Array
from ..geometry.power_series import Taylor, coefficients
from ..geometry.rotation import cross
from .equations import System
from .mechanism import Mechanisms


def pose_series(
    mechanisms: Mechanisms, system: System, state: Array, q: Array, metric: Array, inverse: Array
) -> tuple[Array, Array]:
    """Return series of points (order + 1, 3, p, n) and angular velocity (order, 3, n).

    Parameters
    ----------
    state : ndarray, shape (4 + f, n)
    q : ndarray, shape (order + 1, k, n)
        Series of the drivers.
    metric : ndarray, shape (f, n)
        Arc length per unit of each free coordinate.
    inverse : ndarray, shape (m, m, n)
        Inverse of the Jacobian.
    """
    order, n, p = len(q) - 1, len(system), system.arms.shape[1]
    spin = np.zeros((order + 1, 3, n))
    free = np.zeros((order + 1, system.free, n))
    free[0] = state[4:]
    arms = np.zeros((order + 1, 3, p, n))
    arms[0] = system.turned(state)
    for k in range(1, order + 1):
        arms[k] = sum(cross(spin[j][:, None], arms[k - 1 - j]) for j in range(k - 1)) / k if k > 1 else 0
        residual = last_residual(system, mechanisms, arms[: k + 1], free[: k + 1], q[: k + 1])
        with np.errstate(invalid="ignore"):
            step = -(inverse * residual).sum(1)
            turn, free[k] = step[:3], step[3:] / metric
        spin[k - 1] = k * turn
        arms[k] += cross(turn[:, None], arms[0])
    return base_series(system, free, q)[:, :, None] + arms, spin[:order]


def base_series(system: System, free: Array, q: Array) -> Array:
    """Return the series of the base, shape (order + 1, 3, n)."""
    return placed_series(system, 0, free, q)


def placed_series(system: System, which: int, free: Array, q: Array) -> Array:
    """Return the series of a driven point, shape (order + 1, 3, n)."""
    d = system.driven[which]
    i, order, n = d.slot.point, len(q) - 1, q.shape[-1]
    own = np.zeros_like(q[:, 0]) if d.column is None else free[:, d.column - 3]
    u, w = (own if k is None else q[:, k] for k in d.driver)
    x = np.empty((order + 1, 3, n))
    for kind, where, p in d.slot.groups:
        local = kind.point(Taylor(u[:, where]), Taylor(w[:, where]), p)
        for axis in range(3):
            x[:, axis, where] = coefficients(local[axis], order, (p.shape[1],))
    out = (system.frames[:, :, i] * x[:, None]).sum(2)
    out[0] += system.origins[:, i]
    return np.asarray(out)


def last_residual(system: System, mechanisms: Mechanisms, arms: Array, free: Array, q: Array) -> Array:
    """Return the last coefficient of the residual, shape (m, n)."""
    base = base_series(system, free, q)
    out = np.empty((3 + system.free, len(system)))
    row = 0
    for i in dict.fromkeys(system.points):
        local = local_series(system, i, base + arms[:, :, i])
        for kind, where, p in mechanisms.guides[i].each():
            off = kind.distances(local[..., where], kind.scaled(p, system.unit[where]))
            out[row : row + kind.conditions, where] = off[-1]
        row += 2 if mechanisms.curves[i] else 1
    for j in range(1, len(system.driven)):
        out[row : row + 3] = (placed_series(system, j, free, q) - base - arms[:, :, system.driven[j].slot.point])[-1]
        row += 3
    return out


def local_series(system: System, i: int, world: Array) -> Array:
    """Return the series of point i in the axes of its guide."""
    world = world.copy()
    world[0] -= system.origins[:, i]
    return np.asarray((system.frames[:, :, i] * world[:, :, None]).sum(1))
