"""The steps that come of linear problems, against linear programming."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from catalogue.kinematics.types import Array
from catalogue.refine.quantities import Pieces
from catalogue.refine.step import STEP, take_step
from catalogue.refine.subproblem import Subproblem
from tests.refine.programme import N, P, best_of, cost_of, smooth


@pytest.mark.parametrize("size", [1.0, 1e-3, 1e-6])
def test_the_largest_error_is_the_least(size: float) -> None:
    problem = smooth(size, 8)
    radius, penalty = np.full(N, 0.3), np.full(N, 10.0)
    found = take_step(problem, radius, penalty)
    assert (np.abs(found.displacement) <= 0.3 * (1 + 1e-5)).all()
    for i in range(N):
        best = best_of(problem, i, 0.3, 10.0)
        pull = 0.5 * STEP.pull * (found.displacement[i] ** 2).sum() / 0.3**2 * 10  # what a short step is worth
        assert cost_of(problem, i, found.displacement[i], 10.0) <= best + max(pull, 2e-3)


def test_radii_shorten_the_step() -> None:
    problem = smooth(1e-3, 0)
    for radius in (1.0, 1e-2, 1e-4):
        step = take_step(problem, np.full(N, radius), np.full(N, 10.0)).displacement
        assert (np.abs(step) <= radius * (1 + 1e-5)).all()
        assert (np.abs(step).max(1) > 0.5 * radius).all() or radius == 1.0


def test_broken_constraints_are_mended_as_far_as_the_radius_allows() -> None:
    problem = smooth(1e-2, 8, broken=0.02)
    penalty = 100.0
    for radius in (1e-4, 0.1):
        found = take_step(problem, np.full(N, radius), np.full(N, penalty))
        rows = problem.limits["rows"]
        left = np.maximum(rows.value + (rows.slope @ found.displacement[..., None])[..., 0], 0).max(1)
        for i in range(N):
            assert cost_of(problem, i, found.displacement[i], penalty) <= best_of(problem, i, radius, penalty) + 0.02
        assert (left < rows.value.max(1)).all()
        assert (left < 1e-5).all() == (radius == 0.1)


def test_a_relaxed_constraint_yields_to_the_others() -> None:
    """Two rows that contradict one another: the one that is relaxed is broken."""
    plain = smooth(1e-3, 0)
    along = np.eye(P)[0]
    slope, value = np.tile(along, (N, 1, 1)), np.full((N, 1), 0.05)
    limits = {"up": Pieces(value, slope), "down": Pieces(value, -slope)}
    for relaxed, sign in (("up", 1), ("down", -1)):
        problem = replace(plain, limits=limits, marginal={}, relaxed=relaxed)
        step = take_step(problem, np.full(N, 0.2), np.full(N, 100.0)).displacement[:, 0]
        np.testing.assert_allclose(step, sign * 0.05, atol=1e-3)


@pytest.mark.parametrize("radius", [0.3, 0.01])
def test_ranked_measures_become_least(radius: float) -> None:
    """Sums of largest pieces, the deviation being a constraint."""
    draw = np.random.default_rng(8)
    plain = smooth(1e-3, 4)
    pieces = {
        name: Pieces(draw.normal(size=(N, k)), draw.normal(size=(N, k, P)))
        for name, k in (("size", 6), ("max_link", 3))
    }
    marginal = {"size": np.full(N, 0.7), "max_link": draw.uniform(0.1, 1, N)}
    problem = replace(plain, measures=pieces, marginal=marginal, allowed=np.abs(plain.error).max(1) * 1.2)
    found = take_step(problem, np.full(N, radius), np.full(N, 100.0))
    for i in range(N):
        slight = STEP.slight * sum(np.abs(p.slope[i]).sum() for p in pieces.values()) * radius
        best = best_of(problem, i, radius, 100.0)
        pull = 0.5 * STEP.pull * P
        assert cost_of(problem, i, found.displacement[i], 100.0) <= best + slight + pull + 2e-3


@pytest.mark.parametrize("rate", [0.2, 3.0])
def test_a_measure_that_rises_with_the_largest_error_becomes_least(rate: float) -> None:
    """As good as the programme in which the error costs as much itself."""
    plain, slope = smooth(1e-3, 4), np.random.default_rng(6).normal(size=(N, 1, P))
    worst = np.abs(plain.error).max(1)
    pieces = {"allowance": Pieces(np.zeros((N, 1)), slope)}
    by_error = {"allowance": np.full(N, rate) / (1.6 * worst)}
    asked = replace(plain, measures=pieces, marginal={"allowance": np.ones(N)}, allowed=1.6 * worst, by_error=by_error)
    marginal = {"deviation": np.full(N, rate), "allowance": np.ones(N)}
    same = replace(asked, marginal=marginal, by_error={})
    step = take_step(asked, np.full(N, 0.3), np.full(N, 100.0)).displacement
    for i in range(N):
        here, still = (cost_of(same, i, s, 100.0) for s in (step[i], np.zeros(P)))
        best = best_of(same, i, 0.3, 100.0)
        assert here - best < 0.02 * (still - best) + 2e-3


def test_what_is_not_finite_is_not_stepped() -> None:
    problem = smooth(1.0, 2)
    problem.error[3, 1] = np.nan
    step = take_step(problem, np.ones(N), np.full(N, 10.0)).displacement
    assert np.isnan(step[3]).all()
    assert np.isfinite(np.delete(step, 3, axis=0)).all()


def test_some_problems_are_solved_as_in_the_whole_batch() -> None:
    problem = smooth(1e-3, 8)
    every = take_step(problem, np.full(N, 0.1), np.full(N, 10.0)).displacement
    some: Array = np.array([7, 2, 2])
    assert isinstance(problem[some], Subproblem)
    part = take_step(problem[some], np.full(3, 0.1), np.full(3, 10.0)).displacement
    np.testing.assert_allclose(part, every[some], rtol=1e-6, atol=1e-9)
