"""What a file of hard points holds: its mechanism, drives by name, and the table of a motion."""

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
from .axle import Wheel, kinematics
from .instant import ratio
from .mechanism import Mechanism
from .motion import Motion
from .sensitivity import sensitivities
from .statics import Load, reactions
from .transmission import transmission
from .two_wheels import axle

if TYPE_CHECKING:
    from matplotlib.figure import Figure


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
        """Tabulate all readings of the file, one row per pose."""
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

    def _wheels(self, motion: Motion) -> list[pd.DataFrame]:
        """Tabulate each wheel, several by name, and the axle of two."""
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
        """Tabulate a scalar and its ratio to wheel travel, steering held."""
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
