"""The room that a linkage sweeps over its stroke: how far it leaves a region, or enters others.

The linkage is its links as straight segments: cranks from pivot to pivot, the triangle of both moving pivots and the
guided point; of a machine with a slot the slot and what joins its ends to both moving pivots.  Rails of sliders and
slots of slides are not looked at; of a slide the fixed pivot stands for the moving one.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from ..kinematics.linkage import RR, Linkage
from ..kinematics.types import Array
from .drive import SampledPoses

#: Places along each link that are looked at, and what an edge that is crossed between them counts for, of the size.
STATIONS, GRAZED = 5, 1e-3


class Area(Protocol):
    """A polygon: its corners (k, 2), and how far points lie outside, negative inside."""

    @property
    def corners(self) -> Array: ...

    def outside(self, z: Array) -> Array: ...


def link_segments(linkage: Linkage, moves: SampledPoses) -> Array:
    """Return both ends of the k segments of n linkages at f positions, complex, shape (f, n, k, 2); what is no link is
    a point of another one.

    Parameters
    ----------
    linkage : Linkage of n
        Of slots the machine, as the poses are.
    """
    fixed = np.broadcast_to(linkage.points[None, :, :, 0], moves.pins.shape)
    pivots = np.where(linkage.dyads == RR, fixed, moves.pins)
    one, two, point = moves.pins[..., 0], moves.pins[..., 1], moves.point
    ends = [(pivots[..., 0], one), (pivots[..., 1], two), (one, two)]
    if moves.slot is None:
        ends += [(one, point), (two, point)]
    else:
        first, last = moves.slot[..., 0], moves.slot[..., 1]
        ends += [(first, last), (one, first), (one, last), (two, first), (two, last)]
    return np.stack([np.stack(pair, axis=-1) for pair in ends], axis=-2)


def protrusion(area: Area, swept: Array) -> Array:
    """Return how far linkages reach out of an area at most, negative inside, shape (n,), from segments (f, n, k, 2)."""
    out = area.outside(_stations(swept)).max(axis=(0, 2, 3))
    return _grazed(area, swept, out)


def intrusion(area: Area, swept: Array) -> Array:
    """Return how far linkages reach into an area at most, negative outside, shape (n,), from segments (f, n, k, 2)."""
    deep = -area.outside(_stations(swept)).min(axis=(0, 2, 3))
    return _grazed(area, swept, deep)


def _grazed(area: Area, swept: Array, amount: Array) -> Array:
    """Return amounts, a small positive one where an edge is crossed between the places that are looked at."""
    crossed = (amount <= 0) & _crosses(area, swept).any(axis=(0, 2))
    return np.asarray(np.where(crossed, GRAZED * np.abs(swept).max((0, 2, 3)), amount))


def _stations(swept: Array) -> Array:
    """Return places along the segments, shape (f, n, k, STATIONS)."""
    share = np.linspace(0, 1, STATIONS)
    return np.asarray(swept[..., :1] + (swept[..., 1:] - swept[..., :1]) * share)


def _crosses(area: Area, swept: Array) -> Array:
    """Return which segments cross an edge of the polygon, shape (f, n, k)."""
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
