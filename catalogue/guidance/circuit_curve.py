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
#: What stands for the chart of a motion whose parameter is the phase of its circuit, see `catalogue.kinematics.motion`.
CIRCUIT = 3
#: Part of half a stroke to which its middle is known.
MIDDLE = 1e-14
#: Cosine of the angle to its middle at which a path no longer runs forward; on so many intervals.
TURNING, STEPS = 0.1, 16


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
    def chart(self) -> Array:
        """What stands for a chart, shape (k,)."""
        return np.full(len(self.middle), CIRCUIT)

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
    """k guides on their circuits: as a `catalogue.guidance.coupler_curve.CouplerCurve`, but nothing is sought on it."""

    motion: CircuitMotion
    point: Complexes  # guided, in mid-stroke

    #: None is needed: a circuit passes its change points straight.
    pole = None

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


def runs_forward(seen: Complexes, turning: float = TURNING) -> Mask:
    """Return which paths (m, k), seen at Chebyshev points with their chords along the real axis, run forward along
    these, and with a cosine above `turning` to their direction in the middle; the latter on `STEPS` intervals, so that
    it does not depend on the grid."""
    steps = np.diff(seen[:: (len(seen) - 1) // STEPS], axis=0)
    k = np.clip((seen[:: (len(seen) - 1) // STEPS].real < seen[[0, -1]].real.mean(0)).sum(0) - 1, 1, STEPS - 2)
    tangent = sum(steps[k + i, np.arange(len(k))] for i in (-1, 0, 1))
    along = (steps * (tangent / np.abs(tangent)).conj()).real
    return np.asarray((along > turning * np.abs(steps)).all(0) & (np.diff(seen.real, axis=0) > 0).all(0))


def fitted(
    circuits: Circuits, point: Complexes, low: Floats, high: Floats, *, circle: bool, radius: float | None
) -> Fit:
    """Return the best lines or circles of coupler points (k,) of circuits, given with the linkages, over windows of
    phases (k,), either end first.

    Straight paths run to the right, or upwards; arcs bulge to the left of their way.  NaN where the path turns back,
    or the finest grid leaves a hundredth of the deviation open.

    Parameters
    ----------
    circle : bool
        Fit circles, of the `radius` that is given [length] or of any.
    """
    points = grid(NODES)
    with np.errstate(all="ignore"):
        z = circuits.pose(0.5 * (high + low) + 0.5 * (high - low) * points.nodes[:, None]).point(point)
        chord = z[-1] - z[0]
        back = (chord.real < 0) | ((chord.real == 0) & (chord.imag < 0))
        if circle:
            back = ((z[NODES // 2] - z[0]) / chord).imag < 0
        z = np.where(back, z[::-1], z)
        first, chord = z[0], z[-1] - z[0]
        seen, length = (z - first) / chord, np.abs(chord)  # in the frame of its ends
        held = None if radius is None else -length / radius
        fit = minimum_zone(seen.real, np.where(runs_forward(seen), seen.imag, np.nan), circle, points, held)
        deviation = np.where(resolved(fit, *LEAST_SURE), fit.deviation, np.nan)
        return Fit(
            length * deviation, length * fit.stroke, first + chord * fit.start, chord / length * fit.along,
            fit.curvature / length, length * fit.rise, length * fit.unresolved,
        )  # fmt: skip


def on_path(circuits: Circuits, point: Complexes, low: Floats, high: Floats, fit: Fit) -> tuple[CircuitCurve, Traced]:
    """Return the points as guides in mid-stroke where they stand, and what is traced there, over windows that were
    fitted; in the direction of the path, against the phase where `low` of `Traced` is above `high`."""
    middle = fit.start + 0.5 * fit.stroke * fit.along

    def off(s: Floats) -> Floats:
        place = circuits.pose(s[None]).point(point)[0]
        return np.asarray(((place - middle) * fit.along.conj()).real / fit.stroke)

    with np.errstate(all="ignore"):
        ends = off(low), off(high)
        s, _ = false_position(off, low, high, *ends, np.full(len(low), MIDDLE), steps=60)
    back = ends[0] > 0
    a, b = np.where(back, high, low), np.where(back, low, high)
    moving = CircuitMotion(circuits, s, np.ones(len(s), complex), np.zeros(len(s), complex))
    guided = circuits.pose(s[None]).point(point)[0]
    return CircuitCurve(moving, guided), Traced(fit, 0 * guided, a - s, b - s)


def laid(curve: CircuitCurve, traced: Traced) -> tuple[CircuitCurve, Traced]:
    """Return guides that stand where they stand carried so that their paths run from 0 to 1, and what is traced."""
    fit, n = traced.fit, len(curve)
    scale: Complexes = fit.stroke * fit.along
    with np.errstate(all="ignore"):
        moving = replace(curve.motion, scale=1 / scale, shift=-fit.start / scale)
        carried = Fit(
            fit.deviation / fit.stroke, np.ones(n), np.zeros(n, complex), np.ones(n, complex),
            fit.curvature * fit.stroke, fit.rise / fit.stroke, fit.unresolved / fit.stroke,
        )  # fmt: skip
        return CircuitCurve(moving, (curve.point - fit.start) / scale), replace(traced, fit=carried)
