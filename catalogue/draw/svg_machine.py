"""Prints a machine as animated SVG: supports and path below, bodies and joints above."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..markup import NOTHING, Markup, element, join
from .drive_marks import drive_marks
from .frame import BEARING_SYMBOL, Frame
from .machine import Bearing, Block, Body, Joint, JointKind, LineKind, Machine, Plate, Rail, Role, Wheel
from .svg import Clock, group, number, plate, polyline, text
from .symbols import BLOCK, SYMBOL

#: Classes of links by their roles.
ROLES = {
    Role.CRANK: "crank",
    Role.DRIVER: "crank driver",
    Role.COUPLER: "coupler",
    Role.OUTPUT: "output",
    Role.BAR: "crank plate",
}
#: Classes of joints, and their radii [pt].
JOINTS = {
    JointKind.PIN: ("pin", SYMBOL.pivot),
    JointKind.GUIDED: ("point", 3.6),
    JointKind.SECOND: ("point second", 2.6),
}
#: Classes of lines.
LINES = {LineKind.PATH: "path", LineKind.TRACE: "path second"}


def svg_machine(shown: Machine, frame: Frame, clock: Clock) -> tuple[Markup, Markup]:
    """Return the lower and the upper part of the drawing."""
    held = [_support(one, frame) for one in shown.supports]
    lines = [element("path", class_=LINES[line.kind], d=polyline(frame.at(line.z))) for line in shown.lines]
    below = join([group("ground", *held, _drive(shown, frame)), *lines])
    return below, join(_body(body, frame, clock) for body in shown.bodies)


def svg_names(shown: Machine, frame: Frame, clock: Clock) -> Markup:
    """Return the names of the joints, which move with them and stay upright."""
    away = complex(7 * frame.point, -6 * frame.point)
    return join(
        clock.moved(frame.at(at), "name", text(joint.label.text, away, "halo"))
        for joint, at in shown.joints
        if joint.label is not None
    )


def _body(body: Body, frame: Frame, clock: Clock) -> Markup:
    """Return a body, animated as a rigid group."""
    parts = [_shape(shape, frame) for shape in body.shapes]
    parts += [part for joint in body.joints for part in _joint(joint, frame)]
    inner = join(parts)
    if body.turn is not None:
        inner = clock.turned(body.turn, None, inner)
    return clock.moved(frame.at(body.at), body.kind, inner) if parts else NOTHING


def _shape(shape: Plate | Block | Wheel, frame: Frame) -> Markup:
    """Return a shape in the frame of its body."""
    if isinstance(shape, Plate):
        corners = frame.along(shape.drawn(frame.point / frame.scale))
        outline = plate(corners, (SYMBOL.rod if shape.is_slim else SYMBOL.link) * frame.point)
        return element("path", class_=f"link {ROLES[shape.role]}", d=outline)
    if isinstance(shape, Block):
        half = (BLOCK[0] - 1.5 + 1j * (BLOCK[1] - 1.5)) * frame.point
        corner = np.array([half, half.conjugate(), -half, -half.conjugate()]) * np.conj(shape.along)
        return element("path", class_="slider", d=polyline(corner) + "Z")
    return _wheel(frame.along(shape.centre), shape.radius * frame.scale)


def _joint(joint: Joint, frame: Frame) -> Iterator[Markup]:
    """Yield a pin or a point in the frame of its body; nothing for a mere name."""
    if joint.kind in JOINTS:
        kind, radius = JOINTS[joint.kind]
        at = complex(frame.along(joint.place))
        yield element("circle", class_=kind, cx=number(at.real), cy=number(at.imag), r=number(radius * frame.point))


def _wheel(centre: complex, radius: float) -> Markup:
    """Return a pitch circle with a spoke, which shows how it turns."""
    spoke = polyline(np.array([centre, centre + radius]))
    circle = element("circle", cx=number(centre.real), cy=number(centre.imag), r=number(radius))
    return group("frame", circle, element("path", d=spoke))


def _support(one: Bearing | Rail | Wheel, frame: Frame) -> Markup:
    """Return a bearing, a rail or a fixed wheel."""
    if isinstance(one, Wheel):
        return _wheel(frame.at(one.centre), one.radius * frame.scale)
    p = frame.point
    if isinstance(one, Bearing):
        z = complex(frame.at(one.at))
        foot = z + 1j * BEARING_SYMBOL.height * p
        corner = np.array([z - 2.4 * p, z + 2.4 * p, foot + 8 * p, foot - 8 * p])
        half = BEARING_SYMBOL.foot * p
        return element("path", class_="bearing", d=polyline(corner) + "Z") + _hatched(foot - half, foot + half, 1j, p)
    side = one.side.conjugate()
    ends = frame.at(one.drawn(p / frame.scale))
    return _hatched(complex(ends[0]), complex(ends[1]), side, p)


def _hatched(a: complex, b: complex, towards: complex, point: float) -> Markup:
    """Return a fixed line with hatching on the side `towards`."""
    along = (b - a) / abs(b - a)
    length = BEARING_SYMBOL.hatching * point
    count = max(2, round(abs(b - a) / length))
    start = a + (np.arange(count) + 0.75) / count * (b - a)
    strokes = np.stack([start, start + length * (towards - along), np.full(count, np.nan)], 1).ravel()
    return element("path", class_="frame", d=polyline(np.append(strokes, [a, b])))


def _drive(shown: Machine, frame: Frame) -> Markup:
    """Return the arc with arrow heads at the driving crank, over its range of angles."""
    if shown.drive is None:
        return NOTHING
    centre = frame.at(shown.drive.centre)
    marks = [polyline(centre + frame.point * mark.conj()) for mark in drive_marks(shown.drive.angle)]
    return element("path", class_="drive", d="".join(marks))
