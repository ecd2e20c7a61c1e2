"""Split a placed guide into its links, with their holes, slots and poses.

A crank is a bar between two pivots.  The coupler is a plate with its pins and the guided point.  A
slider is a block with a pin of the coupler, in a slot of the frame; a slide is a block on a pin of
the frame, in a slot of the coupler. A slot is as long as the travel of its block over the stroke,
or over the whole circuit for a linkage without a stroke.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import count
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InvalidRequest
from ..guides.kinds import has_bars, is_candidate, is_dwell
from ..kinematics.circuits import OPEN, circuits
from ..kinematics.link_lengths import in_coupler
from ..kinematics.linkage import PR, RR
from ..kinematics.types import Complexes, Floats

if TYPE_CHECKING:
    from ..guides.kinds import Guide
    from ..guides.placed import PlacedGuide
    from ..guides.run import Run

#: Name of the guided point among the pivots.
GUIDED = "guided"
#: Distance below which two places are one [sizes of the linkage].
SAME = 1e-9


@dataclass(frozen=True)
class Link:
    """A link in its own coordinates: x + iy, from its first pivot, x towards the second one.

    Attributes
    ----------
    name : str
        ``frame``, ``crank 1``, ``coupler``, ``slider 2``, ``slide 1``; of many bars their names.
    kind : str
        ``frame``, ``crank``, ``coupler``, ``bar`` or ``block``.
    origin, turn : complex
        Place of the link's origin in the given position, and the unit vector of its x axis there.
    holes : dict of str to complex
        Pivots by name: ``A1``, ``A1*``, ``A2``, ``A2*`` and ``guided``.
    slots : dict of str to (complex, complex)
        By the name of the block in each slot, the ends of the travel of its middle.
    within : str
        Link in whose slot a block runs; empty for a link that is no block.
    """

    name: str
    kind: str
    origin: complex
    turn: complex
    holes: dict[str, complex]
    slots: dict[str, tuple[complex, complex]]
    within: str = ""

    def placed(self, z: complex) -> complex:
        """Convert a point of the link to the frame, in the given position."""
        return self.origin + self.turn * z

    @property
    def angle(self) -> float:
        """Angle of the link's own x axis [deg]."""
        return float(np.degrees(np.angle(self.turn)))


