"""Guides that stand somewhere: circuits, dead points, motions, and a candidate's motion beside its row."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import least_squares

import catalogue
from catalogue.errors import CatalogueError, InvalidLinkage, InvalidRequest
from catalogue.guides.guide_motion import GuideMotion
from catalogue.guides.own_guide import guide
from catalogue.kinematics.linkage import Linkage
from tests.draw.samples import ARC, MADE

Ask = Callable[..., catalogue.Found]
CRANK_ROCKER = {"ground": 4, "crank": 1, "coupler": 3.5, "rocker": 3, "along": 2, "across": 1}
DOUBLE_ROCKER = {"ground": 4, "crank": 2.4, "coupler": 2, "rocker": 2.4, "along": 1, "across": -1.5}


def test_a_crank_rocker_turns_on_two_circuits() -> None:
    placed = guide(CRANK_ROCKER)
    told = placed.circuits
    assert [(one.lead, one.motion, one.given) for one in told] == [
        ("crank 1", "turns", True),
        ("crank 1", "turns", False),
    ]
    assert placed.dead_points["crank 1"] == []
    # the rocker stops where crank and coupler lie on one line
    stops = [180 - math.degrees(math.acos((9 + 16 - far**2) / 24)) for far in (2.5, 4.5)]
    expected = sorted([*stops, *(360 - stop for stop in stops)])
    assert placed.dead_points["crank 2"] == pytest.approx(expected, abs=1e-7)
    assert placed.change_points == {"crank 1": [], "crank 2": []}


def test_a_double_rocker_swings_between_its_dead_points() -> None:
    placed = guide(DOUBLE_ROCKER)
    stop = math.degrees(math.acos((2.4**2 + 16 - 4.4**2) / (2 * 2.4 * 4)))  # coupler and other crank on one line
    for one in placed.circuits:
        assert one.motion == "swings"
        assert (one.low, one.high) == pytest.approx(
            (stop_of_inner(), stop) if one.low > 0 else (-stop, -stop_of_inner()) if one.high < 0 else (-stop, stop),
            abs=1e-6,
        )
    assert placed.dead_points["crank 1"] == pytest.approx(sorted([stop, 360 - stop]), abs=1e-6)


def stop_of_inner() -> float:
    return math.degrees(math.acos((2.4**2 + 16 - 0.4**2) / (2 * 2.4 * 4)))


def test_a_parallelogram_tells_its_change_points() -> None:
    placed = guide({"ground": 3, "crank": 1, "coupler": 3, "rocker": 1}, (1.0, 1.0))
    assert placed.change_points["crank 1"] == pytest.approx([0, 180])
    assert placed.dead_points == {"crank 1": [], "crank 2": []}


def test_a_motion_of_the_whole_circuit_ends_where_it_began() -> None:
    for links in (CRANK_ROCKER, DOUBLE_ROCKER):
        placed = guide(links)
        moved = placed.motion(101, points={"tip": (1.0, 2.0)})
        z = moved.points["guided"]
        assert z[0] == pytest.approx(complex(*placed.guided), abs=1e-9)
        assert z[-1] == pytest.approx(z[0], abs=1e-9)
        assert moved.points["tip"][0] == pytest.approx(1 + 2j, abs=1e-9)
        # stiff: distances of coupler points stay
        np.testing.assert_allclose(abs(z - moved.points["tip"]), abs(z[0] - (1 + 2j)), rtol=1e-12)


def test_velocities_are_differences_of_places() -> None:
    moved = guide(CRANK_ROCKER).motion(20001, driver=1)
    turned = np.radians(moved.drive)
    for name, z in moved.points.items():
        slope = np.gradient(z, turned)[1:-1]
        np.testing.assert_allclose(moved.velocities[name][1:-1], slope, atol=1e-5)
        bend = np.gradient(moved.velocities[name], turned)[1:-1]
        np.testing.assert_allclose(moved.accelerations[name][1:-1], bend, atol=1e-5)
    ratio = np.gradient(np.radians(moved.cranks[2]), turned)[1:-1]
    np.testing.assert_allclose(moved.ratios["crank 2"][1:-1], ratio, atol=1e-6)


def test_rows_in_a_dead_point_say_so() -> None:
    placed = guide(DOUBLE_ROCKER)
    turned = placed.circuits[0]
    moved = placed.motion(3601, driver=1)
    dead = moved.reason != ""
    assert set(moved.reason) <= {"", "dead point of crank 1"}
    assert np.isnan(moved.ratios["coupler"][dead]).all()
    assert np.isfinite(moved.ratios["coupler"][~dead]).all()
    assert moved.cranks[1].max() == pytest.approx(turned.high, abs=1e-3)
    assert moved.cranks[1].min() == pytest.approx(turned.low, abs=1e-3)


def test_a_motion_is_a_table_with_units() -> None:
    frame = guide(CRANK_ROCKER).motion(11).to_pandas("mm")
    assert len(frame) == 11
    assert all(name.endswith("]") or name == "reason" for name in frame.columns)
    assert "guided vx [mm/rad]" in frame.columns
    assert {"A1* x [mm]", "A2* ay [mm/rad^2]", "crank 2 ratio [1]"} <= {*frame.columns}


@pytest.mark.parametrize(
    "links",
    [
        CRANK_ROCKER,
        {"crank": 1, "coupler": 3, "offset": 0.3, "along": 1, "across": 0.5},
        {"ground": 3, "crank": 1, "offset": 0.2, "along": 1, "across": 0.5},
        {"height": 1, "offset": 0.4, "along": 1, "across": 0.5},
        {"coupler": 2, "between": 70, "along": 1, "across": 0.5},
        {"ground": 2, "between": 70, "along": 1, "across": 0.5},
    ],
    ids=lambda links: " ".join(links),
)
def test_link_lengths_make_the_linkage_that_has_them(links: dict[str, float]) -> None:
    placed = guide(links)
    lengths = placed.lengths
    assert (lengths["point along"], lengths["point across"]) == pytest.approx(
        (1 if links["along"] == 1 else 2, links["across"])
    )
    for given, told in (("crank", "crank 1"), ("rocker", "crank 2"), ("ground", "frame"), ("coupler", "coupler")):
        if given in links:
            assert lengths[told] == pytest.approx(links[given], rel=1e-12)
    if "offset" in links:
        offsets = [abs(value) for name, value in lengths.items() if name.startswith("offset")]
        assert any(value == pytest.approx(links["offset"], rel=1e-9) for value in offsets)


@pytest.mark.parametrize(
    ("make", "error"),
    [
        (lambda: guide([[[0, 0], [1, 1]], [[3, 0], [4, 2]]]), InvalidRequest),
        (lambda: guide({"ground": 4, "crank": 1, "coupler": 3.5, "rocker": 3}), InvalidRequest),
        (lambda: guide({"ground": 4, "crank": 1, "coupler": 3.5, "rocker": 3, "along": 1}), InvalidLinkage),
        (lambda: guide({"ground": 4, "crank": 1, "length": 3.5}, (0, 0)), InvalidLinkage),
        (lambda: guide({"ground": 9, "crank": 1, "coupler": 2, "rocker": 3}, (0, 0)), InvalidLinkage),
        (lambda: guide({"crank": 1, "coupler": 2, "offset": 5}, (0, 0)), InvalidLinkage),
        (lambda: guide({"coupler": 2, "between": 0}, (0, 0)), InvalidLinkage),
        (lambda: guide({"crank": [1, 2], "coupler": 3}, (0, 0)), InvalidLinkage),
        (lambda: guide(CRANK_ROCKER, (math.nan, 0)), CatalogueError),
        (lambda: guide(CRANK_ROCKER, "here"), InvalidRequest),
        (lambda: guide(CRANK_ROCKER).motion(1), InvalidRequest),
        (lambda: guide(CRANK_ROCKER).motion(driver=3), InvalidRequest),
        (lambda: guide({"crank": 1, "coupler": 3}, (1, 1)).motion(driver=2), InvalidRequest),
        (lambda: guide(CRANK_ROCKER).motion(points={"tip": 3}), InvalidRequest),
    ],
)
def test_what_cannot_be_meant_is_refused_in_one_line(make: Callable[[], object], error: type[Exception]) -> None:
    with pytest.raises(error) as caught:
        make()
    assert "\n" not in str(caught.value)
    assert str(caught.value)


WISHES = {
    "line": (catalogue.StraightLine(150.0, 0.5), {}),
    "line elsewhere": (catalogue.StraightLine(150.0, 0.5, (20.0, 15.0), 90.0), {}),
    "arc": (catalogue.CircularArc(100.0, 0.5, 150.0), {}),
    "any arc": (catalogue.CircularArc(100.0, 0.5), {}),
    "sliding": (catalogue.StraightLine(150.0, 0.5), {"families": ["slider-crank", "inverted-slider-crank"]}),
    "others": (catalogue.StraightLine(150.0, 5.0), {"families": ["elliptic-trammel", "oldham"]}),
}


@pytest.mark.slow
@pytest.mark.parametrize("wish", WISHES)
def test_the_motion_over_the_stroke_is_what_the_row_says(ask: Ask, wish: str) -> None:
    request, options = WISHES[wish]
    found = ask(request, limit=12, per_series=2, **options)
    assert len(found) > 0
    for c in found:
        moved = c.motion(721)
        z = moved.points["guided"]
        start = complex(*c.start)
        along = np.exp(1j * math.radians(c.along))
        # the path starts where the row says, but for a little of its deviation
        assert ((z - start) * along.conjugate()).real[[0, -1]] == pytest.approx([0, c.stroke], abs=0.05 * c.deviation)
        assert ((z[-1] - z[0]) * along.conjugate()).real == pytest.approx(c.stroke, rel=1e-8)
        ends = c.path(2)
        np.testing.assert_allclose([[p.real, p.imag] for p in z[[0, -1]]], ends, atol=1e-9 * c.stroke)
        # the stroke is laid about mid-stroke anew: of a path that is far off its nominal it is a little another one
        off = 1e-4 if c.deviation < 0.005 * c.stroke else 1e-3
        assert np.abs(moved.deviation).max() == pytest.approx(c.deviation, rel=off, abs=1e-9 * c.stroke)
        assert moved.transmission.min() == pytest.approx(c.min_transmission, abs=0.05)
        driven(c, moved)


@pytest.mark.parametrize("made", [*MADE.values(), ARC], ids=[*MADE, "arc"])
def test_deviations_are_distances_from_one_line_or_circle_positive_to_the_left(made: catalogue.Candidate) -> None:
    moved = made.motion(301)
    z, off = moved.points["guided"], moved.deviation
    np.testing.assert_allclose([off.max(), -off.min()], made.deviation, rtol=2e-3)
    assert z[-1].real > z[0].real
    if made.radius is None:
        left = z.imag - off  # of a line along the path, the same for all points
        np.testing.assert_allclose(left, np.polyval(np.polyfit(z.real, left, 1), z.real), atol=1e-3 * made.deviation)
        return
    bend = np.sign(np.polyfit(z.real, z.imag, 2)[0])  # 1: the centre is to the left
    radius = made.radius

    def missed(centre: Any) -> Any:
        return np.abs(z - complex(*centre)) + bend * off - radius

    fit = least_squares(missed, [50, bend * radius])
    assert np.abs(fit.fun).max() < 1e-3 * made.deviation


def test_what_is_drawn_of_a_guide_is_its_motion_over_the_stroke() -> None:
    made = MADE["four-bar"]
    drawn, closed = made.drawn_motion(9)
    np.testing.assert_array_equal(drawn.points["guided"], made.motion(9).points["guided"])
    assert not closed
    with pytest.raises(InvalidRequest, match="does not lead its guided point over a stroke of 1e"):
        replace(made, stroke=1e9).drawn_motion(9)


def test_a_guide_in_the_frame_of_its_path_is_the_same_one() -> None:
    """Laid from (0, 0) along +x: all distances stay, from the pole too."""
    made = replace(MADE["slider-crank"], pole=[12.0, -7.0, 1.0])
    z = np.exp(0.4j) * np.array([complex(*made.pivots[0][0][:2]), complex(*made.guided), 12 - 7j]) + (30 - 20j)
    pivots = Linkage(made.pivots).moved(np.exp(0.4j), 30 - 20j).pivots[0].tolist()
    there = replace(
        made, pivots=pivots, guided=[z[1].real, z[1].imag], pole=[z[2].real, z[2].imag, 1.0],
        start=[30.0, -20.0], along=float(np.degrees(0.4)),
    )  # fmt: skip
    home = there.at_home()
    assert home.at_home() is home
    np.testing.assert_allclose(home.pivots, made.pivots, atol=1e-9)
    np.testing.assert_allclose(home.guided, made.guided, atol=1e-9)
    assert home.pole
    np.testing.assert_allclose(home.pole[:2], [12, -7], atol=1e-9)


def driven(c: catalogue.Candidate, moved: GuideMotion) -> None:
    """Check what depends on the crank that drives."""
    if c.driver is None:
        return
    assert moved.driver == c.driver
    if c.drive_angle is not None:
        assert np.ptp(moved.drive) == pytest.approx(c.drive_angle, rel=5e-3)
    if c.advantage is not None:
        assert np.nanmin(moved.advantage) == pytest.approx(c.advantage, rel=1e-2)


def test_a_length_that_is_rounding_is_nought() -> None:
    links = {"crank": 123.456789, "ground": 246.913578, "coupler": 308.641972, "rocker": 308.641972}
    for along, across in ((617.283945, 0), (0, 617.283945), (617.283945, 1e-6)):
        told = catalogue.guide(links | {"along": along, "across": across}).lengths
        assert told["point across"] == (pytest.approx(across, rel=1e-6) if across else 0)
        assert told["point along"] == (pytest.approx(along) if along else 0)


def test_figures_of_a_crank_are_empty_where_the_coupler_drives() -> None:
    """With the reason; the ratios are over the coupler's angle."""
    placed = guide({"ground": 4, "crank": 2, "coupler": 3, "rocker": 3, "angle": 60}, (1.0, 2.0))
    moved, led = placed.motion(37, driver=0), placed.motion(37, driver=1)
    assert np.isnan(moved.transmission).all()
    assert np.isnan(moved.advantage).all()
    assert all("coupler drives" in reason or "dead point" in reason for reason in moved.reason)
    assert np.isfinite(led.transmission).all()
    free = np.isfinite(moved.ratios["crank 1"]) & np.isfinite(led.ratios["coupler"])
    assert free.sum() > 20
    np.testing.assert_allclose(moved.ratios["coupler"][free], 1.0)
    np.testing.assert_allclose(moved.ratios["crank 1"][free] * led.ratios["coupler"][free], 1.0, rtol=1e-9)
