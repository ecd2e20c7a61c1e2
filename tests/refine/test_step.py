"""The minimax step against linear programming."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linprog

from catalogue.refine.step import minimax_step


def test_the_largest_error_is_nearly_the_least() -> None:
    """On smooth columns as paths have them; the nominal moves at no cost."""
    x = np.cos(np.linspace(np.pi, 0, 33))
    draw = np.random.default_rng(1)
    n, p = 30, 4
    waves = np.stack([np.cos(k * np.arccos(x)) for k in range(9)], axis=1)
    error = waves @ draw.normal(size=(9, n))
    jacobian = np.moveaxis((waves @ draw.normal(size=(n, 9, p))), 0, 1)
    free = np.broadcast_to(np.stack([np.ones_like(x), x], axis=-1)[:, None], (33, n, 2))
    step, left = minimax_step(error, jacobian, free, np.array([1e-12]))
    assert step.shape == (1, n, p)
    for i in range(n):
        columns = np.concatenate([jacobian[:, i], free[:, i], -np.ones((33, 1))], axis=1)
        mirrored = np.concatenate([-columns[:, :-1], columns[:, -1:]], axis=1)
        best = linprog(
            [0] * (p + 2) + [1],
            A_ub=np.concatenate([columns, mirrored]),
            b_ub=np.concatenate([-error[:, i], error[:, i]]),
            bounds=[(None, None)] * (p + 3),
        ).fun
        assert best * (1 - 1e-9) <= left[0, i] <= 1.15 * best


def test_damping_shortens_the_step() -> None:
    draw = np.random.default_rng(2)
    error, jacobian = draw.normal(size=(33, 5)), draw.normal(size=(33, 5, 3))
    free = np.ones((33, 5, 1))
    step, left = minimax_step(error, jacobian, free, np.array([1e-9, 1.0, 1e3]))
    length = np.linalg.norm(step, axis=-1)
    assert (length[2] < 0.1 * length[:2]).all()
    assert (left[2] > left[0]).all()


def test_what_is_not_finite_is_not_stepped() -> None:
    error = np.ones((9, 2))
    error[3, 1] = np.nan
    step, left = minimax_step(error, np.ones((9, 2, 1)), np.ones((9, 2, 1)), np.array([1e-3]))
    assert np.isfinite(step[0, 0]).all()
    assert np.isnan(step[0, 1]).all()
    assert np.isnan(left[0, 1])
