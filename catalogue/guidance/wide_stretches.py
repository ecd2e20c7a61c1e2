"""Search circuits for windows nearest to an arc near a half circle or beyond.

The phase of its middle identifies a window over such an arc.  A curve is cut into pieces, and the
middles of all pieces are compared by the mean square distance of a few places from their mean
circle; the best ones are moved to reduce the deviation itself.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..kinematics.circuits import OPEN, Circuits
from ..kinematics.types import Complexes, Floats, Indices
from .best_circle import mean_centre, squared_centre
from .cells import Curves
from .wide_arc import WideArcs, wide_arcs


class WideStretches(NamedTuple):
    """How windows along wide arcs are searched for on a circuit."""

    #: least pieces of an arc: the middle of a window is found to a twenty-fourth of it
    pieces: int = 24
    fewest: int = 160  #: least pieces of a circuit, as of other windows
    most: int = 2560  #: most pieces of a circuit: shorter arcs are not looked for
    spread: int = 24  #: windows of a circuit that are tried besides, evenly
    #: Places of a window that are read: a path with eight waves over it has four on each.
    places: int = 33
    #: Least part of its turn about the mean circle, and of the requested angle, over which a path
    #: runs forward.
    forward: float = 0.7
    moves: int = 3  #: moves of a mean circle from the circle that fits squared radii best
    spare: int = 3  #: windows followed per stretch that is wanted: some of them overlap
    least: int = 4  #: least windows of a circuit that are followed
    first: float = 2.0  #: longest move of the first round [pieces]
    shorter: float = 1 / 3  #: longest move of a round over that of the round before
    rounds: int = 14  #: rounds, which leave a millionth of a piece


WIDE = WideStretches()

#: Moves of a middle that are tried [parts of the longest].
WAYS = np.linspace(-1, 1, 7)


def nearest_arcs(
    circuits: Circuits, point: Complexes, radius: float, angle: float, count: int
) -> tuple[Indices, WideArcs]:
    """Find windows of coupler points (k,) on circuits (k,) closest to wide arcs.

    Parameters
    ----------
    radius, angle : float
        Of the arcs [length, deg].
    count : int
        How many stretches of a linkage are wanted: a few more are returned of each circuit, as some
        may overlap.

    Returns
    -------
    ndarray of int, shape (n,)
        Numbers of the circuits.
    WideArcs
        Those n windows that were found.
    """
    of, middle, by, centre = _begun(circuits, point, radius, angle, max(WIDE.spare * count, WIDE.least))
    if not len(of):
        return of, wide_arcs(circuits[of], point[of], middle, centre, np.full(0, radius), angle)
    best = wide_arcs(circuits[of], point[of], middle, centre, np.full(len(of), radius), angle)
    kept = _leading(of, best.fit.deviation, max(WIDE.spare * count, WIDE.least))
    of, by, best = of[kept], by[kept], best[kept]
    centre = np.where(np.isfinite(best.fit.deviation), best.centre, centre[kept])
    for _ in range(WIDE.rounds):
        each = np.tile(np.arange(len(of)), len(WAYS))
        moved = best.middle[each] + (WAYS[:, None] * by).ravel()
        tried = wide_arcs(circuits[of[each]], point[of[each]], moved, centre[each], np.full(len(each), radius), angle)
        off = np.nan_to_num(tried.fit.deviation, nan=np.inf).reshape(len(WAYS), -1)
        way = off.argmin(0)
        found = tried[way * len(of) + np.arange(len(of))]
        better = np.isfinite(off.min(0))
        best = best.replaced(better, found[better])
        centre = np.where(better, best.centre, centre)
        by = np.where(better & (np.abs(WAYS[way]) == 1), by, by * WIDE.shorter)
    good = np.flatnonzero(np.isfinite(best.fit.deviation))
    return of[good], best[good]


def _leading(of: Indices, deviation: Floats, count: int) -> Indices:
    """Select at most `count` windows of each circuit by their deviation, NaN last."""
    order = np.lexsort((np.nan_to_num(deviation, nan=np.inf), of))
    rank = np.arange(len(of)) - np.searchsorted(of[order], of[order])
    return np.sort(order[rank < count])


def _begun(
    circuits: Circuits, point: Complexes, radius: float, angle: float, count: int
) -> tuple[Indices, Floats, Floats, Complexes]:
    """Select the most promising windows, at most `count` per circuit.

    Returns their circuits, the phases of their middles, the permitted moves of these [rad], and
    estimates of the arcs' centres.
    """
    curves = Curves.of(circuits, point, np.arange(len(circuits)))
    length = radius * np.radians(angle)
    with np.errstate(all="ignore"):
        wanted = np.nan_to_num(WIDE.pieces * curves.length / length, nan=0.0, posinf=WIDE.most)
    pieces = WIDE.fewest * 2 ** np.ceil(np.log2(np.clip(wanted, WIDE.fewest, WIDE.most) / WIDE.fewest)).astype(int)
    parts = [
        _of_pieces(curves, np.flatnonzero((pieces == many) & (wanted > 0)), int(many), radius, length, count)
        for many in np.unique(pieces)
    ]
    return tuple(np.concatenate(values) for values in zip(*parts, strict=True))  # type: ignore[return-value]


def _of_pieces(
    curves: Curves, which: Indices, pieces: int, radius: float, length: float, count: int
) -> tuple[Indices, Floats, Floats, Complexes]:
    """Find the windows of curves that are cut into a given number of pieces."""
    some = curves[which]
    s, z = some.cut(pieces)
    turns = some.circuits.kind != OPEN
    with np.errstate(all="ignore"):
        half = 0.5 * length / some.length * pieces
        steps = np.linspace(-1, 1, WIDE.places)[:, None, None] * half
        index = np.rint(np.arange(pieces)[:, None] + steps).astype(int)
        beyond = (half > 0.5 * pieces) | (~turns & ((index < 0) | (index > pieces)).any(0))
        index = np.where(turns, np.mod(index, pieces), np.clip(index, 0, pieces))
        places = z[index, np.arange(len(which))]
        centre = mean_centre(places, radius, squared_centre(places), moves=WIDE.moves)
        spoke = places - centre
        off = np.sqrt(((np.abs(spoke) - radius) ** 2).mean(0))
        turned = np.angle(spoke[1:] / spoke[:-1])
        forward = np.abs(turned.sum(0)) > WIDE.forward * np.maximum(np.abs(turned).sum(0), length / radius)
    off = np.where(beyond | np.isnan(off), np.inf, off)
    smooth = np.where(forward, off, np.inf)
    least = (smooth <= np.roll(smooth, 1, 0)) & (smooth < np.roll(smooth, -1, 0))
    first = np.argsort(np.where(least, smooth, np.inf), axis=0, kind="stable")[:count]
    # windows that run forward may be few, and between others
    spread = np.broadcast_to(
        np.arange(WIDE.spread)[:, None] * (pieces // WIDE.spread),
        (WIDE.spread, len(which)),
    )
    rank = np.concatenate([first, spread])
    good = np.isfinite(np.take_along_axis(off, rank, 0))
    column = np.broadcast_to(np.arange(len(which)), rank.shape)[good]
    at = rank[good]
    piece = np.abs(s[at + 1, column] - s[at, column])
    return which[column], some.phase(s)[at, column], WIDE.first * piece, centre[at, column]
