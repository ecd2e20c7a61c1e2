"""Loop closure: conditions on pairs of bodies by joints that carry no body.

A link keeps a distance; a joint that closes a loop keeps components of a point and angles of
directions (`CLOSING`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from ...errors import InvalidLinkage
from . import elements as e
from .hard_points import HardPoints, label
from .spanning_tree import SpanningTree

#: Conditions of a joint that closes a loop: components of its point along and across the axis, and
#: rotations.
CLOSING: dict[type, tuple[str, str]] = {
    e.Revolute: ("apq", "pq"),
    e.Prismatic: ("pq", "pqa"),
    e.Cylindrical: ("pq", "pq"),
    e.Fixed: ("apq", "pqa"),
}


class Condition(NamedTuple):
    """Ends and vectors of one equation, its two bodies and its element."""

    parts: tuple[int, ...]
    bodies: tuple[int, int]
    name: str


class LoopClosure:
    """Conditions of the elements that carry no body.

    Parameters
    ----------
    tree : SpanningTree
    points : HardPoints
        Points and directions of the conditions are added to it.
    free_links : set of str
        Names of links with a driven, held or read length: they close no loop.
    charted : set of str
        Names of guides with a driven, held or read coordinate: their point becomes a body.

    Attributes
    ----------
    distances, offsets, angles : list of Condition
        Two ends with a constant distance; two ends that coincide along a vector; two vectors with a
        constant angle.
    on_guides : list of (int, int, OnGuide)
        End, and body that carries the guide.
    free_ends : dict of str to Condition
        Ends of the free links.
    facing : list of (int, int)
        Pairs of vectors of equal direction; the conditions on their angles also hold for a reversed
        joint.
    turned : set of int
        Bodies with conditions on directions, not only on points.
    """

    def __init__(self, tree: SpanningTree, points: HardPoints, free_links: set[str], charted: set[str]) -> None:
        self.tree, self.points, self.free_links, self.charted = tree, points, free_links, charted
        self.distances: list[Condition] = []
        self.offsets: list[Condition] = []
        self.angles: list[Condition] = []
        self.on_guides: list[tuple[int, int, e.OnGuide]] = []
        self.free_ends: dict[str, Condition] = {}
        self.turned: set[int] = set()
        self.facing: list[tuple[int, int]] = []

    def add(self, x: e.Element) -> None:
        """Add the conditions of an element."""
        if isinstance(x, e.Link):
            self._add_link(x)
        elif isinstance(x, e.KeepAngle):
            a, b = self.tree.pair(x)
            one, other = self.points.direction(x.axis_a, label(x)), self.points.direction(x.axis_b, label(x))
            self._add_angle(label(x), (a, one), (b, other))
        elif isinstance(x, e.OnGuide):
            self._add_guide(x)
        elif isinstance(x, e.Spherical | e.Universal):
            body, on = self.tree.pair(x)
            self._add_coincidence(label(x), self.points.point(x.at, f"{label(x)}.at"), on, body, self._world())
            if isinstance(x, e.Universal):
                one, other = (self.points.direction(v, f"{label(x)}.axis") for v in (x.axis_on, x.axis))
                self._add_angle(label(x), (on, one), (body, other))
        elif not self.tree.carries(x):
            self._add_joint(x)

    def _add_link(self, x: e.Link) -> None:
        a, b = self.tree.pair(x)
        one, other = self.points.point(x.from_, f"{label(x)}.from"), self.points.point(x.to, f"{label(x)}.to")
        link = Condition((self.points.end(a, one), self.points.end(b, other)), (a, b), label(x))
        if x.name and x.name in self.free_links:
            self.free_ends[x.name] = link
            return
        if self.points.coincident(one, other):
            raise InvalidLinkage(f"{label(x)} has no length: use Spherical")
        self.distances.append(link)

    def _add_guide(self, x: e.OnGuide) -> None:
        body, on = self.tree.pair(x)
        p = self.points.point(x.at, f"{label(x)}.at")
        if x.name and x.name in self.charted:
            self._add_coincidence(label(x), p, self.tree.add(f"{x.name} (point)", x), body, self._world())
        else:
            self.on_guides.append((self.points.end(body, p), on, x))
            self.turned.add(on)

    def _add_joint(self, x: Any) -> None:
        if isinstance(x, e.Screw):
            raise InvalidLinkage(f"{label(x)} closes a loop: state a screw before the other joints of its body")
        body, on = self.tree.pair(x)
        p, axis = self.points.axis(x)
        components, turns = CLOSING[type(x)]
        direction = dict(zip("apq", (axis, *self.points.across(axis)), strict=True))
        self._add_coincidence(label(x), p, on, body, [direction[k] for k in components])
        self.facing.append((self.points.vector(on, axis), self.points.vector(body, axis)))
        if "a" in turns:
            same = direction["p"]
            self.facing.append((self.points.vector(on, same), self.points.vector(body, same)))
        for k in turns:
            other, mine = (direction["p"], direction["q"]) if k == "a" else (axis, direction[k])
            self._add_angle(label(x), (on, other), (body, mine))

    def _world(self) -> list[int]:
        return [self.points.direction(v, k) for k, v in e.DIRECTIONS.items()]

    def _add_coincidence(self, name: str, p: int, on: int, body: int, along: Sequence[int]) -> None:
        """Add conditions that two hard points coincide along directions of one body."""
        if len(along) < len(e.DIRECTIONS):
            self.turned.add(on)
        for d in along:
            parts = self.points.end(on, p), self.points.end(body, p), self.points.vector(on, d)
            self.offsets.append(Condition(parts, (on, body), name))

    def _add_angle(self, name: str, one: tuple[int, int], other: tuple[int, int]) -> None:
        """Add the condition that two directions, each (body, direction), keep their angle."""
        parts = self.points.vector(*one), self.points.vector(*other)
        self.turned |= {one[0], other[0]}
        self.angles.append(Condition(parts, (one[0], other[0]), name))
