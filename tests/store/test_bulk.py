"""Whole batches or nothing, indexes after the load, one file at the end."""

from __future__ import annotations

import sqlite3
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sqlalchemy import Connection, func, select
from sqlalchemy.exc import InvalidRequestError

from catalogue.store import (
    PIVOTS,
    Base,
    Batch,
    Database,
    Guide,
    Mechanism,
    Reach,
    drop_indexes,
    finish,
    is_indexed,
    make_indexes,
    prepare,
    stacked_pivots,
    write_batch,
)

Sample = Callable[..., Any]


@pytest.fixture
def connection(database: Database) -> Iterator[Connection]:
    """Return a connection to an empty database, in no transaction."""
    with database.engine.connect() as opened:
        yield opened


def everything(database: Database, table: type[Base]) -> dict[str, np.ndarray[Any, Any]]:
    columns = Base.metadata.tables[table.__tablename__].columns
    return database.read(select(*columns).order_by(*columns[:2]))


def counts(database: Database) -> list[int]:
    tables = (Batch, Mechanism, Guide, Reach)
    return [int(database.read(select(func.count().label("n")).select_from(table))["n"][0]) for table in tables]


def assert_written(read: dict[str, np.ndarray[Any, Any]], given: dict[str, Any]) -> None:
    for name, column in given.items():
        expected = np.broadcast_to(np.asarray(column, dtype=read[name].dtype), read[name].shape)
        np.testing.assert_array_equal(read[name], expected, err_msg=name)


def test_what_was_written_is_read(database: Database, connection: Connection, sample: Sample) -> None:
    batch, mechanisms, guides, reaches = sample(7, 50)
    write_batch(connection, batch, mechanisms, guides, reaches)
    assert_written(everything(database, Batch), batch)
    stored = everything(database, Mechanism)
    np.testing.assert_array_equal(stacked_pivots(stored), mechanisms.pop("pivots"))
    rest = {name: column for name, column in stored.items() if name not in {column.key for column in PIVOTS}}
    assert_written(rest, {**mechanisms, "id": np.arange(1, 51), "batch_id": 1})
    guided, reached = guides.pop("mechanism"), reaches.pop("guide")
    assert_written(everything(database, Guide), {**guides, "mechanism_id": 1 + guided})
    same = {name: guides[name][reached] for name in ("kind", "cover")}
    assert_written(everything(database, Reach), {**reaches, "guide_id": 1 + reached, **same})


def test_keys_continue_and_stay_in_the_batch(database: Database, connection: Connection, sample: Sample) -> None:
    for number in range(3):
        write_batch(connection, *sample(number, 4))
    mechanisms, guides, reaches = (everything(database, table) for table in (Mechanism, Guide, Reach))
    np.testing.assert_array_equal(mechanisms["batch_id"], np.repeat([1, 2, 3], 4))
    np.testing.assert_array_equal(guides["mechanism_id"], np.repeat(np.arange(1, 13), 2))
    np.testing.assert_array_equal(reaches["guide_id"], np.repeat(np.arange(1, 25), 3))


def test_designs_entered_by_hand_have_no_batch(database: Database, connection: Connection, sample: Sample) -> None:
    _, mechanisms, guides, reaches = sample(0, 2)
    write_batch(connection, None, {**mechanisms, "name": ["Watt's", "Roberts's"]}, guides, reaches)
    read = database.read(select(Mechanism.name).where(Mechanism.batch_id.is_(None)))
    assert list(read["name"]) == ["Watt's", "Roberts's"]
    assert counts(database) == [0, 2, 4, 12]


def test_batch_may_be_without_mechanisms(database: Database, connection: Connection, sample: Sample) -> None:
    write_batch(connection, *sample(0, 0))
    assert counts(database) == [1, 0, 0, 0]


def test_same_batch_is_not_written_twice(database: Database, connection: Connection, sample: Sample) -> None:
    write_batch(connection, *sample(0))
    with pytest.raises(sqlite3.IntegrityError, match=r"UNIQUE.*batch\.number"):
        write_batch(connection, *sample(0))
    assert counts(database) == [1, 4, 8, 24]


