"""Answers as a user sees them, one and all."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, Self, TypeVar, overload

import numpy as np

from ..candidates.feasibility import values
from ..candidates.select import nearest, normal_form
from ..errors import InvalidRequest
from ..guidance.drive import drive_metrics
from ..guidance.metrics import min_transmission_turn
from ..guidance.sensitivity import sensitivity
from ..kinematics.batch import Rows
from ..kinematics.motion import CHANGE, conditioning
from ..kinematics.types import Array, Complexes, Floats
from ..problem.problem import Problem
from ..problem.request import CircularArc, Request, StraightLine, switch
from .placed import SAMPLES, GuideMotion, PlacedGuide, sampled

if TYPE_CHECKING:
    import pandas as pd

    from ..guidance.circuit_curve import CircuitCurve
    from ..guidance.coupler_curve import CouplerCurve
    from ..guidance.metrics import Measures
    from ..guidance.sensitivity import Sensitivity
    from ..guidance.trace import Traced
    from ..kinematics.linkage import Linkage
    from ..refine.certificate import Drifts
    from .find import Selection


class Printable(Protocol):
    """What is printed as a row of a table."""

    def to_dict(self) -> dict[str, Any]: ...


T = TypeVar("T", bound=Printable)

#: Answers that are shown of results.
SHOWN = 12
#: Properties of a candidate that are printed besides its fields.
DERIVED = ("drift", "band", "percent", "lengths")


@dataclass(frozen=True, repr=False)
class Candidate(PlacedGuide):
    """A verified guide, laid so that its path runs from (0, 0) to (stroke, 0); lengths in the user's unit.

    Attributes
    ----------
    id : int or None
        Of the stored guide it comes from; ``catalogue show ID`` shows it.  None if it was constructed for given pivots.
    family, series, configuration, order
        Of the ancestor at its design position; order of contact, 99 if it is exact.
    stroke, deviation : float
        Deviation: half the width of the narrowest strip (annulus) that holds the path over the stroke; with given
        pivots the largest distance from the nominal itself, which stays where it is (`catalogue.guidance.in_place`).
    radius : float or None
        Of the best circle; None for a straight line.
    size, max_link, min_link, max_ground, max_arm, min_transmission, rotates
        See `catalogue.guidance.metrics.Measures`; None where there is no such length.  `rotates`: numbers of cranks.
    driver, drive_angle, time_ratio, uniformity, advantage, rotation
        See `catalogue.guidance.drive.DriveMetrics`; None where there is no such thing.
    min_transmission_turn : float or None
        Least transmission angle over the whole turn of the driver [deg]; None if it does not turn fully.
    allowance : float or None
        Standard deviation of every pivot coordinate at which the path still stays within the deviation asked; None for
        a point that returns.
    sensitivity_rms, expected : float or None
        Standard deviation of the path's displacement across it, where it is largest, if every coordinate of every pivot
        is off by a standard deviation of 1; deviation plus two of them for the play that was asked for.  None for a
        point that returns.
    pivots, guided : list
        [[A1, A1*], [A2, A2*]], each [x, y, w], and the guided point, in mid-stroke; one that returns at rest.
    score : float or None
        Joint desirability of size, transmission, allowance and shortest link, 0 to 100; see
        `catalogue.problem.ranking.Ranking.score`.
    front : int or None
        Number of its Pareto front, 1 if no other answer is better by all criteria; None unless it was asked for.
    nearest : float or None
        How near the nearest other answer is as a design, 0 to 1; see `catalogue.candidates.select`.
    gap : float or None
        What moving the pivots by a hundredth of their distance from the guided point could at most still take away
        from what was ranked by, to first order (`catalogue.refine.certificate`); 0: it is stationary.  None if not
        refined, and for a point that returns.
    alternations : int or None
        Peaks of alternating sign at which the path reaches its deviation, ends included; with `gap`.
    cognate : int or None
        1, 2: it is a cognate of the stored guide, the one that shares its first or second fixed pivot.
    pole : list of float or None
        Given where the linkage is at a change point at that moment: the pole of the branch on which it moves.
    start, along
        Where the path starts, [x, y], and its direction from there [deg].
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
    min_link: float | None = None
    min_transmission_turn: float | None = None
    allowance: float | None = None
    sensitivity_rms: float | None = None
    expected: float | None = None
    score: float | None = None
    front: int | None = None
    nearest: float | None = None
    gap: float | None = None
    alternations: int | None = None
    cognate: int | None = None
    pole: list[float] | None = None
    start: list[float] = field(default_factory=lambda: [0.0, 0.0])
    along: float = 0.0
    _drift: tuple[Drifts, int] | None = field(default=None, repr=False, compare=False)

    @property
    def request(self) -> Request:
        """The nominal that this candidate follows, with its own deviation as tolerance."""
        tolerance = max(self.deviation, 1e-300)
        start = (self.start[0], self.start[1])
        if self.radius is None:
            return StraightLine(self.stroke, tolerance, start, self.along)
        return CircularArc(self.stroke, tolerance, self.radius, start, self.along)

    def __repr__(self) -> str:
        kind = " ".join(part for part in (self.series, self.family, self.configuration) if part)
        arc = "" if self.radius is None else f", radius {self.radius:.6g}"
        return (
            f"<{type(self).__name__} {kind}: stroke {self.stroke:.6g}{arc}, deviation {self.deviation:.3g}, "
            f"size {self.size:.4g}, transmission {self.min_transmission:.0f}\u00b0>"
        )

    def at_home(self) -> Candidate:
        """Return the same candidate in the frame in which its path runs from (0, 0) to (stroke, 0)."""
        if self.along == 0 and self.start == [0.0, 0.0]:
            return self
        turn, origin = self.request.direction.conjugate(), self.request.origin

        def carried(x: float, y: float, w: float = 1.0) -> list[float]:
            z = turn * (complex(x, y) - (origin if w else 0))
            return [z.real, z.imag]

        pivots = [[[*carried(x, y, w), w] for x, y, w in pair] for pair in self.pivots]
        x, y = self.guided
        pole = None if self.pole is None else carried(self.pole[0], self.pole[1])
        return replace(self, pivots=pivots, guided=carried(x, y), pole=pole, start=[0.0, 0.0], along=0.0)

    def span(self) -> CouplerCurve:
        """Return the guide ready to be traced from mid-stroke."""
        from ..guidance.coupler_curve import coupler_curve

        pole = None if self.pole is None else np.array([complex(*self.pole)])
        return coupler_curve(self.linkage, np.array([complex(*self.guided)]), pole=pole)

    def motion(
        self,
        samples: int = SAMPLES,
        *,
        points: Mapping[str, Any] | None = None,
        driver: int | None = None,
        whole: bool = False,
    ) -> GuideMotion:
        """Return the motion over the stroke, from the start of the path to its end; `whole`: over the whole circuit.

        Raises
        ------
        InvalidRequest
            As of `PlacedGuide.motion`; and if the guided point returns, over the stroke.
        """
        driver = self.driver if driver is None else driver
        if switch("whole", whole):
            return super().motion(samples, points=points, driver=driver)
        from ..kinematics.circuits import circuits

        s = np.linspace(*self._phases(), sampled(samples))[:, None]
        moved = GuideMotion.of(self, circuits(self.linkage)[:1], s, points, driver)
        return replace(moved, deviation=self.off_nominal(moved.points["guided"]))

    def _phases(self) -> tuple[float, float]:
        """Return the phases, see `kinematics.circuits`, between which the point runs from the start of its path to the
        end."""
        from ..kinematics.circuits import circuits

        here, traced = self._traced()
        if here.cusp.any():
            raise InvalidRequest("the guided point returns: ask for the motion over the whole circuit")
        pose = here.motion.pose(np.stack([traced.low, traced.high]).astype(float))
        phases = circuits(here.linkage)[:1].phases(pose)
        z = pose.point(here.point)[:, 0]
        forward = ((z[1] - z[0]) * self.request.direction.conjugate()).real > 0
        return (phases[0], phases[1]) if forward else (phases[1], phases[0])

    def off_nominal(self, z: Complexes) -> Floats:
        """Return the distances of places of the guided point (m,), from the start to the end of its stroke, from the
        nominal, positive to the left."""
        from ..guidance.deviation_curve import from_circle

        _, traced = self._traced()
        fit = traced.fit
        if self.radius is None:
            side = 1.0 if (fit.along[0].conjugate() * self.request.direction).real > 0 else -1.0
            return np.asarray(side * ((z - fit.start[0]) * fit.along[0].conjugate()).imag)
        return from_circle(z, (z[0], z[-1]), self.radius, max(self.deviation, 1e-18 * self.stroke))

    def _traced(self) -> tuple[CouplerCurve | CircuitCurve, Traced]:
        from ..guidance.placement import at_stroke

        here = self.span()
        return here, at_stroke(here, self.stroke, circle=self.radius is not None, extend=False)

    def path(self, points: int = 101) -> Floats:
        """Return points of the guided path over the stroke, shape (points, 2)."""
        here, traced = self._traced()
        share = np.linspace(-1, 1, points)
        u, v = here.path.window(traced.low.astype(float), traced.high.astype(float), share)
        z = here.point + (u + 1j * v)[:, 0] * here.tangent
        z = z if ((z[-1] - z[0]) * self.request.direction.conjugate()).real > 0 else z[::-1]
        return np.stack([z.real, z.imag], axis=-1)

    def sensitivity(self) -> Sensitivity:
        """Return what errors of the pivots and play in the joints do to the path; arrays of one entry.

        Raises
        ------
        InvalidRequest
            If the guided point returns: at its rest it follows no error to first order.
        """
        here, traced = self._traced()
        if here.cusp.any():
            raise InvalidRequest("the guided point returns: its sensitivity is not known")
        return sensitivity(here, traced)

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

    def to_dict(self) -> dict[str, Any]:
        """Return the candidate as plain Python numbers, lists and strings, what is derived included."""
        return {name: deepcopy(getattr(self, name)) for name in self.columns()}

    @classmethod
    def columns(cls) -> list[str]:
        """Names of what a candidate is printed as."""
        return [*(f.name for f in fields(cls) if f.repr), *DERIVED]

    def plot(self, file: str | Path | None = None) -> Any:
        """Draw the linkage in mid-stroke with ghosts at the ends, its path and the deviation.

        Parameters
        ----------
        file : path, optional
            PNG, SVG or PDF by its suffix.  The same candidate gives the same file.

        Returns
        -------
        matplotlib.figure.Figure
            Of its own: pyplot does not know it, and no display is needed.

        Raises
        ------
        InvalidRequest
            If the suffix is none of these, the folder does not exist or cannot be written, or the linkage does not lead
            its guided point over the whole stroke.
        MissingExtra
            Without matplotlib: ``pip install "mechanism-catalogue[plot]"``.
        """
        from ..draw import draw

        return draw(self, file)


