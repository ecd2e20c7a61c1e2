"""Convex quadratic programmes, many at once, by an interior-point method."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..kinematics.batch import Rows
from ..kinematics.types import Array, Floats


class InteriorPoint(NamedTuple):
    """Mehrotra's method: limits and starting point."""

    iterations: int = 50  #: largest number of iterations
    close: float = 1e-6  #: residual of complementarity, rows and gradient at which the iteration stops
    #: Residual of complementarity below which the iteration stops unless the other residuals fall
    #: by half: they are rounding of large multipliers, which would only grow.
    closest: float = 1e-9
    block: int = 128  #: largest number of programmes solved together
    #: Exponent of the largest cost in the initial multipliers, which end at about that size with
    #: penalties.
    first: float = 0.6
    inside: float = 0.99  #: part of the distance to the border of the positive orthant that a step covers


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
        The last iterate, even where the rows contradict one another; NaN where x is not determined
        in double precision.
    multipliers : ndarray, shape (n, k)
        Multipliers of the rows, all positive.
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
        at = _improve(programmes, at, missing)
    solution[active], multipliers[active] = at.x, at.dual
    return solution, multipliers


@dataclass(frozen=True)
class _Programmes(Rows):
    weight: Floats  #: diagonal of the quadratic term, (n, p)
    cost: Floats  #: linear term, (n, p)
    rows: Floats  #: coefficients of the constraints, (n, k, p)
    columns: Floats  #: transposed `rows`, (n, p, k)
    right: Floats  #: right sides of the constraints, (n, k)


@dataclass(frozen=True)
class _Iterates(Rows):
    """Iterates, or their steps."""

    x: Floats  #: variables, (n, p)
    slack: Floats  #: slacks of the rows, (n, k)
    dual: Floats  #: multipliers of the rows, (n, k)


@dataclass(frozen=True)
class _Missing(Rows):
    """Residuals of the conditions of optimality."""

    rows: Floats  #: primal residuals, (n, k)
    gradient: Floats  #: dual residuals, (n, p)
    gap: Floats  #: mean complementarity, (n, 1)

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


def _improve(of: _Programmes, at: _Iterates, missing: _Missing) -> _Iterates:
    """Return the iterates after a predictor and a corrector."""
    normal = (of.columns * (at.dual / at.slack)[:, None]) @ of.rows
    diagonal = np.einsum("nii->ni", normal)
    diagonal += of.weight + 1e-16 * np.abs(diagonal).max(1, keepdims=True)
    product = at.slack * at.dual
    ahead = _newton(of, at, missing, normal, -product)
    after = (
        (at.slack + _step_to_bound(at.slack, ahead.slack) * ahead.slack)
        * (at.dual + _step_to_bound(at.dual, ahead.dual) * ahead.dual)
    ).mean(1, keepdims=True)
    centring = (after / missing.gap) ** 3
    step = _newton(of, at, missing, normal, centring * missing.gap - product - ahead.slack * ahead.dual)
    # primal and dual steps may differ in length, as the quadratic term weighs little
    length = IPM.inside * _step_to_bound(at.slack, step.slack)
    return _Iterates(
        at.x + length * step.x,
        at.slack + length * step.slack,
        at.dual + IPM.inside * _step_to_bound(at.dual, step.dual) * step.dual,
    )


def _newton(of: _Programmes, at: _Iterates, missing: _Missing, normal: Floats, target: Floats) -> _Iterates:
    """Solve the normal equations (n, p, p) for Newton's steps.

    The steps change the products of slacks and multipliers by a target (n, k).
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
        regular = np.linalg.slogdet(matrix)[0] != 0  # both use the same elimination
        out = np.full(right.shape, np.nan)
        out[regular] = np.linalg.solve(matrix[regular], right[regular])
        return out


def _step_to_bound(value: Floats, step: Floats) -> Floats:
    """Return the largest fraction of a step that leaves all values non-negative, (n, 1)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = np.where(step < 0, -value / step, np.inf)
    return np.asarray(np.minimum(reach.min(1, keepdims=True), 1.0))
