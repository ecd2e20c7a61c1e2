"""Circuits: all poses reachable without disassembly, with limits and dead points of the drive."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import brentq

from ...given import whole
from ...kinematics.types import Array
from ..continuation.curve import Trace
from ..continuation.dead_points import dead_points, split_folds
from ..continuation.newton import across
from ..continuation.tracing import LONG, MAX_NODES, March
from .curve import Curve, signature, tangents
from .elements import Scalar, title
from .motion import Motion
from .newton import solved
from .tree import FREE

if TYPE_CHECKING:
    from .mechanism import Mechanism

#: Largest number of poses of a motion.
MOST_POSES = 1_000_000
#: Distance from the first node at which closure is tested [steps].
CLOSURE_TEST_DISTANCE = 3.0
#: Distance from the first node at which a curve has closed [steps].
CLOSURE_DISTANCE = 5e-2


@dataclass(frozen=True, eq=False, repr=False)
class Circuit:
    """A whole circuit, through the dead points of the drive.

    Attributes
    ----------
    closed : bool
        Whether it returns to its start; an open circuit is followed both ways until `reason`.
    crank : bool
        Whether the drive turns fully: without dead point, one turn per circuit.
    limits : tuple of float
        Least and greatest value of the drive; of a crank, 0 and a turn.
    dead_points : ndarray, shape (d,)
        Values at which the drive reverses, in order of passing.
    length : float
        Arc length [rad and units of length].
    reason : str
        Reason for the end of an open circuit, such as a branch point.
    number : int
        Number of its mechanism in the batch.
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
    number: int = 0

    def __repr__(self) -> str:
        drive = title(self.driven)
        ends = "turns fully" if self.crank else f"from {self.limits[0]:.6g} to {self.limits[1]:.6g}"
        how = "closed" if self.closed else f"open: {self.reason}"
        return f"<Circuit of {drive}: {ends}, {len(self.dead_points)} dead points, {how}>"

    def motion(self, count: int = 361) -> Motion:
        """Return `count` poses along the circuit, from the design pose on.

        They are evenly spaced in the angle of a crank that turns fully, else in arc length.
        """
        many, mechanism = _repeat(self.curve, whole("count", count, 1, MOST_POSES)), self.mechanism
        if len(mechanism.system().points) > 1:
            mechanism = mechanism.one(self.number)
        if self.crank:
            begin, end = self.trace.drive[[0, -1]]
            value = np.linspace(begin, begin + np.copysign(2 * np.pi, end - begin), count)
            y, good = solved(many, self.trace.at(self.trace.where(value)), value)
            y[~good] = np.nan
        else:
            s = np.linspace(self.trace.s[0], self.trace.s[-1], count)
            i = np.clip(np.searchsorted(self.trace.s, s), 1, len(self.trace.s) - 1)
            y, _, _ = across(many, self.trace.at(s), self.trace.tangent[i])
            value = many(y)[2] * self.curve.system.scalars[-1].unit
        return Motion(mechanism, self.curve, self.driven, self.held, value, y[None], ((None, None),))


def _repeat(curve: Curve, count: int) -> Curve:
    return curve.take(np.zeros(count, int))


def circuits(mechanism: Mechanism, curve: Curve, y: Array, drive: Scalar, held: tuple[Scalar, ...]) -> list[Circuit]:
    """Return the circuits through states y (n, numbers)."""
    _, j, _, by = curve.selected(y)(y)
    tangent, _, _ = tangents(j, by)
    found = _follow_closed(curve, y, tangent)
    open_ = np.flatnonzero([not closed for _, closed in found])
    back = _follow_closed(curve.take(open_), y[open_], -tangent[open_]) if len(open_) else []
    other = {int(i): trace for i, (trace, _) in zip(open_, back, strict=True)}
    return [
        _circuit(mechanism, curve.take(np.array([i])), trace, other.get(i), drive, held, i)
        for i, (trace, _) in enumerate(found)
    ]


