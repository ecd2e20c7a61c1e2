"""Mechanisms from TOML or JSON: hard points in the user's unit, drives and what is read off by name.

A file holds `unit`, and tables ``[[link]]``, ``[[revolute]]``, ``[[prismatic]]``, ``[[cylindrical]]``,
``[[spherical]]``, ``[[universal]]``, ``[[fixed]]``, ``[[guide]]``, ``[[angle]]`` with the fields of the classes of
`elements`; ``[[coupling]]`` with `of`, names of drives, and `weights`; ``[drive.NAME]`` with
`kind` (``joint``, ``travel``, ``length``, ``angle``, ``guide``, ``sum``) and the fields of the scalar, of a sum `of`,
names of drives, and `weights`; and what to print:
``[[point]]`` with `body`, `at`, `name`; ``[wheel]`` with the fields of `Wheel`, `steer`, the name of a drive, and
`spring`, names of drives that stand still while the wheel is steered, or two ``[[wheel]]`` with a `name` each;
``[vehicle]`` with `wheelbase`; ``[[load]]`` with the fields of `Load`, for reactions; ``[transmission]`` with `output`
and `link`;
``[[reading]]`` with `scalar`, the name of a drive, and `name`.  `axes` are those of the points: ``"ISO 8855"``,
``"SAE"`` or ``"x rearwards"``.  ``[hard_points]`` has points by names, which may stand wherever a point does; two names
are a direction; travel without `along` is upwards.  ``[fit]`` says what is to be fitted: `fitting/files.py`.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping
from dataclasses import fields, replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...errors import InvalidRequest, quoted
from ...folders import folder
from ...given import instance, names, positive, text
from . import elements as e
from .axle import AXES, Wheel
from .job import Job
from .mechanism import Mechanism
from .named_points import read_points, resolved
from .statics import Load

if TYPE_CHECKING:
    pass

ELEMENTS: dict[str, type] = {
    "link": e.Link, "revolute": e.Revolute, "screw": e.Screw, "prismatic": e.Prismatic, "cylindrical": e.Cylindrical,
    "spherical": e.Spherical, "guide": e.OnGuide, "angle": e.KeepAngle, "universal": e.Universal, "fixed": e.Fixed,
}  # fmt: skip
SCALARS: dict[str, type] = {
    "joint": e.Joint, "travel": e.Travel, "length": e.Length, "angle": e.Angle, "guide": e.GuideCoordinate,
    "sum": e.Sum,
}  # fmt: skip
OTHERS = (
    "unit",
    "axes",
    "drive",
    "coupling",
    "point",
    "reading",
    "wheel",
    "vehicle",
    "load",
    "transmission",
    "fit",
    "title",
    "hard_points",
)
#: Folder of files that need hard points alone.
TEMPLATES = folder("data") / "spatial" / "templates"


def load(file: str | Path, points: str | Path | None = None) -> Job:
    """Read a mechanism from a TOML or JSON file, or from a template.

    Parameters
    ----------
    file : path or str
        Or the name of a template: double-wishbone, mcpherson, five-link, trailing-arm.
    points : path, optional
        Hard points in CSV, which replace those of the file by their names.

    Raises
    ------
    InvalidRequest
        If the file cannot be read, or a name in it means nothing.
    InvalidLinkage
        If what it holds is no mechanism.
    """
    instance("file", file, str | PathLike)
    named = TEMPLATES / f"{file}.toml"
    if not Path(file).exists() and Path(file).name == str(file) and named.exists():
        file = named
    try:
        content = Path(file).expanduser().read_text("utf-8-sig")
    except (OSError, UnicodeDecodeError, RuntimeError, ValueError) as error:
        raise InvalidRequest(f"cannot read {file}: {error}") from None
    try:
        given = json.loads(content) if content.lstrip()[:1] == "{" else tomllib.loads(content)
    except (json.JSONDecodeError, tomllib.TOMLDecodeError, RecursionError) as error:
        raise InvalidRequest(f"{file} is neither TOML nor JSON: {error}") from None
    named_points = read_points(points, str(given.get("unit", "length"))) if points is not None else {}
    given, unused = resolved(given, named_points, str(file))
    return replace(_job(given, str(file)), unused=tuple(unused), file=str(file))


def _job(given: dict[str, Any], file: str) -> Job:
    for name in given:
        if name not in ELEMENTS and name not in OTHERS:
            raise InvalidRequest(f"{file}: {quoted(name)} means nothing; tables are {', '.join([*ELEMENTS, *OTHERS])}")
    elements = [
        _made(made, one, f"{file}: {kind} {i + 1}")
        for kind, made in ELEMENTS.items()
        for i, one in enumerate(tables_in(given, kind, file))
    ]
    axes = str(given.get("axes", "ISO 8855"))
    if axes not in AXES:
        raise InvalidRequest(f"{file}: axes must be one of {', '.join(AXES)}, not {quoted(axes)}")
    drives = _drives(table_in(given, "drive", file), file, (0.0, 0.0, AXES[axes][2]))
    elements += [
        _coupling(one, drives, f"{file}: coupling {i + 1}") for i, one in enumerate(tables_in(given, "coupling", file))
    ]
    mechanism = Mechanism(elements, str(given.get("unit", "length")))
    points = tuple(tables_in(given, "point", file))
    for one in points:
        if not {"body", "at"} <= set(one):
            raise InvalidRequest(f"{file}: a point needs body and at")
        for name in ("body", "name"):
            text(f"{file}: {name} of a point", one.get(name, ""))
    title = str(given.get("title", "")) or Path(file).stem.replace("_", " ")
    wheels = [_wheel(one, axes, file) for one in _wheel_tables(given, file)]
    made, first, steer, spring = wheels[0] if wheels else (None, "", "", ())
    vehicle = table_in(given, "vehicle", file)
    if set(vehicle) - {"wheelbase"}:
        raise InvalidRequest(f"{file}: vehicle has a wheelbase, not {quoted(next(iter(set(vehicle) - {'wheelbase'})))}")
    wheelbase = positive(f"{file}: wheelbase", vehicle["wheelbase"]) if vehicle else None
    loads = tuple(_made(Load, one, f"{file}: load {i + 1}") for i, one in enumerate(tables_in(given, "load", file)))
    readings = []
    for one in tables_in(given, "reading", file):
        scalar = str(one.get("scalar", ""))
        if not drives.get(scalar) or set(one) - {"scalar", "name"}:
            raise InvalidRequest(f"{file}: a reading needs the scalar of a drive, and may have a name")
        readings.append((text(f"{file}: name of a reading", one.get("name", scalar)), drives[scalar]))
    output = table_in(given, "transmission", file)
    return Job(
        mechanism, drives, points, made, steer, spring, output, given, title, tuple(readings), first=first,
        others=tuple(wheels[1:]), wheelbase=wheelbase, loads=loads,
    )  # fmt: skip


def _wheel_tables(given: Mapping[str, Any], file: str) -> list[dict[str, Any]]:
    """Return the tables of wheels: one ``[wheel]``, or several ``[[wheel]]`` with names of their own."""
    if not isinstance(given.get("wheel"), list):
        return [dict(one) for one in (table_in(dict(given), "wheel", file),) if one]
    wheels = [dict(one) for one in tables_in(dict(given), "wheel", file)]
    called = [one.get("name") for one in wheels]
    if len(wheels) > 1 and (not all(called) or len(set(map(str, called))) < len(called)):
        raise InvalidRequest(f"{file}: several wheels need a name each, such as left and right")
    return wheels


def _wheel(given: dict[str, Any], axes: str, file: str) -> tuple[Wheel, str, str, tuple[str, ...]]:
    """Read a wheel, its name, its steering drive and its held springs."""
    steer, name = str(given.pop("steer", "")), text(f"{file}: name of a wheel", given.pop("name", ""))
    spring = names(f"{file}: spring of the wheel", given.pop("spring", ()))
    return _made(Wheel, {**given, "axes": axes}, f"{file}: wheel"), name, steer, spring


def _coupling(one: Mapping[str, Any], drives: Mapping[str, Any], what: str) -> e.Coupling:
    """Return a coupling of drives, by their names."""
    parts = names(f"{what}: of", one.get("of", ()))
    unknown = [part for part in parts if not drives.get(part)]
    if unknown or len(parts) < 2 or set(one) - {"of", "weights", "name"}:
        raise InvalidRequest(f"{what} needs of, names of drives, and weights, one for each")
    total = _made(e.Sum, {"parts": [drives[part] for part in parts], "weights": one.get("weights", ())}, what)
    return e.Coupling(total, str(one.get("name", "")))


def _drives(given: Mapping[str, Any], file: str, up: tuple[float, ...]) -> dict[str, Any]:
    """Return scalars by the names of their tables; sums may name scalars that come later, travel is upwards."""
    drives: dict[str, Any] = dict.fromkeys(given)
    for sums in (False, True):
        for name, one in given.items():
            what = f"{file}: drive {quoted(name)}"
            kind = one.get("kind") if isinstance(one, dict) else None
            if not isinstance(kind, str) or kind not in SCALARS:
                raise InvalidRequest(f"{what} needs a kind, one of {', '.join(SCALARS)}")
            if (kind == "sum") is not sums:
                continue
            fields = {k: v for k, v in one.items() if k != "kind"}
            if kind == "travel":
                fields.setdefault("along", up)
            if sums:
                parts = names(f"{what}: of", fields.pop("of", ()))
                unknown = next((part for part in parts if not drives.get(part)), None)
                if unknown is not None or "parts" in fields:
                    raise InvalidRequest(f"{what}: of names drives of other kinds, not {quoted(unknown or 'parts')}")
                fields["parts"] = [drives[part] for part in parts]
            drives[name] = _made(SCALARS[kind], fields, what)
    return drives


def table_in(given: dict[str, Any], name: str, file: str) -> dict[str, Any]:
    one = given.get(name, {})
    if not isinstance(one, dict):
        raise InvalidRequest(f"{file}: {name} must be a table")
    return one


def tables_in(given: dict[str, Any], name: str, file: str) -> list[dict[str, Any]]:
    found = given.get(name, [])
    if not isinstance(found, list) or not all(isinstance(x, dict) for x in found):
        raise InvalidRequest(f"{file}: {name} must be tables, each headed [[{name}]]")
    return found


def _made(kind: type, one: dict[str, Any], what: str) -> Any:
    """Return a dataclass from its fields; `from` stands for `from_`."""
    values = {("from_" if k == "from" else k): v for k, v in one.items()}
    known = {f.name for f in fields(kind)}
    for name in values:
        if name not in known:
            permitted = ", ".join(k.rstrip("_") for k in sorted(known))
            raise InvalidRequest(f"{what}: {quoted(name)} means nothing; its fields are {permitted}")
    try:
        return kind(**values)
    except InvalidRequest as error:
        raise InvalidRequest(f"{what}: {error}") from None
    except TypeError as error:
        raise InvalidRequest(f"{what}: {str(error).partition(') ')[2] or error}") from None
