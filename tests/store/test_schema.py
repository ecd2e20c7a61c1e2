"""A file says what it holds, in words and in views that are read with SQL alone."""

from __future__ import annotations

import sqlite3
import struct
from collections.abc import Callable
from contextlib import closing
from dataclasses import astuple
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from catalogue.store import Database, write_batch
from catalogue.store.schema import described

UNITS = {"", "deg", "stroke", "canonical", "1/canonical"}
NAMES = [f"{joint}_{dyad}_{part}" for dyad in (1, 2) for joint in ("fixed", "moving") for part in "xyw"]


def rows(path: Path, query: str) -> list[Any]:
    with closing(sqlite3.connect(path)) as connection:
        return connection.execute(query).fetchall()


@pytest.fixture
def filled(path: Path, sample: Callable[..., Any]) -> Path:
    """Return a file with one batch."""
    with Database.open(path) as database, database.engine.connect() as connection:
        write_batch(connection, *sample(0))
    return path


def test_every_table_view_and_column_is_described_in_the_file(database: Database) -> None:
    names = rows(database.path, "SELECT name, type FROM sqlite_master WHERE type IN ('table', 'view')")
    kinds = {name: kind for name, kind in names if not name.startswith("sqlite_")}
    held = {(name, "", kind) for name, kind in kinds.items()}
    for name in kinds:
        held |= {(name, *column[1:3]) for column in rows(database.path, f"PRAGMA table_info({name})")}
    told = rows(database.path, "SELECT table_name, column_name, type FROM description")
    assert {one[:2] for one in told} == {one[:2] for one in held}
    assert all(one in held for one in told if kinds[one[0]] == "table")


def test_what_the_file_says_is_what_the_models_say(database: Database) -> None:
    found = rows(database.path, "SELECT table_name, column_name, type, unit, meaning FROM description")
    assert sorted(found) == sorted(map(astuple, described()))


def test_every_description_says_something_in_one_line_with_a_known_unit() -> None:
    for one in described():
        assert len(one.meaning) > 3, one
        assert not set("[]\n") & set(one.meaning), one
        assert one.unit in UNITS, one


def test_views_show_what_was_written(filled: Path, sample: Callable[..., Any]) -> None:
    _, mechanisms, guides, _ = sample(0)
    found = np.array(rows(filled, f"SELECT {', '.join(NAMES)}, kappa, x FROM guides ORDER BY id"))
    parent = guides["mechanism"]
    np.testing.assert_array_equal(found[:, :12], mechanisms["pivots"].reshape(-1, 12)[parent])
    np.testing.assert_array_equal(found[:, 12], mechanisms["kappa"][parent])
    np.testing.assert_array_equal(found[:, 13], guides["x"])
    single = rows(filled, "SELECT x, y, w FROM pivots ORDER BY mechanism_id, dyad, joint = 'moving'")
    np.testing.assert_array_equal(np.reshape(single, (-1, 2, 2, 3)), mechanisms["pivots"])


@pytest.mark.slow
def test_pivots_of_an_older_file_are_the_same_numbers(path: Path, at_revision: Callable[[Path, str], Path]) -> None:
    """In a file of revision 0006 they are bytes; all is kept but the sign of zero, which SQLite does not store."""
    given = [-0.0, 1 / 3, 1.0, -2.5e-17, 5e-324, 1.0, 0.6, -0.8, 0.0, 1e300, -7.0, 1.0]
    at_revision(path, "0006")
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute(
            "INSERT INTO mechanism (id, family, configuration, series, member, parameters, pivots)"
            " VALUES (7, 'four-bar', 'TP', 'I.GG', 'plain', '{}', ?)",
            (struct.pack("<12d", *given),),
        )
    Database.open(path).close()
    (found,) = rows(path, f"SELECT {', '.join(NAMES)} FROM mechanism WHERE id = 7")
    assert list(found) == given


def test_views_follow_the_tables_through_an_upgrade(filled: Path, add_migration: Callable[[str], None]) -> None:
    add_migration(
        'with op.batch_alter_table("mechanism", recreate="always") as batch:\n'
        '    batch.add_column(sa.Column("note", sa.TEXT))'
    )
    Database.open(filled).close()
    assert rows(filled, "SELECT count(*) FROM guides") == [(8,)]
    assert rows(filled, "SELECT count(*) FROM pivots") == [(16,)]
