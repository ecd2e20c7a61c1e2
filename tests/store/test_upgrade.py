"""Migrations lead to the models' tables, and an upgrade loses nothing."""

from __future__ import annotations

import json
import sqlite3
import struct
from collections.abc import Callable
from contextlib import closing
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest
from alembic.autogenerate import compare_metadata
from alembic.config import Config
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import create_engine, func, select

import catalogue
from catalogue.errors import DatabaseError, DatabaseTooNew
from catalogue.folders import folder
from catalogue.store import PIVOTS, Base, Database, SpecimenRow, write_batch
from catalogue.store.engine import revision, revisions
from catalogue.store.schema import describe

HEAD = revisions()[-1]
NEXT = f"{int(HEAD) + 1:04}"
ADD_COLUMN = """
with op.batch_alter_table("mechanism", recreate="always") as batch:
    batch.add_column(sa.Column("note", sa.TEXT))
"""
FAIL = """
op.create_table("more", sa.Column("id", sa.INTEGER))
op.execute("DELETE FROM reach")
raise ValueError("no\\nway")
"""
ORPHAN = "op.execute('DELETE FROM mechanism WHERE id = 1')"


def rows(path: Path, query: str) -> list[Any]:
    with closing(sqlite3.connect(path)) as connection:
        return connection.execute(query).fetchall()


def schema(connection: sqlite3.Connection) -> dict[str, str]:
    found = connection.execute("SELECT name, sql FROM sqlite_master WHERE name NOT LIKE 'sqlite_%'")
    return {name: " ".join(sql.split()) for name, sql in found if name != "alembic_version"}


def fill_backwards(old: Path, built: Path, mechanisms: str = "TRUE") -> None:
    """Fill the tables of an older revision with mechanisms, and all that belongs to them, of a file of today."""
    made = {
        "pivots": f"blob({', '.join(column.key for column in PIVOTS)})",
        "balance": "size - min_transmission / 90",
        "floor": "size - min_transmission / 90",
        "spread": "0.0",
        "inner_sweep": "iif(sweep > 0, sweep, NULL)",
        "inner_size": "iif(sweep > 0, size, NULL)",
        "inner_transmission": "iif(sweep > 0, min_transmission, NULL)",
        **dict.fromkeys(("halfway", "farther"), "iif(sweep > 0, NULL, 1.0)"),
        **dict.fromkeys(("still", "grows", "angle", "turns"), "iif(sweep > 0, 1.0, NULL)"),
    }
    wanted = {
        "batch": "TRUE",
        "mechanism": mechanisms,
        "guide": "mechanism_id IN (SELECT id FROM main.mechanism) AND contact_order >= 2",  # all that old files took
        "reach": "guide_id IN (SELECT id FROM main.guide)",
    }
    with closing(sqlite3.connect(old)) as target, target:
        target.execute("ATTACH ? AS built", (str(built),))
        target.create_function("blob", len(PIVOTS), lambda *numbers: struct.pack("<12d", *numbers))
        for table, condition in wanted.items():
            names = [row[1] for row in target.execute(f"PRAGMA main.table_info({table})")]
            held = {row[1] for row in target.execute(f"PRAGMA built.table_info({table})")}
            chosen = [name if name in held else made[name] for name in names]
            target.execute(
                f"INSERT INTO main.{table} ({', '.join(names)}) SELECT {', '.join(chosen)} FROM built.{table}"
                f" WHERE {condition}"
            )


@pytest.fixture
def filled(path: Path, sample: Callable[..., Any]) -> Path:
    """Return a file at revision `HEAD` with one batch."""
    with Database.open(path) as database, database.engine.connect() as connection:
        write_batch(connection, *sample(0))
    return path


def test_last_file_is_the_head() -> None:
    config = Config()
    config.set_main_option("script_location", str(folder("migrations")))
    scripts = ScriptDirectory.from_config(config)
    assert [script.revision for script in scripts.walk_revisions()] == revisions()[::-1]


def test_migrated_tables_are_those_of_the_models(database: Database) -> None:
    with database.engine.connect() as connection:
        assert compare_metadata(MigrationContext.configure(connection), Base.metadata) == []


def test_migrated_schema_is_written_like_that_of_the_models(database: Database, tmp_path: Path) -> None:
    modelled = tmp_path / "modelled.db"
    engine = create_engine(f"sqlite:///{modelled}")
    Base.metadata.create_all(engine)
    with engine.begin() as connection:
        describe(connection)
    engine.dispose()
    with closing(sqlite3.connect(database.path)) as one, closing(sqlite3.connect(modelled)) as other:
        assert schema(one) == schema(other)
        assert schema(one)["reach"].endswith("STRICT")


