"""Candidates: guides placed along the path of a problem, measured on their finite motion."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..guidance.allowance import Zone, allowances, expected_deviation
from ..guidance.circuit_curve import CIRCUIT, CircuitCurve
from ..guidance.coupler_curve import CouplerCurve, coupler_curve
from ..guidance.finite_scatter import FREE, finite_allowances, finite_expected
from ..guidance.fixed_nominal import Nominal, in_place
from ..guidance.metrics import Measures, measure
from ..guidance.placement import PLACEMENT, at_stroke, mid_stroke, mirrored, mirrored_places, near_stroke, placed
from ..guidance.slides import NOWHERE
from ..guidance.trace import Traced, retrace
from ..guidance.wide_arc import WIDE_ARC, along_circuits, traced_about
from ..kinematics.batch import Rows, put
from ..kinematics.linkage import Linkage
from ..kinematics.types import Array, Complexes, Floats, Indices, Integers, Mask
from ..problem.problem import Problem

#: Intervals between the Chebyshev points at which the deviation of an answer is measured: with 32
#: the error is up to 0.2 per cent near a dead point, or where many extremes are as large.
SHOWN = 128
#: Relative distance from its bound beyond which a rough allowance decides correctly, by the number
#: of coordinates of the nominal that are fitted: in 6,000 candidates its error is at most 13 per
#: cent, 20 where a radius is fitted.
ROUGH_WITHIN = {0: 0.15, 2: 0.15, 3: 0.4}
#: Orientations of a guide along a line, as pairs (path reversed, guide mirrored in the line).
FLIPS = ((False, False), (True, False), (False, True), (True, True))


@dataclass(frozen=True)
class Origin(Rows):
    """Ancestors of n candidates, in their design positions; arrays of shape (n,)."""

    id: Integers  # number of the stored guide; -1 without one
    family: Array
    series: Array
    configuration: Array
    order: Integers  # order of contact; 99 if exact
    cognate: Integers  # 0 for the ancestor itself, 1 or 2 for its cognates

    @classmethod
    def made(cls, linkage: Linkage, series: str, order: Array | int = 2) -> Origin:
        """Return the origin of synthesised linkages."""
        n = len(linkage)
        code, blank = (np.full(n, text, dtype=object) for text in (series, ""))
        orders, zero = np.broadcast_to(order, n).copy(), np.zeros(n, int)
        return cls(zero - 1, linkage.family.astype(object), code, blank, orders, zero)


@dataclass(frozen=True)
class CandidateBatch(Rows):
    """n guides placed along the path from 0 to 1, in mid-stroke; arrays of shape (n,) [strokes].

    Attributes
    ----------
    allowance : ndarray
        Standard deviation of pivot position at which 95 % of machines keep the tolerance; see
        `catalogue.guidance.allowance`.  Negative where the deviation exceeds the tolerance, NaN for
        returning points and where it was not requested.
    expected : ndarray
        Deviation that 95 % of machines with the given play keep; without play the deviation.
    """

    origin: Origin
    linkage: Linkage
    point: Complexes  # guided points in mid-stroke
    pole: Complexes  # pole in mid-stroke; tells the branch of a linkage at a change point, NaN where unknown
    chart: Integers  # number of the chart of the motion that parametrises the traces
    traced: Traced  # the path over the stroke and its nominal
    measures: Measures
    allowance: Floats
    expected: Floats

    def __len__(self) -> int:
        return len(self.point)

    def replaced(self, where: Indices, by: CandidateBatch) -> CandidateBatch:
        """Replace the entries `where`, a mask or indices, by those of `by`, in order."""
        return put(self, where, by)

    @property
    def deviation(self) -> Floats:
        """Deviations, shape (n,) [strokes]."""
        return np.asarray(self.traced.fit.deviation.astype(float))

    @cached_property
    def curve(self) -> Any:
        """Coupler curves of the candidates from mid-stroke; along wide arcs a `CircuitCurve`."""
        return curves(self.linkage, self.point, self.pole, self.chart)


def curves(linkage: Linkage, point: Complexes, pole: Complexes, chart: Integers) -> CouplerCurve | CircuitCurve:
    """Return coupler curves (n,) from the present positions: in charts, or along whole circuits."""
    if (chart == CIRCUIT).any():
        return along_circuits(linkage, point)
    return coupler_curve(linkage, point, pole=pole, chart=chart)


def place_on_path(problem: Problem, guides: CouplerCurve, traced: Traced) -> tuple[Linkage, Complexes, Complexes]:
    """Place traced guides along the path from 0 to 1, arcs bulging to +y.

    Guides without a trace keep their place.

    Returns
    -------
    Linkage, complex ndarray, complex ndarray
        Linkages, guided points (n,) and poles (n,) in mid-stroke.
    """
    there = np.isfinite(traced.fit.deviation) & (traced.fit.stroke > 0)
    linkage, point, _ = placed(guides, traced, 1.0)
    with np.errstate(all="ignore"):  # the pole matters at change points, which are the reference position
        pole = np.where(there, -traced.fit.along.conj() / traced.fit.stroke * traced.fit.start, 0)
    over = problem.curved & (traced.fit.curvature > 0)
    return flip(linkage, point, pole, np.zeros(len(point), bool), over)


def on_path(problem: Problem, origin: Origin, guides: CouplerCurve, traced: Traced) -> CandidateBatch:
    """Place traced guides along the path and measure them over exactly the stroke."""
    return measured(problem, origin, *place_on_path(problem, guides, traced))


def flip(
    linkage: Linkage, point: Complexes, pole: Complexes, reverse: Mask, over: Mask, stroke: float = 1.0
) -> tuple[Linkage, Complexes, Complexes]:
    """Reverse placed guides along the path (`reverse`), or mirror them in its line (`over`)."""
    _, pole = mirrored(linkage, pole, stroke, reverse, over)
    linkage, point = mirrored(linkage, point, stroke, reverse, over)
    return linkage, point, pole


def mirror_image(problem: Problem, found: CandidateBatch, reverse: bool, over: bool) -> CandidateBatch:
    """Measure mirror images: in the middle of the path (`reverse`), in its line (`over`)."""
    n = len(found)
    sides = np.full(n, reverse), np.full(n, over)
    seen = flip(found.linkage, found.point, found.pole, *sides, problem.path.stroke)
    return measured(problem, found.origin, *seen)


def slides_on_path(problem: Problem, guides: CouplerCurve, traced: Traced) -> Complexes:
    """Return the ends of rails and slots (n, 2, 2) in mid-stroke after `place_on_path`.

    NaN if there is no region.
    """
    wanted, fit = problem.constraints, traced.fit
    if wanted.fixed_pivots_in is None and wanted.pivots_in is None:
        return np.full((len(guides), 2, 2), NOWHERE)
    with np.errstate(all="ignore"):
        ends = (measure(guides, traced).slides - fit.start[:, None, None]) * fit.along.conj()[:, None, None]
        over = problem.curved & (fit.curvature > 0)
        return mirrored_places(ends / fit.stroke[:, None, None], 1.0, np.zeros(len(over), bool), over)


def every_flip(problem: Problem, n: int) -> list[tuple[Mask, Mask]]:
    """List the orientations of n guides as pairs of masks (n,), reverse and over.

    A line permits four orientations, an arc two.
    """
    flips = FLIPS[:2] if problem.curvature != 0 else FLIPS
    return [(np.full(n, reverse), np.full(n, over)) for reverse, over in flips]


def measured(problem: Problem, origin: Origin, linkage: Linkage, point: Complexes, pole: Complexes) -> CandidateBatch:
    """Measure guides along the path over exactly the stroke, as candidates."""
    if problem.is_wide:
        return on_wide_arc(problem, origin, along_circuits(linkage, point))
    guides = coupler_curve(linkage, point, pole=pole, least=0.5)
    return measure_traced(problem, origin, guides, _trace_over_stroke(problem, guides, extend=False))


def on_wide_arc(problem: Problem, origin: Origin, guides: CircuitCurve, **nodes: int) -> CandidateBatch:
    """Place guides near the arc of a problem along it, and measure them.

    Their reference position is in the middle of the path; `nodes` are arguments of `wide_arcs`.
    """
    path, n = problem.path, len(guides)
    assert path.radius is not None
    assert path.angle is not None
    centre = 0.5 * path.stroke - 1j * path.radius * np.cos(0.5 * np.radians(path.angle))
    traced = traced_about(guides, np.full(n, centre), np.full(n, path.radius), path.angle, **nodes)
    there, fit = np.isfinite(traced.fit.deviation), traced.fit
    scale = np.where(there, fit.along.conj(), 1.0)
    shift = np.where(there, -scale * fit.start, 0.0)
    fit = replace(fit, start=np.where(there, 0j, fit.start), along=np.where(there, 1 + 0j, fit.along))
    laid = along_circuits(guides.linkage.moved(scale, shift), scale * guides.point + shift)
    return measure_traced(problem, origin, laid, replace(traced, fit=fit))


def measure_traced(
    problem: Problem, origin: Origin, guides: CouplerCurve | CircuitCurve, traced: Traced
) -> CandidateBatch:
    """Measure traced guides in mid-stroke: all quantities that the problem bounds or ranks."""
    wanted = problem.constraints
    found = measure(guides, traced, in_middle=True, turning=wanted.full_rotation, inverse=wanted.slots)
    allowance, expected = np.full(len(guides), np.nan), traced.fit.deviation.astype(float)
    if problem.needs_allowance:
        zone = Zone(*problem.zone)
        allowance = allowances(problem.deviation, guides, traced, zone, rough=True)
        if wanted.min_allowance is not None:  # decide by the value shown to users
            away = np.abs(allowance / wanted.min_allowance - 1)
            close = np.flatnonzero((expected <= problem.deviation) & (away < ROUGH_WITHIN[zone.free]))
            allowance[close] = _shown_allowances(problem, guides[close], traced[close])
    if wanted.play:
        expected = expected_deviation(wanted.play, guides, traced, Zone(*problem.zone), rough=True)
    linkage, point, chart = guides.linkage, guides.point, guides.motion.chart
    return CandidateBatch(origin, linkage, point, _pole(guides), chart, traced, found, allowance, expected)


def with_allowance(problem: Problem, found: CandidateBatch) -> CandidateBatch:
    """Measure allowances and expected deviations with the accuracy of displayed values."""
    allowance = _shown_allowances(problem, found.curve, found.traced)
    return replace(found, allowance=allowance, expected=_shown_expectations(problem, found))


def _measure_allowances(problem: Problem, found: CandidateBatch) -> CandidateBatch:
    """Measure allowances and expected deviations accurately, if bounded or ranked."""
    if problem.needs_allowance:
        return with_allowance(problem, found)
    if problem.constraints.play:
        return replace(found, expected=_shown_expectations(problem, found))
    return found


def _shown_expectations(problem: Problem, found: CandidateBatch) -> Floats:
    """Return the deviations expected of candidates with play, (n,) [strokes]."""
    zone, play = Zone(*problem.zone), problem.constraints.play
    if not play:
        return found.deviation
    expectations = finite_expected if zone.free == FREE else expected_deviation
    return expectations(play, found.curve, found.traced, zone)


def _shown_allowances(problem: Problem, guides: CouplerCurve | CircuitCurve, traced: Traced) -> Floats:
    """Compute the allowances of traced guides for display and constraints."""
    zone = Zone(*problem.zone)
    exactly = finite_allowances if zone.free == FREE else allowances
    return exactly(problem.deviation, guides, traced, zone)


def near_path(
    problem: Problem, origin: Origin, moved: CouplerCurve | CircuitCurve, nominal: Nominal | None = None
) -> CandidateBatch:
    """Place guides along the path again after small moves, and measure them.

    They are given near mid-stroke, arcs bulging to +y. With a `nominal`, such as the path itself,
    distances are measured from it, and the guides keep their place.
    """
    if isinstance(moved, CircuitCurve):
        return on_wide_arc(problem, origin, moved)
    if nominal is not None:
        linkage, point, traced = mid_stroke(moved, in_place(moved, nominal))
        return measure_traced(problem, origin, coupler_curve(linkage, point, chart=moved.motion.chart), traced)
    found = near_stroke(moved, 1.0, circle=problem.curved, curvature=problem.fixed_curvature)
    back = found.fit.along.real < 0  # guides keep their side of the path
    found = _reverse_traces(found, back)
    linkage, point, traced = placed(moved, found, 1.0)
    if problem.curvature is None:  # an arc that bulges the other way does not answer the request
        turned = traced.fit.curvature >= 0
        traced = replace(traced, fit=replace(traced.fit, deviation=np.where(turned, np.nan, traced.fit.deviation)))
    with np.errstate(all="ignore"):
        pole = found.fit.along.conj() / found.fit.stroke * (_pole(moved) - found.fit.start)
    if moved.cusp.any():
        return measured(problem, origin, linkage, point, pole)
    here = coupler_curve(linkage, point, pole=pole, chart=moved.motion.chart)
    return measure_traced(problem, origin, here, _reverse_traces(traced, back))


def in_best_charts(problem: Problem, found: CandidateBatch) -> CandidateBatch:
    """Measure candidates again in charts better than those of their traces."""
    if problem.is_wide:
        return found
    best = coupler_curve(found.linkage, found.point, pole=found.pole, least=0.5).motion.chart
    other = np.flatnonzero(best != found.chart)
    if not len(other):
        return found
    some = found[other]
    anew = measured(problem, some.origin, some.linkage, some.point, some.pole)
    return found.replaced(other, anew)


def final(problem: Problem, found: CandidateBatch, *, rigid: bool = False) -> CandidateBatch:
    """Place candidates along the nominal of a finer grid, and measure their deviations there.

    Extended precision is used where double precision does not suffice. With `rigid` link lengths
    keep their last digit; the fitted stroke may then differ from the requested one by the error of
    the grid.
    """
    guides = found.curve
    if isinstance(guides, CircuitCurve):
        shown = on_wide_arc(problem, found.origin, guides, nodes=SHOWN, most=WIDE_ARC.most)
        return _measure_allowances(problem, shown)
    if guides.cusp.any():
        return replace(found, traced=_trace_over_stroke(problem, guides))
    found = in_best_charts(problem, found)
    guides = found.curve
    assert isinstance(guides, CouplerCurve)
    held = found.traced.fit.curvature if problem.fixed_curvature is not None else None
    traced = retrace(guides, found.traced, circle=problem.curved, nodes=SHOWN, held=held)
    if rigid:
        traced = keep_lengths(traced)
    back = traced.fit.along.real < 0
    linkage, point, laid = placed(guides, _reverse_traces(traced, back), 1.0)
    still = guides.motion.branch != 0  # at a change point the pivots as given, with the pole, tell the branch
    linkage = Linkage.trusted(np.where(still[:, None, None, None], found.linkage.pivots, linkage.pivots))
    point, traced = np.where(still, found.point, point), _reverse_traces(laid, back).replaced(still, traced[still])
    here = coupler_curve(linkage, point, pole=found.pole, chart=found.chart)
    fine = np.flatnonzero(traced.relative < PLACEMENT.fine)
    if len(fine):
        traced = traced.replaced(np.isin(np.arange(len(found)), fine), _trace_over_stroke(problem, here[fine]))
    shown = measure_traced(problem, found.origin, here, traced)
    return _measure_allowances(problem, shown)


def _trace_over_stroke(problem: Problem, guides: CouplerCurve, *, extend: bool = True) -> Traced:
    """Trace guides over exactly the stroke, about their guided points."""
    up = None if problem.fixed_curvature is None else np.full(len(guides), problem.fixed_curvature)
    return at_stroke(guides, 1.0, circle=problem.curved, extend=extend, curvature=up)


def _pole(guides: CouplerCurve | CircuitCurve) -> Complexes:
    return np.full(len(guides), complex(np.nan, np.nan)) if guides.pole is None else guides.pole


def keep_lengths(traced: Traced) -> Traced:
    """Set the fitted strokes to the requested one, so that placing changes no length."""
    return replace(traced, fit=replace(traced.fit, stroke=np.ones(len(traced.low))))


def _reverse_traces(traced: Traced, where: Mask) -> Traced:
    """Reverse the direction of the traces that a mask selects."""
    fit = traced.fit
    way = np.where(where, -1, 1)
    start = np.where(where, fit.start + fit.stroke * fit.along, fit.start)
    turned = replace(fit, start=start, along=way * fit.along, curvature=way * fit.curvature, rise=way * fit.rise)
    low, high = np.where(where, traced.high, traced.low), np.where(where, traced.low, traced.high)
    return Traced(turned, traced.shift, low, high)
