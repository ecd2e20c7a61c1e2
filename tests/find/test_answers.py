"""Answers that stay: codes, the file in which they lie, and files of answers."""

from __future__ import annotations

import copy
import json
import pickle
import sqlite3
import subprocess
import sys
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

import catalogue
from catalogue import Catalogue, CircularArc, Found, InvalidRequest, StraightLine
from catalogue.find import answers
from catalogue.find.dwell_results import StandStill

LINE = StraightLine(100, 0.5)
MINE = {"ground": 220, "crank": 100, "coupler": 250, "rocker": 250, "along": 125, "across": 80}


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a new file of answers."""
    path = tmp_path / "answers.db"
    monkeypatch.setenv("CATALOGUE_ANSWERS", str(path))
    return path


def test_answers_of_every_kind_are_picked_up_to_the_last_digit(
    ask: Callable[..., Found], small: Catalogue, file: Path
) -> None:
    stretches = catalogue.guide(MINE).measure(stroke=120.0)
    kinds: list[Any] = [
        ask(LINE), ask(CircularArc(100, 0.5, 120)), ask(LINE, cognates=True), stretches,
        small.find_dwells(StandStill(60, 1, 20)),
    ]  # fmt: skip
    for found in kinds:
        assert len(found)
        for code, one in zip(found.remember(), found, strict=True):
            again = answers.recall(code)
            assert again == one
            assert type(again) is type(one)
            assert again.pivots == one.pivots
    assert file.is_file()


def test_the_same_answer_has_the_same_code_and_another_has_another(ask: Callable[..., Found], file: Path) -> None:
    found = ask(LINE)
    codes = found.remember()
    assert found.remember() == codes
    assert len({*codes}) == len(found)
    assert all(answers.is_code(code) and not code.isdigit() for code in codes)
    file.unlink()
    assert found.remember() == codes


def test_a_code_is_good_in_another_process(ask: Callable[..., Found], file: Path) -> None:
    found = ask(LINE)
    code = found.remember()[0]
    script = f"import catalogue; c = catalogue.recall({code!r}); print(c.pivots, c.deviation)"
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True, timeout=60,
        env={"CATALOGUE_ANSWERS": str(file), "PYTHONPATH": str(Path(catalogue.__file__).parents[1])},
    )  # fmt: skip
    assert done.stdout.strip() == f"{found[0].pivots} {found[0].deviation}"


def test_two_answers_of_one_code_are_both_kept(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(answers, "code_of", lambda _, length=7: "abcdefgh"[:length])
    one, other = (catalogue.guide({**MINE, "along": along}) for along in (1, 2))
    codes = answers.remember([one, other])
    assert codes == ["abcdefg", "abcdefgh"]
    assert [answers.recall(code) for code in codes] == [one, other]
    assert file.is_file()


def test_the_oldest_are_dropped_and_said_to_be(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(answers, "KEPT", 5)
    codes = answers.remember([catalogue.guide({**MINE, "along": along}) for along in range(9)])
    with closing(sqlite3.connect(file)) as held:
        assert held.execute("SELECT count(*) FROM answer").fetchone() == (5,)
    assert answers.recall(codes[-1]).lengths["point along"] == pytest.approx(8)
    with pytest.raises(InvalidRequest, match=f"no answer has the code {codes[0]}"):
        answers.recall(codes[0])


@pytest.mark.parametrize("path", ["absent/answers.db", "."])
def test_a_file_that_cannot_be_used_is_named(path: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "absent").write_text("a file where a folder is wanted")
    monkeypatch.setenv("CATALOGUE_ANSWERS", str(tmp_path / path))
    with pytest.raises(InvalidRequest, match="cannot be written"):
        catalogue.guide(MINE).measure(stroke=120.0).remember()


def test_a_damaged_file_of_answers_is_named(file: Path) -> None:
    file.write_bytes(b"no database" * 100)
    with pytest.raises(InvalidRequest, match=r"answers\.db cannot be read"):
        answers.recall("abcdefg")


def test_an_answer_whose_record_is_damaged_is_named(file: Path) -> None:
    code = answers.remember([catalogue.guide(MINE)])[0]
    for kept in ("{kind", "", b"\xff", None, "[" * 100_000):
        with closing(sqlite3.connect(file)) as opened, opened:
            opened.execute("DROP TABLE answer")
            opened.execute("CREATE TABLE answer (code TEXT, record)")
            opened.execute("INSERT INTO answer VALUES (?, ?)", (code, kept))
        with pytest.raises(InvalidRequest, match=f"the answer {code} is damaged"):
            answers.recall(code)


def test_files_of_answers_are_read_again(ask: Callable[..., Found], tmp_path: Path) -> None:
    found, file = ask(LINE), tmp_path / "found.json"
    found.save(file)
    assert catalogue.load(file) == list(found)
    assert json.loads(file.read_text())["version"] == catalogue.__version__


@pytest.mark.parametrize(
    "text", ["", "{", "[]", '{"format": 1}', '{"format": "mechanism-catalogue answers", "answers": [1]}',
             '{"format": "mechanism-catalogue answers", "answers": [{"kind": "Candidate", "id": 1}]}',
             '{"format": "mechanism-catalogue answers", "answers": [{"kind": "os.system"}]}'],
)  # fmt: skip
def test_files_that_hold_no_answers_are_refused(text: str, tmp_path: Path) -> None:
    file = tmp_path / "found.json"
    file.write_text(text)
    with pytest.raises(InvalidRequest):
        catalogue.load(file)


def test_answers_and_results_copy_pickle_compare_and_slice(ask: Callable[..., Found]) -> None:
    found = ask(LINE)
    assert pickle.loads(pickle.dumps(found)) == found
    assert copy.deepcopy(found[0]) == copy.copy(found[0]) == found[0]
    assert type(found[:3]) is Found
    assert list(found[1:3]) == [found[1], found[2]]
    assert found[:1] != found[1:2]
    assert len(repr(found).splitlines()) <= 25
    assert all(len(line) < 160 for line in repr(found).splitlines())


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("stroke", "long"),
        ("deviation", []),
        ("series", 7),
        ("pivots", [[1, 2], [3, 4]]),
        ("guided", [1]),
        ("size", True),
    ],
)
def test_a_record_that_was_changed_is_told(small: Catalogue, name: str, value: Any) -> None:
    held = answers.record(small.guide("watt").at(1.0))
    assert answers.answer(held) == small.guide("watt").at(1.0)
    with pytest.raises(InvalidRequest, match=r"^an answer is damaged, or of another version"):
        answers.answer(held | {name: value})
