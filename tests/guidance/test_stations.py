"""Machines at stations along the nominal stand where loops closed in another way put them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from catalogue import Catalogue, CircularArc, StraightLine
from catalogue.guidance.minimum_zone import grid
from catalogue.guidance.sensitivity import displaced
from catalogue.guidance.stations import STATION, Stationed, nominal
from catalogue.kinematics.linkage import Linkage
from tests.refine.starts import problem_of, started

LINE, ARC, ANY = StraightLine(1, 5e-3), CircularArc(1, 5e-3, 0.9), CircularArc(1, 5e-3)
FAMILIES = ("four-bar", "slider-crank", "inverted-slider-crank", "elliptic-trammel")


def stationed(small: Catalogue, request: Any, family: str, count: int = 12) -> tuple[Stationed, Any]:
    problem = problem_of(request, families=[family])
    found = started(small, problem, count)
    bend = problem.curvature
    curvature = -np.abs(found.traced.fit.curvature.astype(float)) if bend is None else np.full(len(found), float(bend))
    return Stationed.followed(found.linkage, found.point, curvature), found


@pytest.mark.parametrize("curvature", [0.0, -1e-7, -0.3, -1.99])
def test_a_nominal_has_its_chord_and_its_curvature(curvature: float) -> None:
    place, tangent = nominal(np.array([curvature]))
    np.testing.assert_allclose(place[[0, -1], 0], [0, 1], atol=1e-15)
    np.testing.assert_allclose(np.abs(tangent), 1, atol=1e-15)
    if curvature:
        centre = place + 1j * tangent / curvature
        np.testing.assert_allclose(np.abs(centre - centre[0]) * -curvature, 0, atol=1e-12)
    else:
        np.testing.assert_allclose(place[:, 0], 0.5 + 0.5 * grid(STATION.intervals).nodes, atol=1e-15)
        np.testing.assert_array_equal(tangent, 1)


@pytest.mark.slow
@pytest.mark.parametrize("request_", [LINE, ARC, ANY], ids=["line", "arc", "any arc"])
@pytest.mark.parametrize("family", FAMILIES)
def test_the_guided_point_stands_at_every_station(small: Catalogue, request_: Any, family: str) -> None:
    """Both dyads keep their lengths, sliders their lines, and the foot on the nominal is the station."""
    there, _ = stationed(small, request_, family)
    assert there.reached.mean() > 0.7
    there = there[np.flatnonzero(there.reached)]
    place, tangent = nominal(there.curvature)
    pose, z = there.pose, there.linkage.points
    point = pose.point(there.point)
    np.testing.assert_allclose(((point - place) * tangent.conj()).real, 0, atol=1e-12)
    np.testing.assert_allclose(((point - place) * tangent.conj()).imag, there.error.T, atol=1e-12)
    for i in (0, 1):
        fixed, moving = there.linkage.finite[:, i].T
        moved = pose.point(z[:, i, 1])
        length = np.abs(moved - z[:, i, 0]) - np.abs(z[:, i, 1] - z[:, i, 0])
        np.testing.assert_allclose(length[:, fixed & moving], 0, atol=1e-9)
        rail = ((moved - z[:, i, 1]) * z[:, i, 0].conj()).real  # across the normal of the rail
        np.testing.assert_allclose(rail[:, ~fixed], 0, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("request_", [LINE, ARC], ids=["line", "arc"])
def test_the_largest_distance_is_about_the_deviation(small: Catalogue, request_: Any) -> None:
    there, found = stationed(small, request_, "four-bar", 24)
    good = np.flatnonzero(there.reached)
    laid = there[good].laid(any_radius=False)
    ratio = laid.deviation / found.deviation[good]
    assert (ratio > 0.9).all()  # stations miss peaks between them
    assert np.median(ratio) < 1.2


@pytest.mark.slow
@pytest.mark.parametrize("request_", [LINE, ARC, ANY], ids=["line", "arc", "any arc"])
def test_a_machine_moved_across_its_path_is_laid_where_it_was(small: Catalogue, request_: Any) -> None:
    """To move a machine across, and to turn it about the middle of a line, changes no design: its errors return."""
    there, _ = stationed(small, request_, "four-bar")
    for _ in range(4):
        there = there[np.flatnonzero(there.reached)].laid(any_radius=request_ is ANY)
    factor = np.exp(0.01j) if request_ is LINE else 1.0
    shift = 0.5 - 0.5 * factor + 0.02j
    moved = Stationed.settled(
        there.linkage.moved(factor, shift), factor * there.point + shift, there.curvature, there.error, there.angle
    )  # fmt: skip
    assert (moved.deviation > 0.01).all()
    for _ in range(4):
        moved = moved.laid(any_radius=request_ is ANY)
    good = moved.reached & there.reached
    assert good.mean() > 0.7
    within = 0.4 if request_ is ANY else 0.1  # of any radius it is another piece of the path
    np.testing.assert_allclose(moved.deviation[good], there.deviation[good], rtol=within, atol=2e-5)


@pytest.mark.slow
def test_denser_stations_hold_those_that_were(small: Catalogue) -> None:
    there, _ = stationed(small, LINE, "four-bar")
    there = there[np.flatnonzero(there.reached)]
    denser = there.denser()
    assert denser.intervals == 2 * there.intervals
    assert denser.reached.all()
    np.testing.assert_allclose(denser.error[:, ::2], there.error, atol=1e-12)
    np.testing.assert_allclose(denser.angle[:, ::2], there.angle, atol=1e-12)
    assert (denser.deviation >= there.deviation - 1e-15).all()


@pytest.mark.slow
def test_slopes_are_those_of_the_finite_motion(small: Catalogue) -> None:
    there, _ = stationed(small, LINE, "four-bar")
    there = there[np.flatnonzero(there.reached)]
    across, h = there.jacobian.across, 1e-6
    for k in range(10):
        low, high = (
            Stationed.settled(
                *displaced(there.linkage, there.point, np.tile(step * np.eye(10)[k], (len(there), 1)))[:2],
                there.curvature, there.error, there.angle,
            )
            for step in (-h, h)
        )  # fmt: skip
        np.testing.assert_allclose(across[..., k].T, (high.error - low.error) / (2 * h), atol=2e-4, rtol=1e-4)


def test_a_machine_that_reaches_too_short_reaches_no_station(random_linkages: Callable[..., Linkage]) -> None:
    linkage = random_linkages("four-bar", 50, 5)
    short = Linkage(np.concatenate([0.05 * linkage.pivots[..., :2], linkage.pivots[..., 2:]], axis=-1))
    there = Stationed.followed(short, np.full(50, 0.5 + 0j), np.zeros(50))
    assert not there.reached.any()


@pytest.mark.slow
def test_by_curvature_is_the_difference(small: Catalogue) -> None:
    there, _ = stationed(small, ANY, "four-bar")
    there = there[np.flatnonzero(there.reached)]
    h = 1e-6
    low, high = (
        Stationed.settled(there.linkage, there.point, there.curvature + s * h, there.error, there.angle)
        for s in (-1, 1)
    )
    good = low.reached & high.reached
    difference = (high.error - low.error) / (2 * h)
    # the station runs along too: to first order that changes the distance by the slope of the error
    np.testing.assert_allclose(there.by_curvature[good], difference[good], atol=0.05)
