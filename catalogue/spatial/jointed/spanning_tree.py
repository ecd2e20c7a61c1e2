"""Choose the joints that carry bodies: a spanning tree rooted in the ground."""

from __future__ import annotations

from collections.abc import Sequence

from ...errors import InvalidLinkage, InvalidRequest
from . import elements as e
from .hard_points import label
from .tree import Placed

#: Joints that can carry a body.
Carrier = e.Revolute | e.Prismatic | e.Cylindrical


class SpanningTree:
    """Bodies in order; each is carried by an earlier one by its first joint, or is free.

    Attributes
    ----------
    bodies : list of str
        The ground first.
    carrier : dict of str to Revolute, Prismatic, Cylindrical, OnGuide or None
        The joint that carries each other body; None for a free one.
    """

    def __init__(self, elements: Sequence[e.Element]) -> None:
        named = _named_bodies(elements)
        carriers = _carriers(elements)
        self.bodies = [e.GROUND]
        self.carrier: dict[str, Carrier | e.OnGuide | None] = {}
        while left := [b for b in named if b not in self.bodies]:
            ready = [b for b in left if b not in carriers or carriers[b].on in self.bodies]
            if not ready:
                raise InvalidLinkage(f"{', '.join(left)} hang on each other: let one hang on another body")
            for b in ready:
                self.bodies.append(b)
                self.carrier[b] = carriers.get(b)

    def add(self, name: str, x: e.OnGuide) -> int:
        """Add a point on a guide as a body that does not turn; return its number."""
        self.bodies.append(name)
        self.carrier[name] = x
        return len(self.bodies) - 1

    def carries(self, x: e.Element) -> bool:
        """Return whether a joint carries a body; otherwise it closes a loop."""
        return any(x is joint for joint in self.carrier.values())

    def body(self, name: str, what: str) -> int:
        """Return the number of a body; raise InvalidRequest if there is none of that name."""
        if name not in self.bodies:
            raise InvalidRequest(f"{what}: there is no body {name!r}, only {', '.join(self.bodies)}")
        return self.bodies.index(name)

    def pair(self, x: e.Element) -> tuple[int, int]:
        """Return the numbers of the two bodies that an element joins."""
        first, second = e.joined_bodies(x)
        return self.bodies.index(first), self.bodies.index(second)


def _named_bodies(elements: Sequence[e.Element]) -> list[str]:
    """Return the bodies without the ground, in order of first mention."""
    named: list[str] = []
    for x in elements:
        pair = e.joined_bodies(x)
        if pair[0] == pair[1]:
            raise InvalidLinkage(f"{label(x)} joins {pair[0]} to itself")
        named += [b for b in pair if b not in (*named, e.GROUND)]
    if not named:
        raise InvalidLinkage("a mechanism needs a body and what guides it")
    return named


def _carriers(elements: Sequence[e.Element]) -> dict[str, Carrier]:
    """Return the first joint of each body, which carries it."""
    carriers: dict[str, Carrier] = {}
    for x in elements:
        if isinstance(x, Carrier) and x.body not in carriers:
            if x.body == e.GROUND:
                raise InvalidLinkage(f"{label(x)}: the ground hangs on nothing; name the body first, then on what")
            carriers[x.body] = x
    return carriers


def merge_placed(placed: Sequence[Placed]) -> tuple[Placed, ...]:
    """Merge neighbouring entries of one kind that are carried by the ground or free."""
    out: list[Placed] = []
    for p in placed:
        last = out[-1] if out else None
        if last and p.joint_kind == last.joint_kind and not p.guide and not any(p.on + last.on):
            out[-1] = Placed(
                p.joint_kind,
                last.bodies + p.bodies,
                last.on + p.on,
                last.unknown + p.unknown,
                last.number + p.number,
                last.point + p.point,
                last.direction + p.direction,
                lead=(*_leads_of(last), *_leads_of(p)) if last.lead or p.lead else (),
            )
        else:
            out.append(p)
    return tuple(out)


def _leads_of(p: Placed) -> tuple[float, ...]:
    return p.lead or (0.0,) * len(p.bodies)
