"""Conditions in SQL: what is known of the stored reaches of a guide before anything is traced.

A guide is stored with one reach per level of relative deviation.  A request is met by the reaches of the loosest level
that satisfies it and of tighter ones (shorter strokes, larger but easier on the transmission angle).  A reach of that
loosest level may still be stretched, by a factor of at most `stretch`, until it uses the whole tolerance; lengths
relative to the stroke shrink by the same factor, so that conditions on lengths are loosened by it.  Everything is
checked again afterwards on the traced motion.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from sqlalchemy import ColumnElement, and_, func, not_, or_

from ..guide.kinds import POINTS, RETURNS, SLOTS
from ..store import Guide, Mechanism, Reach
from .constraints import Constraints
from .promise import shape, within
from .region import Region
from .request import Request

#: Bounds on lengths with the column they bound.
LENGTHS: dict[str, Any] = {
    "max_size": Reach.size,
    "max_link": Reach.max_link,
    "max_ground": Reach.max_ground,
    "max_arm": Reach.max_arm,
}
#: By how much the transmission angle of an arc is better than it promises, at most [deg].
STEEPER = 3.0
#: How far the size of an arc is from what it promises, at most.
LOOSE = 1.05
#: How far pivots beside an arc are from where they promise to be, at most [stored strokes].
PAD = 0.015
#: How far angles of a longer or shorter stroke are from proportion, at most.
TURNS = 1.5
SLIDING = ("slider-crank", "inverted-slider-crank", "swinging-block", "elliptic-trammel", "oldham")


def stretch(request: Request, level: int, rank: dict[str, float]) -> float:
    """Return the factor by which a reach of this level may be stretched at most (two inflections).

    When the straightest guide is wanted, only as far as the next looser level.
    """
    if request.kind == "circle":
        return 1.0
    spare = max(1.0, request.relative / 10.0**level)
    return math.cbrt(min(spare, 10.0) if "deviation" in rank else spare)


def conditions(
    request: Request, wanted: Constraints, level: int, rank: dict[str, float], least: Any = None
) -> dict[str, ColumnElement[bool]]:
    """Return the SQL condition of each active constraint on reaches of a level, by name.

    A stored length times `least` is the length in the user's unit, at least; for an arc that depends on the reach.
    """
    s = request.stroke
    if least is None:
        least = s / stretch(request, level, rank)
    most: Any = s
    if (sweep := request.sweep) is not None:
        least = most = Reach.sweep * (s / sweep)
    found: dict[str, ColumnElement[bool]] = {}
    for name in ("families", "series", "configurations"):
        if getattr(wanted, name):
            tag = {"families": Mechanism.family, "series": Mechanism.series}.get(name, Mechanism.configuration)
            found[name] = tag.in_(getattr(wanted, name))
    if wanted.pins_only:
        found["pins_only"] = Mechanism.family.not_in(SLIDING)
    if wanted.order:
        found["order"] = Guide.contact_order >= wanted.order
    for name, column in LENGTHS.items():
        bound = getattr(wanted, name)
        if bound is not None and name == "max_size" and sweep is not None:  # the path is a part of it that shrinks
            found[name] = shape(request)[0] * s <= bound * LOOSE
        elif bound is not None:
            found[name] = func.coalesce(column * least <= bound, True)
    if wanted.min_link is not None:
        found["min_link"] = func.coalesce(Reach.min_link * most >= wanted.min_link, True)
    if wanted.min_transmission:
        best: Any = Reach.min_transmission
        if sweep is not None:
            best = func.max(best, shape(request)[1] + STEEPER)
        found["min_transmission"] = best >= wanted.min_transmission
    if wanted.full_rotation:
        found["full_rotation"] = Reach.rotates > 0
    found |= _turning(wanted, least / s, most / s)
    boxes = {
        "fixed_pivots_in": (Reach.fixed_x0, Reach.fixed_y0, Reach.fixed_x1, Reach.fixed_y1),
        "pivots_in": (Reach.all_x0, Reach.all_y0, Reach.all_x1, Reach.all_y1),
    }
    for name, box in boxes.items():
        region = getattr(wanted, name)
        if region is not None:
            found[name] = _inside(box, region, request, least, most)
    return found


def _turning(wanted: Constraints, least: Any, most: Any) -> dict[str, ColumnElement[bool]]:
    """The conditions on angles: they change with the length of the stroke, about in proportion, and not quite so."""
    found = {}
    if wanted.min_drive_angle is not None:
        found["min_drive_angle"] = Reach.drive_angle * TURNS >= wanted.min_drive_angle * least
    if wanted.max_drive_angle is not None:
        found["max_drive_angle"] = Reach.drive_angle <= wanted.max_drive_angle * TURNS * most
    if wanted.max_rotation is not None:
        found["max_rotation"] = Reach.rotation <= wanted.max_rotation * TURNS * most
    return {name: func.coalesce(test, True) for name, test in found.items()}


def flips(request: Request) -> list[tuple[bool, bool]]:
    """Return the ways in which a guide can be laid along the path: reversed, and mirrored."""
    both = [(False, False), (True, False)]
    return both if request.kind == "circle" else [*both, (False, True), (True, True)]


def _inside(box: tuple[Any, ...], region: Region, request: Request, least: Any, most: Any) -> ColumnElement[bool]:
    """A stored box, laid along the path in one of the `flips`, lies in the region's bounding box; stored, the path's
    middle is (0.5, 0).  The flips turn x and y apart from each other."""
    x0, y0, x1, y1 = box
    left, low, right, high = region.box
    left, right = left - 0.5 * request.stroke, right - 0.5 * request.stroke
    rise: Any = 0.0
    if request.sweep is not None:  # the chord of a shorter window lies nearer to the summit
        rise = (_height(Reach.sweep) - _height(request.sweep)) / Reach.sweep
        x0, y0, x1, y1 = x0 + PAD, y0 + PAD, x1 - PAD, y1 - PAD

    def between(start: Any, end: Any, low: float, high: float) -> ColumnElement[bool]:
        if least is not most:
            return and_(func.max(start * least, start * most) >= low, func.min(end * least, end * most) <= high)
        return and_(start * least >= low, end * least <= high)

    along = or_(*(between(x0 - 0.5, x1 - 0.5, *ends) for ends in ((left, right), (-right, -left))))
    straight, turned = between(y0 - rise, y1 - rise, low, high), between(y0 + rise, y1 + rise, -high, -low)
    if request.kind == "circle":  # the arc is to bulge to +y: a guide whose centre lies to the left is turned over
        over = Guide.curvature > 0
        straight, turned = and_(not_(over), straight), and_(over, turned)
    return func.coalesce(and_(along, or_(straight, turned)), True)


def _height(sweep: Any) -> Any:
    """Return the height of an arc over its chord, in radii: 1 - sqrt(1 - sweep**2 / 4), 1.5 % off at 1.9."""
    square = sweep * sweep * 0.25
    return square * (1 / 2 + square * (1 / 8 + square * (1 / 16 + square * 0.108)))


def basis(request: Request, wanted: Constraints, levels: Sequence[int]) -> ColumnElement[bool]:
    """Return the condition that no constraint can be traded against: kind, level, and of an arc the one reach of each
    guide that is just long enough."""
    kinds = SLOTS if wanted.slots else RETURNS if wanted.returns else POINTS
    return and_(Reach.kind == kinds[request.kind], Reach.level.in_(levels), within(request))
