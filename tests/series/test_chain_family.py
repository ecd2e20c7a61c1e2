"""Families of mechanisms of many bars as data: what is wrong is told in one line."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from catalogue.chains.structure import Structure
from catalogue.errors import PluginError
from catalogue.plugin.mechanisms import chain_collection
from catalogue.series.chain_family import ChainFamily, apex
from catalogue.series.series import Parameter

STRUCTURE = Structure.of({"frame": "AD", "crank": "AB", "coupler": "BCP", "rocker": "CD"}, drive="crank")
CRANK = Parameter("crank", ((0.2, 0.8),), "length of the crank")


def pose(p: Any) -> dict[str, Any]:
    b = 1j * p["crank"]
    c = apex(b, 1.2, 1.0, 1.1)
    return {"A": 0, "D": 1, "B": b, "C": c, "P": 2 * c - b}


GOOD: dict[str, Any] = {
    "name": "lambda", "title": "Lambda linkages", "source": "Chebyshev", "structure": STRUCTURE, "point": "P",
    "parameters": [CRANK], "pose": pose,
}  # fmt: skip


@pytest.mark.parametrize(
    ("change", "wrong"),
    [
        ({"name": "my family"}, "a name has up to 40 of the characters"),
        ({"title": " "}, "title of the family lambda must be one line of printable text"),
        ({"source": ""}, "source of the family lambda must be"),
        ({"structure": "ABCD"}, "its structure must be made by Structure.of"),
        ({"point": "X"}, "the guided point 'X' is no joint on a bar"),
        ({"point": "A"}, "the guided point 'A' is on the frame, which stands still"),
        ({"parameters": ["crank"]}, "its parameters must be of the class Parameter"),
        ({"parameters": [CRANK, CRANK]}, "two parameters have one name"),
        ({"pose": {"A": 0}}, "pose must be a function"),
        ({"special": {"Roberts": 3}}, "Roberts must be a function"),
        ({"pose": lambda p: {"A": p["crnk"]}}, "pose or directions fail in the middle of the domain: 'crnk'"),
        ({"pose": lambda p: {"A": 0 * p["crank"]}}, "joint 'D' has no position"),
        ({"pose": lambda p: {**pose(p), "C": np.zeros(7)}}, "fail in the middle of the domain"),
        ({"directions": lambda p: [p["crank"]]}, "0 slides need as many directions, not 1"),
    ],
)
def test_wrong_data_are_told_in_one_line(change: dict[str, Any], wrong: str) -> None:
    with pytest.raises(PluginError, match=wrong) as caught:
        ChainFamily(**{**GOOD, **change})
    assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_a_family_is_stated_in_few_lines_and_draws_guides() -> None:
    collection = chain_collection("lambdas", "Lambda linkages", "Chebyshev", [ChainFamily(**GOOD)])
    some = collection.draw("lambda", np.random.default_rng(1), 20)
    assert len(some) > 5
    for one in some:
        collection.owns(one)


def test_mechanisms_that_cannot_be_closed_are_left_out() -> None:
    wide = ChainFamily(**{**GOOD, "parameters": [Parameter("crank", ((0.2, 9.0),), "length of the crank")]})
    chain, valid = wide.chains({"crank": np.array([0.5, 8.0, np.nan])})
    assert valid.tolist() == [True, False, False]
    assert len(chain) == 1


@pytest.mark.slow
def test_well_known_cases_are_named() -> None:
    family = ChainFamily(**GOOD, special={"short": lambda p: p["crank"] < 0.4})
    collection = chain_collection("lambdas", "Lambda linkages", "Chebyshev", [family])
    (one, *_) = collection.draw("lambda", np.random.default_rng(1), 20)
    short = {**one.parameters, "values": {"crank": 0.3}}
    assert collection.classify(short).special == ("short",)
    assert collection.classify({**short, "values": {"crank": 0.5}}).special == ()


def test_an_apex_is_left_of_the_way() -> None:
    assert apex(0, 5, 6, 5) == pytest.approx(3 + 4j)
    assert np.isnan(apex(0, 1, 6, 1))
