"""A sample of what `corrupt.py` does, and one case of each kind that fell: a documented error or a right answer."""

from __future__ import annotations

import os
import re
import runpy
import shutil
import sqlite3
import subprocess
import sys
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import catalogue
from catalogue import Catalogue, DatabaseError, InvalidRequest, StraightLine
from catalogue.store import Database, seal

LINE = StraightLine(100, 0.5)
QUESTIONS = ("find", "show", "export")


@pytest.fixture(scope="module")
def attack() -> SimpleNamespace:
    """Return `corrupt.py`."""
    return SimpleNamespace(**runpy.run_path(str(Path(__file__).with_name("corrupt.py"))))


@pytest.fixture
def copied(small_db: Path, tmp_path: Path) -> Path:
    """Return a database of its own."""
    return Path(shutil.copy(small_db, tmp_path / "copy.db"))


@pytest.mark.slow
def test_damaged_files_are_told_or_answer_rightly(small_db: Path, attack: SimpleNamespace) -> None:
    for what, question, came, case in attack.run(small_db, 10, seed=1, values=0.01, questions=QUESTIONS):
        assert not came.startswith("traceback"), (what, question, case, came)
        assert came != "other" or "value" in what, (what, question, case)


#: Column, value of `corrupt.VALUES`, and what is said of it.
IMPOSSIBLE = [
    ("mechanism.fixed_1_x", "NULL", "a pivot"),
    ("mechanism.fixed_1_x", "infinity", "fixed_1_x is inf"),
    ("mechanism.fixed_1_w", "-7", "CHECK constraint failed in mechanism"),
    ("mechanism.moving_2_x", "a word", "moving_2_x is no column of numbers"),
    ("mechanism.family", "a word", "family"),
    ("mechanism.family", "broken UTF-8", "Could not decode to UTF-8"),
    ("mechanism.parameters", "no JSON", "CHECK constraint|no JSON object|malformed"),
    ("mechanism.parameters", "a list", "no JSON object|CHECK constraint"),
    ("guide.kind", "no text", "CHECK constraint failed in guide"),
    ("guide.contact_order", "NULL", "contact_order"),
    ("guide.contact_order", "2**62", "contact_order"),
    ("reach.size", "-7", "size is -7|CHECK constraint"),
    ("reach.stroke", "NULL", "stroke"),
    ("reach.rotates", "infinity", "CHECK constraint failed in reach"),
]


@pytest.mark.parametrize(("where", "value", "said"), IMPOSSIBLE, ids=lambda value: str(value)[:24])
def test_what_cannot_be_is_told_in_one_line(
    copied: Path, attack: SimpleNamespace, where: str, value: str, said: str
) -> None:
    assert attack.tamper(copied, *where.split("."), value)
    error = attack.ask(copied, "export")
    assert isinstance(error, DatabaseError)
    assert re.search(rf"copy\.db is damaged \(.*({said}).*put it elsewhere and run", str(error)), str(error)


@pytest.mark.slow
def test_guides_whose_pivots_are_elsewhere_are_told_or_measured(copied: Path, attack: SimpleNamespace) -> None:
    assert attack.tamper(copied, "mechanism", "moving_1_x", "1e-320")
    told = 0
    with catalogue.open(copied, build=False) as opened:
        for number in range(1, 301, 10):
            try:
                assert np.isfinite(opened.guide(number).at(1.0).deviation)
            except DatabaseError as error:
                assert "measured again has another" in str(error)  # noqa: PT017  # of some
                told += 1
    assert told


@pytest.mark.slow
def test_names_that_are_too_long_are_shortened_in_an_error(copied: Path, attack: SimpleNamespace) -> None:
    assert attack.tamper(copied, "mechanism", "family", "a long text")
    with catalogue.open(copied, build=False) as opened, pytest.raises(InvalidRequest) as told:
        opened.find(LINE, families="four-bar")
    assert len(str(told.value)) < 300


def test_a_table_that_is_missing_is_told(copied: Path) -> None:
    with closing(sqlite3.connect(copied)) as file:
        file.execute("DROP TABLE setting")
    with pytest.raises(DatabaseError, match=r"is damaged .*no such table: setting"):
        catalogue.open(copied)


@pytest.mark.parametrize(("key", "asked"), [("count", {}), ("seed", {"count": 1})])
def test_a_setting_that_cannot_be_read_is_told(copied: Path, key: str, asked: dict[str, Any]) -> None:
    with closing(sqlite3.connect(copied, isolation_level=None)) as file:
        file.execute("UPDATE setting SET value = 'many' WHERE key = ?", [key])
        file.execute("UPDATE setting SET value = '' WHERE key = 'series'")
    with catalogue.open(copied, build=False) as opened, pytest.raises(DatabaseError, match=f"setting {key} is 'many'"):
        opened.build(**asked)


