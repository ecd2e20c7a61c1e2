"""Definitions of the columns of wheels and axles."""

from __future__ import annotations

from collections.abc import Mapping

#: By the name of a column: its unit (``"length"`` is that of the mechanism), and its meaning.
WHEEL = {
    "travel": ("length", "height of the wheel centre above the design pose"),
    "toe": ("deg", "positive when the front of the wheel points inwards"),
    "camber": ("deg", "positive when the top of the wheel leans outwards"),
    "recession": ("length", "way of the wheel centre backwards from the design pose"),
    "half track": ("length", "distance of the contact point from the middle plane"),
    "roll centre": ("length", "height above the ground, on the middle plane; travel moves, steering held"),
    "toe gradient": ("deg/length", "change of toe per travel; steering held"),
    "camber gradient": ("deg/length", "change of camber per travel; steering held"),
    "half track gradient": ("length/length", "change of the half track per travel; steering held"),
    "support angle of contact": ("deg", "lean forwards of its path, brake on; travel moves, steering held"),
    "support angle of centre": ("deg", "lean forwards of its path; travel moves, steering held"),
    "screw axis x": ("1", "direction of the instant screw axis; travel moves, steering held"),
    "screw axis y": ("1", "the same, to the left"),
    "screw axis z": ("1", "the same, upwards"),
    "screw axis at x": ("length", "point of that axis next to the wheel centre"),
    "screw axis at y": ("length", "the same, to the left"),
    "screw axis at z": ("length", "the same, upwards"),
    "pitch": ("length/rad", "advance along that axis per radian"),
    "caster": ("deg", "lean backwards of the steering axis; steering moves, spring held"),
    "kingpin inclination": ("deg", "lean inwards of the steering axis; steering moves, spring held"),
    "scrub radius": ("length", "contact point outside the steering axis on the ground; steering moves, spring held"),
    "trail": ("length", "contact point behind the steering axis on the ground; steering moves, spring held"),
}  # fmt: skip


#: The same of an axle with two wheels.
AXLE = {
    "track": ("length", "distance of the contact points across the vehicle"),
    "total toe": ("deg", "sum of both toe angles"),
    "steering angle": ("deg", "mean of both wheels, positive to the left"),
    "roll centre height": ("length", "above the line of the contact points; each wheel travels, steering held"),
    "roll centre offset": ("length", "to the left of the middle plane"),
    "Ackermann": ("%", "toe-out in turns over that of wheels that turn about one point of the rear axle's line"),
    "turning circle": ("length", "diameter of the outer contact point's circle"),
}  # fmt: skip


def heading(name: str, length: str, known: Mapping[str, tuple[str, str]] = WHEEL) -> str:
    """Return the heading of a column, with its unit.

    Parameters
    ----------
    name : str
        A key of `known`.
    length : str
        The unit of length.
    known : mapping
        `WHEEL` or `AXLE`.
    """
    return f"{name} [{known[name][0].replace('length', length)}]"
