"""Where the drive of a curve of poses turns back: dead points, and folds that lie between two nodes."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from ...kinematics.types import Array
from .curve import Curve, Trace, around
from .newton import across

#: A drive that turns back less steeply than this [units per rad or unit] rests.
FLAT = 1e-9


def unfolded(curve: Curve, trace: Trace) -> Trace:
    """Return a trace with a node between any two between which its drive turns back twice.

    The cubic between two nodes, whose slope is s0 (1 - t)^2 + 2 m t (1 - t) + s1 t^2, says where that may be; the least
    slope of the curve itself decides.
    """
    h, s0, s1 = np.diff(trace.s), trace.slope[:-1], trace.slope[1:]
    m = 3 * np.diff(trace.drive) / h - s0 - s1
    for k in reversed(np.flatnonzero((s0 * s1 > 0) & (m * s0 < 0))):
        direction = np.sign(s0[k])

        def slope(s: float, k: int = k, direction: float = direction) -> float:
            return float(direction * across(curve, trace.at(np.array([s])), trace.tangent[k][None])[2][0])  # noqa: B023

        least = minimize_scalar(slope, bounds=(trace.s[k], trace.s[k + 1]), method="bounded", options={"xatol": 1e-9})
        if least.fun < -FLAT:
            trace = _with_node(curve, trace, int(k), float(least.x))
    return trace


def _with_node(curve: Curve, trace: Trace, k: int, s: float) -> Trace:
    """Return a trace with one more node, at an arc length after node k."""
    y, tangent, slope = across(curve, trace.at(np.array([s])), trace.tangent[k][None])
    _, j, value, _ = curve(y)
    if curve.system.scalars[-1].periodic:
        value = trace.drive[k] + around(value - trace.drive[k])
    node: tuple[Any, ...] = (s, y[0], curve.system.lifted(y, tangent)[0], value[0], slope[0], tangent[0], j[0])
    arrays = [np.insert(v, k + 1, w, axis=0) for v, w in zip(trace[:7], node, strict=True)]
    return Trace._make([*arrays, trace.reason])


def stationary(curve: Curve, trace: Trace, i: int) -> tuple[tuple[float, Array], Array]:
    """Return arc length and state next to nodes i and i + 1 where the drive is stationary, and the tangent there.

    A root of the slope; the drive is stationary, so that its error is the square of that of the place.  Nodes are not
    exact: if the slope does not change its sign between them, the place is a little outside, where a secant finds it.
    """

    def at(s: float) -> tuple[Array, Array, float]:
        y, tangent, slope = across(curve, trace.at(np.array([s])), trace.tangent[i][None])
        return y[0], tangent, float(slope[0])

    a, b = float(trace.s[i]), float(trace.s[i + 1])
    f, g = at(a)[2], at(b)[2]
    if f * g < 0:
        s = float(brentq(lambda s: at(s)[2], a, b, xtol=1e-13))
    else:
        low, high, s = 1.5 * a - 0.5 * b, 1.5 * b - 0.5 * a, b
        for _ in range(20):
            if g == f or abs(g) < 1e-10:
                break
            s, a, f = float(np.clip(s - g * (s - a) / (g - f), low, high)), s, g
            g = at(s)[2]
    y, tangent, _ = at(s)
    return (s, y), tangent


def up_to_dead_point(curve: Curve, trace: Trace) -> Trace:
    """Return a trace whose drive turns back before its last node, with the dead point as its last node."""
    at, tangent = stationary(curve, trace, len(trace.s) - 2)
    _, _, value, _ = curve(at[1][None])
    one: tuple[Any, ...] = (
        at[0], at[1], curve.system.lifted(at[1][None], tangent)[0], value[0], 0.0, tangent[0], trace.jacobian[-1],
    )  # fmt: skip
    if curve.system.scalars[-1].periodic:
        one = (*one[:3], trace.drive[-2] + around(value - trace.drive[-2])[0], *one[4:])
    arrays = [np.concatenate([v[:-1], np.asarray(w)[None]]) for v, w in zip(trace[:7], one, strict=True)]
    return Trace._make([*arrays, trace.reason])
