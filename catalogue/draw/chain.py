"""The drawing of a mechanism of many bars: bars, joints, slides, wheels and the guided path."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..chains.circuits import ChainCircuits
from ..chains.lengths import pitch_circles
from ..chains.poses import Poses
from ..chains.structure import Structure
from ..kinematics.types import Complexes, Floats
from ..paper import COUPLER, CRANK, DRIVER, GREY, INK, PATH, SANS, SERIF, blank, kind_of, literal, write
from .symbols import Pen

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..guides.own_chain import OwnChain


@dataclass(frozen=True)
class Layout:
    """Layout of the drawing [in].

    Attributes
    ----------
    width, margin, title : float
        Width of the sheet, margin about the drawing, height of its title.
    low, high : float
        Smallest and largest height of the sheet.
    positions : int
        Number of positions of a motion from which the travel of a slide is taken.
    """

    width: float = 8.0
    margin: float = 0.8
    title: float = 0.9
    low: float = 2.5
    high: float = 8.0
    positions: int = 65


PAGE = Layout()


@dataclass(frozen=True)
class ChainPicture:
    """Contents of a drawing of a mechanism of many bars.

    Attributes
    ----------
    circuit : ChainCircuits
        One circuit, of the bar with the guided joint.
    point : int
        Number of the guided joint.
    path : ndarray, shape (m,)
        Phases along the path [rad].
    middle : float
        Phase of the pose [rad].
    ghosts : ndarray, shape (k,)
        Phases of poses to draw faintly [rad].
    title : str
    facts : list of str
    """

    circuit: ChainCircuits
    point: int
    path: Floats
    middle: float
    ghosts: Floats
    title: str
    facts: list[str]

    @classmethod
    def of(cls, guide: OwnChain) -> ChainPicture:
        """Return the drawing of a mechanism: its pose, path and ghosts, in its unit."""
        low, middle, high = guide.drawn
        path = guide.samples(low, high).polyline([0])
        ends = np.array([low, high] if hasattr(guide, "stroke") else [])
        facts = [*guide.facts, f"lengths in {guide.unit}" if guide.unit else ""]
        return cls(guide.circuit, guide.read.point, path, middle, ends, guide.name or "Mechanism", facts)

    @property
    def structure(self) -> Structure:
        """Structure of the mechanism."""
        return self.circuit.chain.structure

    @cached_property
    def curve(self) -> Complexes:
        """Points of the path, (m,) [length]."""
        return self.circuit.poses(self.path[:, None]).joint(self.point)[:, 0]

    @cached_property
    def at(self) -> Poses:
        """The pose, then the ghosts."""
        return self.circuit.poses(np.append(self.middle, self.ghosts)[:, None])

    @cached_property
    def shown(self) -> Complexes:
        """Positions of the joints in the pose and the ghosts, (j, 1 + k) [length]."""
        return np.array([self.at.joint(j)[:, 0] for j in range(len(self.structure.joints))])

    @property
    def box(self) -> tuple[complex, complex]:
        """Lower left and upper right corner of all that is drawn [length]."""
        structure, z = self.structure, self.shown[:, 0]
        wheels = [circle for gear in structure.gears for circle in pitch_circles(structure, gear, z)]
        rims = [centre + radius * way for _, centre, radius in wheels for way in (1, 1j, -1, -1j)]
        every = np.concatenate([self.curve, self.shown.ravel(), rims])
        return complex(every.real.min(), every.imag.min()), complex(every.real.max(), every.imag.max())


def draw_chain(one: ChainPicture, file: str | Path | None = None) -> Figure:
    """Draw a mechanism in one pose, with its path and ghosts.

    Parameters
    ----------
    one : ChainPicture
    file : path, optional
        PNG, SVG or PDF by suffix.
    """
    kind = None if file is None else kind_of(file)
    low, high = one.box
    inner = PAGE.width - 2 * PAGE.margin
    inch = max((high - low).real / inner, (high - low).imag / (PAGE.high - PAGE.title - PAGE.margin))
    height = max(PAGE.low, (high - low).imag / inch + PAGE.title + PAGE.margin)
    figure = blank(PAGE.width, height)
    _title(figure, one, height)
    axes = figure.add_axes((0, 0, 1, (height - PAGE.title + 0.5 * PAGE.margin) / height), gid="mechanism")
    axes.set_axis_off()
    centre = 0.5 * (low + high)
    half = 0.5 * (height - PAGE.title + 0.5 * PAGE.margin) * inch
    axes.set_xlim(centre.real - 0.5 * PAGE.width * inch, centre.real + 0.5 * PAGE.width * inch)
    axes.set_ylim(centre.imag - half, centre.imag + half)
    axes.set_aspect("equal")
    put_chain(Pen(axes, inch / 72), one)
    literal(figure)
    if file is not None and kind is not None:
        write(figure, Path(file), kind)
    return figure


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
    pen.line(one.curve, "path", color=PATH, linewidth=1.8, zorder=7)


def _title(figure: Figure, one: ChainPicture, height: float) -> None:
    figure.text(PAGE.margin / PAGE.width, 1 - 0.4 / height, one.title, family=SERIF, size=15, color=INK)
    figure.text(
        PAGE.margin / PAGE.width, 1 - 0.65 / height, "; ".join(filter(None, one.facts)), family=SANS, size=8, color=GREY
    )


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
    step = max(1, len(one.path) // PAGE.positions)
    run = [one.circuit.poses(one.path[::step, None]).way(number)[:, 0]]
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
