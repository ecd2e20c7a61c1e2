"""Definitions of the columns of wheels, axles and vehicles."""

from __future__ import annotations

from collections.abc import Mapping

_TRAVELS = "travel moves, steering held"
_STEERS = "steering moves, spring held"
_ROLLS = "wheels travel oppositely, heave and steering held"

#: Unit and meaning of each column.  ``length`` is the unit of the mechanism, ``steer`` that of the
#: steering scalar.
WHEEL = {
    "travel": ("length", "height of the wheel centre above the design pose"),
    "toe": ("deg", "positive when the front of the wheel points inwards"),
    "camber": ("deg", "positive when the top of the wheel leans outwards"),
    "recession": ("length", "way of the wheel centre backwards from the design pose"),
    "half track": ("length", "distance of the contact point from the middle plane"),
    "roll centre": ("length", f"height above the ground, on the middle plane; {_TRAVELS}"),
    "toe gradient": ("deg/length", f"change of toe per travel; {_TRAVELS}"),
    "camber gradient": ("deg/length", f"change of camber per travel; {_TRAVELS}"),
    "half track gradient": ("length/length", f"change of the half track per travel; {_TRAVELS}"),
    "support angle of contact": ("deg", f"lean forwards of its path, brake on; {_TRAVELS}"),
    "support angle of centre": ("deg", f"lean forwards of its path; {_TRAVELS}"),
    "screw axis x": ("1", f"direction of the instant screw axis; {_TRAVELS}"),
    "screw axis y": ("1", f"its part to the left; {_TRAVELS}"),
    "screw axis z": ("1", f"its part upwards; {_TRAVELS}"),
    "screw axis at x": ("length", f"point of that axis next to the wheel centre; {_TRAVELS}"),
    "screw axis at y": ("length", f"its part to the left; {_TRAVELS}"),
    "screw axis at z": ("length", f"its part upwards; {_TRAVELS}"),
    "pitch": ("length/rad", f"advance along that axis per radian; {_TRAVELS}"),
    "caster": ("deg", f"lean backwards of the steering axis; {_STEERS}"),
    "kingpin inclination": ("deg", f"lean inwards of the steering axis; {_STEERS}"),
    "scrub radius": ("length", f"contact point outside the steering axis; {_STEERS}"),
    "trail": ("length", f"contact point behind the steering axis, on the ground; {_STEERS}"),
    "kingpin offset": ("length", f"wheel centre outside the steering axis, at its height; {_STEERS}"),
    "caster offset": ("length", f"wheel centre behind the steering axis, at its height; {_STEERS}"),
    "steering gradient": ("deg/steer", f"turn of the wheel to the left per steering; {_STEERS}"),
    "camber by steering": ("deg/deg", f"change of camber per turn of the wheel to the left; {_STEERS}"),
}

#: Columns of an axle with two wheels.
AXLE = {
    "track": ("length", "distance of the contact points across the vehicle"),
    "total toe": ("deg", "sum of both toe angles"),
    "steering angle": ("deg", "mean of both wheels, positive to the left"),
    "roll centre height": ("length", f"above the line of the contact points; {_ROLLS}"),
    "roll centre offset": ("length", f"to the left of the middle plane; {_ROLLS}"),
    "roll steer": ("deg/deg", f"steering angle per roll of the body to the right; {_ROLLS}"),
    "roll camber": ("deg/deg", f"camber of the outer wheel to the body per roll, mean of both; {_ROLLS}"),
    "Ackermann": ("%", "toe-out in turns over that of wheels that turn about one point of the rear axle's line"),
    "turning circle": ("length", "diameter of the outer contact point's circle"),
}

#: Columns of an axle in its vehicle.
VEHICLE = {
    "anti-dive": ("%", f"of a front axle while braking; {_TRAVELS}"),
    "braking anti-lift": ("%", f"of a rear axle while braking; {_TRAVELS}"),
    "driving anti-lift": ("%", f"of a front axle that drives; {_TRAVELS}"),
    "anti-squat": ("%", f"of a rear axle that drives; {_TRAVELS}"),
    "roll axis": ("deg", "fall forwards of the line through the roll centres of both axles"),
}

#: Headings of these groups, as help and reports show them.
GROUPS = {
    "Columns of a wheel": WHEEL,
    "Columns of an axle with two wheels": AXLE,
    "Columns of an axle in its vehicle": VEHICLE,
}
#: Remark under them.
REMARK = (
    "Spring held: the spring that the file names, else the arms on revolute joints that carry the wheel, else "
    "the height of the wheel centre. Both wheels of a rigid axle travel together."
)


def heading(
    name: str,
    length: str,
    known: Mapping[str, tuple[str, str]] = WHEEL,
    steer: str = "steer",
) -> str:
    """Return the heading of a column, with its unit.

    Parameters
    ----------
    name : str
        A key of `known`.
    length : str
        The unit of length.
    known : mapping
        `WHEEL`, `AXLE` or `VEHICLE`.
    steer : str
        The unit of the steering scalar.
    """
    return f"{name} [{known[name][0].replace('length', length).replace('steer', steer)}]"
