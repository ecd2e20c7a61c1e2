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
    """Options of the search for the straightest stretches of circuits."""

    block: int = 1024  #: largest number of circuits processed at once on a core
    alone: int = 256  #: number of circuits up to which a single core processes them
    first: int = 2  #: rounds of moves between two selections of windows to follow
    spare: int = 2  #: number of windows followed per requested stretch: some of them overlap
    #: Largest number of searches for windows longer than the longest: none of 400 linkages needs
    #: more than two.
    checks: int = 4


STRETCH_SEARCH = StretchSearch()


class QuickSearch(NamedTuple):
    """Limits of a quick search."""

    seen: int = 4  #: number of windows per linkage that are measured for a first bound
    moved: int = 6  #: number of windows per linkage that may be moved
    #: Deviation over the best up to which windows are followed after two rounds: the moves left, a
    #: fortieth of a window, change a deviation by less.
    close: float = 1.2
    closer: float = 1.05  #: the ratio after four rounds, when the moves left are a hundredth of a window
    #: The ratio before the final moves, which measure the stroke along the best line instead of a
    #: chord, on more nodes: that changes deviations by a few thousandths.
    tied: float = 1.01
    #: Number of final rounds of moves, which leave an error of 4e-5 windows: 2e-4 of a deviation at
    #: a steep limit.
    last: int = 4
    #: Factor by which the moves grow again before the final rounds of a thorough search: there the
    #: stroke is measured along the best line instead of a chord, which shifts the optimum.
    again: int = 4
    #: Largest final move of a quick search [windows]: about a piece, as of two plateaus of nearly
    #: equal deviation the lower one may be narrow.
    piece: float = 0.05


QUICK_SEARCH = QuickSearch()

#: Number of windows per linkage that remain after each of the first corrections of a stroke, in a
#: quick search.
KEPT_WINDOWS = (3, 2, 1)
#: Largest numbers of corrections of a stroke, (thorough, quick search): on the coarse grid, then on
#: the fine one.
CORRECTIONS = ((4, 1), (5, 7))


class Extension(NamedTuple):
    """Options of the extension of a stretch to its permitted deviation."""

    #: Relative difference of a feasible and an infeasible stroke at which corrections stop.
    settled: float = 1e-3
    inside: float = 1e-3  #: relative margin of the deviation below its bound
    #: Smallest relative growth of a stroke that counts when an end is moved: near the longest
    #: stroke smaller gains are rounding.
    gain: float = 1e-7
    #: Ratio of the short to the long trial moves of the two ends in the final search.
    shorter: float = 1 / 8
    #: directions of the trial moves: with eight, a ridge of the deviation can lie between two
    directions: int = 16
    first: float = 1 / 64  #: length of the first trial moves [windows]
    last: float = 1e-4  #: length of the trial moves at which the search stops [windows]
    most: int = 20  #: largest number of rounds of trial moves


EXTENSION = Extension()

#: Range of the exponent of the stroke to which the deviation is proportional.
EXPONENT_RANGE = (0.5, 60.0)
#: Range of a correction of the logarithm of a stroke.
STROKE_CHANGE_RANGE = (-0.5, 0.2)
_TURN = np.exp(2j * np.pi * np.arange(EXTENSION.directions) / EXTENSION.directions).view(float).reshape(-1, 2)
SIDES = np.kron(EXTENSION.shorter ** np.arange(2)[:, None], _TURN / np.abs(_TURN).max(1, keepdims=True))


def straightest(
    circuits: Carriers,
    point: Complexes,
    stroke: Floats,
    *,
    circle: bool,
    radius: float | None = None,
    count: int = 4,
    last: int = QUICK_SEARCH.last,
) -> Stretches:
    """Find the straightest stretches of coupler points (k,) on circuits (k,).

    With `count` 1 return the best stretch of each linkage; else also others, at most
    `STRETCH_SEARCH.spare` times `count`, as some may overlap.

    Parameters
    ----------
    stroke : ndarray, shape (k,)
        Distance of the ends [length].
    circle : bool
        Fit circles, of the given `radius` [length] or of any.
    last : int
        Number of final rounds of moves with `count` 1; each divides the error of a window by six.
    """
    quick = count == 1

    def found(block: Indices) -> Stretches:
        seek = Search(Curves.of(circuits[block], point[block], block), circle, radius, quick)
        return seek.numbered(least(seek, stroke[block], np.full(len(block), np.inf), count, last=last))

    return _evaluate_in_blocks(found, len(circuits))


