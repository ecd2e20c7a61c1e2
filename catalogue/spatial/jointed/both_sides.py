"""Mirror the tables of one wheel at the middle plane: both wheels of an axle."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from ...errors import InvalidRequest, quoted
from ...given import names
from .axle import AXES, SIDES
from .elements import GROUND
from .named_points import DIRECTION_FIELDS, POINT_FIELDS

#: Fields that name a body.
BODY_FIELDS = ("body", "on", "a", "b", "carrier")
#: Fields that name drives.
DRIVE_FIELDS = ("scalar", "of", "steer", "spring")
#: Kinds of tables that occur once per side.
SIDED_TABLES = (
    "link",
    "revolute",
    "screw",
    "prismatic",
    "cylindrical",
    "spherical",
    "universal",
    "fixed",
    "angle",
    "coupling",
    "point",
    "reading",
    "load",
)
#: Kinds of joints that turn about an axis.
TURNING_JOINTS = ("revolute", "cylindrical", "screw")


def both_sides(given: Mapping[str, Any], file: str) -> dict[str, Any]:
    """Mirror the tables of one wheel; prefix bodies, names and drives by ``left`` and ``right``.

    Tables with ``once = true`` refer to bodies that both sides share (`shared`) and are kept
    unchanged.  Drives ``heave`` and ``roll``, mean and difference of both travels, are added.

    Parameters
    ----------
    given : mapping
        The tables of a file, with names replaced by coordinates.
    file : str
        For messages.

    Raises
    ------
    InvalidRequest
        If the file does not describe one wheel, or has a guide, a fit or a transmission.
    """
    wheel, drives = given.get("wheel"), given.get("drive", {})
    if not isinstance(wheel, dict) or not all(isinstance(one, dict) for one in drives.values()):
        raise InvalidRequest(f"{file}: both sides are those of a file with one [wheel] and [drive]")
    for name in ("guide", "fit", "transmission"):
        if given.get(name):
            raise InvalidRequest(f"{file}: [{name}] has no other side: state both wheels in the file")
    sign = AXES.get(str(given.get("axes")), (1.0, 1.0, 1.0))[1]
    try:
        is_left = float(wheel["centre"][1]) * sign > 0
    except (KeyError, IndexError, TypeError, ValueError):
        raise InvalidRequest(f"{file}: the wheel needs its centre") from None
    sides = [(side, (side == "left") != is_left) for side in SIDES]
    shared = {GROUND, *names(f"{file}: shared", given.get("shared", ()))}
    sided = {k for k, v in drives.items() if not v.get("once")}

    def of(table: Mapping[str, Any], side: str, mirrored: bool, kind: str = "") -> dict[str, Any]:
        out = _mirror_table(table, kind) if mirrored else dict(table)
        for field in BODY_FIELDS:
            if isinstance(out.get(field), str) and out[field] not in shared:
                out[field] = f"{side} {out[field]}"
        for field in ("name", "link"):
            if out.get(field):
                out[field] = f"{side} {out[field]}"
        for field in DRIVE_FIELDS:
            if field in out:
                named = names(f"{file}: {field}", out[field])
                out[field] = [f"{side} {name}" if name in sided else name for name in named]
        if "scalar" in out:
            out = {**out, "scalar": out["scalar"][0], "wheel": side}
        return out

    out = {k: v for k, v in given.items() if k not in ("both", "shared")}
    for kind in SIDED_TABLES:
        tables = given.get(kind, [])
        if tables and isinstance(tables, list) and all(isinstance(one, dict) for one in tables):
            out[kind] = [_unsided(one) for one in tables if one.get("once")]
            out[kind] += [
                of(one, side, mirrored, kind) for one in tables if not one.get("once") for side, mirrored in sides
            ]
    out["drive"] = {k: _unsided(v) for k, v in drives.items() if k not in sided} | {
        f"{side} {k}": of(v, side, mirrored, "drive")
        for k, v in drives.items()
        if k in sided
        for side, mirrored in sides
    }
    out["wheel"] = [
        {**of(wheel, side, mirrored), "name": side, **({"side": side} if "side" in wheel else {})}
        for side, mirrored in sides
    ]
    out["drive"] |= _heave_and_roll(out["drive"], [k for k, v in drives.items() if v.get("kind") == "travel"])
    if "reading" in out:
        out["reading"] = list(_both_readings(out["reading"], out["drive"]))
    return out


def one_side(given: Mapping[str, Any]) -> dict[str, Any]:
    """Remove the entries of a file that concern both sides."""
    out = {k: v for k, v in given.items() if k not in ("both", "shared")}
    for kind in SIDED_TABLES:
        if isinstance(out.get(kind), list):
            out[kind] = [_unsided(one) if isinstance(one, dict) else one for one in out[kind]]
    if isinstance(out.get("drive"), dict):
        out["drive"] = {k: _unsided(v) if isinstance(v, dict) else v for k, v in out["drive"].items()}
    return out


def _unsided(table: Mapping[str, Any]) -> dict[str, Any]:
    return {k: v for k, v in table.items() if k != "once"}


def _mirror_table(table: Mapping[str, Any], kind: str) -> dict[str, Any]:
    """Reflect points and directions of a table at y = 0.

    Axes of rotation keep their sense of rotation as seen from their own side.
    """
    out = dict(table)
    for field, value in table.items():
        if field in (*POINT_FIELDS, *DIRECTION_FIELDS, "force") and isinstance(value, list):
            turns = (kind in TURNING_JOINTS and field == "axis") or field == "about"
            out[field] = _reflect(value, -1.0 if turns else 1.0)
        elif field == "moment" and isinstance(value, list):
            out[field] = _reflect(value, -1.0)
        elif field in DIRECTION_FIELDS and value == "y":
            out[field] = [0.0, -1.0, 0.0]
        elif field == "lead":
            out[field] = -value
    if kind in TURNING_JOINTS and "to" in out:
        out["at"], out["to"] = out["to"], out["at"]
    return out


def _reflect(value: list[Any], sign: float) -> list[Any]:
    if len(value) != 3:
        raise InvalidRequest(f"{quoted(value)} is no point of one wheel: both sides need x, y, z")
    return [sign * value[0], -sign * value[1], sign * value[2]]


def _heave_and_roll(drives: Mapping[str, Any], travels: Iterable[str]) -> dict[str, Any]:
    """Return drives ``heave`` and ``roll`` of the first travel, unless such names exist."""
    first = next((name for name in travels if f"left {name}" in drives), None)
    if first is None:
        return {}
    both = [f"{side} {first}" for side in SIDES]
    made = {"heave": [0.5, 0.5], "roll": [1.0, -1.0]}
    return {
        name: {"kind": "sum", "of": both, "weights": weights} for name, weights in made.items() if name not in drives
    }


def _both_readings(tables: Iterable[dict[str, Any]], drives: dict[str, Any]) -> Iterable[dict[str, Any]]:
    """Yield readings; for those with `difference`, also the difference of both sides."""
    for table in tables:
        name = table.pop("difference", "")
        yield table
        if name and table["wheel"] == SIDES[0]:
            pair = [f"{side} {table['scalar'].removeprefix(f'{SIDES[0]} ')}" for side in SIDES]
            drives[name] = {"kind": "sum", "of": pair, "weights": [1.0, -1.0]}
            yield {"scalar": name, "wheel": "both"}
