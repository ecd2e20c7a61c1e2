"""Poses of linkages with their guided points at stations along the nominal.

The nominal is an arc of given curvature, or a line, whose chord runs from 0 to 1.  At a station the
distance of the guided point from the nominal and the angle of the coupler are two unknowns; the
dyads are two equations for them, see `catalogue.guidance.sensitivity`.  Newton's method solves
these, starting from the last station, or from the pose before a small move of the pivots.

These poses are no verified motion: circuits, and places where the point turns back, are not
detected.  Results have to be measured.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ..kinematics.batch import Rows
from ..kinematics.linkage import Linkage
from ..kinematics.motion import Pose
from ..kinematics.types import Complexes, Floats, Mask
from .minimum_zone import grid
from .sensitivity import PoseJacobian, jacobian_at


class StationOptions(NamedTuple):
    """Options of Newton's method for poses at stations along the nominal."""

    #: First number of intervals between the stations: most deviations then have an error of a few
    #: per cent.
    intervals: int = 16
    #: Number of Newton steps to a station, and for all stations at once after a move; then as many
    #: for linkages that have not converged.
    steps: int = 3
    #: Largest last Newton step to a station that counts as reached [strokes, rad]: the error is
    #: about its square.
    reached: float = 1e-4
    close: float = 1e-5  #: largest last step with which no linkage needs further steps
    #: largest distance from the nominal at which a linkage still counts as guided along it
    #: [strokes]
    astray: float = 0.5
    sharpest: float = 0.5005  #: least radius of a nominal [strokes]: that of a half circle is 0.5
    bend_step: float = 1e-6  #: step of finite differences by the curvature [1/stroke]
    #: Term added to the diagonal of the fit: along a flat arc a change of radius hardly differs
    #: from a shift.
    regular: float = 1e-14


STATION = StationOptions()


def nominal(curvature: Floats, intervals: int = STATION.intervals) -> tuple[Complexes, Complexes]:
    """Return the stations along nominals of curvatures (n,), and unit tangents there.

    Parameters
    ----------
    curvature : ndarray, shape (n,)
        Negative for a centre below, 0 for a line [1/stroke].
    intervals : int
        Number of intervals between the stations, which are Chebyshev points.

    Returns
    -------
    place, tangent : complex ndarray, shape (m, n)
    """
    nodes, half = grid(intervals).nodes[:, None], np.arcsin(0.5 * curvature)
    turn = half * nodes
    bend = np.where(curvature == 0, 1.0, curvature)
    x = np.where(curvature == 0, 0.5 * nodes, np.sin(turn) / bend)
    y = -2 * np.sin(0.5 * (half + turn)) * np.sin(0.5 * (half - turn)) / bend
    return 0.5 + x + 1j * y, np.exp(1j * turn)


class _Dyads(NamedTuple):
    """Pivots of n linkages relative to their guided points, with masks of the finite ones."""

    fixed: Complexes  #: fixed pivots, (2, n)
    moving: Complexes  #: moving pivots, (2, n)
    has_fixed: Floats  #: 1 for a finite fixed pivot, else 0, (2, n)
    has_moving: Floats  #: 1 for a finite moving pivot, else 0, (2, n)

    @classmethod
    def of(cls, linkage: Linkage, point: Complexes) -> _Dyads:
        away = linkage.points - point[:, None, None]
        z = np.where(linkage.finite, away, linkage.points)
        finite = linkage.finite.astype(float)
        return cls(z[..., 0].T, z[..., 1].T, finite[..., 0].T, finite[..., 1].T)

    def twice(self) -> _Dyads:
        """Return the dyads of all linkages twice, one copy after the other."""
        return _Dyads(*(np.concatenate([part, part], axis=1) for part in self))

    def towards(
        self, base: Complexes, tangent: Complexes, error: Floats, angle: Floats, steps: int
    ) -> tuple[Floats, Floats, Floats]:
        """Take Newton steps from distances and angles to stations, `base` relative to the point.

        Returns
        -------
        error, angle, missed : ndarray
            Distances, angles and the largest change of either by the last step, in the shape of the
            stations.
        """
        across = 1j * tangent
        missed = np.full(error.shape, np.inf)
        for _ in range(steps):
            turn = np.exp(1j * angle)
            shift = base + across * error
            value, by_error, by_angle = [], [], []
            for a, b, w, v in zip(*self, strict=True):
                turned = w * turn * b
                ray = turned - v * a
                square = shift.real**2 + shift.imag**2
                value.append(0.5 * w * v * square + (ray.conj() * shift).real - (a.conj() * b * (turn - 1)).real)
                by_error.append(((w * v * shift + ray).conj() * across).real)
                swung = (1j * turned).conj() * shift - a.conj() * (1j * b * turn)
                by_angle.append(swung.real)
            determinant = by_error[0] * by_angle[1] - by_error[1] * by_angle[0]
            one = (value[0] * by_angle[1] - value[1] * by_angle[0]) / determinant
            two = (by_error[0] * value[1] - by_error[1] * value[0]) / determinant
            error, angle = error - one, angle - two
            missed = np.maximum(np.abs(one), np.abs(two))
        return error, angle, missed


