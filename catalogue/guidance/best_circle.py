"""Best-fitting circles of given radii, for the largest or the mean square distance.

A move of the centre changes the distance of a place by the cosine and the sine of the direction to
that place. Along arcs beyond a half circle these functions are no Haar system: two opposite places
alone may determine the deviation, and then the best centre is not unique. The mean circle is
unique, and moves smoothly with the path.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ..kinematics.batch import Columns
from ..kinematics.types import Complexes, Floats, Indices
from .drive import differentiation
from .minimum_zone import Grid, grid, times
from .uniform_fit import NEXT, uniform_fit


class CircleMoves(NamedTuple):
    """Iterations for the centre of a circle."""

    #: Number of moves of a mean circle; after two the error is of fourth order in the deviation
    #: over the radius.
    mean: int = 2
    #: Largest number of moves of a best-placed circle; as steps are halved where they gain nothing,
    #: most circles need five.
    most: int = 24
    first: float = 0.3  #: longest first move [radii]: up to it the linear model holds
    last: float = 1e-9  #: length of a move at which the iteration stops [radii]
    #: Largest distance of the middle of two opposite places from the centre [radii].
    opposite: float = 0.2
    #: Longest move when extremes between the fine points are equalised [deviations].
    polish: float = 0.1


CIRCLE_MOVES = CircleMoves()

#: Trial places about these extremes, in two rounds [steps of the fine points].
POLISH_PLACES = (np.linspace(-1, 1, 9), np.linspace(-0.2, 0.2, 9))


@dataclass(frozen=True)
class Circles(Columns):
    """Best-placed circles of given radii about n paths; arrays of shape (n,).

    Attributes
    ----------
    centre : complex ndarray
    deviation : ndarray
        Largest distance of the path from the circle [length].
    unresolved : ndarray
        Bound on the error of the interpolant [length].
    stations : ndarray of int, shape (3, n)
        Fine points of the grid at which the distance is largest.
    """

    centre: Complexes
    deviation: Floats
    unresolved: Floats
    stations: Indices


def best_placed(z: Complexes, radius: Floats, centre: Complexes, points: Grid) -> Circles:
    """Place circles best about paths.

    Parameters
    ----------
    z : complex ndarray, shape (m, n)
        Paths at the nodes of a grid [length].
    radius : ndarray, shape (n,)
        Radii of the circles [length].
    centre : complex ndarray, shape (n,)
        First guesses of the centres.
    points : Grid
        Grid to which the m nodes belong.
    """
    fine, n = times(points.fine, z), len(centre)
    with np.errstate(all="ignore"):
        centre, least, stations = _minimise_by_descent(fine, radius, centre)
        # where two opposite places within the circle determine the deviation, the linear model sees
        # no gain in a move across them
        spoke = fine[stations, np.arange(n)] - centre
        opposite = np.flatnonzero(np.abs(spoke + spoke[NEXT]).min(0) < CIRCLE_MOVES.opposite * radius)
        if len(opposite):
            pair = np.abs(spoke + spoke[NEXT])[:, opposite].argmin(0)
            across = 1j * spoke[pair, opposite] / np.abs(spoke[pair, opposite])
            across = across * np.sqrt(radius * least)[opposite]
            each = np.tile(opposite, 2)
            other, lower, there = _minimise_by_descent(
                fine[:, each], radius[each], centre[each] + np.append(across, -across)
            )
            for part in np.split(np.arange(len(each)), 2):
                better = part[lower[part] < least[each[part]]]
                centre[each[better]], least[each[better]] = other[better], lower[better]
                stations[:, each[better]] = there[:, better]
        centre, deviation = _equalise_peaks(fine, radius, centre)
        unresolved = np.abs(points.coefficients[-2:] @ z).sum(0)
    return Circles(centre, deviation, unresolved, stations)


def _minimise_by_descent(fine: Complexes, radius: Floats, centre: Complexes) -> tuple[Complexes, Floats, Indices]:
    """Place circles by Gauss-Newton steps that reduce the largest distance.

    Returns
    -------
    complex ndarray, shape (n,)
        Centres.
    ndarray, shape (n,)
        Largest distances at the fine points [length].
    ndarray of int, shape (3, n)
        Fine points of these distances.
    """
    n, centre = len(centre), centre.copy()
    open_, reach, stations = np.arange(n), radius * CIRCLE_MOVES.first, np.zeros((3, n), int)
    least = np.abs(np.abs(fine - centre) - radius).max(0)
    for turn in range(CIRCLE_MOVES.most):
        here, far = fine[:, open_], radius[open_]
        spoke = here - centre[open_]
        away = np.abs(spoke)
        terms = np.stack([spoke.real / away, spoke.imag / away])
        move, _, stations[:, open_] = uniform_fit(terms, away - far, stations[:, open_] if turn else None)
        step = move[0] + 1j * move[1]
        step = np.nan_to_num(step * np.minimum(1.0, reach[open_] / np.abs(step)))
        now = np.abs(np.abs(here - centre[open_] - step) - far).max(0)
        better = now < least[open_]
        some = open_[better]
        centre[some], least[some] = centre[some] + step[better], now[better]
        reach[open_] = np.where(better, 2 * np.abs(step), 0.25 * np.abs(step))
        open_ = open_[(np.abs(step) > CIRCLE_MOVES.last * far) & (better | (reach[open_] > CIRCLE_MOVES.last * far))]
        if not len(open_):
            break
    return centre, least, stations


def _equalise_peaks(fine: Complexes, radius: Floats, centre: Complexes, peaks: int = 6) -> tuple[Complexes, Floats]:
    """Move circles until the largest distances, at peaks between the fine points, are equal.

    Returns
    -------
    complex ndarray, shape (n,)
        Centres.
    ndarray, shape (n,)
        Largest distances [length].
    """
    n = len(centre)
    off = np.abs(np.abs(fine - centre) - radius)
    beside = np.pad(off, ((1, 1), (0, 0)))
    extreme = np.where((off >= beside[:-2]) & (off > beside[2:]), off, 0.0)
    places = np.argpartition(-extreme, peaks, axis=0)[:peaks].astype(float)
    moved = centre
    for near in POLISH_PLACES:
        tried = np.clip(places + near[:, None, None], 0, len(fine) - 1)
        spoke, off = _interpolate(fine, moved, radius, tried.reshape(peaks * len(near), n))
        move, _, _ = uniform_fit(np.stack([spoke.real, spoke.imag]), off)
        step = move[0] + 1j * move[1]
        # a longer step means that the descent stopped early and that other places determine the
        # deviation
        step = np.where(np.abs(step) < CIRCLE_MOVES.polish * np.abs(off).max(0), step, 0.0)
        moved, off = moved + step, np.abs(off - (spoke.conj() * step).real)
        best = off.reshape(tried.shape).argmax(0)
        places = tried[best, np.arange(peaks)[:, None], np.arange(n)]
    level = np.maximum(off.max(0), np.abs(np.abs(fine - moved) - radius).max(0))
    return moved, level


def _interpolate(fine: Complexes, centre: Complexes, radius: Floats, places: Floats) -> tuple[Complexes, Floats]:
    """Interpolate directions and distances between fine points, by parabolas.

    Directions are unit vectors from the centre.

    Parameters
    ----------
    places : ndarray, shape (k, n)
        Positions along the paths [steps of the fine points].
    """
    column = np.arange(fine.shape[1])
    nearest = np.clip(np.rint(places).astype(int), 1, len(fine) - 2)
    shift = places - nearest
    before, here, after = three = np.stack([fine[nearest + k, column] for k in (-1, 0, 1)])
    spoke = here + 0.5 * shift * (after - before + shift * (before - 2 * here + after)) - centre
    low, at, high = np.abs(three - centre) - radius
    return spoke / np.abs(spoke), at + 0.5 * shift * (high - low + shift * (low - 2 * at + high))


def squared_centre(z: Complexes) -> Complexes:
    """Fit circles of any radius to positions (m, ...) by squared radii; return the centres."""
    home = z.mean(0)
    w = z - home
    square = np.abs(w) ** 2
    return np.asarray(home + _moved(w.real, w.imag, 0.5 * (square - square.mean(0)), 1.0))


def mean_centre(
    z: Complexes,
    radius: Floats | float,
    centre: Complexes,
    weight: Floats | float = 1.0,
    moves: int = CIRCLE_MOVES.mean,
) -> Complexes:
    """Fit circles of a radius to places by the mean square distance, and return the centres.

    Parameters
    ----------
    z : complex ndarray, shape (m, ...)
    centre : complex ndarray, shape (...)
        First guesses of the centres.
    weight : ndarray, shape (m, ...), optional
        Weights of the places.
    """
    for _ in range(moves):
        spoke = z - centre
        far = np.abs(spoke)
        step = _moved(spoke.real / far, spoke.imag / far, far - radius, weight)
        centre = centre + step * np.minimum(1.0, 0.5 * radius / np.abs(step))
    return np.asarray(centre)


def _moved(x: Floats, y: Floats, values: Floats, weight: Floats | float) -> Complexes:
    """Solve a x + b y = values by least squares for a + i b."""
    xx, xy, yy = ((weight * part).sum(0) for part in (x * x, x * y, y * y))
    a, b = (weight * values * x).sum(0), (weight * values * y).sum(0)
    return np.asarray((a * yy - b * xy + 1j * (b * xx - a * xy)) / (xx * yy - xy * xy))


def by_length(z: Complexes) -> Floats:
    """Return weights (m, n) that turn sums over nodes into integrals along paths z (m, n)."""
    count = len(z) - 1
    return np.asarray(np.abs(times(differentiation(count), z)) * _quadrature(count)[:, None])


@lru_cache
def _quadrature(count: int) -> Floats:
    """Return the Clenshaw-Curtis weights, shape (count + 1,)."""
    order = np.arange(count + 1)
    with np.errstate(divide="ignore"):
        moments = np.where(order % 2 == 0, 2.0 / (1.0 - order.astype(float) ** 2), 0.0)
    return np.asarray(moments @ grid(count).coefficients)
