"""Split a mechanism of many bars into links: its bars with holes, slots and poses.

A bar is a plate with a hole at each joint.  Where one bar slides along another there is a block in
a slot: the slider itself if it has one joint, else a block on the slider's first joint.  Wheels are
plates like other bars, drawn with their pitch circles; the parts that keep bars parallel are
omitted.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..chains.lengths import pitch_circles, spans
from ..errors import InvalidRequest
from ..kinematics.circuits import OPEN, TURN
from ..kinematics.sampling import lowest
from ..kinematics.types import Complexes, Floats
from .links import SAME, Link, Links, Places, link_of

if TYPE_CHECKING:
    from ..chains.structure import Structure

Chain = Any  # an `OwnChain`, or a `ChainStretch`, of a higher floor


def links_of(one: Chain) -> Links:
    """Return the bars of a mechanism as links; see `links.taken_apart`.

    Raises
    ------
    InvalidRequest
        If it has no stroke and runs to infinity.
    """
    structure, found = one.chain.structure, one.circuit
    low, _, high = one.drawn
    if found.kind[0] == OPEN and not hasattr(one, "stroke"):
        raise InvalidRequest(
            "this mechanism runs to infinity: find a stretch of its motion with `catalogue measure`, and export that "
            "by its code"
        )
    phases, knots = one.spline()
    path = found.poses(phases[:, None]).joint(one.read.point)[:, 0]
    z = dict(zip(structure.joints, one.chain.z[:, 0].tolist(), strict=True))
    slots: dict[str, dict[str, tuple[complex, complex]]] = {name: {} for name in structure.names}
    blocks: dict[str, list[Link]] = {name: [] for name in structure.names}
    for number, slide in enumerate(structure.slides):
        joint = structure.bars[structure.number(slide.second)][1][0]
        along = complex(one.chain.u[number, 0])
        block = _block_name(structure, slide.second)
        if blocks[slide.second]:
            block += f" {len(blocks[slide.second]) + 1}"
        shortest, longest = _travel_range(one, number, low, high)
        slots[slide.first][block] = z[joint] + along * shortest, z[joint] + along * longest
        blocks[slide.second].append(Link(block, "block", z[joint], along, {joint: 0j}, {}, slide.first))
    ends = [end for every in slots.values() for pair in every.values() for end in pair]
    every = np.array([*z.values(), *path, *ends])
    size = _diameter(every)
    links: list[Link] = []
    for name, joints in sorted(structure.bars, key=lambda bar: bar[0] != "frame"):
        kind = "frame" if name == "frame" else "bar"
        if all(block.name != name for block in blocks[name]):
            links.append(
                link_of(name, kind, _drop_coincident_holes({joint: z[joint] for joint in joints}, size), slots[name])
            )
        links += blocks[name]
    wheels = [circle for gear in structure.gears for circle in pitch_circles(structure, gear, one.chain.z[:, 0])]
    return Links(links, path, knots, size, one.name or "mechanism", spans(one.chain), wheels, _notes(structure))


def chain_placed_over(one: Chain, links: Links, count: int) -> Places:
    """Place the links of a mechanism over its motion; see `links.placed_over`."""
    structure, found = one.chain.structure, one.circuit
    low, _, high = one.drawn
    low, high = one.range if found.kind[0] == TURN else (low, high)
    phases = one.samples(low, high).rows(np.linspace(0, 1, count))
    at = found.poses(phases[:, None])
    places: Places = {}
    for link in links.links:
        bar = structure.number(link.name.split()[0])  # names of bars have no spaces
        places[link.name] = at.point(bar, np.array([link.origin]))[:, 0], at.turn[bar, :, 0] * link.turn
    return places


def _block_name(structure: Structure, slider: str) -> str:
    """Return the name of the block on a slider; the slider's own if it has no other part."""
    joints = structure.bars[structure.number(slider)][1]
    runs = sum(slider in slide.ends for slide in structure.slides)
    return slider if len(joints) == 1 and runs == 1 else f"{slider} block"


def _travel_range(one: Chain, number: int, low: float, high: float) -> tuple[float, float]:
    """Compute the range of a slider's displacement from the given pose [length]."""
    samples = one.samples(low, high)

    def way(phases: Floats) -> Floats:
        found: Floats = one.circuit.poses(phases[:, None]).way(number)[:, 0]
        return found

    here = way(samples.at)
    return lowest(way, samples.at, here), -lowest(lambda phases: -way(phases), samples.at, -here)


def _drop_coincident_holes(holes: dict[str, complex], size: float) -> dict[str, complex]:
    """Drop all but one of coincident holes."""
    kept: dict[str, complex] = {}
    for name, z in holes.items():
        if all(abs(z - other) > SAME * size for other in kept.values()):
            kept[name] = z
    return kept


def _diameter(z: Complexes) -> float:
    return float(np.abs(z[:, None] - z[None, :]).max())


def _notes(structure: Structure) -> list[str]:
    """State the limitations of the parts of a mechanism."""
    notes = []
    for gear in structure.gears:
        if gear.ratio == 1:
            notes.append(f"{gear.second} is kept parallel to {gear.first}: what keeps it is not drawn")
        else:
            notes.append(f"{gear.first} and {gear.second} are wheels: pitch circles are drawn, teeth are not")
    return notes
