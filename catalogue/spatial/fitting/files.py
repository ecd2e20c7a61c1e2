"""Read the section ``[fit]`` of a file, and write the file with moved hard points.

``[fit.sweep.NAME]`` has `drive` and `hold`, names of drives, and `values`, or `from`, `to` and
`steps`, in the unit of the file or degrees.  ``[[fit.target]]`` has the quantity: `read`, a column
of the sweep's table; or `length`, a link; or `point`, a point of the file, on a `line` (`at`,
`along`), a `circle` (`centre`, `axis`, `radius`) or at the positions `values`.  It has the target:
`value`, or `values` for each pose, or a curve `x`, `y` over the drive; and `tolerance`, `offset`,
and `over`, the sweep.  ``[[fit.bound]]`` has `read` or `length`, `least`, `most`. ``[[fit.box]]``
has `point` or `points`, `half`, `mirror`.
"""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Callable, Mapping
from copy import deepcopy
from pathlib import Path
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
import pandas as pd

from ...errors import InvalidRequest, quoted
from ...folders import replacing
from ...given import array
from ...kinematics.types import Array
from ..jointed.job import Job
from ..jointed.motion import Motion
from ..jointed.reading import ELEMENTS, table_in, tables_in
from .boxes import POINT_FIELDS, Box
from .fit import fit
from .outcome import Fit
from .targets import Bound, Reading, Sweep, Target, link_length, off_circle, off_line

#: Largest number of positions of a sweep.
MAX_POSITIONS = 10_000
#: Fields of each table.
TABLE_FIELDS = {
    "sweep": {"drive", "hold", "values", "from", "to", "steps"},
    "target": {"read", "length", "point", "line", "circle", "value", "values", "x", "y", "tolerance", "offset", "over"},
    "bound": {"read", "length", "least", "most", "tolerance", "over"},
    "box": {"point", "points", "half", "mirror"},
}


def fit_file(job: Job, starts: int = 16, steps: int = 50, seed: int = 1) -> Fit:
    """Fit the mechanism of a file by its section ``[fit]``.

    Raises
    ------
    InvalidRequest
        If the section is missing or has an invalid entry.
    NotMovable
        As `fit`.
    """
    asked = Asked(job)
    return fit(job.mechanism, asked.targets, asked.boxes, asked.bounds, starts, steps, seed)


