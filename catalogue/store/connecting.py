"""Connections to one file: plain ones of sqlite3, and the engine that hands them to SQLAlchemy."""

from __future__ import annotations

import sqlite3
from functools import partial
from pathlib import Path

from sqlalchemy import URL, Connection, Engine, create_engine, event
from sqlalchemy.pool import NullPool

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


def engine_for(path: Path) -> Engine:
    """Return an engine on the existing file `path` whose transactions are real, for tables as well as for rows.

    A connection with the execution option ``immediate`` takes the write lock at once: a transaction that reads before
    it writes would fail, not wait, when another process writes in between.
    """
    # Without a pool: a connection kept for later would keep the file from being folded into one, moved or deleted.
    engine = create_engine(URL.create("sqlite", database=str(path)), creator=partial(connect, path), poolclass=NullPool)
    event.listen(engine, "begin", _begin)
    return engine


def _begin(connection: Connection) -> None:
    immediate = connection.get_execution_options().get("immediate", False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if immediate else "BEGIN")
