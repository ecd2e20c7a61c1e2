"""What an answer made of a stored reach is likely to cost, as SQL that an index alone can compute.

A request lies between a reach and its neighbour, whose measures are stored with it (see `catalogue.build.promise`).
For a straight line: the parabola through the balances at the deviation of the reach, at 10**0.5 and at 10 times that.
For an arc: the linkage keeps its place while its window shrinks, so that its size, in a fixed unit, and its
transmission angle go in proportion to the sweep from the reach to the one inside it.
"""

from __future__ import annotations

import math
from typing import Any

from sqlalchemy import ColumnElement, and_, case, func, true

from ..guide.reach import LEVELS
from ..store import Reach
from .constraints import Constraints
from .narrow import DEPTH, loosest
from .request import Request

#: Constraints that a shorter part of the path may meet where the longest does not.
SHORTER = (
    "min_transmission", "fixed_pivots_in", "pivots_in", "swept_in", "keep_out", "min_link", "max_drive_angle",
    "max_rotation", "min_uniformity", "min_advantage",
)  # fmt: skip

#: A reach below this part of its level ends where its deviation jumps: a request just above the level is beyond it.
AMPLE = 0.5
OWN: ColumnElement[Any] = Reach.size - Reach.min_transmission / 90


def levels(request: Request, wanted: Constraints) -> list[int]:
    """Return the levels whose reaches may serve: the loosest that satisfies the request, and tighter ones.

    The window of an arc lies between two reaches, of whatever levels; a line needs a tighter reach only where a longer
    stroke may break a constraint.
    """
    top = loosest(request)
    depth = len(LEVELS) if request.sweep is not None else DEPTH if _stays(wanted) else 1
    return [level for level in LEVELS if top - depth < level <= top]


def within(request: Request) -> ColumnElement[bool]:
    """Return the condition that a request lies between a reach and its neighbour."""
    if request.sweep is None:
        return true()
    return and_(Reach.sweep >= request.sweep, Reach.inner_sweep < request.sweep)


def promised(request: Request, wanted: Constraints) -> ColumnElement[Any]:
    """Return the balance that is likely, not below the floor of the reach."""
    if request.sweep is not None:
        return func.max(Reach.floor, _arc(request.sweep))
    top = loosest(request)
    share = min(max(math.log10(request.relative) - top, 0.0), 1.0)
    here = case((Reach.deviation < AMPLE * 10.0**top, func.min(OWN, Reach.halfway)), else_=OWN)
    parabola = (
        (1 - share) * (1 - 2 * share) * here
        + 4 * share * (1 - share) * Reach.halfway
        + share * (2 * share - 1) * Reach.farther
    )
    if not _stays(wanted):
        return func.max(Reach.floor, parabola)
    # where a longer stroke may break a constraint the stored one serves, and so does that of a tighter level
    between = func.max(Reach.floor, func.min(parabola, OWN))
    return case((Reach.level == top, between), else_=OWN)


def _arc(sweep: float) -> ColumnElement[Any]:
    share = (sweep - Reach.inner_sweep) / (Reach.sweep - Reach.inner_sweep)
    size = (Reach.inner_size + share * (Reach.size - Reach.inner_size)) * Reach.sweep / sweep
    angle = Reach.inner_transmission + share * (Reach.min_transmission - Reach.inner_transmission)
    balance: ColumnElement[Any] = func.max(1.0, size) - angle / 90
    return balance


def _stays(wanted: Constraints) -> bool:
    return any(getattr(wanted, name) for name in SHORTER)
