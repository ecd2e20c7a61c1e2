"""What an answer made of a stored reach is likely to cost, as SQL that an index alone can compute.

A request lies between a reach and its neighbour, and what it costs there is stored (see `catalogue.build.promise`).
For a straight line: the parabola through the balances at the deviation of the reach, at 10**0.5 and at 10 times that.
For an arc: its size and its transmission angle as functions of the sweep.
"""

from __future__ import annotations

import math
from typing import Any

from sqlalchemy import ColumnElement, and_, case, func, true

from ..guide.reach import LEVELS
from ..store import Reach
from .constraints import Constraints
from .request import Request

#: How many levels are searched where a shorter stroke may serve.
DEPTH = 3
#: Constraints that a shorter part of the path may meet where the longest does not.
SHORTER = (
    "min_transmission", "fixed_pivots_in", "pivots_in", "swept_in", "keep_out", "min_link", "max_drive_angle",
    "max_rotation", "min_uniformity", "min_advantage",
)  # fmt: skip

#: A reach below this part of its level ends where its deviation jumps: a request just above the level is beyond it.
AMPLE = 0.5
OWN: ColumnElement[Any] = Reach.size - Reach.min_transmission / 90


def loosest(request: Request) -> int:
    """Return the level whose reaches satisfy the request."""
    level = math.floor(math.log10(request.relative) + 1e-9)
    return int(min(max(level, min(LEVELS)), max(LEVELS)))


def levels(request: Request, depth: int) -> list[int]:
    """Return the levels whose reaches may serve: of a line `depth`, from the loosest that satisfies a request; all from
    there of an arc, whose window lies between two reaches of whatever levels."""
    top = loosest(request)
    return [level for level in LEVELS if level <= top and (request.sweep is not None or level > top - depth)]


def depth(wanted: Constraints) -> int:
    """Return how many levels of a line are to be searched: one, unless a shorter stroke may meet a constraint."""
    return DEPTH if _stays(wanted) else 1


def within(request: Request) -> ColumnElement[bool]:
    """Return the condition that a request lies between a reach and its neighbour."""
    if request.sweep is None:
        return true()
    return and_(Reach.sweep >= request.sweep, Reach.inner_sweep < request.sweep)


def shape(request: Request) -> tuple[ColumnElement[Any], ColumnElement[Any]]:
    """Return about how large a linkage is beside the stroke, its path apart, and its transmission angle [deg]."""
    sweep = request.sweep
    if sweep is None:
        return Reach.size.expression, Reach.min_transmission.expression
    turned = 2 * math.asin(min(0.5 * sweep, 1.0))
    return Reach.still * (1 / sweep) + Reach.grows, func.min(Reach.angle + Reach.turns * turned, 90.0)


def promised(request: Request, wanted: Constraints) -> ColumnElement[Any]:
    """Return the balance that is likely, not below the floor of the reach."""
    if request.sweep is not None:
        size, angle = shape(request)
        return func.max(Reach.floor, func.max(1.0, size) - angle / 90)
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


def may_promise(request: Request, below: Any) -> ColumnElement[bool]:
    """Return a condition that is soon computed, and met by all that promises to be `below`."""
    if request.sweep is None:
        return true()
    size, _ = shape(request)
    small: ColumnElement[bool] = size <= below + 1  # no transmission angle makes up for more
    return small


def _stays(wanted: Constraints) -> bool:
    return any(getattr(wanted, name) for name in SHORTER)
