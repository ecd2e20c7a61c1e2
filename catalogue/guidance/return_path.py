"""Return paths of guided points while the driving crank completes its turn, and their lift."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..kinematics.circuits import TURN, circuits
from ..kinematics.types import Complexes, Floats
from .coupler_curve import CouplerCurve
from .metrics import Measures
from .minimum_zone import Fit, polar
from .trace import Traced

if TYPE_CHECKING:
    from .circuit_curve import CircuitCurve

#: Number of positions over the turn; with a parabola through three of them the error of the lift of
#: a crank-rocker is 1e-6.
POSITIONS = 360


def lift(
    guides: CouplerCurve | CircuitCurve,
    traced: Traced,
    measures: Measures,
    positions: int = POSITIONS,
) -> Floats:
    """Measure how far guided points lift off their nominal over the turn of the driving crank.

    Parameters
    ----------
    guides, traced, measures
        n guides in mid-stroke, traced over the stroke.
    positions : int
        Number of sampled positions of the turn.

    Returns
    -------
    ndarray, shape (n,)
        Largest distance of the coupler curve from the line or circle [length of the guides]; NaN
        where no crank drives through a full turn.
    """
    linkage, fit = guides.linkage, traced.fit
    found = np.full(len(guides), np.nan)
    # bit values 1 and 2 are the numbers of the cranks
    turning = np.flatnonzero((measures.rotates & measures.driver) > 0)
    if not len(turning):
        return found
    some = circuits(linkage[turning])
    some = some[np.flatnonzero(np.isfinite(some.phase) & (some.kind == TURN))]
    of = turning[some.of]
    share = np.arange(positions)[:, None] / positions
    point = (guides.point + traced.shift)[of]
    with np.errstate(all="ignore"):
        z = some.pose(some.phase + share * some.period).point(point)
        off = distance(z, fit[of])
        found[of] = peak(np.abs(off))
    return found


def distance(z: Complexes, nominal: Fit) -> Floats:
    """Compute signed distances of points (m, n) from lines and circles (n,), left positive."""
    w = (z - nominal.start) * nominal.along.conj() - 0.5 * nominal.stroke
    # the place opposite the top of the arc, from which positions are measured, has no position
    with np.errstate(all="ignore"):
        return polar(w.real, w.imag - nominal.rise, nominal.curvature)[0]


def peak(values: Floats) -> Floats:
    """Return the largest of periodic values (m, n), interpolated by a parabola, shape (n,)."""
    at = np.argmax(values, axis=0)
    column = np.arange(values.shape[1])
    before, here, after = (values[(at + k) % len(values), column] for k in (-1, 0, 1))
    bend = before - 2 * here + after
    with np.errstate(all="ignore"):
        above = -0.125 * (after - before) ** 2 / bend
    return np.asarray(here + np.where(np.isfinite(above), np.clip(above, 0.0, here), 0.0))
