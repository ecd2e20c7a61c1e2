"""Narrow the stored reaches in SQL, by what is known of them before anything is traced."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from sqlalchemy import ColumnElement, Select, bindparam, func, select

from ..guide.reach import LEVELS
from ..linkage import Array
from ..store import Batch, Database, Guide, Mechanism, Reach
from .conditions import SLIDING, basis, conditions
from .constraints import Constraints
from .promise import DEPTH, levels, shape
from .request import Request

#: Least number of candidates that a series sends.
LEAST = 40

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
    """Return the codes of the series that a database holds and that are wanted, of a family that is wanted; those of
    which it holds few guides come first.

    A series without such a family would be searched to its end in vain.  One of which the database holds only named
    guides counts if it is asked for by its code.
    """
    number = func.sum(func.sum(Batch.guides)).over(partition_by=Batch.series).label("number")
    members = select(Batch.series.label("code"), Batch.member, number).group_by(Batch.series, Batch.member)
    rows = read(members.order_by("number", Batch.series))
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
