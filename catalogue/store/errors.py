"""Errors of a database file, said in one line with the remedy."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sqlalchemy.exc import DBAPIError

from ..errors import DatabaseError

RENEW = "delete it and run `catalogue build`, or name another with --db"

_SAYINGS = {
    sqlite3.SQLITE_NOTADB: f"is not a database: {RENEW}",
    sqlite3.SQLITE_CORRUPT: f"is damaged: {RENEW}",
    sqlite3.SQLITE_IOERR: f"cannot be read or written to the end, the disk may fail: {RENEW}",
    sqlite3.SQLITE_FULL: "cannot grow, the disk is full: free some space, or name a file elsewhere with --db",
    sqlite3.SQLITE_BUSY: "is locked by another process: try again when that has finished",
    sqlite3.SQLITE_LOCKED: "is locked by another connection: try again when that has finished",
    sqlite3.SQLITE_READONLY: "may not be written: change the permissions of the file and its folder, "
    "or name another with --db",
    sqlite3.SQLITE_CANTOPEN: "cannot be opened: check that you may read and write it and its folder, "
    "or name another with --db",
    sqlite3.SQLITE_PERM: "may not be opened: change its permissions, or name another with --db",
}


@contextmanager
def database_errors(path: Path) -> Iterator[None]:
    """Turn what the disk, the permissions or another process do to `path` into a one-line `DatabaseError`.

    A broken constraint or a wrong statement is a fault of the program, not of the file, and passes unchanged.
    """
    try:
        yield
    except OSError as error:
        raise DatabaseError(f"{path} cannot be used ({error.strerror}): name another with --db") from error
    except (sqlite3.Error, DBAPIError) as error:
        cause = error.orig if isinstance(error, DBAPIError) else error
        # The low byte is the kind of failure, the rest a detail of it.
        saying = _SAYINGS.get(getattr(cause, "sqlite_errorcode", 0) & 0xFF)
        if saying is None:
            raise
        raise DatabaseError(f"{path} {saying}") from error
