# A crank-rocker whose coupler point carries a bar kept parallel to the frame.
import numpy as np

from catalogue.plugin import Parameter, angles, hookimpl


def pose(p):
    from catalogue.plugin import apex

    b = p["crank"] * np.exp(1j * p["angle"])
    c = apex(b, 1.5, 1.0, 1.2)
    return {"A": 0, "D": 1, "B": b, "C": c, "E": c + p["reach"] * (c - b), "T": c + p["reach"] * (c - b) + 0.5}


@hookimpl
def catalogue_collections():
    from catalogue.plugin import ChainFamily, Structure, chain_collection

    bars = {"frame": "AD", "crank": "AB", "coupler": "BCE", "rocker": "CD", "table": "ET"}
    family = ChainFamily(
        "level-table",
        "Table kept level by a parallel",
        "any textbook",
        Structure.of(bars, drive="crank", parallel=[("frame", "table")]),
        "T",
        [
            Parameter("crank", ((0.2, 0.8),), "length of the crank, over the frame"),
            Parameter("reach", ((-1.0, 2.0),), "length of the coupler beyond its pin"),
            Parameter("angle", angles((0, 360)), "angle of the crank [rad]"),
        ],
        pose,
    )
    return [chain_collection("level-tables", "Tables that stay level", "any textbook", [family])]
