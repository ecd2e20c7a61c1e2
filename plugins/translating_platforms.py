"""Platforms that do not turn: two cognate four-bars with one crank carry a bar at two points.

With a, b, c, d the vectors of crank, coupler, rocker and frame and P = A + a + k b, the cognate on
D and on the third pivot E = A + k d has a crank (1 - k) a at E, and there P = E + (1 - k) a + k c.
Moved by A - E its crank stands on A and turns with a: both are one bar.  The bar from P to P - k d
then does not turn; P and a link k c hold it.

Source: S. Roberts, On three-bar motion in plane space, Proc. London Math. Soc. 7, 1875; R. S.
Hartenberg, J. Denavit, Kinematic Synthesis of Linkages, 1964, ch. 6.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from catalogue.plugin import Parameter, angles, hookimpl

if TYPE_CHECKING:
    from catalogue.plugin import Collection, Complexes, Floats, Parameters

SOURCE = "Roberts 1875; Hartenberg and Denavit 1964, ch. 6"


def pose(p: Parameters) -> dict[str, Complexes | float]:
    """Place the four-bar on a frame of length 1, then platform and link."""
    from catalogue.plugin import apex

    b = p["crank"] * np.exp(1j * p["angle"])
    c = apex(b, p["coupler"], 1.0, p["rocker"])
    k = p["along"] + 1j * p["across"]
    guided = b + k * (c - b)
    return {"A": 0.0, "D": 1.0, "B": b, "C": c, "F": (1 - k) * b, "P": guided, "Q": guided - k, "T": guided - 0.5 * k}


def from_four_bars(b: Complexes, c: Complexes, p: Complexes) -> dict[str, Floats]:
    """Return the parameters of platforms for four-bars on a frame from 0 to 1."""
    k = (p - b) / (c - b)
    crank, coupler, rocker = np.abs(b), np.abs(c - b), np.abs(c - 1)
    return {
        "crank": crank,
        "coupler": coupler,
        "rocker": rocker,
        "along": k.real,
        "across": k.imag,
        "angle": np.angle(b),
    }


@hookimpl
def catalogue_collections() -> list[Collection]:
    from catalogue.plugin import ChainFamily, Structure, chain_collection

    family = ChainFamily(
        "cognate-platform",
        "Platform held by two cognate four-bars with one crank",
        SOURCE,
        Structure.of(
            {"frame": "AD", "crank": "ABF", "coupler": "BCP", "rocker": "CD", "platform": "PQT", "link": "FQ"},
            drive="crank",
        ),
        "T",
        [
            Parameter("crank", ((0.2, 1.5),), "length of the crank, over the frame"),
            Parameter("coupler", ((0.4, 2.0),), "length of the coupler, over the frame"),
            Parameter("rocker", ((0.4, 2.0),), "length of the rocker, over the frame"),
            Parameter("along", ((-1.0, 2.0),), "guided point along the coupler, over its length"),
            Parameter("across", ((-1.5, -0.2), (0.2, 1.5)), "guided point across the coupler, over its length"),
            Parameter("angle", angles((0, 360)), "angle of the crank from the frame [rad]"),
        ],
        pose,
        from_four_bars=from_four_bars,
    )
    return [chain_collection("translating-platforms", "Platforms that do not turn", SOURCE, [family])]
