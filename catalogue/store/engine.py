"""Connections to a database file, their errors, and migrations of its tables.

Alembic is imported only to create or upgrade tables, SQLAlchemy only for an engine: opening a
current file costs two small queries, and a `find` needs neither.
"""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
from dataclasses import dataclass
from filecmp import cmp
from functools import partial
from importlib import import_module
from itertools import chain, count
from pathlib import Path
from stat import S_IMODE
from typing import TYPE_CHECKING, Any, cast

from ..errors import DatabaseError, DatabaseTooNew, InvalidRequest, quoted, shortened
from ..folders import folder, make_folder, unused_name
from . import seal

if TYPE_CHECKING:
    from sqlalchemy import Connection, Engine

PATIENCE = 10.0  # time to wait for another process's lock [s]

_PRAGMAS = """
PRAGMA foreign_keys = ON;
PRAGMA synchronous = NORMAL;
PRAGMA cache_size = -65536;
PRAGMA mmap_size = 0;
"""  # without memory mapping: a truncated file raises an error and does not kill the process


_RENEW = "put it elsewhere and run `catalogue build`, or name another with --db"

_SAYINGS = {
    sqlite3.SQLITE_NOTADB: "is not a database: name another with --db",
    sqlite3.SQLITE_CORRUPT: f"is damaged: {_RENEW}",
    sqlite3.SQLITE_IOERR: f"cannot be read or written to the end, the disk may fail: {_RENEW}",
    sqlite3.SQLITE_FULL: "cannot grow, the disk is full: free some space, or name a file elsewhere with --db",
    sqlite3.SQLITE_BUSY: "is locked by another process: try again when that has finished",
    sqlite3.SQLITE_LOCKED: "is locked by another connection: try again when that has finished",
    sqlite3.SQLITE_READONLY: "may not be written: change the permissions of the file and its folder, "
    "or name another with --db",
    sqlite3.SQLITE_CANTOPEN: "cannot be opened: check that you may read and write it and its folder, "
    "or name another with --db",
    sqlite3.SQLITE_PERM: "may not be opened: change its permissions, or name another with --db",
}
#: Start of messages about values that only another program can have written.
IMPOSSIBLE = "impossible: "


@contextmanager
def database_errors(path: Path) -> Iterator[None]:
    """Convert errors of the disk, of permissions or of locks to a one-line `DatabaseError`.

    A violated constraint is a fault of the program, not of the file, and is raised unchanged. A
    statement that fails is a fault of the file, as all statements work on sound files.
    """
    try:
        yield
    except OSError as error:
        raise DatabaseError(f"{path} cannot be used ({error.strerror}): name another with --db") from error
    except UnicodeEncodeError as error:
        raise InvalidRequest(f"{quoted(error.object)} is no text: it has half of a pair of code units") from None
    except UnicodeDecodeError as error:  # an invalid text in SQLite's own description of the tables
        raise DatabaseError(f"{path} is damaged: {_RENEW}") from error
    except Exception as error:
        cause = getattr(error, "orig", error)  # SQLAlchemy's errors wrap the driver's
        if not isinstance(cause, sqlite3.Error):
            raise
        # The low byte is the kind of failure, the rest a detail of it.
        saying = _SAYINGS.get(getattr(cause, "sqlite_errorcode", 0) & 0xFF)
        if saying is None and isinstance(cause, sqlite3.OperationalError | sqlite3.DataError):
            saying = f"is damaged ({shortened(str(cause), 200)}): {_RENEW}"
        if saying is None:
            raise
        raise DatabaseError(f"{path} {saying}") from error


def connect(path: Path, *, writable: bool = True) -> sqlite3.Connection:
    """Connect to the file `path` (absolute) in autocommit mode: only BEGIN opens a transaction.

    SQLite itself falls back to reading a file without write permission.
    """
    uri = f"{path.as_uri()}?mode={'rw' if writable else 'ro'}"
    connection = sqlite3.connect(uri, uri=True, timeout=PATIENCE, isolation_level=None, check_same_thread=False)
    try:
        connection.executescript(_PRAGMAS)
    except sqlite3.Error:
        connection.close()
        raise
    return connection


def engine_for(path: Path, *, writable: bool = True) -> Engine:
    """Create an engine for the file `path` with transactions that include changes of tables.

    A connection with the execution option ``immediate`` acquires the write lock at once: a
    transaction that reads before it writes would fail, rather than wait, when another process
    writes in between. Connections are not pooled, so that a file that replaces this one is read.
    """
    from sqlalchemy import URL, create_engine, event
    from sqlalchemy.pool import NullPool

    creator: Callable[[], Any] = partial(connect, path, writable=writable)
    engine = create_engine(URL.create("sqlite", database=str(path)), pool=NullPool(creator))
    event.listen(engine, "begin", _begin)
    return engine


def _begin(connection: Connection) -> None:
    immediate = connection.get_execution_options().get("immediate", False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if immediate else "BEGIN")


def check_seal(connection: sqlite3.Connection, path: Path) -> None:
    """Raise `sqlite3.DataError` if a file has a seal and has changed since."""
    if seal.is_broken(connection, path):
        raise sqlite3.DataError(f"{IMPOSSIBLE}it is not as it was written")


def unseal(connection: Connection, path: Path) -> None:
    """Check the seal, then remove it, in a transaction that will write.

    A writer seals the file again at the end, and would seal a foreign change with it; hence the
    check.
    """
    driver = cast(sqlite3.Connection, connection.connection.driver_connection)
    check_seal(driver, path)
    driver.execute(seal.REMOVE)


