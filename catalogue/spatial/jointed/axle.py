"""What chassis engineers read off the motion of a wheel carrier.

Vehicle axes of ISO 8855: x forward, y to the left, z up; the middle plane of the vehicle is y = 0.  Angles in degrees.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from ...errors import InvalidRequest
from ...given import Stated, array, instance, number, positive
from ...kinematics.types import Array
from .elements import Scalar, Vector
from .frame import framed
from .hard_points import numbers
from .motion import Motion
from .vectors import cross


@dataclass(frozen=True)
class Wheel(Stated):
    """A wheel on its carrier, in the design pose.

    Parameters
    ----------
    carrier : str
        The body that carries it.
    centre : array-like, shape (3,), or (n, 3) of a batch
    axis : array-like, shape (3,), or (n, 3)
        Along the axis of rotation, either way.
    radius : float
        Of the tyre under load.
    """

    carrier: str
    centre: Vector
    axis: Vector
    radius: float

    def outboard(self) -> Array:
        """Return the axis, pointing away from the middle of the vehicle."""
        axis, side = numbers(self.axis, "Wheel.axis"), numbers(self.centre, "Wheel.centre")[:, 1:2]
        across = axis[:, 1:2] * side
        if not (0 < self.radius < np.inf and across.all()):
            raise InvalidRequest("a Wheel needs a radius, a centre beside the plane y = 0, and an axis across it")
        out = np.asarray(axis * np.sign(across) / np.sqrt((axis * axis).sum(1, keepdims=True)))
        return out if len(out) > 1 else np.asarray(out[0])


def kinematics(motion: Motion, wheel: Wheel, steer: Scalar | None = None) -> pd.DataFrame:
    """Return what the wheel does over a sweep, one row per value of the drive.

    Parameters
    ----------
    motion : Motion
        Of wheel travel.
    wheel : Wheel
    steer : scalar, optional
        One of those that were held in the sweep, such as the Joint of the rack: about its axis the wheel would be
        steered; it gives caster, kingpin inclination, scrub radius and trail.

    Returns
    -------
    pandas.DataFrame
        One row per pose, of a batch indexed by mechanism and pose.  Toe is positive when the front of the wheel points
        inwards, camber when its top leans outwards, caster when the steering axis leans backwards, kingpin inclination
        when it leans inwards; recession of the wheel centre is backwards, the half track is that of the contact point.
        The roll centre is above the ground, on the middle plane (of an axle that moves symmetrically); the support
        angles, from which `anti_dive` follows, are those by which the paths of the contact point (brake outboard) and
        of the wheel centre (drive, or brake inboard) lean forwards in the side view.

    Raises
    ------
    InvalidRequest
        If `steer` was not held, or the wheel is not one for all nor one for each of a batch.
    """
    instance("motion", motion, Motion), instance("wheel", wheel, Wheel)
    unit, deg = motion.mechanism.unit, "deg"
    design = motion.each(wheel.centre, "Wheel.centre")
    side = np.sign(design[:, 1])
    x = motion.rows(motion.point(wheel.carrier, wheel.centre, 1))
    n = motion.rows(motion.direction(wheel.carrier, wheel.outboard(), 0))
    centre, velocity, spin = x[:, 0], x[:, 1], motion.rows(motion.spin(wheel.carrier))[:, 0]
    down = n * n[:, 2:] - np.array([0.0, 0.0, 1.0])
    contact = centre + wheel.radius * down / np.sqrt((down * down).sum(1, keepdims=True))
    patch = velocity + cross(spin, contact - centre)
    ground = contact[:, 2]
    screw = axis_of(velocity, spin, centre)
    with np.errstate(all="ignore"):
        columns = {
            f"travel [{unit}]": centre[:, 2] - design[:, 2],
            f"toe [{deg}]": np.degrees(np.arctan2(n[:, 0], side * n[:, 1])),
            f"camber [{deg}]": np.degrees(-np.arcsin(n[:, 2])),
            f"recession [{unit}]": design[:, 0] - centre[:, 0],
            f"half track [{unit}]": np.abs(contact[:, 1]),
            f"roll centre [{unit}]": contact[:, 1] * patch[:, 1] / patch[:, 2],
            f"support angle of contact [{deg}]": np.degrees(np.arctan2(patch[:, 0], patch[:, 2])),
            f"support angle of centre [{deg}]": np.degrees(np.arctan2(velocity[:, 0], velocity[:, 2])),
        }
    for name, column in zip("xyz", screw[0].T, strict=True):
        columns[f"screw axis {name} [1]"] = column
    for name, column in zip("xyz", screw[1].T, strict=True):
        columns[f"screw axis at {name} [{unit}]"] = column
    columns[f"pitch [{unit}/rad]"] = screw[2]
    if steer is not None:
        spin, velocity = (motion.rows(v) for v in motion.influence(steer, wheel.carrier, wheel.centre))
        k, at, _ = axis_of(velocity, spin, centre)
        k = k * np.sign(k[:, 2:])
        foot = at + k * ((ground - at[:, 2]) / k[:, 2])[:, None]
        columns |= {
            f"caster [{deg}]": np.degrees(np.arctan2(-k[:, 0], k[:, 2])),
            f"kingpin inclination [{deg}]": np.degrees(np.arctan2(-side * k[:, 1], k[:, 2])),
            f"scrub radius [{unit}]": side * (contact[:, 1] - foot[:, 1]),
            f"trail [{unit}]": foot[:, 0] - contact[:, 0],
        }
    return framed(motion, columns)


def axis_of(velocity: Array, spin: Array, at: Array) -> tuple[Array, Array, Array]:
    """Return the instant screw axis of a body: direction (s, 3), the point on it next to `at`, and the pitch.

    Of a translation the direction is that of the velocity, the point `at` and the pitch infinite.
    """
    w = np.sqrt((spin * spin).sum(-1, keepdims=True))
    still = w < 1e-300
    with np.errstate(all="ignore"):
        along = np.where(still, velocity / np.sqrt((velocity * velocity).sum(-1, keepdims=True)), spin / w)
        point = np.where(still, at, at + cross(spin, velocity) / (w * w))
        pitch = np.where(still[..., 0], np.inf, (spin * velocity).sum(-1) / (w * w)[..., 0])
    return along, point, pitch


def anti_dive(support_angle: Any, wheelbase: float, height: float, share: float) -> Array:
    """Return how much of the dive under braking a front axle supports [%]; of a rear axle it is minus the anti-lift.

    Parameters
    ----------
    support_angle : array-like
        Of the contact point (brake outboard) or the centre (inboard) [deg], positive for a path up and forwards.
    wheelbase, height : float
        Wheelbase, and height of the centre of gravity, in one unit.
    share : float
        Part of the braking force that acts on this axle.

    Raises
    ------
    InvalidRequest
        If something is no number, or a length not above 0.
    """
    angle, part = np.radians(array("support_angle", support_angle)), number("share", share)
    return np.asarray(100 * np.tan(angle) * part * positive("wheelbase", wheelbase) / positive("height", height))
