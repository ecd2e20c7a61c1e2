"""The linkage in an animated drawing: bearings, rails, path and links."""

from __future__ import annotations

import numpy as np

from ..kinematics.linkage import PR, RP, RR
from ..kinematics.types import Complexes
from ..markup import NOTHING, Markup, element, join
from .drive_marks import drive_marks
from .frame import BEARING_SYMBOL, Frame
from .poses import Poses
from .svg import Clock, group, number, pair, plate, polyline
from .symbols import BLOCK, SYMBOL


def machine(shown: Poses, frame: Frame, clock: Clock) -> tuple[Markup, Markup]:
    """Return the lower and upper part of the drawing: frame and path; links and joints."""
    path = element("path", class_="path", d=polyline(frame.at(shown.path)))
    traces = [element("path", class_="path second", d=polyline(frame.at(z))) for z in shown.traces.values()]
    held = [_held(shown, frame, i) for i in (0, 1)]
    joints = [pin(frame.at(shown.fixed[i]), frame) for i in (0, 1) if shown.kinds[i] != PR]
    blocks = [_slide(shown, frame, clock, i) for i in (0, 1) if shown.kinds[i] == RP]
    cranks = [_crank(shown, frame, clock, i) for i in (0, 1) if shown.kinds[i] == RR]
    sliders = [_slider(shown, frame, clock, i) for i in (0, 1) if shown.kinds[i] == PR]
    if shown.joint is not None:
        held.append(bearing(complex(frame.at(shown.pivot)), frame))
    below = group("ground", *held, _drive(shown, frame)) + path + join(traces)
    output = _output(shown, frame, clock)
    return below, join([*cranks, *sliders, *output[:1], _coupler(shown, frame, clock), *blocks, *output[1:], *joints])


def _coupler(shown: Poses, frame: Frame, clock: Clock) -> Markup:
    """Return the coupler with pins and guided point, moving as a rigid body."""
    point, origin = frame.point, shown.home[shown.origin]
    rods = [
        element(
            "path",
            class_="link coupler",
            d=plate(frame.along(_spared(ends, shown.home[i], frame) - origin), SYMBOL.rod * point),
        )
        for i, ends in shown.rods.items()
    ]
    home = frame.along(shown.home - origin)
    pins = [pin(home[i], frame) for i in (0, 1) if shown.kinds[i] != RP]
    dots = [
        element("circle", class_="point second", cx=number(z.real), cy=number(z.imag), r=number(2.6 * point))
        for z in (frame.along(shown.traced[name] - origin) for name in shown.traces)
    ]
    guided = element("circle", class_="point", cx=number(home[2].real), cy=number(home[2].imag), r=number(3.6 * point))
    body = element("path", class_="link coupler", d=plate(home, SYMBOL.link * point))
    carrier = shown.carried(np.array([origin]))[:, 0]
    return clock.moved(frame.at(carrier), "coupler", clock.turned(shown.turn, None, *rods, body, *pins, *dots, guided))


def _spared(ends: Complexes, foot: complex, frame: Frame) -> Complexes:
    """Return the ends of a coupler line, extended where they would lie inside the block."""
    along = ends[1] - ends[0]
    if along == 0:
        return ends
    spare = (BLOCK[0] + 8) * frame.point / frame.scale * along / abs(along) * np.array([-1, 1])
    return np.asarray(ends + np.where(np.abs(ends - foot) < 1e-9 * abs(along), 0, spare))


def _crank(shown: Poses, frame: Frame, clock: Clock, i: int) -> Markup:
    length = abs(frame.along(shown.home[i] - shown.fixed[i]))
    body = element("path", d=plate(np.array([0j, complex(length)]), SYMBOL.link * frame.point))
    kind = "link crank driver" if shown.driver == i + 1 else "link crank"
    turned = clock.turned(shown.cranks[i], None, body)
    return group(kind, turned, transform=f"translate({pair(complex(frame.at(shown.fixed[i])))})")


def _slider(shown: Poses, frame: Frame, clock: Clock, i: int) -> Markup:
    angle = number(float(-np.degrees(np.angle(1j * shown.fixed[i]))), 3)
    return clock.moved(
        frame.at(shown.moving[:, i]), "slider", element("path", d=block(frame), transform=f"rotate({angle})")
    )


def _slide(shown: Poses, frame: Frame, clock: Clock, i: int) -> Markup:
    turned = clock.turned(shown.turn, None, element("path", d=block(frame, float(np.angle(1j * shown.normals[i])))))
    return group("slide", turned, transform=f"translate({pair(complex(frame.at(shown.fixed[i])))})")