def test_upgrade_keeps_all_rows_and_a_copy(filled: Path, add_migration: Callable[[str], None]) -> None:
    before = filled.read_bytes()
    add_migration(ADD_COLUMN)
    with Database.open(filled) as database, database.engine.connect() as connection:
        assert connection.exec_driver_sql("SELECT count(note), count(*) FROM mechanism").one() == (0, 4)
        assert connection.exec_driver_sql("SELECT count(*) FROM reach").scalar_one() == 24
        assert connection.exec_driver_sql("PRAGMA foreign_keys").scalar_one() == 1
        ddl = connection.exec_driver_sql("SELECT sql FROM sqlite_master WHERE name = 'mechanism'").scalar_one()
        assert "STRICT" in ddl
        assert "ck_mechanism_curvature" in ddl
    assert revision(filled) == NEXT
    copy = filled.with_name(f"some.db.backup-{HEAD}")
    assert rows(copy, "SELECT version_num FROM alembic_version") == [(HEAD,)]
    assert rows(copy, "SELECT count(*) FROM reach") == [(24,)]
    assert len(copy.read_bytes()) == len(before)


def test_a_file_that_was_changed_since_it_was_sealed_is_not_upgraded(
    filled: Path, add_migration: Callable[[str], None]
) -> None:
    with Database.open(filled) as database:
        database.seal()
    with closing(sqlite3.connect(filled)) as connection, connection:
        connection.execute("UPDATE reach SET size = size * 10")
    before = filled.read_bytes()
    add_migration(ADD_COLUMN)
    with pytest.raises(DatabaseError, match="not as it was written"):
        Database.open(filled)
    assert filled.read_bytes() == before
    assert [file.name for file in filled.parent.glob("some.db*")] == ["some.db"]


def test_older_copy_is_not_overwritten(filled: Path, add_migration: Callable[[str], None]) -> None:
    filled.with_name(f"some.db.backup-{HEAD}").write_text("precious")
    add_migration(ADD_COLUMN)
    Database.open(filled).close()
    assert filled.with_name(f"some.db.backup-{HEAD}").read_text() == "precious"
    assert revision(filled.with_name(f"some.db.backup-{HEAD}-2")) == HEAD


@pytest.mark.parametrize(("body", "reason"), [(FAIL, r"\(no\)"), (ORPHAN, "2 rows without")])
def test_failed_upgrade_leaves_the_file_as_it_was(
    filled: Path, add_migration: Callable[[str], None], body: str, reason: str
) -> None:
    before = filled.read_bytes()
    add_migration(body)
    with pytest.raises(DatabaseError, match=reason) as caught:
        Database.open(filled)
    assert filled.read_bytes() == before
    assert str(caught.value).endswith("it is unchanged")
    assert "\n" not in str(caught.value)
    assert [file.name for file in filled.parent.glob("some.db*")] == ["some.db"]  # no copy per attempt


