"""Lengths of links, and linkages whose lengths are round."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import catalogue
from catalogue.kinematics.from_lengths import from_lengths
from catalogue.kinematics.link_lengths import link_lengths, rounded
from catalogue.kinematics.linkage import FAMILIES, Linkage
from catalogue.kinematics.types import Array


def random_linkages(family: str, n: int = 60) -> tuple[Linkage, Array]:
    """Return linkages of a family with coupler points."""
    rng = np.random.default_rng(3)
    pivots = np.concatenate([rng.normal(size=(n, 2, 2, 2)), np.ones((n, 2, 2, 1))], axis=-1)
    for i, kind in enumerate(FAMILIES[family]):
        if kind:
            pivots[:, i, 0 if kind == 1 else 1, 2] = 0
    return Linkage(pivots), rng.normal(size=n) + 1j * rng.normal(size=n)


@pytest.mark.parametrize("family", list(FAMILIES))
def test_lengths_belong_to_the_linkage_wherever_it_stands(family: str) -> None:
    linkage, point = random_linkages(family)
    here = link_lengths(linkage, point)
    turn, shift = np.exp(0.7j), 2 - 3j
    there = link_lengths(linkage.moved(turn, shift), turn * point + shift)
    assert here.keys() == there.keys()
    for name, values in here.items():
        np.testing.assert_allclose(there[name], values, atol=1e-12)


@pytest.mark.parametrize("family", list(FAMILIES))
def test_rounded_linkages_have_round_lengths_and_stand_near(family: str) -> None:
    linkage, point = random_linkages(family)
    made, moved, good = rounded(linkage, point, 0.01)
    assert good.mean() > 0.9
    for values in link_lengths(made, moved).values():
        np.testing.assert_allclose(values, 0.01 * np.round(values / 0.01), atol=1e-10)
    off = np.where(made.finite, np.abs(made.points - linkage.points[good]), 0.0)
    assert np.quantile(off.max((1, 2)), 0.9) < 0.03
    np.testing.assert_allclose(made.pivots[~made.finite], linkage[good].pivots[~made.finite], atol=1e-15)


def test_lengths_are_those_a_textbook_gives() -> None:
    linkage = from_lengths({"ground": 4.0, "crank": 2.0, "coupler": 5.0, "rocker": 5.0, "angle": 90.0})
    found = link_lengths(linkage, linkage.points[:, 0, 1])
    assert {name: values[0] for name, values in found.items()} == pytest.approx(
        {"crank 1": 2, "crank 2": 5, "frame": 4, "coupler": 5, "point along": 0, "point across": 0}, abs=1e-12
    )
    slider = from_lengths({"crank": 1.0, "coupler": 3.0, "offset": 0.5, "angle": 40.0})
    found = link_lengths(slider, slider.points[:, 0, 1])
    assert found["coupler"][0] == pytest.approx(3)
    assert abs(found["offset of slider 2"][0]) == pytest.approx(0.5)


@pytest.mark.slow
@given(step=st.floats(0.5, 50))
def test_a_step_beyond_the_lengths_leaves_none(step: float) -> None:
    linkage, point = random_linkages("four-bar", 20)
    made, moved, good = rounded(linkage, point, step)
    lengths = link_lengths(linkage, point)
    vanishing = np.min([lengths[k] for k in ("crank 1", "crank 2", "frame", "coupler")], axis=0) < 0.5 * step * 0.999
    assert not good[vanishing].any()
    for values in link_lengths(made, moved).values():
        np.testing.assert_allclose(values, step * np.round(values / step), atol=1e-9 * step + 1e-9)


@pytest.mark.slow
def test_found_guides_have_round_lengths_and_serve(small: catalogue.Catalogue) -> None:
    found = small.find(catalogue.StraightLine(150, 0.5), round_to=1.0, limit=8, pins_only=True)
    assert len(found) == 8
    for c in found:
        assert c.deviation <= 0.5
        assert all(abs(v - round(v)) < 1e-10 for v in c.lengths.values())
        assert c.to_dict()["lengths"] == c.lengths
    assert found.to_pandas()["lengths"][0] == found[0].lengths
