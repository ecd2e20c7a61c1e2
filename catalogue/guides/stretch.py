"""A stretch of the motion of a given linkage."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from ..guidance.circuit_curve import fitted, on_path
from ..kinematics.circuits import circuits
from .candidate import Candidate
from .columns import STRETCH

if TYPE_CHECKING:
    from ..guidance.circuit_curve import CircuitCurve
    from ..guidance.trace import Traced


@dataclass(frozen=True, repr=False)
class Stretch(Candidate):
    """A stretch of the motion of a given linkage, in the position at its middle.

    Attributes
    ----------
    number : int
        Number of the given linkage, from 1.
    circuit, given, joined : int, bool, bool
        Number of the circuit, see `PlacedGuide.circuits`; whether it is that of the given position;
        whether the two circuits cross at change points.  To reach another circuit that is not
        joined, the linkage must be taken apart.
    drive_from, drive_to : float or None
        Angle of the driving crank from the x axis at the start of the path, -180 to 180, and at its
        end, counted from the start: less if the crank turns clockwise [deg]; None without a crank.
    nearest_series, residual : str or None, float or None
        The nearest degenerate series on the stretch, and its residual; see `Membership`.

    Examples
    --------
    >>> from catalogue import guide
    >>> watt = guide([[[-50, 30], [0, 30]], [[50, -30], [0, -30]]], (0, 0))
    >>> best = watt.measure(stroke=50)[0]
    >>> best.given, round(best.deviation, 3)
    (True, 0.147)
    """

    number: int = 1
    circuit: int = 1
    given: bool = True
    joined: bool = False
    drive_from: float | None = None
    drive_to: float | None = None
    nearest_series: str | None = None
    residual: float | None = None
    _window: tuple[float, float] = field(default=(0.0, 0.0), repr=False)
    meanings = STRETCH
    __hash__ = Candidate.__hash__

    def _traced(self) -> tuple[CircuitCurve, Traced]:
        """Trace the guide on its circuit over the stretch, in place."""
        if self.is_wide and self.radius is not None and self.arc_angle is not None:
            return self._along_wide_arc(self.radius, self.arc_angle)
        found = circuits(self.linkage)[:1]
        low, high = (found.phase + t for t in self._window)
        point = np.array([complex(*self.guided)])
        fit = fitted(found, point, low, high, circle=self.radius is not None, radius=self.radius)
        return on_path(found, point, low, high, fit)
