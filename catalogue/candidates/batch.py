"""Batches of candidates: guides that stand along the path of a problem, with what was measured of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..guidance.coupler_curve import CouplerCurve, coupler_curve
from ..guidance.metrics import Measures
from ..guidance.trace import Traced
from ..kinematics.batch import Rows, put
from ..kinematics.linkage import Linkage
from ..kinematics.types import Array, Complexes, Floats


@dataclass(frozen=True)
class Origin(Rows):
    """Where n candidates come from: arrays of shape (n,), what they say is of the ancestor at its design position."""

    id: Array  # of the stored guide; -1 where there is none
    family: Array
    series: Array
    configuration: Array
    order: Array  # of contact, 99 if exact
    cognate: Array  # 0, or which of the two cognates of the ancestor it is

    @classmethod
    def made(cls, linkage: Linkage, series: str, order: Array | int = 2) -> Origin:
        """Return the origin of linkages that were made, not stored."""
        n = len(linkage)
        code, blank = (np.full(n, text, dtype=object) for text in (series, ""))
        orders, zero = np.broadcast_to(order, n).copy(), np.zeros(n, int)
        return cls(zero - 1, linkage.family.astype(object), code, blank, orders, zero)


@dataclass(frozen=True)
class CandidateBatch(Rows):
    """n guides laid along the path from 0 to 1, in mid-stroke; lengths in strokes, arrays of shape (n,).

    The allowance is the standard deviation of every coordinate of every pivot and of the guided point at which the path
    still stays within the deviation asked: (asked - deviation) / (2 rms), rms the displacement across the path where it
    is largest per unit of that scatter, to first order.  Negative where the deviation is too large, NaN for points that
    return, and where nobody asked for it.
    """

    origin: Origin
    linkage: Linkage
    point: Complexes  # guided points in mid-stroke
    pole: Complexes  # there; tells the branch of a linkage at a change point, NaN where it is not known
    chart: Array  # of the motion, whose parameter the traces are in
    traced: Traced  # the path over the stroke and its nominal
    measures: Measures
    allowance: Floats

    def __len__(self) -> int:
        return len(self.point)

    def replaced(self, where: Array, by: CandidateBatch) -> CandidateBatch:
        """Return these with the entries `where`, a mask or indices, from `by`, which holds just those."""
        return put(self, where, by)

    @property
    def deviation(self) -> Floats:
        """Deviations, shape (n,) [strokes]."""
        return np.asarray(self.traced.fit.deviation.astype(float))

    @cached_property
    def curve(self) -> CouplerCurve:
        """The guides ready to be traced from mid-stroke."""
        return coupler_curve(self.linkage, self.point, pole=self.pole, chart=self.chart)
