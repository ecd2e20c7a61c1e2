"""Series of few guides per block, series that misbehave, and all that a built file holds."""

from __future__ import annotations

import fcntl
import os
import sqlite3
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

import catalogue
from catalogue.plugin.registry import Registry
from catalogue.populate.fill import fill
from catalogue.progress import Progress
from catalogue.store import Database

HERE = Path(__file__).parent
FEW = ("T.few", "T.less")

#: Rows without the keys that connect the tables, but with the identity of the batch and the order within it.
_BATCH = "b.series, b.member, b.seed, b.number, b.plan"
_CONTENT = {
    "batch": "SELECT * FROM batch b",
    "mechanism": f"SELECT {_BATCH}, m.* FROM mechanism m JOIN batch b ON b.id = m.batch_id",
    "guide": f"SELECT {_BATCH}, m.parameters, g.* FROM guide g JOIN mechanism m ON m.id = g.mechanism_id"
    " JOIN batch b ON b.id = m.batch_id",
    "reach": f"SELECT {_BATCH}, m.parameters, g.label, g.x, g.y, g.kind, r.* FROM reach r JOIN guide g ON"
    " g.id = r.guide_id JOIN mechanism m ON m.id = g.mechanism_id JOIN batch b ON b.id = m.batch_id",
    "setting": "SELECT * FROM setting",
    "index": "SELECT name, sql FROM sqlite_master WHERE type = 'index'",
}
_KEYS = {"id", "batch_id", "mechanism_id", "guide_id"}

Content = dict[str, list[tuple[Any, ...]]]


@pytest.fixture(scope="session")
def content() -> Callable[[Path], Content]:
    """Return a reader of everything that a file holds, keys aside, sorted."""

    def read(path: Path) -> Content:
        found = {}
        with closing(sqlite3.connect(path)) as connection:
            for table, query in _CONTENT.items():
                cursor = connection.execute(query)
                kept = [i for i, (name, *_) in enumerate(cursor.description) if name not in _KEYS]
                found[table] = sorted((tuple(row[i] for i in kept) for row in cursor), key=repr)
        return found

    return read


@pytest.fixture(scope="session")
def registry() -> Registry:
    """Return the built-in series, and two of few guides per block."""
    return Registry([str(HERE / "dropin")])


@pytest.fixture(scope="session")
def rude() -> Registry:
    """Return the built-in series, those of few guides, and those that misbehave."""
    return Registry([str(HERE / "dropin"), str(HERE / "rude")])


@pytest.fixture(scope="session")
def filled(registry: Registry) -> Callable[..., Progress]:
    """Return `fill` for a path, by default with 600 guides of the two small series, made by one process."""

    def run(path: Path, *, count: int = 600, series: tuple[str, ...] = FEW, **options: Any) -> Progress:
        with Database.open(path) as database:
            options = {"registry": registry, "processes": 1, **options}
            return fill(database, count=count, series=series, **options)

    return run


@pytest.fixture(scope="session")
def undisturbed(filled: Callable[..., Progress], once: Callable[..., Path]) -> Path:
    """Return a file that `filled` made in one go, by two processes."""
    return once("undisturbed.db", lambda path: filled(path, processes=2))


@pytest.fixture
def environment(tmp_path: Path) -> dict[str, str]:
    """Return an environment for the command, in which processes leave locks in `tmp_path`/locks while they live."""
    (tmp_path / "locks").mkdir()
    return {
        **os.environ,
        "CATALOGUE_PLUGINS": os.pathsep.join(str(HERE / name) for name in ("dropin", "watched")),
        "PYTHONPATH": str(Path(catalogue.__file__).parents[1]),
        "TEST_LOCKS": str(tmp_path / "locks"),
    }


@pytest.fixture
def all_gone(environment: dict[str, str]) -> Callable[[float], None]:
    """Return a check that all processes of `environment` have ended within so many seconds."""
    folder = Path(environment["TEST_LOCKS"])

    def runs(file: Path) -> bool:
        with file.open() as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
            except BlockingIOError:
                return True
        return False

    def check(seconds: float) -> None:
        end = time.monotonic() + seconds
        left = list(folder.iterdir())
        assert left, "no process has been seen"
        while (left := [file for file in left if runs(file)]) and time.monotonic() < end:
            time.sleep(0.02)
        assert not left, f"still run: {[file.name for file in left]}"

    return check
