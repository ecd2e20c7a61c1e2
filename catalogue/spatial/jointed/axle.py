"""Kinematic characteristics of a wheel: toe, camber, steering axis, support angles.

Columns are in the vehicle axes of ISO 8855, also where points are given in others: x forward, y to
the left, z up; the middle plane of the vehicle is y = 0.  Angles are in degrees.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas as pd

from ...errors import InvalidRequest, quoted
from ...given import Stated, choice, instance, several
from ...kinematics.types import Array
from ..geometry.rotation import cross
from .columns import heading
from .elements import Joint, Revolute, Scalar, Spherical, Travel, Vector
from .frame import make_frame
from .hard_points import numbers
from .instant import Instant, instant
from .motion import Motion

#: Factors that convert coordinates in vehicle axes to ISO 8855: x forward, y to the left, z up.
AXES = {
    "ISO 8855": (1.0, 1.0, 1.0),
    "SAE": (1.0, -1.0, -1.0),
    "x rearwards": (-1.0, -1.0, 1.0),
}
#: Sides of the vehicle.
SIDES = ("left", "right")
#: Least height of the wheel centre above its contact point [radii]; camber and caster reduce it by
#: less.
MIN_CONTACT_DEPTH = 0.9
#: Largest error of the contact point's distance [radii]: hard points are given to a millimetre.
MAX_CONTACT_ERROR = 0.02


@dataclass(frozen=True)
class Wheel(Stated):
    """A wheel on its carrier, in the design pose.

    Parameters
    ----------
    carrier : str
        The body that carries it.
    centre : array-like, shape (3,), or (n, 3) of a batch
    axis : array-like, shape (3,), or (n, 3)
        Direction of the axis of rotation; either sense.
    radius : float
        Radius of the tyre under load; 0: the distance of `contact` from the centre.
    contact : array-like, shape (3,), optional
        Contact point of the tyre on the ground, in the design pose; one radius below the centre.
    axes : str
        Vehicle axes of all given points, a key of `AXES`.
    side : str, optional
        ``"left"`` or ``"right"``; must agree with the axes.

    Raises
    ------
    InvalidRequest
        If axes, side, contact and centre contradict each other, or the radius is not above 0.

    Examples
    --------
    >>> Wheel("wheel", (0, 760, 0), (0, 1, 0), contact=(0, 765, -310), side="left")
    """

    carrier: str
    centre: Vector
    axis: Vector
    radius: float = 0.0
    contact: Vector | None = None
    axes: str = "ISO 8855"
    side: str = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.axes not in AXES:
            raise InvalidRequest(f"axes must be one of {', '.join(AXES)}, not {quoted(self.axes)}")
        if self.side:
            left = choice("side", self.side, SIDES) == "left"
            if not ((self.beside() > 0) == left).all():
                raise InvalidRequest(f"a {self.side} wheel is on the other side in axes {self.axes}: state the axes")

    @property
    def signs(self) -> Array:
        """Factors (3,) that convert coordinates in `axes` to ISO 8855."""
        return np.array(AXES[self.axes])

    def beside(self) -> Array:
        """Return the centre's distance to the left of the middle plane, (1,) or (n,)."""
        return np.asarray(numbers(self.centre, "Wheel.centre")[:, 1] * self.signs[1])

    def rolling_radius(self) -> float:
        """Return the radius, checked against the contact point."""
        if self.contact is None:
            return self.radius
        down = (numbers(self.contact, "Wheel.contact") - numbers(self.centre, "Wheel.centre"))[0] * self.signs
        far = float(np.sqrt(down @ down))
        if not down[2] < -MIN_CONTACT_DEPTH * far:
            raise InvalidRequest(f"the contact point is not below the wheel centre in axes {self.axes}: state the axes")
        if self.radius and abs(far - self.radius) > MAX_CONTACT_ERROR * self.radius:
            raise InvalidRequest(f"the contact point is {far:g} from the wheel centre, not the radius {self.radius:g}")
        return self.radius or far

    def outboard(self) -> Array:
        """Return the axis, pointing away from the middle of the vehicle."""
        axis, side = numbers(self.axis, "Wheel.axis"), numbers(self.centre, "Wheel.centre")[:, 1:2]
        across = axis[:, 1:2] * side
        if not (0 < self.rolling_radius() < np.inf and across.all()):
            raise InvalidRequest("a Wheel needs a radius, a centre beside the plane y = 0, and an axis across it")
        out = np.asarray(axis * np.sign(across) / np.sqrt((axis * axis).sum(1, keepdims=True)))
        return out if len(out) > 1 else np.asarray(out[0])


