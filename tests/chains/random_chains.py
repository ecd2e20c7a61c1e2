"""Random chains of ten kinds, with a dyad of every kind, gears and bars kept parallel."""

from __future__ import annotations

import numpy as np

from catalogue.chains.chain import Chain
from catalogue.chains.structure import Structure
from catalogue.errors import InvalidLinkage

FOUR_BAR = {"frame": "AD", "crank": "AB", "coupler": "BC", "rocker": "CD"}


def six(frame: str, crank: str, coupler: str, rocker: str) -> dict[str, str]:
    """Return a four-bar with further joints, and the dyad E F G."""
    return {"frame": frame, "crank": crank, "coupler": coupler, "rocker": rocker, "rod": "EF", "bar": "FG"}


KINDS = {
    "Watt I": Structure.of(six("AD", "AB", "BCE", "CDG"), drive="crank"),
    "Stephenson III": Structure.of(six("ADG", "AB", "BCE", "CD"), drive="crank"),
    "Stephenson I": Structure.of(six("AD", "ABG", "BCE", "CD"), drive="crank"),
    "press": Structure.of(
        FOUR_BAR | {"coupler": "BCE", "rod": "EF", "ram": "F"}, drive="crank", slides=[("frame", "ram")]
    ),
    "quick return": Structure.of(
        {"frame": "ACG", "crank": "AB", "block": "B", "lever": "CE", "rod": "EF", "bar": "FG"},
        drive="crank",
        slides=[("lever", "block")],
    ),
    "two slides": Structure.of(
        FOUR_BAR | {"one": "E", "other": "E"}, drive="crank", slides=[("coupler", "one"), ("rocker", "other")]
    ),
    "yoke": Structure.of(
        {"frame": "AG", "crank": "AB", "block": "B", "yoke": "E", "rod": "EF", "bar": "FG"},
        drive="crank",
        slides=[("frame", "yoke"), ("yoke", "block")],
    ),
    "geared five-bar": Structure.of(
        {"frame": "AD", "crank": "AB", "wheel": "DE", "rod": "BF", "bar": "FE"},
        drive="crank",
        gears=[("crank", "wheel", "frame", -1.5)],
    ),
    "kept parallel": Structure.of(
        FOUR_BAR | {"coupler": "BCE", "frame": "ADG", "platform": "EH", "rod": "HF", "bar": "FG"},
        drive="crank",
        parallel=[("frame", "platform")],
    ),
    "cylinder": Structure.of(
        {"frame": "D", "piston": "B", "coupler": "BCE", "rocker": "CD", "rod": "EF", "bar": "FG"} | {"frame": "DG"},
        drive="piston",
        slides=[("frame", "piston")],
    ),
}


def random_chains(kind: str, count: int, seed: int) -> Chain:
    """Return `count` chains of a kind with joints drawn from a normal distribution."""
    structure, rng = KINDS[kind], np.random.default_rng(seed)
    z, u = np.empty((len(structure.joints), count), complex), np.empty((len(structure.slides), count), complex)
    for i in range(count):
        while True:
            one = rng.normal(size=(len(z), 2)) @ (1, 1j)
            direction = np.exp(2j * np.pi * rng.random(len(u)))
            try:
                made = Chain(structure, np.asarray(one[:, None], complex), direction[:, None])
            except InvalidLinkage:
                continue
            if all(abs(made.sine(group)[0]) > 0.05 for group in structure.dyads):
                break
        z[:, i], u[:, i] = one, direction
    return Chain(structure, np.asarray(z, complex), np.asarray(u, complex))
