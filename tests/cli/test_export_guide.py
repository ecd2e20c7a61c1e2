"""``export CODE``: any guide as a file for CAD and other programs."""

from __future__ import annotations

import csv
import io
import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import catalogue

Run = Callable[..., Any]
MINE = {"crank": 100, "rocker": 250, "ground": 220, "coupler": 250, "along": 125, "across": 80}


@pytest.mark.slow
def test_an_answer_comes_back_from_json(run: Run, code: str, tmp_path: Path) -> None:
    file = tmp_path / "guide.json"
    done = run("export", code, "--out", file)
    assert (done.code, done.out, done.err) == (0, "", f"written: {file}, json\n")
    assert run("export", code, "--format", "json", "--out", "-").out == file.read_text("utf-8")
    shown = json.loads(run("show", code, "--format", "json").out)
    back = json.loads(run("show", file, "--format", "json").out)
    assert (back["pivots"], back["guided"]) == (shown["pivots"], shown["guided"])
    assert back["lengths"] == pytest.approx(shown["lengths"], rel=1e-12)
    measured = json.loads(run("measure", file, "--stroke", 120, "--limit", 1, "--format", "json").out)[0]
    assert measured["deviation"] == pytest.approx(shown["deviation"], rel=1e-4)
    assert "crank 1" in run("show", file).out
    drawn = run("show", file, "--plot", tmp_path / "guide.svg")  # over its circuit
    assert (drawn.code, (tmp_path / "guide.svg").stat().st_size > 1000) == (0, True)


def test_a_file_of_ones_own_is_exported_as_it_stands(run: Run, mine: Path) -> None:
    told = run("export", mine, "--format", "solidworks", "--unit", "in", "--bar-width", 12, "--hole", 5)
    assert '"crank_1" = 100in\n' in told.out
    assert told.out.endswith('"bar_width" = 12in\n"hole" = 5in\n')


@pytest.mark.slow
def test_a_named_and_a_stored_guide_take_a_stroke(run: Run, small: catalogue.Catalogue, small_db: Path) -> None:
    for name in ("watt", str(small.guides()["id"].iloc[-1])):
        told = run("export", name, "--stroke", 80, "--format", "json", "--db", small_db)
        assert json.loads(told.out)["measured"]["stroke"] == pytest.approx(80)


def test_rows_and_columns_of_the_motion_are_chosen(run: Run, code: str) -> None:
    asked = ("--format", "csv", "--positions", 5, "--columns", "transmission,drive", "--columns", "guided x")
    rows = list(csv.reader(io.StringIO(run("export", code, *asked).out)))
    assert rows[0] == ["transmission [deg]", "drive [deg]", "guided x [length]"]
    assert len(rows) == 6


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ((), "name a format (dxf, json,"),
        (("--out", "{tmp}/guide.dfx"), "names no format; choose one of .csv, .dxf"),
        (("--format", "xlsx"), "xlsx cannot be printed: name a file with --out"),
        (("--format", "sqlite"), "sqlite holds all that is stored: leave out CODE"),
        (("--format", "dxf", "--series", "II.xy"), "--series is for all that is stored: leave out CODE"),
        (("--format", "dxf", "--out", "{tmp}/absent/guide.dxf"), "there is no folder"),
        (("--format", "dxf", "--out", "{tmp}"), "is a folder: name a file with --out"),
        (("--format", "dxf", "--out", "{tmp}/there.dxf"), "is there already"),
    ],
)
def test_what_cannot_be_written_is_refused_before_anything_is_read(
    run: Run, tmp_path: Path, options: tuple[str, ...], message: str
) -> None:
    (tmp_path / "there.dxf").write_text("mine")
    done = run("export", "no-such-guide.json", *(text.format(tmp=tmp_path) for text in options))
    assert done.code == 2
    assert message in done.line
    assert (tmp_path / "there.dxf").read_text() == "mine"


def test_an_unknown_format_is_refused(run: Run) -> None:
    done = run("export", "watt", "--format", "dfx")
    assert done.code == 2
    assert "'dfx' is not one of 'dxf'" in done.err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--format", "json", "--stroke", "50"), "stands where it is: only a stored guide or a named design"),
        (("--format", "csv", "--columns", "guidet"), "no column 'guidet'; there are guided"),
        (("--format", "csv", "--over", "stroke"), "no stroke: export an answer of `measure`"),
        (("--format", "csv", "--positions", "1"), "samples must be at least 2"),
        (("--format", "pylinkage",), "asserts a deviation: export an answer"),
        (("--format", "dxf", "--hole", "300"), "holes of 300 meet"),
    ],
)  # fmt: skip
def test_what_cannot_be_meant_is_one_line(run: Run, mine: Path, options: tuple[str, ...], message: str) -> None:
    done = run("export", mine, *options)
    assert done.code == 2
    assert message in done.line


def test_options_for_one_guide_want_one(run: Run, small_db: Path) -> None:
    assert "--bar-width is for one guide: name it" in run("export", "--bar-width", 3, "--db", small_db).line
    assert "dxf is of one guide: name it" in run("export", "--format", "dxf", "--db", small_db).line


def test_a_file_is_overwritten_by_force_alone(run: Run, code: str, tmp_path: Path) -> None:
    file = tmp_path / "guide.py"
    file.write_text("mine")
    assert run("export", code, "--out", file).code == 2
    assert file.read_text() == "mine"
    assert run("export", code, "--out", file, "--force").code == 0
    assert "pylinkage" in file.read_text("utf-8")


def test_several_linkages_are_refused(run: Run, tmp_path: Path) -> None:
    file = tmp_path / "two.csv"
    file.write_text("ground,crank,coupler,rocker,along,across\n220,100,250,250,125,80\n220,90,250,250,125,80\n")
    assert "holds 2 mechanisms: one can be exported at a time" in run("export", file, "--format", "json").line


@pytest.mark.slow
def test_nothing_for_cad_is_loaded_until_it_is_written(environment: dict[str, str]) -> None:
    heavy = "('ezdxf', 'xlsxwriter', 'pandas', 'matplotlib', 'pyarrow', 'pylinkage')"
    code = f"""
import sys, catalogue
guide = catalogue.guide({MINE!r})
assert 'catalogue.export' not in sys.modules
guide.export(format='json'), guide.export(format='fusion'), guide.export(format='freecad')
assert not [name for name in {heavy} if name in sys.modules], [name for name in {heavy} if name in sys.modules]
"""
    subprocess.run([sys.executable, "-c", code], env=environment, check=True, timeout=120)
