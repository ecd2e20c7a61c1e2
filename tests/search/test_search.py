"""A search ends, keeps what it says, and never loses what it has."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from catalogue import Catalogue, CircularArc, StraightLine
from catalogue.candidates.batch import CandidateBatch
from catalogue.candidates.feasibility import cost, feasibility
from catalogue.kinematics.types import Floats, Mask
from catalogue.problem.constraints import Constraints
from catalogue.problem.problem import Problem
from catalogue.problem.ranking import Ranking
from catalogue.refine.sqp import Refinement
from catalogue.search import search, starts
from catalogue.search.search import Search
from catalogue.search.starts import Starts

LINE, ARC = StraightLine(1, 1e-3), CircularArc(1, 1e-3, 1.5)


def asked(request: Any, rank_by: Any = "score", **wanted: Any) -> Problem:
    return Problem.of(request, Constraints(**wanted), Ranking.of(request, rank_by))


@pytest.mark.slow
@pytest.mark.parametrize("request_", [LINE, ARC], ids=["line", "arc"])
def test_what_a_search_says_to_be_good_is(small: Catalogue, request_: Any) -> None:
    problem = asked(request_, families=["four-bar"], max_size=4.0, min_transmission=40)
    done = Search(problem, small.database).run()
    assert done.status == "found"
    assert done.found is not None
    good = np.isfinite(done.cost)
    assert good.sum() >= 6
    np.testing.assert_array_equal(feasibility(problem, done.found).all[good], True)
    np.testing.assert_allclose(done.cost[good], cost(problem, done.found)[good], rtol=1e-12)
    assert set(done.found.linkage.family) == {"four-bar"}
    assert done.report.measured > 0
    assert done.report.refined > 0
    assert done.report.seconds.keys() == {"starts", "refine"}


@pytest.mark.slow
def test_refinement_does_better_than_what_is_stored(small: Catalogue) -> None:
    problem = asked(LINE, "size", families=["four-bar"], min_transmission=40)
    stored, refined = (Search(problem, small.database, refines=yes).run() for yes in (False, True))
    best, before = (np.sort(done.cost)[:6] for done in (refined, stored))
    assert (best <= before).all()
    assert best.mean() < before.mean() - 0.05


@pytest.mark.slow
@pytest.mark.parametrize("effort", [1, 3])
def test_without_refinement_guides_are_as_they_are_stored(small: Catalogue, effort: int) -> None:
    found = small.find(LINE, families=["four-bar"], max_size=6.0, limit=60, effort=effort, refine=False, distinct=0)
    kept = [(one, one.id) for one in found if one.id is not None]  # others are made to measure
    assert len(kept) > 5
    for one, number in kept:
        links, stored = (
            np.sort([length for name, length in guide.lengths.items() if not name.startswith("point")])
            for guide in (one, small.guide(number).at(1.0))
        )
        np.testing.assert_allclose(links / links[0], stored / stored[0], rtol=1e-9)


@pytest.mark.slow
def test_a_further_stage_never_loses_the_best(small: Catalogue) -> None:
    problem = asked(LINE, "deviation", families=["four-bar"], max_size=3.0, min_transmission=45)
    one, best, count = Search(problem, small.database, enough=100), np.inf, 0
    while one.status == "searching" and one.stage < 3:
        one.step()
        assert len(one.cost) > count, "each stage tries something"
        count = len(one.cost)
        assert one.cost.min() <= best
        best = one.cost.min()
    assert np.isfinite(best)


@pytest.mark.slow
def test_the_same_problem_is_searched_in_the_same_way(small: Catalogue, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(starts, "CONSTRAINED", replace(starts.CONSTRAINED, points=300))
    problem = asked(LINE, "size", families=["four-bar"], fixed_pivots_in=(-0.5, 0.1, 1.5, 1.5))
    one, other = (Search(problem, small.database).run() for _ in range(2))
    assert one.found is not None
    assert other.found is not None
    np.testing.assert_array_equal(one.found.linkage.pivots, other.found.linkage.pivots)
    np.testing.assert_array_equal(one.cost, other.cost)


EASY = {"families": ["four-bar"], "max_size": 4.0, "min_transmission": 40}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("request_", "wanted"),
    [
        (StraightLine(1, 1e-3), EASY),
        (StraightLine(1, 3e-4), {"pins_only": True, "fixed_pivots_in": (-2, -2, 3, 3)}),
        (CircularArc(1, 1e-3, 1.5), {"min_transmission": 40, "fixed_pivots_in": (-2, -2, 3, 3)}),
    ],
)
def test_a_few_starts_are_enough_where_no_answer_can_be_much_better(
    small: Catalogue, request_: Any, wanted: dict[str, Any]
) -> None:
    """The list is full, its best is within the gap of the cheapest that there can be, and a whole search finds none
    that is much better."""
    problem = replace(asked(request_, **wanted), limit=6)
    quick, whole = (Search(replace(problem, effort=effort), small.database).run() for effort in (1, 2))
    assert quick.status == "found"
    assert np.isfinite(quick.cost).sum() >= 6
    assert 0 < quick.report.refined < 0.3 * whole.report.refined
    assert 0 <= whole.cost.min() <= quick.cost.min() <= search.GAP


@pytest.mark.parametrize(
    ("request_", "wanted", "rank_by"),
    [
        (LINE, EASY, "size"),  # how small a guide can be is not known
        (LINE, {**EASY, "max_size": 1.5}, "score"),  # few are so small
        (StraightLine(1, 1e-5), {"min_transmission": 40, "full_rotation": True}, "score"),  # the best is not that good
    ],
)
def test_a_few_starts_are_not_enough_elsewhere(
    small: Catalogue, request_: Any, wanted: dict[str, Any], rank_by: str
) -> None:
    done = Search(asked(request_, rank_by, **wanted), small.database)
    done._try_few()
    assert done.status == "searching"


@pytest.mark.parametrize(
    ("rank_by", "before", "after", "gained"),
    [
        ("score", 0.02, 0.0175, False),  # a quarter of a point
        ("score", 0.02, 0.0165, True),
        ("size", 2.0, 1.995, False),
        ("size", 2.0, 1.993, True),
        ("deviation", 1e-6, 0.998e-6, False),
        ("deviation", 1e-6, 0.996e-6, True),
        ("size", np.inf, 9.0, True),
        ("size", np.inf, np.inf, False),
    ],
)
def test_a_gain_is_a_part_of_the_cost_or_of_one(
    small: Catalogue, rank_by: str, before: float, after: float, gained: bool
) -> None:
    done = Search(asked(LINE, rank_by), small.database)
    done.cost = np.array([after, 3 + after])
    assert done._gained(before) == gained


@pytest.mark.slow
def test_a_search_for_the_impossible_ends(small: Catalogue, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(starts, "SCORED", replace(starts.SCORED, in_vain=600))
    problem = asked(StraightLine(1, 1e-9), families=["four-bar"], max_size=1.05, min_transmission=60)
    done = Search(problem, small.database).run()
    assert done.status == "exhausted"
    assert not np.isfinite(done.cost).any()
    assert done.found is not None


@pytest.mark.slow
def test_a_search_ends_when_its_points_are_spent(small: Catalogue, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(starts, "SCORED", replace(starts.SCORED, in_vain=1))
    problem = asked(StraightLine(1, 1e-9), families=["four-bar"], max_size=1.05, min_transmission=60)
    done = Search(problem, small.database).run()
    assert done.status == "exhausted"
    assert done.stage == 3, "starts made to measure are tried in any case"


@pytest.mark.slow
def test_what_came_nearest_is_refined_once_more(small: Catalogue, monkeypatch: pytest.MonkeyPatch) -> None:
    """It comes nearer, or meets the constraints, if it was not at rest; and nothing that was found is lost."""
    monkeypatch.setattr(starts, "SCORED", replace(starts.SCORED, in_vain=1))
    nearer = []
    for deviation, wanted in (
        (1e-4, {"fixed_pivots_in": (0, 0.2, 0.6, 0.6), "max_size": 1.4}),
        (3e-5, {"min_transmission": 60, "max_size": 1.6}),
        (1e-5, {"min_transmission": 50, "max_size": 2.0}),
    ):
        problem = asked(StraightLine(1, deviation), pins_only=True, **wanted)
        count, least = [], []
        for insists in (False, True):
            with monkeypatch.context() as patched:
                if not insists:
                    patched.setattr(Search, "_refine_nearest", lambda *_: None)
                done = Search(problem, small.database).run()
            assert done.found is not None
            assert len(done.cost) == len(done.found)
            count.append(len(done.cost))
            least.append(float(np.nanmin(feasibility(problem, done.found).total)))
        assert 0 < count[1] - count[0] <= search.NEAREST
        nearer.append(least[0] - least[1])
    assert min(nearer) >= 0
    assert max(nearer) > 1e-6


@pytest.mark.slow
def test_where_nothing_is_found_only_the_nearest_are_followed_to_the_end(
    small: Catalogue, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Halfway those go on that break the constraints least, and those that are nearest are led in."""
    monkeypatch.setattr(starts, "SCORED", replace(starts.SCORED, in_vain=1))
    problem = asked(StraightLine(1, 1e-5), pins_only=True, pivots_in=(-0.2, 0.0, 1.2, 0.6))
    rounds: list[tuple[Mask, Floats]] = []
    led: list[Floats] = []
    step, restore = Refinement.step, Search._restore_feasibility

    def watched(refinement: Refinement, *args: Any) -> bool:
        rounds.append((refinement.active.copy(), refinement.nearest.copy()))
        return step(refinement, *args)

    def leading(one: Search, near: CandidateBatch, hasty: bool) -> tuple[CandidateBatch, Floats]:
        led.append(feasibility(problem, near).total)
        return restore(one, near, hasty)

    monkeypatch.setattr(Refinement, "step", watched)
    monkeypatch.setattr(Search, "_restore_feasibility", leading)
    monkeypatch.setattr(Search, "_refine_nearest", lambda *_: None)
    monkeypatch.setattr(Search, "_race", lambda *_: None)
    done = Search(problem, small.database)
    done.step()
    assert done.status == "exhausted"
    assert not np.isfinite(done.cost).any()
    half = 2 + search.MORE_ROUNDS // 2
    (before, _), (after, nearest) = rounds[half - 1 : half + 1]
    assert before.sum() > search.LED >= after.sum() > 0, "fewer go on from halfway"
    assert (nearest < nearest[after].max()).sum() < search.LED, "the nearest"
    assert len(led) == 1
    assert done.found is not None
    broken = np.sort(feasibility(problem, done.found).total)
    assert 0 < len(led[0]) <= search.LED
    assert led[0].max() < search.NEAR
    assert broken[0] <= led[0].min()


