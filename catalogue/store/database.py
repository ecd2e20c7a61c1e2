"""One database file, opened."""

from __future__ import annotations

import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from sqlalchemy import Connection, Select

from ..errors import DatabaseError
from .closing import Closing
from .columns import read_columns
from .engine import engine_for
from .errors import database_errors
from .prepared import Prepared
from .upgrade import bring_up_to_date


class Database(Closing):
    """A database file with current tables; leave it as a context manager, or `close` it.

    Attributes
    ----------
    path : Path
        The file, absolute.
    engine : Engine
        For connections; a connection begins a transaction with its first statement.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.engine = engine_for(path)
        self._kept = engine_for(path, keep=True)  # for what is read again and again
        weakref.finalize(self, self._kept.dispose)  # also of one that nobody closes

    @classmethod
    def open(cls, path: str | PathLike[str], *, create: bool = True) -> Database:
        """Open the file `path`, upgrading older tables after a backup.

        Parameters
        ----------
        path : path
            The file.
        create : bool
            Whether to make an empty database, and the folders above it, if there is none.

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

    def read(self, select: Select[*tuple[Any, ...]]) -> dict[str, np.ndarray[Any, Any]]:
        """Return the named columns of `select` as arrays; see `read_columns`.

        Raises
        ------
        DatabaseError
            If the file is damaged or locked.
        """
        with database_errors(self.path), self.engine.connect() as connection:
            return read_columns(connection, select)

    @contextmanager
    def reading(self) -> Iterator[Callable[..., dict[str, np.ndarray[Any, Any]]]]:
        """Yield a function like `read_columns` that keeps one connection, for several reads in a row."""
        with database_errors(self.path), self._kept.connect() as connection:
            yield partial(read_columns, connection)

    @contextmanager
    def preparing(self) -> Iterator[Callable[[Select[Any]], Prepared]]:
        """Yield a function that makes a `Prepared` of a select, all on one connection."""
        with database_errors(self.path), self._kept.connect() as connection:
            yield partial(Prepared, connection)

    def close(self) -> None:
        """Let go of the file."""
        self.engine.dispose()
        self._kept.dispose()

    def __repr__(self) -> str:
        return f"Database({str(self.path)!r})"
