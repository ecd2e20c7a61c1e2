"""Find bodies that spin idly: all their joints are on one line."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from ...kinematics.types import Array
from .hard_points import HardPoints
from .loop_closure import Condition, LoopClosure
from .tree import CYLINDRICAL, FREE, PRISMATIC, Placed

#: Largest distance of collinear points from their line [distances of the points].
LINE_TOLERANCE = 1e-9


def idle_rotations(loops: LoopClosure, placed: Sequence[Placed], driven: Collection[int]) -> list[Condition]:
    """Return conditions that suppress idle rotations.

    A free body spins about the line of its points, together with bodies that slide on it along that
    line; a body on a cylindrical joint spins about the axis of the joint.

    Parameters
    ----------
    loops : LoopClosure
    placed : sequence of Placed
        One for each body.
    driven : collection of int
        Bodies with a driving or held rotation.
    """
    points, out = loops.points, []
    for p in placed:
        body, on = p.bodies[0], p.on[0]
        sliding = [q for q in placed if q.on[0] == body]
        if body in loops.turned or body in driven:
            continue
        if p.joint_kind == CYLINDRICAL and not sliding and points.of(body):
            line = points.points[p.point[0]][0], _vector(points, p.direction[0])
            if _is_straight(points, points.of(body), *line):
                out.append(_kept(points, body, on, p.direction[0]))
        elif p.joint_kind == FREE and points.of(body):
            carriers = loops.turned | {r.on[0] for r in placed}
            telescope = all(q.joint_kind in (PRISMATIC, CYLINDRICAL) and q.bodies[0] not in carriers for q in sliding)
            every = [*points.of(body), *(end for q in sliding for end in points.of(q.bodies[0]))]
            every += [q.point[0] for q in sliding if q.joint_kind == CYLINDRICAL]
            far = max(every, key=lambda end: float(np.abs(points.points[end][0] - points.points[every[0]][0]).max()))
            line = points.points[every[0]][0], points.points[far][0] - points.points[every[0]][0]
            along = all(_is_parallel(_vector(points, q.direction[0]), line[1]) for q in sliding)
            if telescope and along and line[1].any() and _is_straight(points, every, *line):
                out.append(_kept(points, body, 0, points.between(every[0], far)))
    return out


def _kept(points: HardPoints, body: int, on: int, direction: int) -> Condition:
    vector = points.vector(body, direction)
    return Condition((vector,), (on, body), "")


def _vector(points: HardPoints, direction: int) -> Array:
    known = points.directions[direction]
    v = known[0] if isinstance(known, np.ndarray) else points.points[known[1]][0] - points.points[known[0]][0]
    return np.asarray(v)


def _is_parallel(one: Array, other: Array) -> bool:
    off = np.cross(one, other)
    return bool(off @ off <= LINE_TOLERANCE**2 * (one @ one) * (other @ other))


def _is_straight(points: HardPoints, ends: Sequence[int], at: Array, along: Array) -> bool:
    """Return whether hard points of a batch's first mechanism are on a line."""
    apart = np.stack([points.points[end][0] for end in ends]) - at
    off = np.cross(apart, along / (np.sqrt(along @ along) or 1.0))
    return bool(np.abs(off).max() <= LINE_TOLERANCE * max(np.abs(apart).max(), np.sqrt(along @ along)))
