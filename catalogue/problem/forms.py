"""Forms of a request: mapping, JSON, TOML and row of a table.

All of them have one set of names: those of the keywords of `Catalogue.find`, with ``path``,
``stroke``, ``deviation``, ``radius``, ``angle``, ``from``, ``to``, ``along`` and ``unit`` for the
path; ``catalogue find --config FILE`` reads these too.
"""

from __future__ import annotations

import json
import math
import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from fractions import Fraction
from itertools import chain
from typing import Any

from ..errors import InvalidRequest, quoted
from ..given import listed, number, switch
from ..quantities import BOUNDS, DEGREES, LENGTHS, RATIO
from ..units import WRITTEN, angle_in, factor, length_in, unit_or_none
from .constraints import PRESCRIBED, REGIONS, Constraints
from .path import CircularArc, StraightLine, ends
from .problem import OWN, Request, is_default

#: Paths by name.
PATHS: Mapping[str, type[StraightLine] | type[CircularArc]] = {
    "straight-line": StraightLine,
    "circular-arc": CircularArc,
}
#: Names of a path in a mapping.
PATH_NAMES = ("path", "stroke", "deviation", "radius", "angle", "from", "to", "along", "unit")
#: Other spellings of names: options of the command.
SPELLINGS = {
    "family": "families",
    "configuration": "configurations",
    "desire": "desires",
    "pareto": "rank_by",
}
_LENGTH_NAMES = frozenset({"stroke", "deviation", "radius", *LENGTHS, "within", "play", "round_to"})
_ANGLE_NAMES = frozenset({"angle", "along", *(name for name, row in BOUNDS.items() if row.unit == DEGREES)})
_PLACE_NAMES = frozenset(("from", "to", *REGIONS, *PRESCRIBED))
_NAME_LISTS = frozenset(("families", "series", "configurations"))
_SWITCHES = frozenset(("pins_only", "slots", "returns", "full_rotation", "refine", "cognates"))
_NUMBERS = frozenset(
    ("limit", "effort", "per_series", "order", "distinct", *(name for name, row in BOUNDS.items() if row.unit == RATIO))
)
_WHOLE = frozenset(("limit", "effort", "per_series", "order"))
_TRUE = ("true", "yes", "1")
_FALSE = ("false", "no", "0")
#: A name with a unit in a table's head: ``max_size [in]``.
_HEAD = re.compile(r"(?P<name>.*?)\s*\[(?P<unit>[^\]]*)\]\s*")


def to_dict(request: Request) -> dict[str, Any]:
    """Convert a request to plain numbers, texts and lists; see `Request.to_dict`."""
    path = request.path
    found: dict[str, Any] = {"path": next(name for name, kind in PATHS.items() if type(path) is kind)}
    found |= {"stroke": path.stroke, "deviation": path.deviation}
    if isinstance(path, CircularArc):
        found |= {name: value for name in ("radius", "angle") if (value := getattr(path, name)) is not None}
    if path.start != (0.0, 0.0):
        found["from"] = list(path.start)
    found |= {name: value for name in ("along", "unit") if (value := getattr(path, name))}
    for name in request.constraints.active():
        found[name] = _listed(name, getattr(request.constraints, name))
    for name in OWN:
        if name != "desires" and not is_default(name, value := getattr(request, name)):
            found[name] = list(value) if isinstance(value, tuple) else value
    if request.desires:
        found["desires"] = {name: list(parts) for name, parts in request.desires}
    return found


def from_dict(given: Mapping[str, object]) -> Request:
    """Build a request from a mapping; see `Request.from_dict`."""
    if not isinstance(given, Mapping):
        raise InvalidRequest(f"a request must be a mapping of names to values, not {quoted(given)}")
    said = _Reading(given).values()
    kind = said.pop("path", "circular-arc" if said.keys() & {"radius", "angle"} else "straight-line")
    if not isinstance(kind, str) or kind not in PATHS:
        raise InvalidRequest(f"path must be one of {', '.join(PATHS)}, not {quoted(kind)}")
    place: dict[str, Any] = {
        name: said.pop(name) for name in ("stroke", "radius", "angle", "along", "unit") if name in said
    }
    start, end = said.pop("from", (0.0, 0.0)), said.pop("to", None)
    if end is not None:
        if place.keys() & {"stroke", "along"}:
            raise InvalidRequest("to says how long the path is and where it leads: leave out stroke and along")
        place |= ends(start, end)
    else:
        place["start"] = start
    if kind == "straight-line" and (wrong := place.keys() & {"radius", "angle"}):
        raise InvalidRequest(f"a straight line has no {min(wrong)}: leave it out, or give path = 'circular-arc'")
    if kind == "straight-line" and "stroke" not in place:
        raise InvalidRequest("a request needs a stroke: the length of the path")
    if "deviation" not in said:
        raise InvalidRequest("a request needs a deviation: its tolerance")
    return Request.of(PATHS[kind](deviation=said.pop("deviation"), **place), options=PATH_NAMES, **said)


