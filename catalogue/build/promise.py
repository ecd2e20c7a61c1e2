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


def of_arcs(reaches: dict[str, Array], last: Array, halves: dict[str, Array]) -> dict[str, Array]:
    """Return the columns of circular reaches: sweep, size and angle of the next tighter one, in strokes of this one.

    Where there is none the sweep is 0, and size and angle are those over half the window.

    Parameters
    ----------
    reaches : mapping of columns
        By guide, from the loosest level to the tightest.
    last : ndarray of bool, shape (n,)
        Which are the tightest of their guides.
    halves : mapping of columns
        ``stroke, size, min_transmission`` of these over half their windows; NaN where that could not be traced.
    """
    sweep, size, angle, stroke = (reaches[k] for k in ("sweep", "size", "min_transmission", "stroke"))
    inner = np.minimum(np.arange(len(last)) + 1, len(last) - 1)
    inner_sweep = np.where(last, 0.0, np.minimum(sweep[inner], sweep))
    inner_size, inner_angle = size[inner] * inner_sweep / sweep, angle[inner]
    traced = np.isfinite(halves["size"])
    inner_size[last] = np.where(traced, halves["size"] * halves["stroke"] / stroke[last], 0.75 * size[last])
    inner_angle[last] = np.where(traced, halves["min_transmission"], angle[last])
    # over the shortest windows the angle is as much better again, at most
    best = np.maximum(angle, np.where(last, np.minimum(2 * inner_angle - angle, 90.0), inner_angle))
    least = np.where(last, size, np.minimum(size, size[inner])) - best / 90
    none = np.full(len(last), np.nan)
    return {
        "floor": np.where(inner_sweep < sweep, np.minimum(least, balance(reaches)), np.inf),  # else it serves nothing
        "halfway": none, "farther": none,
        "inner_sweep": inner_sweep, "inner_size": inner_size, "inner_transmission": inner_angle,
    }  # fmt: skip
