"""Verify restored answers: refuse records that disagree with a measurement of their mechanism.

They measure the path, all numbers of the table and the drive, and all numbers of a dwell.  A record
does not say whether its deviation is from the best-fitting or from the prescribed nominal, nor
whether the guide is a slot: it is accepted if one of these measurements agrees.  Numbers that
depend on the request (score, allowance, gap) or on the origin are protected by the code; see
`answers`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from ..candidates.batch import SHOWN
from ..errors import InvalidRequest, quoted
from ..guidance.circuit_curve import CircuitCurve, move_to_unit
from ..guidance.coupler_curve import CouplerCurve, coupler_curve
from ..guidance.dwell import dwells, slides_over_turn, strays, turned
from ..guidance.fixed_nominal import Nominal, in_place
from ..guidance.metrics import measure
from ..guidance.placement import at_stroke
from ..guidance.trace import Traced
from ..guides.candidate import Candidate
from ..guides.chain_stretch import ChainStretch
from ..guides.columns import DWELL, LENGTH, STRETCH
from ..guides.dwell import DwellCandidate
from ..guides.stretch import Stretch
from ..problem.path import StraightLine
from .listing import Frames, measured_columns
from .measure import driven

Numbers = Mapping[str, Any]


class Agreement(NamedTuple):
    """Permitted differences between a record and its measurement."""

    relative: float = 2e-3  #: permitted relative difference: the search uses another grid
    strokes: float = 1e-11  #: permitted difference of lengths near zero [strokes]
    places: float = 1e-14  #: permitted difference of lengths near zero [largest coordinate]
    others: float = 1e-6  #: permitted difference of other numbers near zero


AGREEMENT = Agreement()

#: Angles from the x axis, equal modulo a full turn.
DIRECTIONS = ("along", "drive_from", "drive_to")


def check(one: Any) -> None:
    """Refuse an answer of planar guides that disagrees with its measurement."""
    ways: Iterator[Numbers] = iter(())
    if isinstance(one, DwellCandidate):
        ways = _measure_dwell(one)
    elif isinstance(one, Candidate):
        ways = _measure_candidate(one)
    elif isinstance(one, ChainStretch):
        ways = iter([{"deviation": one.deviation_again(), **one.over_window()}])
    wrong = []
    with np.errstate(all="ignore"):
        for found in ways:
            wrong.append(_first_difference(one, found))
            if not wrong[-1]:
                return
    if wrong:
        raise InvalidRequest(wrong[0])


def _first_difference(one: Candidate | DwellCandidate, found: Numbers) -> str:
    """Describe the first difference between record and measurement.

    The text is empty if there is none.
    """
    told = vars(one)
    stroke, deviation = told.get("stroke", 1.0), told.get("deviation", 0.0)
    far = max(np.abs(np.ravel(told[name])).max() for name in ("pivots", "guided", "start", "joint") if name in told)
    close = AGREEMENT.strokes * stroke + AGREEMENT.places * float(far)
    for name, value in found.items():
        said = told[name]
        if said is None:
            continue  # the record lacks this number
        if isinstance(value, str | list):
            good = said == value
        elif name == "start":
            good = abs(complex(*said) - complex(*value)) <= close + deviation
        elif name in DIRECTIONS:
            off, wide = (said - value + 180) % 360 - 180, np.degrees(2 * deviation / stroke)
            # a stretch is measured in place, so its direction is exact
            own = isinstance(one, Stretch) and name == "along"
            good = abs(off) <= (AGREEMENT.others + AGREEMENT.relative * wide if own else AGREEMENT.relative + wide)
        else:
            least = close if (STRETCH.get(name) or DWELL[name]).unit == LENGTH else AGREEMENT.others
            good = abs(said - value) <= least + AGREEMENT.relative * abs(value)
        if not good:
            again = "cannot be measured again" if value != value else f"measured again {quoted(value)}"
            return f"its {name.replace('_', ' ')} is {quoted(said)}, {again}"
    return ""


def _measure_candidate(one: Candidate) -> Iterator[Numbers]:
    """Yield measurements of a candidate, as a linkage and as a slot."""
    driver = np.array([one.driver if one.driver in (1, 2) else 0])
    for curve, traced, frames in _trace_stretch(one) if isinstance(one, Stretch) else _trace_path(one):
        start = float(frames.start[0].real), float(frames.start[0].imag)
        for slots in (False, True):
            found = measure(curve, traced, in_middle=True, inverse=slots, driver=driver)
            columns = measured_columns(curve, traced, found, frames, slots=slots)
            if isinstance(one, Stretch) and isinstance(curve, CircuitCurve):
                columns |= driven(curve, traced, columns["driver"], frames)
            turning, machine = columns.pop("rotates")[0], curve.linkage.inverted() if slots else curve.linkage
            told = {name: float(values[0]) for name, values in columns.items()}
            yield {"family": str(machine.family[0]), **told, "rotates": turning, "start": start}


def _trace_path(one: Candidate) -> Iterator[tuple[CouplerCurve | CircuitCurve, Traced, Frames]]:
    """Yield a candidate traced along its best-fitting nominal and the recorded one."""
    if one.is_wide:
        yield from _trace_wide_arc(one)
        return
    frame = StraightLine(one.stroke, 0.05 * one.stroke, (one.start[0], one.start[1]), one.along)
    scale = frame.stroke * frame.direction
    linkage = one.linkage.moved(1 / scale, -frame.origin / scale)
    point, pole = (
        np.array([(complex(*(place or (np.nan, np.nan))) - frame.origin) / scale]) for place in (one.guided, one.pole)
    )
    curve, arc = coupler_curve(linkage, point, pole=pole, least=0.5), one.radius is not None
    radius = np.inf if one.radius is None else one.radius / one.stroke
    bend = np.array([-1 / radius]) if arc else None
    for best in (True, False):
        if best:
            traced = at_stroke(curve, 1.0, circle=arc, nodes=SHOWN, curvature=bend)
        else:
            traced = in_place(curve, Nominal(1.0, radius), SHOWN)
        fit, back = traced.fit, traced.fit.along.real < 0
        start, along = np.where(back, fit.start + fit.stroke * fit.along, fit.start), np.where(back, -1, 1) * fit.along
        way, stroke = along * frame.direction, np.array([one.stroke])
        yield curve, traced, Frames(stroke, scale * start + frame.origin, np.degrees(np.angle(way)), way)


def _trace_wide_arc(one: Candidate) -> Iterator[tuple[CircuitCurve, Traced, Frames]]:
    """Yield a normalised candidate traced along its arc near a half circle or beyond."""
    curve, traced = one._traced()
    fit = traced.fit
    if not isinstance(curve, CircuitCurve) or not np.isfinite(fit.deviation).all():
        raise InvalidRequest(f"its point does not run along an arc of {one.arc_angle:g}\u00b0")
    yield *move_to_unit(curve, traced), Frames(fit.stroke, fit.start, np.degrees(np.angle(fit.along)), fit.along)


def _trace_stretch(one: Stretch) -> Iterator[tuple[CircuitCurve, Traced, Frames]]:
    """Yield a normalised stretch traced in place."""
    curve, traced = one._traced()
    fit = traced.fit
    yield *move_to_unit(curve, traced), Frames(fit.stroke, fit.start, np.degrees(np.angle(fit.along)), fit.along)


def _measure_dwell(one: DwellCandidate) -> Iterator[Numbers]:
    """Yield measurements of a dwell, at the recorded length and residual."""
    from .dwells import SEARCH, diameter

    linkage = one.linkage
    point, joint, pivot = (np.array([complex(*place)]) for place in (one.guided, one.joint, one.pivot))
    curve = coupler_curve(linkage, point)
    path, driving = turned(curve, np.array([one.driver]), SEARCH.fine)
    found = dwells(path, joint, pivot[:, None], 1.0)
    told, begin = {}, None
    if one.drive_from is not None and one.drive_to is not None:
        crank, home = linkage.points[0, one.driver - 1, ::-1]
        begin = (one.drive_from - float(np.degrees(np.angle((crank - home) / (pivot[0] - home)))) - 1) % 360 - 359
        told = {"drive_to": one.drive_from + one.angle}
    slides = slides_over_turn(curve, np.array([one.driver]))
    slides = slides[np.isfinite(slides)]
    stray = strays(path, joint, pivot, one.angle, begin)
    yield {
        **told,
        "family": str(linkage.family[0]),
        "residual": float(stray[np.abs(stray - one.residual).argmin()]),
        "swing": float(found.swing[0, 0]),
        "min_transmission": float(np.fmin(found.transmission[0, 0], driving[0])),
        "size": diameter(np.array([*linkage.points[linkage.finite], *joint, *pivot, *slides]), path[:, 0]),
    }
