"""A block of mechanisms on its way along a path, each with steps of its own, until its motion ends."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ...kinematics.types import Array
from .equations import System
from .formulation import formulated
from .mechanism import Mechanisms
from .newton import LAST
from .position import EDGE, OK, driver_units, off_edge
from .predictor_corrector import FIRST, LONGEST, SHORTEST, Corrected, Front, Line, correct, turning
from .unknowns import State

TURNING = "turning point"
BRANCH = "branch point"
STUCK = "step too small"
#: A step across which the determinant changes its sign is shortened to this before a branch point is called one.
AT_BRANCH = 1e-5


class Walk:
    """A block of mechanisms on its way; the last axis of every array is that of the block.

    Parameters
    ----------
    mechanisms : Mechanisms
    path : ndarray, shape (n, s, k)
        Values of the drivers.
    state : State
        Poses at the first node.
    stop : ndarray, shape (n, s)
        Which values of the path are nodes, the last among them.
    marked : bool
        Whether to leave marks.
    """

    def __init__(self, mechanisms: Mechanisms, path: Array, state: State, stop: Array, marked: bool) -> None:
        n = len(mechanisms)
        self.mechanisms, self.system = mechanisms, formulated(mechanisms)
        self.path, self.stop = np.moveaxis(path, 0, -1) / driver_units(mechanisms), stop  # (s, k, n)
        self.count, self.marked = stop.sum(1), marked
        node = np.argsort(~stop, axis=1, kind="stable")[:, : self.count.max()].T  # the others are copies of the last
        node[np.arange(len(node))[:, None] >= self.count] = len(self.path) - 1
        self.nodes = np.take_along_axis(self.path, node[:, None], 0)
        self.marks: list[tuple[Array, ...]] = []  # mechanism, node, part of the way to the next, numbers, derivative
        self.reached, self.steps, self.end = np.ones(n, int), np.zeros(n, int), np.zeros(n)
        self.reason = np.full(n, OK, dtype="U90")
        self.state = self.system.stated(state, self.nodes[0])
        self.states = np.full((len(self.nodes), *self.state.numbers.shape), np.nan)
        self.y, self.width = np.zeros(n), np.ones(n)
        self.length = np.full(n, LONGEST / 8)
        m, k = self.system.unknowns, self.nodes.shape[1]
        self.rates, self.tangent, self.before = np.zeros((m, k, n)), np.zeros((m + 1, n)), np.zeros((m + 1, n))
        self.step, self.metric, self.sign = np.ones(n), np.ones((self.system.free, n)), np.zeros(n)
        self.rated = np.zeros(n, bool)
        self.folded = np.zeros((2, n))  # length of the step across a turning point, and dy/ds at its end
        self.bounded = any(kind.bounded for g in mechanisms.guides for kind in g.kinds)

    def run(self) -> None:
        """Advance all mechanisms until each has come to its end."""
        who, system = np.arange(len(self.end)), self.system
        row = np.zeros_like(self.tangent)
        row[-1] = 1
        begun = correct(system, self._line(who), self.state, self.y, row, np.full(len(who), np.inf))
        self.sign = begun.sign
        self._landed(who, begun, np.ones(len(who)))
        while True:
            active = self._active()[who]
            if not active.any():
                if not self._turned():
                    return
                who, system = np.arange(len(self.end)), self.system
                continue
            if active.mean() < 0.75:
                who = who[active]
                system, active = self.system.take(who), active[active]
            self._advance(who, system, active)

    @cached_property
    def places(self) -> Array:
        """Where the values of the path are, in nodes from the first, less than 0 before it, shape (n, s)."""
        passed = np.maximum(np.cumsum(self.stop, axis=1) - 1, 0)
        who = np.arange(len(passed))[:, None]
        begin = self.nodes[passed, :, who]
        segment = self.nodes[np.minimum(passed + 1, len(self.nodes) - 1), :, who] - begin
        with np.errstate(invalid="ignore"):
            part = ((np.moveaxis(self.path, -1, 0) - begin) * segment).sum(2) / (segment * segment).sum(2)
        return np.where(self.stop, passed, np.where(self.stop.cumsum(1) > 0, passed + part, -1))

    def _active(self) -> Array:
        return np.asarray((self.reason == OK) & (self.reached < self.count))

    def _line(self, who: Array) -> Line:
        last = np.minimum(self.reached[who], len(self.nodes) - 1)
        q0, q1 = self.nodes[self.reached[who] - 1, :, who].T, self.nodes[last, :, who].T
        return Line(q0, (q1 - q0) / self.width[who])

    def _advance(self, who: Array, system: System, active: Array) -> None:
        """Try one step of each."""
        line, front = self._line(who), self._front(who)
        left, slope, length = self.width[who] - self.y[who], front.tangent[-1], self.length[who]
        h = np.clip(left / np.maximum(slope, 1e-300), -length, length)  # backwards if the last step crossed the node
        land, size = np.abs(h) < length, np.abs(h)
        z, row = front.predicted(h, land, self.width[who])
        y = np.where(land, self.width[who], front.y + z[-1])
        c = correct(system, line, front.state.moved(z[:-1], front.metric), y, row, np.maximum(FIRST * size, LAST))
        self.steps[who] += active
        good, stretch = c.judged(z, h, front)
        flipped = good & (c.sign != self.sign[who])
        branch = flipped & (size < AT_BRANCH)
        stuck = ~good & (size < SHORTEST)
        folded = good & ~flipped & (c.tangent[-1] <= 0)
        edge = good & ~flipped & ~folded & self._off(who, system, c, line)
        on = active & good & ~(flipped | folded | edge)
        for reason, where in ((BRANCH, branch), (STUCK, stuck), (EDGE, edge)):
            self._ended(who[active & where], reason, (front.y + h * slope)[active & where])
        turned = active & folded
        self.reason[who[turned]], self.folded[:, who[turned]] = TURNING, (h[turned], c.tangent[-1, turned])
        refused = active & ~on
        self.length[who[refused]] = size[refused] / 2
        better = size * stretch
        better = np.where(land & (better >= size), np.maximum(self.length[who], better), better)
        self.length[who[on]] = np.minimum(better, LONGEST)[on]
        walked = np.flatnonzero(on & ~land)
        i = who[walked]
        self.state.put(i, c.state[walked])
        self.y[i], self.step[i], self.before[:, i] = c.y[walked], h[walked], front.tangent[:, walked]
        self.tangent[:, i], self.metric[:, i], self.rated[i] = c.tangent[:, walked], c.metric[:, walked], False
        if self.marked and len(i):
            with np.errstate(all="ignore"):
                rates = c.tangent[:-1, walked] / c.tangent[-1, walked] * self.width[i]
            self._mark(i, self.reached[i] - 1, self.y[i] / self.width[i], c.metric[:, walked], rates)
        landed = np.flatnonzero(on & land)
        if len(landed):
            self.reached[who[landed]] += 1
            self._landed(who[landed], _taken(c, landed), h[landed])

    def _turned(self) -> bool:
        """Find the turning points that were crossed, all at once; return whether some lie beyond the next node."""
        who = np.flatnonzero(self.folded[0])
        if not len(who):
            return False
        at = turning(self.system.take(who), self._line(who), self._front(who), *self.folded[:, who])
        self.folded[:, who] = 0
        here = at.y <= self.width[who]
        self._ended(who[here], TURNING, at.y[here])
        self.reason[who[~here]] = OK
        return not here.all()

    def _front(self, who: Array) -> Front:
        arrays = (v[..., who] for v in (self.y, self.tangent, self.before, self.step, self.metric))
        return Front(self.state[who], *arrays)

    def _landed(self, who: Array, c: Corrected, h: Array) -> None:
        """Store a node, and turn towards the next."""
        node = self.reached[who] - 1
        self.state.put(who, c.state)
        self.states[node, :, who] = c.state.numbers.T
        self.end[who], self.y[who], self.metric[:, who] = node, 0, c.metric
        if self.marked and node.any():
            last = (self.nodes[node, :, who] - self.nodes[node - 1, :, who]).T
            self._mark(who, node - 1, np.ones(len(who)), c.metric, (c.rates * last).sum(1))
        self.width[who] = 1
        dq = self._line(who).q1
        if self.marked:
            self._mark(who, node, np.zeros(len(who)), c.metric, (c.rates * dq).sum(1))
        with np.errstate(invalid="ignore"):
            width = np.maximum(np.sqrt(((c.travel * dq) ** 2).sum(0)), 1e-9)
            tangent = _unit((c.rates * dq).sum(1), width)
            before = _unit((self.rates[..., who] * dq).sum(1), width)
        rated = self.rated[who]
        self.width[who], self.tangent[:, who] = width, tangent
        self.before[:, who] = np.where(rated, before, tangent)
        self.step[who], self.rates[..., who], self.rated[who] = h, c.rates, True

    def _mark(self, who: Array, node: Array, part: Array, metric: Array, rates: Array) -> None:
        state = self.state[who]
        self.marks.append((who, node, part, state.numbers, state.velocity(rates, metric)))

    def _off(self, who: Array, system: System, c: Corrected, line: Line) -> Array:
        if not self.bounded:
            return np.zeros(len(who), bool)
        local = system.local(system.world(c.state, line(c.y)))
        return off_edge(self.mechanisms[who], system, local)

    def poses(self) -> Array:
        """Return the states at the nodes as poses, shape (s, 4 + f, n), NaN where there are none."""
        s, rows, n = self.states.shape
        flat = np.moveaxis(self.states, 1, 0).reshape(rows, s * n)
        system, q = self.system.take(np.tile(np.arange(n), s)), np.moveaxis(self.nodes, 1, 0).reshape(-1, s * n)
        turns = len(self.state.quaternion)
        pose = system.pose(type(self.state)(flat[:turns], flat[turns:]), q)
        return np.moveaxis(pose.numbers.reshape(-1, s, n), 0, 1)

    def _ended(self, who: Array, reason: str, y: Array) -> None:
        if reason in (STUCK, BRANCH) and len(who):
            lost = self.system.take(who).lost(self.state[who], self._line(who)(self.y[who]))
            self.reason[who] = np.where(lost == OK, reason, lost)
        else:
            self.reason[who] = reason
        self.end[who] = self.reached[who] - 1 + np.minimum(y / self.width[who], 1)


def _unit(x: Array, y: Array) -> Array:
    z = np.concatenate([x, y[None]])
    return np.asarray(z / np.sqrt((z * z).sum(0)))


def _taken(c: Corrected, index: Array) -> Corrected:
    values = {k: v[..., index] for k, v in vars(c).items() if k != "state"}
    return Corrected(state=c.state[index], **values)
