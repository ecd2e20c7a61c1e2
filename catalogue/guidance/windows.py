"""Windows of coupler curves: where they are sought, measured, and moved to where their paths are straightest.

A coupler curve is cut into pieces of equal length.  A window of as many pieces as the stroke needs is moved along it,
and what nine of its points are off the best line or circle, in the mean square, says where the path is straight.  From
the best of these places the window is moved on, by ever shorter ways, until its deviation, now that of `minimum_zone`,
is least.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..kinematics.batch import Columns, Rows, join
from ..kinematics.circuits import OPEN, Circuits
from ..kinematics.types import Complexes, Floats, Indices, Mask
from .circuit_curve import runs_forward
from .minimum_zone import alternating, grid, reference

#: Phases at which a coupler curve is read to be cut.
PHASES = 192
#: Pieces of a window at least; of a circuit, at least and at most.
PIECES, FEWEST, MOST = 10, 160, 5120
#: Points of a window that are looked at.
POINTS = 9
#: Windows are looked at whose ends are that many times as far apart as asked, or that many times nearer.
NEARLY = 1.5
#: A path that is as good as it can be reaches about so many times its mean error.
PEAK = 1.4
#: In a thorough and a quick search: where windows are tried about the best place, what the way to the farthest becomes
#: in the next round, and how many rounds.
THOROUGH = (np.array([0, -1, 1, -2, 2, -3, 3, -4, 4, -5, 5, -6, 6]) / 6, 1 / 6, 5)
QUICK = (np.array([0, -1, 1]) / 2, 1 / 2, 9)
#: The same while a stroke is corrected.
CORRECTING = (np.array([0, -1, 1, -2, 2, -3, 3]) / 3, 1 / 3, 1)
#: What that way becomes, while a stroke is sought, where the best is the farthest.
FARTHER = 2.0
#: Windows about each of the first ones, and how many of them are followed, in either; and how far to either side they
#: are, of a window.
ABOUT, WIDE = ((13, 2), (7, 1)), 1 / 6
#: Secant steps to the end of a window, how near its stroke is to be then, and how near it is near enough.
STEPS, CLOSE, NEGLIGIBLE = 5, 1e-5, 1e-7
#: Intervals between the Chebyshev points of a window, on the way and in the end.
NODES, FINER = 16, 32
#: How far inside its ends, of half a window, a path is looked at for whether it turns back there.
EDGE = 1e-5
#: Strokes tried for a deviation that is given, of the largest distance on the curve; widest arc, chord over radius.
LADDER = 0.95 * 0.8 ** np.arange(24)
#: Windows of few curves are sought for several strokes at once, so many in all.
TOGETHER = 12
FULLEST = 1.95

#: Points of paths (m, n) at phases (m, n), or (n,).
Path = Callable[[Floats], Complexes]


@dataclass(frozen=True)
class Stretches(Rows):
    """n windows of circuits; arrays of shape (n,).

    Attributes
    ----------
    circuit : ndarray of int
        Which of the circuits.
    low, high : ndarray
        Phases of the ends [rad].
    stroke, deviation : ndarray
        Distance of the ends; half the width of the narrowest strip or annulus, or the largest distance from the
        best-placed arc of the radius that is given; NaN where the path turns back on the way [length].
    extremes : ndarray of int
        About where it is farthest from the line or circle, to either side in turn, of the fine points of the finer
        grid, (n, 3 or 4).
    """

    circuit: Indices
    low: Floats
    high: Floats
    stroke: Floats
    deviation: Floats
    extremes: Indices

    @classmethod
    def none(cls) -> Stretches:
        """Return no window."""
        nothing, whole = np.zeros(0), np.zeros(0, int)
        return cls(whole, nothing, nothing, nothing, nothing, np.zeros((0, 3), int))


@dataclass(frozen=True)
class Curves(Columns):
    """Coupler curves of k circuits, cut: phases s and the parts of their lengths up to there, (PHASES + 1, k); their
    lengths and the largest distances on them, (k,); `number` says which circuits they are."""

    circuits: Circuits
    point: Complexes
    number: Indices
    s: Floats
    run: Floats
    length: Floats
    across: Floats

    def __len__(self) -> int:
        return len(self.point)

    @classmethod
    def of(cls, circuits: Circuits, point: Complexes, number: Indices) -> Curves:
        share = np.linspace(0, 1, PHASES + 1)[:, None]
        s = share * circuits.period
        for last in (False, True):
            with np.errstate(all="ignore"):
                z = circuits.pose(s).point(point)
                run = np.cumsum(np.nan_to_num(np.abs(np.diff(z, axis=0, prepend=z[:1]))), axis=0)
                across = np.fmax.reduce(np.abs(z[:, None] - z[::16]), axis=(0, 1))
            length = run[-1]
            # a little of the phase itself, so that a point at rest moves on
            run = run / np.where(length > 0, length, 1) + 0.02 * share
            run /= run[-1]
            if not last:
                s = _interpolated(share, run, s)
        return cls(circuits, point, number, s, run, length, across)

    @property
    def shortest(self) -> Floats:
        """Shortest strokes that are looked for, shape (k,) [length]."""
        return np.asarray(PIECES / MOST * self.length)

    def cut(self, pieces: int) -> tuple[Floats, Complexes]:
        """Return the phases (pieces + 1, k) that cut the curves into pieces about equally long, and the points."""
        s = _interpolated(np.linspace(0, 1, pieces + 1)[:, None], self.run, self.s)
        with np.errstate(all="ignore"):
            return s, self.circuits.pose(s).point(self.point)


def _interpolated(x: Floats, table: Floats, values: Floats) -> Floats:
    """Return values (m, k) at x (p, 1), from 0 to 1, in tables (m, k) of which each begins with 0 and ends with 1."""
    apart = 2 * np.arange(table.shape[1])
    return np.interp((x + apart).T.ravel(), (table + apart).T.ravel(), values.T.ravel()).reshape(len(apart), -1).T


@dataclass(frozen=True)
class Search:
    """The windows of some coupler curves; circuits are numbered within them, but for what `numbered` returns."""

    curves: Curves
    circle: bool
    radius: float | None
    quick: bool

    def places(self, stroke: Floats, count: int, which: Indices | None = None) -> Stretches:
        """Return the windows of curves in which nine points show the path straightest, at most `count` of each."""
        which = np.arange(len(self.curves)) if which is None else which
        with np.errstate(all="ignore"):
            many = np.nan_to_num(PIECES * self.curves.length[which] / stroke, nan=FEWEST)
        double = np.ceil(np.log2(np.clip(many, FEWEST, MOST) / FEWEST)).astype(int)
        parts = []
        for k in np.unique(double):
            some = np.flatnonzero(double == k)
            parts.append(self._places(which[some], stroke[some], FEWEST * 2**k, count))
        return join(*parts)

    def _places(self, which: Indices, stroke: Floats, pieces: int, count: int) -> Stretches:
        curves = self.curves[which]
        s, z = curves.cut(pieces)
        turns = curves.circuits.kind != OPEN
        arc = stroke
        if self.radius is not None:
            arc = 2 * self.radius * np.arcsin(np.minimum(0.5 * stroke / self.radius, 1.0))
        with np.errstate(all="ignore"):
            width = np.nan_to_num(arc / curves.length * pieces, posinf=2.0 * pieces)
        steps = np.rint(np.linspace(0, 1, POINTS)[:, None] * np.minimum(width, 2.0 * pieces)).astype(int)
        fits = (steps[-1] < pieces) & (steps[1] > 0)
        index = np.arange(pieces)[:, None] + np.where(fits, steps, np.arange(POINTS)[:, None])[:, None]
        beyond = ~turns & (index[-1] > pieces)
        index = np.where(turns & (index >= pieces), index - pieces, np.minimum(index, pieces))
        w = z[index, np.arange(len(which))]  # (POINTS, pieces, k)
        with np.errstate(all="ignore"):
            ratio = np.abs(w[-1] - w[0]) / stroke
            good = fits & ~beyond & (ratio > 1 / NEARLY) & (ratio < NEARLY)
            off = np.where(good, np.nan_to_num(self._off(w), nan=np.inf, posinf=np.inf), np.inf)
        peak = (off <= np.roll(off, 1, 0)) & (off < np.roll(off, -1, 0)) & np.isfinite(off)
        at, column = np.nonzero(peak)
        order = np.lexsort((off[at, column], column))
        order = order[np.arange(len(order)) - np.searchsorted(column[order], column[order]) < count]
        at, column = at[order], column[order]
        low, high = s[at, column], s[index[-1, at, column], column]
        high = np.where(high > low, high, high + curves.circuits.period[column])
        extremes = reference(4 if self.circle and self.radius is None else 3, 4 * FINER)
        extremes = np.broadcast_to(extremes, (len(column), len(extremes)))
        return Stretches(which[column], low, high, stroke[column], PEAK * off[at, column], extremes)

    def _off(self, w: Complexes) -> Floats:
        """Return what points w (POINTS, m, k), in their order, are off the best line or circle, in the mean square,
        (m, k); infinite where they do not run forward."""
        seen, half = _seen(w)
        u, v = seen.real, seen.imag
        basis = np.polynomial.legendre.legvander(np.linspace(-1, 1, POINTS), 1)
        if self.circle:
            k = self._bend(v[POINTS // 2], half)
            v = v + k / (1 + np.sqrt(np.maximum(1 - k * k, 0.0)))
            v = (2 * v - k * (u * u + v * v)) / (1 + np.sqrt((k * u) ** 2 + (1 - k * v) ** 2))
            if self.radius is None:
                basis = np.polynomial.legendre.legvander(np.linspace(-1, 1, POINTS), 2)
        rest = np.eye(POINTS) - basis @ np.linalg.pinv(basis)
        error = np.tensordot(rest, v, 1)
        return np.where((np.diff(u, axis=0) > 0).all(0), half * np.sqrt((error**2).mean(0)), np.inf)

    def _bend(self, sagitta: Floats, half: Floats) -> Floats:
        """Return curvatures of circles through the ends and the middle of a path, or with the radius that is given and
        on that side, positive to the left [1/half the chord]."""
        bend = -2 * sagitta / (sagitta**2 + 1)
        return bend if self.radius is None else np.copysign(half / self.radius, bend)

    def measured(self, at: Stretches, nodes: int = NODES) -> Stretches:
        """Return windows, from where they begin and about how long they are, over exactly their strokes; pushed back
        from the ends of open circuits."""
        path, open_ = self._path(at), self._open(at)
        with np.errstate(all="ignore"):
            # a circuit from infinity to infinity has two ends, at which windows stop
            low = np.where(open_, np.maximum(at.low, 0.0), at.low)
            high = _far_end(path, low, at.high + low - at.low, at.stroke)
            beyond = open_ & (high > 2 * np.pi)
            if beyond.any():
                low = np.where(beyond, _far_end(path, np.where(beyond, 2 * np.pi, high), low, at.stroke), low)
                high = np.where(beyond, 2 * np.pi, high)
            found = self.between(replace(at, low=low, high=high), nodes, path)
            close = np.abs(found.stroke - at.stroke) <= CLOSE * at.stroke
            return replace(found, stroke=at.stroke, deviation=np.where(close, found.deviation, np.nan))

    def between(self, at: Stretches, nodes: int = NODES, path: Path | None = None) -> Stretches:
        """Return windows between their ends, whatever their strokes; on their paths, where these are there."""
        path, open_ = path or self._path(at), self._open(at)
        low, high = at.low, at.high
        with np.errstate(all="ignore"):
            points = grid(nodes)
            share = np.concatenate([[EDGE - 1], points.nodes, [1 - EDGE]])
            z = path(0.5 * (low + high) + 0.5 * (high - low) * share[:, None])
            seen, half = _seen(z[1:-1])
            # between its last points, too
            onward = (((z[[0, -2]] - z[[1, -1]]) * (z[-2] - z[1]).conj()).real > 0).all(0)
            held = self._bend(seen[nodes // 2].imag, half) if self.radius is not None else None
            forward = runs_forward(seen) & onward & (low < high) & ~(open_ & ((low < 0) | (high > 2 * np.pi)))
            per, v = FINER // nodes, np.where(forward, seen.imag, np.nan)
            fit, index = alternating(seen.real, v, self.circle, points, held, _apart(at.extremes.T // per, 4 * nodes))
            return replace(at, stroke=2 * half, deviation=half * fit.deviation, extremes=per * index.T)

    def _path(self, at: Stretches) -> Path:
        """Return the paths of windows by their phases."""
        some, z = self.curves.circuits[at.circuit], self.curves.point[at.circuit]
        return lambda s: np.asarray(some.pose(s).point(z))

    def _open(self, at: Stretches) -> Mask:
        """Return which windows are of open circuits."""
        return np.asarray(self.curves.circuits.kind[at.circuit] == OPEN)

    def about(self, at: Stretches) -> tuple[Stretches, Floats]:
        """Return of windows, and others about each of them, those that are straighter than their neighbours, and how
        near the next ones were [rad]."""
        count, kept = ABOUT[self.quick]
        by = WIDE * (at.high - at.low)
        tried, off = self._tried(at, by, np.linspace(-1, 1, count))
        beside = np.pad(off, ((1, 1), (0, 0)), constant_values=np.inf)
        off = np.where((off <= beside[:-2]) & (off < beside[2:]), off, np.inf)
        order = np.argsort(off, axis=0, kind="stable")[:kept]
        good = np.isfinite(np.take_along_axis(off, order, 0)).T
        column = np.broadcast_to(np.arange(len(by)), order.shape).T[good]
        lost = np.setdiff1d(np.arange(len(by)), column)  # too long to be followed anywhere near
        found, near = join(tried[order.T[good] * len(by) + column], at[lost]), np.concatenate([column, lost])
        return found, (by * 2 / (count - 1))[near]

    def _tried(self, at: Stretches, by: Floats, way: Floats, nodes: int = NODES) -> tuple[Stretches, Floats]:
        """Return windows moved along their paths by parts `way` (m,) of ways (n,) [rad]; their deviations, (m, n)."""
        each = at[np.tile(np.arange(len(at.low)), len(way))]
        shift = (way[:, None] * by).ravel()
        tried = self.measured(replace(each, low=each.low + shift, high=each.high + shift), nodes)
        return tried, np.where(np.isnan(tried.deviation), np.inf, tried.deviation).reshape(len(way), -1)

    def moved(
        self, at: Stretches, by: Floats, rounds: int | None = None, nodes: int = NODES, *, correcting: bool = False
    ) -> tuple[Stretches, Floats]:
        """Return windows moved along their paths to where they are straightest, at first by ways up to `by` (n,) [rad],
        and the ways that would come next; `correcting` those whose strokes were changed."""
        n = len(at.low)
        way, shorter, all_rounds = CORRECTING if correcting else QUICK if self.quick else THOROUGH
        farther = FARTHER if correcting else 1.0
        for _ in range(all_rounds if rounds is None else rounds):
            if rounds is not None or correcting or nodes != NODES:
                tried, off = self._tried(at, by, way, nodes)
            else:  # the first is the window as it is, which was measured before
                tried, off = self._tried(at, by, way[1:], nodes)
                here = np.where(np.isnan(at.deviation), np.inf, at.deviation)
                tried, off = join(at, tried), np.concatenate([here[None], off])
            # the nearest of those alike: at the end of an open circuit windows that would pass it are one
            best = np.argmax(off <= off.min(0) * (1 + CLOSE), axis=0)
            at = tried[best * n + np.arange(n)]
            by = np.where(np.abs(way[best]) == 1, farther * by, by * shorter)
        return at, by

    def leading(self, at: Stretches, key: Floats, count: int) -> Indices:
        """Return of the windows of each linkage those with the least keys, at most `count`, NaN last."""
        of = self.curves.circuits.of[at.circuit]
        order = np.lexsort((key, of))
        rank = np.arange(len(of)) - np.searchsorted(of[order], of[order])
        return np.sort(order[rank < count])

    def longer(self, allowed: Floats, count: int) -> Stretches:
        """Return windows that are about as long as the deviations (k,) allow: of each circuit the longest that seems to
        hold, one step shorter and `count` - 1 longer, at least one."""
        across = self.curves.across
        if self.radius is not None:
            across = np.minimum(across, FULLEST * self.radius)
        parts, which, held, rung = [], np.flatnonzero(across > 0), np.zeros(len(across), int), 0
        while len(which) and rung < len(LADDER):
            shares = LADDER[rung : rung + max(TOGETHER // len(which), 1)]
            found = self.places(np.outer(shares, across[which]).ravel(), 2, np.tile(which, len(shares)))
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
        """Return windows with the numbers of their circuits among all."""
        return replace(at, circuit=self.curves.number[at.circuit])


def _far_end(path: Path, start: Floats, end: Floats, stroke: Floats) -> Floats:
    """Return where windows (n,) end that start at `start` and end near `end`, over exactly their strokes."""
    before = start + 0.99 * (end - start)
    first, *others = path(np.stack([start, before, end]))
    error, now = (np.abs(other - first) - stroke for other in others)
    for left in reversed(range(STEPS)):
        step = now * (end - before) / np.where(now == error, np.inf, now - error)
        most = 0.2 * np.abs(end - start)
        before, error, end = end, now, end - np.clip(step, -most, most)
        if not left or not (np.abs(now) > NEGLIGIBLE * stroke).any():
            break
        now = np.abs(path(end[None])[0] - first) - stroke
    return end


def _seen(w: Complexes) -> tuple[Complexes, Floats]:
    """Return points (p, ...), first to last, as they lie about the middle of their ends, these in -1 and 1; and half
    the distance of the ends."""
    half = 0.5 * (w[-1] - w[0])
    return (w - 0.5 * (w[0] + w[-1])) * (1 / half), np.abs(half)


def _apart(index: Indices, last: int) -> Indices:
    """Return indices (k, n) of which each is above the one before, where two are one those that are taken first."""
    with_gaps = (np.diff(index, axis=0) > 0).all(0)
    return index if with_gaps.all() else np.where(with_gaps, index, reference(len(index), last)[:, None])
