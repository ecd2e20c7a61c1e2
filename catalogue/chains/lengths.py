"""Lengths of the bars of a chain, and pitch circles of its wheels."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from ..kinematics.linkage import EXTENT
from ..kinematics.types import Complexes
from .chain import Chain
from .structure import Gear, Structure


def spans(chain: Chain) -> dict[str, tuple[complex, complex]]:
    """Return the ends of each length in the reference pose, by name.

    Parameters
    ----------
    chain : Chain
        One chain.

    Returns
    -------
    dict of str to (complex, complex)
        ``crank O B``: between the first two joints of a bar, and from both to each further joint.
        ``offset frame ram``: from the first joint of a rail to the line of a slider. Joints that
        coincide have no length.

    Examples
    --------
    >>> from catalogue.chains.structure import Structure
    >>> bars = {"frame": "AD", "crank": "AB", "coupler": "BCP", "rocker": "CD"}
    >>> structure = Structure.of(bars, drive="crank")
    >>> chain = Chain.of(structure, {"A": 0, "D": 4, "B": 1j, "C": 3 + 2j, "P": 2 + 3j})
    >>> list(spans(chain))
    ['frame A D', 'crank A B', 'coupler B C', 'coupler B P', 'coupler C P', 'rocker C D']
    """
    structure, z = chain.structure, dict(zip(chain.structure.joints, chain.z[:, 0].tolist(), strict=True))
    found: dict[str, tuple[complex, complex]] = {}
    for name, joints in structure.bars:
        for one, other in combinations(joints, 2):
            if one in joints[:2]:
                found[f"{name} {one} {other}"] = z[one], z[other]
    for slide, along in zip(structure.slides, chain.u[:, 0].tolist(), strict=True):
        rail, slider = (dict(structure.bars)[name] for name in (slide.first, slide.second))
        if rail and slider:
            start = z[rail[0]]
            foot = start + 1j * along * ((z[slider[0]] - start) * along.conjugate()).imag
            found[f"offset {slide.first} {slide.second}"] = start, foot
    least = EXTENT.coincident * float(chain.size[0])
    return {name: ends for name, ends in found.items() if abs(ends[1] - ends[0]) > least}


def pitch_circles(structure: Structure, gear: Gear, z: Complexes) -> list[tuple[str, complex, float]]:
    """Return the pitch circles of a gear: name of the wheel, centre and radius.

    Parameters
    ----------
    structure : Structure
    gear : Gear
    z : complex ndarray, shape (j,)
        Positions of the joints [length].

    Returns
    -------
    list of (str, complex, float)
        Empty for bars kept parallel, and for a wheel without a pin on the carrier.
    """
    carrier, centres = structure.number(gear.carrier), []
    if gear.ratio == 1:
        return []
    for name in (gear.first, gear.second):
        wheel = structure.number(name)
        centres.append([complex(z[j]) for j, bars in enumerate(structure.on) if {wheel, carrier} <= bars])
    if not all(centres):
        return []
    apart = float(np.abs(centres[1][0] - centres[0][0]))
    second = apart / abs(gear.ratio - 1) if gear.ratio > 0 else apart / (1 - gear.ratio)
    return [(gear.first, centres[0][0], abs(gear.ratio) * second), (gear.second, centres[1][0], second)]
