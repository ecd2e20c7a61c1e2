"""How near two answers are as designs, whatever their scale, placement and mirror image.

An answer is laid so that its path runs from (0, 0) to (stroke, 0), which leaves it free to be mirrored in the line of
the path and across its middle (an arc only across), and to have its dyads exchanged.  A pivot is taken as the line to
it from an eye one stroke above the middle of the path, and two pivots are as far apart as the sine of the angle of
their lines.  This is a metric, 0 to 1, in which a pivot at infinity is as good as any: near the path it is the distance
over the stroke, far away that of the directions.
"""

from __future__ import annotations

import numpy as np

from ..kinematics.types import Array

#: Pairs of designs compared at once.
BLOCK = 4096


def normal_form(pivots: Array, stroke: float) -> Array:
    """Return the pivots of laid linkages as unit vectors, shape (n, 4, 3): dyad by dyad, fixed and moving.

    Parameters
    ----------
    pivots : ndarray, shape (n, 2, 2, 3)
    stroke : float
    """
    unit = pivots.copy()
    unit[..., 0] -= 0.5 * stroke * unit[..., 2]
    unit[..., 2] *= stroke
    return np.asarray(unit / np.linalg.norm(unit, axis=-1, keepdims=True)).reshape(len(pivots), 4, 3)


def distances(some: Array, others: Array, *, mirror: bool) -> Array:
    """Return the distances of designs from others: the largest of a pivot, in the pose in which that is least.

    Parameters
    ----------
    some : ndarray, shape (m, 4, 3)
        See `normal_form`.
    others : ndarray, shape (n, 4, 3)
    mirror : bool
        Whether a design may be mirrored in the line of the path: a straight one.

    Returns
    -------
    ndarray, shape (m, n)
        Between 0 and 1; rounding makes up to 3e-8 of 0.
    """
    signs = [(1, 1, 1), (-1, 1, 1), *([(1, -1, 1), (-1, -1, 1)] if mirror else [])]
    exchanged = [[0, 1, 2, 3], [2, 3, 0, 1]]
    poses = np.stack([(some * np.array(sign))[:, order] for sign in signs for order in exchanged], axis=1)
    flat = poses.transpose(2, 3, 0, 1).reshape(4, 3, -1)  # pivot by pivot
    found = np.empty((len(some), len(others)))
    step = max(1, BLOCK // max(len(some), 1))
    for start in range(0, len(others), step):
        part = others[start : start + step].transpose(1, 0, 2)
        cosine = np.abs(part @ flat).min(axis=0).reshape(part.shape[1], *poses.shape[:2])  # of the pivot farthest off
        found[:, start : start + step] = np.sqrt(np.maximum(1 - cosine.max(axis=-1).T ** 2, 0.0))
    return found


def nearest(designs: Array, *, mirror: bool) -> Array:
    """Return how near each design is to the nearest other one, NaN if there is no other, shape (n,)."""
    if len(designs) < 2:
        return np.full(len(designs), np.nan)
    away = distances(designs, designs, mirror=mirror)
    np.fill_diagonal(away, np.inf)
    return np.asarray(away.min(axis=1))
