"""Answers as a user sees them."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, overload

import numpy as np

from ..candidates.batch import CandidateBatch
from ..candidates.feasibility import machine, values
from ..candidates.similarity import nearest, normal_form
from ..guide.drive import drive_metrics
from ..guide.rotatability import min_transmission_turn
from ..guide.sensitivity import sensitivity
from ..kinematics.motion import CHANGE, conditioning
from ..kinematics.types import Array
from ..problem.problem import Problem
from ..problem.request import Request
from .candidate import COLUMNS, Candidate, known

if TYPE_CHECKING:
    import pandas as pd

    from ..refine.drift import Drifts
    from .explain import Explanation
    from .find import Selection


@dataclass(frozen=True, eq=False)
class Found(Sequence[Candidate]):
    """The answer to a request: candidates, best first."""

    candidates: list[Candidate]
    explanation: Explanation | None = field(repr=False, default=None)

    def __len__(self) -> int:
        return len(self.candidates)

    def __iter__(self) -> Iterator[Candidate]:
        return iter(self.candidates)

    @overload
    def __getitem__(self, index: int) -> Candidate: ...
    @overload
    def __getitem__(self, index: slice) -> list[Candidate]: ...
    def __getitem__(self, index: int | slice) -> Candidate | list[Candidate]:
        return self.candidates[index]

    def to_pandas(self) -> pd.DataFrame:
        """Return one row per candidate."""
        import pandas as pd

        return pd.DataFrame([c.to_dict() for c in self.candidates], columns=list(COLUMNS))

    def to_json(self) -> str:
        """Return a JSON list of the candidates."""
        return json.dumps([c.to_dict() for c in self.candidates], indent=1, allow_nan=False)

    def explain(self) -> str:
        """Say how the answer came about: what each constraint removed, what was loaded, how long each step took.

        For an empty answer: which constraint excluded the most, and how near the nearest miss is.
        """
        return "" if self.explanation is None else str(self.explanation)


def candidates(problem: Problem, request: Request, chosen: Selection, drifts: Drifts | None = None) -> list[Candidate]:
    """Return candidates one by one, in the user's unit and frame.

    Parameters
    ----------
    request : StraightLine or CircularArc
        That of the user.
    drifts : Drifts, optional
        Of the same candidates, if they are refined ones.
    """
    found, s = chosen.found, problem.stroke
    m, fit, guides, origin = found.measures, found.traced.fit, found.curve, found.origin
    works = drive_metrics(guides, found.traced, m, inverse=problem.constraints.slots)
    rms = np.where(guides.cusp, np.nan, sensitivity(guides, found.traced).rms)
    marks = problem.ranking.score(scored(problem, found, rms))
    allowance = (problem.deviation - found.deviation) / (2 * rms)
    near = nearest(normal_form(found.linkage.pivots, 1.0), mirror=problem.curvature == 0)
    change = conditioning(found.linkage).max(0) < CHANGE
    turn = min_transmission_turn(machine(problem, found), works.driver)
    placed = found.linkage.moved(problem.scale, problem.shift)
    point, pole = (problem.scale * z + problem.shift for z in (found.point, found.pole))
    seal, out = chosen.certificate, []
    for i in range(len(found)):
        pivots = np.where(placed.pivots[i] == 0, 0.0, placed.pivots[i])  # no -0.0
        deviation = s * float(fit.deviation[i])
        sealed = seal is not None and bool(np.isfinite(seal.gap[i]))
        out.append(
            Candidate(
                id=int(origin.id[i]) if origin.id[i] >= 0 else None,
                family=str(found.linkage.family[i]),
                series=str(origin.series[i]),
                configuration=str(origin.configuration[i]),
                order=int(origin.order[i]),
                stroke=float(request.stroke),
                deviation=deviation,
                radius=_radius(request, s, float(fit.curvature[i])),
                size=s * float(m.size[i]),
                max_link=known(s * m.max_link[i]),
                max_ground=known(s * m.max_ground[i]),
                max_arm=known(s * m.max_arm[i]),
                min_link=known(s * m.min_link[i]),
                min_transmission=float(m.min_transmission[i]),
                rotates=[k + 1 for k in (0, 1) if int(m.rotates[i]) >> k & 1],
                driver=int(works.driver[i]) or None,
                drive_angle=known(works.drive_angle[i]),
                time_ratio=known(works.time_ratio[i]),
                uniformity=known(works.uniformity[i]),
                advantage=known(works.advantage[i]),
                rotation=float(works.rotation[i]),
                min_transmission_turn=known(turn[i]),
                allowance=known(s * allowance[i]),
                sensitivity_rms=known(rms[i]),
                expected=known(deviation + 2 * s * problem.constraints.play * rms[i]),
                pivots=pivots.tolist(),
                guided=[float(point[i].real), float(point[i].imag)],
                score=known(marks[i]),
                front=int(chosen.front[i]) or None,
                nearest=known(near[i]),
                cognate=int(origin.cognate[i]) or None,
                gap=float(seal.gap[i]) if seal is not None and sealed else None,
                alternations=int(seal.alternations[i]) if seal is not None and sealed else None,
                pole=[float(pole[i].real), float(pole[i].imag)] if change[i] and np.isfinite(pole[i]) else None,
                start=[float(x) for x in request.start],
                along=float(request.along),
                _drift=(drifts, i) if drifts is not None else None,
            )
        )
    return out


def scored(problem: Problem, found: CandidateBatch, rms: Array) -> dict[str, Array]:
    """Return the values that a score is made of, the allowance among them."""
    with np.errstate(invalid="ignore"):
        allowance = np.nan_to_num((problem.deviation - found.deviation) / (2 * rms))
    return values(problem, found.with_(allowance=allowance))


def _radius(request: Request, stroke: float, curvature: float) -> float | None:
    if request.kind == "line":
        return None
    return float(request.radius) if request.radius is not None else stroke / abs(curvature)