#: What a candidate of a `find` is printed as.
COLUMNS = tuple(Candidate.columns())


def known(value: float) -> float | None:
    """Return a finite number, None for another."""
    return float(value) if math.isfinite(value) else None


@dataclass(frozen=True, eq=False, repr=False)
class Results(Sequence[T]):
    """Answers of one kind, best first; `explanation` is told as its text, made when it is asked for.

    The classes made of this one say as what `columns` a candidate is printed.
    """

    candidates: list[T]
    explanation: Any = field(repr=False, default="")

    def __len__(self) -> int:
        return len(self.candidates)

    def __repr__(self) -> str:
        rows = [f"  {i}: {one!r}" for i, one in enumerate(self.candidates[:SHOWN])]
        more = [f"  ... {len(self) - SHOWN} more"] * (len(self) > SHOWN)
        return "\n".join([f"<{type(self).__name__} of {len(self)}>", *rows, *more])

    @overload
    def __getitem__(self, index: int) -> T: ...
    @overload
    def __getitem__(self, index: slice) -> Self: ...
    def __getitem__(self, index: int | slice) -> T | Self:
        if isinstance(index, slice):
            return replace(self, candidates=self.candidates[index])
        return self.candidates[index]

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and self.candidates == other.candidates

    __hash__ = None  # type: ignore[assignment]

    @property
    def columns(self) -> list[str]:
        """Names of what each candidate is printed as."""
        raise NotImplementedError

    def to_pandas(self) -> pd.DataFrame:
        """Return one row per candidate."""
        import pandas as pd

        return pd.DataFrame([c.to_dict() for c in self.candidates], columns=self.columns)

    def to_json(self) -> str:
        """Return a JSON list of the candidates."""
        return json.dumps([c.to_dict() for c in self.candidates], indent=1, allow_nan=False)

    def remember(self) -> list[str]:
        """Keep the candidates, and return a short code of each by which `catalogue.recall` finds it again, in another
        process too.

        Raises
        ------
        InvalidRequest
            If the file of answers cannot be written.
        """
        from .answers import remember

        return remember(self.candidates)

    def save(self, file: str | Path) -> None:
        """Write the candidates to a JSON file, which `catalogue.load` reads on any machine.

        Raises
        ------
        InvalidRequest
            If it cannot be written.
        """
        from .answers import save

        save(self.candidates, file)

    def explain(self) -> str:
        """Say how the answer came about: what each constraint removed, how long it took.

        For an empty answer: which constraint excluded the most, and how near the nearest miss is.
        """
        return str(self.explanation)