@dataclass(frozen=True)
class Layout:
    """A kind of file: its tables, and the folder of its migrations."""

    what: str  #: name in messages
    tables: frozenset[str]  #: names of some of its tables, which identify the kind of file
    versions: str  #: folder below `migrations`
    models: str  #: module of its table classes, with their `Base`
    is_described: bool = False  #: whether it holds views and a description of its tables


#: A catalogue of guides.
CATALOGUE = Layout(
    "of the catalogue", frozenset({"mechanism", "guide"}), "versions", "catalogue.store.models", is_described=True
)


def revisions(layout: Layout = CATALOGUE) -> list[str]:
    """Return the known revisions in order; file names of migrations begin with them."""
    return sorted(file.stem.split("_")[0] for file in (folder("migrations") / layout.versions).glob("[0-9]*.py"))


def revision(path: Path, layout: Layout = CATALOGUE) -> str | None:
    """Read the revision of the tables in the file `path`; None for a missing or empty file.

    Raises
    ------
    DatabaseError
        If the file is a folder or a device, not a database, or a database of something else.
    """
    if path.exists() and not path.is_file():
        raise DatabaseError(f"{path} is a {'folder' if path.is_dir() else 'device'}: name a file with --db")
    if not path.exists() or path.stat().st_size == 0:
        return None
    with closing(connect(path)) as connection:
        tables = {name for (name,) in connection.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
        if not tables:
            return None
        ours = tables >= layout.tables | {"alembic_version"}
        found = connection.execute("SELECT version_num FROM alembic_version").fetchall() if ours else []
    if len(found) != 1:
        raise DatabaseError(f"{path} is a database, but not one {layout.what}: name another")
    return str(found[0][0])


def bring_up_to_date(path: Path, layout: Layout = CATALOGUE) -> None:
    """Create the tables in the file `path`, or upgrade older ones.

    An older file is first copied to ``<name>.backup-<revision>`` beside it: one copy per revision.

    Raises
    ------
    DatabaseTooNew
        If the file's revision is not one of this package's.
    DatabaseError
        If an upgrade fails; the file is then as it was.
    """
    found = revision(path, layout)
    known = revisions(layout)
    if found == known[-1]:
        return
    if found is None:
        make_folder(path.parent)
        with suppress(FileExistsError):  # SQLite would ignore the umask's permissions for the group
            path.touch(exist_ok=False)
        _migrate(path, layout)
    elif found not in known:
        raise DatabaseTooNew(
            f"{path} was written by a newer version of the catalogue (revision {found}, this one knows {known[-1]}): "
            "upgrade mechanism-catalogue, or name another with --db"
        )
    else:
        try:
            with database_errors(path):
                _migrate(path, layout)
        except Exception as error:  # a migration may fail in any way, and the user must learn that no data are lost
            reason = (str(error) or repr(error)).splitlines()[0]
            raise DatabaseError(
                f"{path} could not be upgraded from revision {found} to {known[-1]} ({reason}): it is unchanged"
            ) from error


@contextmanager
def _backup(path: Path, found: str) -> Iterator[None]:
    """Copy the database to the first free backup name, unless there is such a copy.

    The backup appears once complete, and is removed if the enclosed work fails.
    """
    endings = chain([""], (f"-{number}" for number in count(2)))
    copies = (path.with_name(f"{path.name}.backup-{found}{ending}") for ending in endings)
    part = unused_name(path, f"{path.name}.backup-")  # `catalogue doctor` lists incomplete copies of killed processes
    try:
        part.touch(0o600, exist_ok=False)
        part.chmod(S_IMODE(path.stat().st_mode))  # the copy has the permissions of the original
        with closing(connect(path)) as source, closing(connect(part)) as target:
            source.backup(target)
        copy = next(name for name in copies if not name.exists() or cmp(name, part, shallow=False))
        new = not copy.exists()
        if new:
            with part.open("rb+") as whole:
                os.fsync(whole.fileno())
            part.rename(copy)
    finally:
        part.unlink(missing_ok=True)
    try:
        yield
    except BaseException:
        if new:
            copy.unlink(missing_ok=True)
        raise


def _migrate(path: Path, layout: Layout) -> None:
    """Run the missing migrations and renew the description, in one transaction, after a backup."""
    from alembic import command
    from alembic.config import Config

    from .schema import describe, drop_views

    base = import_module(layout.models).Base
    config = Config()
    place = str(folder("migrations")).replace("%", "%%")
    config.set_main_option("script_location", place)
    config.set_main_option("path_separator", "newline")  # a folder may have a colon in its name
    config.set_main_option("version_locations", f"{place}/{layout.versions}")
    engine = engine_for(path)
    try:
        with engine.connect().execution_options(immediate=True) as connection:
            # A batch migration drops and recreates a table, and a drop deletes the children by
            # cascade.  The switch does nothing inside a transaction, hence the bare cursor.
            connection.connection.cursor().execute("PRAGMA foreign_keys = OFF")
            with ExitStack() as stack, connection.begin():
                older = revision(path, layout)  # another process may have upgraded it in the meantime
                if older == revisions(layout)[-1]:
                    return
                unseal(connection, path)
                if older is not None:
                    stack.enter_context(_backup(path, older))
                config.attributes.update(connection=connection, metadata=base.metadata)
                if layout.is_described:
                    drop_views(connection)  # SQLite renames no table that a view reads
                command.upgrade(config, "head")
                if layout.is_described:
                    describe(connection)
                orphans = connection.exec_driver_sql("PRAGMA foreign_key_check").fetchall()
                if orphans:
                    raise DatabaseError(f"{path} has {len(orphans)} rows without the row they refer to")
    finally:
        engine.dispose()
