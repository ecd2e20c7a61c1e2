"""Measure guides in place against a fixed nominal from (0, 0) to (stroke, 0)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..kinematics.types import Array, Complexes, Floats, Mask
from .coupler_curve import CouplerCurve
from .minimum_zone import Fit, grid, largest, rise_over
from .trace import Traced


class FixedNominal(NamedTuple):
    """Options of the measurement from a nominal in a fixed place."""

    rounds: int = 5  #: number of corrections of a window until its ends coincide with those of the nominal
    ends: float = 1e-9  #: error of the ends at which they coincide [strokes]
    #: Error of interpolation over the deviation that is accepted; otherwise the number of nodes is
    #: doubled and quadrupled.
    resolved: float = 1e-4
    away: float = 0.1  #: distance from the nominal up to which a path is followed [strokes]
    rounding: float = 1e-15  #: deviation that counts as rounding [strokes]


NOMINAL = FixedNominal()


@dataclass(frozen=True)
class Nominal:
    """A line from (0, 0) to (stroke, 0), or an arc between them above."""

    stroke: float
    radius: float = np.inf

    @property
    def centre(self) -> complex:
        """Centre of the arc; NaN for a line."""
        if not np.isfinite(self.radius):
            return complex(np.nan, np.nan)
        return complex(0.5 * self.stroke, -np.sqrt(self.radius**2 - 0.25 * self.stroke**2))

    def at(self, share: Floats) -> tuple[Complexes, Complexes]:
        """Return points at shares of the nominal, 0 to 1, and their outward unit normals."""
        if not np.isfinite(self.radius):
            places: Complexes = np.add(share * self.stroke, 0j)  # as precise as the shares
            return places, np.full(share.shape, 1j)
        turn: Complexes = np.exp(1j * np.arcsin(0.5 * self.stroke / self.radius) * (1 - 2 * share))
        return self.centre + 1j * self.radius * turn, 1j * turn

    def along(self, z: Array) -> tuple[Floats, Complexes]:
        """Project points: position of the foot, relative to the middle, and direction there."""
        if not np.isfinite(self.radius):
            return z.real - 0.5 * self.stroke, np.ones_like(z, complex)
        spoke = -1j * (z - self.centre)  # 1 in the middle of the arc
        return -self.radius * np.angle(spoke), spoke / np.abs(spoke)

    def off(self, z: Complexes) -> Floats:
        """Compute the distances of points from the nominal.

        Positive above a line and outside an arc.
        """
        if not np.isfinite(self.radius):
            return z.imag
        return np.abs(z - self.centre) - self.radius


def in_place(guides: CouplerCurve, nominal: Nominal, nodes: int = 32) -> Traced:
    """Trace guides over the nominal itself, in its frame and close to it.

    `nodes` are intervals between Chebyshev points.

    The deviation is the largest distance of the path from the nominal, over the part of the path
    whose feet on the nominal run from one end to the other. NaN where the point does not reach both
    ends, runs backwards, or leaves the nominal by a tenth of the stroke.
    """
    stroke = nominal.stroke
    onward = guides.tangent.real >= 0
    ends = np.stack([np.where(onward, x, stroke - x) for x in (0.0, stroke)])
    with np.errstate(all="ignore"):
        wanted = nominal.along(ends)[0]
        u = ((ends - guides.point) * guides.tangent.conj()).real
        for _ in range(NOMINAL.rounds):
            t = np.stack(guides.window(*np.clip(u, -guides.extent[0], guides.extent[1])))
            x, y = guides.path(t)
            now, heading = nominal.along(guides.point + (x + 1j * y) * guides.tangent)
            missing = wanted - now
            u = u + missing * (heading * guides.tangent.conj()).real
    deviation, unresolved, forward = _measure(guides, t, nominal, onward, nodes)
    for more in (2, 4):
        again = np.isfinite(deviation) & (unresolved > NOMINAL.resolved * deviation + NOMINAL.rounding * stroke)
        if not again.any():
            break
        part = _measure(guides[again], t[:, again], nominal, onward[again], more * nodes)
        deviation[again], unresolved[again], forward[again] = part
    with np.errstate(all="ignore"):
        good = forward & (np.abs(missing).max(0) < NOMINAL.ends * stroke) & (deviation < NOMINAL.away * stroke)
    deviation = np.where(good, deviation, np.nan)
    way = np.where(onward, 1.0, -1.0)
    chord, bend = np.full(len(guides), stroke), -way / nominal.radius
    fit = Fit(deviation, chord, ends[0] + 0j, way + 0j, bend, rise_over(chord, bend), unresolved)
    return Traced(fit, np.zeros(len(guides), complex), t[0], t[1])


def _measure(
    guides: CouplerCurve, t: Floats, nominal: Nominal, onward: Mask, nodes: int
) -> tuple[Floats, Floats, Mask]:
    """Compute the largest distances from the nominal, their errors, and which paths run forward."""
    points = grid(nodes)
    with np.errstate(all="ignore"):
        u, v = guides.path.window(t[0], t[1], points.nodes)
        z = guides.point + (u + 1j * v) * guides.tangent
        run, off = nominal.along(z)[0], nominal.off(z)
        forward = (np.diff(np.where(onward, run, -run), axis=0) > 0).all(0)
        return largest(np.abs(points.fine @ off)), np.abs(points.coefficients[-2:] @ off).sum(0), np.asarray(forward)
