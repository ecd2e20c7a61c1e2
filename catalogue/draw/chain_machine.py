"""A mechanism of many bars as a machine to draw: bars, joints, slides and wheels."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from ..chains.lengths import pitch_circles
from ..kinematics.types import Complexes
from .machine import (
    Bearing,
    Block,
    Body,
    Drive,
    Joint,
    JointKind,
    Label,
    Line,
    LineKind,
    Machine,
    Plate,
    Rail,
    Role,
    Wheel,
)
from .symbols import BLOCK

if TYPE_CHECKING:
    from .chain_poses import ChainPoses


def chain_machine(shown: ChainPoses) -> Machine:
    """Describe a mechanism of many bars in its poses."""
    structure, z = shown.structure, shown.at.chain.z[:, 0]
    wheels = [
        (structure.number(name), Wheel(f"wheel-{number}-{name}", centre, radius))
        for number, gear in enumerate(structure.gears)
        for name, centre, radius in pitch_circles(structure, gear, z)
    ]
    bearings = [Bearing(f"ground-{structure.joints[j]}", complex(z[j])) for j in shown.fixed]
    supports: list[Bearing | Rail | Wheel] = [
        *bearings,
        *_rails(shown),
        *(wheel for bar, wheel in wheels if bar == structure.frame),
    ]
    bars = [
        _bar(shown, bar, [wheel for carrier, wheel in wheels if carrier == bar])
        for bar in range(len(structure.bars))
        if bar != structure.frame
    ]
    path = Line("path", LineKind.PATH, shown.path)
    return Machine((*bars, *_joints(shown)), tuple(supports), (path,), shown.middle, _driving_crank(shown))


def _bar(shown: ChainPoses, bar: int, wheels: list[Wheel]) -> Body:
    """Return a bar with its wheels, slots, plate and block."""
    structure, z, origin = shown.structure, shown.at.chain.z[:, 0], shown.at.origin[bar, 0]
    name = structure.names[bar]
    role = Role.DRIVER if name == structure.drive else Role.COUPLER if bar in structure.on[shown.point] else Role.BAR
    corners = np.array([z[j] for j, bars in enumerate(structure.on) if bar in bars]) - origin
    shapes: list[Plate | Block | Wheel] = [one._replace(centre=one.centre - origin) for one in wheels]
    for k, slide in enumerate(structure.slides):
        if structure.number(slide.first) == bar:
            ends, along = _travel_ends(shown, k)
            spare = (BLOCK[0] + 7) * along * np.array([-1, 1])
            shapes.append(Plate(f"rail-{k}", Role.COUPLER, ends - origin, spare, is_slim=True))
    if len(corners) > 1:
        shapes.append(Plate(name, role, corners))
    for slide, along in zip(structure.slides, shown.at.chain.u[:, 0], strict=True):
        if structure.number(slide.second) == bar:
            shapes.append(Block(f"block-{name}", complex(along)))
    turned = np.unwrap(np.angle(shown.at.turn[bar, :, 0]))
    return Body(name, "bar", shown.at.at[bar, :, 0], turned, tuple(shapes))


def _travel_ends(shown: ChainPoses, slide: int) -> tuple[Complexes, complex]:
    """Return the ends of a slider's travel (2,) in the reference pose [length], and its direction.

    A slot reaches to the pins of its bar too.
    """
    structure, chain = shown.structure, shown.at.chain
    rail = structure.number(structure.slides[slide].first)
    start, along = shown.at.origin[structure.number(structure.slides[slide].second), 0], complex(chain.u[slide, 0])
    way = shown.at.way(slide)[:, 0]
    if rail != structure.frame:
        held = [chain.z[j, 0] for j, bars in enumerate(structure.on) if rail in bars]
        way = np.append(way, ((np.array(held) - start) / along).real)
    return start + along * np.array([way.min(), way.max()]), along


def _rails(shown: ChainPoses) -> Iterator[Rail]:
    """Yield the rails on the frame."""
    for k, slide in enumerate(shown.structure.slides):
        if shown.structure.number(slide.first) == shown.structure.frame:
            ends, along = _travel_ends(shown, k)
            yield Rail(f"rail-{k}", ends, -1j * along)


def _joints(shown: ChainPoses) -> Iterator[Body]:
    """Yield the pins, and the guided point, above all bars."""
    structure = shown.structure
    for number, (name, bars) in enumerate(zip(structure.joints, structure.on, strict=True)):
        label = Label(name, name, name, is_fixed=structure.frame in bars)
        pins = [Joint(f"joint-{name}", JointKind.PIN, 0j)] if len(bars) > 1 else []
        guided = [Joint(f"guided-{name}", JointKind.GUIDED, 0j)] if number == shown.point else []
        first, *more = pins + guided or [Joint(f"point-{name}", JointKind.NAMED, 0j)]
        kind = "guided" if number == shown.point else "pins"
        yield Body(name, kind, shown.at.joint(number)[:, 0], joints=(first._replace(label=label), *more))


def _driving_crank(shown: ChainPoses) -> Drive | None:
    """Return the driving crank; None for a sliding drive."""
    structure = shown.structure
    bar, link = structure.driver
    others = [j for j, bars in enumerate(structure.on) if bar in bars and j != link.joint]
    if link.is_slide or not others:
        return None
    z = shown.at.chain.z[:, 0]
    return Drive(complex(z[link.joint]), np.angle(z[others[0]] - z[link.joint]) + shown.at.drive[:, 0])
