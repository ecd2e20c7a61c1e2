"""Cells of coupler curves: pieces on which windows begin, with lower bounds of deviations.

A coupler curve is cut into pieces of about equal length. The stroke of a window is at most the sum
of the chords of its pieces. So all windows that begin on one piece contain the path from the next
cut up to the last cut within a stroke of chords: their common core. The strip of a window is at
least as wide as that of points of its core, and half that width is at least their root mean square
distance from their best line. No window is therefore straighter than the bound of its cell, and
only cells whose bounds are below the best known deviation have to be searched. The bound is strict
unless a path turns by more than a right angle on one piece at an end of a window; for circles it
holds to first order.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..kinematics.batch import Columns, Rows, join
from ..kinematics.circuits import OPEN, Carriers
from ..kinematics.handedness import followed
from ..kinematics.types import Array, Complexes, Floats, Indices, Mask


class CellOptions(NamedTuple):
    """Options of the pieces of coupler curves, and of the lower bounds of windows."""

    phases: int = 192  #: number of phases at which a coupler curve is sampled before it is cut
    #: Least number of pieces of a window: the bound of a smooth path grows like the fourth power of
    #: the stroke, and a core that is shorter by one piece loses a third of it.
    pieces: int = 10
    #: least number of pieces of a circuit: with fewer a corner may hide between two cuts
    fewest: int = 160
    most: int = 5120  #: largest number of pieces of a circuit: 1024 circuits of so many take 0.7 GB
    points: int = 9  #: number of sampled points of a core: nine follow the eight extremes of most paths
    #: Largest ratio of the stroke that falls to a core to the core's chord. Cells beyond it are
    #: excluded: their paths may run within 84 degrees of their middle direction, but are too curved
    #: to guide.
    nearly: float = 1.5
    #: Factor of the bound for circles, whose distances are linear in centre and radius only to
    #: first order.
    bent: float = 0.9
    #: Fraction of a step between points of a core by which it may run back, as its chord differs in
    #: direction from that of the window.
    slack: float = 0.25
    #: Error of the number of equal pieces in a stroke, which may be a whole number.
    rounding: float = 1e-9


CELL = CellOptions()


@dataclass(frozen=True)
class Cells(Rows):
    """Pieces of coupler curves on which windows of a stroke may begin; n, arrays of shape (n,).

    Attributes
    ----------
    circuit, number : ndarray of int
        Number of the circuit, and of the piece on it.
    piece, low, high : ndarray
        Length of the piece; phases of its start, and approximately of the end of a window from
        there [rad].
    stroke, least : ndarray
        Distance of the ends; lower bound of the deviations of all windows that begin on the piece
        [length].
    peak : ndarray of bool
        Whether that bound is less than on both neighbouring pieces.
    """

    circuit: Indices
    number: Indices
    piece: Floats
    low: Floats
    high: Floats
    stroke: Floats
    least: Floats
    peak: Mask


@dataclass(frozen=True)
class Curves(Columns):
    """Coupler curves of k circuits, tabulated by length.

    A left-handed circuit is followed in the sense of its mirror image, so that a circuit and its
    image have mirrored windows.

    Attributes
    ----------
    number : ndarray of int, shape (k,)
        Numbers of the circuits.
    offset, sense : ndarray, shape (k,)
        The curve at phase s is the circuit at phase offset + sense * s, with sense 1 or -1 [rad].
    s, run : ndarray, shape (phases + 1, k)
        Phases [rad], and the fractions of the length up to them.
    length, across : ndarray, shape (k,)
        Lengths and diameters of the curves [length].
    """

    circuits: Carriers
    point: Complexes
    number: Indices
    offset: Floats
    sense: Floats
    s: Floats
    run: Floats
    length: Floats
    across: Floats

    def __len__(self) -> int:
        return len(self.point)

    @classmethod
    def of(cls, circuits: Carriers, point: Complexes, number: Indices) -> Curves:
        share = np.linspace(0, 1, CELL.phases + 1)[:, None]
        s = share * circuits.period
        offset, sense = followed(circuits, point)
        for last in (False, True):
            with np.errstate(all="ignore"):
                z = circuits.pose(offset + sense * s).point(point)
                run = np.cumsum(np.nan_to_num(np.abs(np.diff(z, axis=0, prepend=z[:1]))), axis=0)
                across = np.fmax.reduce(np.abs(z[:, None] - z[::16]), axis=(0, 1))
            length = run[-1]
            # a small share of the phase keeps the table rising where the point is at rest
            run = run / np.where(length > 0, length, 1) + 0.02 * share
            run /= run[-1]
            if not last:
                s = _interpolated(share, run, s)
        return cls(circuits, point, number, offset, sense, s, run, length, across)

    @property
    def shortest(self) -> Floats:
        """Shortest strokes to search for, shape (k,) [length]."""
        return np.asarray(CELL.pieces / CELL.most * self.length)

    def at(self, s: Floats) -> Complexes:
        """Compute the points at phases (m, k)."""
        return np.asarray(self.circuits.pose(self.phase(s)).point(self.point))

    def phase(self, s: Floats) -> Floats:
        """Return the phases of the circuits at phases (..., k) of the curves."""
        return np.asarray(self.offset + self.sense * s)

    def cut(self, pieces: int) -> tuple[Floats, Complexes]:
        """Cut the curves into pieces of about equal length: phases (pieces + 1, k), and points."""
        s = _interpolated(np.linspace(0, 1, pieces + 1)[:, None], self.run, self.s)
        with np.errstate(all="ignore"):
            return s, self.at(s)


def _interpolated(x: Floats, table: Floats, values: Floats) -> Floats:
    """Interpolate values at x (p, 1 or k) in tables (m, k) from 0 to 1."""
    apart = 2 * np.arange(table.shape[1])
    inside = np.interp((x + apart).T.ravel(), (table + apart).T.ravel(), values.T.ravel())
    return np.asarray(inside).reshape(len(apart), -1).T


def cells_of(curves: Curves, stroke: Floats, which: Indices, circle: bool, radius: float | None) -> Cells:
    """Return the cells of some curves, numbers `which` (m,), for windows of strokes (m,).

    Parameters
    ----------
    circle : bool
        Bound the deviations from circles, of the `radius` that is given [length] or of any.
    """
    with np.errstate(all="ignore"):
        many = np.nan_to_num(CELL.pieces * curves.length[which] / stroke, nan=CELL.fewest)
    double = np.ceil(np.log2(np.clip(many, CELL.fewest, CELL.most) / CELL.fewest)).astype(int)
    parts = []
    for k in np.unique(double):
        some = np.flatnonzero(double == k)
        parts.append(_cells(curves[which[some]], which[some], stroke[some], CELL.fewest * 2**k, circle, radius))
    return join(*parts) if parts else _cells(curves[which], which, stroke, CELL.fewest, circle, radius)


def _cells(curves: Curves, which: Indices, stroke: Floats, pieces: int, circle: bool, radius: float | None) -> Cells:
    """Return the cells of curves cut into a given number of pieces."""
    s, z = curves.cut(pieces)
    turns, number = curves.circuits.kind != OPEN, np.arange(pieces)[:, None]
    arc = stroke
    if radius is not None:
        arc = 2 * radius * np.arcsin(np.minimum(0.5 * stroke / radius, 1.0))
    with np.errstate(all="ignore"):
        run = np.pad(np.cumsum(np.nan_to_num(np.abs(np.diff(z, axis=0))), axis=0), ((1, 0), (0, 0)))
        ends = run[:-1] + arc
        total = np.where(run[-1] > 0, run[-1], 1.0)
        lap = (turns & (ends > run[-1])).astype(int)
        # the chords of a window are a little shorter than its path
        beyond = ~turns & (run[:-1] + stroke > run[-1] * (1 + 1 / pieces))
        share = np.clip(np.nan_to_num(ends / total - lap), 0, 1)
        cuts = np.broadcast_to(np.arange(pieces + 1.0)[:, None], run.shape)
        last = np.floor(_interpolated(share, run / total, cuts) + CELL.rounding).astype(int)
        width = np.nan_to_num(arc / curves.length * pieces, posinf=2.0 * pieces)
    # no more pieces than for equal ones, so that bounds do not change with the rounding of cores
    held = np.minimum(last + pieces * lap - number, np.floor(width + CELL.rounding).astype(int))
    whole = np.clip(held, 2, pieces)
    steps = np.rint(np.linspace(0, 1, CELL.points)[:, None, None] * (whole - 1)).astype(int)
    index = 1 + number + steps
    end = number + whole
    index = np.where(turns & (index > pieces), index - pieces, np.minimum(index, pieces))
    w = z[index, np.arange(len(which))]  # (points, pieces, k)
    with np.errstate(all="ignore"):
        far = np.abs(w[-1] - w[0])
        has = (stroke / arc) * np.minimum(arc, np.mod(run[index[-1], np.arange(len(which))] - run[1:], total))
        good = (width >= CELL.points) & ~beyond & (far * CELL.nearly > has)
        least = np.where(
            good, np.nan_to_num(_mean_square_distance(w, circle, radius), nan=np.inf, posinf=np.inf), np.inf
        )
        least = np.where(good & (held < 2), 0.0, least)  # a core of a single cut gives no bound
        longer = np.clip(has / far, 1.0, CELL.nearly)
    column = np.arange(len(which))
    at = np.where(turns & (end > pieces), end - pieces, np.minimum(end, pieces))
    low, high = s[:-1], s[at, column] + np.where(end > pieces, curves.circuits.period, 0.0) * turns
    high = low + longer * (high - low)
    n = len(which)
    peak = (least <= np.roll(least, 1, 0)) & (least < np.roll(least, -1, 0)) & np.isfinite(least)

    def flat(values: Array) -> Array:
        return np.broadcast_to(values, (pieces, n)).T.ravel()

    piece = flat(s[1:] - low)
    return Cells(flat(which), flat(number), piece, flat(low), flat(high), flat(stroke), flat(least), flat(peak))


def _mean_square_distance(w: Complexes, circle: bool, radius: float | None) -> Floats:
    """Compute mean square distances of points from best lines or circles, (m, k).

    They are infinite where the points do not run forward.
    """
    seen, half = from_chord(w)
    u, v = seen.real, seen.imag
    back = -CELL.slack * np.abs(np.diff(seen, axis=0))
    forward = (np.diff(u, axis=0) >= back).all(0)
    if not circle:
        u, v = u - u.mean(0), v - v.mean(0)
        whole, long = (v * v).sum(0), (u * u).sum(0)
        rest = np.maximum(whole - (u * v).sum(0) ** 2 / long, 0.0)
        # distances across the line are less than across the chord
        return np.where(forward, half * np.sqrt(rest / CELL.points * long / (long + whole)), np.inf)
    k = bent(v[CELL.points // 2], half, radius)
    v = v + k / (1 + np.sqrt(np.maximum(1 - k * k, 0.0)))
    v = (2 * v - k * (u * u + v * v)) / (1 + np.sqrt((k * u) ** 2 + (1 - k * v) ** 2))
    # a move of a circle changes distances by sine and cosine of the angle about its centre, a
    # change of radius by 1
    cosine = np.sqrt(np.maximum(1 - (k * u) ** 2, 0.0))
    moves = [u, cosine] if radius is not None else [np.ones_like(u), u, u * u / (1 + cosine)]
    for n, move in enumerate(moves):
        for before in moves[:n]:
            move = move - before * (before * move).sum(0) / (before * before).sum(0)
        moves[n] = move
        v = v - move * (move * v).sum(0) / (move * move).sum(0)
    error = CELL.bent * np.sqrt((v * v).mean(0))
    return np.where(forward, half * error, np.inf)


def bent(sagitta: Floats, half: Floats, radius: float | None) -> Floats:
    """Compute curvatures of circles through ends and middle of paths, positive to the left.

    Lengths are in units of half the chord.  With a `radius` the circles have this radius, and only
    the side is computed.
    """
    bend = -2 * sagitta / (sagitta**2 + 1)
    return bend if radius is None else np.copysign(half / radius, bend)


def from_chord(w: Complexes) -> tuple[Complexes, Floats]:
    """Normalise points (p, ...) to ends at -1 and 1.

    Return them, and half the distance of their ends.
    """
    half = 0.5 * (w[-1] - w[0])
    return (w - 0.5 * (w[0] + w[-1])) * (1 / half), np.abs(half)
