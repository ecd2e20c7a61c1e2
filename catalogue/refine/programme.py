"""Many small convex quadratic programmes at once, by an interior-point method."""

from __future__ import annotations

import numpy as np

from ..linkage import Array

#: Most iterations, and the complementarity at which they stop.
ITERATIONS, CLOSE = 30, 1e-7
#: Part of the way to the border of the positive orthant that a step goes.
INSIDE = 0.99


def solve(weight: Array, cost: Array, rows: Array, right: Array) -> tuple[Array, Array]:
    """Minimise  x diag(weight) x / 2 + cost x  subject to  rows x <= right.

    Predictor and corrector from a start that need not be feasible (S. Mehrotra, SIAM J. Optim. 2 (1992) 575-601).  All
    coefficients should be of order 1.

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
    x = np.zeros((n, p))
    slack, dual = np.maximum(right, 1.0), np.ones((n, k))
    turned = np.ascontiguousarray(np.swapaxes(rows, 1, 2))
    eye = np.eye(p)
    for _ in range(ITERATIONS):
        ratio = dual / slack
        outside = (rows @ x[..., None])[..., 0] + slack - right
        uphill = weight * x + cost + (turned @ dual[..., None])[..., 0]
        gap = (slack * dual).mean(1, keepdims=True)
        open_ = np.maximum(gap, np.abs(uphill).max(1, keepdims=True)) > CLOSE
        if not open_.any():
            break
        normal = (turned * ratio[:, None]) @ rows
        normal += (weight[..., None] + 1e-13 * np.abs(normal).max((1, 2), keepdims=True)) * eye
        inverse = np.linalg.inv(normal)

        def newton(
            target: Array,
            inverse: Array = inverse,
            outside: Array = outside,
            uphill: Array = uphill,
            slack: Array = slack,
            dual: Array = dual,
        ) -> tuple[Array, Array, Array]:
            pull = (dual * outside + target) / slack
            dx = -(inverse @ (uphill + (turned @ pull[..., None])[..., 0])[..., None])[..., 0]
            ds = -outside - (rows @ dx[..., None])[..., 0]
            return dx, ds, (target - dual * ds) / slack

        dx, ds, dy = newton(-slack * dual)
        after = ((slack + _far(slack, ds) * ds) * (dual + _far(dual, dy) * dy)).mean(1, keepdims=True)
        centring = (after / gap) ** 3
        dx, ds, dy = newton(centring * gap - slack * dual - ds * dy)
        primal, other = INSIDE * _far(slack, ds), INSIDE * _far(dual, dy)
        length = np.where(open_, np.minimum(primal, other), 0.0)  # one for both: a quadratic term couples them
        x, slack, dual = x + length * dx, slack + length * ds, dual + length * dy
    return x, dual


def _far(value: Array, step: Array) -> Array:
    """Return the longest part of a step, at most all of it, after which no value is below 0, shape (n, 1)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = np.where(step < 0, -value / step, np.inf)
    return np.asarray(np.minimum(reach.min(1, keepdims=True), 1.0))