def least(
    seek: Search,
    stroke: Floats,
    bound: Floats,
    count: int,
    which: Indices | None = None,
    last: int = QUICK_SEARCH.last,
) -> Stretches:
    """Find the windows of least deviation over strokes (m,), below bounds (k,).

    With `count` 1 return the best window of each linkage; else the best one of each curve, and
    others up to `STRETCH_SEARCH.spare` times `count`.

    Parameters
    ----------
    stroke : ndarray, shape (m,)
        Strokes for all curves, or for those numbered `which` (m,) [length].
    last : int
        Number of final rounds of moves with `count` 1.
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
        at, by = _select_near_best(seek, at[lead], by[lead], bound, WINDOW.looser)
        at, by = _select_near_best(seek, *seek.moved(at, by, STRETCH_SEARCH.first), bound, QUICK_SEARCH.close)
        at, by = _select_near_best(seek, *seek.moved(at, by, STRETCH_SEARCH.first), bound, QUICK_SEARCH.closer)
        apart = seek.distinct(at)
        at, _ = _select_near_best(seek, at[apart], by[apart], bound, QUICK_SEARCH.tied)
        at, _ = seek.moved(at, QUICK_SEARCH.piece * (at.high - at.low), last, WINDOW.finer, along=True)
        return at[seek.leading(at, at.deviation, 1)]
    at, by = seek.moved(at, by, STRETCH_SEARCH.first)
    apart = seek.distinct(at)
    at, by = at[apart], by[apart]
    lead = seek.leading(at, at.deviation, STRETCH_SEARCH.spare * count)
    at, _ = seek.moved(at[lead], QUICK_SEARCH.again * by[lead], nodes=WINDOW.finer, along=True)
    return at


def _select_near_best(
    seek: Search, at: Stretches, by: Floats, bound: Floats, within: float
) -> tuple[Stretches, Floats]:
    """Select the windows of each linkage nearly as straight as its best, or as bounds (k,)."""
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

    return _evaluate_in_blocks(found, len(circuits))


def grown(seek: Search, at: Stretches, by: Floats, allowed: Floats) -> Stretches:
    """Grow windows, moved by up to `by` (n,) [rad], to their permitted deviations.

    Windows above their permitted deviations are dropped.
    """
    if not len(at.low):
        return at
    grow = _Growing(seek, at, by, allowed[at.circuit])
    rough, fine = CORRECTIONS[seek.quick]
    for turn in range(rough):
        grow.step(WINDOW.nodes)
        if seek.quick and turn < len(KEPT_WINDOWS):
            grow.keep(seek.leading(grow.at, -grow.reach, KEPT_WINDOWS[turn]))
    grow.finer()
    for _ in range(fine):
        grow.step(WINDOW.finer)
    held = np.flatnonzero(grow.best.stroke > 0)
    best = grow.best[held]
    return best if seek.quick else extended(seek, best, (1 - EXTENSION.inside) * grow.allowed[held])


class _Growing:
    """Windows while they are corrected to their permitted deviations; n, arrays of shape (n,).

    Attributes
    ----------
    at, by : Stretches, ndarray
        Windows to measure next, and their largest moves [rad].
    best : Stretches
        The longest feasible windows so far; stroke 0 if there is none.
    beyond : ndarray
        Shortest infeasible strokes so far [length].
    power : ndarray
        Exponent of the stroke to which the deviation is proportional.
    last : Stretches
        Last measurement of the windows.
    reach : ndarray
        Estimated final stroke [length].
    """

    def __init__(self, seek: Search, at: Stretches, by: Floats, allowed: Floats) -> None:
        n = len(at.low)
        self.seek, self.at, self.by, self.allowed = seek, at, by, allowed
        self.best, self.beyond = replace(at, stroke=np.zeros(n)), np.full(n, np.inf)
        self.power, self.last, self.reach = np.full(n, 3.0), at, at.stroke

    def keep(self, some: Indices) -> None:
        """Drop all windows but the given ones."""
        self.at, self.by, self.allowed, self.best = self.at[some], self.by[some], self.allowed[some], self.best[some]
        self.beyond, self.power, self.last = self.beyond[some], self.power[some], self.last[some]
        self.reach = self.reach[some]

    def finer(self) -> None:
        """Measure feasible windows on the finer grid; correct again those infeasible on it."""
        self.best, self.beyond = self.seek.measured(self.best, WINDOW.finer), np.full(len(self.beyond), np.inf)
        self.best = replace(self.best, stroke=np.where(self.best.deviation <= self.allowed, self.best.stroke, 0.0))

    def step(self, nodes: int) -> None:
        """Correct the strokes of windows that have not converged."""
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
            power = np.where((slope > EXPONENT_RANGE[0]) & (slope < EXPONENT_RANGE[1]), slope, power)
            wanted = at.stroke * np.exp(
                np.clip((np.log(allowed / at.deviation) - EXTENSION.inside) / power, *STROKE_CHANGE_RANGE)
            )
            middle = np.where(
                np.isfinite(beyond), np.sqrt(best.stroke * beyond), at.stroke * np.exp(STROKE_CHANGE_RANGE[1])
            )
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

    Ends also move separately: where a path turns back, or an open circuit ends, a shift of the
    whole window seldom permits a longer one.
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


def _evaluate_in_blocks(found: Callable[[Indices], Stretches], n: int) -> Stretches:
    """Evaluate a function on blocks of n circuits, several blocks at once."""
    if n <= STRETCH_SEARCH.alone:
        return found(np.arange(n))
    cores = os.cpu_count() or 1
    blocks = np.array_split(np.arange(n), cores * max(1, -(-n // (cores * STRETCH_SEARCH.block))))
    with Threads(cores) as threads:
        return join(*threads.map(found, blocks))
