"""Straightest stretches of coupler points over a stroke, and longest ones within a deviation.

`least` searches for windows of a stroke with the least deviation: bounds of cells (`cells`) exclude
most windows, the others are measured and moved along their curves.  `longest` grows windows until
their deviations reach the tolerance, then searches for windows a little longer than the longest and
grows them, until none is within the tolerance.  The two answers are therefore consistent.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..kinematics.batch import join, put
from ..kinematics.circuits import Carriers
from ..kinematics.types import Complexes, Floats, Indices
from ..threads import Threads
from .cells import Curves
from .windows import WINDOW, Search, Stretches


class StretchSearch(NamedTuple):
    """How the straightest stretches of circuits are searched for."""

    block: int = 1024  #: most circuits handled at once, on one of the cores
    alone: int = 256  #: circuits up to which they are not shared among the cores
    first: int = 2  #: rounds of moves between two choices of windows to follow
    spare: int = 2  #: windows followed per stretch that is wanted: some of them overlap
    #: Most searches for windows longer than the longest: of 400 linkages none needs more than two.
    checks: int = 4


STRETCH_SEARCH = StretchSearch()


class QuickSearch(NamedTuple):
    """Limits of a quick search."""

    seen: int = 4  #: windows of a linkage that are measured for a first bound
    moved: int = 6  #: windows of a linkage that may be moved on
    #: Deviation over the best up to which windows are followed after two rounds: the fortieth of a
    #: window then left changes it by less.
    close: float = 1.2
    closer: float = 1.05  #: The ratio after four rounds: a hundredth of a window is left.
    #: The ratio in the end: over a stroke along the best line instead of a chord, and on finer
    #: nodes, deviations change by a few thousandths.
    tied: float = 1.01
    #: Rounds of moves in the end, which leave 4e-5 of a window: 2e-4 of a deviation at a steep
    #: limit.
    last: int = 4
    #: Growth of the moves over the last ones: over a stroke along the best line, no longer over a
    #: chord, the best place is another one.
    again: int = 4
    #: Least distance of two windows [windows]: about a piece, for of two plateaus of nearly one
    #: deviation the lower one may be narrow.
    piece: float = 0.05


QUICK_SEARCH = QuickSearch()

#: Windows of a linkage left after each of the first corrections of a stroke, in a quick search.
KEPT = (3, 2, 1)
#: Most corrections of a stroke: (thorough, quick search) on the coarse grid, and on the fine one.
CORRECTIONS = ((4, 1), (5, 7))


class Extension(NamedTuple):
    """How a stretch is made as long as its deviation permits."""

    #: Relative difference of a feasible and an infeasible stroke at which corrections stop.
    settled: float = 1e-3
    inside: float = 1e-3  #: relative margin of the deviation below its bound
    #: Smallest relative growth of a stroke when an end is moved: at the longest stroke rounding
    #: gains.
    gain: float = 1e-7
    #: Ratio of the short to the long trial moves of the two ends in the final search.
    shorter: float = 1 / 8
    #: directions of the trial moves: with eight, a ridge of the deviation can lie between two
    directions: int = 16
    first: float = 1 / 64  #: length of the first trial moves [windows]
    last: float = 1e-4  #: length of the last trial moves [windows]
    most: int = 20  #: most rounds of trial moves


EXTENSION = Extension()

#: Range of the exponent of the deviation as a power of the stroke.
STEEP = (0.5, 60.0)
#: Range of a change of the logarithm of a stroke.
CHANGE = (-0.5, 0.2)
_TURN = np.exp(2j * np.pi * np.arange(EXTENSION.directions) / EXTENSION.directions).view(float).reshape(-1, 2)
SIDES = np.kron(EXTENSION.shorter ** np.arange(2)[:, None], _TURN / np.abs(_TURN).max(1, keepdims=True))


def straightest(
    circuits: Carriers, point: Complexes, stroke: Floats, *, circle: bool, radius: float | None = None, count: int = 4
) -> Stretches:
    """Find the straightest stretches of coupler points (k,) on circuits (k,).

    With `count` 1 the best of each linkage; else also others, at most `STRETCH_SEARCH.spare` times
    `count`, as some may overlap.

    Parameters
    ----------
    stroke : ndarray, shape (k,)
        Distance of the ends [length].
    circle : bool
        Seek circles, of the `radius` that is given [length] or of any.
    """
    quick = count == 1

    def found(block: Indices) -> Stretches:
        seek = Search(Curves.of(circuits[block], point[block], block), circle, radius, quick)
        return seek.numbered(least(seek, stroke[block], np.full(len(block), np.inf), count))

    return _by_blocks(found, len(circuits))


def least(seek: Search, stroke: Floats, bound: Floats, count: int, which: Indices | None = None) -> Stretches:
    """Find the windows of least deviation over strokes (m,), below bounds (k,).

    With `count` 1 the best of each linkage; else that of each curve, and of others up to
    `STRETCH_SEARCH.spare` times `count`.

    Parameters
    ----------
    stroke : ndarray, shape (m,)
        Of all curves, or of those with the numbers `which` (m,) [length].
    """
    cells = seek.cells(stroke, which)
    cells = cells[np.flatnonzero(cells.least < bound[cells.circuit])]
    if not len(cells.low):
        return Stretches.none()
    first = seek.places(cells, QUICK_SEARCH.seen if seek.quick else max(count, 3))
    at = seek.measured(first[seek.leading(first, first.deviation, QUICK_SEARCH.seen)] if seek.quick else first)
    at, by = seek.moved(at, 0.5 * WINDOW.wide * (at.high - at.low), STRETCH_SEARCH.first)
    more, near = seek.contenders(cells, seek.best(at, bound) if seek.quick else seek.listed(at, bound, count))
    at, by = join(more, at), np.concatenate([near, by])
    if seek.quick:
        lead = seek.leading(at, at.deviation, QUICK_SEARCH.moved)
        at, by = _near_the_best(seek, at[lead], by[lead], bound, WINDOW.looser)
        at, by = _near_the_best(seek, *seek.moved(at, by, STRETCH_SEARCH.first), bound, QUICK_SEARCH.close)
        at, by = _near_the_best(seek, *seek.moved(at, by, STRETCH_SEARCH.first), bound, QUICK_SEARCH.closer)
        apart = seek.distinct(at)
        at, _ = _near_the_best(seek, at[apart], by[apart], bound, QUICK_SEARCH.tied)
        at, _ = seek.moved(at, QUICK_SEARCH.piece * (at.high - at.low), QUICK_SEARCH.last, WINDOW.finer, along=True)
        return at[seek.leading(at, at.deviation, 1)]
    at, by = seek.moved(at, by, STRETCH_SEARCH.first)
    apart = seek.distinct(at)
    at, by = at[apart], by[apart]
    lead = seek.leading(at, at.deviation, STRETCH_SEARCH.spare * count)
    at, _ = seek.moved(at[lead], QUICK_SEARCH.again * by[lead], nodes=WINDOW.finer, along=True)
    return at


def _near_the_best(seek: Search, at: Stretches, by: Floats, bound: Floats, within: float) -> tuple[Stretches, Floats]:
    """Select the windows of each linkage nearly as straight as the best, or as bounds (k,)."""
    some = np.flatnonzero(at.deviation <= within * seek.best(at, bound)[at.circuit])
    return at[some], by[some]


def longest(
    circuits: Carriers,
    point: Complexes,
    deviation: Floats,
    *,
    circle: bool,
    radius: float | None = None,
    count: int = 4,
) -> Stretches:
    """Find the longest stretches within deviations (k,) [length].

    With a `count` of 1 the search is quick, and finds the longest stretch of each linkage.
    """
    quick = count == 1

    def found(block: Indices) -> Stretches:
        seek = Search(Curves.of(circuits[block], point[block], block), circle, radius, quick)
        allowed = deviation[block]
        at = grown(seek, *seek.about(seek.longer(allowed, count)), allowed)
        open_ = np.arange(len(block))
        for _ in range(STRETCH_SEARCH.checks):
            known = seek.farthest(at)[open_]
            asked = np.where(known > 0, (1 + EXTENSION.settled) * known, seek.curves.shortest[open_])
            more = least(seek, asked, allowed, count, open_)
            more = more[np.flatnonzero(more.deviation <= allowed[more.circuit])]
            more = grown(seek, more, WINDOW.wide * (more.high - more.low), allowed)
            more = more[np.flatnonzero(more.stroke > (1 + 0.5 * EXTENSION.settled) * seek.farthest(at)[more.circuit])]
            if not len(more.low):
                break
            at = join(at, more)
            own = seek.owner
            open_ = np.flatnonzero(np.isin(own, own[more.circuit]))
        return seek.numbered(at)

    return _by_blocks(found, len(circuits))


def grown(seek: Search, at: Stretches, by: Floats, allowed: Floats) -> Stretches:
    """Grow windows, moved by up to `by` (n,) [rad], to their permitted deviations.

    Windows that violate them are dropped.
    """
    if not len(at.low):
        return at
    grow = _Growing(seek, at, by, allowed[at.circuit])
    rough, fine = CORRECTIONS[seek.quick]
    for turn in range(rough):
        grow.step(WINDOW.nodes)
        if seek.quick and turn < len(KEPT):
            grow.keep(seek.leading(grow.at, -grow.reach, KEPT[turn]))
    grow.finer()
    for _ in range(fine):
        grow.step(WINDOW.finer)
    held = np.flatnonzero(grow.best.stroke > 0)
    best = grow.best[held]
    return best if seek.quick else extended(seek, best, (1 - EXTENSION.inside) * grow.allowed[held])


class _Growing:
    """n windows during the correction to their permitted deviations; arrays of shape (n,).

    Attributes
    ----------
    at, by : Stretches, ndarray
        Windows to measure next, and how far they may move [rad].
    best : Stretches
        The longest feasible ones so far; stroke 0 if there is none.
    beyond : ndarray
        Shortest infeasible strokes so far [length].
    power : ndarray
        Power of the stroke with which the deviation grows.
    last : Stretches
        Their last measurement.
    reach : ndarray
        Estimated final length [length].
    """

    def __init__(self, seek: Search, at: Stretches, by: Floats, allowed: Floats) -> None:
        n = len(at.low)
        self.seek, self.at, self.by, self.allowed = seek, at, by, allowed
        self.best, self.beyond = replace(at, stroke=np.zeros(n)), np.full(n, np.inf)
        self.power, self.last, self.reach = np.full(n, 3.0), at, at.stroke

    def keep(self, some: Indices) -> None:
        """Drop all windows but some."""
        self.at, self.by, self.allowed, self.best = self.at[some], self.by[some], self.allowed[some], self.best[some]
        self.beyond, self.power, self.last = self.beyond[some], self.power[some], self.last[some]
        self.reach = self.reach[some]

    def finer(self) -> None:
        """Measure feasible strokes on the finer grid; reopen those infeasible on it."""
        self.best, self.beyond = self.seek.measured(self.best, WINDOW.finer), np.full(len(self.beyond), np.inf)
        self.best = replace(self.best, stroke=np.where(self.best.deviation <= self.allowed, self.best.stroke, 0.0))

    def step(self, nodes: int) -> None:
        """Correct the strokes of windows that are not settled."""
        open_ = np.flatnonzero(~(self.beyond < (1 + EXTENSION.settled) * self.best.stroke))
        if not len(open_):
            return
        allowed, best, beyond = self.allowed[open_], self.best[open_], self.beyond[open_]
        at, by = self.seek.moved(self.at[open_], self.by[open_], nodes=nodes, correcting=True)
        holds = at.deviation <= allowed
        best = put(best, holds, at[holds])
        beyond = np.where(holds, beyond, np.minimum(beyond, at.stroke))
        last, before, power = at, self.last[open_], self.power[open_]
        with np.errstate(all="ignore"):
            reach = np.fmax(best.stroke, at.stroke * (allowed / at.deviation) ** (1 / power))
            slope = np.log(at.deviation / before.deviation) / np.log(at.stroke / before.stroke)
            power = np.where((slope > STEEP[0]) & (slope < STEEP[1]), slope, power)
            wanted = at.stroke * np.exp(np.clip((np.log(allowed / at.deviation) - EXTENSION.inside) / power, *CHANGE))
            middle = np.where(np.isfinite(beyond), np.sqrt(best.stroke * beyond), at.stroke * np.exp(CHANGE[1]))
            outside = ~((wanted > best.stroke) & (wanted < beyond))
            wanted = np.where(outside & (best.stroke > 0), middle, np.where(outside, 0.7 * at.stroke, wanted))
        lost = np.isnan(at.deviation) & (best.stroke > 0)
        at = put(at, lost, best[lost])
        ratio = wanted / at.stroke
        by = np.maximum(by, np.abs(ratio - 1) * (at.high - at.low))
        at = replace(at, stroke=wanted, high=at.low + ratio * (at.high - at.low))
        for name, new in (
            ("at", at),
            ("by", by),
            ("best", best),
            ("beyond", beyond),
            ("power", power),
            ("last", last),
            ("reach", reach),
        ):
            setattr(self, name, put(getattr(self, name), open_, new))


def extended(seek: Search, at: Stretches, allowed: Floats) -> Stretches:
    """Extend windows within deviations (n,), moving each end and both.

    Ends move separately as well: where a path turns back, or an open circuit ends, moving a window
    along seldom makes it longer.
    """
    by, some = EXTENSION.first * (at.high - at.low), np.arange(len(at.low))
    for _ in range(EXTENSION.most):
        n, (low, high) = len(some), SIDES.T[..., None] * by[some]
        each = at[np.tile(some, len(low))]
        tried = seek.between(replace(each, low=each.low + low.ravel(), high=each.high + high.ravel()), WINDOW.nodes)
        stroke = np.where(tried.deviation <= np.tile(allowed[some], len(low)), tried.stroke, 0.0).reshape(len(low), n)
        best = stroke.argmax(axis=0)
        longer = stroke[best, np.arange(n)] > (1 + EXTENSION.gain) * at.stroke[some]
        at = put(at, some[longer], tried[(best * n + np.arange(n))[longer]])
        by[some] *= np.where(longer, 2 * np.abs(SIDES[best]).max(1), EXTENSION.shorter**2)
        some = some[by[some] > EXTENSION.last * (at.high - at.low)[some]]
        if not len(some):
            break
    return at


def _by_blocks(found: Callable[[Indices], Stretches], n: int) -> Stretches:
    """Evaluate a function on blocks of n circuits, several at once."""
    if n <= STRETCH_SEARCH.alone:
        return found(np.arange(n))
    cores = os.cpu_count() or 1
    blocks = np.array_split(np.arange(n), cores * max(1, -(-n // (cores * STRETCH_SEARCH.block))))
    with Threads(cores) as threads:
        return join(*threads.map(found, blocks))
