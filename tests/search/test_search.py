"""A search ends, keeps what it says, and never loses what it has."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from catalogue import Catalogue, CircularArc, StraightLine
from catalogue.candidates.feasibility import cost, feasibility
from catalogue.problem.constraints import Constraints
from catalogue.problem.problem import Problem
from catalogue.problem.ranking import Ranking
from catalogue.search import search
from catalogue.search.search import BUDGET, Search
from catalogue.search.starts import Starts

pytestmark = pytest.mark.slow

LINE, ARC = StraightLine(1, 1e-3), CircularArc(1, 1e-3, 1.5)


def asked(request: Any, rank_by: Any = "score", **wanted: Any) -> Problem:
    return Problem.of(request, Constraints(**wanted), Ranking.of(request, rank_by))


@pytest.mark.parametrize("request_", [LINE, ARC], ids=["line", "arc"])
def test_what_a_search_says_to_be_good_is(small: Catalogue, request_: Any) -> None:
    problem = asked(request_, families=["four-bar"], max_size=4.0, min_transmission=40)
    done = Search(problem, small.database).run()
    assert done.status in ("found", "good enough", "no gain")
    assert done.found is not None
    good = np.isfinite(done.cost)
    assert good.sum() >= 6
    np.testing.assert_array_equal(feasibility(problem, done.found).all[good], True)
    np.testing.assert_allclose(done.cost[good], cost(problem, done.found)[good], rtol=1e-12)
    assert set(done.found.linkage.family) == {"four-bar"}
    assert done.report.measured > 0
    assert done.report.refined > 0
    assert done.report.seconds.keys() <= {"starts", "race", "refine"}


def test_refinement_does_better_than_what_is_stored(small: Catalogue) -> None:
    problem = asked(LINE, "size", families=["four-bar"], min_transmission=40)
    stored, refined = (Search(problem, small.database, refines=yes).run() for yes in (False, True))
    best, before = (np.sort(done.cost)[:6] for done in (refined, stored))
    assert (best <= before).all()
    assert best.mean() < before.mean() - 0.05


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


@pytest.mark.parametrize("rank_by", ["size", "score"])
def test_a_further_phase_never_loses_the_best(small: Catalogue, rank_by: str) -> None:
    """Lists only improve: whoever looks early sees answers, and later none that are worse."""
    problem = asked(LINE, rank_by, families=["four-bar"], max_size=3.0, min_transmission=45)
    one, best, lists = Search(problem, small.database), np.inf, []
    while one.status == "searching":
        one.step()
        least = float(one.cost.min(initial=np.inf))
        assert least <= best
        best = least
        lists.append(best)
    assert np.isfinite(best)
    assert len(lists) > (2 if rank_by == "deviation" else 0), "others may be good enough at once"


@pytest.mark.slow
def test_a_full_list_from_a_tighter_problem_is_hopped_from_and_only_improves(
    small: Catalogue, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Broad phases are left to the tighter problem; with too short a list they are run."""
    wanted: dict[str, Any] = {"families": ["four-bar"], "min_transmission": 40}
    weights = {"size": 1.0, "transmission": 1.0}
    tight = Search(asked(LINE, weights, **wanted), small.database).run()
    assert tight.found is not None
    good = tight.found[np.flatnonzero(np.isfinite(tight.cost))]
    gathered: list[int] = []
    broad = Starts.broad

    def counted(starts: Starts, number: int, *rest: Any) -> Any:
        gathered.append(number)
        return broad(starts, number, *rest)

    monkeypatch.setattr(Starts, "broad", counted)
    looser = asked(replace(LINE, deviation=2e-3), weights, **wanted)
    done = Search(replace(looser, limit=6), small.database, given=good, warm=True).run()
    assert (done.status, gathered) == ("no gain", [])
    assert done._least <= cost(looser, good).min()
    Search(replace(looser, limit=60), small.database, given=good[:1], warm=True).run()
    assert gathered


@pytest.mark.slow
def test_without_constraints_a_search_goes_on_while_the_best_is_no_limit(small: Catalogue) -> None:
    """The first phase ends at a size of 1.230 strokes, later ones at 1.214; no guide is smaller than its stroke."""
    problem = asked(StraightLine(1, 1 / 3000), "size", families=["four-bar"])
    search = Search(problem, small.database)
    while not search.broad:
        search.step()
    first = search.cost.min()
    assert first > problem.ranking.good
    assert search.status == "searching"
    search.run()
    assert search.cost.min() < 1.215 < first


