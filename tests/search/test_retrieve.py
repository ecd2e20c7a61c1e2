"""Stored starts: which are read, what they are likely to cost and break, and who is tried first."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from catalogue import Catalogue, CircularArc, StraightLine
from catalogue.problem.constraints import Constraints
from catalogue.problem.problem import Problem
from catalogue.problem.ranking import Ranking
from catalogue.search.retrieve import candidates_of, eligible, estimate, kinds, levels, shortlist, stored_reaches

LINE, ARC = StraightLine(1, 1e-3), CircularArc(1, 1e-3, 1.5)


def asked(request: Any, rank_by: Any = "score", **wanted: Any) -> Problem:
    return Problem.of(request, Constraints(**wanted), Ranking.of(request, rank_by))


@pytest.mark.parametrize("request_", [LINE, ARC, CircularArc(1, 1e-3)], ids=["line", "arc", "any arc"])
def test_the_shortlist_holds_every_series_and_no_guide_twice(small: Catalogue, request_: Any) -> None:
    problem = asked(request_)
    reaches = stored_reaches(problem, small.database)
    merit, _ = estimate(problem, reaches)
    first = shortlist(reaches, merit, 30)
    assert len(first) == 30
    assert set(reaches.series[first]) == set(reaches.series)
    assert len(set(reaches.guide[first])) == 30
    given = {code: int((reaches.series[first] == code).sum()) for code in set(reaches.series)}
    there = {code: len(set(reaches.guide[reaches.series == code])) for code in given}
    for code, count in given.items():
        assert count >= min(there[code], max(given.values()) - 1), "equal shares, of those that have as many"
    # of each series the best is among them, and the best of all comes first
    for code in set(reaches.series):
        of = np.flatnonzero(reaches.series == code)
        assert of[np.argmin(merit[of])] in first
    assert reaches.series[first[0]] == reaches.series[np.argmin(merit)]
    second = shortlist(reaches, merit, 30, reaches.guide[first])
    assert not set(reaches.guide[second]) & set(reaches.guide[first])


def test_what_is_not_eligible_is_not_listed(small: Catalogue) -> None:
    problem = asked(LINE, families=["four-bar", "slider-crank"], pins_only=True, series=["II.xy", "IV*.l"], order=3)
    reaches = stored_reaches(problem, small.database)
    good = eligible(problem, reaches)
    by_hand = [f == "four-bar" and s in ("II.xy", "IV*.l") and k >= 3 for f, s, k in zip(
        reaches.family, reaches.series, reaches.order, strict=True)]  # fmt: skip
    assert good.tolist() == by_hand
    assert 0 < good.sum() < len(good)
    merit = np.where(good, estimate(problem, reaches)[0], np.inf)
    assert good[shortlist(reaches, merit, 10_000)].all()
    nobody = shortlist(reaches, np.full(len(reaches), np.inf), 5)
    assert len(nobody) == 0


BOUNDS: list[dict[str, Any]] = [
    {"max_size": 2.0}, {"max_link": 1.5}, {"min_link": 0.4}, {"max_ground": 1.2}, {"min_ground": 0.8}, {"max_arm": 1.0},
    {"min_transmission": 45.0}, {"full_rotation": True},
]  # fmt: skip


@pytest.mark.parametrize("request_", [LINE, ARC], ids=["line", "arc"])
@pytest.mark.parametrize("bound", BOUNDS, ids=str)
def test_a_guide_that_meets_the_constraint_has_no_penalty(
    small: Catalogue, request_: Any, bound: dict[str, Any]
) -> None:
    """At the stroke to which it is stretched, by its stored numbers; and one that does not has one."""
    plain, wanted = asked(request_), asked(request_, **bound)
    reaches = stored_reaches(plain, small.database)
    free, stretch = estimate(plain, reaches)
    merit, same = estimate(wanted, reaches)
    np.testing.assert_array_equal(same, stretch)
    ((name, value),) = bound.items()
    if name == "full_rotation":
        holds = reaches.rotates > 0
    elif name == "min_transmission":
        holds = reaches["min_transmission"] >= value
    elif name == "max_size":
        holds = np.maximum(reaches["size"] / stretch, 1.0) <= value
    else:
        length = reaches[name.replace("min_ground", "max_ground")] / stretch
        holds = np.isnan(length) | (length <= value if name.startswith("max") else length >= value)
    assert 0 < holds.sum() < len(holds)
    assert (merit[holds] == free[holds]).all()
    assert (merit[~holds] > free[~holds]).all()


@pytest.mark.parametrize("bound", [{"min_drive_angle": 60}, {"max_drive_angle": 40}, {"max_rotation": 20}], ids=str)
def test_who_misses_a_bound_on_an_angle_by_more_has_the_larger_penalty(small: Catalogue, bound: dict[str, Any]) -> None:
    plain, wanted = asked(LINE), asked(LINE, **bound)
    reaches = stored_reaches(plain, small.database)
    (free, stretch), (merit, _) = estimate(plain, reaches), estimate(wanted, reaches)
    ((name, value),) = bound.items()
    angle = reaches[name[4:]] * stretch
    over = np.where(name[:3] == "min", value - angle, angle - value)
    known, broken = np.isfinite(over), over > 0
    assert 0 < broken.sum() < known.sum()
    assert (merit[known & ~broken] == free[known & ~broken]).all()
    order = np.argsort(over[broken])
    assert (np.diff((merit - free)[broken][order]) >= -1e-9).all()


@pytest.mark.parametrize("name", ["fixed_pivots_in", "pivots_in"])
@pytest.mark.parametrize(("request_", "ways"), [(LINE, 4), (ARC, 2)], ids=["line", "arc"])
def test_a_box_is_no_penalty_if_the_pivots_stand_in_it_in_some_way(
    small: Catalogue, request_: Any, ways: int, name: str
) -> None:
    """The stored box of the fixed pivots, or of all, turned round and mirrored by hand."""
    plain, wanted = asked(request_), asked(request_, **{name: (-0.3, 0.1, 1.5, 1.4)})
    reaches = stored_reaches(plain, small.database)
    free, stretch = estimate(plain, reaches)
    merit, _ = estimate(wanted, reaches)
    stored = reaches.fixed_box if name == "fixed_pivots_in" else reaches.box
    x0, y0, x1, y1 = (stored / stretch[:, None]).T
    holds = np.zeros(len(reaches), bool)
    for right, up in ((1, 1), (-1, 1), (1, -1), (-1, -1))[:ways]:
        x, y = 0.5 + right * np.array([x0, x1]), up * np.array([y0, y1])
        inside = (x.min(0) >= -0.3) & (x.max(0) <= 1.5) & (y.min(0) >= 0.1) & (y.max(0) <= 1.4)
        holds |= inside | np.isnan(x0)
    assert 0 < holds.sum() < len(holds)
    assert (merit[holds] == free[holds]).all()
    assert (merit[~holds] > free[~holds]).all()


@pytest.mark.parametrize("request_", [LINE, ARC], ids=["line", "arc"])
def test_an_estimate_is_near_what_is_measured(small: Catalogue, request_: Any) -> None:
    """Of size and transmission angle, which a stretched stroke changes; medians, for estimates err."""
    problem = asked(request_)
    reaches = stored_reaches(problem, small.database)
    merit, stretch = estimate(problem, reaches)
    chosen = shortlist(reaches, merit, 80)
    laid = candidates_of(problem, small.database, reaches, chosen, stretch[chosen])
    there = np.isfinite(laid.deviation)
    assert there.mean() > 0.9
    assert laid.origin.id.tolist() == reaches.guide[chosen].tolist()
    size = np.maximum(reaches["size"] / stretch, 1)[chosen] / laid.measures.size
    assert np.median(np.abs(size[there] - 1)) < 0.05
    angle = reaches["min_transmission"][chosen] - laid.measures.min_transmission
    assert np.median(np.abs(angle[there])) < 6
    assert (laid.deviation[there] < 1e-3).mean() > 0.5


@pytest.mark.slow
@pytest.mark.parametrize("request_", [LINE, CircularArc(1, 1e-3)], ids=["line", "any arc"])
def test_what_is_laid_unstretched_is_what_is_stored(small: Catalogue, request_: Any) -> None:
    problem = asked(request_)
    reaches = stored_reaches(problem, small.database)
    some = np.arange(0, len(reaches), 3)
    laid = candidates_of(problem, small.database, reaches, some, np.ones(len(some)))
    there = np.isfinite(laid.deviation)
    assert there.mean() > 0.95
    np.testing.assert_allclose(laid.measures.size[there], reaches["size"][some][there], rtol=0.01)
    np.testing.assert_allclose(
        laid.measures.min_transmission[there], reaches["min_transmission"][some][there], atol=0.5
    )
    assert (laid.deviation[there] <= 10.0 ** reaches.level[some][there]).all()


def test_levels_hold_what_is_asked_and_one_looser() -> None:
    assert levels(asked(StraightLine(1, 3e-4))) == (-4, -3)
    assert levels(asked(StraightLine(1, 1e-4))) == (-4, -3)
    low, high = levels(asked(StraightLine(1, 3e-4), "deviation"))
    assert (low < -4, high) == (True, -3)
    assert levels(asked(StraightLine(1, 1e-15)))[0] <= levels(asked(StraightLine(1, 1e-15)))[1]


def test_flat_arcs_are_served_by_lines_too() -> None:
    def serve(request: Any, **wanted: Any) -> int:
        return len(kinds(asked(request, **wanted)))

    assert [serve(CircularArc(1, 1e-3, r)) for r in (0.6, 50.0, 1e6)] == [1, 2, 2]
    assert serve(CircularArc(1, 1e-3)) == serve(LINE) == 1
    point, slot = kinds(asked(LINE)), kinds(asked(LINE, slots=True))
    assert not set(point) & set(slot)


def test_reaches_are_read_once_until_the_file_changes(small: Catalogue) -> None:
    problem = asked(LINE)
    assert stored_reaches(problem, small.database) is stored_reaches(asked(LINE, max_size=3), small.database)
    assert stored_reaches(problem, small.database) is not stored_reaches(asked(ARC), small.database)
