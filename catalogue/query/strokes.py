"""Which stroke of a stored guide serves a request best.

A stored guide may be used over any part of its path, and the similarity that carries that part onto the stroke asked
for sets its size: a longer part makes it smaller and less straight.  Each attempt is a way to choose it; the first
whose answer meets all constraints counts.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from ..guide.reach import USABLE, Ladder, reach
from ..guide.span import Span
from ..guide.sweep import at_sweep
from ..guide.trace import Traced, trace
from ..linkage import Array
from .conditions import LENGTHS
from .constraints import Constraints
from .request import Request

Rows = dict[str, Array]
Attempt = Callable[[Rows, Span], Traced]

#: Criteria for which a longer part of the path is better.
SHRINKING = {"balance", "size", "max_link", "max_ground", "max_arm", "score"}
#: Factors beyond the one that the bounds on lengths ask for, when the straightest guide is wanted.
MARGINS = (1.005, 1.05, 1.15, 1.4, 2.0)


def attempts(request: Request, wanted: Constraints, rank: dict[str, float]) -> list[Attempt]:
    """Return the attempts for a request, the most desirable first."""
    if request.kind == "circle":
        sweep = request.sweep
        return [partial(_arc, sweep) if sweep is not None else partial(_stored, circle=True)]
    if "deviation" in rank:
        bounds = {name: request.stroke / b for name in LENGTHS if (b := getattr(wanted, name)) is not None}
        return [partial(_straightest, bounds, margin) for margin in MARGINS]
    if SHRINKING & set(rank):
        return [partial(_longest, request.relative), _stored]
    return [_stored]


def _arc(sweep: float, rows: Rows, guides: Span) -> Traced:
    """The part whose chord is to the radius as is asked for."""
    return at_sweep(guides, rows["half"], rows["centre"], rows["sweep"], sweep)[1]


def _stored(rows: Rows, guides: Span, circle: bool = False) -> Traced:
    """The part that is stored."""
    return trace(guides, rows["half"], circle=circle, split=True, centre=rows["centre"], nodes=16)


def _straightest(bounds: dict[str, float], margin: float, rows: Rows, guides: Span) -> Traced:
    """The shortest part, not below the one stored, for which the lengths stay within their bounds."""
    lengths = [np.nan_to_num(rows[LENGTHS[name].key]) * scale for name, scale in bounds.items()]
    need = np.max([np.ones(len(guides)), *lengths], axis=0)
    half = rows["half"] * np.where(need > 1, need * margin, margin if margin > MARGINS[0] else 1.0)
    return trace(guides, _usable(guides, half, rows), circle=False, split=True, centre=rows["centre"], nodes=16)


def _longest(relative: float, rows: Rows, guides: Span) -> Traced:
    """The longest part within the tolerance."""
    spare = np.maximum(relative / np.maximum(rows["deviation"], 1e-16), 1.0)
    powers = np.array([1 / 3, 1 / 4, 1 / 5.5, 0.0])  # two, three, four inflections, and none to spare
    half = np.stack([_usable(guides, h, rows) for h in rows["half"] * np.minimum(spare ** powers[:, None], 3.0)])
    each = np.tile(np.arange(len(guides)), len(half))
    tried = trace(guides[each], half.ravel(), circle=False, split=True, centre=rows["centre"][each], nodes=16)
    ladder = Ladder(half, tried.reshaped(half.shape), rows["centre"])
    return reach(guides, ladder, relative * 0.999, circle=False)[1]


def _usable(guides: Span, half: Array, rows: Rows) -> Array:
    low, high = guides.extent
    return np.asarray(np.minimum(half, USABLE * np.minimum(low / (1 - rows["centre"]), high / (1 + rows["centre"]))))
