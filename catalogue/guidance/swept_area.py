"""The swept area of a linkage over its stroke: how far it leaves a region, or enters others.

Links are straight segments: cranks from pivot to pivot, the triangle of both moving pivots and the
guided point; for a guided slot the slot, and segments from its ends to both moving pivots. Sliders
add their rails, slides their slots over the travel of the stroke, with the ends joined to the rest
of the coupler (see `slides`). For a slide the fixed pivot takes the place of the moving one.
"""

from __future__ import annotations

from functools import reduce
from typing import NamedTuple, Protocol

import numpy as np

from ..kinematics.linkage import PR, RP, RR, Linkage
from ..kinematics.types import Complexes, Floats
from .drive import SampledPoses
from .minimum_zone import largest


class SweptArea(NamedTuple):
    """Tests of links against keep-out zones."""

    #: number of tested points along each link, and along its part between two crossed edges
    stations: int = 5
    grazed: float = 1e-3  #: violation assumed where a segment crosses a region between these points [size]


SWEPT_AREA = SweptArea()


#: Pairs of link ends that the segments connect: for a linkage, and for one with a guided slot.
SEGMENTS = np.array([(0, 2), (1, 3), (2, 3), (2, 4), (3, 4)])
SLOTTED = np.array([(0, 2), (1, 3), (2, 3), (4, 5), (2, 4), (2, 5), (3, 4), (3, 5)])
#: Pairs of ends of the same slide, for two slides.
ALONG = np.array([(0, 1), (2, 3)])
#: Pairs of ends of different slides.
ACROSS = np.array([(0, 2), (0, 3), (1, 2), (1, 3)])


class Area(Protocol):
    """A polygon: its corners (k, 2), convexity, and signed distances of points."""

    @property
    def corners(self) -> Floats: ...

    @property
    def is_convex(self) -> bool: ...

    def outside(self, z: Complexes) -> Floats: ...


def link_ends(linkage: Linkage, moves: SampledPoses) -> Complexes:
    """Compute the ends of links at f positions, complex, shape (f, n, k).

    The order is: both fixed pivots, both moving ones, the guided point or both ends of its slot,
    then the ends of rails and slots, if any.

    Parameters
    ----------
    linkage : Linkage of n
        For a guided slot the linkage as built, to which the poses belong.
    """
    fixed = np.broadcast_to(linkage.points[None, :, :, 0], moves.pins.shape)
    pivots = np.where(linkage.dyads == RR, fixed, moves.pins)
    last = moves.point[..., None] if moves.slot is None else moves.slot
    return np.concatenate([pivots, moves.pins, last, *_slide_ends(linkage, moves)], axis=-1)


def _slide_ends(linkage: Linkage, moves: SampledPoses) -> list[Complexes]:
    """Compute the ends of rails and of slots, (f, n, 4) each, if any.

    For a crank both ends are its moving pivot.
    """
    found = []
    for kind in _slide_kinds(linkage):
        ends = np.where((linkage.dyads == kind)[..., None], moves.slides, moves.pins[..., None])
        found.append(ends.reshape(*ends.shape[:2], 4))
    return found


def _slide_kinds(linkage: Linkage) -> list[int]:
    """Return the kinds of slides that linkages have."""
    return [kind for kind in (PR, RP) if (linkage.dyads == kind).any()]


def link_segments(linkage: Linkage, moves: SampledPoses) -> Complexes:
    """Compute the ends of segments at f positions, complex, shape (f, n, k, 2).

    A missing link is replaced by a point of another one; see `link_ends`.
    """
    guided = [4] if moves.slot is None else [4, 5]
    joined, first = [SEGMENTS if moves.slot is None else SLOTTED], 4 + len(guided)
    for kind in _slide_kinds(linkage):
        joined.append(first + ALONG)
        if kind == RP:  # the coupler is a plate that holds its slots
            joined.append(first + ACROSS)
            joined.append(np.array([(first + k, point) for k in range(4) for point in guided]))
        first += 4
    return link_ends(linkage, moves)[..., np.concatenate(joined)]


def protrusion(area: Area, swept: Complexes) -> Floats:
    """Compute the protrusion of linkages from a region, negative inside, shape (n,).

    `swept` are segments (f, n, k, 2); for a convex region ends of links (f, n, k, 1) suffice.
    """
    if area.is_convex:  # the farthest point of a segment from a convex region is one of its ends
        return largest(area.outside(swept).max(axis=(2, 3)))
    return _largest_distance(area, swept, 1)


def intrusion(area: Area, swept: Complexes) -> Floats:
    """Compute the intrusion of segments (f, n, k, 2) into a region, negative outside, (n,)."""
    return _largest_distance(area, swept, -1)


def _largest_distance(area: Area, swept: Complexes, side: int) -> Floats:
    """Compute the largest distance of segments outside (`side` 1) or inside (-1) of a region.

    Where a segment crosses edges of the region, points between the crossings are tested too.
    """
    segments = [(swept[..., j, 0], swept[..., j, 1]) for j in range(swept.shape[2])]
    places = (a + (b - a) * share for a, b in segments for share in np.linspace(0, 1, SWEPT_AREA.stations))
    amount = largest(reduce(np.maximum, (side * area.outside(z) for z in places)))
    some = np.flatnonzero(amount <= 0)
    if len(some):  # a crossing may lie between two stations
        near = swept[:, some]
        more = np.fmax.reduce((side * area.outside(_points_between_crossings(area, near))).max(axis=-1), axis=(0, 2))
        passed = np.where(more > 0, more, SWEPT_AREA.grazed * np.abs(near).max((0, 2, 3)))
        amount[some] = np.where(np.isfinite(more), passed, amount[some])
    return amount


def _points_between_crossings(area: Area, swept: Complexes) -> Complexes:
    """Return points of segments between crossed edges, shape (f, n, k, stations).

    NaN where a segment crosses fewer than two.
    """
    corners = area.corners[:, 0] + 1j * area.corners[:, 1]
    a, b = swept[..., 0], swept[..., 1]
    first, last = np.full(a.shape, np.inf), np.full(a.shape, -np.inf)
    for c, d in zip(corners, np.roll(corners, -1), strict=True):
        edge, bar = d - c, b - a
        one, other = _area(edge, a - c), _area(edge, b - c)
        crossed = (one * other < 0) & (_area(bar, c - a) * _area(bar, d - a) < 0)
        share = one / np.where(crossed, one - other, 1.0)
        first = np.where(crossed, np.minimum(first, share), first)
        last = np.where(crossed, np.maximum(last, share), last)
    none = last <= first
    first, last = np.where(none, np.nan, first), np.where(none, np.nan, last)
    share = first[..., None] + (last - first)[..., None] * np.linspace(0, 1, SWEPT_AREA.stations)
    return np.asarray(a[..., None] + (b - a)[..., None] * share)


def _area(a: Complexes, b: Complexes) -> Floats:
    return np.asarray((np.conj(a) * b).imag)
