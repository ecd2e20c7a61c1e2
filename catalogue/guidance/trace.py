"""Trace guides on their finite motion: path over a window, splitting, best line or circle.

`trace` measures any linkages, guided points and half strokes, independent of series.  With `split`
the guided point is first moved off its singular point so that the merged inflections separate,
which divides the deviation by four (two inflections) to sixteen (four): the shift makes the first
Chebyshev coefficients of the error vanish, in the sense of least squares, so that what remains is
nearly a single Chebyshev polynomial (Allievi 1895, secs. 27-31; the rule delta = 2 c4 h^2 r*^2 is
its limit for a short stroke).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ..kinematics.batch import Columns
from ..kinematics.types import Array, Complexes, Floats, Mask
from .coupler_curve import CouplerCurve, coupler_curve
from .cusped_zone import cusped_zone
from .minimum_zone import Fit, Grid, grid, minimum_zone, resolved, seen


class Splitting(NamedTuple):
    """Options of the shift of a guided point that splits its inflections."""

    leash: int = 20  #: Half stroke over the largest displacement of the point.
    rounds: int = 2  #: number of successive displacements
    #: Ratio of the errors after and before a step above which the step was too long and is retried.
    helps: float = 0.6
    short_leash: float = 0.3  #: length of the retried step over the first one
    #: Error below which a path counts as exact and its point is not moved [half strokes]: rounding.
    straight: float = 1e-11
    #: Offset of the stroke of a guide with three inflections from the singular point [half
    #: strokes].
    off_centre: float = 8**-0.5


SPLITTING = Splitting()

#: Largest error of the finest grid, relative to the deviation and to the stroke.
MAX_GRID_ERROR = (1e-2, 1e-13)


@dataclass(frozen=True)
class Traced(Columns):
    """Measurements of n guides over their windows.

    Attributes
    ----------
    fit : Fit of n
        Best line or circle, in the frame of the linkage.
    shift : ndarray, complex, shape (n,)
        Displacement of the guided point from its given place, in the reference position [length].
    low, high : ndarray, shape (n,)
        Parameters at the ends of the window.
    """

    fit: Fit
    shift: Complexes
    low: Floats
    high: Floats

    @property
    def relative(self) -> Floats:
        """Deviation over stroke."""
        with np.errstate(all="ignore"):
            return self.fit.deviation / self.fit.stroke

    def parameters(self, nodes: Floats) -> Floats:
        """Map nodes (m,) of [-1, 1] to parameters of the windows, shape (m, n)."""
        low, high = self.low.astype(float), self.high.astype(float)
        return np.asarray(0.5 * (high + low) + 0.5 * (high - low) * nodes[:, None])

    @classmethod
    def nothing(cls, count: int, kind: Any = float) -> Traced:
        """Make an unmeasured batch of `count` guides, all NaN."""
        none = np.full(count, np.nan, kind)
        plane = np.full(count, np.nan, np.result_type(kind, np.complex64))
        return cls(Fit(none, none, plane, plane, none, none, none), plane, none, none)


def trace(
    guides: CouplerCurve,
    half: Floats,
    *,
    circle: bool,
    split: bool,
    centre: Floats | float = 0.0,
    nodes: int = 32,
    held: Floats | None = None,
) -> Traced:
    """Trace guides over windows of their paths and fit circles or straight lines.

    NaN where the window leaves the extent of the guide, where the point runs backwards within it,
    and where the error of the finest grid exceeds a hundredth of the deviation.

    Parameters
    ----------
    half : ndarray, shape (n,)
        Half the length of the window along the tangent of the given point; at a cusp its full
        length [length].
    split : bool
        Move the guided point so that its inflections separate; a point at a cusp stays there.
    centre : float or ndarray, shape (n,)
        Position of the middle of the window, relative to the reference position [half strokes].
    nodes : int
        Number of intervals between Chebyshev points; guides that they do not resolve are traced
        again with twice and four times as many.
    held : ndarray, shape (n,), optional
        Curvature of the nominal, positive to the left of the direction of increasing parameter
        [1/length]; fitted if not given. Only without `split`.
    """
    if guides.cusp.any() and not guides.cusp.all():
        found = Traced.nothing(len(guides), half.dtype)
        for which in (guides.cusp, ~guides.cusp):
            some = np.broadcast_to(centre, len(guides))[which]
            bend = None if held is None else held[which]
            part = trace(guides[which], half[which], circle=circle, split=split, centre=some, nodes=nodes, held=bend)
            found = found.replaced(which, part)
        return found
    low, high = guides.window((centre - 1) * half, (centre + 1) * half)
    found = _measure(guides, low, high, half, circle, split, nodes, held)
    for more in (2, 4):
        again = np.isfinite(found.fit.deviation) & ~resolved(found.fit)
        if not again.any():
            break
        bend = None if held is None else held[again]
        part = _measure(guides[again], low[again], high[again], half[again], circle, split, more * nodes, bend)
        found = found.replaced(again, part)
    with np.errstate(all="ignore"):
        sure = resolved(found.fit, *MAX_GRID_ERROR)
        deviation = np.where(sure, found.fit.deviation, np.nan)
    return replace(found, fit=replace(found.fit, deviation=deviation))


def retrace(guides: CouplerCurve, traced: Traced, *, circle: bool, nodes: int, held: Floats | None = None) -> Traced:
    """Measure guides over their windows on another grid, with interpolated extremes."""
    low, high = traced.low.astype(float), traced.high.astype(float)
    return _measure(guides, low, high, np.full_like(low, np.nan), circle, False, nodes, held, between=True)


def over(
    guides: CouplerCurve, low: Floats, high: Floats, *, circle: bool, nodes: int, held: Array | None = None
) -> Traced:
    """Measure guides, points unchanged, over windows of the parameter, (n,) each."""
    return _measure(guides, low, high, np.full_like(low, np.nan), circle, False, nodes, held)


def _measure(
    guides: CouplerCurve,
    low: Floats,
    high: Floats,
    half: Floats,
    circle: bool,
    split: bool,
    nodes: int,
    held: Floats | None,
    *,
    between: bool = False,
) -> Traced:
    returning = bool(guides.cusp.any())
    points = grid(4 * nodes if returning else nodes, half.dtype)
    u, v = guides.path.window(low, high, points.nodes)
    if returning:
        found, shift = cusped_zone(u, v, circle, points, held), np.zeros_like(guides.tangent)
    elif split:
        cos, sin = guides.turn.window(low, high, points.nodes)
        moved_u, moved_v, shift, plain = _straighten(u, v, cos, sin, half, circle, points, SPLITTING.leash)
        found = _fit(moved_u, moved_v, circle, points)
        poor = ~(found.deviation < SPLITTING.helps * plain) & (np.abs(shift) > SPLITTING.short_leash * half)
        if poor.any():
            found, shift = _retry_splitting(found, shift, poor, (u, v, cos, sin), half, circle, points)
        shift = shift * guides.tangent
    else:
        found, shift = _fit(u, v, circle, points, held, between=between), np.zeros_like(guides.tangent)
    placed = replace(
        found,
        start=guides.point + shift + found.start * guides.tangent,
        along=found.along * guides.tangent,
    )
    return Traced(placed, shift, low, high)


def _fit(u: Floats, v: Floats, circle: bool, points: Grid, held: Floats | None = None, *, between: bool = False) -> Fit:
    """Fit the paths that run forward over the whole window."""
    return minimum_zone(u, np.where((np.diff(u, axis=0) <= 0).any(0), np.nan, v), circle, points, held, between=between)


def _retry_splitting(
    found: Fit, shift: Complexes, poor: Mask, paths: tuple[Floats, ...], half: Floats, circle: bool, points: Grid
) -> tuple[Fit, Complexes]:
    """Retry splittings that did not reduce the error by a shorter step, or undo them."""
    u, v, cos, sin = (p[:, poor] for p in paths)
    shift = shift.copy()
    moved_u, moved_v, step, _ = _straighten(u, v, cos, sin, half[poor], circle, points, SPLITTING.short_leash)
    n = len(step)
    both = _fit(np.concatenate([moved_u, u], axis=1), np.concatenate([moved_v, v], axis=1), circle, points)
    short, plain = both[:n], both[n:]
    for other, by in ((short, step), (plain, np.zeros_like(step))):
        better = np.zeros_like(poor)
        better[poor] = ~(found.deviation[poor] <= other.deviation)
        chosen = better[poor]
        found = found.replaced(better, other[chosen])
        shift[better] = by[chosen]
    return found, shift


def _straighten(
    u: Floats, v: Floats, cos: Floats, sin: Floats, half: Floats, circle: bool, points: Grid, leash: float
) -> tuple[Floats, Floats, Complexes, Floats]:
    """Return the paths (u, v) after splitting, the shift of the point, and the error before."""
    shift = np.zeros(len(half), dtype=(u[:1] + 0j).dtype)
    curvature = _chord_curvature(u, v) if circle else np.zeros_like(half)
    errors = []
    for _ in range(SPLITTING.rounds):
        step, error = _step(u, v, cos, sin, half, curvature, points.coefficients, leash)
        errors.append(error)
        shift = shift + step
        u, v = u + cos * step.real - sin * step.imag, v + cos * step.imag + sin * step.real
    return u, v, shift, errors[0]


def _step(
    u: Floats, v: Floats, cos: Floats, sin: Floats, half: Floats, curvature: Floats, to_chebyshev: Floats, leash: float
) -> tuple[Complexes, Floats]:
    """Compute the shift of the guided point to the straightest path, and the error without it.

    With a curvature the shift leads to the path closest to a circle of this curvature.

    The shift minimises the Chebyshev coefficients of the distance from the nominal, which may move
    and turn, by least squares; the length of the shift is limited, so that an ill-determined
    direction is not followed.
    """
    with np.errstate(all="ignore"):
        along = u[-1] - u[0] + 1j * (v[-1] - v[0])
        along = along / np.abs(along)
        middle = len(u) // 2
        u, v = seen(u, v, u[middle] + 1j * v[middle], along)
        x, y = -curvature * u, 1 - curvature * v  # normal of the nominal, to be divided by its length
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
        error = np.sqrt((target**2).sum(0))
        held = (error / (leash * half)) ** 2
        g11, g12, g22 = (free[0] ** 2).sum(0) + held, (free[0] * free[1]).sum(0), (free[1] ** 2).sum(0) + held
        r1, r2 = -(free[0] * target).sum(0), -(free[1] * target).sum(0)
        det = g11 * g22 - g12 * g12
        a, b = (r1 * g22 - r2 * g12) / det, (r2 * g11 - r1 * g12) / det
        step = (a + 1j * b) * along
        return np.where(np.isfinite(step) & ~(error <= SPLITTING.straight * half), step, 0), error


def _chord_curvature(u: Floats, v: Floats) -> Floats:
    """Compute the curvature of circles through ends and middles of paths, left positive, (n,)."""
    chord = u[-1] - u[0] + 1j * (v[-1] - v[0])
    middle = len(u) // 2
    with np.errstate(all="ignore"):
        offset = u[middle] - 0.5 * (u[0] + u[-1]) + 1j * (v[middle] - 0.5 * (v[0] + v[-1]))
        sagitta, half = (offset * chord.conj()).imag / np.abs(chord), 0.5 * np.abs(chord)
        return np.asarray(-2 * sagitta / (sagitta**2 + half**2))


def extended(guides: CouplerCurve) -> CouplerCurve:
    """Return guides in extended precision, where the platform has it."""
    return coupler_curve(guides.linkage, guides.point, np.longdouble, guides.pole, guides.motion.chart)
