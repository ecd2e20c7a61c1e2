"""A series dropped in from a folder passes the contract; the contract refuses a wrong one, and says why."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

from catalogue.curvature_theory.leading_error import EXACT
from catalogue.kinematics.types import Array
from catalogue.series.series import Guided, Parameters
from catalogue.testing import SeriesContract, load

FOLDER = Path(__file__).with_name("dropin")
MY_X0 = load("my.x0", FOLDER)


class TestIIx0(SeriesContract):
    """Including a slot, the pseudo-cuspidation of eq. (41)."""

    series = MY_X0
    folders = (FOLDER,)
    special: ClassVar = {"slider-crank general": [{"a1": 2 * np.tan(0.7), "phi2": np.pi - 0.7}]}


def test_it_fits_on_a_page() -> None:
    assert len((FOLDER / "my_x0.py").read_text("utf-8").splitlines()) <= 40


# -- what the contract refuses --------------------------------------------------------------------------------------
def broken(**changes: Any) -> SeriesContract:
    """Return the contract of my.x0 with something changed."""
    contract = SeriesContract()
    contract.series = replace(MY_X0, **changes)  # type: ignore[misc]  # fields by name
    return contract


def with_guides(change: Callable[[list[Guided]], Sequence[Guided]]) -> SeriesContract:
    return broken(guided=lambda p: change(list(MY_X0.guided(p))))


def with_pivots(change: Callable[[Array, Parameters], Array]) -> SeriesContract:
    (member,) = MY_X0.members
    return broken(members=[replace(member, pivots=lambda p: change(member.pivots(p), p))])


def with_member(**changes: Any) -> SeriesContract:
    return broken(members=[replace(MY_X0.members[0], **changes)])


def with_classes(change: Callable[[Array, Array], tuple[Array, Array]]) -> SeriesContract:
    return broken(classify=lambda instant: change(*MY_X0.classify(instant)))


def shifted(guides: list[Guided]) -> list[Guided]:
    return [replace(g, pairs=g.pairs * [[1, 1.0001, 1], [1, 1, 1]]) for g in guides]


def scaled(pivots: Array, _: Parameters) -> Array:
    return pivots * [2, 2, 1]


def lowered(pivots: Array, _: Parameters) -> Array:
    return pivots - [0, 0.5, 0] * pivots[..., 2:]


def upside_down(pivots: Array, _: Parameters) -> Array:
    return pivots * [1, -1, 1]


def off_the_pole(pivots: Array, p: Parameters) -> Array:
    return pivots + 1e-6 * p["a1"][:, None, None, None] * [[[0, 0, 0], [1, 0, 0]], [[0, 0, 0], [0, 0, 0]]]


def growing(pivots: Array, _: Parameters) -> Array:
    return pivots * (1 + 1e-6 * np.arange(len(pivots))[:, None, None, None] * [1, 1, 0])


def chancy(pivots: Array, _: Parameters) -> Array:
    return pivots * np.random.default_rng().random()


def lost_at_the_end(pivots: Array, p: Parameters) -> Array:
    return np.where((p["a1"] == 4)[:, None, None, None], np.nan, pivots)


@pytest.mark.parametrize(
    ("contract", "test", "message"),
    [
        (with_guides(lambda g: [replace(x, order=5) for x in g]), "guides_touch*", "claims contact of order 5, .*s.5"),
        (with_guides(lambda g: [replace(x, order=3) for x in g]), "guides_touch*", "claims contact of order 3"),
        (with_guides(lambda g: [replace(x, order=EXACT) for x in g]), "guides_touch*", r"\(exact\), but .* leaves it"),
        (with_guides(shifted), "guides_touch*", "of order 4, but the finite motion leaves it like s.[1-4]"),
        (with_guides(shifted), "principal_pairs*", "is real, but no guided element of order 4"),
        (with_guides(lambda g: g[:1]), "principal_pairs*", "check where you give NaN"),
        (with_guides(lambda g: [g[0], replace(g[0], label="x")]), "guides_are_pairs*", r"x is \[3\]; give one of them"),
        (with_guides(lambda g: [replace(g[0], pairs=0 * g[0].pairs)]), "guides_are_pairs*", r"\(0, 0, 0\) is no point"),
        (with_guides(lambda g: [replace(x, pairs=x.pairs * np.nan) for x in g]), "each_guide*", "NaN everywhere"),
        (with_guides(lambda g: [g[0], g[0]]), "arrays_have*", "two guided elements have one label"),
        (with_guides(lambda g: [replace(g[0], order=4.0)]), "arrays_have*", "order of .* not an integer"),  # type: ignore[arg-type]  # wrong on purpose
        (with_guides(lambda g: [replace(g[0], pairs=g[0].pairs[:, 0])]), "arrays_have*", "pairs of .* shape"),
        (with_pivots(scaled), "frame*", "the diameter of its inflection circle is not 1"),
        (with_pivots(lowered), "frame*", "its pole is not at the origin"),
        (with_pivots(upside_down), "frame*", r"its inflection pole is not \(0, 1\)"),
        (with_pivots(off_the_pole), "linkages_are*", "residual"),
        (with_pivots(growing), "a_linkage*", "its pivots alone"),
        (with_pivots(chancy), "same_parameters*", "use no random numbers"),
        (with_pivots(lost_at_the_end), "edges*", "NaN or infinite"),
        (with_classes(lambda r, m: (r, 0 * m)), "linkages_are*", "margin 0 in the canonical frame"),
        (with_classes(lambda r, m: (r, m * r.size)), "a_linkage*", "its margin alone"),
        (with_classes(lambda r, m: (r, m[:1])), "arrays_have*", "margin: shape"),
        (broken(title=" "), "data_are_complete", "must not be blank"),
        (with_member(weight=0.0), "data_are_complete", "weight must be positive"),
        (with_member(family="gear"), "data_are_complete", "no plugin provides the family"),
        (broken(inverse="my.x0"), "inverse_has*", "it is its own inverse"),
        (broken(inverse="II.xy"), "registered*", "the inverse of II.xy is"),
    ],
)  # fmt: skip
def test_the_contract_refuses(contract: SeriesContract, test: str, message: str) -> None:
    names = [name for name in dir(contract) if name.startswith(f"test_{test.rstrip('*')}")]
    assert len(names) == 1
    members = [] if test == "data_are_complete" else [contract.series.members[0]]
    # a check that is skipped does not refuse with that message
    with pytest.raises((AssertionError, pytest.skip.Exception), match=message):
        getattr(contract, names[0])(*members)