def kinematics(
    motion: Motion,
    wheel: Wheel,
    steer: Scalar | None = None,
    spring: Scalar | Sequence[Scalar] = (),
    beside: Sequence[Scalar] = (),
) -> pd.DataFrame:
    """Compute the columns of a wheel over a motion, one row per pose.

    Parameters
    ----------
    motion : Motion
        Over any drives: travel, steering, a spring, or several of them.
    wheel : Wheel
    steer : scalar, optional
        Scalar that steers the wheel, such as the Joint of the rack; it need not be in the motion.
        Caster, kingpin inclination, scrub radius and trail need it; it is held in wheel travel.
    spring : scalar or sequence of scalars
        Scalars held while the wheel is steered: the Length of the spring, the Joint of an arm.
        Default: the joints of the arms that carry the wheel by ball joints; without such arms the
        height of the wheel centre.
    beside : sequence of scalars
        Scalars held in addition where travel leaves the wheel another freedom, such as the roll of
        a rigid axle.  Default: those that the motion holds.

    Returns
    -------
    pandas.DataFrame
        One row per pose, of a batch indexed by mechanism and pose; `columns.WHEEL` defines the
        columns and the held scalars.  A column is NaN where these do not determine it;
        ``attrs["reasons"]`` says why, by heading.

    Raises
    ------
    InvalidRequest
        If a scalar is not one of the mechanism, or there is neither one wheel nor one per
        mechanism.
    """
    instance("motion", motion, Motion), instance("wheel", wheel, Wheel), instance("steer", steer, Scalar | None)
    springs = (spring,) if isinstance(spring, Scalar) else several("spring", spring, Scalar)
    also = several("beside", beside, Scalar)
    at = seat(motion, wheel)
    design = motion.each(wheel.centre, "Wheel.centre") * wheel.signs
    with np.errstate(all="ignore"):
        columns = {
            "travel": at.centre[2] - design[:, 2],
            "toe": at.toe(),
            "camber": np.degrees(-np.arcsin(at.axis[2])),
            "recession": design[:, 0] - at.centre[0],
            "half track": np.abs(at.contact[1]),
        }
        travelling, in_travel = _travel_columns(motion, wheel, steer, also, at)
        steering, in_steering = _steering_columns(motion, wheel, steer, springs, also, at)
    reasons = dict.fromkeys(in_travel, travelling) | dict.fromkeys(in_steering, steering)
    unit, by = motion.mechanism.unit, unit_of(motion, steer) if steer else ""
    every = columns | in_travel | in_steering
    table = make_frame(motion, {heading(k, unit, steer=by): v for k, v in every.items()})
    table.attrs["reasons"] = {heading(k, unit, steer=by): why for k, why in reasons.items() if why}
    return table


def unit_of(motion: Motion, scalar: Scalar) -> str:
    """Return the unit in which a scalar is shown: that of length, or degrees."""
    return "deg" if motion.function(scalar)[0].angular else motion.mechanism.unit


class Seat(NamedTuple):
    """A wheel over a motion, in ISO 8855.

    Attributes
    ----------
    centre, axis, contact : ndarray, shape (3, s)
        Wheel centre, outward axis of rotation, contact point.
    side : ndarray, shape (s,) or (1,)
        1 on the left, -1 on the right.
    radius : float
    """

    centre: Array
    axis: Array
    contact: Array
    side: Array
    radius: float

    def toe(self) -> Array:
        """Return toe [deg], (s,)."""
        return np.asarray(np.degrees(np.arctan2(self.axis[0], self.side * self.axis[1])))

    def moved(self, motion: Instant) -> tuple[Array, Array, Array]:
        """Compute the rates of steering angle and camber, and the velocity of the contact point.

        Parameters
        ----------
        motion : Instant
            About the wheel centre, in ISO 8855.

        Returns
        -------
        turn, camber : ndarray, shape (s,)
            Rates of the steering angle, positive to the left, and of camber [rad].
        contact : ndarray, shape (3, s)
            Velocity of the contact point, which is not fixed to the wheel [length].
        """
        n, turned = self.axis, cross(motion.spin, self.axis)
        level = 1 - n[2] ** 2
        root = np.sqrt(level)
        down = (self.contact - self.centre) / self.radius
        change = turned * n[2] + n * turned[2]
        across = change - down * (change * down).sum(0)
        turn = (n[0] * turned[1] - n[1] * turned[0]) / level
        return turn, -turned[2] / root, motion.velocity + self.radius / root * across


def seat(motion: Motion, wheel: Wheel) -> Seat:
    """Place a wheel in the poses of a motion."""
    signs, radius = wheel.signs[:, None], wheel.rolling_radius()
    centre = motion.rows(motion.point(wheel.carrier, wheel.centre)).T * signs
    n = motion.rows(motion.direction(wheel.carrier, wheel.outboard())).T * signs
    down = n * n[2]
    down[2] -= 1
    contact = centre + radius / np.sqrt((down * down).sum(0)) * down
    side = np.sign(motion.each(wheel.centre, "Wheel.centre")[:, 1] * wheel.signs[1])
    return Seat(centre, n, contact, side, radius)