@dataclass(frozen=True)
class Links:
    """A guide as links.

    Attributes
    ----------
    links : list of Link
        The frame first, then cranks, blocks, the coupler.
    path : complex ndarray, shape (m,)
        Path of the guided point over the stroke or the whole circuit: points of a cubic spline with
        an error below `catalogue.kinematics.splines.SPLINE_ERROR`.
    knots : ndarray, shape (m,)
        Parameters of the spline at these points, from 0 to 1.
    size : float
        Diameter of the finite pivots, the travels of the blocks and the path.
    title : str
        Family, or name of a mechanism of many bars.
    lengths : dict of str to (complex, complex)
        Ends of each length in the given position.
    wheels : list of (str, complex, float)
        Pitch circles: name, centre and radius.
    notes : list of str
        Limitations of the parts.
    """

    links: list[Link]
    path: Complexes
    knots: Floats
    size: float
    title: str
    lengths: dict[str, tuple[complex, complex]]
    wheels: list[tuple[str, complex, float]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def taken_apart(guide: Guide) -> Links:
    """Return the links of a guide.

    Raises
    ------
    InvalidRequest
        If the guide is a linkage without a stroke whose coupler runs to infinity: its slots would
        have no ends.
    """
    if has_bars(guide):
        from .chain_links import links_of

        return links_of(guide)
    z, kinds, finite = guide.linkage.points[0], guide.linkage.dyads[0], guide.linkage.finite[0]
    run, guided = motion_over_stroke(guide), complex(*guide.guided)
    phases, knots = run.spline()
    path = run.path(phases)
    frame = _fixed_places(guide)
    pins: dict[str, complex] = {f"A{i + 1}*": complex(z[i, 1]) for i in (0, 1) if finite[i, 1]}
    links, tracks, ways = [], {}, {}
    for i in (0, 1):
        fixed, moving = complex(z[i, 0]), complex(z[i, 1])
        if kinds[i] == RR:
            links.append(link_of(f"crank {i + 1}", "crank", {f"A{i + 1}": fixed, f"A{i + 1}*": moving}))
        elif kinds[i] == PR:
            along = -1j * fixed
            tracks[f"slider {i + 1}"] = _slot_ends(run, i, moving, along)
            links.append(Link(f"slider {i + 1}", "block", moving, along, {f"A{i + 1}*": 0j}, {}, "frame"))
        else:
            along = -1j * moving
            ways[f"slide {i + 1}"] = _slot_ends(run, i, fixed, along)
            links.append(Link(f"slide {i + 1}", "block", fixed, along, {f"A{i + 1}": 0j}, {}, "coupler"))
    if output := rod_and_rocker(guide):
        joint = output[0][1]
        links += [
            link_of("rod", "crank", {GUIDED: guided, "J": joint}),
            link_of("rocker", "crank", {"B": frame["B"], "J": joint}),
        ]
    every = np.array([*z[finite], guided, *path, *(end for ends in (tracks | ways).values() for end in ends)])
    size = float(np.abs(every[:, None] - every[None, :]).max())
    if all(abs(guided - pin) > SAME * size for pin in pins.values()):
        pins[GUIDED] = guided
    every_link = [link_of("frame", "frame", frame, tracks), *links, _coupler(guide, pins, ways)]
    return Links(every_link, path, knots, size, str(guide.linkage.family[0]), spans(guide))


def motion_over_stroke(guide: PlacedGuide) -> Run:
    """Return the motion over the stroke.

    For a guide without a stroke, and for a returning point, it covers the circuit.
    """
    if is_candidate(guide):
        return guide.run(whole=bool(guide.span().cusp.any()))
    if circuits(guide.linkage).kind[0] == OPEN:
        raise InvalidRequest(
            "the coupler of this linkage runs to infinity: find a stretch of its motion with `catalogue measure`, and "
            "export that by its code"
        )
    return guide.run()


#: Origin and unit vector of the x axis of each link over the motion, by its name, shape (m,) each.
Places = dict[str, tuple[Complexes, Complexes]]


def placed_over(guide: Guide, links: Links, poses: int) -> Places:
    """Place the links of a guide over its motion.

    Parameters
    ----------
    guide : PlacedGuide
    links : Links
        Links of the guide.
    poses : int
        Number of positions.

    Returns
    -------
    Places
        Over the whole circuit where the driving crank turns fully, else over the stroke.
    """
    if has_bars(guide):
        from .chain_links import chain_placed_over

        return chain_placed_over(guide, links, poses)
    if is_candidate(guide):
        turns = guide.driver in guide.rotates or bool(guide.span().cusp.any())
        moved = guide.motion(poses, whole=turns)
    else:
        moved = guide.motion(poses)
    turn = np.exp(1j * np.radians(moved.coupler))
    start, now = complex(*guide.guided), moved.points[GUIDED]
    still = np.ones(len(moved), complex)
    points = {**moved.points, **{name: z * still for name, z in _fixed_places(guide).items()}}
    if is_dwell(guide):
        points["J"] = guide.joints(now)
    found: Places = {}
    for link in links.links:
        if link.name == "coupler":
            found[link.name] = now + turn * (link.origin - start), turn * link.turn
        elif link.kind == "frame" or link.name.startswith("slider"):
            origin = points[next(iter(link.holes))] if link.kind == "block" else link.origin * still
            found[link.name] = origin, link.turn * still
        elif link.name.startswith("slide"):
            found[link.name] = link.origin * still, turn * link.turn
        else:
            first, second = (points[name] for name in list(link.holes)[:2])
            way = second - first
            found[link.name] = first, np.asarray(way / np.abs(way), complex)
    return found


def _fixed_places(guide: PlacedGuide) -> dict[str, complex]:
    """Return the finite fixed pivots by name; for a dwell that of its rocker too."""
    z, finite = guide.linkage.points[0], guide.linkage.finite[0]
    found = {f"A{i + 1}": complex(z[i, 0]) for i in (0, 1) if finite[i, 0]}
    if output := rod_and_rocker(guide):
        found["B"] = output[1][0]
    return found


def _slot_ends(run: Run, i: int, here: complex, along: complex) -> tuple[complex, complex]:
    """Return the ends of a block's travel, given its place in the given position."""
    low, high = run.travel(i, along)
    start = (here * along.conjugate()).real
    return here + along * (low - start), here + along * (high - start)


def link_of(
    name: str, kind: str, holes: dict[str, complex], slots: dict[str, tuple[complex, complex]] | None = None
) -> Link:
    """Return a link with its x axis along its first two holes, else along its slot."""
    ends = [end for slot in (slots or {}).values() for end in slot]
    origin, *others = [*holes.values(), *ends]
    alone = ends[1] - ends[0] if ends else 0j
    way = alone if len(holes) < 2 else others[0] - origin
    return _placed_block(name, kind, origin, way, holes, slots or {})


def _coupler(guide: PlacedGuide, holes: dict[str, complex], slots: dict[str, tuple[complex, complex]]) -> Link:
    """Return the coupler in the coordinates `point along` and `point across`."""
    origin, ahead = (complex(in_coupler(guide.linkage, np.array([z]))[0]) for z in (0j, 1 + 0j))
    return _placed_block("coupler", "coupler", origin, ahead - origin, holes, slots)


def _placed_block(
    name: str,
    kind: str,
    origin: complex,
    turn: complex,
    holes: dict[str, complex],
    slots: dict[str, tuple[complex, complex]],
) -> Link:
    turn = turn / abs(turn) if turn else 1 + 0j  # a slot without length has no direction

    def own(z: complex) -> complex:
        return (z - origin) * turn.conjugate()

    return Link(
        name,
        kind,
        origin,
        turn,
        {pivot: own(z) for pivot, z in holes.items()},
        {block: (own(a), own(b)) for block, (a, b) in slots.items()},
    )


def distinct(names: Sequence[str]) -> list[str]:
    """Replace all but letters, digits and underscores; number names that become equal."""
    found: list[str] = []
    taken: set[str] = set()
    for name in names:
        plain = name = re.sub(r"\W", "_", name, flags=re.ASCII)
        for number in count(2):
            if name.casefold() not in taken:
                break
            name = f"{plain}_{number}"
        taken.add(name.casefold())
        found.append(name)
    return found


def spans(guide: PlacedGuide) -> dict[str, tuple[complex, complex]]:
    """Return the end points of each of `PlacedGuide.lengths` by name, in the given position.

    A dwell adds ``rod`` and ``rocker``.
    """
    z = guide.linkage.points[0]
    guided = complex(*guide.guided)
    origin, ahead = (complex(in_coupler(guide.linkage, np.array([p]))[0]) for p in (0j, 1 + 0j))
    found: dict[str, tuple[complex, complex]] = {}
    for name, length in guide.lengths.items():
        what, _, number = name.rpartition(" ")
        if name in ("frame", "coupler"):
            k = int(name == "coupler")
            ends = (z[0, k], z[1, k])
        elif what == "crank":
            ends = (z[int(number) - 1, 0], z[int(number) - 1, 1])
        elif what == "offset of slider":
            i = int(number) - 1
            ends = (z[1 - i, 0], z[1 - i, 0] + length * z[i, 0])
        elif what == "offset of slide":
            i = int(number) - 1
            ends = (z[1 - i, 1], z[1 - i, 1] + length * z[i, 1])
        else:
            foot = origin + (ahead - origin) * guide.lengths["point along"]
            ends = (origin, foot) if name == "point along" else (foot, guided)
        found[name] = (complex(ends[0]), complex(ends[1]))
    return found | dict(zip(("rod", "rocker"), rod_and_rocker(guide), strict=False))


def rod_and_rocker(guide: PlacedGuide) -> list[tuple[complex, complex]]:
    """Return the ends of rod and rocker of a dwell, the joint last; empty for another guide."""
    if not is_dwell(guide):
        return []
    joint = complex(*guide.joint)
    return [(complex(*guide.guided), joint), (complex(*guide.pivot), joint)]
