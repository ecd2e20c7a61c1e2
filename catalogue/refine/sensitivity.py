"""What errors of the pivots, or play in their joints, do to the path of a guided point.

By the derivatives in closed form, so to first order: where a pivot is off by a small vector e_i, the point is displaced
across its nominal by the sum of g_i . e_i.  The largest sum over vectors of length 1 is the sum of |g_i|; over vectors
whose coordinates are independent with standard deviation 1 its standard deviation is the root of the sum of |g_i|^2.
Both are taken where on the stroke they are largest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..guide.minimax import grid
from ..guide.span import Span
from ..guide.trace import Traced
from ..linkage import Array
from .derivatives import across_nominal

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


def sensitivity(guides: Span, traced: Traced) -> Sensitivity:
    """Return the sensitivities of traced guides whose points do not return.

    Parameters
    ----------
    guides : Span of n
    traced : Traced of n
        Of points as they are, not split.
    """
    fit, nodes = traced.fit, grid(NODES).nodes
    low, high = traced.low.astype(float), traced.high.astype(float)
    t = 0.5 * (high + low) + 0.5 * (high - low) * nodes[:, None]
    tangent = np.broadcast_to(fit.along.astype(complex), t.shape)
    curvature, stroke = fit.curvature.astype(float), fit.stroke.astype(float)
    if curvature.any():
        u, v = guides.path.window(low, high, nodes)
        z = guides.point + (u + 1j * v) * guides.tangent
        depth = np.copysign(np.sqrt(1 / curvature**2 - 0.25 * stroke**2), curvature)
        spoke = fit.start + fit.along * (0.5 * stroke + 1j * depth) - z
        tangent = -1j * np.sign(curvature) * (spoke / np.abs(spoke)).astype(complex)
    by = across_nominal(guides.motion, guides.point, t, tangent).reshape(*t.shape, 5, 2)
    length = np.hypot(by[..., 0], by[..., 1])  # (m, n, 5)
    finite = np.concatenate([guides.linkage.finite.reshape(-1, 4), np.ones((len(guides), 1), bool)], axis=1)
    given = np.where(finite, length, 0.0)
    return Sensitivity(
        length[..., :4].max(0).reshape(-1, 2, 2),
        length[..., 4].max(0),
        given.sum(-1).max(0),
        np.sqrt((given**2).sum(-1)).max(0),
    )
