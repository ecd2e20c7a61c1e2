"""Pictures, films and data sheets from the command line; what cannot be drawn is refused before any work."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Run = Callable[..., Any]
MINE = {"ground": 220, "crank": 100, "coupler": 250, "rocker": 250, "along": 125, "across": 80}


@pytest.mark.slow
def test_show_draws_what_moves(run: Run, code: str, tmp_path: Path) -> None:
    picture = tmp_path / "guide.svg"
    done = run("show", code, "--plot", picture, "--moving")
    assert done.code == 0
    text = picture.read_text("utf-8")
    assert "<animateTransform" in text
    assert f'<title id="guide-title">{code} · ' in text
    assert run("show", code, "--plot", picture, "--moving").code == 2  # it is there
    assert run("show", code, "--plot", picture, "--moving", "--force").code == 0


def test_moving_wants_a_file_that_can_move(run: Run, code: str, tmp_path: Path) -> None:
    assert "goes with --plot" in run("show", code, "--moving").line
    assert "a .png cannot move" in run("show", code, "--plot", tmp_path / "a.png", "--moving").line


@pytest.mark.parametrize("command", [
    ("find", "straight-line", "--stroke", 150, "--deviation", 0.05),
    ("measure", "nothing.json", "--stroke", 1),
    ("show", "nothing"),
])  # fmt: skip
def test_what_cannot_be_drawn_is_refused_before_anything_is_read(run: Run, command: Any, tmp_path: Path) -> None:
    for name, said in (("a.xyz", "choose .png, .svg, .pdf or .gif"), ("absent/a.png", "there is no folder")):
        done = run(*command, "--plot", tmp_path / name, "--db", tmp_path / "absent.db")
        assert done.code == 2
        assert said in done.line
    assert not (tmp_path / "absent.db").exists()


@pytest.mark.parametrize("suffix", ["html", pytest.param("pdf", marks=pytest.mark.slow)])
def test_sheet_of_an_answer_and_of_a_linkage(run: Run, code: str, mine: Path, tmp_path: Path, suffix: str) -> None:
    for what in (code, mine):
        page = tmp_path / f"guide.{suffix}"
        done = run("sheet", what, "--out", page, "--paper", "letter", "--unit", "in", "--scale", "1:100", "--force")
        assert done.code == 0
        assert done.err.strip() == f"written: {page}"
        assert page.stat().st_size > 10_000
    assert run("sheet", code, "--out", page).code == 2  # it is there


def test_a_sheet_that_cannot_be_written_is_refused(run: Run, code: str, tmp_path: Path) -> None:
    assert "choose .pdf or .html" in run("sheet", code, "--out", tmp_path / "a.png").line
    assert "a scale is written as" in run("sheet", code, "--out", tmp_path / "a.html", "--scale", "2").line


@pytest.mark.slow
@pytest.mark.parametrize("arguments", [("show", "watt", "--plot"), ("sheet", "watt", "--out")])
def test_the_code_on_a_picture_of_a_named_guide_is_kept(
    run: Run, small_db: Path, tmp_path: Path, arguments: tuple[str, ...]
) -> None:
    picture = tmp_path / ("watt.svg" if "show" in arguments else "watt.html")
    moving = ["--moving"] if "show" in arguments else []
    assert run(*arguments, picture, *moving, "--db", small_db).code == 0
    found = re.search(r"\b(?:code |guide-title\">)([a-z][a-z0-9]{6})\b", picture.read_text("utf-8"))
    assert found is not None
    assert "four-bar" in run("show", found[1]).out
