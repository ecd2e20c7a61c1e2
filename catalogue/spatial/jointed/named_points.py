"""Hard points by name: read them from CSV, and place them in the tables of a mechanism."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InvalidRequest, quoted
from ...given import array, choice, instance
from ...units import MILLIMETRES, decimal, millimetres
from .axle import AXES, SIDES
from .vehicle import AXLES, BRAKES

#: Fields of elements, drives, points and wheels that hold a point.
POINT_FIELDS = ("at", "to", "from", "origin", "centre", "contact", "point")
#: Fields that hold a direction; two names mean the direction from the first to the second.
DIRECTION_FIELDS = ("axis", "axis_a", "axis_b", "along", "about", "direction")
#: Words for directions, in ISO 8855.
NAMED_DIRECTIONS = {"forwards": (1.0, 0.0, 0.0), "left": (0.0, 1.0, 0.0), "up": (0.0, 0.0, 1.0)}
#: Fields with a number that may be given by name: lengths, and shares without a unit.
LENGTH_FIELDS = ("wheelbase", "height", "roll_centre", "per_turn")
SHARE_FIELDS = ("braking", "driving")
#: Permitted words of CSV rows that hold a word instead of a point.
SETTINGS = {"axes": tuple(AXES), "side": SIDES, "axle": AXLES, "brakes": BRAKES}
#: Largest file of hard points [characters]: a thousand times that of a suspension.
MAX_CHARACTERS = 1_000_000


@dataclass(frozen=True)
class NamedPoints:
    """Contents of a CSV file of hard points.

    Attributes
    ----------
    points : dict
        Coordinates by name, in lower case, in the unit of the mechanism.
    numbers : dict
        Numbers by name, in the unit of the file: a wheelbase, a share of the braking force.
    settings : dict
        Words, by the keys of `SETTINGS`.
    factor : float
        Units of the mechanism per unit of the file.
    """

    points: dict[str, list[float]] = field(default_factory=dict)
    numbers: dict[str, float] = field(default_factory=dict)
    settings: dict[str, str] = field(default_factory=dict)
    factor: float = 1.0


def read_points(file: str | Path, unit: str) -> NamedPoints:
    """Read hard points from CSV: a name and three coordinates in each row.

    Cells are separated by commas, semicolons or tabs; with semicolons or tabs the comma is the
    decimal sign.  Headings in the first row may give the unit, ``x [m]``; lines that begin with
    ``#`` are comments.  A row may hold one number, ``wheelbase,2700``, or a word, ``axes,SAE``.

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
    if len(content) > MAX_CHARACTERS:
        raise InvalidRequest(f"{file} has more than {MAX_CHARACTERS} characters: it is no list of hard points")
    between = next((c for c in ";\t" if c in content), ",")
    points: dict[str, list[float]] = {}
    numbers: dict[str, float] = {}
    settings: dict[str, str] = {}
    factor = 1.0
    for line, row in _rows(content, between):
        name, cells = row[0].lower(), row[1:]
        while cells and not cells[-1]:
            cells.pop()
        what = f"{file}, line {line}"
        if not name or name in points or name in numbers or name in settings:
            fault = "there twice" if name else "no name"
            raise InvalidRequest(f"{what}: {quoted(row[0])} is {fault}")
        if name in SETTINGS and len(cells) == 1:
            settings[name] = choice(f"{what}: {name}", cells[0], SETTINGS[name])
            continue
        read = [decimal(c.replace(",", ".") if between != "," else c) for c in cells]
        known = [v for v in read if v is not None and np.isfinite(v)]
        if len(known) == len(cells) == 1:
            numbers[name] = known[0]
        elif len(known) == len(cells) == 3:
            points[name] = [v * factor for v in known]
        elif not points and cells and read[0] is None:
            factor = _factor(cells[0], unit, str(file))
        else:
            raise InvalidRequest(f"{what}: a hard point is a name and x, y, z, not {quoted(row)}")
    if not points:
        raise InvalidRequest(f"{file} holds no hard points: write a name and x, y, z in each row")
    return NamedPoints(points, numbers, settings, factor)


