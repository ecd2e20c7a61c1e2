"""One database file, opened; its columns are read straight from the driver's cursor to arrays."""

from __future__ import annotations

import weakref
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from decimal import Decimal
from functools import cached_property, partial
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from ..errors import DatabaseError, quoted
from ..folders import expanded
from ..kinematics.types import Array, Floats
from . import engine as files
from .engine import bring_up_to_date, database_errors, engine_for

if TYPE_CHECKING:
    from sqlalchemy import Connection, Engine, Select

_CHUNK = 50_000  # rows held as Python objects at a time
_DTYPES = {bool: np.bool_, int: np.int64, float: np.float64, Decimal: np.float64}
#: Columns of the pivots of a mechanism in the order of its array (dyad, (fixed, moving), (x, y, w)).
PIVOT_NAMES = tuple(f"{joint}_{dyad}_{part}" for dyad in (1, 2) for joint in ("fixed", "moving") for part in "xyw")
#: Reaches with their guides and mechanisms.
JOINED = "FROM reach JOIN guide ON guide.id = reach.guide_id JOIN mechanism ON mechanism.id = guide.mechanism_id"


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
    types = [column.type.python_type for column in select.selected_columns]
    result = connection.execute(select, bound)
    names, cursor = list(result.keys()), result.cursor
    assert cursor is not None  # a select has rows
    found = as_columns(cursor, dict(zip(names, types, strict=True)))
    result.close()
    return found


def as_columns(cursor: Any, types: Mapping[str, type]) -> dict[str, Array]:
    """Return what a cursor of the driver holds as columns of these names and types."""
    parts: list[list[Array]] = [[as_array(kind, ())] for kind in types.values()]
    while rows := cursor.fetchmany(_CHUNK):
        for part, kind, values in zip(parts, types.values(), zip(*rows, strict=True), strict=True):
            part.append(as_array(kind, values))
    return {name: np.concatenate(part[1:] or part) for name, part in zip(types, parts, strict=True)}


def as_array(kind: type, values: Sequence[Any]) -> Array:
    """Return the values of one column as an array of the dtype that their Python type asks for."""
    return np.array(values, dtype=_DTYPES.get(kind, object))


class Database:
    """A database file with current tables; leave it as a context manager, or `close` it."""

    def __init__(self, path: Path) -> None:
        self.path = path  # absolute

    @cached_property
    def engine(self) -> Engine:
        """An engine whose connections begin a transaction with their first statement."""
        return engine_for(self.path)

    @cached_property
    def _kept(self) -> Engine:
        """An engine for what is read again and again."""
        kept = engine_for(self.path, keep=True)
        weakref.finalize(self, kept.dispose)  # also of one that nobody closes
        return kept

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
        if not isinstance(path, str | PathLike):
            raise DatabaseError(f"{quoted(path)} is no path of a file: name one with --db")
        with database_errors(Path(path)):
            path = expanded(path).absolute()
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

    def plain(self, columns: Mapping[str, type], rest: str, values: Iterable[Any] = ()) -> dict[str, Array]:
        """Return columns, given with their Python types, of the SQL text SELECT columns rest, as `read` does: a `find`
        reads so little that to import SQLAlchemy would take it longer.

        Raises
        ------
        DatabaseError
            If the file is damaged or locked.
        """
        with database_errors(self.path), closing(files.connect(self.path)) as connection:
            cursor = connection.execute(f"SELECT {', '.join(columns)} {rest}", tuple(values))
            return as_columns(cursor, {name.rpartition(".")[2]: kind for name, kind in columns.items()})

    @contextmanager
    def reading(self) -> Iterator[Callable[..., dict[str, Array]]]:
        """Yield a function like `read_columns` that keeps one connection, for several reads in a row."""
        with database_errors(self.path), self._kept.connect() as connection:
            yield partial(read_columns, connection)

    def get_setting(self, key: str) -> str | None:
        """Return the text kept under `key`, None if there is none."""
        found = self.plain({"value": str}, "FROM setting WHERE key = ?", [key])["value"]
        return str(found[0]) if len(found) else None

    def set_setting(self, key: str, value: str) -> None:
        """Keep the text `value` under `key`, in place of what was there."""
        from sqlalchemy.dialects.sqlite import insert

        from .models import Setting

        statement = insert(Setting).values(key=key, value=value)
        with self.begin() as connection:
            connection.execute(statement.on_conflict_do_update(index_elements=[Setting.key], set_={"value": value}))

    def close(self) -> None:
        """Let go of the file."""
        for engine in [vars(self)[name] for name in ("engine", "_kept") if name in vars(self)]:
            engine.dispose()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __reduce__(self) -> tuple[Callable[[Path], Database], tuple[Path]]:
        """What was pickled opens the file anew."""
        return partial(Database.open, create=False), (self.path,)

    def __repr__(self) -> str:
        return f"Database({str(self.path)!r})"


def stacked_pivots(rows: Mapping[str, Array]) -> Floats:
    """Return the pivots in columns that were read, shape (n, 2, 2, 3): dyad, (fixed, moving), (x, y, w)."""
    return np.stack([rows[name] for name in PIVOT_NAMES], axis=-1).reshape(-1, 2, 2, 3)
