"""Derivatives of a position, of any order: one linear system per order (`series`)."""

from __future__ import annotations

from dataclasses import dataclass
from math import factorial
from typing import Any

import numpy as np

from ...errors import InvalidRequest
from ...given import array, instance
from ...kinematics.types import Array
from ..geometry.kinds import Kind
from ..geometry.power_series import Taylor, coefficients
from ..geometry.rotation import cross
from .equations import System
from .mechanism import Mechanisms
from .position import Positions, check_positions, conditioning, driver_units
from .series import local_series, pose_series

#: Highest derivative: the factorials of higher orders overflow.
MAX_ORDER = 170


@dataclass(frozen=True, eq=False)
class Jets:
    """Derivatives of the motion of n mechanisms; NaN where no position exists.

    Attributes
    ----------
    points : ndarray, shape (n, p, order + 1, 3)
        Points of the body and their derivatives.
    spin : ndarray, shape (n, order, 3)
        Angular velocity, angular acceleration, ... of the body in world axes.
    coordinates : ndarray, shape (n, p, 2, order + 1)
        u, w and their derivatives; NaN where the chart is singular, and w on curves.
    condition : ndarray, shape (n,)
        Condition number of the Jacobian; expect a relative error of 2e-16 times it in each order.
    chart : ndarray, shape (n, p)
        Smallest of ``|X_u|``, ``|X_w|`` and ``|X_u x X_w|`` per unit of coordinate, in units of
        length: 0 where the chart of a guide is singular (the motion is not).
    """

    points: Array
    spin: Array
    coordinates: Array
    condition: Array
    chart: Array


def jets(mechanisms: Mechanisms, positions: Positions, rates: Any) -> Jets:
    """Return the derivatives of the motion at known positions.

    Parameters
    ----------
    mechanisms : Mechanisms
    positions : Positions
    rates : array-like, shape (n, k, order) or (k, order)
        First and higher derivatives of each driver by time.  For one degree of freedom (1, 0, 0,
        ...) gives derivatives by the driver itself, the *reduced* velocities and accelerations
        (Mangeron, Oğuztöreli and Plitea 1970, sec. 6b), which do not depend on the law of motion.

    Raises
    ------
    InvalidRequest
        If the rates have a wrong shape or are not finite, or the positions are of other mechanisms.
    """
    n = len(instance("mechanisms", mechanisms, Mechanisms))
    given = array("rates", rates)
    if given.ndim not in (2, 3) or given.shape[-2] != mechanisms.freedom or not np.isfinite(given).all():
        raise InvalidRequest(f"rates must be finite numbers of shape {(n, mechanisms.freedom, 'order')}: {given.shape}")
    given = np.broadcast_to(given, (n, *given.shape[-2:]))
    if (order := given.shape[-1]) > MAX_ORDER:
        raise InvalidRequest(f"rates must be of order {MAX_ORDER} at most, not {order}")
    check_positions("positions", instance("positions", positions, Positions), mechanisms)
    system, units = System.of(mechanisms), driver_units(mechanisms)
    q = np.stack([positions.drivers.T / units, *(given[..., k].T / units / factorial(k + 1) for k in range(order))])
    now = system.evaluate(positions.state, q[0])
    kappa, inverse = conditioning(now, system.unit / mechanisms.diameter)
    world, spin = pose_series(mechanisms, system, positions.state, q, now.metric, inverse)
    scale = np.array([factorial(k) for k in range(order + 1)], float)
    points = np.moveaxis(world * system.unit, (0, 1, 2), (2, 3, 1)) * scale[:, None]
    points[:, :, 0] += system.centre.T[:, None]
    coordinates, chart = _coordinates(mechanisms, system, positions, world)
    for i in range(2):
        coordinates[:, :, i] *= scale
    for k, (i, name) in enumerate(mechanisms.drivers):
        coordinates[:, i, "uw".index(name), 1:] = given[:, k]
    lost = ~np.isfinite(kappa) | ~np.isfinite(positions.points).all((1, 2))
    points[lost, :, 1:], coordinates[lost, :, :, 1:] = np.nan, np.nan
    by_order = np.moveaxis(spin[:order], -1, 0) * scale[:order, None]
    by_order[lost] = np.nan
    return Jets(points, by_order, coordinates, kappa, chart)


def _coordinates(mechanisms: Mechanisms, system: System, positions: Positions, world: Array) -> tuple[Array, Array]:
    """Return series (n, p, 2, order + 1) of u, w, and regularity (n, p)."""
    n, p = mechanisms.body.shape[:2]
    out, chart = np.empty((n, p, 2, len(world))), np.empty((n, p))
    for i, guides in enumerate(mechanisms.guides):
        local = local_series(system, i, world[:, :, i])
        for kind, where, parameters in guides.each():
            unit = system.unit[where]
            units = [kind.coordinate_unit(axis, unit) for axis in (0, 1)]
            start = [positions.coordinates[where, i, axis] / units[axis] for axis in (0, 1)]
            series, regular = coordinate_series(kind, start, local[..., where], kind.scaled(parameters, unit))
            for axis in (0, 1):
                out[where, i, axis] = (series[axis] * units[axis]).T
            chart[where, i] = regular
    return out, chart


def coordinate_series(kind: Kind, start: list[Array], x: Array, p: Array) -> tuple[Array, Array]:
    """Return series of u, w (2, order + 1, n) of points, and the metric."""
    order, n = len(x) - 1, x.shape[-1]
    curve = kind.conditions == 2
    u, w = start[0], np.zeros(n) if curve else start[1]
    _, t = kind.tangents(u, w, p)
    c = np.zeros((2, order + 1, n))
    c[0, 0], c[1, 0] = u, w
    with np.errstate(all="ignore"):
        if curve:
            metric = np.sqrt((t[0] ** 2).sum(0))
            dual = np.stack([t[0] / metric**2, np.zeros_like(t[0])])
        else:
            normal = cross(t[0], t[1])
            area = (normal**2).sum(0)
            dual = np.stack([cross(t[1], normal), cross(normal, t[0])]) / area
            metric = np.minimum(np.sqrt((t**2).sum(1)).min(0), np.sqrt(area))
        for k in range(1, order + 1):
            local = kind.point(Taylor(c[0, : k + 1]), Taylor(c[1, : k + 1]), p)
            rest = x[k] - np.stack([coefficients(v, k, (n,))[k] for v in local])
            c[:, k] = (dual * rest).sum(1)
    c[:, :, ~(metric > 0)] = np.nan
    c[0, 0], c[1, 0] = start
    if curve:
        c[1] = np.nan
    return c, metric
