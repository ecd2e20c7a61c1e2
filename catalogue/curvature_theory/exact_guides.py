"""Test whether coupler points stay on their nominal over the finite motion.

A Taylor series alone cannot decide it.  Its terms are compared at a value of the parameter at which
the terms of the path are of equal size.  If the pole is far, at 1e8 times the size of the linkage
say, that parameter is so small that every term of the error is below rounding, though the point
leaves its nominal as soon as the linkage turns visibly.  So a point counts as exact only if the
finite motion, in the charts that carry it farthest, keeps it on its nominal.  The terms of other
points are compared at a visible rotation.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..kinematics.linkage import Linkage
from ..kinematics.motion import CHARTS, motion
from ..kinematics.types import Complexes, Floats, Integers, Mask


class FiniteTest(NamedTuple):
    """Options of the finite motion that decides whether a point stays on its nominal."""

    positions: int = 16  #: number of positions in either direction
    farthest: float = 1.0  #: tangent of half of the angle to which the motion is followed
    part: float = 0.9  #: part of the range up to a turning point, near which positions lose digits
    #: Value of `farthest` where the series has no term above rounding: a change point farther on
    #: may lead into the other branch.
    nearer: float = 0.1
    conditioned: float = 1e-6  #: least conditioning of a chart: worse ones lose the digits that decide
    #: Part of the longest range of any chart that a chart must cover: a shorter one proves too
    #: little.
    far: float = 0.3
    rounding: float = 1e-11  #: distance from the nominal that rounding explains [path]


FINITE = FiniteTest()

#: Parameters at which the terms of a series are compared; the smaller ones where it does not
#: converge up to the larger ones.
VISIBLE = (0.3, *np.geomspace(0.1, 1e-7, 13))
#: Number of the first significant term if rounding hides it: that of any point off its circle.
UNDECIDED = 3


def stays(
    linkage: Linkage,
    point: Complexes,
    unit: Complexes,
    curvature: Floats,
    pole: Complexes | None,
    farthest: float = FINITE.farthest,
) -> Mask:
    """Tell which coupler points stay on their nominal over the finite motion, shape (n,).

    False where no chart is conditioned well enough.

    Parameters
    ----------
    linkage : Linkage of n
    point : complex ndarray, shape (n,)
    unit : complex ndarray, shape (n,)
        Tangents of the nominals, which go through the points.
    curvature : ndarray, shape (n,)
        Curvatures of the nominals, towards -i unit [1/length].
    pole : complex ndarray, shape (n,), optional
        Chooses the branch of linkages at a change point.
    farthest : float
        Parameter, tangent of half an angle, to which the motion is followed.
    """
    ways, kept = [], []
    share = np.arange(1, FINITE.positions + 1) / FINITE.positions
    share = np.concatenate([-share[::-1], share])[:, None]
    for chart in CHARTS:
        moving = motion(linkage, chart, point, pole=pole)
        good = moving.conditioning > FINITE.conditioned
        with np.errstate(all="ignore"):
            reach = np.minimum(np.abs(FINITE.part * moving.interval), farthest)
            re, im = moving.point(point)(np.where(share < 0, reach[0], reach[1]) * share)
            path = ((re + 1j * im) * unit.conj()).conj()
            square = path.real**2 + path.imag**2
            root = np.hypot(curvature * path.real, 1 - curvature * path.imag)
            away = np.abs((2 * path.imag - curvature * square) / (1 + root))
            far, most = (np.fmax.reduce(values, axis=0) for values in (np.sqrt(square), away))
            ways.append(np.where(good, np.nan_to_num(far), 0.0))
            kept.append(most <= FINITE.rounding * far)
    # one chart suffices: another one may follow the other branch beyond a change point
    carried = np.stack(ways)
    return np.asarray(((carried > FINITE.far * carried.max(0)) & kept).any(0))


def first_term(gap: Floats, path: Complexes, most: int, tolerance: float) -> Integers:
    """Find the first significant term of the gap after a visible rotation, shape (n,).

    Parameters
    ----------
    gap, path : ndarray, shape (m, n)
        Taylor coefficients of the distance from the nominal, and of the path.
    most : int
        Largest number of a term that is significant.
    tolerance : float
        Part of the largest term below which a term counts as zero.

    Returns
    -------
    ndarray of int, shape (n,)
        0 if all terms are rounding; `UNDECIDED` if all significant ones come after `most`.
    """
    first = np.full(gap.shape[1], UNDECIDED)
    for near in VISIBLE[::-1]:
        weight = near ** np.arange(len(gap))[:, None]
        terms, whole = np.abs(gap) * weight, (np.abs(path) * weight).max(0)
        there = terms > np.maximum(tolerance * terms.max(0), 32 * np.finfo(float).eps * whole)
        found = np.where(there.any(0), there.argmax(0), 0)
        reached = terms.argmax(0) <= most  # where the last terms are the largest, the series does not converge
        first = np.where((found > 0) & (found <= most) & reached, found, first)
    return np.where(there.any(0), first, 0)
