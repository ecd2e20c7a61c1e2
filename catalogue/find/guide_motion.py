"""The motion of a guide over the drive, position by position."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InvalidRequest
from ..given import whole
from ..kinematics.circuits import COUPLER, Circuits
from ..kinematics.closure import Closure
from ..kinematics.linkage import RR, Linkage
from ..kinematics.rates import rates
from ..kinematics.types import Array, Complexes, Floats, Mask
from ..problem.request import places
from ..units import LENGTH, factor, power, unit_or_none

if TYPE_CHECKING:
    import pandas as pd

    from .placed import PlacedGuide

#: Why a motion has no velocities where two branches cross.
CHANGE_POINT = "change point: two branches cross, the drive alone leads into neither"
#: How near to the angle of its change point a crank stands at it [rad]; rates are NaN within about 1e-7 of it.
AT_CHANGE = 1e-4
#: Positions of a motion if it is not said how many, and at most.
SAMPLES, MOST = 361, 1_000_000

#: Reason for an empty transmission angle and mechanical advantage.
NO_CRANK_DRIVES = "the coupler drives: no crank has a transmission angle or an advantage"


@dataclass(frozen=True, eq=False)
class GuideMotion:
    """The motion of a guide at m positions; arrays of shape (m,), lengths in the unit of the guide.

    Velocities and accelerations are derivatives by the angle of the drive: times the angular velocity of the drive, and
    its square, they are those of a drive that turns steadily.  They are NaN in a dead point of the drive, where it
    cannot move the linkage; `reason` says so.

    Attributes
    ----------
    phase : ndarray
        Of the circuit, see `catalogue.kinematics.circuits` [rad].
    drive, coupler : ndarray
        Angle of the driving crank from the x axis; of the coupler, from the position given [deg].
    cranks : dict of int to ndarray
        Angles of the cranks from the x axis, by number [deg].
    ratios : dict of str to ndarray
        Angular velocities over that of the drive: ``coupler``, ``crank 1``, ``crank 2``.
    angular_accelerations : dict of str to ndarray
        Their derivatives by the angle of the drive [1/rad].
    points, velocities, accelerations : dict of str to complex ndarray
        Of ``guided``, the finite moving pivots ``A1*`` and ``A2*`` and the points asked for: x + iy [length], its
        derivatives [length/rad, length/rad^2].
    transmission : ndarray
        Transmission angle of the crank that drives, without a crank of the better dyad; NaN where the coupler drives
        although there is a crank [deg].
    advantage : ndarray
        Mechanical advantage: force of the guided point along its path over force at the pin of the driving crank,
        without friction; NaN where the coupler drives.
    deviation : ndarray
        Distance of the guided point from the nominal, positive to the left, where the motion is that over the stroke;
        else NaN [length].
    reason : ndarray of str
        Why something is NaN; else empty.
    unit : str or None
        Of the lengths; None if it is not known.
    """

    driver: int
    phase: Floats
    drive: Floats
    coupler: Floats
    cranks: dict[int, Floats]
    ratios: dict[str, Floats]
    angular_accelerations: dict[str, Floats]
    points: dict[str, Complexes]
    velocities: dict[str, Complexes]
    accelerations: dict[str, Complexes]
    transmission: Floats
    advantage: Floats
    deviation: Floats
    reason: Array
    unit: str | None = None

    @classmethod
    def of(
        cls, placed: PlacedGuide, found: Circuits, s: Floats, points: Mapping[str, Any] | None, driver: int | None
    ) -> GuideMotion:
        """Return the motion of a guide at phases (m, 1) of one circuit."""
        linkage, lead = found.linkage, int(found.lead[0])
        chosen = (lead + 1) % 3 if driver is None else whole("driver", driver, 0)
        kinds = linkage.dyads[0]
        if chosen and (chosen > 2 or kinds[chosen - 1] != RR):
            raise InvalidRequest(f"there is no crank {chosen} to drive: this {linkage.family[0]} has {_cranks(kinds)}")
        pose = found.pose(s)
        here = pose.linkages(linkage)
        moves = rates(here, np.full(len(s), chosen - 1 if chosen else COUPLER))
        named = {"guided": complex(*placed.guided)}
        named |= {f"A{i + 1}*": complex(linkage.points[0, i, 1]) for i in (0, 1) if linkage.finite[0, i, 1]}
        named |= {name: complex(*at) for name, at in places("points", points).items()}
        at = {name: pose.point(np.array([z]))[:, 0] for name, z in named.items()}
        z = here.points
        cranks = {i + 1: np.degrees(np.unwrap(np.angle(z[:, i, 1] - z[:, i, 0]))) for i in (0, 1) if kinds[i] == RR}
        coupler = np.degrees(np.unwrap(np.angle(1 + pose.x[:, 0])))
        spins = {f"crank {i}": moves.crank(here, i - 1) for i in cranks}
        velocities = {name: moves.velocity_of(p) for name, p in at.items()}
        with np.errstate(all="ignore"):
            reach = np.abs(z[:, chosen - 1, 1] - z[:, chosen - 1, 0]) if chosen else np.full(len(s), np.nan)
            advantage = reach / np.abs(velocities["guided"])
        name = f"crank {chosen}" if chosen else "coupler"
        dead = np.isnan(moves.omega)
        pushed = not chosen and bool((kinds == RR).any())  # though a crank could drive
        usual = NO_CRANK_DRIVES if pushed else ""
        return cls(
            chosen, s[:, 0], cranks.get(chosen, coupler), coupler, cranks,
            {"coupler": moves.omega} | {k: v[0] for k, v in spins.items()},
            {"coupler": moves.alpha} | {k: v[1] for k, v in spins.items()},
            at, velocities, {k: moves.acceleration_of(p) for k, p in at.items()},
            np.full(len(s), np.nan) if pushed else _transmission(here, chosen),
            np.where(np.isfinite(advantage), advantage, np.nan),
            np.full(len(s), np.nan),
            np.where(dead, np.where(_at_change(linkage, chosen, z), CHANGE_POINT, f"dead point of {name}"), usual),
            placed.unit,
        )  # fmt: skip

    def __len__(self) -> int:
        return len(self.phase)

    def between(self, first: int, last: int) -> GuideMotion:
        """Return the motion from one position to the one before another."""
        part = slice(first, last)

        def taken(value: Any) -> Any:
            if isinstance(value, dict):
                return {name: array[part] for name, array in value.items()}
            return value[part] if isinstance(value, np.ndarray) else value

        return replace(self, **{f.name: taken(getattr(self, f.name)) for f in fields(self)})

    def to_pandas(self, unit: str | None = None) -> pd.DataFrame:
        """Return one row per position; headings say the units.

        Parameters
        ----------
        unit : str, optional
            In which lengths are told, converted from that of the guide; where the guide has none, they are taken to be
            in it.  If neither has one the headings say ``length``.

        Raises
        ------
        InvalidRequest
            If there is no such unit.
        """
        import pandas as pd

        told = unit_or_none(unit) or self.unit
        times = float(factor(self.unit, told)) if self.unit and told else 1.0
        columns: dict[str, Array] = {}
        for (name, declared), values in self._columns().items():
            scale = times ** power(declared)
            heading = f"{name} [{declared.replace(LENGTH, told or LENGTH)}]" if declared else name
            columns[heading] = values if scale == 1 else scale * values
        return pd.DataFrame(columns)

    def _columns(self) -> dict[tuple[str, str], Array]:
        """Return the columns of the table by their names and declared units."""
        columns: dict[tuple[str, str], Array] = {("drive", "deg"): self.drive, ("coupler", "deg"): self.coupler}
        columns |= {(f"crank {i}", "deg"): angle for i, angle in self.cranks.items()}
        for what, every, declared in (
            ("", self.points, LENGTH),
            ("v", self.velocities, f"{LENGTH}/rad"),
            ("a", self.accelerations, f"{LENGTH}/rad^2"),
        ):
            for name, z in every.items():
                columns |= {(f"{name} {what}x", declared): z.real, (f"{name} {what}y", declared): z.imag}
        columns |= {(f"{name} ratio", "1"): ratio for name, ratio in self.ratios.items()}
        columns |= {(f"{name} acceleration", "1/rad"): rate for name, rate in self.angular_accelerations.items()}
        return columns | {
            ("transmission", "deg"): self.transmission,
            ("advantage", "1"): self.advantage,
            ("deviation", LENGTH): self.deviation,
            ("reason", ""): self.reason,
        }


def sampled(samples: Any) -> int:
    """Return how many positions are asked for; `InvalidRequest` unless from 2 to `MOST`."""
    return whole("samples", samples, 2, MOST)


def _transmission(linkage: Linkage, driver: int) -> Floats:
    """Return the transmission angle in each position, the crank of that number driving, 0: the better dyad [deg]."""
    from ..guidance.metrics import transmission_sines

    x = np.zeros(1, complex)
    sines = transmission_sines(linkage, [linkage.points[None, :, i, 1] for i in (0, 1)], x)[:, 0]
    angle = np.degrees(np.arcsin(np.clip(np.abs(sines), 0, 1)))
    return np.asarray(angle[driver - 1 if driver else int(angle.min(1).argmax())])


def _at_change(linkage: Linkage, driver: int, z: Complexes) -> Mask:
    """Return in which positions, pivots z (m, 2, 2), the crank of that number is at a change point."""
    if not driver:
        return np.zeros(len(z), bool)
    closure = Closure.of(linkage, np.array([driver - 1]))
    crank = z[:, driver - 1]
    away = np.abs(np.angle((crank[:, 1] - crank[:, 0]) / closure.arm))
    return np.asarray((closure.change & (np.abs(away - closure.at) < AT_CHANGE)).any(0))


def _cranks(kinds: Sequence[int]) -> str:
    numbers = [f"crank {i + 1}" for i in (0, 1) if kinds[i] == RR]
    return " and ".join(numbers) if numbers else "none, its coupler drives (0)"
