"""Sample a smooth curve of one parameter so that nothing between two samples is missed.

The phase of a circuit is a poor measure of what happens: near a change point, or where two pins nearly meet, links turn
by half a turn or a whole one while the phase grows by a millionth.  All such places lie where the leading crank is in
line with the frame or reverses, at multiples of a quarter turn of the phase.  `resolved` therefore starts from even
samples and from samples that crowd at those places, and halves intervals until places and directions are known between
them as well as at them.  From this table come even rows, polylines and splines, each with an error that it states.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from .types import Array, Complexes, Floats, Mask

#: Samples taken at first between the two ends: more than a coupler curve, of degree six, has wiggles.
EVEN = 49
#: Leading crank and frame are in line, or the crank reverses, at multiples of this phase [rad].
IN_LINE = 0.5 * np.pi
#: Distances from there at which samples crowd, down to the root of the rounding of a phase [rad].
CROWDED = IN_LINE * 2.0 ** -np.arange(5, 27)
#: Between two samples of the table values may be off the straight line between them by this, and apart by that [scale].
TABLE_ERROR, TABLE_STEP = 2e-3, 0.1
#: Where an interval is looked at: a third sample alone would miss a curve that is symmetric about it.
INNER = np.array([0.25, 0.5, 0.75])
#: Halvings, and samples, at most: a double has 52 bits.
MAX_ROUNDS, MAX_SAMPLES = 60, 50_000
#: A value runs at most so many times as far between two even rows as it does on average, where rows are even in phase.
CROWDING = 4.0
#: Way below which a value is at rest [scale].
REST = 1e-3
#: Error of a polyline [scale], and part of it that its intervals are laid out for.
POLYLINE_ERROR, AIMED = 8e-5, 0.8
#: Fewest intervals of a polyline: what is bent less than its error is drawn smoothly all the same.
FEWEST = 16
#: Error of a spline [scale], its points at first, and steps in which the place nearest to another is found on it.
SPLINE_ERROR, SPLINE_POINTS, NEWTON = 2e-7, 361, 4

Curve = Callable[[Floats], Complexes]
#: Values at both ends (j, k) and within (3, j, k) of intervals -> how far each is off, over what is allowed, (j,).
Test = Callable[[Complexes, Complexes, Complexes], Floats]


@dataclass(frozen=True)
class Samples:
    """Values of a curve between two parameters, resolved.

    Attributes
    ----------
    curve : callable
        Values (m, k) at parameters (m,); complex: places, or directions of links as unit vectors.
    at : ndarray, shape (m,)
        Parameters, from one end to the other.
    values : ndarray, shape (m, k)
    scale : ndarray, shape (k,)
        Unit of the errors of each value.
    """

    curve: Curve
    at: Floats
    values: Complexes
    scale: Floats

    @property
    def way(self) -> Floats:
        """Measure in which rows are even, from 0 on, shape (m,): the share of the parameter, but faster where a value
        runs more than `CROWDING` times as far as on average."""
        steps = np.abs(np.diff(self.values, axis=0)) / self.scale
        shares = steps / np.maximum(steps.sum(0), REST)
        run = np.abs(np.diff(self.at)) / abs(self.at[-1] - self.at[0])
        return np.append(0.0, np.cumsum(np.maximum(run, shares.max(1) / CROWDING)))

    def rows(self, share: Floats) -> Floats:
        """Return the parameters at shares (n,) of the way, from 0 to 1.

        With n even shares no value runs farther from one row to the next than (`CROWDING` + k)/(n - 1) of its whole
        way, k being the number of values; the first and the last are the ends to the last digit.
        """
        way = self.way
        return np.asarray(np.interp(share * way[-1], way, self.at))

    def share(self, at: Floats | float) -> Floats:
        """Return the shares of the way at parameters, the other way round than `rows`."""
        way = self.way
        forward = self.at[-1] >= self.at[0]
        run, way = (self.at, way) if forward else (self.at[::-1], way[::-1])
        return np.asarray(np.interp(at, run, way) / max(way[0], way[-1]))

    def linked(self, share: Floats, error: float) -> Floats:
        """Return shares (n,) of the way, and as many more as no value needs to be off by more than `error` of its scale
        half way between two of them."""

        def curve(share: Floats) -> Complexes:
            return np.asarray(self.curve(self.rows(share)) / self.scale)

        return halved(curve, share, lambda a, b, inner: np.abs(inner[1] - 0.5 * (a + b)).max(-1) / error)[0]

    def polyline(self, columns: list[int], error: float = POLYLINE_ERROR) -> Floats:
        """Return the parameters of a polyline from which the values of some columns are off by at most `error` of their
        scale."""
        scale = self.scale[columns]

        def curve(at: Floats) -> Complexes:
            return np.asarray(self.curve(at)[:, columns] / scale)

        ends = self.values[:, columns] / scale
        off = _off_chord(ends[:-1], ends[1:], _within(curve, self.at))
        laid = np.append(0.0, np.cumsum(np.sqrt(np.nan_to_num(off) / (AIMED * error))))
        count = max(FEWEST, int(np.ceil(min(laid[-1], MAX_SAMPLES))))
        laid += 1e-3 * np.linspace(0, max(1.0, laid[-1]), len(laid))  # where it is straight
        even = np.interp(np.linspace(0, laid[-1], count + 1), laid, self.at)
        return halved(curve, even, lambda a, b, inner: _off_chord(a, b, inner) / error)[0]

    def spline(self, column: int, error: float = SPLINE_ERROR) -> tuple[Floats, Floats]:
        """Return the parameters of the points of a cubic spline, see `cubic`, from which a value is off by at most
        `error` of its scale, and the parameters of the spline there, from 0 to 1."""
        scale = self.scale[column]
        at = self.rows(np.linspace(0, 1, SPLINE_POINTS))
        for _ in range(MAX_ROUNDS):
            z = self.curve(at)[:, column] / scale
            knots = spline_parameters(at, z)
            inner = _within(lambda s: self.curve(s)[:, [column]] / scale, at)[..., 0]
            rough = _off_spline(cubic(knots, z), knots, inner) > error
            if not rough.any() or len(at) > MAX_SAMPLES:
                break
            at = np.sort(np.append(at, 0.5 * (at[:-1] + at[1:])[rough]))
            at = at if self.at[-1] > self.at[0] else at[::-1]
        return at, knots


def resolved(curve: Curve, low: float, high: float, fixed: Array, least: float) -> Samples:
    """Return the samples of a curve between two parameters.

    Parameters
    ----------
    curve : callable
        See `Samples`.
    low, high : float
        In this order or the other [rad].
    fixed : ndarray, shape (k,)
        Scale of each value; NaN where it is the extent of what is sampled.
    least : float
        Least extent that counts as such.
    """
    first = np.linspace(low, high, EVEN)
    lines = IN_LINE * np.arange(np.ceil(min(low, high) / IN_LINE - 1), np.floor(max(low, high) / IN_LINE + 1) + 1)
    near = (lines[:, None] + np.concatenate([-CROWDED, [0.0], CROWDED])).ravel()
    first = np.unique(np.append(first, near[(near > min(low, high)) & (near < max(low, high))]))
    first = first if high >= low else first[::-1]
    values = curve(first)
    with np.errstate(all="ignore"):
        extent = np.nan_to_num(
            np.maximum(*(np.nanmax(x, axis=0) - np.nanmin(x, axis=0) for x in (values.real, values.imag)))
        )
    scale = np.where(np.isnan(fixed), np.maximum(extent, least), fixed)
    at, values = halved(lambda s: np.asarray(curve(s) / scale), first, _off_table)
    return Samples(curve, at, values * scale, scale)


def halved(curve: Curve, at: Floats, test: Test) -> tuple[Floats, Complexes]:
    """Halve the intervals between parameters (m,) until all pass a test; return all parameters, and the values."""
    values = curve(at)
    open_: Mask = np.ones(len(at) - 1, bool)
    for _ in range(MAX_ROUNDS):
        some = np.flatnonzero(open_)
        middle = 0.5 * (at[some] + at[some + 1])
        fresh = (middle != at[some]) & (middle != at[some + 1])
        some = some[fresh]
        if not len(some) or len(at) > MAX_SAMPLES:
            break
        inner = at[some] + np.multiply.outer(INNER, at[some + 1] - at[some])
        within = curve(inner.ravel()).reshape(*inner.shape, -1)
        with np.errstate(all="ignore"):
            rough = test(values[some], values[some + 1], within) > 1
        some, inner, within = some[rough], inner[:, rough], within[:, rough]
        parts = np.zeros(len(at), int)
        parts[some + 1] = 1
        place = np.arange(len(at)) + np.cumsum(parts)
        grown, known = np.empty(len(at) + len(some)), np.empty((len(at) + len(some), values.shape[1]), complex)
        grown[place], known[place] = at, values
        grown[place[some] + 1], known[place[some] + 1] = inner[1], within[1]
        open_ = np.zeros(len(grown) - 1, bool)
        open_[place[some]] = open_[place[some] + 1] = True
        at, values = grown, known
    return at, values


def cubic(knots: Floats, z: Complexes) -> Any:
    """Return the cubic spline through places (m,) at parameters (m,), two real columns, not-a-knot at its ends."""
    from scipy.interpolate import make_interp_spline

    return make_interp_spline(knots, np.stack([z.real, z.imag], 1), k=3)


def spline_parameters(at: Floats, z: Complexes) -> Floats:
    """Return the parameters of a spline, (m,) from 0 to 1: half the share of the phase, in which a cusp is smooth, and
    half the share of the length, in which a sudden motion is."""
    run, length = np.abs(np.diff(at)), np.abs(np.diff(z))
    both = run / run.sum() + length / max(float(length.sum()), REST)
    return np.append(0.0, np.cumsum(both) / both.sum())


def lowest(function: Callable[[Floats], Floats], at: Floats, values: Floats) -> float:
    """Return the least value of a function between parameters (m,) at which it has values (m,), to rounding."""
    least = int(np.nanargmin(values))
    low, high = at[max(least - 1, 0)], at[min(least + 1, len(at) - 1)]
    best = float(values[least])
    for _ in range(6):
        fine = np.linspace(low, high, 17)
        seen = function(fine)
        least = int(np.nanargmin(seen))
        best = min(best, float(seen[least]))
        low, high = fine[max(least - 1, 0)], fine[min(least + 1, 16)]
    return best


def _within(curve: Curve, at: Floats) -> Complexes:
    """Return the values within all intervals, shape (3, m - 1, k)."""
    inner = at[:-1] + np.multiply.outer(INNER, np.diff(at))
    return curve(inner.ravel()).reshape(*inner.shape, -1)


def _off_table(a: Complexes, b: Complexes, inner: Complexes) -> Floats:
    line = a + INNER[:, None, None] * (b - a)
    off = np.abs(inner - line).max(0) / TABLE_ERROR
    return np.asarray(np.maximum(off, np.abs(b - a) / TABLE_STEP).max(-1))


def _off_chord(a: Complexes, b: Complexes, inner: Complexes) -> Floats:
    """Return the largest distance of values within intervals from the chord."""
    chord = b - a
    with np.errstate(all="ignore"):
        along = ((inner - a) * chord.conj()).real / np.abs(chord) ** 2
        foot = a + np.clip(np.nan_to_num(along), 0, 1) * chord
        return np.asarray(np.abs(inner - foot).max((0, -1)))


def _off_spline(spline: Any, knots: Floats, inner: Complexes) -> Floats:
    """Return the largest distance of places (3, m - 1) within the intervals from a spline: from the place there that is
    found by Newton's method, so that it is never told too small."""
    u = knots[:-1] + np.multiply.outer(INNER, np.diff(knots))
    slope, least = spline.derivative(), np.full(u.shape, np.inf)
    for _ in range(NEWTON):
        (x, y), (dx, dy) = np.moveaxis(spline(u), -1, 0), np.moveaxis(slope(u), -1, 0)
        off, along = inner - (x + 1j * y), dx + 1j * dy
        least = np.minimum(least, np.abs(off))
        with np.errstate(all="ignore"):
            step = np.nan_to_num((off * along.conj()).real / np.abs(along) ** 2)
        u = np.clip(u + step, knots[:-1], knots[1:])
    return np.asarray(least.max(0))
