"""Windows of coupler curves: measured, and moved to where their paths are straightest.

A window begins in a cell (`cells`) of its curve. It is moved along the curve in ever shorter steps
until its deviation, by `minimum_zone`, is minimal. Where the turn of the path would exceed its
limit, the window stops at that limit.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..kinematics.batch import Rows, join, put
from ..kinematics.circuits import OPEN
from ..kinematics.types import Complexes, Floats, Indices, Mask
from .cells import Cells, Curves, bent, cells_of, from_chord
from .circuit_curve import MIDDLE, runs_forward
from .minimum_zone import alternating, grid, reference


class WindowOptions(NamedTuple):
    """Options of the search for windows along a curve, and of their measurement."""

    #: Largest deviation of a window that is moved on, over the least known. Windows are measured in
    #: the middle of each piece: towards the next piece, a twentieth of a window away, the deviation
    #: falls by at most this factor.
    looser: float = 1.6
    apart: float = 0.05  #: least distance of the starts of two windows [windows]: half a piece
    peak: float = 1.4  #: approximate ratio of largest to mean error of a path that cannot be improved
    #: Growth of the moves while a stroke is corrected along the best line, if the best trial is the
    #: farthest.
    farther: float = 2.0
    wide: float = 1 / 6  #: largest shift of trial windows [windows]
    #: Largest number of secant steps to the end of a window: where its path turns by 84 degrees
    #: they converge slowly.
    steps: int = 8
    close: float = 1e-5  #: permitted error of a stroke [strokes]
    negligible: float = 1e-7  #: error of a stroke at which no further step is taken [strokes]
    #: largest number of corrections of a chord until the stroke along the best line is the
    #: requested one
    tilts: int = 3
    nodes: int = 16  #: intervals between the Chebyshev points of a window during the search
    finer: int = 32  #: intervals for the final measurement
    #: Factor of the cosine below which a path no longer runs forward, as the limit in a search: the
    #: last corrections of the stroke then stay within the limit.
    inside_limit: float = 1.03
    #: Distance inside its ends at which a path is tested for turning back [half windows].
    edge: float = 1e-5
    together: int = 12  #: number of windows searched for at once: of several strokes where curves are few
    fullest: float = 1.95  #: chord over radius of the widest arc


WINDOW = WindowOptions()


class Moves(NamedTuple):
    """Trial windows about the best one so far, in rounds."""

    places: Floats  #: trial moves [largest move of the round]
    shrinking: float  #: ratio of the largest moves of successive rounds
    rounds: int


#: Trial windows of a thorough and of a quick search.
THOROUGH = Moves(np.array([0, -1, 1, -2, 2, -3, 3, -4, 4, -5, 5, -6, 6]) / 6, 1 / 6, 5)
QUICK = Moves(np.array([0, -1, 1]) / 2, 1 / 2, 9)
#: Trial windows after a correction of strokes: one round.
CORRECTING = Moves(np.array([0, -1, 1, -2, 2, -3, 3]) / 3, 1 / 3, 1)
#: Number of windows about each first one, and number of these followed: in a thorough, and in a
#: quick search.
TRIALS_ABOUT = ((13, 2), (7, 1))
#: Trial strokes for a given deviation [largest distance on the curve].
TRIAL_STROKES = 0.95 * 0.8 ** np.arange(24)

#: Function that computes points of paths (m, n) at phases (m, n), or (n,).
Path = Callable[[Floats], Complexes]


@dataclass(frozen=True)
class Stretches(Rows):
    """n windows of circuits; arrays of shape (n,).

    Attributes
    ----------
    circuit : ndarray of int
        Number of the circuit.
    low, high : ndarray
        Phases of the ends [rad].
    stroke, chord : ndarray
        The stroke is the distance of the ends, or of their projections on the best line; the chord
        is the distance of the ends [length].
    deviation : ndarray
        Half the width of the narrowest strip or annulus, or the largest distance from the
        best-placed arc of the given radius; NaN where the path turns back within the window
        [length].
    extremes : ndarray of int
        Fine points of the finer grid near the alternating extremes of the distance from the line or
        circle, (n, 3 or 4).
    """

    circuit: Indices
    low: Floats
    high: Floats
    stroke: Floats
    chord: Floats
    deviation: Floats
    extremes: Indices

    @classmethod
    def none(cls) -> Stretches:
        """Return an empty batch of windows."""
        nothing, whole = np.zeros(0), np.zeros(0, int)
        return cls(whole, nothing, nothing, nothing, nothing, nothing, np.zeros((0, 3), int))


@dataclass(frozen=True)
class Search:
    """Search for windows of coupler curves.

    Results number the circuits by their rows in `curves`; `numbered` restores the original numbers.
    """

    curves: Curves
    circle: bool
    radius: float | None
    quick: bool

    def cells(self, stroke: Floats, which: Indices | None = None) -> Cells:
        """Return the cells of curves, all or those numbered `which`, for one stroke each."""
        which = np.arange(len(self.curves)) if which is None else which
        return cells_of(self.curves, stroke, which, self.circle, self.radius)

    def begun(self, cells: Cells, share: float = 0.0) -> Stretches:
        """Return a window for each cell; it begins at a share, 0 to 1, of the piece of the cell."""
        shift = share * cells.piece
        extremes = reference(4 if self.circle and self.radius is None else 3, 4 * WINDOW.finer)
        extremes = np.broadcast_to(extremes, (len(shift), len(extremes)))
        return Stretches(
            cells.circuit,
            cells.low + shift,
            cells.high + shift,
            cells.stroke,
            cells.stroke,
            WINDOW.peak * cells.least,
            extremes,
        )

    def places(self, cells: Cells, count: int) -> Stretches:
        """Return windows of cells with locally least bounds, at most `count` per curve."""
        cells = cells[np.flatnonzero(cells.peak)]
        order = np.lexsort((cells.least, cells.stroke, cells.circuit))
        of, asked = cells.circuit[order], cells.stroke[order]
        new = np.flatnonzero((np.diff(of, prepend=-1) != 0) | (np.diff(asked, prepend=-1.0) != 0))
        rank = np.arange(len(of)) - np.repeat(new, np.diff(new, append=len(of)))
        return self.begun(cells[np.sort(order[rank < count])])

    def contenders(self, cells: Cells, bound: Floats) -> tuple[Stretches, Floats]:
        """Select windows that may fall below bounds (k,), with distances to the next ones [rad].

        A window in the middle of every cell that its bound does not exclude is measured; those
        straighter than their neighbours, and not too far above the bound, are returned.
        """
        open_ = cells[np.flatnonzero(cells.least < bound[cells.circuit])]
        tried = self.measured(self.begun(open_, 0.5))
        off = np.where(np.isnan(tried.deviation), np.inf, tried.deviation)
        beside = (np.diff(open_.circuit) == 0) & (np.diff(open_.number) == 1)
        before = np.where(np.append(False, beside), np.roll(off, 1), np.inf)
        after = np.where(np.append(beside, False), np.roll(off, -1), np.inf)
        kept = np.flatnonzero((off <= before) & (off < after) & (off < WINDOW.looser * bound[open_.circuit]))
        return tried[kept], open_.piece[kept]

    def distinct(self, at: Stretches) -> Indices:
        """Select windows straighter than all others within `WINDOW.apart` of their length."""
        order = np.lexsort((at.low, at.circuit))
        low, off, of = at.low[order], np.nan_to_num(at.deviation[order], nan=np.inf), at.circuit[order]
        near = (np.diff(of) == 0) & (np.diff(low) < WINDOW.apart * (at.high - at.low)[order][1:])
        worse = np.zeros(len(off), bool)
        worse[1:] |= near & (off[1:] >= off[:-1])
        worse[:-1] |= near & (off[:-1] > off[1:])
        return np.sort(order[~worse])

    def measured(self, at: Stretches, nodes: int = WINDOW.nodes, *, along: bool = False) -> Stretches:
        """Fit windows, given by their start and approximate length, to their strokes.

        Windows beyond the ends of open circuits are moved back. A stroke is a chord, or with
        `along` a length along the best line.
        """
        found = self._measure_over_chords(at, at.chord if along else at.stroke, nodes)
        for _ in range(WINDOW.tilts * along):
            with np.errstate(all="ignore"):
                off = np.flatnonzero(np.abs(found.stroke - at.stroke) > WINDOW.close * at.stroke)
                if not len(off):
                    break
                chord = at.stroke[off] / found.stroke[off] * found.chord[off]
            found = put(found, off, self._measure_over_chords(found[off], chord, nodes))
        return replace(found, stroke=at.stroke, chord=np.where(np.isnan(found.deviation), at.stroke, found.chord))

    def _measure_over_chords(self, at: Stretches, chord: Floats, nodes: int) -> Stretches:
        """Measure windows of given chords (n,), with strokes along the best line."""
        path, open_ = self._path(at), self._is_open(at)
        with np.errstate(all="ignore"):
            # an open circuit has two ends, at which windows stop
            low = np.where(open_, np.maximum(at.low, 0.0), at.low)
            high = _solve_end(path, low, at.high + low - at.low, chord)
            beyond = open_ & (high > 2 * np.pi)
            if beyond.any():
                low = np.where(beyond, _solve_end(path, np.where(beyond, 2 * np.pi, high), low, chord), low)
                high = np.where(beyond, 2 * np.pi, high)
            found = self._measure_between_ends(replace(at, low=low, high=high), nodes, path)
            close = np.abs(found.chord - chord) <= WINDOW.close * chord
            return replace(found, deviation=np.where(close, found.deviation, np.nan))

    def between(self, at: Stretches, nodes: int = WINDOW.nodes) -> Stretches:
        """Measure windows between their ends; strokes are those along the best line."""
        return self._measure_between_ends(at, nodes, self._path(at))

    def _measure_between_ends(self, at: Stretches, nodes: int, path: Path) -> Stretches:
        """Measure windows on their paths between their ends."""
        open_ = self._is_open(at)
        low, high = at.low, at.high
        with np.errstate(all="ignore"):
            points = grid(nodes)
            share = np.concatenate([[WINDOW.edge - 1], points.nodes, [1 - WINDOW.edge]])
            z = path(0.5 * (low + high) + 0.5 * (high - low) * share[:, None])
            seen, half = from_chord(z[1:-1])
            # test between the last two points too
            onward = (((z[[0, -2]] - z[[1, -1]]) * (z[-2] - z[1]).conj()).real > 0).all(0)
            held = bent(seen[nodes // 2].imag, half, self.radius) if self.radius is not None else None
            forward = (
                runs_forward(seen, WINDOW.inside_limit * MIDDLE.turning)
                & onward
                & (low < high)
                & ~(open_ & ((low < 0) | (high > 2 * np.pi)))
            )
            per, v = WINDOW.finer // nodes, np.where(forward, seen.imag, np.nan)
            fit, index = alternating(
                seen.real, v, self.circle, points, held, _make_increasing(at.extremes.T // per, 4 * nodes)
            )
            stroke, deviation = half * fit.stroke, half * fit.deviation
            return Stretches(at.circuit, low, high, stroke, 2 * half, deviation, per * index.T)

    def _path(self, at: Stretches) -> Path:
        """Return the paths of windows by their phases."""
        curves, of = self.curves, at.circuit  # do not capture the tables of the curves, which are large
        some, z, offset, sense = curves.circuits[of], curves.point[of], curves.offset[of], curves.sense[of]
        return lambda s: np.asarray(some.pose(offset + sense * s).point(z))

    def _is_open(self, at: Stretches) -> Mask:
        """Tell which windows are on open circuits."""
        return np.asarray(self.curves.circuits.kind[at.circuit] == OPEN)

    def about(self, at: Stretches) -> tuple[Stretches, Floats]:
        """Shift windows to the least deviations nearby; return also the spacing of trials [rad]."""
        if not len(at.low):
            return at, np.zeros(0)
        count, kept = TRIALS_ABOUT[self.quick]
        by = WINDOW.wide * (at.high - at.low)
        tried, off = self._try_moves(at, by, np.linspace(-1, 1, count))
        beside = np.pad(off, ((1, 1), (0, 0)), constant_values=np.inf)
        off = np.where((off <= beside[:-2]) & (off < beside[2:]), off, np.inf)
        order = np.argsort(off, axis=0, kind="stable")[:kept]
        good = np.isfinite(np.take_along_axis(off, order, 0)).T
        column = np.broadcast_to(np.arange(len(by)), order.shape).T[good]
        lost = np.setdiff1d(np.arange(len(by)), column)  # windows too long to fit anywhere near
        found, near = join(tried[order.T[good] * len(by) + column], at[lost]), np.concatenate([column, lost])
        return found, (by * 2 / (count - 1))[near]

    def best(self, at: Stretches, bound: Floats) -> Floats:
        """Return the least known deviations: of linkages or, in a thorough search, of curves."""
        own = self.owner
        least = np.full(len(self.curves), np.inf)
        np.fmin.at(least, own, bound)
        np.fmin.at(least, own[at.circuit], at.deviation)
        return np.asarray(least[own])

    def listed(self, at: Stretches, bound: Floats, count: int) -> Floats:
        """Return the deviations of rank `count` on curves (k,), or bounds (k,) if fewer are known.

        A window that overlaps a straighter one by more than a half does not count.
        """
        order = np.lexsort((at.deviation, at.circuit))
        of = at.circuit[order]
        rank = np.arange(len(of)) - np.searchsorted(of, of)
        shape = len(self.curves), int(rank.max(initial=0)) + 1
        off, middle, half = np.full(shape, np.inf), np.zeros(shape), np.zeros(shape)
        off[of, rank] = np.nan_to_num(at.deviation[order], nan=np.inf)
        middle[of, rank], half[of, rank] = 0.5 * (at.low + at.high)[order], 0.25 * (at.high - at.low)[order]
        period = self.curves.circuits.period[:, None, None]
        away = np.mod(middle[:, :, None] - middle[:, None] + 0.5 * period, period) - 0.5 * period
        same = np.tril(np.abs(away) < half[:, :, None] + half[:, None], -1).any(2)
        ranked = np.sort(np.where(same, np.inf, off), axis=1)
        return np.asarray(np.minimum(ranked[:, count - 1] if count <= shape[1] else np.inf, bound))

    def farthest(self, at: Stretches) -> Floats:
        """Return the longest stroke of a window in the group of each curve, (k,); 0 without any.

        Groups are those of `owner`.
        """
        own = self.owner
        most = np.zeros(len(self.curves))
        np.fmax.at(most, own[at.circuit], at.stroke)
        return np.asarray(most[own])

    @property
    def owner(self) -> Indices:
        """Group in which windows of a curve compete: its linkage, or the curve if thorough."""
        if not self.quick:
            return np.arange(len(self.curves))
        return np.asarray(np.unique(self.curves.circuits.of, return_inverse=True)[1])

    def _try_moves(
        self, at: Stretches, by: Floats, way: Floats, nodes: int = WINDOW.nodes, *, along: bool = False
    ) -> tuple[Stretches, Floats]:
        """Return windows moved along their paths by fractions `way` (m,) of `by` (n,) [rad].

        Return also their deviations, (m, n).
        """
        each = at[np.tile(np.arange(len(at.low)), len(way))]
        shift = (way[:, None] * by).ravel()
        tried = self.measured(replace(each, low=each.low + shift, high=each.high + shift), nodes, along=along)
        return tried, np.where(np.isnan(tried.deviation), np.inf, tried.deviation).reshape(len(way), len(by))

    def moved(
        self,
        at: Stretches,
        by: Floats,
        rounds: int | None = None,
        nodes: int = WINDOW.nodes,
        *,
        correcting: bool = False,
        along: bool = False,
    ) -> tuple[Stretches, Floats]:
        """Move windows along their paths to where they are straightest.

        The first moves are up to `by` (n,) [rad]; the lengths of the next moves are returned too.
        `correcting` applies after a change of their strokes.
        """
        n = len(at.low)
        way, shorter, all_rounds = CORRECTING if correcting else QUICK if self.quick and not along else THOROUGH
        farther = WINDOW.farther if correcting or along else 1.0
        for _ in range(all_rounds if rounds is None else rounds):
            if rounds is not None or correcting or along or nodes != WINDOW.nodes:
                tried, off = self._try_moves(at, by, way, nodes, along=along)
            else:  # the first trial is the window itself, which is measured already
                tried, off = self._try_moves(at, by, way[1:], nodes)
                here = np.where(np.isnan(at.deviation), np.inf, at.deviation)
                tried, off = join(at, tried), np.concatenate([here[None], off])
            # take the shortest move of equal deviation: all moves past the end of an open circuit
            # give the same window
            best = np.argmax(off <= off.min(0) * (1 + WINDOW.close), axis=0)
            at = tried[best * n + np.arange(n)]
            by = np.where(np.abs(way[best]) == 1, farther * by, by * shorter)
        return at, by

    def leading(self, at: Stretches, key: Floats, count: int) -> Indices:
        """Select at most `count` windows of each linkage by ascending key, NaN last."""
        of = self.curves.circuits.of[at.circuit]
        order = np.lexsort((key, of))
        rank = np.arange(len(of)) - np.searchsorted(of[order], of[order])
        return np.sort(order[rank < count])

    def longer(self, allowed: Floats, count: int) -> Stretches:
        """Return windows about as long as the deviations (k,) permit.

        For each circuit these are the longest estimated feasible one, one shorter, and `count` - 1
        longer ones, at least one.
        """
        across = self.curves.across
        if self.radius is not None:
            across = np.minimum(across, WINDOW.fullest * self.radius)
        parts, which, held, rung = [], np.flatnonzero(across > 0), np.zeros(len(across), int), 0
        while len(which) and rung < len(TRIAL_STROKES):
            shares = TRIAL_STROKES[rung : rung + max(WINDOW.together // len(which), 1)]
            cells = self.cells(np.outer(shares, across[which]).ravel(), np.tile(which, len(shares)))
            found = self.places(cells, 2)
            share = np.argmin(np.abs(shares[:, None] - found.stroke / across[found.circuit]), axis=0)
            holds = np.zeros((len(shares), len(across)), int)
            holds[share[good := found.deviation <= allowed[found.circuit]], found.circuit[good]] = 1
            before = held + holds.cumsum(0) - holds
            parts.append(found[before[share, found.circuit] < 2])
            held = held + holds.sum(0)
            which, rung = which[held[which] < 2], rung + len(shares)
        if not parts:  # no point moves
            return Stretches.none()
        tried = join(*parts)
        order = np.lexsort((tried.stroke, tried.circuit))
        tried = tried[order]
        first = np.searchsorted(tried.circuit, tried.circuit)
        return tried[np.flatnonzero(np.arange(len(first)) - first < max(count, 2) + 1)]

    def numbered(self, at: Stretches) -> Stretches:
        """Return windows with the original numbers of their circuits, and with phases of these."""
        of, offset, sense = at.circuit, self.curves.offset[at.circuit], self.curves.sense[at.circuit]
        ends = np.sort(np.stack([offset + sense * at.low, offset + sense * at.high]), axis=0)
        return replace(at, circuit=self.curves.number[of], low=ends[0], high=ends[1])


def _solve_end(path: Path, start: Floats, end: Floats, stroke: Floats) -> Floats:
    """Solve for the ends of windows (n,) from `start`, near `end`, over exactly their strokes."""
    before = start + 0.99 * (end - start)
    first, *others = path(np.stack([start, before, end]))
    error, now = (np.abs(other - first) - stroke for other in others)
    for left in reversed(range(WINDOW.steps)):
        step = now * (end - before) / np.where(now == error, np.inf, now - error)
        most = 0.2 * np.abs(end - start)
        before, error, end = end, now, end - np.clip(step, -most, most)
        if not left or not (np.abs(now) > WINDOW.negligible * stroke).any():
            break
        now = np.abs(path(end[None])[0] - first) - stroke
    return end


def _make_increasing(index: Indices, last: int) -> Indices:
    """Make indices (k, n) strictly increasing, keeping the first of equal ones."""
    with_gaps = (np.diff(index, axis=0) > 0).all(0)
    return index if with_gaps.all() else np.where(with_gaps, index, reference(len(index), last)[:, None])
