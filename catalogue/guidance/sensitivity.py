"""First-order effect of pivot errors and joint play on the path of a guided point.

In the pose z -> z + D + x z, x = exp(i theta) - 1, with all coordinates relative to an origin near
the linkage, each dyad (A, w), (A*, w*) satisfies (see `motion`)

    w w* |D|^2 + 2 Re(conj(w (1 + x) A* - w* A) D) - 2 Re(conj(A) A* x) = 0

A change of the pivots therefore changes D and theta by one linear equation for each dyad.  A third
equation fixes the position of the guided point along the nominal, so that only its displacement
across the nominal remains. No chart is involved, and only cusps of the path and change points are
singular.

To first order, small errors e_i of the pivots displace the point across its nominal by the sum of
g_i . e_i.  For vectors of length 1 the largest sum is the sum of |g_i|; for vectors with
independent coordinates of standard deviation 1 the standard deviation of the sum is the root of the
sum of |g_i|^2.  The measures are the largest values of both over the stroke.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..kinematics.batch import Rows, put
from ..kinematics.linkage import Linkage
from ..kinematics.motion import Motion, Pose
from ..kinematics.types import Complexes, Floats, Mask
from .coupler_curve import CouplerCurve
from .minimum_zone import grid
from .trace import Traced

if TYPE_CHECKING:
    from .circuit_curve import CircuitCurve, CircuitMotion

#: Number of coordinates that vary: x and y of A1, A1*, A2, A2* and of the guided point.
COUNT = 10


@dataclass(frozen=True)
class PoseJacobian(Rows):
    """Derivatives of the poses of n guides at m stations of their nominals by the pivots.

    The last axis holds the derivatives by x and y of A1, A1*, A2, A2*, and the guided point, in the
    reference position; a pivot at infinity can only rotate: the derivative along its direction is
    0.

    Attributes
    ----------
    shift : complex ndarray, shape (m, n, 10)
        Derivatives of the displacement d of the pose z -> z + d + x (z - origin) (`Pose`), at a
        fixed origin.
    angle : ndarray, shape (m, n, 10)
        Derivatives of the angle of the coupler [rad].
    across : ndarray, shape (m, n, 10)
        Derivatives of the distance of the guided point from the nominal, positive to the left.
    """

    shift: Complexes
    angle: Floats
    across: Floats


def pose_jacobian(moving: Motion | CircuitMotion, point: Complexes, t: Floats, tangent: Complexes) -> PoseJacobian:
    """Differentiate the poses with guided points (n,) at fixed stations of their nominals.

    The poses are at parameters t (m, n); `tangent` holds unit vectors along the nominals, (n,) or
    (m, n).
    """
    return jacobian_at(moving.linkage, point, moving.pose(t), tangent)


def jacobian_at(linkage: Linkage, point: Complexes, pose: Pose, tangent: Complexes) -> PoseJacobian:
    """Return the derivatives of `pose_jacobian` in known poses (m, n).

    With its guided point at a fixed position along the nominal, a coupler has two freedoms: the
    distance of the point from the nominal and the angle of the coupler. Two dyads determine them.
    """
    d, x, origin = pose
    turn = 1 + x
    tangent = np.broadcast_to(tangent, d.shape)
    across_way = 1j * tangent
    d = d + x * (point - origin)  # displacement of the guided point
    z = np.where(linkage.finite, linkage.points - point[:, None, None], linkage.points)
    # an angle is counted as an arc about as long as the linkage is large: products of lengths do
    # not overflow
    unit = np.ldexp(1.0, np.frexp(linkage.size)[1])
    by = np.zeros((2, *d.shape, COUNT))  # derivatives of the two equations by the coordinates, at a fixed pose
    by_across, by_angle = np.empty((2, *d.shape)), np.empty((2, *d.shape))
    carried = np.conj(tangent) * turn  # displacement of the guided point in its coupler, along and across the nominal
    along = np.stack([carried.real, -carried.imag])
    for i in (0, 1):
        (a, b), (w, v) = z[:, i].T, linkage.finite[:, i].T.astype(float)
        turned = w * turn * b
        normal = w * v * d + turned - v * a
        by_across[i] = (normal.conj() * across_way).real
        by_angle[i] = ((1j * turned).conj() * d).real - (np.conj(a) * (1j * b * turn)).real
        by_angle[i] /= unit
        by_fixed, by_moving = -(v * d + b * x), w * np.conj(turn) * d - a * np.conj(x)
        for k, slope in ((4 * i, by_fixed), (4 * i + 2, by_moving)):
            by[i, ..., k], by[i, ..., k + 1] = slope.real, slope.imag
        # the displacement that keeps the point at its position along the nominal
        back = -(normal.conj() * tangent).real
        by[i, ..., 8], by[i, ..., 9] = back * along[0], back * along[1]
        _turn_only(linkage, by[i])
    with np.errstate(all="ignore"):
        determinant = by_across[0] * by_angle[1] - by_across[1] * by_angle[0]
        weights = np.stack([by_angle[1], -by_angle[0], -by_across[1], by_across[0]]) / determinant
        first, second, third, fourth = weights[..., None]
        across = -(first * by[0] + second * by[1])
        angle = -(third * by[0] + fourth * by[1]) / unit[:, None]
        shift = across_way[..., None] * across
        shift[..., 8] -= tangent * along[0]
        shift[..., 9] -= tangent * along[1]
        spin = 1j * turn * (point - origin)
        across[..., 8] += carried.imag
        across[..., 9] += carried.real
    return PoseJacobian(shift - spin[..., None] * angle, angle, across)


def _turn_only(linkage: Linkage, by: Floats) -> None:
    """Remove the parts of derivatives along the directions of pivots at infinity, in place."""
    for i in (0, 1):
        for j in (0, 1):
            far = ~linkage.finite[:, i, j]
            if far.any():
                k, z = 4 * i + 2 * j, linkage.points[:, i, j]
                along = by[..., k] * z.real + by[..., k + 1] * z.imag
                by[..., k] -= np.where(far, along * z.real, 0)
                by[..., k + 1] -= np.where(far, along * z.imag, 0)


def displaced(linkage: Linkage, point: Complexes, step: Floats) -> tuple[Linkage, Complexes, Mask]:
    """Displace linkages and guided points by steps (n, 10).

    Return the valid results and their mask.
    """
    pivots = linkage.pivots.copy()
    pivots[..., :2] += step[:, :8].reshape(-1, 2, 2, 2)
    made, good = Linkage.valid(pivots)
    return made, (point + step[:, 8] + 1j * step[:, 9])[good], good


class SensitivityGrid(NamedTuple):
    """Grid on which the sensitivity is evaluated."""

    nodes: int = 32  #: intervals between the evaluated positions
    most: int = 512  #: largest number of intervals
    missed: float = 1e-3  #: relative error of the sum of squares above which the grid is refined


SENSITIVITY = SensitivityGrid()


@dataclass(frozen=True)
class Sensitivity:
    """Displacements of n guided points across their nominals, per unit error of the pivots.

    Attributes
    ----------
    pivots : ndarray, shape (n, 2, 2)
        Largest displacement over the stroke for an error of 1 of one pivot in its worst direction,
        by dyad and pivot (fixed, moving); for a pivot at infinity, for an angle of 1 rad [length].
    point : ndarray, shape (n,)
        Largest displacement over the stroke for an error of 1 of the guided point in its coupler.
    worst : ndarray, shape (n,)
        Largest displacement for errors of 1 of all finite pivots and the guided point, each in its
        worst direction.
    rms : ndarray, shape (n,)
        Standard deviation of the displacement for independent coordinates of all finite pivots and
        the guided point with standard deviation 1.
    """

    pivots: Floats
    point: Floats
    worst: Floats
    rms: Floats


def sensitivity(
    guides: CouplerCurve | CircuitCurve,
    traced: Traced,
    stations: int = SENSITIVITY.nodes,
    most: int = SENSITIVITY.most,
) -> Sensitivity:
    """Compute the sensitivities of traced guides with unchanged points that do not return.

    The number of intervals between the evaluated positions is doubled, from `stations` to at most
    `most`, until the last two Chebyshev coefficients of the sum of squares are small.
    """
    points = grid(stations)
    t, tangent = traced.parameters(points.nodes), ways(guides, traced, points.nodes)
    by = pose_jacobian(guides.motion, guides.point, t, tangent).across.reshape(*t.shape, 5, 2)
    length = np.hypot(by[..., 0], by[..., 1])  # (m, n, 5)
    finite = np.concatenate([guides.linkage.finite.reshape(-1, 4), np.ones((len(guides), 1), bool)], axis=1)
    given = np.where(finite, length, 0.0)
    found = Sensitivity(
        length[..., :4].max(0).reshape(-1, 2, 2),
        length[..., 4].max(0),
        given.sum(-1).max(0),
        _largest(given**2, stations),
    )
    squares = (given**2).sum(-1)
    rough = np.flatnonzero(np.abs(points.coefficients[-2:] @ squares).sum(0) > SENSITIVITY.missed * squares.max(0))
    if stations >= most or not len(rough):
        return found
    return put(found, rough, sensitivity(guides[rough], traced[rough], 2 * stations, most))


def _largest(squares: Floats, stations: int) -> Floats:
    """Compute the largest root of the sum of squares (m, n, k), interpolated, shape (n,)."""
    return np.asarray(np.sqrt((grid(stations).fine @ squares.sum(-1)).max(0)))


def ways(guides: CouplerCurve | CircuitCurve, traced: Traced, nodes: Floats) -> Complexes:
    """Return unit vectors along the nominals at the guided points, shape (m, n)."""
    fit = traced.fit
    along, curvature = fit.along.astype(complex), fit.curvature.astype(float)
    u, v = guides.path.window(traced.low.astype(float), traced.high.astype(float), nodes)
    z = (guides.point + (u + 1j * v) * guides.tangent - fit.start.astype(complex)) * along.conj()
    half = 0.5 * fit.stroke.astype(float)
    way = 1 - curvature * (z.imag - fit.rise.astype(float)) + 1j * curvature * (z.real - half)
    return np.asarray(along * way / np.abs(way))
