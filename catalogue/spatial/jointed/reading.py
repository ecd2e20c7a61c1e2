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
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from ...errors import CannotDrive, InvalidRequest, quoted
from ...folders import folder
from ...given import instance, names, positive, text
from . import elements as e
from .axle import AXES, Wheel, kinematics
from .instant import ratio
from .mechanism import Mechanism
from .motion import Motion
from .named_points import read_points, resolved
from .sensitivity import sensitivities
from .statics import Load, reactions
from .transmission import transmission
from .two_wheels import axle

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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


@dataclass(frozen=True, eq=False)
class Job:
    """What a file holds; `given` as it was read."""

    mechanism: Mechanism
    drives: dict[str, Any]
    points: tuple[Mapping[str, Any], ...]
    wheel: Wheel | None
    steer: str
    spring: tuple[str, ...]
    output: Mapping[str, Any]
    given: dict[str, Any]
    title: str = ""
    readings: tuple[tuple[str, Any], ...] = ()
    unused: tuple[str, ...] = ()
    file: str = ""
    first: str = ""
    others: tuple[tuple[Wheel, str, str, tuple[str, ...]], ...] = ()
    wheelbase: float | None = None
    loads: tuple[Load, ...] = ()

    def drive(self, name: str) -> Any:
        """Return a drive by its name."""
        if instance("name", name, str) not in self.drives:
            raise InvalidRequest(f"there is no drive {quoted(name)}: the file has {', '.join(self.drives) or 'none'}")
        return self.drives[name]

    def driven(self, drive: str | Sequence[str], hold: Sequence[str] = ()) -> tuple[Any, list[Any]]:
        """Return the first of one or several drives and the held scalars, by their names.

        Raises
        ------
        InvalidRequest
            If there is no such drive.
        CannotDrive
            If more must be held.
        """
        drives = names("drive", drive)
        scalars, held = [self.drive(name) for name in drives], [self.drive(name) for name in hold]
        mobility = self.mechanism.mobility
        missing = mobility.freedoms - len(scalars) - len(held)
        others = [n for n in self.drives if n not in (*drives, *hold)]
        if missing > 0 and others and not mobility.singular:
            rest = f"{' and '.join(drives)} drives one, hold {missing} more of {', '.join(others)}"
            if len(drives) > 1:
                rest = f"{' and '.join(drives)} drive {len(drives)}, hold {missing} more of {', '.join(others)}"
            raise CannotDrive(f"there are {mobility.freedoms} freedoms: {rest}")
        return scalars[0], held

    def sweep(self, drives: Mapping[str, Any], hold: Mapping[str, float | None], grid: bool = False) -> Motion:
        """Move the mechanism by drives of the file.

        Parameters
        ----------
        drives : mapping of names to values, each (s,)
            In the unit of the file, or degrees.
        hold : mapping of names to values
            None for the value in the design pose.
        grid : bool
            Whether every value of a drive is combined with every one of the others.

        Raises
        ------
        InvalidRequest, CannotDrive, NotMovable
            As `Mechanism.sweep`.
        """
        scalars = {name: self.drive(name) for name in (*drives, *hold)}
        system = self.mechanism.system(*scalars.values())
        factor = {
            name: np.radians(1.0) if one.angular else 1.0 for name, one in zip(scalars, system.scalars, strict=True)
        }
        values = {scalars[n]: np.asarray(v, float) * factor[n] for n, v in drives.items()}
        held = {scalars[n]: None if v is None else v * factor[n] for n, v in hold.items()}
        return self.mechanism.sweep(values, hold=held, grid=grid)

    def plot(self, motion: Motion, file: str | Path | None = None) -> Figure:
        """Draw a motion with the wheel and the points of the file."""
        instance("motion", motion, Motion)
        points = {p.get("name", p["body"]): (p["body"], p["at"]) for p in self.points}
        return motion.plot(file, self.wheel, points, title=self.title)

    def table(self, motion: Motion) -> pd.DataFrame:
        """Return all that the file says to print, one row per pose, with units in the headings."""
        instance("motion", motion, Motion)
        unit = self.mechanism.unit
        parts = [self._index(motion)]
        for point in self.points:
            x = motion.point(point["body"], point["at"])
            name = point.get("name", point["body"])
            parts.append(pd.DataFrame({f"{name} {k} [{unit}]": c for k, c in zip("xyz", x.T, strict=True)}))
        for joint in self.mechanism.carriers():
            turns = not isinstance(joint, e.Prismatic)
            value = motion.joint(joint.body)
            parts.append(
                pd.DataFrame({f"{joint.body} [{'deg' if turns else unit}]": np.degrees(value) if turns else value})
            )
        parts += [self._read(motion, name, scalar) for name, scalar in self.readings]
        if self.output:
            parts.append(
                transmission(motion.by(motion.driven), self.output.get("output", ""), self.output.get("link", ""))
            )
        parts += self._wheels(motion)
        if self.loads:
            parts.append(reactions(motion, self.loads))
        whole = pd.concat([part.reset_index(drop=True) for part in parts], axis=1)
        whole = whole.loc[:, ~whole.columns.duplicated()]
        whole.attrs["reasons"] = {k: v for part in parts for k, v in part.attrs.get("reasons", {}).items()}
        return whole.set_index([*parts[0].columns]) if motion.others else whole

    def sensitivities(self, motion: Motion, column: str) -> pd.DataFrame:
        """Return the derivative of a column by every coordinate of every hard point, one row per pose.

        Parameters
        ----------
        motion : Motion
        column : str
            Its heading, with or without the unit.

        Raises
        ------
        InvalidRequest
            If there is no such column.
        """
        headings = list(map(str, self.table(motion).columns))
        found = next((h for h in headings if column in (h, h.partition(" [")[0])), None)
        if found is None:
            raise InvalidRequest(f"no column is headed {quoted(column)}: {', '.join(headings)}")
        name = found
        return sensitivities(motion, lambda moved: self.table(moved)[name].to_numpy())

    def _wheels(self, motion: Motion) -> list[pd.DataFrame]:
        """Return the columns of each wheel, of several with their names before them, and of two those of the axle."""
        out = []
        every = [(self.wheel, "", self.steer, self.spring), *self.others] if self.wheel else []
        for wheel, name, steer, spring in every:
            scalar = self.drive(steer) if steer else None
            table = kinematics(motion, wheel, scalar, [self.drive(one) for one in spring])
            if len(every) > 1:
                first = next(k for k in (name, self.first) if k)
                named = {column: f"{first} {column}" for column in table if not str(column).startswith("drive [")}
                reasons = {named[column]: reason for column, reason in table.attrs["reasons"].items()}
                table = table.rename(columns=named)
                table.attrs["reasons"] = reasons
            out.append(table)
        if len(every) == 2:
            steered = self.drive(self.steer) if self.steer else None
            out.append(axle(motion, every[0][0], every[1][0], steered, self.wheelbase))
        return out

    def _read(self, motion: Motion, name: str, scalar: Any) -> pd.DataFrame:
        """Return a scalar over a motion, and its ratio to the travel of the wheel, steering held."""
        angular = motion.mechanism.scalar_function(scalar, motion.scalars)[0].angular
        unit, factor = ("deg", np.degrees(1.0)) if angular else (self.mechanism.unit, 1.0)
        columns = {f"{name} [{unit}]": motion.value(scalar) * factor}
        if self.wheel:
            up = e.Travel(self.wheel.carrier, self.wheel.centre, (0.0, 0.0, self.wheel.signs[2]))
            rate, reason = ratio(motion, scalar, up, [self.drive(self.steer)] if self.steer else [])
            heading = f"{name} ratio [{unit}/{self.mechanism.unit}]"
            columns[heading] = rate * factor
            table = pd.DataFrame(columns)
            table.attrs["reasons"] = {heading: reason} if reason else {}
            return table
        return pd.DataFrame(columns)

    def _index(self, motion: Motion) -> pd.DataFrame:
        """Return the values of the drives, of several with their names in the file."""
        if not motion.others:
            return pd.DataFrame({f"drive [{motion.drive_unit}]": motion.drive_shown})
        called = {e.identity(scalar): f"drive {name}" for name, scalar in self.drives.items()}
        levels = motion.index.names
        index = motion.index.to_frame(index=False)
        units = [str(level).rpartition(" [")[2] for level in levels]
        named = zip(motion.drives, units, strict=True)
        index.columns = [f"{called.get(e.identity(s), e.title(s))} [{unit}" for s, unit in named]
        return index


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
    """Return a wheel, its name, what steers it, and what is held meanwhile."""
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