def _output(shown: Poses, frame: Frame, clock: Clock) -> list[Markup]:
    """Return the rocker and rod of a dwell, with their joints; empty for another guide."""
    if shown.joint is None:
        return []
    parts: list[Markup] = []
    for start, end in ((np.full(len(shown.joint), shown.pivot), shown.joint), (shown.guided, shown.joint)):
        away = end - start
        length = float(np.abs(frame.along(away[shown.middle])))
        body = element(
            "path", class_="link output", d=plate(np.array([0j, complex(length)]), SYMBOL.link * frame.point)
        )
        turned = clock.turned(np.unwrap(np.angle(away)), None, body, pin(complex(length), frame))
        if parts:
            parts.append(clock.moved(frame.at(start), "output", turned, pin(0j, frame)))
        else:
            at = pair(complex(frame.at(shown.pivot)))
            parts.append(group("output", turned, transform=f"translate({at})"))
    return [*parts, pin(frame.at(shown.pivot), frame)]


def block(frame: Frame, angle: float = 0.0) -> str:
    """Return the outline of a block at an angle from the x axis [rad]."""
    half = (BLOCK[0] - 1.5 + 1j * (BLOCK[1] - 1.5)) * frame.point
    corner = np.array([half, half.conjugate(), -half, -half.conjugate()]) * np.exp(-1j * angle)
    return polyline(corner) + "Z"


def pin(z: complex, frame: Frame) -> Markup:
    """Return a pin."""
    return element(
        "circle", class_="pin", cx=number(float(z.real)), cy=number(float(z.imag)), r=number(SYMBOL.pivot * frame.point)
    )


def _held(shown: Poses, frame: Frame, i: int) -> Markup:
    """Return the support of a dyad: a bearing, or the rail of a slider."""
    if shown.kinds[i] == PR:
        return _track(shown, frame, i)
    return bearing(complex(frame.at(shown.fixed[i])), frame)


def bearing(z: complex, frame: Frame) -> Markup:
    """Return a bearing, its foot below."""
    p = frame.point
    foot = z + 1j * BEARING_SYMBOL.height * p
    corner = np.array([z - 2.4 * p, z + 2.4 * p, foot + 8 * p, foot - 8 * p])
    return element("path", class_="bearing", d=polyline(corner) + "Z") + hatched(
        foot - BEARING_SYMBOL.foot * p, foot + BEARING_SYMBOL.foot * p, 1j, frame
    )


def _track(shown: Poses, frame: Frame, i: int) -> Markup:
    """Return the rail of a slider, hatched on the side away from the linkage."""
    normal, p = complex(np.conj(shown.fixed[i])), frame.point
    at = frame.at(shown.moving[:, i])
    others = np.concatenate(
        [np.atleast_1d(frame.at(shown.fixed[shown.kinds != PR])), frame.at(shown.carried(shown.home)).ravel()]
    )
    side = -1.0 if ((others - at[0]) * np.conj(normal)).real.sum() > 0 else 1.0
    along = 1j * normal
    run = ((at - at[0]) * np.conj(along)).real
    spare = (BLOCK[0] + 7) * p
    foot = at[0] + side * BLOCK[1] * p * normal
    return hatched(foot + (run.min() - spare) * along, foot + (run.max() + spare) * along, side * normal, frame)


def hatched(a: complex, b: complex, towards: complex, frame: Frame) -> Markup:
    """Return a fixed line with hatching on the side `towards`."""
    along = (b - a) / abs(b - a)
    length = BEARING_SYMBOL.hatching * frame.point
    count = max(2, round(abs(b - a) / length))
    start = a + (np.arange(count) + 0.75) / count * (b - a)
    strokes = np.stack([start, start + length * (towards - along), np.full(count, np.nan)], 1).ravel()
    return element("path", class_="frame", d=polyline(np.append(strokes, [a, b])))


def _drive(shown: Poses, frame: Frame) -> Markup:
    """Return the arc with arrow heads at the driving crank, over its range of angles."""
    if not shown.driver:
        return NOTHING
    centre = frame.at(shown.fixed[shown.driver - 1])
    marks = drive_marks(shown.cranks[shown.driver - 1])
    data = [polyline(centre + frame.point * mark.conj()) for mark in marks]
    return element("path", class_="drive", d="".join(data))
