"""Search circuits for windows closest to an arc near a half circle or beyond.

The phase of its middle identifies a window over such an arc. A curve is cut into pieces, and
windows about all pieces are compared by the mean square distance of a few places from their mean
circle. The best ones are moved to reduce the deviation itself.
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
    """Options of the search for windows along wide arcs on a circuit."""

    #: least number of pieces of an arc: the middle of a window is located to a twenty-fourth of the
    #: arc
    pieces: int = 24
    fewest: int = 160  #: least number of pieces of a circuit, as for other windows
    most: int = 2560  #: largest number of pieces of a circuit: shorter arcs are not searched for
    spread: int = 24  #: number of further trial windows of a circuit, evenly spaced
    #: Number of sampled places of a window: a path with eight waves over it has four on each.
    places: int = 33
    #: Least part of its angle about the mean circle, and of the requested angle, over which a path
    #: must run forward.
    forward: float = 0.7
    moves: int = 3  #: number of moves of a mean circle from the circle that fits squared radii best
    spare: int = 3  #: number of windows followed per requested stretch: some of them overlap
    least: int = 4  #: least number of windows followed on a circuit
    first: float = 2.0  #: longest move of the first round [pieces]
    shorter: float = 1 / 3  #: longest move of a round over that of the round before
    rounds: int = 14  #: number of rounds, which leave an error of a millionth of a piece


WIDE = WideStretches()

#: Trial moves of a middle [largest moves].
TRIAL_MOVES = np.linspace(-1, 1, 7)


def nearest_arcs(
    circuits: Circuits, point: Complexes, radius: float, angle: float, count: int
) -> tuple[Indices, WideArcs]:
    """Find windows of coupler points (k,) on circuits (k,) closest to wide arcs.

    Parameters
    ----------
    radius, angle : float
        Radius and angle of the arcs [length, deg].
    count : int
        Requested number of stretches per linkage: a few more are returned for each circuit, as some
        may overlap.

    Returns
    -------
    ndarray of int, shape (n,)
        Numbers of the circuits.
    WideArcs
        The n windows found.
    """
    of, middle, by, centre = _select_promising(circuits, point, radius, angle, max(WIDE.spare * count, WIDE.least))
    if not len(of):
        return of, wide_arcs(circuits[of], point[of], middle, centre, np.full(0, radius), angle)
    best = wide_arcs(circuits[of], point[of], middle, centre, np.full(len(of), radius), angle)
    kept = _select_best(of, best.fit.deviation, max(WIDE.spare * count, WIDE.least))
    of, by, best = of[kept], by[kept], best[kept]
    centre = np.where(np.isfinite(best.fit.deviation), best.centre, centre[kept])
    for _ in range(WIDE.rounds):
        each = np.tile(np.arange(len(of)), len(TRIAL_MOVES))
        moved = best.middle[each] + (TRIAL_MOVES[:, None] * by).ravel()
        tried = wide_arcs(circuits[of[each]], point[of[each]], moved, centre[each], np.full(len(each), radius), angle)
        off = np.nan_to_num(tried.fit.deviation, nan=np.inf).reshape(len(TRIAL_MOVES), -1)
        way = off.argmin(0)
        found = tried[way * len(of) + np.arange(len(of))]
        better = np.isfinite(off.min(0))
        best = best.replaced(better, found[better])
        centre = np.where(better, best.centre, centre)
        by = np.where(better & (np.abs(TRIAL_MOVES[way]) == 1), by, by * WIDE.shorter)
    good = np.flatnonzero(np.isfinite(best.fit.deviation))
    return of[good], best[good]


def _select_best(of: Indices, deviation: Floats, count: int) -> Indices:
    """Select at most `count` windows of each circuit by their deviation, NaN last."""
    order = np.lexsort((np.nan_to_num(deviation, nan=np.inf), of))
    rank = np.arange(len(of)) - np.searchsorted(of[order], of[order])
    return np.sort(order[rank < count])


def _select_promising(
    circuits: Circuits, point: Complexes, radius: float, angle: float, count: int
) -> tuple[Indices, Floats, Floats, Complexes]:
    """Select the most promising windows, at most `count` per circuit.

    Return their circuits, the phases of their middles, the largest moves of these middles [rad],
    and estimates of the arcs' centres.
    """
    curves = Curves.of(circuits, point, np.arange(len(circuits)))
    length = radius * np.radians(angle)
    with np.errstate(all="ignore"):
        wanted = np.nan_to_num(WIDE.pieces * curves.length / length, nan=0.0, posinf=WIDE.most)
    pieces = WIDE.fewest * 2 ** np.ceil(np.log2(np.clip(wanted, WIDE.fewest, WIDE.most) / WIDE.fewest)).astype(int)
    parts = [
        _search_pieces(curves, np.flatnonzero((pieces == many) & (wanted > 0)), int(many), radius, length, count)
        for many in np.unique(pieces)
    ]
    return tuple(np.concatenate(values) for values in zip(*parts, strict=True))  # type: ignore[return-value]


def _search_pieces(
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
    # few windows may run forward, possibly between the others: add evenly spaced ones
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
