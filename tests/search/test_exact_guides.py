"""Exact guides of any proportions: what they carry stays on its nominal, and they are found where they may stand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from catalogue import Catalogue, CircularArc, StraightLine
from catalogue.problem.constraints import Constraints
from catalogue.problem.problem import Problem
from catalogue.problem.ranking import Ranking
from catalogue.search.exact_guides import MIN_DEAD_POINT_ANGLE, cardan, parallelograms, starts

LINE, ARC, ANY = StraightLine(1, 1e-3), CircularArc(1, 1e-3, 0.8), CircularArc(1, 1e-3)
ABOVE = (-4.0, 3.0, 5.0, 7.0)
#: Room beside the path for the crank's pivot and a rail, across the path, of a Cardan motion of diameter 2.
RAIL_TOO = (-1.0, -2.0, -0.5, 2.0)


def asked(request: Any, **wanted: Any) -> Problem:
    return Problem.of(request, Constraints(**wanted), Ranking())


@pytest.mark.parametrize("radius", [0.51, 0.6, 1.0, 5.0])
def test_parallelograms_carry_along_the_arc_itself(radius: float) -> None:
    """And no dead point is near."""
    problem = asked(CircularArc(1, 1e-3, radius), families=["four-bar"])
    made = parallelograms(problem, 12, np.random.default_rng(3))
    if radius == 0.51:
        assert made is None, "the crank would come too near to its coupler"
        return
    assert made is not None
    assert (made.deviation < 1e-14).all()
    assert (made.measures.min_transmission > np.degrees(0.95 * MIN_DEAD_POINT_ANGLE)).all()
    assert (made.origin.order == 99).all()
    # both cranks are the same vector, as long as the radius: the coupler does not turn
    cranks = made.linkage.points[:, :, 1] - made.linkage.points[:, :, 0]
    np.testing.assert_allclose(cranks[:, 0], cranks[:, 1], atol=1e-12)
    np.testing.assert_allclose(np.abs(cranks), radius, rtol=1e-12)
    centre = 0.5 - 1j * np.sqrt(radius**2 - 0.25)
    np.testing.assert_allclose(np.abs(made.point - centre), radius, rtol=1e-12)


def test_parallelograms_stand_every_way_that_dead_points_leave() -> None:
    problem = asked(CircularArc(1, 1e-3, 1.0), families=["four-bar"])
    made = parallelograms(problem, 200, np.random.default_rng(3))
    assert made is not None
    ground = made.linkage.points[:, 1, 0] - made.linkage.points[:, 0, 0]
    for side in (1, -1):
        tilt = np.degrees(np.angle(side * ground[side * ground.real > 0]))
        assert len(tilt) > 50
        assert tilt.min() < -30
        assert tilt.max() > 30
    assert made.measures.min_transmission.max() > 55  # of 60 at most: the cranks turn by 60 degrees


def test_no_parallelogram_is_made_where_both_pivots_would_stand_in_one_place() -> None:
    """As in a region farther away than any link is long, where all that is drawn stands at its limit."""
    problem = asked(ARC, pivots_in=(-1e7, -1e7, -1e7 + 1, -1e7 + 1))
    assert parallelograms(problem, 12, np.random.default_rng(3)) is None


@pytest.mark.slow
def test_an_arc_of_given_radius_is_exact_where_parallelograms_may_be(small: Catalogue) -> None:
    found = small.find(ARC, families=["four-bar"], rank_by="deviation", limit=6, max_size=3.0)
    assert found[0].deviation < 1e-14
    assert found[0].order == 99
    assert len({c.series for c in found}) > 1, "they crowd out nothing"


def test_parallelograms_of_any_radius_stand_in_the_region_asked_for() -> None:
    made = parallelograms(asked(ANY, fixed_pivots_in=(0.0, -1.0, 1.0, 1.0)), 100, np.random.default_rng(3))
    assert made is not None
    assert len(made) > 20
    assert (made.deviation < 1e-14).all()
    assert np.ptp(made.traced.fit.curvature) > 0.3, "the radii differ"
    fixed = made.linkage.points[:, :, 0]
    assert ((fixed.real >= 0) & (fixed.real <= 1) & (np.abs(fixed.imag) <= 1)).all()
    assert (made.measures.min_transmission > np.degrees(0.95 * MIN_DEAD_POINT_ANGLE)).all()


@pytest.mark.slow
@pytest.mark.parametrize("family", ["elliptic-trammel", "slider-crank"])
def test_a_circle_that_rolls_in_one_twice_as_large_carries_along_lines(naive: SimpleNamespace, family: str) -> None:
    """On the motion of loops that are closed by circles and lines."""
    made = cardan(asked(LINE), [family], 60, np.random.default_rng(4))
    assert made is not None
    assert len(made) > 20
    assert (made.deviation < 1e-14).all()
    assert (made.linkage.family == family).all()
    for pivots, point in zip(made.linkage.pivots[:8], made.point[:8], strict=True):
        path = naive.Loop(pivots.tolist(), complex(point)).over(1.0, 801)
        assert path is not None
        z = np.asarray(path).astype(complex)
        assert np.ptp(z.real) == pytest.approx(1.0, abs=1e-6)
        assert np.abs(z.imag).max() < 1e-12


@pytest.mark.parametrize(
    ("request_", "wanted", "made"),
    [
        (LINE, {}, {"elliptic-trammel", "slider-crank"}),
        (LINE, {"families": ["slider-crank", "four-bar"]}, {"slider-crank"}),
        (LINE, {"pins_only": True}, set()),
        (LINE, {"series": ["II.ooo"]}, set()),
        (ARC, {"pins_only": True}, {"four-bar"}),
        (ANY, {"families": ["slider-crank"]}, set()),
    ],
)
def test_only_exact_guides_of_the_sort_asked_for_are_made(request_: Any, wanted: Any, made: set[str]) -> None:
    found = starts(asked(request_, **wanted), 40, np.random.default_rng(5))
    assert (set() if found is None else {*found.linkage.family}) == made


@pytest.mark.slow
@pytest.mark.parametrize(
    ("request_", "wanted"),
    [
        (LINE, {"pivots_in": ABOVE}),
        (LINE, {"families": ["slider-crank"], "fixed_pivots_in": RAIL_TOO}),
        (ANY, {"pins_only": True, "fixed_pivots_in": (0.57, -0.64, 0.6, -0.36), "max_size": 1.02}),
    ],
    ids=["trammel", "slider-crank", "parallelogram"],
)
def test_the_least_deviation_is_none_where_an_exact_guide_may_stand(
    small: Catalogue, request_: Any, wanted: Any
) -> None:
    found = small.find(request_, rank_by="deviation", limit=3, **wanted)
    assert found[0].deviation < 1e-12
    assert found[1].deviation > 0  # and others beside it