class Asked:
    """The section ``[fit]`` of a file: `targets`, `bounds` and `boxes`."""

    def __init__(self, job: Job) -> None:
        self.job, section = job, table_in(job.given, "fit", "the file")
        for name in section:
            if name not in TABLE_FIELDS:
                raise InvalidRequest(f"fit: {quoted(name)} means nothing; tables are {', '.join(TABLE_FIELDS)}")
        if not section:
            raise InvalidRequest("the file says nothing of what is to be fitted: add [[fit.target]] and [[fit.box]]")
        self.tables: WeakKeyDictionary[Motion, pd.DataFrame] = WeakKeyDictionary()
        sweeps = table_in(section, "sweep", "fit")
        self.sweeps = {name: self._sweep(one, f"fit.sweep {quoted(name)}") for name, one in sweeps.items()}
        every = {
            name: [
                _check_fields(name, one, f"fit.{name} {i + 1}") for i, one in enumerate(tables_in(section, name, "fit"))
            ]
            for name in ("target", "bound", "box")
        }
        self.targets = [self._target(one, f"fit.target {i + 1}") for i, one in enumerate(every["target"])]
        self.bounds = [self._bound(one, f"fit.bound {i + 1}") for i, one in enumerate(every["bound"])]
        self.boxes = [_box(one, f"fit.box {i + 1}") for i, one in enumerate(every["box"])]

    # -- sweeps ----------------------------------------------------------------------------------
    def _sweep(self, one: Any, what: str) -> Sweep:
        if not isinstance(one, dict):
            raise InvalidRequest(f"{what} must be a table")
        _check_fields("sweep", one, what)
        hold = one.get("hold", [])
        drive = self.job.drive(str(one.get("drive", "")))
        held = [self.job.drive(str(name)) for name in (hold if isinstance(hold, list) else [hold])]
        if "values" in one:
            values = array(f"{what}.values", one["values"], finite=True)
        elif {"from", "to"} <= set(one):
            ends = [_number_of(one, k, what, 0.0) for k in ("from", "to")]
            steps = one.get("steps", 17)
            if not isinstance(steps, int) or not 2 <= steps <= MAX_POSITIONS:
                raise InvalidRequest(f"{what}.steps must be a whole number from 2 to {MAX_POSITIONS}")
            values = np.linspace(ends[0], ends[1], steps)
        else:
            raise InvalidRequest(f"{what} needs values, or from and to")
        angular = self.job.mechanism.system(*held, drive).scalars[-1].angular
        return Sweep(drive, np.radians(values) if angular else values, held)

    def _sweep_of(self, one: Mapping[str, Any], what: str) -> Sweep:
        name = str(one.get("over", next(iter(self.sweeps), "") if len(self.sweeps) == 1 else ""))
        if name not in self.sweeps:
            raise InvalidRequest(f"{what}: over must name a sweep, one of {', '.join(self.sweeps) or 'none'}")
        return self.sweeps[name]

    # -- quantities ------------------------------------------------------------------------------
    def _parse_reading(self, one: Mapping[str, Any], what: str) -> tuple[str, Reading, str]:
        """Return name, reading and unit of the quantity of a target or a bound."""
        said = [name for name in ("read", "length", "point") if name in one]
        if len(said) != 1:
            raise InvalidRequest(f"{what} needs one of read, length and point")
        name, unit = str(one[said[0]]), self.job.mechanism.unit
        if said[0] == "read":
            found = re.fullmatch(r"(.*) \[(.*)\]", name)
            return (found[1], self._column(name), found[2]) if found else (name, self._column(name), "")
        if said[0] == "length":
            return f"length of {name}", lambda motion: link_length(motion, name), unit
        return name, self._place(one, name, what), unit

    def _column(self, name: str) -> Reading:
        def read(motion: Motion) -> Array:
            if motion not in self.tables:
                self.tables[motion] = self.job.table(motion)
            table = self.tables[motion]
            if name not in table:
                raise InvalidRequest(f"a sweep prints no column {quoted(name)}, only {', '.join(table.columns)}")
            reason = table.attrs["reasons"].get(name)
            if reason and table[name].isna().all():
                raise InvalidRequest(f"{name} is not known: {reason}")
            return np.asarray(table[name], float)

        return read

    def _place(self, one: Mapping[str, Any], name: str, what: str) -> Reading:
        point = next((p for p in self.job.points if p.get("name", p["body"]) == name), None)
        if point is None:
            raise InvalidRequest(f"{what}: the file has no [[point]] named {quoted(name)}")
        body, at = str(point["body"]), point["at"]
        if "line" in one:
            line = _fields(one["line"], ("at", "along"), f"{what}.line")
            return lambda motion: off_line(motion.point(body, at), line[0], line[1])
        if "circle" in one:
            ring = _fields(one["circle"], ("centre", "axis", "radius"), f"{what}.circle")
            return lambda motion: off_circle(motion.point(body, at), ring[0], ring[1], float(ring[2]))
        return lambda motion: motion.point(body, at)

    def _target(self, one: Mapping[str, Any], what: str) -> Target:
        name, reading, unit = self._parse_reading(one, what)
        over = self._sweep_of(one, what)
        on_guide = "point" in one and ("line" in one or "circle" in one)
        said = [k for k in ("value", "values", "x") if k in one]
        if len(said) != 1 and not (on_guide and not said):
            raise InvalidRequest(f"{what} needs one of value, values, and x with y")
        offset = one.get("offset", False)
        if not isinstance(offset, bool):
            raise InvalidRequest(f"{what}.offset must be true or false")
        value: Any = 0.0
        if said == ["x"]:
            value = self._curve(one, over, what)
        elif said:
            value = array(f"{what}.{said[0]}", one[said[0]], finite=True)
        return Target(name, reading, over, value, _number_of(one, "tolerance", what, 1.0), offset, unit)

    def _curve(self, one: Mapping[str, Any], over: Sweep, what: str) -> Array:
        """Interpolate a curve linearly at values of the drive in the shown unit."""
        x, y = array(f"{what}.x", one["x"], finite=True), array(f"{what}.y", one.get("y", []), finite=True)
        if x.ndim != 1 or x.shape != y.shape or len(x) < 2 or not (np.diff(x) > 0).all():
            raise InvalidRequest(f"{what}: x must rise, and y have as many numbers")
        angular = self.job.mechanism.system(*over.hold, over.drive).scalars[-1].angular
        at = np.degrees(over.values) if angular else np.asarray(over.values)
        slack = 1e-9 * (x[-1] - x[0])
        if at.min() < x[0] - slack or at.max() > x[-1] + slack:
            raise InvalidRequest(
                f"{what}: x runs from {x[0]:g} to {x[-1]:g}, the drive from {at.min():g} to {at.max():g}"
            )
        return np.asarray(np.interp(at, x, y))

    def _bound(self, one: Mapping[str, Any], what: str) -> Bound:
        name, reading, unit = self._parse_reading(one, what)
        least, most = _number_of(one, "least", what, -np.inf), _number_of(one, "most", what, np.inf)
        return Bound(
            name, reading, self._sweep_of(one, what), least, most, _number_of(one, "tolerance", what, 1.0), unit
        )