@dataclass(frozen=True, eq=False, repr=False)
class Found(Results[Candidate]):
    """The answer to a request: candidates, best first."""

    @property
    def columns(self) -> list[str]:
        return list(COLUMNS)


@dataclass(frozen=True)
class Frames(Rows):
    """Where n guides stand in the user's unit and frame: their paths from `start` on, complex, over a `stroke` in the
    direction `along` [deg]; arrays of shape (n,)."""

    stroke: Floats
    start: Complexes
    along: Floats
    direction: Complexes  # unit vector

    @classmethod
    def of(cls, request: Request, n: int) -> Frames:
        """Return the frame of a request, n times."""
        place = (float(request.stroke), complex(request.origin), float(request.along), complex(request.direction))
        return cls(*(np.full(n, value) for value in place))


def candidates(problem: Problem, request: Request, chosen: Selection, drifts: Drifts | None = None) -> list[Candidate]:
    """Return candidates one by one in the unit and the frame of the user's request, with the drifts of refined ones."""
    found, frames = chosen.found, Frames.of(request, len(chosen.found))
    slots = problem.constraints.slots
    columns = measured_columns(found.curve, found.traced, found.measures, frames, slots=slots)
    rms, seal, n = columns["sensitivity_rms"], chosen.certificate, len(found)
    allowance = (problem.deviation - found.deviation) / (2 * rms)
    gap = np.full(n, np.nan) if seal is None else seal.gap
    columns |= {
        "radius": columns["radius"] if request.radius is None else np.full(n, request.radius),
        "allowance": problem.stroke * allowance,
        "expected": columns["deviation"] + 2 * problem.stroke * problem.constraints.play * rms,
        "score": problem.ranking.score(values(problem, replace(found, allowance=np.nan_to_num(allowance)))),
        "nearest": nearest(normal_form(found.linkage.pivots, 1.0), mirror=problem.curvature == 0),
        "gap": gap,
        **{name: getattr(found.origin, name) for name in ("family", "series", "configuration", "order")},
        "id": np.where(found.origin.id >= 0, found.origin.id, np.nan),
        "cognate": np.where(found.origin.cognate > 0, found.origin.cognate, np.nan),
        "front": np.where(chosen.front > 0, chosen.front, np.nan),
        "alternations": np.full(n, np.nan) if seal is None else np.where(np.isfinite(gap), seal.alternations, np.nan),
    }
    more = [{"_drift": (drifts, i)} for i in range(n)] if drifts is not None else None
    return listed(Candidate, found.linkage, found.point, found.pole, frames, columns, more)