def test_upgrade_that_was_killed_after_its_copy_makes_no_second_one(
    filled: Path, add_migration: Callable[[str], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    add_migration(ADD_COLUMN)
    with monkeypatch.context() as killed:
        killed.setattr(Path, "unlink", lambda *_, **__: None)  # of a process that is gone
        killed.setattr("alembic.command.upgrade", lambda *_: 1 / 0)
        with pytest.raises(DatabaseError):
            Database.open(filled)
    copy = filled.with_name(f"some.db.backup-{HEAD}")
    assert copy.exists()
    left, other = filled.parent.glob("*.part"), filled.with_name("some.db.backup.part")
    assert not [*left]  # the name was given to the copy
    other.write_bytes(b"of the user")
    Database.open(filled).close()
    assert revision(filled) == NEXT
    assert {file.name for file in filled.parent.glob("some.db*")} == {"some.db", copy.name, other.name}
    assert other.read_bytes() == b"of the user"


def test_a_published_revision_is_as_it_was_published() -> None:
    """What a file went through cannot be told from its revision otherwise: write another one."""
    files = sorted((folder("migrations") / "versions").glob("[0-9]*.py"))
    now = {file.stem: sha256("".join(file.read_text("utf-8").split()).encode()).hexdigest() for file in files}
    assert now == json.loads((Path(__file__).parents[1] / "golden" / "revisions.json").read_text("utf-8"))


@pytest.mark.slow
@pytest.mark.parametrize("older", revisions()[:-1])
def test_a_file_of_any_revision_is_upgraded_and_used(
    small_db: Path, tmp_path: Path, at_revision: Callable[[Path, str], Path], older: str
) -> None:
    old = at_revision(tmp_path / "old.db", older)
    fill_backwards(old, small_db, "batch_id IS NULL OR batch_id < 4")
    with catalogue.open(old, build=False) as cat, catalogue.open(small_db, build=False) as now:
        assert revision(old) == HEAD
        found = cat.find(catalogue.StraightLine(1, 0.01), refine=False, limit=5)
        assert len(found) == 5
        assert all(one.deviation <= 0.01 for one in found)
        for name in ("watt", int(found[0].id or 0)):
            assert cat.guide(name).at(1.0).to_dict() == now.guide(name).at(1.0).to_dict()
    copies = [file.name for file in tmp_path.glob("old.db*")]
    assert sorted(copies) == ["old.db", f"old.db.backup-{older}"]


@pytest.mark.slow
def test_specimens_that_two_processes_stored_are_there_once(
    path: Path, at_revision: Callable[[Path, str], Path]
) -> None:
    at_revision(path, "0007")
    names = "collection, family, series, configuration, kind, block, deviation, parameters, metrics"
    values = ("a", "b", "c", "d", "line", 0, 0.5, "{}", '{"size": 1.0}')
    with closing(sqlite3.connect(path)) as connection, connection:
        for size in (1, 2, 1, 2):
            changed = (*values[:-1], f'{{"size": {size}}}')
            connection.execute(f"INSERT INTO specimens ({names}) VALUES ({', '.join('?' * 9)})", changed)
    Database.open(path).close()
    held = rows(path, "SELECT id, place, metrics FROM specimens ORDER BY id")
    assert held == [(1, 0, '{"size": 1}'), (2, 1, '{"size": 2}')]


def test_failed_copy_leaves_none(
    filled: Path, add_migration: Callable[[str], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    add_migration(ADD_COLUMN)
    with closing(sqlite3.connect(filled)) as locker:
        locker.execute("BEGIN EXCLUSIVE")
        monkeypatch.setattr("catalogue.store.engine.PATIENCE", 0.01)
        monkeypatch.setattr("catalogue.store.engine.revision", lambda *_: HEAD)
        with pytest.raises(DatabaseError, match="locked"):
            Database.open(filled)
    assert not list(filled.parent.glob("*.backup*"))


@pytest.mark.slow
def test_newer_file_is_refused(filled: Path) -> None:
    with closing(sqlite3.connect(filled)) as connection, connection:
        connection.execute("UPDATE alembic_version SET version_num = '0999'")
    before = filled.read_bytes()
    with pytest.raises(DatabaseTooNew, match=r"0999.*upgrade mechanism-catalogue"):
        Database.open(filled)
    assert filled.read_bytes() == before


@pytest.mark.slow
def test_a_file_without_specimens_gets_their_table(path: Path, at_revision: Callable[[Path, str], Path]) -> None:
    (migration,) = (folder("migrations") / "versions").glob("*_specimens.py")
    at_revision(path, revisions()[revisions().index(migration.stem.partition("_")[0]) - 1])
    assert rows(path, "SELECT count(*) FROM sqlite_master WHERE name = 'specimens'") == [(0,)]
    with Database.open(path) as database:
        found = database.read(select(func.count(SpecimenRow.id).label("rows")))
    assert found["rows"].tolist() == [0]
    assert rows(path, "SELECT sql LIKE '%STRICT%' FROM sqlite_master WHERE name = 'specimens'") == [(1,)]


@pytest.mark.slow
def test_guides_of_an_older_file_are_put_in_an_order_of_coverage(
    path: Path, tmp_path: Path, sample: Callable[..., Any], at_revision: Callable[[Path, str], Path]
) -> None:
    """A file of revision 0005, filled with the same rows, is brought to what is stored today."""
    with Database.open(path) as database, database.engine.connect() as connection:
        for number in range(2):
            write_batch(connection, *sample(number))
        _, mechanisms, guides, reaches = sample(2, 1)
        write_batch(connection, None, {**mechanisms, "name": ["Watt's"]}, {**guides, "cover": 0}, reaches)
    old = at_revision(tmp_path / "old.db", "0005")
    fill_backwards(old, path)
    Database.open(old).close()
    assert revision(old) == HEAD
    with closing(sqlite3.connect(old)) as one, closing(sqlite3.connect(path)) as other:
        assert schema(one) == schema(other)
        for table in ("mechanism", "reach", "guide", "batch"):
            columns = [row[1] for row in one.execute(f"PRAGMA table_info({table})") if row[1] != "cover"]
            query = f"SELECT {', '.join(columns)} FROM {table} ORDER BY 1, 2"
            assert one.execute(query).fetchall() == other.execute(query).fetchall(), table
        differ = "SELECT count(*) FROM reach JOIN guide ON id = guide_id WHERE reach.cover <> guide.cover"
        assert one.execute(differ).fetchone() == (0,)
        drawn = "SELECT cover FROM guide WHERE kind = 'circle' AND mechanism_id < 9 ORDER BY id"
        assert [row[0] for row in one.execute(drawn)] == list(range(8))
        assert one.execute("SELECT max(cover) FROM guide WHERE mechanism_id = 9").fetchone() == (0,)
        assert one.execute("PRAGMA foreign_key_check").fetchall() == []
