"""The room that a linkage sweeps over its stroke: whether it stays inside a region and clear of others.

The linkage is its links as straight bars: cranks from pivot to pivot, the triangle of both moving pivots and the guided
point.  Rails of sliders and slots of slides are not looked at; of a slide the fixed pivot stands for the moving one.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from ..linkage import RR, Array, Linkage
from .practice import Moves


class Area(Protocol):
    """A polygon: its corners (k, 2), and which points lie inside."""

    @property
    def corners(self) -> Array: ...

    def holds(self, z: Array) -> Array: ...


def bars(linkage: Linkage, moves: Moves) -> Array:
    """Return both ends of the bars of n linkages at f positions, complex, shape (f, n, 5, 2); what is no bar is a
    point of another one."""
    fixed = np.broadcast_to(linkage.points[None, :, :, 0], moves.pins.shape)
    pivots = np.where(linkage.dyads == RR, fixed, moves.pins)
    one, two, point = moves.pins[..., 0], moves.pins[..., 1], moves.point
    ends = (pivots[..., 0], one), (pivots[..., 1], two), (one, two), (one, point), (two, point)
    return np.stack([np.stack(pair, axis=-1) for pair in ends], axis=-2)


def stays_inside(area: Area, swept: Array) -> Array:
    """Return which linkages stay inside, shape (n,), from their bars (f, n, 5, 2)."""
    return np.asarray((area.holds(swept).all(-1) & ~_crosses(area, swept)).all(axis=(0, 2)))


def stays_clear(area: Area, swept: Array) -> Array:
    """Return which linkages have no part of a bar inside, shape (n,), from their bars (f, n, 5, 2)."""
    return np.asarray(~(area.holds(swept).any(-1) | _crosses(area, swept)).any(axis=(0, 2)))


def _crosses(area: Area, swept: Array) -> Array:
    """Return which bars cross an edge of the polygon, shape (f, n, 5)."""
    corners = area.corners[:, 0] + 1j * area.corners[:, 1]
    a, b = swept[..., 0], swept[..., 1]
    crossed = np.zeros(a.shape, bool)
    for c, d in zip(corners, np.roll(corners, -1), strict=True):
        edge, bar = d - c, b - a
        sides = _area(edge, a - c) * _area(edge, b - c), _area(bar, c - a) * _area(bar, d - a)
        crossed |= (sides[0] < 0) & (sides[1] < 0)
    return crossed


def _area(a: Array, b: Array) -> Array:
    return np.asarray((np.conj(a) * b).imag)