@pytest.mark.slow
@pytest.mark.parametrize(("size", "effort"), [(160.0, 1), (165.1, 0), (175.0, 1)])
def test_a_tolerance_that_few_guides_keep_is_answered(small: Catalogue, size: float, effort: int) -> None:
    """Their links are shorter than a tenth of the stroke, and refinement from elsewhere ends at 1.5 tolerances."""
    assert small.find(StraightLine(150, 0.05), families=["four-bar"], max_size=size, limit=1, effort=effort)


def test_the_same_problem_is_searched_in_the_same_way(small: Catalogue) -> None:
    problem = asked(LINE, "size", families=["four-bar"], fixed_pivots_in=(-0.5, 0.1, 1.5, 1.5))
    budget = replace(BUDGET, hops=1)
    one, other = (Search(problem, small.database, budget=budget).run() for _ in range(2))
    assert one.found is not None
    assert other.found is not None
    np.testing.assert_array_equal(one.found.linkage.pivots, other.found.linkage.pivots)
    np.testing.assert_array_equal(one.cost, other.cost)


@pytest.mark.parametrize(
    ("deviation", "rank_by", "wanted"),
    [
        (1e-4, "transmission", {"pins_only": True, "fixed_pivots_in": (-0.3, -1.5, 1.3, -0.1)}),
        (1e-3, "balance", {"families": ["slider-crank"], "max_size": 2.2}),
    ],
)
def test_a_race_finds_what_refinement_alone_finds_with_fewer_programmes(
    small: Catalogue, monkeypatch: pytest.MonkeyPatch, deviation: float, rank_by: str, wanted: dict[str, Any]
) -> None:
    """The same programmes, from all starts instead of the leaders of a race: about as good, and dearer."""
    problem = asked(StraightLine(1, deviation), rank_by, **wanted)
    raced = Search(problem, small.database).run()
    monkeypatch.setattr(search, "is_raced", lambda _: False)
    whole = Search(problem, small.database).run()
    assert raced.cost.min() <= whole.cost.min() + 0.02 * max(abs(whole.cost.min()), 1)
    assert raced.report.refined < 0.75 * whole.report.refined
    assert raced.report.raced > 0
    assert whole.report.raced == 0


EASY = {"families": ["four-bar"], "max_size": 4.0, "min_transmission": 40}


@pytest.mark.parametrize(
    ("request_", "wanted", "most"),
    [
        (StraightLine(1, 1e-3), EASY, 370),
        (StraightLine(1, 3e-4), {"pins_only": True, "fixed_pivots_in": (-2, -2, 3, 3)}, 430),
        (CircularArc(1, 1e-3, 1.5), {"min_transmission": 40, "fixed_pivots_in": (-2, -2, 3, 3)}, 600),
    ],
)
def test_a_few_starts_are_enough_where_no_answer_can_be_much_better(
    small: Catalogue, request_: Any, wanted: dict[str, Any], most: int
) -> None:
    """The list is full, its best is within the gap of the cheapest that there can be, and a whole search finds none
    that is much better."""
    problem = replace(asked(request_, **wanted), limit=6)
    quick, whole = (Search(replace(problem, effort=effort), small.database).run() for effort in (1, 2))
    assert quick.status == "good enough"
    assert np.isfinite(quick.cost).sum() >= 6
    assert 0 < quick.report.refined < min(most, whole.report.refined)
    assert quick.report.raced == 0
    assert 0 <= whole.cost.min() <= quick.cost.min() <= 0.05


@pytest.mark.slow
@pytest.mark.parametrize(
    ("request_", "wanted", "rank_by"),
    [
        (LINE, EASY, "max_link"),  # how short links can be is not known
        (LINE, {**EASY, "max_size": 1.5}, "score"),  # few are so small
        (StraightLine(1, 1e-5), {"min_transmission": 40, "full_rotation": True}, "score"),  # the best is not that good
    ],
)
def test_a_few_starts_are_not_enough_elsewhere(
    small: Catalogue, request_: Any, wanted: dict[str, Any], rank_by: str
) -> None:
    done = Search(asked(request_, rank_by, **wanted), small.database)
    done.step()
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


#: Requests of `tests/benchmarks/recall.py`, each made of a linkage that an independent search knows, and its cost.
HARD: list[Any] = [
    (
        StraightLine(1, 0.00191767),
        {"pins_only": True, "max_size": 2.83543, "min_transmission": 68.8032, "min_link": 1.60621},
        "transmission",
        0.5299759,
    ),
    (
        StraightLine(1, 0.00168084),
        {"families": ["four-bar"], "max_size": 1.46104, "max_link": 1.4135, "max_drive_angle": 44.1025},
        "balance",
        1.0872872,
    ),
]


