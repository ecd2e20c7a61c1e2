"""A mechanism of many bars in an animated drawing: bearings, rails, path, bars, wheels."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..kinematics.types import Floats
from ..markup import NOTHING, Markup, element, join
from .chain_poses import ChainPoses
from .drive_marks import drive_marks
from .frame import Frame
from .machine import bearing, block, hatched, pin
from .svg import Clock, group, number, plate, polyline
from .symbols import BLOCK, SYMBOL


def chain_machine(shown: ChainPoses, frame: Frame, clock: Clock) -> tuple[Markup, Markup]:
    """Return the lower and upper part of the drawing: frame and path; bars and joints.

    Parameters
    ----------
    shown : ChainPoses
    frame : Frame
    clock : Clock
    """
    structure = shown.structure
    held = [bearing(complex(frame.at(z)), frame) for z in shown.bearings]
    rails = [_rail(shown, frame, number) for number in range(len(structure.slides))]
    rings = [_circle(frame.at(c), r * frame.scale) for bar, c, r in shown.wheels if bar == structure.frame]
    path = element("path", class_="path", d=polyline(frame.at(shown.path)))
    below = group("ground", *held, *rails, *rings, _drive(shown, frame)) + path
    moving = [bar for bar in range(len(structure.bars)) if bar != structure.frame]
    return below, join([*(_bar(shown, frame, clock, bar) for bar in moving), *_joints(shown, frame, clock)])


def _bar(shown: ChainPoses, frame: Frame, clock: Clock, bar: int) -> Markup:
    """Return a bar with its wheels, slots and block, moving as a rigid body."""
    structure, z, origin = shown.structure, shown.at.chain.z[:, 0], shown.at.origin[bar, 0]
    name = structure.names[bar]
    kind = "crank driver" if name == structure.drive else "crank plate"
    kind = "coupler" if bar in structure.on[shown.point] and name != structure.drive else kind
    corners = frame.along(np.array([z[j] for j, bars in enumerate(structure.on) if bar in bars]) - origin)
    parts = [_circle(frame.along(c - origin), r * frame.scale) for one, c, r in shown.wheels if one == bar]
    parts += list(_slots(shown, frame, bar))
    if len(corners) > 1:
        parts.append(element("path", class_=f"link {kind}", d=plate(corners, SYMBOL.link * frame.point)))
    for slide, u in zip(structure.slides, shown.at.chain.u[:, 0], strict=True):
        if structure.number(slide.second) == bar:
            parts.append(element("path", class_="slider", d=block(frame, float(np.angle(u)))))
    turned = np.unwrap(np.angle(shown.at.turn[bar, :, 0]))
    return clock.moved(frame.at(shown.at.at[bar, :, 0]), "bar", clock.turned(turned, None, *parts))


def _slots(shown: ChainPoses, frame: Frame, bar: int) -> Iterator[Markup]:
    """Yield the slots of a moving bar, along which other bars slide."""
    structure = shown.structure
    for k, slide in enumerate(structure.slides):
        if structure.number(slide.first) == bar:
            start, along = shown.at.origin[structure.number(slide.second), 0], shown.at.chain.u[k, 0]
            ends = start + along * _run(shown, frame, k) - shown.at.origin[bar, 0]
            yield element("path", class_="link coupler", d=plate(frame.along(ends), SYMBOL.rod * frame.point))


def _run(shown: ChainPoses, frame: Frame, slide: int) -> Floats:
    """Return the ends of the travel of a slider, with room for its block [length]."""
    way, spare = shown.at.way(slide)[:, 0], (BLOCK[0] + 7) * frame.point / frame.scale
    return np.array([way.min() - spare, way.max() + spare])


def _rail(shown: ChainPoses, frame: Frame, slide: int) -> Markup:
    """Return the rail of a slider on the frame; empty for a slider on a moving bar."""
    structure = shown.structure
    if structure.number(structure.slides[slide].first) != structure.frame:
        return NOTHING
    along = shown.at.chain.u[slide, 0]
    start = shown.at.origin[structure.number(structure.slides[slide].second), 0]
    ends, side = frame.at(start + along * _run(shown, frame, slide)), frame.along(-1j * along) / frame.scale
    foot = BLOCK[1] * frame.point * side
    return hatched(complex(ends[0] + foot), complex(ends[1] + foot), complex(side), frame)


def _circle(centre: complex, radius: float) -> Markup:
    """Return a pitch circle with a spoke, which shows how it turns."""
    spoke = polyline(np.array([centre, centre + radius]))
    circle = element("circle", cx=number(centre.real), cy=number(centre.imag), r=number(radius))
    return group("frame", circle, element("path", d=spoke))


def _joints(shown: ChainPoses, frame: Frame, clock: Clock) -> Iterator[Markup]:
    """Yield the pins, and the guided point."""
    structure = shown.structure
    for joint, (bars, z) in enumerate(zip(structure.on, shown.joints, strict=True)):
        if structure.frame in bars and len(bars) > 1:
            yield pin(complex(frame.at(z[0])), frame)
        elif len(bars) > 1:
            yield clock.moved(frame.at(z), "pins", pin(0j, frame))
        if joint == shown.point:
            dot = element("circle", class_="point", cx="0", cy="0", r=number(3.6 * frame.point))
            yield clock.moved(frame.at(z), "guided", dot)


def _drive(shown: ChainPoses, frame: Frame) -> Markup:
    """Return the arc with arrow heads at the driving crank, over its range of angles."""
    structure = shown.structure
    bar, link = structure.driver
    others = [j for j, bars in enumerate(structure.on) if bar in bars and j != link.joint]
    if link.is_slide or not others:
        return NOTHING
    z = shown.at.chain.z[:, 0]
    angle = np.angle(z[others[0]] - z[link.joint]) + shown.at.drive[:, 0]
    marks = [frame.at(z[link.joint]) + frame.point * mark.conj() for mark in drive_marks(angle)]
    return element("path", class_="drive", d="".join(polyline(mark) for mark in marks))


def chain_names(shown: ChainPoses, frame: Frame, clock: Clock) -> Markup:
    """Return the names of the joints, which move with them and stay upright."""
    away = complex(7 * frame.point, -6 * frame.point)
    return join(
        clock.moved(frame.at(z), "name", element("text", name, class_="halo", x=number(away.real), y=number(away.imag)))
        for name, z in zip(shown.structure.joints, shown.joints, strict=True)
    )
