"""What the two wheels of an axle do together: track, roll centre, steering geometry."""

from __future__ import annotations

import numpy as np
import pandas as pd

from ...errors import InvalidRequest
from ...given import instance, positive
from .axle import Wheel, contact_point, kinematics
from .columns import AXLE, heading
from .elements import Scalar
from .frame import framed
from .motion import Motion


def axle(
    motion: Motion, one: Wheel, other: Wheel, steer: Scalar | None = None, wheelbase: float | None = None
) -> pd.DataFrame:
    """Compute the columns of an axle over a motion, one row per pose.

    Parameters
    ----------
    motion : Motion
    one, other : Wheel
        On either side of the middle plane.
    steer : scalar, optional
        What steers both wheels; it is held where travel moves one.
    wheelbase : float, optional
        For Ackermann and the turning circle, in the unit of length.

    Returns
    -------
    pandas.DataFrame
        `columns.AXLE` says what each column means.

    Raises
    ------
    InvalidRequest
        If both wheels are on one side, or the wheelbase is not above 0.
    """
    instance("one", one, Wheel), instance("other", other, Wheel)
    unit = motion.mechanism.unit
    tables = [kinematics(motion, wheel, steer) for wheel in (one, other)]
    contacts = [contact_point(motion, wheel)[2] for wheel in (one, other)]
    if not (contacts[0][:1, 1] * contacts[1][:1, 1] < 0).all() and np.isfinite(contacts[0][:1, 1]).all():
        raise InvalidRequest("the wheels of an axle are on either side of its middle plane")
    left, right = (0, 1) if contacts[0][0, 1] > contacts[1][0, 1] else (1, 0)
    toe = [tables[k][heading("toe", unit)].to_numpy() for k in (left, right)]
    rise = [tables[k][heading("roll centre", unit)].to_numpy() for k in (left, right)]
    (y1, z1), (y2, z2) = ((contacts[k][:, 1], contacts[k][:, 2]) for k in (left, right))
    with np.errstate(all="ignore"):
        beside = (z1 + rise[0] - z2 - rise[1]) / (rise[0] / y1 - rise[1] / y2)
        beside = np.where(np.isclose(rise[0] / y1, rise[1] / y2, rtol=0, atol=1e-12), np.nan, beside)
        ground = z1 + (z2 - z1) * (beside - y1) / (y2 - y1)
        angles = -np.radians(toe[0]), np.radians(toe[1])
        columns = {
            "track": y1 - y2,
            "total toe": toe[0] + toe[1],
            "steering angle": np.degrees(angles[0] + angles[1]) / 2,
            "roll centre height": z1 + rise[0] * (1 - beside / y1) - ground,
            "roll centre offset": beside,
        }
        if wheelbase is not None:
            base = positive("wheelbase", wheelbase)
            to_left = angles[0] + angles[1] > 0
            inner = np.abs(np.where(to_left, angles[0], angles[1]))
            outer = np.abs(np.where(to_left, angles[1], angles[0]))
            ideal = np.arctan2(base * np.tan(outer), base - columns["track"] * np.tan(outer))
            columns |= {
                "Ackermann": 100 * (inner - outer) / (ideal - outer),
                "turning circle": 2 * base / np.sin(outer),
            }
    return framed(motion, {heading(name, unit, AXLE): column for name, column in columns.items()})
