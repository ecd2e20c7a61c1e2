"""Certificates of refined guides: the gap to a stationary point, by duality, and the drift.

The drift is the distance of a guide from the series of its start.

The linearised problem is  min c y  over steps |s_k| <= r and measures y, subject to rows (s, y) <=
right.  Any multipliers of the rows that balance the cost of the measures prove the bound

    min c y >= - right . multipliers - r |rows_s' multipliers|_1,

and the best ones make this exact.  The gap is the present cost less this bound: 0 exactly where the
guide is stationary.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ..candidates.batch import CandidateBatch
from ..candidates.feasibility import EXACT_DEVIATION
from ..curvature_theory.instant import Instant
from ..errors import PluginError
from ..guidance.minimum_zone import grid
from ..kinematics.linkage import Linkage
from ..kinematics.types import Array, Floats
from ..problem.problem import Problem
from ..series.series import Series
from .step import take_step
from .subproblem import Parametrisation, PivotCoordinates, linearise


class CertificateOptions(NamedTuple):
    """Region and resolution of the certificate."""

    #: Largest moves for which the bound holds [unit of each coordinate, a distance from the guided
    #: point].
    region: float = 0.01
    #: Part of the largest error above which a peak counts as an extremum of the alternation.
    peak: float = 0.95
    penalty: float = 30.0  #: weight of a violated constraint in the proof
    instants: int = 64  #: number of intervals between the stations of the stroke


PROOF = CertificateOptions()


@dataclass(frozen=True)
class Certificate:
    """Quality of n guides; arrays of shape (n,).

    The gap bounds, to first order, the further reduction of the cost by moves within
    `PROOF.region`: relative for a deviation or a desirability, else in strokes and right angles. It
    is 0 where the guide is stationary. It is NaN where the path returns, where nothing was proved,
    and for exact guides ranked by deviation.
    """

    gap: Floats
    alternations: Array  #: number of alternating peaks of the error, ends of the stroke included; 0 without a gap


def certified(problem: Problem, found: CandidateBatch, moves: Parametrisation | None = None) -> Certificate:
    """Return the certificates of placed guides."""
    guides = found.curve
    exact = found.traced.relative <= EXACT_DEVIATION
    some = np.flatnonzero(
        ~guides.cusp & np.isfinite(found.deviation) & ~(exact & (problem.ranking.only == "deviation"))
    )
    gap, count = np.full(len(found), np.nan), np.zeros(len(found), int)
    if len(some):
        with np.errstate(all="ignore"):
            linear = linearise(problem, found[some], guides[some], moves or PivotCoordinates())
            step = take_step(linear, np.full(len(some), PROOF.region), np.full(len(some), PROOF.penalty), margin=0.0)
            gap[some] = np.maximum(step.bound, 0.0)
        count[some] = np.where(exact[some], 0, alternations(linear.error))
    return Certificate(gap, count)


def alternations(error: Floats) -> Array:
    """Count the peaks of errors (n, m) along paths that alternate at the largest error, (n,)."""
    large = np.abs(error) >= PROOF.peak * np.abs(error).max(1, keepdims=True)
    count, last = np.zeros(len(error), int), np.zeros(len(error))
    for at, sign in zip(large.T, np.sign(error).T, strict=True):
        new = at & (sign != last)
        count += new
        last = np.where(new, sign, last)
    return count


class Drifts:
    """Drifts of refined answers from their series, measured on first use.

    `series` is a function that returns the series by code, as this loads the plugins.
    """

    def __init__(self, found: CandidateBatch, series: Callable[[], Mapping[str, Series]], slots: bool = False) -> None:
        self._asked = found, series, slots

    @cached_property
    def least(self) -> Floats:
        """Least residuals of the guides' own series, shape (n,)."""
        found, series, slots = self._asked
        return drift(found, series(), slots)

    def __getstate__(self) -> dict[str, Any]:
        """Return the measured values, which copies and pickles hold."""
        return {"least": self.least}


def drift(found: CandidateBatch, series: Mapping[str, Series], slots: bool = False) -> Floats:
    """Return the least residual of each guide's own series over its stroke, shape (n,).

    Linkages with slots are inverted. NaN where the series is not registered, and for cognates,
    which belong to another one.
    """
    n, t = len(found), found.traced.parameters(grid(PROOF.instants).nodes)
    pose = found.curve.motion.pose(t)
    pivots = np.empty((len(t), n, 2, 2, 3))
    pivots[...] = found.linkage.pivots
    for i in (0, 1):
        at = pose.pivot(found.linkage, i)
        pivots[:, :, i, 1, 0], pivots[:, :, i, 1, 1] = at.real, at.imag
    least = np.full(n, np.nan)
    codes = found.origin.series.astype(str)
    for code in np.unique(codes):
        of = np.flatnonzero(codes == code)
        if code not in series:
            continue
        linkage, good = Linkage.valid(pivots[:, of].reshape(-1, 2, 2, 3))
        with np.errstate(all="ignore"):
            residual = np.full(len(good), np.nan)
            with suppress(PluginError):  # NaN for a plugin that fails; `classify` reports its error
                residual[good], _ = series[str(code)].residuals(Instant(linkage.inverted() if slots else linkage))
        least[of] = np.fmin.reduce(residual.reshape(len(t), len(of)), axis=0)
    return np.where(found.origin.cognate != 0, np.nan, least)
