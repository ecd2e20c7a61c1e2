"""One database file, opened; its columns are read straight from the driver's cursor to arrays."""

from __future__ import annotations

import weakref
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any, Self

import numpy as np
from sqlalchemy import Boolean, Connection, Float, Integer, Numeric, Select, select
from sqlalchemy.dialects.sqlite import insert
from sqlalchemy.types import TypeEngine

from ..errors import DatabaseError
from ..kinematics.types import Array, Floats
from .engine import bring_up_to_date, database_errors, engine_for
from .models import PIVOTS, Guide, Mechanism, Reach, Setting

_CHUNK = 50_000  # rows held as Python objects at a time
_DTYPES = {Boolean: np.bool_, Integer: np.int64, Float: np.float64, Numeric: np.float64}


def read_columns(
    connection: Connection, select: Select[Any], bound: Mapping[str, Any] | None = None
) -> dict[str, Array]:
    """Return the columns of a Core select, by name.

    Parameters
    ----------
    select : Select
        Of single columns with distinct names (not of ORM entities).
    bound : mapping, optional
        Values of the select's bound parameters: to build a select once costs less than to build it for each value.

    Returns
    -------
    dict of ndarray, shape (n,)
        REAL as float64 with NaN for NULL, INTEGER as int64, comparisons as bool, TEXT as str objects (None for
        NULL).

    Raises
    ------
    TypeError
        If an INTEGER is NULL (say in the select what stands for it).
    """
    types: list[TypeEngine[Any]] = [column.type for column in select.selected_columns]
    result = connection.execute(select, bound)
    names, cursor = list(result.keys()), result.cursor
    assert cursor is not None  # a select has rows
    parts: list[list[Array]] = [[as_array(kind, ())] for kind in types]
    while rows := cursor.fetchmany(_CHUNK):
        for part, kind, values in zip(parts, types, zip(*rows, strict=True), strict=True):
            part.append(as_array(kind, values))
    result.close()
    return {name: np.concatenate(part[1:] or part) for name, part in zip(names, parts, strict=True)}


def as_array(kind: TypeEngine[Any], values: Sequence[Any]) -> Array:
    """Return the values of one column as an array of the dtype that its SQL type asks for."""
    return np.array(values, dtype=next((dtype for sql, dtype in _DTYPES.items() if isinstance(kind, sql)), object))


class Database:
    """A database file with current tables; leave it as a context manager, or `close` it."""

    def __init__(self, path: Path) -> None:
        self.path = path  # absolute
        self.engine = engine_for(path)  # whose connections begin a transaction with their first statement
        self._kept = engine_for(path, keep=True)  # for what is read again and again
        weakref.finalize(self, self._kept.dispose)  # also of one that nobody closes

    @classmethod
    def open(cls, path: str | PathLike[str], *, create: bool = True) -> Database:
        """Open the file `path`, upgrading older tables after a backup; if there is none and `create`, make an empty
        one, and the folders above it.

        Raises
        ------
        DatabaseTooNew
            If a newer version of the catalogue wrote it.
        DatabaseError
            If it is absent and not to be created, is not a database of the catalogue, is damaged or locked, or may
            not be read.
        """
        path = Path(path).expanduser().absolute()
        with database_errors(path):
            if not create and not path.exists():
                raise DatabaseError(f"{path} does not exist: run `catalogue build` first, or name another with --db")
            bring_up_to_date(path)
        return cls(path)

    @contextmanager
    def begin(self) -> Iterator[Connection]:
        """Yield a connection in a transaction that may write; it is committed at the end, rolled back on an error."""
        engine = self.engine.execution_options(immediate=True)
        with database_errors(self.path), engine.begin() as connection:
            yield connection

    def read(self, select: Select[*tuple[Any, ...]]) -> dict[str, Array]:
        """Return the named columns of `select` as arrays; see `read_columns`.

        Raises
        ------
        DatabaseError
            If the file is damaged or locked.
        """
        with database_errors(self.path), self.engine.connect() as connection:
            return read_columns(connection, select)

    @contextmanager
    def reading(self) -> Iterator[Callable[..., dict[str, Array]]]:
        """Yield a function like `read_columns` that keeps one connection, for several reads in a row."""
        with database_errors(self.path), self._kept.connect() as connection:
            yield partial(read_columns, connection)

    def get_setting(self, key: str) -> str | None:
        """Return the text kept under `key`, None if there is none."""
        found = self.read(select(Setting.value).where(Setting.key == key))["value"]
        return str(found[0]) if len(found) else None

    def set_setting(self, key: str, value: str) -> None:
        """Keep the text `value` under `key`, in place of what was there."""
        statement = insert(Setting).values(key=key, value=value)
        with self.begin() as connection:
            connection.execute(statement.on_conflict_do_update(index_elements=[Setting.key], set_={"value": value}))

    def close(self) -> None:
        """Let go of the file."""
        self.engine.dispose()
        self._kept.dispose()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __reduce__(self) -> tuple[Callable[[Path], Database], tuple[Path]]:
        """What was pickled opens the file anew."""
        return partial(Database.open, create=False), (self.path,)

    def __repr__(self) -> str:
        return f"Database({str(self.path)!r})"


#: What a stored reach is laid along a path by.
COLUMNS = (
    Guide.id.label("id"),
    *(Mechanism.family, Mechanism.series, Mechanism.member, Mechanism.configuration, *PIVOTS),
    *(Guide.x, Guide.y, Guide.kind, Guide.label, Guide.contact_order),
    *(Reach.level, Reach.half, Reach.centre, Reach.stroke, Reach.sweep, Reach.deviation),
    *(Reach.size, Reach.max_link, Reach.max_ground, Reach.max_arm),
)


def joined(*columns: Any) -> Select[Any]:
    """Return a select over reaches with their guides and mechanisms."""
    return (
        select(*columns)
        .select_from(Reach)
        .join(Guide, Guide.id == Reach.guide_id)
        .join(Mechanism, Mechanism.id == Guide.mechanism_id)
    )


def stacked_pivots(rows: Mapping[str, Array]) -> Floats:
    """Return the pivots in columns that were read, shape (n, 2, 2, 3): dyad, (fixed, moving), (x, y, w)."""
    return np.stack([rows[column.key] for column in PIVOTS], axis=-1).reshape(-1, 2, 2, 3)
