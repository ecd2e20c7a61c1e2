"""Convex quadratic programmes, many at once, by an interior-point method."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..kinematics.batch import Rows
from ..kinematics.types import Array, Floats


class InteriorPoint(NamedTuple):
    """Mehrotra's method: limits and starting point."""

    iterations: int = 50  #: most iterations
    close: float = 1e-6  #: residual of complementarity, rows and gradient at which they stop
    #: Residual of complementarity below which the others, unless they fall by half, are rounding
    #: of large multipliers, which would only grow.
    closest: float = 1e-9
    block: int = 128  #: most programmes solved together
    #: Power of the largest cost at which multipliers start: penalties bring them to about that in
    #: the end.
    first: float = 0.6
    inside: float = 0.99  #: part of the way to the border of the positive orthant that a step goes


IPM = InteriorPoint()


def solve(weight: Floats, cost: Floats, rows: Floats, right: Floats) -> tuple[Floats, Floats]:
    """Minimise  x diag(weight) x / 2 + cost x  subject to  rows x <= right.

    Predictor and corrector from a start that need not be feasible (S. Mehrotra, SIAM J. Optim. 2
    (1992) 575-601).  All coefficients should be of order 1.  A programme leaves the iteration as
    soon as it is solved.

    Parameters
    ----------
    weight, cost : ndarray, shape (n, p)
        Weights of at least 0; together with the rows they must determine x.
    rows : ndarray, shape (n, k, p)
    right : ndarray, shape (n, k)

    Returns
    -------
    x : ndarray, shape (n, p)
        The last iterate, also where the rows contradict one another; NaN where x is not
        determined in double precision.
    multipliers : ndarray, shape (n, k)
        Of the rows, all positive.
    """
    n, k, p = rows.shape
    if n > IPM.block:  # a block fits in the cache of a core
        each = [slice(i, i + IPM.block) for i in range(0, n, IPM.block)]
        parts = [solve(weight[s], cost[s], rows[s], right[s]) for s in each]
        return np.concatenate([x for x, _ in parts]), np.concatenate([y for _, y in parts])
    solution, multipliers = np.zeros((n, p)), np.ones((n, k))
    active, before = np.arange(n), np.full(n, np.inf)
    programmes = _Programmes(weight, cost, rows, np.ascontiguousarray(np.swapaxes(rows, 1, 2)), right)
    dual = np.ones((n, k)) * np.maximum(np.abs(cost).max(1, keepdims=True), 1.0) ** IPM.first
    at = _Iterates(np.zeros((n, p)), np.maximum(right, 1.0), dual)
    for _ in range(IPM.iterations):
        missing = _missing(programmes, at)
        gap, residual = missing.gap[:, 0], missing.largest
        left = (gap > IPM.close) | ((residual > IPM.close) & ((gap > IPM.closest) | (residual < 0.5 * before)))
        before = residual[left]
        if not left.all():
            solution[active], multipliers[active] = at.x, at.dual
            active, programmes, at, missing = active[left], programmes[left], at[left], missing[left]
            if not len(active):
                break
        at = _improved(programmes, at, missing)
    solution[active], multipliers[active] = at.x, at.dual
    return solution, multipliers


@dataclass(frozen=True)
class _Programmes(Rows):
    weight: Floats  #: (n, p)
    cost: Floats  #: (n, p)
    rows: Floats  #: (n, k, p)
    columns: Floats  #: (n, p, k), the rows transposed
    right: Floats  #: (n, k)


@dataclass(frozen=True)
class _Iterates(Rows):
    """Iterates, or steps of them."""

    x: Floats  #: (n, p)
    slack: Floats  #: (n, k)
    dual: Floats  #: (n, k), the multipliers


@dataclass(frozen=True)
class _Missing(Rows):
    """Residuals of the conditions of optimality."""

    rows: Floats  #: (n, k), primal residuals
    gradient: Floats  #: (n, p), dual residuals
    gap: Floats  #: (n, 1), mean complementarity

    @property
    def largest(self) -> Floats:
        """The largest residuals, shape (n,)."""
        return np.asarray(np.maximum(np.abs(self.gradient).max(1), np.abs(self.rows).max(1)))


def _missing(of: _Programmes, at: _Iterates) -> _Missing:
    """Compute the residuals of iterates."""
    return _Missing(
        (of.rows @ at.x[..., None])[..., 0] + at.slack - of.right,
        of.weight * at.x + of.cost + (of.columns @ at.dual[..., None])[..., 0],
        (at.slack * at.dual).mean(1, keepdims=True),
    )


def _improved(of: _Programmes, at: _Iterates, missing: _Missing) -> _Iterates:
    """Return the iterates after a predictor and a corrector."""
    normal = (of.columns * (at.dual / at.slack)[:, None]) @ of.rows
    diagonal = np.einsum("nii->ni", normal)
    diagonal += of.weight + 1e-16 * np.abs(diagonal).max(1, keepdims=True)
    product = at.slack * at.dual
    ahead = _newton(of, at, missing, normal, -product)
    after = (
        (at.slack + _far(at.slack, ahead.slack) * ahead.slack) * (at.dual + _far(at.dual, ahead.dual) * ahead.dual)
    ).mean(1, keepdims=True)
    centring = (after / missing.gap) ** 3
    step = _newton(of, at, missing, normal, centring * missing.gap - product - ahead.slack * ahead.dual)
    # primal and dual steps may differ in length, as the quadratic term weighs little
    length = IPM.inside * _far(at.slack, step.slack)
    return _Iterates(
        at.x + length * step.x,
        at.slack + length * step.slack,
        at.dual + IPM.inside * _far(at.dual, step.dual) * step.dual,
    )


def _newton(of: _Programmes, at: _Iterates, missing: _Missing, normal: Floats, target: Floats) -> _Iterates:
    """Solve the normal equations (n, p, p) for Newton's steps.

    They change the products of slacks and multipliers by a target (n, k).
    """
    pull = (at.dual * missing.rows + target) / at.slack
    dx = -_solved(normal, missing.gradient[..., None] + of.columns @ pull[..., None])[..., 0]
    ds = -missing.rows - (of.rows @ dx[..., None])[..., 0]
    return _Iterates(dx, ds, (target - at.dual * ds) / at.slack)


def _solved(matrix: Floats, right: Floats) -> Array:
    """Solve linear systems one by one, NaN for singular ones."""
    try:
        return np.asarray(np.linalg.solve(matrix, right))
    except np.linalg.LinAlgError:
        regular = np.linalg.slogdet(matrix)[0] != 0  # by the same elimination
        out = np.full(right.shape, np.nan)
        out[regular] = np.linalg.solve(matrix[regular], right[regular])
        return out


def _far(value: Floats, step: Floats) -> Floats:
    """Return the largest fraction of a step that leaves all values non-negative, (n, 1)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = np.where(step < 0, -value / step, np.inf)
    return np.asarray(np.minimum(reach.min(1, keepdims=True), 1.0))
