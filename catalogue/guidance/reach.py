"""The longest stroke that a guide holds within a relative deviation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..kinematics.batch import Columns, mapped
from ..kinematics.types import Floats, Mask
from .coupler_curve import CouplerCurve
from .trace import SPLITTING, Traced, trace

#: Ladder of relative deviations, as decimal exponents.
LEVELS = (-2, -3, -4, -5, -6, -7, -8, -9)


class ReachOptions(NamedTuple):
    """Options of the trial strokes of a reach."""

    strokes: int = 10  #: number of trial strokes: a geometric sequence down from the longest
    ratio: float = 0.62  #: ratio of two successive trial strokes
    #: Number of corrections of a window about a change point: they leave an error below 1e-4 of the
    #: half window.
    rounds: int = 4
    nodes: int = 16  #: intervals between the Chebyshev points of a window
    usable: float = 0.95  #: usable part of the extent: at its very end the path turns back


REACH = ReachOptions()


@dataclass(frozen=True)
class Ladder(Columns):
    """Half strokes of n guides against relative deviation, longest first.

    Attributes
    ----------
    half : ndarray, shape (strokes, n)
        Half strokes, a column for each guide [length].
    traced : Traced, shape (strokes, n)
        Measurements over these strokes.
    centre : ndarray, shape (n,)
        Middles of the windows [half strokes].
    """

    half: Floats
    traced: Traced
    centre: Floats


def scan(guides: CouplerCurve, *, circle: bool, three: Mask) -> Ladder:
    """Trace each guide over a sequence of strokes.

    Where a point has `three` merged inflections, (n,), each stroke is also tried off centre, to
    either side, and the best of these centres is used.
    """
    n = len(guides)
    centre = np.zeros(n)
    if three.any():
        some = guides[three]
        shortest = 0.3 * _longest(some, SPLITTING.off_centre)
        options = np.array([0.0, SPLITTING.off_centre, -SPLITTING.off_centre])
        tried = [trace(some, shortest, circle=circle, split=True, centre=c, nodes=REACH.nodes) for c in options]
        relative = np.stack([one.relative for one in tried])
        centre[three] = options[np.argmin(np.where(np.isnan(relative), np.inf, relative), axis=0)]
    half = _longest(guides, centre) * REACH.ratio ** np.arange(REACH.strokes)[:, None]
    each = np.tile(np.arange(n), REACH.strokes)
    found = trace(guides[each], half.ravel(), circle=circle, split=True, centre=centre[each], nodes=REACH.nodes)
    return Ladder(half, mapped(lambda values: values.reshape(half.shape), found), centre)


def reach(
    guides: CouplerCurve, ladder: Ladder, tolerance: Floats | float, *, circle: bool, steps: int = 2
) -> tuple[Floats, Traced]:
    """Find the longest half strokes within a relative deviation, float or (n,), and trace them.

    NaN where there is none.

    Between the last stroke outside the tolerance and the first one inside, `steps` secant steps in
    logarithms follow. Every returned stroke was itself traced and is within the tolerance.
    """
    tolerance = np.broadcast_to(np.asarray(tolerance, dtype=float), len(guides))
    column = np.arange(len(guides))
    with np.errstate(all="ignore"):
        relative = ladder.traced.relative
        holds = relative <= tolerance
        k = np.argmax(holds, axis=0)
        some = np.asarray(holds.any(axis=0))
        ends = (k, np.maximum(k - 1, 0))
        good, bad = (ladder.half[end, column] for end in ends)
        good_e, bad_e = (np.log(relative[end, column] / tolerance) for end in ends)
        good = np.where(some, good, np.nan)
        first: Traced = mapped(lambda values: values[k[some], column[some]], ladder.traced)
        found = Traced.nothing(len(guides), ladder.half.dtype).replaced(some, first)
        for _ in range(steps):
            open_ = some & (k > 0) & (bad > good * 1.001)
            if not open_.any():
                break
            share = np.clip((-0.02 - good_e) / (bad_e - good_e), 0.05, 0.95)
            share = np.where(np.isfinite(share), share, 0.5)
            tried = np.exp(np.log(good) + share * (np.log(bad) - np.log(good)))
            now = trace(
                guides[open_],
                tried[open_],
                circle=circle,
                split=True,
                centre=ladder.centre[open_],
                nodes=REACH.nodes,
            )
            e = np.full(len(guides), np.nan)
            e[open_] = np.log(now.relative / tolerance[open_])
            hit = open_ & (e <= 0)
            miss = open_ & ~hit
            found = found.replaced(hit, now[hit[open_]])
            good, good_e = np.where(hit, tried, good), np.where(hit, e, good_e)
            bad, bad_e = np.where(miss, tried, bad), np.where(miss, e, bad_e)
    return good, found


def about_change_points(
    guides: CouplerCurve, half: Floats, centre: Floats, found: Traced, *, circle: bool
) -> tuple[Floats, Floats, Traced]:
    """Move the windows of guides at change points until the linkages stand there in mid-stroke.

    Guides are stored in mid-stroke; near a change point, but not at it, the branch of such a
    position could not be determined.

    Parameters
    ----------
    half, centre : ndarray, shape (n,)
        Half windows [length], and the positions of their middles [half windows].
    found : Traced
        Traces over these windows.

    Returns
    -------
    half, centre, found
        Values of all guides; those away from change points are unchanged.
    """
    some = np.flatnonzero(guides.motion.branch != 0)
    if not len(some):
        return half, centre, found
    at, half, centre = guides[some], half.copy(), np.broadcast_to(centre, half.shape).copy()
    for _ in range(REACH.rounds):
        now = found[some]
        with np.errstate(all="ignore"):
            run = ((at.point + now.shift - now.fit.start) * now.fit.along.conj()).real
            centre[some] += 2 * run / now.fit.stroke - 1
            half[some] = np.minimum(half[some], _longest(at, centre[some]))
        found = found.replaced(
            some, trace(at, half[some], circle=circle, split=True, centre=centre[some], nodes=REACH.nodes)
        )
    return half, centre, found


def _longest(guides: CouplerCurve, centre: Floats | float) -> Floats:
    low, high = guides.extent
    return np.asarray(REACH.usable * np.minimum(low / (1 - centre), high / (1 + centre)))
