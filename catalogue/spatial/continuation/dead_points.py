"""Find dead points, the extrema of the drive along a curve of poses."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.optimize import minimize_scalar

from ...kinematics.types import Array
from .curve import Curve, Trace, around, cubic
from .newton import across

#: Slope below which a drive is stationary and does not reverse [units per rad or unit].
STATIONARY_SLOPE = 1e-9
#: Largest slope of the drive at a dead point; the error of the drive is its square.
SLOPE_TOLERANCE = 1e-10
#: Change of arc length below which a root is exact to rounding [rad, units].
ARC_TOLERANCE = 1e-13


def split_folds(curve: Curve, trace: Trace) -> Trace:
    """Insert a node into each interval of a trace in which the drive reverses twice.

    The cubic between two nodes, of slope s0 (1 - t)^2 + 2 m t (1 - t) + s1 t^2, shows candidates;
    the least slope of the curve itself decides.
    """
    h, s0, s1 = np.diff(trace.s), trace.slope[:-1], trace.slope[1:]
    m = 3 * np.diff(trace.drive) / h - s0 - s1
    for k in reversed(np.flatnonzero((s0 * s1 > 0) & (m * s0 < 0))):
        direction = np.sign(s0[k])

        def slope(s: float, k: int = k, direction: float = direction) -> float:
            return float(direction * across(curve, trace.at(np.array([s])), trace.tangent[k][None])[2][0])  # noqa: B023

        least = minimize_scalar(slope, bounds=(trace.s[k], trace.s[k + 1]), method="bounded", options={"xatol": 1e-9})
        if least.fun < -STATIONARY_SLOPE:
            trace = _with_node(curve, trace, int(k), float(least.x))
    return trace


def _with_node(curve: Curve, trace: Trace, k: int, s: float) -> Trace:
    """Return a trace with one more node, at an arc length after node k."""
    y, tangent, slope = across(curve, trace.at(np.array([s])), trace.tangent[k][None])
    value = _unwind(curve, curve(y)[2], trace.drive[k])
    node = s, y[0], curve.lifted(y, tangent)[0], value[0], slope[0], tangent[0]
    arrays = [np.insert(v, k + 1, w, axis=0) for v, w in zip(trace[:-1], node, strict=True)]
    return Trace._make([*arrays, trace.reason])


def _unwind(curve: Curve, value: Array, near: Any) -> Array:
    """Add whole turns to periodic drives to bring them next to given values."""
    return np.asarray(near + around(value - near)) if curve.periodic else value


def dead_points(curve: Curve, one: Trace, other: Trace) -> Trace:
    """Find the dead points of n curves between two nodes of each.

    Solves for roots of the slope by false position.  Nodes are not exact: if the slope does not
    change sign between them, the root is just outside and a secant finds it.
    """
    h = other.s - one.s

    def at(s: Array) -> tuple[Array, Array, Array]:
        t = (s - one.s) / h
        y = cubic(t[:, None], h[:, None], one.y, other.y, one.rate, other.rate)
        return across(curve, y, one.tangent)

    a, b, f, (y, tangent, slope) = one.s, other.s, at(one.s)[2], at(other.s)
    low, high, crosses = 1.5 * a - 0.5 * b, 1.5 * b - 0.5 * a, f * slope < 0
    done = (slope == f) | (np.abs(slope) < SLOPE_TOLERANCE)
    for _ in range(100):
        if done.all():
            break
        with np.errstate(all="ignore"):
            s = b - slope * (b - a) / (slope - f)
        s = np.where(done, b, np.where(crosses, s, np.clip(s, low, high)))
        there, along, new = at(s)
        stays = crosses & (new * slope >= 0)
        with np.errstate(all="ignore"):
            share = 1 - new / slope  # Anderson and Björck's factor: without it one end would never move
        f = np.where(done, f, np.where(stays, f * np.where(share > 0, share, 0.5), slope))
        a = np.where(done | stays, a, b)
        y, tangent = (np.where(done[:, None], v, w) for v, w in ((y, there), (tangent, along)))
        ended = ~(np.abs(new) >= SLOPE_TOLERANCE) | ~(np.abs(s - b) >= ARC_TOLERANCE) | (new == slope)
        b, slope, done = s, np.where(done, slope, new), done | ended
    value = _unwind(curve, curve(y)[2], one.drive)
    return Trace(b, y, curve.lifted(y, tangent), value, np.zeros_like(b), tangent)
