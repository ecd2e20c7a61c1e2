"""Draws a machine with a pen: in one pose with ghosts, or pose by pose for a film."""

from __future__ import annotations

import numpy as np

from ..kinematics.types import Complexes
from ..paper import COUPLER, CRANK, DRIVER, GREY, INK, PATH
from .drive_marks import drive_marks
from .machine import Bearing, Block, Body, Joint, JointKind, LineKind, Machine, Plate, Rail, Role, Wheel
from .symbols import SOLID, SYMBOL, Pen

#: Colours of links; others have that of a crank.
LINKS = {Role.DRIVER: DRIVER, Role.COUPLER: COUPLER}
#: Styles of lines.
LINES = {
    LineKind.PATH: {"color": PATH, "linewidth": 2.4, "zorder": 7},
    LineKind.TRACE: {"color": COUPLER, "linewidth": 1.2, "zorder": 6.5},
    LineKind.BEYOND: {"color": PATH, "linewidth": 0.9, "zorder": 6},
    LineKind.TURN: {"color": PATH, "alpha": 0.6, "linewidth": 0.8, "linestyle": (0, (4, 3)), "zorder": 2},
    LineKind.SWEEP: {"color": CRANK, "alpha": 0.45, "linewidth": 0.8, "linestyle": (0, (1, 2)), "zorder": 2},
}
WHEEL = {"color": CRANK, "linewidth": 1.0, "linestyle": (0, (6, 2, 1, 2)), "zorder": 2}
#: Points of a pitch circle.
RIM = np.exp(2j * np.pi * np.arange(181) / 180)


def pen_machine(pen: Pen, shown: Machine) -> None:
    """Draw supports, lines, ghosts, the machine in the pose of a still, and names."""
    for name, pose in shown.ghosts.items():
        pen_pose(pen, shown, pose, f"{name}-")
    pen_ground(pen, shown)
    pen_pose(pen, shown, shown.middle)
    for joint, at in shown.joints:
        if joint.label is not None:
            colour = GREY if joint.label.is_fixed else INK
            pen.name(complex(at[shown.middle]), joint.label.math, f"name-{joint.label.name}", colour)


def pen_ground(pen: Pen, shown: Machine) -> None:
    """Draw the fixed parts: supports, drive and lines."""
    for one in shown.supports:
        if isinstance(one, Bearing):
            pen.ground(one.at, one.name, -1j)
        elif isinstance(one, Rail):
            a, b = one.drawn(pen.point).tolist()
            pen.hatched(a, b, one.side, one.name)
        else:
            pen.line(one.centre + one.radius * RIM, one.name, **WHEEL)
    if shown.drive is not None:
        for number, mark in enumerate(drive_marks(shown.drive.angle)):
            z = shown.drive.centre + pen.point * mark
            pen.line(z, f"drive-{number}", color=DRIVER, linewidth=1.2, zorder=SOLID)
    for line in shown.lines:
        if len(line.z) > 1:
            pen.line(line.z, line.name, **LINES[line.kind])


def pen_pose(pen: Pen, shown: Machine, pose: int, ghost: str = "") -> None:
    """Draw the bodies in a pose; with `ghost`, the prefix of names, only the moving ones."""
    for level, body in enumerate(shown.bodies):
        if not (ghost and (body.stands or body.kind == "slide")):
            _body(pen, body, pose, level / len(shown.bodies), ghost)


def _body(pen: Pen, body: Body, pose: int, level: float, ghost: str) -> None:
    """Draw a body; `level` runs from 0, the back, to 1."""
    turn = 1.0 + 0j if body.turn is None else complex(np.exp(1j * body.turn[pose]))
    origin, is_ghost, back = complex(body.at[pose]), bool(ghost), 1 + level if ghost else 4 + level

    def placed(z: Complexes) -> Complexes:
        return np.asarray(origin + turn * z)

    for shape in body.shapes:
        name = ghost + shape.name
        if isinstance(shape, Plate):
            corners, width = placed(shape.drawn(pen.point)), SYMBOL.rod if shape.is_slim else SYMBOL.link
            colour = LINKS.get(shape.role, CRANK)
            pen.link(corners, name, colour, ghost=is_ghost, width=width, zorder=back)
        elif isinstance(shape, Block):
            pen.block(origin, name, turn * shape.along, CRANK, ghost=is_ghost, zorder=back + 1)
        elif isinstance(shape, Wheel) and not ghost:
            pen.line(placed(shape.centre + shape.radius * RIM), name, **WHEEL)
    for joint in body.joints:
        _joint(pen, joint, complex(origin + turn * joint.place), ghost)


def _joint(pen: Pen, joint: Joint, at: complex, ghost: str) -> None:
    """Draw a pin, or a point."""
    name, is_ghost = ghost + joint.name, bool(ghost)
    if joint.kind == JointKind.PIN:
        pen.pivot(at, name, ghost=is_ghost, zorder=6 if ghost else 9)
    elif joint.kind != JointKind.NAMED:
        colour = PATH if joint.kind == JointKind.GUIDED else COUPLER
        pen.dot(at, name, colour, ghost=is_ghost, zorder=8 if ghost else 10)
