"""The least that a stored reach can cost in an answer, so that a request need not trace what cannot be among the best.

A request lies between two reaches of a guide.  For a straight line its stroke is longer than the one stored at the
level that satisfies it, and not longer than the one of the next looser level: the linkage is no smaller beside its
stroke than there, and its transmission angle no larger than here.  For an arc its window lies within the stored one,
and contains the one of the next tighter level: the size is no smaller than here, the transmission angle no larger
than there.
"""

from __future__ import annotations

import numpy as np

from ..guide.reach import LEVELS
from ..linkage import Array

#: How much longer a stroke becomes, at most, where no looser level is stored: a decade, of two inflections.
DECADE = 10.0 ** (1 / 3)
#: The most that a query stretches a stored stroke, and the transmission angle [deg] beyond which none is stored.
FARTHEST, WEAK = 3.0, 2.0
#: A reach below this part of its level ends for another reason than its deviation: a stroke beyond it was not stored.
AMPLE = 0.3


def floors(reaches: dict[str, Array], circle: bool) -> Array:
    """Return the least balance (size over stroke, less the transmission angle over 90 degrees) of each reach.

    Parameters
    ----------
    reaches : mapping of columns
        ``guide, level, stroke, deviation, size, min_transmission``, by guide, from the loosest level to the tightest.
    circle : bool
        Their nominal.

    Returns
    -------
    ndarray, shape (n,)
        Not above the balance of the reach itself.
    """
    size, angle, guide = reaches["size"], reaches["min_transmission"] / 90, reaches["guide"]
    if circle:
        return size - np.maximum(angle, _angle_within(guide, reaches["stroke"], angle))
    has_looser = np.concatenate([[False], np.diff(guide) == 0])
    looser = np.concatenate([size[:1], size[:-1]])
    ample = np.concatenate([[0.0], reaches["deviation"][:-1]]) < AMPLE * 10.0 ** (reaches["level"] + 1)
    least = np.where(has_looser, looser, np.maximum(1.0, size / DECADE)) - angle
    beyond = np.maximum(1.0, size / FARTHEST) - WEAK / 90  # a stroke at which the transmission angle was too small
    least = np.where(has_looser & ample, np.minimum(least, beyond), least)
    return np.asarray(np.minimum(least, size - angle))


def spreads(reaches: dict[str, Array], curvature: Array) -> Array:
    """Return the least size of each reach beside its stroke, however short a part of the path is used.

    It is the extent of the box of the pivots, or its distance from the middle of the path, which for an arc lies off
    the chord by about its height (to fifth order in the sweep).

    Parameters
    ----------
    reaches : mapping of columns
        ``sweep, all_x0, all_y0, all_x1, all_y1``.
    curvature : ndarray, shape (n,)
        Of the nominal; the path bulges to the other side.
    """
    x0, y0, x1, y1 = (reaches[f"all_{side}"] for side in ("x0", "y0", "x1", "y1"))
    half = 0.5 * reaches["sweep"]
    height = -np.sign(curvature) * half * (0.25 + 0.0625 * half * half)
    across, along = np.maximum(0.5 - x0, x1 - 0.5), np.maximum(height - y0, y1 - height)
    return np.asarray(np.max([x1 - x0, y1 - y0, across, along], axis=0))


def _angle_within(guide: Array, stroke: Array, angle: Array) -> Array:
    """Return the transmission angle of the next tighter, shorter reach of the guide; its own if there is none."""
    within = angle.copy()
    for step in range(min(len(LEVELS), len(angle)) - 1, 0, -1):
        shorter = (guide[step:] == guide[:-step]) & (stroke[step:] < stroke[:-step] * (1 - 1e-9))
        within[:-step] = np.where(shorter, angle[step:], within[:-step])
    return within
