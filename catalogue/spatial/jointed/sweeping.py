"""Sweep a drive from the design pose to given values, compiled or by numpy."""

from __future__ import annotations

import numpy as np

from ...kinematics.types import Array
from ..continuation import tracing
from ..continuation.newton import newton_step
from ..continuation.tracing import BRANCH, LONG, MAX_NODES, STUCK, TURNING, trace_toward
from . import compiled
from .curve import Curve
from .newton import ACCURACY, solved

#: Distance beyond the end of a motion [units or rad] at which a value of the drive is reached.
END_TOLERANCE = 1e-12
#: Reasons why a motion ends, in the order of `native.curve`.
REASONS = ("", TURNING, BRANCH, STUCK, LONG)


def swept(curve: Curve, y: Array, at: tuple[Array, ...], tangent: Array, goal: Array) -> tuple[Array, Array, Array]:
    """Sweep from design poses y (n, numbers) along tangents (n, m) of growing drive.

    Parameters
    ----------
    at : tuple of ndarray
        Values of the curve at y.
    goal : ndarray, shape (s,)

    Returns
    -------
    states : ndarray, shape (n, s, numbers)
        NaN where there is no pose.
    end : ndarray, shape (n, 2)
        Least and greatest value that the drive reached.
    reason : ndarray of str, shape (n, 2)
        Reason of each end; empty if all values were reached.
    """
    start = at[2]
    target = np.stack([np.minimum(goal.min(), start), np.maximum(goal.max(), start)], axis=1)
    fast = curve.system.fast
    if fast is None:
        return _sweep_by_numpy(curve, y, at, tangent, target, goal)
    nodes = np.zeros(len(y)), y, curve.system.lifted(y, tangent), start, (at[3] * tangent).sum(1), tangent
    sign = newton_step(at[0], at[1], tangent, signed=True)[2]
    states, end, why, singular = compiled.swept(
        fast, curve.held, nodes, sign, target, goal, MAX_NODES, (tracing.LIMITS, ACCURACY)
    )
    reason = np.array([*REASONS, ""], dtype=object)[why]
    if singular.any():
        i = np.flatnonzero(singular)
        part = _sweep_by_numpy(curve.take(i), y[i], tuple(v[i] for v in at), tangent[i], target[i], goal)
        states[i], end[i], reason[i] = part
    return states, end, reason


def _sweep_by_numpy(
    curve: Curve, y: Array, at: tuple[Array, ...], tangent: Array, target: Array, goal: Array
) -> tuple[Array, Array, Array]:
    """Trace all curves down and up by numpy, then correct all poses together."""
    n, begin = len(y), at[2]
    both, sign = np.tile(np.arange(n), 2), np.repeat((-1.0, 1.0), n)
    traces = trace_toward(
        curve.take(both), y[both], sign[:, None] * tangent[both], target.T.ravel(), at=tuple(v[both] for v in at)
    )
    end, nodes, along = traces.nodes.drive[traces.last].reshape(2, n), traces.nodes, sign[traces.who]
    gone = along * (nodes.drive - begin[both[traces.who]])
    growing = traces._replace(nodes=nodes._replace(drive=gone, slope=along * nodes.slope))
    who, which = np.nonzero((goal >= end[0, :, None] - END_TOLERANCE) & (goal <= end[1, :, None] + END_TOLERANCE))
    guess, far = y[who], goal[which] - begin[who]
    some = np.flatnonzero(np.abs(far) > END_TOLERANCE)
    if len(some):
        guess[some] = growing.between(who[some] + n * (far[some] > 0), np.abs(far[some]))[0]
    states = np.full((n, len(goal), y.shape[1]), np.nan)
    found, good = solved(curve.take(who), guess, goal[which])
    found[~good] = np.nan
    states[who, which] = found
    return states, end.T, traces.reason.reshape(2, n).T
