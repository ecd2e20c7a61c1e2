"""What a stored reach promises to a request that lies between it and a neighbour, so that few need be traced.

A request lies between two reaches of a guide.  For a straight line its stroke is longer than the one stored at the
level that satisfies it, and about as long as the one of the next looser level at most: what an answer costs there, and
half-way, is stored.  For an arc its window lies within the stored one and contains that of the next tighter level: what
it costs in between is stored as a function of its sweep.  `catalogue.query.promise` asks for it.

The cost is the balance: the size over the stroke, less the least transmission angle over 90 degrees.
"""

from __future__ import annotations

import numpy as np

from ..guide.reach import LEVELS
from ..linkage import Array

#: Decimal exponents of the deviations to which lines are reached: the levels, half-way between them, and one beyond.
RUNGS = tuple(sorted({*LEVELS, *(level + 0.5 for level in LEVELS), *(level + 1 for level in LEVELS)}))
#: Below this size the path is larger than the linkage.
PATH = 1.0 + 1e-6
#: What is stored of arcs only.
OF_ARCS = ("inner_sweep", "still", "grows", "angle", "turns")


def balance(reaches: dict[str, Array]) -> Array:
    """Return the balance, shape (n,), of reaches: columns ``size`` [strokes] and ``min_transmission`` [deg]."""
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
    none = dict.fromkeys(OF_ARCS, np.full(len(own), np.nan))
    return {"floor": np.minimum(own, np.minimum(halfway, farther)), "halfway": halfway, "farther": farther, **none}


def of_arcs(reaches: dict[str, Array], curvature: Array, last: Array, halves: dict[str, Array]) -> dict[str, Array]:
    """Return the columns of circular reaches: from which sweep on they serve, and what they cost there.

    Beside the radius the size is about a part that stays and one that grows with the sweep, and the transmission angle
    goes with the angle of the arc: both are taken through this reach and the next tighter one, or this one over half
    its window.  Where that is the last and its path larger than the linkage, its size over the shorter windows is what
    counts, between half of it and none.

    Parameters
    ----------
    reaches : mapping of columns
        By guide, from the loosest level to the tightest.
    curvature : ndarray, shape (n,)
        Of the nominal; the path bulges to the other side.
    last : ndarray of bool, shape (n,)
        Which are the tightest of their guides.
    halves : mapping of columns
        ``sweep, size, min_transmission`` of these over half their windows; NaN where that could not be traced.
    """
    sweep, size, angle = (reaches[k] for k in ("sweep", "size", "min_transmission"))
    inner = np.minimum(np.arange(len(last)) + 1, len(last) - 1)
    traced = np.isfinite(halves["size"]) & (halves["sweep"] < 0.9 * sweep[last])
    short, its_size, its_angle = sweep[inner], size[inner], angle[inner]
    short[last] = np.where(traced, halves["sweep"], 0.5 * sweep[last])
    its_size[last] = np.where(traced, halves["size"], 1.5 * size[last])
    its_angle[last] = np.where(traced, halves["min_transmission"], angle[last])
    inner_sweep = np.where(last, 0.0, np.minimum(short, sweep))
    with np.errstate(all="ignore"):
        whole, part = size * sweep, its_size * short  # beside the radius
        # where the path is larger than the linkage the size first falls with the sweep, then stays
        middle = 0.5 * (sweep + short)
        bent = 0.5 * (0.5 * (whole + part) + np.maximum(part, middle))
        grows = np.where(size < PATH, (bent - part) / (middle - short), (whole - part) / (sweep - short))
        remains = extents(reaches, curvature) * sweep
        grows = np.where(last & (size < PATH), np.maximum(part - remains, 0.0) / short, grows)
        turns = (angle - its_angle) / (arc(sweep) - arc(short))
    serves = np.isfinite(grows) & np.isfinite(turns) & (inner_sweep < sweep)
    grows, turns = np.where(serves, grows, 0.0), np.where(serves, turns, 0.0)
    found = {
        "inner_sweep": np.where(serves, inner_sweep, sweep),
        "still": np.where(serves, part - grows * short, whole), "grows": grows,
        "angle": np.where(serves, its_angle - turns * arc(short), angle), "turns": turns,
    }  # fmt: skip
    ends = [np.maximum(inner_sweep, 1e-3), sweep]
    least = np.min([np.maximum(1.0, found["still"] / w + grows) for w in ends], axis=0)
    best = np.max([np.minimum(found["angle"] + turns * arc(w), 90.0) for w in ends], axis=0)
    floor = np.minimum(least - best / 90, balance(reaches))
    none = np.full(len(last), np.nan)
    return {"floor": np.where(serves, floor, np.inf), "halfway": none, "farther": none, **found}


def extents(reaches: dict[str, Array], curvature: Array) -> Array:
    """Return the least size of each reach, in strokes, however short a part of the path is used, shape (n,).

    It is the extent of the box of the pivots, or its distance from the summit of the path, which lies off the chord by
    the height of the arc.

    Parameters
    ----------
    reaches : mapping of columns
        ``sweep, all_x0, all_y0, all_x1, all_y1``.
    curvature : ndarray, shape (n,)
        Of the nominal; the path bulges to the other side.
    """
    x0, y0, x1, y1 = (reaches[f"all_{side}"] for side in ("x0", "y0", "x1", "y1"))
    summit = -np.sign(curvature) * np.tan(0.25 * arc(reaches["sweep"])) / 2
    across, along = np.maximum(0.5 - x0, x1 - 0.5), np.maximum(summit - y0, y1 - summit)
    return np.asarray(np.max([x1 - x0, y1 - y0, across, along], axis=0))


def arc(sweep: Array) -> Array:
    """Return the angle of arcs whose chord is `sweep` times their radius, shape (n,) [rad]."""
    return np.asarray(2 * np.arcsin(np.minimum(0.5 * sweep, 1.0)))
