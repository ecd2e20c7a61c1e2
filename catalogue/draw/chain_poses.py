"""Poses of a mechanism of many bars for an animated drawing, independent of paper."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..chains.poses import Poses as BarPoses
from ..chains.rates import rates
from ..chains.structure import Structure
from ..guides.kinds import has_stroke
from ..kinematics.circuits import OPEN
from ..kinematics.types import Complexes, Floats
from .chain_machine import chain_machine
from .poses import POSE_COUNT, shares_and_times, still_shares

if TYPE_CHECKING:
    from ..guides.own_chain import OwnChain
    from ..kinematics.sampling import Samples
    from .machine import Machine


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
        Index of the pose nearest to the given position, for a still.
    closed : bool
        Whether the last pose equals the first.
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

    @cached_property
    def machine(self) -> Machine:
        """The mechanism as a machine to draw."""
        return chain_machine(self)

    @property
    def guided(self) -> Complexes:
        """Positions of the guided joint, shape (m,) [length]."""
        return self.at.joint(self.point)[:, 0]

    @property
    def fixed(self) -> list[int]:
        """Numbers of the pins of the frame."""
        structure = self.structure
        return [j for j, bars in enumerate(structure.on) if structure.frame in bars and len(bars) > 1]


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
    samples, home, closed = _sampled_motion(guide, turn=turn)
    share, time = shares_and_times(samples, count, closed=closed, error=error)
    return _poses_at(guide, samples, share, time, home, closed=closed)


def still_chain_poses(guide: OwnChain) -> ChainPoses:
    """Compute the poses of a still, one of them the pose to draw."""
    samples, home, closed = _sampled_motion(guide)
    share = still_shares(samples, home, closed=closed)
    return _poses_at(guide, samples, share, share, home, closed=closed)


def _sampled_motion(guide: OwnChain, *, turn: bool = False) -> tuple[Samples, float, bool]:
    """Return samples of the motion, the phase of the pose [rad], and whether it is closed."""
    low, home, high = guide.drawn
    if turn or not has_stroke(guide):
        (low, high), home = guide.range, float(guide.circuit.phase[0])
    closed = abs(high - low) >= float(guide.circuit.period[0]) * (1 - 1e-9) and guide.circuit.kind[0] != OPEN
    return guide.samples(low, high), home, closed


def _poses_at(
    guide: OwnChain, samples: Samples, share: Floats, time: Floats, home: float, *, closed: bool
) -> ChainPoses:
    """Compute the poses at fractions of a motion; a still shows the one at phase `home` [rad]."""
    phases = samples.rows(share)
    at, point = guide.circuit.poses(phases[:, None]), guide.read.point
    with np.errstate(all="ignore"):
        velocity = rates(at).velocity_of(guide.circuit.bar, at.chain.z[point])[:, 0]
    along = samples.polyline([0])
    path = guide.circuit.poses(along[:, None]).joint(point)[:, 0]
    forward = np.sign(np.gradient(at.drive[:, 0]))
    middle = int(np.abs(phases - home).argmin())
    return ChainPoses(at, phases, point, path, velocity * forward, time, middle, closed)
