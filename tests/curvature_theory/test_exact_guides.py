"""Orders of contact where series mislead: pole far out, dead points near; against the loop closed in 100 digits."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import catalogue
from catalogue.curvature_theory.analysis import DEAD_POINT, REGULAR, curvature
from catalogue.curvature_theory.dead_points import dead_points
from catalogue.curvature_theory.leading_error import EXACT, leading_error
from catalogue.errors import InvalidRequest
from catalogue.kinematics.linkage import Linkage
from catalogue.kinematics.types import Array
from catalogue.testing.contact import contact_order, largest_gap, taylor

FAMILIES = ("four-bar", "slider-crank", "inverted-slider-crank")
GAP = (1e-16, 1e-12, 5e-10, 1e-9, 2e-9, 5e-9, 1e-8, 2e-8, 5e-8, 1e-7, 2e-7, 1e-6, 1e-5, 1e-4)


def point(z: complex, w: float = 1.0) -> list[float]:
    return [z.real, z.imag, w]


def second(family: str, fixed: complex, moving: complex, along: complex) -> list[list[float]]:
    """Return a dyad of the family's second kind, its ray along a direction."""
    return {
        "four-bar": [point(fixed), point(moving)],
        "slider-crank": [point(along, 0.0), point(moving)],
        "inverted-slider-crank": [point(fixed), point(along, 0.0)],
    }[family]


def nearly_parallel(family: str, angle: float, count: int, seed: int = 0) -> Linkage:
    """Return linkages whose rays are at this angle."""
    draw, made = np.random.default_rng(seed), []
    for _ in range(count):
        a, b, c, length = draw.normal(size=4)
        fixed, along = complex(c, draw.choice([-1, 1]) * (0.3 + draw.random())), np.exp(1j * angle)
        made.append([[point(complex(a)), point(complex(b))], second(family, fixed, fixed + length * along, along)])
    return Linkage(made)


def nearly_dead(family: str, off: float, count: int, seed: int = 0) -> Linkage:
    """Return linkages whose pivots lie this far from a line."""
    draw, made = np.random.default_rng(seed), []
    for _ in range(count):
        z = draw.normal(size=4) + 1j * off * draw.normal(size=4)
        made.append([[point(z[0]), point(z[1])], second(family, z[2], z[3], np.exp(1j * off * draw.normal()))])
    return Linkage(made)


@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("angle", [1e-10, 1e-8, 1e-7, 1e-5, 1e-3])
def test_orders_near_parallel_rays_are_those_of_the_loop(family: str, angle: float) -> None:
    linkage = nearly_parallel(family, angle, 8)
    found = catalogue.classify(linkage).guided()
    at = np.argwhere(found.order > 0)[::2][:6]
    assert len(at) > 2
    for i, k in at:
        assert found.order[i, k] == contact_order(taylor(linkage.pivots[i], [found.pairs[i, k]])[0])


@pytest.mark.slow
@pytest.mark.parametrize("make", [nearly_parallel, nearly_dead])
@pytest.mark.parametrize("family", FAMILIES)
def test_no_element_is_exact_that_the_loop_leaves(make: Callable[..., Linkage], family: str) -> None:
    for off in GAP[::2]:
        linkage = make(family, off, 60)
        order = catalogue.classify(linkage).guided().order
        assert order.min() >= 0
        for i, k in np.argwhere(order == EXACT)[:2]:
            pair = catalogue.classify(linkage).guided().pairs[i, k]
            assert largest_gap(linkage.pivots[i], [pair])[0] < 1e-10 * linkage.size[i]
        assert (order == EXACT).sum() <= 2


