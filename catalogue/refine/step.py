"""The step that makes the largest of many linearised errors least inside linearised constraints, for many guides."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..linkage import Array
from .linear import Linear
from .programme import solve


@dataclass(frozen=True)
class Step:
    """Steps of n guides.

    Attributes
    ----------
    step : ndarray, shape (n, p)
    alternation : ndarray, shape (n, m)
        Multipliers of the errors, the sum of whose moduli is 1, signed as the errors that are left.
    limits : ndarray, shape (n, k)
        Multipliers of the inequalities: relative change of the largest error per unit.
    """

    step: Array
    alternation: Array
    limits: Array

    @property
    def dual(self) -> Array:
        """Largest multiplier of an inequality, shape (n,)."""
        return np.asarray(self.limits.max(1, initial=0.0))


def minimax_step(problem: Linear, leash: Array, pull: float = 1.0) -> Step:
    """Return the steps s within the limits for which the largest error that is left and a price of length are least.

    That is, max |error + jacobian s| / max |error| + pull |s|^2 / (2 leash^2).

    In the singular directions of the Jacobian, each scaled by the larger of its effect on the errors and the leash,
    all coefficients are of order 1 or less, however ill-conditioned it is.

    Parameters
    ----------
    leash : ndarray, shape (n,)
        How long a step may be, about.
    pull : float
        How strongly the leash pulls.

    Returns
    -------
    Step
        NaN where the problem is not finite.
    """
    largest = np.abs(problem.error).max(1)[:, None]
    good = np.isfinite(problem.jacobian).all((1, 2)) & np.isfinite(problem.error).all(1) & (largest[:, 0] > 0)
    with np.errstate(all="ignore"):
        error = np.where(good[:, None], problem.error / largest, 1.0)
        jacobian = np.where(good[:, None, None], problem.jacobian / largest[..., None], 0.0)
    _, singular, turn = np.linalg.svd(jacobian, full_matrices=False)
    scale = np.maximum(singular, 1 / leash[:, None])
    back = np.swapaxes(turn, 1, 2) / scale[:, None]  # from the scaled coordinates to the steps
    effect, slope = jacobian @ back, problem.slope @ back
    n, m, p = effect.shape
    rows = np.zeros((n, 2 * m + slope.shape[1], p + 1))
    rows[:, :m, :p], rows[:, m : 2 * m, :p], rows[:, : 2 * m, p] = effect, -effect, -1.0
    rows[:, 2 * m :, :p] = slope
    right = np.concatenate([-error, error, -problem.value], axis=1)
    weight = np.concatenate([pull / (scale * leash[:, None]) ** 2, np.zeros((n, 1))], axis=1)
    x, dual = solve(weight, np.eye(p + 1)[p:].repeat(n, 0), rows, right)
    step = (back @ x[:, :p, None])[..., 0]
    sign = dual[:, :m] - dual[:, m : 2 * m]
    sign = sign / np.abs(sign).sum(1, keepdims=True)
    return Step(np.where(good[:, None], step, np.nan), sign, dual[:, 2 * m :])
