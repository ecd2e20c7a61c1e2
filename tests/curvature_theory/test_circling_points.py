"""Circling points of a chosen radius: on the finite motion their osculating circle has it, and is stationary."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from catalogue.curvature_theory.analysis import curvature
from catalogue.curvature_theory.circling_points import circling_points
from catalogue.curvature_theory.leading_error import leading_error
from catalogue.errors import InvalidRequest
from catalogue.kinematics.linkage import Linkage
from catalogue.plugin.registry import Registry

FAMILIES = ["four-bar", "slider-crank", "inverted-slider-crank", "swinging-block"]


def confirm(linkage: Linkage, pairs: np.ndarray, radius: float, share: float) -> int:
    """Check pairs on the series of the motion; return how many there are."""
    owner, column = np.nonzero(np.isfinite(pairs).all(axis=(2, 3)))
    z = pairs[owner, column, :, 0] + 1j * pairs[owner, column, :, 1]
    np.testing.assert_allclose(np.abs(z[:, 1] - z[:, 0]), radius, rtol=1e-8)
    found = leading_error(linkage[owner], z[:, 1], circle=True, tolerance=1e-6)
    at = curvature(linkage)[owner]
    off = np.abs(z[:, 1] - at.pole[:, 0] - 1j * at.pole[:, 1]) / at.rho0
    some = ~found.cusp & (found.positions > 0)
    assert some.mean() > share
    assert (found.positions[some] >= 4).mean() > 0.99  # four positions in common: the coefficient of u^3 vanishes
    centre = z[:, 1] + found.normal / np.where(found.curvature == 0, np.nan, found.curvature)
    error = np.abs(centre - z[:, 0]) / (1 + np.abs(z[:, 0]))
    assert np.all(error[some] < 1e-7 / np.minimum(off[some], 1) ** 2)  # near the pole the path hardly shows its circle
    assert np.median(error[some]) < 1e-9
    return len(owner)


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("radius", [0.05, 0.7, 6.0])
def test_circling_points_run_on_stationary_circles(
    random_linkages: Callable[..., Linkage], family: str, radius: float
) -> None:
    linkage = random_linkages(family, 200, 7)
    assert confirm(linkage, circling_points(curvature(linkage), radius), radius, 0.95) > 200


@pytest.mark.parametrize("family", FAMILIES[:2])
def test_none_is_missed(random_linkages: Callable[..., Linkage], family: str) -> None:
    """Counted again by the changes of sign along the curve."""
    linkage = random_linkages(family, 60, 3)
    at = curvature(linkage)
    phi = (np.arange(200_000) + 0.5) / 200_000 * np.pi
    x, y = np.cos(phi), np.sin(phi)
    found = np.isfinite(circling_points(at, 1.3)).all(axis=(2, 3)).sum(1)
    same = 0
    for i in range(len(linkage)):
        a, b = at.kappa_star[i] * x + at.s[i] * y, at.kappa[i] * x + at.s[i] * y
        gap = np.abs(x * x * y / at.rho0[i]) - 1.3 * np.abs(a * b)
        same += found[i] == np.count_nonzero(np.diff(np.sign(gap)))
    assert same >= 58


@pytest.mark.parametrize(("code", "on_axis"), [("I.GG", 2), ("II.xy", 2), ("II*.xy", 2), ("III.KK", 0), ("III*.KK", 1)])
def test_an_axis_that_belongs_to_the_curve_has_its_points(code: str, on_axis: int) -> None:
    """The pole normal with s = 0, the pole tangent with kappa* = 0."""
    from catalogue.series.sampling import draw

    series = Registry().get(code)
    linkage = draw(series, series.members[0], 5, 0).linkage[:40]
    pairs = circling_points(curvature(linkage), 0.8)
    assert np.isfinite(pairs[:, 6:]).all(axis=(2, 3)).sum(1).min() >= on_axis
    confirm(linkage, pairs, 0.8, 0.5)


def test_the_pole_normal_has_four_points_where_the_radius_is_above_four_diameters() -> None:
    """1/y* - 1/y = 1/rho0 and |y - y*| = R: two quadratics, one of which has real roots only then."""
    from catalogue.series.sampling import draw

    series = Registry().get("I.GG")
    linkage = draw(series, series.members[0], 5, 0).linkage[:40]
    at = curvature(linkage)
    for radius, there in ((4.5 * at.rho0.max(), 4), (3.9 * at.rho0.min(), 2)):
        pairs = circling_points(at, radius)
        assert (np.isfinite(pairs[:, 6:]).all(axis=(2, 3)).sum(1) == there).all()
        confirm(linkage, pairs, radius, 0.5)


def test_without_a_pole_there_are_none() -> None:
    watt = Linkage([[[-1, 0.6, 1], [0, 0.6, 1]], [[1, -0.6, 1], [0, -0.6, 1]]])
    assert np.isnan(circling_points(curvature(watt), 1.0)).all()


@pytest.mark.parametrize("radius", [0.0, -1.0, np.nan, np.inf])
def test_a_radius_is_a_positive_number(radius: float) -> None:
    with pytest.raises(InvalidRequest, match="radius must be a finite number above zero"):
        circling_points(curvature(Linkage(np.zeros((0, 2, 2, 3)))), radius)
