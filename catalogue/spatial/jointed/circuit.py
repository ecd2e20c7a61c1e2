"""All that a mechanism reaches without being taken apart: crank or rocker, limits, dead points."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ...kinematics.types import Array
from .elements import Scalar
from .motion import Motion
from .system import FREE
from .tracing import (
    BRANCH,
    LONG,
    MOST,
    SHORTEST,
    STUCK,
    Curve,
    March,
    Trace,
    across,
    crossed,
    signature,
    stationary,
    tangents,
)

if TYPE_CHECKING:
    from .mechanism import Mechanism

#: Nearer than this to where it set out, in steps, a curve is tried for having closed; and how near it must come.
NEAR, CLOSED = 3.0, 5e-2


@dataclass(frozen=True, eq=False)
class Circuit:
    """The whole of a motion, through the dead points of the drive.

    Attributes
    ----------
    closed : bool
        Whether it returns to where it set out; else it was followed both ways, until `reason`.
    crank : bool
        Whether the drive turns fully: it has no dead point, and gains a turn each time round.
    limits : tuple of float
        Least and greatest value of the drive; of a crank, 0 and a turn.
    dead_points : ndarray, shape (d,)
        Values of the drive at which it turns back, in the order in which they are passed.
    length : float
        Arc length [rad and units of length].
    reason : str
        Why an open circuit ends: at a branch point, too far away.
    """

    mechanism: Mechanism
    curve: Curve
    driven: Scalar
    held: tuple[Scalar, ...]
    trace: Trace
    closed: bool
    crank: bool
    limits: tuple[float, float]
    dead_points: Array
    length: float
    reason: str

    def motion(self, count: int = 361) -> Motion:
        """Return `count` poses all along the circuit, the first in the design pose; of a crank that turns fully evenly
        spaced in its angle, else in arc length."""
        if self.crank:
            begin, end = self.trace.drive[[0, -1]]
            values = np.linspace(begin, begin + np.copysign(2 * np.pi, end - begin), count)
            return self.mechanism.sweep(self.driven, values, self.held)
        s = np.linspace(self.trace.s[0], self.trace.s[-1], count)
        i = np.clip(np.searchsorted(self.trace.s, s), 1, len(self.trace.s) - 1)
        y, _, _ = across(_repeated(self.curve, count), self.trace.at(s), self.trace.tangent[i])
        value = _repeated(self.curve, count)(y)[2] * self.curve.system.scalars[-1].unit
        return Motion(self.mechanism, self.curve, self.driven, self.held, value, y[None], ((None, None),))


def _repeated(curve: Curve, count: int) -> Curve:
    return curve.take(np.zeros(count, int))


def circuit(mechanism: Mechanism, curve: Curve, y: Array, drive: Scalar, held: tuple[Scalar, ...]) -> Circuit:
    """Return the circuit on which the state y (1, numbers) is."""
    _, j, _, by = curve(y)
    tangent, _, _ = tangents(j, by)
    unit = curve.system.scalars[-1].unit
    trace, closed = _around(curve, y, tangent)
    if not closed:
        other, _ = _around(curve, y, -tangent)
        reason = trace.reason
        trace = other.joined(trace)
    else:
        reason = ""
    dead = []
    if closed and abs(trace.slope[0]) < 1e-9 and trace.slope[1] * trace.slope[-2] < 0:  # in the design pose
        dead.append(float(trace.drive[0]) * unit)
        trace.slope[[0, -1]] = 0.0
    for k in np.flatnonzero(np.sign(trace.slope[:-1]) * np.sign(trace.slope[1:]) < 0):
        (_, at), _ = stationary(curve, trace, int(k))
        value = curve(at[None])[2][0]
        if curve.system.scalars[-1].periodic:
            value += 2 * np.pi * np.round((trace.drive[k] - value) / (2 * np.pi))
        dead.append(float(value) * unit)
    gained = trace.drive[-1] - trace.drive[0]
    crank = closed and not dead and abs(abs(gained) - 2 * np.pi) < 1e-3 and unit == 1.0
    values = [*dead, *((trace.drive[[0, -1]] * unit).tolist() if not (closed and dead) else [])]
    limits = (0.0, 2 * np.pi) if crank else (float(min(values)), float(max(values)))
    length = float(trace.s[-1] - trace.s[0])
    return Circuit(mechanism, curve, drive, held, trace, closed, crank, limits, np.array(dead), length, reason)


def _around(curve: Curve, y: Array, tangent: Array) -> tuple[Trace, bool]:
    """Follow a curve until it closes, a branch crosses it, or it has no end."""
    march = March(curve, y, tangent)
    first = signature(curve, y)[0]
    away = signature(curve, y + 1e-6 * curve.system.lifted(y, tangent))[0] - first
    away /= np.sqrt(away @ away)
    behind = 0.0
    for _ in range(MOST):
        if march.h[0] < SHORTEST:
            march.reason[0] = STUCK
            break
        if not march.step()[0]:
            continue
        apart = signature(curve, march.last[1])[0] - first
        ahead = float(apart @ away)
        step = march.last[0][0] - march.before[0][0]
        if behind < 0 <= ahead and np.sqrt(apart @ apart) < NEAR * step:
            trace = march.trace(0)
            low, high = trace.s[-2], trace.s[-1]
            for _ in range(50):
                s = (low + high) / 2
                apart = signature(curve, trace.at(np.array([s])))[0] - first
                low, high = (s, high) if apart @ away < 0 else (low, s)
            y_near, _, _ = across(curve, trace.at(np.array([s])), trace.tangent[-2][None])
            apart = signature(curve, y_near)[0] - first
            if np.sqrt(apart @ apart) < CLOSED * step:
                return _closing(curve, trace, s), True
        behind = ahead
    reason = march.reason[0] or LONG
    trace = crossed(march.trace(0))
    return Trace._make([*trace[:7], BRANCH if trace.reason == BRANCH else reason]), False


def _closing(curve: Curve, trace: Trace, s: float) -> Trace:
    """Return a closed trace whose last node is where it set out: angles may have gained turns, quaternions a sign."""
    first, there = trace.y[:1], trace.at(np.array([s]))
    y = first + 2 * np.pi * np.round((there - first) / (2 * np.pi))
    for p in curve.system.placed:
        for c in p.number if p.sort == FREE else ():
            y[:, c : c + 7] = first[:, c : c + 7]
            y[:, c : c + 4] *= np.sign((there[:, c : c + 4] * first[:, c : c + 4]).sum())
    tangent, slope, value = trace.tangent[:1], trace.slope[:1], curve(y)[2]
    if curve.system.scalars[-1].periodic:
        value = value + 2 * np.pi * np.round((trace.drive[-2] - value) / (2 * np.pi))
    new: tuple[Any, ...] = (
        np.array([s]),
        y,
        curve.system.lifted(y, tangent),
        value,
        slope,
        tangent,
        trace.jacobian[-1:],
    )
    return Trace._make([*(np.concatenate([v[:-1], w]) for v, w in zip(trace[:7], new, strict=True)), ""])
