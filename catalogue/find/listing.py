"""Make the candidates of a result from a batch."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from ..candidates.batch import with_allowance
from ..candidates.feasibility import values
from ..candidates.select import nearest, normal_form
from ..guidance.drive import drive_metrics
from ..guidance.metrics import min_transmission_turn
from ..guidance.sensitivity import sensitivity
from ..guides.candidate import Candidate
from ..kinematics.batch import Rows
from ..kinematics.motion import CHANGE, conditioning
from ..kinematics.types import Array, Complexes, Floats
from ..problem.path import PathRequest
from ..problem.problem import Problem
from ..quantities import DRIVE_METRICS, MEASURES, QUANTITIES
from ..units import LENGTH

if TYPE_CHECKING:
    from ..guidance.circuit_curve import CircuitCurve
    from ..guidance.coupler_curve import CouplerCurve
    from ..guidance.metrics import Measures
    from ..guidance.trace import Traced
    from ..kinematics.linkage import Linkage
    from ..refine.certificate import Drifts
    from .find import Selection


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
    rows = zip(*(_to_plain_values(name, values) for name, values in columns.items()), strict=True)
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


def _to_plain_values(name: str, values: Array) -> list[Any]:
    """Convert values to plain Python ones; None for numbers that are not finite."""
    if values.dtype.kind not in "fiu":
        return [str(v) if isinstance(v, str) else v for v in values.tolist()]
    kind = int if name in INTEGER_FIELDS else float
    return [kind(v) if math.isfinite(v) else None for v in values.tolist()]
