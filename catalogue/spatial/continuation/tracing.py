"""Trace curves of poses of mechanisms with one degree of freedom.

The parameter is the arc length, which is regular at dead points of any drive (Allgower and Georg,
Introduction to Numerical Continuation Methods).  The error of a cubic through the last two nodes
controls the step.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...kinematics.types import Array
from .curve import Curve, Limits, Trace, Traces, around, cubic, rises
from .dead_points import dead_points
from .newton import LAST, newton_step

#: Step control for mechanisms of joints: Newton's method finds any pose from cubics between nodes.
LIMITS = Limits(
    aim=2e-3,
    refused=1e-2,
    first=0.1,
    longest=0.8,
    shortest=1e-7,
    contraction=0.2,
    at_branch=1e-5,
    bow=0.02,
    turn=float(np.cos(0.7)),
    last=LAST,
)
#: Least divisor.
TINY = 1e-9
#: Fourth power of the least ratio of a step to the next, 1 / 2.
MIN_STEP_RATIO = 0.0625
#: Fourth power of the greatest ratio of a step to the next, 1 / 0.3.
MAX_STEP_RATIO = 123.5
#: Largest number of nodes of a curve.
MAX_NODES = 2000
#: Reasons why a curve ends.
TURNING = "dead point"
BRANCH = "branch point"
STUCK = "step too small"
LONG = "no end after 2000 nodes"


class March:
    """Continuation of n curves from states (n, numbers) along tangents (n, m).

    Each curve has its own step length; arrays refer to the curves `who` that have not ended.
    """

    def __init__(
        self,
        curve: Curve,
        y: Array,
        tangent: Array,
        at: tuple[Array, ...] | None = None,
        limits: Limits | None = None,
        first: Array | None = None,
    ) -> None:
        f, j, drive, by = at or curve(y)
        self.curve, self.who, self.limits = curve, np.arange(len(y)), limits or LIMITS
        rate, length = curve.lifted(y, tangent), self.limits.first
        self.last: tuple[Array, ...] = (np.zeros(len(y)), y, rate, drive, (by * tangent).sum(1), tangent)
        self.h = np.full(len(y), length) if first is None else first
        self.sign = newton_step(f, j, tangent, signed=True)[2]
        self.crossing = np.zeros(len(y), bool)  # whether the last attempted step would have changed the orientation
        # before the first step, the previous node is extrapolated backwards along the tangent
        self.before: tuple[Array, ...] = (self.last[0] - length, y - length * rate, *self.last[2:])
        self.reason, self.tried = np.full(len(y), "", object), np.zeros(len(y), int)
        self._passed: list[tuple[Array, ...]] = [(self.who, *self.last)]

    def step(self) -> Array:
        """Try a step of every curve; return a mask of accepted steps.

        A step is refused if Newton's method does not contract, if cubics would not be near the
        curve, or if the bordered determinant changes sign: its sign is constant along a smooth
        curve (Allgower and Georg, ch. 8).
        """
        self.tried[self.who] += 1
        h, node, good, self.crossing = self.curve.compiled_step(self) or self._try_step()
        if good.all():
            self.before, self.last = self.last, node
            self._passed.append((self.who, *node))
        else:
            self.before = tuple(_where(good, a, b) for a, b in zip(self.last, self.before, strict=True))
            self.last = tuple(_where(good, a, b) for a, b in zip(node, self.last, strict=True))
            self._passed.append((self.who[good], *(v[good] for v in node)))
        self.h = h
        return np.asarray(good)

    def _try_step(self) -> tuple[Array, tuple[Array, ...], Array, Array]:
        """Predict and correct; return next step lengths, new nodes, good steps, changed signs."""
        s, y, rate, drive, slope, tangent = self.last
        back = (s - self.before[0])[:, None]
        curve, sign, limits = self.curve, self.sign, self.limits
        guess = curve.unitary(cubic(1 + self.h[:, None] / back, back, self.before[1], y, self.before[2], rate))
        if curve.redundant:  # conditions that imply all others at the start of the step
            curve = curve.selected(y)
            sign = newton_step(*curve(y)[:2], tangent, signed=True)[2]
        f, j, _, _ = curve(guess)
        off, along, _ = newton_step(f, j, tangent)
        size = np.sqrt((off * off).sum(1))
        near = curve.unitary(curve.moved(guess, off))
        f, j, value, by = curve(near)
        off, new, new_sign = newton_step(f, j, along, signed=True)
        left = np.sqrt((off * off).sum(1))
        y_new = curve.moved(near, off)
        rate_new = curve.lifted(y_new, new)
        # ratio of arc to chord, for the cubics and the next predictor
        ahead = y_new - y
        chord = np.sqrt((curve.weight * ahead**2).sum(1))
        arc = chord * (1 + (2 - 2 * (curve.weight * rate_new * rate).sum(1)) / 24)
        bow = (curve.weight * (ahead - (0.5 * arc)[:, None] * (rate + rate_new)) ** 2).sum(1)
        bow *= not curve.spins
        good = size <= np.minimum(limits.refused, 0.1 * self.h)
        good &= left <= np.maximum(limits.contraction * size, limits.last)
        turn = ((new - tangent) ** 2).sum(1)
        turned, bent = turn / (2 - 2 * limits.turn), bow / (limits.bow * arc + TINY) ** 2
        good &= (turned <= 1) & (bent <= 1)
        crossing = new_sign != sign
        good &= ~crossing
        if curve.periodic:
            value = drive + around(value - drive)
        value, slope_new = value + (by * off).sum(1), (by * new).sum(1)
        if limits.margin >= 0:
            with np.errstate(all="ignore"):
                good &= rises(slope, slope_new, (value - drive) / arc, limits.margin * turn**1.5)
        # corrections and the square of the bow grow like the fourth power of a step, its turn
        # linearly
        worst = np.maximum(np.maximum(size / limits.aim, 2 * bent), 4 * turned**2)
        change = np.fmax(np.fmin(worst, MAX_STEP_RATIO), MIN_STEP_RATIO) ** -0.25
        change = np.where(good, change, np.minimum(change, 0.5))
        node = s + arc, y_new, rate_new, value, slope_new, new
        return np.minimum(change * self.h, limits.longest), node, np.asarray(good), crossing

    def stopped(self) -> Array:
        """Return a mask of curves with too short steps, and record the reason."""
        stopped = self.h < np.where(self.crossing, self.limits.at_branch, self.limits.shortest)
        self.reason[self.who[stopped]] = np.where(self.crossing[stopped], BRANCH, STUCK)
        return np.asarray(stopped)

    def end(self, here: Array) -> None:
        """End the tracing of some curves."""
        keep = np.flatnonzero(~here)
        self.who, self.h, self.curve = self.who[keep], self.h[keep], self.curve.take(keep)
        self.sign, self.crossing = self.sign[keep], self.crossing[keep]
        self.last, self.before = (tuple(v[keep] for v in node) for node in (self.last, self.before))

    def traces(self) -> Traces:
        """Return the nodes of all curves."""
        who, *nodes = (np.concatenate(column) for column in zip(*self._passed, strict=True))
        order = np.argsort(who, kind="stable")
        return Traces(who[order], Trace._make([*(v[order] for v in nodes), ""]), self.reason, self.tried)

    def trace(self, i: int) -> Trace:
        """Return the nodes of one curve."""
        return self.traces().one(i)


def _where(mask: Array, a: Array, b: Array) -> Array:
    return np.asarray(np.where(mask.reshape(-1, *[1] * (a.ndim - 1)), a, b))


def trace_toward(curve: Curve, y: Array, tangent: Array, target: Array, **given: Any) -> Traces:
    """Trace curves until their drives pass a target (n,) or reverse.

    Further arguments are those of `March`.
    """
    march = March(curve, y, tangent, **given)
    direction = np.sign(target - march.last[3])
    march.end(direction == 0)
    for _ in range(MAX_NODES):
        if not len(march.who):
            break
        good, here = march.step(), direction[march.who]
        passed = good & (here * (march.last[3] - target[march.who]) >= 0)
        turned = good & ~passed & (here * march.last[4] <= 0)
        ended = passed | turned | march.stopped()
        if ended.any():
            march.reason[march.who[passed]] = ""
            march.reason[march.who[turned]] = TURNING
            march.end(ended)
    march.reason[march.who] = LONG
    traces = march.traces()
    some = np.flatnonzero(traces.reason == TURNING)
    if len(some):
        last, nodes = traces.last[some], traces.nodes
        found = dead_points(curve.take(some), nodes.take(last - 1), nodes.take(last))
        for v, new in zip(nodes[:-1], found[:-1], strict=True):
            v[last] = new
    return traces
