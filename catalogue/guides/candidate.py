"""One answer to a request: a placed, verified guide."""

from __future__ import annotations

import math
from collections.abc import Mapping
from copy import deepcopy
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InvalidRequest, quoted
from ..given import complexes, switch
from ..guidance.sensitivity import SENSITIVITY, sensitivity
from ..kinematics.types import Complexes, Floats
from ..problem.path import CircularArc, PathFrame, PathRequest, StraightLine, places
from ..quantities import Further, Measured
from .columns import CANDIDATE, attributes
from .guide_motion import SAMPLES, GuideMotion, sampled
from .placed import PlacedGuide
from .run import Run

if TYPE_CHECKING:
    from ..guidance.circuit_curve import CircuitCurve
    from ..guidance.coupler_curve import CouplerCurve
    from ..guidance.sensitivity import Sensitivity
    from ..guidance.trace import Traced
    from ..refine.certificate import Drifts

#: Positions over the turn to measure the lift: every quarter of a degree of a uniformly turning
#: crank.
LIFT_POSITIONS = 1441
#: Properties printed besides the fields.
DERIVED = ("drift", "band", "percent", "lift", "lengths")


@dataclass(frozen=True, init=False, repr=False, eq=False)
class _Origin:
    """Fields of `Candidate` before its size: origin and path."""

    id: int | None
    family: str
    series: str
    configuration: str
    order: int
    stroke: float
    deviation: float
    radius: float | None


@dataclass(frozen=True, init=False, repr=False, eq=False)
class _Places:
    """Fields of `Candidate` after its size and before the optional ones: the linkage."""

    rotates: list[int]
    pivots: list[list[list[float]]]
    guided: list[float]
    driver: int | None = None


for _fields in (Measured, Further):
    dataclass(frozen=True, init=False, repr=False, eq=False)(_fields)


