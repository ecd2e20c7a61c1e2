from __future__ import annotations

import doctest
import importlib
from typing import Any

import numpy as np
import pytest

from catalogue.chains.chain import Chain
from catalogue.chains.structure import Structure, Turn
from catalogue.errors import InvalidLinkage
from tests.chains.random_chains import FOUR_BAR, KINDS

GROUPS = {
    "Watt I": ["RRR", "RRR"],
    "press": ["RRR", "RRP"],
    "quick return": ["RPR", "RRR"],
    "two slides": ["RRR", "PRP"],
    "yoke": ["RPP", "RRR"],
    "geared five-bar": ["turn", "RRR"],
    "kept parallel": ["RRR", "turn", "RRR"],
}


@pytest.mark.parametrize("kind", GROUPS)
def test_bars_close_in_the_groups_of_the_textbook(kind: str) -> None:
    told = ["turn" if isinstance(group, Turn) else group.kind for group in KINDS[kind].groups]
    assert told == GROUPS[kind]


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_has_one_freedom(kind: str) -> None:
    assert KINDS[kind].freedoms == 1


def test_a_joint_of_three_bars_counts_twice() -> None:
    peaucellier = Structure.of(
        {"frame": "OQ", "crank": "QC", "OB": "OB", "OD": "OD", "BC": "BC", "CD": "CD", "BP": "BP", "DP": "DP"},
        drive="crank",
    )
    assert [group.kind for group in peaucellier.dyads] == ["RRR"] * 3
    assert peaucellier.freedoms == 1


def test_wheels_come_back_after_as_many_turns_as_their_ratio_says() -> None:
    assert KINDS["geared five-bar"].turns == 2
    assert KINDS["Watt I"].turns == 1


@pytest.mark.parametrize(
    ("bars", "how", "wrong"),
    [
        ({"crank": "AB"}, {"drive": "crank"}, "one bar must be `frame`"),
        (FOUR_BAR, {"drive": "crnk"}, "there is no bar 'crnk'; there are frame, crank, coupler, rocker"),
        (FOUR_BAR, {"drive": "coupler"}, "must share one joint with the frame, or slide on it, not 0"),
        (FOUR_BAR | {"rod": "BX"}, {"drive": "crank"}, "it has 2 freedoms; .*: connect 'rod' with more bars"),
        (FOUR_BAR | {"stay": "AC"}, {"drive": "crank"}, "0 freedoms: a joint, slide or gear is one too many"),
        (FOUR_BAR | {"rocker": "CC"}, {"drive": "crank"}, "bar 'rocker' names a joint twice"),
        (FOUR_BAR | {"ro d": "C"}, {"drive": "crank"}, "names have up to 40 of the characters"),
        (FOUR_BAR, {"drive": "crank", "slides": [("rocker", "rocker")]}, "cannot slide or roll on itself"),
        (FOUR_BAR, {"drive": "crank", "gears": [("crank", "coupler", "frame", -1)]}, "must be pinned to its carrier"),
        (FOUR_BAR, {"drive": "crank", "gears": [("crank", "rocker", "frame", 0)]}, "a finite number other than zero"),
        (
            {"frame": "AF", "crank": "AB", "plate": "BCD", "one": "CE", "two": "DG", "rocker": "EGF"},
            {"drive": "crank"},
            "'plate', 'one', 'two', 'rocker' close in no dyad",
        ),
        (
            {"frame": "AD", "crank": "AB", "wheel": "DE", "rod": "BF", "bar": "FE"},
            {"drive": "crank", "gears": [("crank", "wheel", "frame", 2**0.5)]},
            "is no fraction of teeth up to 360",
        ),
        (
            {"frame": "AD", "crank": "AB", "wheel": "DE", "rod": "BF", "bar": "FE"},
            {"drive": "crank", "gears": [("crank", "wheel", "frame", 1e300)]},
            "the gear ratio 1e.300 is no fraction of teeth up to 360",
        ),
        (
            {"frame": "ADG", "crank": "AB", "wheel": "D", "other": "GE", "rod": "BF", "bar": "FE"},
            {"drive": "crank", "gears": [("crank", "wheel", "frame", 7 / 359), ("wheel", "other", "frame", 3 / 353)]},
            "back only after 126727 turns of the drive, at most 1000 are followed",
        ),
        (
            FOUR_BAR | {"rocker": "CDX", "wheel": "XE", "rod": "EF", "bar": "FA"},
            {"drive": "crank", "gears": [("frame", "wheel", "rocker", 1.5)]},
            "needs a whole ratio",
        ),
    ],
)
def test_a_structure_that_does_not_close_is_refused(bars: dict[str, str], how: Any, wrong: str) -> None:
    with pytest.raises(InvalidLinkage, match=wrong.replace("(", r"\(")):
        Structure.of(bars, **how)


FIVE = {"A": 0, "D": 4, "B": 1j, "C": 3 + 2j}


@pytest.mark.parametrize(
    ("joints", "wrong"),
    [
        ({"A": 0, "D": 4, "B": 1j}, "joint 'C' has no position"),
        ({**FIVE, "X": 1}, "joint 'X' is on no bar"),
        ({**FIVE, "C": np.nan}, "not finite"),
        ({**FIVE, "C": 1j}, "joints of 'coupler' or 'rocker' coincide"),
        ({**FIVE, "B": 0}, "joints of 'crank' coincide: it drives nothing"),
        ({**FIVE, "C": 2 + 0.5j}, "given at a dead or change point of 'coupler' and 'rocker'"),
        ({name: 1e-200 * z for name, z in FIVE.items()}, "its size must be between"),
        ({name: 1e100 * z for name, z in FIVE.items()}, "its size must be between"),
    ],
)
def test_a_reference_pose_that_says_no_branch_is_refused(joints: dict[str, complex], wrong: str) -> None:
    with pytest.raises(InvalidLinkage, match=wrong):
        Chain.of(Structure.of(FOUR_BAR, drive="crank"), joints)


@pytest.mark.parametrize("module", ["chain", "circuits", "given", "poses", "rates", "structure"])
def test_the_examples_print_what_they_show(module: str) -> None:
    done = doctest.testmod(importlib.import_module(f"catalogue.chains.{module}"))
    assert done.attempted
    assert not done.failed


def test_a_batch_is_taken_apart_by_columns() -> None:
    structure = Structure.of(FOUR_BAR, drive="crank")
    chain = Chain.of(structure, {"A": 0, "D": [4, 5, 6], "B": 1j, "C": 3 + 2j})
    assert len(chain) == 3
    assert chain[1:].z[structure.joints.index("D")].tolist() == [5, 6]
