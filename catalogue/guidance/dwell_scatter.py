"""The allowance of a dwell, and machines simulated at a scatter.

The crank turns between fixed directions, whatever the errors of the pivots.  Over this part of its
turn the angle of the rocker is, to first order, linear in the errors of all coordinates, and half
its range is its distance from the best-placed angle.  So the allowance of a path applies to it,
with one free coordinate.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..kinematics.linkage import Linkage
from ..kinematics.motion import motion
from ..kinematics.types import Complexes, Floats
from .allowance import ALLOWANCE, References, Response, allowed, scattered, shortest
from .drawn_machines import SIMULATION
from .dwell import joint_places
from .minimum_zone import grid
from .sensitivity import COUNT, displaced


class DwellScatter(NamedTuple):
    """Grids of the allowance of a dwell."""

    stations: int = 32  #: intervals between the Chebyshev points of the dwell
    drawn: int = 64  #: number of intervals for a simulated machine
    step: float = 1e-5  #: step of the differences [length of the driving crank]
    output: int = 4  #: number of coordinates of the output dyad: joint and pivot of the rocker


DWELL_SCATTER = DwellScatter()

#: Number of all coordinates; those of the linkage come first.
ALL = COUNT + DWELL_SCATTER.output


@dataclass(frozen=True)
class Standing:
    """A rocker that stands still while the crank turns between two directions.

    Attributes
    ----------
    linkage : Linkage
        One linkage, in the reference position.
    point, joint, pivot : complex
        Guided point, joint of rod and rocker, fixed pivot of the rocker, in that position [length].
    crank : int
        Number of the driving crank, 1 or 2.
    low, high : float
        Directions of the crank at the beginning and at the end [rad].
    """

    linkage: Linkage
    point: complex
    joint: complex
    pivot: complex
    crank: int
    low: float
    high: float

    def allowance(self, band: float) -> float:
        """Return the scatter at which the rocker stays within a band with `PROBABILITY`.

        The scatter is the standard deviation of each coordinate of the pivots and the joint.

        Parameters
        ----------
        band : float
            Width of the band of the rocker's angles [rad].

        Returns
        -------
        float
            Scatter, at most `ALLOWANCE.largest` of the shortest link; negative where the exact
            linkage leaves the band [length].
        """
        nodes = grid(DWELL_SCATTER.stations)
        steps = DWELL_SCATTER.step * np.concatenate([np.eye(ALL), -np.eye(ALL), np.zeros((1, ALL))])
        angles = self._angles(steps, nodes.nodes)
        across = (angles[:, :ALL] - angles[:, ALL:-1])[None] / (2 * DWELL_SCATTER.step)
        across = np.where(self._scattered, across, 0.0)
        fine = nodes.fine @ angles[:, -1]
        middle = 0.5 * (fine.max() + fine.min())
        error, deviation = (angles[:, -1] - middle)[None], np.array([0.5 * np.ptp(fine)])
        place = nodes.nodes[None]
        here = Response(error, place, np.ones_like(place), across, np.zeros(0), np.zeros(0), deviation)
        found = References.of(here, 1)
        links = [abs(self.point - self.joint), abs(self.joint - self.pivot), shortest(self.linkage)[0]]
        return float(min(allowed(found, deviation, np.array([0.5 * band]))[0], ALLOWANCE.largest * min(links)))

    def kept_share(self, scatter: float, band: float, draws: int = SIMULATION.draws) -> float:
        """Compute the fraction of simulated machines within a band [rad], at a scatter [length].

        Machines that cannot move through the dwell count as outside.
        """
        steps = scatter * np.random.default_rng(SIMULATION.seed).normal(size=(draws, ALL)) * self._scattered
        with np.errstate(all="ignore"):
            ranges = np.ptp(self._angles(steps, grid(DWELL_SCATTER.drawn).nodes), axis=0)
        return float(np.count_nonzero(ranges <= band) / draws)

    @property
    def _scattered(self) -> Floats:
        return np.concatenate([scattered(self.linkage)[0], np.ones(DWELL_SCATTER.output, bool)])

    def _angles(self, steps: Floats, nodes: Floats) -> Floats:
        """Compute the rocker angles (m, n) [rad] of machines displaced by steps (n, 14)."""
        each = np.zeros(len(steps), int)
        linkage, point, good = displaced(self.linkage[each], np.full(len(each), self.point), steps[:, :COUNT])
        more = steps[good, COUNT:]
        joint, pivot = self.joint + more[:, 0] + 1j * more[:, 1], self.pivot + more[:, 2] + 1j * more[:, 3]
        z = linkage.points[:, self.crank - 1]
        direction = 0.5 * (self.high + self.low) + 0.5 * (self.high - self.low) * nodes[:, None]
        turn = np.angle(np.exp(1j * direction) * (z[:, 0] - z[:, 1]).conj() * -1)
        moving = motion(linkage, np.full(len(point), self.crank), point)
        path: Complexes = moving.pose(np.tan(0.5 * turn)).point(point)
        places = joint_places(path, point, joint, pivot)
        found = np.full((len(nodes), len(steps)), np.nan)
        found[:, good] = np.unwrap(np.angle((places - pivot) * (joint - pivot).conj()), axis=0)
        return found
