"""A machine to draw: bodies in poses, supports and lines, independent of paper.

Linkages of two dyads and mechanisms of many bars both have this form. `pen_machine` draws it by
matplotlib, `svg_machine` as animated SVG.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..kinematics.types import Complexes, Floats
from .symbols import BLOCK


class LineKind(StrEnum):
    """Kinds of lines: paths of guided and further points, and arcs of cranks."""

    PATH = "path"  #: path of the guided point
    TRACE = "trace"  #: path of a further point of the coupler
    TURN = "turn"  #: path of the guided point over the turn of a crank
    BEYOND = "beyond"  #: path of the guided point beyond its stroke
    SWEEP = "sweep"  #: arc on which the tip of a crank moves


class JointKind(StrEnum):
    """Kinds of joints and points."""

    PIN = "pin"
    GUIDED = "guided"  #: the guided point
    SECOND = "second"  #: a further point of the coupler
    NAMED = "named"  #: a point of which only the name is drawn


class Role(StrEnum):
    """Role of a link in its machine."""

    CRANK = "crank"
    DRIVER = "driver"
    COUPLER = "coupler"
    OUTPUT = "output"
    BAR = "bar"


class Plate(NamedTuple):
    """A link: a plate with round ends about its corners.

    Attributes
    ----------
    name : str
    role : Role
    corners : complex ndarray, shape (k,)
        Corners in the body's frame [length].
    beyond : complex ndarray, shape (k,), optional
        Outward displacement of each corner in a drawing, for a block that runs past it [pt].
    is_slim : bool
        Whether it is drawn as slim as the line of a slide.
    """

    name: str
    role: Role
    corners: Complexes
    beyond: Complexes | None = None
    is_slim: bool = False

    def drawn(self, point: float) -> Complexes:
        """Return the corners to draw, where `point` is the length of a point of paper [length]."""
        return self.corners if self.beyond is None else self.corners + point * self.beyond


class Block(NamedTuple):
    """A sliding block about the origin of its body; `along` is a unit vector."""

    name: str
    along: complex


class Wheel(NamedTuple):
    """The pitch circle of a gear: centre in the body's frame, and radius [length]."""

    name: str
    centre: complex
    radius: float

    @property
    def rim(self) -> Complexes:
        """Four points of the circle [length]."""
        return np.asarray(self.centre + self.radius * np.array([1, 1j, -1, -1j]), complex)


class Label(NamedTuple):
    """Name of a joint in its three notations.

    Attributes
    ----------
    name : str
        Name of its SVG element.
    text : str
        Plain text.
    math : str
        Text in matplotlib's notation.
    is_fixed : bool
        Whether the joint is a fixed pivot.
    """

    name: str
    text: str
    math: str
    is_fixed: bool


class Joint(NamedTuple):
    """A pin or point: its place in the frame of its body [length]."""

    name: str
    kind: JointKind
    place: complex
    label: Label | None = None


@dataclass(frozen=True)
class Body:
    """A rigid body in m poses.

    Attributes
    ----------
    name, kind : str
        Name of the body, and its class in an animated drawing.
    at : complex ndarray, shape (m,)
        Positions of the origin of its frame [length].
    turn : ndarray, shape (m,), or None
        Angles of its frame, without jumps [rad]; None for a body that is drawn upright.
    shapes : tuple of Plate, Block or Wheel
    joints : tuple of Joint
    """

    name: str
    kind: str
    at: Complexes
    turn: Floats | None = None
    shapes: tuple[Plate | Block | Wheel, ...] = ()
    joints: tuple[Joint, ...] = ()

    def places(self, z: Complexes) -> Complexes:
        """Compute points of the body's frame, shape (k,), in all poses, (m, k) [length]."""
        turned = np.ones(len(self.at)) if self.turn is None else np.exp(1j * self.turn)
        return np.asarray(self.at[:, None] + turned[:, None] * np.ravel(z))

    def only(self, poses: list[int]) -> Body:
        """Return the body in some of its poses."""
        return replace(self, at=self.at[poses], turn=None if self.turn is None else self.turn[poses])

    @property
    def stands(self) -> bool:
        """Whether the body does not move."""
        return not np.ptp(self.at) and (self.turn is None or not np.ptp(self.turn))


class Bearing(NamedTuple):
    """The support of a fixed pivot."""

    name: str
    at: complex


class Rail(NamedTuple):
    """The support of a slider: ends of its travel (2,) [length], and unit normal off the slider."""

    name: str
    ends: Complexes
    side: complex

    def drawn(self, point: float) -> Complexes:
        """Return the ends to draw, beside the block; `point` is a point of paper [length]."""
        way = self.ends[1] - self.ends[0]
        # a slider that hardly moves has no direction of its own
        along = 1j * self.side * (-1 if (way * np.conj(1j * self.side)).real < 0 else 1)
        spare = (BLOCK[0] + 7) * along * np.array([-1, 1]) + BLOCK[1] * self.side
        return np.asarray(self.ends + point * spare)


class Drive(NamedTuple):
    """A driving crank: its fixed pivot [length], and its angles in the poses, (m,) [rad]."""

    centre: complex
    angle: Floats


class Line(NamedTuple):
    """A line through points [length]; `kind` determines its style."""

    name: str
    kind: LineKind
    z: Complexes


@dataclass(frozen=True)
class Machine:
    """A machine in m poses, with its supports and lines.

    Attributes
    ----------
    bodies : tuple of Body
        From the back to the front.
    supports : tuple of Bearing, Rail or Wheel
    lines : tuple of Line
        Lines, including the path of the guided point.
    middle : int
        Index of the pose of a still.
    drive : Drive, optional
        None without a driving crank.
    ghosts : dict of str to int
        Names and indices of the poses that a still shows as ghosts.
    """

    bodies: tuple[Body, ...]
    supports: tuple[Bearing | Rail | Wheel, ...]
    lines: tuple[Line, ...]
    middle: int
    drive: Drive | None = None
    ghosts: dict[str, int] = field(default_factory=dict)

    @property
    def path(self) -> Complexes:
        """Path of the guided point, (p,) [length]."""
        return next(line.z for line in self.lines if line.kind == LineKind.PATH)

    @property
    def joints(self) -> Iterator[tuple[Joint, Complexes]]:
        """Each joint with its positions in the poses, (m,) [length]."""
        for body in self.bodies:
            for joint in body.joints:
                yield joint, body.places(np.array([joint.place]))[:, 0]

    @property
    def plates(self) -> Iterator[tuple[Plate, Complexes]]:
        """Each plate with the positions of its corners in the poses, (m, k) [length]."""
        for body in self.bodies:
            for shape in body.shapes:
                if isinstance(shape, Plate):
                    yield shape, body.places(shape.corners)

    @property
    def places(self) -> Complexes:
        """Places of the pins and points in the pose of a still, (k,) [length]."""
        return np.array([at[self.middle] for _, at in self.joints])

    @cached_property
    def extent(self) -> Complexes:
        """All places to which a drawing must reach [length]."""
        every = [line.z for line in self.lines]
        every += [at for _, at in self.joints]
        every += [corners.ravel() for _, corners in self.plates]
        every += [one.rim for one in self.supports if isinstance(one, Wheel)]
        every += [body.places(one.rim) for body in self.bodies for one in body.shapes if isinstance(one, Wheel)]
        z = np.concatenate([np.ravel(part) for part in every])
        return np.asarray(z[np.isfinite(z)])

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Bounding box x0, y0, x1, y1 of all places [length]."""
        z = self.extent
        return float(z.real.min()), float(z.imag.min()), float(z.real.max()), float(z.imag.max())
