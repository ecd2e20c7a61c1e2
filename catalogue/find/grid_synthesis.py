"""Complete a four-bar of which one crank, or both fixed or both moving pivots, are given: along the whole path.

While the guided point stays on the nominal, a crank leaves the coupler no freedom, so that the path of every other
coupler point is known, and of every fixed point in the inverse motion.  Where such a path is nearly a circle, its
centre and that point are the second dyad.  Theory has these in closed form for one position only; what is found here
are starts for the refinement, of no series.
"""

from __future__ import annotations

import numpy as np

from ..guidance.fixed_nominal import Nominal
from ..guidance.minimum_zone import grid
from ..kinematics.types import Complexes, Floats, Indices
from ..problem.request import Request

#: Stations along the path are the Chebyshev points of so many intervals, of which the middle is mid-stroke.
INTERVALS = 16
#: Places that are tried for a missing pivot: a square of so many by so many, and half its side in strokes.
SIDE, HALF = 61, {"crank": 1.5, "moving": 3.0, "fixed": 4.0}
#: Shortest and longest crank in strokes; no moving pivot is nearer to the point or the other one than the shortest.
SHORTEST, LONGEST = 0.04, 10.0
#: Sine of the angle between crank and arm below which they lie in line.
IN_LINE = 1e-12
#: Starts for each pair of given pivots.
STARTS = 40


def completed(given: str, pivots: Complexes, nominal: Nominal) -> tuple[Floats, Indices]:
    """Return pivots of linkages in mid-stroke, shape (n, 2, 2, 3), and which pair each is for, (n,).

    `given` is as in `catalogue.series.posed.Posed`; `pivots`, complex, shape (m, 2), are the given pairs in mid-stroke,
    in the unit of the path.
    """
    made = [_best(given, pair, nominal) for pair in pivots]
    z = np.concatenate(made)
    of = np.repeat(np.arange(len(made)), [len(best) for best in made])
    return np.stack([z.real, z.imag, np.ones(z.shape)], axis=-1), of


def _best(given: str, pair: Complexes, nominal: Nominal) -> Complexes:
    """Return the best linkages for one pair, ((A1, A1*), (A2, A2*)) each."""
    from scipy.ndimage import minimum_filter

    share = 0.5 * (1 + grid(INTERVALS).nodes)
    path = nominal.at(share)[0]
    middle, stroke = path[len(path) // 2], nominal.stroke
    ticks = stroke * np.linspace(-HALF[given], HALF[given], SIDE)
    place = (middle + ticks[:, None] + 1j * ticks).ravel()
    one, two = (np.full(place.shape, pivot) for pivot in pair)
    with np.errstate(all="ignore"):
        if given == "fixed":  # the second pivot runs about its moving one in the inverse motion
            a, a_, b = one, place, two
            centre, off = circles(turns(a, a_, path).conj() * (b - path[:, None]))
            b_ = middle + centre
        else:
            a, a_, b_ = (one, two, place) if given == "crank" else (place, one, two)
            b, off = circles(path[:, None] + turns(a, a_, path) * (b_ - middle))
        crank, apart = np.abs([a_ - a, b_ - b]), np.abs([b_ - a_, a_ - middle, b_ - middle])
        good = (crank > SHORTEST * stroke).all(0) & (crank < LONGEST * stroke).all(0)
        good &= (apart > SHORTEST * stroke).all(0) & np.isfinite(off)
    off = np.where(good, off, np.inf)
    square = off.reshape(SIDE, SIDE)
    least = square == minimum_filter(square, 3, mode="constant", cval=np.inf)  # no larger than any of those around
    order = np.argsort(off, kind="stable")
    order = order[(least.ravel() & good)[order]][:STARTS]
    return np.asarray(np.stack([a, a_, b, b_], axis=-1)[order].reshape(-1, 2, 2))


def reaches(crank: tuple[tuple[float, float], ...], request: Request) -> bool:
    """Return whether a crank can follow the whole path of a request, the point being its own."""
    assert request.radius is not None
    path = Nominal(request.stroke, request.radius).at(0.5 * (1 + grid(INTERVALS).nodes))[0]
    fixed, moving = (np.array([complex(*place)]) for place in crank)
    with np.errstate(all="ignore"):
        return bool(np.isfinite(turns(fixed, moving, path)).all())


def turns(fixed: Complexes, moving: Complexes | complex, path: Complexes) -> Complexes:
    """Return by which unit factors the coupler is turned at each station, shape (k, n).

    NaN where crank and arm, the line from the moving pivot to the point, do not reach; and everywhere if they lie in
    line in mid-stroke, where the point may leave to either side.

    Parameters
    ----------
    fixed, moving : complex ndarray, shape (n,)
        Cranks in mid-stroke.
    path : complex ndarray, shape (k,)
        Places of the guided point, k odd, of which the middle one is mid-stroke; lengths in one unit of any kind.
    """
    middle = path[len(path) // 2]
    crank, arm = moving - fixed, moving - middle
    span = path[:, None] - fixed
    along = 0.5 * (np.abs(span) + (np.abs(crank) ** 2 - np.abs(arm) ** 2) / np.abs(span))
    side = (crank * (middle - fixed).conj()).imag
    side = np.where(np.abs(side) <= IN_LINE * np.abs(crank) * np.abs(middle - fixed), 0.0, np.sign(side))
    across = np.sqrt(np.abs(crank) ** 2 - along**2) * np.where(side == 0, np.nan, side)
    at = fixed + span / np.abs(span) * (along + 1j * across)
    return np.asarray((at - path[:, None]) / arm)


def circles(z: Complexes) -> tuple[Complexes, Floats]:
    """Return centres of the circles nearest to paths z (k, n), and half the widths of the annuli about these centres
    that hold the stations, each (n,); NaN for points in line.

    Least squares of the power of the stations with respect to the circle (Kasa 1976), which is linear.
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
