"""Narrow the stored reaches in SQL, by what is known of them before anything is traced.

A guide is stored with one reach per level of relative deviation.  A request is met by the reaches of the loosest level
that satisfies it and of tighter ones (shorter strokes, larger but easier on the transmission angle).  A reach of that
loosest level may still be stretched, by a factor of at most `stretch`, until it uses the whole tolerance; lengths
relative to the stroke shrink by the same factor, so that conditions on lengths are loosened by it.  Everything is
checked again afterwards on the traced motion.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from sqlalchemy import ColumnElement, Select, and_, bindparam, func, not_, or_, select

from ..guide.kinds import POINTS, RETURNS, SLOTS
from ..guide.reach import LEVELS
from ..linkage import Array
from ..store import Batch, Database, Guide, Mechanism, Reach
from .constraints import Constraints
from .promise import DEPTH, levels, shape, within
from .region import Region
from .request import Request

#: Bounds on lengths with the column they bound.
LENGTHS: dict[str, Any] = {
    "max_size": Reach.size,
    "max_link": Reach.max_link,
    "max_ground": Reach.max_ground,
    "max_arm": Reach.max_arm,
}
#: Least number of candidates that a series sends.
LEAST = 40
#: How far the size of an arc is from what it promises, at most.
LOOSE = 1.05
#: How far angles of a longer or shorter stroke are from proportion, at most.
TURNS = 1.5
SLIDING = ("slider-crank", "inverted-slider-crank", "swinging-block", "elliptic-trammel", "oldham")

COLUMNS = (
    Guide.id.label("id"),
    Mechanism.family,
    Mechanism.series,
    Mechanism.member,
    Mechanism.configuration,
    Mechanism.pivots,
    Guide.x,
    Guide.y,
    Guide.kind,
    Guide.label,
    Guide.contact_order,
    Reach.level,
    Reach.half,
    Reach.centre,
    Reach.stroke,
    Reach.sweep,
    Reach.deviation,
    Reach.size,
    Reach.max_link,
    Reach.max_ground,
    Reach.max_arm,
)


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
        least = most = s * Reach.sweep / sweep
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
        best = func.max(Reach.min_transmission, func.coalesce(Reach.inner_transmission, 0.0))
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
            found[name] = or_(*(_inside(box, region, request, flip, least, most) for flip in flips(request)))
    return found


def _turning(wanted: Constraints, least: Any, most: Any) -> dict[str, ColumnElement[bool]]:
    """The conditions on angles: they change with the length of the stroke, about in proportion, and not quite so."""
    found = {}
    if wanted.min_drive_angle is not None:
        found["min_drive_angle"] = Reach.drive_angle * TURNS >= wanted.min_drive_angle * least
    if wanted.max_drive_angle is not None:
        found["max_drive_angle"] = Reach.drive_angle * most <= wanted.max_drive_angle * TURNS
    if wanted.max_rotation is not None:
        found["max_rotation"] = Reach.rotation * most <= wanted.max_rotation * TURNS
    return {name: func.coalesce(test, True) for name, test in found.items()}


def flips(request: Request) -> list[tuple[bool, bool]]:
    """Return the ways in which a guide can be laid along the path: reversed, and mirrored."""
    both = [(False, False), (True, False)]
    return both if request.kind == "circle" else [*both, (False, True), (True, True)]


def _inside(
    box: tuple[Any, ...], region: Region, request: Request, flip: tuple[bool, bool], least: Any, most: Any
) -> ColumnElement[bool]:
    """A stored box, laid along the path, lies in the region's bounding box; stored, the path's middle is (0.5, 0)."""
    x0, y0, x1, y1 = box
    low_x, high_x = x0 - 0.5, x1 - 0.5
    low_y, high_y = y0, y1
    wanted = [b - (0.5 * request.stroke if i % 2 == 0 else 0.0) for i, b in enumerate(region.box)]
    if flip[0]:
        wanted[0], wanted[2] = -wanted[2], -wanted[0]
    if request.kind == "circle":  # the arc is to bulge to +y: a guide whose centre lies to the left is turned over
        over = Guide.curvature > 0
        straight = _bounds(low_x, high_x, low_y, high_y, wanted, least, most)
        wanted = [wanted[0], -wanted[3], wanted[2], -wanted[1]]
        turned = _bounds(low_x, high_x, low_y, high_y, wanted, least, most)
        return or_(and_(not_(over), straight), and_(over, turned))
    if flip[1]:
        wanted[1], wanted[3] = -wanted[3], -wanted[1]
    return _bounds(low_x, high_x, low_y, high_y, wanted, least, most)


def _bounds(
    low_x: Any, high_x: Any, low_y: Any, high_y: Any, wanted: list[float], least: Any, most: Any
) -> ColumnElement[bool]:
    def above(value: Any, bound: float) -> ColumnElement[bool]:
        return (value * least if least is most else func.max(value * least, value * most)) >= bound

    def below(value: Any, bound: float) -> ColumnElement[bool]:
        return (value * least if least is most else func.min(value * least, value * most)) <= bound

    test = and_(above(low_x, wanted[0]), above(low_y, wanted[1]), below(high_x, wanted[2]), below(high_y, wanted[3]))
    return func.coalesce(test, True)


def basis(request: Request, wanted: Constraints, levels: Sequence[int]) -> ColumnElement[bool]:
    """Return the condition that no constraint can be traded against: kind, level, and of an arc the one reach of each
    guide that is just long enough."""
    kinds = SLOTS if wanted.slots else RETURNS if wanted.returns else POINTS
    return and_(Reach.kind == kinds[request.kind], Reach.level.in_(levels), within(request))


def cost(request: Request, rank: dict[str, float]) -> ColumnElement[Any]:
    """Return the SQL expression that a reach is ranked by before it is traced: less is better."""
    size, degrees = shape(request)
    angle, by = degrees / 90, 1.0 if request.sweep is None else Reach.sweep / request.sweep
    if request.kind == "circle":
        size = func.max(1.0, size)
    terms = {
        "balance": size - angle,
        "size": size,
        "max_link": func.coalesce(Reach.max_link, 0.0) * by,
        "max_ground": func.coalesce(Reach.max_ground, 0.0) * by,
        "max_arm": Reach.max_arm * by,
        "transmission": 1 - angle,
        "deviation": Reach.deviation / request.relative,
        "score": 1 - angle * (2 - angle) / size,  # sin(90 deg x) is nearly x (2 - x)
    }
    if list(rank) == ["size"] and request.kind == "line":
        return Reach.size.expression  # so that the index gives the order
    return sum((weight * terms[name] for name, weight in rank.items()), start=0 * Reach.size)


def joined(*columns: Any) -> Select[Any]:
    """Return a select over reaches with their guides and mechanisms."""
    return (
        select(*columns)
        .select_from(Reach)
        .join(Guide, Guide.id == Reach.guide_id)
        .join(Mechanism, Mechanism.id == Guide.mechanism_id)
    )


def held(read: Callable[[Any], dict[str, Array]], wanted: Constraints) -> list[str]:
    """Return the codes of the series that a database holds and that are wanted, of a family that is wanted.

    A series without such a family would be searched to its end in vain.  One of which the database holds only named
    guides counts if it is asked for by its code.
    """
    rows = read(select(Batch.series.label("code"), Batch.member).distinct().order_by(Batch.series))
    codes = []
    for code, member in zip(rows["code"], rows["member"], strict=True):
        family = member.split()[0]  # a member is named by its family and a name of its own
        fits = (not wanted.families or family in wanted.families) and not (wanted.pins_only and family in SLIDING)
        if fits and (not wanted.series or code in wanted.series):
            codes.append(str(code))
    if wanted.series:
        named = select(Mechanism.series.label("code")).where(Mechanism.batch_id.is_(None)).distinct()
        codes += sorted(str(code) for code in read(named)["code"] if code in wanted.series)
    return list(dict.fromkeys(codes))


def narrow(
    database: Database, request: Request, wanted: Constraints, rank: dict[str, float], limit: int
) -> dict[str, Array]:
    """Return the most promising stored reaches, at most one per guide, best first.

    Each series sends its share, so that none is crowded out by another whose members are alike.
    """
    only_deviation = list(rank) == ["deviation"]
    some = levels(request, len(LEVELS) if "deviation" in rank else DEPTH)
    groups = [[level] for level in some] if request.sweep is None else [some]
    if only_deviation:
        groups.reverse()  # the tightest first, and no looser than is needed
    order = cost(request, rank)
    selects = [
        joined(*COLUMNS, order.label("cost"))
        .where(basis(request, wanted, group), Reach.series == bindparam("code"))
        .where(*conditions(request, wanted, group[0], rank).values())
        .order_by(order)
        .limit(bindparam("room"))
        for group in groups
    ]
    parts = []
    with database.reading() as read:
        codes = held(read, wanted)
        share = max(limit // max(len(codes), 1), LEAST)
        for code in codes:
            room = share
            for select_ in selects:
                parts.append(read(select_, {"code": code, "room": room}))
                if only_deviation and (room := room - len(parts[-1]["id"])) <= 0:
                    break
    parts = [p for p in parts if len(p["id"])] or parts[:1]
    if not parts:
        return {"id": np.zeros(0, int)}
    found = {k: np.concatenate([p[k] for p in parts]) for k in parts[0]}
    best = np.lexsort((found["id"], found["cost"]))
    _, first = np.unique(found["id"][best], return_index=True)
    kept = best[np.sort(first)]
    place = np.zeros(len(kept), int)  # of each within its series
    for code in codes:
        of = found["series"][kept] == code
        place[of] = np.arange(of.sum())
    kept = kept[place < share]
    return {k: v[kept] for k, v in found.items()}
