"""Along the curve of all poses that a mechanism of one freedom can take: coarse steps first, then all poses at once.

The conditions leave a curve; its arc length is regular where any drive has a dead point, so that the curve is followed
without regard to what drives (Allgower and Georg, Introduction to Numerical Continuation Methods).  Nodes on it are as
far apart as a cubic through the last two allows; poses asked for are put on cubics between nodes, and corrected
together by Newton's method.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...kinematics.types import Array
from . import compiled
from .curve import Curve, Trace, around, cubic, orientation
from .dead_points import up_to_dead_point
from .newton import LAST, newton_step

#: First correction at a node that is aimed at, above which a step is refused, and steps [rad, units].
AIM, REFUSED, FIRST, LONGEST, SHORTEST = 2e-3, 1e-2, 0.1, 0.8, 1e-7
#: Second correction at a node, at most, over the first: where Newton's method does not contract, another curve is near.
CONTRACTION = 0.2
#: A step shorter than this that would still change the orientation of the curve is at a branch point [rad, units].
AT_BRANCH = 1e-5
#: How far, of a step, its chord may be off the mean of the tangents at its ends: less than this on one smooth curve.
BOW = 0.02
#: Largest turn of the tangent between nodes [cos].
TURN = np.cos(0.7)
#: Nodes of a curve at most.
MOST = 2000
TURNING, BRANCH, STUCK, LONG = "dead point", "branch point", "step too small", "no end after 2000 nodes"


def limits() -> tuple[float, ...]:
    """Return the constants of a step, as the kernel takes them."""
    return AIM, REFUSED, FIRST, LONGEST, SHORTEST, CONTRACTION, AT_BRANCH, BOW, float(TURN), LAST


class March:
    """Curves on their way from states y (n, numbers), each along its tangent (n, m), with steps of its own.

    `who` says which curves are still on their way; arrays are of those alone.
    """

    def __init__(self, curve: Curve, y: Array, tangent: Array, at: tuple[Array, ...] | None = None) -> None:
        _, j, drive, by = at or curve(y)
        self.curve, self.who = curve, np.arange(len(y))
        self.last: tuple[Array, ...] = (
            np.zeros(len(y)), y, curve.system.lifted(y, tangent), drive, (by * tangent).sum(1), tangent, j,
        )  # fmt: skip
        self.h = np.full(len(y), FIRST)
        self.sign = orientation(j, tangent)
        self.crossing = np.zeros(len(y), bool)  # whether the last step tried would have changed the orientation
        # where no step was made yet, the node before is one straight behind
        self.before: tuple[Array, ...] = (self.last[0] - FIRST, y - FIRST * self.last[2], *self.last[2:])
        self.nodes: list[list[tuple[Array, ...]]] = [[tuple(v[i] for v in self.last)] for i in self.who]
        self.reason = [""] * len(y)

    def step(self) -> Array:
        """Try a step of every curve; return where one was made.

        A step is refused where Newton's method does not contract, where the cubics would not be near the curve, and
        where the bordered determinant changes its sign, which it does not on one smooth curve (Allgower and Georg,
        ch. 8).
        """
        h, node, good, self.crossing = self._compiled() or self._tried()
        if good.all():
            self.before, self.last = self.last, node
        else:
            self.before = tuple(_where(good, a, b) for a, b in zip(self.last, self.before, strict=True))
            self.last = tuple(_where(good, a, b) for a, b in zip(node, self.last, strict=True))
        for i in np.flatnonzero(good):
            self.nodes[self.who[i]].append(tuple(v[i] for v in self.last))
        self.h = h
        return np.asarray(good)

    def _compiled(self) -> Any:
        """Return what `_tried` does, by the kernel, if it can."""
        fast = self.curve.system.fast
        if fast is None:
            return None
        return compiled.steps(fast, self.curve.held, self.h, self.sign, self.before, self.last, limits())

    def _tried(self) -> tuple[Array, tuple[Array, ...], Array, Array]:
        """Return next lengths of steps, new nodes, where a step is good, and where it would change the orientation."""
        s, y, rate, drive, _, tangent, _ = self.last
        back = (s - self.before[0])[:, None]
        system = self.curve.system
        guess = system.unitary(cubic(1 + self.h[:, None] / back, back, self.before[1], y, self.before[2], rate))
        curve, sign = self.curve, self.sign
        if system.redundant:  # conditions that stand for all others where the step begins
            curve = curve.selected(y)
            sign = orientation(curve(y)[1], tangent)
        f, j, _, _ = curve(guess)
        off, across_guess = newton_step(f, j, tangent)
        size = np.sqrt((off * off).sum(1))
        near = system.unitary(system.moved(guess, off))
        f, j, value, by = curve(near)
        off, new = newton_step(f, j, across_guess)
        left = np.sqrt((off * off).sum(1))
        y_new = system.moved(near, off)
        rate_new = system.lifted(y_new, new)
        # the arc over the chord: the cubics, and the next guess, rely on it
        ahead = y_new - y
        chord = np.sqrt((system.weight * ahead**2).sum(1))
        arc = chord * (1 + (2 - 2 * (system.weight * rate_new * rate).sum(1)) / 24)
        bow = (system.weight * (ahead - (0.5 * arc)[:, None] * (rate + rate_new)) ** 2).sum(1)
        bow *= not system.idle.size  # a spin that is idle follows no curve of its own
        good = (size <= np.minimum(REFUSED, 0.1 * self.h)) & (left <= np.maximum(CONTRACTION * size, LAST))
        good &= ((new * tangent).sum(1) >= TURN) & (bow <= (BOW * arc) ** 2)
        crossing = orientation(j, new) != sign
        good &= ~crossing
        if system.scalars[-1].periodic:
            value = drive + around(value - drive)
        node = (s + arc, y_new, rate_new, value + (by * off).sum(1), (by * new).sum(1), new, j)
        change = np.clip((AIM / np.maximum(size, 1e-9)) ** 0.25, 0.3, 2.0)
        change = np.where(good, change, np.minimum(change, 0.5))
        return np.minimum(change * self.h, LONGEST), node, np.asarray(good), crossing

    def stopped(self) -> Array:
        """Return which curves cannot go on, and note why."""
        stopped = self.h < np.where(self.crossing, AT_BRANCH, SHORTEST)
        for i in np.flatnonzero(stopped):
            self.reason[self.who[i]] = BRANCH if self.crossing[i] else STUCK
        return np.asarray(stopped)

    def end(self, here: Array) -> None:
        """Take some curves off their way."""
        keep = np.flatnonzero(~here)
        self.who, self.h, self.curve = self.who[keep], self.h[keep], self.curve.take(keep)
        self.sign, self.crossing = self.sign[keep], self.crossing[keep]
        self.last, self.before = (tuple(v[keep] for v in node) for node in (self.last, self.before))

    def trace(self, i: int) -> Trace:
        """Return the nodes of one curve."""
        return Trace._make([*(np.stack(column) for column in zip(*self.nodes[i], strict=True)), self.reason[i]])


def _where(mask: Array, a: Array, b: Array) -> Array:
    return np.asarray(np.where(mask.reshape(-1, *[1] * (a.ndim - 1)), a, b))


def toward(curve: Curve, y: Array, tangent: Array, target: Array, at: tuple[Array, ...] | None = None) -> list[Trace]:
    """Follow each curve until its drive has passed a target (n,), or turns back."""
    march = March(curve, y, tangent, at)
    direction = np.sign(target - march.last[3])
    march.end(direction == 0)
    for _ in range(MOST):
        if not len(march.who):
            break
        good, here = march.step(), direction[march.who]
        passed = good & (here * (march.last[3] - target[march.who]) >= 0)
        turned = good & ~passed & (here * march.last[4] <= 0)
        ended = passed | turned | march.stopped()
        if ended.any():
            for i in march.who[turned]:
                march.reason[i] = TURNING
            march.end(ended)
    for i in march.who:
        march.reason[i] = LONG
    traces = [march.trace(i) for i in range(len(y))]
    return [
        up_to_dead_point(curve.take(np.array([i])), trace) if trace.reason == TURNING else trace
        for i, trace in enumerate(traces)
    ]