def _box(one: Mapping[str, Any], what: str) -> Box:
    points = one.get("points", one.get("point"))
    if not isinstance(points, str) and not (isinstance(points, list) and points):
        raise InvalidRequest(f"{what} needs point, or points")
    return Box(points, one.get("half", 0.0), str(one.get("mirror", "")))


def _check_fields(kind: str, one: dict[str, Any], what: str) -> dict[str, Any]:
    for name in one:
        if name not in TABLE_FIELDS[kind]:
            raise InvalidRequest(
                f"{what}: {quoted(name)} means nothing; its fields are {', '.join(sorted(TABLE_FIELDS[kind]))}"
            )
    return one


def _fields(one: Any, names: tuple[str, ...], what: str) -> list[Array]:
    if not isinstance(one, dict) or set(one) != set(names):
        raise InvalidRequest(f"{what} needs {', '.join(names)}")
    shapes: dict[str, tuple[int, ...]] = {"radius": ()}
    found = [array(f"{what}.{name}", one[name], shapes.get(name, (3,)), finite=True) for name in names]
    for name, value in zip(names, found, strict=True):
        if name in ("along", "axis") and not value.any():
            raise InvalidRequest(f"{what}.{name} is no direction: its length is 0")
    return found


def _number_of(one: Mapping[str, Any], name: str, what: str, default: float) -> float:
    if name not in one:
        return default
    return float(array(f"{what}.{name}", one[name], (), finite=True))


# -- the file with hard points moved ------------------------------------------------------------
def fitted_tables(job: Job, found: Fit) -> dict[str, Any]:
    """Return the tables of a file with fitted hard points."""
    given = deepcopy(job.given)
    tables = [one for kind in ELEMENTS for one in given.get(kind, [])]
    for table, was, now in zip(tables, job.mechanism.joints, found.mechanism.joints, strict=True):
        for field in POINT_FIELDS.get(type(now), ()):
            if getattr(now, field) is not getattr(was, field):
                table[field.rstrip("_")] = list(getattr(now, field))
    return given


def write(given: Mapping[str, Any], file: Path) -> None:
    """Write tables to a file: JSON if its suffix is ``.json``, else TOML."""
    text = json.dumps(given, indent=1) + "\n" if file.suffix.lower() == ".json" else toml(given)
    try:
        with replacing(file) as part:
            part.write(text.encode())
    except OSError as error:
        raise InvalidRequest(f"cannot write {file}: {error.strerror}") from error


def toml(given: Mapping[str, Any]) -> str:
    """Return tables as TOML, without loss of digits."""
    lines: list[str] = []
    _table_lines(given, "", lines)
    text = "\n".join(lines).lstrip("\n") + "\n"
    assert tomllib.loads(text) == given
    return text


def _table_lines(table: Mapping[str, Any], path: str, lines: list[str]) -> None:
    inner: list[tuple[str, Any, Callable[[str], str]]] = []
    for name, value in table.items():
        key = name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else _value(name)
        if isinstance(value, dict) and not path.startswith("[["):
            inner.append((key, [value], "[{}]".format))
        elif isinstance(value, list) and value and all(isinstance(v, dict) for v in value):
            inner.append((key, value, "[[{}]]".format))
        else:
            lines.append(f"{key} = {_value(value)}")
    for key, tables, heading in inner:
        whole = f"{path}.{key}" if path else key
        for one in tables:
            lines += ["", heading(whole)]
            _table_lines(one, whole, lines)


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return json.dumps(value).replace("\x7f", "\\u007f")
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_value, value))}]"
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{_value(k)} = {_value(v)}" for k, v in value.items()) + " }"
    return repr(value)
