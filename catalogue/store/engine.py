"""Connections to one file: plain ones of sqlite3, and the engine that hands them to SQLAlchemy."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from sqlalchemy import URL, Connection, Engine, create_engine, event
from sqlalchemy.exc import DisconnectionError
from sqlalchemy.pool import NullPool, QueuePool

PATIENCE = 10.0  # how long to wait for another process's lock [s]

_PRAGMAS = """
PRAGMA foreign_keys = ON;
PRAGMA synchronous = NORMAL;
PRAGMA cache_size = -65536;
PRAGMA mmap_size = 2147418112;
"""


def connect(path: Path, *, create: bool = False) -> sqlite3.Connection:
    """Return a connection to the file `path` (absolute) in which only an explicit BEGIN opens a transaction.

    Where the file may not be written, SQLite falls back to reading by itself.
    """
    mode = "rwc" if create else "rw"
    connection = sqlite3.connect(
        f"{path.as_uri()}?mode={mode}", uri=True, timeout=PATIENCE, isolation_level=None, check_same_thread=False
    )
    try:
        connection.executescript(_PRAGMAS)
    except sqlite3.Error:
        connection.close()
        raise
    return connection


def engine_for(path: Path, *, keep: bool = False) -> Engine:
    """Return an engine on the existing file `path` whose transactions are real, for tables as well as for rows.

    A connection with the execution option ``immediate`` takes the write lock at once: a transaction that reads before
    it writes would fail, not wait, when another process writes in between.

    Parameters
    ----------
    keep : bool
        Keep a connection for later: what it has mapped of a large file need not be mapped again.  Until the engine is
        disposed of, the log of what is written meanwhile is not folded into the file.  A file that has taken the place
        of this one is noticed.
    """
    creator: Callable[[], Any] = partial(connect, path)
    pool = QueuePool(creator, pool_size=1, max_overflow=-1) if keep else NullPool(creator)
    engine = create_engine(URL.create("sqlite", database=str(path)), pool=pool)
    event.listen(engine, "begin", _begin)
    if keep:
        event.listen(engine, "connect", lambda _, record: record.info.update(file=_identity(path)))
        event.listen(engine, "checkout", partial(_check, path))
    return engine


def _begin(connection: Connection) -> None:
    immediate = connection.get_execution_options().get("immediate", False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if immediate else "BEGIN")


def _check(path: Path, _: Any, record: Any, __: Any) -> None:
    """Have the pool connect again unless the connection is to the file that is there now, made by this process."""
    if record.info["file"] != _identity(path):
        raise DisconnectionError(f"{path} is another file now")


def _identity(path: Path) -> tuple[int, ...]:
    try:
        found = path.stat()
    except OSError:
        return ()  # to connect again says what is wrong
    return os.getpid(), found.st_dev, found.st_ino
