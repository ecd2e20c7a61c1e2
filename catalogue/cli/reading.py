"""Linkages from what a user writes: pivots or link lengths, in JSON or CSV."""

from __future__ import annotations

import csv
import io
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InvalidLinkage, InvalidRequest
from ..kinematics.from_lengths import FOUR_BAR, INVERTED, POSITION, SLIDER_CRANK, from_lengths
from ..kinematics.linkage import Linkage
from ..kinematics.types import Array

NAMES = {*FOUR_BAR, *SLIDER_CRANK, *INVERTED, *POSITION}


def read_linkages(file: str) -> Linkage:
    """Return the linkages that a file, or with ``-`` the standard input, holds.

    Raises
    ------
    InvalidRequest, InvalidLinkage
        If it cannot be read, or holds something else.
    """
    if file == "-":
        text = sys.stdin.read()
    else:
        try:
            text = Path(file).read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise InvalidRequest(f"cannot read {file}: {error}") from None
    given = _json(text, file) if text.lstrip()[:1] in ("[", "{") else _csv(text, file)
    if not given:
        raise InvalidRequest(f"{file} holds no linkage")
    pivots = np.full((len(given), 2, 2, 3), np.nan)
    alike: dict[tuple[str, ...], list[int]] = {}  # by the lengths that are given; none of them: pivots
    for i, one in enumerate(given):
        alike.setdefault(tuple(sorted(one)) if isinstance(one, dict) else (), []).append(i)
    for names, rows in alike.items():
        if names:
            pivots[rows] = from_lengths({name: [_number(given[i][name], file) for i in rows] for name in names}).pivots
        else:
            pivots[rows] = _pivots([given[i] for i in rows], file)
    return Linkage(pivots)


def _json(text: str, file: str) -> list[Any]:
    """Return for each linkage its pivots, as nested lists, or a mapping of link lengths."""
    try:
        given = json.loads(text)
    except json.JSONDecodeError as error:
        raise InvalidRequest(f"{file} is no valid JSON: {error}") from None
    if isinstance(given, dict) or _depth(given) == 3:
        given = [given]
    for i, one in enumerate(given):
        if isinstance(one, dict):
            links = {name: one[name] for name in one if name in NAMES}
            if "pivots" not in one and not links:
                raise InvalidRequest(f"{file}: object {i} has neither `pivots` nor link lengths")
            given[i] = one.get("pivots", links)
    return list(given)


def _csv(text: str, file: str) -> list[Any]:
    """The same from CSV: 8 or 12 numbers a line, or the columns that a heading names."""
    rows = [(i, row) for i, row in enumerate(csv.reader(io.StringIO(text)), 1) if any(cell.strip() for cell in row)]
    heading = [cell.strip() for cell in rows[0][1]] if rows else []
    if NAMES & {*heading}:
        short = [i for i, row in rows[1:] if len(row) != len(heading)]
        if short:
            raise InvalidRequest(f"{file}, line {short[0]}: it has not the {len(heading)} columns of the heading")
        return [{k: v for k, v in zip(heading, row, strict=True) if k in NAMES} for _, row in rows[1:]]
    if rows and _floats(rows[0][1]) is None:  # a heading
        rows = rows[1:]
    return [_line(row, file, i) for i, row in rows]


def _line(row: list[str], file: str, line: int) -> list[Any]:
    numbers = _floats(row)
    if numbers is None:
        raise InvalidRequest(f"{file}, line {line}: {','.join(row)!r} is not all numbers")
    if len(row) not in (8, 12):
        raise InvalidRequest(f"{file}, line {line}: {len(row)} numbers; 8 (x, y) or 12 (x, y, w) are wanted")
    return np.reshape(numbers, (2, 2, -1)).tolist()


def _pivots(given: list[Any], file: str) -> Array:
    try:
        full = [[[[*p, 1.0] if len(p) == 2 else list(p) for p in dyad] for dyad in one] for one in given]
        pivots = np.array(full, dtype=float)
    except (TypeError, ValueError):
        pivots = np.zeros(0)
    if pivots.shape[1:] != (2, 2, 3):
        raise InvalidLinkage(f"{file}: a linkage is [[A1, A1*], [A2, A2*]], each pivot [x, y] or [x, y, w]")
    return pivots


def _number(value: Any, file: str) -> float:
    try:
        return float(value)
    except (TypeError, ValueError):
        raise InvalidRequest(f"{file}: {value!r} is no number") from None


def _floats(row: list[str]) -> list[float] | None:
    """Return the numbers of a row, None if something else is among them."""
    try:
        return [float(cell) for cell in row]
    except ValueError:
        return None


def _depth(given: Any) -> int:
    return 1 + _depth(given[0]) if isinstance(given, list) and given else 0
