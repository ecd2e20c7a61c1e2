"""From what an engineer states to equations: which joint carries which body, and what closes the loops.

A joint that closes a loop becomes conditions on two bodies: components of a point, angles of directions (`CLOSING`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...errors import InvalidLinkage, InvalidRequest, quoted
from ...given import array
from ...kinematics.types import Array
from ..geometry.guides import Guides
from ..geometry.rotation import matrix
from . import elements as e
from .scalars import Compiled, CompiledAngle, CompiledLength, CompiledTravel, CompiledUnknown
from .system import OnKind, System
from .tree import (
    CURVE,
    CYLINDRICAL,
    FREE,
    NUMBERS,
    PRISMATIC,
    REVOLUTE,
    SURFACE,
    UNKNOWNS,
    Laid,
    Placed,
)

#: Conditions of a joint that closes a loop: components of its point along the axis and across it, and turns.
CLOSING = {e.Revolute: ("apq", "pq"), e.Prismatic: ("pq", "pqa"), e.Cylindrical: ("pq", "pq")}
SORT = {e.Revolute: REVOLUTE, e.Screw: REVOLUTE, e.Prismatic: PRISMATIC, e.Cylindrical: CYLINDRICAL}
#: Largest coordinate: the squares of larger ones might be no doubles.
FAR = 1e100
#: How far, of the size of the mechanism, a point may be off its guide in the design pose.
OFF = 1e-9
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def numbers(value: Any, what: str, size: int = 3) -> Array:
    """Return a point or a direction as an array (N, size), checked."""
    found = np.atleast_2d(array(what, value, (size,), (None, size), wrong=InvalidLinkage))
    if not np.abs(found).max() <= FAR:
        raise InvalidLinkage(f"{what} must be {size} finite numbers up to {FAR:g}, not {quoted(value)}")
    return found


class Compiler:
    """Collects bodies, hard points, joints and conditions of elements and scalars; `system` is what they make."""

    def __init__(self, elements: Sequence[e.Element], scalars: Sequence[e.Scalar]) -> None:
        self.elements = elements
        self.points: list[Array] = []
        self.labels: list[str] = []
        self.ways_of: list[tuple[int, int] | Array] = []
        self.end_list: list[tuple[int, int]] = []
        self.way_list: list[tuple[int, int]] = []
        self.distance: list[tuple[int, int]] = []
        self.offset: list[tuple[int, int, int]] = []
        self.angle: list[tuple[int, int]] = []
        self.on_guides: list[tuple[int, int, e.OnGuide]] = []
        self.row_bodies: dict[str, list[tuple[int, int]]] = {"distance": [], "offset": [], "angle": [], "guide": []}
        self.row_names: dict[str, list[str]] = {"distance": [], "offset": [], "angle": [], "guide": []}
        self.bodies = [e.GROUND]
        self.free_ends: dict[str, tuple[tuple[int, int], tuple[int, int]]] = {}
        self.free_links = {s.link for s in scalars if isinstance(s, e.Length) and s.link}
        self.charted = {s.guide for s in scalars if isinstance(s, e.GuideCoordinate)}
        for name, kind in [(n, e.Link) for n in self.free_links] + [(n, e.OnGuide) for n in self.charted]:
            if name not in {x.name for x in elements if isinstance(x, kind)}:
                raise InvalidRequest(f"there is no {kind.__name__} named {name!r}")
        self._hang()
        for element in elements:
            self._close(element)
        self._locate()

    # -- bodies -------------------------------------------------------------------------------------------------------
    def _hang(self) -> None:
        """Let bodies hang on joints, in an order in which each hangs on an earlier one; the others are free."""
        named: list[str] = []
        for x in self.elements:
            pair = (x.a, x.b) if isinstance(x, e.Link | e.KeepAngle) else (x.body, x.on)
            if pair[0] == pair[1]:
                raise InvalidLinkage(f"{_label(x)} joins {pair[0]} to itself")
            named += [b for b in pair if b not in (*named, e.GROUND)]
        if not named:
            raise InvalidLinkage("a mechanism needs a body and what guides it")
        carriers: dict[str, e.Revolute | e.Prismatic | e.Cylindrical] = {}
        for x in self.elements:
            if isinstance(x, e.Revolute | e.Prismatic | e.Cylindrical) and x.body not in carriers:
                if x.body == e.GROUND:
                    raise InvalidLinkage(f"{_label(x)}: the ground hangs on nothing; name the body first, then on what")
                carriers[x.body] = x
        self.carrier: dict[str, e.Element | None] = {}
        while left := [b for b in named if b not in self.bodies]:
            ready = [b for b in left if b not in carriers or carriers[b].on in self.bodies]
            if not ready:
                raise InvalidLinkage(f"{', '.join(left)} hang on each other: let one hang on another body")
            for b in ready:
                self.bodies.append(b)
                self.carrier[b] = carriers.get(b)
        self.used = {id(x) for x in carriers.values()}

    def body(self, name: str, what: str) -> int:
        if name not in self.bodies:
            raise InvalidRequest(f"{what}: there is no body {name!r}, only {', '.join(self.bodies)}")
        return self.bodies.index(name)

    # -- points and directions ----------------------------------------------------------------------------------------
    def point(self, value: Any, label: str) -> int:
        self.points.append(numbers(value, label))
        self.labels.append(label)
        return len(self.points) - 1

    def end(self, body: int, point: int) -> int:
        return _index(self.end_list, (body, point))

    def way(self, body: int, direction: int) -> int:
        return _index(self.way_list, (body, direction))

    def fixed(self, vector: Any, label: str) -> int:
        v = numbers(vector, label)
        length = np.sqrt((v * v).sum(1, keepdims=True))
        if not (length > 0).all():
            raise InvalidLinkage(f"{label} is no direction: its length is 0")
        self.ways_of.append(v / length)
        return len(self.ways_of) - 1

    def unit_vector(self, vector: Any, label: str) -> Array:
        """Return a direction as unit vectors (N, 3)."""
        found = self.ways_of[self.fixed(vector, label)]
        assert isinstance(found, np.ndarray)
        return found

    def axis(self, x: Any) -> tuple[int, int]:
        """Return the hard point and the direction of a joint."""
        label = _label(x)
        at = self.point(x.at, f"{label}.at")
        if isinstance(x, e.Prismatic) or x.axis is not None:
            return at, self.fixed(x.axis, f"{label}.axis")
        if x.to is None:
            raise InvalidLinkage(f"{label} needs an axis, or a second point on it")
        to = self.point(x.to, f"{label}.to")
        if (np.broadcast_arrays(self.points[at], self.points[to])[0] == self.points[to]).all(-1).any():
            raise InvalidLinkage(f"{label}: both points of its axis are one")
        self.ways_of.append((at, to))
        return at, len(self.ways_of) - 1

    # -- loops --------------------------------------------------------------------------------------------------------
    def _row(self, kind: str, label: str, bodies: tuple[int, int]) -> None:
        self.row_bodies[kind].append(bodies)
        self.row_names[kind].append(label)

    def _close(self, x: e.Element) -> None:
        label = _label(x)
        if isinstance(x, e.Link):
            a, b = self.bodies.index(x.a), self.bodies.index(x.b)
            ends = self.end(a, self.point(x.from_, f"{label}.from")), self.end(b, self.point(x.to, f"{label}.to"))
            if x.name and x.name in self.free_links:
                self.free_ends[x.name] = ends, (a, b)
                return
            if (np.broadcast_arrays(self.points[-2], self.points[-1])[0] == self.points[-1]).all(-1).any():
                raise InvalidLinkage(f"{label} has no length: use Spherical")
            self.distance.append(ends)
            self._row("distance", label, (a, b))
        elif isinstance(x, e.KeepAngle):
            a, b = self.bodies.index(x.a), self.bodies.index(x.b)
            self.angle.append((self.way(a, self.fixed(x.axis_a, label)), self.way(b, self.fixed(x.axis_b, label))))
            self._row("angle", label, (a, b))
        elif isinstance(x, e.OnGuide):
            body, on = self.bodies.index(x.body), self.bodies.index(x.on)
            p = self.point(x.at, f"{label}.at")
            if x.name and x.name in self.charted:
                self.bodies.append(f"{x.name} (point)")
                self.carrier[self.bodies[-1]] = x
                self._coincide(label, p, len(self.bodies) - 1, body, "xyz", None)
            else:
                self.on_guides.append((self.end(body, p), on, x))
        elif isinstance(x, e.Spherical):
            p = self.point(x.at, f"{label}.at")
            self._coincide(label, p, self.bodies.index(x.on), self.bodies.index(x.body), "xyz", None)
        elif id(x) not in self.used:
            if isinstance(x, e.Screw):
                raise InvalidLinkage(f"{label} closes a loop: state a screw before the other joints of its body")
            on, body = self.bodies.index(x.on), self.bodies.index(x.body)
            p, d = self.axis(x)
            points, turns = CLOSING[type(x)]
            across = {"a": d}
            across["p"], across["q"] = self._across(d)
            self._coincide(label, p, on, body, points, across)
            for k in turns:
                other = across["p"] if k == "a" else d
                mine = across["q"] if k == "a" else across[k]
                self.angle.append((self.way(on, other), self.way(body, mine)))
                self._row("angle", label, (on, body))

    def _across(self, direction: int) -> tuple[int, int]:
        """Return two directions across one; they stay where they are when hard points are moved a little."""
        spec = self.ways_of[direction]
        v = spec if isinstance(spec, np.ndarray) else self.points[spec[1]] - self.points[spec[0]]
        first = np.cross(v, np.eye(3)[np.abs(v).argmin(1)])
        return self.fixed(first, "axis"), self.fixed(np.cross(v, first), "axis")

    def _coincide(self, label: str, p: int, on: int, body: int, along: str, across: dict[str, int] | None) -> None:
        for k in along:
            d = self.fixed(AXES[k], k) if across is None else across[k]
            self.offset.append((self.end(on, p), self.end(body, p), self.way(on, d)))
            self._row("offset", label, (on, body))

    # -- scales -------------------------------------------------------------------------------------------------------
    def _locate(self) -> None:
        named = [
            (x, k) for x in self.elements for k in ("at", "to", "from_", "origin") if getattr(x, k, None) is not None
        ]
        every = np.concatenate(
            [np.zeros((0, 3)), *(numbers(getattr(x, k), f"{_label(x)}.{k.strip('_')}") for x, k in named)]
        )
        every = every if len(every) else np.zeros((1, 3))
        self.centre = (every.max(0) + every.min(0)) / 2
        size = float(np.ptp(every, axis=0).max())
        self.unit = 2.0 ** round(np.log2(size)) if size else 1.0

    def laid(self, x: e.OnGuide) -> Laid:
        """Return a guide in units; raise if the design pose is not on it."""
        guides = Guides(x.guide, x.parameters, x.origin, x.quaternion)
        if len(guides) > 1 or len(numbers(x.at, _label(x))) > 1:
            raise InvalidLinkage(f"{_label(x)}: a guide and its point are the same for a whole batch: give one")
        kind, _, p = guides.each()[0]
        one = np.array([self.unit])
        shape = kind.scaled(p, one)[:, 0] if len(p) else np.zeros(0)
        frame = matrix(guides.quaternion.T / np.abs(guides.quaternion).max())[:, :, 0]
        origin = (guides.origin[0] - self.centre) / self.unit
        local = frame.T @ ((numbers(x.at, _label(x))[0] - self.centre) / self.unit - origin)
        value, slope = kind.gradients(local[:, None], shape[:, None])
        off = float(np.abs(value[:, 0] / np.sqrt((slope**2).sum(1))[:, 0]).max())
        if not off < OFF * max(1.0, float(np.abs(local).max())):
            raise InvalidLinkage(
                f"{_label(x)}: its point is {off * self.unit:.3g} off the {kind.name} in the design pose"
            )
        u, w = (float(v[0]) for v in kind.locate(local[:, None], shape[:, None]))
        return Laid(kind, shape, frame, origin, (u,) if kind.conditions == 2 else (u, w))

    # -- the system ---------------------------------------------------------------------------------------------------
    def system(self, scalars: Sequence[e.Scalar]) -> System:
        """Return the equations, with the scalars as further rows."""
        placed, column, number = [], 0, 0
        where: dict[str, tuple[int, int]] = {}
        moves: list[set[int]] = [set() for _ in self.bodies]
        for i, name in enumerate(self.bodies[1:], 1):
            x = self.carrier[name]
            guide, on, at, d, lead = None, 0, 0, 0, 0.0
            if isinstance(x, e.OnGuide):
                guide = self.laid(x)
                sort, on = (CURVE if guide.kind.conditions == 2 else SURFACE), self.body(x.on, name)
                at = next(p for b, p in self.end_list if b == i)
            elif x is None:
                sort = FREE
                at = next((p for b, p in self.end_list if b == i), 0)
            else:
                assert isinstance(x, e.Revolute | e.Prismatic | e.Cylindrical)  # `_hang` takes no others
                sort, on = SORT[type(x)], self.body(x.on, name)
                at, d = self.axis(x)
                turn = numbers((x.lead,), f"{_label(x)}.lead", 1).item() if isinstance(x, e.Screw) else 0.0
                lead = turn / (2 * np.pi * self.unit)
            placed.append(Placed(sort, [i], [on], [column], [number], [at], [d], guide, (lead,) if lead else ()))
            moves[i] = moves[on] | set(range(column, column + UNKNOWNS[sort]))
            where[name] = (column, number)
            column, number = column + UNKNOWNS[sort], number + NUMBERS[sort]
        idle = self._idle(placed)
        extra = [self._scalar(s, where) for s in scalars]
        row_bodies = [*self.row_bodies["distance"], *self.row_bodies["offset"], *self.row_bodies["angle"]]
        guides, row = [], len(row_bodies)
        self.names = [*self.row_names["distance"], *self.row_names["offset"], *self.row_names["angle"]]
        for end, on, x in self.on_guides:
            laid = self.laid(x)
            guides.append(OnKind(end, on, laid, slice(row, row + laid.kind.conditions)))
            row += laid.kind.conditions
            row_bodies += [(on, self.end_list[end][0])] * laid.kind.conditions
            self.names += [_label(x)] * laid.kind.conditions
        row_bodies += [(0, self.way_list[w][0]) for w in idle]
        self.names += [f"idle rotation of {self.bodies[self.way_list[w][0]]}" for w in idle]
        rows = len(row_bodies)
        sign = np.zeros((rows + len(extra), column))
        for r, (a, b) in enumerate(row_bodies + [s.bodies for s in extra]):
            sign[r, list(moves[b])] += 1
            sign[r, list(moves[a])] -= 1
        n = self._batch()
        points = np.stack([np.broadcast_to(p, (n, 3)) for p in self.points], axis=1)
        points = (points - self.centre) / self.unit
        return System(
            tuple(self.bodies), points, directions(self.ways_of, points), _grouped(placed), column, number,
            ([b for b, _ in self.end_list], [p for _, p in self.end_list]),
            ([b for b, _ in self.way_list], [d for _, d in self.way_list]),
            np.array(self.distance, int).reshape(-1, 2).T, np.array(self.offset, int).reshape(-1, 3).T,
            np.array(self.angle, int).reshape(-1, 2).T, tuple(guides), np.array(idle, int).reshape(1, -1),
            sign, rows, tuple(extra), np.arange(rows), self.centre, self.unit, tuple(self.names),
            tuple(self.ways_of), tuple(self.labels), tuple(_label(x) for x in self.elements),
        )  # fmt: skip

    def _batch(self) -> int:
        """Return how many mechanisms the points and directions are of."""
        sizes = {len(v) for v in (*self.points, *self.ways_of) if isinstance(v, np.ndarray)} - {1}
        if len(sizes) > 1:
            told = " and ".join(str(n) for n in sorted(sizes))
            raise InvalidLinkage(f"points are of batches of {told} mechanisms: give one for all, or one for each")
        return sizes.pop() if sizes else 1

    def _idle(self, placed: list[Placed]) -> list[int]:
        """Return ways about which free bodies spin idly: all that holds them acts on points of one line."""
        out = []
        for p in placed:
            body = p.bodies[0]
            held = {b for a, c in self.row_bodies["angle"] for b in (a, c)} | {on for _, on, _ in self.on_guides}
            held |= {q.on[0] for q in placed} | {a for a, _ in self.row_bodies["offset"]}
            ends = [q for b, q in self.end_list if b == body]
            if p.sort != FREE or body in held or not ends:
                continue
            x = np.stack([self.points[q][0] for q in ends])
            apart = x - x[0]
            far = int((apart**2).sum(1).argmax())
            if not apart[far].any() or np.linalg.svd(apart, compute_uv=False)[1:2].sum() > 1e-9 * np.abs(apart).max():
                continue
            self.ways_of.append((ends[0], ends[far]))
            out.append(self.way(body, len(self.ways_of) - 1))
        return out

    def _scalar(self, s: e.Scalar, where: dict[str, tuple[int, int]]) -> Compiled:
        if isinstance(s, e.Joint | e.GuideCoordinate):
            name = f"{s.guide} (point)" if isinstance(s, e.GuideCoordinate) else s.body
            i = self.body(name, "drive")
            x = self.carrier[name]
            if x is None:
                raise InvalidRequest(f"{name} hangs on no joint that could be driven: drive a Travel or an Angle")
            if isinstance(s, e.GuideCoordinate):
                assert isinstance(x, e.OnGuide)  # the point is carried by it
                laid, index = self.laid(x), "uw".find(s.coordinate)
                if not 0 <= index < len(laid.start):
                    raise InvalidRequest(f"{s.guide} has no coordinate {s.coordinate!r}")
                unit = float(laid.kind.coordinate_unit(index, np.array([self.unit]))[0])
                angular = laid.kind.spans[index] == np.pi and "uw"[index] not in laid.kind.lengths
            else:
                index = s.index
                if not 0 <= index < UNKNOWNS[SORT[type(x)]]:
                    raise InvalidRequest(f"the joint of {name} has no coordinate {index}")
                angular = not (isinstance(x, e.Prismatic) or index)
                unit = 1.0 if angular else self.unit
            column, number = where[name]
            return CompiledUnknown((0, i), unit, angular, number + index, column + index)
        if isinstance(s, e.Travel):
            body = self.body(s.body, "Travel")
            point = self.point(s.point, "Travel.point")
            along = AXES.get(s.along) if isinstance(s.along, str) else s.along
            if along is None:
                raise InvalidRequest(f"Travel along {s.along!r}: give x, y, z or three numbers")
            way = self.way(0, self.fixed(along, "Travel.along"))
            return CompiledTravel((0, body), self.unit, False, self.end(body, point), self.end(0, point), way)
        if isinstance(s, e.Length):
            if s.link:
                ends, bodies = self.free_ends[s.link]
            else:
                bodies = self.body(s.a, "Length"), self.body(s.b, "Length")
                ends = (
                    self.end(bodies[0], self.point(s.from_, "Length.from")),
                    self.end(bodies[1], self.point(s.to, "Length.to")),
                )
            return CompiledLength(bodies, self.unit, False, *ends)
        about, direction = self.unit_vector(s.about, "Angle.about"), self.unit_vector(s.direction, "Angle.direction")
        if len({len(about), len(direction)} - {1}) > 1:
            raise InvalidLinkage("the directions of an Angle are of batches of different sizes")
        first = direction - (direction * about).sum(-1, keepdims=True) * about
        if not (np.sqrt((first * first).sum(-1)) > 1e-9).all():
            raise InvalidRequest("an Angle needs a direction that is not along its axis")
        body = self.body(s.body, "Angle")
        ways = [self.way(0, self.fixed(v, "Angle")) for v in (first, np.cross(about, first))]
        return CompiledAngle((0, body), 1.0, True, self.way(body, self.fixed(direction, "Angle.direction")), *ways)


def directions(specs: Sequence[Any], points: Array) -> Array:
    """Return unit vectors (N, d, 3): fixed ones, and those from hard point to hard point."""
    out = np.zeros((len(points), len(specs), 3))
    for k, s in enumerate(specs):
        v = s if isinstance(s, np.ndarray) else points[:, s[1]] - points[:, s[0]]
        out[:, k] = v / np.sqrt((v * v).sum(-1, keepdims=True))
    return out


def _grouped(placed: list[Placed]) -> tuple[Placed, ...]:
    """Return neighbours of one sort that hang on the ground, or are free, together."""
    out: list[Placed] = []
    for p in placed:
        last = out[-1] if out else None
        if last and p.sort == last.sort and not p.guide and not any(p.on + last.on):
            out[-1] = Placed(
                p.sort, last.bodies + p.bodies, last.on + p.on, last.unknown + p.unknown, last.number + p.number,
                last.point + p.point, last.direction + p.direction,
                lead=(*_leads(last), *_leads(p)) if last.lead or p.lead else (),
            )  # fmt: skip
        else:
            out.append(p)
    return tuple(out)


def _leads(p: Placed) -> tuple[float, ...]:
    return p.lead or (0.0,) * len(p.bodies)


def _index(items: list[Any], item: Any) -> int:
    if item not in items:
        items.append(item)
    return items.index(item)


def _label(x: e.Element) -> str:
    if x.name:
        return x.name
    pair = (x.a, x.b) if isinstance(x, e.Link | e.KeepAngle) else (x.body, x.on)
    return f"{type(x).__name__} {pair[0]}-{pair[1]}"