@dataclass(frozen=True)
class Stationed(Rows):
    """n linkages in m poses each, with their guided points at stations along the nominals.

    Attributes
    ----------
    linkage : Linkage
        Linkages in the reference position, somewhere on the stroke.
    point : complex ndarray, shape (n,)
        Guided points there [strokes].
    curvature : ndarray, shape (n,)
        Curvatures of the nominals, not positive [1/stroke].
    error : ndarray, shape (n, m)
        Distances from the nominals, positive to the left [strokes].
    angle : ndarray, shape (n, m)
        Angles of the couplers [rad].
    reached : ndarray of bool, shape (n,)
        Whether the linkage has such a pose at every station.
    """

    linkage: Linkage
    point: Complexes
    curvature: Floats
    error: Floats
    angle: Floats
    reached: Mask

    def __len__(self) -> int:
        return len(self.point)

    @classmethod
    def followed(cls, linkage: Linkage, point: Complexes, curvature: Floats) -> Stationed:
        """Follow linkages from mid-stroke to all stations."""
        place, tangent = nominal(curvature)
        middle, nodes = STATION.intervals // 2, grid(STATION.intervals).nodes
        dyads = _Dyads.of(linkage, point)
        both = dyads.twice()
        error, angle = np.full(place.shape, np.nan), np.full(place.shape, np.nan)
        with np.errstate(all="ignore"):
            base = place - point
            first = -(base[middle] * (1j * tangent[middle]).conj()).real
            error[middle], angle[middle], _ = dyads.towards(
                base[middle], tangent[middle], first, np.zeros(len(point)), STATION.steps + 1
            )
            last = before = np.tile([error[middle], angle[middle]], 2)
            for k in range(1, middle + 1):
                at = [middle + k, middle - k]
                ratio = 0.0
                if k > 1:
                    steps = np.diff(nodes[middle + k - 2 : middle + k + 1])
                    ratio = float(steps[1] / steps[0])
                guess = last + ratio * (last - before)
                *reached, _ = both.towards(
                    base[at].reshape(-1), tangent[at].reshape(-1), guess[0], guess[1], STATION.steps
                )
                before, last = last, np.array(reached)
                error[at], angle[at] = last.reshape(2, 2, -1)
        return cls.settled(linkage, point, curvature, error.T, angle.T)

    @classmethod
    def settled(cls, linkage: Linkage, point: Complexes, curvature: Floats, error: Floats, angle: Floats) -> Stationed:
        """Solve for the poses at the stations, from near errors and angles (n, m)."""
        place, tangent = nominal(curvature, error.shape[1] - 1)
        dyads = _Dyads.of(linkage, point)
        with np.errstate(all="ignore"):
            base = place - point
            e, t, missed = dyads.towards(base, tangent, error.T, angle.T, STATION.steps)
            if not (missed.max(0) < STATION.close).all():
                e, t, missed = dyads.towards(base, tangent, e, t, STATION.steps)
            reached = (missed.max(0) < STATION.reached) & (np.abs(e).max(0) < STATION.astray)
        return cls(linkage, point, curvature, e.T, t.T, reached)

    def denser(self) -> Stationed:
        """Solve for the poses at twice as many stations."""
        between = _refinement_matrix(self.intervals)
        error, angle = self.error @ between.T, self.angle @ between.T
        return Stationed.settled(self.linkage, self.point, self.curvature, error, angle)

    @property
    def intervals(self) -> int:
        """Number of intervals between the stations."""
        return int(self.error.shape[1] - 1)

    @property
    def nominal(self) -> tuple[Complexes, Complexes]:
        """The stations, and unit vectors along the nominals there, shape (m, n) each."""
        return nominal(self.curvature, self.intervals)

    @property
    def deviation(self) -> Floats:
        """Largest distances from the nominals, shape (n,)."""
        return np.asarray(np.abs(self.error).max(1))

    @property
    def pose(self) -> Pose:
        """The poses at the stations."""
        place, tangent = self.nominal
        shift = place - self.point + 1j * tangent * self.error.T
        return Pose(shift, np.exp(1j * self.angle.T) - 1, self.point)

    @property
    def jacobian(self) -> PoseJacobian:
        """The derivatives of the poses by the pivots and the guided point."""
        return jacobian_at(self.linkage, self.point, self.pose, self.nominal[1])

    @property
    def by_curvature(self) -> Floats:
        """The derivatives of the distances by the curvatures, shape (n, m)."""
        (place, tangent), (after, _) = (
            nominal(self.curvature + step, self.intervals) for step in (0.0, STATION.bend_step)
        )
        return np.asarray(-((after - place) * (1j * tangent).conj()).real.T / STATION.bend_step)

    def laid(self, *, any_radius: bool) -> Stationed:
        """Move linkages by the similarities that fit their paths best to the nominals.

        The fit is by mean squares: for a line of the chord, for an arc of given radius of its
        place, for one of any radius of both and the radius. Linkages far from the nominal are left
        in place.
        """
        near = self.deviation < STATION.astray
        error = np.where(near[:, None], self.error, 0.0)
        if any_radius:
            factor, shift, bend, left = self._fit_free_arc(error)
        elif (self.curvature == 0).all():
            factor, shift, left = _fit_line(error)
            bend = self.curvature
        else:
            shift, left = self._fit_shift(error)
            factor, bend = np.ones(len(self), complex), self.curvature
        good = near & np.isfinite(factor) & np.isfinite(shift) & np.isfinite(bend)
        factor, shift = np.where(good, factor, 1.0), np.where(good, shift, 0.0)
        linkage = self.linkage.moved(factor, shift)
        bend = np.where(good, bend, self.curvature)
        left = np.where(good[:, None], left, self.error)
        return Stationed.settled(linkage, factor * self.point + shift, bend, left, self.angle)

    def _fit_shift(self, error: Floats) -> tuple[Complexes, Floats]:
        """Return the best shifts of arcs of given radii, and the remaining errors."""
        turn = np.angle(self.nominal[1]).T
        (up, back), left = _fit_columns(np.stack([np.cos(turn), np.sin(turn)], axis=2), error)
        return back - 1j * up, left

    def _fit_free_arc(self, error: Floats) -> tuple[Complexes, Complexes, Floats, Floats]:
        """Fit arcs of free radius: return factors and shifts, curvatures, and remaining errors."""
        place, tangent = self.nominal
        turn = np.angle(tangent).T
        columns = np.stack([np.cos(turn), np.sin(turn), np.ones(turn.shape)], axis=2)
        (up, back, out), left = _fit_columns(columns, error)
        with np.errstate(all="ignore"):
            radius = -1 / self.curvature
            centre = 0.5 - back + 1j * (up - np.sqrt(np.maximum(radius * radius - 0.25, 0.0)))
            ends = (place + 1j * tangent * error.T)[[0, -1]] - centre
            low, high = centre + (radius + out) * ends / np.abs(ends)
            factor = 1 / (high - low)
            size = np.abs(factor)
            bend = -1 / np.maximum((radius + out) * size, STATION.sharpest)
        return factor, -low * factor, bend, left * size[:, None]


