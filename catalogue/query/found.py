"""Answers as a user sees them."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, overload

import numpy as np

from ..motion import CHANGE, conditioning
from .candidate import COLUMNS, Candidate, known
from .likeness import nearest
from .ranking import forms, score
from .request import Request

if TYPE_CHECKING:
    import pandas as pd

    from ..refine.drift import Drifts
    from .lay import Answers


@dataclass(frozen=True, eq=False)
class Found(Sequence[Candidate]):
    """The answer to a request: candidates, best first."""

    candidates: list[Candidate]
    explanation: Callable[[], str] = field(repr=False, default=lambda: "")

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
        return self.explanation()


def candidates(answers: Answers, request: Request, play: float = 0.0, drifts: Drifts | None = None) -> list[Candidate]:
    """Return the answers one by one.

    Parameters
    ----------
    play : float
        Standard deviation of every coordinate of every pivot.
    drifts : Drifts, optional
        Of the same answers, if they are refined ones.
    """
    from ..guide.practice import practice
    from ..guide.span import span
    from ..refine.sensitivity import sensitivity

    rows, m, fit, out = answers.rows, answers.measures, answers.traced.fit, []
    guides = span(answers.linkage, answers.point, pole=answers.pole)
    works = practice(guides, answers.traced, m)
    strays = np.where(guides.cusp, np.nan, sensitivity(guides, answers.traced).rms)
    sealed = np.isfinite(rows["gap"]) if "gap" in rows else np.zeros(len(answers.point), bool)
    marks = score(answers, request)
    near = nearest(forms(answers, request), mirror=request.kind == "line")
    change = conditioning(answers.linkage).max(0) < CHANGE
    for i, point in enumerate(answers.point):
        pivots = np.where(answers.linkage.pivots[i] == 0, 0.0, answers.linkage.pivots[i])  # no -0.0
        deviation, curved = float(fit.deviation[i]), request.kind == "circle"
        out.append(
            Candidate(
                id=int(rows["id"][i]) if rows["id"][i] >= 0 else None,
                family=str(rows["family"][i]),
                series=str(rows["series"][i]),
                configuration=str(rows["configuration"][i]),
                order=int(rows["contact_order"][i]),
                stroke=float(request.stroke),
                deviation=deviation,
                radius=float(1 / abs(fit.curvature[i])) if curved else None,
                size=float(m.size[i]),
                max_link=known(m.max_link[i]),
                max_ground=known(m.max_ground[i]),
                max_arm=known(m.max_arm[i]),
                min_transmission=float(m.min_transmission[i]),
                rotates=[k + 1 for k in (0, 1) if int(m.rotates[i]) >> k & 1],
                driver=int(works.driver[i]) or None,
                drive_angle=known(works.drive_angle[i]),
                time_ratio=known(works.time_ratio[i]),
                uniformity=known(works.uniformity[i]),
                advantage=known(works.advantage[i]),
                rotation=float(works.rotation[i]),
                sensitivity_rms=known(strays[i]),
                expected=known(deviation + 2 * play * strays[i]),
                pivots=pivots.tolist(),
                guided=[float(point.real), float(point.imag)],
                score=known(marks[i]),
                front=int(rows["front"][i]) if "front" in rows else None,
                nearest=known(near[i]),
                cognate=int(rows["cognate"][i]) or None if "cognate" in rows else None,
                unrefined=float(rows["unrefined"][i]) if "unrefined" in rows else None,
                gap=float(rows["gap"][i]) if sealed[i] else None,
                alternations=int(rows["alternations"][i]) if sealed[i] else None,
                pole=[float(answers.pole[i].real), float(answers.pole[i].imag)] if change[i] else None,
                _drift=(drifts, i) if drifts is not None else None,
            )
        )
    return out
