"""``catalogue doctor``: check installation and database, and name repairs."""

from __future__ import annotations

import os
import platform
import shlex
import sqlite3
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import closing
from glob import escape
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import NamedTuple

import click
from click.exceptions import Exit

from ..errors import CatalogueError, DatabaseError, PluginError
from ..folders import answers_file, default_database, user_folder
from ..installed import fault
from ..progress import busy
from . import VERSION
from .options import DB, FORMAT, PLUGINS
from .tables import print_records, print_table, tell

#: Packages to report, required or of an extra.
PACKAGES = (
    "numpy",
    "scipy",
    "SQLAlchemy",
    "alembic",
    "pluggy",
    "click",
    "rich",
    "matplotlib",
    "pandas",
    "pyarrow",
    "starlette",
    "jinja2",
    "uvicorn",
    "ezdxf",
    "xlsxwriter",
    "build123d",
)
#: Extra of each optional package.
EXTRAS = {
    "matplotlib": "plot",
    "pyarrow": "parquet",
    "starlette": "web",
    "jinja2": "web",
    "uvicorn": "web",
    "ezdxf": "cad",
    "xlsxwriter": "cad",
    "build123d": "step",
}


class Finding(NamedTuple):
    """A line of the report; `code` is the exit code of a fault, or 0."""

    what: str
    found: str
    remedy: str = ""
    code: int = 0


@click.command(params=[DB, PLUGINS, FORMAT])
def doctor(db: Path | None, plugins: Sequence[str], format: str) -> None:
    """Check the installation and the database, and name the command that repairs each fault.

    Nothing is changed.

    Reports versions, the database with its revision and integrity, rejected plugins, copies made
    before upgrades, and the user's data directory.
    """
    file = (db or default_database()).absolute()
    with busy("looking"):
        found = [*_check_packages(), *_database(file), *_upgrade_copies(file), *_plugins(plugins), *_check_user_data()]
    records = [{"what": f.what, "found": f.found, "remedy": f.remedy, "sound": not f.code} for f in found]
    if format == "table":
        _print(found)
    else:
        print_records(format, records, "", ["", "found", "remedy"], [f[:3] for f in found])
    if wrong := [f.code for f in found if f.code]:
        raise Exit(min(wrong))


def _print(found: Sequence[Finding]) -> None:
    """Print the report, with a remedy for each fault."""
    print_table("Doctor", ["", "~found"], [f[:2] for f in found])
    remedies = [f for f in found if f.remedy]
    if remedies:
        print_table("What mends or removes it", ["", "~remedy"], [(f.what, f.remedy) for f in remedies])
    wrong = sum(bool(f.code) for f in found)
    tell(f"{wrong} of these are wrong" if wrong else "nothing is wrong")


def _check_packages() -> Iterator[Finding]:
    yield Finding("mechanism-catalogue", f"{VERSION} in {Path(__file__).parents[1]}")
    yield Finding("Python", f"{platform.python_version()} at {sys.executable}, {platform.platform()}")
    yield Finding("SQLite", sqlite3.sqlite_version)
    if told := fault():
        yield Finding("name clash", "two distributions own the package `catalogue`", told, PluginError.exit_code)
    else:
        yield Finding("name clash", "none: the unrelated distribution `catalogue` is not installed")
    for name in PACKAGES:
        try:
            yield Finding(name, version(name))
        except PackageNotFoundError:
            extra = EXTRAS.get(name)
            yield Finding(name, "not installed", f'pip install "mechanism-catalogue[{extra}]"' if extra else "")


def _database(file: Path) -> Iterator[Finding]:
    from ..store import Database
    from ..store.engine import connect, database_errors, revision, revisions

    if not file.exists():
        yield Finding("database", f"{file} is not there", "`catalogue build` makes it, the first `find` too")
        return
    try:
        with database_errors(file):
            now, newest = revision(file), revisions()[-1]
            yield Finding("database", f"{file}, {_size(file)}")
            if now is None:
                yield Finding("revision", "the file is empty", "`catalogue build` fills it")
                return
            if now not in revisions():
                yield Finding("revision", f"{now}, newer than {newest}", "upgrade mechanism-catalogue", 4)
                return
            yield Finding("revision", now, "" if now == newest else f"any command upgrades it to {newest}")
            with closing(connect(file)) as connection:
                (state,) = connection.execute("PRAGMA integrity_check(1)").fetchone()
                orphans = connection.execute("PRAGMA foreign_key_check").fetchmany(1)
                held = {
                    table: connection.execute(f"SELECT count(*) FROM {table}").fetchone()[0]  # nosec B608  # our own
                    for table in ("mechanism", "guide", "specimens")
                    if connection.execute("SELECT 1 FROM sqlite_master WHERE name = ?", (table,)).fetchone()
                }
                done = connection.execute("SELECT value FROM setting WHERE key = 'complete'").fetchone()
        if state != "ok" or orphans:
            remedy = "put it elsewhere and run `catalogue build`"
            yield Finding("integrity", str(state) if state != "ok" else "rows without the row they refer to", remedy, 4)
        else:
            if now == newest:
                with Database.open(file, writable=False) as opened:
                    opened.check(rules=False)
                    opened.check_values()
            yield Finding("integrity", "ok")
        counted = ", ".join(f"{number} {table.removesuffix('s')}s" for table, number in held.items())
        whole = done == ("yes",)
        yield Finding("content", counted, "" if whole else "`catalogue build` goes on with what was begun")
    except DatabaseError as error:
        yield Finding("database", str(error), "", error.exit_code)


def _upgrade_copies(file: Path) -> Iterator[Finding]:
    """Yield copies made before upgrades, and incomplete ones."""
    for copy in sorted(file.parent.glob(f"{escape(file.name)}.backup*")):
        yield Finding("backup", f"{copy}, {_size(copy)}", _removal(copy))


def _plugins(folders: Sequence[str]) -> Iterator[Finding]:
    from ..plugin.registry import Registry

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the report shows them
        try:
            registry = Registry(folders)
            names = [*registry.collections]
        except CatalogueError as error:
            yield Finding("plugins", str(error), "", PluginError.exit_code)
            return
    sound = [r for r in registry.records if not r.error]
    yield Finding("plugins", f"{len(sound)}, with {len(registry.series)} series and {len(names)} collections")
    for r in registry.records:
        if r.error:
            yield Finding(f"plugin {r.name}", r.error, f"mend or remove {r.origin}", PluginError.exit_code)


def _check_user_data() -> Iterator[Finding]:
    folder = user_folder()
    held = sorted(path for path in folder.rglob("*") if path.is_file()) if folder.is_dir() else []
    yield Finding("data directory", f"{folder}, {len(held)} files", _removal(folder) if held else "")
    for path in held:
        yield Finding("", f"{path.relative_to(folder)}, {_size(path)}")
    answers = answers_file()
    if answers.exists() and answers not in held:
        yield Finding("answers", f"{answers}, {_size(answers)}", _removal(answers))


def _size(file: Path) -> str:
    size = file.stat().st_size
    return f"{size / 1e6:.1f} MB" if size >= 1e5 else f"{size / 1e3:.1f} kB"


def _removal(path: Path) -> str:
    """Return the shell command to remove a file or folder on this system."""
    if os.name == "nt":
        return f'rmdir /s "{path}"' if path.is_dir() else f'del "{path}"'
    return f"rm {'-r ' * path.is_dir()}{shlex.quote(str(path))}"
