"""An open database file; its columns are read directly from the driver's cursor to arrays."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from decimal import Decimal
from functools import cached_property, partial
from itertools import count
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from ..errors import DatabaseError, quoted
from ..folders import expanded
from ..kinematics.linkage import Linkage, faults
from ..kinematics.types import Array, Floats
from ..quantities import STORED
from . import engine as files
from . import seal
from .engine import CATALOGUE, IMPOSSIBLE, Layout, bring_up_to_date, check_seal, database_errors, engine_for, unseal

if TYPE_CHECKING:
    from sqlalchemy import Connection, Engine, Select

_CHUNK = 50_000  # rows held as Python objects at a time
#: Largest number that the file may hold.
LARGEST = 1.7e308
#: Range of stored values by column; all other numbers are finite.
_RANGES = {
    **{name: (column.range.least, column.range.most) for name, column in STORED.items()},
    **dict.fromkeys(("stroke", "half", "smallest", "rho0"), (5e-324, 1e300)),
    **dict.fromkeys(("deviation", "sweep"), (0, 1e300)),
    **dict.fromkeys(("centre", "tangent_x", "tangent_y"), (-1.000000001, 1.000000001)),
    **{"level": (-12, -1), "rotates": (0, 3), "contact_order": (1, 99)},
    **dict.fromkeys(("x", "y", "curvature", "all_x0", "all_y0", "all_x1", "all_y1"), (-1e300, 1e300)),
    **dict.fromkeys(("inflections", "cover", "seed", "number"), (0, 2**53)),
}
#: Columns in which NULL is a value.
_NULL = {
    *(name for name, column in STORED.items() if column.is_nullable),
    *("rho0", "name", "plugin", "plugin_version", "plan"),
}
_DTYPES = {bool: np.bool_, int: np.int64, float: np.float64, Decimal: np.float64}
#: Columns of the pivots of a mechanism in the order of its array (dyad, (fixed, moving), (x, y,
#: w)).
PIVOT_NAMES = tuple(f"{joint}_{dyad}_{part}" for dyad in (1, 2) for joint in ("fixed", "moving") for part in "xyw")
#: Reaches with their guides and mechanisms.
JOINED = "FROM reach JOIN guide ON guide.id = reach.guide_id JOIN mechanism ON mechanism.id = guide.mechanism_id"


def read_columns(
    connection: Connection, select: Select[Any], bound: Mapping[str, object] | None = None
) -> dict[str, Array]:
    """Return the columns of a Core select, by name.

    Parameters
    ----------
    select : Select
        Select of single columns with distinct names (not of ORM entities).
    bound : mapping, optional
        Values of the select's bound parameters: one select can then serve several values.

    Returns
    -------
    dict of ndarray, shape (n,)
        REAL as float64 with NaN for NULL, INTEGER as int64, comparisons as bool, TEXT as str
        objects (None for NULL, where it may be).

    Raises
    ------
    sqlite3.DataError
        If a value is impossible, such as a negative size or an INTEGER that is NULL (the select
        must replace NULL).
    """
    types = [column.type.python_type for column in select.selected_columns]
    result = connection.execute(select, bound)
    names, cursor = list(result.keys()), result.cursor
    assert cursor is not None  # a select has rows
    found = as_columns(cursor, dict(zip(names, types, strict=True)))
    result.close()
    return found


def as_columns(cursor: Any, types: Mapping[str, type]) -> dict[str, Array]:
    """Convert the rows of a driver's cursor to columns of given names and types."""
    parts: list[list[Array]] = [[as_array(kind, ())] for kind in types.values()]
    while rows := cursor.fetchmany(_CHUNK):
        for part, (name, kind), values in zip(parts, types.items(), zip(*rows, strict=True), strict=True):
            part.append(_read(name, kind, values))
    return {name: np.concatenate(part[1:] or part) for name, part in zip(types, parts, strict=True)}


def as_array(kind: type, values: Sequence[object]) -> Array:
    """Convert the values of one column to an array of their Python type's dtype."""
    return np.array(values, dtype=_DTYPES.get(kind, object))


def _read(name: str, kind: type, values: Sequence[object]) -> Array:
    """Convert the values of a column to an array; `sqlite3.DataError` for an invalid value.

    Stored values may have been changed by other programs.
    """
    try:
        found = as_array(kind, values)
    except (TypeError, ValueError, OverflowError):
        raise sqlite3.DataError(f"{IMPOSSIBLE}{name} is no column of numbers") from None
    if found.dtype == object:
        distinct = {*values} - ({None} if name in _NULL else set()) if kind is str else set()
        # characters that would control a terminal
        wrong = [v for v in distinct if not isinstance(v, str) or not v.isprintable()]
    elif found.dtype.kind == "f" or name in _RANGES:
        low, high = _RANGES.get(name, (-LARGEST, LARGEST))
        good = (found >= low) & (found <= high)
        wrong = found[~good & ~np.isnan(found) if name in _NULL or name not in _RANGES else ~good].tolist()
    else:
        wrong = []
    if wrong:
        raise sqlite3.DataError(f"{IMPOSSIBLE}{name} is {quoted(wrong[0])}")
    return found


