"""Find poses at values of a drive, from the design pose, compiled or by numpy."""

from __future__ import annotations

import numpy as np

from ...kinematics.types import Array
from ..continuation import tracing
from ..continuation.newton import newton_step
from ..continuation.tracing import BRANCH, LONG, MOST, STUCK, TURNING, toward
from . import compiled
from .curve import Curve
from .newton import ACCURACY, solved

#: How far beyond an end of its way, in units or radians, a value of the drive still counts as
#: reached.
BESIDE = 1e-12
#: Why a way ended, in the order of `kernel`.
REASONS = ("", TURNING, BRANCH, STUCK, LONG)


def swept(curve: Curve, y: Array, at: tuple[Array, ...], tangent: Array, goal: Array) -> tuple[Array, Array, Array]:
    """Sweep from design poses y (n, numbers) along tangents (n, m) of growing drive.

    Parameters
    ----------
    at : tuple of ndarray
        What the curve gives at y.
    goal : ndarray, shape (s,)

    Returns
    -------
    states : ndarray, shape (n, s, numbers)
        NaN where there is no pose.
    end : ndarray, shape (n, 2)
        How far the drive went down and up.
    reason : ndarray of str, shape (n, 2)
        Why no farther; empty where it went as far as asked.
    """
    start = at[2]
    target = np.stack([np.minimum(goal.min(), start), np.maximum(goal.max(), start)], axis=1)
    fast = curve.system.fast
    if fast is None:
        return _swept(curve, y, at, tangent, target, goal)
    nodes = (
        np.zeros(len(y)), y, curve.system.lifted(y, tangent), start, (at[3] * tangent).sum(1), tangent,
    )  # fmt: skip
    sign = newton_step(at[0], at[1], tangent, signed=True)[2]
    states, end, why, singular = compiled.swept(
        fast, curve.held, nodes, sign, target, goal, MOST, (tracing.LIMITS, ACCURACY)
    )
    reason = np.array([*REASONS, ""], dtype=object)[why]
    if singular.any():
        i = np.flatnonzero(singular)
        part = _swept(curve.take(i), y[i], tuple(v[i] for v in at), tangent[i], target[i], goal)
        states[i], end[i], reason[i] = part
    return states, end, reason


def _swept(
    curve: Curve, y: Array, at: tuple[Array, ...], tangent: Array, target: Array, goal: Array
) -> tuple[Array, Array, Array]:
    """Sweep by numpy: all ways first, then all poses together."""
    n = len(y)
    both = np.tile(np.arange(n), 2)
    signed = np.concatenate([-tangent, tangent])
    traces = toward(curve.take(both), y[both], signed, target.T.ravel(), at=tuple(v[both] for v in at))
    states, inside = np.full((n, len(goal), y.shape[1]), np.nan), np.zeros((n, len(goal)), bool)
    for i in range(n):
        trace = traces.one(i).joined(traces.one(n + i))
        inside[i] = (goal >= trace.drive[0] - BESIDE) & (goal <= trace.drive[-1] + BESIDE)
        if inside[i].any():
            states[i, inside[i]] = trace.at(trace.where(goal[inside[i]])) if len(trace.s) > 1 else trace.y[:1]
    who, which = np.nonzero(inside)
    found, good = solved(curve.take(who), states[who, which], goal[which])
    found[~good] = np.nan
    states[who, which] = found
    return states, traces.nodes.drive[traces.last].reshape(2, n).T, traces.reason.reshape(2, n).T
