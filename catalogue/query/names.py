"""Names of families, series and configurations that a request gives."""

from __future__ import annotations

from sqlalchemy import select

from ..errors import InvalidRequest
from ..store import Database, Mechanism
from .constraints import Constraints

SINGULAR = {"families": "family", "series": "series", "configurations": "configuration"}


def check_names(database: Database, wanted: Constraints) -> None:
    """Raise `InvalidRequest` if a family, series or configuration is asked for that the database does not hold."""
    columns = {"families": Mechanism.family, "series": Mechanism.series, "configurations": Mechanism.configuration}
    for name, column in columns.items():
        asked = getattr(wanted, name)
        if asked:
            unknown = [
                a for a in asked if not len(database.read(select(column).where(column == a).limit(1))[column.key])
            ]
            if unknown:
                held = sorted(set(database.read(select(column.label("name")).distinct())["name"]))
                raise InvalidRequest(
                    f"the database holds no {SINGULAR[name]} {unknown[0]!r}; it holds "
                    f"{', '.join(held)}. `catalogue build --series CODE` adds a series"
                )
