"""Interpolate positions between nodes of traces, correct them at their drivers, and check them.

Polynomials through two nodes and their neighbours agree to so many digits that one or two
corrections are enough.  A position counts where Newton's method stays near its polynomial, the
rates agree with its derivative, and the determinant has the sign of the curve.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...kinematics.types import Array
from ..continuation.curve import Traces
from ..continuation.elimination import solve
from .curve import LineCurve
from .newton import LAST, NOISE

#: Positions that are corrected together.
TOGETHER = 2048
#: Corrections that a position is given.
CORRECTIONS = 3
#: Largest first correction, as a part of the way between two nodes.
NEAR = 1e-3
#: Largest difference of rates, in their own size with that of the drivers.
ALIKE = 1e-2
#: Largest ratio of a correction to the one before.
SECOND = 0.2
#: `NEAR` where steps lead to a position alone.
NEAR_ALONE = 0.1
#: `ALIKE` where steps lead to a position alone.
ALIKE_ALONE = 0.2
#: Sine of the angle between two pieces of a path below which the node between them is no corner.
STRAIGHT = 1e-9
#: Rounding errors by which a driver's value may be beside a straight line.
ROUNDING = 8 * float(np.finfo(float).eps)


def corners(nodes: Array) -> Array:
    """Find the corners of paths (n, s, k), their ends among them, shape (n, s)."""
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
    """Polynomials of arc length between the nodes of traces.

    Attributes
    ----------
    first : ndarray, shape (p,)
        Node at which each begins.
    at : ndarray, shape (8, p)
        Arc lengths of the ends of each and of its neighbours, each twice.
    factors : ndarray, shape (8, numbers, p)
        Divided differences of states.
    """

    first: Array
    at: Array
    factors: Array

    @staticmethod
    def of(traces: Traces) -> Pieces:
        """Return the polynomials between the nodes of traces."""
        who, nodes = traces.who, traces.nodes
        one = np.flatnonzero(np.diff(who) == 0)
        joined = np.zeros(len(who) + 1, bool)
        joined[one + 1] = True
        before, after = joined[one], joined[one + 2]
        last = np.minimum(one + 2, len(who) - 1)
        marks = np.stack([one, one + 1, np.where(before, one - 1, last), last])
        at = np.repeat(nodes.s[marks], 2, axis=0)
        level = np.repeat(np.moveaxis(nodes.y[marks], 2, 1), 2, axis=0)
        factors = [level[0]]
        with np.errstate(all="ignore"):
            for k in range(1, 8):
                level = np.diff(level, axis=0) / (at[k:] - at[:-k])[:, None]
                if k == 1:
                    level[::2] = np.moveaxis(nodes.rate[marks], 2, 1)
                known = np.ones(len(one), bool) if k < 4 else before | after if k < 6 else before & after
                factors.append(np.where(known, level[0], 0))
        return Pieces(one, at, np.stack(factors))

    def where(self, piece: Array, value: Array) -> Array:
        """Solve for arc lengths at values of the drive, the last number of pieces."""
        low, high = self.at[0, piece], self.at[2, piece]
        s = (low + high) / 2
        for _ in range(40):  # Newton's method, kept between bounds: slow at a dead point
            there, slope = self(piece, s, slice(-1, None))
            off = there[0] - value
            low, high = np.where(off < 0, s, low), np.where(off < 0, high, s)
            better = s - off / slope[0]
            s, before = np.where((better >= low) & (better <= high), better, (low + high) / 2), s
            if not (np.abs(s - before) > LAST).any():
                break
        return np.asarray(s)

    def __call__(self, piece: Array, s: Array, rows: slice = slice(None)) -> tuple[Array, Array]:
        """Return the numbers (rows, n) of pieces at arc lengths, and their derivatives."""
        value = self.factors[7][rows, piece]
        slope = np.zeros_like(value)
        for k in range(6, -1, -1):
            off = s - self.at[k, piece]
            slope = slope * off + value
            value = value * off + self.factors[k][rows, piece]
        return value, slope


def fill(curve: LineCurve, traces: Traces, sign: Array, who: Array, value: Array, next_: Array) -> tuple[Array, Array]:
    """Find states (m, numbers) of curves `who` at values of their drives, and success.

    `sign` (n,) is that of the determinants of curves; `next_` (m,) marks poses to which steps lead
    alone.
    """
    states, good = np.full((len(value), len(curve.weight)), np.nan), np.zeros(len(value), bool)
    if not len(value) or len(traces.who) == len(traces.reason):
        return states, good
    pieces, last = Pieces.of(traces), traces.last
    span = 2 * max(np.abs(value).max(), 1e-300)  # of curves one after the other; last nodes may be farther
    key = np.minimum(traces.nodes.drive, 0.75 * span) + traces.who * span
    node = np.minimum(np.searchsorted(key, value + who * span, side="right") - 1, last[who] - 1)
    piece = np.searchsorted(pieces.first, node)
    for low in range(0, len(value), TOGETHER):
        some = slice(low, low + TOGETHER)
        with np.errstate(all="ignore"):
            states[some], good[some] = _corrected(
                curve.take(who[some]), pieces, piece[some], value[some], sign[who[some]], next_[some]
            )
    return states, good


def _corrected(
    curve: LineCurve, pieces: Pieces, piece: Array, value: Array, sign: Array, next_: Array
) -> tuple[Array, Array]:
    """Return states (m, numbers) at values of the drive, and where they are beyond doubt."""
    numbers, slope = pieces(piece, pieces.where(piece, value))
    way = pieces.at[2, piece] - pieces.at[0, piece]
    turns, dq, system = len(curve.like.quaternion), curve.q1, curve.system
    q = curve.q0 + value * dq
    state = curve.state(numbers.T).copy()
    sure, rest, sub, at, values, limit = np.zeros(len(value), bool), np.arange(len(value)), system, state, q, way
    for i in range(CORRECTIONS):
        now = sub.evaluate(at, values)
        right = np.stack([-now.residual, -(now.drivers * dq[:, rest]).sum(1)], axis=1)
        z, found = solve(now.jacobian, right)
        length = np.sqrt((z[:, 0] ** 2).sum(0))
        if i == 0:
            scale = np.concatenate([np.full((turns, len(value)), 2.0), now.metric])
            rate = np.stack([at.velocity(z[:, 1], now.metric), slope[:-1] / slope[-1]]) * scale
            rate /= np.sqrt((rate**2).sum(1) + ((now.travel * dq) ** 2).sum(0))[:, None]
            alike = np.sqrt(((rate[0] - rate[1]) ** 2).sum(0)) <= np.where(next_, ALIKE_ALONE, ALIKE)
            limit = np.where(alike, np.where(next_, NEAR_ALONE, NEAR) * way + LAST, 0)
        at = at.moved(z[:, 0], now.metric)
        state.put(rest, at)
        last = (length < LAST) | ((now.distance < NOISE * sub.reach) & (i > 0))
        near = (length <= limit) & (found == sign[rest])
        sure[rest] = near & last
        more = np.flatnonzero(near & ~last)
        if not len(more):
            break
        rest, sub, at, values, limit = rest[more], sub.take(more), at[more], values[:, more], SECOND * length[more]
    return np.concatenate([state.numbers, value[None]]).T, sure
