"""Quadratic programmes and minimax steps against solvers of scipy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog, minimize

from catalogue.refine.linear import Linear
from catalogue.refine.programme import solve
from catalogue.refine.step import minimax_step

N, P = 12, 5


def smooth(size: float, limits: int, seed: int = 1) -> Linear:
    """Return problems as paths have them: smooth errors and columns."""
    x = np.cos(np.linspace(np.pi, 0, 33))
    draw = np.random.default_rng(seed)
    waves = np.stack([np.cos(k * np.arccos(x)) for k in range(9)])
    error = size * draw.normal(size=(N, 9)) @ waves
    jacobian = np.swapaxes(draw.normal(size=(N, P, 9)) @ waves, 1, 2)
    return Linear(error, jacobian, -draw.uniform(0, 0.05, (N, limits)), draw.normal(size=(N, limits, P)))


@pytest.mark.parametrize("weight", [0.0, 1.0])
def test_programmes_are_solved(weight: float) -> None:
    draw = np.random.default_rng(3)
    rows, right, cost = draw.normal(size=(N, 60, P)), draw.uniform(0.1, 2, (N, 60)), draw.normal(size=(N, P))
    x, dual = solve(np.full((N, P), weight), cost, rows, right)
    assert (dual > 0).all()
    for i in range(N):
        if weight:
            room = {"type": "ineq", "fun": lambda s, i=i: right[i] - rows[i] @ s}
            best = minimize(lambda s, i=i: 0.5 * s @ s + cost[i] @ s, np.zeros(P), constraints=room, method="SLSQP")
        else:
            best = linprog(cost[i], A_ub=rows[i], b_ub=right[i], bounds=[(None, None)] * P)
        np.testing.assert_allclose(x[i], best.x, atol=1e-4)
        assert (rows[i] @ x[i] - right[i]).max() < 1e-5
        np.testing.assert_allclose(weight * x[i] + cost[i] + rows[i].T @ dual[i], 0, atol=1e-6)


@pytest.mark.parametrize("size", [1.0, 1e-6])
def test_the_largest_error_is_the_least(size: float) -> None:
    """On a leash that does not pull, by linear programming."""
    problem = smooth(size, 8)
    found = minimax_step(problem, np.full(N, 1e2 * size), 1e-8)
    left = np.abs(problem.error + (problem.jacobian @ found.step[..., None])[..., 0]).max(1)
    for i in range(N):
        columns = np.concatenate([problem.jacobian[i], -np.ones((33, 1))], axis=1)
        mirrored = np.concatenate([-columns[:, :-1], columns[:, -1:]], axis=1)
        rows = np.concatenate([problem.slope[i], np.zeros((8, 1))], axis=1)
        best = linprog(
            [0] * P + [1],
            A_ub=np.concatenate([columns, mirrored, rows]),
            b_ub=np.concatenate([-problem.error[i], problem.error[i], -problem.value[i]]) / size,
            bounds=[(None, None)] * (P + 1),
        ).fun * size  # fmt: skip
        assert best * (1 - 1e-6) <= left[i] <= best * (1 + 1e-3)
    assert (problem.value + (problem.slope @ found.step[..., None])[..., 0]).max() < 1e-6
    np.testing.assert_allclose(np.abs(found.alternation).sum(1), 1)


def test_a_leash_shortens_the_step() -> None:
    problem = smooth(1.0, 0)
    length = [np.linalg.norm(minimax_step(problem, np.full(N, leash)).step, axis=1) for leash in (10.0, 0.1, 1e-4)]
    assert (length[1] < 0.5 * length[0]).all()
    assert (length[1] < 0.2).all()
    assert (length[2] < 2e-4).all()


def test_what_is_not_finite_is_not_stepped() -> None:
    problem = smooth(1.0, 2)
    problem.error[3, 1] = np.nan
    step = minimax_step(problem, np.ones(N)).step
    assert np.isnan(step[3]).all()
    assert np.isfinite(np.delete(step, 3, axis=0)).all()
