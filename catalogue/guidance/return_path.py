"""Return paths of guided points, the driving crank turning on, and their lift."""

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

#: Positions over the turn; a parabola through three of them leaves 1e-6 of the lift of a
#: crank-rocker open.
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
        n guides as they stand in mid-stroke, traced over the stroke.
    positions : int
        How many positions of the turn are read.

    Returns
    -------
    ndarray, shape (n,)
        Largest distance of the coupler curve from the line or circle [length of the guides]; NaN
        where no crank drives through a full turn.
    """
    linkage, fit = guides.linkage, traced.fit
    found = np.full(len(guides), np.nan)
    turning = np.flatnonzero((measures.rotates & measures.driver) > 0)  # the bit of a crank is its number
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
    with np.errstate(all="ignore"):  # a place opposite the top of the arc, from which it is seen, is nowhere along it
        return polar(w.real, w.imag - nominal.rise, nominal.curvature)[0]


def peak(values: Floats) -> Floats:
    """Return the largest of periodic values (m, n), read off a parabola, shape (n,)."""
    at = np.argmax(values, axis=0)
    column = np.arange(values.shape[1])
    before, here, after = (values[(at + k) % len(values), column] for k in (-1, 0, 1))
    bend = before - 2 * here + after
    with np.errstate(all="ignore"):
        above = -0.125 * (after - before) ** 2 / bend
    return np.asarray(here + np.where(np.isfinite(above), np.clip(above, 0.0, here), 0.0))