@pytest.mark.slow
def test_one_bit_is_noticed_by_whoever_quotes_the_file(copied: Path, attack: SimpleNamespace) -> None:
    """Also where the value could be: the seal says that it is not as it was written; who edits a file takes it away."""
    content = bytearray(copied.read_bytes())
    content[len(content) // 2] ^= 1
    copied.write_bytes(content)
    for question in ("show", "census", "export", "find"):
        assert "not as it was written" in str(attack.ask(copied, question))


@pytest.mark.slow
def test_a_large_file_is_read_in_blocks_with_the_same_digest(copied: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(seal, "LARGE", 0)
    with catalogue.open(copied, build=False) as opened:
        opened.database.check()
    content = bytearray(copied.read_bytes())
    content[-1] ^= 1
    copied.write_bytes(content)
    with catalogue.open(copied, build=False) as opened, pytest.raises(DatabaseError, match="not as it was written"):
        opened.database.check()


@pytest.mark.slow
def test_a_file_that_is_edited_and_says_so_is_read(copied: Path, small: Catalogue) -> None:
    with closing(sqlite3.connect(copied, isolation_level=None)) as file:
        file.executescript("PRAGMA user_version = 0; PRAGMA foreign_keys = ON; DELETE FROM guide WHERE id = 7")
    with catalogue.open(copied, build=False) as opened:
        assert [*opened.guides()["id"]] == [i for i in small.guides()["id"] if i != 7]


#: What writes to a file, by name.
WRITERS: dict[str, Callable[[Catalogue], object]] = {
    "build": lambda opened: opened.build(),
    "a larger build": lambda opened: opened.build(count=2000, processes=1),
    "a build of other series": lambda opened: opened.build(count=10, series=["I.GG"], processes=1),
    "build_collection": lambda opened: opened.build_collection("spatial-guidance", count=6),
    "set_setting": lambda opened: opened.database.set_setting("mine", "1"),
}


@pytest.mark.slow
@pytest.mark.parametrize("writer", WRITERS)
def test_no_command_that_writes_seals_a_file_that_was_changed(copied: Path, writer: str) -> None:
    with closing(sqlite3.connect(copied, isolation_level=None)) as file:
        file.execute("UPDATE reach SET size = size * 10")
    before = copied.read_bytes()
    with catalogue.open(copied, build=False) as opened:
        with pytest.raises(DatabaseError, match="not as it was written"):
            WRITERS[writer](opened)
        with pytest.raises(DatabaseError, match="not as it was written"):
            opened.find(LINE)
    assert copied.read_bytes() == before


@pytest.mark.slow
def test_a_build_on_a_changed_file_ends_with_the_code_of_a_damaged_one(copied: Path) -> None:
    with closing(sqlite3.connect(copied, isolation_level=None)) as file:
        file.execute("UPDATE reach SET size = size * 10")
    environment = {**os.environ, "CATALOGUE_DB": str(copied)}
    for _ in range(2):
        done = subprocess.run(
            [sys.executable, "-m", "catalogue", "build"], env=environment, capture_output=True, text=True, check=False
        )
        assert (done.returncode, "not as it was written" in done.stderr) == (4, True), done.stderr


def test_a_change_while_a_file_is_open_is_seen_before_it_is_written_to(copied: Path) -> None:
    with Database.open(copied) as opened:
        opened.check()
        with closing(sqlite3.connect(copied, isolation_level=None)) as file:
            file.execute("UPDATE reach SET size = size * 10")
        with pytest.raises(DatabaseError, match="not as it was written"):
            opened.set_setting("mine", "1")


@pytest.mark.slow
def test_what_writes_takes_the_seal_away_and_a_build_gives_it_back(copied: Path, small: Catalogue) -> None:
    def seal() -> int:
        with closing(sqlite3.connect(copied)) as file:
            return int(file.execute("PRAGMA user_version").fetchone()[0])

    assert seal()
    with catalogue.open(copied, build=False) as opened:
        opened.database.set_setting("mine", "1")
        assert not seal()
        opened.build(count=small.database.get_number("count", 0), series=small.database.get_setting("series").split())  # type: ignore[union-attr]
        assert seal()
        opened.database.check()


@pytest.mark.slow
def test_a_catalogue_without_guides_says_so(copied: Path) -> None:
    with closing(sqlite3.connect(copied, isolation_level=None)) as file:
        file.executescript("PRAGMA foreign_keys = ON; PRAGMA user_version = 0; DELETE FROM mechanism")
    with catalogue.open(copied) as opened:
        found = opened.find(LINE, refine=False)
        assert not found
        assert "the database holds no guides: `catalogue build` fills it" in found.explain()
        with pytest.raises(InvalidRequest, match="the database holds no guides"):
            opened.find(LINE, families="four-bar")
