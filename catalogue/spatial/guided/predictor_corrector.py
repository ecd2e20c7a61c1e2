"""One step of a batch along its solution curves, in the space of the unknowns and of the path's parameter together.

A vector z of that space is (rotation of the body, arcs of the free coordinates, y); the drivers are q0 + y q1.  A step
goes along the unit tangent T, bent by its last change, and is corrected either at fixed y or across T, which is regular
at turning points.  The determinant bordered by T keeps its sign along a curve unless a branch point is crossed
(Allgower and Georg, Introduction to Numerical Continuation Methods, ch. 8).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...kinematics.types import Array
from .elimination import solve
from .equations import System
from .newton import LAST, NOISE
from .unknowns import State

#: Evaluations of a corrector.
CORRECTIONS = 6
#: A step is refused if its first correction is a larger part of it, if the second is a larger part of the first, or if
#: the tangent turns more than this [rad], or if its chord is a larger part off.
FIRST, SECOND, TURN = 0.1, 0.2, 0.18
#: Slope of the driver that counts as none, per cube of the angle turned.
MARGIN = 0.05
BOW = 0.004
#: What they should be of the next step, and how much longer than the last it may be, and how much shorter.
WANTED_FIRST, WANTED_TURN, WANTED_BOW = 0.05, 0.1, 0.002
LONGER, SHORTER = 2.0, 0.5
LONGEST, SHORTEST = 0.5, 1e-8


@dataclass(frozen=True)
class Line:
    """Drivers q0 + y q1, both (k, n)."""

    q0: Array
    q1: Array

    def __call__(self, y: Array) -> Array:
        return np.asarray(self.q0 + y * self.q1)

    def take(self, index: Array) -> Line:
        return Line(self.q0[:, index], self.q1[:, index])


@dataclass(frozen=True)
class Front:
    """Where the curves are: y (n,), tangent and the one before (m + 1, n), length of the last step (n,)."""

    state: State
    y: Array
    tangent: Array
    before: Array
    step: Array
    metric: Array

    def predicted(self, h: Array, land: Array, end: Array) -> tuple[Array, Array]:
        """Return the step of length h, ending at y = `end` where it is to land, and the row of its corrector."""
        z = h * self.tangent + (0.5 * h * h / self.step) * (self.tangent - self.before)
        z[-1] = np.where(land, end - self.y, z[-1])
        unit = np.zeros_like(z)
        unit[-1] = 1
        return z, np.where(land, unit, self.tangent)


@dataclass(frozen=True)
class Corrected:
    """What a corrector came to, shape (n,) or (..., n).

    Attributes
    ----------
    state, y
    tangent : ndarray, shape (m + 1, n)
        Unit tangent, along the row of the corrector.
    rates : ndarray, shape (m, k, n)
        Derivatives of the unknowns by the drivers, if the row was that of y.
    travel, metric : ndarray, shape (k, n), (f, n)
        Arcs per driver and per free coordinate.
    sign : ndarray, shape (n,)
        Of the determinant bordered by the row.
    first : ndarray, shape (n,)
        Length of the first correction.
    correction : ndarray, shape (m + 1, n)
        Sum of the corrections.
    found : ndarray, shape (n,)
    """

    state: State
    y: Array
    tangent: Array
    rates: Array
    travel: Array
    metric: Array
    sign: Array
    first: Array
    correction: Array
    found: Array

    def judged(self, z: Array, h: Array, front: Front) -> tuple[Array, Array]:
        """Return where a step, predicted as z, of length h, stayed on its curve, and how much longer the next may be.

        Its chord must be along the mean of the tangents at its ends, as that of a smooth curve is to third order.

        Where y grows at both ends, the slope of its cubic through them must stay above the error that it may have, the
        cube of the angle turned: else two turning points may lie between.
        """
        with np.errstate(all="ignore"):
            a, b, rise = front.tangent[-1], self.tangent[-1], (self.y - front.y) / h
            linear, square = 6 * rise - 4 * a - 2 * b, 3 * (a + b - 2 * rise)
            dips = (square > 0) & (linear < 0) & (linear > -2 * square)
            turn = ((self.tangent - front.tangent) ** 2).sum(0)
            plain = (b <= 0) | ~dips | (a - linear**2 / (4 * square) >= MARGIN * turn**1.5)
            chord, mean = z + self.correction, self.tangent + front.tangent
            chord[-1 - len(self.metric) : -1] *= (1 + self.metric / front.metric) / 2
            bow = chord - mean * ((chord * mean).sum(0) / (mean * mean).sum(0))
            off, size = np.sqrt((bow**2).sum(0)), np.abs(h)
            good = self.found & plain & (off <= np.maximum(BOW * size, LAST)) & (turn <= TURN**2)
            parts = [np.maximum(w * size, LAST) / v for w, v in ((WANTED_FIRST, self.first), (WANTED_BOW, off))]
            stretch = np.fmin(np.sqrt(np.fmin(*parts)), WANTED_TURN / np.sqrt(turn))  # corrections grow like the cube
            return np.asarray(good), np.asarray(np.clip(stretch, SHORTER, LONGER))


def correct(system: System, line: Line, state: State, y: Array, row: Array, limit: Array) -> Corrected:
    """Return the points of the curves for which the correction is normal to a row (m + 1, n), by Newton's method.

    A mechanism is given up if its first correction is longer than `limit` (n,), a later one than `SECOND` of the last.
    """
    m, n, k = system.unknowns, len(system), len(line.q0)
    out = Corrected(
        state.copy(), y.copy(), np.zeros((m + 1, n)), np.zeros((m, k, n)),
        np.ones((k, n)), np.ones((system.free, n)), np.zeros(n), np.full(n, np.inf), np.zeros((m + 1, n)),
        np.zeros(n, bool),
    )  # fmt: skip
    who, sub, at = np.arange(n), system, (state, y)
    for i in range(CORRECTIONS):
        now = sub.evaluate(at[0], line(at[1]))
        size = len(who)
        bordered = np.empty((m + 1, m + 1, size))
        bordered[:m, :m], bordered[:m, m], bordered[m] = now.jacobian, (now.drivers * line.q1).sum(1), row
        right = np.zeros((m + 1, 2 + k, size))
        right[:m, 0], right[m, 1], right[:m, 2:] = -now.residual, 1, -now.drivers
        z, sign = solve(bordered, right)
        step, tangent = z[:, 0], z[:, 1]
        with np.errstate(all="ignore"):
            length = np.sqrt((step**2).sum(0))
            at = at[0].moved(step[:m], now.metric), at[1] + step[m]
            last = (length < LAST) | ((now.distance < NOISE * sub.reach) & (i > 0))
            gone = ~(length <= limit)
            limit = np.maximum(SECOND * length, 10 * LAST)
        if i == 0:
            out.first[:] = length
        out.correction[:, who] += step
        stop = np.flatnonzero(last | gone)
        if len(stop):
            there = who[stop]
            with np.errstate(all="ignore"):
                out.tangent[:, there] = tangent[:, stop] / np.sqrt((tangent[:, stop] ** 2).sum(0))
            out.state.put(there, at[0][stop])
            out.y[there], out.sign[there], out.found[there] = at[1][stop], sign[stop], last[stop]
            out.rates[..., there] = z[:m, 2:, stop]
            out.travel[:, there], out.metric[:, there] = now.travel[:, stop], now.metric[:, stop]
            keep = np.flatnonzero(~(last | gone))
            if not len(keep):
                break
            who, sub, line, row, limit = who[keep], sub.take(keep), line.take(keep), row[:, keep], limit[keep]
            at = at[0][keep], at[1][keep]
    return out


def turning(system: System, line: Line, front: Front, h: Array, slope: Array) -> Corrected:
    """Return the turning points of y within steps of length h (n,), at whose ends dy/ds is `slope` < 0.

    Illinois' method on dy/ds along the step; y is stationary there, so that its error is the square of that of s.
    """
    low, high = np.zeros(len(system)), h.copy()
    at_low, at_high = front.tangent[-1].copy(), slope.copy()
    kept = np.zeros(len(system))
    for _ in range(60):
        s = high - at_high * (high - low) / (at_high - at_low)
        z, row = front.predicted(s, np.zeros(len(s), bool), s)
        start = front.state.moved(z[:-1], front.metric)
        found = correct(system, line, start, front.y + z[-1], row, np.full(len(s), np.inf))
        at = found.tangent[-1]
        if not (np.abs(at) > 1e-8).any():
            break
        up = at > 0
        at_high = np.where(up, np.where(kept > 0, at_high / 2, at_high), at)
        at_low = np.where(up, at, np.where(kept < 0, at_low / 2, at_low))
        low, high = np.where(up, s, low), np.where(up, high, s)
        kept = np.where(up, np.maximum(kept, 0) + 1, np.minimum(kept, 0) - 1)
    return found
