"""Fill a database: `prepare`, `drop_indexes`, `write_batch`, `make_indexes`, `finish`.

Loading before indexing is four times as fast as loading into indexed tables. A kill at any moment
loses at most the open batch.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any, cast

import numpy as np
from sqlalchemy import Connection, Index, delete

from ..errors import DatabaseError
from .database import Database
from .engine import connect, database_errors, unseal
from .models import PIVOTS, Base, Batch, Mechanism

Columns = Mapping[str, Any]


def write_batch(
    connection: Connection, batch: Columns | None, mechanisms: Columns, guides: Columns, reaches: Columns
) -> None:
    """Add one finished batch in one transaction.

    A column is an array or a list with one value per row, or one value for all rows; NaN is stored
    as NULL. The order of the rows determines the keys that connect the tables, and the columns that
    repeat those of another table.

    Parameters
    ----------
    connection : Connection
        Connection, not in a transaction.
    batch : mapping or None
        The values of one `Batch`; None for designs entered by hand.
    mechanisms : mapping of columns
        Columns of `Mechanism`, with all pivots in ``pivots``, shape (n, 12) or (n, 2, 2, 3).
    guides : mapping of columns
        Columns of `Guide`, with ``mechanism``, shape (m,): index into these mechanisms, from 0.
    reaches : mapping of columns
        Columns of `Reach`, with ``guide``, shape (k,): index into these guides, from 0.

    Raises
    ------
    ValueError
        If columns differ in length or refer to a row that is not in the batch.
    sqlite3.IntegrityError
        If a value breaks a rule of the tables.
    DatabaseError
        If the disk is full or the file is locked.
    """
    mechanisms, guides, reaches = dict(mechanisms), dict(guides), dict(reaches)
    pivots = np.reshape(mechanisms.pop("pivots"), (-1, len(PIVOTS)))
    mechanisms |= {column.key: values for column, values in zip(PIVOTS, pivots.T, strict=True)}
    parents = _row_numbers(guides.pop("mechanism"), len(pivots))
    owners = _row_numbers(reaches.pop("guide"), len(parents))
    codes = np.broadcast_to(mechanisms.get("series", ""), len(pivots))[parents]
    kinds, covers = (np.broadcast_to(guides[name], parents.shape)[owners] for name in ("kind", "cover"))
    with _write_transaction(connection):
        batch_id = None if batch is None else _insert(connection, "batch", 1, batch)
        first = _insert(connection, "mechanism", len(pivots), mechanisms | {"batch_id": batch_id})
        keys: dict[str, Any] = {"mechanism_id": first + parents, "series": codes}
        first = _insert(connection, "guide", len(parents), keys | guides)
        keys = {"guide_id": first + owners, "kind": kinds, "series": codes[owners], "cover": covers}
        _insert(connection, "reach", len(owners), keys | reaches)


def remove_named_guides(connection: Connection, names: Sequence[str]) -> None:
    """Remove the designs of these names, with their guides."""
    with _write_transaction(connection):
        connection.execute(delete(Mechanism).where(Mechanism.batch_id.is_(None), Mechanism.name.in_(names)))


def remove_batches(connection: Connection, ids: Sequence[int]) -> None:
    """Remove batches with all guides and specimens stored from them."""
    if ids:
        make_indexes(connection)  # without indexes each row would need a search of the whole file
        with _write_transaction(connection):
            connection.execute(delete(Batch).where(Batch.id.in_(ids)))


def drop_indexes(connection: Connection) -> None:
    """Drop the indexes that only requests need."""
    with _write_transaction(connection):
        for index in _indexes():
            index.drop(connection, checkfirst=True)


def make_indexes(connection: Connection) -> None:
    """Create missing indexes and update SQLite's statistics, in one transaction."""
    with _write_transaction(connection):
        for index in _indexes():
            index.create(connection, checkfirst=True)
        connection.exec_driver_sql("ANALYZE")


def is_indexed(connection: Connection) -> bool:
    """Tell whether all indexes exist."""
    # A bare cursor leaves no transaction open, which would block the next one.
    present = connection.connection.cursor()
    present.execute("SELECT name FROM sqlite_master WHERE type = 'index'")
    return {index.name for index in _indexes()} <= {name for (name,) in present.fetchall()}


def prepare(database: Database) -> None:
    """Let the file be written and read at once: changes go to a write-ahead log until `finish`."""
    with database_errors(database.path), closing(connect(database.path)) as connection:
        connection.execute("PRAGMA journal_mode = WAL")


def finish(database: Database) -> bool:
    """Merge the write-ahead log into the database, to make it one file that can be copied.

    Returns False if another process has the database open: it is consistent, but the log remains.
    """
    database.close()
    try:
        with database_errors(database.path), closing(connect(database.path)) as connection:
            (mode,) = connection.execute("PRAGMA journal_mode = DELETE").fetchone()
    except DatabaseError as error:
        if getattr(error.__cause__, "sqlite_errorcode", None) != sqlite3.SQLITE_BUSY:
            raise
        return False
    if mode == "delete":
        database.seal()
    return bool(mode == "delete")


@contextmanager
def _write_transaction(connection: Connection) -> Iterator[None]:
    """Open a transaction with the write lock, after a check of the seal.

    Disk errors are raised with their cause.
    """
    path = Path(connection.engine.url.database or "")
    with database_errors(path), connection.execution_options(immediate=True).begin():
        unseal(connection, path)
        yield


def _indexes() -> list[Index]:
    return sorted((i for table in Base.metadata.tables.values() for i in table.indexes), key=lambda i: str(i.name))


def _row_numbers(places: object, count: int) -> np.ndarray[Any, np.dtype[np.int64]]:
    """Check row numbers within the batch: a wrong one might refer to a row of an older batch."""
    rows = np.asarray(places, dtype=np.int64)
    if rows.size and (rows.min() < 0 or rows.max() >= count):
        raise ValueError(f"a row refers to one outside its batch, of {count} rows")
    return rows


def _insert(connection: Connection, table: str, count: int, columns: Columns) -> int:
    """Insert `count` rows with consecutive ids, if the table has ids, and return the first.

    The driver's own executemany is thrice as fast as SQLAlchemy's of dictionaries.
    """
    known = Base.metadata.tables[table].columns
    first = 1
    if "id" in known:
        first += connection.exec_driver_sql(f"SELECT coalesce(max(id), 0) FROM {table}").scalar_one()  # nosec B608  # names of our own tables
        columns = {"id": range(first, first + count), **columns}
    names = ", ".join(f'"{known[name].name}"' for name in columns)
    places = ", ".join("?" * len(columns))
    rows = zip(*(_values(column, count) for column in columns.values()), strict=True)
    cursor = cast(sqlite3.Cursor, connection.connection.cursor())  # unlike other cursors this one takes an iterator
    cursor.executemany(f"INSERT INTO {table} ({names}) VALUES ({places})", rows)  # nosec B608  # names of our own tables
    return first


def _values(column: object, count: int) -> Sequence[Any]:
    """Convert to Python's numbers and texts: SQLite would store NumPy's integers as blobs."""
    if isinstance(column, np.generic | np.ndarray):
        column = column.tolist()  # a single value remains one
    return column if isinstance(column, Sequence) and not isinstance(column, str | bytes) else [column] * count
