"""Measures of an answer of many bars from the positions of its joints alone."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from catalogue import mechanism
from catalogue.kinematics.types import Complexes

SAMPLES = 401
#: Directions in which a width is measured: the largest is known to 4e-5 of it.
ANGLES = 180


@dataclass(frozen=True)
class Moved:
    """Positions (m,) of all joints of an answer over its stroke [length]."""

    own: Any
    motion: Any
    joints: dict[str, Complexes]

    @classmethod
    def of(cls, answer: Any) -> Moved:
        """Move an answer of a collection."""
        own: Any = mechanism(answer)
        motion = own.motion(SAMPLES)
        still = {name: np.full(SAMPLES, complex(*own.joints[name])) for name in own.bars["frame"]}
        return cls(own, motion, {**still, **motion.points})

    @property
    def pins(self) -> set[str]:
        """Joints on two bars or more."""
        count = [joint for joints in self.own.bars.values() for joint in joints]
        return {joint for joint in count if count.count(joint) > 1}

    @property
    def path(self) -> Complexes:
        """Positions of the guided joint."""
        return self.joints[self.own.point]

    def box(self, names: Any, at: Any = slice(None)) -> tuple[float, float, float, float]:
        """Return the box of joints at some positions: x0, y0, x1, y1."""
        z = np.concatenate([np.atleast_1d(self.joints[name][at]) for name in names])
        return float(z.real.min()), float(z.imag.min()), float(z.real.max()), float(z.imag.max())

    def measures(self) -> dict[str, float]:
        """Return measures by the names that bounds give them."""
        own, motion, pins = self.own, self.motion, self.pins
        middle = {name: complex(z[SAMPLES // 2]) for name, z in self.joints.items()}

        def apart(joints: list[str]) -> list[float]:
            return [abs(middle[a] - middle[b]) for a, b in combinations([j for j in joints if j in pins], 2)]

        links = [d for bar, joints in own.bars.items() if bar != "frame" for d in apart(joints)]
        arms = [
            abs(middle[j] - middle[own.point])
            for joints in own.bars.values()
            if own.point in joints
            for j in joints
            if j in pins and j != own.point
        ]
        bar = next(bar for bar, joints in own.bars.items() if own.point in joints)
        z = np.array([*self.joints.values()]).ravel()
        widest = max(np.ptp((z * np.exp(-1j * angle)).real) for angle in np.pi * np.arange(ANGLES) / ANGLES)
        # positions run evenly along a phase: speed over that of the drive is the ratio of differences
        ways, drives = np.abs(np.diff(self.path)), np.abs(np.diff(np.radians(motion.drive)))
        speed, steady = ways / drives, (np.diff(motion.drive) > 0).all() or (np.diff(motion.drive) < 0).all()
        pivot = next(j for j in own.bars["frame"] if j in own.bars[own.drive])
        crank = max([abs(middle[j] - middle[pivot]) for j in own.bars[own.drive] if j in pins and j != pivot])
        return {
            "size": float(widest),
            "max_link": max(links),
            "min_link": min(links),
            "max_ground": max([0.0, *apart(own.bars["frame"])]),
            "max_arm": min(arms),
            "min_transmission": float(motion.transmission.min()),
            "rotation": float(np.ptp(motion.angles[bar])),
            "drive_angle": float(np.ptp(motion.drive)),
            "uniformity": float(speed.min() / speed.max()) if steady else 0.0,
            "advantage": float(crank / speed.max()) if steady else 0.0,
            "turns": float(own.drive_range is None),
        }