HARD: list[Any] = [
    (
        StraightLine(1, 0.00191767),
        {
            "pins_only": True,
            "full_rotation": True,
            "max_size": 2.83543,
            "min_transmission": 68.8032,
            "min_link": 1.60621,
        },
    ),
    (
        StraightLine(40, 0.00206116),
        {"families": ["four-bar"], "min_uniformity": 0.899745, "max_drive_angle": 33.6432, "max_size": 78.0341},
    ),
]


@pytest.mark.slow
@pytest.mark.parametrize(("request_", "wanted"), HARD, ids=["full rotation", "drive"])
def test_a_race_answers_what_is_denied_without(
    small: Catalogue, monkeypatch: pytest.MonkeyPatch, request_: Any, wanted: dict[str, Any]
) -> None:
    """Two requests of the benchmark, each made of a linkage that an independent search knows."""
    found = small.find(request_, **wanted, rank_by="transmission", limit=1)
    assert len(found) == 1
    assert found[0].deviation <= request_.deviation
    assert found[0].size <= wanted["max_size"]
    monkeypatch.setattr(Search, "_race", lambda *_: None)
    assert not small.find(request_, **wanted, rank_by="transmission", limit=1)


@pytest.mark.slow
def test_near_a_candidate_few_starts_are_refined_and_it_is_found_again(small: Catalogue) -> None:
    """Those that are most like it lead to an answer hardly dearer, with less than a third of the points."""
    problem = asked(LINE, "size", families=["four-bar"], fixed_pivots_in=(-0.5, 0.1, 1.5, 1.5), min_transmission=40)
    whole = Search(problem, small.database)
    whole.step()
    assert whole.found is not None
    best = int(np.argmin(whole.cost))
    near = Search(problem, small.database)
    answers = near.answers_near(whole.found[np.array([best])])
    assert answers is not None
    assert near.report.refined < 0.3 * whole.report.refined
    assert near.cost.min() <= 1.1 * whole.cost[best]
    assert len(answers) == np.isfinite(near.cost).sum()


@pytest.mark.parametrize("stored", [True, False], ids=["that do not reach over the path", "of another family"])
def test_where_no_stored_start_is_any_good_nothing_is_found_near(
    small: Catalogue, monkeypatch: pytest.MonkeyPatch, stored: bool
) -> None:
    problem = asked(LINE, "size", families=["four-bar"] if stored else ["oldham"])
    near = Search(asked(LINE, families=["four-bar"]), small.database).starts.gathered(0, 1, None)
    assert near is not None
    monkeypatch.setattr(Starts, "_merits", lambda _, some: np.full(len(some), np.inf))
    search_ = Search(problem, small.database)
    assert search_.answers_near(near[np.array([0])]) is None
    assert search_.report.refined == 0
    assert (search_.report.measured > 0) == stored
