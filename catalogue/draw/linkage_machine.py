"""A linkage of two dyads, or a dwell, as a machine to draw."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from ..kinematics.linkage import PR, RP, RR
from ..kinematics.types import Complexes
from .machine import Bearing, Block, Body, Drive, Joint, JointKind, Label, Line, LineKind, Machine, Plate, Rail, Role
from .symbols import BLOCK

if TYPE_CHECKING:
    from .poses import Poses


def linkage_machine(shown: Poses) -> Machine:
    """Describe a linkage in its poses."""
    supports = [_support(shown, i) for i in (0, 1)]
    drive = None
    if shown.driver:
        drive = Drive(complex(shown.fixed[shown.driver - 1]), shown.cranks[shown.driver - 1])
    if shown.joint is not None:
        supports.append(Bearing("ground-output", shown.pivot))
    lines = [
        Line("path", LineKind.PATH, shown.path),
        *(Line(name, LineKind.TRACE, z) for name, z in shown.traces.items()),
    ]
    return Machine(tuple(_bodies(shown)), tuple(supports), tuple(lines), shown.middle, drive)


def _bodies(shown: Poses) -> Iterator[Body]:
    """Yield the moving bodies from the back to the front, then the pins of the frame."""
    number, count = {RR: "crank-{}", PR: "slider-{}", RP: "slide-{}"}, len(shown.guided)
    names = [number[int(kind)].format(i + 1) for i, kind in enumerate(shown.kinds)]
    fixed = np.tile(shown.fixed, (count, 1))
    for i, angle in shown.cranks.items():
        role = Role.DRIVER if shown.driver == i + 1 else Role.CRANK
        corners = np.array([0, abs(shown.home[i] - shown.fixed[i])], complex)
        yield Body(names[i], "crank", fixed[:, i], angle, (Plate(names[i], role, corners),))
    for i in np.flatnonzero(shown.kinds == PR).tolist():
        yield Body(names[i], "slider", shown.moving[:, i], None, (Block(names[i], 1j * shown.fixed[i]),))
    output = tuple(_dwell_output(shown))
    yield from output[:1]
    yield _coupler(shown)
    for i, normal in shown.normals.items():
        yield Body(names[i], "slide", fixed[:, i], shown.turn, (Block(names[i], 1j * normal),))
    yield from output[1:]
    for i in np.flatnonzero(shown.kinds != PR).tolist():
        pin = Joint(
            f"fixed-pivot-{i + 1}",
            JointKind.PIN,
            0j,
            Label(f"fixed-{i + 1}", f"A{'₁₂'[i]}", f"$A_{i + 1}$", is_fixed=True),
        )
        yield Body(pin.name, "pins", fixed[:, i], joints=(pin,))


def _coupler(shown: Poses) -> Body:
    """Return the coupler with the lines of its slides, its pins and points."""
    origin = shown.home[shown.origin]
    lines = [
        Plate(f"line-{i + 1}", Role.COUPLER, ends - origin, _overhang(ends, shown.home[i]), is_slim=True)
        for i, ends in shown.rods.items()
    ]
    pins = [
        Joint(
            f"moving-pivot-{i + 1}",
            JointKind.PIN,
            complex(shown.home[i] - origin),
            Label(f"moving-{i + 1}", f"A{'₁₂'[i]}*", f"$A_{i + 1}^{{*}}$", is_fixed=False),
        )
        for i in (0, 1)
        if shown.kinds[i] != RP
    ]
    points = [Joint(name, JointKind.SECOND, complex(z - origin)) for name, z in shown.traced.items()]
    points.append(Joint("guided", JointKind.GUIDED, complex(shown.home[2] - origin)))
    carrier = shown.carried(np.array([origin]))[:, 0]
    shapes = (*lines, Plate("coupler", Role.COUPLER, shown.home - origin))
    return Body("coupler", "coupler", carrier, shown.turn, shapes, (*pins, *points))


def _overhang(ends: Complexes, foot: complex) -> Complexes:
    """Return the lengths of a slide's line beyond its block, at both ends [pt]."""
    along = ends[1] - ends[0]
    if along == 0:
        return np.zeros(2, complex)
    spare = (BLOCK[0] + 8) * along / abs(along) * np.array([-1, 1])
    return np.where(np.abs(ends - foot) < 1e-9 * abs(along), 0, spare)


def _dwell_output(shown: Poses) -> Iterator[Body]:
    """Yield the rocker and the rod of a dwell, with their pins; nothing for another guide."""
    if shown.joint is None:
        return
    pivot = np.full(len(shown.joint), shown.pivot)
    for name, start in (("rocker", pivot), ("rod", shown.guided)):
        away = shown.joint - start
        end = complex(np.abs(away[shown.middle]))
        pins = (
            Joint(f"{name}-joint", JointKind.PIN, end),
            *([Joint("rod-end", JointKind.PIN, 0j)] if name == "rod" else []),
        )
        plate = Plate(name, Role.OUTPUT, np.array([0, end]))
        yield Body(name, "output", start, np.unwrap(np.angle(away)), (plate,), pins)
    yield Body("fixed-pivot-output", "pins", pivot, joints=(Joint("fixed-pivot-output", JointKind.PIN, 0j),))


def _support(shown: Poses, i: int) -> Bearing | Rail:
    """Return the support of a dyad: a bearing, or a rail on the side away from the linkage."""
    if shown.kinds[i] != PR:
        return Bearing(f"ground-{i + 1}", complex(shown.fixed[i]))
    normal, track = complex(shown.fixed[i]), shown.moving[:, i]
    others = np.concatenate([shown.fixed[shown.kinds != PR], shown.carried(shown.home).ravel()])
    side = -1.0 if ((others - track[0]) * normal.conjugate()).real.sum() > 0 else 1.0
    run = ((track - track[0]) * (1j * normal).conjugate()).real
    return Rail(f"guide-{i + 1}", track[0] + 1j * normal * np.array([run.min(), run.max()]), side * normal)
