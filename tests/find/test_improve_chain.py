"""Mechanisms of many bars refined from where they are: straighter, held, within bounds, measured anew."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from catalogue import CircularArc, InvalidRequest, StraightLine, improve, mechanism
from tests.chains.known import BICYCLE, CHEBYSHEV, JANSEN, KLANN, PEAUCELLIER


def deviation(one: Any, stroke: float) -> float:
    """Return half the width of the narrowest strip about the path: it lies along a side of the hull."""
    z = one.motion(2001).points[one.point]
    assert abs(z[-1] - z[0]) == pytest.approx(stroke, rel=1e-3)
    corners = z[ConvexHull(np.stack([z.real, z.imag], 1)).vertices]
    way = np.roll(corners, -1) - corners
    off = (z * (way / abs(way)).conj()[:, None]).imag
    return float(0.5 * np.ptp(off, axis=1).min())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("given", "stroke", "share"), [(CHEBYSHEV, 3, 0.1), (BICYCLE, 80, 0.3)], ids=["lambda", "bike"]
)
def test_a_mechanism_gets_straighter_with_its_fixed_pivots_held(
    given: dict[str, Any], stroke: float, share: float
) -> None:
    mine = mechanism(given)
    found = mine.improve(StraightLine(stroke, 0.01 * stroke), hold="fixed-pivots")
    before, after = found.before, found.improved
    assert after is not None
    assert found.which == ("before", "improved")
    assert after.deviation < share * before.deviation
    assert after.deviation == pytest.approx(deviation(after, stroke), rel=1e-2)
    assert after.size <= 1.1 * before.size
    for joint in given["bars"]["frame"]:
        assert after.joints[joint] == mine.joints[joint]
    assert after.bars == mine.bars
    assert after.name == mine.name


@pytest.mark.slow
def test_bounds_on_size_and_transmission_are_kept() -> None:
    mine = mechanism(KLANN)
    found = mine.improve(StraightLine(30, 0.3), hold="fixed-pivots", max_size=128.0, min_transmission=40.0)
    assert found.improved is not None
    assert found.improved.size <= 128 < found.before.size
    assert found.improved.min_transmission >= 40
    none = mine.improve(StraightLine(30, 0.3), hold=[*mine.joints][:-1], max_size=31.0)
    assert none.improved is None
    assert none.which == ("before",)
    assert "no way found to improve it within these bounds" in none.explain()


@pytest.mark.slow
def test_joints_are_held_by_name_and_a_stretch_is_improved_over_itself() -> None:
    best = mechanism(KLANN).measure(stroke=30)[1]
    held = [joint for joint in best.joints if joint not in ("foot", "F")]
    found = best.improve(StraightLine(best.stroke, 1.0), hold=held)
    assert found.before is best
    assert found.improved is not None
    assert found.improved.deviation < best.deviation
    assert all(found.improved.joints[joint] == best.joints[joint] for joint in held)


@pytest.mark.slow
def test_units_are_those_of_the_request() -> None:
    mine = mechanism(PEAUCELLIER, unit="mm")
    found = mine.improve(StraightLine(3 / 25.4, 0.01, unit="in"))
    assert found.before.unit == "in"
    assert found.before.lengths["OB O B"] * 25.4 == pytest.approx(5)
    assert found.before.stroke * 25.4 == pytest.approx(3)


@pytest.mark.slow
def test_an_arc_of_a_radius_is_approached() -> None:
    found = mechanism(JANSEN).improve(CircularArc(60, 1, 100), hold="fixed-pivots")
    assert found.improved is not None
    assert found.improved.radius == 100
    assert found.improved.deviation < 0.9 * found.before.deviation


@pytest.mark.slow
def test_other_bounds_and_rankings_are_kept() -> None:
    mine = mechanism(KLANN)
    found = mine.improve(
        StraightLine(30, 0.5), rank_by="min_transmission", max_size=120, max_link=60, min_uniformity=0.3
    )
    assert found.improved is not None
    better = found.improved
    assert better.min_transmission > 1.5 * found.before.min_transmission
    assert better.deviation <= 0.5
    assert better.size <= 120
    moving = [bar for name, bar in better.bars.items() if name != "frame"]
    pins = {name for bar in better.bars.values() for name in bar if sum(name in b for b in better.bars.values()) > 1}
    apart = [
        np.hypot(*(np.array(better.joints[one]) - better.joints[other]))
        for bar in moving
        for one in {*bar} & pins
        for other in {*bar} & pins
    ]
    assert max(apart) <= 60
    smaller = mine.improve(StraightLine(30, 2), rank_by="size")
    assert smaller.improved is not None
    assert smaller.improved.size < 0.8 * smaller.before.size


@pytest.mark.slow
def test_joints_move_into_a_region() -> None:
    mine = mechanism(KLANN)
    low, high = (np.array([*mine.joints.values()]).min(0), np.array([*mine.joints.values()]).max(0))
    fixed = np.array([mine.joints[name] for name in mine.bars["frame"]])
    inner = np.array([4, 2])
    box = (*(fixed.min(0) + inner), *(fixed.max(0) - inner))  # a pivot leaves its place for it
    assert (fixed < box[:2]).any()
    found = mine.improve(StraightLine(30, 0.3), fixed_pivots_in=box, max_size=2 * np.hypot(*(high - low)))
    assert found.improved is not None
    there = np.array([found.improved.joints[name] for name in mine.bars["frame"]])
    assert (there >= np.array(box[:2]) - 1e-6).all()
    assert (there <= np.array(box[2:]) + 1e-6).all()
    assert found.improved.deviation < 0.3


@pytest.mark.slow
def test_a_stroke_over_a_dead_point_of_the_drive_is_told() -> None:
    found = mechanism({**CHEBYSHEV, "drive": "rocker"}).improve(StraightLine(4.5, 0.05))
    assert found.improved is None
    assert "its drive passes a dead point on the stroke" in found.explain()


@pytest.mark.slow
def test_a_stretch_on_the_way_back_of_the_drive_is_improved() -> None:
    """The drive turns round between the given pose and the stretch: the pose closes in another way there."""
    mine = mechanism({**BICYCLE, "drive": "body"})
    last = mine.measure(stroke=60)[2]
    found = last.improve(StraightLine(60, 2), hold="fixed-pivots")
    assert found.before.joints == last.joints
    assert found.before.deviation == last.deviation
    assert found.improved is not None
    assert found.improved.deviation < 0.5 * last.deviation


def test_an_exact_mechanism_is_not_improved() -> None:
    found = mechanism(PEAUCELLIER).improve(StraightLine(3, 0.01))
    assert found.improved is None
    assert found.before.deviation < 1e-13


@pytest.mark.slow
def test_what_cannot_be_meant_is_refused() -> None:
    mine = mechanism(JANSEN)
    line = StraightLine(30, 0.3)
    with pytest.raises(InvalidRequest, match="all joints are held"):
        mine.improve(line, hold=list(mine.joints))
    with pytest.raises(InvalidRequest, match="does its point run forward over a stroke of 500"):
        mine.improve(StraightLine(500, 1))
    with pytest.raises(InvalidRequest, match="a mechanism of many bars has `improve` itself"):
        improve(mine, line)  # type: ignore[arg-type]  # a user's mistake
    with pytest.raises(InvalidRequest, match="unknown constraint: 'max_sise'; did you mean max_size"):
        mine.improve(line, max_sise=3)
