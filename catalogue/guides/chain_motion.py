"""The motion of a mechanism of many bars over its drive, position by position."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..chains.poses import Poses
from ..chains.rates import rates
from ..errors import InvalidRequest, quoted
from ..given import pair
from ..kinematics.types import Array, Complexes, Floats
from ..units import LENGTH, columns_in

if TYPE_CHECKING:
    import pandas as pd

    from .own_chain import OwnChain

#: Reason for missing velocities.
DEAD_POINT = "dead point: {} cannot be driven through"


@dataclass(frozen=True, eq=False)
class ChainMotion:
    """The motion of a mechanism at m positions; arrays of shape (m,).

    Velocities and accelerations are derivatives by the drive: by its angle [rad], or by the
    displacement of a driving slider [length]. At a dead point they are NaN, and `reason` says so.

    Attributes
    ----------
    drive : ndarray
        Angle of the drive from its given pose [deg]; for a slider its displacement [length].
    angles : dict of str to ndarray
        Angle of each moving bar from its given pose, continuous [deg].
    ratios, angular_accelerations : dict of str to ndarray
        Angular velocity of each bar over that of the drive, and its derivative by the drive.
    points, velocities, accelerations : dict of str to complex ndarray
        Positions of all moving joints [length], and their derivatives by the drive.
    distances : dict of str to (ndarray, ndarray)
        Distances of pairs of joints [length], and their derivatives by the drive.
    transmission : ndarray
        Least transmission angle of the dyads [deg].
    reason : ndarray of str
        Reason for NaN; else empty.
    pushed : bool
        Whether a slider drives.
    unit : str or None

    Examples
    --------
    >>> from catalogue import mechanism
    >>> bars = {"frame": "AD", "crank": "AB", "coupler": "BCP", "rocker": "CD"}
    >>> joints = {"A": [0, 0], "D": [2, 0], "B": [0, 1], "C": [2, 2.5], "P": [4, 4]}
    >>> lambda_ = mechanism({"joints": joints, "bars": bars, "drive": "crank", "point": "P"})
    >>> motion = lambda_.motion(samples=5)
    >>> motion.drive.round(6).tolist(), sorted(motion.points)
    ([0.0, 90.0, 180.0, 270.0, 360.0], ['B', 'C', 'P'])
    """

    drive: Floats
    angles: dict[str, Floats]
    ratios: dict[str, Floats]
    angular_accelerations: dict[str, Floats]
    points: dict[str, Complexes]
    velocities: dict[str, Complexes]
    accelerations: dict[str, Complexes]
    distances: dict[str, tuple[Floats, Floats]]
    transmission: Floats
    reason: Array
    pushed: bool
    unit: str | None = None

    @classmethod
    def of(cls, one: OwnChain, phases: Floats, between: Sequence[Sequence[str]] = ()) -> ChainMotion:
        """Compute the motion at phases.

        Parameters
        ----------
        one : OwnChain
        phases : ndarray, shape (m,)
            Phases of its circuit [rad].
        between : sequence of (str, str)
            Pairs of joints whose distances are wanted.

        Raises
        ------
        InvalidRequest
            If a joint of `between` is unknown, or named twice.
        """
        structure, z = one.chain.structure, one.chain.z
        at = one.circuit.poses(phases[:, None])
        moves = rates(at)
        bars = [i for i in range(len(structure.bars)) if i != structure.frame]
        carried = {j: min(on) for j, on in enumerate(structure.on) if structure.frame not in on}
        names = {i: structure.names[i] for i in bars}
        dead = np.isnan(moves.omega[:, :, 0]).any(0)
        pairs = [pair("between", one, "the names of two joints") for one in between]
        if unknown := [name for ends in pairs for name in ends if name not in structure.joints]:
            raise InvalidRequest(f"there is no joint {quoted(unknown[0])}; there are {', '.join(structure.joints)}")
        if still := [one for one, other in pairs if one == other]:
            raise InvalidRequest(f"the distance of joint {quoted(still[0])} from itself is zero: name another joint")
        drive = at.drive[:, 0] if structure.is_pushed else np.degrees(at.drive[:, 0])
        return cls(
            drive,
            {name: np.degrees(np.unwrap(np.angle(at.turn[i, :, 0]))) for i, name in names.items()},
            {name: moves.omega[i, :, 0] for i, name in names.items()},
            {name: moves.alpha[i, :, 0] for i, name in names.items()},
            {structure.joints[j]: at.joint(j)[:, 0] for j in carried},
            {structure.joints[j]: moves.velocity_of(bar, z[j])[:, 0] for j, bar in carried.items()},
            {structure.joints[j]: moves.acceleration_of(bar, z[j])[:, 0] for j, bar in carried.items()},
            {
                f"{first}-{second}": _distance(at, moves, *(structure.joints.index(name) for name in (first, second)))
                for first, second in pairs
            },
            at.transmission[:, 0],
            np.where(dead, DEAD_POINT.format(structure.drive), ""),
            structure.is_pushed,
            one.unit,
        )

    def __len__(self) -> int:
        return len(self.drive)

    def to_pandas(self, unit: str | None = None) -> pd.DataFrame:
        """Convert to a data frame, one row per position, with units in the headings.

        Parameters
        ----------
        unit : str, optional
            Unit to convert lengths to.
        """
        import pandas as pd

        return pd.DataFrame(columns_in(self._columns(), self.unit, unit))

    def _columns(self) -> dict[tuple[str, str], Array]:
        """Return the columns of the table by name and declared unit."""
        rad, turn = (LENGTH, f"1/{LENGTH}") if self.pushed else ("rad", "1")
        first, second = ("1", f"1/{LENGTH}") if self.pushed else (f"{LENGTH}/rad", f"{LENGTH}/rad^2")
        columns: dict[tuple[str, str], Array] = {("drive", LENGTH if self.pushed else "deg"): self.drive}
        taken = ("drive", "transmission")
        columns |= {(f"bar {name}" if name in taken else name, "deg"): angle for name, angle in self.angles.items()}
        for what, every, declared in (
            ("", self.points, LENGTH),
            ("v", self.velocities, first),
            ("a", self.accelerations, second),
        ):
            for name, z in every.items():
                columns |= {(f"{name} {what}x", declared): z.real, (f"{name} {what}y", declared): z.imag}
        columns |= {(f"{name} ratio", turn): ratio for name, ratio in self.ratios.items()}
        by = f"1/{rad}" if not self.pushed else f"1/{LENGTH}^2"
        columns |= {(f"{name} acceleration", by): rate for name, rate in self.angular_accelerations.items()}
        for name, (apart, rate) in self.distances.items():
            columns |= {(name, LENGTH): apart, (f"{name} ratio", first): rate}
        return columns | {("transmission", "deg"): self.transmission, ("reason", ""): self.reason}


def _distance(at: Poses, moves: Any, first: int, second: int) -> tuple[Floats, Floats]:
    """Return the distance of two joints and its derivative by the drive, (m,) each."""
    structure, z = at.chain.structure, at.chain.z
    one, other = (min(structure.on[j]) for j in (first, second))
    way = at.joint(second) - at.joint(first)
    speed = moves.velocity_of(other, z[second]) - moves.velocity_of(one, z[first])
    with np.errstate(all="ignore"):
        return np.abs(way)[:, 0], (way.conj() * speed).real[:, 0] / np.abs(way)[:, 0]
