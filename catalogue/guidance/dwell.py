"""Dwells: a dyad between a coupler point on an arc and the arc's centre rests.

The crank turns fully and steadily.  The output dyad is a rod as long as the arc's radius, from the
guided point P to a joint D, which stands at the centre of the arc during the dwell, and a rocker
from D to a fixed pivot E.  All measures are taken over the full turn of the crank: the rocker's
swing, the crank rotation during which it stays within a given angle, and the least transmission
angle at D.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..kinematics.batch import Rows
from ..kinematics.motion import Motion, Pose, motion
from ..kinematics.types import Array, Complexes, Floats, Integers
from .coupler_curve import CouplerCurve
from .metrics import min_transmission_turn
from .minimum_zone import grid
from .slides import slide_ends, slide_runs

#: Number of intervals between the Chebyshev points of the turn at which slides are sampled.
NODES = 96


@dataclass(frozen=True)
class Dwell(Rows):
    """Dwells of rockers over a full turn of the crank; arrays of one shape [deg].

    Attributes
    ----------
    angle : ndarray
        Rotation of the crank while the rocker stays within the band about its reference position.
    begin : ndarray
        Rotation of the crank from the reference position to the beginning of the dwell, not above
        0.
    residual : ndarray
        Range of the rocker's angles during the dwell.
    swing : ndarray
        Range of the rocker's angles over the turn; NaN if rod and rocker do not reach over the
        whole turn.
    transmission : ndarray
        Least angle between rod and rocker over the turn, 0 ... 90.
    """

    angle: Floats
    begin: Floats
    residual: Floats
    swing: Floats
    transmission: Floats


def turned(guides: CouplerCurve, crank: Integers, count: int) -> tuple[Complexes, Floats]:
    """Compute guided points at `count` uniform steps of a full crank turn, (count, n).

    The reference position is between the two middle steps.  Also returns the minimum transmission
    angle over the turn [deg].

    NaN for cranks that do not turn fully.
    """
    moving = _driven(guides, crank)
    step = (np.arange(count) + 0.5) / count * 2 - 1
    full = ~np.isfinite(moving.interval).any(axis=0)
    with np.errstate(all="ignore"):
        path = moving.pose(np.tan(0.5 * np.pi * step)[:, None] + np.zeros(len(guides))).point(guides.point)
        angle = min_transmission_turn(guides.linkage, crank)
    return np.where(full, path, np.nan), np.where(full, angle, np.nan)


def slides_over_turn(guides: CouplerCurve, crank: Integers) -> Complexes:
    """Compute the ends of rails and slots over a full turn, shape (n, 2, 2).

    See `slides.slide_ends`.
    """
    with np.errstate(all="ignore"):
        pose = _over_turn(_driven(guides, crank), len(guides))
        return slide_ends(guides.linkage, slide_runs(guides.linkage, pose))


def _driven(guides: CouplerCurve, crank: Integers) -> Motion:
    """Return the motion in the charts of cranks with numbers 1 or 2."""
    return motion(guides.linkage, crank, guides.point, pole=guides.pole)


def _over_turn(moving: Motion, n: int) -> Pose:
    """Return the poses at Chebyshev points of a full turn, entries (m, n)."""
    return moving.pose(np.tan(0.5 * np.pi * (1 - 1e-9) * grid(NODES).nodes)[:, None] + np.zeros(n))


def dwells(path: Complexes, centre: Complexes, pivot: Complexes, residual: float, swing: float = 0.0) -> Dwell:
    """Measure the dwells of rockers driven by rods along a path, arrays (n, m).

    NaN where rod and rocker do not reach over the whole turn, or the rocker turns fully.

    The path (f, n) has the guided points over a full turn in even steps, the dwell in its middle,
    where the joint D is at `centre` (n,).  Rockers about fixed pivots E (n, m) are tried.  A dwell
    keeps within a band of the width `residual`; rockers that swing by less than `swing` are left
    out [deg].
    """
    transmission, which, angle = _rocking(path, centre, pivot)
    found = np.full((4, *pivot.shape), np.nan)
    range_ = np.ptp(angle, axis=0)
    full = np.abs(angle[-1] - angle[0]) > 180  # over a turn, rather than returning to its first angle
    range_[full] = np.nan
    some = range_ >= swing
    found[0][which] = range_
    to = tuple(w[some] for w in which)
    found[1][to], found[2][to], found[3][to] = _standing(angle[:, some], residual)
    return Dwell(found[1], found[2], found[3], found[0], np.where(np.isnan(found[0]), np.nan, transmission))


def strays(path: Array, centre: Complexes, pivot: Complexes, angle: float, begin: float | None = None) -> Floats:
    """Compute the ranges of one rocker's angle over parts of the turn [deg].

    Arrays are as in `dwells`, with n = 1 and pivot (1,). A part covers `angle` of the crank and
    begins at `begin` [deg, as in `Dwell`]; if None, all parts that contain the reference position
    are measured. NaN if there is none.
    """
    _, _, angles = _rocking(path, centre, pivot[:, None])
    count, middle = len(path), len(path) // 2
    steps = round(count * angle / 360)
    if not 1 <= steps < count or not angles.shape[1]:
        return np.full(1, np.nan)
    first, last = max(middle - steps - 1, 0), middle
    if begin is not None:
        first = last = round(middle - 0.5 + count * begin / 360)
    if not 0 <= first <= last <= middle or first + steps >= count:
        return np.full(1, np.nan)
    parts = np.lib.stride_tricks.sliding_window_view(angles[first : last + steps + 1, 0], steps + 1)
    return np.asarray(np.ptp(parts, axis=1))


def _rocking(path: Complexes, centre: Complexes, pivot: Complexes) -> tuple[Floats, tuple[Integers, ...], Floats]:
    """Compute minimum transmission angles (n, m), which rockers reach, and their angles (f, k)."""
    middle = len(path) // 2
    start = 0.5 * (path[middle - 1] + path[middle])
    rod, rocker = np.abs(start - centre)[:, None], np.abs(centre[:, None] - pivot)
    with np.errstate(all="ignore"):
        side = np.sign(((start[:, None] - pivot).conj() * (centre[:, None] - pivot)).imag)
        arm = path[..., None] - pivot
        square = arm.real**2 + arm.imag**2
        cosine = (rod**2 + rocker**2 - np.stack([square.min(0), square.max(0)])) / (2 * rod * rocker)
        transmission = 90 - np.degrees(np.arcsin(np.abs(cosine).max(0)))
        which = np.nonzero((np.abs(cosine) < 1).all(0))
        arm, square = np.moveaxis(arm, 0, -1)[which].T, np.moveaxis(square, 0, -1)[which].T
        place, rod_, rocker_ = (centre[:, None] - pivot)[which], rod[which[0], 0], rocker[which]
        joint = arm * _apex(square, rod_, rocker_, side[which])
        angle = np.degrees(np.unwrap(np.angle(joint * place.conj()), axis=0))
    return transmission, which, angle


def _apex(square: Floats, rod: Floats, rocker: Floats, side: Floats) -> Complexes:
    """Compute the joint of rod and rocker relative to the arm from the rocker's pivot.

    `square` is the squared length of the arm; NaN where rod and rocker do not reach.
    """
    foot = 0.5 * (square + rocker**2 - rod**2)
    return np.asarray((foot + 1j * side * np.sqrt(square * rocker**2 - foot**2)) / square)


def joint_places(path: Complexes, point: Complexes, joint: Complexes, pivot: Complexes) -> Complexes:
    """Return the positions of joints of rods and rockers while guided points run along paths.

    Parameters
    ----------
    path : complex ndarray, shape (m, n) or (m,)
        Places of the guided points [length].
    point, joint, pivot : complex ndarray, shape (n,) or ()
        Guided point, joint and fixed pivot of the rocker in one position [length].

    Returns
    -------
    complex ndarray
        Shape of `path`; NaN where rod and rocker do not reach the point.
    """
    side = np.sign(((point - pivot).conj() * (joint - pivot)).imag)
    arm = path - pivot
    with np.errstate(invalid="ignore"):
        seen = _apex(arm.real**2 + arm.imag**2, np.abs(point - joint), np.abs(joint - pivot), side)
    return np.asarray(pivot + arm * seen)


def _standing(angle: Floats, residual: float) -> tuple[Floats, Floats, Floats]:
    """Find the longest dwell of angles (f, k): its length, its start and its range [deg].

    It contains the reference position.  Two pointers move outwards from there and back, as ranges
    grow with either end.
    """
    count, middle = len(angle), len(angle) // 2
    step = 360.0 / count
    best, begin, held = (np.full(angle.shape[1:], value) for value in (-1.0, np.nan, np.nan))
    before, after = angle[:middle][::-1], angle[middle:]
    top, low = ([of.accumulate(part, axis=0) for part in (before, after)] for of in (np.maximum, np.minimum))
    back, ahead = np.zeros(angle.shape[1], int), np.full(angle.shape[1], count - middle - 1)
    left = np.arange(angle.shape[1])
    while len(left):
        i, j = back[left], ahead[left]
        spread = np.maximum(top[0][i, left], top[1][j, left]) - np.minimum(low[0][i, left], low[1][j, left])
        inside = spread <= residual
        run = np.where(inside, (i + j + 1) * step, -1.0)
        better = run > best[left]
        some = left[better]
        best[some], begin[some], held[some] = run[better], (-0.5 - i[better]) * step, spread[better]
        back[left] += inside
        ahead[left] -= ~inside
        left = left[(back[left] < middle) & (ahead[left] >= 0)]
    return np.maximum(best, 0.0), begin, held
