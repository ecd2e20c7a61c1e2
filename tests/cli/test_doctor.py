"""`catalogue doctor` says what is wrong, changes nothing, and its exit code is that of what is wrong."""

from __future__ import annotations

import json
import os
import shutil
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from catalogue.store.engine import revisions

Run = Callable[..., Any]


def told(done: Any) -> dict[str, dict[str, Any]]:
    return {one["what"]: one for one in json.loads(done.out)}


@pytest.fixture
def file(small_db: Path, tmp_path: Path) -> Path:
    return Path(shutil.copy(small_db, tmp_path / "some [1].db"))


@pytest.mark.slow
def test_all_is_well(run: Run, file: Path) -> None:
    before = file.read_bytes()
    done = run("doctor", "--db", file, "--format", "json")
    found = told(done)
    assert done.code == 0
    assert (found["revision"]["found"], found["integrity"]["found"]) == (revisions()[-1], "ok")
    assert "guides" in found["content"]["found"]
    assert all(one["sound"] for one in found.values())
    assert file.read_bytes() == before
    assert [path.name for path in file.parent.iterdir()] == [file.name]


@pytest.mark.slow
def test_what_is_wrong_is_named_with_its_remedy(run: Run, file: Path, tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "bad.py").write_text("1 / 0")
    copy = file.with_name(f"{file.name}.backup-0006")
    copy.write_bytes(b"a copy")
    done = run("doctor", "--db", file, "--plugins", tmp_path / "mine", "--format", "json")
    found = told(done)
    assert done.code == 5
    assert found["plugin bad"]["found"] == "ZeroDivisionError: division by zero"
    assert found["plugin bad"]["remedy"] == f"mend or remove {tmp_path / 'mine' / 'bad.py'}"
    assert str(copy) in found["backup"]["remedy"]
    with file.open("r+b") as damaged:
        damaged.seek(file.stat().st_size // 2)
        damaged.write(bytes(200_000))
    done = run("doctor", "--db", file)
    assert done.code == 4
    assert "integrity" in done.out or "damaged" in done.out


@pytest.mark.slow
@pytest.mark.parametrize(
    "change",
    ["DROP TABLE reach", "DROP TABLE description", "DROP TABLE specimens", "DROP VIEW guides",
     """UPDATE mechanism SET parameters = '{"a1": "x"}'""", "UPDATE guide SET label = CAST(x'fffe41' AS TEXT)",
     "UPDATE guide SET label = char(27) || '[2J' WHERE id = 7"],
)  # fmt: skip
def test_a_file_that_was_changed_is_not_called_sound(run: Run, file: Path, change: str) -> None:
    with closing(sqlite3.connect(file, isolation_level=None)) as connection:
        connection.executescript(f"PRAGMA user_version = 0; {change}")
    done = run("doctor", "--db", file)
    assert done.code == 4
    assert "is damaged" in " ".join(done.out.split())
    assert "nothing is wrong" not in done.out
    assert "\x1b[2J" not in done.out


@pytest.mark.slow
def test_an_older_file_is_not_upgraded(run: Run, tmp_path: Path, at_revision: Callable[[Path, str], Path]) -> None:
    old = at_revision(tmp_path / "old.db", "0002")
    done = run("doctor", "--db", old, "--format", "json")
    assert told(done)["revision"] == {
        "what": "revision", "found": "0002", "remedy": f"any command upgrades it to {revisions()[-1]}", "sound": True
    }  # fmt: skip
    with closing(sqlite3.connect(old)) as connection:
        assert connection.execute("SELECT version_num FROM alembic_version").fetchone() == ("0002",)


@pytest.mark.slow
@pytest.mark.skipif(not Path(os.devnull).is_char_device(), reason="only here it is a file")
def test_a_device_is_no_database(run: Run) -> None:
    done = run("doctor", "--db", os.devnull)
    assert (done.code, "is a device: name a file with --db" in done.out) == (4, True)


@pytest.mark.parametrize("content", [b"", b"some text that is no database" * 9])
def test_a_file_that_is_none_is_said_and_never_to_be_deleted(run: Run, tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "other.db"
    file.write_bytes(content)
    done = run("doctor", "--db", file)
    assert done.code == (4 if content else 0)
    assert "delete" not in done.out
    assert file.read_bytes() == content
