"""Corners of paths, and positions between nodes of traces: from cubics, corrected and checked.

A position is accepted if Newton's method contracts and stays near its cubic, and the determinant
has the sign of the curve.
"""

from __future__ import annotations

import numpy as np

from ...kinematics.types import Array
from ..continuation.curve import Traces
from ..continuation.elimination import solve
from ..continuation.newton import LAST
from .curve import LineCurve
from .newton import NOISE
from .unknowns import moved

#: Positions corrected together.
BLOCK = 2048
#: Largest number of corrections of a position.
CORRECTIONS = 4
#: Largest first correction [distances between two nodes], where the drive changes with arc length.
MAX_FIRST_CORRECTION = 0.01
#: Slope of the drive below which the limit of corrections near a dead point grows no more.
MIN_SLOPE = 0.1
#: Largest ratio of a correction to the one before.
MAX_CONTRACTION = 0.2
#: Predicted size of a correction below which it is omitted.
CONVERGED = 1e-15
#: Sine of the angle between two sections of a path below which their node is no corner.
STRAIGHT = 1e-9
#: Relative distance of a driver's value from a straight line that rounding explains.
ROUNDING = 8 * float(np.finfo(float).eps)


def corners(nodes: Array) -> Array:
    """Find the corners of paths (n, s, k), including their ends, shape (n, s)."""
    out = np.ones(nodes.shape[:2], bool)
    nodes = np.ascontiguousarray(np.moveaxis(nodes, 2, 0))
    step = np.diff(nodes)
    one, other = step[..., :-1], step[..., 1:]
    ahead, size = (one * other).sum(0), (one * one).sum(0)
    with np.errstate(all="ignore"):
        aside = np.abs(other - one * (ahead / size)).max(0, initial=0)
    near = STRAIGHT * np.sqrt((other * other).sum(0)) + ROUNDING * np.abs(nodes).max((0, 2))[:, None]
    out[:, 1:-1] = ~((ahead > 0) & (aside <= near))
    return out


def fill(curve: LineCurve, traces: Traces, sign: Array, who: Array, value: Array) -> tuple[Array, Array]:
    """Find states (m, numbers) of curves `who` at values of their drives, and success.

    `sign` (n,) is that of the determinants of curves.
    """
    states, good = np.full((len(value), len(curve.weight)), np.nan), np.zeros(len(value), bool)
    if not len(value) or len(traces.who) == len(traces.reason):
        return states, good
    guess, slope, way = traces.between(who, value)
    limit = MAX_FIRST_CORRECTION * way / np.clip(slope, MIN_SLOPE, 1) + LAST
    for low in range(0, len(value), BLOCK):
        some = slice(low, low + BLOCK)
        with np.errstate(all="ignore"):
            states[some], good[some] = _correct(
                curve.take(who[some]), guess[some], value[some], sign[who[some]], limit[some]
            )
    return states, good


def _correct(curve: LineCurve, guess: Array, value: Array, sign: Array, limit: Array) -> tuple[Array, Array]:
    """Return states (m, numbers) at values of the drive, and a mask of reliable ones."""
    state, values, sub = guess[:, :-1].T.copy(), curve.q0 + value * curve.q1, curve.system
    sure, rest, at, before = np.zeros(len(value), bool), np.arange(len(value)), state, limit
    for i in range(CORRECTIONS):
        now = sub.evaluate(at, values)
        z, found = solve(now.jacobian, -now.residual[:, None])
        length = np.sqrt((z[:, 0] ** 2).sum(0))
        at = moved(at, z[:, 0], now.metric)
        state[:, rest] = at
        last = length < LAST
        if i:
            last |= (now.distance < NOISE * sub.reach) | (length**3 < CONVERGED * before**2)
        near = (length <= limit) & (found == sign[rest])
        sure[rest] = near & last
        more = np.flatnonzero(near & ~last)
        if not len(more):
            break
        rest, sub, at, values = rest[more], sub.take(more), at[:, more], values[:, more]
        before, limit = length[more], MAX_CONTRACTION * length[more]
    return np.concatenate([state, value[None]]).T, sure
