"""Selects over stored guides: reaches with what they belong to."""

from __future__ import annotations

from typing import Any

from sqlalchemy import Select, select

from .models import Guide, Mechanism, Reach

#: What a stored reach is laid along a path by.
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


def joined(*columns: Any) -> Select[Any]:
    """Return a select over reaches with their guides and mechanisms."""
    return (
        select(*columns)
        .select_from(Reach)
        .join(Guide, Guide.id == Reach.guide_id)
        .join(Mechanism, Mechanism.id == Guide.mechanism_id)
    )
