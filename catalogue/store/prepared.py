"""A select that is compiled once and run many times, straight through the driver."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from sqlalchemy import Connection, Select

from ..kinematics.types import Array
from .columns import as_array


class Prepared:
    """A Core select of single columns with distinct names, ready to be run on a connection.

    SQLAlchemy needs about a millisecond for each run of a wide select, which is more than SQLite needs for a page of an
    index; here it compiles the select, and the driver runs it.

    Parameters
    ----------
    connection : Connection
        Where to read; it must stay open.
    select : Select
        Its bound parameters with names are given with each run; they have some value of the right type.
    """

    def __init__(self, connection: Connection, select: Select[Any]) -> None:
        compiled = select.compile(connection.engine, compile_kwargs={"render_postcompile": True})
        self._sql, self._fixed = str(compiled), dict(compiled.params)
        self._order: Sequence[str] = getattr(compiled, "positiontup", None) or ()
        self._types = [(column.name, column.type) for column in select.selected_columns]
        connection.exec_driver_sql("SELECT 1").close()  # begins the transaction in which all runs read
        self._cursor = connection.connection.cursor()

    def rows(self, bound: Mapping[str, Any]) -> list[tuple[Any, ...]]:
        """Return the rows for these values of the parameters."""
        values = [bound[name] if name in bound else self._fixed[name] for name in self._order]
        self._cursor.execute(self._sql, values)
        return list(self._cursor.fetchall())

    def read(self) -> dict[str, Array]:
        """Return the columns of what the select gives as it is."""
        return self.columns(self.rows({}))

    def columns(self, rows: Sequence[tuple[Any, ...]]) -> dict[str, Array]:
        """Return the columns of rows, of one run or of several, as arrays; see `read_columns`."""
        values = zip(*rows, strict=True) if rows else ((),) * len(self._types)
        return {name: as_array(kind, column) for (name, kind), column in zip(self._types, values, strict=True)}
