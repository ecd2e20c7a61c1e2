"""The longest stroke that a guide holds within a relative deviation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..linkage import Array
from .span import Span
from .trace import OFF_CENTRE, Traced, trace

#: Ladder of relative deviations, as decimal exponents.
LEVELS = (-2, -3, -4, -5, -6, -7, -8, -9)
#: Strokes tried: a geometric sequence down from the longest.
STROKES, RATIO = 13, 0.7
#: Part of the extent that is used: at its very end the path turns back.
USABLE = 0.95


@dataclass(frozen=True)
class Ladder:
    """Half strokes of n guides against relative deviation, longest first; each column is a scan of one guide.

    Attributes
    ----------
    half : ndarray, shape (STROKES, n)
        Half strokes tried [length].
    relative : ndarray, shape (STROKES, n)
        Deviation over stroke found there; NaN where the guide could not be traced.
    centre : ndarray, shape (n,)
        Middle of the window in half strokes.
    """

    half: Array
    relative: Array
    centre: Array


def scan(guides: Span, *, circle: bool, three: Array, nodes: int = 16) -> Ladder:
    """Trace each guide over a sequence of strokes.

    Parameters
    ----------
    guides : Span of n
    circle : bool
        The nominal.
    three : ndarray of bool, shape (n,)
        Whether the guided point has three merged inflections; its stroke is then also tried off centre, to either side.
    """
    n = len(guides)
    centre = np.zeros(n)
    if three.any():
        some = guides[three]
        options = np.array([0.0, OFF_CENTRE, -OFF_CENTRE])
        best = np.full(three.sum(), np.inf)
        chosen = np.zeros(three.sum())
        shortest = 0.3 * _longest(some, OFF_CENTRE)
        for option in options:
            relative = trace(some, shortest, circle=circle, split=True, centre=option, nodes=nodes).relative
            better = relative < best
            best, chosen = np.where(better, relative, best), np.where(better, option, chosen)
        centre[three] = chosen
    half = _longest(guides, centre) * RATIO ** np.arange(STROKES)[:, None]
    relative = np.stack(
        [trace(guides, h, circle=circle, split=True, centre=centre, nodes=nodes).relative for h in half]
    )
    return Ladder(half, relative, centre)


def reach(
    guides: Span, ladder: Ladder, tolerance: Array | float, *, circle: bool, steps: int = 2, nodes: int = 16
) -> tuple[Array, Traced]:
    """Return the longest half strokes within a relative deviation, NaN where there is none, and what is traced there.

    Parameters
    ----------
    guides : Span of n
    ladder : Ladder of n
    tolerance : float or ndarray, shape (n,)
        Largest deviation over stroke.
    steps : int
        Secant steps, in logarithms, between the last stroke that fails and the first that holds.  Every stroke that is
        returned was itself traced and holds.
    """
    tolerance = np.broadcast_to(np.asarray(tolerance, dtype=float), len(guides))
    with np.errstate(all="ignore"):
        holds = ladder.relative <= tolerance
        k = np.argmax(holds, axis=0)
        some = holds.any(axis=0)
        good = np.take_along_axis(ladder.half, k[None], 0)[0]
        good_e = np.log(np.take_along_axis(ladder.relative, k[None], 0)[0] / tolerance)
        before = np.maximum(k - 1, 0)[None]
        bad = np.take_along_axis(ladder.half, before, 0)[0]
        bad_e = np.log(np.take_along_axis(ladder.relative, before, 0)[0] / tolerance)
        good = np.where(some, good, np.nan)
        for _ in range(steps):
            open_ = some & (k > 0) & (bad > good * 1.001)
            if not open_.any():
                break
            share = np.clip((-0.02 - good_e) / (bad_e - good_e), 0.05, 0.95)
            share = np.where(np.isfinite(share), share, 0.5)
            tried = np.exp(np.log(good) + share * (np.log(bad) - np.log(good)))
            now = trace(
                guides[open_], tried[open_], circle=circle, split=True, centre=ladder.centre[open_], nodes=nodes
            ).relative
            e = np.full(len(guides), np.nan)
            e[open_] = np.log(now / tolerance[open_])
            hit = open_ & (e <= 0)
            miss = open_ & ~hit
            good, good_e = np.where(hit, tried, good), np.where(hit, e, good_e)
            bad, bad_e = np.where(miss, tried, bad), np.where(miss, e, bad_e)
    return good, trace(guides, good, circle=circle, split=True, centre=ladder.centre, nodes=nodes)


def _longest(guides: Span, centre: Array | float) -> Array:
    low, high = guides.extent
    return np.asarray(USABLE * np.minimum(low / (1 - centre), high / (1 + centre)))
