"""Views for readers by SQL alone, and the meaning of every table and column.

The views ``guides`` (a guide with its mechanism in one row) and ``pivots`` (a pivot in one row) and
the table ``description`` hold no data of their own. They are made from the selects below and from
the comments in `models` whenever a file is created or upgraded, so that no migration has to know
them. Views take no space. Pivots are columns of numbers, not blobs: SQLite has no function that
reads a double from bytes, and no other program could read a view that needed a function of this
package.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

from sqlalchemy import INTEGER, TEXT, Connection, SelectBase, delete, insert, literal, select, union_all
from sqlalchemy.dialects import sqlite

from .models import PIVOTS, Base, Description, Guide, Mechanism


@dataclass(frozen=True)
class Described:
    """Meaning of one column; of a whole table or view if `column_name` is empty."""

    table_name: str
    column_name: str
    type: str
    unit: str
    meaning: str


#: One guide with its mechanism.
GUIDES = select(
    *(Guide.id, Mechanism.name, Mechanism.family, Mechanism.series, Mechanism.member, Mechanism.configuration),
    *(Guide.kind, Guide.label, Guide.contact_order, Guide.inflections, Guide.leading, Guide.cover),
    *(Guide.x, Guide.y, Guide.tangent_x, Guide.tangent_y, Guide.curvature),
    *PIVOTS,
    *(Mechanism.rho0, Mechanism.kappa, Mechanism.kappa_star, Mechanism.s),
    *(Mechanism.parameters, Guide.mechanism_id),
).join_from(Guide, Mechanism)
_PIVOTS = union_all(
    *(
        select(
            Mechanism.id.label("mechanism_id"),
            literal(dyad, INTEGER).label("dyad"),
            literal(joint, TEXT).label("joint"),
            *(getattr(Mechanism, f"{joint}_{dyad}_{part}").label(part) for part in "xyw"),
        )
        for dyad in (1, 2)
        for joint in ("fixed", "moving")
    )
)
VIEWS: dict[str, tuple[SelectBase, str]] = {
    "guides": (GUIDES, "A guide with its mechanism in one row, in the canonical frame."),
    "pivots": (_PIVOTS, "A pivot of a mechanism in one row, in the canonical frame."),
}
#: Meanings of columns of views that are in no table.
_MADE = {
    "mechanism_id": "mechanism it belongs to",
    "dyad": "1 or 2",
    "joint": "fixed or moving",
    "x": "where it is, or its direction [canonical]",
    "y": "where it is, or its direction [canonical]",
    "w": "1; 0: it is at infinity towards (x, y)",
}


def described() -> Iterator[Described]:
    """Yield the meaning of every table, view and column of a file.

    A table comes before its columns.
    """
    yield Described("alembic_version", "", "table", "", "The state of the tables, as Alembic keeps it.")
    yield Described("alembic_version", "version_num", "VARCHAR(32)", "", "revision of the tables")
    models = {str(mapper.local_table): mapper.class_ for mapper in Base.registry.mappers}
    for name, table in sorted(Base.metadata.tables.items()):
        yield Described(name, "", "table", "", _sentence(models[name].__doc__ or ""))
        yield from (_column(name, column) for column in table.columns)
    for name, (query, meaning) in VIEWS.items():
        yield Described(name, "", "view", "", meaning)
        yield from (_column(name, column) for column in query.selected_columns)


def drop_views(connection: Connection) -> None:
    """Drop the views before a change of their tables."""
    for name in VIEWS:
        connection.exec_driver_sql(f"DROP VIEW IF EXISTS {name}")


def describe(connection: Connection) -> None:
    """Make the views and fill the table of descriptions."""
    for name, (query, _) in VIEWS.items():
        text = query.compile(dialect=sqlite.dialect(), compile_kwargs={"literal_binds": True})
        connection.exec_driver_sql(f"CREATE VIEW {name} AS {text}")
    connection.execute(delete(Description))
    connection.execute(insert(Description), [asdict(one) for one in described()])


def _column(table: str, column: Any) -> Described:
    """Describe a column from its comment, which ends with its unit, if any."""
    comment = getattr(column, "comment", None) or _MADE[column.name]
    meaning, _, unit = comment.removesuffix("]").partition(" [")
    return Described(table, column.name, str(column.type), unit, meaning)


def _sentence(docstring: str) -> str:
    """Return the first paragraph in one line."""
    return " ".join(docstring.partition("\n\n")[0].split())