def _circuit(
    mechanism: Mechanism,
    curve: Curve,
    trace: Trace,
    back: Trace | None,
    drive: Scalar,
    held: tuple[Scalar, ...],
    i: int,
) -> Circuit:
    """Return the circuit of a trace, and of the trace back if it did not close."""
    closed, unit, reason = back is None, curve.system.scalars[-1].unit, ""
    if back is not None:
        reason, trace = trace.reason, back.joined(trace)
    trace = split_folds(curve, trace)
    dead = []
    if closed and abs(trace.slope[0]) < 1e-9 and trace.slope[1] * trace.slope[-2] < 0:  # in the design pose
        dead.append(float(trace.drive[0]) * unit)
        trace.slope[[0, -1]] = 0.0
    turns = np.flatnonzero(np.sign(trace.slope[:-1]) * np.sign(trace.slope[1:]) < 0)
    if len(turns):
        passed = dead_points(_repeat(curve, len(turns)), trace.take(turns), trace.take(turns + 1))
        dead += (passed.drive * unit).tolist()
    gained = trace.drive[-1] - trace.drive[0]
    crank = closed and not dead and abs(abs(gained) - 2 * np.pi) < 1e-3 and unit == 1.0
    values = [*dead, *((trace.drive[[0, -1]] * unit).tolist() if not (closed and dead) else [])]
    limits = (0.0, 2 * np.pi) if crank else (float(min(values)), float(max(values)))
    length = float(trace.s[-1] - trace.s[0])
    return Circuit(mechanism, curve, drive, held, trace, closed, crank, limits, np.array(dead), length, reason, i)


def _follow_closed(curve: Curve, y: Array, tangent: Array) -> list[tuple[Trace, bool]]:
    """Follow curves until each closes, branches or becomes too long; return traces and closure."""
    march = March(curve, y, tangent)
    first = signature(curve, y)
    away = signature(curve, y + 1e-6 * curve.system.lifted(y, tangent)) - first
    away /= np.sqrt((away * away).sum(1, keepdims=True))
    behind = np.zeros(len(y))
    done: dict[int, Trace] = {}
    for _ in range(MAX_NODES):
        march.end(march.stopped())
        if not len(march.who):
            break
        good, who = march.step(), march.who
        apart = signature(curve.take(who), march.last[1]) - first[who]
        ahead, step = (apart * away[who]).sum(1), march.last[0] - march.before[0]
        near = good & (behind[who] < 0) & (ahead >= 0) & ((apart * apart).sum(1) < (CLOSURE_TEST_DISTANCE * step) ** 2)
        behind[who] = np.where(good, ahead, behind[who])
        for k in np.flatnonzero(near):
            i = int(who[k])
            closing = _end_at_start(curve.take(np.array([i])), march.trace(i), first[i], away[i], float(step[k]))
            if closing is not None:
                done[i] = closing
        march.end(np.isin(who, list(done)))
    open_ = (i for i in range(len(y)) if i not in done)
    ended = {i: march.trace(i)._replace(reason=str(march.reason[i]) or LONG) for i in open_}
    return [(done[i], True) if i in done else (ended[i], False) for i in range(len(y))]


def _end_at_start(curve: Curve, trace: Trace, first: Array, away: Array, step: float) -> Trace | None:
    """End a trace at its first pose if its last step passes it."""

    def ahead(s: float) -> float:
        return float((signature(curve, trace.at(np.array([s])))[0] - first) @ away)

    low, high = float(trace.s[-2]), float(trace.s[-1])
    s = float(brentq(ahead, low, high, xtol=1e-14)) if ahead(low) < 0 < ahead(high) else (low + high) / 2
    y_near, _, _ = across(curve, trace.at(np.array([s])), trace.tangent[-2][None])
    apart = signature(curve, y_near)[0] - first
    return _closed_trace(curve, trace, s) if np.sqrt(apart @ apart) < CLOSURE_DISTANCE * step else None


def _closed_trace(curve: Curve, trace: Trace, s: float) -> Trace:
    """Return a closed trace that ends at its first node.

    Angles may differ there by whole turns, quaternions by the sign.
    """
    first, there = trace.y[:1], trace.at(np.array([s]))
    y = first + 2 * np.pi * np.round((there - first) / (2 * np.pi))
    for p in curve.system.placed:
        for c in p.number if p.joint_kind == FREE else ():
            y[:, c : c + 7] = first[:, c : c + 7]
            y[:, c : c + 4] *= np.sign((there[:, c : c + 4] * first[:, c : c + 4]).sum())
    tangent, slope, value = trace.tangent[:1], trace.slope[:1], curve(y)[2]
    if curve.system.scalars[-1].periodic:
        value = value + 2 * np.pi * np.round((trace.drive[-2] - value) / (2 * np.pi))
    new = np.array([s]), y, curve.lifted(y, tangent), value, slope, tangent
    return Trace._make([*(np.concatenate([v[:-1], w]) for v, w in zip(trace[:-1], new, strict=True)), ""])
