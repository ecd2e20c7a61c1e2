"""Place traced guides along a requested path, and measure them at exactly its stroke."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..kinematics.linkage import Linkage
from ..kinematics.types import Complexes, Floats, Mask
from .coupler_curve import CouplerCurve
from .metrics import middle_of_stroke
from .minimum_zone import Fit, rise_over
from .trace import Traced, extended, trace


class Placement(NamedTuple):
    """Options of the corrections of a window to the requested stroke."""

    #: Deviation below which a guide is measured again in extended precision [strokes].
    fine: float = 1e-11
    rounds: int = 3  #: number of corrections to the requested chord
    cusp_rounds: int = 10  #: number of corrections from a cusp, where the chord rotates as it grows
    #: Largest number of corrections until the ends of a path are equally far from its guided point:
    #: near a half circle each one leaves up to a third of the error.
    point_rounds: int = 30
    #: Correction of an end below which the iteration stops [half windows]: answers that are read
    #: again keep 11 digits of their stroke.
    still: float = 1e-12
    reached: float = 1e-11  #: smallest relative correction of a stroke
    corrections: int = 2  #: largest number of corrections of a stroke


PLACEMENT = Placement()


def placed(guides: CouplerCurve, traced: Traced, stroke: Floats | float) -> tuple[Linkage, Complexes, Traced]:
    """Scale and move linkages so that their paths run from 0 to `stroke`.

    Returns the linkages at mid-stroke, the guided points (n,), and the traces in unchanged charts.

    Guides whose paths have a cusp are returned in that position, with the cusp at (0, 0); those at
    a change point in that position, wherever it is on the stroke. Guides without a trace keep their
    place.
    """
    there = _has_trace(traced)
    now, here, seen = mid_stroke(guides, traced)
    with np.errstate(all="ignore"):
        scale = np.where(there, stroke / traced.fit.stroke * traced.fit.along.conj(), 1.0)
        shift = np.where(there, -scale * traced.fit.start, 0.0)
        size, fit = np.abs(scale), traced.fit
        fit = Fit(
            size * fit.deviation,
            size * fit.stroke,
            scale * fit.start + shift,
            scale / size * fit.along,
            fit.curvature / size,
            rise_over(size * fit.stroke, fit.curvature / size),
            size * fit.unresolved,
        )
    return now.moved(scale, shift), scale * here + shift, replace(seen, fit=fit)


def mid_stroke(guides: CouplerCurve, traced: Traced) -> tuple[Linkage, Complexes, Traced]:
    """Move linkages and guided points along their motion to mid-stroke, a cusp or a change point.

    Return them without displacement of the frame, and their traces in unchanged charts, with
    parameters relative to this position.
    """
    there = _has_trace(traced)
    moving, linkage = guides.motion, guides.linkage
    point = np.where(there, guides.point + traced.shift, guides.point)
    t = np.where(there, middle_of_stroke(moving, point, traced, guides.cusp), 0.0)
    t = np.where(moving.branch != 0, 0.0, t)  # near a change point double precision does not distinguish the branches
    pose = moving.pose(t[None])
    # parameters are tangents of half angles: subtract the angles
    low, high = ((end - t) / (1 + end * t) for end in (traced.low, traced.high))
    return pose.linkages(linkage), pose.point(point)[0], Traced(traced.fit, np.zeros_like(traced.shift), low, high)


def _has_trace(traced: Traced) -> Mask:
    return np.isfinite(traced.fit.deviation) & (traced.fit.stroke > 0)


def mirrored(linkage: Linkage, point: Complexes, stroke: float, reverse: Mask, over: Mask) -> tuple[Linkage, Complexes]:
    """Reverse placed guides (`reverse`), or mirror them in the line of the path (`over`)."""
    # both together are a half turn about the middle of the path; each alone is a reflection
    factor = np.where(reverse, -1.0, 1.0)
    shift = np.where(reverse, stroke, 0.0)
    return linkage.moved(factor, shift, reverse != over), mirrored_places(point, stroke, reverse, over)


def mirrored_places(z: Complexes, stroke: float, reverse: Mask, over: Mask) -> Complexes:
    """Return places (n, ...) of guides as moved by `mirrored`."""
    reverse, over = (side.reshape(-1, *(1,) * (z.ndim - 1)) for side in (reverse, over))
    seen = np.where(reverse != over, np.conj(z), z)
    return np.asarray(np.where(reverse, stroke - seen, seen))


def at_stroke(
    guides: CouplerCurve,
    stroke: Floats | float,
    *,
    circle: bool,
    nodes: int = 32,
    extend: bool = True,
    curvature: Floats | None = None,
) -> Traced:
    """Trace guides, points unchanged, over windows of exactly this stroke.

    NaN where the guide does not reach so far.  If `extend`, deviations below `PLACEMENT.fine` are
    measured in extended precision.  `curvature` fixes the curvature of the nominal, an arc from (0,
    0) to (stroke, 0), positive for a centre above.
    """
    held = None if curvature is None else along_path(guides, curvature)
    stroke = np.broadcast_to(np.asarray(stroke, dtype=float), len(guides))
    half, centre = np.where(guides.cusp, np.minimum(stroke, guides.extent.min(0)), 0.5 * stroke), np.zeros(len(guides))
    at, rest = np.flatnonzero(guides.cusp), np.flatnonzero(~guides.cusp)
    for _ in range(PLACEMENT.cusp_rounds if len(at) else 0):
        with np.errstate(all="ignore"):
            half[at] *= stroke[at] / _strokes_from_cusp(guides[at], half[at], circle, nodes)
    half[rest], centre[rest] = _window_about_point(guides[rest], stroke[rest])
    found = trace(guides, half, circle=circle, split=False, centre=centre, nodes=nodes, held=held)
    found, half, centre = _correct_windows(
        found, guides, stroke, half, circle=circle, centre=centre, nodes=nodes, held=held
    )
    fine = (found.relative < PLACEMENT.fine) & extend
    if fine.any() and np.finfo(np.longdouble).eps < np.finfo(float).eps:
        again = trace(
            extended(guides[fine]),
            half[fine].astype(np.longdouble),
            circle=circle,
            split=False,
            centre=centre[fine],
            nodes=nodes,
            held=None if held is None else held[fine].astype(np.longdouble),
        )
        found = found.replaced(fine, again)
    return found


def _strokes_from_cusp(guides: CouplerCurve, half: Floats, circle: bool, nodes: int) -> Floats:
    """Return the strokes of guides with a cusp over windows of given lengths, shape (n,)."""
    if not circle:
        return np.asarray(trace(guides, half, circle=False, split=False, nodes=nodes).fit.stroke)
    u, v = guides.path(np.stack(guides.window(-half, half)))
    return np.asarray(np.abs(0.5 * (u.sum(0) + 1j * v.sum(0))))  # the chord, whatever the circle


def _window_about_point(guides: CouplerCurve, stroke: Floats) -> tuple[Floats, Floats]:
    """Solve for half length and centre of windows of a stroke, centred at the guided points.

    Each round computes the ends on circles through the last ends and the guided points.
    """
    low, high = -0.5 * stroke, 0.5 * stroke
    left, extent = np.arange(len(guides)), guides.extent
    for _ in range(PLACEMENT.point_rounds):
        here = guides[left]
        inside = np.maximum(low[left], -extent[0, left]), np.minimum(high[left], extent[1, left])
        u, v = here.path(np.stack(here.window(*inside)))
        first, last = _ends_on_circle(u + 1j * v, stroke[left])
        moved = np.maximum(np.abs(first - low[left]), np.abs(last - high[left]))
        low[left], high[left] = first, last
        left = left[moved > PLACEMENT.still * stroke[left]]
        if not len(left):
            break
    return 0.5 * (high - low), (high + low) / (high - low)


def _ends_on_circle(ends: Complexes, stroke: Floats) -> tuple[Floats, Floats]:
    """Compute the ends of arcs of chord `stroke` on circles through 0 and `ends`.

    Inversion in 0 turns the circles into straight lines, so that nearly straight ones lose no
    digits.

    Parameters
    ----------
    ends : complex ndarray, shape (2, n)
        One place of each circle before 0, one after it [length].
    """
    with np.errstate(all="ignore"):
        before, behind = 1 / ends
        back = behind - before
        tangent = back.conj() / np.abs(back)
        half_angle = 0.5 * np.arcsin(-stroke * (behind * tangent).imag)
        reach = 0.5 * stroke / np.cos(half_angle) * tangent
        turn = np.exp(1j * half_angle)
        return -(reach * turn.conj()).real, (reach * turn).real


def along_path(guides: CouplerCurve, curvature: Floats | float) -> Floats:
    """Convert curvatures, positive for a centre above, to positive for a centre on the left."""
    return np.asarray(np.where(guides.tangent.real < 0, -1.0, 1.0) * curvature)


def near_stroke(guides: CouplerCurve, stroke: float, *, circle: bool, curvature: float | None = None) -> Traced:
    """Trace guides, points unchanged, over windows with ends `stroke` apart [length].

    NaN where a guide does not reach so far. The error of the stroke along a line is a few
    deviations squared. With a `curvature`, positive for a centre above, the nominal has exactly
    this curvature, and the stroke is exactly the requested one.
    """
    held = None if curvature is None else along_path(guides, curvature)
    half, centre = np.where(guides.cusp, stroke, 0.5 * stroke), np.zeros(len(guides))
    half = np.where(guides.cusp, half, _window_of_chord(guides, half, centre, np.full_like(half, stroke)))
    found = trace(guides, half, circle=circle, split=False, centre=centre, held=held)
    if held is None:
        return found
    return _correct_windows(found, guides, stroke, half, circle=circle, centre=centre, held=held)[0]


def _correct_windows(
    found: Traced,
    guides: CouplerCurve,
    stroke: Floats | float,
    half: Floats,
    *,
    circle: bool,
    centre: Floats,
    nodes: int = 32,
    held: Floats | None = None,
) -> tuple[Traced, Floats, Floats]:
    """Trace guides until their strokes are exact.

    Return also half lengths and centres of the windows. The chord of a path is longer than its
    extent along the best line, and has another middle: along that line the guided point, unless it
    returns, must be halfway.
    """
    stroke, half, centre = np.broadcast_to(stroke, half.shape), half.copy(), centre.copy()
    for _ in range(PLACEMENT.corrections):
        fit = found.fit
        with np.errstate(all="ignore"):
            ratio = stroke / fit.stroke
            ahead = ((guides.point - fit.start) * fit.along.conj()).real - 0.5 * fit.stroke
        ahead = np.where(guides.cusp | circle, 0.0, ahead)
        off = np.flatnonzero((np.abs(ratio - 1) > PLACEMENT.reached) | (np.abs(ahead) > PLACEMENT.reached * stroke))
        if not len(off):
            break
        middle = centre[off] * half[off] + ahead[off]
        half[off] *= ratio[off]
        centre[off] = middle / half[off]
        bend = None if held is None else held[off]
        some = guides[off]
        now = trace(some, half[off], circle=circle, split=False, centre=centre[off], nodes=nodes, held=bend)
        found = found.replaced(off, now)
    return found, half, centre


def _window_of_chord(guides: CouplerCurve, half: Floats, centre: Floats, chord: Floats) -> Floats:
    """Solve for half windows whose ends are `chord` apart, starting at `half`, without a fit."""
    for _ in range(PLACEMENT.rounds):
        low, high = guides.window((centre - 1) * half, (centre + 1) * half)
        u, v = guides.path(np.stack([low, high]))
        with np.errstate(all="ignore"):
            half = half * chord / np.hypot(u[1] - u[0], v[1] - v[0])
    return half