@pytest.mark.slow
def test_points_of_exact_guides_are_exact_still() -> None:
    """Every point of a coupler with parallel equal cranks; the joint's circle in an isosceles slider-crank."""
    draw = np.random.default_rng(3)
    z = draw.normal(size=50) + 1j * draw.normal(size=50)
    parallelogram = Linkage([[[[0.0, 0, 1], [0.6, 1, 1]], [[2, 0.3, 1], [2.6, 1.3, 1]]]] * 50)
    assert (leading_error(parallelogram, z, circle=True).order == EXACT).all()
    for phi in draw.uniform(0.2, 1.2, 20):
        pin = np.exp(1j * phi)
        isosceles = Linkage([[point(0j), point(pin)], [[0.0, 1, 0], point(complex(2 * pin.real))]])
        end = np.array([complex(0, 2 * pin.imag)])  # as far beyond the pin as the slider: on a line through the pivot
        assert leading_error(isosceles, end).order[0] == EXACT
        assert leading_error(isosceles, end + 1e-6 * pin).order[0] < EXACT


# -- some series always holds -----------------------------------------------------------------------------------------
@pytest.mark.slow
@pytest.mark.parametrize("make", [nearly_parallel, nearly_dead])
@pytest.mark.parametrize("family", FAMILIES)
def test_some_series_always_holds(make: Callable[..., Linkage], family: str) -> None:
    for off in GAP:
        linkage = make(family, off, 150, seed=2)
        for one in catalogue.classify(linkage):
            assert one.series


# -- dead points ------------------------------------------------------------------------------------------------------
def mobile() -> Linkage:
    """Return linkages at dead points that can move."""
    every = nearly_dead("four-bar", 0.0, 40, seed=5)
    return every[np.isfinite(dead_points(every).pole).all(1).reshape(-1, 2).all(1)]


def poles_of(linkage: Linkage) -> list[complex]:
    """Return the points of its line about which the coupler of a flat linkage can turn.

    A turn by t about p moves a pivot b by (b - p) t across the line, by (p - b) t^2/2 along it; its crank from a keeps
    its length if it is moved by -((b - p) t)^2 / (2 (b - a)) along it.  What is missing, the t^2/2-fold of
    -(b - p)^2/(b - a) + (b - p) = (b - p) (p - a)/(b - a), the coupler shifts along the line: the same for both pivots.
    """
    (a, a_star), (b, b_star) = linkage.points[0].real
    one, two = (np.poly1d([x_star, x], r=True) / (x_star - x) for x, x_star in ((a, a_star), (b, b_star)))
    return sorted((one - two).roots, key=lambda r: r.real)


def test_curvature_gives_either_branch_of_a_dead_point() -> None:
    linkage = mobile()
    assert len(linkage) > 10
    assert (curvature(linkage).state == DEAD_POINT).all()
    both: list[Array] = [catalogue.curvature(linkage, branch).pole[:, 0] for branch in (0, 1)]
    for i in range(len(linkage)):
        np.testing.assert_allclose(sorted(p[i] for p in both), poles_of(linkage[i]), rtol=1e-6)
    assert (catalogue.curvature(linkage, 1).state == REGULAR).all()
    with pytest.raises(InvalidRequest, match="branch"):
        catalogue.curvature(linkage, 2)


@pytest.mark.slow
def test_what_both_branches_of_a_dead_point_guide_is_listed() -> None:
    linkage = mobile()[:10]
    found = catalogue.classify(linkage).guided()
    half = len(found.labels) // 2
    assert found.labels[half:] == [f"{label}, branch 2" for label in found.labels[:half]]
    for branch in (0, 1):
        at = curvature(linkage, branch)
        own = slice(branch * half, (branch + 1) * half)
        np.testing.assert_allclose(found.pairs[:, own][:, 0, 1, :2], at.undulation, rtol=1e-9, atol=1e-9)
        assert set(found.order[:, own].ravel()) <= {0, 3, 4, 5}
        assert (found.order[:, own][:, 0] >= 3).all()


@pytest.mark.slow
def test_other_linkages_have_one_branch() -> None:
    flat, bent = mobile()[:1], nearly_parallel("four-bar", 0.5, 1)
    found = catalogue.classify(Linkage(np.concatenate([flat.pivots, bent.pivots]))).guided()
    alone = catalogue.classify(bent).guided()
    half = len(alone.labels)
    np.testing.assert_array_equal(found.order[1], np.concatenate([alone.order[0], np.zeros(half, int)]))
    np.testing.assert_array_equal(found.pairs[1, :half], alone.pairs[0])
    assert np.isnan(found.pairs[1, half:]).all()