def measured_columns(
    guides: CouplerCurve | CircuitCurve, traced: Traced, measures: Measures, frames: Frames, *, slots: bool = False
) -> dict[str, Array]:
    """Return what is measured of guides laid from 0 to 1, by the names of fields of `Candidate` [the user's unit]."""
    s = frames.stroke
    works = drive_metrics(guides, traced, measures, inverse=slots)
    machines = guides.linkage.inverted() if slots else guides.linkage
    rotates = measures.rotates
    turning = np.empty(len(s), object)
    turning[:] = [[k + 1 for k in (0, 1) if int(bits) >> k & 1] for bits in rotates]
    with np.errstate(divide="ignore"):
        radius = s / np.abs(traced.fit.curvature.astype(float))
    return {
        "stroke": s,
        "deviation": s * traced.fit.deviation.astype(float),
        "radius": radius,
        "size": s * measures.size,
        "min_transmission": measures.min_transmission,
        **{name: s * getattr(measures, name) for name in ("max_link", "max_ground", "max_arm", "min_link")},
        **{name: getattr(works, name) for name in ("drive_angle", "time_ratio", "uniformity", "advantage", "rotation")},
        "driver": np.where(works.driver > 0, works.driver, np.nan),
        "min_transmission_turn": min_transmission_turn(machines, works.driver),
        "sensitivity_rms": np.where(guides.cusp, np.nan, sensitivity(guides, traced).rms),
        "rotates": turning,
        "along": frames.along,
    }


