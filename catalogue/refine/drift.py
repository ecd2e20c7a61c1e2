"""How far refined linkages have drifted from the series of their ancestors."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any

import numpy as np

from ..candidates.batch import CandidateBatch
from ..curvature_theory.instant import Instant
from ..guide.minimum_zone import grid
from ..kinematics.linkage import Linkage
from ..kinematics.types import Array
from ..series.series import Series

#: Intervals between the instants of the stroke that are looked at.
INSTANTS = 64


class Drifts:
    """How far refined answers have drifted from their series; measured when first asked for, as it takes the plugins.

    Parameters
    ----------
    found : CandidateBatch of n
    series : callable
        Returns the series that are registered, by code.
    slots : bool
        The guides are slots.
    """

    def __init__(self, found: CandidateBatch, series: Callable[[], Mapping[str, Series]], slots: bool = False) -> None:
        self._asked = found, series, slots

    @cached_property
    def least(self) -> Array:
        """Least residuals of the guides' own series, shape (n,)."""
        found, series, slots = self._asked
        return drift(found, series(), slots)

    def __getstate__(self) -> dict[str, Any]:
        """What is copied or pickled is what was measured."""
        return {"least": self.least}


def drift(found: CandidateBatch, series: Mapping[str, Series], slots: bool = False) -> Array:
    """Return the least residual of each guide's own series over its stroke, shape (n,).

    NaN where the series is not registered, and for cognates, which are of another one.

    Parameters
    ----------
    slots : bool
        The guides are slots: their linkages are the inverse ones.
    """
    n, nodes = len(found), grid(INSTANTS).nodes
    moving = found.curve.motion
    low, high = found.traced.low.astype(float), found.traced.high.astype(float)
    t = 0.5 * (high + low) + 0.5 * (high - low) * nodes[:, None]
    d, x = moving.pose(t)
    z, finite = found.linkage.points, found.linkage.finite
    pivots = np.empty((len(t), n, 2, 2, 3))
    pivots[...] = found.linkage.pivots
    for i in (0, 1):
        at = z[:, i, 1] + d + x * (z[:, i, 1] - moving.origin)
        at = np.where(finite[:, i, 1], at, z[:, i, 1] * (1 + x))
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
            residual[good] = series[str(code)].classify(Instant(linkage.inverted() if slots else linkage))[0]
        least[of] = np.fmin.reduce(residual.reshape(len(t), len(of)), axis=0)
    return np.where(found.origin.cognate != 0, np.nan, least)
