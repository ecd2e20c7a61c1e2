"""Add the named guides to the database, classified and measured like sampled ones."""

from __future__ import annotations

import numpy as np
from sqlalchemy import Connection, select

from ..guidance.kinds import POINTS
from ..kinematics.linkage import Linkage
from ..kinematics.types import Floats
from ..plugin.registry import Registry
from ..series.classification import classify
from ..series.named_guides import named_guides
from ..store import PIVOTS, Database, Guide, Mechanism, remove_named_guides, stacked_pivots, write_batch
from .rows import concatenate, guide_columns, mechanism_columns

#: Name of the member for a design, which is the only guide in it.
MEMBER = "design"
#: Code of the series of a design that cannot be compared with any registered series.
UNKNOWN = "none"


def write_named_guides(database: Database, connection: Connection, registry: Registry) -> None:
    """Write new or changed named designs, each to its series or, without one, to the nearest."""
    designs = list(named_guides().values())
    placed = [design.canonical() for design in designs]
    linkage = Linkage(np.concatenate([one.pivots for one, *_ in placed]))
    point, centre, half = (np.array([p[i] for p in placed]) for i in (1, 2, 3))
    nearest = [one.nearest for one in classify(linkage, registry.series)]
    series = np.array([one.series if one else UNKNOWN for one in nearest], dtype=object)
    held = _stored_identities(database)
    contact = ([getattr(d, name) for d in designs] for name in ("order", "inflections"))
    now = list(map(_identity, series, linkage.pivots, point, *contact))
    new = [i for i, design in enumerate(designs) if held.get(design.name) != now[i]]
    if not new:
        return
    chosen = [designs[i] for i in new]
    remove_named_guides(connection, [d.name for d in chosen])
    points = {
        "mechanism": np.arange(len(chosen)),
        "kind": np.array([POINTS["circle" if d.circle else "line"] for d in chosen]),
        "label": np.full(len(chosen), "guided", dtype=object),
        "x": point[new].real,
        "y": point[new].imag,
        "contact_order": np.array([d.order for d in chosen]),
        "inflections": np.array([d.inflections for d in chosen]),
        "centre": centre[new],
    }
    guides, reaches = concatenate(guide_columns(linkage[new], points, half[new]))
    mechanisms = {
        **mechanism_columns(linkage[new]),
        "series": series[new],
        "member": MEMBER,
        "name": [d.name for d in chosen],
        "parameters": "{}",
    }
    write_batch(connection, None, mechanisms, guides | {"cover": 0}, reaches)


#: Series, pivots, guided point, order of contact and inflections of a design.
Identity = tuple[str, list[float], complex, int, int]


def _identity(series: object, pivots: Floats, point: complex, order: int, inflections: int) -> Identity:
    return str(series), pivots.ravel().tolist(), complex(point), int(order), int(inflections)


def _stored_identities(database: Database) -> dict[str, Identity]:
    """Read the stored rows of each design, by name."""
    rows = database.read(
        select(Mechanism.name, Mechanism.series, *PIVOTS, Guide.x, Guide.y, Guide.contact_order, Guide.inflections)
        .join(Guide, Guide.mechanism_id == Mechanism.id)
        .where(Mechanism.batch_id.is_(None), Mechanism.name.in_(list(named_guides())))
    )
    points = rows["x"] + 1j * rows["y"]
    contact = rows["contact_order"], rows["inflections"]
    return dict(zip(rows["name"], map(_identity, rows["series"], stacked_pivots(rows), points, *contact), strict=True))
