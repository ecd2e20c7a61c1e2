"""Linkages of users improved: what is held is held, what comes is better, and is what is measured of it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import catalogue
from catalogue import Catalogue, CircularArc, InvalidRequest, OwnGuide, StraightLine
from catalogue.find.improve import ImprovementTask
from catalogue.guides.placed import PlacedGuide
from catalogue.problem.constraints import Constraints
from tests.find.conftest import at_home

pytestmark = pytest.mark.slow

MINE = {"ground": 220, "crank": 100, "coupler": 250, "rocker": 250, "along": 125, "across": 80}
SLIDER = {"crank": 60, "coupler": 200, "offset": 10, "along": 260, "across": 30}
TRAMMEL = OwnGuide([[[1, 0, 0], [0, 60, 1]], [[0, 1, 0], [80, 0, 1]]], [100, -20])


@pytest.fixture(scope="module")
def mine() -> OwnGuide:
    return catalogue.guide(MINE)


@pytest.mark.parametrize(
    ("hold", "same"),
    [
        ((), ()),
        ("fixed-pivots", ("frame",)),
        (("crank 1", "crank-2", "coupler", "frame"), ("crank 1", "crank 2", "coupler", "frame")),
    ],
)
def test_what_is_held_stays_and_the_rest_becomes_better(
    mine: OwnGuide, naive: SimpleNamespace, hold: Any, same: tuple[str, ...]
) -> None:
    found = improve(mine, StraightLine(120, 0.4), hold=hold)
    before, after = found.before, found.improved
    assert found.which == ("before", "improved")
    assert after.deviation <= 0.4 < before.deviation
    assert after.score > before.score
    for name in same:
        assert after.lengths[name] == pytest.approx(mine.lengths[name], rel=1e-12)
    if "frame" in same:
        assert [pair[0] for pair in after.pivots] == [pair[0] for pair in mine.pivots]
    # measured again from its pivots, by circles that meet
    path = naive.Loop(*at_home(after)).over(after.stroke, 4801)
    assert naive.strip_of(path) == pytest.approx(after.deviation, rel=1e-6)


def improve(guide: PlacedGuide, request_: Any, **how: Any) -> Any:
    """Return what comes of a guide; typed so that what is None need not be asked of each answer."""
    return catalogue.improve(guide, request_, **how)


def carried(guide: OwnGuide, turn: complex, shift: complex, mirror: bool) -> OwnGuide:
    """Return a guide mirrored in the x axis, or not, then turned, scaled and moved."""
    z = complex(*guide.guided)
    z = turn * (z.conjugate() if mirror else z) + shift
    return OwnGuide(guide.linkage.moved(turn, shift, np.array([mirror])).pivots[0].tolist(), [z.real, z.imag])


def test_it_does_not_matter_how_the_guide_lies(mine: OwnGuide) -> None:
    """Run the other way, turned and ten times as large, or mirrored it becomes the same."""
    scores = []
    for turn, mirror in ((1, False), (10 * np.exp(2.7j), False), (1, True)):
        scale = abs(turn)
        moved = carried(mine, turn, (300 - 70j) * scale, mirror)
        found = improve(moved, StraightLine(120 * scale, 0.4 * scale), hold="fixed-pivots")
        assert found.before.deviation == pytest.approx(0.4845 * scale, rel=1e-3)
        scores.append(found.improved.score)
    assert min(scores) > 0.999 * max(scores)


@pytest.mark.parametrize("request_", [StraightLine(100, 0.5), CircularArc(100, 0.5, 150)], ids=["line", "arc"])
def test_an_answer_is_improved_from_its_own_stretch(small: Catalogue, request_: Any) -> None:
    """That is where it scores best, and seldom where it runs straightest."""
    for answer in small.find(request_, families=["four-bar"], limit=1):
        found = improve(answer, request_, hold="fixed-pivots")
        assert found.before.deviation == pytest.approx(answer.deviation, rel=1e-3)
        assert found.before.score == pytest.approx(answer.score, abs=0.01)
        assert found.improved.score >= found.before.score - 0.001


def test_the_smallest_deviation_is_sought_if_that_is_ranked(mine: OwnGuide) -> None:
    found = improve(mine, StraightLine(120, 12), hold=("crank 1", "frame"), rank_by="deviation")
    assert found.improved.deviation < 0.1 * found.before.deviation


def test_sliders_and_arcs(mine: OwnGuide) -> None:
    slider = catalogue.guide(SLIDER)
    found = improve(slider, StraightLine(50, 1), hold="fixed-pivots", rank_by="deviation")
    name = next(k for k in slider.lengths if k.startswith("offset"))
    assert found.improved.family == "slider-crank"
    assert found.improved.lengths[name] == pytest.approx(slider.lengths[name], abs=1e-9)
    assert found.improved.pivots[0][0] == slider.pivots[0][0]
    assert found.improved.deviation < found.before.deviation
    arc = improve(mine, CircularArc(120, 0.3, 180), hold="frame")
    assert arc.improved.radius == 180
    assert arc.improved.deviation <= 0.3


def test_constraints_are_met_as_measured(mine: OwnGuide) -> None:
    found = improve(mine, StraightLine(120, 0.3), hold="frame", min_transmission=60, max_size=260)
    assert found.improved.min_transmission >= 60 - 1e-6
    assert found.improved.size <= 260 * (1 + 1e-6)


@pytest.mark.parametrize("within", [0.0, 15.0])
def test_a_path_that_stays_in_place(mine: OwnGuide, within: float) -> None:
    at = mine.measure(stroke=120)[0]
    request = StraightLine(120, 0.3, (at.start[0], at.start[1]), at.along)
    found = improve(mine, request, hold="fixed-pivots", in_place=True, within=within, rank_by="deviation")
    after = found.improved
    away = [np.hypot(*np.subtract(a[0], b[0])[:2]) for a, b in zip(after.pivots, mine.pivots, strict=True)]
    assert max(away) <= within + 1e-9
    assert (after.start, after.along) == (list(request.start), request.along)
    start, direction = complex(*request.start), np.exp(1j * np.radians(request.along))
    path = (after.path(401) @ [1, 1j] - start) / direction
    assert np.abs(path.imag).max() == pytest.approx(after.deviation, rel=1e-3)


def test_the_catalogue_stands_beside_under_the_same_conditions(mine: OwnGuide, small: Catalogue) -> None:
    found = improve(mine, StraightLine(120, 0.3), hold="frame", catalogue=small)
    assert found.which[-1] == "catalogue"
    assert found.catalogue.lengths["frame"] == pytest.approx(220, rel=1e-12)
    assert found.catalogue.deviation <= 0.3
    assert found.to_pandas().shape[0] == len(found)


@pytest.mark.parametrize("bearing", [0.0, 0.7, 2.2])
@pytest.mark.parametrize("guide", [catalogue.guide(MINE), catalogue.guide(SLIDER), TRAMMEL])
def test_what_is_shown_first_is_the_guide_where_it_stands(guide: OwnGuide, bearing: float) -> None:
    """Wherever its slides point to: as it is measured in its own frame."""
    turn, shift = np.exp(1j * bearing), 30 - 20j
    moved = guide.linkage.moved(turn, shift).pivots[0]
    z = turn * complex(*guide.guided) + shift
    turned = OwnGuide(moved.tolist(), [z.real, z.imag])
    task = ImprovementTask.of(turned, StraightLine(50, 1), Constraints.of({}), (), False, 0.0, "score", 1)
    shown = task.shown(task.start()[[0]])
    seen = min(turned.measure(stroke=50), key=lambda one: np.abs(np.subtract(one.guided, shown.guided)).max())
    np.testing.assert_allclose(shown.start, seen.start, atol=1e-6)
    np.testing.assert_allclose(shown.guided, seen.guided, atol=1e-6)
    np.testing.assert_allclose(shown.pivots, seen.pivots, atol=1e-6)


def test_copies_have_the_pivots_that_are_held(mine: OwnGuide) -> None:
    at = mine.measure(stroke=120)[0]
    request = StraightLine(120, 0.3, (at.start[0], at.start[1]), at.along)
    for hold, still in (("fixed-pivots", True), ((), False)):
        task = ImprovementTask.of(mine, request, Constraints.of({}), hold, True, 0.0, "score", 1)
        start = task.start()
        copies = task.scattered(start).linkage.points
        spread = np.ptp(copies.real, axis=0) + np.ptp(copies.imag, axis=0)
        assert len(copies) > 2 * len(start)
        assert (spread[:, 1] > 0.1).all()
        assert (spread[:, 0] == 0).all() if still else (spread[:, 0] > 0.1).all()
        assert (np.abs(copies - start.linkage.points[0])[0] == 0).all()  # the first is as it was


@pytest.mark.parametrize(
    ("request_", "how", "said"),
    [
        (StraightLine(120, 1), {"hold": "crank 7"}, "nothing is called 'crank 7'"),
        (StraightLine(2000, 1), {}, "its point run forward over a stroke of 2000: ask for 252 or less"),
        (StraightLine(120, 1), {"within": 3}, "give in_place too"),
        (StraightLine(120, 1), {"fixed_pivots": [(0, 0), (1, 0)]}, "hold its own pivots"),
        (StraightLine(120, 1, (5000, 0)), {"in_place": True}, "where the request has it"),
        (CircularArc(120, 1), {"in_place": True}, "give the radius"),
        (StraightLine(120, 1), {"min_size": 3}, "min_size"),
        (StraightLine(120, 1), {"effort": 0}, "effort"),
    ],
)
def test_what_cannot_be_done_is_said(mine: OwnGuide, request_: Any, how: dict[str, Any], said: str) -> None:
    with pytest.raises(InvalidRequest, match=said):
        improve(mine, request_, **how)


def test_nothing_found_says_what_to_do(mine: OwnGuide) -> None:
    held = ("crank 1", "crank 2", "frame", "coupler", "point along", "point across")
    found = improve(mine, StraightLine(120, 1e-6), hold=held)
    assert found.which == ("before",)
    assert found.improved is None
    assert "hold less" in found.explain()
