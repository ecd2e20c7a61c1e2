"""Mechanisms from TOML or JSON: hard points in the user's unit, drives and what is read off by name.

A file holds `unit`, and tables ``[[link]]``, ``[[revolute]]``, ``[[prismatic]]``, ``[[cylindrical]]``,
``[[spherical]]``, ``[[guide]]``, ``[[angle]]`` with the fields of the classes of `elements`; ``[drive.NAME]`` with
`kind` (``joint``, ``travel``, ``length``, ``angle``, ``guide``) and the fields of the scalar; and what to print:
``[[point]]`` with `body`, `at`, `name`; ``[wheel]`` with the fields of `Wheel`, `steer`, the name of a drive, and
`spring`, names of drives that stand still while the wheel is steered;
``[transmission]`` with `output` and `link`.  ``[fit]`` says what is to be fitted: `fitting/files.py`.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from ...errors import CannotDrive, InvalidRequest, quoted
from ...given import instance, names, text
from . import elements as e
from .axle import Wheel, kinematics
from .mechanism import Mechanism
from .motion import Motion
from .transmission import transmission

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ELEMENTS: dict[str, type] = {
    "link": e.Link, "revolute": e.Revolute, "screw": e.Screw, "prismatic": e.Prismatic, "cylindrical": e.Cylindrical,
    "spherical": e.Spherical, "guide": e.OnGuide, "angle": e.KeepAngle,
}  # fmt: skip
SCALARS: dict[str, type] = {
    "joint": e.Joint, "travel": e.Travel, "length": e.Length, "angle": e.Angle, "guide": e.GuideCoordinate,
}  # fmt: skip
OTHERS = ("unit", "drive", "point", "wheel", "transmission", "fit", "title")


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

    def drive(self, name: str) -> Any:
        """Return a drive by its name."""
        if instance("name", name, str) not in self.drives:
            raise InvalidRequest(f"there is no drive {quoted(name)}: the file has {', '.join(self.drives) or 'none'}")
        return self.drives[name]

    def driven(self, drive: str, hold: Sequence[str] = ()) -> tuple[Any, list[Any]]:
        """Return a drive and what is held, by their names.

        Raises
        ------
        InvalidRequest
            If there is no such drive.
        CannotDrive
            If more must be held.
        """
        scalar, held = self.drive(drive), [self.drive(name) for name in hold]
        mobility = self.mechanism.mobility
        missing, others = mobility.freedoms - 1 - len(held), [n for n in self.drives if n not in (drive, *hold)]
        if missing > 0 and others and not mobility.singular:
            rest = f"{drive} drives one, hold {missing} more of {', '.join(others)}"
            raise CannotDrive(f"there are {mobility.freedoms} freedoms: {rest}")
        return scalar, held

    def plot(self, motion: Motion, file: str | Path) -> Figure:
        """Draw a motion with the wheel and the points of the file."""
        instance("motion", motion, Motion)
        points = {p.get("name", p["body"]): (p["body"], p["at"]) for p in self.points}
        return motion.plot(file, self.wheel, points, title=self.title)

    def table(self, motion: Motion) -> pd.DataFrame:
        """Return all that the file says to print, one row per pose, with units in the headings."""
        instance("motion", motion, Motion)
        unit = self.mechanism.unit
        parts = [pd.DataFrame({f"drive [{motion.drive_unit}]": motion.drive_shown})]
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
        if self.output:
            parts.append(transmission(motion, self.output.get("output", ""), self.output.get("link", "")))
        if self.wheel:
            steer = self.drive(self.steer) if self.steer else None
            parts.append(kinematics(motion, self.wheel, steer, [self.drive(name) for name in self.spring]))
        whole = pd.concat(parts, axis=1)
        whole = whole.loc[:, ~whole.columns.duplicated()]
        whole.attrs["reasons"] = parts[-1].attrs.get("reasons", {})
        return whole


def load(file: str | Path) -> Job:
    """Read a mechanism from a TOML or JSON file.

    Raises
    ------
    InvalidRequest
        If the file cannot be read, or a name in it means nothing.
    InvalidLinkage
        If what it holds is no mechanism.
    """
    instance("file", file, str | PathLike)
    try:
        content = Path(file).expanduser().read_text("utf-8-sig")
    except (OSError, UnicodeDecodeError, RuntimeError, ValueError) as error:
        raise InvalidRequest(f"cannot read {file}: {error}") from None
    try:
        given = json.loads(content) if content.lstrip()[:1] == "{" else tomllib.loads(content)
    except (json.JSONDecodeError, tomllib.TOMLDecodeError, RecursionError) as error:
        raise InvalidRequest(f"{file} is neither TOML nor JSON: {error}") from None
    return _job(given, str(file))


def _job(given: dict[str, Any], file: str) -> Job:
    for name in given:
        if name not in ELEMENTS and name not in OTHERS:
            raise InvalidRequest(f"{file}: {quoted(name)} means nothing; tables are {', '.join([*ELEMENTS, *OTHERS])}")
    elements = [
        _made(made, one, f"{file}: {kind} {i + 1}")
        for kind, made in ELEMENTS.items()
        for i, one in enumerate(tables_in(given, kind, file))
    ]
    mechanism = Mechanism(elements, str(given.get("unit", "length")))
    drives = {}
    for name, one in table_in(given, "drive", file).items():
        what = f"{file}: drive {quoted(name)}"
        kind = one.get("kind") if isinstance(one, dict) else None
        if not isinstance(kind, str) or kind not in SCALARS:
            raise InvalidRequest(f"{what} needs a kind, one of {', '.join(SCALARS)}")
        drives[name] = _made(SCALARS[kind], {k: v for k, v in one.items() if k != "kind"}, what)
    points = tuple(tables_in(given, "point", file))
    for one in points:
        if not {"body", "at"} <= set(one):
            raise InvalidRequest(f"{file}: a point needs body and at")
        for name in ("body", "name"):
            text(f"{file}: {name} of a point", one.get(name, ""))
    wheel = dict(table_in(given, "wheel", file))
    title = str(given.get("title", "")) or Path(file).stem.replace("_", " ")
    steer = str(wheel.pop("steer", ""))
    spring = names(f"{file}: spring of the wheel", wheel.pop("spring", ()))
    made = _made(Wheel, wheel, f"{file}: wheel") if wheel else None
    return Job(mechanism, drives, points, made, steer, spring, table_in(given, "transmission", file), given, title)


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
