"""Stack the parts of a guide in levels without collisions in motion.

Every part is a convex hull with a rounded border.  Parts whose hulls come nearer than their borders
in any pose of the stroke conflict.  A block lies in the level of the link whose slot it runs in.
Among the assignments without a conflict, those come first whose pins cross the fewest parts between
the levels they join, then those with the fewest levels. The best one is chosen; for many bars the
best one that a bounded search finds.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ..kinematics.types import Complexes, Mask
from .links import Places
from .outlines import Part

#: Number of poses in which parts are compared: every two degrees where the driving crank turns
#: fully.
POSES = 181


@dataclass(frozen=True)
class Levels:
    """The level of every part, counted from the frame.

    Attributes
    ----------
    of : mapping of str to int
        Level of each link by name; 0 for the frame.
    crossed : tuple of (str, str)
        Pairs of a pin, named by its pivot, and a link that it crosses between the levels it joins.
    """

    of: Mapping[str, int]
    crossed: tuple[tuple[str, str], ...]

    @property
    def top(self) -> int:
        """First level above all parts."""
        return 1 + max(self.of.values())

    def notes(self) -> list[str]:
        """State each level and each crossed pin in a line, for the file."""
        named: dict[int, list[str]] = {}
        for name, level in self.of.items():
            named.setdefault(level, []).append(name)
        lines = [f"level {level}: {', '.join(named[level])}" for level in sorted(named)]
        return lines + [
            f"pin {pin} meets {link} between its levels: shape {link} around it" for pin, link in self.crossed
        ]


def stack_levels(cut: Sequence[Part], places: Places) -> Levels:
    """Assign a level to every part.

    Parameters
    ----------
    cut : sequence of Part
        Parts of one guide.
    places : Places
        Origins and directions of its links over the stroke.

    Returns
    -------
    Levels
    """
    groups: dict[str, list[Part]] = {}
    for part in cut:
        groups.setdefault(part.link.within or part.link.name, []).append(part)
    names = list(groups)
    hulls = {name: [_hull_over_motion(part, places) for part in parts] for name, parts in groups.items()}
    conflicts = {pair for pair in combinations(names, 2) if _any_overlap(hulls[pair[0]], hulls[pair[1]])}
    pins = _pin_groups(groups, places)
    crossings = {
        (pin, name)
        for pin, (ends, hull) in pins.items()
        for name in names
        if name not in ends and _any_overlap([hull], hulls[name])
    }
    ends = {pin: joined for pin, (joined, _) in pins.items()}
    of = _Assignment(names, conflicts, crossings, ends).best()
    crossed = tuple((pin, name) for pin, name in sorted(crossings) if _is_between(of, ends[pin], name))
    return Levels({part.link.name: of[part.link.within or part.link.name] for part in cut}, crossed)


class _Assignment:
    """Search for the best levels of groups by branch and bound."""

    #: Largest number of branches: enough for an exhaustive search of seven groups; with more groups
    #: it ends after a second.
    max_visits = 50_000

    def __init__(
        self,
        names: list[str],
        conflicts: set[tuple[str, str]],
        crossings: set[tuple[str, str]],
        ends: Mapping[str, tuple[str, ...]],
    ) -> None:
        self.names, self.ends, self.visits = names, ends, 0
        order = {name: k for k, name in enumerate(names)}
        self.apart: list[list[str]] = [[] for _ in names]
        for pair in conflicts:
            first, last = sorted(pair, key=order.__getitem__)
            self.apart[order[last]].append(first)
        # crossings that are known once the group at this place of the order has a level
        self.decided: list[list[tuple[str, str]]] = [[] for _ in names]
        for pin, name in crossings:
            self.decided[max(order[one] for one in (*ends[pin], name))].append((pin, name))
        self.rank: tuple[int, ...] | None = None
        self.found: dict[str, int] = {}

    def best(self) -> dict[str, int]:
        """Return the level of every group, the frame's being 0."""
        self._visit({}, 0)
        return self.found

    def _visit(self, of: dict[str, int], crossed: int) -> None:
        k, levels = len(of), tuple(of.values())[1:]
        rank = (crossed, max(levels, default=0), sum(levels), *levels)
        if self.rank is not None and rank >= self.rank[: len(rank)]:
            return
        if k == len(self.names):
            self.rank, self.found = rank, dict(of)
            return
        self.visits += 1
        if self.visits > self.max_visits and self.rank is not None:
            return
        taken = {of[one] for one in self.apart[k]}
        for level in range(len(self.names) if k else 1):
            if level not in taken:
                of[self.names[k]] = level
                met = sum(_is_between(of, self.ends[pin], name) for pin, name in self.decided[k])
                self._visit(of, crossed + met)
                del of[self.names[k]]