def _rows(content: str, between: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the rows of a file that are not empty, with their line numbers."""
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


def resolved(given: Mapping[str, Any], named: NamedPoints, file: str) -> tuple[dict[str, Any], list[str]]:
    """Replace names of hard points and numbers in all tables of a file.

    Returns
    -------
    given : dict
        Tables with coordinates instead of names; optional tables without any known name are
        omitted.
    unused : list of str
        Names that no table uses.

    Raises
    ------
    InvalidRequest
        If names have no points; the message lists all of them.
    """
    table = given.get("hard_points", {})
    if not isinstance(table, dict):
        raise InvalidRequest(f"{file}: hard_points must be a table")
    points = {
        name.lower(): array(f"{file}: hard point {quoted(name)}", v, (3,), finite=True).tolist()
        for name, v in {**table, **named.points}.items()
    }
    out = {k: v for k, v in given.items() if k != "hard_points"} | _apply_settings(given, named.settings, file)
    names = _Names(points, named, np.array(AXES.get(str(out.get("axes")), (1.0, 1.0, 1.0))))
    out = _without_absent(out, names)
    out = {k: v if k == "fit" else _map_tables(v, names.placed) for k, v in out.items()}
    vehicle = out.get("vehicle")
    if isinstance(vehicle, dict):  # each number of a vehicle is optional
        out["vehicle"] = {k: v for k, v in vehicle.items() if v is not None}
    if names.missing:
        raise InvalidRequest(
            f"{file} needs the hard points {', '.join(names.missing)}: name them in [hard_points] or in CSV"
        )
    return out, [name for name in (*points, *named.numbers) if name not in names.used]


def _apply_settings(given: Mapping[str, Any], settings: Mapping[str, str], file: str) -> dict[str, Any]:
    """Return the entries of a file as changed by the settings of the CSV file."""
    out: dict[str, Any] = {}
    for name, word in settings.items():
        if name == "axes":
            if given.get("axes", word) != word:
                raise InvalidRequest(f"{file} is in axes {given['axes']}, its hard points are in {word}")
            out["axes"] = word
            continue
        table = "wheel" if name == "side" else "vehicle"
        one = out.get(table, given.get(table, {}))
        if not isinstance(one, dict):
            raise InvalidRequest(f"{file}: {name} in CSV is that of a file with one [{table}]")
        out[table] = {k: v for k, v in one.items() if k != "optional"} | {name: word}
    return out


class _Names:
    """Names of a CSV file, with a record of the used and the missing ones."""

    def __init__(self, points: Mapping[str, list[float]], named: NamedPoints, signs: Any) -> None:
        self.points, self.named, self.signs = points, named, signs
        self.used: set[str] = set()
        self.missing: dict[str, None] = {}

    def is_known(self, name: str) -> bool:
        return name.lower() in self.points or name.lower() in self.named.numbers

    def point(self, name: str) -> list[float]:
        """Return the coordinates of a hard point; zeros if it is missing."""
        self.used.add(name.lower())
        if name.lower() not in self.points:
            self.missing[name] = None
        return self.points.get(name.lower(), [0.0, 0.0, 0.0])

    def number(self, key: str, name: str) -> float | None:
        """Return a named number in the unit of the mechanism."""
        self.used.add(name.lower())
        value = self.named.numbers.get(name.lower())
        return value if value is None or key in SHARE_FIELDS else value * self.named.factor

    def placed(self, table: Any) -> Any:
        """Return a table with names replaced by coordinates and numbers."""
        if not isinstance(table, dict):
            return table
        out = dict(table)
        for key, value in table.items():
            if key in POINT_FIELDS and isinstance(value, str):
                out[key] = self.point(value)
            elif key in (*LENGTH_FIELDS, *SHARE_FIELDS) and isinstance(value, str):
                out[key] = self.number(key, value)
            elif key in DIRECTION_FIELDS and isinstance(value, str) and value in NAMED_DIRECTIONS:
                out[key] = (NAMED_DIRECTIONS[value] * self.signs).tolist()
            elif key in DIRECTION_FIELDS and _is_pair(value):
                first, second = (np.asarray(self.point(name)) for name in value)
                out[key] = (second - first).tolist()
        return out


def _map_tables(value: Any, of: Any) -> Any:
    """Apply a function to each table of an entry of a file."""
    if isinstance(value, list):
        return [of(one) for one in value]
    if isinstance(value, dict) and any(isinstance(one, dict) for one in value.values()):
        return {key: of(one) for key, one in value.items()}
    return of(value)


def _without_absent(given: dict[str, Any], names: _Names) -> dict[str, Any]:
    """Omit optional tables without any known name, and the names of their drives.

    Tables with equal words for `optional` are kept or omitted together.
    """
    own: dict[str, set[str]] = {}
    for value in given.values():
        for table in _tables_in_entry(value):
            own.setdefault(str(table.get("optional", "")), set()).update(_names_in_table(table))
    absent = {
        group for group, stated in own.items() if group and not any(map(names.is_known, stated - own.get("", set())))
    }

    def is_there(table: Any) -> bool:
        return not (isinstance(table, dict) and table.get("optional") in absent)

    def plain(table: Any) -> Any:
        kept = {k: v for k, v in table.items() if k != "optional"} if isinstance(table, dict) else table
        for key in ("steer", "spring") if isinstance(table, dict) else ():
            if isinstance(kept.get(key), list):
                kept[key] = [name for name in kept[key] if name not in left_out]
        return kept

    drives = given.get("drive", {})
    left_out = [k for k, v in drives.items() if not is_there(v)] if isinstance(drives, dict) else []
    out: dict[str, Any] = {}
    for key, value in given.items():
        if isinstance(value, list):
            value = [table for table in value if is_there(table)]
        elif key == "drive" and isinstance(value, dict):
            value = {name: table for name, table in value.items() if is_there(table)}
        elif not is_there(value):
            continue
        out[key] = value if key == "fit" else _map_tables(value, plain)
    return out


def _tables_in_entry(value: Any) -> Iterator[dict[str, Any]]:
    """Yield the tables of an entry of a file."""
    if isinstance(value, dict):
        yield value
    inner = value if isinstance(value, list) else list(value.values()) if isinstance(value, dict) else []
    yield from (one for one in inner if isinstance(one, dict))


def _names_in_table(table: Mapping[str, Any]) -> Iterator[str]:
    """Yield the names of hard points and numbers in a table."""
    for key, value in table.items():
        if key in (*POINT_FIELDS, *LENGTH_FIELDS, *SHARE_FIELDS) and isinstance(value, str):
            yield value
        elif key in DIRECTION_FIELDS and _is_pair(value):
            yield from value


def _is_pair(value: Any) -> bool:
    return isinstance(value, list) and len(value) == 2 and all(isinstance(v, str) for v in value)
