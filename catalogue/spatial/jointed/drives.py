"""Scalars as functions of the pose, each kind in terms of a formulation."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import InvalidLinkage, InvalidRequest
from . import elements as e
from .scalars import AngleFunction, CoordinateFunction, LengthFunction, ScalarFunction, SumFunction, TravelFunction
from .tree import UNKNOWNS

if TYPE_CHECKING:
    from .formulation import Formulation


def scalar_function(s: e.Scalar, f: Formulation) -> ScalarFunction:
    """Return a scalar as a function of the pose; raise InvalidRequest for an unknown kind."""
    return FUNCTIONS[type(s)](s, f)


def _carrier(body: str, f: Formulation) -> tuple[int, Any]:
    """Return the number of a body and the joint that carries it."""
    number, x = f.tree.body(body, "drive"), f.tree.carrier.get(body)
    if x is None:
        raise InvalidRequest(f"{body} hangs on no joint that could be driven: drive a Travel or an Angle")
    return number, x


def joint(s: e.Joint, f: Formulation) -> CoordinateFunction:
    """Return a coordinate of the joint that carries a body."""
    number, x = _carrier(s.body, f)
    if not 0 <= s.index < UNKNOWNS[f.placed[number - 1].joint_kind]:
        raise InvalidRequest(f"the joint of {s.body} has no coordinate {s.index}")
    angular = not (isinstance(x, e.Prismatic) or s.index)
    return f.coordinate(number, s.index, 1.0 if angular else f.unit, angular)


def guide_coordinate(s: e.GuideCoordinate, f: Formulation) -> CoordinateFunction:
    """Return a coordinate of a guided point, in the chart of its guide."""
    number, x = _carrier(f"{s.guide} (point)", f)
    guide, index = f.located(x), "uw".find(s.coordinate)
    if not 0 <= index < len(guide.start):
        raise InvalidRequest(f"{s.guide} has no coordinate {s.coordinate!r}")
    unit = float(guide.kind.coordinate_unit(index, np.array([f.unit]))[0])
    angular = guide.kind.spans[index] == np.pi and "uw"[index] not in guide.kind.lengths
    return f.coordinate(number, index, unit, angular)


def travel(s: e.Travel, f: Formulation) -> TravelFunction:
    """Return the travel of a point of a body along a direction of the ground."""
    body, points = f.tree.body(s.body, "Travel"), f.points
    point = points.point(s.point, "Travel.point")
    along = e.DIRECTIONS.get(s.along) if isinstance(s.along, str) else s.along
    if along is None:
        raise InvalidRequest(f"Travel along {s.along!r}: give x, y, z or three numbers")
    vector = points.vector(0, points.direction(along, "Travel.along"))
    return TravelFunction((0, body), f.unit, False, points.end(body, point), points.end(0, point), vector)


def length(s: e.Length, f: Formulation) -> LengthFunction:
    """Return the length of a link, or the distance of two points."""
    if s.link:
        link = f.loops.free_ends[s.link]
        return LengthFunction(link.bodies, f.unit, False, *link.parts)
    a, b = f.tree.body(s.a, "Length"), f.tree.body(s.b, "Length")
    first = f.points.end(a, f.points.point(s.from_, "Length.from"))
    second = f.points.end(b, f.points.point(s.to, "Length.to"))
    return LengthFunction((a, b), f.unit, False, first, second)


def angle(s: e.Angle, f: Formulation) -> AngleFunction:
    """Return the rotation of a direction of a body about an axis of the ground."""
    points = f.points
    about, direction = points.unit_vector(s.about, "Angle.about"), points.unit_vector(s.direction, "Angle.direction")
    if len({len(about), len(direction)} - {1}) > 1:
        raise InvalidLinkage("the directions of an Angle are of batches of different sizes")
    first = direction - (direction * about).sum(-1, keepdims=True) * about
    if not (np.sqrt((first * first).sum(-1)) > 1e-9).all():
        raise InvalidRequest("an Angle needs a direction that is not along its axis")
    body = f.tree.body(s.body, "Angle")
    across = [points.vector(0, points.direction(v, "Angle")) for v in (first, np.cross(about, first))]
    vector = points.vector(body, points.direction(direction, "Angle.direction"))
    return AngleFunction((0, body), 1.0, True, vector, *across)


def total(s: e.Sum, f: Formulation) -> SumFunction:
    """Return a weighted sum of scalars."""
    parts = tuple(scalar_function(part, f) for part in s.parts)
    angular = all(part.angular for part in parts)
    unit = 1.0 if angular else f.unit
    if any(part.periodic and abs(weight) != 1 for part, weight in zip(parts, s.weights, strict=True)):
        raise InvalidRequest("an Angle in a Sum needs the weight 1 or -1: it is known but for whole turns")
    moves = f.moves([part.bodies for part in parts])
    weights = tuple(weight * part.unit / unit for weight, part in zip(s.weights, parts, strict=True))
    return SumFunction((0, 0), unit, angular, parts, weights, moves)


#: Function that converts each kind of scalar.
FUNCTIONS: dict[type, Callable[[Any, Formulation], ScalarFunction]] = {
    e.Joint: joint,
    e.GuideCoordinate: guide_coordinate,
    e.Travel: travel,
    e.Length: length,
    e.Angle: angle,
    e.Sum: total,
}
