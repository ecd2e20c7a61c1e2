"""What each column of a wheel means, and what stands still where it is a rate."""

from __future__ import annotations

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


def heading(name: str, length: str) -> str:
    """Return the heading of a column of a wheel, with its unit.

    Parameters
    ----------
    name : str
        A key of `WHEEL`.
    length : str
        The unit of length.
    """
    return f"{name} [{WHEEL[name][0].replace('length', length)}]"
