"""Many small convex quadratic programmes at once, by an interior-point method."""

from __future__ import annotations

import numpy as np

from ..kinematics.types import Array

#: Most iterations, and the complementarity at which they stop.
ITERATIONS, CLOSE = 50, 1e-6
#: Part of the way to the border of the positive orthant that a step goes.
INSIDE = 0.99


def solve(weight: Array, cost: Array, rows: Array, right: Array) -> tuple[Array, Array]:
    """Minimise  x diag(weight) x / 2 + cost x  subject to  rows x <= right.

    Predictor and corrector from a start that need not be feasible (S. Mehrotra, SIAM J. Optim. 2 (1992) 575-601).  All
    coefficients should be of order 1.  A programme leaves the iteration as soon as it is solved.

    Parameters
    ----------
    weight, cost : ndarray, shape (n, p)
        Weights of at least 0; together with the rows they must determine x.
    rows : ndarray, shape (n, k, p)
    right : ndarray, shape (n, k)

    Returns
    -------
    x : ndarray, shape (n, p)
        The last iterate, also where the rows contradict one another.
    multipliers : ndarray, shape (n, k)
        Of the rows, all positive.
    """
    n, k, p = rows.shape
    solution, multipliers = np.zeros((n, p)), np.ones((n, k))
    x, slack, active = np.zeros((n, p)), np.maximum(right, 1.0), np.arange(n)
    dual = np.ones((n, k)) * np.maximum(np.sqrt(np.abs(cost).max(1, keepdims=True)), 1.0)
    turned = np.ascontiguousarray(np.swapaxes(rows, 1, 2))
    for _ in range(ITERATIONS):
        ratio = dual / slack
        outside = (rows @ x[..., None])[..., 0] + slack - right
        uphill = weight * x + cost + (turned @ dual[..., None])[..., 0]
        gap = (slack * dual).mean(1, keepdims=True)
        left = np.maximum(np.maximum(gap[:, 0], np.abs(uphill).max(1)), np.abs(outside).max(1)) > CLOSE
        if not left.all():
            solution[active], multipliers[active] = x, dual
            active, x, slack, dual, ratio = active[left], x[left], slack[left], dual[left], ratio[left]
            rows, turned, right, weight, cost = rows[left], turned[left], right[left], weight[left], cost[left]
            outside, uphill, gap = outside[left], uphill[left], gap[left]
            if not len(active):
                break
        normal = (turned * ratio[:, None]) @ rows
        diagonal = np.einsum("nii->ni", normal)
        diagonal += weight + 1e-16 * np.abs(diagonal).max(1, keepdims=True)

        def newton(
            target: Array,
            rows: Array = rows,
            turned: Array = turned,
            normal: Array = normal,
            outside: Array = outside,
            uphill: Array = uphill,
            slack: Array = slack,
            dual: Array = dual,
        ) -> tuple[Array, Array, Array]:
            pull = (dual * outside + target) / slack
            dx = -np.linalg.solve(normal, uphill[..., None] + turned @ pull[..., None])[..., 0]
            ds = -outside - (rows @ dx[..., None])[..., 0]
            return dx, ds, (target - dual * ds) / slack

        dx, ds, dy = newton(-slack * dual)
        after = ((slack + _far(slack, ds) * ds) * (dual + _far(dual, dy) * dy)).mean(1, keepdims=True)
        centring = (after / gap) ** 3
        dx, ds, dy = newton(centring * gap - slack * dual - ds * dy)
        length = np.minimum(INSIDE * _far(slack, ds), INSIDE * _far(dual, dy))  # a quadratic term couples them
        x, slack, dual = x + length * dx, slack + length * ds, dual + length * dy
    solution[active], multipliers[active] = x, dual
    return solution, multipliers


def _far(value: Array, step: Array) -> Array:
    """Return the longest part of a step, at most all of it, after which no value is below 0, shape (n, 1)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = np.where(step < 0, -value / step, np.inf)
    return np.asarray(np.minimum(reach.min(1, keepdims=True), 1.0))
