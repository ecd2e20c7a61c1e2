"""The user's own linkage, typed or dragged: its path, and its straightest stretch."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import CatalogueError, InvalidRequest, quoted
from ..given import positive
from ..guidance.stretches import straightest
from ..guides.own_guide import OwnGuide, guide
from ..guides.run import Run
from ..kinematics.circuits import circuits
from ..units import decimal
from .cards import Card, Number, card, drawing, figure, words

#: Longest text of a linkage [characters]: ten times that of pivots to full precision.
LONGEST = 2000
#: Initial linkage: Watt's at mid-stroke.
EXAMPLE = "[[[-50, 30], [0, 30]], [[50, -30], [0, -30]]]"


@dataclass(frozen=True)
class Own:
    """Measurements of an own linkage; positions as plain numbers, for the script of the page."""

    family: str
    pivots: list[list[list[float]]]
    guided: list[float]
    path: list[list[float]]  #: path of the point over its circuit
    stretch: list[list[float]]  #: straightest stretch of the path
    numbers: tuple[Number, ...]
    card: Card | None
    error: str  #: reason for a missing stretch


def read(linkage: str, x: str, y: str) -> OwnGuide:
    """Parse a guide: pivots or link lengths as JSON, and the coordinates of the guided point.

    Raises
    ------
    CatalogueError
        If they form no linkage, or the point is missing.
    """
    if len(linkage) > LONGEST:
        raise InvalidRequest(f"a linkage has {LONGEST} letters at most")
    try:
        given = json.loads(linkage)
    except (ValueError, RecursionError) as error:
        raise InvalidRequest(f"the linkage is no JSON: {error}") from None
    if not isinstance(given, dict | list):
        raise InvalidRequest("the linkage must be pivots, [[A1, A1*], [A2, A2*]], or link lengths by their names")
    if isinstance(given, dict) and "bars" in given:
        raise InvalidRequest("a mechanism of many bars is not taken here yet: `catalogue show FILE --plot` draws it")
    point = (_number("x", x), _number("y", y)) if x or y else None
    if isinstance(given, list) and point is None:
        raise InvalidRequest("say where the guided point is: x and y")
    return guide(given, point if isinstance(given, list) or not {"along", "x"} & {*given} else None)


def _number(name: str, text: str) -> float:
    found = decimal(text)
    if found is None:
        raise InvalidRequest(f"{name} must be a number, not {quoted(text)}")
    return found


def measured(linkage: str, x: str, y: str, stroke: str, unit: str, settled: bool) -> Own:
    """Measure an own linkage: its path and its straightest stretch of a stroke.

    Parameters
    ----------
    linkage, x, y, stroke, unit : str
        Fields of the form.
    settled : bool
        Whether to search all circuits, draw and store the stretch.  False while the linkage is
        dragged: only the current circuit is searched, which is fast enough.
    """
    one = read(linkage, x, y).in_unit(unit)
    length = positive("stroke", _number("stroke", stroke))
    shown = [Number(words(name), figure(value, 5), "length") for name, value in one.lengths.items()]
    shown.append(Number("Stroke", figure(length, 5), "length"))
    run = one.run(whole=True)
    path = _places(run.path(run.polyline()))
    stretch, told, drawn, error = (_search_all_circuits if settled else _search_current_circuit)(one, length)
    return Own(str(one.linkage.family[0]), one.pivots, one.guided, path, stretch, (*shown, *told), drawn, error)


Found = tuple[list[list[float]], list[Number], Card | None, str]


def _search_all_circuits(one: OwnGuide, stroke: float) -> Found:
    """Find the straightest stretch on all circuits, with numbers and card, or the error."""
    try:
        found = one.measure(stroke=stroke, limit=1)
    except CatalogueError as fault:
        return [], [], None, str(fault)
    if not found:
        return [], [], None, str(found.explanation)
    best = found[0]
    reached = "" if best.given else ", joined at a change point" if best.joined else ", to be assembled anew"
    circuit = f"{best.circuit}{reached}"
    told = _told(figure(best.deviation), figure(best.min_transmission, 2), circuit)
    run = best.run()
    return _places(run.path(run.polyline())), told, card(best, found.remember()[0], drawing(best)), ""


def _search_current_circuit(one: OwnGuide, stroke: float) -> Found:
    """Find the straightest stretch on the current circuit, without card, while dragging."""
    here, point = circuits(one.linkage)[:1], np.array([complex(*one.guided)])
    found = straightest(here, point, np.array([stroke]), circle=False, count=1)
    if not len(found.deviation) or not np.isfinite(found.deviation[0]):
        return [], _told("–", "…", "1"), None, ""
    run = Run(one, here, float(found.low[0]), float(found.high[0]))
    return _places(run.path(run.polyline())), _told(figure(float(found.deviation[0])), "…", "1"), None, ""


def _told(deviation: str, transmission: str, circuit: str) -> list[Number]:
    return [
        Number("Deviation", deviation, "length", "Half the width of the narrowest strip that contains the stretch."),
        Number("Transmission", transmission, "°", "Minimum angle over the stretch; the better crank drives."),
        Number("Circuit", circuit, "", "Positions reachable without disassembly."),
    ]


def _places(z: Any) -> list[list[float]]:
    """Return the finite positions of a path that can be drawn."""
    kept = z[np.isfinite(z)]
    return [[round(v.real, 9), round(v.imag, 9)] for v in kept.tolist()]
