"""One answer as a user sees it."""

from __future__ import annotations

import math
from copy import deepcopy
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InvalidRequest
from ..linkage import Array, Linkage
from .request import CircularArc, Request, StraightLine

if TYPE_CHECKING:
    from ..guide.span import Span
    from ..refine.drift import Drifts
    from ..refine.sensitivity import Sensitivity


#: Properties of a candidate that are printed besides its fields.
DERIVED = ("drift", "band", "percent", "lengths")


@dataclass(frozen=True, eq=False)
class Candidate:
    """A verified guide, laid so that its path runs from (0, 0) to (stroke, 0); lengths in the user's unit.

    Attributes
    ----------
    id : int or None
        Of the stored guide it comes from; ``catalogue show ID`` shows it.  None if it was constructed for given pivots.
    family, series, configuration : str
        Of the ancestor at its design position.
    order : int
        Order of contact of the ancestor there; 99 if it is exact.
    stroke, deviation : float
        Deviation: half the width of the narrowest strip (annulus) that holds the path over the stroke.
    radius : float or None
        Of the best circle; None for a straight line.
    size, max_link, max_ground, max_arm, min_transmission, rotates
        See `catalogue.guide.measures.Measures`; None where there is no such length.  `rotates`: numbers of the cranks.
    driver, drive_angle, time_ratio, uniformity, advantage, rotation
        See `catalogue.guide.practice.Practice`; None where there is no such thing.
    sensitivity_rms, expected : float or None
        Standard deviation of the path's displacement across it, where it is largest, if every coordinate of every pivot
        is off by a standard deviation of 1; deviation plus two of them for the play that was asked for.  None for a
        point that returns.
    pivots : list
        [[A1, A1*], [A2, A2*]], each [x, y, w], with the guided point in mid-stroke; one that returns at rest.
    guided : list of float
        The guided point at that moment.
    score : float or None
        One mark, 0 to 100, for size, transmission angle and deviation together; see `catalogue.query.ranking.score`.
    front : int or None
        Number of its Pareto front, 1 if no other answer is better by all criteria; None unless it was asked for.
    nearest : float or None
        How near the nearest other answer is as a design, 0 to 1; see `catalogue.query.likeness`.
    unrefined : float or None
        Deviation before refinement, if the candidate was refined; series and configuration are those it had then.
    gap : float or None
        Part of the deviation that moving the pivots by a hundredth of their distance from the guided point could still
        take away within the constraints, at most and to first order (`catalogue.refine.certificate`); 0: it is
        stationary.  None if not refined, exact, or a point that returns.
    alternations : int or None
        Peaks of alternating sign at which the path reaches the deviation, ends included; with `gap`.
    cognate : int or None
        1, 2: it is a cognate of the stored guide, the one that shares its first or second fixed pivot.
    pole : list of float or None
        Given where the linkage is at a change point at that moment: the pole of the branch on which it moves.
    """

    id: int | None
    family: str
    series: str
    configuration: str
    order: int
    stroke: float
    deviation: float
    radius: float | None
    size: float
    max_link: float | None
    max_ground: float | None
    max_arm: float | None
    min_transmission: float
    rotates: list[int]
    pivots: list[list[list[float]]]
    guided: list[float]
    driver: int | None = None
    drive_angle: float | None = None
    time_ratio: float | None = None
    uniformity: float | None = None
    advantage: float | None = None
    rotation: float | None = None
    sensitivity_rms: float | None = None
    expected: float | None = None
    score: float | None = None
    front: int | None = None
    nearest: float | None = None
    unrefined: float | None = None
    gap: float | None = None
    alternations: int | None = None
    cognate: int | None = None
    pole: list[float] | None = None
    _drift: tuple[Drifts, int] | None = field(default=None, repr=False)

    @property
    def linkage(self) -> Linkage:
        """The linkage, in mid-stroke."""
        return Linkage(self.pivots)

    @property
    def request(self) -> Request:
        """The nominal that this candidate follows, with its own deviation as tolerance."""
        tolerance = max(self.deviation, 1e-300)
        if self.radius is None:
            return StraightLine(self.stroke, tolerance)
        return CircularArc(self.stroke, self.radius, tolerance)

    def span(self) -> Span:
        """Return the guide ready to be traced from mid-stroke."""
        from ..guide.span import span

        pole = None if self.pole is None else np.array([complex(*self.pole)])
        return span(self.linkage, np.array([complex(*self.guided)]), pole=pole)

    def path(self, points: int = 101) -> Array:
        """Return points of the guided path over the stroke, shape (points, 2)."""
        from ..guide.place import at_stroke

        here = self.span()
        traced = at_stroke(here, self.stroke, circle=self.radius is not None, extend=False)
        share = np.linspace(-1, 1, points)
        u, v = here.path.window(traced.low.astype(float), traced.high.astype(float), share)
        z = here.point + (u + 1j * v)[:, 0] * here.tangent
        z = z if z[0].real < z[-1].real else z[::-1]
        return np.stack([z.real, z.imag], axis=-1)

    def sensitivity(self) -> Sensitivity:
        """Return what errors of the pivots and play in the joints do to the path; arrays of one entry.

        Raises
        ------
        InvalidRequest
            If the guided point returns: at its rest it follows no error to first order.
        """
        from ..guide.place import at_stroke
        from ..refine.sensitivity import sensitivity

        here = self.span()
        if here.cusp.any():
            raise InvalidRequest("the guided point returns: its sensitivity is not known")
        return sensitivity(here, at_stroke(here, self.stroke, circle=self.radius is not None, extend=False))

    @property
    def drift(self) -> float | None:
        """Least residual, over the stroke, of the refined linkage in the series of its ancestor: 0 if it still belongs
        to it.  None if not refined, or where the series has no residual.  Measured for all answers when first asked
        for, because it takes the plugins."""
        if self._drift is None:
            return None
        drifts, row = self._drift
        return known(drifts.least[row])

    @property
    def band(self) -> float:
        """Width of the narrowest strip, twice the deviation."""
        return 2 * self.deviation

    @property
    def percent(self) -> float:
        """The band in percent of the stroke."""
        return 100 * self.band / self.stroke

    @property
    def lengths(self) -> dict[str, float]:
        """Lengths of the links and place of the guided point in the coupler, by name; see `catalogue.dimensions`."""
        from ..dimensions import dimensions

        found = dimensions(self.linkage, np.array([complex(*self.guided)]))
        return {name: float(value[0]) for name, value in found.items()}

    def to_dict(self) -> dict[str, Any]:
        """Return the candidate as plain Python numbers, lists and strings, what is derived included."""
        return {name: deepcopy(getattr(self, name)) for name in COLUMNS}

    def plot(self, file: str | Path | None = None) -> Any:
        """Draw the linkage in mid-stroke with ghosts at the ends, its path and the deviation.

        Parameters
        ----------
        file : path, optional
            PNG, SVG or PDF by its suffix.

        Returns
        -------
        matplotlib.figure.Figure

        Raises
        ------
        MissingExtra
            Without matplotlib: ``pip install "mechanism-catalogue[plot]"``.
        """
        from ..draw import draw

        return draw(self, file)


#: What a candidate is printed as.
COLUMNS = (*(f.name for f in fields(Candidate) if f.repr), *DERIVED)


def known(value: float) -> float | None:
    """Return a finite number, None for another."""
    return float(value) if math.isfinite(value) else None
