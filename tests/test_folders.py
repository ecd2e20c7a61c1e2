"""Files written in place of others: nothing of the user's is touched on the way."""

from __future__ import annotations

import os
import stat
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import catalogue
from catalogue.folders import make_folder, replacing

MINE = {"ground": 220, "crank": 100, "coupler": 250, "rocker": 250, "along": 125, "across": 80}


def test_a_file_of_the_users_named_part_stays(tmp_path: Path) -> None:
    mine, file = tmp_path / "h.csv.part", tmp_path / "h.csv"
    mine.write_text("precious")
    catalogue.guide(MINE).export(file, "csv")
    assert mine.read_text() == "precious"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["h.csv", "h.csv.part"]


@pytest.mark.parametrize("name", ["h.svg", "h.dxf", "h.csv", "h.xlsx", "h.html", "h.json"])
def test_no_writer_follows_a_link_that_stands_where_it_wrote_before(tmp_path: Path, name: str) -> None:
    other, file = tmp_path / "other", tmp_path / name
    other.write_text("precious")
    (tmp_path / f"{name}.part").symlink_to(other)
    guide = catalogue.guide(MINE).measure(stroke=120.0)[0]
    write: Callable[..., Any] = guide.export if name[2:] in ("dxf", "csv", "xlsx", "json") else guide.plot
    if name == "h.html":
        write = guide.sheet
    write(file)
    assert file.stat().st_size > 100
    assert other.read_text() == "precious"


def test_what_fails_leaves_what_was_there_and_nothing_else(tmp_path: Path) -> None:
    file = tmp_path / "x"
    file.write_text("old")
    with pytest.raises(TypeError), replacing(file) as part:
        part.writelines([b"half", None])  # type: ignore[list-item]
    assert file.read_text() == "old"
    assert [*tmp_path.iterdir()] == [file]


def test_writers_at_once_do_not_mix(tmp_path: Path) -> None:
    """Each has a file of its own: the last one to end has the name, whole."""
    file, start = tmp_path / "x", threading.Barrier(4)

    def write(letter: bytes) -> None:
        start.wait()
        with replacing(file) as part:
            for _ in range(100):
                part.write(letter * 1000)

    threads = [threading.Thread(target=write, args=(bytes([65 + k]),)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    held = file.read_bytes()
    assert len(held) == 100_000
    assert len({*held}) == 1
    assert [*tmp_path.iterdir()] == [file]


@pytest.mark.slow
def test_a_path_of_very_many_folders_is_told_in_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    deep = Path(f"{tmp_path}/{'a/' * 1900}x.db")
    with pytest.raises(catalogue.DatabaseError, match=r"cannot be used \(it lies in too many folders\)"):
        catalogue.open(deep, build=False)
    monkeypatch.setenv("CATALOGUE_ANSWERS", str(deep))
    with pytest.raises(catalogue.InvalidRequest, match=r"cannot be written .*too many folders"):
        catalogue.guide(MINE).measure(stroke=120.0).remember()
    with pytest.raises(OSError, match="too many folders"):
        make_folder(deep)
    assert not [*tmp_path.iterdir()]


@pytest.mark.skipif(os.name == "nt", reason="Windows knows no such modes")
@pytest.mark.parametrize(("umask", "new"), [(0o022, 0o644), (0o077, 0o600), (0o002, 0o664)])
def test_modes_are_those_of_the_umask_or_of_the_file_replaced(tmp_path: Path, umask: int, new: int) -> None:
    file, before = tmp_path / "x", os.umask(umask)
    try:
        for expected in (new, 0o640, 0o600):
            if file.exists():
                file.chmod(expected)
            with replacing(file) as part:
                part.write(b"some")
            assert stat.S_IMODE(file.stat().st_mode) == expected
    finally:
        os.umask(before)


@pytest.mark.skipif(os.name == "nt", reason="Windows knows no such modes")
@pytest.mark.parametrize(("umask", "mode"), [(0o022, 0o644), (0o077, 0o600), (0o002, 0o664)])
def test_a_new_database_has_the_mode_of_the_umask(tmp_path: Path, umask: int, mode: int) -> None:
    before = os.umask(umask)
    try:
        catalogue.open(tmp_path / "new.db", build=False).close()
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "new.db").stat().st_mode) == mode
