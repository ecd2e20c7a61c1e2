"""Five-bars with geared cranks: guides at the joint of both couplers, or at a point of one.

With angles u and v = q u + c of the cranks the coupler joint is the apex of a triangle on both
crank pins.  For q = -1, equal cranks that mirror one another and equal rods, the apex stays on the
line of symmetry: Cartwright's exact straight line.  If both pivots coincide and the rods equal the
cranks, the joint is the sum of two vectors that turn against one another, as in Cardan's gears.

Source: E. Cartwright, British patent 2202, 1797; F. Freudenstein, E. J. F. Primrose, Geared
five-bar motion, J. Appl. Mech. 30, 1963; G. N. Sandor, A. G. Erdman, Advanced Mechanism Design 2,
1984.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from catalogue.plugin import Parameter, angles, hookimpl

if TYPE_CHECKING:
    from catalogue.plugin import ChainFamily, Collection, Complexes, Parameters

SOURCE = "Cartwright 1797; Freudenstein and Primrose 1963; Sandor and Erdman 1984"
#: Ratio of the second crank to the first, by the name of its family: equal wheels, wheels of ratio
#: one to two, and wheels with a third one in between.
RATIOS = {"geared-five-bar": -1.0, "geared-five-bar-half": -0.5, "geared-five-bar-double": -2.0, "belted-five-bar": 2.0}
FREE = [
    Parameter("crank", ((0.15, 0.9),), "length of the first crank, over the frame"),
    Parameter("other", ((0.15, 0.9),), "length of the second crank, over the frame"),
    Parameter("coupler", ((0.5, 2.0),), "length of the first coupler, over the frame"),
    Parameter("rod", ((0.5, 2.0),), "length of the second coupler, over the frame"),
    Parameter("along", ((-0.5, 1.5),), "guided point along the first coupler, over its length"),
    Parameter("across", ((-1.0, 1.0),), "guided point across the first coupler, over its length"),
    Parameter("angle", angles((0, 360)), "angle of the first crank [rad]"),
    Parameter("phase", angles((0, 360)), "angle of the second crank there [rad]"),
]


def pose(p: Parameters) -> dict[str, Complexes | float]:
    """Place both cranks on a frame of length 1, and their couplers."""
    from catalogue.plugin import apex

    b, d = p["crank"] * np.exp(1j * p["angle"]), 1 + p["other"] * np.exp(1j * p["phase"])
    c = apex(b, p["coupler"], d, p["rod"])
    return {"A": 0.0, "E": 1.0, "B": b, "D": d, "C": c, "P": b + (p["along"] + 1j * p["across"]) * (c - b)}


def cartwright(p: Parameters) -> dict[str, Complexes | float]:
    """Place cranks that mirror one another on a frame of length 1, and equal rods."""
    from catalogue.plugin import apex

    b = p["crank"] * np.exp(1j * p["angle"])
    d = 1 - np.conj(b)
    return {"A": 0.0, "E": 1.0, "B": b, "D": d, "C": apex(b, p["rod"], d, p["rod"])}


def family(name: str, ratio: float) -> ChainFamily:
    """Return the family of one ratio."""
    from catalogue.plugin import ChainFamily, Structure

    bars = {"frame": "AE", "crank": "AB", "other": "ED", "coupler": "BCP", "rod": "DC"}
    structure = Structure.of(bars, drive="crank", gears=[("crank", "other", "frame", ratio)])
    return ChainFamily(name, f"Five-bar with cranks in ratio {ratio:g}", SOURCE, structure, "P", FREE, pose)


@hookimpl
def catalogue_collections() -> list[Collection]:
    from catalogue.plugin import ChainFamily, Structure, chain_collection

    bars = {"frame": "AE", "crank": "AB", "other": "ED", "coupler": "BC", "rod": "DC"}
    exact = ChainFamily(
        "cartwright",
        "Cartwright's straight line: mirrored cranks, geared, and equal rods",
        SOURCE,
        Structure.of(bars, drive="crank", gears=[("crank", "other", "frame", -1.0)]),
        "C",
        [
            Parameter("crank", ((0.1, 0.45),), "length of the cranks, over the frame"),
            Parameter("rod", ((0.5, 2.0),), "length of the rods, over the frame"),
            Parameter("angle", angles((0, 360)), "angle of the first crank [rad]"),
        ],
        cartwright,
        exact=True,
        special={"turning": lambda p: p["rod"] > 0.5 + p["crank"]},
    )
    families = [*(family(name, ratio) for name, ratio in RATIOS.items()), exact]
    return [chain_collection("geared-five-bars", "Five-bars with geared cranks", SOURCE, families)]
