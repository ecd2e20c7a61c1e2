"""Quadratic programmes and the steps that come of linear problems, against solvers of scipy."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import linprog, minimize

from catalogue.kinematics.types import Array
from catalogue.refine import step
from catalogue.refine.quantities import Pieces
from catalogue.refine.step import CLOSE, PULL, SLIGHT, solve, take_step
from catalogue.refine.subproblem import Subproblem
from tests.refine.programme import N, P, best_of, cost_of, smooth


@pytest.mark.parametrize("weight", [0.0, 1.0])
@pytest.mark.parametrize("seed", range(4))
def test_programmes_are_solved(weight: float, seed: int) -> None:
    draw = np.random.default_rng(seed)
    rows, right, cost = draw.normal(size=(N, 60, P)), draw.uniform(0.1, 2, (N, 60)), draw.normal(size=(N, P))
    x, dual = solve(np.full((N, P), weight), cost, rows, right)
    assert (dual > 0).all()
    best: Any
    for i in range(N):
        if weight:
            room: Any = {"type": "ineq", "fun": lambda s, i=i: right[i] - rows[i] @ s}

            def objective(s: Array, i: int = i) -> float:
                return float(0.5 * s @ s + cost[i] @ s)

            best = minimize(objective, np.zeros(P), constraints=room, method="SLSQP", tol=1e-12)
        else:
            best = linprog(cost[i], A_ub=rows[i], b_ub=right[i], bounds=[(None, None)] * P)
        here = 0.5 * weight * x[i] @ x[i] + cost[i] @ x[i]
        left = 60 * CLOSE  # rows times the complementarity at which it stops
        assert abs(here - best.fun) <= 2 * left
        if weight:
            np.testing.assert_allclose(x[i], best.x, atol=np.sqrt(2 * left))
        assert (rows[i] @ x[i] - right[i]).max() < 1e-5
        np.testing.assert_allclose(weight * x[i] + cost[i] + rows[i].T @ dual[i], 0, atol=1e-6)


@pytest.mark.parametrize("price", [1.0, 10.0, 1e2, 1e3, 1e4])
def test_a_dear_slack_is_solved_as_a_cheap_one(price: float) -> None:
    """Constraints that are elastic at the prices that refinement asks, 10 ... 10^4, and its certificate, 10^3."""
    draw = np.random.default_rng(5)
    rows, right, cost = draw.normal(size=(N, 30, P)), draw.uniform(0.1, 2, (N, 30)), draw.normal(size=(N, P))
    box = np.tile(np.concatenate([np.eye(P), -np.eye(P)]), (N, 1, 1))
    rows, right = np.concatenate([rows, box], axis=1), np.concatenate([right, np.ones((N, 2 * P))], axis=1)
    column = np.zeros((N, 30 + 2 * P, 1))
    column[:, :30:2] = -1.0  # every other row may be broken
    slack = np.zeros((N, 1, P + 1))
    slack[..., -1] = -1.0
    every = np.concatenate([np.concatenate([rows, column], axis=2), slack], axis=1)
    bounds, prices = np.append(right, np.zeros((N, 1)), axis=1), np.append(cost, np.full((N, 1), price), axis=1)
    x, _ = solve(np.zeros((N, P + 1)), prices, every, bounds)
    for i in range(N):
        best = linprog(prices[i], A_ub=every[i], b_ub=bounds[i], bounds=[(None, None)] * (P + 1))
        assert best.fun is not None
        assert (every[i] @ x[i] - bounds[i]).max() < 1e-5
        assert prices[i] @ x[i] <= best.fun + 1e-4


@pytest.mark.parametrize("size", [1.0, 1e-3, 1e-6])
def test_the_largest_error_is_the_least(size: float) -> None:
    problem = smooth(size, 8)
    radius, penalty = np.full(N, 0.3), np.full(N, 10.0)
    found = take_step(problem, radius, penalty)
    assert (np.abs(found.step) <= 0.3 * (1 + 1e-5)).all()
    for i in range(N):
        best = best_of(problem, i, 0.3, 10.0)
        pull = 0.5 * PULL * (found.step[i] ** 2).sum() / 0.3**2 * 10  # what a short step is worth
        assert cost_of(problem, i, found.step[i], 10.0) <= best + max(pull, 2e-3)


def test_radii_shorten_the_step() -> None:
    problem = smooth(1e-3, 0)
    for radius in (1.0, 1e-2, 1e-4):
        step = take_step(problem, np.full(N, radius), np.full(N, 10.0)).step
        assert (np.abs(step) <= radius * (1 + 1e-5)).all()
        assert (np.abs(step).max(1) > 0.5 * radius).all() or radius == 1.0


def test_broken_constraints_are_mended_as_far_as_the_radius_allows() -> None:
    problem = smooth(1e-2, 8, broken=0.02)
    penalty = 100.0
    for radius in (1e-4, 0.1):
        found = take_step(problem, np.full(N, radius), np.full(N, penalty))
        rows = problem.limits["rows"]
        left = np.maximum(rows.value + (rows.slope @ found.step[..., None])[..., 0], 0).max(1)
        for i in range(N):
            assert cost_of(problem, i, found.step[i], penalty) <= best_of(problem, i, radius, penalty) + 0.02
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
        step = take_step(problem, np.full(N, 0.2), np.full(N, 100.0)).step[:, 0]
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
        slight = SLIGHT * sum(np.abs(p.slope[i]).sum() for p in pieces.values()) * radius
        best = best_of(problem, i, radius, 100.0)
        pull = 0.5 * PULL * P
        assert cost_of(problem, i, found.step[i], 100.0) <= best + slight + pull + 2e-3


@pytest.mark.parametrize("rms", [0.1, 0.7, 3.0])
def test_a_ranked_allowance_becomes_the_largest(rms: float) -> None:
    """It is (1 - deviation/allowed)/(2 rms): as good as the programme of its derivatives by deviation and rms."""
    plain = smooth(1e-3, 4)
    worst, slope = np.abs(plain.error).max(1), np.random.default_rng(6).normal(size=(N, P))
    asked = replace(
        plain, marginal={"allowance": np.ones(N)}, allowed=1.6 * worst, rms=np.full(N, rms), rms_slope=rms * slope
    )
    by_rms = (1 - 1 / 1.6) / (2 * rms**2) * asked.rms_slope
    marginal = {"deviation": np.full(N, 1 / (2 * rms)), "size": np.ones(N)}
    same = replace(asked, measures={"size": Pieces(np.zeros((N, 1)), by_rms[:, None])}, marginal=marginal)
    step = take_step(asked, np.full(N, 0.3), np.full(N, 100.0)).step
    for i in range(N):
        here, still = (cost_of(same, i, s, 100.0) for s in (step[i], np.zeros(P)))
        best = best_of(same, i, 0.3, 100.0)
        assert here - best < 0.02 * (still - best) + 2e-3


def test_what_is_not_finite_is_not_stepped() -> None:
    problem = smooth(1.0, 2)
    problem.error[3, 1] = np.nan
    step = take_step(problem, np.ones(N), np.full(N, 10.0)).step
    assert np.isnan(step[3]).all()
    assert np.isfinite(np.delete(step, 3, axis=0)).all()


def test_some_problems_are_solved_as_in_the_whole_batch() -> None:
    problem = smooth(1e-3, 8)
    every = take_step(problem, np.full(N, 0.1), np.full(N, 10.0)).step
    some: Array = np.array([7, 2, 2])
    assert isinstance(problem[some], Subproblem)
    part = take_step(problem[some], np.full(3, 0.1), np.full(3, 10.0)).step
    np.testing.assert_allclose(part, every[some], rtol=1e-6, atol=1e-9)


def test_programmes_solved_in_blocks_are_those_of_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    draw = np.random.default_rng(3)
    rows, right, cost = draw.normal(size=(N, 40, P)), draw.uniform(0.1, 2, (N, 40)), draw.normal(size=(N, P))
    whole = solve(np.full((N, P), 0.1), cost, rows, right)
    monkeypatch.setattr(step, "BLOCK", 5)
    assert N % 5, "the last block is a shorter one"
    for part, one in zip(solve(np.full((N, P), 0.1), cost, rows, right), whole, strict=True):
        np.testing.assert_allclose(part, one, rtol=1e-9)


def test_large_multipliers_leave_no_more_than_rounding_in_the_gradient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where rounding alone is left iterations end; further ones end in noise, up to 1e2."""
    draw = np.random.default_rng(5)
    n, price = 400, 1e4
    rows = draw.normal(size=(n, 60, P)) * 10 ** draw.uniform(-4, 0, (n, 1, P))
    right = draw.uniform(0.1, 2, (n, 60))
    right[:, ::2] -= 0.5  # those that may be broken
    rows = np.concatenate([rows, np.tile(np.concatenate([np.eye(P), -np.eye(P)]), (n, 1, 1))], axis=1)
    slack = np.zeros((n, 60 + 2 * P, 1))
    slack[:, :60:2] = -1.0
    last = np.zeros((n, 1, P + 1))
    last[..., -1] = -1.0
    every = np.concatenate([np.concatenate([rows, slack], axis=2), last], axis=1)
    bounds = np.concatenate([right, np.ones((n, 2 * P)), np.zeros((n, 1))], axis=1)
    prices = np.concatenate([draw.normal(size=(n, P)), np.full((n, 1), price)], axis=1)
    weight = np.full((n, P + 1), 1e-3)
    x, dual = solve(weight, prices, every, bounds)
    gradient = weight * x + prices + (np.swapaxes(every, 1, 2) @ dual[..., None])[..., 0]
    assert np.abs(gradient).max() < 1e-7 * price
    monkeypatch.setattr(step, "ITERATIONS", 40)
    assert np.array_equal(x, solve(weight, prices, every, bounds)[0]), "none of them needs so many"


def test_a_programme_that_is_not_determined_spoils_no_other() -> None:
    draw = np.random.default_rng(8)
    rows, right = draw.normal(size=(3, 12, 4)), draw.uniform(0.5, 1, (3, 12))
    weight, cost = np.full((3, 4), 1e-3), draw.normal(size=(3, 4))
    alone = solve(weight[[0, 2]], cost[[0, 2]], rows[[0, 2]], right[[0, 2]])
    rows[1], weight[1] = 0.0, 0.0
    together = solve(weight, cost, rows, right)
    for one, other in zip(alone, together, strict=True):
        np.testing.assert_allclose(other[[0, 2]], one, rtol=1e-9)
    assert np.isnan(together[0][1]).all()
