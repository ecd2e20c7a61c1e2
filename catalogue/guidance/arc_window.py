"""Trace circular guides over windows with a requested ratio of chord to radius."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..kinematics.types import Floats
from .coupler_curve import CouplerCurve
from .reach import REACH
from .trace import Traced, trace

#: First trial windows, as ratios to the window by proportion.
TRIAL_WINDOWS = np.array([0.75, 0.9, 1.0, 1.1])


class SweepCorrection(NamedTuple):
    """Iteration of a window to the requested sweep."""

    rounds: int = 6  #: largest number of further windows
    reached: float = 1e-6  #: relative error of the sweep at which the iteration stops


SWEEP = SweepCorrection()


def at_sweep(guides: CouplerCurve, half: Floats, centre: Floats, known: Floats, sweep: float) -> tuple[Floats, Traced]:
    """Find half windows (n,) [length] with chord over radius `sweep`, below 2, and trace them.

    The sweep is not proportional to the window, since the circle changes with the window and the
    point is moved for each one. Among nearby windows of this sweep the widest is returned, NaN
    where there is none. Near a jump `SWEEP.rounds` may not suffice: the error of the sweep then
    exceeds `SWEEP.reached`.

    The arguments `half`, `known` and `centre` describe the first windows: half their lengths, their
    sweeps, and their middles, in half windows from the reference position.
    """
    n = len(guides)
    guess = sweep / known
    parts = np.stack([*(TRIAL_WINDOWS[:, None] * guess), np.sqrt(guess)])
    each = np.tile(np.arange(n), len(parts))
    ladder = trace(
        guides[each], (half * parts).ravel(), circle=True, split=True, centre=centre[each], nodes=REACH.nodes
    )
    with np.errstate(all="ignore"):
        x = np.log(np.concatenate([parts, np.ones_like(parts[:1])]))
        y = np.concatenate([_log_excess(ladder, sweep).reshape(parts.shape), -np.log(guess)[None]])
        order = np.argsort(x, axis=0)
        x, y = (np.take_along_axis(values, order, 0) for values in (x, y))
        crossed = (y[:-1] <= 0) & (y[1:] >= 0)
        below = len(crossed) - 1 - np.argmax(crossed[::-1], axis=0)
        open_ = np.asarray(crossed.any(axis=0))
        rows = np.stack([below, below + 1, np.where(below > 0, below - 1, 2)])
        x, y = (np.take_along_axis(values, rows, 0) for values in (x, y))
        half, traced = np.where(open_, half, np.nan), Traced.nothing(n)
        scale = half.copy()
        for _ in range(SWEEP.rounds):
            if not open_.any():
                break
            at = _interpolate_zero(x[:, open_], y[:, open_])
            half[open_] = scale[open_] * np.exp(at)
            now = trace(guides[open_], half[open_], circle=True, split=True, centre=centre[open_], nodes=REACH.nodes)
            traced = traced.replaced(open_, now)
            error = _log_excess(now, sweep)
            for values, new in ((x, at), (y, error)):
                short, beyond, _ = values[:, open_]
                values[:, open_] = np.where(error <= 0, (new, beyond, short), (short, new, beyond))
            open_[open_] = np.abs(error) > SWEEP.reached
    return half, traced


def _log_excess(traced: Traced, sweep: float) -> Floats:
    """Compute the logarithm of the ratio of traced to requested sweeps."""
    return np.asarray(np.log(traced.fit.stroke * np.abs(traced.fit.curvature) / sweep))


def _interpolate_zero(x: Floats, y: Floats) -> Floats:
    """Interpolate the zero of y between two points.

    y <= 0 at the first point, y >= 0 at the second. A parabola in y through three points is used if
    its zero is between them, else a line.
    """
    (a, b, c), (p, q, r) = x, y
    line = np.where(q > p, (a * q - b * p) / (q - p), 0.5 * (a + b))
    bent = a * q * r / ((p - q) * (p - r)) + b * p * r / ((q - p) * (q - r)) + c * p * q / ((r - p) * (r - q))
    return np.asarray(np.where((bent > a) & (bent < b), bent, line))
