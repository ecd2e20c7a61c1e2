"""Hard points by name: from a table of a file or from CSV, put where a mechanism refers to them."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InvalidRequest, quoted
from ...given import array, instance
from ...units import MILLIMETRES, decimal, millimetres

#: Fields of elements, drives, points and wheels that hold a point.
PLACES = ("at", "to", "from", "origin", "centre", "contact", "point")
#: Fields that hold a direction: two names are from the first to the second.
DIRECTIONS = ("axis", "axis_a", "axis_b", "along", "about", "direction")
#: Largest file of hard points [characters]: a thousand times a suspension's.
LARGEST = 1_000_000


def read_points(file: str | Path, unit: str) -> dict[str, list[float]]:
    """Read hard points from CSV: a name and three coordinates in each row.

    Commas, semicolons or tabs part the cells; with semicolons or tabs a comma is a decimal one.  A first row of
    headings may say the unit, ``x [m]``; lines that begin with ``#`` are comments.

    Parameters
    ----------
    file : path
    unit : str
        The unit of the mechanism; coordinates are converted to it.

    Raises
    ------
    InvalidRequest
        If the file cannot be read, or a row is no point.
    """
    instance("points", file, str | PathLike)
    try:
        content = Path(file).expanduser().read_text("utf-8-sig")
    except (OSError, UnicodeDecodeError, RuntimeError, ValueError) as error:
        raise InvalidRequest(f"cannot read {file}: {error}") from None
    if len(content) > LARGEST:
        raise InvalidRequest(f"{file} has more than {LARGEST} characters: it is no list of hard points")
    between = next((c for c in ";\t" if c in content), ",")
    points: dict[str, list[float]] = {}
    factor = 1.0
    for number, cells in _rows(content, between):
        numbers = [decimal(c.replace(",", ".") if between != "," else c) for c in cells[1:4]]
        if len(cells) < 4 or any(cells[4:]) or None in numbers or not np.isfinite(np.asarray(numbers, float)).all():
            if not points and len(cells) > 1 and numbers[0] is None:
                factor = _factor(cells[1], unit, str(file))
                continue
            raise InvalidRequest(f"{file}, line {number}: a hard point is a name and x, y, z, not {quoted(cells)}")
        name = cells[0].lower()
        if not name or name in points:
            raise InvalidRequest(f"{file}, line {number}: {quoted(cells[0])} is {'there twice' if name else 'no name'}")
        points[name] = [float(v or 0.0) * factor for v in numbers]
    if not points:
        raise InvalidRequest(f"{file} holds no hard points: write a name and x, y, z in each row")
    return points


def _rows(content: str, between: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the rows of a file that hold something, with their numbers."""
    try:
        for number, row in enumerate(csv.reader(content.splitlines(), delimiter=between), 1):
            cells = [cell.strip() for cell in row]
            if any(cells) and not cells[0].startswith("#"):
                yield number, cells
    except csv.Error as error:
        raise InvalidRequest(f"hard points cannot be read: {error}") from None


def _factor(heading: str, unit: str, file: str) -> float:
    """Return the units of a mechanism per unit of a heading such as ``x [m]``."""
    if not heading.endswith("]"):
        return 1.0
    own = heading.rpartition("[")[2].rstrip("]").strip()
    if own == unit:
        return 1.0
    if unit not in MILLIMETRES:
        raise InvalidRequest(f"{file} is in {own}: the mechanism needs a unit of length, not {quoted(unit)}")
    return millimetres(own) / millimetres(unit)


def resolved(given: Mapping[str, Any], points: Mapping[str, Any], file: str) -> tuple[dict[str, Any], list[str]]:
    """Put hard points in the place of their names in all tables of a file.

    Returns
    -------
    given : dict
        The same with coordinates alone.
    unused : list of str
        Points to which nothing refers.

    Raises
    ------
    InvalidRequest
        If names have no points: all that are missing are listed.
    """
    table = given.get("hard_points", {})
    if not isinstance(table, dict):
        raise InvalidRequest(f"{file}: hard_points must be a table")
    known = {name.lower(): array(f"{file}: hard point {quoted(name)}", v, (3,), finite=True).tolist()
             for name, v in {**table, **points}.items()}  # fmt: skip
    used: set[str] = set()
    missing: dict[str, None] = {}

    def placed(name: str) -> Any:
        if name.lower() in known:
            used.add(name.lower())
            return known[name.lower()]
        missing[name] = None
        return [0.0, 0.0, 0.0]

    def one(table: Any) -> Any:
        if not isinstance(table, dict):
            return table
        out = dict(table)
        for field, value in table.items():
            if field in PLACES and isinstance(value, str):
                out[field] = placed(value)
            elif field in DIRECTIONS and isinstance(value, list) and len(value) == 2 and _words(value):
                first, second = (np.asarray(placed(name)) for name in value)
                out[field] = (second - first).tolist()
        return out

    out: dict[str, Any] = {}
    for name, value in given.items():
        if name in ("fit", "hard_points"):
            continue
        if name == "drive" and isinstance(value, dict):
            out[name] = {key: one(table) for key, table in value.items()}
        else:
            out[name] = [one(table) for table in value] if isinstance(value, list) else one(value)
    if "fit" in given:
        out["fit"] = given["fit"]
    if missing:
        raise InvalidRequest(f"{file} needs the hard points {', '.join(missing)}: name them in [hard_points] or in CSV")
    return out, [name for name in known if name not in used]


def _words(value: list[Any]) -> bool:
    return all(isinstance(part, str) for part in value)
