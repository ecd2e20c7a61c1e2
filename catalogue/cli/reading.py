"""Linkages and guided points from what a user writes: pivots or link lengths, in JSON or CSV."""

from __future__ import annotations

import csv
import io
import json
import math
import sys
from typing import Any

import numpy as np

from ..errors import InvalidLinkage, InvalidRequest, quoted
from ..folders import expanded
from ..kinematics.from_lengths import CLOSURES, POINT, POSITION, guide_from_lengths
from ..kinematics.linkage import Linkage
from ..kinematics.types import Array, Complexes, doubles
from ..problem.request import number, point

NAMES = {*POSITION, *POINT, *(name for names in CLOSURES for name in names)}
#: What separates the cells of a line: the first of these that the first line holds.
DELIMITERS = ("\t", ";", ",")
#: Numbers of a line without names: pivots by x and y, or by x, y and w; and the guided point.
COUNTS = {8: 0, 10: 2, 12: 0, 14: 2}


def read_text(file: str) -> str:
    """Return what a file, or with ``-`` the standard input, holds.

    Raises
    ------
    InvalidRequest
        If it cannot be read.
    """
    try:
        if file == "-":
            return sys.stdin.read().removeprefix("\ufeff")
        return expanded(file).read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError, ValueError) as error:
        raise InvalidRequest(f"cannot read {file}: {getattr(error, 'strerror', None) or error}") from None


def read_linkages(file: str) -> Linkage:
    """Return the linkages of a file, those of link lengths at the angle that is given.

    Raises
    ------
    InvalidRequest, InvalidLinkage
        If it cannot be read, or holds something else.
    """
    given = entries(read_text(file), file)
    if any("pivots" not in one and "angle" not in one for one in given):
        raise InvalidLinkage(
            "link lengths need the `angle` of the first crank, in degrees: a series is of one position"
        )
    return linkages_of(given, file)[0]


def linkages_of(given: list[dict[str, Any]], file: str) -> tuple[Linkage, Complexes]:
    """Return linkages, and their guided points (n,), NaN where none is given."""
    pivots = np.full((len(given), 2, 2, 3), np.nan)
    points = np.full(len(given), complex(np.nan, np.nan))
    alike: dict[tuple[str, ...], list[int]] = {}  # by the names that are given
    for i, one in enumerate(given):
        alike.setdefault(tuple(sorted(one)), []).append(i)
    for names, rows in alike.items():
        if "pivots" in names:
            pivots[rows] = _pivots([given[i]["pivots"] for i in rows], file)
            if "point" in names:
                points[rows] = [complex(*point(f"{file}: the guided point", given[i]["point"])) for i in rows]
        else:
            table = {name: [number(f"{file}: {name}", given[i][name]) for i in rows] for name in names}
            linkage, points[rows] = guide_from_lengths(table)
            pivots[rows] = linkage.pivots
    return Linkage(pivots), points


def entries(text: str, file: str) -> list[dict[str, Any]]:
    """Return for each linkage of a text its pivots and guided point, or its link lengths, by name."""
    given = _json(text, file) if text.lstrip()[:1] in ("[", "{") else _csv(text, file)
    if not given:
        raise InvalidRequest(f"{file} holds no linkage")
    return given


def _json(text: str, file: str) -> list[dict[str, Any]]:
    try:
        given = json.loads(text, parse_int=float)  # whose digits nobody counts
    except RecursionError:
        raise InvalidRequest(f"{file} is no valid JSON: it is nested too deeply") from None
    except ValueError as error:
        raise InvalidRequest(f"{file} is no valid JSON: {error}") from None
    if isinstance(given, dict) or _depth(given) == 3:
        given = [given]
    found = []
    for i, one in enumerate(given):
        if not isinstance(one, dict):
            found.append({"pivots": one})
            continue
        links = {name: one[name] for name in one if name in NAMES}
        if "pivots" in one:
            point = one.get("guided", one.get("point", [one["x"], one["y"]] if {"x", "y"} <= {*one} else None))
            links = {"pivots": one["pivots"], **({} if point is None else {"point": point})}
        elif not links:
            raise InvalidRequest(f"{file}: object {i} has neither `pivots` nor link lengths")
        found.append(links)
    return found


def _csv(text: str, file: str) -> list[dict[str, Any]]:
    first = text.lstrip().partition("\n")[0]
    delimiter = next((d for d in DELIMITERS if d in first), ",")
    try:
        table = list(csv.reader(io.StringIO(text), delimiter=delimiter))
    except csv.Error as error:
        raise InvalidRequest(f"{file} is no valid CSV: {error}") from None
    rows = [(i, [cell.strip() for cell in row]) for i, row in enumerate(table, 1) if any(cell.strip() for cell in row)]
    heading = rows[0][1] if rows and all(_float(cell) is None for cell in rows[0][1]) else []
    rows = rows[1:] if heading else rows
    if not (NAMES & {*heading}):
        return [_line(row, file, i) for i, row in rows]
    for i, row in rows:
        if len(row) != len(heading):
            raise InvalidRequest(f"{file}, line {i}: it has {len(row)} columns, the heading {len(heading)}")
    return [
        {name: _cell(row[k], file, i, name) for k, name in enumerate(heading) if name in NAMES and row[k]}
        for i, row in rows
    ]


def _line(row: list[str], file: str, line: int) -> dict[str, Any]:
    """Return pivots and guided point from a line of numbers."""
    if len(row) not in COUNTS:
        raise InvalidRequest(
            f"{file}, line {line}: {len(row)} numbers; 8 (x, y) or 12 (x, y, w) are wanted, and 2 for the guided point"
        )
    numbers = [_cell(cell, file, line, str(k)) for k, cell in enumerate(row, 1)]
    last = len(numbers) - COUNTS[len(numbers)]
    held: dict[str, Any] = {"pivots": np.reshape(numbers[:last], (2, 2, -1)).tolist()}
    return held | ({"point": numbers[last:]} if numbers[last:] else {})


def _cell(text: str, file: str, line: int, column: str) -> float:
    value = _float(text)
    where = f"{file}, line {line}, column {column}"
    if value is None:
        raise InvalidRequest(f"{where}: {quoted(text)} is no number")
    if not math.isfinite(value):
        raise InvalidLinkage(f"{where}: {quoted(text)} is NaN or infinite")
    return value


def _float(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _pivots(given: list[Any], file: str) -> Array:
    try:
        full = [[[[*p, 1.0] if len(p) == 2 else list(p) for p in dyad] for dyad in one] for one in given]
        pivots = doubles(full)
    except (TypeError, ValueError):
        pivots = np.zeros(0)
    if pivots.shape[1:] != (2, 2, 3):
        raise InvalidLinkage(f"{file}: a linkage is [[A1, A1*], [A2, A2*]], each pivot [x, y] or [x, y, w]")
    return pivots


def _depth(given: Any) -> int:
    return 1 + _depth(given[0]) if isinstance(given, list) and given else 0
