"""The answers to a request together, and how they are made of a batch."""

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
from ..problem.problem import Problem
from ..problem.request import Request
from .candidate import COLUMNS, Candidate

if TYPE_CHECKING:
    import pandas as pd

    from ..guidance.circuit_curve import CircuitCurve
    from ..guidance.coupler_curve import CouplerCurve
    from ..guidance.metrics import Measures
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

    def _repr_html_(self) -> str:
        """What a notebook shows: cards that move, a table behind; of no answers why there are none."""
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
        """Say how the answer came about: what was looked at, how much of it broke which constraint, how long it took.

        For an empty answer: what to relax, and how far.
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
    """Where n guides stand in the user's unit and frame: their paths from `start` on, complex, in the direction `along`
    [deg], and the `extent` in which their lengths are told, that is their stroke or diameter; arrays of shape (n,)."""

    extent: Floats
    start: Complexes
    along: Floats
    direction: Complexes  # unit vector

    @classmethod
    def of(cls, request: Request, n: int) -> Frames:
        """Return the frame of a request, n times."""
        place = (float(request.extent), complex(request.origin), float(request.along), complex(request.direction))
        return cls(*(np.full(n, value) for value in place))


def candidates(problem: Problem, request: Request, chosen: Selection, drifts: Drifts | None = None) -> list[Candidate]:
    """Return candidates one by one in the unit and the frame of the user's request, with the drifts of refined ones."""
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
    """Return what is measured of guides laid from 0 to 1, by the names of fields of `Candidate` [the user's unit]."""
    s = frames.extent
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
        **{name: s * getattr(measures, name) for name in ("max_link", "max_ground", "max_arm", "travel", "min_link")},
        **{name: getattr(works, name) for name in ("drive_angle", "time_ratio", "uniformity", "advantage", "rotation")},
        "driver": np.where(works.driver > 0, works.driver, np.nan),
        "min_transmission_turn": min_transmission_turn(machines, works.driver),
        "sensitivity_rms": np.where(guides.cusp, np.nan, sensitivity(guides, traced).rms),
        "rotates": turning,
        "along": frames.along,
    }


#: Fields that are whole numbers.
WHOLE = ("id", "order", "fitted", "driver", "front", "cognate", "alternations", "circuit", "number")
C = TypeVar("C", bound=Candidate)


def listed(
    make: type[C], linkage: Linkage, point: Complexes, pole: Complexes, frames: Frames, columns: Mapping[str, Array],
    more: Sequence[Mapping[str, Any]] | None = None,
) -> list[C]:  # fmt: skip
    """Return candidates one by one: linkages laid from 0 to 1 carried to where they stand, columns (n,), of whose
    numbers those that are not finite become None, and what else there is of each."""
    scale = frames.extent * frames.direction
    pivots = linkage.moved(scale, frames.start).pivots
    z, poles = (scale * part + frames.start for part in (point, pole))
    change = np.isfinite(poles)
    if change.any():
        change[change] = conditioning(linkage[change]).max(0) < CHANGE
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
