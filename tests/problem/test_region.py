"""Regions hold what is inside and say how far outside a point is: against angles and distances by brute force."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from catalogue import InvalidRequest, StraightLine
from catalogue.problem.constraints import Constraints
from catalogue.problem.problem import Problem
from catalogue.problem.ranking import Ranking
from catalogue.problem.region import Region, zones

INF = math.inf
POINTS = st.tuples(st.floats(-10, 10), st.floats(-10, 10))


def star(draw: Any, corners: int) -> Any:
    """Return a polygon that is star-shaped about some point, convex or not, in either sense."""
    angle = 2 * np.pi * (np.arange(corners) + draw.uniform(-0.3, 0.3, corners)) / corners
    radius = draw.uniform(0.3, 2, corners)
    polygon = np.stack([radius * np.cos(angle), radius * np.sin(angle)], 1) + draw.normal(size=2)
    return polygon[:: draw.choice([-1, 1])]


def border(corners: Any, count: int = 2000) -> tuple[Any, float]:
    """Return points along the sides of a polygon, and the largest distance between neighbours."""
    z = np.asarray(corners)[:, 0] + 1j * np.asarray(corners)[:, 1]
    side = np.roll(z, -1) - z
    return (z[:, None] + side[:, None] * np.linspace(0, 1, count)).ravel(), np.abs(side).max() / (count - 1)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ((0, 0, 0, 10), "is empty: it has no width or no height"),
        ((0, 5, 10, 5), "is empty"),
        ((4, 3, 0, -1), "is turned inside out: give the lower left corner first"),
        ((0, 3, 4, -1), "is turned inside out"),
        ((INF, 0, -INF, 1), "is turned inside out"),
        ((0, 0, math.nan, 10), "has a coordinate that is not a number"),
        ([(0, 0), (1, 0), (0, INF)], "only a box may have sides at infinity"),
        ((0, 0, 10), "must be x0, y0, x1, y1 or at least three points"),
        ([(0, 0), (1, 1)], "must be x0, y0, x1, y1 or at least three points"),
        ([(0, 0), (1, 1), (2, 2, 2)], "must be x0, y0, x1, y1 or a list of points"),
        ([(0, 0, 0), (1, 1, 0), (2, 2, 2)], "at least three points"),
        ([(0, 0), (1, 0), (2, 0)], "is empty"),
        ("box", "must be x0, y0, x1, y1 or a list of points"),
        (7, "at least three points"),
    ],
)
@pytest.mark.parametrize("name", ["fixed_pivots_in", "pivots_in", "swept_in"])
def test_regions_refuse(name: str, given: Any, message: str) -> None:
    with pytest.raises(InvalidRequest, match=f"^{name} .*{message}"):
        Constraints(**{name: given})


@pytest.mark.slow
@given(st.integers(3, 9), st.integers(0, 2**32 - 1))
def test_polygon_holds_what_is_inside(naive: Any, corners: int, seed: int) -> None:
    """Against the sum of the angles under which the point sees the sides."""
    draw = np.random.default_rng(seed)
    polygon = star(draw, corners)
    points = draw.uniform(-4, 4, (60, 2))
    found = Region.of("polygon", polygon).holds(points[:, 0] + 1j * points[:, 1])
    assert found.tolist() == [naive.inside(polygon.tolist(), x, y) for x, y in points]


@pytest.mark.slow
@given(st.lists(POINTS, min_size=1, max_size=30))
def test_box_holds_its_border(points: list[tuple[float, float]]) -> None:
    region = Region.of("box", (-3, -2, 5, 4))
    z = np.array([complex(*p) for p in [*points, (-3, 4), (5, -2), (0, -2)]])
    assert region.holds(z).tolist() == [-3 <= p.real <= 5 and -2 <= p.imag <= 4 for p in z]


def test_a_box_is_the_polygon_of_its_corners() -> None:
    box, polygon = Region.of("a", (-3, -2, 5, 4)), Region.of("b", [(-3, -2), (5, -2), (5, 4), (-3, 4)])
    draw = np.random.default_rng(0)
    z = draw.uniform(-8, 8, 500) + 1j * draw.uniform(-8, 8, 500)
    np.testing.assert_array_equal(box.holds(z), polygon.holds(z))
    np.testing.assert_allclose(box.outside(z), polygon.outside(z), rtol=1e-14)
    assert box.box == polygon.box
    assert box.is_box
    assert not polygon.is_box


@pytest.mark.slow
@given(st.integers(3, 9), st.integers(0, 2**32 - 1))
def test_outside_is_the_signed_distance_from_the_border(naive: Any, corners: int, seed: int) -> None:
    draw = np.random.default_rng(seed)
    polygon = star(draw, corners)
    z = draw.uniform(-4, 4, 40) + 1j * draw.uniform(-4, 4, 40)
    places, step = border(polygon)
    nearest = np.abs(z[:, None] - places).min(1)
    found = Region.of("polygon", polygon).outside(z)
    assert (np.abs(found) <= nearest + 1e-12).all()
    assert (np.abs(found) >= nearest - step).all()
    assert ((found < 0) == [naive.inside(polygon.tolist(), p.real, p.imag) for p in z]).all()


@given(st.integers(0, 2**32 - 1))
def test_distances_are_carried_along(seed: int) -> None:
    """A region and a point that are moved, turned and scaled together are as far apart, times the scale."""
    draw = np.random.default_rng(seed)
    region = Region.of("polygon", star(draw, 6)) if seed % 2 else Region.of("box", (-1, -0.5, 2, 1.5))
    z = draw.uniform(-4, 4, 40) + 1j * draw.uniform(-4, 4, 40)
    scale = np.exp(draw.normal()) * np.exp(2j * np.pi * draw.random())
    shift = complex(*draw.normal(size=2))
    carried = region.carried(scale, shift)
    np.testing.assert_allclose(carried.outside(scale * z + shift), abs(scale) * region.outside(z), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("along", [0.0, 90.0, 33.0])
@pytest.mark.parametrize(
    ("box", "inward"),
    [
        ((-INF, 2, INF, INF), lambda z: z.imag - 2),
        ((-INF, -INF, INF, -3), lambda z: -3 - z.imag),
        ((5, -INF, INF, INF), lambda z: z.real - 5),
        ((-INF, -INF, 5, INF), lambda z: 5 - z.real),
        ((-1, -INF, 4, INF), lambda z: np.minimum(z.real + 1, 4 - z.real)),
    ],
    ids=lambda v: "" if callable(v) else str(v),
)
def test_a_side_at_infinity_bounds_nothing(box: Any, inward: Any, along: float) -> None:
    """Half planes and strips in the user's frame, wherever the path lies in it."""
    request = StraightLine(7.0, 0.1, start=(3.0, -2.0), along=along)
    problem = Problem.of(request, Constraints(fixed_pivots_in=box), Ranking())
    region = problem.constraints.fixed_pivots_in
    draw = np.random.default_rng(1)
    there = draw.uniform(-40, 40, 200) + 1j * draw.uniform(-40, 40, 200)
    inside = inward(there)
    found = region.outside((there - problem.shift) / problem.scale) * problem.stroke
    np.testing.assert_allclose(found, -inside, atol=1e-6)


def test_keep_out_takes_one_region_or_several() -> None:
    assert len(zones("keep_out", (0, 0, 1, 1))) == 1
    assert len(zones("keep_out", [(0, 0, 1, 1), [(0, 0), (1, 0), (0, 1)]])) == 2
    assert zones("keep_out", ()) == ()
    with pytest.raises(InvalidRequest, match="keep_out must be a sequence of regions"):
        zones("keep_out", 3)
