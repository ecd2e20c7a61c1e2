"""Lists of answers, and their construction from a batch of candidates."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, Self, TypeVar, overload

import numpy as np

from ..candidates.batch import with_allowance
from ..candidates.feasibility import values
from ..candidates.select import nearest, normal_form
from ..guidance.drive import drive_metrics
from ..guidance.metrics import min_transmission_turn
from ..guidance.sensitivity import sensitivity
from ..kinematics.batch import Rows
from ..kinematics.motion import CHANGE, conditioning
from ..kinematics.types import Array, Complexes, Floats
from ..problem.path import PathRequest
from ..problem.problem import Problem
from ..quantities import DRIVE_METRICS, MEASURES, QUANTITIES
from ..units import LENGTH
from .candidate import COLUMNS, Candidate

if TYPE_CHECKING:
    import pandas as pd

    from ..guidance.circuit_curve import CircuitCurve
    from ..guidance.coupler_curve import CouplerCurve
    from ..guidance.metrics import Measures
    from ..guidance.trace import Traced
    from ..kinematics.linkage import Linkage
    from ..problem.problem import Request
    from ..refine.certificate import Drifts
    from .find import Selection


class Printable(Protocol):
    """An answer that can be printed as a row of a table."""

    def to_dict(self) -> dict[str, Any]: ...


T = TypeVar("T", bound=Printable)

#: Number of answers in the repr: a screen.
SHOWN = 12


@dataclass(frozen=True, eq=False, repr=False)
class Results(Sequence[T]):
    """A sequence of answers of one kind, best first; subclasses define the printed `columns`.

    Attributes
    ----------
    candidates : list
    explanation : object
        Its text explains the result; computed when printed.
    """

    candidates: list[T]
    explanation: Any = field(repr=False, default="")

    def __len__(self) -> int:
        return len(self.candidates)

    def __repr__(self) -> str:
        rows = [f"  {i}: {one!r}" for i, one in enumerate(self.candidates[:SHOWN])]
        more = [f"  ... {len(self) - SHOWN} more"] * (len(self) > SHOWN)
        return "\n".join([f"<{type(self).__name__} of {len(self)}>", *rows, *more])

    def _repr_html_(self) -> str:
        """Return animated cards and a table for a notebook; for an empty result its explanation."""
        from ..draw.cards import cards_html
        from ..markup import element

        if not self.candidates:
            return element("pre", self.explain())
        return cards_html(self.candidates, f"{type(self).__name__} of {len(self)}")

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

    __hash__ = None  # type: ignore[assignment]  # equality without a hash: a list is inside

    @property
    def columns(self) -> list[str]:
        """Names of the printed fields."""
        raise NotImplementedError

    def to_pandas(self) -> pd.DataFrame:
        """Convert to a data frame, one row per candidate."""
        import pandas as pd

        return pd.DataFrame([c.to_dict() for c in self.candidates], columns=self.columns)

    def to_json(self) -> str:
        """Convert to a JSON list of candidates."""
        return json.dumps([c.to_dict() for c in self.candidates], indent=1, allow_nan=False)

    def remember(self) -> list[str]:
        """Store the candidates and return their codes, for `catalogue.recall` and all commands.

        Returns
        -------
        list of str

        Raises
        ------
        InvalidRequest
            If the file of answers cannot be written.
        """
        from .answers import remember

        return remember(self.candidates)

    def save(self, file: str | Path) -> None:
        """Write the candidates to a JSON file, for `catalogue.load` on any machine.

        Parameters
        ----------
        file : path

        Raises
        ------
        InvalidRequest
            If the file cannot be written.
        """
        from .answers import save

        save(self, file)

    def explain(self) -> str:
        """Explain the result: candidates examined, constraints violated, times.

        For an empty result: which constraints to relax, to which values.
        """
        return str(self.explanation)


@dataclass(frozen=True, eq=False, repr=False)
class Found(Results[Candidate]):
    """Answers to a request, best first.

    Attributes
    ----------
    request : Request or None
        The request that they answer.
    cost : float or None
        Cost of the best answer, which the ranking minimises.

    Examples
    --------
    >>> from catalogue import StraightLine
    >>> found = cat.find(StraightLine(stroke=150, deviation=0.5), limit=3)
    >>> len(found), list(found.to_pandas().columns[:3])
    (3, ['id', 'family', 'series'])
    >>> cat.find(found.request) == found
    True
    """

    request: Request | None = field(repr=False, default=None)
    cost: float | None = field(repr=False, default=None)

    @property
    def columns(self) -> list[str]:
        return list(COLUMNS)


@dataclass(frozen=True)
class Frames(Rows):
    """Frames of n guides in the user's unit; arrays of shape (n,).

    Attributes
    ----------
    start : complex ndarray
        Start of the path [length].
    along : ndarray
        Direction of the path [deg].
    extent : ndarray
        Unit of normalised lengths: stroke or diameter [length].
    """

    extent: Floats
    start: Complexes
    along: Floats
    direction: Complexes  # unit vector

    @classmethod
    def of(cls, request: PathRequest, n: int) -> Frames:
        """Repeat the frame of a request n times."""
        place = (float(request.extent), complex(request.origin), float(request.along), complex(request.direction))
        return cls(*(np.full(n, value) for value in place))


def candidates(
    problem: Problem, request: PathRequest, chosen: Selection, drifts: Drifts | None = None
) -> list[Candidate]:
    """Build candidates in the unit and frame of the request, with the drifts of refined ones."""
    found, frames = chosen.found, Frames.of(request, len(chosen.found))
    slots = problem.constraints.slots
    found, certificate, n = with_allowance(problem, found), chosen.certificate, len(found)
    columns = measured_columns(found.curve, found.traced, found.measures, frames, slots=slots)
    gap = np.full(n, np.nan) if certificate is None else certificate.gap
    columns |= {
        "stroke": np.full(n, float(request.stroke)),
        **({"arc_angle": np.full(n, float(request.angle))} if request.is_wide and request.angle else {}),
        "radius": columns["radius"] if request.radius is None else np.full(n, request.radius),
        "allowance": problem.stroke * found.allowance,
        "expected": problem.stroke * found.expected,
        "asked_deviation": np.full(n, request.deviation),
        "fitted": np.full(n, problem.zone[1]),
        "score": problem.ranking.score(values(problem, found)),
        "nearest": nearest(normal_form(found.linkage.pivots, 1.0), mirror=problem.curvature == 0),
        "gap": gap,
        **{name: getattr(found.origin, name) for name in ("family", "series", "configuration", "order")},
        "id": np.where(found.origin.id >= 0, found.origin.id, np.nan),
        "cognate": np.where(found.origin.cognate > 0, found.origin.cognate, np.nan),
        "unit": np.full(n, request.unit, object),
        "front": np.where(chosen.front > 0, chosen.front, np.nan),
        "alternations": np.full(n, np.nan)
        if certificate is None
        else np.where(np.isfinite(gap), certificate.alternations, np.nan),
    }
    more = [{"_drift": (drifts, i)} for i in range(n)] if drifts is not None else None
    return listed(Candidate, found.linkage, found.point, found.pole, frames, columns, more)


def measured_columns(
    guides: CouplerCurve | CircuitCurve, traced: Traced, measures: Measures, frames: Frames, *, slots: bool = False
) -> dict[str, Array]:
    """Collect measurements of normalised guides by fields of `Candidate` [length]."""
    s = frames.extent
    works = drive_metrics(guides, traced, measures, inverse=slots)
    of: Mapping[str, Any] = {MEASURES: measures, DRIVE_METRICS: works}
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
        **{
            row.name: getattr(of[row.source], row.name) * (s if row.unit == LENGTH else 1.0)
            for row in QUANTITIES
            if row.source in of
        },
        "driver": np.where(works.driver > 0, works.driver, np.nan),
        "min_transmission_turn": min_transmission_turn(machines, works.driver),
        "sensitivity_rms": np.where(guides.cusp, np.nan, sensitivity(guides, traced).rms),
        "rotates": turning,
        "along": frames.along,
    }


#: Integer fields.
INTEGER_FIELDS = ("id", "order", "fitted", "driver", "front", "cognate", "alternations", "circuit", "number")
C = TypeVar("C", bound=Candidate)


def listed(
    make: type[C],
    linkage: Linkage,
    point: Complexes,
    pole: Complexes,
    frames: Frames,
    columns: Mapping[str, Array],
    more: Sequence[Mapping[str, Any]] | None = None,
) -> list[C]:
    """Build candidates from normalised linkages and columns.

    Parameters
    ----------
    make : type
        Class of the candidates.
    linkage : Linkage
        n linkages with their paths from 0 to 1 [strokes].
    point, pole : complex ndarray, shape (n,)
        Guided points and poles [strokes].
    frames : Frames
        Frames to move them to.
    columns : mapping of str to ndarray, shape (n,)
        Values of fields; None replaces numbers that are not finite.
    more : sequence of mapping, optional
        Further fields of each candidate.
    """
    scale = frames.extent * frames.direction
    pivots = linkage.moved(scale, frames.start).pivots
    z, poles = (scale * part + frames.start for part in (point, pole))
    change = np.isfinite(poles)
    if change.any():
        change[change] = conditioning(linkage[change]).max(0) < CHANGE
    rows = zip(*(_plain(name, values) for name, values in columns.items()), strict=True)
    placed = np.where(pivots == 0, 0.0, pivots).tolist()  # replaces -0.0
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
    """Convert values to plain Python ones; None for numbers that are not finite."""
    if values.dtype.kind not in "fiu":
        return [str(v) if isinstance(v, str) else v for v in values.tolist()]
    kind = int if name in INTEGER_FIELDS else float
    return [kind(v) if math.isfinite(v) else None for v in values.tolist()]