def _fit_line(error: Floats) -> tuple[Complexes, Complexes, Floats]:
    """Return factors and shifts of paths near a line, and the remaining errors (n, m)."""
    nodes = grid(error.shape[1] - 1).nodes
    columns = np.broadcast_to(np.stack([np.ones_like(nodes), nodes], axis=1), (*error.shape, 2))
    (up, slope), left = _fit_columns(columns, error)
    middle = 0.5 * (left.max(1) + left.min(1))
    up, left = up + middle, left - middle[:, None]
    low, high = 1j * (up - slope), 1 + 1j * (up + slope)
    factor = 1 / (high - low)
    return factor, -low * factor, left


def _fit_columns(columns: Floats, error: Floats) -> tuple[Floats, Floats]:
    """Fit columns (n, m, k) to errors; return coefficients (k, n) and residuals."""
    across = np.swapaxes(columns, 1, 2)
    square = across @ columns
    diagonal = np.einsum("nii->ni", square)
    diagonal += STATION.regular * STATION.intervals
    found = np.linalg.solve(square, across @ error[..., None])
    return np.asarray(found[..., 0].T), np.asarray(error - (columns @ found)[..., 0])


@lru_cache
def _refinement_matrix(intervals: int) -> Floats:
    """Return the matrix that interpolates from Chebyshev points to twice as many."""
    angle = np.pi * (1 - np.arange(2 * intervals + 1) / (2 * intervals))
    waves = np.cos(angle[:, None] * np.arange(intervals + 1))
    return np.asarray(waves @ grid(intervals).coefficients)
