"""What a stored reach promises to a request that lies between it and a neighbour, so that few need be traced.

A request lies between two reaches of a guide.  For a straight line its stroke is longer than the one stored at the
level that satisfies it, and about as long as the one of the next looser level at most: what an answer costs there, and
half-way, is stored.  For an arc its window lies within the stored one and contains that of the next tighter level,
whose measures are stored too.  `catalogue.query.promise` goes between them.

The cost is the balance: the size over the stroke, less the least transmission angle over 90 degrees.
"""

from __future__ import annotations

import numpy as np

from ..guide.reach import LEVELS
from ..linkage import Array

#: Decimal exponents of the deviations to which lines are reached: the levels, half-way between them, and one beyond.
RUNGS = tuple(sorted({*LEVELS, *(level + 0.5 for level in LEVELS), *(level + 1 for level in LEVELS)}))


def balance(reaches: dict[str, Array]) -> Array:
    """Return the balance of each reach from its columns ``size`` and ``min_transmission``."""
    return np.asarray(reaches["size"] - reaches["min_transmission"] / 90)


def of_lines(ladder: Array, step: Array, guide: Array) -> dict[str, Array]:
    """Return the columns of straight reaches: what the guide costs at 10**0.5 and at 10 times its deviation.

    Parameters
    ----------
    ladder : ndarray, shape (RUNGS, n)
        Balance of each guide at each of `RUNGS`; NaN below those that it holds.
    step, guide : ndarray of int, shape (m,)
        Of each reach, where in the ladder it is.
    """
    own, halfway, farther = (ladder[step + k, guide] for k in range(3))
    none = np.full(len(own), np.nan)
    return {
        "floor": np.minimum(own, np.minimum(halfway, farther)),
        "halfway": halfway, "farther": farther,
        "inner_sweep": none, "inner_size": none, "inner_transmission": none,
    }  # fmt: skip


def of_arcs(reaches: dict[str, Array], curvature: Array) -> dict[str, Array]:
    """Return the columns of circular reaches: sweep, size and angle of the next tighter one, in strokes of this one.

    Where there is none: sweep 0, the extent of the pivots, and the angle of the reach itself.

    Parameters
    ----------
    reaches : mapping of columns
        By guide, from the loosest level to the tightest.
    curvature : ndarray, shape (n,)
        Of the nominal; the path bulges to the other side.
    """
    guide, sweep, size, angle = (reaches[k] for k in ("guide", "sweep", "size", "min_transmission"))
    inner = np.minimum(np.arange(len(guide)) + 1, len(guide) - 1)
    has = (guide[inner] == guide) & (inner > np.arange(len(guide)))
    inner_sweep = np.where(has, np.minimum(sweep[inner], sweep), 0.0)
    inner_size = np.where(has, size[inner] * inner_sweep / sweep, extents(reaches, curvature))
    inner_angle = np.where(has, angle[inner], angle)
    least = np.minimum(size, np.where(has, size[inner], size)) - np.maximum(angle, inner_angle) / 90
    least = np.where(inner_sweep < sweep, least, balance(reaches))
    none = np.full(len(guide), np.nan)
    return {
        "floor": np.minimum(least, balance(reaches)), "halfway": none, "farther": none,
        "inner_sweep": inner_sweep, "inner_size": inner_size, "inner_transmission": inner_angle,
    }  # fmt: skip


def extents(reaches: dict[str, Array], curvature: Array) -> Array:
    """Return the least size of each reach, in strokes, however short a part of the path is used.

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