def to_json(request: Request) -> str:
    """Convert a request to a JSON object."""
    return json.dumps(_without_infinities(to_dict(request)), ensure_ascii=False, allow_nan=False)


def to_toml(request: Request) -> str:
    """Convert a request to TOML."""
    return "".join(f"{name} = {_toml(value)}\n" for name, value in to_dict(request).items())


def from_text(form: str, text: str) -> Request:
    """Build a request from a text in JSON or TOML."""
    try:
        given = json.loads(text) if form == "JSON" else tomllib.loads(text)
    except (ValueError, TypeError, RecursionError) as error:
        raise InvalidRequest(f"this is no request in {form}: {error}") from None
    return from_dict(given)


def to_row(request: Request) -> dict[str, Any]:
    """Convert a request to cells of a table."""
    return {name: cells[0] for name, cells in columns_of([to_dict(request)]).items()}


def columns_of(rows: Sequence[Mapping[str, Any]]) -> dict[str, list[Any]]:
    """Convert mappings of `to_dict`, or their JSON read again, to columns of cells.

    A cell is NaN where a name is not given.
    """
    found: dict[str, list[Any]] = {}
    for name in dict.fromkeys(chain.from_iterable(rows)):
        values = [row.get(name, math.nan) for row in rows]
        listed = [isinstance(value, (list, Mapping)) for value in values]
        if any(listed):
            cells = [_cell(name, value) if many else value for value, many in zip(values, listed, strict=True)]
            if name == "rank_by":  # the criteria of a Pareto front have their own column
                found["pareto"] = [cell if many else math.nan for cell, many in zip(cells, listed, strict=True)]
                cells = [math.nan if many else cell for cell, many in zip(cells, listed, strict=True)]
            values = cells
        if name != "rank_by" or not all(listed):
            found[name] = values
    return found


def column_order(names: Iterable[str]) -> list[str]:
    """Sort names of cells in the order in which a request writes them."""
    every = [*PATH_NAMES, *(one.name for one in fields(Constraints)), *OWN]
    return sorted(names, key=lambda name: every.index("rank_by" if name == "pareto" else name))


class _Reading:
    """Values of a mapping, converted by their names."""

    def __init__(self, given: Mapping[str, object]) -> None:
        self._given: dict[str, tuple[Any, str | None]] = {}
        for key, value in given.items():
            head = _HEAD.fullmatch(str(key))
            name = (head["name"] if head else str(key)).strip().replace("-", "_")
            if not _is_given(value):
                continue
            if name == "pareto" and isinstance(value, str):
                value = [part.strip() for part in value.split(",")]
            name = SPELLINGS.get(name, name)
            if name in self._given:
                raise InvalidRequest(f"{name} is given twice")
            self._given[name] = value, head["unit"] if head else None
        self.unit = unit_or_none(self._given["unit"][0]) if "unit" in self._given else None

    def values(self) -> dict[str, Any]:
        found = {name: self._value(name, value, unit) for name, (value, unit) in self._given.items()}
        if self.unit is not None:
            found["unit"] = self.unit
        return found

    def _value(self, name: str, value: object, unit: str | None) -> Any:
        with_unit = ((_LENGTH_NAMES, self._length), (_PLACE_NAMES, self._places), ({"keep_out"}, self._zones))
        for names, read in with_unit:
            if name in names:
                return read(name, value, unit)
        plain = ((_ANGLE_NAMES, _angle), (_SWITCHES, _switch), (_NUMBERS, _plain_number), (_NAME_LISTS, _names))
        for of_kind, convert in plain:
            if name in of_kind:
                return convert(name, value)
        return self._desires(value) if name == "desires" else value

    def _length(self, name: str, value: object, unit: str | None = None) -> Any:
        """Convert a length; `unit` is that of the head of its column."""
        if unit is None and not isinstance(value, str):
            return value
        found = length_in(value) if isinstance(value, str) else (Fraction(repr(number(name, value))), None)
        if found is None:
            raise InvalidRequest(f"{name}: {quoted(value)} is no length: write 80, 80mm, 2.5cm, 3.5in or 1/8in")
        size, base = found
        if base is None and unit is not None:
            if unit.lower() not in WRITTEN:
                raise InvalidRequest(
                    f"{name}: there is no unit {quoted(unit)} of length; there are {', '.join(WRITTEN)}"
                )
            times, base = WRITTEN[unit.lower()]
            size = size * times
        if base is None:
            return float(size)
        self.unit = self.unit or base
        return float(size * factor(base, self.unit))

    def _places(self, name: str, value: object, unit: str | None) -> Any:
        """Convert lengths in text or nested lists; six or more in a row are points of a polygon."""
        if isinstance(value, str):
            value = value.replace(",", " ").split()
        parts = listed(value)
        if parts is None:
            return value
        if any(listed(part) is not None for part in parts):
            return [self._places(name, part, unit) for part in parts]
        read = [self._length(name, part, unit) for part in parts]
        polygon = len(read) >= 6 and len(read) % 2 == 0 and name not in PRESCRIBED
        return [read[k : k + 2] for k in range(0, len(read), 2)] if polygon else read

    def _zones(self, name: str, value: Any, unit: str | None) -> Any:
        zones = [one for one in value.split(";") if one.strip()] if isinstance(value, str) else value
        parts = listed(zones)
        if parts and not any(isinstance(one, str) or listed(one) is not None for one in parts):
            zones = [parts]  # the numbers of a single zone
        return [self._places(name, zone, unit) for zone in zones] if parts else zones

    def _desires(self, value: object) -> Any:
        if isinstance(value, str):
            value = [part for part in value.split(";") if part.strip()]
        if not isinstance(value, Mapping):
            texts = [str(part).partition("=") for part in listed(value) or ()]
            value = {name.strip(): numbers.split(":") for name, _, numbers in texts}
        return {name: self._desire(f"desires {name}", name, numbers) for name, numbers in value.items()}

    def _desire(self, told: str, name: str, numbers: object) -> list[Any]:
        parts = [part.strip() if isinstance(part, str) else part for part in listed(numbers) or ()]
        ends = [_angle(told, one) if name == "transmission" else self._length(told, one) for one in parts[:2]]
        return ends + [_plain_number(told, one) for one in parts[2:]]


