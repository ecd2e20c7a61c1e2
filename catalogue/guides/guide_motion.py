"""The motion of a guide over its drive, position by position."""

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
from ..problem.path import places
from ..units import LENGTH, columns_in

if TYPE_CHECKING:
    import pandas as pd

    from .placed import PlacedGuide

#: Reason for missing velocities where two branches cross.
CHANGE_POINT = "change point: two branches cross, the drive alone leads into neither"
#: Angle from a change point within which a crank counts as at it [rad]: rates are NaN within about
#: 1e-7.
AT_CHANGE = 1e-4
#: Default number of positions of a motion: one per degree of a full turn.
SAMPLES = 361
#: Largest number of positions of a motion: about a gigabyte.
MOST = 1_000_000

#: Reason for an empty transmission angle and mechanical advantage.
NO_CRANK_DRIVES = "the coupler drives: no crank has a transmission angle or an advantage"


@dataclass(frozen=True, eq=False)
class GuideMotion:
    """The motion of a guide at m positions; arrays of shape (m,), lengths in the unit of the guide.

    Velocities and accelerations are derivatives by the angle of the drive.  Multiplied by the
    angular velocity of a uniform drive, and by its square, they become those over time.  At a dead
    point of the drive they are NaN, and `reason` says so.

    Attributes
    ----------
    phase : ndarray
        Phase of the circuit; see `catalogue.kinematics.circuits` [rad].
    drive, coupler : ndarray
        Angle of the driving crank from the x axis; of the coupler from the given position [deg].
    cranks : dict of int to ndarray
        Angles of the cranks from the x axis, by number [deg].
    ratios : dict of str to ndarray
        Angular velocities of ``coupler``, ``crank 1``, ``crank 2`` over that of the drive.
    angular_accelerations : dict of str to ndarray
        Derivatives of `ratios` by the angle of the drive [1/rad].
    points, velocities, accelerations : dict of str to complex ndarray
        Positions x + iy [length] and their derivatives [length/rad, length/rad^2] of ``guided``, of
        the finite moving pivots ``A1*`` and ``A2*`` and of the requested points.
    transmission : ndarray
        Transmission angle of the driving crank; without a crank that of the better dyad; NaN where
        the coupler drives although there is a crank [deg].
    advantage : ndarray
        Mechanical advantage: force along the path over force at the pin of the driving crank,
        without friction; NaN where the coupler drives.
    deviation : ndarray
        Signed distance of the guided point from the nominal, positive to the left; NaN except over
        the stroke [length].
    reason : ndarray of str
        Reason for NaN; else empty.
    unit : str or None
        Unit of the lengths; None if unknown.

    Examples
    --------
    >>> from catalogue import guide
    >>> links = {"crank": 100, "rocker": 250, "ground": 220, "coupler": 250}
    >>> mine = guide(links | {"along": 125, "across": 80})
    >>> motion = mine.motion(samples=73)
    >>> motion.drive.shape, motion.points["guided"].dtype.name
    ((73,), 'complex128')
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
        """Compute the motion of a guide on one circuit.

        Parameters
        ----------
        placed : PlacedGuide
        found : Circuits
            The circuit.
        s : ndarray, shape (m, 1)
            Phases [rad].
        points : mapping of str to (x, y), optional
            Further coupler points [length].
        driver : int, optional
            Number of the driving crank; 0: the coupler.
        """
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
        pushed = not chosen and bool((kinds == RR).any())  # the coupler drives although there is a crank
        usual = NO_CRANK_DRIVES if pushed else ""
        return cls(
            chosen,
            s[:, 0],
            cranks.get(chosen, coupler),
            coupler,
            cranks,
            {"coupler": moves.omega} | {k: v[0] for k, v in spins.items()},
            {"coupler": moves.alpha} | {k: v[1] for k, v in spins.items()},
            at,
            velocities,
            {k: moves.acceleration_of(p) for k, p in at.items()},
            np.full(len(s), np.nan) if pushed else _transmission(here, chosen),
            np.where(np.isfinite(advantage), advantage, np.nan),
            np.full(len(s), np.nan),
            np.where(dead, np.where(_at_change(linkage, chosen, z), CHANGE_POINT, f"dead point of {name}"), usual),
            placed.unit,
        )

    def __len__(self) -> int:
        return len(self.phase)

    def between(self, first: int, last: int) -> GuideMotion:
        """Return the positions from `first` to `last`, without the last one.

        Parameters
        ----------
        first, last : int
            Numbers of positions, as in a slice.
        """
        part = slice(first, last)

        def taken(value: Any) -> Any:
            if isinstance(value, dict):
                return {name: array[part] for name, array in value.items()}
            return value[part] if isinstance(value, np.ndarray) else value

        return replace(self, **{f.name: taken(getattr(self, f.name)) for f in fields(self)})

    def to_pandas(self, unit: str | None = None) -> pd.DataFrame:
        """Convert to a data frame, one row per position, with units in the headings.

        Parameters
        ----------
        unit : str, optional
            Unit to convert lengths to; lengths of unknown unit are taken to be in it.  Without any
            unit the headings say ``length``.

        Raises
        ------
        InvalidRequest
            If the unit is unknown.
        """
        import pandas as pd

        return pd.DataFrame(columns_in(self._columns(), self.unit, unit))

    def _columns(self) -> dict[tuple[str, str], Array]:
        """Return the columns of the table by name and declared unit."""
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
    """Check a number of positions, 2 to `MOST`."""
    return whole("samples", samples, 2, MOST)


def _transmission(linkage: Linkage, driver: int) -> Floats:
    """Compute the transmission angle of the driving crank in each position [deg].

    Driver 0 selects the better dyad.
    """
    from ..guidance.metrics import transmission_sines

    x = np.zeros(1, complex)
    sines = transmission_sines(linkage, [linkage.points[None, :, i, 1] for i in (0, 1)], x)[:, 0]
    angle = np.degrees(np.arcsin(np.clip(np.abs(sines), 0, 1)))
    return np.asarray(angle[driver - 1 if driver else int(angle.min(1).argmax())])


def _at_change(linkage: Linkage, driver: int, z: Complexes) -> Mask:
    """Tell in which positions, pivots z (m, 2, 2), a crank is at a change point."""
    if not driver:
        return np.zeros(len(z), bool)
    closure = Closure.of(linkage, np.array([driver - 1]))
    crank = z[:, driver - 1]
    away = np.abs(np.angle((crank[:, 1] - crank[:, 0]) / closure.arm))
    return np.asarray((closure.change & (np.abs(away - closure.at) < AT_CHANGE)).any(0))


def _cranks(kinds: Sequence[int]) -> str:
    numbers = [f"crank {i + 1}" for i in (0, 1) if kinds[i] == RR]
    return " and ".join(numbers) if numbers else "none, its coupler drives (0)"
