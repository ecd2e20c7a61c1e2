"""How far refined guides are from a least deviation: a bound by duality.

Of the linear problem  max |e + J s|  over  v + G s <= 0,  |s_k| <= r,  multipliers lambda of the errors, with sum of
moduli 1, and mu >= 0 of the constraints prove

    max |e + J s| >= lambda e + mu v - r |J' lambda + G' mu|_1

whatever multipliers they are; the bound is exact for the best ones, which alternate in sign (Chebyshev).  It equals the
present deviation exactly where the guide is stationary, for every r.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..guide.span import span
from ..linkage import Array
from ..query.lay import Answers
from .linear import Linear, linearised
from .step import minimax_step
from .task import EXACT, Task

#: Moves that the bound holds for: of each coordinate by this part of its unit (`task.Free`: a distance from the point).
REGION = 0.01
#: Pull of the leash in the linear programme, which the box bounds; and, in parts of the region, by how much constraints
#: are loosened for it so that there is room between them.  The bound holds for whatever multipliers come of it.
SLIGHT = 1e-6
#: A peak of the error counts as one of the alternation if it is at least this part of the largest.
PEAK = 0.95


@dataclass(frozen=True)
class Certificate:
    """How good n guides are.

    Attributes
    ----------
    gap : ndarray, shape (n,)
        NaN where the path is exact but for rounding, or returns.
        (E - E_lower)/E: part of the largest error that moves within `REGION` could at most take away, to first order.
        0 where the guide is stationary: the alternation and the constraints that are active balance.
    alternations : ndarray of int, shape (n,)
        Peaks of the error of alternating sign, ends of the stroke included; 0 without a gap.
    """

    gap: Array
    alternations: Array


def certified(now: Answers, task: Task, ceiling: Array) -> Certificate:
    """Return the certificates of placed guides.

    Parameters
    ----------
    ceiling : ndarray, shape (n,)
        Price that each may not exceed.
    """
    guides = span(now.linkage, now.point, pole=now.pole)
    some = np.flatnonzero((now.traced.relative > EXACT) & ~guides.cusp)
    gap, count = np.full(len(now.point), np.nan), np.zeros(len(now.point), int)
    if len(some):
        with np.errstate(all="ignore"):
            problem = linearised(now[some], guides[some], task, (ceiling - task.price(now))[some])
            gap[some] = np.clip(1 - lower_bound(problem, REGION) / np.abs(problem.error).max(1), 0, 1)
        count[some] = alternations(problem.error)
    return Certificate(gap, count)


def lower_bound(problem: Linear, region: float) -> Array:
    """Return what the largest errors cannot fall below, to first order, in steps |s_k| <= region, shape (n,).

    NaN where the problem is not finite.
    """
    n, k, p = problem.slope.shape
    sides = np.broadcast_to(np.concatenate([np.eye(p), -np.eye(p)]), (n, 2 * p, p))
    boxed = Linear(
        problem.error,
        problem.jacobian,
        np.concatenate([problem.value, np.full((n, 2 * p), -region)], axis=1) / region - SLIGHT,
        np.concatenate([problem.slope, sides], axis=1) / region,
    )
    found = minimax_step(boxed, np.full(n, region), SLIGHT)
    weight, force = found.alternation, np.abs(problem.error).max(1)[:, None] * found.limits[:, :k] / region
    by = (weight[:, None] @ problem.jacobian)[:, 0] + (force[:, None] @ problem.slope)[:, 0]
    bound = (weight * problem.error).sum(1) + (force * problem.value).sum(1) - region * np.abs(by).sum(1)
    return np.asarray(np.where(np.isfinite(found.step).all(1), np.maximum(bound, 0.0), np.nan))


def alternations(error: Array) -> Array:
    """Return how many peaks of errors (n, m) along paths alternate at the largest error, shape (n,)."""
    large = np.abs(error) >= PEAK * np.abs(error).max(1, keepdims=True)
    count, last = np.zeros(len(error), int), np.zeros(len(error))
    for at, sign in zip(large.T, np.sign(error).T, strict=True):
        new = at & (sign != last)
        count += new
        last = np.where(new, sign, last)
    return count
