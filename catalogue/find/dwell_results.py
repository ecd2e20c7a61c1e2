"""A rocker that is to stand still, and what is found for it."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InvalidRequest
from ..given import positive
from ..kinematics.types import Complexes
from ..units import unit_or_none
from .columns import DWELL
from .placed import PlacedGuide
from .results import Results

if TYPE_CHECKING:
    from ..guidance.dwell_scatter import Standing


@dataclass(frozen=True)
class StandStill:
    """A rocker is to stand still while a crank turns on.

    Parameters
    ----------
    angle : float
        By how much the crank turns meanwhile, at least [deg].
    residual : float
        Width of the band of angles in which the rocker may stray meanwhile [deg].
    swing : float
        How far the rocker swings over a turn, at least [deg].
    crank : float
        Length of the driving crank [`unit`].
    unit : str, optional
        Of the lengths of the answers: mm, cm, m, in or ft.

    Raises
    ------
    InvalidRequest
        Unless all are positive, the angle below 300, the swing below 180, the residual below a fifth of the swing; or
        if there is no such unit.
    """

    angle: float
    residual: float
    swing: float
    crank: float = 1.0
    unit: str | None = None

    def __post_init__(self) -> None:
        unit_or_none(self.unit)
        for name in ("angle", "residual", "swing", "crank"):
            object.__setattr__(self, name, positive(name, getattr(self, name)))
        if self.angle >= 300 or self.swing >= 180:
            raise InvalidRequest("a dwell of 300 degrees or more, or a swing of 180, cannot be had with a dyad")
        if self.residual > 0.2 * self.swing:
            raise InvalidRequest(f"a residual of {self.residual:g} degrees in {self.swing:g} is no standstill")


@dataclass(frozen=True)
class DwellCandidate(PlacedGuide):
    """A crank-driven linkage with an output dyad, at a place of the dwell; the driving crank has the length asked for,
    places are [x, y]."""

    id: int  #: of the stored guide that it comes from, like what follows
    family: str
    series: str
    configuration: str
    order: int
    angle: float  #: of the crank during the dwell [deg]; angles are measured in steps of an eighth of a degree
    residual: float  #: range of the rocker's angles meanwhile [deg]
    swing: float  #: the same over the full turn [deg]
    min_transmission: float  #: least angle over the full turn, of the linkage and at the joint of the dyad [deg]
    #: Diameter of all finite pivots at that place, the joint and the pivot of the output dyad among them,
    #: together with the guided path over the whole turn [the unit of the crank].
    size: float
    driver: int  #: number of the crank that turns
    pivots: list[list[list[float]]]  #: [[A1, A1*], [A2, A2*]], each [x, y, w]
    guided: list[float]  #: the coupler point that leads the rod
    joint: list[float]  #: of rod and rocker
    pivot: list[float]  #: the fixed pivot of the rocker
    #: Angles of the driving crank at the beginning and at the end of the dwell, counterclockwise from the line from its
    #: fixed pivot to that of the rocker [deg]; None if a record does not say them.
    drive_from: float | None = None
    drive_to: float | None = None
    #: Standard deviation of every coordinate at which the rocker keeps the residual asked over the dwell asked, in the
    #: middle of this one, with 95 % probability [the unit of the crank].
    allowance: float | None = None
    asked_angle: float | None = None  #: dwell asked [deg]
    asked_residual: float | None = None  #: residual asked [deg]
    unit: str | None = None  #: of the lengths; None: not known

    meanings = DWELL
    pole = None  # it is at no change point
    __hash__ = PlacedGuide.__hash__

    @cached_property
    def lengths(self) -> dict[str, float]:
        """Lengths of all links, by name: of the linkage, the rod and the rocker, and how far the rocker's pivot is from
        that of the driving crank."""
        rod, rocker = math.dist(self.guided, self.joint), math.dist(self.joint, self.pivot)
        home = self.pivots[self.driver - 1][0][:2]
        return {**super().lengths, "rod": rod, "rocker": rocker, "rocker pivot": math.dist(home, self.pivot)}

    def joints(self, guided: Complexes) -> Complexes:
        """Return where the joint of rod and rocker is.

        Parameters
        ----------
        guided : complex ndarray, shape (m,)
            Places of the guided point [length].

        Returns
        -------
        complex ndarray, shape (m,)
            Places of the joint [length], NaN where rod and rocker do not reach the point.
        """
        from ..guidance.dwell import joint_places

        point, joint, pivot = (np.array(complex(*z)) for z in (self.guided, self.joint, self.pivot))
        return joint_places(guided, point, joint, pivot)

    def scaled(self, crank: float) -> DwellCandidate:
        """Return the same dwell with a driving crank of this length [its unit].

        Raises
        ------
        InvalidRequest
            Unless it is a finite number above zero.
        """
        (ax, ay, _), (bx, by, _) = self.pivots[self.driver - 1]
        times = positive("crank", crank) / math.dist((ax, ay), (bx, by))
        pivots = [[[times * x, times * y, w] if w else [x, y, w] for x, y, w in dyad] for dyad in self.pivots]
        guided, joint, pivot = ([times * x, times * y] for x, y in (self.guided, self.joint, self.pivot))
        allowance = None if self.allowance is None else times * self.allowance
        return replace(
            self, pivots=pivots, guided=guided, joint=joint, pivot=pivot, size=times * self.size, allowance=allowance
        )

    @property
    def _standing(self) -> Standing | None:
        """The part of the turn over which the rocker is to stand still, in the middle of that over which it does; None
        where it is not known what was asked."""
        if self.drive_from is None or self.asked_angle is None:
            return None
        from ..guidance.dwell_scatter import Standing

        middle, half = self.drive_from + 0.5 * self.angle, 0.5 * self.asked_angle
        point, joint, pivot = (complex(*z) for z in (self.guided, self.joint, self.pivot))
        low, high = math.radians(middle - half), math.radians(middle + half)
        return Standing(self.linkage, point, joint, pivot, self.driver, low, high)

    def for_request(self, request: StandStill) -> DwellCandidate:
        """Return the same dwell with what was asked and its allowance for it."""
        asked = replace(self, asked_angle=request.angle, asked_residual=request.residual)
        standing = asked._standing
        return (
            asked if standing is None else replace(asked, allowance=standing.allowance(math.radians(request.residual)))
        )

    @cached_property
    def kept_share(self) -> float | None:
        """Share of a thousand machines, drawn at the allowance, whose rocker keeps the residual asked; None without an
        allowance."""
        standing = self._standing
        if standing is None or self.asked_residual is None or self.allowance is None or self.allowance <= 0:
            return None
        return standing.kept_share(self.allowance, math.radians(self.asked_residual))

    def to_dict(self) -> dict[str, Any]:
        """Return the dwell as plain Python numbers, lists and strings, what is derived included."""
        return {**asdict(self), "lengths": dict(self.lengths)}


@dataclass(frozen=True, eq=False)
class DwellResults(Results[DwellCandidate]):
    """Dwells, best first; its explanation says how many guides were looked at, and how near the nearest came."""

    @property
    def columns(self) -> list[str]:
        return [*DwellCandidate.__dataclass_fields__, "lengths"]
