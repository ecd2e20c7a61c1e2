"""Outlines of parts to cut: bars, plates and blocks, with holes and slots.

An outline is a closed chain of corners, each with the bulge of the side that follows it as in DXF:
the tangent of a quarter of the angle of its arc, 0 for a straight side.  Corners run
counterclockwise.  The width of the tool is not compensated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from ..errors import InvalidRequest
from ..given import positive
from .links import Link, Links


class Proportions(NamedTuple):
    """Proportions of parts."""

    block: float = 2.0  #: length of a block over its width
    thickness: float = 0.3  #: thickness of a part over its width
    width: float = 0.06  #: largest default width of a bar [sizes of the linkage]
    #: Largest default width of a bar over the shortest distance of two pivots, so that bars do not
    #: hide pins.
    pitch: float = 0.6


PROPORTION = Proportions()


@dataclass(frozen=True)
class Outline:
    """A closed chain of corners (m,) with the bulges (m,) of the sides that follow them."""

    corners: list[complex]
    bulges: list[float]

    def placed(self, origin: complex, turn: complex = 1 + 0j) -> Outline:
        """Return the outline moved to another place; `turn` is a unit vector."""
        return Outline([origin + turn * z for z in self.corners], self.bulges)

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Bounding box x0, y0, x1, y1.

        An arc is replaced by its full circle, which is exact at the end of a bar along an axis.
        """
        x = [z.real for z in self.points()]
        y = [z.imag for z in self.points()]
        return min(x), min(y), max(x), max(y)

    def points(self, per_arc: int = 16) -> list[complex]:
        """Return points along the outline, those of its arcs included."""
        found: list[complex] = []
        for k, (start, bulge) in enumerate(zip(self.corners, self.bulges, strict=True)):
            end = self.corners[(k + 1) % len(self.corners)]
            found.append(start)
            if bulge:
                sweep = 4 * math.atan(bulge)
                centre = start + (end - start) * (0.5 + 0.5j / math.tan(0.5 * sweep))
                turns = np.exp(1j * sweep * np.arange(1, per_arc) / per_arc)
                found += [complex(z) for z in centre + (start - centre) * turns]
        return found


@dataclass(frozen=True)
class Part:
    """The part of one link, in its coordinates: edge, slots, and holes by the names of pivots.

    The edge is the convex hull of the `core`, widened by the `border`.
    """

    link: Link
    edge: Outline
    slots: dict[str, Outline]
    holes: dict[str, complex]
    bore: float
    core: list[complex]
    border: float


@dataclass(frozen=True)
class Sizes:
    """Width of the bars and diameter of the holes [the unit of the guide]."""

    width: float
    hole: float

    @property
    def thickness(self) -> float:
        """Thickness of the parts as solids [the unit of the guide]."""
        return PROPORTION.thickness * self.width

    @classmethod
    def of(cls, links: Links, width: float | None, hole: float | None) -> Sizes:
        """Return the given sizes; a missing one is chosen as a round number.

        Raises
        ------
        InvalidRequest
            Unless width and hole are above zero, the hole is narrower than the bar, and no two
            holes of a link meet.
        """
        pitch, link, pair = _closest_holes(links)
        wide = (
            _round_down(min(PROPORTION.width * links.size, PROPORTION.pitch * pitch))
            if width is None
            else positive("bar width", width)
        )
        bore = _round_down(min(0.5 * wide, 0.5 * pitch)) if hole is None else positive("hole", hole)
        if hole is not None and width is None:
            wide = max(wide, 2 * bore)
        if bore >= wide:
            raise InvalidRequest(f"holes of {bore:g} do not fit into bars {wide:g} wide")
        if bore >= pitch:
            raise InvalidRequest(
                f"holes of {bore:g} meet: {pair[0]} and {pair[1]} of the {link} are {pitch:.6g} apart; choose "
                "smaller ones"
            )
        return cls(wide, bore)


def parts(links: Links, sizes: Sizes) -> list[Part]:
    """Return the parts to cut: the frame, a bar of each crank, the blocks, the coupler plate."""
    half, length = 0.5 * sizes.width, PROPORTION.block * sizes.width
    found = []
    for link in links.links:
        if link.kind == "block":
            edge = rectangle(0j, 0j, length, sizes.width)
            found.append(Part(link, edge, {}, link.holes, sizes.hole, edge.corners, 0.0))
            continue
        slots = {name: rectangle(a, b, length, sizes.width) for name, (a, b) in link.slots.items()}
        corners = [*link.holes.values(), *(z for slot in slots.values() for z in slot.corners)]
        core = convex(corners)
        found.append(Part(link, rounded_hull(core, half), slots, link.holes, sizes.hole, core, half))
    return found


def rectangle(start: complex, end: complex, length: float, width: float) -> Outline:
    """Return the rectangle that a block covers between two positions; along x if they coincide."""
    way = end - start
    along = way / abs(way) if way else 1 + 0j
    over, side = 0.5 * length * along, 0.5j * width * along
    return Outline([start - over - side, end + over - side, end + over + side, start - over + side], [0.0] * 4)


def rounded_hull(places: list[complex], radius: float) -> Outline:
    """Return the convex hull of places grown by a radius: one place gives a disc, two a bar."""
    hull = convex(places)
    if len(hull) == 1:
        return Outline([hull[0] - radius, hull[0] + radius], [1.0, 1.0])
    corners: list[complex] = []
    bulges: list[float] = []
    ways = [hull[(k + 1) % len(hull)] - hull[k] for k in range(len(hull))]
    normals = [-1j * way / abs(way) for way in ways]
    for k, corner in enumerate(hull):
        before, after = normals[k - 1], normals[k]
        turn = float(np.angle(after / before))
        sweep = turn if len(hull) > 2 else math.pi  # the sign of a zero would decide the side of a half circle
        corners += [corner + radius * before, corner + radius * after]
        bulges += [math.tan(0.25 * sweep), 0.0]
    return Outline(corners, bulges)


def convex(places: list[complex]) -> list[complex]:
    """Return the corners of the convex hull, counterclockwise; places on a line give two ends."""
    z = np.array(places, complex)
    far = z[np.abs(z - z[0]).argmax()]
    if far == z[0]:
        return [complex(far)]
    along = (far - z[0]) / abs(far - z[0])
    run, off = ((z - z[0]) * along.conjugate()).real, ((z - z[0]) * along.conjugate()).imag
    if np.abs(off).max() <= 1e-9 * abs(far - z[0]):
        return [complex(z[run.argmin()]), complex(z[run.argmax()])]
    try:
        return [complex(p) for p in z[ConvexHull(np.stack([z.real, z.imag], 1)).vertices]]
    except QhullError:  # the hull is too flat for scipy
        return [complex(z[run.argmin()]), complex(z[run.argmax()])]


def _closest_holes(links: Links) -> tuple[float, str, tuple[str, str]]:
    """Find the closest two holes of a link: distance, link and holes."""
    pairs = (
        (abs(a - b), link.name, (one, other))
        for link in links.links
        for one, a in link.holes.items()
        for other, b in link.holes.items()
        if one < other
    )
    return min(pairs, default=(links.size, "", ("", "")))


def _round_down(value: float) -> float:
    """Round down to a round number: 1, 1.5, 2, ... 8 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(value))
    share = max(m for m in (1, 1.5, 2, 3, 4, 5, 6, 8) if m * power <= value * (1 + 1e-12) or m == 1)
    return float(f"{share * power:.3g}")
