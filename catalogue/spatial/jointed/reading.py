"""Read mechanisms from TOML or JSON: hard points in the user's unit, drives and readings by name.

A file holds `unit`, and tables ``[[link]]``, ``[[revolute]]``, ``[[prismatic]]``,
``[[cylindrical]]``, ``[[spherical]]``, ``[[universal]]``, ``[[fixed]]``, ``[[guide]]``,
``[[angle]]`` with the fields of the classes of `elements`; ``[[coupling]]`` with `of`, names of
drives, and `weights`; ``[drive.NAME]`` with `kind` (``joint``, ``travel``, ``length``, ``angle``,
``guide``, ``sum``) and the fields of the scalar, of a sum `of`, names of drives, and `weights`;
and what to print: ``[[point]]`` with `body`, `at`, `name`; ``[wheel]`` with the fields of
`Wheel`, `steer`, the name of a drive, and `spring`, names of drives that stand still while the
wheel is steered, or two ``[[wheel]]`` with a `name` each; ``[vehicle]`` with the fields of
`Vehicle`; ``[[load]]`` with the fields of `Load`, for reactions; ``[transmission]`` with `output`
and `link`; ``[[reading]]`` with `scalar`, the name of a drive, and `name`. Tables with one word
for `optional` are left out together if none of their names is known. With `both` the wheel is
mirrored: `both_sides.py`. `axes` are those of the points: ``"ISO 8855"``, ``"SAE"`` or ``"x
rearwards"``. ``[hard_points]`` has points by names, which may stand wherever a point does; two
names are a direction; travel without `along` is upwards. ``[fit]`` says what is to be fitted:
`fitting/files.py`.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping
from dataclasses import MISSING, fields, replace
from math import pi
from os import PathLike
from pathlib import Path
from typing import Any

from ...errors import InvalidRequest, quoted
from ...folders import folder
from ...given import instance, names, positive, switch, text
from . import elements as e
from .answers import answers_in, tables
from .axle import AXES, Wheel
from .both_sides import both_sides, one_side
from .job import Job, Mounted, Reading
from .mechanism import Mechanism
from .named_points import NamedPoints, read_points, resolved
from .statics import Load
from .vehicle import Vehicle

ELEMENTS: dict[str, type] = {
    "link": e.Link,
    "revolute": e.Revolute,
    "screw": e.Screw,
    "prismatic": e.Prismatic,
    "cylindrical": e.Cylindrical,
    "spherical": e.Spherical,
    "guide": e.OnGuide,
    "angle": e.KeepAngle,
    "universal": e.Universal,
    "fixed": e.Fixed,
}
SCALARS: dict[str, type] = {
    "joint": e.Joint,
    "travel": e.Travel,
    "length": e.Length,
    "angle": e.Angle,
    "guide": e.GuideCoordinate,
    "sum": e.Sum,
}
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
#: Folder of templates: mechanisms that need only hard points.
TEMPLATES = folder("data") / "spatial" / "templates"


def templates() -> list[str]:
    """List the names of the templates, which need only hard points."""
    return sorted(file.stem for file in TEMPLATES.glob("*.toml"))


def load(file: str | Path, points: str | Path | None = None, both: bool = False, answer: int = 1) -> Job:
    """Read a mechanism from a TOML or JSON file, or from a template.

    Parameters
    ----------
    file : path or str
        A file, or the name of a template, one of `templates()`.
    points : path, optional
        CSV of hard points; they replace those of the file with equal names.
    answer : int
        Number of the guided body in a file of answers (``find --collection spatial-guidance
        --save``).
    both : bool
        Whether to mirror the wheel of the file at the middle plane, for both wheels of an axle.

    Raises
    ------
    InvalidRequest
        If the file cannot be read, or has an unknown name.
    InvalidLinkage
        If its contents are no mechanism.
    """
    instance("file", file, str | PathLike)
    named = TEMPLATES / f"{file}.toml"
    if not Path(file).exists() and Path(file).name == str(file) and named.exists():
        file = named
    try:
        content = Path(file).expanduser().read_text("utf-8-sig")
    except (OSError, UnicodeDecodeError, RuntimeError, ValueError) as error:
        hint = "" if Path(file).suffix else f"; templates are {', '.join(templates())}"
        raise InvalidRequest(f"cannot read {file}: {error}{hint}") from None
    try:
        is_json = "".join(content.split(maxsplit=2)[:2]).startswith(("{", "[{"))
        given = json.loads(content) if is_json else tomllib.loads(content)
    except (json.JSONDecodeError, tomllib.TOMLDecodeError, RecursionError) as error:
        raise InvalidRequest(f"{file} is neither TOML nor JSON: {error}") from None
    guided = answers_in(given)
    if guided:
        given = tables(given, answer, str(file))
    elif answer != 1:
        raise InvalidRequest(f"{file} holds no answers of guided bodies: leave out the number of one")
    if not isinstance(given, dict):
        raise InvalidRequest(f"{file} holds no tables")
    listed = read_points(points, str(given.get("unit", "length"))) if points is not None else NamedPoints()
    given, unused = resolved(given, listed, str(file))
    mirrored = switch("both", both) or switch(f"{file}: both", given.get("both", False))
    given = both_sides(given, str(file)) if mirrored else one_side(given)
    return replace(_parse_job(given, str(file)), unused=tuple(unused), file=str(file), answers=len(guided))


def _parse_job(given: dict[str, Any], file: str) -> Job:
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
    wheels = tuple(_wheel(one, axes, file) for one in _wheel_tables(given, file))
    vehicle = table_in(given, "vehicle", file)
    loads = tuple(_made(Load, one, f"{file}: load {i + 1}") for i, one in enumerate(tables_in(given, "load", file)))
    readings = []
    for one in tables_in(given, "reading", file):
        scalar = str(one.get("scalar", ""))
        if not drives.get(scalar) or set(one) - {"scalar", "name", "wheel", "difference"}:
            raise InvalidRequest(f"{file}: a reading needs the scalar of a drive, and may have a name")
        words = {
            k: text(f"{file}: {k} of a reading", one.get(k, scalar if k == "name" else "")) for k in ("name", "wheel")
        }
        readings.append(Reading(words["name"], scalar, words["wheel"]))
    return Job(
        mechanism,
        drives,
        points,
        wheels,
        table_in(given, "transmission", file),
        given,
        title,
        tuple(readings),
        vehicle=_made(Vehicle, vehicle, f"{file}: vehicle") if vehicle else None,
        loads=loads,
    )


def _wheel_tables(given: Mapping[str, Any], file: str) -> list[dict[str, Any]]:
    """Return the tables of wheels: one ``[wheel]``, or several ``[[wheel]]`` with names."""
    if not isinstance(given.get("wheel"), list):
        return [dict(one) for one in (table_in(dict(given), "wheel", file),) if one]
    wheels = [dict(one) for one in tables_in(dict(given), "wheel", file)]
    called = [one.get("name") for one in wheels]
    if len(wheels) > 1 and (not all(called) or len(set(map(str, called))) < len(called)):
        raise InvalidRequest(f"{file}: several wheels need a name each, such as left and right")
    return wheels


def _wheel(given: dict[str, Any], axes: str, file: str) -> Mounted:
    """Read a wheel, its name, its steering drive and its held springs."""
    steer = names(f"{file}: steer of the wheel", given.pop("steer", ()))
    name = text(f"{file}: name of a wheel", given.pop("name", ""))
    spring = names(f"{file}: spring of the wheel", given.pop("spring", ()))
    wheel: Wheel = _made(Wheel, {**given, "axes": axes}, f"{file}: wheel")
    try:
        wheel.outboard()
    except InvalidRequest as error:
        raise InvalidRequest(f"{file}: {error}") from None
    return Mounted(wheel, name, next(filter(None, steer), ""), spring)


def _coupling(one: Mapping[str, Any], drives: Mapping[str, Any], what: str) -> e.Coupling:
    """Return a coupling of drives; `per_turn` is the travel of the first per turn of the second."""
    parts = names(f"{what}: of", one.get("of", ()))
    unknown = [part for part in parts if not drives.get(part)]
    if unknown or len(parts) < 2 or set(one) - {"of", "weights", "per_turn", "name"}:
        raise InvalidRequest(f"{what} needs of, names of drives, and weights, one for each")
    weights = one.get("weights", ())
    if "per_turn" in one:
        if weights or len(parts) > 2:
            raise InvalidRequest(f"{what}: per_turn stands for the weights of two drives")
        weights = [1.0, -positive(f"{what}: per_turn", one["per_turn"]) / (2 * pi)]
    total = _made(e.Sum, {"parts": [drives[part] for part in parts], "weights": weights}, what)
    return e.Coupling(total, str(one.get("name", "")))


def _drives(given: Mapping[str, Any], file: str, up: tuple[float, ...]) -> dict[str, Any]:
    """Return scalars by the names of their tables; travel is upwards by default."""
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
    """Make a dataclass from its fields; `from` means `from_`."""
    values = {("from_" if k == "from" else k): v for k, v in one.items()}
    known = {f.name for f in fields(kind)}
    for name in values:
        if name not in known:
            permitted = ", ".join(k.rstrip("_") for k in sorted(known))
            raise InvalidRequest(f"{what}: {quoted(name)} means nothing; its fields are {permitted}")
    needed = {f.name.rstrip("_"): f for f in fields(kind) if f.default is MISSING}
    absent = [name for name, f in needed.items() if f.name not in values]
    if absent:
        raise InvalidRequest(f"{what} needs {', '.join(absent)}")
    try:
        return kind(**values)
    except (InvalidRequest, TypeError) as error:
        raise InvalidRequest(f"{what}: {error}") from None
