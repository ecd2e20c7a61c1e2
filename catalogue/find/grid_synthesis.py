"""Complete a four-bar with one prescribed crank, or both fixed or both moving pivots prescribed.

With the guided point on the nominal, a crank determines the pose of the coupler, hence the path of
every other coupler point, and of every fixed point in the inverse motion.  Where such a path is
nearly circular, the point and the centre form the second dyad.  Closed forms exist for one position
only; the results here are starts of the refinement, of no series.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..guidance.fixed_nominal import Nominal
from ..guidance.minimum_zone import grid
from ..kinematics.types import Complexes, Floats, Indices
from ..problem.path import PathRequest


class GridSynthesis(NamedTuple):
    """Grid search for missing pivots."""

    #: Number of intervals of the Chebyshev stations along the path: even, so that the middle
    #: station is mid-stroke.
    intervals: int = 16
    #: Grid points per side of the square searched for a missing pivot: a step of a tenth of a
    #: stroke or less resolves the minima of the circularity.
    side: int = 61
    #: Shortest crank, and shortest distance of a moving pivot from the point or the other one
    #: [strokes].
    shortest: float = 0.04
    longest: float = 10.0  #: longest crank [strokes]
    #: sine of the angle between crank and arm below which they count as aligned: above rounding
    in_line: float = 1e-12
    starts: int = 40  #: largest number of starts for each prescribed pair


SYNTHESIS = GridSynthesis()

#: Half the side of the searched square, by the prescribed pair [strokes].
HALF = {"crank": 1.5, "moving": 3.0, "fixed": 4.0}


def complete_pairs(given: str, pivots: Complexes, nominal: Nominal) -> tuple[Floats, Indices]:
    """Complete prescribed pairs of pivots to linkages at mid-stroke.

    Parameters
    ----------
    given : str
        Kind of the prescribed pair; see `catalogue.series.posed.Posed`.
    pivots : complex ndarray, shape (m, 2)
        Prescribed pairs at mid-stroke [unit of the path].
    nominal : Nominal

    Returns
    -------
    ndarray, shape (n, 2, 2, 3), and ndarray of int, shape (n,)
        Pivots of the linkages, and for each the number of its prescribed pair.
    """
    made = [_best_linkages(given, pair, nominal) for pair in pivots]
    z = np.concatenate(made)
    of = np.repeat(np.arange(len(made)), [len(best) for best in made])
    return np.stack([z.real, z.imag, np.ones(z.shape)], axis=-1), of


def _best_linkages(given: str, pair: Complexes, nominal: Nominal) -> Complexes:
    """Find the best linkages for one pair, each ((A1, A1*), (A2, A2*))."""
    from scipy.ndimage import minimum_filter

    share = 0.5 * (1 + grid(SYNTHESIS.intervals).nodes)
    path = nominal.at(share)[0]
    middle, stroke = path[len(path) // 2], nominal.stroke
    ticks = stroke * np.linspace(-HALF[given], HALF[given], SYNTHESIS.side)
    place = (middle + ticks[:, None] + 1j * ticks).ravel()
    one, two = (np.full(place.shape, pivot) for pivot in pair)
    with np.errstate(all="ignore"):
        if given == "fixed":  # in the inverse motion the fixed pivot circles about the moving one
            a, a_, b = one, place, two
            centre, off = circles(turns(a, a_, path).conj() * (b - path[:, None]))
            b_ = middle + centre
        else:
            a, a_, b_ = (one, two, place) if given == "crank" else (place, one, two)
            b, off = circles(path[:, None] + turns(a, a_, path) * (b_ - middle))
        crank, apart = np.abs([a_ - a, b_ - b]), np.abs([b_ - a_, a_ - middle, b_ - middle])
        good = (crank > SYNTHESIS.shortest * stroke).all(0) & (crank < SYNTHESIS.longest * stroke).all(0)
        good &= (apart > SYNTHESIS.shortest * stroke).all(0) & np.isfinite(off)
    off = np.where(good, off, np.inf)
    square = off.reshape(SYNTHESIS.side, SYNTHESIS.side)
    least = square == minimum_filter(square, 3, mode="constant", cval=np.inf)  # no larger than any neighbour
    order = np.argsort(off, kind="stable")
    order = order[(least.ravel() & good)[order]][: SYNTHESIS.starts]
    return np.asarray(np.stack([a, a_, b, b_], axis=-1)[order].reshape(-1, 2, 2))


def reaches(crank: tuple[tuple[float, float], ...], request: PathRequest) -> bool:
    """Tell whether a crank with its arm reaches the whole path of a request."""
    assert request.radius is not None
    path = Nominal(request.stroke, request.radius).at(0.5 * (1 + grid(SYNTHESIS.intervals).nodes))[0]
    fixed, moving = (np.array([complex(*place)]) for place in crank)
    with np.errstate(all="ignore"):
        return bool(np.isfinite(turns(fixed, moving, path)).all())


def turns(fixed: Complexes, moving: Complexes | complex, path: Complexes) -> Complexes:
    """Compute the rotation of the coupler at each station as unit complex factors, shape (k, n).

    NaN where crank and arm (from the moving pivot to the point) do not reach the station; NaN
    everywhere if they are aligned at mid-stroke, a dead point.

    Parameters
    ----------
    fixed, moving : complex ndarray, shape (n,)
        Pivots of the cranks at mid-stroke [length].
    path : complex ndarray, shape (k,)
        Positions of the guided point, k odd, the middle one at mid-stroke [length].
    """
    middle = path[len(path) // 2]
    crank, arm = moving - fixed, moving - middle
    span = path[:, None] - fixed
    along = 0.5 * (np.abs(span) + (np.abs(crank) ** 2 - np.abs(arm) ** 2) / np.abs(span))
    side = (crank * (middle - fixed).conj()).imag
    side = np.where(np.abs(side) <= SYNTHESIS.in_line * np.abs(crank) * np.abs(middle - fixed), 0.0, np.sign(side))
    across = np.sqrt(np.abs(crank) ** 2 - along**2) * np.where(side == 0, np.nan, side)
    at = fixed + span / np.abs(span) * (along + 1j * across)
    return np.asarray((at - path[:, None]) / arm)


def circles(z: Complexes) -> tuple[Complexes, Floats]:
    """Fit circles to paths by linear least squares (Kasa 1976).

    Parameters
    ----------
    z : complex ndarray, shape (k, n)
        Stations of n paths.

    Returns
    -------
    complex ndarray, ndarray, shape (n,) each
        Centres, and half the widths of the annuli about them; NaN for collinear stations.
    """
    origin = z.mean(axis=0)
    x, y = (z - origin).real, (z - origin).imag
    power = 0.5 * (x * x + y * y)
    xx, xy, yy = (x * x).sum(0), (x * y).sum(0), (y * y).sum(0)
    px, py = (power * x).sum(0), (power * y).sum(0)
    det = xx * yy - xy * xy
    centre = (px * yy - py * xy + 1j * (py * xx - px * xy)) / det
    distance = np.abs(z - origin - centre)
    return origin + centre, 0.5 * (distance.max(0) - distance.min(0))
