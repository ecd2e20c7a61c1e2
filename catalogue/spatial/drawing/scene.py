"""Contents of a picture of a mechanism, in the user's unit.

The first axis of arrays counts poses; the first pose is drawn in full, others as ghosts.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ...kinematics.types import Array

#: Length of an axis beyond its joint [sizes of the scene].
AXIS_OVERHANG = 0.045


@dataclass(frozen=True)
class Link:
    """A link with ball joints: its ends (p, 2, 3)."""

    name: str
    ends: Array


@dataclass(frozen=True)
class Body:
    """A body: its points (p, k, 3) and rods, such as arms of a cross, (p, r, 2, 3)."""

    name: str
    points: Array
    rods: Array


@dataclass(frozen=True)
class Axis:
    """The axis of a joint: one or two points (p, 1 or 2, 3), direction (p, 3), kind of motion."""

    points: Array
    direction: Array
    turns: bool
    slides: bool

    def ends(self, size: float) -> Array:
        """Return the ends of the symbol, (p, 2, 3)."""
        more = AXIS_OVERHANG * size * (1.6 if self.slides else 1.0) * self.direction
        return np.stack([self.points[:, 0] - more, self.points[:, -1] + more], axis=1)


@dataclass(frozen=True)
class Scene:
    """A mechanism in some of its poses.

    Attributes
    ----------
    balls : ndarray, shape (p, b, 3)
        Ball joints; `fixed` (f, 3) are fixed points.
    curves, patches : list of (str, ndarray), shape (p, m, 3), (p, m, m, 3)
        Guides, by name.
    rings : list of ndarray, shape (p, m, 3)
        Wheels.
    paths : dict
        Paths of points (s, 3), by name.
    title, note : str
    unit : str
    """

    links: list[Link]
    bodies: list[Body]
    axes: list[Axis]
    balls: Array
    fixed: Array
    curves: list[tuple[str, Array]]
    patches: list[tuple[str, Array]]
    rings: list[Array]
    paths: dict[str, Array]
    title: str
    note: str
    unit: str
    places: Array = field(init=False)

    def __post_init__(self) -> None:
        parts = [
            *(x.ends for x in self.links),
            *(x.points for x in self.bodies),
            *(x.points for x in self.axes),
            *(x.rods for x in self.bodies),
            self.balls,
            self.fixed,
            *(v for _, v in (*self.curves, *self.patches)),
            *self.rings,
            *self.paths.values(),
        ]
        every = np.concatenate([np.zeros((0, 3)), *(np.reshape(v, (-1, 3)) for v in parts)])
        object.__setattr__(self, "places", every[np.isfinite(every).all(1)])

    @property
    def size(self) -> float:
        """The largest side of the box about all that is shown."""
        return float(np.ptp(self.places, axis=0).max()) or 1.0