@dataclass(frozen=True, repr=False)
class Candidate(Further, _Places, Measured, _Origin, PlacedGuide):
    """A verified guide in the frame of the request; lengths in its `unit`.

    Some attributes may be None.  They are defined in `catalogue.guidance.metrics.Measures`,
    `catalogue.guidance.drive.DriveMetrics`, `catalogue.guidance.fixed_nominal` (deviation with
    prescribed pivots), `catalogue.problem.ranking.Ranking.score`, `catalogue.candidates.select`
    (nearest) and `catalogue.refine.certificate` (gap, alternations: to first order; None if not
    refined).

    Examples
    --------
    >>> from catalogue import StraightLine
    >>> best = cat.find(StraightLine(stroke=150, deviation=0.5), families=["four-bar"], limit=1)[0]
    >>> best.deviation <= 0.5, best.path(points=11).shape, best.family
    (True, (11, 2), 'four-bar')
    """

    asked_deviation: float | None = None
    fitted: int | None = None
    score: float | None = None
    front: int | None = None
    nearest: float | None = None
    gap: float | None = None
    alternations: int | None = None
    cognate: int | None = None
    pole: list[float] | None = None
    start: list[float] = field(default_factory=lambda: [0.0, 0.0])
    along: float = 0.0
    unit: str | None = None
    arc_angle: float | None = None
    _drift: tuple[Drifts, int] | None = field(default=None, repr=False, compare=False)
    __hash__ = PlacedGuide.__hash__

    @property
    def frame(self) -> PathFrame:
        """Frame of the path: its start and direction."""
        return PathFrame((self.start[0], self.start[1]), self.along)

    @property
    def request(self) -> PathRequest:
        """The path of this candidate as a request, with its own deviation as tolerance.

        Raises
        ------
        InvalidRequest
            If the deviation is a tenth of the stroke or more, as that of a measured stretch may be.
        """
        tolerance = max(self.deviation, 1e-300)
        start = (self.start[0], self.start[1])
        if self.radius is None:
            return StraightLine(self.stroke, tolerance, start, self.along, self.unit)
        return CircularArc(self.stroke, tolerance, self.radius, start, self.along, self.unit, self.arc_angle)

    def __repr__(self) -> str:
        kind = " ".join(part for part in (self.series, self.family, self.configuration) if part)
        arc = "" if self.radius is None else f", radius {self.radius:.6g}"
        arc += f", {self.arc_angle:.4g}\u00b0" if self.is_wide else ""
        lengths = f", lengths in {self.unit}" if self.unit else ""
        return (
            f"<{type(self).__name__} {kind}: stroke {self.stroke:.6g}{arc}, deviation {digits(self.deviation)}, "
            f"size {digits(self.size, '.4g')}{lengths}, transmission {digits(self.min_transmission, '.0f')}\u00b0>"
        )

    def at_home(self) -> Candidate:
        """Move the candidate's path to run from (0, 0) to (stroke, 0)."""
        if self.along == 0 and self.start == [0.0, 0.0]:
            return self
        turn, origin = self.frame.direction.conjugate(), self.frame.origin

        def carried(x: float, y: float, w: float = 1.0) -> list[float]:
            z = turn * (complex(x, y) - (origin if w else 0))
            return [z.real, z.imag]

        pivots = [[[*carried(x, y, w), w] for x, y, w in pair] for pair in self.pivots]
        x, y = self.guided
        pole = None if self.pole is None else carried(self.pole[0], self.pole[1])
        return replace(self, pivots=pivots, guided=carried(x, y), pole=pole, start=[0.0, 0.0], along=0.0)

    def span(self) -> CouplerCurve:
        """Return the coupler curve of the guided point, from mid-stroke."""
        from ..guidance.coupler_curve import coupler_curve

        pole = None if self.pole is None else np.array([complex(*self.pole)])
        return coupler_curve(self.linkage, np.array([complex(*self.guided)]), pole=pole, least=0.5 * self.stroke)

    def motion(
        self,
        samples: int = SAMPLES,
        *,
        points: Mapping[str, Any] | None = None,
        driver: int | None = None,
        whole: bool = False,
    ) -> GuideMotion:
        """Compute the motion over the stroke, from the start of the path to its end.

        Parameters
        ----------
        samples : int
            Number of positions, 2 to 1,000,000; see `PlacedGuide.motion`.
        points : mapping of str to (x, y), optional
            Further coupler points by name, in the position of the pivots [length].
        driver : int, optional
            Number of the driving crank, 1 or 2; 0: the coupler.
        whole : bool
            Compute the motion over the whole circuit instead.

        Returns
        -------
        GuideMotion

        Raises
        ------
        InvalidRequest
            See `PlacedGuide.motion`; also for the stroke of a point that returns.
        """
        driver = self.driver if driver is None else driver
        if switch("whole", whole):
            return super().motion(samples, points=points, driver=driver)
        if self.traced[0].cusp.any():
            raise InvalidRequest("the guided point returns: ask for the motion over the whole circuit")
        run = self.run(points=points)
        moved = run.motion(run.rows(sampled(samples)), driver)
        return replace(moved, deviation=self.off_nominal(moved.points["guided"]))

    def drawn_motion(
        self, samples: int, *, whole: bool = False, points: Mapping[str, Any] | None = None
    ) -> tuple[GuideMotion, bool]:
        if switch("whole", whole) or self.traced[0].cusp.any():
            return super().drawn_motion(samples, whole=whole, points=points)
        return self.motion(samples, points=points), False

    def run(self, *, whole: bool = False, points: Mapping[str, Any] | None = None) -> Run:
        if switch("whole", whole):
            return super().run(whole=True, points=points)
        told = places("points", points)
        return replace(self._run, points=told) if told else self._run

    @cached_property
    def _run(self) -> Run:
        """The motion over the stroke.

        For a point that returns, from one end of its path to the point of rest and back.
        """
        from ..guidance.circuit_curve import CircuitCurve
        from ..kinematics.circuits import circuits

        here, traced = self.traced
        found = circuits(self.linkage)[:1]
        if isinstance(here, CircuitCurve):  # a `CircuitCurve` runs from the start of the path to its end already
            low, high = (float(here.motion.middle[0] + end[0]) for end in (traced.low, traced.high))
            return Run(self, found, low, high)
        start = found if np.array_equal(here.linkage.pivots, found.linkage.pivots) else circuits(here.linkage)[:1]
        pose = here.motion.pose(np.stack([traced.low, traced.high]).astype(float))
        low, high = start.phases(pose)
        z = pose.point(here.point)[:, 0]
        backward = ((z[1] - z[0]) * self.frame.direction.conjugate()).real <= 0 and not here.cusp.any()
        return Run(self, found, *((high, low) if backward else (low, high)))

    def off_nominal(self, z: Complexes) -> Floats:
        """Compute signed distances of the path from the nominal, positive to the left.

        Parameters
        ----------
        z : complex ndarray, shape (m,)
            Positions x + iy of the guided point, from the start to the end of the stroke [length].

        Returns
        -------
        ndarray, shape (m,)
            Distances [length].

        Raises
        ------
        InvalidRequest
            If `z` is not a row of finite positions.
        """
        from ..guidance.deviation_curve import from_circle

        z = complexes("z", z)
        if z.ndim != 1 or not len(z):
            raise InvalidRequest(f"z must be places in a row, not {quoted(z)}")
        _, traced = self.traced
        fit = traced.fit
        if self.radius is None:
            side = 1.0 if (fit.along[0].conjugate() * self.frame.direction).real > 0 else -1.0
            return np.asarray(side * ((z - fit.start[0]) * fit.along[0].conjugate()).imag)
        if z[0] == z[-1]:
            raise InvalidRequest("z must run from one end of an arc to the other, which are one place here")
        return from_circle(z, (z[0], z[-1]), self.radius, max(self.deviation, 1e-18 * self.stroke))

    @cached_property
    def traced(self) -> tuple[CouplerCurve | CircuitCurve, Traced]:
        """Coupler curve and its measurements over the stroke; cached."""
        here, traced = self._traced()
        if not np.isfinite(traced.fit.deviation).all():
            raise InvalidRequest(f"the linkage does not lead its guided point over a stroke of {self.stroke:g}")
        return here, traced

    def _traced(self) -> tuple[CouplerCurve | CircuitCurve, Traced]:
        from ..guidance.placement import at_stroke
        from ..guidance.trace import retrace

        if self.is_wide and self.radius is not None and self.arc_angle is not None:
            return self._along_wide_arc(self.radius, self.arc_angle)
        here = self.span()
        traced = at_stroke(here, self.stroke, circle=self.radius is not None, extend=False)
        if self.radius is None or here.cusp.any() or not np.isfinite(traced.fit.deviation).all():
            return here, traced
        forward = (here.tangent * self.frame.direction.conjugate()).real > 0
        bend = np.where(forward, -1, 1) / self.radius  # the arc bulges to the left of its chord
        return here, retrace(here, traced, circle=True, nodes=SENSITIVITY.nodes, held=bend)

    def _along_wide_arc(self, radius: float, angle: float) -> tuple[CircuitCurve, Traced]:
        """Trace the guide along a wide arc on its circuit, from the middle of the arc."""
        from ..guidance.wide_arc import WIDE_ARC, along_circuits, traced_about

        here = along_circuits(self.linkage, np.array([complex(*self.guided)]))
        middle = 0.5 * self.stroke - 1j * radius * math.cos(math.radians(0.5 * angle))
        centre = np.array([self.frame.origin + self.frame.direction * middle])
        return here, traced_about(here, centre, np.array([radius]), angle, WIDE_ARC.shown, WIDE_ARC.most)

    def path(self, points: int = 101) -> Floats:
        """Compute points of the path over the stroke, spaced like the positions of `motion`.

        Parameters
        ----------
        points : int
            Number of points, 2 to 1,000,000.

        Returns
        -------
        ndarray, shape (points, 2)
            Coordinates x, y [length].
        """
        points = sampled(points)
        run = self.run()
        z = run.path(run.rows(points))
        return np.stack([z.real, z.imag], axis=-1)

    def sensitivity(self) -> Sensitivity:
        """Compute the first-order effect of pivot errors and joint play on the path.

        Returns
        -------
        Sensitivity
            Arrays with one entry.

        Raises
        ------
        InvalidRequest
            If the guided point returns: at rest the effect is not of first order.
        """
        here, traced = self.traced
        if here.cusp.any():
            raise InvalidRequest("the guided point returns: its sensitivity is not known")
        return sensitivity(here, traced)

    @cached_property
    def kept_share(self) -> float | None:
        """Fraction of 1000 simulated machines, scattered by the allowance, that keep the tolerance.

        None without an allowance, and at a change point.  See `guidance.drawn_machines`.
        """
        if self.allowance is None or self.allowance <= 0 or self.asked_deviation is None or self.fitted is None:
            return None
        from ..guidance.allowance import Zone
        from ..guidance.circuit_curve import CircuitCurve
        from ..guidance.coupler_curve import CouplerCurve
        from ..guidance.drawn_machines import kept_share, kept_share_over_arc
        from ..guidance.fixed_nominal import Nominal

        guides, traced = self.at_home().traced
        if self.is_wide and isinstance(guides, CircuitCurve) and self.arc_angle is not None:
            return kept_share_over_arc(guides, traced, self.arc_angle, self.allowance, self.asked_deviation)
        if self.pole is not None or not isinstance(guides, CouplerCurve):
            return None
        zone = Zone(self.radius is not None, self.fitted)
        nominal = Nominal(self.stroke, math.inf if self.radius is None else self.radius)
        return kept_share(guides, traced, nominal, zone, self.allowance, self.asked_deviation)

    @property
    def drift(self) -> float | None:
        """Least residual in the series of its start over the stroke: 0 for a member.

        None if not refined, or if the series has no residual.  Computed for all answers on first
        use, because it loads the plugins.
        """
        if self._drift is None:
            return None
        drifts, row = self._drift
        return known(drifts.least[row])

    @cached_property
    def lift(self) -> float | None:
        """Largest distance of the coupler curve from the line or circle over a full turn [length].

        None if the driving crank does not turn fully.
        """
        if self.driver not in self.rotates:
            return None
        from ..guidance.return_path import distance, peak

        run = self.run(whole=True)
        z = run.path(run.rows(LIFT_POSITIONS))[:-1, None]  # the last position is the first
        return float(peak(np.abs(distance(z, self.traced[1].fit)))[0])

    @property
    def is_wide(self) -> bool:
        """Whether the path is an arc near a half circle or beyond."""
        return self.arc_angle is not None

    @property
    def extent(self) -> float:
        """Extent of the nominal: stroke, beyond a half circle the diameter [length]."""
        return 2 * self.radius if self.radius is not None and (self.arc_angle or 0.0) > 180 else self.stroke

    @property
    def run_length(self) -> float:
        """Length of the deviation's axis in drawings: the stroke; the arc length of a wide arc."""
        if self.radius is None or self.arc_angle is None or not self.is_wide:
            return self.stroke
        return self.radius * math.radians(self.arc_angle)

    @property
    def band(self) -> float:
        """Width of the narrowest strip, twice the deviation [length]."""
        return 2 * self.deviation

    @property
    def percent(self) -> float:
        """Width of the narrowest strip over the stroke [%]."""
        return 100 * self.band / self.stroke

    def to_dict(self) -> dict[str, Any]:
        """Convert the candidate to plain numbers, lists and strings, with derived properties."""
        values = {name: getattr(self, name) for name in self.columns()}
        return {name: deepcopy(v) if isinstance(v, list | dict) else v for name, v in values.items()}

    @classmethod
    def columns(cls) -> list[str]:
        """List the names of the printed fields and properties."""
        return [*(f.name for f in fields(cls) if f.repr), *DERIVED]


Candidate.__doc__ = f"{Candidate.__doc__}\n{attributes(CANDIDATE, Candidate.columns())}"
#: Columns of the candidates of a `find`.
COLUMNS = tuple(Candidate.columns())


def digits(value: float | None, format: str = ".3g") -> str:
    """Format a number; a dash for None."""
    return "-" if value is None else f"{value:{format}}"


def known(value: float) -> float | None:
    """Return a finite number, or None."""
    return float(value) if math.isfinite(value) else None
