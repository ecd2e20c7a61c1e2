"""Put the named guides into the database: classified and measured like what is drawn."""

from __future__ import annotations

import sqlite3

import numpy as np
from sqlalchemy import Connection, select

from ..errors import DatabaseError
from ..guide.kinds import POINTS
from ..kinematics.linkage import Linkage
from ..kinematics.types import Array, Complexes, Floats
from ..plugin.registry import Registry
from ..series.classification import classify
from ..series.named_guides import NamedGuide, named_guides
from ..store import Database, Guide, Mechanism, remove_named_guides, write_batch
from .rows import Columns, guide_columns, mechanism_columns, together

#: The member of its series that a design is: itself.
MEMBER = "design"
#: Series of a design that no registered series can be held against.
UNKNOWN = "none"


def write_named_guides(database: Database, connection: Connection, registry: Registry) -> int:
    """Write the designs that the database does not hold, or holds otherwise, and return how many.

    Raises
    ------
    DatabaseError
        If the file cannot be written, or another process is filling it.
    """
    wanted = list(named_guides().values())
    placed = [design.canonical() for design in wanted]
    linkage = Linkage(np.concatenate([one.pivots for one, *_ in placed]))
    point, centre, half = (np.array([p[i] for p in placed]) for i in (1, 2, 3))
    series = nearest_series(linkage, registry)
    held = _held(database)
    mine = zip(series, linkage.pivots.reshape(-1, 12), point, strict=True)
    now = [(code, pivots.tobytes(), complex(z)) for code, pivots, z in mine]
    new = np.array([held.get(d.name) != entry for d, entry in zip(wanted, now, strict=True)])
    if not new.any():
        return 0
    chosen = [d for d, is_new in zip(wanted, new, strict=True) if is_new]
    remove_named_guides(connection, [d.name for d in chosen])
    mechanisms, guides, reaches = columns(chosen, linkage[new], point[new], centre[new], half[new])
    mechanisms["series"] = series[new]
    try:
        write_batch(connection, None, mechanisms, guides, reaches)
    except sqlite3.IntegrityError as error:
        if "mechanism.name" not in str(error):
            raise
        raise DatabaseError(
            f"{database.path} is being filled by another process: wait until that has finished"
        ) from error
    return len(chosen)


def columns(
    chosen: list[NamedGuide], linkage: Linkage, point: Complexes, centre: Complexes, half: Floats
) -> tuple[Columns, Columns, Columns]:
    """Return the columns of mechanisms, but for their series, of guides and of reaches.

    Parameters
    ----------
    chosen : list of n NamedGuide
    linkage : Linkage of n
        In the canonical frame, as all that follows.
    point, centre : complex ndarray, shape (n,)
    half : ndarray, shape (n,)
        Half the usual strokes.
    """
    circle = np.array([d.circle for d in chosen])
    points = {
        "mechanism": np.arange(len(chosen)),
        "kind": np.where(circle, POINTS["circle"], POINTS["line"]),
        "label": np.full(len(chosen), "guided", dtype=object),
        "x": point.real,
        "y": point.imag,
        "contact_order": np.array([d.order for d in chosen]),
        "centre": centre,
    }
    parts = []
    for kind in (False, True):
        which = circle == kind
        some = {k: v[which] for k, v in points.items()}
        parts.append(guide_columns(linkage[which], some, kind, half[which]))
    guides, reaches = together([part for part in parts if part is not None])
    guides["cover"] = 0
    mechanisms = {
        **mechanism_columns(linkage),
        "member": MEMBER,
        "name": [d.name for d in chosen],
        "parameters": "{}",
    }
    return mechanisms, guides, reaches


def nearest_series(linkage: Linkage, registry: Registry) -> Array:
    """Return the code of the series that each linkage belongs to, else of the nearest one, shape (n,)."""
    found = [one.nearest for one in classify(linkage, registry.series)]
    return np.array([one.series if one else UNKNOWN for one in found], dtype=object)


def _held(database: Database) -> dict[str, tuple[str, bytes, complex]]:
    """Return series, pivots and guided point of each design in the database, by name."""
    rows = database.read(
        select(Mechanism.name, Mechanism.series, Mechanism.pivots, Guide.x, Guide.y)
        .join(Guide, Guide.mechanism_id == Mechanism.id)
        .where(Mechanism.batch_id.is_(None), Mechanism.name.in_(list(named_guides())))
    )
    return {
        str(name): (str(code), pivots.tobytes(), complex(x, y)) for name, code, pivots, x, y in
        zip(*rows.values(), strict=True)
    }  # fmt: skip