@pytest.mark.parametrize(
    ("change", "error"),
    [
        ({"size": 0.0}, sqlite3.IntegrityError),
        ({"sweep": [0.0]}, ValueError),
        ({"length": 1.0}, KeyError),
        ({"guide": np.r_[8, np.arange(23) % 8]}, ValueError),
        ({"guide": np.r_[np.arange(23) % 8, -1]}, ValueError),
    ],
    ids=["broken rule", "short column", "unknown column", "guide past the end", "guide before the start"],
)
def test_batch_with_a_fault_leaves_nothing(
    database: Database, connection: Connection, sample: Sample, change: dict[str, Any], error: type[Exception]
) -> None:
    write_batch(connection, *sample(0))
    batch, mechanisms, guides, reaches = sample(1)
    with pytest.raises(error):
        write_batch(connection, batch, mechanisms, guides, {**reaches, **change})
    assert counts(database) == [1, 4, 8, 24]
    write_batch(connection, batch, mechanisms, guides, reaches)
    assert counts(database) == [2, 8, 16, 48]


def test_open_transaction_is_not_swallowed(connection: Connection, sample: Sample) -> None:
    connection.exec_driver_sql("SELECT 1")
    with pytest.raises(InvalidRequestError, match="already"):
        write_batch(connection, *sample(0))


def test_new_database_is_indexed(connection: Connection) -> None:
    assert is_indexed(connection)


def test_indexes_are_dropped_and_made_any_number_of_times(connection: Connection, sample: Sample) -> None:
    write_batch(connection, *sample(0))
    for change, state in ((drop_indexes, False), (make_indexes, True)):
        for _ in range(2):
            change(connection)
            assert is_indexed(connection) is state
    statistics = connection.exec_driver_sql("SELECT idx FROM sqlite_stat1").scalars().all()
    assert {"ix_reach_cover", "ix_guide_mechanism", "ix_mechanism_kind"} <= set(statistics)


def test_the_first_of_the_coverage_order_are_read_by_their_index(connection: Connection, sample: Sample) -> None:
    write_batch(connection, *sample(0, 100))
    make_indexes(connection)
    query = "SELECT * FROM reach WHERE kind = 'line' AND level IN (-3, -2) AND cover < 10"
    plan = [row[-1] for row in connection.exec_driver_sql(f"EXPLAIN QUERY PLAN {query}")]
    assert plan == ["SEARCH reach USING INDEX ix_reach_cover (kind=? AND level=? AND cover<?)"]


def test_filling_does_not_stop_readers(database: Database) -> None:
    prepare(database)
    with database.engine.connect() as connection, database.begin() as writer:
        writer.exec_driver_sql("INSERT INTO setting VALUES ('a', 'b')")
        assert connection.exec_driver_sql("SELECT count(*) FROM setting").scalar_one() == 0


def test_finished_database_is_one_file(database: Database, sample: Sample) -> None:
    prepare(database)
    with database.engine.connect() as connection:
        write_batch(connection, *sample(0))
        assert database.path.with_name("some.db-wal").stat().st_size > 0
    assert finish(database)
    assert [file.name for file in database.path.parent.iterdir()] == ["some.db"]
    assert counts(database) == [1, 4, 8, 24]
    assert [file.name for file in database.path.parent.iterdir()] == ["some.db"]


def test_finish_waits_for_nobody_and_can_be_repeated(
    database: Database, sample: Sample, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("catalogue.store.engine.PATIENCE", 0.01)
    prepare(database)
    with database.engine.connect() as connection:
        write_batch(connection, *sample(0))
        assert not finish(database)
    assert counts(database) == [1, 4, 8, 24]
    assert finish(database)


@pytest.mark.slow
def test_kill_at_any_moment_leaves_whole_batches(path: Path, filler: Path, environment: dict[str, str]) -> None:
    delays = np.random.default_rng(0).uniform(0, 0.15, 5)
    done = []
    for delay in delays:
        with subprocess.Popen([sys.executable, filler, path], env=environment, stdout=subprocess.PIPE) as process:
            assert process.stdout is not None
            assert process.stdout.readline().strip() == b"batch"
            time.sleep(delay)
            process.kill()
        assert process.returncode != 1  # it was at work until it was killed
        with Database.open(path, create=False) as database:
            batches, mechanisms, guides, reaches = counts(database)
            assert [mechanisms, guides, reaches] == [300 * batches, 600 * batches, 1800 * batches]
            kept = database.read(select(func.count(Mechanism.id).label("n")).group_by(Mechanism.batch_id))["n"]
            assert list(kept) == [300] * batches
        with closing(sqlite3.connect(path)) as connection:
            assert connection.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
            assert connection.execute("PRAGMA foreign_key_check").fetchall() == []
        done.append(batches)
    assert done == sorted(set(done))
    with Database.open(path) as database:
        with database.engine.connect() as open_connection:
            make_indexes(open_connection)
            assert is_indexed(open_connection)
        assert finish(database)
    assert [file.name for file in path.parent.iterdir()] == [path.name]
