"""Linkages from link lengths: what is measured on them is what was given."""

from __future__ import annotations

import numpy as np
import pytest

import catalogue
from catalogue.errors import InvalidLinkage
from catalogue.kinematics.from_lengths import from_lengths


def test_a_four_bar_has_its_lengths() -> None:
    draw = np.random.default_rng(1)
    n = 500
    links = {
        "ground": draw.uniform(2, 3, n), "crank": draw.uniform(0.5, 1, n), "coupler": draw.uniform(2, 3, n),
        "rocker": draw.uniform(2.5, 3, n), "angle": draw.uniform(-180, 180, n), "branch": draw.choice([-1, 1], n),
    }  # fmt: skip
    z = from_lengths(links).points
    (a1, m1), (a2, m2) = ((z[:, i, 0], z[:, i, 1]) for i in (0, 1))
    np.testing.assert_array_equal(a1, 0)
    for name, found in (("ground", a2 - a1), ("crank", m1 - a1), ("coupler", m2 - m1), ("rocker", m2 - a2)):
        np.testing.assert_allclose(np.abs(found), links[name], rtol=1e-12)
    np.testing.assert_allclose(np.angle(m1, deg=True), links["angle"], rtol=1e-12)
    side = np.sign(((a2 - m1).conj() * (m2 - m1)).imag)  # of the line from the crank's end to the rocker's pivot
    np.testing.assert_array_equal(side, links["branch"])


def test_a_slider_crank_has_its_lengths() -> None:
    for branch in (1, -1):
        linkage = from_lengths({"crank": 1, "coupler": 3, "offset": [-0.4, 0, 0.5], "angle": 70, "branch": branch})
        z = linkage.points
        assert set(linkage.family) == {"slider-crank"}
        np.testing.assert_allclose(np.abs(z[:, 1, 1] - z[:, 0, 1]), 3)
        np.testing.assert_allclose(z[:, 1, 1].imag, [-0.4, 0, 0.5])
        np.testing.assert_allclose(z[:, 1, 0], 1j)
        assert (np.sign(z[:, 1, 1].real - z[:, 0, 1].real) == branch).all()


def test_an_inverted_slider_crank_has_its_lengths() -> None:
    for branch in (1, -1):
        linkage = from_lengths({"ground": 3, "crank": 1, "offset": [-0.4, 0, 0.5], "angle": 70, "branch": branch})
        z = linkage.points
        assert set(linkage.family) == {"inverted-slider-crank"}
        away = ((z[:, 0, 1] - z[:, 1, 0]).conj() * z[:, 1, 1]).real  # of the crank's end from the coupler's line
        np.testing.assert_allclose(np.abs(away), [0.4, 0, 0.5], atol=1e-15)
    np.testing.assert_allclose(from_lengths({"ground": 3, "crank": 1, "angle": 70}).points[0, 1, 0], 3)


@pytest.mark.slow
def test_textbook_linkages_by_their_lengths() -> None:
    """Roberts 4 : 2.4 : 2 : 2.4 in the middle, Scott Russell with crank and coupler equal."""
    roberts = {"ground": 4, "crank": 2.4, "coupler": 2, "rocker": 2.4, "angle": np.degrees(np.arccos(1 / 2.4))}
    assert catalogue.classify(from_lengths(roberts), tolerance=1e-7)[0].series == ["I.GG"]
    russell = {"crank": 1, "coupler": 1, "angle": 40}
    assert "II.ooo" in catalogue.classify(from_lengths(russell))[0].series


@pytest.mark.parametrize(
    ("links", "message"),
    [
        ({"crank": 1, "coupler": 2}, "`angle` of the first crank"),
        ({"crank": 1, "rocker": 2, "angle": 3}, "crank, rocker make no linkage: give ground crank coupler rocker, or"),
        ({"crank": -1, "coupler": 2, "angle": 3}, "linkage 0: its crank must be above zero"),
        ({"crank": 0, "coupler": 2, "angle": 3}, "linkage 0: its crank must be above zero"),
        ({"crank": [1, np.nan], "coupler": 2, "angle": 3}, "linkage 1: its crank must be above zero"),
        ({"crank": 1, "coupler": np.inf, "angle": 3}, "linkage 0: a number is NaN or infinite"),
        ({"crank": 1, "coupler": 2, "angle": 3, "branch": 0}, "linkage 0: its branch must be 1 or -1"),
        ({"crank": 1, "coupler": 0.2, "angle": 90}, "linkage 0: its chain cannot be closed at this angle"),
        ({"crank": 1, "ground": 2, "offset": 5, "angle": [1, 2]}, "linkage 0: its chain cannot be closed at this"),
        ({"ground": 9, "crank": 1, "coupler": 2, "rocker": 3, "angle": 1}, "cannot be closed"),
    ],
)
def test_impossible_lengths_are_refused(links: dict[str, float], message: str) -> None:
    with pytest.raises(InvalidLinkage, match=message.replace("(", r"\(")):
        from_lengths(links)


def test_a_length_below_zero_is_named_also_where_no_angle_is_given() -> None:
    lengths = {"crank": -100, "rocker": 250, "ground": 220, "coupler": 250, "along": 125, "across": 80}
    with pytest.raises(InvalidLinkage, match="its crank must be above zero"):
        catalogue.guide(lengths)
