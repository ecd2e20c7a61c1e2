"""Sample a motion so that nothing happens unseen between two samples.

The phase of a circuit says little of what moves.  Near a change point, or where two pins nearly
meet, a link turns by half a turn or by a whole one while the phase grows by a millionth.  All such
places are at multiples of a quarter turn of the phase: there the leading crank is in line with the
frame, or reverses.  `resolved` starts from even samples and from some that crowd at these places.
It halves intervals until each value is known within them as well as at their ends.  From this table
come rows, polylines and splines, each with a stated error.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .types import Complexes, Floats, Mask


class Sampling(NamedTuple):
    """How finely a motion is sampled."""

    #: samples at first: several for each wiggle of a coupler curve, which has degree six
    even: int = 49
    #: Largest error between two samples [scale]: rows then keep their share to a part in a
    #: hundred.
    table_error: float = 2e-3
    #: Largest step between samples [scale]: a link that turns once is seen in 60 positions.
    table_step: float = 0.1
    max_rounds: int = 60  #: most halvings of an interval: a double has 52 bits
    max_samples: int = 50_000  #: most samples: thirty times those of a curve near a change point
    #: Speed of a value over its mean speed above which rows stand closer: a crank-rocker has even
    #: rows.
    crowding: float = 4.0
    #: Way below which a value is at rest [scale]: shares of less would be shares of rounding.
    rest: float = 1e-3


SAMPLING = Sampling()

#: Step of the phases at which leading crank and frame are in line, or the crank reverses [rad].
IN_LINE = 0.5 * np.pi
#: Distances from there at which samples crowd, down to the root of the rounding of a phase [rad].
CROWDED = IN_LINE * 4.0 ** -np.arange(2.5, 13.5)
#: Places within an interval at which it is tested: the middle alone would miss a curve that is
#: symmetric about it.
INNER = np.array([0.25, 0.5, 0.75])


class Polyline(NamedTuple):
    """How closely a polyline follows a curve."""

    #: Largest error [scale]: a tenth of the width of a line on a card of 360 pixels.
    error: float = 8e-5
    #: part of the error for which intervals are laid out: most then need no halving
    aimed: float = 0.8
    #: fewest intervals: an arc flatter than its error looks smooth all the same
    min_intervals: int = 16
    straight: float = 1e-3  #: part of the intervals that is laid out evenly, for straight parts


POLYLINE = Polyline()


class Enclosure(NamedTuple):
    """How a least value is enclosed."""

    rounds: int = 6  #: rounds: 8 to the sixth is finer than the root of rounding
    samples: int = 17  #: samples of a round


ENCLOSURE = Enclosure()


Curve = Callable[[Floats], Complexes]
#: Values at both ends (j, k) and within (3, j, k) of intervals -> how far each is off, over what is
#: allowed, (j,).
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
        """Measure in which rows are even, from 0 on, shape (m,).

        It is the share of the parameter, but grows faster where a value runs above
        `SAMPLING.crowding` times its mean speed.
        """
        steps = np.abs(np.diff(self.values, axis=0)) / self.scale
        shares = steps / np.maximum(steps.sum(0), SAMPLING.rest)
        run = np.abs(np.diff(self.at)) / abs(self.at[-1] - self.at[0])
        return np.append(0.0, np.cumsum(np.maximum(run, shares.max(1) / SAMPLING.crowding)))

    def rows(self, share: Floats) -> Floats:
        """Return the parameters at shares (n,) of the way, from 0 to 1.

        Between n even shares no value runs farther than (`SAMPLING.crowding` + k)/(n - 1) of its
        whole way, for k values.
        """
        way = self.way
        return np.asarray(np.interp(share * way[-1], way, self.at))

    def share(self, at: Floats | float) -> Floats:
        """Return the shares of the way at parameters: the inverse of `rows`."""
        way = self.way
        forward = self.at[-1] >= self.at[0]
        run, way = (self.at, way) if forward else (self.at[::-1], way[::-1])
        return np.asarray(np.interp(at, run, way) / max(way[0], way[-1]))

    def linked(self, share: Floats, error: float) -> Floats:
        """Add shares to shares (n,) of the way until values vary linearly between them.

        Parameters
        ----------
        share : ndarray, shape (n,)
        error : float
            Largest distance of a value from the mean of its neighbours, half way between them
            [scale].

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
            Values that the polyline follows.
        error : float
            Largest distance from it [scale].

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
        In this order or the other [rad].
    fixed : ndarray, shape (k,)
        Scale of each value; NaN: its extent, the larger one of width and height.
    least : float
        Least scale of that kind [length].
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
    at, values = halved(lambda s: np.asarray(curve(s) / scale), first, _off_table)
    return Samples(curve, at, values * scale, scale)


def halved(curve: Curve, at: Floats, test: Test) -> tuple[Floats, Complexes]:
    """Halve intervals until all pass a test, and return parameters and values.

    Parameters
    ----------
    curve : callable
        Values (m, k) at parameters (m,).
    at : ndarray, shape (m,)
        Ends of the intervals at first.
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
    """Minimise a function about the least of its values (m,) at parameters (m,), to rounding."""
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
    """Evaluate a curve at `INNER` of each interval between parameters (m,).

    Returns
    -------
    complex ndarray, shape (3, m - 1, k)
    """
    inner = at[:-1] + np.multiply.outer(INNER, np.diff(at))
    return curve(inner.ravel()).reshape(*inner.shape, -1)


def _off_table(a: Complexes, b: Complexes, inner: Complexes) -> Floats:
    """Return the error of intervals of the table over what is allowed, shape (j,)."""
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
