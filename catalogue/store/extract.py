"""A small database of some guides, complete without the catalogue."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import closing
from pathlib import Path
from shutil import copyfileobj
from tempfile import TemporaryDirectory
from typing import BinaryIO

from .database import Database
from .engine import connect, database_errors

#: Tables of the extract, each copied from the table or view of the same name, so that programs can
#: read either.
_TABLES = {
    "guides": "id IN wanted",
    "pivots": "mechanism_id IN (SELECT mechanism_id FROM extract.guides)",
    "reach": "guide_id IN wanted",
    "description": "table_name IN ('guides', 'pivots', 'reach', 'description')",
}


def write_extract(database: Database, guides: Iterable[int], file: BinaryIO) -> None:
    """Write guides, by their numbers, to a database of four tables.

    The tables are ``guides``, ``pivots``, ``reach`` and ``description``.

    Raises
    ------
    DatabaseError
        If the guides cannot be written.
    """
    with TemporaryDirectory() as folder:  # private to the user: SQLite opens its files by their names
        extract = Path(folder) / "extract.db"
        with database_errors(extract), closing(connect(database.path)) as connection:
            connection.execute("ATTACH ? AS extract", (f"{extract.as_uri()}?mode=rwc",))
            connection.execute("CREATE TEMP TABLE wanted (id INTEGER PRIMARY KEY)")
            connection.execute("BEGIN")
            connection.executemany("INSERT INTO wanted VALUES (?)", ((number,) for number in guides))
            for table, condition in _TABLES.items():
                connection.execute(f"CREATE TABLE extract.{table} AS SELECT * FROM main.{table} WHERE {condition}")  # nosec B608  # names of our own tables
            connection.execute("CREATE UNIQUE INDEX extract.guides_id ON guides (id)")
            connection.execute("CREATE UNIQUE INDEX extract.reach_guide ON reach (guide_id, level)")
            connection.execute("COMMIT")
        with extract.open("rb") as content:
            copyfileobj(content, file)
