"""How far refined guides are from a stationary point of what they were refined for: a bound by duality.

Of the linear problem  min c y  over the steps |s_k| <= r, the measures y, and the constraints  rows (s, y) <= right,
any multipliers of the rows that balance the cost of the measures prove

    min c y >= - right . multipliers - r |rows_s' multipliers|_1,

whatever they are; the bound is exact for the best ones.  What it leaves below the present cost is the gap: 0 exactly
where the guide is stationary.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..candidates.batch import CandidateBatch
from ..guide.fixed_nominal import Nominal
from ..kinematics.types import Array
from ..problem.problem import Problem
from .parametrisation import Parametrisation, PivotCoordinates
from .sqp import EXACT
from .step import take_step
from .subproblem import linearise

#: Moves that the bound holds for: of each coordinate by this part of its unit, a distance from the guided point.
REGION = 0.01
#: A peak of the error counts as one of the alternation if it is at least this part of the largest.
PEAK = 0.95
#: Price of a broken constraint in the proof.
PENALTY = 30.0


@dataclass(frozen=True)
class Certificate:
    """How good n guides are.

    Attributes
    ----------
    gap : ndarray, shape (n,)
        What moves within `REGION` could at most still take away from the cost, to first order: of a deviation as a
        part of it, of a score as a part of the desirability, else in strokes and right angles.  0 where the guide is
        stationary; NaN where the path returns, where it is exact but for rounding and the
        deviation is ranked, and where nothing was proved.
    alternations : ndarray of int, shape (n,)
        Peaks of the error of alternating sign, ends of the stroke included; 0 without a gap.
    """

    gap: Array
    alternations: Array


def certified(
    problem: Problem, found: CandidateBatch, moves: Parametrisation | None = None, nominal: Nominal | None = None
) -> Certificate:
    """Return the certificates of placed guides."""
    guides = found.curve
    exact = found.traced.relative <= EXACT
    some = np.flatnonzero(
        ~guides.cusp & np.isfinite(found.deviation) & ~(exact & (problem.ranking.only == "deviation"))
    )
    gap, count = np.full(len(found), np.nan), np.zeros(len(found), int)
    if len(some):
        with np.errstate(all="ignore"):
            linear = linearise(problem, found[some], guides[some], moves or PivotCoordinates(), nominal)
            step = take_step(linear, np.full(len(some), REGION), np.full(len(some), PENALTY), margin=0.0)
            gap[some] = np.maximum(step.bound, 0.0)
        count[some] = np.where(exact[some], 0, alternations(linear.error))
    return Certificate(gap, count)


def alternations(error: Array) -> Array:
    """Return how many peaks of errors (n, m) along paths alternate at the largest error, shape (n,)."""
    large = np.abs(error) >= PEAK * np.abs(error).max(1, keepdims=True)
    count, last = np.zeros(len(error), int), np.zeros(len(error))
    for at, sign in zip(large.T, np.sign(error).T, strict=True):
        new = at & (sign != last)
        count += new
        last = np.where(new, sign, last)
    return count
