"""What can be asked for, and how a request that cannot be meant is refused: in one line that names it."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import catalogue
from catalogue import CircularArc, InvalidRequest, StraightLine
from catalogue.query.constraints import Constraints
from catalogue.query.criteria import CRITERIA, weights
from catalogue.query.region import Region

NUMBERS = [
    (math.nan, "finite number above zero, not nan"),
    (math.inf, "finite number above zero, not inf"),
    (-math.inf, "finite number above zero, not -inf"),
    (0, "finite number above zero, not 0"),
    (-150, "finite number above zero, not -150"),
    ("long", "must be a number, not 'long'"),
    (None, "must be a number, not None"),
    ([150], "must be a number, not"),
    (1j, "must be a number, not 1j"),
]
each_wrong_number = pytest.mark.parametrize(("value", "message"), NUMBERS)


@each_wrong_number
@pytest.mark.parametrize(
    ("name", "make"),
    [
        ("stroke", lambda x: StraightLine(x, 0.05)),
        ("deviation", lambda x: StraightLine(150, x)),
        ("stroke", lambda x: CircularArc(x, 200, 0.05)),
        ("radius", lambda x: CircularArc(150, x, 0.05)),
        ("deviation", lambda x: CircularArc(150, 200, x)),
    ],
)
def test_nominal_refuses(name: str, make: Callable[[Any], Any], value: Any, message: str) -> None:
    if name == "radius" and value is None:  # whatever fits best
        assert make(value).sweep is None
        return
    with pytest.raises(InvalidRequest, match=f"^{name} .*{message}"):
        make(value)


@each_wrong_number
@pytest.mark.parametrize("name", ["max_size", "max_link", "min_link", "max_ground", "max_arm"])
def test_lengths_refuse(name: str, value: Any, message: str) -> None:
    if value is None:
        assert getattr(Constraints(**{name: value}), name) is None
        return
    with pytest.raises(InvalidRequest, match=f"^{name} .*{message}"):
        Constraints(**{name: value})


def test_a_deviation_of_a_tenth_of_the_stroke_is_no_guidance() -> None:
    assert StraightLine(10, 1).relative == pytest.approx(0.1)
    with pytest.raises(InvalidRequest, match=r"a deviation of 1\.5 over a stroke of 10 is no guidance"):
        StraightLine(10, 1.5)


def test_an_arc_stays_below_a_half_circle() -> None:
    assert CircularArc(197, 100, 0.1).sweep == pytest.approx(1.97)
    for stroke in (199, 200, 500):
        with pytest.raises(InvalidRequest, match=f"an arc of chord {stroke} and radius 100 is a half circle or imposs"):
            CircularArc(stroke, 100, 0.1)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ((0, 0, 0, 10), "is empty: it has no width or no height"),
        ((0, 5, 10, 5), "is empty"),
        ((0, 0, math.nan, 10), "has a coordinate that is not finite"),
        ((0, 0, 10, math.inf), "has a coordinate that is not finite"),
        ((0, 0, 10), "must be x0, y0, x1, y1 or at least three points"),
        ([(0, 0), (1, 1)], "must be x0, y0, x1, y1 or at least three points"),
        ([(0, 0), (1, 1), (2, 2, 2)], "must be x0, y0, x1, y1 or a list of points"),
        ([(0, 0, 0), (1, 1, 0), (2, 2, 2)], "at least three points"),
        ([(0, 0), (1, 0), (2, 0)], "is empty"),
        ("box", "must be x0, y0, x1, y1 or a list of points"),
        (7, "at least three points"),
    ],
)
@pytest.mark.parametrize("name", ["fixed_pivots_in", "pivots_in"])
def test_regions_refuse(name: str, given: Any, message: str) -> None:
    with pytest.raises(InvalidRequest, match=f"^{name} .*{message}"):
        Constraints(**{name: given})


def test_corners_of_a_box_may_be_any_two() -> None:
    for corners in ((0, -1, 4, 3), (4, 3, 0, -1), (0, 3, 4, -1)):
        assert Region.of("box", corners).box == (0, -1, 4, 3)


@pytest.mark.parametrize("angle", [-1, 90, 180, math.nan, math.inf, "steep", None])
def test_transmission_angle_refuses(angle: Any) -> None:
    with pytest.raises(InvalidRequest, match=r"^min_transmission must be "):
        Constraints(min_transmission=angle)


def test_links_must_leave_room() -> None:
    with pytest.raises(InvalidRequest, match="min_link 20 is above max_link 10"):
        Constraints(min_link=20, max_link=10)


@pytest.mark.parametrize("order", [-1, 3.5, "high", None])
def test_order_refuses(order: Any) -> None:
    assert Constraints(order=np.int64(3)).order == 3
    with pytest.raises(InvalidRequest, match=r"^order must be (a whole number|at least 0), not"):
        Constraints(order=order)


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ("size", {"size": 1.0}),
        ("size=2, transmission=0.5", {"size": 2.0, "transmission": 0.5}),
        ({"deviation": 3}, {"deviation": 3.0}),
        ("size,deviation", {"size": 1.0, "deviation": 1.0}),
    ],
)
def test_weights_are_read(given: Any, expected: dict[str, float]) -> None:
    assert weights(given) == expected


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("beauty", "cannot rank by beauty; choose from balance, size, deviation, .*max_arm"),
        ("size=1,beauty=2", "cannot rank by beauty"),
        ("", "cannot rank by ; choose|cannot rank by nothing"),
        ({}, "cannot rank by nothing"),
        ("size=0", "the weight of size must be a finite number above zero, not 0"),
        ("size=-1", "the weight of size must be a finite number above zero, not -1"),
        ("size=nan", "the weight of size .* not nan"),
        ("size=much", "the weight of size must be a number, not 'much'"),
        ("size=", "the weight of size must be a number, not ''"),
        (3, "cannot rank by 3"),
    ],
)
def test_weights_refuse(given: Any, message: str) -> None:
    with pytest.raises(InvalidRequest, match=message):
        weights(given)


@pytest.mark.parametrize(
    ("wanted", "message"),
    [
        ({"families": "five-bar"}, "the database holds no family 'five-bar'; it holds .*four-bar.*"),
        ({"series": ["I.GG", "V.zz"]}, r"the database holds no series 'V\.zz'; it holds I\.GG, "),
        ({"configurations": ["Q"]}, "the database holds no configuration 'Q'"),
        ({"bolts": 3}, "unknown constraint: 'bolts'"),
        ({"rank_by": "beauty"}, "cannot rank by beauty"),
        ({"limit": 0}, "limit must be at least 1, not 0"),
        ({"effort": 0}, "effort must be at least 1, not 0"),
        ({"per_series": -1}, "per_series must be at least 0, not -1"),
        ({"limit": "many"}, "limit must be a whole number, not 'many'"),
        ({"effort": 1.5}, "effort must be a whole number, not 1.5"),
    ],
)
def test_find_refuses(small: catalogue.Catalogue, wanted: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidRequest, match=message):
        small.find(StraightLine(150, 0.5), **wanted)


@pytest.mark.parametrize("given", [None, 150, "line"])
def test_find_refuses_what_is_no_request(small: catalogue.Catalogue, given: Any) -> None:
    with pytest.raises(InvalidRequest, match="StraightLine or CircularArc"):
        small.find(given)


POINTS = st.tuples(st.floats(-10, 10), st.floats(-10, 10))


@given(st.integers(3, 9), st.integers(0, 2**32 - 1))
def test_polygon_holds_what_is_inside(naive: Any, corners: int, seed: int) -> None:
    """Star-shaped about the origin, convex or not; against the sum of the angles seen from the point."""
    draw = np.random.default_rng(seed)
    angle = 2 * np.pi * (np.arange(corners) + draw.uniform(-0.3, 0.3, corners)) / corners
    radius = draw.uniform(0.3, 2, corners)
    polygon = np.stack([radius * np.cos(angle), radius * np.sin(angle)], 1) + draw.normal(size=2)
    region = Region.of("polygon", polygon[:: draw.choice([-1, 1])])
    points = draw.uniform(-4, 4, (60, 2))
    found = region.holds(points[:, 0] + 1j * points[:, 1])
    assert found.tolist() == [naive.inside(polygon.tolist(), x, y) for x, y in points]


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
    assert box.box == polygon.box
    assert box.is_box
    assert not polygon.is_box


def test_active_names_what_is_set() -> None:
    assert Constraints().active() == []
    wanted = Constraints(families="four-bar", max_size=3, pivots_in=(0, 0, 1, 1), pins_only=True, min_transmission=40)
    assert wanted.active() == ["families", "pins_only", "pivots_in", "max_size", "min_transmission"]
    assert wanted.families == ("four-bar",)


def test_criteria_are_all_accepted(small: catalogue.Catalogue) -> None:
    for criterion in CRITERIA:
        assert len(small.find(StraightLine(150, 0.5), rank_by=criterion, limit=2)) == 2
