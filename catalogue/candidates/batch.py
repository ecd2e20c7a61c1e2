"""Batches: records, or columns by name, whose arrays run over the same n things, taken apart and put together again;
among them that of candidates: guides that stand along the path of a problem, with what was measured of them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeVar, cast

import numpy as np

from ..guide.coupler_curve import CouplerCurve, coupler_curve
from ..guide.metrics import Measures
from ..guide.trace import Traced
from ..kinematics.batch import mapped
from ..kinematics.linkage import Linkage
from ..kinematics.types import Array, Complexes, Floats

T = TypeVar("T")


def take(batch: T, index: Any) -> T:
    """Return the chosen ones of a batch: an array, a `Linkage`, None, or a dataclass or dict of these."""
    return cast(T, mapped(lambda values: values[index], batch))


def join(*batches: T) -> T:
    """Return the things of all batches, one after the other."""
    return cast(T, mapped(lambda *values: np.concatenate(values), *batches))


def put(batch: T, where: Array, by: T) -> T:
    """Return a batch with the entries `where`, a mask or indices, taken from `by`, which holds just those."""

    def replaced(values: Array, new: Array) -> Array:
        out = values.astype(np.result_type(values, new)) if values.dtype != object else values.copy()
        out[where] = new
        return out

    return cast(T, mapped(replaced, batch, by))


@dataclass(frozen=True)
class Origin:
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
class CandidateBatch:
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

    def __getitem__(self, index: Any) -> CandidateBatch:
        return take(self, index)

    def replaced(self, where: Array, by: CandidateBatch) -> CandidateBatch:
        """Return these with the entries `where`, a mask or indices, from `by`, which holds just those."""
        return put(self, where, by)

    def followed_by(self, *others: CandidateBatch) -> CandidateBatch:
        """Return these and then the others."""
        return join(self, *others)

    @property
    def deviation(self) -> Floats:
        """Deviations, shape (n,) [strokes]."""
        return np.asarray(self.traced.fit.deviation.astype(float))

    @cached_property
    def curve(self) -> CouplerCurve:
        """The guides ready to be traced from mid-stroke."""
        return coupler_curve(self.linkage, self.point, pole=self.pole, chart=self.chart)

    def with_(self, **changes: Any) -> CandidateBatch:
        """Return these with some fields changed."""
        return replace(self, **changes)
