"""Dwell mechanisms in refinement: a driven linkage, a rod and a rocker that rests.

All pivots move, but the fixed pivot of the crank, and the crank keeps its length. The rocker's
angle is taken at Chebyshev points of the requested dwell, all else at even steps of the turn.
Derivatives are differences.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..candidates.feasibility import weight
from ..guidance.coupler_curve import coupler_curve
from ..guidance.dwell import joint_places, slides_over_turn
from ..guidance.metrics import min_transmission_turn
from ..guidance.minimum_zone import grid
from ..guidance.sensitivity import COUNT, displaced
from ..kinematics.batch import Rows, put
from ..kinematics.linkage import Linkage
from ..kinematics.motion import motion
from ..kinematics.plane_vectors import extreme_pairs
from ..kinematics.types import Complexes, Floats, Indices, Integers, Mask
from .model import Judged
from .quantities import Pieces
from .subproblem import Subproblem, at_peaks


class DwellOptions(NamedTuple):
    """Grids, units and steps of the refinement of dwells."""

    intervals: int = 32  #: number of intervals between the Chebyshev points of the dwell
    steps: int = 96  #: number of positions over the turn
    group: int = 4  #: number of successive positions of which the worst transmission is kept
    directions: int = 24  #: number of directions in which the size is measured
    unit: float = 0.3  #: least unit of the moves of a pivot [cranks]
    #: Number of coordinates: four of the other dyad's pivots, two each of the guided point and the
    #: joint, the distance of the rocker's pivot from the crank's, the angle of the crank.
    coordinates: int = 10
    step: float = 1e-6  #: step of finite differences [units]
    inside: float = 1e-3  #: part of a bound by which dwells stay inside it, as it is measured between the positions


DWELL = DwellOptions()
#: Right angle [rad].
RIGHT = 0.5 * np.pi


@dataclass(frozen=True, eq=False)
class DwellLinkages(Rows):
    """n dwell mechanisms in the middle of their dwells; arrays of shape (n,).

    Attributes
    ----------
    linkage : Linkage
    point, joint, pivot : complex ndarray
        Guided point, joint of rod and rocker, fixed pivot of the rocker.
    driver : ndarray of int
        Number of the driving crank, 1 or 2.
    """

    linkage: Linkage
    point: Complexes
    joint: Complexes
    pivot: Complexes
    driver: Integers

    def shape(self) -> Floats:
        """Return the distances of all pivots and joints, (n, d) [cranks].

        A pivot at infinity counts as a place one crank from the guided point.
        """
        n = len(self.point)
        z, finite = self.linkage.points.reshape(n, 4), self.linkage.finite.reshape(n, 4)
        z = np.where(finite, z, self.point[:, None] + self.crank[:, None] * z)
        z = np.concatenate([z, np.stack([self.point, self.joint, self.pivot], 1)], axis=1)
        one, other = np.triu_indices(z.shape[1], 1)
        return np.abs(z[:, one] - z[:, other]) / self.crank[:, None]

    @property
    def home(self) -> Complexes:
        """Fixed pivot of the crank, (n,)."""
        return np.asarray(self.linkage.points[np.arange(len(self.point)), self.driver - 1, 0])

    @property
    def pin(self) -> Complexes:
        """Moving pivot of the crank, (n,)."""
        return np.asarray(self.linkage.points[np.arange(len(self.point)), self.driver - 1, 1])

    @property
    def crank(self) -> Floats:
        """Length of the crank, (n,)."""
        return np.abs(self.pin - self.home)


@dataclass(frozen=True, eq=False)
class MeasuredDwells(Rows):
    """n dwell mechanisms with what is bounded and ranked; arrays of shape (n,).

    Attributes
    ----------
    dwell : DwellLinkages
    residual : ndarray
        Range of the rocker's angle over the requested dwell [rad]; NaN where the crank or the rod
        does not turn fully.
    swing : ndarray
        Range of the rocker's angle over the turn [rad].
    transmission : ndarray
        Minimum transmission angle over the turn, of linkage and rod [rad].
    size : ndarray
        Diameter of pivots and path [cranks].
    """

    dwell: DwellLinkages
    residual: Floats
    swing: Floats
    transmission: Floats
    size: Floats

    def __len__(self) -> int:
        return len(self.residual)

    def replaced(self, where: Indices, by: MeasuredDwells) -> MeasuredDwells:
        """Replace the rows `where` by those of `by`."""
        return put(self, where, by)


@dataclass(frozen=True, eq=False)
class Turned(Rows):
    """Values of n dwell mechanisms over the turn.

    Attributes
    ----------
    resting : ndarray, shape (n, m)
        Angle of the rocker at the Chebyshev points of the dwell [rad].
    swung : ndarray, shape (n, k)
        Angle of the rocker over the turn [rad].
    slanting : ndarray, shape (n, k + 1)
        Right angle less the transmission angle: of rod and rocker, and of the linkage [rad].
    places : complex ndarray, shape (n, q)
        Finite pivots, joints, ends of slides and the path over the turn.
    """

    resting: Floats
    swung: Floats
    slanting: Floats
    places: Complexes


@dataclass(frozen=True)
class DwellModel:
    """Dwell mechanisms as the optimiser sees them; the transmission angle is ranked.

    Attributes
    ----------
    angle, residual, swing : float
        Requested dwell: rotation of the crank, range of the rocker's angle there and over the turn
        [rad].
    size : float
        Largest size [cranks].
    """

    angle: float
    residual: float
    swing: float
    size: float = np.inf

    def judged(self, guides: MeasuredDwells) -> Judged:
        with np.errstate(all="ignore"):
            total = weight("deviation") * np.maximum(np.log(guides.residual / self.residual), 0.0)
            total += np.maximum(self.swing - guides.swing, 0.0) / RIGHT + np.maximum(guides.size / self.size - 1, 0.0)
        good = np.isfinite(guides.residual) & np.isfinite(guides.transmission)
        total = np.where(good & np.isfinite(total), total, np.inf)
        return Judged(np.where(good, -guides.transmission / RIGHT, np.inf), total, total <= 0)

    def refinable(self, guides: MeasuredDwells, met: Mask) -> Mask:  # noqa: ARG002  # of the protocol
        return np.isfinite(guides.residual)

    def deviation(self, guides: MeasuredDwells) -> Floats:
        return guides.residual / self.residual

    def charted(self, guides: MeasuredDwells) -> MeasuredDwells:
        return guides

    def moved(self, guides: MeasuredDwells, step: Floats) -> tuple[MeasuredDwells, Indices]:
        there, valid = _displaced(guides.dwell, step[:, : DWELL.coordinates] * _units(guides.dwell))
        found = self.measured(there)
        kept = np.isfinite(found.residual)
        return found[kept], np.flatnonzero(valid)[kept]

    def measured(self, dwell: DwellLinkages) -> MeasuredDwells:
        """Measure dwell mechanisms over the turn."""
        at = self.turned(dwell)
        ends = _ends(at.places)
        across = np.abs(np.subtract(*(np.take_along_axis(at.places, end, 1) for end in ends)))
        return MeasuredDwells(
            dwell,
            _peaks(at.resting),
            np.ptp(at.swung, axis=1),
            RIGHT - at.slanting.max(1),
            across.max(1) / dwell.crank,
        )

    def linearised(self, guides: MeasuredDwells) -> Subproblem:
        here, n = guides.dwell, len(guides)
        at, unit = self.turned(here), _units(here)
        read = _Read.of(self, at)
        values = read(at, here.crank)
        each, coordinate = np.repeat(np.arange(n), DWELL.coordinates), np.tile(np.arange(DWELL.coordinates), n)
        there, valid = _displaced(
            here[each], DWELL.step * unit[each] * (coordinate[:, None] == np.arange(DWELL.coordinates))
        )
        each, coordinate = each[valid], coordinate[valid]
        moved = read[each](self.turned(there), there.crank)
        slopes = {name: np.zeros((*value.shape, DWELL.coordinates + 1)) for name, value in values.items()}
        for name, value in moved.items():
            slopes[name][each, :, coordinate] = np.nan_to_num((value - values[name][each]) / DWELL.step)
        slopes["resting"][..., -1] = -1.0  # the middle of the rest is free
        error, jacobian = at_peaks(values.pop("resting"), slopes.pop("resting"), DWELL.intervals)
        pieces = {name: Pieces(value, slopes[name]) for name, value in values.items()}
        ranked = {"min_transmission": pieces.pop("min_transmission")}
        allowed = np.full(n, 0.5 * self.residual)
        return Subproblem(error, jacobian, pieces, ranked, {"min_transmission": np.ones(n)}, allowed, {})

    def turned(self, dwell: DwellLinkages) -> Turned:
        """Evaluate dwell mechanisms over the turn."""
        n, k = len(dwell.point), DWELL.steps
        moving = motion(dwell.linkage, dwell.driver, dwell.point)
        nodes = 0.5 * self.angle * grid(DWELL.intervals).nodes
        turn = np.concatenate([nodes, 2 * np.pi * ((np.arange(k) + 0.5) / k - 0.5)])
        full = ~np.isfinite(moving.interval).any(axis=0)
        with np.errstate(all="ignore"):
            path = moving.pose(np.tan(0.5 * turn)[:, None] + np.zeros(n)).point(dwell.point)
            path = np.where(full, path, np.nan)
            joint = joint_places(path, dwell.point, dwell.joint, dwell.pivot)
            angle = np.angle((joint - dwell.pivot) / (dwell.joint - dwell.pivot))
            rod, rocker = joint - path, joint - dwell.pivot
            slanting = RIGHT - np.abs(np.angle(rod / rocker))
            linkage = RIGHT - np.radians(min_transmission_turn(dwell.linkage, dwell.driver))
            slides = slides_over_turn(coupler_curve(dwell.linkage, dwell.point, chart=dwell.driver), dwell.driver)
        m = len(nodes)
        points, finite = dwell.linkage.points.reshape(n, 4), dwell.linkage.finite.reshape(n, 4)
        points = np.where(finite, points, dwell.point[:, None])
        slides = slides.reshape(n, -1)
        slides = np.where(np.isfinite(slides), slides, dwell.point[:, None])
        places = np.concatenate([points, dwell.joint[:, None], dwell.pivot[:, None], slides, path[m:].T], axis=1)
        return Turned(
            np.unwrap(angle[:m], axis=0).T,
            np.unwrap(angle[m:], axis=0).T,
            np.concatenate([np.abs(slanting[m:]), linkage[None]]).T,
            places,
        )


@dataclass(frozen=True)
class _Read:
    """Rows of the limits and the ranked measure of n mechanisms, near one position of each.

    The places of which the rows consist are chosen there, so that differences are smooth.

    Attributes
    ----------
    middle : ndarray, shape (n, 1)
        Middle of the range of the resting rocker [rad].
    worst : ndarray, shape (n, g)
        Numbers of the positions of least transmission of each group.
    ends : ndarray, shape (2, n, d)
        Numbers of the places that are farthest apart.
    """

    model: DwellModel
    middle: Floats
    worst: Indices
    ends: Indices

    @classmethod
    def of(cls, model: DwellModel, at: Turned) -> _Read:
        n = len(at.resting)
        grouped = at.slanting[:, :-1].reshape(n, -1, DWELL.group)
        worst = grouped.argmax(2) + np.arange(0, DWELL.steps, DWELL.group)
        worst = np.concatenate([worst, np.full((n, 1), DWELL.steps)], axis=1)
        fine = at.resting @ grid(DWELL.intervals).fine.T
        middle = 0.5 * (fine.max(1) + fine.min(1))[:, None]
        return cls(model, middle, worst, _ends(at.places))

    def __getitem__(self, index: Indices) -> _Read:
        return replace(self, middle=self.middle[index], worst=self.worst[index], ends=self.ends[:, index])

    def __call__(self, at: Turned, crank: Floats) -> dict[str, Floats]:
        """Return the rows by name, less is better."""
        model = self.model
        rows = {
            "resting": at.resting - self.middle,
            "min_transmission": np.take_along_axis(at.slanting, self.worst, 1) / RIGHT,
            "swing": (model.swing * (1 + DWELL.inside) - np.ptp(at.swung, axis=1))[:, None] / RIGHT,
        }
        if np.isfinite(model.size):
            one, other = (np.take_along_axis(at.places, end, 1) for end in self.ends)
            rows["size"] = np.abs(one - other) / (crank[:, None] * model.size) - 1 + DWELL.inside
        return rows


def _ends(places: Complexes) -> Indices:
    """Return the numbers of pairs of places (n, q) that are far apart, (2, n, d)."""
    return np.swapaxes(extreme_pairs(places.T, DWELL.directions), 1, 2)


def _peaks(angle: Floats) -> Floats:
    """Return the range of values (n, m) at Chebyshev points, between them too."""
    return np.asarray(np.ptp(angle @ grid(DWELL.intervals).fine.T, axis=1))


def _units(dwell: DwellLinkages) -> Floats:
    """Return the units of the moves, (n, 10): distances from the guided point, and 1 rad."""
    n = len(dwell.point)
    other = 2 - dwell.driver
    pivots, finite = (part[np.arange(n), other] for part in (dwell.linkage.points, dwell.linkage.finite))
    least = DWELL.unit * dwell.crank
    arm = np.where(finite, np.maximum(np.abs(pivots - dwell.point[:, None]), least[:, None]), 1.0)
    rod = np.maximum(np.abs(dwell.point - dwell.joint), least)
    rocker = np.maximum(np.abs(dwell.joint - dwell.pivot), least)
    point = np.maximum(np.abs(dwell.point - dwell.pin), least)
    columns = [arm[:, 0], arm[:, 0], arm[:, 1], arm[:, 1], point, point, rod, rod, rocker, np.ones(n)]
    return np.stack(columns, axis=1)


def _displaced(dwell: DwellLinkages, step: Floats) -> tuple[DwellLinkages, Mask]:
    """Return the mechanisms after steps (n, 10) that are valid, and their mask."""
    n = len(dwell.point)
    change = np.zeros((n, COUNT))
    columns = 4 * (2 - dwell.driver)[:, None] + np.arange(4)
    np.put_along_axis(change, columns, step[:, :4], 1)
    arm = dwell.pin - dwell.home
    turned = arm * (np.exp(1j * step[:, 9]) - 1)
    pin = 4 * (dwell.driver - 1)[:, None] + np.array([2, 3])
    np.put_along_axis(change, pin, np.stack([turned.real, turned.imag], 1), 1)
    change[:, 8:] = step[:, 4:6]
    linkage, point, good = displaced(dwell.linkage, dwell.point, change)
    away = dwell.pivot - dwell.home
    joint = dwell.joint + step[:, 6] + 1j * step[:, 7]
    pivot = dwell.pivot + away / np.abs(away) * step[:, 8]
    return DwellLinkages(linkage, point, joint[good], pivot[good], dwell.driver[good]), good
