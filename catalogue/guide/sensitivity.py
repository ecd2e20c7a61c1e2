"""What errors of the pivots, or play in their joints, do to the path of a guided point.

By the derivatives in closed form, so to first order: where a pivot is off by a small vector e_i, the point is displaced
across its nominal by the sum of g_i . e_i.  The largest sum over vectors of length 1 is the sum of |g_i|; over vectors
whose coordinates are independent with standard deviation 1 its standard deviation is the root of the sum of |g_i|^2.
Both are taken where on the stroke they are largest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..kinematics.motion import motion
from ..kinematics.types import Array
from .coupler_curve import CouplerCurve
from .minimum_zone import grid
from .pose_jacobian import COUNT, across_nominal, displaced
from .trace import Traced

#: Intervals between the positions that are looked at.
NODES = 32


@dataclass(frozen=True)
class Sensitivity:
    """Displacements of the guided points of n guides across their nominal, per unit of error of the pivots.

    Attributes
    ----------
    pivots : ndarray, shape (n, 2, 2)
        Largest over the stroke, by dyad and pivot (fixed, moving), for an error of 1 in the worst direction; of a pivot
        at infinity for an angle of 1 rad [length].
    point : ndarray, shape (n,)
        The same for an error of the guided point in its coupler.
    worst : ndarray, shape (n,)
        For errors of 1 of all finite pivots and the guided point at once, each in its worst direction.
    rms : ndarray, shape (n,)
        Standard deviation for errors of all of them whose coordinates are independent, with standard deviation 1.
    """

    pivots: Array
    point: Array
    worst: Array
    rms: Array


def sensitivity(guides: CouplerCurve, traced: Traced, stations: int = NODES) -> Sensitivity:
    """Return the sensitivities of traced guides whose points do not return.

    Parameters
    ----------
    guides : CouplerCurve of n
    traced : Traced of n
        Of points as they are, not split.
    stations : int
        Intervals between the positions that are looked at.
    """
    nodes = grid(stations).nodes
    low, high = traced.low.astype(float), traced.high.astype(float)
    t = 0.5 * (high + low) + 0.5 * (high - low) * nodes[:, None]
    tangent = _ways(guides, traced, nodes)
    by = across_nominal(guides.motion, guides.point, t, tangent).reshape(*t.shape, 5, 2)
    length = np.hypot(by[..., 0], by[..., 1])  # (m, n, 5)
    finite = np.concatenate([guides.linkage.finite.reshape(-1, 4), np.ones((len(guides), 1), bool)], axis=1)
    given = np.where(finite, length, 0.0)
    return Sensitivity(
        length[..., :4].max(0).reshape(-1, 2, 2),
        length[..., 4].max(0),
        given.sum(-1).max(0),
        _largest(given**2, stations),
    )


def rms_gradient(guides: CouplerCurve, traced: Traced, stations: int = 8, step: float = 1e-5) -> tuple[Array, Array]:
    """Return `Sensitivity.rms` of traced guides and its derivatives by the pivots and the guided point.

    Differences of the first derivatives, the poses and the way of the path held.

    Parameters
    ----------
    step : float
        Of the coordinates [length].

    Returns
    -------
    rms : ndarray, shape (n,)
    slope : ndarray, shape (n, 10)
        In the coordinates of `catalogue.guide.pose_jacobian`; 0 where it is not known.
    """
    n = len(guides)
    nodes = grid(stations).nodes
    low, high = traced.low.astype(float), traced.high.astype(float)
    t = 0.5 * (high + low) + 0.5 * (high - low) * nodes[:, None]
    tangent = _ways(guides, traced, nodes)
    steps = np.concatenate([np.zeros((1, COUNT)), step * np.eye(COUNT)])
    each, which = np.tile(np.arange(n), COUNT + 1), np.repeat(steps, n, axis=0)
    linkage, point, good = displaced(guides.linkage[each], guides.point[each], which)
    each = each[good]
    pole = None if guides.pole is None else guides.pole[each]
    with np.errstate(all="ignore"):
        moving = motion(linkage, guides.motion.chart[each], point, pole=pole)
        by = across_nominal(moving, point, t[:, each], tangent[:, each])
        finite = np.concatenate([linkage.finite.reshape(-1, 4), np.ones((len(point), 1), bool)], axis=1)
        rms = np.full((COUNT + 1) * n, np.nan)
        rms[good] = _largest(np.where(np.repeat(finite, 2, axis=1), by**2, 0.0), stations)
        each_rms = rms.reshape(COUNT + 1, n)
        slope = ((each_rms[1:] - each_rms[0]) / step).T
    return each_rms[0], np.where(np.isfinite(slope), slope, 0.0)


def _largest(squares: Array, stations: int) -> Array:
    """Return the largest root of the sum of squares (m, n, k), read between the positions too, shape (n,)."""
    return np.asarray(np.sqrt((grid(stations).fine @ squares.sum(-1)).max(0)))


def _ways(guides: CouplerCurve, traced: Traced, nodes: Array) -> Array:
    """Return unit vectors along the nominals where the guided points are, shape (m, n)."""
    fit = traced.fit
    along, curvature = fit.along.astype(complex), fit.curvature.astype(float)
    u, v = guides.path.window(traced.low.astype(float), traced.high.astype(float), nodes)
    z = (guides.point + (u + 1j * v) * guides.tangent - fit.start.astype(complex)) * along.conj()
    half = 0.5 * fit.stroke.astype(float)
    sagitta = curvature * half**2 / (1 + np.sqrt(np.maximum(1 - (curvature * half) ** 2, 0.0)))
    way = 1 - curvature * (z.imag + sagitta) + 1j * curvature * (z.real - half)
    return np.asarray(along * way / np.abs(way))
