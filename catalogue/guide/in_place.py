"""Measure guides where they stand, against a nominal that does not move: it runs from (0, 0) to (stroke, 0)."""

from __future__ import annotations

import numpy as np

from ..linkage import Array
from .minimax import Fit, grid
from .span import Span
from .trace import Traced

#: Corrections of a window until its ends are those of the nominal.
ROUNDS = 5
#: Part of the stroke up to which they are.
ENDS = 1e-9
#: A path that leaves the nominal farther than this part of the stroke is not followed.
AWAY = 0.1


def in_place(guides: Span, stroke: float, radius: float = np.inf, nodes: int = 32) -> Traced:
    """Return the guides traced over the nominal itself: a line, or an arc that bulges to +y.

    Its deviation is the largest distance of the path from that line or arc, over the part of the path whose feet on it
    run from one end to the other.

    Parameters
    ----------
    guides : Span of n
        In the frame of the nominal, near which they stand in the reference position.
    stroke : float
        Length of the line or chord of the arc.
    radius : float
        Of the arc; infinite for a line.
    nodes : int
        Intervals between Chebyshev points.

    Returns
    -------
    Traced
        NaN where the point does not run from one end to the other, or runs backwards, or leaves the nominal by a tenth
        of the stroke.
    """
    onward = guides.tangent.real >= 0
    ends = np.stack([np.where(onward, x, stroke - x) for x in (0.0, stroke)])
    with np.errstate(all="ignore"):
        wanted = along(ends, stroke, radius)[0]
        u = ((ends - guides.point) * guides.tangent.conj()).real
        for _ in range(ROUNDS):
            t = np.stack(guides.window(*np.clip(u, -guides.extent[0], guides.extent[1])))
            now, heading = along(guides.point + _moved(guides, t), stroke, radius)
            missing = wanted - now
            u = u + missing * (heading * guides.tangent.conj()).real
        points = grid(nodes)
        a, b = guides.path.window(t[0], t[1], points.nodes)
        z = guides.point + (a + 1j * b) * guides.tangent
        run, _ = along(z, stroke, radius)
        off = distance(z, stroke, radius)
        deviation = _largest(points.fine @ off)
        forward = (np.diff(np.where(onward, run, -run), axis=0) > 0).all(0)
        good = forward & (np.abs(missing).max(0) < ENDS * stroke) & (deviation < AWAY * stroke)
        unresolved = np.abs(points.coefficients[-2:] @ off).sum(0)
    deviation = np.where(good, deviation, np.nan)
    way = np.where(onward, 1.0, -1.0)
    curvature = np.where(np.isfinite(radius), -way / radius, 0.0)
    fit = Fit(deviation, np.full(len(guides), stroke), ends[0] + 0j, way + 0j, curvature, unresolved)
    return Traced(fit, np.zeros(len(guides), complex), t[0], t[1])


def centre_of(stroke: float, radius: float) -> complex:
    """Return the centre of an arc that bulges to +y."""
    return complex(0.5 * stroke, -np.sqrt(radius * radius - 0.25 * stroke * stroke))


def along(z: Array, stroke: float, radius: float) -> tuple[Array, Array]:
    """Return how far along the nominal the feet of points are, from its middle, and its direction there."""
    if not np.isfinite(radius):
        return z.real - 0.5 * stroke, np.ones_like(z, complex)
    spoke = -1j * (z - centre_of(stroke, radius))  # 1 in the middle
    return -radius * np.angle(spoke), spoke / np.abs(spoke)


def distance(z: Array, stroke: float, radius: float) -> Array:
    """Return how far points stand above the nominal; on the outside of an arc."""
    if not np.isfinite(radius):
        return z.imag
    return np.abs(z - centre_of(stroke, radius)) - radius


def nominal(share: Array, stroke: float, radius: float) -> tuple[Array, Array]:
    """Return points of the nominal, from 0 (start) to 1 (end), and unit vectors across it, outward from the centre."""
    if not np.isfinite(radius):
        return share * stroke + 0j, np.full(share.shape, 1j)
    turn = np.exp(1j * np.arcsin(0.5 * stroke / radius) * (1 - 2 * share))
    return centre_of(stroke, radius) + 1j * radius * turn, 1j * turn


def _moved(guides: Span, t: Array) -> Array:
    u, v = guides.path(t)
    return np.asarray((u + 1j * v) * guides.tangent)


def _largest(values: Array) -> Array:
    """Largest absolute value of interpolated ones, extremes between the points read off a parabola."""
    size = np.abs(values)
    k = np.argmax(size, axis=0)[None]
    inner = np.clip(k, 1, len(values) - 2)
    at, low, high = (np.take_along_axis(size, inner + i, 0)[0] for i in (0, -1, 1))
    bend = low - 2 * at + high
    gain = np.where((bend < 0) & (inner == k)[0], -((high - low) ** 2) / (8 * np.where(bend == 0, 1, bend)), 0)
    return np.asarray(np.take_along_axis(size, k, 0)[0] + gain)
