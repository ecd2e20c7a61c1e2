"""A named guide as the literature has it, beside the best that the catalogue has in its place."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..designs import Design
from .candidate import Candidate
from .constraints import Constraints
from .found import candidates
from .lay import laid
from .request import CircularArc, Request, StraightLine, positive

if TYPE_CHECKING:
    from ..facade import Catalogue
    from .stored import StoredGuide

#: A deviation below this part of the stroke is rounding: nothing can be straighter.
EXACT_DEVIATION = 1e-14


def as_published(design: Design, guide: StoredGuide, stroke: float = 1.0) -> Candidate:
    """Return a design over its usual stroke, the guided point not split, laid from (0, 0) to (stroke, 0).

    Parameters
    ----------
    design : Design
    guide : StoredGuide
        What the database holds of it.
    """
    stroke = positive("stroke", stroke)
    tags = {"id": guide.id, "family": guide.family, "series": guide.series, "configuration": guide.configuration}
    rows = {k: np.array([v]) for k, v in {**tags, "contact_order": guide.order}.items()}
    traced = design.traced
    request: Request = StraightLine(stroke, 0.09 * stroke)
    if design.circle:
        sweep = float(traced.fit.stroke[0] * abs(traced.fit.curvature[0]))
        request = CircularArc(stroke, stroke / sweep, 0.09 * stroke)
    answers, _ = laid(request, Constraints(), rows, design.guide, traced)
    return candidates(answers, request)[0]


def best_of_series(catalogue: Catalogue, published: Candidate) -> Candidate | None:
    """Return the straightest stored guide of the same series on the same stroke, no larger; None if none is straighter.

    Parameters
    ----------
    catalogue : Catalogue
    published : Candidate
        Of `as_published`.
    """
    if published.deviation <= EXACT_DEVIATION * published.stroke:
        return None
    size = published.size * (1 + 1e-9)
    found = catalogue.find(
        published.request, series=[published.series], max_size=size, rank_by="deviation", limit=1, per_series=0
    )
    return found[0] if len(found) else None
