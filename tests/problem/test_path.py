"""Paths that can be asked for, where they lie, and how one that cannot be meant is refused: in a line that names it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from catalogue import CircularArc, InvalidRequest, StraightLine

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
        ("stroke", lambda x: CircularArc(x, 0.05, 200)),
        ("radius", lambda x: CircularArc(150, 0.05, x)),
        ("deviation", lambda x: CircularArc(150, x, 200)),
    ],
)
def test_nominal_refuses(name: str, make: Callable[[Any], Any], value: Any, message: str) -> None:
    if name == "radius" and value is None:  # whatever fits best
        assert make(value).sweep is None
        return
    with pytest.raises(InvalidRequest, match=f"^{name} .*{message}"):
        make(value)


def test_a_deviation_of_a_tenth_of_the_stroke_is_no_guidance() -> None:
    assert StraightLine(10, 1).relative == pytest.approx(0.1)
    with pytest.raises(InvalidRequest, match=r"a deviation of 1\.5 over a stroke of 10 is no guidance"):
        StraightLine(10, 1.5)


def test_an_arc_over_a_chord_is_the_minor_one_up_to_a_half_circle() -> None:
    assert CircularArc(197, 0.1, 100).sweep == pytest.approx(1.97)
    assert CircularArc(200, 0.1, 100).angle == pytest.approx(180)
    with pytest.raises(InvalidRequest, match=r"an arc of chord 201 and radius 100 is impossible: .* at most 200"):
        CircularArc(201, 0.1, 100)


@pytest.mark.parametrize("angle", [1e-3, 45, 180, 200, 350])
def test_two_of_stroke_radius_and_angle_say_the_third(angle: float) -> None:
    chord = 2 * 50 * math.sin(math.radians(angle / 2))
    every: dict[str, Any] = {"stroke": chord, "radius": 50.0, "angle": angle}
    for left_out in every:
        if left_out == "angle" and angle > 180:  # the minor arc is meant
            continue
        made = CircularArc(deviation=chord / 100, **{k: v for k, v in every.items() if k != left_out})
        assert [made.stroke, made.radius, made.angle] == pytest.approx([chord, 50, angle], rel=1e-9)
    assert replace(CircularArc(deviation=0.01 * chord, **every), unit="mm").angle == angle


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"radius": 50, "angle": 0}, "angle must be a finite number above zero, not 0"),
        ({"radius": 50, "angle": -90}, "angle must be a finite number above zero, not -90"),
        ({"radius": 50, "angle": 351}, "an arc of 351\u00b0 nearly closes: its angle must be 350\u00b0 or less"),
        ({"radius": 50, "angle": "wide"}, "angle must be a number, not 'wide'"),
        ({"radius": 50}, "stroke must be a number, not None"),
        ({"angle": 200}, "an arc needs its stroke, or radius and angle"),
        (
            {"stroke": 60, "radius": 50, "angle": 200},
            "stroke 60, radius 50 and angle 200\u00b0 contradict one another: .*a chord of 98.4808; leave one",
        ),
    ],
)  # fmt: skip
def test_an_arc_refuses_what_contradicts_itself(given: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidRequest, match=message):
        CircularArc(deviation=0.1, **given)


def test_a_tenth_of_the_diameter_is_no_guidance_beyond_a_half_circle() -> None:
    assert CircularArc(deviation=10, radius=50, angle=350).relative == pytest.approx(0.1)
    with pytest.raises(InvalidRequest, match="no guidance"):
        CircularArc(deviation=10.1, radius=50, angle=350)


@pytest.mark.slow
@given(st.floats(1e-3, 1e3), st.floats(1e-9, 0.1), st.floats(1 / 1.97, 1e9))
def test_an_arc_in_the_order_stroke_radius_deviation_is_refused(stroke: float, part: float, bend: float) -> None:
    """As it was once: no radius of an arc is small enough for a deviation."""
    deviation, radius = stroke * part, stroke * bend
    assert CircularArc(stroke, deviation, radius).radius == radius
    with pytest.raises(InvalidRequest, match="of an arc give stroke, deviation, radius in this order"):
        CircularArc(stroke, radius, deviation)
    with pytest.raises(InvalidRequest, match="of an arc give stroke, deviation, radius in this order"):
        CircularArc.between((0, 0), (0, stroke), radius, deviation)
    with pytest.raises(InvalidRequest, match=r"no guidance$"):
        StraightLine(stroke, radius)


COORDINATE = st.floats(-1e6, 1e6).map(lambda x: round(x, 3))


@given(COORDINATE, COORDINATE, COORDINATE, COORDINATE)
def test_a_path_between_two_points_starts_and_ends_there(x0: float, y0: float, x1: float, y1: float) -> None:
    here, there = complex(x0, y0), complex(x1, y1)
    if here == there:
        with pytest.raises(InvalidRequest, match="the path starts and ends in"):
            StraightLine.between((x0, y0), (x1, y1), 1e-9)
        return
    for request in (
        StraightLine.between((x0, y0), (x1, y1), 1e-5),
        CircularArc.between((x0, y0), (x1, y1), 1e-5),
    ):
        assert request.origin == here
        assert abs(request.origin + request.stroke * request.direction - there) <= 1e-14 * (abs(here) + abs(there))
        assert abs(request.direction) == pytest.approx(1, abs=1e-15)


@pytest.mark.parametrize(("along", "direction"), [(0, 1), (90, 1j), (-90, -1j), (180, -1), (270, -1j), (360, 1)])
def test_right_angles_are_exact(along: float, direction: complex) -> None:
    assert StraightLine(1, 0.01, along=along).direction == direction


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: StraightLine(1, 0.01, start=(0, math.nan)), "start has a coordinate that is not finite"),
        (lambda: StraightLine(1, 0.01, start=3), "start must be two numbers, x and y, not 3"),  # type: ignore[arg-type]  # wrong on purpose
        (lambda: StraightLine(1, 0.01, start=(1, 2, 3)), "start must be two numbers"),  # type: ignore[arg-type]  # wrong on purpose
        (lambda: StraightLine(1, 0.01, along="up"), "along must be a number of degrees, not 'up'"),  # type: ignore[arg-type]  # wrong on purpose
        (
            lambda: StraightLine.between((-1e308, 0), (1.7e308, 0), 1),
            "stroke must be a finite number above zero, not inf",
        ),
        (
            lambda: StraightLine.between((0, 0), (1.7e308, 1.7e308), 1),
            "stroke must be a finite number above zero, not inf",
        ),
        (lambda: CircularArc(1, 0.01, 2, along=math.inf), "along must be a finite number of degrees, not inf"),
        (lambda: StraightLine.between((0, 0), "there", 0.01), "to must be two numbers"),  # type: ignore[arg-type]  # wrong on purpose
        (lambda: StraightLine.between((0, math.inf), (1, 0), 0.01), "from has a coordinate that is not finite"),
        (lambda: CircularArc.between((0, 0), (0, 0), 0.01, 1), r"starts and ends in \(0, 0\): give two places"),
    ],
)
def test_places_refuse(make: Callable[[], Any], message: str) -> None:
    with pytest.raises(InvalidRequest, match=message):
        make()
