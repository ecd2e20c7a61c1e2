"""A problem is what was asked, in strokes, whatever the unit, place and direction."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from catalogue import CircularArc, StraightLine
from catalogue.problem.constraints import Constraints
from catalogue.problem.problem import Problem
from catalogue.problem.ranking import Ranking

SCALES = [1e-300, 1e-12, 1e-3, 1.0, 25.4, 1e6, 1e300]


def asked(size: float, start: complex = 0j, along: float = 0.0) -> Problem:
    """Return one problem in a unit, at a place and in a direction."""
    turn = StraightLine(1, 0.01, along=along).direction
    places = [start + size * turn * z for z in (0.2 - 0.4j, 0.9 + 0.7j)]
    request = CircularArc(size, 1e-3 * size, 1.5 * size, start=(start.real, start.imag), along=along)
    wanted = Constraints(
        max_size=3 * size, min_link=0.1 * size, min_transmission=40, fixed_pivots=[(z.real, z.imag) for z in places],
        within=0.2 * size,
    )  # fmt: skip
    return Problem.of(request, wanted, Ranking.of(request, desires={"size": (2 * size, 7 * size)}))


@pytest.mark.parametrize("along", [0.0, 90.0, -137.5])
@pytest.mark.parametrize("size", SCALES)
def test_a_problem_does_not_depend_on_unit_and_place(size: float, along: float) -> None:
    one, other = asked(1.0), asked(size, size * (3 - 2j), along)
    assert other.path.stroke == 1
    assert other.deviation == pytest.approx(1e-3, rel=1e-14)
    assert other.curvature == pytest.approx(-1 / 1.5)
    assert other.stroke == pytest.approx(size)
    for name in ("max_size", "min_link", "within", "min_transmission"):
        assert getattr(other.constraints, name) == pytest.approx(getattr(one.constraints, name), rel=1e-14)
    for a, b in zip(one.constraints.places, other.constraints.places, strict=True):
        assert b == pytest.approx(a, abs=1e-14)
    assert other.ranking.desires["size"].best == pytest.approx(2)
    assert other.ranking.desires["size"].worst == pytest.approx(7)


@given(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3), st.floats(-360, 360), st.floats(-2, 3), st.floats(-2, 2))
def test_scale_and_shift_lead_back_to_the_frame_of_the_user(
    x: float, y: float, along: float, right: float, up: float
) -> None:
    """A place that many strokes along the path and to its left of the start, by the sine and cosine of the angle."""
    request = StraightLine(20.0, 0.1, start=(x, y), along=along)
    problem = Problem.of(request, Constraints(), Ranking())
    a = math.radians(along)
    expected = complex(
        x + 20 * (right * math.cos(a) - up * math.sin(a)), y + 20 * (right * math.sin(a) + up * math.cos(a))
    )
    assert problem.scale * complex(right, up) + problem.shift == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(
    ("request_", "curvature", "fixed"),
    [(StraightLine(4, 0.1), 0, None), (CircularArc(4, 0.1, 8), -0.5, -0.5), (CircularArc(4, 0.1), None, None)],
    ids=["line", "arc", "any arc"],
)
def test_curvature_of_the_nominal(request_: Any, curvature: float | None, fixed: float | None) -> None:
    problem = Problem.of(request_, Constraints(), Ranking())
    assert problem.curvature == curvature
    assert problem.fixed_curvature == fixed
    assert math.copysign(1, problem.curvature or 0.0) == (-1 if curvature else 1)


def test_the_allowance_is_needed_where_it_is_ranked_or_bounded() -> None:
    def problem(rank_by: Any, **wanted: Any) -> Problem:
        request = StraightLine(1, 0.01)
        return Problem.of(request, Constraints(**wanted), Ranking.of(request, rank_by))

    assert problem("size").ranking.quantities == {"size"}
    assert {"size", "transmission", "allowance", "min_link"} <= problem("score").ranking.quantities
    assert problem(["size", "max_link"]).ranking.quantities == {"size", "max_link"}
    for needed in (
        problem("score"), problem("size=1,allowance=2"), problem(["size", "allowance"]),
        problem("size", min_allowance=0.1),
    ):  # fmt: skip
        assert needed.needs_allowance is True
    for other in (
        problem("size"), problem(["size", "max_link"]), problem("score", returns=True), problem("size", play=0.1),
        problem("deviation", max_size=3, min_transmission=40),
    ):  # fmt: skip
        assert other.needs_allowance is False
