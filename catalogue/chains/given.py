"""Chains from plain data, such as a JSON file holds: joints, bars, drive and guided point.

=========  =====================================================================================
name       value
=========  =====================================================================================
joints     by name a position [x, y]; or, in order, from joints before it:
           {"B": 50, "D": 41.5, "side": "left"}: at distances from two, left of the way from the
           first to the second; {"A": 15, "angle": 30}: at a distance from one [length, deg];
           {"from": "B", "to": "C", "along": 70, "across": -8}: along and left of a way
bars       by name the joints on each, ["B", "C"] or "BC"; one is the `frame`
drive      a bar pinned to the frame, which turns, or a slider on the frame, which is pushed
point      the guided joint, on moving bars alone
slides     [{"bar": "frame", "slider": "ram", "angle": 90}, ...], angle of the slide [deg]; or
           {"bar": "body", "slider": "shaft", "along": ["mount", "eye"]}: from joint to joint
gears      [{"wheels": ["sun", "planet"], "carrier": "arm", "ratio": -2}, ...]; see `Gear`
parallel   [["frame", "platform"], ...]: bars kept parallel
name, unit of the chain; of its lengths: mm, cm, m, in or ft
lengths    as `export` writes them: must agree with the joints; its limits, measured and provenance
           are not read
=========  =====================================================================================
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from ..errors import InvalidLinkage, quoted
from ..given import number, pair, text
from ..kinematics.linkage import EXTENT
from ..kinematics.motion import CHANGE
from ..units import unit_or_none
from .chain import LIMITS, Chain
from .lengths import spans
from .structure import Structure

#: Keys of a position that are not names of joints.
_HOW = ("angle", "side", "from", "to", "along", "across")
#: Keys that `export` adds and that are not read.
NOTES = ("limits", "measured", "provenance")
_SIDES = {"left": 1, "right": -1}


class GivenChain(NamedTuple):
    """A chain, the number of its guided joint, its name and the unit of its lengths."""

    chain: Chain
    point: int
    name: str
    unit: str | None


def read_chain(given: Mapping[str, Any]) -> GivenChain:
    """Read one chain from plain data; see the head of the module.

    Raises
    ------
    InvalidLinkage, InvalidRequest
        If a value is missing or invalid, or bars close in no group.

    Examples
    --------
    >>> lambda_ = {
    ...     "joints": {
    ...         "A": [0, 0],
    ...         "D": [2, 0],
    ...         "B": {"A": 1, "angle": 90},
    ...         "C": {"B": 2.5, "D": 2.5, "side": "left"},
    ...         "P": {"from": "B", "to": "C", "along": 5, "across": 0},
    ...     },
    ...     "bars": {"frame": "AD", "crank": "AB", "coupler": "BCP", "rocker": "CD"},
    ...     "drive": "crank",
    ...     "point": "P",
    ... }
    >>> found = read_chain(lambda_)
    >>> found.chain.z[found.point, 0].round(3).item()
    (4+4j)
    """
    known = {"joints", "bars", "drive", "point", "slides", "gears", "parallel", "name", "unit", "lengths"}
    if wrong := given.keys() - known - {*NOTES}:
        raise InvalidLinkage(f"a chain has no {quoted(min(wrong))}")
    if missing := [name for name in ("joints", "bars", "drive", "point") if name not in given]:
        raise InvalidLinkage(f"a chain needs {quoted(missing[0])}")
    bars = {
        name: tuple(text("a joint", joint) for joint in _joints(f"bar {quoted(name)}", joints))
        for name, joints in _mapping("bars", given["bars"]).items()
    }
    slides = [
        _named(f"slide {i}", one, ("bar", "slider", "angle"), ("bar", "slider", "along"))
        for i, one in enumerate(_listed(given, "slides"))
    ]
    gears = [_named(f"gear {i}", one, ("wheels", "carrier", "ratio")) for i, one in enumerate(_listed(given, "gears"))]
    structure = Structure.of(
        bars,
        drive=text("drive", given["drive"]),
        slides=[(text("bar", one["bar"]), text("slider", one["slider"])) for one in slides],
        gears=[
            (*_two("wheels", one["wheels"]), text("carrier", one["carrier"]), number("ratio", one["ratio"]))
            for one in gears
        ],
        parallel=[_two("parallel", one) for one in _listed(given, "parallel")],
    )
    places = _places(_mapping("joints", given["joints"]))
    point = text("point", given["point"])
    if point not in structure.joints:
        raise InvalidLinkage(f"the guided point {quoted(point)} is no joint on a bar")
    guided = structure.joints.index(point)
    if structure.frame in structure.on[guided]:
        raise InvalidLinkage(
            f"the guided point {quoted(point)} is on the frame, which stands still: name a joint on moving bars alone"
        )
    name = given.get("name")
    chain = Chain.of(structure, places, [_direction(one, places) for one in slides])
    _check_lengths(chain, _mapping("lengths", given["lengths"]) if given.get("lengths") else {})
    return GivenChain(
        chain,
        guided,
        "" if name is None else text("name", name),
        unit_or_none(given.get("unit")),
    )


def _check_lengths(chain: Chain, told: Mapping[str, Any]) -> None:
    """Refuse lengths that disagree with the joints, as in a changed file."""
    known, size = spans(chain), float(chain.size[0])
    for name, value in told.items():
        start, end = known.get(name, (0j, 0j))
        if name not in known or abs(number(name, value) - abs(end - start)) > CHANGE * size:
            has = f"they are {abs(end - start):.9g} apart" if name in known else "no bar has it"
            raise InvalidLinkage(
                f"`lengths` says {quoted(name)} is {quoted(value)}, but {has} by `joints`: change these, or leave "
                "out `lengths`"
            )


def _mapping(name: str, given: object) -> Mapping[str, Any]:
    if not isinstance(given, Mapping) or not given:
        raise InvalidLinkage(f"{quoted(name)} must say something by name, not {quoted(given)}")
    return given


def _joints(name: str, given: object) -> Sequence[Any]:
    """Return the joints of a bar; a text names joints of one letter."""
    return given if isinstance(given, str) else _sequence(name, given)


def _sequence(name: str, given: object) -> Sequence[Any]:
    if isinstance(given, str | bytes | Mapping) or not isinstance(given, Sequence):
        raise InvalidLinkage(f"{name} must be a list, not {quoted(given)}")
    return given


def _listed(given: Mapping[str, Any], name: str) -> Sequence[Any]:
    return _sequence(quoted(name), given.get(name, []))


def _named(name: str, given: object, *wanted: Sequence[str]) -> Mapping[str, Any]:
    if not isinstance(given, Mapping) or all({*given} != {*one} for one in wanted):
        told = " or ".join(", ".join(one) for one in wanted)
        raise InvalidLinkage(f"{name} must say {told}, not {quoted(given)}")
    return given


def _direction(slide: Mapping[str, Any], places: Mapping[str, complex]) -> complex:
    """Return the direction of a slide."""
    if "angle" in slide:
        return cmath.rect(1, math.radians(number("angle", slide["angle"])))
    one, other = (text("along", joint) for joint in pair("along", slide["along"], "the names of two joints"))
    if unknown := [joint for joint in (one, other) if joint not in places]:
        raise InvalidLinkage(f"there is no joint {quoted(unknown[0])}")
    if places[one] == places[other]:
        raise InvalidLinkage(f"a slide along {one} and {other} has no direction: they coincide")
    return places[other] - places[one]


def _two(name: str, given: object) -> tuple[str, str]:
    one, other = pair(name, given, "the names of two bars")
    return text(name, one), text(name, other)


def _places(given: Mapping[str, Any]) -> dict[str, complex]:
    """Place joints in order."""
    places: dict[str, complex] = {}
    for name, value in given.items():
        if isinstance(value, Mapping):
            places[name] = _placed(f"joint {quoted(name)}", value, places)
        else:
            x, y = pair(f"joint {quoted(name)}", value, "x and y, or distances from joints before it")
            places[name] = complex(number(f"x of joint {quoted(name)}", x), number(f"y of joint {quoted(name)}", y))
        if not cmath.isfinite(places[name]):
            raise InvalidLinkage(f"joint {quoted(name)} has a coordinate that is not finite")
        if max(abs(places[name].real), abs(places[name].imag)) > LIMITS.largest:
            raise InvalidLinkage(f"joint {quoted(name)} lies beyond {LIMITS.largest:.0e}: choose another unit")
    return places


def _placed(name: str, value: Mapping[str, Any], places: Mapping[str, complex]) -> complex:
    """Place a joint by distances from others."""

    def known(joint: Any) -> complex:
        if not isinstance(joint, str) or joint not in places:
            raise InvalidLinkage(f"{name} is placed from {quoted(joint)}, which is no joint before it")
        return places[joint]

    if {*value} == {"from", "to", "along", "across"}:
        start, way = known(value["from"]), known(value["to"]) - known(value["from"])
        if not way:
            raise InvalidLinkage(
                f"{name} lies along no way: {quoted(value['from'])} and {quoted(value['to'])} coincide"
            )
        return start + way / abs(way) * complex(number("along", value["along"]), number("across", value["across"]))
    away = {
        joint: number(f"{name}, its distance from {quoted(joint)}", d)
        for joint, d in value.items()
        if joint not in _HOW
    }
    if min(away.values(), default=0) <= 0:
        raise InvalidLinkage(f"{name} needs distances above zero from joints before it")
    (first, distance), *others = away.items()
    if {*value} == {first, "angle"}:
        return known(first) + cmath.rect(distance, math.radians(number("angle", value["angle"])))
    if len(others) != 1 or {*value} - {*away} != {"side"} or value["side"] not in [*_SIDES]:
        raise InvalidLinkage(
            f'{name} needs a position, distances from two joints and "side": "left" or "right", or a distance and an '
            "angle"
        )
    return _apex(name, known(first), distance, known(others[0][0]), others[0][1], _SIDES[value["side"]])


def _apex(name: str, one: complex, first: float, other: complex, second: float, side: int) -> complex:
    """Return the apex of a triangle on a side of the way between two places."""
    way = other - one
    apart = abs(way)
    size = max(first, second, apart)  # unit of length that avoids overflow of powers
    a, b, c = first / size, second / size, apart / size
    if c < EXTENT.coincident:
        raise InvalidLinkage(f"{name} stands on two joints that coincide")
    square = (a + b - c) * (a + b + c) * (c - a + b) * (c + a - b)
    if square < -CHANGE * (a + b) ** 4:
        raise InvalidLinkage(
            f"{name} cannot be {first:g} and {second:g} away from joints that are {apart:g} apart: take another angle"
        )
    along = 0.5 * (c**2 + (a - b) * (a + b))
    return one + way * complex(along, side * 0.5 * math.sqrt(max(square, 0.0))) / c**2
