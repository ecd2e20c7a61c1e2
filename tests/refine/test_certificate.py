"""The bound by duality against linear programming, and what it promises of guides."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from catalogue import Catalogue, CircularArc, StraightLine
from catalogue.candidates.batch import CandidateBatch, near_path
from catalogue.candidates.feasibility import cost, feasibility
from catalogue.curvature_theory.instant import Instant
from catalogue.guidance.coupler_curve import coupler_curve
from catalogue.guidance.minimum_zone import grid
from catalogue.kinematics.linkage import Linkage
from catalogue.kinematics.types import Array
from catalogue.problem.problem import Problem
from catalogue.refine.certificate import PROOF, alternations, certified, drift
from catalogue.refine.sqp import Refinement
from catalogue.refine.step import STEP, take_step
from catalogue.refine.subproblem import GRID, PivotCoordinates, Subproblem
from tests.refine.programme import N, P, best_of, cost_of, smooth
from tests.refine.starts import problem_of, started


@pytest.mark.parametrize("penalty", [10.0, PROOF.penalty])
@pytest.mark.parametrize("size", [1.0, 1e-3, 1e-7])
@pytest.mark.parametrize("limits", [0, 5, 40])
def test_the_bound_is_that_of_linear_programming(size: float, limits: int, penalty: float) -> None:
    problem = smooth(size, limits)
    bound = take_step(problem, np.full(N, PROOF.region), np.full(N, penalty), margin=0.0).bound
    proved = np.flatnonzero(np.isfinite(bound))
    assert len(proved) == N
    good = 0
    for i in proved.tolist():
        gain = cost_of(problem, i, np.zeros(problem.jacobian.shape[2]), penalty) - best_of(
            problem, i, PROOF.region, penalty
        )
        assert bound[i] >= gain - 1e-6, "it is a bound"
        # the pull takes |s|^2 / 2 r^2 of it from the step, and |s|_1 / r of it from the multipliers
        good += bool(bound[i] <= gain + 1.5 * STEP.pull * P)
    assert good == N, "and a good one"


def test_a_stationary_problem_has_no_gap() -> None:
    """A Chebyshev polynomial over its lower ones: no combination of those lowers it, however long the steps."""
    x = grid(GRID.nodes).nodes
    error = np.tile(np.cos(6 * np.arccos(x)), (3, 1))
    jacobian = np.tile(np.stack([np.cos(k * np.arccos(x)) for k in range(6)], axis=1), (3, 1, 1))
    one = np.ones(3)
    problem = Subproblem(error, jacobian, {}, {}, {"deviation": one}, one, {})
    for region in (1e-3, 1.0, 1e3):
        bound = take_step(problem, np.full(3, region), np.full(3, PROOF.penalty), margin=0.0).bound
        np.testing.assert_allclose(bound, 0.0, atol=0.02)
    assert alternations(error).tolist() == [7, 7, 7]


def test_alternations_are_of_equal_height() -> None:
    x = grid(GRID.nodes).nodes
    wave = np.cos(3 * np.arccos(x))
    assert alternations(np.stack([wave, wave * (1 + x), 0.5 * wave + 0.5, -wave])).tolist() == [4, 1, 1, 4]


def moved(problem: Problem, found: CandidateBatch, step: Array) -> tuple[CandidateBatch, Array]:
    """Return what comes of steps, laid along the path and measured, and of which guides."""
    linkage, point, good = PivotCoordinates().moved(found, step)
    kept = np.flatnonzero(good)
    guides = coupler_curve(linkage, point, pole=found.pole[kept])
    return near_path(problem, found[kept].origin, guides), kept


PROBLEMS: list[tuple[Any, Any, dict[str, Any]]] = [
    (StraightLine(1, 5e-3), "deviation", {"families": ["four-bar"], "max_size": 3.0}),
    (StraightLine(1, 5e-3), "size", {"families": ["four-bar"], "min_transmission": 20.0}),
    (CircularArc(1, 5e-3, 1), "balance", {"families": ["four-bar"]}),
]


@pytest.mark.slow
@pytest.mark.parametrize(("request_", "rank_by", "wish"), PROBLEMS, ids=str)
def test_no_small_move_gains_more_than_the_gap(
    small: Catalogue, request_: Any, rank_by: Any, wish: dict[str, Any]
) -> None:
    """Of what is refined, and of what is not: random moves within the region, measured on their finite motion."""
    problem = problem_of(request_, rank_by, **wish)
    start = started(small, problem, 10)
    run = Refinement.of(problem, start).run(8)
    done = run.best[np.flatnonzero(np.isfinite(run.best_cost))]
    assert len(done) >= 3
    draw = np.random.default_rng(3)
    for found in (done, start[np.flatnonzero(feasibility(problem, start).all)]):
        gap = certified(problem, found).gap
        # the gap is one of first order: what is curved counts as the square of the step, over the deviation
        longest = np.minimum(PROOF.region, found.deviation)[:, None]
        for share in (1.0, 0.3, 0.05):
            for _ in range(8):
                step = share * longest * draw.uniform(-1, 1, (len(found), 10))
                after, kept = moved(problem, found, step)
                met = feasibility(problem, after).all
                gain = cost(problem, found[kept]) - cost(problem, after)
                if rank_by == "deviation":  # as a part, not as a logarithm
                    gain = 1 - np.exp(-gain)
                assert not (gain[met] > gap[kept][met] + 0.02 * share**2 + 1e-4).any()


@pytest.mark.slow
def test_refined_guides_are_nearer_to_stationary(small: Catalogue) -> None:
    for request_, rank_by, wish in PROBLEMS:
        problem = problem_of(request_, rank_by, **wish)
        start = started(small, problem, 10)
        run = Refinement.of(problem, start).run(40)  # until it rests
        some = np.flatnonzero(np.isfinite(run.best_cost) & feasibility(problem, start).all)
        before, after = (certified(problem, found[some]).gap for found in (start, run.best))
        assert np.isfinite(before).all()
        assert np.isfinite(after).all()
        assert np.nanmedian(after) < 0.02
        assert np.nanmedian(before) > 3 * np.nanmedian(after)


@pytest.mark.slow
def test_refined_deviations_alternate(small: Catalogue) -> None:
    """Refinement adds touches of the strip; ten coordinates less a similarity leave no more than ten."""
    problem = problem_of(StraightLine(1, 5e-3), "deviation", families=["four-bar"], max_size=4.0)
    start = started(small, problem, 10)
    run = Refinement.of(problem, start).run(15)
    before, after = (certified(problem, found).alternations for found in (start, run.best))
    assert np.nanmedian(after) > np.nanmedian(before)
    assert after.max() <= 10


@pytest.mark.slow
def test_drift_is_the_least_residual_over_the_stroke(small: Catalogue) -> None:
    """One guide after the other, at places of their own; cognates, and what has no series, have none."""
    found = started(small, problem_of(StraightLine(1, 5e-3), series=["II.xy"]), 4)
    drifted = drift(found, small.registry.series)
    for i in range(len(found)):
        one = found[[i]]
        pose = one.curve.motion.pose(one.traced.parameters(np.linspace(-1, 1, 1501)))
        pivots = np.repeat(one.linkage.pivots, 1501, axis=0)
        for k in (0, 1):
            at = pose.pivot(one.linkage, k)[:, 0]
            pivots[:, k, 1, 0], pivots[:, k, 1, 1] = at.real, at.imag
        residual, _ = small.registry.get("II.xy").classify(Instant(Linkage(pivots)))
        assert np.nanmin(residual) - 1e-9 <= drifted[i] < np.nanmin(residual) + 0.02 * np.nanmax(residual)
    cognates = replace(found, origin=replace(found.origin, cognate=np.ones(len(found), int)))
    assert np.isnan(drift(cognates, small.registry.series)).all()
    assert np.isnan(drift(found, {})).all()


@pytest.mark.slow
def test_a_returning_or_exact_path_has_no_gap(small: Catalogue) -> None:
    problem = problem_of(StraightLine(1, 5e-3), "deviation", families=["elliptic-trammel"])
    found = started(small, problem, 8)
    exact = found.traced.relative <= 1e-12
    assert exact.any()
    made = certified(problem, found)
    np.testing.assert_array_equal(np.isnan(made.gap), exact)
    assert (made.alternations[exact] == 0).all()
