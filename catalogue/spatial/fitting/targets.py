"""Targets and bounds of a fit: quantities read off sweeps, with tolerances."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...errors import InvalidRequest, quoted
from ...given import Stated, array, instance, number, positive, several
from ...kinematics.types import Array
from ..jointed.elements import Link, Scalar
from ..jointed.motion import Motion

#: Function of a motion: a number (s,) or a vector (s, k) per pose that depends on this pose only.
Reading = Callable[[Motion], Any]


@dataclass(frozen=True, eq=False)
class Sweep(Stated):
    """Arguments of `Mechanism.sweep`: drive, values and held scalars."""

    drive: Scalar
    values: Any
    hold: Sequence[Scalar] = ()

    def __post_init__(self) -> None:
        array("values of a Sweep", self.values, (None,), finite=True)
        instance("Sweep.drive", self.drive, Scalar)
        object.__setattr__(self, "hold", several("Sweep.hold", self.hold, Scalar))


@dataclass(frozen=True, eq=False)
class Target(Stated):
    """A target curve.

    Parameters
    ----------
    name : str
    reading : callable
        Function of a motion that returns the compared quantity, (s,) or (s, k): ``lambda m:
        kinematics(m, wheel)["toe [deg]"]``.
    over : Sweep
    value : float or array-like
        Target value, constant or one for each value of the drive, in the unit of the reading.
    tolerance : float
        Deviation that counts as 1, in the unit of the reading: the inverse of a weight.  The
        objective has the mean square of the deviations.
    offset : bool
        Whether a constant difference is ignored, such as a different zero.
    unit : str
        Unit of the reading, for headings.
    """

    name: str
    reading: Reading
    over: Sweep
    value: Any = 0.0
    tolerance: float = 1.0
    offset: bool = False
    unit: str = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        instance(f"{self.name}: over", self.over, Sweep)
        positive(f"{self.name}: tolerance", self.tolerance)

    def deviations(self, read: Array) -> Array:
        """Return deviations (n, s, k) of readings (n, s, k), in their unit."""
        off = read - self.values(read.shape[1:])
        return np.asarray(off - off.mean(1, keepdims=True)) if self.offset else off

    def values(self, shape: tuple[int, ...]) -> Array:
        """Return the target values, of a shape that broadcasts to (s, k)."""
        value = array(f"{self.name}: values", self.value, finite=True)
        if value.ndim == 1 and len(value) == shape[0]:
            value = value[:, None]
        try:
            np.broadcast_to(value, shape)
        except ValueError:
            raise InvalidRequest(
                f"{self.name}: values of shape {np.shape(self.value)} for readings of shape {shape}"
            ) from None
        return value


@dataclass(frozen=True, eq=False)
class Bound(Stated):
    """Limits of a reading at every pose.

    `tolerance` is the excess that counts as 1, like the tolerance of a target.
    """

    name: str
    reading: Reading
    over: Sweep
    least: float = field(default=-np.inf)
    most: float = field(default=np.inf)
    tolerance: float = 1.0
    unit: str = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        instance(f"{self.name}: over", self.over, Sweep)
        positive(f"{self.name}: tolerance", self.tolerance)
        if not self.least <= self.most or (np.isinf(self.least) and np.isinf(self.most)):
            raise InvalidRequest(f"{self.name}: a bound needs least or most, and least not above most")

    def excess(self, read: Array) -> Array:
        """Return the excesses (n, s, k or 2 k) of readings (n, s, k)."""
        sides = [
            side for end, side in ((self.least, self.least - read), (self.most, read - self.most)) if np.isfinite(end)
        ]
        return np.concatenate(sides, axis=2)


# -- readings ----------------------------------------------------------------------------------
def link_length(motion: Motion, link: str) -> Array:
    """Return the length of a link, repeated for every pose, (s,)."""
    instance("link", link, str)
    for x in instance("motion", motion, Motion).mechanism.elements:
        if isinstance(x, Link) and x.name == link:
            e = np.asarray(x.to, float) - np.asarray(x.from_, float)
            return np.asarray(np.broadcast_to(np.sqrt((e * e).sum(-1)), motion.drive.shape))
    raise InvalidRequest(f"there is no link named {quoted(link)}")


def off_line(points: Any, at: Any, along: Any) -> Array:
    """Return the shortest vectors (s, 3) from a line through `at` to points (s, 3)."""
    x, e = array("points", points, (..., 3)) - array("at", at, (3,)), _direction("along", along)
    return np.asarray(x - (x @ e)[..., None] * e / (e @ e))


def off_circle(points: Any, centre: Any, axis: Any, radius: float) -> Array:
    """Return distances (s, 2) of points from a circle, radial and axial."""
    x, e = array("points", points, (..., 3)) - array("centre", centre, (3,)), _direction("axis", axis)
    e = e / np.sqrt(e @ e)
    height = x @ e
    flat = x - height[..., None] * e
    return np.stack([np.sqrt((flat * flat).sum(-1)) - number("radius", radius), height], axis=-1)


def _direction(name: str, given: Any) -> Array:
    found = array(name, given, (3,), finite=True)
    if not found.any():
        raise InvalidRequest(f"{name} is no direction: its length is 0")
    return found
