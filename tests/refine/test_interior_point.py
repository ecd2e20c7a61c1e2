"""Quadratic programmes against solvers of scipy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.optimize import linprog, minimize

from catalogue.kinematics.types import Array
from catalogue.refine import interior_point
from catalogue.refine.interior_point import IPM, solve
from tests.refine.programme import N, P


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
        left = 60 * IPM.close  # rows times the complementarity at which it stops
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


def test_programmes_solved_in_blocks_are_those_of_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    draw = np.random.default_rng(3)
    rows, right, cost = draw.normal(size=(N, 40, P)), draw.uniform(0.1, 2, (N, 40)), draw.normal(size=(N, P))
    whole = solve(np.full((N, P), 0.1), cost, rows, right)
    monkeypatch.setattr(interior_point, "IPM", interior_point.IPM._replace(block=5))
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
    monkeypatch.setattr(interior_point, "IPM", interior_point.IPM._replace(iterations=40))
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
