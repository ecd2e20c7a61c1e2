"""The file that keeps records by codes: ours alone, private, bounded by what it holds."""

from __future__ import annotations

import os
import random
import sqlite3
import stat
import subprocess
import sys
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from catalogue import InvalidRequest
from catalogue.guides import codes

NO_CODE = "abcdefg"


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the name of a file of answers that is not there."""
    path = tmp_path / "answers.db"
    monkeypatch.setenv("CATALOGUE_ANSWERS", str(path))
    return path


def run(file: Path, *statements: str) -> list[tuple[Any, ...]]:
    """Run statements on a file; return the rows of the last."""
    with closing(sqlite3.connect(file)) as opened, opened:
        return [opened.execute(one).fetchall() for one in statements][-1]


@pytest.mark.parametrize(
    "statements",
    [
        ["CREATE TABLE song (title TEXT)", "INSERT INTO song VALUES ('Ode')"],
        ["CREATE TABLE answer (question TEXT, said TEXT)"],
        ["CREATE TABLE answer (number INTEGER PRIMARY KEY AUTOINCREMENT, code TEXT UNIQUE, record TEXT)",
         "CREATE TABLE other (x)"],
        ["PRAGMA application_id = 7"],
        ["PRAGMA user_version = 3"],
    ],
    ids=["songs", "other answers", "answers and more", "marked", "empty of another"],
)  # fmt: skip
def test_a_database_of_another_program_is_refused_and_unchanged(file: Path, statements: list[str]) -> None:
    run(file, *statements)
    before = file.read_bytes()
    with pytest.raises(InvalidRequest, match="is a database, but not one of answers: name another file with CATALOG"):
        codes.keep(["{}"])
    with pytest.raises(InvalidRequest, match="is a database, but not one of answers"):
        codes.stored_record(NO_CODE)
    assert file.read_bytes() == before
    assert [*file.parent.iterdir()] == [file]


def test_the_catalogue_itself_is_no_file_of_answers(
    small_db: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    copy = tmp_path / "copy.db"
    copy.write_bytes(small_db.read_bytes())
    monkeypatch.setenv("CATALOGUE_ANSWERS", str(copy))
    with pytest.raises(InvalidRequest, match="not one of answers"):
        codes.keep(["{}"])
    assert copy.read_bytes() == small_db.read_bytes()


def test_a_file_without_the_mark_is_taken_over_with_its_records(file: Path) -> None:
    kept = codes.keep(["{}", "[]"])
    run(file, "PRAGMA application_id = 0")
    assert codes.stored_record(kept[0]) == "{}"
    more = codes.keep(["7"])
    assert [codes.stored_record(code) for code in (*kept, *more)] == ["{}", "[]", "7"]
    assert run(file, "PRAGMA application_id") == [(codes.APPLICATION_ID,)]


@pytest.mark.slow
def test_repeats_take_no_place_of_others(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(codes, "CODES", codes.CODES._replace(kept=10))
    old = codes.keep(["of last year"])
    again = [f"answer {k}" for k in range(9)]
    for _ in range(50):
        codes.keep(again)
    assert codes.stored_record(old[0]) == "of last year"
    assert run(file, "SELECT count(*) FROM answer") == [(10,)]
    codes.keep(["one more"])
    assert codes.stored_record(old[0]) is None
    assert all(codes.stored_record(codes.code_of(text)) == text for text in again)


@pytest.mark.skipif(os.name == "nt", reason="Windows knows no such modes")
@pytest.mark.parametrize("umask", [0o000, 0o022, 0o077])
def test_the_file_is_private_whatever_the_umask(file: Path, umask: int) -> None:
    before = os.umask(umask)
    try:
        with codes._opened(write=True) as opened:
            assert opened is not None
            opened.execute("INSERT INTO answer (code, record) VALUES ('a', 'b')")
            modes = {path.name: stat.S_IMODE(path.stat().st_mode) for path in file.parent.iterdir()}
    finally:
        os.umask(before)
    assert len(modes) == 3  # with the log and its index
    assert {*modes.values()} == {0o600}


@pytest.mark.skipif(os.name == "nt", reason="Windows knows no such modes")
def test_a_file_that_others_could_read_is_made_private(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One of an earlier version, with its log; not before it is written, and none of another program."""
    codes.keep(["{}"])
    with codes._opened(write=False) as opened:
        assert opened is not None
        opened.execute("SELECT record FROM answer").fetchall()
        parts = [*file.parent.iterdir()]
        for part in parts:
            part.chmod(0o644)
        codes.stored_record(NO_CODE)
        assert {stat.S_IMODE(part.stat().st_mode) for part in parts} == {0o644}
        codes.keep(['{"other": 1}'])
        assert len(parts) == 3
        assert {stat.S_IMODE(part.stat().st_mode) for part in parts} == {0o600}
    foreign = file.with_name("foreign.db")
    with closing(sqlite3.connect(foreign)) as made:
        made.execute("CREATE TABLE theirs (x)")
    foreign.chmod(0o644)
    monkeypatch.setenv("CATALOGUE_ANSWERS", str(foreign))
    with pytest.raises(InvalidRequest, match="not one of answers"):
        codes.keep(["{}"])
    assert stat.S_IMODE(foreign.stat().st_mode) == 0o644


@pytest.mark.slow
def test_any_damage_is_one_line_that_says_what_to_do(file: Path) -> None:
    """Bytes of the head and of the table are changed at random: some damage is harmless, none is a traceback."""
    kept = codes.keep([f'{{"record": {k}}}' for k in range(40)])
    whole, rng, told = file.read_bytes(), random.Random(8), set()
    for k in range(120):
        damaged = bytearray(whole)
        for _ in range(rng.choice([1, 3, 30, 300])):
            damaged[rng.randrange(rng.choice([300, len(whole)]))] = rng.randrange(256)
        file.write_bytes(damaged)
        for ask in (partial(codes.keep, [str(k)]), partial(codes.stored_record, kept[5])):
            try:
                ask()
            except InvalidRequest as error:
                told.add(str(error).rpartition(":")[2])
    assert " remove it, or name another with CATALOGUE_ANSWERS" in "".join(told)


def test_a_file_that_another_process_writes_is_not_to_be_removed(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    codes.keep(["{}"])
    monkeypatch.setattr(codes, "CODES", codes.CODES._replace(patience=0.01))
    with closing(sqlite3.connect(file, isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")
        with pytest.raises(InvalidRequest, match="try again when the other process has finished"):
            codes.keep(["{}"])


@pytest.mark.slow
def test_many_processes_make_the_file_at_once(file: Path) -> None:
    script = "import sys; from catalogue.guides.codes import keep; print(*keep([sys.argv[1]]))"
    command = [sys.executable, "-c", script]
    root = Path(codes.__file__).parents[2]
    every = [
        subprocess.Popen([*command, str(k)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=root)
        for k in range(8)
    ]
    done = [one.communicate(timeout=120) for one in every]
    assert [err for _, err in done] == [""] * 8
    assert [codes.stored_record(out.strip()) for out, _ in done] == [str(k) for k in range(8)]
    assert run(file, "SELECT count(*) FROM answer") == [(8,)]
