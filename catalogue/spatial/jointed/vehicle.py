"""Anti-dive, anti-lift, anti-squat and the roll axis: an axle in its vehicle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from ...errors import InvalidRequest
from ...given import Stated, array, choice, instance, number, positive
from ...kinematics.types import Array
from .columns import VEHICLE, heading

#: Positions of an axle in the vehicle.
AXLES = ("front", "rear")
#: Positions of brakes; the torque of inboard ones acts on the body.
BRAKES = ("outboard", "inboard")


@dataclass(frozen=True)
class Vehicle(Stated):
    """Masses and forces of a vehicle, as far as its kinematics need them.

    Parameters
    ----------
    wheelbase : float
        In the unit of the mechanism, like all lengths here.
    axle : str
        ``"front"`` or ``"rear"``: the modelled axle.  Optional if only the wheelbase is given.
    height : float, optional
        Height of the centre of gravity above the ground.
    braking, driving : float, optional
        Shares, 0 to 1, of the braking and of the driving force on this axle.
    brakes : str
        ``"outboard"``, on the carrier, or ``"inboard"``.
    live : bool
        Whether the driving torque acts between wheel and carrier, as in a live axle or a hub motor.
    roll_centre : float, optional
        Height of the roll centre of the other axle above the ground.

    Raises
    ------
    InvalidRequest
        If a length is not above 0, a share is outside 0 to 1, or a value is missing.

    Examples
    --------
    >>> Vehicle(2700, "front", height=550, braking=0.65)
    """

    wheelbase: float
    axle: str = ""
    height: float | None = None
    braking: float | None = None
    driving: float | None = None
    brakes: str = "outboard"
    live: bool = False
    roll_centre: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        positive("wheelbase", self.wheelbase), choice("brakes", self.brakes, BRAKES)
        shares = {k: v for k in ("braking", "driving") if (v := getattr(self, k)) is not None}
        for name, share in shares.items():
            if not 0 <= number(name, share) <= 1:
                raise InvalidRequest(f"{name} must be a share from 0 to 1, not {share:g}")
        if self.height is not None:
            positive("height", self.height)
        if self.roll_centre is not None and not np.isfinite(number("roll_centre", self.roll_centre)):
            raise InvalidRequest("roll_centre must be a finite height")
        if shares and self.height is None:
            raise InvalidRequest("anti-dive, anti-lift and anti-squat need the height of the centre of gravity")
        if self.axle or shares or self.roll_centre is not None:
            choice("axle", self.axle, AXLES)

    def supports(self, contact: Any, centre: Any) -> dict[str, Array]:
        """Compute the shares of dive, lift and squat that the suspension supports.

        Parameters
        ----------
        contact, centre : array-like, shape (s,)
            Support angles of contact point and wheel centre [deg].

        Returns
        -------
        dict of ndarray, shape (s,)
            By the keys of `columns.VEHICLE` [%]; only those with a stated share of force.
        """
        out, ahead = {}, self.axle == "front"
        sign = 1.0 if ahead else -1.0
        if self.braking is not None:
            angle = centre if self.brakes == "inboard" else contact
            out["anti-dive" if ahead else "braking anti-lift"] = sign * self._support(angle, self.braking)
        if self.driving is not None:
            angle = contact if self.live else centre
            out["driving anti-lift" if ahead else "anti-squat"] = sign * self._support(angle, self.driving)
        return out

    def roll_axis(self, roll_centre: Any) -> Array:
        """Compute the inclination of the roll axis, falling forwards [deg].

        Parameters
        ----------
        roll_centre : array-like, shape (s,)
            Height of the roll centre of the moved axle above the ground.
        """
        if self.roll_centre is None:
            raise InvalidRequest("the roll axis needs the height of the other axle's roll centre")
        rise = self.roll_centre - array("roll_centre", roll_centre)
        return np.degrees(np.arctan2(rise if self.axle == "front" else -rise, self.wheelbase))

    def _support(self, angle: Any, share: float) -> Array:
        assert self.height is not None
        return anti_dive(angle, self.wheelbase, self.height, share)


def tabulate_support(vehicle: Vehicle, wheel: pd.DataFrame, unit: str) -> pd.DataFrame:
    """Tabulate the support of a wheel in its vehicle.

    Parameters
    ----------
    vehicle : Vehicle
    wheel : DataFrame
        From `kinematics`.
    unit : str
        The unit of length.

    Returns
    -------
    pandas.DataFrame
        `columns.VEHICLE` says what each column means; NaN for the reasons in ``attrs["reasons"]``.
    """
    names = [heading(f"support angle of {of}", unit) for of in ("contact", "centre")]
    found = instance("vehicle", vehicle, Vehicle).supports(*(wheel[name] for name in names))
    table = pd.DataFrame({heading(name, unit, VEHICLE): np.asarray(v) for name, v in found.items()})
    reason = next((wheel.attrs["reasons"][name] for name in names if name in wheel.attrs["reasons"]), "")
    table.attrs["reasons"] = dict.fromkeys(table.columns, reason) if reason else {}
    return table


def anti_dive(support_angle: Any, wheelbase: float, height: float, share: float) -> Array:
    """Compute the share of the brake dive that a front axle supports [%].

    For a rear axle the result is minus the anti-lift (Reimpell, Stoll and Betzler, The Automotive
    Chassis, 2nd ed., section 6.3).

    Parameters
    ----------
    support_angle : array-like
        Support angle of the contact point (outboard brake) or of the centre (inboard) [deg],
        positive for a path up and forwards.
    wheelbase, height : float
        Wheelbase, and height of the centre of gravity, in one unit.
    share : float
        Part of the braking force that acts on this axle.

    Raises
    ------
    InvalidRequest
        If an argument is no number, or a length is not above 0.

    Examples
    --------
    >>> anti_dive(3.0, wheelbase=2700, height=550, share=0.65)
    """
    angle, part = np.radians(array("support_angle", support_angle)), number("share", share)
    leverage = positive("wheelbase", wheelbase) / positive("height", height)
    return np.asarray(100 * np.tan(angle) * part * leverage)
