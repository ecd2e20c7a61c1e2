"""Regions for pivots and links to stay in or out of: boxes, half planes, polygons."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np

from ..errors import InvalidRequest
from ..given import doubles, listed
from ..kinematics.types import Complexes, Floats, Mask

#: Coordinate that represents a side at infinity [unit of the region]: far beyond any linkage, exact
#: in doubles.
FAR = 1e7


@dataclass(frozen=True, eq=False)
class Region:
    """A polygon, convex or concave, with corners (k, 2); regions with equal corners are equal."""

    corners: Floats
    box: tuple[float, float, float, float]
    is_box: bool

    @cached_property
    def _measure_polygon(self) -> tuple[bool, tuple[float, ...]]:
        return self.is_box, tuple(self.corners.ravel().tolist())

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Region) and self._measure_polygon == other._measure_polygon

    def __hash__(self) -> int:
        return hash(self._measure_polygon)

    def to_list(self) -> list[Any]:
        """Convert to the sides of a box, x0, y0, x1, y1, or to points (x, y)."""
        return [float(side) for side in self.box] if self.is_box else self.corners.tolist()

    @classmethod
    def of(cls, name: str, given: object) -> Region:
        """Parse a region: a `Region`, a box (x0, y0, x1, y1) or at least three points."""
        if isinstance(given, Region):
            return given
        try:
            values = doubles(given)
        except ValueError:
            raise InvalidRequest(f"{name} must be x0, y0, x1, y1 or a list of points") from None
        if values.shape == (4,):
            (x0, x1), (y0, y1) = values[[0, 2]], values[[1, 3]]
            if x0 > x1 or y0 > y1:
                raise InvalidRequest(f"{name} is turned inside out: give the lower left corner first, x0 y0 x1 y1")
            corners = np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])
        elif values.ndim == 2 and values.shape[1] == 2 and len(values) >= 3:
            corners = values
        else:
            raise InvalidRequest(f"{name} must be x0, y0, x1, y1 or at least three points")
        if np.isnan(corners).any() or (values.ndim == 2 and np.isinf(corners).any()):
            raise InvalidRequest(f"{name} has a coordinate that is not a number; only a box may have sides at infinity")
        low, high = corners.min(0), corners.max(0)
        if not (high > low).all():
            raise InvalidRequest(f"{name} is empty: it has no width or no height")
        return cls(corners, (low[0], low[1], high[0], high[1]), values.ndim == 1)

    def carried(self, scale: complex, shift: complex) -> Region:
        """Transform the region by z -> scale z + shift; sides at infinity stay at `FAR`."""
        size = abs(scale)
        scaled = np.where(np.isinf(self.corners), np.sign(self.corners) * FAR, size * self.corners)
        z = scale / size * (scaled[:, 0] + 1j * scaled[:, 1]) + shift
        corners = np.stack([z.real, z.imag], axis=-1)
        (x0, y0), (x1, y1) = corners.min(0).tolist(), corners.max(0).tolist()
        return Region(corners, (x0, y0, x1, y1), self.is_box and complex(scale).imag == 0)

    def mirrored(self, reverse: bool, over: bool, stroke: float = 1.0) -> Region:
        """Mirror the region at mid-path (`reverse`) and in the line of the path (`over`)."""
        x, y = self.corners.T
        corners = np.stack([stroke - x if reverse else x, -y if over else y], axis=-1)
        (x0, y0), (x1, y1) = corners.min(0).tolist(), corners.max(0).tolist()
        return Region(corners, (x0, y0, x1, y1), self.is_box)

    def rounded(self) -> Region:
        """Round the coordinates of the region to 12 decimals."""
        x0, y0, x1, y1 = (round(x, 12) for x in self.box)
        return Region(self.corners.round(12), (x0, y0, x1, y1), self.is_box)

    @cached_property
    def sides(self) -> tuple[Complexes, Complexes]:
        """Start points and outward unit normals of the sides, complex, shape (k,) each."""
        corner = self.corners[:, 0] + 1j * self.corners[:, 1]
        side = np.roll(corner, -1) - corner
        corner, side = corner[side != 0], side[side != 0]
        turn = (np.roll(side, -1) * side.conj()).imag
        return corner, side / np.abs(side) * (-1j if turn.sum() > 0 else 1j)

    @cached_property
    def is_convex(self) -> bool:
        """Whether the polygon is convex."""
        out = self.sides[1]
        turn = (np.roll(out, -1) * out.conj()).imag
        return bool((turn >= 0).all() or (turn <= 0).all())

    def outside(self, z: Complexes) -> Floats:
        """Compute signed distances of complex points z, any shape, negative inside."""
        if self.is_box:
            x0, y0, x1, y1 = self.box
            x, y = np.maximum(x0 - z.real, z.real - x1), np.maximum(y0 - z.imag, z.imag - y1)
            distance, corner = np.maximum(x, y), (x > 0) & (y > 0)
            distance[corner] = np.hypot(x[corner], y[corner])
            return distance
        least = np.full(z.shape, np.inf)
        for (x, y), (p, q) in zip(self.corners, np.roll(self.corners, -1, axis=0) - self.corners, strict=True):
            if p or q:
                u, v = z.real - x, z.imag - y
                along = np.clip((u * p + v * q) / (p * p + q * q), 0, 1)
                least = np.minimum(least, (u - along * p) ** 2 + (v - along * q) ** 2)
        distance = np.sqrt(least)
        return np.asarray(np.where(self.holds(z), -distance, distance))

    def holds(self, z: Complexes) -> Mask:
        """Tell which complex points z, any shape, lie inside, or on the edge of a box."""
        x, y = z.real, z.imag
        if self.is_box:
            x0, y0, x1, y1 = self.box
            return np.asarray((x >= x0) & (x <= x1) & (y >= y0) & (y <= y1))
        inside = np.zeros(z.shape, dtype=bool)
        a = self.corners
        for (xa, ya), (xb, yb) in zip(a, np.roll(a, -1, axis=0), strict=True):
            crosses = (ya > y) != (yb > y)
            with np.errstate(all="ignore"):
                inside ^= crosses & (x < xa + (y - ya) * (xb - xa) / (yb - ya))
        return inside


def zones(name: str, given: object) -> tuple[Region, ...]:
    """Parse one region or a sequence of regions, in any order: they are sorted."""
    if isinstance(given, Region):
        return (given,)
    found = listed(given)
    if found is None:
        raise InvalidRequest(f"{name} must be a sequence of regions: x0, y0, x1, y1 or points of each")
    if found and not any(isinstance(part, Region | Iterable) for part in found):  # numbers of a single region
        found = [found]
    return tuple(sorted((Region.of(name, z) for z in found), key=lambda zone: zone._measure_polygon))


#: A box (x0, y0, x1, y1), sides possibly infinite, or the corners of a polygon.
RegionLike: TypeAlias = Region | Floats | Sequence[float | Sequence[float]]
