"""Requests for dwells, and their answers."""

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
    """Request for a dwell: a rocker rests while a crank turns on.

    Parameters
    ----------
    angle : float
        Minimum rotation of the crank during the dwell [deg].
    residual : float
        Maximum range of the rocker's angle during the dwell [deg].
    swing : float
        Minimum swing of the rocker over a turn [deg].
    crank : float
        Length of the driving crank [length].
    unit : str, optional
        Unit of the lengths: mm, cm, m, in or ft.

    Raises
    ------
    InvalidRequest
        Unless all are positive, the angle below 300, the swing below 180 and the residual below a
        fifth of the swing; or if the unit is unknown.

    Examples
    --------
    >>> from catalogue import StandStill
    >>> dwell = StandStill(angle=90, residual=0.5, swing=30, crank=40, unit="mm")
    >>> dwell.angle, dwell.unit
    (90.0, 'mm')
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
    """A six-bar dwell mechanism in a position of its dwell; positions are [x, y]."""

    id: int  #: number of the stored guide it was refined from; the next fields are of that guide, too
    family: str
    series: str
    configuration: str
    order: int
    angle: float  #: rotation of the crank during the dwell [deg]; measured in steps of an eighth of a degree
    residual: float  #: range of the rocker's angle during the dwell [deg]
    swing: float  #: range of the rocker's angle over a turn [deg]
    min_transmission: float  #: minimum transmission angle over the turn, of linkage and output dyad [deg]
    #: Overall size: diameter of all finite pivots in this position and of the path over the turn
    #: [length].
    size: float
    driver: int  #: number of the driving crank
    pivots: list[list[list[float]]]  #: [[A1, A1*], [A2, A2*]], each [x, y, w]
    guided: list[float]  #: coupler point that drives the rod
    joint: list[float]  #: joint of rod and rocker
    pivot: list[float]  #: fixed pivot of the rocker
    #: Angles of the driving crank at start and end of the dwell, counterclockwise from the line
    #: from its fixed pivot to that of the rocker [deg]; None in older records.
    drive_from: float | None = None
    drive_to: float | None = None
    #: Standard deviation of pivot position at which 95 % of machines keep the requested residual
    #: over the requested dwell, in the middle of this one [length].
    allowance: float | None = None
    asked_angle: float | None = None  #: requested dwell [deg]
    asked_residual: float | None = None  #: requested residual [deg]
    unit: str | None = None  #: unit of the lengths; None if unknown

    meanings = DWELL
    pole = None  # a dwell is never at a change point
    __hash__ = PlacedGuide.__hash__

    @cached_property
    def lengths(self) -> dict[str, float]:
        """Lengths of all links, and distance of the fixed pivots, by name [length]."""
        rod, rocker = math.dist(self.guided, self.joint), math.dist(self.joint, self.pivot)
        home = self.pivots[self.driver - 1][0][:2]
        return {**super().lengths, "rod": rod, "rocker": rocker, "rocker pivot": math.dist(home, self.pivot)}

    def joints(self, guided: Complexes) -> Complexes:
        """Compute the position of the joint of rod and rocker.

        Parameters
        ----------
        guided : complex ndarray, shape (m,)
            Positions of the guided point [length].

        Returns
        -------
        complex ndarray, shape (m,)
            Positions of the joint [length]; NaN where rod and rocker do not reach the point.
        """
        from ..guidance.dwell import joint_places

        point, joint, pivot = (np.array(complex(*z)) for z in (self.guided, self.joint, self.pivot))
        return joint_places(guided, point, joint, pivot)

    def scaled(self, crank: float) -> DwellCandidate:
        """Scale the dwell to a length of the driving crank [length].

        Raises
        ------
        InvalidRequest
            Unless the length is finite and positive.
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
        """Requested dwell as a range of the turn, in the middle of the actual one.

        None if unknown.
        """
        if self.drive_from is None or self.asked_angle is None:
            return None
        from ..guidance.dwell_scatter import Standing

        middle, half = self.drive_from + 0.5 * self.angle, 0.5 * self.asked_angle
        point, joint, pivot = (complex(*z) for z in (self.guided, self.joint, self.pivot))
        low, high = math.radians(middle - half), math.radians(middle + half)
        return Standing(self.linkage, point, joint, pivot, self.driver, low, high)

    def for_request(self, request: StandStill) -> DwellCandidate:
        """Add the request, and the allowance for it."""
        asked = replace(self, asked_angle=request.angle, asked_residual=request.residual)
        standing = asked._standing
        return (
            asked if standing is None else replace(asked, allowance=standing.allowance(math.radians(request.residual)))
        )

    @cached_property
    def kept_share(self) -> float | None:
        """Fraction of 1000 simulated machines, scattered by the allowance, that keep the residual.

        None without an allowance.
        """
        standing = self._standing
        if standing is None or self.asked_residual is None or self.allowance is None or self.allowance <= 0:
            return None
        return standing.kept_share(self.allowance, math.radians(self.asked_residual))

    def to_dict(self) -> dict[str, Any]:
        """Convert the dwell to plain numbers, lists and strings, with derived properties."""
        return {**asdict(self), "lengths": dict(self.lengths)}


@dataclass(frozen=True, eq=False)
class DwellResults(Results[DwellCandidate]):
    """Dwells, best first; the explanation has the number of trials and the closest miss."""

    @property
    def columns(self) -> list[str]:
        return [*DwellCandidate.__dataclass_fields__, "lengths"]
