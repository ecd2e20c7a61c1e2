"""Guides on their circuits, laid along a path: what measures are read from where no chart of `motion` is known."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..kinematics.batch import Columns
from ..kinematics.circuits import Circuits
from ..kinematics.linkage import Linkage
from ..kinematics.motion import Pose
from ..kinematics.types import Array, Complexes, Floats, Mask
from .coupler_curve import false_position
from .minimum_zone import Fit, grid, minimum_zone, resolved
from .trace import LEAST_SURE, Traced

#: Intervals between the Chebyshev points at which the deviation is measured.
NODES = 128
#: Part of half a stroke to which its middle is known.
MIDDLE = 1e-14


@dataclass(frozen=True)
class CircuitMotion(Columns):
    """Motion of k linkages along their circuits, carried by similarities z -> scale z + shift: as a
    `catalogue.kinematics.motion.Motion`, its parameter the phase from that of mid-stroke, `middle`; arrays of shape
    (k,)."""

    circuits: Circuits
    middle: Floats
    scale: Complexes
    shift: Complexes

    @cached_property
    def _start(self) -> Pose:
        return self.circuits.pose(self.middle[None])

    @property
    def origin(self) -> Complexes:
        """About which poses turn, shape (k,)."""
        return np.asarray(self.scale * (self._start.origin + self._start.d[0]) + self.shift)

    @cached_property
    def linkage(self) -> Linkage:
        """The linkages in mid-stroke."""
        return self._start.linkages(self.circuits.linkage).moved(self.scale, self.shift)

    def pose(self, t: Floats) -> Pose:
        """Return the poses at phases t (m, k) from mid-stroke."""
        here, start = self.circuits.pose(self.middle + t), self._start
        return Pose(self.scale * (here.d - start.d), (1 + here.x) * (1 + start.x).conj() - 1, self.origin)


@dataclass(frozen=True)
class CircuitCurve(Columns):
    """k guides on their circuits: as a `catalogue.guide.coupler_curve.CouplerCurve`, but nothing is sought on it."""

    motion: CircuitMotion
    point: Complexes  # guided, in mid-stroke

    def __len__(self) -> int:
        return len(self.point)

    @property
    def linkage(self) -> Linkage:
        return self.motion.linkage

    @property
    def cusp(self) -> Mask:
        return np.zeros(len(self), bool)

    @property
    def tangent(self) -> Complexes:
        """Axis along which the path is given, shape (k,)."""
        return np.ones(len(self), complex)

    @property
    def path(self) -> CircuitCurve:
        return self

    def window(self, low: Array, high: Array, nodes: Array) -> tuple[Floats, Floats]:
        """Return the displacement (u, v), each (m, k), at the `nodes` (m,) of [-1, 1] carried to [low, high], (k,)."""
        t = 0.5 * (high + low) + 0.5 * (high - low) * nodes[:, None]
        z = self.motion.pose(t).point(self.point) - self.point
        return z.real, z.imag


def on_path(
    circuits: Circuits, point: Complexes, low: Floats, high: Floats, *, circle: bool, radius: float | None
) -> tuple[CircuitCurve, Traced, Complexes, Complexes, Mask]:
    """Return coupler points (k,) of circuits, given with the linkages, over windows of phases (k,) as guides in
    mid-stroke, carried so that the path runs from 0 to 1, arcs bulging to +y; what is traced there; scale and shift of
    the similarities that carry the path to where it lies, (k,); and which run against the phase.

    Straight paths run to the right where they lie, or upwards.  NaN where the path turns back, or the finest grid
    leaves a hundredth of the deviation open.

    Parameters
    ----------
    circle : bool
        Fit circles, of the `radius` that is given [length] or of any.
    """

    def places(s: Floats) -> Complexes:
        return np.asarray(circuits.pose(s).point(point))

    points = grid(NODES)
    with np.errstate(all="ignore"):
        z = places(0.5 * (high + low) + 0.5 * (high - low) * points.nodes[:, None])
        bulge = (((z[NODES // 2] - z[0]) / (z[-1] - z[0])).imag) if circle else np.zeros(len(low))
        chord = z[-1] - z[0]
        back = bulge < 0 if circle else (chord.real < 0) | ((chord.real == 0) & (chord.imag < 0))
        z = np.where(back, z[::-1], z)
        first, chord = z[0], z[-1] - z[0]
        # in the frame of its ends
        seen = (z - first) / chord
        held = None if radius is None else -np.abs(chord) / radius
        forward = (np.diff(seen.real, axis=0) > 0).all(0)
        fit: Fit = minimum_zone(seen.real, np.where(forward, seen.imag, np.nan), circle, points, held)
        fit = replace(fit, deviation=np.where(resolved(fit, *LEAST_SURE), fit.deviation, np.nan))
        turn = fit.stroke * fit.along
        scale, shift = chord * turn, first + chord * fit.start
        middle = shift + 0.5 * scale

        def off(s: Floats) -> Floats:
            return np.asarray(((places(s[None])[0] - middle) / scale).real)

        a, b = np.where(back, high, low), np.where(back, low, high)
        s = false_position(off, a, b, off(a), off(b), np.full(len(a), MIDDLE), steps=60)
        moving = CircuitMotion(circuits, s, 1 / scale, -shift / scale)
        guided = (places(s[None])[0] - shift) / scale
    laid = Fit(
        fit.deviation / fit.stroke, np.ones(len(s)), np.zeros(len(s), complex), np.ones(len(s), complex),
        fit.curvature * fit.stroke, fit.unresolved / fit.stroke,
    )  # fmt: skip
    return CircuitCurve(moving, guided), Traced(laid, 0 * guided, a - s, b - s), scale, shift, back


def ends(curve: CircuitCurve, traced: Traced) -> Linkage:
    """Return the linkages at the start and at the end of the path, 2 k of them."""
    return curve.motion.pose(np.stack([traced.low, traced.high]).astype(float)).linkages(curve.linkage)