class Database:
    """A database file with current tables; leave it as a context manager, or `close` it."""

    def __init__(self, path: Path, *, writable: bool = True) -> None:
        self.path = path  # absolute
        self.writable = writable
        self._checked: tuple[int, ...] = ()

    @cached_property
    def engine(self) -> Engine:
        """An engine whose connections begin a transaction with their first statement."""
        return engine_for(self.path, writable=self.writable)

    def _connect(self) -> sqlite3.Connection:
        return files.connect(self.path, writable=self.writable)

    @classmethod
    def open(
        cls, path: str | PathLike[str], *, create: bool = True, writable: bool = True, layout: Layout = CATALOGUE
    ) -> Self:
        """Open a database file, upgrading an older one after a backup.

        Parameters
        ----------
        path : path
        create : bool
            Create a missing file with its folders.
        writable : bool
            Otherwise the file must exist and be current, and is only read.
        layout : Layout
            Kind of file.

        Raises
        ------
        DatabaseTooNew
            If a newer version of the catalogue wrote it.
        DatabaseError
            If it is absent and not to be created, is not a database of the catalogue, is damaged or
            locked, or may not be read.
        """
        if not isinstance(path, str | PathLike):
            raise DatabaseError(f"{quoted(path)} is no path of a file: name one with --db")
        with database_errors(Path(path)):
            path = expanded(path).absolute()
            if not (create and writable) and not path.exists():
                raise DatabaseError(f"{path} does not exist: run `catalogue build` first, or name another with --db")
            if writable:
                bring_up_to_date(path, layout)
            elif files.revision(path, layout) != files.revisions(layout)[-1]:
                raise DatabaseError(f"{path} is not of this version: `catalogue build` brings it up to date")
        return cls(path, writable=writable)

    @contextmanager
    def begin(self) -> Iterator[Connection]:
        """Yield a connection in a transaction that may write.

        It is committed at the end, rolled back on an error.

        Raises
        ------
        DatabaseError
            If the file has changed since it was sealed, or cannot be written.
        """
        engine = self.engine.execution_options(immediate=True)
        with database_errors(self.path), engine.begin() as connection:
            unseal(connection, self.path)
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

    @property
    def has_guides(self) -> bool:
        """Whether any guide is stored; `DatabaseError` as in `plain`."""
        return bool(len(self.plain({"id": int}, "FROM guide LIMIT 1")["id"]))

    def plain(self, columns: Mapping[str, type], rest: str, values: Iterable[object] = ()) -> dict[str, Array]:
        """Read columns, given with their Python types, by the SQL text SELECT columns rest.

        Like `read`, without SQLAlchemy: its import would take longer than the reading in a search.

        Raises
        ------
        DatabaseError
            If the file is damaged or locked.
        """
        with database_errors(self.path), closing(self._connect()) as connection:
            cursor = connection.execute(f"SELECT {', '.join(columns)} {rest}", tuple(values))
            return as_columns(cursor, {name.rpartition(".")[2]: kind for name, kind in columns.items()})

    def objects(self, texts: Iterable[str], *, numbers: bool = False) -> list[dict[str, Any]]:
        """Parse stored texts as JSON objects; `DatabaseError` for an invalid one.

        With `numbers`, values must be finite numbers and names printable.
        """
        with database_errors(self.path):
            try:
                found = [json.loads(text) for text in texts]
            except (ValueError, RecursionError, TypeError):
                found = [None]
            if not all(isinstance(one, dict) for one in found):
                raise sqlite3.DataError(f"{IMPOSSIBLE}a text is no JSON object")
            for name, value in (item for one in found for item in one.items() if numbers):
                if not name.isprintable() or type(value) not in (int, float) or not abs(value) <= LARGEST:
                    raise sqlite3.DataError(f"{IMPOSSIBLE}parameter {quoted(name)} is {quoted(value)}")
            return found

    def pivots(self, rows: Mapping[str, Array]) -> Floats:
        """Return `stacked_pivots` after a check that they form linkages.

        Otherwise raise `DatabaseError`.
        """
        found = stacked_pivots(rows)
        far = found[..., 2] == 0
        with database_errors(self.path):
            if not np.isin(found[..., 2], (0, 1)).all() or (abs(np.hypot(*found[far, :2].T) - 1) > 1e-9).any():
                raise sqlite3.DataError(f"{IMPOSSIBLE}a pivot is not (x, y, 1), nor (x, y, 0) of length 1")
            if wrong := [text for text in faults(found) if text]:
                raise sqlite3.DataError(f"{IMPOSSIBLE}{wrong[0]}")
            if "family" in rows and (wrong := rows["family"][rows["family"] != Linkage.trusted(found).family].tolist()):
                raise sqlite3.DataError(f"{IMPOSSIBLE}the family of other pivots is {quoted(wrong[0])}")
        return found

    def check(self, *, rules: bool = True) -> None:
        """Verify the file by its seal, unless it is unchanged since the last check.

        A file without a seal (build incomplete, or changed since) is checked by the constraints of
        its tables if `rules`.

        Raises
        ------
        DatabaseError
            If it is damaged.
        """
        with database_errors(self.path):
            found = self.path.stat()
            stamp = (found.st_mtime_ns, found.st_size)
            if self._checked in ((*stamp, True), (*stamp, rules)):
                return
            with closing(self._connect()) as connection:
                check_seal(connection, self.path)
                if rules and not seal.is_sealed(connection):
                    [(said,)] = connection.execute("PRAGMA integrity_check(1)").fetchall()
                    orphan = connection.execute("PRAGMA foreign_key_check").fetchone()
                    if said != "ok" or orphan:
                        raise sqlite3.DataError(IMPOSSIBLE + (said if said != "ok" else f"orphans in {orphan[0]}"))
            self._checked = (*stamp, rules)

    def check_values(self) -> None:
        """Read and check every value of all tables and views.

        Raises
        ------
        DatabaseError
            If a value is invalid, or a table or view is missing.
        """
        from sqlalchemy import select

        from .models import Base
        from .schema import VIEWS

        for name, table in Base.metadata.tables.items():
            # an INTEGER that may be NULL refers to a row that may be missing
            columns = [c for c in table.columns if not (c.nullable and c.type.python_type is int)]
            for start in count(0, _CHUNK):
                rows = self.read(select(*columns).limit(_CHUNK).offset(start))
                if name == "mechanism":
                    self.pivots(rows)
                for text in ("parameters", "metrics"):
                    self.objects(rows.get(text, ()), numbers=name == "mechanism")
                if len(next(iter(rows.values()))) < _CHUNK:
                    break
        for view in VIEWS:
            self.plain({"count(*)": int}, f"FROM {view}")

    def stamp(self) -> tuple[int, ...]:
        """Return the size of the file, and the modification times of file and write-ahead log.

        Raises
        ------
        DatabaseError
            If the file is missing.
        """
        with database_errors(self.path):
            found, log = self.path.stat(), self.path.with_name(f"{self.path.name}-wal")
            return found.st_size, found.st_mtime_ns, *(path.stat().st_mtime_ns for path in (log,) if path.exists())

    def seal(self) -> None:
        """Store a digest of the file in it, by which `check` detects any change.

        A write removes the digest.
        """
        with database_errors(self.path), closing(files.connect(self.path)) as connection:
            connection.execute("BEGIN IMMEDIATE")
            connection.execute(f"PRAGMA user_version = {seal.digest_now(connection, self.path)}")
            connection.execute("COMMIT")

    def get_setting(self, key: str) -> str | None:
        """Return the text stored under `key`, None if there is none."""
        found = self.plain({"value": str}, "FROM setting WHERE key = ?", [key])["value"]
        return str(found[0]) if len(found) else None

    def get_number(self, key: str, default: int) -> int:
        """Return the whole number stored under `key`, or a default.

        Raises
        ------
        DatabaseError
            If the stored value is no whole number.
        """
        text = self.get_setting(key)
        with database_errors(self.path):
            if text and not text.isdecimal():
                raise sqlite3.DataError(f"{IMPOSSIBLE}the setting {key} is {quoted(text)}")
        return int(text) if text else default

    def set_setting(self, key: str, value: str) -> None:
        """Store the text `value` under `key`, replacing any."""
        from sqlalchemy.dialects.sqlite import insert

        from .models import Setting

        statement = insert(Setting).values(key=key, value=value)
        with self.begin() as connection:
            connection.execute(statement.on_conflict_do_update(index_elements=[Setting.key], set_={"value": value}))

    def close(self) -> None:
        """Close the connections to the file."""
        if "engine" in vars(self):
            self.engine.dispose()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __reduce__(self) -> tuple[Callable[[Path], Database], tuple[Path]]:
        """Reduce to the path: an unpickled database opens the file."""
        return partial(Database.open, create=False, writable=self.writable), (self.path,)

    def __repr__(self) -> str:
        return f"Database({str(self.path)!r})"


def stacked_pivots(rows: Mapping[str, Array]) -> Floats:
    """Stack columns of pivots, shape (n, 2, 2, 3): dyad, (fixed, moving), (x, y, w)."""
    return np.stack([rows[name] for name in PIVOT_NAMES], axis=-1).reshape(-1, 2, 2, 3)
