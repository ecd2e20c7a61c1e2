"""The drawing of a mechanism of many bars: bars, joints, slides, wheels and the guided path."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..chains.circuits import ChainCircuits
from ..chains.lengths import pitch_circles
from ..chains.poses import Poses
from ..chains.structure import Structure
from ..guides.kinds import has_stroke
from ..kinematics.types import Complexes, Floats
from ..paper import COUPLER, CRANK, DRIVER, GREY, INK, PATH
from .symbols import Pen

if TYPE_CHECKING:
    from ..guides.own_chain import OwnChain


class ChainDrawing(NamedTuple):
    """Numbers of positions of a motion that are drawn."""

    slide: int = 65  #: largest number of positions from which the travel of a slide is taken
    deviation: int = 257  #: number of positions along the stroke at which the deviation is drawn


DRAWING = ChainDrawing()


@dataclass(frozen=True)
class ChainPicture:
    """Contents of a drawing of a mechanism of many bars.

    Attributes
    ----------
    circuit : ChainCircuits
        One circuit, of the bar with the guided joint.
    point : int
        Number of the guided joint.
    phases : ndarray, shape (m,)
        Phases along the path [rad].
    middle : float
        Phase of the pose [rad].
    ghosts : ndarray, shape (k,)
        Phases of poses to draw faintly [rad].
    position, error : ndarray, shape (d,)
        Positions along the stroke, and the deviations there [length]; empty without a stroke.
    """

    circuit: ChainCircuits
    point: int
    phases: Floats
    middle: float
    ghosts: Floats
    position: Floats = field(default_factory=lambda: np.empty(0))
    error: Floats = field(default_factory=lambda: np.empty(0))

    @classmethod
    def of(cls, guide: OwnChain) -> ChainPicture:
        """Return the drawing of a mechanism: its pose, path and ghosts, in its unit."""
        low, middle, high = guide.drawn
        samples = guide.samples(low, high)
        shown = cls(guide.circuit, guide.read.point, samples.polyline([0]), middle, np.empty(0))
        if not has_stroke(guide):
            return shown
        z = shown.along(samples.rows(np.linspace(0, 1, DRAWING.deviation)))
        position = ((z - guide.frame.origin) * guide.frame.direction.conjugate()).real
        return replace(shown, ghosts=np.array([low, high]), position=position, error=guide.deviations(z))

    @property
    def structure(self) -> Structure:
        """Structure of the mechanism."""
        return self.circuit.chain.structure

    def along(self, phases: Floats) -> Complexes:
        """Compute the guided joint at phases (m,) [length]."""
        return self.circuit.poses(phases[:, None]).joint(self.point)[:, 0]

    @cached_property
    def path(self) -> Complexes:
        """Points of the path, (m,) [length]."""
        return self.along(self.phases)

    @cached_property
    def at(self) -> Poses:
        """The pose, then the ghosts."""
        return self.circuit.poses(np.append(self.middle, self.ghosts)[:, None])

    @cached_property
    def shown(self) -> Complexes:
        """Positions of the joints in the pose and the ghosts, (j, 1 + k) [length]."""
        return np.array([self.at.joint(j)[:, 0] for j in range(len(self.structure.joints))])

    @property
    def places(self) -> Complexes:
        """Places of the joints in the pose, (j,) [length]."""
        return self.shown[:, 0]

    @property
    def box(self) -> tuple[float, float, float, float]:
        """x0, y0, x1, y1 of all that is drawn [length]."""
        structure, places = self.structure, self.shown[:, 0]
        wheels = [circle for gear in structure.gears for circle in pitch_circles(structure, gear, places)]
        rims = [centre + radius * way for _, centre, radius in wheels for way in (1, 1j, -1, -1j)]
        z = np.concatenate([self.path, self.shown.ravel(), rims])
        return float(z.real.min()), float(z.imag.min()), float(z.real.max()), float(z.imag.max())


def put_chain(pen: Pen, one: ChainPicture) -> None:
    """Draw path, ghosts, wheels, bars and joints with a pen."""
    shown = one.shown
    _path(pen, one)
    for ghost in range(1, 1 + len(one.ghosts)):
        _bars(pen, one, one.at, shown[:, ghost], ghost, f"ghost-{ghost}-", ghost=True)
    _wheels(pen, one, shown[:, 0])
    _bars(pen, one, one.at, shown[:, 0], 0, "")
    _joints(pen, one, shown[:, 0])


def put_ground(pen: Pen, one: ChainPicture) -> None:
    """Draw the path with a pen, behind poses of a film."""
    _path(pen, one)


def put_pose(pen: Pen, one: ChainPicture, pose: int) -> None:
    """Draw bars, wheels and joints in a pose: 0, or the number of a ghost."""
    z = one.shown[:, pose]
    _wheels(pen, one, z)
    _bars(pen, one, one.at, z, pose, "")
    _pins(pen, one, z)


def _path(pen: Pen, one: ChainPicture) -> None:
    pen.line(one.path, "path", color=PATH, linewidth=1.8, zorder=7)


def _bars(pen: Pen, one: ChainPicture, at: Poses, z: Complexes, pose: int, prefix: str, *, ghost: bool = False) -> None:
    """Draw the moving bars in one pose."""
    structure = one.structure
    for number, (name, joints) in enumerate(structure.bars):
        if number == structure.frame:
            continue
        guided = structure.joints[one.point] in joints
        colour = DRIVER if name == structure.drive else COUPLER if guided else CRANK
        corners = z[[structure.joints.index(joint) for joint in joints]]
        if len(corners) > 1:
            pen.link(corners, f"{prefix}{name}", colour, ghost=ghost, zorder=1 if ghost else 4)
    for number, slide in enumerate(structure.slides):
        rail, slider = structure.number(slide.first), structure.number(slide.second)
        along = complex(at.turn[rail, pose, 0] * one.circuit.chain.u[number, 0])
        if not ghost:
            _rail(pen, one, at, number, along, pose)
        pen.block(
            complex(at.at[slider, pose, 0]),
            f"{prefix}block-{slide.second}",
            along,
            CRANK,
            ghost=ghost,
            zorder=1 if ghost else 5,
        )


def _rail(pen: Pen, one: ChainPicture, shown: Poses, number: int, along: complex, pose: int) -> None:
    """Draw the line of a slide over the motion, from the joints of its bar."""
    structure, slide = one.structure, one.structure.slides[number]
    rail, slider = structure.number(slide.first), structure.number(slide.second)
    step = max(1, len(one.phases) // DRAWING.slide)
    run = [one.circuit.poses(one.phases[::step, None]).way(number)[:, 0]]
    start = complex(shown.at[slider, pose, 0]) - along * float(shown.way(number)[pose, 0])
    if rail != structure.frame:
        held = [j for j, bars in enumerate(structure.on) if rail in bars]
        run.append(np.array([((shown.joint(j)[pose, 0] - start) / along).real for j in held]))
    every, spare = np.concatenate(run), 16 * pen.point
    ends = start + along * np.array([every.min() - spare, every.max() + spare])
    if rail == structure.frame:
        pen.hatched(complex(ends[0]), complex(ends[1]), -1j * along, f"rail-{number}")
    else:
        pen.line(ends, f"rail-{number}", color=CRANK, linewidth=1.3, zorder=3.5)


def _joints(pen: Pen, one: ChainPicture, z: Complexes) -> None:
    """Draw pins, bearings and the guided point, with names."""
    _pins(pen, one, z)
    for number, (name, bars) in enumerate(zip(one.structure.joints, one.structure.on, strict=True)):
        pen.name(complex(z[number]), name, f"name-{name}", GREY if one.structure.frame in bars else INK)


def _pins(pen: Pen, one: ChainPicture, z: Complexes) -> None:
    """Draw pins, bearings and the guided point."""
    structure = one.structure
    for number, (name, bars) in enumerate(zip(structure.joints, structure.on, strict=True)):
        place = complex(z[number])
        if structure.frame in bars and len(bars) > 1:
            pen.ground(place, f"ground-{name}", -1j)
        if len(bars) > 1:
            pen.pivot(place, f"joint-{name}")
        if number == one.point:
            pen.dot(place, f"guided-{name}", PATH)


def _wheels(pen: Pen, one: ChainPicture, z: Complexes) -> None:
    """Draw the pitch circles of gears."""
    structure = one.structure
    for number, gear in enumerate(structure.gears):
        for name, centre, radius in pitch_circles(structure, gear, z):
            circle = centre + radius * np.exp(2j * np.pi * np.arange(181) / 180)
            style: Any = {"color": CRANK, "linewidth": 1.0, "linestyle": (0, (6, 2, 1, 2)), "zorder": 2}
            pen.line(circle, f"wheel-{number}-{name}", **style)
