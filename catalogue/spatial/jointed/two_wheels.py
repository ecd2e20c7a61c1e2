"""Kinematic characteristics of an axle: track, roll centre, steering geometry."""

from __future__ import annotations

import numpy as np
import pandas as pd

from ...errors import InvalidRequest
from ...given import instance, positive
from ...kinematics.types import Array
from ..geometry.rotation import cross
from .axle import Seat, Wheel, height, motion_in_iso, seat
from .columns import AXLE, heading
from .elements import Scalar
from .frame import make_frame
from .motion import Motion

#: Difference of the slopes of two normals below which they are parallel.
PARALLEL_SLOPES = 1e-12
#: Reason why a pose has no turning circle.
NO_TURNING_CIRCLE = "in some poses the wheels do not turn to one side"


def axle(
    motion: Motion, one: Wheel, other: Wheel, steer: Scalar | None = None, wheelbase: float | None = None
) -> pd.DataFrame:
    """Compute the columns of an axle over a motion, one row per pose.

    Parameters
    ----------
    motion : Motion
    one, other : Wheel
        Wheels on opposite sides of the middle plane.
    steer : scalar, optional
        Scalar that steers both wheels; held in roll.
    wheelbase : float, optional
        For Ackermann and the turning circle, in the unit of length.

    Returns
    -------
    pandas.DataFrame
        `columns.AXLE` says what each column means, ``attrs["reasons"]`` why one is NaN.

    Raises
    ------
    InvalidRequest
        If both wheels are on one side, or the wheelbase is not above 0.
    """
    instance("one", one, Wheel), instance("other", other, Wheel)
    wheels = sorted((one, other), key=lambda wheel: -wheel.beside().max())
    if not wheels[1].beside().max() < 0 < wheels[0].beside().min():
        raise InvalidRequest("the wheels of an axle are on either side of its middle plane")
    seats = [seat(motion, wheel) for wheel in wheels]
    with np.errstate(all="ignore"):
        inwards = [at.toe() for at in seats]
        angles = -np.radians(inwards[0]), np.radians(inwards[1])
        reason, rolling = _roll_columns(motion, wheels, seats, steer)
        reasons = dict.fromkeys(rolling, reason)
        columns = {
            "track": seats[0].contact[1] - seats[1].contact[1],
            "total toe": inwards[0] + inwards[1],
            "steering angle": np.degrees(angles[0] + angles[1]) / 2,
            **rolling,
        }
        if wheelbase is not None:
            base = positive("wheelbase", wheelbase)
            turned = np.where(angles[0] * angles[1] > 0, 1.0, np.nan)
            to_left = angles[0] + angles[1] > 0
            inner = np.abs(np.where(to_left, angles[0], angles[1]))
            outer = np.abs(np.where(to_left, angles[1], angles[0]))
            ideal = np.arctan2(base * np.tan(outer), base - columns["track"] * np.tan(outer))
            columns |= {
                "Ackermann": turned * 100 * (inner - outer) / (ideal - outer),
                "turning circle": turned * 2 * base / np.sin(outer),
            }
            if np.isnan(turned).any():
                reasons |= dict.fromkeys(("Ackermann", "turning circle"), NO_TURNING_CIRCLE)
    unit = motion.mechanism.unit
    table = make_frame(motion, {heading(name, unit, AXLE): column for name, column in columns.items()})
    table.attrs["reasons"] = {heading(name, unit, AXLE): why for name, why in reasons.items() if why}
    return table


def _roll_columns(
    motion: Motion, wheels: list[Wheel], seats: list[Seat], steer: Scalar | None
) -> tuple[str, dict[str, Array]]:
    """Compute the columns of roll, with heave and steering held, and the reason for NaN.

    The roll centre is where the normals to the paths of both contact points meet.
    """
    left, right = map(height, wheels)
    still = [(left + right) / 2, *([steer] if steer else [])]
    every = [
        motion_in_iso(motion, wheel, at.centre, left - right, still) for wheel, at in zip(wheels, seats, strict=True)
    ]
    slopes, levels = [], []
    for at, moved in zip(seats, every, strict=True):
        patch = moved.velocity + cross(moved.spin, at.contact - at.centre)
        slopes.append(patch[1] / patch[2])
        levels.append(at.contact[2] + at.contact[1] * slopes[-1])
    turns, cambers, velocities = zip(*(at.moved(moved) for at, moved in zip(seats, every, strict=True)), strict=True)
    one, two = (at.contact for at in seats)
    across, rise = one[1] - two[1], two[2] - one[2]
    spread, lift = velocities[0][1] - velocities[1][1], velocities[1][2] - velocities[0][2]
    roll = (lift * across - rise * spread) / (across**2 + rise**2)
    parallel = np.isclose(slopes[0], slopes[1], rtol=0, atol=PARALLEL_SLOPES)
    beside = np.where(parallel, np.nan, (levels[0] - levels[1]) / (slopes[0] - slopes[1]))
    ground = one[2] - rise * (beside - one[1]) / across
    return next((moved.reason for moved in every if moved.reason), ""), {
        "roll centre height": levels[0] - slopes[0] * beside - ground,
        "roll centre offset": beside,
        "roll steer": (turns[0] + turns[1]) / 2 / roll,
        "roll camber": (cambers[1] - cambers[0]) / 2 / roll,
    }
