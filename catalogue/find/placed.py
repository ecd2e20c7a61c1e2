"""Guides that stand somewhere, whatever they came from: their circuits, and their motion over the drive."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InvalidLinkage, InvalidRequest, quoted
from ..kinematics.circuits import COUPLER, SWING, TURN, Circuits, circuits
from ..kinematics.linkage import RR, Linkage
from ..kinematics.rates import rates
from ..kinematics.types import Array, Complexes, Floats
from ..problem.request import places, whole
from ..problem.request import point as two_numbers

if TYPE_CHECKING:
    import pandas as pd

    from ..problem.request import Request
    from .improve import Improvement
    from .measure import Measured

#: Positions of a motion if it is not said how many, and at most.
SAMPLES, MOST = 361, 1_000_000


@dataclass(frozen=True)
class Circuit:
    """One circuit of a linkage: what it reaches without being taken apart.

    Attributes
    ----------
    lead : str
        What its positions are told by: ``crank 1``, ``crank 2`` or ``coupler``.
    motion : str
        ``turns`` (fully), ``swings`` (between dead points) or ``open`` (from infinity to infinity).
    low, high : float
        Range of the lead's angle from the x axis [deg]; of the coupler, from the given position.
    given : bool
        Whether the linkage is given in a position of this circuit.
    """

    lead: str
    motion: str
    low: float
    high: float
    given: bool


class PlacedGuide:
    """What all guides have that stand somewhere: a linkage of given pivots with a guided point.

    Attributes
    ----------
    pivots, guided : list
        [[A1, A1*], [A2, A2*]], each [x, y, w], and the guided point [x, y], in one position [the user's unit].
    pole : list of float or None
        Where the linkage is at a change point in that position: the pole of the branch on which it moves.
    """

    pivots: list[list[list[float]]]
    guided: list[float]
    pole: list[float] | None

    @property
    def linkage(self) -> Linkage:
        """The linkage, in the position given."""
        return Linkage(self.pivots)

    @cached_property
    def lengths(self) -> dict[str, float]:
        """Lengths of the links and place of the guided point in the coupler, by name; see `kinematics.link_lengths`."""
        from ..kinematics.link_lengths import link_lengths

        found = link_lengths(self.linkage, np.array([complex(*self.guided)]))
        return {name: float(value[0]) for name, value in found.items()}

    @property
    def circuits(self) -> list[Circuit]:
        """All circuits; that of the given position first."""
        found = circuits(self.linkage)
        axis = np.degrees(np.angle(found.closure.arm))
        told = []
        for k in range(len(found)):
            led, kind = int(found.lead[k]), int(found.kind[k])
            offset = 0.0 if led == COUPLER else float(axis[k])
            low, high = 0.0, 360.0
            if kind != TURN:
                swing = abs(float(found.half[k])) if kind == SWING else float(found.half[k])
                low, high = (math.degrees(float(found.centre[k]) + side * swing) for side in (-1, 1))
            told.append(
                Circuit(
                    "coupler" if led == COUPLER else f"crank {led + 1}",
                    ("turns", "swings", "open")[kind],
                    low + offset if kind != TURN else 0.0,
                    high + offset if kind != TURN else 360.0,
                    bool(np.isfinite(found.phase[k])),
                )
            )
        return told

    @property
    def dead_points(self) -> dict[str, list[float]]:
        """Angles of each crank from the x axis at which it is at a dead point, where it cannot drive [deg, 0 to
        360), on all circuits."""
        return _stops(self.linkage, dead=True)

    @property
    def change_points(self) -> dict[str, list[float]]:
        """Angles of each crank from the x axis at which all pivots lie on one line, and the linkage may change its
        branch [deg, 0 to 360)."""
        return _stops(self.linkage, dead=False)

    def motion(
        self, samples: int = SAMPLES, *, points: Mapping[str, Any] | None = None, driver: int | None = None
    ) -> GuideMotion:
        """Return the motion over the whole circuit of the given position, beginning and ending there.

        Parameters
        ----------
        samples : int
            Positions, 2 at least.
        points : mapping of str to (x, y), optional
            Further coupler points by name, where they are in the given position.
        driver : int, optional
            Number of the crank that drives, 1 or 2; 0: the coupler.  If not given that which leads, see `circuits`.

        Raises
        ------
        InvalidRequest
            If a point is no pair of numbers, there is no such crank, or samples are fewer than 2 or more than a
            million.
        """
        found = circuits(self.linkage)[:1]
        s = found.phase + np.linspace(0, 1, sampled(samples))[:, None] * found.period
        return GuideMotion.of(self, found, s, points, driver)

    def measure(self, **asked: Any) -> Measured:
        """Return where the guided point runs straightest, or nearest to a circle; see `catalogue.measure`."""
        from .measure import measure

        return measure(self, **asked)

    def improve(self, request: Request, **how: Any) -> Improvement:
        """Return the guide as it is, refined, and beside the best of a catalogue; see `catalogue.improve`."""
        from .improve import improve

        return improve(self, request, **how)


@dataclass(frozen=True)
class OwnGuide(PlacedGuide):
    """A linkage of your own with the point that is to be guided; made by `catalogue.guide`."""

    pivots: list[list[list[float]]]
    guided: list[float]
    pole: list[float] | None = None
    name: str = ""

    def __repr__(self) -> str:
        lengths = ", ".join(f"{name} {value:.6g}" for name, value in self.lengths.items())
        return f"<{self.name or 'OwnGuide'}: {self.linkage.family[0]}, {lengths}>"


def guide(linkage: Any, point: Any = None, *, name: str = "") -> OwnGuide:
    """Return a linkage of your own as a guide that can be measured, moved and improved.

    Parameters
    ----------
    linkage : Linkage, array_like or mapping
        One linkage: its pivots, [[A1, A1*], [A2, A2*]], each (x, y) or (x, y, w); or its link lengths by name, see
        `catalogue.kinematics.from_lengths`, with the `angle` of the crank and the `branch`, or without if any position
        will do.
    point : (x, y)
        The coupler point, where it is in that position.  Of link lengths it may be given by `along` and `across`
        instead, from crank 1's moving pivot along and across the line to the other one; see
        `catalogue.kinematics.link_lengths`.

    Raises
    ------
    InvalidLinkage, InvalidRequest
        If they form no linkage, or there is no point.
    """
    from ..kinematics.from_lengths import guide_from_lengths

    if not isinstance(name, str):
        raise InvalidRequest(f"name must be a text, not {quoted(name)}")
    if isinstance(linkage, Mapping):
        one, at = guide_from_lengths(linkage)
    else:
        one = linkage if isinstance(linkage, Linkage) else Linkage(linkage)
        at = np.full(len(one), complex(np.nan, np.nan))
    if len(one) != 1:
        raise InvalidLinkage(f"one linkage is wanted, not {len(one)}: `catalogue.measure` takes many")
    if point is None and np.isnan(at[0]):
        raise InvalidRequest(
            "say which point is guided: point=(x, y) in that position, or `along` and `across` beside link lengths"
        )
    place = two_numbers("point", point) if point is not None else (float(at[0].real), float(at[0].imag))
    return OwnGuide(one.pivots[0].tolist(), [*place], None, name)


@dataclass(frozen=True, eq=False)
class GuideMotion:
    """The motion of a guide at m positions; arrays of shape (m,), lengths in the user's unit.

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
        Transmission angle [deg].
    advantage : ndarray
        Mechanical advantage: force of the guided point along its path over force at the pin of the driving crank,
        without friction; NaN where the coupler drives.
    deviation : ndarray
        Distance of the guided point from the nominal, positive to the left, where the motion is that over the stroke;
        else NaN [length].
    reason : ndarray of str
        Why something is NaN; else empty.
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
        return cls(
            chosen, s[:, 0], cranks.get(chosen, coupler), coupler, cranks,
            {"coupler": moves.omega} | {k: v[0] for k, v in spins.items()},
            {"coupler": moves.alpha} | {k: v[1] for k, v in spins.items()},
            at, velocities, {k: moves.acceleration_of(p) for k, p in at.items()},
            _transmission(here, chosen), np.where(np.isfinite(advantage), advantage, np.nan),
            np.full(len(s), np.nan),
            np.where(dead, f"dead point of {name}", ""),
        )  # fmt: skip

    def __len__(self) -> int:
        return len(self.phase)

    def to_pandas(self, unit: str = "") -> pd.DataFrame:
        """Return one row per position; headings say the unit, that of lengths if it is named here, else ``length``."""
        import pandas as pd

        length = unit or "length"
        columns: dict[str, Array] = {"drive [deg]": self.drive, "coupler [deg]": self.coupler}
        columns |= {f"crank {i} [deg]": angle for i, angle in self.cranks.items()}
        for name, z in self.points.items():
            columns |= {f"{name} x [{length}]": z.real, f"{name} y [{length}]": z.imag}
        for what, every, by in (("v", self.velocities, "rad"), ("a", self.accelerations, "rad^2")):
            for name, z in every.items():
                columns |= {f"{name} {what}x [{length}/{by}]": z.real, f"{name} {what}y [{length}/{by}]": z.imag}
        columns |= {f"{name} ratio [1]": ratio for name, ratio in self.ratios.items()}
        columns |= {f"{name} acceleration [1/rad]": rate for name, rate in self.angular_accelerations.items()}
        columns |= {
            "transmission [deg]": self.transmission,
            "advantage [1]": self.advantage,
            f"deviation [{length}]": self.deviation,
            "reason": self.reason,
        }
        return pd.DataFrame(columns)


def sampled(samples: Any) -> int:
    """Return how many positions are asked for; `InvalidRequest` unless from 2 to `MOST`."""
    if whole("samples", samples, 2) > MOST:
        raise InvalidRequest(f"samples must be at most {MOST}, not {samples}")
    return int(samples)


def _transmission(linkage: Linkage, driver: int) -> Floats:
    """Return the transmission angle in each position, the crank of that number driving, 0: the better dyad [deg]."""
    from ..guidance.metrics import transmission_sines

    x = np.zeros(1, complex)
    sines = transmission_sines(linkage, [linkage.points[None, :, i, 1] for i in (0, 1)], x)[:, 0]
    angle = np.degrees(np.arcsin(np.clip(np.abs(sines), 0, 1)))
    return np.asarray(angle[driver - 1 if driver else int(angle.min(1).argmax())])


def _stops(linkage: Linkage, *, dead: bool) -> dict[str, list[float]]:
    """Return by crank the angles from the x axis at which it is dead, or at a change point [deg]."""
    from ..kinematics.circuits import Closure

    told = {}
    for i in np.flatnonzero(linkage.dyads[0] == RR):
        closure = Closure.of(linkage, np.array([i]))
        axis, angles = float(np.angle(closure.arm[0])), []
        for which, at in zip((closure.dead if dead else closure.change)[:, 0], closure.at[:, 0], strict=True):
            if which:
                angles += [axis + at, axis - at]
        told[f"crank {i + 1}"] = sorted({round(math.degrees(a) % 360, 9) for a in angles})
    return told


def _cranks(kinds: Sequence[int]) -> str:
    numbers = [f"crank {i + 1}" for i in (0, 1) if kinds[i] == RR]
    return " and ".join(numbers) if numbers else "none, its coupler drives (0)"
