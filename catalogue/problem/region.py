"""Regions of the plane in which pivots and links may be, or may not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InvalidRequest
from ..kinematics.types import Array

#: Where a side at infinity is taken to be, in the lengths that a region is carried to.
FAR = 1e7


@dataclass(frozen=True)
class Region:
    """A convex or concave polygon, corners (k, 2); a box is given by its corners x0, y0, x1, y1."""

    corners: Array
    box: tuple[float, float, float, float]
    is_box: bool

    @classmethod
    def of(cls, name: str, given: Any) -> Region:
        """Return the region given as (x0, y0, x1, y1) or as a sequence of at least three points."""
        try:
            values = np.asarray(given, dtype=float)
        except (TypeError, ValueError):
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
        """Return the region after z -> scale z + shift; sides at infinity are `FAR` after that."""
        far = np.where(np.isinf(self.corners), np.sign(self.corners) * FAR / abs(scale), self.corners)
        z = scale * (far[:, 0] + 1j * far[:, 1]) + shift
        corners = np.stack([z.real, z.imag], axis=-1)
        (x0, y0), (x1, y1) = corners.min(0).tolist(), corners.max(0).tolist()
        return Region(corners, (x0, y0, x1, y1), self.is_box and complex(scale).imag == 0)

    def rounded(self, decimals: int = 12) -> Region:
        """Return the region with its coordinates rounded."""
        x0, y0, x1, y1 = (round(x, decimals) for x in self.box)
        return Region(self.corners.round(decimals), (x0, y0, x1, y1), self.is_box)

    def outside(self, z: Array) -> Array:
        """Return how far points z, complex, any shape, lie outside the region; negative inside, to the nearest side."""
        if self.is_box:
            x0, y0, x1, y1 = self.box
            x, y = np.maximum(x0 - z.real, z.real - x1), np.maximum(y0 - z.imag, z.imag - y1)
            away = np.hypot(np.maximum(x, 0.0), np.maximum(y, 0.0))
            return np.asarray(np.where(away > 0, away, np.maximum(x, y)))
        corner = self.corners[:, 0] + 1j * self.corners[:, 1]
        side = np.roll(corner, -1) - corner
        side, corner = side[side != 0], corner[side != 0]
        away = np.asarray(z)[..., None] - corner
        along = np.clip((away * side.conj()).real / np.abs(side) ** 2, 0, 1)
        distance = np.abs(away - along * side).min(-1)
        return np.asarray(np.where(self.holds(z), -distance, distance))

    def holds(self, z: Array) -> Array:
        """Return which of the points z, complex, any shape, lie inside or on the border of a box."""
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


def zones(name: str, given: Any) -> tuple[Region, ...]:
    """Return regions given as a sequence of them, or one of them.

    Raises
    ------
    InvalidRequest
        If they are none.
    """
    try:
        found = list(given)
    except TypeError:
        raise InvalidRequest(f"{name} must be a sequence of regions: x0, y0, x1, y1 or points of each") from None
    if found and all(isinstance(value, int | float) for value in found):
        found = [found]
    return tuple(z if isinstance(z, Region) else Region.of(name, z) for z in found)
