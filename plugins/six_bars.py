"""Six-bar guides: Watt's chains I and II, Stephenson's I and III, driven by a crank on the frame.

Stephenson's II is missing: from no bar on the frame does it close in dyads.

Source: the chains of six bars and seven pins named after J. Watt and R. Stephenson; J. J. Uicker,
G. R. Pennock, J. E. Shigley, Theory of Machines and Mechanisms, 2003, ch. 1.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from catalogue.plugin import Parameter, angles, hookimpl

if TYPE_CHECKING:
    from catalogue.plugin import ChainFamily, Collection, Complexes, Floats, Parameters

SOURCE = "chains of Watt and Stephenson; Uicker, Pennock and Shigley 2003, ch. 1"
#: The four-bar A B C D of frame 1, and the dyad E F G closed on it.
FOUR_BAR = [
    Parameter("crank", ((0.2, 1.2),), "length of the crank, over the frame"),
    Parameter("coupler", ((0.5, 2.0),), "length of the coupler, over the frame"),
    Parameter("rocker", ((0.4, 2.0),), "length of the rocker, over the frame"),
    Parameter("angle", angles((0, 360)), "angle of the crank from the frame [rad]"),
]
PLACES = {
    "e": "first joint of the dyad",
    "g": "last joint of the dyad",
    "p": "guided joint, from the dyad's middle joint",
}
DYAD = [
    *(
        Parameter(f"{name}{axis}", ((-1.5, 1.5),), f"{axis} of the {what}")
        for name, what in PLACES.items()
        for axis in "xy"
    ),
    Parameter("rod", ((0.4, 2.0),), "length of the first bar of the dyad"),
    Parameter("link", ((0.4, 2.0),), "length of the second bar of the dyad"),
]


def pose(p: Parameters) -> dict[str, Complexes | float]:
    """Place the four-bar, then the dyad on it."""
    from catalogue.plugin import apex

    b = p["crank"] * np.exp(1j * p["angle"])
    c = apex(b, p["coupler"], 1.0, p["rocker"])
    e, g = p["ex"] + 1j * p["ey"], p["gx"] + 1j * p["gy"]
    f = apex(e, p["rod"], g, p["link"])
    return {"A": 0.0, "D": 1.0, "B": b, "C": c, "E": e, "F": f, "G": g, "P": f + p["px"] + 1j * p["py"]}


def seeds(b: Complexes, c: Complexes, p: Complexes) -> dict[str, Floats]:
    """Return six-bars whose dyad is pinned to the guided point of a four-bar.

    The rods of the dyad are at right angles. Its other end is on either fixed pivot.
    """
    b, c, p = (np.tile(at, 2) for at in (b, c, p))
    g = np.repeat([0.0, 1.0], len(p) // 2)
    rod = np.abs(g - p) / np.sqrt(2)
    back = (1 + 1j) * (p - g) / 2  # from the guided point to the middle joint, left of the way there
    lengths = {
        "crank": np.abs(b),
        "coupler": np.abs(c - b),
        "rocker": np.abs(c - 1),
        "angle": np.angle(b) % (2 * np.pi),
    }
    return lengths | {
        "ex": p.real,
        "ey": p.imag,
        "gx": g,
        "gy": 0 * g,
        "px": back.real,
        "py": back.imag,
        "rod": rod,
        "link": rod,
    }


def family(name: str, title: str, e: str, g: str, **how: Any) -> ChainFamily:
    """Return the family whose dyad is pinned to the bars `e` and `g`."""
    from catalogue.plugin import ChainFamily, Structure

    bars = {"frame": "AD", "crank": "AB", "coupler": "BC", "rocker": "CD", "rod": "EFP", "link": "FG"}
    bars = {bar: joints + "E" * (bar == e) + "G" * (bar == g) for bar, joints in bars.items()}
    return ChainFamily(name, title, SOURCE, Structure.of(bars, drive="crank"), "P", [*FOUR_BAR, *DYAD], pose, **how)


@hookimpl
def catalogue_collections() -> list[Collection]:
    from catalogue.plugin import chain_collection

    families = [
        family("watt-1", "Watt I: a dyad between coupler and rocker", "coupler", "rocker"),
        family("watt-2", "Watt II: a dyad between rocker and frame", "rocker", "frame"),
        family("stephenson-1", "Stephenson I: a dyad between crank and rocker", "rocker", "crank"),
        family("stephenson-3", "Stephenson III: a dyad between coupler and frame", "coupler", "frame", seeds=seeds),
    ]
    return [chain_collection("six-bars", "Six-bar guides of Watt and Stephenson", SOURCE, families)]
