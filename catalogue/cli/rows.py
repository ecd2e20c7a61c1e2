"""Parse JSON or CSV into rows: the values of each linkage by name, and its place in the file.

Invalid numbers, duplicate names and ambiguous lines are refused: no row is skipped.
"""

from __future__ import annotations

import csv
import io
import json
import math
import re
from collections.abc import Iterable
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ..errors import InvalidLinkage, InvalidRequest, quoted
from ..kinematics.from_lengths import CLOSURES, POINT, POSITION
from ..units import decimal

LENGTHS = {name for names in CLOSURES for name in names}
#: Names of scalar values.
NUMBERS = {*LENGTHS, *POSITION, *POINT}
#: Names of lists: pivots, and the guided point under either of two names.
LISTS = ("pivots", "guided", "point")
#: Separators of cells; the first line with one of them, outside quotes, decides; else blanks.
DELIMITERS = ("\t", ";", "|", ",")
#: Possible numbers of cells of a line without heading, and how many of them are the guided point's.
COUNTS = {8: 0, 10: 2, 12: 0, 14: 2}


class Row(NamedTuple):
    """A linkage as given: its place in the file, its values by name, and its unit if named."""

    place: str
    given: dict[str, Any]
    unit: str | None = None


def rows_of(text: str, file: str) -> list[Row]:
    """Parse a text into rows, names in lower case.

    Raises
    ------
    InvalidRequest, InvalidLinkage
        If a row cannot be parsed.
    """
    return _json(text, file) if text.lstrip()[:1] in ("[", "{") else _csv(text, file)


def _json(text: str, file: str) -> list[Row]:
    try:  # integers as floats: thousands of digits would be slow
        given = json.loads(text, parse_int=float, object_pairs_hook=partial(_by_name, file))
    except RecursionError:
        raise InvalidRequest(f"{file} is no valid JSON: it is nested too deeply") from None
    except json.JSONDecodeError as error:
        raise InvalidRequest(f"{file} is no valid JSON: {error}") from None
    every = [given] if isinstance(given, dict) or _depth(given) == 3 else given
    return [
        Row(f"{file}, linkage {i}", one if isinstance(one, dict) else {"pivots": one}) for i, one in enumerate(every)
    ]


def _depth(given: object) -> int:
    depth = 0
    while isinstance(given, list) and given:
        given, depth = given[0], depth + 1
    return depth


def _by_name(place: str, pairs: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    held: dict[str, Any] = {}
    for name, value in pairs:
        if name.casefold() in held:
            raise InvalidRequest(f"{place}: {quoted(name)} is given twice")
        held[name.casefold()] = value
    return held


def _csv(text: str, file: str) -> list[Row]:
    bare = re.sub(r'"[^"\r\n]*"', "", text)
    delimiter = next((d for line in bare.splitlines() for d in DELIMITERS if d in line), " ")
    lines = [
        (place, cells)
        for i, line in enumerate(io.StringIO(text, newline=None), 1)
        if any(cells := _cells(place := f"{file}, line {i}", line, delimiter))
    ]
    heading = lines.pop(0)[1] if lines and not any(map(_has_number, lines[0][1])) else []
    names = {name.casefold() for name in heading}
    words = {word for name in names for word in re.findall(r"\w+", name)}  # "crank [mm]" names a length
    if not (names & {*NUMBERS, *LISTS} or words & LENGTHS):
        return [Row(place, _pivots_and_point(place, cells, delimiter)) for place, cells in lines]
    return [Row(place, _cells_by_heading(place, heading, cells)) for place, cells in lines]


def _cells(place: str, line: str, delimiter: str) -> list[str]:
    """Split a line into cells; no cell spans several lines."""
    try:
        row = next(csv.reader([line.strip(" \n")], delimiter=delimiter, skipinitialspace=True, strict=True))
    except csv.Error as error:
        raise InvalidRequest(f"{place} is no valid CSV: {error}; is a quote left open?") from None
    return [cell.strip() for cell in row]


def _has_number(cell: str) -> bool:
    """Tell whether a cell holds a number: some word begins with a digit, unlike x1, A1*."""
    return re.search(r"\b\d", cell) is not None or decimal(cell) is not None


def _pivots_and_point(place: str, cells: list[str], delimiter: str) -> dict[str, Any]:
    """Convert a line of numbers to pivots and guided point."""
    if len(cells) not in COUNTS:
        raise InvalidRequest(
            f"{place}: {len(cells)} numbers; 8 (x, y) or 12 (x, y, w) are wanted, and 2 for the guided point, "
            f"with {delimiter!r} between, as in the whole file"
        )
    numbers = [_number(place, str(k), cell) for k, cell in enumerate(cells, 1)]
    last = len(numbers) - COUNTS[len(numbers)]
    pivots = {"pivots": np.reshape(numbers[:last], (2, 2, -1)).tolist()}
    return pivots if last == len(numbers) else {**pivots, "point": numbers[last:]}


def _cells_by_heading(place: str, heading: list[str], cells: list[str]) -> dict[str, Any]:
    """Return the cells of a line by the names of the heading, without empty ones."""
    if len(cells) != len(heading):
        raise InvalidRequest(f"{place}: it has {len(cells)} columns, the heading {len(heading)}")
    held = _by_name(place, ((name, cell) for name, cell in zip(heading, cells, strict=True) if cell))
    return {name: _value(place, name, cell) for name, cell in held.items()}


def _value(place: str, name: str, cell: str) -> Any:
    if name in NUMBERS:
        return _number(place, name, cell)
    try:
        return json.loads(cell, parse_int=float) if name in LISTS else cell
    except (ValueError, RecursionError):
        raise InvalidRequest(f"{place}, column {name}: {quoted(cell)} is no list of numbers in brackets") from None


def _number(place: str, column: str, cell: str) -> float:
    value = decimal(cell)
    where = f"{place}, column {column}"
    if value is None:
        raise InvalidRequest(f"{where}: {quoted(cell)} is no number: write it with a point and without a unit")
    if not math.isfinite(value):
        raise InvalidLinkage(f"{where}: {quoted(cell)} is NaN or infinite")
    return value
