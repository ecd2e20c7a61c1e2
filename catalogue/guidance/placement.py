"""Carry traced guides to where their path is wanted, and measure them there at exactly the stroke asked for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..kinematics.linkage import Linkage
from ..kinematics.types import Array, Complexes, Floats, Mask
from .coupler_curve import CouplerCurve
from .metrics import middle_of_stroke
from .minimum_zone import Fit
from .trace import Traced, extended, trace

#: Below this deviation over stroke a guide is measured again in extended precision.
FINE = 1e-11
#: Corrections of a window until its chord, or its stroke from a cusp, is the one asked for; the chord from a cusp turns
#: as it grows.
ROUNDS, ROUNDS_AT_CUSP = 3, 10
#: The same of an arc of any radius until its window lies about the guided point as seen from its own centre; one that
#: moves by less than such a part of its half is left.
ROUNDS_OF_ARC, STILL = 20, 1e-7
#: No correction is made by less than this part.
REACHED, CORRECTIONS = 1e-11, 2


def placed(guides: CouplerCurve, traced: Traced, stroke: Floats | float) -> tuple[Linkage, Array, Traced]:
    """Return the linkages in mid-stroke, laid so that their paths run from (0, 0) to (stroke, 0), float or (n,), which
    sets the scale; the guided points (n,) there; and the same traces, in the same charts.

    Guides whose paths have a cusp are given as they stand there, at (0, 0), those at a change point as they stand at
    it, wherever that is on the stroke.  One that was not traced stays where it is.
    """
    there = _there(traced)
    now, here, seen = mid_stroke(guides, traced)
    with np.errstate(all="ignore"):
        scale = np.where(there, stroke / traced.fit.stroke * traced.fit.along.conj(), 1.0)
        shift = np.where(there, -scale * traced.fit.start, 0.0)
        size, fit = np.abs(scale), traced.fit
        fit = Fit(
            size * fit.deviation, size * fit.stroke, scale * fit.start + shift, scale / size * fit.along,
            fit.curvature / size, size * fit.unresolved,
        )  # fmt: skip
    return now.moved(scale, shift), scale * here + shift, replace(seen, fit=fit)


def mid_stroke(guides: CouplerCurve, traced: Traced) -> tuple[Linkage, Array, Traced]:
    """Return the linkages and guided points in mid-stroke (at a cusp or a change point: there), where they stand, and
    their traces with the parameters counted from there, in the same charts."""
    there = _there(traced)
    moving, linkage = guides.motion, guides.linkage
    point = np.where(there, guides.point + traced.shift, guides.point)
    t = np.where(there, middle_of_stroke(moving, point, traced, guides.cusp), 0.0)
    t = np.where(moving.branch != 0, 0.0, t)  # beside a change point double has no digits that tell the branches apart
    pose = moving.pose(t[None])
    # a parameter is the tangent of half an angle: angles are subtracted
    low, high = ((end - t) / (1 + end * t) for end in (traced.low, traced.high))
    return pose.linkages(linkage), pose.point(point)[0], Traced(traced.fit, np.zeros_like(traced.shift), low, high)


def _there(traced: Traced) -> Mask:
    return np.isfinite(traced.fit.deviation) & (traced.fit.stroke > 0)


def mirrored(linkage: Linkage, point: Complexes, stroke: float, reverse: Mask, over: Mask) -> tuple[Linkage, Complexes]:
    """Return placed guides laid the other way (`reverse`) or mirrored in the line of the path (`over`)."""
    # both together are a half turn about the middle of the path; each alone is a reflection
    factor = np.where(reverse, -1.0, 1.0)
    shift = np.where(reverse, stroke, 0.0)
    return linkage.moved(factor, shift, reverse != over), mirrored_places(point, stroke, reverse, over)


def mirrored_places(z: Complexes, stroke: float, reverse: Mask, over: Mask) -> Complexes:
    """Return where places (n, ...) of guides are after `mirrored`."""
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
    exact: bool = False,
) -> Traced:
    """Trace each guide, its point as it is, over the window about its reference position that has exactly this stroke.

    NaN where the guide does not reach so far.  Deviations below `FINE` are measured in extended precision if `extend`.
    The `curvature` of arcs that run from (0, 0) to (stroke, 0), positive for a centre above, is sought unless it is
    given; it places the window, but not at a cusp, and is that of the nominal if `exact`.
    """
    held = along_path(guides, curvature) if exact and curvature is not None else None
    stroke = np.broadcast_to(np.asarray(stroke, dtype=float), len(guides))
    half, centre = np.where(guides.cusp, np.minimum(stroke, guides.extent.min(0)), 0.5 * stroke), np.zeros(len(guides))
    at, rest = np.flatnonzero(guides.cusp), np.flatnonzero(~guides.cusp)
    for _ in range(ROUNDS_AT_CUSP if len(at) else 0):
        with np.errstate(all="ignore"):
            half[at] *= stroke[at] / _from_cusp(guides[at], half[at], circle, nodes)
    if circle and curvature is not None:
        bend = np.broadcast_to(curvature, len(guides))[rest]
        half[rest], centre[rest] = _symmetric(guides[rest], _arcs(stroke[rest], bend), stroke[rest])
    elif circle:
        half[rest], centre[rest] = _about_the_point(guides[rest], stroke[rest], nodes)
    half[rest] = _of_chord(guides[rest], half[rest], centre[rest], stroke[rest])
    found = trace(guides, half, circle=circle, split=False, centre=centre, nodes=nodes, held=held)
    found, half = _corrected(found, guides, stroke, half, circle=circle, centre=centre, nodes=nodes, held=held)
    fine = (found.relative < FINE) & extend
    if fine.any() and np.finfo(np.longdouble).eps < np.finfo(float).eps:
        again = trace(
            extended(guides[fine]), half[fine].astype(np.longdouble), circle=circle, split=False, centre=centre[fine],
            nodes=nodes, held=None if held is None else held[fine].astype(np.longdouble),
        )  # fmt: skip
        found = found.replaced(fine, again)
    return found


def _from_cusp(guides: CouplerCurve, half: Floats, circle: bool, nodes: int) -> Floats:
    """Return the strokes of guides that return, over windows of a length, shape (n,)."""
    if not circle:
        return np.asarray(trace(guides, half, circle=False, split=False, nodes=nodes).fit.stroke)
    u, v = guides.path(np.stack(guides.window(-half, half)))
    return np.asarray(np.abs(0.5 * (u.sum(0) + 1j * v.sum(0))))  # a chord, whatever the circle


def _about_the_point(guides: CouplerCurve, stroke: Floats, nodes: int) -> tuple[Floats, Floats]:
    """Return half and centre of windows of such strokes whose ends are equally far from the guided points as seen from
    the centres of the arcs, of any radius, that fit the paths between them best."""
    half, centre = 0.5 * stroke, np.zeros(len(guides))
    left = np.arange(len(guides))
    for _ in range(ROUNDS_OF_ARC):
        here, wanted = guides[left], stroke[left]
        chord = _of_chord(here, half[left], centre[left], wanted)
        rough = trace(here, chord, circle=True, split=False, centre=centre[left], nodes=nodes)
        half[left], after = _symmetric(here, rough.fit, wanted)
        moved, centre[left] = np.abs(after - centre[left]), after
        left = left[moved > STILL]
        if not len(left):
            break
    return half, centre


def along_path(guides: CouplerCurve, curvature: Floats | float) -> Floats:
    """Return curvatures that are positive for a centre above as seen along the paths, positive for one to the left."""
    return np.asarray(np.where(guides.tangent.real < 0, -1.0, 1.0) * curvature)


def near_stroke(guides: CouplerCurve, stroke: float, *, circle: bool, curvature: float | None = None) -> Traced:
    """Trace each of n guides, its point as it is, over the window about its reference position whose ends are so far
    apart [length of the guides]; NaN where it does not reach so far.

    The stroke along a line is off by a few deviations squared.  With a `curvature`, positive for a centre above, the
    nominal has exactly that, and the stroke is the one asked for.
    """
    held = None if curvature is None else along_path(guides, curvature)
    half, centre = np.where(guides.cusp, stroke, 0.5 * stroke), np.zeros(len(guides))
    half = np.where(guides.cusp, half, _of_chord(guides, half, centre, np.full_like(half, stroke)))
    found = trace(guides, half, circle=circle, split=False, centre=centre, held=held)
    if held is None:
        return found
    return _corrected(found, guides, stroke, half, circle=circle, centre=centre, held=held)[0]


def _corrected(
    found: Traced,
    guides: CouplerCurve,
    stroke: Floats | float,
    half: Floats,
    *,
    circle: bool,
    centre: Floats,
    nodes: int = 32,
    held: Floats | None = None,
) -> tuple[Traced, Floats]:
    """Trace guides again until their strokes are those asked for, and return their half windows too.

    The chord of a path is longer than its run along the best line.
    """
    stroke, half = np.broadcast_to(stroke, half.shape), half.copy()
    for _ in range(CORRECTIONS):
        with np.errstate(all="ignore"):
            ratio = stroke / found.fit.stroke
        off = np.flatnonzero(np.abs(ratio - 1) > REACHED)
        if not len(off):
            break
        half[off] *= ratio[off]
        bend = None if held is None else held[off]
        some = guides[off]
        now = trace(some, half[off], circle=circle, split=False, centre=centre[off], nodes=nodes, held=bend)
        found = found.replaced(off, now)
    return found, half


def _of_chord(guides: CouplerCurve, half: Floats, centre: Floats, chord: Floats) -> Floats:
    """Return half windows whose ends are as far apart as `chord` says, beginning with `half`; nothing is fitted."""
    for _ in range(ROUNDS):
        low, high = guides.window((centre - 1) * half, (centre + 1) * half)
        u, v = guides.path(np.stack([low, high]))
        with np.errstate(all="ignore"):
            half = half * chord / np.hypot(u[1] - u[0], v[1] - v[0])
    return half


def _arcs(stroke: Floats, curvature: Floats) -> Fit:
    """Return the circles of arcs from (0, 0) to (stroke, 0)."""
    none = np.full_like(stroke, np.nan)
    return Fit(none, stroke, np.zeros(len(stroke), complex), np.ones(len(stroke), complex), curvature, none)


def _symmetric(guides: CouplerCurve, found: Fit, stroke: Floats) -> tuple[Floats, Floats]:
    """Return half and centre of the windows whose ends, on circles, are equally far from the guided points.

    The tangent in the guided point is not parallel to the chord, since the path wavers about the circle.
    """
    with np.errstate(all="ignore"):
        radius = 1 / found.curvature
        depth = np.sqrt(radius**2 - 0.25 * found.stroke**2)
        middle = found.start + found.along * (0.5 * found.stroke + 1j * np.copysign(depth, radius))
        out = guides.point - middle
        turn = np.exp(1j * np.arcsin(0.5 * stroke / np.abs(radius)))
        ends = [((out * t - out) * guides.tangent.conj()).real for t in (turn, turn.conj())]
    low, high = np.minimum(*ends), np.maximum(*ends)
    return 0.5 * (high - low), (high + low) / (high - low)
