"""The public class of a mechanism of joints and links: its freedoms and its motions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import CannotDrive, InvalidRequest, NotMovable
from ...given import instance, number, several, switch, text, whole
from ...kinematics.types import Array
from ..continuation.tracing import March
from . import several_drives
from .assemblies import FoundAssemblies, search
from .circuit import Circuit, circuits
from .curve import Curve, tangents
from .drives import scalar_function
from .elements import Coupling, Cylindrical, Element, Prismatic, Revolute, Scalar, identity
from .formulation import Formulation
from .hard_points import HardPoints
from .motion import Motion
from .rank import RANK_TOLERANCE, SINGULAR, UNMET_CONDITIONS, drop_violating, most_violated, rank_of
from .request import Drives
from .scalars import ScalarFunction
from .several_drives import STATIONARY_SLOPE
from .sweeping import swept
from .system import System

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Fields of an element that may differ within a batch.
BATCH_FIELDS = ("at", "to", "from_", "axis", "axis_a", "axis_b", "axis_on", "origin", "quaternion")
#: Largest number of starts of a search for assemblies.
MAX_STARTS = 1_000_000


@dataclass(frozen=True)
class Mobility:
    """Degrees of freedom of a mechanism.

    Attributes
    ----------
    freedoms : int
        Degrees of freedom, without idle rotations.
    idle : tuple of str
        Bodies that spin idly between two spherical joints.
    redundant : tuple of str
        Elements with conditions that the others imply, in all poses.
    singular : bool
        Whether the design pose has more freedoms than its neighbours.
    """

    freedoms: int
    idle: tuple[str, ...]
    redundant: tuple[str, ...]
    singular: bool


class Mechanism:
    """Bodies joined by elements, in the pose of the given hard points.

    Parameters
    ----------
    elements : sequence of Link, Spherical, Revolute, Screw, Prismatic, Cylindrical, Universal,
    Fixed, OnGuide,
        KeepAngle or Coupling
        Points may be (n, 3): a batch of n mechanisms.
    unit : str
        Unit of length of all points; shown in headings.

    Raises
    ------
    InvalidLinkage
        If elements contradict each other, or a point is not finite, or not on its guide.
    InvalidRequest
        If an argument is no element, or the unit no text.

    Examples
    --------
    >>> rssr = Mechanism(
    ...     [Revolute("crank", (0, 0, 0), axis=(0, 0, 1)), Revolute("rocker", (4, 0, 1), axis=(0, 1,
    0)), ...      Link("crank", (1, 0, 0), "rocker", (4, 0, 3))])
    >>> rssr.sweep(Joint("crank"), np.radians(np.arange(361))).joint("rocker")
    """

    def __init__(self, elements: Sequence[Element], unit: str = "mm") -> None:
        self.elements, self.unit = several("elements", elements, Element), text("unit", unit)
        self._systems: dict[Any, System] = {}
        self._functions: dict[Any, tuple[ScalarFunction, HardPoints]] = {}
        self.system()

    @property
    def couplings(self) -> tuple[Scalar, ...]:
        """Sums of scalars that keep their values in every motion."""
        return tuple(x.scalar for x in self.elements if isinstance(x, Coupling))

    @property
    def joints(self) -> tuple[Element, ...]:
        """All elements but couplings."""
        return tuple(x for x in self.elements if not isinstance(x, Coupling))

    def system(self, *scalars: Scalar) -> System:
        """Return the equations, without redundant conditions; the rows of the scalars come last."""
        key = tuple(identity(one) for one in scalars)
        if key not in self._systems:
            made = Formulation(self.elements, scalars).system()
            rank = rank_of(made)
            plain = len(rank.use) == made.rows and not rank.singular
            self._systems[key] = made if plain else replace(made, use=rank.use, singular=rank.singular)
        return self._systems[key]

    def scalar_function(self, scalar: Scalar, stated: Sequence[Scalar]) -> tuple[ScalarFunction, HardPoints]:
        """Return a scalar as a function of the pose in a motion, and its points."""
        key = identity(scalar), *map(identity, stated)
        if key not in self._functions:
            made = Formulation(self.elements, stated)
            made.place()
            made.points = HardPoints()
            self._functions[key] = scalar_function(scalar, made), made.points
        return self._functions[key]

    def carriers(self) -> list[Revolute | Prismatic | Cylindrical]:
        """Return the joints that carry bodies, named by `Joint`."""
        first: dict[str, Revolute | Prismatic | Cylindrical] = {}
        for x in self.elements:
            if isinstance(x, Revolute | Prismatic | Cylindrical):
                first.setdefault(x.body, x)
        return list(first.values())

    @cached_property
    def mobility(self) -> Mobility:
        """Compute the degrees of freedom."""
        system = self.system()
        redundant = [system.names[r] for r in range(system.rows) if r not in system.use]
        idle = [system.bodies[system.vectors[0][w]] for w in system.idle[0]]
        freedoms = system.unknowns - len(system.use) - len(self.couplings)
        return Mobility(freedoms, tuple(idle), tuple(dict.fromkeys(redundant)), system.singular)

    def _curve(self, drive: Scalar, hold: Sequence[Scalar]) -> tuple[Curve, Array, tuple[Scalar, ...]]:
        """Return the curve of poses, the design states (N, numbers), and the held scalars."""
        held = (*self.couplings, *several("hold", hold, Scalar))
        system = self.system(*held, instance("drive", drive, Scalar))
        freedoms = system.unknowns - len(system.use)
        self.movable(system)
        fixed = len(self.couplings)
        if freedoms != 1 + len(held):
            raise CannotDrive(
                f"there are {freedoms - fixed} freedoms: one drives, {freedoms - fixed - 1} must be held, "
                f"not {len(held) - fixed}"
            )
        y = np.repeat(system.design[None], len(system.points), axis=0)
        return Curve(system, system.evaluate(y)[1][:, :-1] if held else np.zeros((len(y), 0))), y, held

    def sweep(
        self,
        drive: Any,
        values: Any = None,
        hold: Sequence[Scalar] | Mapping[Scalar, float | None] = (),
        grid: bool = False,
    ) -> Motion:
        """Move the mechanism by drives, from the design pose, without disassembly.

        Parameters
        ----------
        drive : Joint, Travel, Length, Angle, GuideCoordinate, Sum, or mapping of those to their
        values
            Several drives follow one path: each has as many values, or one value for all poses.
        values : array-like, shape (s,)
            In the unit of the points, or radians.  Poses beyond a dead point are NaN; `Motion.ends`
            tells where, for several drives `Motion.stops`.
        hold : sequence of scalars, or mapping of scalars to values
            Scalars held at their design value or at the given one: one for each freedom without a
            drive.
        grid : bool
            Whether every value of a drive is combined with every one of the others, the last drive
            fastest.

        Examples
        --------
        >>> axle.sweep({travel: np.linspace(-80, 80, 33), rack: [-10, 0, 10]}, grid=True)

        Raises
        ------
        CannotDrive
            If the drive is stationary when the mechanism moves, or the number of drives and held
            scalars is not that of the freedoms.
        NotMovable
            If there is no freedom, or the design pose is singular.
        InvalidRequest
            If values are not finite, or a drive or held one is no scalar.
        """
        drives = Drives.read(drive, values, hold)
        if switch("grid", grid) or not drives.one:
            return several_drives.sweep(self, drives, grid)
        q, drive = drives.values[0], drives.scalars[0]
        curve, y, held = self._curve(drive, drives.held)
        unit = curve.system.scalars[-1].unit
        goal = q / unit
        at = curve.selected(y)(y)
        tangent, slope, regular = tangents(at[1], at[3])
        if (regular < RANK_TOLERANCE).any():
            raise NotMovable(SINGULAR)
        if (slope < STATIONARY_SLOPE).any():
            self._explain(curve, y, tangent, drive)
        states, end, reason = swept(curve, y, at, tangent, goal)
        asked = np.stack([np.minimum(goal.min(), at[2]), np.maximum(goal.max(), at[2])], axis=1)
        short = (asked - end) * (-1, 1) > 0
        ends = [
            tuple((float(v), str(why)) if less else None for v, why, less in zip(*one, strict=True))
            for one in zip(end * unit, reason, short, strict=True)
        ]
        for i in drop_violating(curve, states):
            ends[i] = ((float(q[0]), UNMET_CONDITIONS), (float(q[0]), UNMET_CONDITIONS))
        return Motion(self, curve, drive, held, q, states, tuple(ends))

    def movable(self, system: System) -> None:
        """Raise NotMovable, with the reason, if a system has no freedom."""
        if system.singular:
            raise NotMovable(SINGULAR)
        if system.unknowns > len(system.use):
            return
        told = "joints and links leave no freedom: a structure; free a link, or drive a length"
        missed = most_violated(system)
        if missed is not None:
            told += f"; it would move if {missed[0]} could be off by {missed[1] * system.unit:.2g} {self.unit}: "
            told += "give rounded hard points with all their digits"
        raise NotMovable(told)

    def circuit(self, drive: Scalar, hold: Sequence[Scalar] = ()) -> Circuit:
        """Follow the whole circuit of the mechanism, through dead points of the drive.

        Raises
        ------
        CannotDrive, NotMovable, InvalidRequest
            As `sweep`.
        """
        curve, y, held = self._curve(drive, hold)
        if len(y) > 1:
            raise InvalidRequest("a circuit is that of one mechanism, not of a batch: ask for `circuits`")
        return circuits(self, curve, y, drive, held)[0]

    def circuits(self, drive: Scalar, hold: Sequence[Scalar] = ()) -> list[Circuit]:
        """Follow the circuits of all mechanisms of a batch at once.

        Raises
        ------
        CannotDrive, NotMovable, InvalidRequest
            As `sweep`.
        """
        curve, y, held = self._curve(drive, hold)
        return circuits(self, curve, y, drive, held)

    def one(self, i: int) -> Mechanism:
        """Return mechanism i of a batch by itself."""
        n = len(self.system().points)
        own, i = [], whole("i", i, -n, n - 1)
        for x in self.elements:
            vectors = {k: np.asarray(getattr(x, k), float) for k in BATCH_FIELDS if vars(x).get(k) is not None}
            own.append(replace(x, **{k: v[i] for k, v in vectors.items() if v.ndim == 2 and len(v) > 1}))
        return Mechanism(own, self.unit)

    def assemblies(
        self, drive: Scalar, value: float, hold: Sequence[Scalar] = (), hits: int = 5, most: int = 4096, seed: int = 1
    ) -> FoundAssemblies:
        """Find assemblies at a value of a drive by Newton's method from random poses.

        Parameters
        ----------
        drive, hold
            As for `sweep`.
        value : float
        hits, most, seed : int
            Number of hits of each assembly, or of random starts, after which the search ends; seed
            of the random numbers.

        Raises
        ------
        CannotDrive, NotMovable, InvalidRequest
            As `sweep`.
        """
        at, hits, most = number("value", value), whole("hits", hits, 1, MAX_STARTS), whole("most", most, 1, MAX_STARTS)
        curve, y, held = self._curve(drive, hold)
        if len(y) > 1 or not np.isfinite(at):
            raise InvalidRequest("assemblies are those of one mechanism at one finite value of its drive")
        target, seed = at / curve.system.scalars[-1].unit, whole("seed", seed, 0)
        states, counts, starts, fruitless = search(curve, target, hits, most, seed)
        motion = Motion(self, curve, drive, held, np.full(len(states), at), states[None], ((None, None),))
        return FoundAssemblies(motion, counts, starts, fruitless, hits)

    def plot(self, file: str | Path | None = None, labels: bool = True, title: str = "") -> Figure:
        """Draw the design pose in three dimensions, as `Motion.plot` does a motion."""
        from ..drawing.figure import draw
        from .picture import scene

        if len(self.system().points) > 1:
            raise InvalidRequest("a picture is that of one mechanism, not of a batch")
        return draw(scene(self, title=text("title", title)), file, switch("labels", labels))

    def _explain(self, curve: Curve, y: Array, tangent: Array, drive: Scalar) -> None:
        """Raise an error that explains why the drive is stationary in the design pose."""
        march, name, moves = March(curve, y, tangent), type(drive).__name__, False
        for _ in range(4):
            march.step()
            moves |= bool(np.abs(march.last[4]).max() > STATIONARY_SLOPE)
        if not moves:
            raise CannotDrive(f"this {name} cannot drive: it keeps its value when the mechanism moves")
        raise CannotDrive(
            f"the design pose is a dead point of this {name}: it is stationary there; drive another scalar"
        )
