"""Measures of the drive of a guide: rotation, uniformity, mechanical advantage, positions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from ..kinematics.batch import Rows, put
from ..kinematics.linkage import RP, RR, Linkage
from ..kinematics.motion import Pose
from ..kinematics.types import Complexes, Floats, Integers, Scalar
from .coupler_curve import CouplerCurve
from .inverse import of_machine
from .metrics import Measures
from .minimum_zone import Grid, grid, largest, times
from .slides import slide_ends, slide_runs
from .trace import Traced

if TYPE_CHECKING:
    from .circuit_curve import CircuitCurve


class DriveGrid(NamedTuple):
    """Grid on which a motion is evaluated and differentiated."""

    nodes: int = 32  #: intervals between the Chebyshev points of the stroke
    most: int = 256  #: largest number of intervals, used near a dead point
    missed: float = 1e-4  #: relative error of a crank speed above which the grid is refined


DRIVE_GRID = DriveGrid()


@dataclass(frozen=True)
class DriveMetrics(Rows):
    """Measures of the drive of n guides over their strokes.

    For a returning point the stroke runs from its end to the point of rest and back.

    Attributes
    ----------
    driver : ndarray of int, shape (n,)
        Number of the driving crank, to which `Measures.min_transmission` refers; 0 if there is
        none.
    drive_angle : ndarray, shape (n,)
        Rotation of the driver over the stroke [deg]; NaN without a crank, and where it reverses.
    time_ratio : ndarray, shape (n,)
        Remaining part of the turn over `drive_angle`, for a driver that turns fully; NaN otherwise.
    uniformity : ndarray, shape (n,)
        Least over largest speed of the guided point along the path at a steady drive, 0 ... 1.  0
        for a returning point, which rests on the way.
    advantage : ndarray, shape (n,)
        Least mechanical advantage over the stroke: force of the point along its path over force at
        the driving crank pin, without friction.  It is unbounded where a point rests; for a
        returning point it is the least on the way there and back.
    rotation : ndarray, shape (n,)
        Range of the coupler's angles over the stroke [deg].
    """

    driver: Integers
    drive_angle: Floats
    time_ratio: Floats
    uniformity: Floats
    advantage: Floats
    rotation: Floats


def drive_metrics(
    guides: CouplerCurve | CircuitCurve,
    traced: Traced,
    measures: Measures,
    *,
    inverse: bool = False,
    nodes: int = DRIVE_GRID.nodes,
) -> DriveMetrics:
    """Measure how traced guides, with unchanged points, are driven over the stroke.

    Parameters
    ----------
    guides : CouplerCurve or CircuitCurve of n
    traced : Traced of n
        Windows of the stroke.
    measures : Measures of n
        Measures of the guides; only the driving crank is used.
    inverse : bool
        The guides are inversions of linkages with a slot, as in
        `catalogue.guidance.metrics.measure`; the measures are those of the linkages.
    nodes : int
        Intervals between the positions of the first grid.
    """
    moves = SampledPoses.of(guides, traced, nodes, inverse=inverse)
    driver, turns = measures.driver, measures.rotates
    z = guides.linkage.points
    of_driver = np.arange(len(guides)), np.maximum(driver - 1, 0)
    crank, lever, radius = (
        np.where(driver > 0, values[..., *of_driver], np.nan)
        for values in (moves.crank, moves.lever, np.abs(z[..., 1] - z[..., 0]))
    )
    with np.errstate(all="ignore"):
        steady = (lever > 0).all(0) | (lever < 0).all(0)
        angle = np.where(steady, np.degrees(np.abs(crank[-1] - crank[0])), np.nan)
        full = (turns & driver) > 0  # bit values 1 and 2 are the numbers of the cranks
        least, most = np.abs(lever).min(0), np.abs(lever).max(0)
        found = DriveMetrics(
            driver,
            angle,
            np.where(full, (360 - angle) / angle, np.nan),
            np.where(steady, np.where(guides.cusp, 0.0, least / most), np.nan),
            np.where(steady, radius * least, np.nan),
            np.degrees(largest(moves.turn) + largest(-moves.turn)),
        )
    rough = np.flatnonzero((driver > 0) & (moves.missed[of_driver] > DRIVE_GRID.missed))
    if nodes >= DRIVE_GRID.most or not len(rough):
        return found
    finer = drive_metrics(guides[rough], traced[rough], measures[rough], inverse=inverse, nodes=2 * nodes)
    return put(found, rough, finer)


@dataclass(frozen=True)
class SampledPoses:
    """Positions of n guides over the stroke, at the f fine points of a grid; evaluated on demand.

    For linkages with a slot all parts but the guided point, which moves in their inversions, are in
    the plane of their frame in the reference position.
    """

    linkage: Linkage
    pose: Pose  #: poses of the coupler at the m nodes, entries (m, n)
    path: Complexes  #: guided points at the nodes, (m, n)
    ends: Complexes | None  #: ends of the slot that the coupler carries, at the nodes, (m, n, 2)

    @classmethod
    def of(
        cls,
        guides: CouplerCurve | CircuitCurve,
        traced: Traced,
        nodes: int = DRIVE_GRID.nodes,
        *,
        inverse: bool = False,
    ) -> SampledPoses:
        """Sample the positions of traced guides.

        `inverse`: the guides are inversions of linkages with a slot; the positions are those of the
        linkages.
        """
        linkage = guides.linkage
        with np.errstate(all="ignore"):
            pose = guides.motion.pose(traced.parameters(grid(nodes).nodes))
            path = pose.point(guides.point + traced.shift)
            if not inverse:
                return cls(linkage, pose, path, None)
            linkage, pose = of_machine(linkage, pose)
            ends = np.stack([pose.point(end) for end in (path[0], path[-1])], axis=-1)
        return cls(linkage, pose, path, ends)

    @property
    def point(self) -> Complexes:
        """The guided point, shape (f, n)."""
        return self._interpolate(self.path)

    @property
    def slot(self) -> Complexes | None:
        """Both ends of the slot, shape (f, n, 2), None without one."""
        return None if self.ends is None else self._interpolate(self.ends)

    @cached_property
    def pins(self) -> Complexes:
        """Moving pivots, shape (f, n, 2).

        A pivot at infinity is replaced by the point of its slide nearest to the fixed pivot.
        """
        return self._interpolate(np.where(self.linkage.finite[:, :, 1], self._moved, self._fixed))

    @cached_property
    def slides(self) -> Complexes:
        """Ends of rails and slots by dyad, shape (f, n, 2, 2); NaN for cranks."""
        ends = slide_ends(self.linkage, slide_runs(self.linkage, self.pose))
        moved = np.stack([self._interpolate(self.pose.point(z)) for z in ends.reshape(-1, 4).T], axis=-1)
        slot = (self.linkage.dyads == RP)[..., None]
        return np.where(slot, moved.reshape(-1, *ends.shape), ends)

    @cached_property
    def turn(self) -> Floats:
        """Angle of the coupler, shape (f, n) [rad], 0 in the reference position."""
        return self._interpolate(np.unwrap(np.angle(1 + self.pose.x), axis=0))

    @cached_property
    def crank(self) -> Floats:
        """Angles of the cranks, shape (f, n, 2) [rad], NaN for sliders and slides."""
        return self._interpolate(self._crank)

    @cached_property
    def lever(self) -> Floats:
        """Rotation of the cranks per length of path, shape (f, n, 2) [rad/length].

        It is infinite at rest: a quotient of two polynomials, with a pole where the point is at
        rest.
        """
        with np.errstate(all="ignore"):
            speed = np.abs(self._interpolate(times(differentiation(len(self.path) - 1), self.path)))
            return np.asarray(self._interpolate(self._turning) / speed[..., None])

    @cached_property
    def missed(self) -> Floats:
        """Relative error of crank speeds, from the last two Chebyshev coefficients, (n, 2)."""
        with np.errstate(all="ignore"):
            last = np.abs(times(self._grid.coefficients[-2:], self._crank)).sum(0)
            return np.asarray((len(self.path) - 1) ** 2 * last / np.abs(self._turning).max(0))

    @property
    def unresolved(self) -> Floats:
        """Error of the positions, from the last two Chebyshev coefficients, shape (n,) [length]."""
        last = self._grid.coefficients[-2:]
        moved = np.where(self.linkage.finite[:, :, 1], self._moved, 0.0)
        with np.errstate(all="ignore"):
            values = (self.path[..., None], moved, slide_runs(self.linkage, self.pose))
            missed = [np.abs(times(last, np.nan_to_num(value))).sum(0).max(-1) for value in values]
        return np.asarray(np.max(missed, axis=0))

    @property
    def _grid(self) -> Grid:
        return grid(len(self.path) - 1)

    def _interpolate(self, values: npt.NDArray[Scalar]) -> npt.NDArray[Scalar]:
        return times(self._grid.fine, values)

    @property
    def _fixed(self) -> Complexes:
        return self.linkage.points[:, :, 0]

    @cached_property
    def _moved(self) -> Complexes:
        """Moving pivots at the nodes, shape (m, n, 2)."""
        with np.errstate(all="ignore"):
            return np.stack([self.pose.point(self.linkage.points[:, i, 1]) for i in (0, 1)], axis=-1)

    @cached_property
    def _crank(self) -> Floats:
        spoke = np.where(self.linkage.dyads == RR, self._moved - self._fixed, np.nan)
        return np.unwrap(np.angle(spoke), axis=0)

    @cached_property
    def _turning(self) -> Floats:
        """Speeds of the cranks at the nodes."""
        return times(differentiation(len(self.path) - 1), self._crank)


@lru_cache
def differentiation(count: int) -> Floats:
    """Return the differentiation matrix (m, m) of a grid, by the parameter in [-1, 1]."""
    points = grid(count)
    chebyshev = np.polynomial.chebyshev
    # coefficients of the derivative, one fewer, evaluated at the nodes
    return np.asarray(chebyshev.chebval(points.nodes, chebyshev.chebder(points.coefficients)).T)
