"""Poses of a guide for an animated drawing, as coordinates, independent of paper.

Every pose is measured on the finite motion; a drawing interpolates only between measured poses.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..errors import InvalidRequest
from ..guides.kinds import is_candidate, is_dwell
from ..kinematics.linkage import RP
from ..kinematics.types import Complexes, Floats, Integers
from .linkage_machine import linkage_machine

if TYPE_CHECKING:
    from ..guides.placed import PlacedGuide
    from ..guides.run import Run
    from ..kinematics.sampling import Samples
    from .machine import Machine


class PoseCount(NamedTuple):
    """Number of poses of a moving drawing."""

    stroke: int = 33  #: default number over a stroke: odd, so that one is in the middle of a still
    turn: int = 73  #: default number over a turn: every five degrees
    most: int = 361  #: largest number of poses: every degree of a turn
    #: Largest error of interpolation half way between two poses [extent of the part's motion, rad]:
    #: a pixel of a card.
    error: float = 5e-3


POSE_COUNT = PoseCount()


@dataclass(frozen=True)
class Poses:
    """A guide in m poses; points are complex numbers in the user's unit, y upwards."""

    kinds: Integers  #: kinds of the dyads, shape (2,): `RR`, `PR`, `RP`
    fixed: Complexes  #: fixed pivots, shape (2,); for a slider the unit normal of its line
    moving: Complexes  #: moving pivots, shape (m, 2); for a slide the unit normal of its coupler line
    turn: Floats  #: rotation of the coupler from the given position, shape (m,) [rad]
    cranks: dict[int, Floats]  #: angle of each crank from the x axis, by dyad 0 or 1, shape (m,) [rad]
    guided: Complexes  #: positions of the guided point, shape (m,)
    home: (
        Complexes  #: in the position given, shape (3,): finite moving pivots or feet on the slides' lines, guided point
    )
    normals: dict[int, complex]  #: unit normal of each slide's coupler line, in the given position
    rods: dict[int, Complexes]  #: ends of each slide's coupler line in the given position, shape (2,)
    #: Velocity of the guided point per radian of the drive, in the order of the poses, shape (m,);
    #: NaN at dead points of the drive.
    velocity: Complexes
    time: Floats  #: times of the poses, from 0 to 1, shape (m,)
    path: Complexes  #: path of the guided point, shape (p,), within `POLYLINE.error`
    traces: dict[str, Complexes]  #: paths of further coupler points by name, shape (p,) each
    traced: dict[str, complex]  #: positions of these points in the given position
    driver: int  #: number of the driving crank; 0: the coupler
    closed: bool  #: whether the last pose equals the first
    joint: Complexes | None = None  #: joints of rod and rocker of a dwell, shape (m,)
    pivot: complex = complex("nan")  #: fixed pivot of its rocker

    @property
    def middle(self) -> int:
        """Index of the pose nearest to the given position."""
        away = np.abs(self.guided - self.home[2]) + np.abs(self.home - self.home[2]).max() * np.abs(self.turn)
        return int(np.argmin(away))

    @cached_property
    def machine(self) -> Machine:
        """The linkage as a machine to draw."""
        return linkage_machine(self)

    @property
    def origin(self) -> int:
        """Index in `home` of the coupler's origin: a finite moving pivot, else the guided point."""
        return next((i for i in (0, 1) if self.kinds[i] != RP), 2)

    def carried(self, z: Complexes) -> Complexes:
        """Move coupler points of the given position, shape (k,), to the poses, (m, k)."""
        return np.asarray(self.guided[:, None] + np.exp(1j * self.turn[:, None]) * (np.ravel(z) - self.home[2]))

    def at_home(self, z: Complexes) -> Complexes:
        """Convert places z, one in each pose, to coupler points in the given position, (m,)."""
        return np.asarray(self.home[2] + np.exp(-1j * self.turn) * (z - self.guided))


def poses(
    guide: PlacedGuide,
    count: int | None = None,
    *,
    turn: bool = False,
    points: Mapping[str, object] | None = None,
    error: float = POSE_COUNT.error,
) -> Poses:
    """Compute poses of a guide over its stroke, or over its circuit if it has none.

    Parameters
    ----------
    guide : PlacedGuide
    count : int, optional
        Number of poses, 3 to 361; default: 33 over a stroke, 73 over a circuit, or more where the
        error requires it.  Over a stroke they are denser near its ends, so that equal times give a
        gentle reversal.
    turn : bool
        Cover the whole circuit, from the given position back to it; for an open circuit its part
        near that position.
    points : mapping of str to (x, y), optional
        Further coupler points, in the given position [length].
    error : float
        Largest error of interpolation half way between two poses [extent of the part's motion,
        rad].

    Raises
    ------
    InvalidRequest
        If the count is out of range, or the linkage does not cover the stroke.
    """
    run = guide.run(whole=turn, points=points)
    return poses_at(guide, run, *shares_and_times(run.samples, count, closed=run.closed, error=error))


