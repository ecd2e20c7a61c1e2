"""Sample a motion so densely that no event between two samples is missed.

The phase of a circuit does not measure motion. Near a change point, or where two pins nearly meet,
a link turns by half a turn or a full one while the phase grows by a millionth. All such places are
at multiples of a quarter turn of the phase: there the leading crank is in line with the frame, or
reverses. `resolved` starts from evenly spaced samples and from others that are dense at these
places. It halves intervals until each value is as accurate within them as at their ends. Rows,
polylines and splines are derived from this table, each with a stated error.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .types import Complexes, Floats, Mask


class Sampling(NamedTuple):
    """Options of the sampling of a motion."""

    #: number of first samples: several for each wave of a coupler curve, which has degree six
    even: int = 49
    #: Largest error between two samples [scale]: positions along the path, interpolated in the
    #: table, then have an error of one per cent.
    table_error: float = 2e-3
    #: Largest step between samples [scale]: a link that turns once is seen in 60 positions.
    table_step: float = 0.1
    max_rounds: int = 60  #: largest number of halvings of an interval: a double has 52 bits
    max_samples: int = 50_000  #: largest number of samples: thirty times that of a curve near a change point
    #: Speed of a value over its mean speed above which rows are denser: a crank-rocker has evenly
    #: spaced rows.
    crowding: float = 4.0
    #: Total displacement below which a value is at rest [scale]: its steps are then rounding.
    rest: float = 1e-3


SAMPLING = Sampling()

#: Step of the phases at which leading crank and frame are in line, or the crank reverses [rad].
IN_LINE = 0.5 * np.pi
#: Distances of additional samples from these phases, down to the square root of the rounding of a
#: phase [rad].
CROWDED = IN_LINE * 4.0 ** -np.arange(2.5, 13.5)
#: Places within an interval at which it is tested: a curve symmetric about the middle would pass a
#: test there alone.
INNER = np.array([0.25, 0.5, 0.75])


class Polyline(NamedTuple):
    """Options of a polyline along a curve."""

    #: Largest error [scale]: a tenth of the width of a line on a card of 360 pixels.
    error: float = 8e-5
    #: part of the error for which the first intervals are chosen: most then need no halving
    aimed: float = 0.8
    #: least number of intervals: an arc flatter than its error looks smooth all the same
    min_intervals: int = 16
    straight: float = 1e-3  #: fraction of the intervals that is spaced evenly, for straight parts


POLYLINE = Polyline()


class Enclosure(NamedTuple):
    """Options of the search for a minimum."""

    rounds: int = 6  #: number of rounds; each narrows the bracket to an eighth, six of them to 4e-6
    samples: int = 17  #: number of samples of a round


ENCLOSURE = Enclosure()


Curve = Callable[[Floats], Complexes]
#: Test of intervals: maps values at both ends (j, k) and within (3, j, k) to the error over the
#: permitted one, (j,).
Test = Callable[[Complexes, Complexes, Complexes], Floats]


@dataclass(frozen=True)
class Samples:
    """Samples of a curve between two parameters, dense enough for interpolation.

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
        """Cumulative measure in which rows are evenly spaced, from 0, shape (m,).

        It is the share of the parameter, but grows faster where a value moves above
        `SAMPLING.crowding` times its mean speed.
        """
        steps = np.abs(np.diff(self.values, axis=0)) / self.scale
        shares = steps / np.maximum(steps.sum(0), SAMPLING.rest)
        run = np.abs(np.diff(self.at)) / abs(self.at[-1] - self.at[0])
        return np.append(0.0, np.cumsum(np.maximum(run, shares.max(1) / SAMPLING.crowding)))

    def rows(self, share: Floats) -> Floats:
        """Return the parameters at shares (n,) of `way`, from 0 to 1.

        Between n even shares no value moves by more than (`SAMPLING.crowding` + k)/(n - 1) of its
        total displacement, for k values.
        """
        way = self.way
        return np.asarray(np.interp(share * way[-1], way, self.at))

    def share(self, at: Floats | float) -> Floats:
        """Return the shares of `way` at parameters: the inverse of `rows`."""
        way = self.way
        forward = self.at[-1] >= self.at[0]
        run, way = (self.at, way) if forward else (self.at[::-1], way[::-1])
        return np.asarray(np.interp(at, run, way) / max(way[0], way[-1]))

    def linked(self, share: Floats, error: float) -> Floats:
        """Refine shares (n,) of `way` until values vary linearly between them.

        Parameters
        ----------
        share : ndarray, shape (n,)
        error : float
            Largest distance of a value half way between two shares from the mean of the values at
            these [scale].

        Returns
        -------
        ndarray, shape (m,)
        """

        def curve(share: Floats) -> Complexes:
            return np.asarray(self.curve(self.rows(share)) / self.scale)

        return halved(curve, share, lambda a, b, inner: np.abs(inner[1] - 0.5 * (a + b)).max(-1) / error)[0]

    def polyline(self, columns: list[int], error: float = POLYLINE.error) -> Floats:
        """Return the parameters of the vertices of a polyline.

        Parameters
        ----------
        columns : list of int
            Columns of the values that the polyline follows.
        error : float
            Largest distance of the curve from the polyline [scale].

        Returns
        -------
        ndarray, shape (m,)
        """
        scale = self.scale[columns]

        def curve(at: Floats) -> Complexes:
            return np.asarray(self.curve(at)[:, columns] / scale)

        ends = self.values[:, columns] / scale
        off = off_chord(ends[:-1], ends[1:], within(curve, self.at))
        laid = np.append(0.0, np.cumsum(np.sqrt(np.nan_to_num(off) / (POLYLINE.aimed * error))))
        count = max(POLYLINE.min_intervals, int(np.ceil(min(laid[-1], SAMPLING.max_samples))))
        laid += POLYLINE.straight * np.linspace(0, max(1.0, laid[-1]), len(laid))
        even = np.interp(np.linspace(0, laid[-1], count + 1), laid, self.at)
        return halved(curve, even, lambda a, b, inner: off_chord(a, b, inner) / error)[0]


