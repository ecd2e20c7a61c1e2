"""Opening: a file is made, taken as it is, or refused in one line that says what to do."""

from __future__ import annotations

import os
import shutil
import sqlite3
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sqlalchemy import func, select
from sqlalchemy.exc import IntegrityError

from catalogue.errors import DatabaseError
from catalogue.store import Batch, Database, Mechanism, write_batch
from catalogue.store.database import PIVOT_NAMES, _read

OPEN = "import sys; from catalogue.store import Database; Database.open(sys.argv[1]).close();"


@pytest.fixture
def filled(path: Path, sample: Callable[..., Any]) -> Path:
    """Return a file with one batch of some size."""
    with Database.open(path) as database, database.engine.connect() as connection:
        write_batch(connection, *sample(0, 400))
    return path


@pytest.fixture
def locked(filled: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Return a file that another connection keeps for itself."""
    monkeypatch.setattr("catalogue.store.engine.PATIENCE", 0.01)
    with closing(sqlite3.connect(filled)) as locker:
        locker.execute("BEGIN EXCLUSIVE")
        yield filled


def refused(path: Path, **options: Any) -> str:
    """Return what the refusal says, one line that names the file."""
    with pytest.raises(DatabaseError) as caught:
        Database.open(path, **options)
    said = str(caught.value)
    assert said.startswith(str(path))
    assert "\n" not in said
    return said


def test_absent_file_and_folders_are_made(tmp_path: Path) -> None:
    path = tmp_path / "new" / "folder" / "odd name %20 #?.db"
    with Database.open(path) as database:
        assert database.path == path
        assert list(database.read(select(Batch.id))["id"]) == []
    assert [file.name for file in path.parent.iterdir()] == [path.name]


def test_empty_file_is_taken_for_absent(path: Path) -> None:
    path.touch()
    with Database.open(path) as database:
        assert database.read(select(Batch.id))["id"].size == 0


def test_absent_file_is_not_made_unasked(path: Path) -> None:
    assert "catalogue build" in refused(path, create=False)
    assert not path.exists()


def test_current_file_is_opened_unchanged(filled: Path) -> None:
    before = filled.read_bytes()
    with Database.open(filled, create=False) as database:
        assert database.read(select(func.count(Mechanism.id).label("n")))["n"] == [400]
    assert filled.read_bytes() == before
    assert [file.name for file in filled.parent.iterdir()] == [filled.name]


@pytest.mark.slow
def test_current_file_is_opened_without_alembic(filled: Path, environment: dict[str, str]) -> None:
    check = f"{OPEN} sys.exit('alembic' in sys.modules)"
    subprocess.run([sys.executable, "-c", check, filled], env=environment, check=True)


@pytest.mark.slow
def test_processes_may_make_one_file_at_once(path: Path, environment: dict[str, str]) -> None:
    makers = [subprocess.Popen([sys.executable, "-c", OPEN, path], env=environment) for _ in range(3)]
    assert [maker.wait() for maker in makers] == [0, 0, 0]
    Database.open(path, create=False).close()


def test_text_is_refused(path: Path) -> None:
    path.write_text("not a database at all, but long enough to hold the header of one" * 9)
    assert refused(path).endswith("is not a database: name another with --db")


def test_truncated_file_is_refused(filled: Path) -> None:
    os.truncate(filled, filled.stat().st_size // 2)
    assert "is damaged: put it elsewhere and run `catalogue build`, or name another with --db" in refused(filled)


def test_damage_met_while_reading_is_told(filled: Path) -> None:
    content = filled.read_bytes()
    page = 4096
    filled.write_bytes(content[: 40 * page] + b"\xff" * (len(content) - 40 * page))
    with Database.open(filled) as database, pytest.raises(DatabaseError, match="is damaged"):
        database.read(select(Mechanism.kappa, Mechanism.parameters))


def columns(pivots: Any) -> dict[str, Any]:
    """Return columns as they are read, of linkages with these pivots."""
    return dict(zip(PIVOT_NAMES, np.asarray(pivots, float).reshape(-1, 12).T, strict=True))


FAR = [[[0, 0, 1], [1, 0.5, 1]], [[0.6, 0.8, 0], [2, 1, 1]]]


def test_stored_pivots_are_those_of_linkages(path: Path) -> None:
    """Points (x, y, 1) wherever they are, directions (x, y, 0) of length 1."""
    with Database.open(path) as database:
        good = np.array([FAR, [[[0, 0, 1], [100, 0.5, 1]], [[3, 4, 1], [0, 0.1, 1]]]], float)
        np.testing.assert_array_equal(database.pivots(columns(good)), good)
        for place, wrong in (
            ((1, 0), (1.2, 1.6, 0)), ((1, 0), (0.3, 0.4, 0)), ((1, 0), (0.6, 0.8 + 1e-6, 0)), ((0, 1), (1, 0.5, 2)),
            ((0, 1), (1, 0.5, 0.5)), ((1, 0), (0.6, 0.8, 1e-3)), ((0, 0), (0, 0, -1)),
        ):  # fmt: skip
            pivots = good.copy()
            pivots[0][place] = wrong
            with pytest.raises(DatabaseError, match="is damaged"):
                database.pivots(columns(pivots))


CUT = """
import sys
from catalogue.errors import DatabaseError
from catalogue.store import Database, Mechanism
from sqlalchemy import select
with Database.open(sys.argv[1]) as database:
    every = select(Mechanism.family, Mechanism.parameters)
    assert len(database.read(every)["family"])
    with open(sys.argv[1], "r+b") as file:
        file.truncate(4096)
    text = {"family": str, "parameters": str}
    for ask in (lambda: database.read(every), lambda: database.plain(text, "FROM mechanism")):
        try:
            ask()
        except DatabaseError as error:
            print(error)
"""


@pytest.mark.slow
def test_a_file_that_is_cut_short_while_it_is_open_is_told(
    small_db: Path, tmp_path: Path, environment: dict[str, str]
) -> None:
    """Of a file that is mapped the process would be killed by SIGBUS."""
    path = shutil.copy(small_db, tmp_path / "cut.db")
    done = subprocess.run(
        [sys.executable, "-c", CUT, path], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("is damaged: put it elsewhere and run `catalogue build`") >= 1


@pytest.mark.parametrize("table", ["mechanism", "alembic_version"])
def test_database_of_something_else_is_refused(path: Path, table: str) -> None:
    with closing(sqlite3.connect(path)) as connection:
        connection.execute(f"CREATE TABLE {table} (version_num)")
    before = path.read_bytes()
    assert "not one of the catalogue" in refused(path)
    assert path.read_bytes() == before


def test_folder_is_refused(tmp_path: Path) -> None:
    assert "is a folder" in refused(tmp_path)


def test_folder_that_cannot_be_made_is_told(filled: Path) -> None:
    assert "name another with --db" in refused(filled / "deeper" / "some.db")


def test_locked_file_is_told(locked: Path) -> None:
    assert "locked by another process" in refused(locked)


def test_lock_met_while_writing_is_told(filled: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("catalogue.store.engine.PATIENCE", 0.01)
    with Database.open(filled) as database, closing(sqlite3.connect(filled)) as locker:
        locker.execute("BEGIN IMMEDIATE")
        with pytest.raises(DatabaseError, match="locked by another process"):
            database.set_setting("seed", "1")


def test_full_disk_is_told(database: Database, sample: Callable[..., Any]) -> None:
    with database.engine.connect() as connection:
        connection.connection.cursor().execute("PRAGMA max_page_count = 60")
        with pytest.raises(DatabaseError, match=r"some\.db cannot grow, the disk is full"):
            write_batch(connection, *sample(0, 400))
    assert database.read(select(Batch.id))["id"].size == 0


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write everything")
@pytest.mark.parametrize("mode", [0o555, 0o755], ids=["closed folder", "open folder"])
def test_file_that_may_not_be_written_is_read(filled: Path, mode: int) -> None:
    filled.chmod(0o444)
    filled.parent.chmod(mode)
    try:
        with Database.open(filled) as database:
            assert database.read(select(Mechanism.id))["id"].size == 400
            with pytest.raises(DatabaseError, match="may not be written"):
                database.set_setting("seed", "1")
    finally:
        filled.parent.chmod(0o755)


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write everything")
def test_file_that_may_not_be_read_or_made_is_refused(filled: Path) -> None:
    filled.chmod(0)
    assert "check that you may read" in refused(filled)
    filled.parent.chmod(0o555)
    try:
        assert "check that you may read" in refused(filled.with_name("other.db"))
    finally:
        filled.parent.chmod(0o755)


def test_transaction_is_undone_on_an_error(database: Database) -> None:
    def interrupted() -> None:
        with database.begin() as connection:
            connection.exec_driver_sql("CREATE TABLE more (id)")
            connection.exec_driver_sql("INSERT INTO setting VALUES ('a', 'b')")
            raise KeyError

    with pytest.raises(KeyError):
        interrupted()
    with database.engine.connect() as connection:
        assert connection.exec_driver_sql("SELECT 1 FROM sqlite_master WHERE name = 'more'").all() == []
    assert database.get_setting("a") is None


def test_broken_rule_is_not_blamed_on_the_file(database: Database) -> None:
    with pytest.raises(IntegrityError), database.begin() as connection:
        connection.exec_driver_sql("INSERT INTO setting VALUES (NULL, 'b')")


@pytest.mark.slow
def test_setting_is_replaced(database: Database) -> None:
    assert database.get_setting("seed") is None
    database.set_setting("seed", "1")
    database.set_setting("seed", "2")
    assert database.get_setting("seed") == "2"


@pytest.mark.slow
def test_file_that_takes_the_place_of_another_is_read(filled: Path, tmp_path: Path) -> None:
    new = tmp_path / "new.db"
    Database.open(new).close()
    with Database.open(filled) as database:
        assert database.read(select(Mechanism.id))["id"].size == 400
        new.replace(filled)
        assert database.read(select(Mechanism.id))["id"].size == 0
        filled.unlink()
        with pytest.raises(DatabaseError, match="cannot be opened"):
            database.read(select(Mechanism.id))


def test_threads_read_at_the_same_time(filled: Path) -> None:
    def read_once(_: int) -> int:
        return int(database.read(select(Mechanism.id))["id"].size)

    with Database.open(filled) as database, ThreadPoolExecutor(8) as pool:
        assert set(pool.map(read_once, range(64))) == {400}


@pytest.mark.parametrize(
    ("name", "least", "most"),
    [("tangent_x", -1, 1), ("centre", -1, 1), ("min_transmission", 0, 90), ("level", -12, -1), ("deviation", 0, 1e300)],
)
def test_what_is_beyond_all_that_a_column_can_hold_is_refused(name: str, least: float, most: float) -> None:
    assert _read(name, float, [least, most]).tolist() == [least, most]
    for wrong in (least - 0.01, most + 0.01 * abs(most)):
        with pytest.raises(sqlite3.DataError, match=name):
            _read(name, float, [least, wrong])