def _is_between(of: Mapping[str, int], ends: Sequence[str], name: str) -> bool:
    """Tell whether a group lies between the levels that a pin joins."""
    return min(of[end] for end in ends) < of[name] < max(of[end] for end in ends)


#: Corners of a hull over the motion, shape (m, k), and the width of its border.
Hull = tuple[Complexes, float]


def _hull_over_motion(part: Part, places: Places) -> Hull:
    """Return the hull of a part in all poses."""
    origin, turn = places[part.link.name]
    corners = np.array(part.core, complex)
    return origin[:, None] + turn[:, None] * corners, part.border


def _pin_groups(groups: Mapping[str, list[Part]], places: Places) -> dict[str, tuple[tuple[str, ...], Hull]]:
    """Return the pins by pivot: the groups that each joins, and its disc in all poses."""
    found: dict[str, tuple[tuple[str, ...], Hull]] = {}
    for group, parts in groups.items():
        for part in parts:
            origin, turn = places[part.link.name]
            for pivot, z in part.holes.items():
                ends, _ = found.get(pivot, ((), None))
                at = (origin + turn * z)[:, None]
                found[pivot] = ((*ends, group), (at, 0.5 * part.bore))
    return {pin: (ends, hull) for pin, (ends, hull) in found.items() if len(ends) > 1}


def _any_overlap(one: Sequence[Hull], other: Sequence[Hull]) -> bool:
    """Return whether any two hulls overlap in any pose."""
    return any(bool(_overlapping_poses(a, b).any()) for a in one for b in other)


def _overlapping_poses(one: Hull, other: Hull) -> Mask:
    """Return in which poses two hulls overlap, shape (m,)."""
    (a, border_a), (b, border_b) = one, other
    m = max(len(a), len(b))
    a, b = (np.broadcast_to(z, (m, z.shape[1])) for z in (a, b))
    near = np.minimum(_corner_distance(a, b), _corner_distance(b, a)) < (border_a + border_b) * (1 - 1e-9)
    return np.asarray(near | _cross(a, b) | _contains(a, b[:, 0]) | _contains(b, a[:, 0]))


def _sides(z: Complexes) -> tuple[Complexes, Complexes]:
    """Return the starts of the sides of polygons (m, k), and their vectors, shape (m, k)."""
    return z, np.roll(z, -1, axis=1) - z


def _corner_distance(corners: Complexes, polygon: Complexes) -> np.ndarray:
    """Compute the least distance of corners (m, p) from sides (m, q), shape (m,)."""
    start, way = _sides(polygon)
    away = corners[:, :, None] - start[:, None]
    square = np.maximum(np.abs(way) ** 2, np.finfo(float).tiny)
    share = np.clip((away * way.conj()[:, None]).real / square[:, None], 0, 1)
    return np.asarray(np.abs(away - share * way[:, None]).min((1, 2)))


def _cross(a: Complexes, b: Complexes) -> Mask:
    """Return in which poses a side of one polygon crosses one of the other, shape (m,)."""
    (start, way), (other, along) = _sides(a), _sides(b)

    def sides_of(line: Complexes, vector: Complexes, first: Complexes, ends: Complexes) -> Mask:
        left, right = (np.sign(((z - line) * vector.conj()).imag) for z in (first, first + ends))
        return np.asarray(left * right < 0)

    one = sides_of(start[:, :, None], way[:, :, None], other[:, None], along[:, None])
    two = sides_of(other[:, None], along[:, None], start[:, :, None], way[:, :, None])
    return np.asarray((one & two).any((1, 2)))


def _contains(polygon: Complexes, z: Complexes) -> Mask:
    """Return in which poses a convex polygon (m, k), counterclockwise, holds a place (m,)."""
    start, way = _sides(polygon)
    if polygon.shape[1] < 3:
        return np.zeros(len(z), bool)
    return np.asarray((((z[:, None] - start) * way.conj()).imag >= 0).all(1))
