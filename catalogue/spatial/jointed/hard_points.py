"""Check and number the hard points and directions of a mechanism, by body."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...errors import InvalidLinkage, quoted
from ...given import array
from ...kinematics.types import Array
from . import elements as e

#: Largest coordinate: the squares of larger ones might overflow.
MAX_COORDINATE = 1e100


def numbers(value: Any, what: str, size: int = 3) -> Array:
    """Return a point or a direction as an array (N, size), checked."""
    found = np.atleast_2d(array(what, value, (size,), (None, size), wrong=InvalidLinkage))
    if not np.abs(found).max() <= MAX_COORDINATE:
        raise InvalidLinkage(f"{what} must be {size} finite numbers up to {MAX_COORDINATE:g}, not {quoted(value)}")
    return found


def label(x: e.Element) -> str:
    """Return the name of an element, or its kind and bodies if it has none."""
    if x.name:
        return x.name
    if isinstance(x, e.Coupling):
        return f"Coupling {e.title(x.scalar)}"
    first, second = e.joined_bodies(x)
    return f"{type(x).__name__} {first}-{second}"


class HardPoints:
    """Hard points and directions, numbered in order of addition, and attached to bodies.

    Attributes
    ----------
    points : list of ndarray, shape (1, 3) or (N, 3)
    labels : list of str
        Names of the points.
    directions : list of (int, int) or ndarray, shape (1, 3) or (N, 3)
        Pairs of hard points, from the first to the second; or unit vectors.
    ends, vectors : list of (int, int)
        Body and hard point; body and direction.
    """

    def __init__(self) -> None:
        self.points: list[Array] = []
        self.labels: list[str] = []
        self.directions: list[tuple[int, int] | Array] = []
        self.ends: list[tuple[int, int]] = []
        self.vectors: list[tuple[int, int]] = []

    def point(self, value: Any, label: str) -> int:
        """Add a hard point."""
        self.points.append(numbers(value, label))
        self.labels.append(label)
        return len(self.points) - 1

    def direction(self, vector: Any, label: str) -> int:
        """Add a direction, independent of hard points."""
        v = numbers(vector, label)
        length = np.sqrt((v * v).sum(1, keepdims=True))
        if not (length > 0).all():
            raise InvalidLinkage(f"{label} is no direction: its length is 0")
        self.directions.append(v / length)
        return len(self.directions) - 1

    def between(self, first: int, second: int) -> int:
        """Add the direction from a hard point to another."""
        self.directions.append((first, second))
        return len(self.directions) - 1

    def unit_vector(self, vector: Any, label: str) -> Array:
        """Add a direction and return its unit vectors (N, 3)."""
        found = self.directions[self.direction(vector, label)]
        assert isinstance(found, np.ndarray)
        return found

    def across(self, direction: int) -> tuple[int, int]:
        """Add two directions perpendicular to one, continuous functions of the hard points."""
        known = self.directions[direction]
        v = known if isinstance(known, np.ndarray) else self.points[known[1]] - self.points[known[0]]
        first = np.cross(v, np.eye(3)[np.abs(v).argmin(1)])
        return self.direction(first, "axis"), self.direction(np.cross(v, first), "axis")

    def axis(self, x: Any) -> tuple[int, int]:
        """Add the hard point and the direction of a joint."""
        name = label(x)
        at = self.point(x.at, f"{name}.at")
        if isinstance(x, e.Prismatic) or x.axis is not None:
            return at, self.direction(x.axis, f"{name}.axis")
        if x.to is None:
            raise InvalidLinkage(f"{name} needs an axis, or a second point on it")
        to = self.point(x.to, f"{name}.to")
        if self.coincident(at, to):
            raise InvalidLinkage(f"{name}: both points of its axis are one")
        return at, self.between(at, to)

    def coincident(self, first: int, second: int) -> bool:
        """Return whether two hard points coincide in any mechanism of the batch."""
        self.batch()  # raises if the sizes of batches differ
        one, other = np.broadcast_arrays(self.points[first], self.points[second])
        return bool((one == other).all(-1).any())

    def end(self, body: int, point: int) -> int:
        """Return the number of a hard point on a body."""
        return _index(self.ends, (body, point))

    def vector(self, body: int, direction: int) -> int:
        """Return the number of a direction in a body."""
        return _index(self.vectors, (body, direction))

    def of(self, body: int) -> list[int]:
        """Return the hard points that are attached to a body."""
        return [p for b, p in self.ends if b == body]

    def batch(self) -> int:
        """Return the number of mechanisms of the points and directions."""
        sizes = {len(v) for v in (*self.points, *self.directions) if isinstance(v, np.ndarray)} - {1}
        if len(sizes) > 1:
            different = " and ".join(str(n) for n in sorted(sizes))
            raise InvalidLinkage(f"points are of batches of {different} mechanisms: give one for all, or one for each")
        return sizes.pop() if sizes else 1


def scale(elements: Sequence[e.Element]) -> tuple[Array, float]:
    """Return the centre (3,) of all points, and the power of 2 nearest to their extent."""
    named = [(x, k) for x in elements for k in ("at", "to", "from_", "origin") if getattr(x, k, None) is not None]
    every = np.concatenate(
        [np.zeros((0, 3)), *(numbers(getattr(x, k), f"{label(x)}.{k.strip('_')}") for x, k in named)]
    )
    every = every if len(every) else np.zeros((1, 3))
    size = float(np.ptp(every, axis=0).max())
    return (every.max(0) + every.min(0)) / 2, 2.0 ** round(np.log2(size)) if size else 1.0


def directions(known: Sequence[Any], points: Array) -> Array:
    """Return unit vectors (N, d, 3): fixed ones, and those from hard point to hard point."""
    out = np.zeros((len(points), len(known), 3))
    for k, s in enumerate(known):
        v = s if isinstance(s, np.ndarray) else points[:, s[1]] - points[:, s[0]]
        out[:, k] = v / np.sqrt((v * v).sum(-1, keepdims=True))
    return out


def _index(items: list[Any], item: Any) -> int:
    if item not in items:
        items.append(item)
    return items.index(item)