def _is_given(value: object) -> bool:
    """Tell whether a cell of a table is filled."""
    return value is not None and value != "" and not (isinstance(value, float) and math.isnan(value))


def _switch(name: str, value: object) -> bool:
    word = str(value).strip().lower()
    if not isinstance(value, str) and word not in ("1.0", "0.0"):  # a column with gaps holds floats
        return switch(name, value)
    if word not in (*_TRUE, *_FALSE, "1.0", "0.0"):
        raise InvalidRequest(f"{name} must be true or false, not {quoted(value)}")
    return word in (*_TRUE, "1.0")


def _plain_number(name: str, value: object) -> Any:
    """Convert a number in text; a whole number of a column with gaps to int."""
    if isinstance(value, str):
        found = length_in(value)
        if found is None or found[1] is not None:
            raise InvalidRequest(f"{name} must be a number, not {quoted(value)}")
        value = float(found[0])
    return int(value) if name in _WHOLE and isinstance(value, float) and value.is_integer() else value


def _angle(name: str, value: object) -> Any:
    found = angle_in(value) if isinstance(value, str) else value
    if found is None:
        raise InvalidRequest(f"{name}: {quoted(value)} is no angle: write 30, 30deg or 0.5rad")
    return found


def _names(name: str, value: object) -> Any:  # noqa: ARG001  # as the other readers
    return value.replace(",", " ").split() if isinstance(value, str) else value


def _listed(name: str, value: Any) -> Any:
    """Convert a constraint to plain numbers, texts and lists."""
    if name in REGIONS:
        return value.to_list()
    if name == "keep_out":
        return [zone.to_list() for zone in value]
    if name in PRESCRIBED:
        return [list(place) for place in value]
    return list(value) if isinstance(value, tuple) else value


def _without_infinities(value: object) -> Any:
    if isinstance(value, Mapping):
        return {name: _without_infinities(one) for name, one in value.items()}
    if isinstance(value, list):
        return [_without_infinities(one) for one in value]
    return str(value) if isinstance(value, float) and math.isinf(value) else value


def _toml(value: object) -> str:
    """Format a value in TOML."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value)
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{name} = {_toml(one)}' for name, one in value.items())}}}"
    if isinstance(value, list):
        return f"[{', '.join(map(_toml, value))}]"
    return repr(value)


def _cell(name: str, value: Any) -> str:
    """Format a list or mapping for a cell of a table."""
    if isinstance(value, Mapping):
        return "; ".join(f"{key}={':'.join(map(repr, parts))}" for key, parts in value.items())
    if name == "keep_out":
        return "; ".join(" ".join(map(repr, _flatten(zone))) for zone in value)
    texts = [one if isinstance(one, str) else repr(one) for one in _flatten(value)]
    return ("," if name == "rank_by" else " ").join(texts)


def _flatten(value: Sequence[object]) -> list[Any]:
    return [part for one in value for part in (_flatten(one) if isinstance(one, list) else [one])]
