"""Cognates run along the same path, measured on the finite motion of each."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from catalogue.guidance.coupler_curve import coupler_curve
from catalogue.kinematics.cognates import cognates
from catalogue.kinematics.linkage import Linkage

Maker = Callable[..., Linkage]


@pytest.mark.parametrize(("family", "count"), [("four-bar", 2), ("slider-crank", 1)])
def test_cognates_have_the_same_path(family: str, count: int, random_linkages: Maker) -> None:
    linkage = random_linkages(family, 60, 11)
    draw = np.random.default_rng(2)
    point = draw.normal(size=60) + 1j * draw.normal(size=60)
    made, which, number = cognates(linkage, point)
    assert np.bincount(which, minlength=60).tolist() == [count] * 60
    assert set(made.family) == {family}
    assert family == "slider-crank" or set(number) == {1, 2}
    shared = np.where(number == 1, linkage.points[which, 0, 0], linkage.points[which, 1, 0])
    np.testing.assert_allclose(made.points[:, 0, 0], shared, atol=1e-12)
    one, two = coupler_curve(linkage[which], point[which]), coupler_curve(made, point[which])
    half = 0.5 * np.minimum(one.extent.min(0), two.extent.min(0))
    clear = half > 0.02
    assert clear.mean() > 0.7
    nodes = np.linspace(-1, 1, 21)
    same = np.abs(one.tangent - two.tangent) < 1e-9
    for g in (one, two):
        low, high = g.window(-half, half)
        u, _ = g.path.window(low, high, nodes)
        assert np.isfinite(u[:, clear]).all()
    # along one's tangent the same place is passed at the same height
    low, high = one.window(-half, half)
    u, v = one.path.window(low, high, nodes)
    turned = np.where(same, 1, -1)
    for k in range(21):
        at, _ = two.window(turned * u[k], turned * u[k])
        x, y = two.path(at[None])
        np.testing.assert_allclose((turned * x[0])[clear], u[k][clear], atol=1e-9)
        np.testing.assert_allclose((turned * y[0])[clear], v[k][clear], atol=1e-8)


def test_the_cognate_of_a_cognate_is_the_linkage(random_linkages: Maker) -> None:
    linkage = random_linkages("slider-crank", 20, 12)
    point = np.full(20, 0.7 - 0.4j)
    made, which, _ = cognates(linkage, point)
    back, again, _ = cognates(made, point[which])
    assert again.tolist() == list(range(20))
    before, after = (np.sort_complex(one.points.reshape(20, -1).round(9)) for one in (linkage[which], back))
    finite = np.abs(before) < 1e9
    np.testing.assert_allclose(np.abs(before[finite]), np.abs(after[finite]), atol=1e-8)


def test_pivots_and_other_families_have_none(random_linkages: Maker) -> None:
    linkage = random_linkages("four-bar", 5, 1)
    made, *_ = cognates(linkage, linkage.points[:, 0, 1])
    assert len(made) == 0
    for family in ("inverted-slider-crank", "swinging-block", "elliptic-trammel", "oldham"):
        made, which, number = cognates(random_linkages(family, 5, 1), np.full(5, 0.1 + 0.2j))
        assert len(made) == len(which) == len(number) == 0


def test_roberts_linkage_is_its_own_cognate_twice() -> None:
    """Symmetric: the third fixed pivot stands between the others, below the guided point's."""
    height = float(np.sqrt(2.4**2 - 1))
    linkage = Linkage([[[-2.0, 0, 1], [-1, height, 1]], [[2.0, 0, 1], [1, height, 1]]])
    made, *_ = cognates(linkage, np.array([0j]))
    third = made.points[:, 1, 0]
    np.testing.assert_allclose(third, third[0])
    assert third[0].real == pytest.approx(0)
