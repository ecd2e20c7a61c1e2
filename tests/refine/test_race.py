"""A race leads starts inside the constraints; its leaders hold on their finite motion nearly what it says."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest

from catalogue import Catalogue, CircularArc, StraightLine
from catalogue.candidates.batch import CandidateBatch
from catalogue.candidates.feasibility import cost, feasibility
from catalogue.guidance.sensitivity import COUNT, displaced
from catalogue.guidance.stations import Stationed
from catalogue.kinematics.linkage import PR, Linkage
from catalogue.problem.problem import Problem
from catalogue.refine import race_model
from catalogue.refine.race import Race
from catalogue.refine.sqp import Refinement
from catalogue.refine.subproblem import is_raced, units
from catalogue.search.starts import SearchReport, Starts
from tests.refine.starts import problem_of

LINE, ARC, ANY = StraightLine(1, 3e-4), CircularArc(1, 3e-4, 0.9), CircularArc(1, 3e-4)
PINS: dict[str, Any] = {"families": ["four-bar"]}
CASES: list[Any] = [
    (LINE, "size", {**PINS, "min_transmission": 50}),
    (LINE, "score", {"families": ["slider-crank", "four-bar"], "fixed_pivots_in": (-0.5, 0.1, 1.5, 1.5)}),
    (LINE, "transmission", {**PINS, "max_size": 2.5, "full_rotation": True}),
    (LINE, "balance", {**PINS, "max_drive_angle": 60, "min_uniformity": 0.6}),
    (LINE, "size", {"families": ["inverted-slider-crank"], "max_travel": 2.0}),
    (ARC, "size", {**PINS, "min_transmission": 45}),
    (ANY, "size", {**PINS, "pivots_in": (-0.6, -1.8, 1.6, -0.1)}),
    (LINE, "deviation", {**PINS, "max_size": 3.0, "min_transmission": 45}),
]


def starts_of(small: Catalogue, problem: Problem, count: int) -> CandidateBatch:
    starts = Starts(problem, small.database, SearchReport())
    found = starts.broad(0, count, None)
    assert found is not None
    assert len(found) > 0.5 * count
    return starts.best(found, count)


@pytest.mark.slow
@pytest.mark.parametrize(("request_", "rank_by", "wanted"), CASES)
def test_more_starts_meet_the_constraints_than_before_and_none_is_lost(
    small: Catalogue, request_: Any, rank_by: str, wanted: dict[str, Any]
) -> None:
    problem = problem_of(request_, rank_by, **wanted)
    assert is_raced(problem)
    starts = starts_of(small, problem, 40)
    race = Race.of(problem, starts)
    before, merits = (race.best.violation <= 0).sum(), [race.merit.copy()]
    for _ in range(12):
        best = race.best
        race.round()
        met = best.violation <= 0
        assert (race.best.violation[met] <= 0).all(), "what has met the constraints is kept"
        assert (race.best.cost[met] <= best.cost[met]).all()
        assert (race.best.violation[~met] <= best.violation[~met]).all()
        merits.append(race.merit)
    assert (race.best.violation <= 0).sum() > before
    assert race.taken == 12 * len(race)


@pytest.mark.slow
@pytest.mark.parametrize(("request_", "rank_by", "wanted"), CASES)
def test_leaders_hold_on_their_finite_motion_what_the_race_says(
    small: Catalogue, request_: Any, rank_by: str, wanted: dict[str, Any]
) -> None:
    """Between the stations a little is missed; four rounds of refinement make good for most."""
    problem = problem_of(request_, rank_by, **wanted)
    starts = starts_of(small, problem, 40)
    race = Race.of(problem, starts)
    race.take_rounds(12)
    race = race.leaders(20).denser()
    race.take_rounds(4)
    race = race.leaders(10)
    met = race.best.violation <= 0
    assert met.any()
    found = race.finalists(starts)
    assert len(found) >= 0.5 * len(race)
    assert set(found.origin.id.tolist()) <= set(starts.origin.id.tolist())
    assert np.nanmin(feasibility(problem, found).total) < 0.05
    refined = Refinement.of(problem, found).run(4)
    assert np.isfinite(refined.best_cost).sum() >= 0.3 * met.sum()
    if rank_by == "size":
        least = race.best.cost[met].min()
        assert refined.best_cost.min() < 1.1 * least


@pytest.mark.slow
def test_leaders_of_other_families_have_the_limits_of_theirs(small: Catalogue) -> None:
    """The rows of a batch depend on its families: those of the leaders alone are made anew."""
    problem = problem_of(LINE, "size", families=["four-bar", "slider-crank"], pivots_in=(-1, -2, 2, 2))
    race = Race.of(problem, starts_of(small, problem, 30))
    race.round()
    pins = np.flatnonzero(race.best.machine.linkage.finite.all((1, 2)))
    few = race._some(pins[:3])
    assert few.here.limit.shape[1] < race.here.limit.shape[1]
    np.testing.assert_allclose(few.best.cost, race.best.cost[pins[:3]], rtol=1e-12)
    few.round()
    assert len(few) == 3


@pytest.mark.slow
def test_leaders_of_other_dyads_have_the_limits_of_theirs(small: Catalogue) -> None:
    """A slider of the first dyad adds rows that one of the second does not have."""
    problem = problem_of(LINE, "size", families=["slider-crank"], pivots_in=(-1, -2, 2, 2))
    starts = starts_of(small, problem, 30)
    pivots = starts.linkage.pivots.copy()
    pivots[::2] = pivots[::2, ::-1]
    race = Race.of(problem, replace(starts, linkage=Linkage.trusted(pivots)))
    race.round()
    first = race._some(np.flatnonzero(race.here.machine.linkage.dyads[:, 0] == PR))
    assert 0 < len(first) < len(race)
    assert first.here.limit.shape[1] < race.here.limit.shape[1]
    first.round()


@pytest.mark.slow
def test_what_a_race_costs_is_what_candidates_cost(small: Catalogue) -> None:
    problem = problem_of(LINE, "balance", **PINS, max_size=6.0)
    starts = starts_of(small, problem, 30)
    race = Race.of(problem, starts)
    off = np.abs(race.here.cost - cost(problem, starts[race.start]))
    assert np.median(off) < 0.003
    assert off.max() < 0.1, "read at nine stations"


@pytest.mark.slow
@pytest.mark.parametrize("request_", [LINE, ARC, ANY], ids=["line", "arc", "any radius"])
def test_the_scatter_changes_with_the_pivots_as_its_slopes_say(small: Catalogue, request_: Any) -> None:
    """By steps along and against every coordinate."""
    problem = problem_of(request_, "allowance", families=["four-bar", "slider-crank"], max_size=4.0)
    machine = Race.of(problem, starts_of(small, problem, 40)).here.machine

    def scatter(there: Stationed) -> Any:
        return np.sqrt((there.jacobian.across**2).sum(-1).max(0))

    unit, step = units(machine.linkage, machine.point), 1e-5
    got, want = race_model._scatter_slope(machine, machine.jacobian) * unit, np.zeros(unit.shape)
    for k, way in product(range(COUNT), (1, -1)):
        moved = way * step * unit * (np.arange(COUNT) == k)
        linkage, point, _ = displaced(machine.linkage, machine.point, moved)
        there = Stationed.settled(linkage, point, machine.curvature, machine.error, machine.angle)
        want[:, k] += way * scatter(there) / (2 * step)
    off = np.abs(got - want).max(1) / np.abs(want).max(1)
    assert np.median(off) < 1e-4
    assert np.mean(off < 1e-2) > 0.8, "at others another station is about as bad"
    assert (np.abs(want).max(1) > 0).all()


@pytest.mark.parametrize(
    ("wanted", "raced"),
    [
        ({}, True),
        ({"keep_out": [(0, 0.2, 1, 0.4)]}, False),
        ({"swept_in": (-2, -2, 3, 3)}, True),
        ({"swept_in": [(-2, -2), (3, -2), (3, 3), (0.5, 1.0), (-2, 3)]}, False),
        ({"play": 1e-5}, False),
        ({"returns": True}, False),
    ],
)
def test_what_stations_do_not_show_is_not_raced(wanted: dict[str, Any], raced: bool) -> None:
    assert is_raced(problem_of(LINE, **wanted)) == raced


def test_wide_arcs_are_not_raced() -> None:
    assert not is_raced(problem_of(CircularArc(radius=1, angle=270, deviation=1e-3)))


@pytest.mark.slow
@pytest.mark.parametrize("rank_by", ["score", "allowance", "size"])
def test_machines_have_as_many_pieces_alone_as_together(small: Catalogue, rank_by: str) -> None:
    """Some gain by a smaller error and some do not: whichever gain in a round, they can take the places of others."""
    problem = problem_of(LINE, rank_by, **PINS)
    starts = starts_of(small, problem, 12)
    here = Race.of(problem, starts).here
    alone = [race_model.Linear.of(problem, here.machine[np.array([i])]) for i in range(len(here))]
    assert {one.measure.shape[1] for one in alone} == {here.measure.shape[1]}
    assert {one.limit.shape[1] for one in alone} == {here.limit.shape[1]}
