"""Coupler curves along whole circuits, without a chart of `motion`."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple, Protocol

import numpy as np

from ..kinematics.batch import Columns
from ..kinematics.circuits import Carriers
from ..kinematics.linkage import Linkage
from ..kinematics.motion import Pose
from ..kinematics.types import Array, Complexes, Floats, Mask
from .coupler_curve import false_position
from .minimum_zone import Fit, grid, minimum_zone, resolved
from .trace import MAX_GRID_ERROR, Traced

#: Intervals between the Chebyshev points at which the deviation is measured.
NODES = 128
#: Number in place of a chart of `catalogue.kinematics.motion`, for a motion whose parameter is the
#: phase of its circuit.
CIRCUIT = 3


class MiddleOptions(NamedTuple):
    """Options of the search for the middle of a stroke, and of the forward test."""

    middle: float = 1e-14  #: relative accuracy of the middle [half strokes]
    #: Cosine of the angle to its middle direction below which a path does not run forward.
    turning: float = 0.1
    steps: int = 16  #: intervals of this test


MIDDLE = MiddleOptions()


@dataclass(frozen=True)
class CircuitMotion(Columns):
    """Motion of k linkages along their circuits, transformed by z -> scale z + shift.

    It replaces a `catalogue.kinematics.motion.Motion`; its parameter is the phase relative to mid-
    stroke, `middle`.  Arrays of shape (k,).
    """

    circuits: Any
    middle: Floats
    scale: Complexes
    shift: Complexes

    @cached_property
    def _start_pose(self) -> Pose:
        start: Pose = self.circuits.pose(self.middle[None])
        return start

    @property
    def chart(self) -> Array:
        """`CIRCUIT` in place of the numbers of charts, shape (k,)."""
        return np.full(len(self.middle), CIRCUIT)

    @property
    def origin(self) -> Complexes:
        """Points about which poses rotate, complex, shape (k,)."""
        return np.asarray(self.scale * (self._start_pose.origin + self._start_pose.d[0]) + self.shift)

    @cached_property
    def linkage(self) -> Linkage:
        """The linkages in mid-stroke."""
        return self._start_pose.linkages(self.circuits.linkage).moved(self.scale, self.shift)

    def pose(self, t: Floats) -> Pose:
        """Return the poses at phases t (m, k) from mid-stroke."""
        here, start = self.circuits.pose(self.middle + t), self._start_pose
        return Pose(self.scale * (here.d - start.d), (1 + here.x) * (1 + start.x).conj() - 1, self.origin)


@dataclass(frozen=True)
class CircuitCurve(Columns):
    """k guides on their circuits; replaces a `coupler_curve.CouplerCurve` over a known window."""

    motion: CircuitMotion
    point: Complexes  # guided points in mid-stroke

    #: None: a circuit needs no pole at its change points, which it passes smoothly.
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

    def window(self, low: Floats, high: Floats, nodes: Floats) -> tuple[Floats, Floats]:
        """Compute displacements (u, v), (m, k) each, at `nodes` (m,) of windows."""
        t = 0.5 * (high + low) + 0.5 * (high - low) * nodes[:, None]
        z = self.motion.pose(t).point(self.point) - self.point
        return z.real, z.imag


class Posed(Protocol):
    """Motion of k bodies as a function of their phases."""

    def pose(self, s: Floats) -> Pose: ...


def runs_forward(seen: Complexes, turning: float = MIDDLE.turning) -> Mask:
    """Tell which paths (m, k), with chords along the real axis, run forward.

    They must also run forward relative to their middle direction, with a cosine above `turning`.
    The test uses `MIDDLE.steps` intervals, independent of the grid.
    """
    steps = np.diff(seen[:: (len(seen) - 1) // MIDDLE.steps], axis=0)
    k = np.clip(
        (seen[:: (len(seen) - 1) // MIDDLE.steps].real < seen[[0, -1]].real.mean(0)).sum(0) - 1,
        1,
        MIDDLE.steps - 2,
    )
    tangent = sum(steps[k + i, np.arange(len(k))] for i in (-1, 0, 1))
    along = (steps * (tangent / np.abs(tangent)).conj()).real
    return np.asarray((along > turning * np.abs(steps)).all(0) & (np.diff(seen.real, axis=0) > 0).all(0))


def fitted(circuits: Posed, point: Complexes, low: Floats, high: Floats, *, circle: bool, radius: float | None) -> Fit:
    """Fit lines or circles to coupler points (k,) of circuits over windows of phases (k,).

    Straight paths run to the right, or upwards; arcs bulge to the left of their direction. NaN
    where the path turns back, or where the error on the finest grid exceeds a hundredth of the
    deviation.

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
        seen, length = (z - first) / chord, np.abs(chord)  # in the frame of the path's ends
        held = None if radius is None else -length / radius
        fit = minimum_zone(seen.real, np.where(runs_forward(seen), seen.imag, np.nan), circle, points, held)
        deviation = np.where(resolved(fit, *MAX_GRID_ERROR), fit.deviation, np.nan)
        return Fit(
            length * deviation,
            length * fit.stroke,
            first + chord * fit.start,
            chord / length * fit.along,
            fit.curvature / length,
            length * fit.rise,
            length * fit.unresolved,
        )


def on_path(circuits: Carriers, point: Complexes, low: Floats, high: Floats, fit: Fit) -> tuple[CircuitCurve, Traced]:
    """Convert fitted windows to guides at mid-stroke, in place, with their traces.

    They run in the direction of the path, against the phase where `low` of `Traced` is above
    `high`.
    """
    middle = fit.start + 0.5 * fit.stroke * fit.along

    def off(s: Floats) -> Floats:
        place = circuits.pose(s[None]).point(point)[0]
        return np.asarray(((place - middle) * fit.along.conj()).real / fit.stroke)

    with np.errstate(all="ignore"):
        ends = off(low), off(high)
        s, _ = false_position(off, low, high, *ends, np.full(len(low), MIDDLE.middle), steps=60)
    back = ends[0] > 0
    a, b = np.where(back, high, low), np.where(back, low, high)
    moving = CircuitMotion(circuits, s, np.ones(len(s), complex), np.zeros(len(s), complex))
    guided = circuits.pose(s[None]).point(point)[0]
    return CircuitCurve(moving, guided), Traced(fit, 0 * guided, a - s, b - s)


def move_to_unit(curve: CircuitCurve, traced: Traced) -> tuple[CircuitCurve, Traced]:
    """Move guides so that their paths run from 0 to 1, with their traces."""
    fit, n = traced.fit, len(curve)
    scale: Complexes = fit.stroke * fit.along
    with np.errstate(all="ignore"):
        moving = replace(curve.motion, scale=1 / scale, shift=-fit.start / scale)
        carried = Fit(
            fit.deviation / fit.stroke,
            np.ones(n),
            np.zeros(n, complex),
            np.ones(n, complex),
            fit.curvature * fit.stroke,
            fit.rise / fit.stroke,
            fit.unresolved / fit.stroke,
        )
        return CircuitCurve(moving, (curve.point - fit.start) / scale), replace(traced, fit=carried)
