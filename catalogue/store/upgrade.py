"""Which revision of the tables a file holds, and how an older one is brought up to date.

Alembic is imported only to create or upgrade: opening a file that is current costs two small queries.
"""

from __future__ import annotations

from contextlib import closing
from itertools import count
from pathlib import Path

from ..errors import DatabaseError, DatabaseTooNew
from ..folders import folder
from .engine import connect, engine_for
from .errors import database_errors
from .models import Base

_OURS = {"alembic_version", "mechanism", "guide"}


def revisions() -> list[str]:
    """Return the known revisions in order: a migration's file name starts with its number, which is its revision."""
    return sorted(file.stem.split("_")[0] for file in (folder("migrations") / "versions").glob("[0-9]*.py"))


def revision(path: Path) -> str | None:
    """Return the revision of the tables in the file `path`, None if the file is absent or empty.

    Raises
    ------
    DatabaseError
        If the file is a folder, not a database, or a database of something else.
    """
    if path.is_dir():
        raise DatabaseError(f"{path} is a folder: name a file with --db")
    if not path.exists() or path.stat().st_size == 0:
        return None
    with closing(connect(path)) as connection:
        tables = {name for (name,) in connection.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
        if not tables:
            return None
        found = connection.execute("SELECT version_num FROM alembic_version").fetchall() if tables >= _OURS else []
    if len(found) != 1:
        raise DatabaseError(f"{path} is a database, but not one of the catalogue: name another with --db")
    return str(found[0][0])


def bring_up_to_date(path: Path) -> None:
    """Create the tables in the file `path` if it has none, upgrade them if they are older than this package's.

    An older file is first copied to ``<name>.backup-<revision>`` beside it.

    Raises
    ------
    DatabaseTooNew
        If the file's revision is not one of this package's.
    DatabaseError
        If an upgrade fails; the file is then as it was.
    """
    found = revision(path)
    known = revisions()
    if found == known[-1]:
        return
    if found is None:
        path.parent.mkdir(parents=True, exist_ok=True)
        connect(path, create=True).close()
        _migrate(path)
    elif found not in known:
        raise DatabaseTooNew(
            f"{path} was written by a newer version of the catalogue (revision {found}, this one knows {known[-1]}): "
            "upgrade mechanism-catalogue, or name another with --db"
        )
    else:
        copy = _back_up(path, found)
        try:
            with database_errors(path):
                _migrate(path)
        except Exception as error:  # a migration may fail in any way, and the user must hear that nothing is lost
            reason = (str(error) or repr(error)).splitlines()[0]
            raise DatabaseError(
                f"{path} could not be upgraded from revision {found} to {known[-1]} ({reason}): "
                f"it is unchanged, and so is its copy {copy.name}"
            ) from error


def _back_up(path: Path, found: str) -> Path:
    """Copy the database to the first free backup name, and return that."""
    plain = path.with_name(f"{path.name}.backup-{found}")
    names = (plain if number == 1 else plain.with_name(f"{plain.name}-{number}") for number in count(1))
    copy = next(name for name in names if not name.exists())
    try:
        with closing(connect(path)) as source, closing(connect(copy, create=True)) as target:
            source.backup(target)
    except BaseException:
        copy.unlink(missing_ok=True)  # half a copy must not pass for one
        raise
    return copy


def _migrate(path: Path) -> None:
    """Run the missing migrations in one transaction."""
    from alembic import command
    from alembic.config import Config

    config = Config()
    config.set_main_option("script_location", str(folder("migrations")).replace("%", "%%"))
    engine = engine_for(path)
    try:
        with engine.connect().execution_options(immediate=True) as connection:
            # A batch migration drops and recreates a table, and a drop deletes the children by cascade.  The switch
            # does nothing inside a transaction, hence the bare cursor.
            connection.connection.cursor().execute("PRAGMA foreign_keys = OFF")
            with connection.begin():
                config.attributes.update(connection=connection, metadata=Base.metadata)
                command.upgrade(config, "head")
                orphans = connection.exec_driver_sql("PRAGMA foreign_key_check").fetchall()
                if orphans:
                    raise DatabaseError(f"{path} has {len(orphans)} rows without the row they refer to")
    finally:
        engine.dispose()