@pytest.mark.parametrize(("request_", "wanted", "rank_by", "known"), HARD, ids=["drag link", "drive"])
def test_cranks_that_turn_fully_are_found_as_good_as_known(
    small: Catalogue, request_: Any, wanted: dict[str, Any], rank_by: str, known: float
) -> None:
    """Neither the bound on the transmission over the stroke is taken for one over the turn, nor is a crank held back at
    the change point, where another would have driven."""
    found = small.find(request_, **wanted, full_rotation=True, rank_by=rank_by, limit=1)
    assert len(found) == 1
    one = found[0]
    assert one.deviation <= request_.deviation
    assert one.driver in one.rotates
    assert one.min_transmission_turn is not None
    turn = one.min_transmission_turn / 90
    value = 1 - turn if rank_by == "transmission" else one.size - turn
    assert value < known + 0.01


def test_a_search_for_the_impossible_ends(small: Catalogue) -> None:
    problem = asked(StraightLine(1, 1e-9), "size", families=["four-bar"], max_size=1.05, min_transmission=60)
    budget = replace(BUDGET, tried=12, kept=6, broad=1)
    done = Search(problem, small.database, budget=budget).run()
    assert done.status == "exhausted"
    assert not np.isfinite(done.cost).any()
    assert done.found is not None
    assert len(done.cost) == len(done.found)


def test_what_came_nearest_is_led_in(small: Catalogue, monkeypatch: pytest.MonkeyPatch) -> None:
    """What was refined too little to meet the tolerance meets it then, or comes nearer; and nothing that was found is
    lost."""
    problem = asked(StraightLine(1, 3e-5), "size", pins_only=True, min_transmission=50, max_size=2.2)
    budget = replace(BUDGET, rounds=3, leaders=4, per_kind=8, broad=0, farther=3, hops=0)
    monkeypatch.setattr(search, "ENOUGH_ANSWERS", 1)
    found = []
    for leads in (False, True):
        with monkeypatch.context() as patched:
            if not leads:
                patched.setattr(Search, "_lead_in", lambda _: iter(()))
            done = Search(problem, small.database, budget=budget)
            done.problem = replace(problem, limit=4)
            found.append(done.run())
    without, with_ = found
    assert without.found is not None
    assert with_.found is not None
    assert len(with_.cost) >= len(without.cost)
    near = [float(np.nanmin(feasibility(problem, one.found).total)) for one in found if one.found is not None]
    assert near[1] < near[0] - 1e-6


def test_a_tolerance_that_is_reached_where_deviation_is_ranked_is_never_denied(small: Catalogue) -> None:
    """The least deviation of a search, asked for with one part in a thousand to spare."""
    wanted: dict[str, Any] = {"families": ["four-bar"], "max_size": 2.2, "min_transmission": 50}
    least = small.find(LINE, **wanted, rank_by="deviation", limit=1)[0].deviation
    for rank_by in ("size", "score"):
        found = small.find(StraightLine(1, 1.001 * least), **wanted, rank_by=rank_by, limit=1)
        assert len(found) == 1
        assert found[0].deviation <= 1.001 * least


def test_near_a_candidate_few_starts_are_refined_and_it_is_found_again(small: Catalogue) -> None:
    """Those that are most like it lead to an answer hardly dearer, with few points."""
    problem = asked(LINE, "size", families=["four-bar"], fixed_pivots_in=(-0.5, 0.1, 1.5, 1.5), min_transmission=40)
    whole = Search(problem, small.database).run()
    assert whole.found is not None
    best = int(np.argmin(whole.cost))
    near = Search(problem, small.database)
    answers = near.answers_near(whole.found[np.array([best])])
    assert answers is not None
    assert near.report.refined < 64 < whole.report.refined
    assert near.cost.min() <= 1.1 * whole.cost[best]
    assert len(answers) == np.isfinite(near.cost).sum()


@pytest.mark.slow
@pytest.mark.parametrize("stored", [True, False], ids=["that do not reach over the path", "of another family"])
def test_where_no_stored_start_is_any_good_nothing_is_found_near(
    small: Catalogue, monkeypatch: pytest.MonkeyPatch, stored: bool
) -> None:
    """But the candidate itself is refined, here for a deviation that none has."""
    problem = asked(StraightLine(1, 1e-14), "size", families=["four-bar"] if stored else ["oldham"])
    near = Search(asked(LINE, families=["four-bar"]), small.database).starts.short(30)
    assert near is not None
    monkeypatch.setattr(Starts, "_merits", lambda _, some: np.full(len(some), np.inf))
    search_ = Search(problem, small.database)
    assert search_.answers_near(near[np.array([0])]) is None
    assert search_.found is not None
    assert len(search_.found) == 1
    assert (search_.report.measured > 0) == stored
