"""Find and measure the straightest or longest stretches of given linkages."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..errors import InvalidRequest, quoted
from ..given import positive, switch, whole
from ..guidance.allowance import Zone, allowances
from ..guidance.cells import Curves
from ..guidance.circuit_curve import CircuitCurve, fitted, move_to_unit, on_path
from ..guidance.metrics import measure as measures_of
from ..guidance.minimum_zone import grid
from ..guidance.stretches import longest, straightest
from ..guidance.trace import Traced
from ..guidance.wide_arc import WIDE_ARC, on_wide_arcs, wide_arcs
from ..guidance.wide_stretches import nearest_arcs
from ..guidance.windows import Stretches
from ..guides.chain_stretch import ChainStretch
from ..guides.own_chain import OwnChain
from ..guides.placed import IMMOBILE, PlacedGuide
from ..guides.results import Measured
from ..guides.stretch import Stretch
from ..kinematics.batch import Columns, join
from ..kinematics.circuits import OPEN, Carriers, Circuits, circuits
from ..kinematics.handedness import followed
from ..kinematics.link_lengths import link_lengths
from ..kinematics.linkage import Linkage
from ..kinematics.types import Array, Complexes, Floats, Indices, Mask
from ..problem.path import consistent_arc, is_wide
from ..series.classification import classify
from ..units import common
from .listing import Frames, listed, measured_columns

if TYPE_CHECKING:
    from ..series.series import Series


class MeasureOptions(NamedTuple):
    """Grids and tolerances of measured stretches."""

    #: Number of positions along which the driving crank is followed: it turns by less than a half
    #: turn between two.
    turns: int = 65
    instants: int = 9  #: number of positions to classify
    corrections: int = 8  #: largest number of corrections of a stretch to the requested stroke on the finer grid
    close: float = 1e-9  #: relative error of stroke or deviation at which corrections stop
    #: Safety factor of advice: suggested over longest stroke, least over suggested deviation.
    surely: float = 0.98
    #: Relative shortening of a stroke per relative excess of its deviation: a half, as a deviation
    #: grows at least with the square of the stroke.
    shorter: float = 0.5
    #: Deviation over tolerance up to which a stretch is shortened; beyond it another stretch is
    #: sought.
    little: float = 1.02
    missed: float = 1e-6  #: permitted relative error of a requested stroke
    more: int = 4  #: number of stretches per circuit in the search for another one


MEASURE = MeasureOptions()

#: Tolerances of further searches, over the requested one, if the finer grid measures a larger
#: deviation.
STRICTER_TOLERANCES = (0.995, 0.97)


def measure(
    guides: PlacedGuide | OwnChain | Sequence[PlacedGuide | OwnChain],
    *,
    stroke: float | None = None,
    deviation: float | None = None,
    radius: float | None = None,
    angle: float | None = None,
    arc: bool = False,
    limit: int = 4,
    series: Callable[[], Mapping[str, Series]] | None = None,
) -> Measured:
    """Find the straightest, or most circular, stretches of guides on all their circuits.

    Parameters
    ----------
    guides : PlacedGuide or OwnChain, or sequence of one kind
    stroke, deviation : float, optional
        Stroke, to minimise the deviation; or deviation, to maximise the stroke.  With both:
        stretches of the stroke, with their allowance within the deviation; not for mechanisms of
        many bars [length].
    radius : float, optional
        Radius of an arc; the deviation is then the largest distance from the best-fitting arc of
        this radius [length].  The longest stroke within a deviation is found on arcs below a half
        circle.
    angle : float, optional
        Angle of an arc, up to 350, with its radius or its stroke [deg].
    arc : bool
        Fit arcs of any radius.
    limit : int
        Maximum number of stretches per linkage; 1 searches faster and less thoroughly.
    series : callable, optional
        Returns the series by code, such as ``lambda: cat.registry.series``, to name the nearest
        one; mechanisms of many bars have none.

    Returns
    -------
    Measured

    Raises
    ------
    InvalidRequest
        If neither stroke nor deviation is given or one is not positive, if stroke, radius and angle
        contradict one another, if the linkages have different units, or if an arc of a half circle
        or an allowance is requested of a mechanism of many bars.

    Examples
    --------
    >>> from catalogue import guide, measure
    >>> links = {"crank": 100, "rocker": 250, "ground": 220, "coupler": 250}
    >>> mine = guide(links | {"along": 125, "across": 80})
    >>> best = measure(mine, stroke=120)[0]
    >>> best.circuit, round(best.deviation, 3)
    (1, 0.485)
    """
    every = list(guides) if isinstance(guides, Sequence) and not isinstance(guides, str) else [guides]
    if not every:
        raise InvalidRequest("there is no linkage to measure")
    if wrong := [one for one in every if not isinstance(one, PlacedGuide | OwnChain)]:
        raise InvalidRequest(f"measure wants guides, such as catalogue.guide makes, not {quoted(wrong[0])}")
    if series is not None and not callable(series):
        raise InvalidRequest(f"series must be a function that returns the series by code, not {quoted(series)}")
    unit = common([one.unit for one in every])
    asked = Sought.of(stroke, deviation, radius, angle, arc, limit)
    if any(isinstance(one, OwnChain) for one in every):
        return _measure_chains(every, asked)
    placed = [one for one in every if isinstance(one, PlacedGuide)]
    linkage = Linkage([one.pivots for one in placed])
    point = np.array([complex(*one.guided) for one in placed])
    found = circuits(linkage)
    at = point[found.of]
    rows: dict[int, Stretch] = {}
    for part, places in best_stretches(found, at, asked):
        rows |= zip(places.tolist(), _build_stretches(part, found, asked, series, unit), strict=True)
    missing = np.setdiff1d(np.arange(len(linkage)), [one.number - 1 for one in rows.values()])
    failed = _reasons(found, at, missing, asked)
    return Measured([rows[i] for i in sorted(rows)], "" if rows else f"no stretch found: {failed[1]}", failed)


@dataclass(frozen=True)
class Sought:
    """Stretches to find: of a stroke, or within a tolerance; along lines or arcs."""

    stroke: float | None
    tolerance: float | None
    radius: float | None
    curved: bool
    wide: float | None
    limit: int

    @classmethod
    def of(
        cls, stroke: Any, deviation: Any, radius: Any = None, angle: Any = None, arc: Any = False, limit: Any = 4
    ) -> Sought:
        """Check the arguments of `measure`."""
        limit = whole("limit", limit, 1)
        if angle is not None:
            stroke, radius, angle = consistent_arc(stroke, radius, angle)
        if stroke is None and deviation is None:
            raise InvalidRequest("say over which stroke it is to be measured, or within which deviation")
        tolerance = None if deviation is None else positive("deviation", deviation)
        if radius is not None:
            radius = positive("radius", radius)
        curved = switch("arc", arc) or radius is not None
        length = None if stroke is None else positive("stroke", stroke)
        if length is not None and radius is not None:
            length, radius, angle = consistent_arc(length, radius, angle)  # refuses an impossible arc
        return cls(length, tolerance, radius, curved, angle if is_wide(angle) else None, limit)

    @property
    def allowed(self) -> float:
        """Largest deviation."""
        return np.inf if self.tolerance is None else self.tolerance


def best_stretches(found: Carriers, at: Complexes, asked: Sought) -> Iterator[tuple[Laid, Indices]]:
    """Find the best stretches of coupler points on circuits, those of each linkage in order.

    Parameters
    ----------
    found : Circuits or ChainCircuits
        k circuits, of linkages numbered from 0.
    at : complex ndarray, shape (k,)
        Guided points [length].
    asked : Sought

    Yields
    ------
    Laid, ndarray of int
        A part of the stretches, and their places in the list of all.
    """
    length, radius, allowed, curved = asked.stroke, asked.radius, asked.allowed, asked.curved
    within = allowed if length is None else np.inf

    def seek(some: Indices, count: int, share: float = 1.0) -> Stretches:
        if length is not None:
            strokes = np.full(len(some), length)
            return straightest(found[some], at[some], strokes, circle=curved, radius=radius, count=count)
        limits = np.full(len(some), share * allowed)
        return longest(found[some], at[some], limits, circle=curved, radius=radius, count=count)

    parts, some, more = [], np.arange(len(found)), asked.limit
    if asked.wide is not None and radius is not None:
        parts.append(Laid.over_wide_arcs(found, at, radius, asked.wide, asked.limit))
    for share in (1.0, *STRICTER_TOLERANCES) if asked.wide is None else ():
        sought = seek(some, more, share)
        part = Laid.of(found, at, replace(sought, circuit=some[sought.circuit]), curved, radius, within)
        over = part.deviation > within * (1 + MEASURE.close)
        parts.append(part[np.flatnonzero(np.isfinite(part.deviation) & ~over)])
        seen = np.concatenate([found.of[one.circuit] for one in parts])
        missed = np.flatnonzero(np.isin(found.of, np.setdiff1d(found.of, seen)))
        # the best stretch cannot be measured, or is worse on the finer grid: try more stretches
        # within a stricter tolerance
        some = np.union1d(missed if length is None or more < MEASURE.more else missed[:0], part.circuit[over])
        more = max(asked.limit, MEASURE.more)
        if not len(some):
            break
    best = join(*(one.stretches for one in parts))
    kept = _select_best(found, best, best.deviation if length is not None else -best.stroke, asked.limit)
    of_part = np.repeat(np.arange(len(parts)), [len(one.circuit) for one in parts])
    start = np.searchsorted(of_part, np.arange(len(parts)))
    for k, part in enumerate(parts):
        chosen = np.flatnonzero(of_part[kept] == k)
        yield part[kept[chosen] - start[k]], chosen


def _measure_chains(every: Sequence[Any], asked: Sought) -> Measured:
    """Measure mechanisms of many bars, one after the other."""
    if others := [one for one in every if not isinstance(one, OwnChain)]:
        raise InvalidRequest(f"measure takes mechanisms of many bars alone, not together with {quoted(others[0])}")
    if asked.wide is not None:
        raise InvalidRequest(
            "arcs near a half circle, or beyond, are not measured yet on mechanisms of many bars: ask for less"
        )
    if asked.stroke is not None and asked.tolerance is not None:
        raise InvalidRequest(
            "the allowance within a deviation is not measured yet on mechanisms of many bars: give the stroke or the "
            "deviation alone"
        )
    rows, failed = list[ChainStretch](), dict[int, str]()
    for number, one in enumerate(every, 1):
        found, at = one.circuit, np.array([one.guided_point])
        made: dict[int, ChainStretch] = {}
        for part, places in best_stretches(found, at, asked):
            made |= zip(places.tolist(), _chain_rows(part, one, asked, number), strict=True)
        rows += _drop_overlapping([made[i] for i in sorted(made)])
        if not made:
            failed[number] = _reasons(found, at, np.array([0]), asked)[1]
    return Measured(rows, "" if rows else f"no stretch found: {failed[1]}", failed)


def _drop_overlapping(rows: list[ChainStretch]) -> list[ChainStretch]:
    """Drop stretches along the path of a better one, such as those of the way back."""
    kept = list[ChainStretch]()
    for one in rows:
        at = complex(*one.start)
        if all(abs(at - complex(*other.start)) > MEASURE.missed * one.size for other in kept):
            kept.append(one)
    return kept


def _chain_rows(at: Laid, one: OwnChain, asked: Sought, number: int) -> list[ChainStretch]:
    """Build the stretches of a mechanism of many bars."""
    made, traced, radii = [], at.traced, np.full(len(at.circuit), np.nan)
    if asked.curved:
        with np.errstate(divide="ignore"):
            radii = at.frames.extent / np.abs(traced.fit.curvature.astype(float))
    for i, middle in enumerate(at.curve.motion.middle.tolist()):
        radius = asked.radius or (float(radii[i]) if np.isfinite(radii[i]) else None)
        start = complex(at.frames.start[i])
        made.append(
            ChainStretch.of_window(
                one,
                (middle + float(traced.low[i]), middle + float(traced.high[i])),
                stroke=float(at.frames.extent[i]),
                deviation=float(at.deviation[i]),
                radius=radius,
                start=[start.real, start.imag],
                along=float(at.frames.along[i]),
                number=number,
            )
        )
    return made


def _reasons(found: Carriers, point: Complexes, missing: Indices, asked: Sought) -> dict[int, str]:
    """Explain why linkages have no stretch, by number from 1, with remedies."""
    some = np.flatnonzero(np.isin(found.of, missing))
    if not len(some):
        return {}
    found, point, curved, radius = found[some], point[some], asked.curved, asked.radius
    of = np.searchsorted(missing, found.of)

    shortest, allowed = np.full((2, len(missing)), np.inf)
    most, immobile = np.zeros(len(missing)), np.zeros(len(missing), bool)
    np.fmin.at(shortest, of, Curves.of(found, point, np.arange(len(some))).shortest)
    np.logical_or.at(immobile, of, found.is_immobile)
    if asked.wide is None and asked.stroke is None:
        at = straightest(found, point, shortest[of], circle=curved, radius=radius)
        np.fmin.at(allowed, of[at.circuit], at.deviation / MEASURE.surely)
    elif asked.wide is None:
        at = longest(found, point, np.full(len(some), np.inf), circle=curved, radius=radius)
        np.fmax.at(most, of[at.circuit], MEASURE.surely * at.stroke)

    def reason(i: int) -> str:
        if immobile[i]:
            return IMMOBILE
        if asked.wide is not None:
            return (
                f"on no circuit does its point run forward along an arc of radius {radius:g} "
                f"over {asked.wide:g}\u00b0: ask for another radius, or for less"
            )
        another = "ask for another kind of path"
        if asked.stroke is None:
            better = f"allow {allowed[i]:.3g}" if allowed[i] < np.inf else another
            return f"none longer than {shortest[i]:.3g} keeps within {asked.allowed:g}: {better}"
        if asked.stroke < shortest[i]:
            return f"a stroke of {asked.stroke:g} is too short to be looked for: ask for {shortest[i]:.3g} or more"
        better = f"ask for {most[i]:.3g} or less" if most[i] > MEASURE.surely * shortest[i] else another
        return f"on no circuit does its point run forward over a stroke of {asked.stroke:g}: {better}"

    return {int(number) + 1: reason(i) for i, number in enumerate(missing)}


@dataclass(frozen=True)
class Laid(Columns):
    """Stretches normalised to paths from 0 to 1, with traces and frames; arrays of shape (n,)."""

    circuit: Indices
    low: Floats
    high: Floats
    curve: CircuitCurve
    traced: Traced
    frames: Frames

    @classmethod
    def of(
        cls, found: Carriers, point: Complexes, at: Stretches, curved: bool, radius: float | None, allowed: float
    ) -> Laid:
        """Place stretches along their nominals.

        With an infinite `allowed` they cover exactly their strokes; else those slightly above the
        permitted deviation are shortened.
        """
        some, z, low, high = found[at.circuit], point[at.circuit], at.low.copy(), at.high.copy()
        forward = followed(some, z)[1] > 0  # so that mirror images are extended at mirrored ends
        fit = fitted(some, z, low, high, circle=curved, radius=radius)
        for _ in range(MEASURE.corrections):
            with np.errstate(all="ignore"):
                over, length = fit.deviation / allowed, fit.stroke
                missing = at.stroke - length
                if np.isfinite(allowed):
                    missing = (
                        np.where(
                            (over > 1 + MEASURE.close) & (over < MEASURE.little),
                            -MEASURE.shorter * (over - 1) - MEASURE.close,
                            0.0,
                        )
                        * length
                    )
                where = np.flatnonzero(np.abs(missing) > 0.5 * MEASURE.close * length)
            # where a path turns by the permitted maximum at one end, extend it at the other one
            for at_end in (forward, ~forward):
                if not len(where):
                    break
                here, along = some[where], fit.along[where]
                ends = _extend_ends(here, z[where], low[where], high[where], missing[where], at_end[where], along)
                new = fitted(here, z[where], *ends, circle=curved, radius=radius)
                lost = (at_end is forward) & np.isnan(new.deviation) & np.isfinite(fit.deviation[where])
                low[where[~lost]], high[where[~lost]] = (end[~lost] for end in ends)
                fit, where = fit.replaced(where[~lost], new[np.flatnonzero(~lost)]), where[lost]
        if not np.isfinite(allowed):  # at the end of an open circuit the stroke may be out of reach
            lost = ~(np.abs(at.stroke - fit.stroke) <= MEASURE.missed * at.stroke)
            fit = replace(fit, deviation=np.where(lost, np.nan, fit.deviation))
        frames = Frames(fit.stroke, fit.start, np.degrees(np.angle(fit.along)), fit.along)
        return cls(at.circuit, low, high, *move_to_unit(*on_path(some, z, low, high, fit)), frames)

    @classmethod
    def over_wide_arcs(cls, found: Any, point: Complexes, radius: float, angle: float, count: int) -> Laid:
        """Place stretches along arcs near a half circle or beyond."""
        which, rough = nearest_arcs(found, point, radius, angle, count)
        some, z = found[which], point[which]
        n = len(which)
        fine = wide_arcs(
            some, z, rough.middle, rough.centre, np.full(n, radius), angle, nodes=WIDE_ARC.shown, most=WIDE_ARC.most
        )
        good = np.flatnonzero(np.isfinite(fine.fit.deviation))
        which, some, z, fine = which[good], some[good], z[good], fine[good]
        fit = fine.fit
        frames = Frames(fit.stroke, fit.start, np.degrees(np.angle(fit.along)), fit.along)
        ends = np.minimum(fine.start, fine.end), np.maximum(fine.start, fine.end)
        return cls(which, *ends, *move_to_unit(*on_wide_arcs(some, z, fine)), frames)

    @property
    def deviation(self) -> Floats:
        """Deviations [length]."""
        return np.asarray(self.frames.extent * self.traced.fit.deviation)

    @property
    def stretches(self) -> Stretches:
        none = np.zeros((len(self.circuit), 0), int)
        extent = self.frames.extent
        return Stretches(self.circuit, self.low, self.high, extent, extent, self.deviation, none)


def _extend_ends(
    some: Carriers, point: Complexes, low: Floats, high: Floats, by: Floats, at_end: Mask, along: Complexes
) -> tuple[Floats, Floats]:
    """Extend stretches (n,) at their ends or starts; return the phases of both."""
    last, half = np.where(some.kind == OPEN, 2 * np.pi, np.inf), 0.5 * (high - low)
    with np.errstate(all="ignore"):
        step = by / _speed(some, point, np.where(at_end, high, low), along)
    later, earlier = np.clip(high + step, low + half, last), np.clip(low - step, 2 * np.pi - last, high - half)
    return np.where(at_end, low, earlier), np.where(at_end, later, high)


def _speed(some: Carriers, point: Complexes, s: Floats, along: Complexes) -> Floats:
    """Compute the derivative of the stroke by the phase of its end."""
    step = 1e-6
    z = some.pose(np.stack([s - step, s + step])).point(point)
    return np.asarray(np.abs(((z[1] - z[0]) * along.conj()).real) / (2 * step))


def _select_best(found: Carriers, at: Stretches, key: Floats, limit: int) -> Indices:
    """Select at most `limit` stretches of each linkage by ascending key; infinite keys are omitted.

    Of stretches that overlap by more than half, the better one is selected.
    """
    order = np.lexsort((key, found.of[at.circuit]))
    order = order[np.isfinite(key[order])]
    kept: list[int] = []
    of, middle = found.of[at.circuit], 0.5 * (at.low + at.high)
    period, half = found.period[at.circuit], 0.25 * (at.high - at.low)
    first = 0  # first selected stretch of the current linkage
    for i in order.tolist():
        if kept and of[kept[-1]] != of[i]:
            first = len(kept)
        same = np.array(kept[first:], int)
        if len(same) >= limit:
            continue
        same = same[at.circuit[same] == at.circuit[i]]
        away = np.mod(middle[same] - middle[i] + 0.5 * period[i], period[i]) - 0.5 * period[i]
        if not (np.abs(away) < half[i] + half[same]).any():
            kept.append(i)
    return np.array(kept, int)


def _build_stretches(
    at: Laid,
    found: Circuits,
    asked: Sought,
    series: Callable[[], Mapping[str, Series]] | None,
    unit: str | None,
) -> list[Stretch]:
    """Build the stretches in the unit and frame of the linkages."""
    n, curve, traced = len(at.circuit), at.curve, at.traced
    tolerance, radius, curved = asked.tolerance, asked.radius, asked.curved
    if not n:
        return []
    columns = measured_columns(curve, traced, measures_of(curve, traced, in_middle=True), at.frames)
    nothing, blank = np.full(n, np.nan), np.full(n, "", object)
    zone, limits = Zone(curved, 3 if curved and radius is None else 2), (tolerance or np.nan) / at.frames.extent
    if not curved or radius is not None:
        columns["radius"] = np.full(n, radius if curved else np.nan, float)
    if asked.wide is not None:
        columns["arc_angle"] = np.full(n, asked.wide)
    first = np.searchsorted(found.of, found.of[at.circuit])
    codes, residual = _nearest_series(at, series)
    columns |= {
        "id": nothing,
        "family": curve.linkage.family.astype(object),
        "series": blank,
        "configuration": blank,
        "order": np.zeros(n),
        "allowance": at.frames.extent * allowances(limits, curve, traced, zone) if tolerance else nothing,
        "asked_deviation": np.full(n, np.nan if tolerance is None else tolerance),
        "fitted": np.full(n, zone.free),
        "number": found.of[at.circuit] + 1,
        "circuit": at.circuit - first + 1,
        "given": np.isfinite(found.phase[at.circuit]).astype(object),
        "joined": found.is_joined[at.circuit].astype(object),
        "nearest_series": codes,
        "residual": residual,
        "unit": np.full(n, unit, object),
    }
    columns |= driven(curve, traced, columns["driver"], at.frames)
    window = np.stack([traced.low, traced.high], axis=1).tolist()
    more = [{"_window": (low, high)} for low, high in window]
    rows = listed(Stretch, curve.linkage, curve.point, nothing + 0j, at.frames, columns, more)
    lengths = link_lengths(Linkage([one.pivots for one in rows]), np.array([complex(*one.guided) for one in rows]))
    for i, one in enumerate(rows):
        one.__dict__["lengths"] = {name: float(v[i]) for name, v in lengths.items() if not np.isnan(v[i])}
    return rows


def driven(curve: CircuitCurve, traced: Traced, driver: Floats, frames: Frames) -> dict[str, Floats]:
    """Compute the angles of the driving cranks at both ends of the path [deg].

    The angle at the end is counted from the start, so its difference gives the sense of rotation.
    """
    n, number = len(curve), np.nan_to_num(driver).astype(int)
    steps = traced.parameters(np.linspace(-1, 1, MEASURE.turns)).astype(float)
    z = curve.motion.pose(steps).linkages(curve.linkage).points.reshape(MEASURE.turns, n, 2, 2)
    z = z[:, np.arange(n), np.maximum(number - 1, 0)]
    turned = np.degrees(np.unwrap(np.angle((z[..., 1] - z[..., 0]) * frames.direction), axis=0))
    turned = np.where(number > 0, turned, np.nan)
    return {"drive_from": turned[0], "drive_to": turned[-1]}


def _nearest_series(at: Laid, series: Callable[[], Mapping[str, Series]] | None) -> tuple[Array, Floats]:
    """Find the degenerate series nearest to linkages on their stretches, and the residuals."""
    n = len(at.circuit)
    if series is None:
        return np.full(n, None, object), np.full(n, np.nan)
    t = at.traced.parameters(grid(MEASURE.instants - 1).nodes)
    told = classify(at.curve.motion.pose(t).linkages(at.curve.linkage), series())
    narrow = [k for k, one in enumerate(told.tested) if one.degenerate]
    residual = told.residual[:, narrow].reshape(len(t), n, -1)
    with np.errstate(all="ignore"):
        least = np.where(np.isfinite(residual), residual, np.inf).min(0)
    best = least.argmin(1)
    value = least[np.arange(n), best]
    codes = np.array([told.tested[k].code for k in narrow], dtype=object)[best]
    codes[~np.isfinite(value)] = None
    return codes, np.where(np.isfinite(value), value, np.nan)
