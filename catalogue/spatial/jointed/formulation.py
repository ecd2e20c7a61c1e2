"""Formulate the equations of elements: bodies on their joints, loop closure, scalars."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...errors import InvalidRequest
from ...kinematics.types import Array
from . import elements as e
from .drives import scalar_function
from .hard_points import HardPoints, directions, label, numbers, scale
from .idle import idle_rotations
from .located_guide import LocatedGuide, located
from .loop_closure import Condition, LoopClosure
from .scalars import CoordinateFunction
from .spanning_tree import SpanningTree, merge_placed
from .system import OnKind, System
from .tree import CURVE, CYLINDRICAL, FREE, NUMBERS, PRISMATIC, REVOLUTE, SURFACE, UNKNOWNS, Placed

#: Number of each kind of joint that can carry a body.
KINDS: dict[type, int] = {e.Revolute: REVOLUTE, e.Screw: REVOLUTE, e.Prismatic: PRISMATIC, e.Cylindrical: CYLINDRICAL}


class Formulation:
    """Equations of a mechanism of elements, scalars as further rows; `system` returns them.

    Attributes
    ----------
    tree : SpanningTree
    points : HardPoints
    loops : LoopClosure
    centre : ndarray, shape (3,)
    unit : float
        Unit of length of the equations; points are relative to the centre.
    """

    def __init__(self, elements: Sequence[e.Element], scalars: Sequence[e.Scalar]) -> None:
        elements = [x for x in elements if not isinstance(x, e.Coupling)]
        self.elements, self.scalars = elements, scalars
        links = {s.link for s in e.expand_sums(scalars) if isinstance(s, e.Length) and s.link}
        guides = {s.guide for s in e.expand_sums(scalars) if isinstance(s, e.GuideCoordinate)}
        for name, kind in [(n, e.Link) for n in links] + [(n, e.OnGuide) for n in guides]:
            if name not in {x.name for x in elements if isinstance(x, kind)}:
                raise InvalidRequest(f"there is no {kind.__name__} named {name!r}")
        self.tree, self.points = SpanningTree(elements), HardPoints()
        self.loops = LoopClosure(self.tree, self.points, links, guides)
        for element in elements:
            self.loops.add(element)
        self.centre, self.unit = scale(elements)
        self.placed: list[Placed] = []

    def located(self, x: e.OnGuide) -> LocatedGuide:
        """Return a guide in units, about the centre; raise if its point is off it in the design
        pose.
        """
        return located(x, self.centre, self.unit)

    def coordinate(self, body: int, index: int, unit: float, angular: bool) -> CoordinateFunction:
        """Return a coordinate of the joint or guide that carries a body."""
        p = self.placed[body - 1]
        return CoordinateFunction((0, body), unit, angular, p.number[0] + index, p.unknown[0] + index)

    def system(self) -> System:
        """Return the equations; call it once only, for it adds conditions."""
        self.place()
        spun = {
            s.body
            for s in e.expand_sums(self.scalars)
            if isinstance(s, e.Angle) or (isinstance(s, e.Joint) and not s.index)
        }
        idle = idle_rotations(self.loops, self.placed, {self.tree.body(body, "drive") for body in spun})
        scalars = tuple(scalar_function(s, self) for s in self.scalars)
        conditions = [*self.loops.distances, *self.loops.offsets, *self.loops.angles]
        guides, on_guides = self._points_on_guides(len(conditions))
        conditions += [*on_guides, *(self._name_condition(c) for c in idle)]
        rows, moves = len(conditions), self.moves([c.bodies for c in conditions] + [s.bodies for s in scalars])
        n = self.points.batch()
        points = np.stack([np.broadcast_to(p, (n, 3)) for p in self.points.points], axis=1)
        points = (points - self.centre) / self.unit
        return System(
            tuple(self.tree.bodies),
            points,
            directions(self.points.directions, points),
            merge_placed(self.placed),
            moves.shape[1],
            sum(NUMBERS[p.joint_kind] for p in self.placed),
            _columns(self.points.ends),
            _columns(self.points.vectors),
            _parts_array(self.loops.distances, 2),
            _parts_array(self.loops.offsets, 3),
            _parts_array(self.loops.angles, 2),
            guides,
            _parts_array(idle, 1),
            moves,
            rows,
            scalars,
            np.arange(rows),
            self.centre,
            self.unit,
            tuple(c.name for c in conditions),
            np.array(self.loops.facing, int).reshape(-1, 2).T,
            tuple(self.points.directions),
            tuple(self.points.labels),
            tuple(label(x) for x in self.elements),
        )

    def place(self) -> None:
        """Place all bodies on their joints; number the unknowns and the state entries."""
        unknown, number = 0, 0
        for i in range(1, len(self.tree.bodies)):
            kind, on, at, direction, guide, lead = self._carrying_joint(i)
            self.placed.append(Placed(kind, [i], [on], [unknown], [number], [at], [direction], guide, lead))
            unknown, number = unknown + UNKNOWNS[kind], number + NUMBERS[kind]

    def _carrying_joint(self, i: int) -> tuple[int, int, int, int, LocatedGuide | None, tuple[float, ...]]:
        """Return the joint that carries body i: kind, base body, point, direction, guide, lead."""
        name = self.tree.bodies[i]
        x = self.tree.carrier[name]
        if x is None:
            return FREE, 0, next(iter(self.points.of(i)), 0), 0, None, ()
        if isinstance(x, e.OnGuide):
            guide = self.located(x)
            kind = CURVE if guide.kind.conditions == 2 else SURFACE
            return kind, self.tree.body(x.on, name), self.points.of(i)[0], 0, guide, ()
        at, direction = self.points.axis(x)
        turn = numbers((x.lead,), f"{label(x)}.lead", 1).item() if isinstance(x, e.Screw) else 0.0
        lead = turn / (2 * np.pi * self.unit)
        return KINDS[type(x)], self.tree.body(x.on, name), at, direction, None, (lead,) if lead else ()

    def _points_on_guides(self, row: int) -> tuple[tuple[OnKind, ...], list[Condition]]:
        """Return points on guides, with rows counted from `row`, and their conditions."""
        guides, conditions = [], []
        for end, on, x in self.loops.on_guides:
            guide = self.located(x)
            count = guide.kind.conditions
            guides.append(OnKind(end, on, guide, slice(row, row + count)))
            conditions += [Condition((end,), (on, self.points.ends[end][0]), label(x))] * count
            row += count
        return tuple(guides), conditions

    def _name_condition(self, idle: Condition) -> Condition:
        """Return the condition that suppresses an idle rotation, with its name."""
        return idle._replace(name=f"idle rotation of {self.tree.bodies[idle.bodies[1]]}")

    def moves(self, pairs: Sequence[tuple[int, int]]) -> Array:
        """Return which unknowns move the bodies of each pair, shape (pairs, unknowns).

        1: an unknown moves only the second body; -1: only the first; 0: both or neither.
        """
        unknowns = sum(UNKNOWNS[p.joint_kind] for p in self.placed)
        moved: list[list[int]] = [[]]  # unknowns that move each body
        for p in self.placed:
            moved.append([*moved[p.on[0]], *range(p.unknown[0], p.unknown[0] + UNKNOWNS[p.joint_kind])])
        out = np.zeros((len(pairs), unknowns))
        for row, (first, second) in zip(out, pairs, strict=True):
            row[moved[second]] += 1
            row[moved[first]] -= 1
        return out


def _columns(pairs: Sequence[tuple[int, int]]) -> tuple[list[int], list[int]]:
    return [first for first, _ in pairs], [second for _, second in pairs]


def _parts_array(conditions: Sequence[Condition], size: int) -> Array:
    """Return ends and vectors of conditions, shape (size, rows)."""
    return np.array([c.parts for c in conditions], int).reshape(-1, size).T
