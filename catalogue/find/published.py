"""A named guide as the literature has it, beside the best that the catalogue has in its place."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..candidates.batch import Origin
from ..candidates.placement import measured, place_on_path
from ..problem.request import CircularArc, Request, StraightLine, positive
from ..series.named_guides import NamedGuide
from .results import Candidate
from .stored import StoredGuide, laid

if TYPE_CHECKING:
    from ..api import Catalogue

#: A deviation below this part of the stroke is rounding: nothing can be straighter.
EXACT_DEVIATION = 1e-14


def as_published(design: NamedGuide, guide: StoredGuide, stroke: float = 1.0) -> Candidate:
    """Return a design, of which the database holds `guide`, over its usual stroke, the guided point not split, laid
    from (0, 0) to (stroke, 0)."""
    stroke = positive("stroke", stroke)
    tags = (guide.id, guide.family, guide.series, guide.configuration, guide.order, 0)
    traced = design.traced
    request: Request = StraightLine(stroke, 0.09 * stroke)
    if design.circle:
        request = CircularArc(stroke, None, 0.09 * stroke)
    origin = Origin(*(np.array([tag]) for tag in tags))
    bend = -np.abs(traced.fit.curvature) * traced.fit.stroke
    return laid(request, lambda problem: measured(problem, origin, *place_on_path(problem, design.guide, traced), bend))


def best_of_series(catalogue: Catalogue, published: Candidate) -> Candidate | None:
    """Return the straightest stored guide of the series of a design `as_published`, on the same stroke and no larger;
    None if none is straighter."""
    if published.deviation <= EXACT_DEVIATION * published.stroke:
        return None
    size = published.size * (1 + 1e-9)
    found = catalogue.find(
        published.request, series=[published.series], max_size=size, rank_by="deviation", limit=1, per_series=0
    )
    return found[0] if len(found) else None