#: Fields that are whole numbers.
WHOLE = ("id", "order", "driver", "front", "cognate", "alternations", "circuit", "number")
C = TypeVar("C", bound=Candidate)


def listed(
    make: type[C], linkage: Linkage, point: Complexes, pole: Complexes, frames: Frames, columns: Mapping[str, Array],
    more: Sequence[Mapping[str, Any]] | None = None,
) -> list[C]:  # fmt: skip
    """Return candidates one by one: linkages laid from 0 to 1 carried to where they stand, columns (n,), of whose
    numbers those that are not finite become None, and what else there is of each."""
    scale = frames.stroke * frames.direction
    pivots = linkage.moved(scale, frames.start).pivots
    z, poles = (scale * part + frames.start for part in (point, pole))
    change = (conditioning(linkage).max(0) < CHANGE) & np.isfinite(poles)
    rows = zip(*(_plain(name, values) for name, values in columns.items()), strict=True)
    placed = np.where(pivots == 0, 0.0, pivots).tolist()  # no -0.0
    return [
        make(
            **dict(zip(columns, row, strict=True)),
            pivots=placed[i],
            guided=[float(z[i].real), float(z[i].imag)],
            pole=[float(poles[i].real), float(poles[i].imag)] if change[i] else None,
            start=[float(frames.start[i].real), float(frames.start[i].imag)],
            **({} if more is None else more[i]),
        )
        for i, row in enumerate(rows)
    ]


def _plain(name: str, values: Array) -> list[Any]:
    """Return values as plain Python ones; None for numbers that are not finite."""
    if values.dtype.kind not in "fiu":
        return [str(v) if isinstance(v, str) else v for v in values.tolist()]
    kind = int if name in WHOLE else float
    return [kind(v) if math.isfinite(v) else None for v in values.tolist()]