def still_poses(guide: PlacedGuide) -> Poses:
    """Compute the poses of a still, one of them the given position."""
    run = guide.run()
    share = still_shares(run.samples, float(run.circuit.phase[0]), closed=run.closed)
    shown = poses_at(guide, run, share, share)
    return replace(shown, driver=guide.driver or 0) if is_candidate(guide) else shown


def shares_and_times(samples: Samples, count: int | None, *, closed: bool, error: float) -> tuple[Floats, Floats]:
    """Choose the fractions of a motion for its poses, and their times, from 0 to 1.

    Raises
    ------
    InvalidRequest
        If the count is out of range.
    """
    told = (POSE_COUNT.turn if closed else POSE_COUNT.stroke) if count is None else count
    if not 3 <= told <= POSE_COUNT.most:
        raise InvalidRequest(f"a moving drawing has 3 to {POSE_COUNT.most} poses, not {told}")
    time = np.linspace(0, 1, told)
    share: Floats = time if closed else 0.5 * (1 - np.cos(np.pi * time))
    if count is None:
        share = samples.linked(share, error)
        time = share if closed else np.arccos(1 - 2 * share) / np.pi
    return share, time


def still_shares(samples: Samples, home: float, *, closed: bool) -> Floats:
    """Return fractions of a motion for a still, around its phase `home` [rad].

    On a closed circuit they begin and end there.
    """
    if closed:
        return np.linspace(0, 1, POSE_COUNT.turn)
    return np.interp(np.linspace(-1, 1, POSE_COUNT.stroke), [-1, 0, 1], [0, float(samples.share(home)), 1])


def poses_at(guide: PlacedGuide, run: Run, share: Floats, time: Floats) -> Poses:
    """Compute the poses at fractions of a run.

    Raises
    ------
    InvalidRequest
        If the linkage does not guide its point over the whole run.
    """
    linkage, moved = guide.linkage, run.motion(run.samples.rows(share), getattr(guide, "driver", None))
    kinds, z, along = linkage.dyads[0], linkage.points[0], run.polyline()
    turned, guided, path = np.radians(moved.coupler), moved.points["guided"], run.path(along)
    if not (np.isfinite(guided).all() and np.isfinite(path).all()):
        raise InvalidRequest("the linkage does not lead its guided point over the whole of the motion to be drawn")
    moving = [
        np.exp(1j * turned) * z[i, 1] if kinds[i] == RP else moved.points[f"A{i + 1}*"] for i in (0, 1)
    ]  # a slide has a normal in place of its moving pivot
    start = complex(*guide.guided)
    feet, rods = _slides(kinds, z, start, {i: run.sliding(i) for i in (0, 1) if kinds[i] == RP})
    joint, pivot = output(guide, guided)
    return Poses(
        kinds=kinds,
        fixed=z[:, 0],
        moving=np.stack(moving, axis=1),
        turn=turned,
        cranks={i - 1: np.radians(angle) for i, angle in moved.cranks.items()},
        guided=guided,
        home=np.array([feet.get(i, z[i, 1]) for i in (0, 1)] + [start]),
        normals={i: z[i, 1] for i in rods},
        rods=rods,
        velocity=moved.velocities["guided"] * (1 if moved.drive[-1] >= moved.drive[0] else -1),
        time=time,
        path=path,
        traces={name: run.places(complex(*at), along) for name, at in run.points.items()},
        traced={name: complex(*at) for name, at in run.points.items()},
        driver=moved.driver,
        closed=run.closed,
        joint=joint,
        pivot=pivot,
    )


def _slides(
    kinds: Integers, z: Complexes, start: complex, fixed: Mapping[int, Complexes]
) -> tuple[dict[int, complex], dict[int, Complexes]]:
    """Return for each slide the nearest foot on its slot, and the ends of the slot.

    `fixed` are the fixed pivots of slides in the coupler's frame, shape (m,).
    """
    feet: dict[int, complex] = {}
    rods: dict[int, Complexes] = {}
    points = [*(z[i, 1] for i in (0, 1) if kinds[i] != RP), start]
    for i in (i for i in (0, 1) if kinds[i] == RP):
        normal = z[i, 1]
        height = [((point - z[i, 0]) * normal.conjugate()).real for point in points]
        nearest = int(np.abs(height).argmin())
        feet[i] = points[nearest] - height[nearest] * normal
        contact = ((fixed[i] - feet[i]) * (1j * normal).conjugate()).real
        rods[i] = feet[i] + 1j * normal * np.array([min(contact.min(), 0.0), max(contact.max(), 0.0)])
    return feet, rods


def output(guide: PlacedGuide, guided: Complexes) -> tuple[Complexes | None, complex]:
    """Return the joints (m,) of a dwell for guided points (m,), and the rocker's pivot.

    None and NaN for a guide that is no dwell.
    """
    if not is_dwell(guide):
        return None, complex("nan")
    return guide.joints(guided), complex(*guide.pivot)