def resolved(curve: Curve, low: float, high: float, fixed: Floats, least: float) -> Samples:
    """Sample a curve between two parameters.

    Parameters
    ----------
    curve : callable
        See `Samples`.
    low, high : float
        Ends of the range, in either order [rad].
    fixed : ndarray, shape (k,)
        Scale of each value; NaN selects its extent, the larger of width and height.
    least : float
        Lower bound of a scale that is an extent [length].
    """
    first = np.linspace(low, high, SAMPLING.even)
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
    at, values = halved(lambda s: np.asarray(curve(s) / scale), first, _table_error)
    return Samples(curve, at, values * scale, scale)


def halved(curve: Curve, at: Floats, test: Test) -> tuple[Floats, Complexes]:
    """Halve intervals until all pass a test, and return parameters and values.

    Parameters
    ----------
    curve : callable
        Values (m, k) at parameters (m,).
    at : ndarray, shape (m,)
        Ends of the first intervals.
    test : callable
        Error of intervals over the permitted one; see `Test`.

    Returns
    -------
    ndarray, shape (m,), complex ndarray, shape (m, k)
    """
    values = curve(at)
    open_: Mask = np.ones(len(at) - 1, bool)
    for _ in range(SAMPLING.max_rounds):
        some = np.flatnonzero(open_)
        middle = 0.5 * (at[some] + at[some + 1])
        fresh = (middle != at[some]) & (middle != at[some + 1])
        some = some[fresh]
        if not len(some) or len(at) > SAMPLING.max_samples:
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


def lowest(function: Callable[[Floats], Floats], at: Floats, values: Floats) -> float:
    """Minimise a function near the least of its values (m,) at parameters (m,), to rounding."""
    least = int(np.nanargmin(values))
    low, high = at[max(least - 1, 0)], at[min(least + 1, len(at) - 1)]
    best = float(values[least])
    for _ in range(ENCLOSURE.rounds):
        fine = np.linspace(low, high, ENCLOSURE.samples)
        seen = function(fine)
        least = int(np.nanargmin(seen))
        best = min(best, float(seen[least]))
        low, high = fine[max(least - 1, 0)], fine[min(least + 1, len(fine) - 1)]
    return best


def within(curve: Curve, at: Floats) -> Complexes:
    """Evaluate a curve at the places `INNER` of each interval between parameters (m,).

    Returns
    -------
    complex ndarray, shape (3, m - 1, k)
    """
    inner = at[:-1] + np.multiply.outer(INNER, np.diff(at))
    return curve(inner.ravel()).reshape(*inner.shape, -1)


def _table_error(a: Complexes, b: Complexes, inner: Complexes) -> Floats:
    """Return the error of intervals of the table over the permitted one, shape (j,)."""
    line = a + INNER[:, None, None] * (b - a)
    off = np.abs(inner - line).max(0) / SAMPLING.table_error
    return np.asarray(np.maximum(off, np.abs(b - a) / SAMPLING.table_step).max(-1))


def off_chord(a: Complexes, b: Complexes, inner: Complexes) -> Floats:
    """Return the largest distance of values within intervals from their chords, shape (j,)."""
    chord = b - a
    with np.errstate(all="ignore"):
        along = ((inner - a) * chord.conj()).real / np.abs(chord) ** 2
        foot = a + np.clip(np.nan_to_num(along), 0, 1) * chord
        return np.asarray(np.abs(inner - foot).max((0, -1)))