def _travel_columns(
    motion: Motion, wheel: Wheel, steer: Scalar | None, beside: Sequence[Scalar], at: Seat
) -> tuple[str, dict[str, Array]]:
    """Compute the columns of wheel travel with the steering held, and the reason for NaN."""
    moved = motion_in_iso(motion, wheel, at.centre, height(wheel), (steer,) if steer else (), beside)
    patch = moved.velocity + cross(moved.spin, at.contact - at.centre)
    along, foot, pitch = axis_of(moved, at.centre)
    turn, camber, rolled = at.moved(moved)
    lean, hub = np.degrees(np.arctan2([patch[0], moved.velocity[0]], [patch[2], moved.velocity[2]]))
    return moved.reason, {
        "roll centre": at.contact[1] * patch[1] / patch[2],
        "toe gradient": np.degrees(-at.side * turn),
        "camber gradient": np.degrees(camber),
        "half track gradient": at.side * rolled[1],
        "support angle of contact": lean,
        "support angle of centre": hub,
        **{f"screw axis {k}": part for part, k in zip(along, "xyz", strict=True)},
        **{f"screw axis at {k}": part for part, k in zip(foot, "xyz", strict=True)},
        "pitch": pitch,
    }


def _steering_columns(
    motion: Motion,
    wheel: Wheel,
    steer: Scalar | None,
    springs: Sequence[Scalar],
    beside: Sequence[Scalar],
    at: Seat,
) -> tuple[str, dict[str, Array]]:
    """Compute the columns of the steering axis with springs held, and the reason for NaN."""
    if steer is None:
        return "", {}
    still = springs or _arm_joints(motion, wheel.carrier) or [height(wheel)]
    moved = motion_in_iso(motion, wheel, at.centre, steer, still, beside)
    along, near, _ = axis_of(moved, at.centre)
    slope = along / along[2]
    foot, hub = (point - near - slope * (point - near)[2] for point in (at.contact, at.centre))
    turn, camber, _ = at.moved(moved)
    per = 1.0 if unit_of(motion, steer) == "deg" else np.degrees(1.0)
    return moved.reason, {
        "caster": np.degrees(-np.arctan(slope[0])),
        "kingpin inclination": np.degrees(-at.side * np.arctan(slope[1])),
        "scrub radius": at.side * foot[1],
        "trail": -foot[0],
        "kingpin offset": at.side * hub[1],
        "caster offset": -hub[0],
        "steering gradient": per * turn,
        "camber by steering": camber / turn,
    }


def height(wheel: Wheel) -> Travel:
    """Return the vertical travel of a wheel centre, positive upwards."""
    return Travel(wheel.carrier, wheel.centre, (0.0, 0.0, wheel.signs[2]))


def motion_in_iso(
    motion: Motion,
    wheel: Wheel,
    centre: Array,
    moving: Scalar,
    still: Sequence[Scalar],
    beside: Sequence[Scalar] = (),
) -> Instant:
    """Compute the motion of a wheel per unit of a scalar, in ISO 8855.

    Scalars `still` are held.  If these leave the wheel another freedom, `beside` are held too, or
    by default the scalars that the motion holds.
    """
    signs = wheel.signs[:, None]
    at = centre * signs
    moved = instant(motion, wheel.carrier, at, moving, still, "the wheel")
    more = [*still, *(beside or motion.held)]
    if moved.reason and len(more) > len(still):
        moved = instant(motion, wheel.carrier, at, moving, more, "the wheel")
    return moved._replace(velocity=moved.velocity * signs, spin=moved.spin * signs)


def _arm_joints(motion: Motion, carrier: str) -> list[Joint]:
    """Return the joints of arms on revolute joints that carry a wheel carrier by ball joints."""
    elements = motion.mechanism.elements
    balls = [x for x in elements if isinstance(x, Spherical) and carrier in (x.body, x.on)]
    beyond = {x.on if x.body == carrier else x.body for x in balls}
    hung = {x.body for x in motion.mechanism.carriers() if isinstance(x, Revolute)}
    return [Joint(body) for body in sorted(beyond & hung)]


def axis_of(moved: Instant, at: Array) -> tuple[Array, Array, Array]:
    """Return the instant screw axis of a body: direction, point next to `at`, both (3, s), pitch.

    For a translation: the direction of the velocity, the point `at`, infinite pitch.
    """
    velocity, spin = moved.velocity, moved.spin
    square = (spin * spin).sum(0)
    with np.errstate(all="ignore"):
        along = spin / np.sqrt(square)
        point = at + cross(spin, velocity) / square
        pitch = (spin * velocity).sum(0) / square
        still = square == 0
        if still.any():
            speed = np.sqrt((velocity * velocity).sum(0))
            along = np.where(still, velocity / speed, along)
            point, pitch = np.where(still, at, point), np.where(still, np.inf, pitch)
    return along, point, pitch
