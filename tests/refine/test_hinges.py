"""Steps bring linear functions inside their bounds, as near as a general minimiser does."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize

from catalogue.refine.hinges import Hinges, bring_inside

PLAN = (4,) * 200


def random_hinges(n: int, p: int, sides: tuple[int, int], wishes: int, seed: int) -> Hinges:
    random = np.random.default_rng(seed)
    count = sum(sides) + wishes
    slope = random.normal(size=(n, count, p))
    inside = random.normal(size=(n, p)) * 0.3
    reached = (slope @ inside[..., None])[..., 0]
    value = random.uniform(-0.5, 0.0, (n, count)) - reached  # there all strict ones hold
    value[:, : sides[0]] = random.uniform(-0.5, 0.5, (n, sides[0])) - reached[:, : sides[0]]
    value[:, sum(sides) :] += 3.0
    return Hinges(slope, value, np.full(n, 0.6), sides)


@pytest.mark.parametrize("seed", range(4))
def test_strict_bounds_hold_and_wishes_are_met_as_far_as_they_allow(seed: int) -> None:
    n, p, sides = 12, 5, (6, 4)
    hinges = random_hinges(n, p, sides, 3, seed)
    none, plenty = np.zeros((n, p)), np.full(n, 1e3)
    step, multipliers, _ = bring_inside(hinges, none, np.zeros((n, 10)), np.full(n, 0.01), plenty, PLAN)
    reached = hinges.value + (hinges.slope @ step[..., None])[..., 0]
    assert (np.abs(reached[:, :6]) < 0.62).all()
    assert (reached[:, 6:10] < 0.02).all()
    assert multipliers.shape == (n, 10)
    for i in range(n):
        best = _minimised(hinges, i)
        assert _wish(hinges, i, step[i]) <= 1.05 * best + 0.02


def _wish(hinges: Hinges, i: int, step: Any) -> float:
    over = np.maximum(hinges.value[i, 10:] + hinges.slope[i, 10:] @ step, 0)
    return float(0.5 * over @ over + 0.005 * step @ step)


def _minimised(hinges: Hinges, i: int) -> float:
    """Return the least that a general minimiser with constraints finds."""

    def spare(step: Any) -> Any:
        there = hinges.value[i, :10] + hinges.slope[i, :10] @ step
        return np.concatenate([0.6 - there[:6], 0.6 + there[:6], -there[6:]])

    bounds: Any = {"type": "ineq", "fun": spare}
    wish: Any = partial(_wish, hinges, i)
    found: Any = minimize(wish, np.zeros(5), constraints=bounds, method="SLSQP")
    assert found.success
    return float(found.fun)


def test_steps_are_no_longer_than_their_radius() -> None:
    hinges = random_hinges(20, 4, (3, 3), 2, 7)
    radius = np.geomspace(1e-3, 1.0, 20)
    step, _, damping = bring_inside(hinges, np.zeros((20, 4)), np.zeros((20, 6)), np.full(20, 0.1), radius, (4, 2))
    assert (np.abs(step).max(1) <= radius * (1 + 1e-12)).all()
    assert damping[0] > 10 * damping[-1], "shorter steps are damped more"


def test_nothing_moves_where_all_holds() -> None:
    hinges = Hinges(np.ones((1, 2, 3)), np.array([[0.1, -0.2]]), np.array([0.5]), (1, 1))
    step, multipliers, _ = bring_inside(hinges, np.zeros((1, 3)), np.zeros((1, 2)), np.ones(1), np.ones(1), (3, 2))
    np.testing.assert_array_equal(step, 0)
    np.testing.assert_array_equal(multipliers, 0)


def test_a_machine_that_is_not_finite_leaves_the_others_alone() -> None:
    hinges = random_hinges(3, 4, (3, 3), 2, 8)
    alone, _, _ = bring_inside(hinges, np.zeros((3, 4)), np.zeros((3, 6)), np.ones(3), np.ones(3), (4, 2))
    value = hinges.value.copy()
    value[1] = np.nan
    broken = Hinges(hinges.slope, value, hinges.bound, hinges.sides)
    step, _, _ = bring_inside(broken, np.zeros((3, 4)), np.zeros((3, 6)), np.ones(3), np.ones(3), (4, 2))
    np.testing.assert_allclose(step[[0, 2]], alone[[0, 2]], rtol=1e-12)
    assert np.isfinite(step).all()
