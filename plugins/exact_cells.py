"""Exact straight lines: the inversors of Peaucellier and Lipkin and of Hart, Cardan's gears.

Source: C.-N. Peaucellier 1864; L. Lipkin 1871; H. Hart, On certain conversions of motion, Messenger
of Mathematics 4, 1875; G. Cardano 1570; A. B. Kempe, How to Draw a Straight Line, 1877.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from catalogue.plugin import Parameter, angles, hookimpl

if TYPE_CHECKING:
    from catalogue.plugin import Collection, Complexes, Parameters

SOURCE = "Peaucellier 1864; Lipkin 1871; Hart 1875; Cardano 1570; Kempe 1877"


def peaucellier(p: Parameters) -> dict[str, Complexes | float]:
    """Place arms of length 1, and a rhombus guided along a circle."""
    from catalogue.plugin import apex

    c = p["crank"] * (1 + np.exp(1j * p["angle"]))
    b, d = apex(0.0, 1.0, c, p["side"]), np.conj(apex(0.0, 1.0, np.conj(c), p["side"]))
    return {"O": 0.0, "Q": p["crank"], "C": c, "B": b, "D": d, "P": b + d - c}


def hart(p: Parameters) -> dict[str, Complexes | float]:
    """Place a contraparallelogram A B C D.

    O, R and P divide its bars in the same ratio and lie on a line.
    """
    a, c, b, d = -p["half"] + 0j, p["half"] + 0j, p["top"] + 1j, -p["top"] + 1j
    o, r = a + p["part"] * (b - a), a + p["part"] * (d - a)
    centre = 0.5 * (o + r) + 1j * p["lead"] * (r - o)
    return {"A": a, "B": b, "C": c, "D": d, "O": o, "R": r, "P": c + p["part"] * (b - c), "S": centre}


def cardan(p: Parameters) -> dict[str, Complexes | float]:
    """Place a wheel of radius 1 that rolls in a ring of radius 2."""
    arm = np.exp(1j * p["angle"])
    return {"O": 0.0, "A": arm, "P": arm + np.exp(-1j * p["angle"])}


@hookimpl
def catalogue_collections() -> list[Collection]:
    from catalogue.plugin import ChainFamily, Structure, chain_collection

    families = [
        ChainFamily(
            "peaucellier-lipkin",
            "Inversor of Peaucellier and Lipkin",
            SOURCE,
            Structure.of(
                {
                    "frame": "OQ",
                    "crank": "QC",
                    "OB": "OB",
                    "OD": "OD",
                    "BC": "BC",
                    "CD": "CD",
                    "BP": "BP",
                    "DP": "DP",
                },
                drive="crank",
            ),
            "P",
            [
                Parameter("side", ((0.15, 0.6),), "side of the rhombus, over a long arm"),
                Parameter("crank", ((0.15, 0.6),), "length of the crank, as of the frame"),
                Parameter("angle", angles((-60, -5), (5, 60)), "angle of the crank [rad]"),
            ],
            peaucellier,
            exact=True,
        ),
        ChainFamily(
            "hart",
            "Hart's inversor, a contraparallelogram",
            SOURCE,
            Structure.of(
                {"frame": "OS", "crank": "SR", "AB": "OAB", "AD": "ARD", "BC": "BCP", "CD": "CD"}, drive="crank"
            ),
            "P",
            [
                Parameter("half", ((0.6, 3.0),), "half the long diagonal, over the height"),
                Parameter("top", ((0.1, 0.5),), "half the short diagonal, over the height"),
                Parameter("part", ((0.25, 0.75),), "part of the bars at which they are divided"),
                Parameter("lead", ((-1.5, 1.5),), "distance of the crank's pivot from the dividing line"),
            ],
            hart,
            exact=True,
            special={"halved": lambda p: abs(p["part"] - 0.5) < 0.01},
        ),
        ChainFamily(
            "cardan-gears",
            "Cardan's gears: a wheel that rolls in a ring of twice its radius",
            SOURCE,
            Structure.of(
                {"frame": "O", "arm": "OA", "wheel": "AP"}, drive="arm", gears=[("frame", "wheel", "arm", 2.0)]
            ),
            "P",
            [Parameter("angle", angles((0, 360)), "angle of the arm [rad]")],
            cardan,
            exact=True,
        ),
    ]
    return [chain_collection("exact-cells", "Mechanisms that draw an exact straight line", SOURCE, families)]
