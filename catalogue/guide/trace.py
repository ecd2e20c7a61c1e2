"""Measure guides on their finite motion: path over a window, splitting of the inflections, best line or circle.

`trace` knows nothing of series: it is given linkages, guided points and half strokes, and measures.  With `split` the
guided point is first moved off its singular point so that the merged inflections separate, which divides the
deviation by four (two inflections) to sixteen (four): the shift makes the first Chebyshev coefficients of the error
vanish, in the sense of least squares, so that what remains is nearly a single Chebyshev polynomial
(Allievi 1895, secs. 27-31; the rule delta = 2 c4 h^2 r*^2 is its limit for a short stroke).
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from ..linkage import Array
from .minimax import Fit, fit, grid, resolved
from .span import Span, span

#: The guided point may move by about this part of the half stroke when its inflections are split.
LEASH = 20
ROUNDS = 2
#: A path whose error is below this part of the half stroke is exact but for rounding, and is left as it is.
STRAIGHT = 1e-11
#: Part of the half stroke by which the stroke of a guide with three inflections lies off the singular point.
OFF_CENTRE = 8**-0.5
#: What the finest grid may miss, of the deviation and of the stroke.
LEAST_SURE = (1e-2, 1e-13)


@dataclass(frozen=True)
class Traced:
    """What was measured of n guides.

    Attributes
    ----------
    fit : Fit of n
        In the frame of the linkage.
    shift : complex ndarray, shape (n,)
        Displacement of the guided point from where it was given, in the reference position [length].
    low, high : ndarray, shape (n,)
        Window of the parameter.
    """

    fit: Fit
    shift: Array
    low: Array
    high: Array

    @property
    def relative(self) -> Array:
        """Deviation over stroke."""
        with np.errstate(all="ignore"):
            return self.fit.deviation / self.fit.stroke

    def __getitem__(self, index: Any) -> Traced:
        part = Fit(*(getattr(self.fit, f.name)[index] for f in fields(Fit)))
        return Traced(part, self.shift[index], self.low[index], self.high[index])

    def replaced(self, where: Array, by: Traced) -> Traced:
        """Return this with the entries `where` (a mask) taken from `by`, which holds just those."""
        pairs = {f.name: _put(getattr(self.fit, f.name), where, getattr(by.fit, f.name)) for f in fields(Fit)}
        return Traced(
            Fit(**pairs),
            _put(self.shift, where, by.shift),
            _put(self.low, where, by.low),
            _put(self.high, where, by.high),
        )


def trace(
    guides: Span, half: Array, *, circle: bool, split: bool, centre: Array | float = 0.0, nodes: int = 32
) -> Traced:
    """Trace each guide over a window of its path and fit the nominal.

    Parameters
    ----------
    guides : Span of n
    half : ndarray, shape (n,)
        Half the length of the window along the tangent of the given point [length].
    circle : bool
        The nominal: circle or straight line.
    split : bool
        Move the guided point so that its inflections separate.
    centre : ndarray, shape (n,)
        Where the middle of the window lies, in half strokes from the reference position.
    nodes : int
        Intervals between Chebyshev points; guides that they do not resolve are traced again with twice and four times
        as many.

    Returns
    -------
    Traced
        NaN where the window leaves the extent of the guide, where the point runs backwards within it, and where the
        finest grid leaves a hundredth of the deviation open.
    """
    low, high = guides.window((centre - 1) * half, (centre + 1) * half)
    found = _measure(guides, low, high, half, circle, split, nodes)
    for more in (2, 4):
        again = np.isfinite(found.fit.deviation) & ~resolved(found.fit)
        if not again.any():
            break
        part = _measure(guides[again], low[again], high[again], half[again], circle, split, more * nodes)
        found = found.replaced(again, part)
    with np.errstate(all="ignore"):
        sure = resolved(found.fit, *LEAST_SURE)
        deviation = np.where(sure, found.fit.deviation, np.nan)
    return replace(found, fit=replace(found.fit, deviation=deviation))


def _measure(guides: Span, low: Array, high: Array, half: Array, circle: bool, split: bool, nodes: int) -> Traced:
    points = grid(nodes, half.dtype)
    u, v = guides.path.window(low, high, points.nodes)
    shift = np.zeros_like(guides.tangent)
    if split:
        cos, sin = guides.turn.window(low, high, points.nodes)
        curvature = _bend(u, v) if circle else np.zeros_like(half)
        for _ in range(ROUNDS):
            a, b = _split(u, v, cos, sin, half, curvature, points.coefficients)
            shift = shift + (a + 1j * b)
            u, v = u + cos * a - sin * b, v + cos * b + sin * a
        shift = shift * guides.tangent
    backwards = (np.diff(u, axis=0) <= 0).any(0)
    v = np.where(backwards, np.nan, v)
    found = fit(u, v, circle, points)
    base = guides.point + shift
    placed = Fit(
        found.deviation,
        found.stroke,
        base + found.start * guides.tangent,
        found.along * guides.tangent,
        found.curvature,
        found.unresolved,
    )
    return Traced(placed, shift, low, high)


def _split(
    u: Array, v: Array, cos: Array, sin: Array, half: Array, curvature: Array, to_chebyshev: Array
) -> tuple[Array, Array]:
    """Return the shift (a, b) of the guided point, along and across the tangent, that leaves the straightest path, or
    the one nearest to a circle of the given curvature.

    Least squares over the Chebyshev coefficients of the distance from the nominal, which may move and turn; the shift is
    held by a leash so that an ill-determined direction is not followed.
    """
    along = u[-1] - u[0] + 1j * (v[-1] - v[0])
    with np.errstate(all="ignore"):
        along = along / np.abs(along)
        middle = len(u) // 2
        u, v = u - u[middle], v - v[middle]
        u, v = u * along.real + v * along.imag, v * along.real - u * along.imag
        x, y = -curvature * u, 1 - curvature * v  # normal of the nominal, once divided by its length
        length = np.hypot(x, y)
        distance = (2 * v - curvature * (u * u + v * v)) / (1 + length)
        rows = (y / length, u / (half * length), (cos * x + sin * y) / length, (cos * y - sin * x) / length, distance)
        columns = np.stack([to_chebyshev @ f for f in rows])
        basis, free, target = columns[:2], columns[2:4], columns[4]
        for i in range(len(basis)):  # orthogonalise against the known part, which is well conditioned
            e = basis[i] / np.sqrt((basis[i] ** 2).sum(0))
            for group in (basis[i + 1 :], free):
                group -= (group * e).sum(1)[:, None] * e
            target = target - (target * e).sum(0) * e
        leash = (target**2).sum(0) / (LEASH * half) ** 2
        g11, g12, g22 = (free[0] ** 2).sum(0) + leash, (free[0] * free[1]).sum(0), (free[1] ** 2).sum(0) + leash
        r1, r2 = -(free[0] * target).sum(0), -(free[1] * target).sum(0)
        det = g11 * g22 - g12 * g12
        a, b = (r1 * g22 - r2 * g12) / det, (r2 * g11 - r1 * g12) / det
        step = (a + 1j * b) * along
        straight = (target**2).sum(0) <= (STRAIGHT * half) ** 2
    step = np.where(np.isfinite(step) & ~straight, step, 0)
    return step.real, step.imag


def _bend(u: Array, v: Array) -> Array:
    """Curvature of the circle through the ends and the middle of a path, positive to the left, shape (n,)."""
    chord = u[-1] - u[0] + 1j * (v[-1] - v[0])
    middle = len(u) // 2
    with np.errstate(all="ignore"):
        offset = u[middle] - 0.5 * (u[0] + u[-1]) + 1j * (v[middle] - 0.5 * (v[0] + v[-1]))
        sagitta, half = (offset * chord.conj()).imag / np.abs(chord), 0.5 * np.abs(chord)
        return np.asarray(-2 * sagitta / (sagitta**2 + half**2))


def extended(guides: Span) -> Span:
    """Return the same guides in extended precision (where the platform has it)."""
    return span(guides.linkage, guides.point, np.longdouble)


def _put(values: Array, where: Array, by: Array) -> Array:
    out = values.copy()
    out[where] = by
    return out
