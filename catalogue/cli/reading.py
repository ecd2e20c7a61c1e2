"""Read linkages and guided points from files: pivots or link lengths, in JSON or CSV."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from difflib import get_close_matches
from typing import Any

import numpy as np

from ..errors import InvalidLinkage, InvalidRequest, quoted
from ..folders import expanded
from ..given import number
from ..kinematics.from_lengths import guide_from_lengths
from ..kinematics.linkage import Linkage
from ..kinematics.types import Complexes
from ..problem.path import point
from ..units import WRITTEN, factor
from .rows import LENGTHS, NUMBERS, Row, rows_of
from .units import UNITS

#: Columns permitted beside link lengths, and ignored.
NOTES = ("name", "note", "code", "id")
#: Columns not permitted beside pivots.
PIVOTS_EXCLUDE = {*LENGTHS, "branch", "across"}


def read_text(file: str) -> str:
    """Read a file, or standard input for ``-``.

    Raises
    ------
    InvalidRequest
        If it cannot be read.
    """
    try:
        if file == "-":
            return (sys.stdin.buffer.read() if sys.stdin else b"").decode("utf-8-sig")  # None: it is closed
        return expanded(file).read_bytes().decode("utf-8-sig")
    except (OSError, UnicodeDecodeError, ValueError) as error:
        raise InvalidRequest(f"cannot read {file}: {getattr(error, 'strerror', None) or error}") from None


def read_linkages(file: str, unit: str | None = None) -> Linkage:
    """Read linkages from a file, in the positions given by pivots or crank angles.

    Parameters
    ----------
    file : str
        Name of the file, or ``-``.
    unit : str, optional
        Unit to convert to; if not given, the first unit in the file.

    Raises
    ------
    InvalidRequest, InvalidLinkage
        If the file cannot be read, or holds something else.
    """
    rows = read_rows(file)
    for place, given, _ in rows:
        if "pivots" not in given and "angle" not in given:
            raise InvalidLinkage(
                f"{place}: link lengths need the `angle` of the first crank, in degrees: a series is of one position"
            )
    chosen = unit or next((row.unit for row in rows if row.unit), None)
    times = np.array([float(factor(row.unit, chosen)) if row.unit and chosen else 1.0 for row in rows])
    linkages = linkages_of(rows)[0]
    return linkages if (times == 1).all() else linkages.moved(times)


def chains_in(content: str, file: str) -> list[Mapping[str, Any]]:
    """Read mechanisms of many bars from JSON; none if it holds something else.

    Raises
    ------
    InvalidRequest
        If a name is given twice.
    """

    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        held: dict[str, Any] = {}
        for name, value in pairs:
            if name in held:
                raise InvalidRequest(f"{file}: {quoted(name)} is given twice")
            held[name] = value
        return held

    if content.lstrip()[:1] not in ("[", "{") or '"bars"' not in content:
        return []
    try:
        given = json.loads(content, object_pairs_hook=once)
    except (ValueError, RecursionError):
        return []  # reported like any invalid JSON
    every = given if isinstance(given, list) else [given]
    return every if any(isinstance(one, dict) and "bars" in one for one in every) else []


def read_rows(file: str, content: str | None = None) -> list[Row]:
    """Read the linkages of a file, or of its content, as rows of values by name.

    A row holds `pivots` and, if given, `point` (complex); or link lengths.  Its unit is None if not
    given.

    Raises
    ------
    InvalidRequest, InvalidLinkage
        If the file cannot be read, holds no linkage, or something else.
    """
    content = read_text(file) if content is None else content
    if chains_in(content, file):
        raise InvalidRequest(f"{file} is a mechanism of many bars: here a linkage of two dyads is wanted")
    rows = rows_of(content, file)
    if not rows:
        raise InvalidRequest(f"{file} holds no linkage")
    read = []
    for place, given, _ in rows:
        unit = _unit(place, given.pop("unit", None))
        read.append(Row(place, (_pivots_and_point if "pivots" in given else _lengths)(place, given), unit))
    return read


def _unit(place: str, given: object) -> str | None:
    """Return the unit of length of a linkage from any of its spellings."""
    if given is None:
        return None
    times, unit = WRITTEN.get(given.strip().lower(), (0, "")) if isinstance(given, str) else (0, "")
    if times != 1:
        raise InvalidRequest(f"{place}: there is no unit {quoted(given)} of length; there are {', '.join(UNITS)}")
    return unit


def linkages_of(rows: list[Row]) -> tuple[Linkage, Complexes]:
    """Convert rows to linkages and their guided points, shape (n,), NaN where none is given.

    Raises
    ------
    InvalidLinkage
        If a row is no linkage; the message names the first one.
    """
    try:
        return _join([row.given for row in rows])
    except InvalidLinkage:
        for place, given, _ in rows:
            try:
                _join([given])
            except InvalidLinkage as error:
                raise InvalidLinkage(f"{place}: {str(error).removeprefix('linkage 0: ')}") from None
        raise


def _join(given: list[dict[str, Any]]) -> tuple[Linkage, Complexes]:
    pivots = np.full((len(given), 2, 2, 3), np.nan)
    points = np.full(len(given), complex(np.nan, np.nan))
    alike: dict[tuple[str, ...], list[int]] = {}  # rows by their names of values
    for i, one in enumerate(given):
        alike.setdefault(tuple(sorted(one)), []).append(i)
    for names, rows in alike.items():
        if "pivots" in names:
            pivots[rows] = [given[i]["pivots"] for i in rows]
            points[rows] = [given[i].get("point", np.nan) for i in rows]
        else:
            linkage, points[rows] = guide_from_lengths({name: [given[i][name] for i in rows] for name in names})
            pivots[rows] = linkage.pivots
    return Linkage(pivots), points


def _pivots_and_point(place: str, given: dict[str, Any]) -> dict[str, Any]:
    """Return pivots and guided point, under any of the names of the point."""
    if wrong := PIVOTS_EXCLUDE & {*given}:
        raise InvalidRequest(f"{place}: give `pivots` or `{min(wrong)}`, not both")
    points = [given[name] for name in ("guided", "point") if given.get(name) is not None]
    if "x" in given or "y" in given:
        points.append([given.get("x"), given.get("y")])
    if len(points) > 1:
        raise InvalidRequest(f"{place}: give one guided point, by `guided`, by `point`, or by `x` and `y`")
    held = {"pivots": _pivots(place, given["pivots"])}
    return {**held, "point": complex(*point(f"{place}: the guided point", points[0]))} if points else held


def _pivots(place: str, given: Any) -> list[list[list[float]]]:
    try:
        full = [[[number("w", x) for x in ([*p, 1.0] if len(p) == 2 else p)] for p in dyad] for dyad in given]
        if np.shape(full) == (2, 2, 3):
            return full
    except (TypeError, ValueError):
        pass
    raise InvalidLinkage(f"{place}: a linkage is [[A1, A1*], [A2, A2*]], each pivot [x, y] or [x, y, w]")


def _lengths(place: str, given: dict[str, Any]) -> dict[str, Any]:
    """Return the link lengths; refuse unknown names."""
    known = {name: number(f"{place}: {name}", value) for name, value in given.items() if name in NUMBERS}
    for name in given:
        if name not in known and name not in NOTES:
            if near := get_close_matches(name, sorted(NUMBERS), n=1):
                raise InvalidRequest(f"{place}: there is no {quoted(name)}; did you mean {near[0]}?")
            if known:
                raise InvalidRequest(f"{place}: there is no {quoted(name)}; names of notes are {', '.join(NOTES)}")
    if not known:
        raise InvalidRequest(f"{place} has neither `pivots` nor link lengths")
    return known
