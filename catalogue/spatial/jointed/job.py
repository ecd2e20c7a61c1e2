"""Contents of a file of hard points: mechanism, named drives, and the table of a motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from ...errors import CannotDrive, InvalidRequest, quoted
from ...given import instance, names
from . import elements as e
from .axle import AXES, Wheel, height, kinematics, unit_of
from .columns import AXLE, VEHICLE, heading
from .instant import ratio
from .mechanism import Mechanism
from .motion import Motion
from .sensitivity import sensitivities
from .statics import Load, reactions
from .transmission import transmission
from .two_wheels import axle
from .vehicle import Vehicle, tabulate_support

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False)
class Mounted:
    """A wheel of a file: its name, its steering drive, and the drives held while it is steered."""

    wheel: Wheel
    name: str = ""
    steer: str = ""
    spring: tuple[str, ...] = ()


@dataclass(frozen=True)
class Reading:
    """A scalar to tabulate, by the name of its drive.

    Attributes
    ----------
    name, scalar : str
    wheel : str
        Name of the wheel whose travel is the reference of its ratio; ``"both"``: the difference of
        both.
    """

    name: str
    scalar: str
    wheel: str = ""


@dataclass(frozen=True, eq=False, repr=False)
class Job:
    """Contents of a file of hard points; `given` are its tables as read."""

    mechanism: Mechanism
    drives: dict[str, Any]
    points: tuple[Mapping[str, Any], ...]
    wheels: tuple[Mounted, ...]
    output: Mapping[str, Any]
    given: dict[str, Any]
    title: str = ""
    readings: tuple[Reading, ...] = ()
    unused: tuple[str, ...] = ()
    file: str = ""
    answers: int = 0
    vehicle: Vehicle | None = None
    loads: tuple[Load, ...] = ()

    def __repr__(self) -> str:
        return f"<Job {quoted(self.title)}: drives {', '.join(self.drives) or 'none'}>"

    @property
    def wheel(self) -> Wheel | None:
        """The first wheel; None without wheels."""
        return self.wheels[0].wheel if self.wheels else None

    def remarks(self) -> list[str]:
        """List possible omissions: axes that are not stated, unused points."""
        out = []
        if self.wheels and "axes" not in self.given:
            out.append(
                "axes of the hard points are not stated, read as ISO 8855 (x forwards, y to the left, z up): "
                f"state axes, one of {', '.join(AXES)}"
            )
        if self.answers > 1:
            out.append(f"{self.file} holds {self.answers} guided bodies: --answer says which")
        if self.unused:
            out.append(f"hard points that nothing refers to: {', '.join(self.unused)}")
        return out

    def drive(self, name: str) -> Any:
        """Return a drive by its name."""
        if instance("name", name, str) not in self.drives:
            raise InvalidRequest(f"there is no drive {quoted(name)}: the file has {', '.join(self.drives) or 'none'}")
        return self.drives[name]

    def driven(self, drive: str | Sequence[str], hold: Sequence[str] = ()) -> tuple[Any, list[Any]]:
        """Return the first drive and the held scalars, by their names.

        Raises
        ------
        InvalidRequest
            If there is no such drive.
        CannotDrive
            If more scalars must be held.
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
            Values in the unit of the file, or degrees.
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
        read = {one.name: self.drive(one.scalar) for one in self.readings}
        springs = {name: one for name, one in read.items() if isinstance(one, e.Length) and not one.link}
        return motion.plot(file, [one.wheel for one in self.wheels], points, title=self.title, springs=springs)

    def table(self, motion: Motion) -> pd.DataFrame:
        """Tabulate all readings of the file, one row per pose."""
        instance("motion", motion, Motion)
        unit = self.mechanism.unit
        parts = [self._drive_index(motion)]
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
        parts += [self._read(motion, one) for one in self.readings]
        if self.output:
            parts.append(
                transmission(motion.by(motion.driven), self.output.get("output", ""), self.output.get("link", ""))
            )
        parts += self._tabulate_wheels(motion)
        if self.loads:
            parts.append(reactions(motion, self.loads))
        whole = pd.concat([part.reset_index(drop=True) for part in parts], axis=1)
        whole = whole.loc[:, ~whole.columns.duplicated()]
        whole.attrs["reasons"] = {k: v for part in parts for k, v in part.attrs.get("reasons", {}).items()}
        return whole.set_index([*parts[0].columns]) if motion.others else whole

    def sensitivities(self, motion: Motion, column: str) -> pd.DataFrame:
        """Differentiate a column by the coordinates of all hard points, per pose.

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

    def _tabulate_wheels(self, motion: Motion) -> list[pd.DataFrame]:
        """Tabulate each wheel, with names if there are several, and the axle of two."""
        out, unit = [], self.mechanism.unit
        for one in self.wheels:
            springs = [self.drive(name) for name in one.spring]
            tables = [kinematics(motion, one.wheel, self._steer(one), springs, self._roll_scalars())]
            if self.vehicle:
                tables.append(tabulate_support(self.vehicle, tables[0], unit))
            out += [_prefix_columns(table, one.name if len(self.wheels) > 1 else "") for table in tables]
        rolled, name = (out[0], heading("roll centre", unit)) if len(self.wheels) == 1 else (None, "")
        if len(self.wheels) == 2:
            base = self.vehicle.wheelbase if self.vehicle else None
            first, second = self.wheels
            rolled = axle(motion, first.wheel, second.wheel, self._steer(first), base)
            name = heading("roll centre height", unit, AXLE)
            out.append(rolled)
        if rolled is not None and self.vehicle and self.vehicle.roll_centre is not None:
            own = heading("roll axis", unit, VEHICLE)
            table = pd.DataFrame({own: self.vehicle.roll_axis(rolled[name].to_numpy())})
            why = rolled.attrs["reasons"].get(name)
            table.attrs["reasons"] = {own: why} if why else {}
            out.append(table)
        return out

    def _roll_scalars(self) -> list[Any]:
        """Return the difference of both travels of an axle, held in heave."""
        if len(self.wheels) != 2:
            return []
        first, second = (height(one.wheel) for one in self.wheels)
        return [first - second]

    def _steer(self, one: Mounted) -> Any:
        return self.drive(one.steer) if one.steer else None

    def _read(self, motion: Motion, reading: Reading) -> pd.DataFrame:
        """Tabulate a scalar and its ratio to wheel travel, with the steering held."""
        scalar, length = self.drive(reading.scalar), self.mechanism.unit
        unit = unit_of(motion, scalar)
        factor = np.degrees(1.0) if unit == "deg" else 1.0
        table = pd.DataFrame({f"{reading.name} [{unit}]": motion.value(scalar) * factor})
        if not self.wheels:
            return table
        one = next((w for w in self.wheels if w.name == reading.wheel), self.wheels[0])
        still = [self._steer(one)] if one.steer else []
        moving: Any = height(one.wheel)
        if reading.wheel == "both":
            other = height(self.wheels[1].wheel)
            moving, still = moving - other, [(moving + other) / 2, *still]
        rate, reason = ratio(motion, scalar, moving, still)
        more = [*still, *(motion.held if reading.wheel == "both" else self._roll_scalars() or motion.held)]
        if reason and len(more) > len(still):
            rate, reason = ratio(motion, scalar, moving, more)
        name = f"{reading.name} ratio [{unit}/{length}]"
        table[name] = rate * factor
        table.attrs["reasons"] = {name: reason} if reason else {}
        return table

    def _drive_index(self, motion: Motion) -> pd.DataFrame:
        """Return the values of the drives; several are headed by their names in the file."""
        if not motion.others:
            return pd.DataFrame({f"drive [{motion.drive_unit}]": motion.drive_shown})
        called = {e.identity(scalar): f"drive {name}" for name, scalar in self.drives.items()}
        levels = motion.index.names
        index = motion.index.to_frame(index=False)
        units = [str(level).rpartition(" [")[2] for level in levels]
        named = zip(motion.drives, units, strict=True)
        index.columns = [f"{called.get(e.identity(s), e.title(s))} [{unit}" for s, unit in named]
        return index


def _prefix_columns(table: pd.DataFrame, name: str) -> pd.DataFrame:
    """Put the name of a wheel before its columns."""
    if not name:
        return table
    named = {k: f"{name} {k}" for k in table if not str(k).startswith("drive [")}
    reasons = {named[k]: reason for k, reason in table.attrs["reasons"].items()}
    out = table.rename(columns=named)
    out.attrs["reasons"] = reasons
    return out
