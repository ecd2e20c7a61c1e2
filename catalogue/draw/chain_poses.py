"""Poses of a mechanism of many bars for an animated drawing, independent of paper."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..chains.lengths import pitch_circles
from ..chains.poses import Poses as BarPoses
from ..chains.rates import rates
from ..chains.structure import Structure
from ..errors import InvalidRequest
from ..kinematics.circuits import OPEN
from ..kinematics.types import Complexes, Floats
from .poses import POSE_COUNT

if TYPE_CHECKING:
    from ..guides.own_chain import OwnChain


@dataclass(frozen=True)
class ChainPoses:
    """A mechanism of many bars in m poses; points are complex numbers in the user's unit.

    Attributes
    ----------
    at : catalogue.chains.poses.Poses
        Poses of its bars.
    phases : ndarray, shape (m,)
        Phases of the poses [rad].
    point : int
        Number of the guided joint.
    path : complex ndarray, shape (p,)
        Path of the guided joint [length].
    velocity : complex ndarray, shape (m,)
        Velocity of the guided joint per unit of the drive; NaN at its dead points.
    time : ndarray, shape (m,)
        Times of the poses, from 0 to 1.
    middle : int
        Index of the pose nearest to that of a still.
    closed : bool
        Whether the last pose is the first again.
    """

    at: BarPoses
    phases: Floats
    point: int
    path: Complexes
    velocity: Complexes
    time: Floats
    middle: int
    closed: bool

    @property
    def structure(self) -> Structure:
        """Structure of the mechanism."""
        return self.at.chain.structure

    @property
    def joints(self) -> Complexes:
        """Positions of the joints, shape (j, m) [length]."""
        return np.array([self.at.joint(j)[:, 0] for j in range(len(self.structure.joints))])

    @property
    def guided(self) -> Complexes:
        """Positions of the guided joint, shape (m,) [length]."""
        return self.at.joint(self.point)[:, 0]

    @property
    def bearings(self) -> Complexes:
        """Places of the pins of the frame, shape (k,) [length]."""
        pins = [j for j, bars in enumerate(self.structure.on) if self.structure.frame in bars and len(bars) > 1]
        return self.at.chain.z[pins, 0]

    @property
    def wheels(self) -> list[tuple[int, complex, float]]:
        """Bar, centre and radius of each pitch circle in the reference pose [length]."""
        z = self.at.chain.z[:, 0]
        found = [one for gear in self.structure.gears for one in pitch_circles(self.structure, gear, z)]
        return [(self.structure.number(name), centre, radius) for name, centre, radius in found]

    @property
    def extent(self) -> Complexes:
        """All places to which the picture must reach [length]."""
        rims = [
            self.at.point(bar, np.array([centre]))[:, 0] + radius * way
            for bar, centre, radius in self.wheels
            for way in (1, 1j, -1, -1j)
        ]
        every = np.concatenate([self.path, self.joints.ravel(), *rims])
        return np.asarray(every[np.isfinite(every)])


def chain_poses(
    guide: OwnChain, count: int | None = None, *, turn: bool = False, error: float = POSE_COUNT.error
) -> ChainPoses:
    """Compute poses of a mechanism of many bars over its stroke, or over its circuit.

    Parameters
    ----------
    guide : OwnChain
    count, turn, error
        See `poses.poses`.

    Raises
    ------
    InvalidRequest
        If the count is out of range.
    """
    low, home, high = guide.drawn
    if turn or not hasattr(guide, "stroke"):
        low, high = guide.range
        home = float(guide.circuit.phase[0])
    closed = abs(high - low) >= float(guide.circuit.period[0]) * (1 - 1e-9) and guide.circuit.kind[0] != OPEN
    told = (POSE_COUNT.turn if closed else POSE_COUNT.stroke) if count is None else count
    if not 3 <= told <= POSE_COUNT.most:
        raise InvalidRequest(f"a moving drawing has 3 to {POSE_COUNT.most} poses, not {told}")
    samples, time = guide.samples(low, high), np.linspace(0, 1, told)
    share = time if closed else 0.5 * (1 - np.cos(np.pi * time))
    if count is None:
        share = samples.linked(share, error)
        time = share if closed else np.arccos(1 - 2 * share) / np.pi
    phases = samples.rows(share)
    at, point = guide.circuit.poses(phases[:, None]), guide.read.point
    with np.errstate(all="ignore"):
        velocity = rates(at).velocity_of(guide.circuit.bar, at.chain.z[point])[:, 0]
    along = samples.polyline([0])
    path = guide.circuit.poses(along[:, None]).joint(point)[:, 0]
    forward = np.sign(np.gradient(at.drive[:, 0]))
    middle = int(np.abs(phases - home).argmin())
    return ChainPoses(at, phases, point, path, velocity * forward, time, middle, closed)
