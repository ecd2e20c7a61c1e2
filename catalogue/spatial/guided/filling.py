"""Positions between the steps of a walk, many at once: interpolated, corrected at their drivers, and checked.

A walk goes in steps as long as its control allows and leaves marks: states and their derivatives along the way.  What
lies between two marks follows from the polynomial through them and their neighbours, which agrees to so many digits
that one correction is enough.  A node counts where Newton's method stays near the polynomial, the rates there agree
with its derivative, and the determinant has the sign of the walk; elsewhere steps must lead.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...kinematics.types import Array
from .continuation import Walk
from .elimination import solve
from .newton import LAST, NOISE
from .position import off_edge
from .predictor_corrector import SECOND

#: Nodes that are corrected together.
TOGETHER = 2048
#: Corrections that a node is given.
CORRECTIONS = 3
#: Largest first correction, of the way between the marks, and largest difference of the rates, of themselves.
NEAR, ALIKE = 1e-3, 1e-2
#: Sine of the angle between two pieces of a path below which the node between them is no corner.
STRAIGHT = 1e-9
#: Rounding errors by which a driver's value may be beside a straight line.
ROUNDING = 8 * float(np.finfo(float).eps)


def corners(nodes: Array) -> Array:
    """Return which nodes (n, s, k) of a path are its ends, or where it does not go straight on, shape (n, s)."""
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


@dataclass(frozen=True)
class Pieces:
    """Polynomials between the marks of walks, in the order of mechanisms, corners and the parameter.

    Attributes
    ----------
    line : ndarray, shape (p,)
        Straight line that each is of: mechanism times `lines`, and corners passed.
    at : ndarray, shape (8, p)
        Parameters, from 0 to 1 on each line, of the ends of each and of its neighbours, each twice.
    factors : ndarray, shape (8, rows, p)
        Divided differences.
    lines : int
    """

    line: Array
    at: Array
    factors: Array
    lines: int

    @staticmethod
    def of(walk: Walk) -> Pieces:
        """Return the polynomials between the marks of a walk."""
        who, corner, t, value, slope = (np.concatenate(v, axis=-1) for v in zip(*walk.marks, strict=True))
        line = who * len(walk.nodes) + corner
        order = np.lexsort((t, line))
        line, t, value, slope = (v[..., order] for v in (line, t, value, slope))
        one = np.flatnonzero(np.diff(line) == 0)
        joined = np.zeros(len(t) + 1, bool)
        joined[one + 1] = True
        before, after = joined[one], joined[one + 2]
        last = np.minimum(one + 2, len(t) - 1)
        marks = np.stack([one, one + 1, np.where(before, one - 1, last), last])
        at = np.repeat(t[marks], 2, axis=0)
        level = np.repeat(np.moveaxis(value[:, marks], 1, 0), 2, axis=0)
        factors = [level[0]]
        with np.errstate(all="ignore"):
            for k in range(1, 8):
                level = np.diff(level, axis=0) / (at[k:] - at[:-k])[:, None]
                if k == 1:
                    level[::2] = np.moveaxis(slope[:, marks], 1, 0)
                known = np.ones(len(one), bool) if k < 4 else before | after if k < 6 else before & after
                factors.append(np.where(known, level[0], 0))
        return Pieces(line[one], at, np.stack(factors), len(walk.nodes))

    @property
    def width(self) -> Array:
        """Part of its line that each takes."""
        return np.asarray(self.at[2] - self.at[0])

    def find(self, who: Array, corner: Array, t: Array) -> Array:
        """Return in which piece parameters are, -1 if in none."""
        if not len(self.line):
            return np.full(len(t), -1)
        line = who * self.lines + corner
        piece = np.maximum(np.searchsorted(2 * self.line + self.at[0], 2 * line + t, side="right") - 1, 0)
        inside = (self.line[piece] == line) & (t >= self.at[0, piece]) & (t <= self.at[2, piece])
        return np.where(inside, piece, -1)

    def __call__(self, piece: Array, t: Array) -> tuple[Array, Array]:
        """Return the values (rows, n) of pieces, and their derivatives."""
        value, slope = self.factors[7][:, piece], np.zeros((self.factors.shape[1], len(piece)))
        for k in range(6, -1, -1):
            off = t - self.at[k, piece]
            slope = slope * off + value
            value = value * off + self.factors[k][:, piece]
        return value, slope


def fill(walk: Walk) -> tuple[Array, Array]:
    """Return the poses (s, 4 + f, n) on the path of a walk, and which are good (n, s): its nodes, and those between."""
    poses, stop = walk.poses(), walk.stop
    states, good = np.full((len(walk.path), *poses.shape[1:]), np.nan), np.zeros(stop.shape, bool)
    passed = np.floor(walk.places).astype(int)
    who, node = np.nonzero(stop)
    states[node, :, who] = poses[passed[who, node], :, who]
    good[who, node] = passed[who, node] < walk.reached[who]
    who, node = np.nonzero(~stop & (passed >= 0) & (passed < walk.reached[:, None]))
    if len(who):
        pieces = Pieces.of(walk)
        for low in range(0, len(who), TOGETHER):
            i, j = who[low : low + TOGETHER], node[low : low + TOGETHER]
            with np.errstate(all="ignore"):
                sure, pose = _corrected(walk, pieces, i, j)
            states[j[sure], :, i[sure]], good[i[sure], j[sure]] = pose, True
    return states, good


def _corrected(walk: Walk, pieces: Pieces, who: Array, node: Array) -> tuple[Array, Array]:
    """Return which of m nodes are found beyond doubt, and the poses there, one a row."""
    t, passed = np.modf(walk.places[who, node])
    before, q = passed.astype(int), walk.path[node, :, who].T
    dq = walk.nodes[before + 1, :, who].T - walk.nodes[before, :, who].T
    piece = pieces.find(who, before, t)
    index = np.flatnonzero(piece >= 0)
    who, q, dq, piece, turns = who[index], q[:, index], dq[:, index], piece[index], len(walk.state.quaternion)
    value, slope = pieces(piece, t[index])
    state, system = type(walk.state)(value[:turns], value[turns:]), walk.system.take(who)
    sure, rest, sub, at, values = np.zeros(len(who), bool), np.arange(len(who)), system, state, q
    for i in range(CORRECTIONS):
        now = sub.evaluate(at, values)
        z, sign = solve(now.jacobian, np.stack([-now.residual, -(now.drivers * dq[:, rest]).sum(1)], axis=1))
        length = np.sqrt((z[:, 0] ** 2).sum(0))
        if i == 0:
            speed = np.sqrt((z[:, 1] ** 2).sum(0) + ((now.travel * dq) ** 2).sum(0))
            other = at.velocity(z[:, 1], now.metric) - slope
            off = np.sqrt(4 * (other[:turns] ** 2).sum(0) + ((other[turns:] * now.metric) ** 2).sum(0))
            limit = np.where(off <= ALIKE * speed, NEAR * speed * pieces.width[piece] + LAST, 0)
        at = at.moved(z[:, 0], now.metric)
        state.put(rest, at)
        last = (length < LAST) | ((now.distance < NOISE * sub.reach) & (i > 0))
        near = (length <= limit) & (sign == walk.sign[who[rest]])
        sure[rest] = near & last
        more = np.flatnonzero(near & ~last)
        if not len(more):
            break
        rest, sub, at, values, limit = rest[more], sub.take(more), at[more], values[:, more], SECOND * length[more]
    if walk.bounded:
        sure &= ~off_edge(walk.mechanisms[who], system, system.local(system.world(state, q)))
    return index[sure], system.pose(state, q).numbers[:, sure].T
