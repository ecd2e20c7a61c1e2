"""Mechanisms of many bars on the command line."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.chains.known import BICYCLE, CHEBYSHEV, JANSEN

Run = Callable[..., Any]


@pytest.fixture(autouse=True)
def own_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CATALOGUE_ANSWERS", str(tmp_path / "answers.db"))


@pytest.fixture
def leg(tmp_path: Path) -> Path:
    file = tmp_path / "leg.json"
    file.write_text(json.dumps(JANSEN))
    return file


@pytest.mark.slow
def test_measure_lists_the_stretches_of_a_leg(run: Run, leg: Path) -> None:
    done = run("measure", leg, "--stroke", 30)
    assert done.code == 0
    assert done.out.startswith("Jansen: 8 bars, crank drives, foot is guided\ncrank turns fully")
    rows = json.loads(run("measure", leg, "--stroke", 30, "--format", "json").out)
    assert rows[0]["stroke"] == pytest.approx(30)
    table = list(csv.DictReader(io.StringIO(run("measure", leg, "--stroke", 30, "--format", "csv").out)))
    assert float(table[0]["deviation"]) == rows[0]["deviation"]
    shown = json.loads(run("show", rows[0]["code"], "--format", "json").out)
    assert shown == rows[0]
    again = json.loads(run("measure", rows[0]["code"], "--stroke", 30, "--format", "json").out)
    assert again[0]["deviation"] == pytest.approx(rows[0]["deviation"], rel=1e-6)


@pytest.mark.slow
def test_trace_has_columns_of_every_joint(run: Run, leg: Path) -> None:
    done = run("trace", leg, "--samples", 13, "--distance", "E,F")
    rows = list(csv.DictReader(io.StringIO(done.out)))
    assert len(rows) == 13
    assert {"drive [deg]", "upper [deg]", "foot x [length]", "G ax [length/rad^2]", "E-F [length]"} <= {*rows[0]}
    code = json.loads(run("measure", leg, "--stroke", 30, "--format", "json").out)[0]["code"]
    part = list(csv.DictReader(io.StringIO(run("trace", code, "--samples", 5).out)))
    whole = list(csv.DictReader(io.StringIO(run("trace", code, "--samples", 5, "--over", "circuit").out)))
    span = [abs(float(rows[-1]["drive [deg]"]) - float(rows[0]["drive [deg]"])) for rows in (part, whole)]
    assert span[0] < 180 < span[1] == pytest.approx(360)


@pytest.mark.slow
def test_show_prints_and_draws(run: Run, leg: Path, tmp_path: Path) -> None:
    done = run("show", leg, "--plot", tmp_path / "leg.png")
    assert done.code == 0
    assert "foot" in done.out
    assert (tmp_path / "leg.png").stat().st_size > 10_000


@pytest.mark.slow
def test_units_go_through(run: Run, tmp_path: Path) -> None:
    file = tmp_path / "bike.json"
    file.write_text(json.dumps(BICYCLE))
    mm = json.loads(run("measure", file, "--stroke", "40mm", "--format", "json").out)
    inch = json.loads(run("measure", file, "--stroke", "40mm", "--unit", "in", "--format", "json").out)
    assert inch[0]["size"] * 25.4 == pytest.approx(mm[0]["size"])
    assert inch[0]["unit"] == "in"


@pytest.mark.slow
def test_several_mechanisms_are_measured_in_one_run(run: Run, tmp_path: Path) -> None:
    file = tmp_path / "legs.json"
    file.write_text(json.dumps([JANSEN, CHEBYSHEV]))
    rows = json.loads(run("measure", file, "--stroke", 2, "--format", "json").out)
    assert [row["number"] for row in rows] == [1, 2]


@pytest.mark.slow
def test_export_writes_a_mechanism_and_a_stretch_of_it(run: Run, leg: Path, tmp_path: Path) -> None:
    for name in ("a.json", "a.csv", "a.svg", "a.dxf", "a.xlsx", "a.txt", "a.FCMacro"):
        file = tmp_path / name
        assert run("export", leg, "--out", file, "--unit", "in").code == 0
        assert file.stat().st_size > 500
    again = run("measure", tmp_path / "a.json", "--stroke", "30in", "--format", "json")
    code = json.loads(again.out)[0]["code"]
    assert json.loads(run("export", code, "--format", "json").out)["measured"]["stroke"] == pytest.approx(30)
    done = run("export", leg, "--out", tmp_path / "a.py")
    assert done.code == 2
    assert "export a mechanism of many bars as dxf, json, csv, xlsx, parquet" in done.line
    assert "is for one guide" not in done.line


@pytest.mark.parametrize(
    ("command", "more"),
    [
        ("classify", []),
    ],
)
def test_other_commands_refuse_it_by_name(run: Run, leg: Path, command: str, more: list[str]) -> None:
    done = run(command, leg, *more)
    assert done.code == 2
    assert "is a mechanism of many bars: here a linkage of two dyads is wanted" in done.line


@pytest.mark.parametrize(
    ("change", "wrong"),
    [
        ({"drive": "cranck"}, "there is no bar 'cranck'"),
        ({"bars": {**JANSEN["bars"], "stay": ["B", "D"]}}, "it has 0 freedoms"),
        ({"colour": "red"}, "a chain has no 'colour'"),
    ],
)
def test_bad_files_get_one_line(run: Run, leg: Path, change: dict[str, Any], wrong: str) -> None:
    leg.write_text(json.dumps({**JANSEN, **change}))
    for command in (("measure", "--stroke", 10), ("trace",), ("show",)):
        done = run(command[0], leg, *command[1:])
        assert done.code in (2, 3)
        assert wrong in done.line
        assert "leg.json" in done.line


def test_bad_options_get_one_line(run: Run, leg: Path, tmp_path: Path) -> None:
    for arguments, wrong in (
        (("measure", leg, "--stroke", 10, "--point", 1, 2), "it names its guided joint by `point`"),
        (("trace", leg, "--also", "A=1,2"), "name it there"),
        (("trace", leg, "--driver", 2), "the drive of a mechanism of many bars"),
        (("trace", leg, "--distance", "E"), "between must be the names of two joints"),
        (("trace", leg, "--over", "stroke"), "has no stroke"),
    ):
        done = run(*arguments)
        assert done.code == 2, arguments
        assert wrong in done.line
    twice = json.dumps(JANSEN)[:-1] + ', "point": "B"}'
    leg.write_text(twice)
    assert "'point' is given twice" in run("trace", leg).line
    leg.write_text(json.dumps([JANSEN, {"crank": 1}]))
    assert "mechanism 2 has no `bars`" in run("trace", leg).line
    two = tmp_path / "two.json"
    two.write_text('{"ground": 220, "crank": 100, "coupler": 250, "rocker": 250, "along": 125, "across": 80}')
    assert "--distance is for a mechanism of many bars" in run("trace", two, "--distance", "A,B").line


@pytest.mark.slow
def test_sheet_writes_a_mechanism_and_a_stretch_of_it(run: Run, leg: Path, tmp_path: Path) -> None:
    code = json.loads(run("measure", leg, "--stroke", 30, "--format", "json").out)[0]["code"]
    for what in (leg, code):
        for name in ("a.pdf", "a.html"):
            assert run("sheet", what, "--out", tmp_path / name, "--unit", "in", "--force").code == 0
            assert (tmp_path / name).stat().st_size > 10_000
    both = tmp_path / "legs.json"
    both.write_text(json.dumps([JANSEN, CHEBYSHEV]))
    assert "holds 2 mechanisms: a sheet shows one" in run("sheet", both, "--out", tmp_path / "b.pdf").line


@pytest.mark.slow
def test_improve_prints_before_and_after_and_saves_them(run: Run, leg: Path, tmp_path: Path) -> None:
    hold = ("--hold", "fixed-pivots", "--hold", "B", "--unit", "mm")
    done = run("improve", leg, "--stroke", 30, *hold, "--save", tmp_path / "both.json")
    assert done.code == 0, done.err
    assert done.out.count("before") == done.out.count("improved") == 1
    rows = json.loads((tmp_path / "both.json").read_text())["answers"]
    assert rows[1]["deviation"] < 0.5 * rows[0]["deviation"]
    for joint in ("O", "D", "B"):
        assert rows[1]["joints"][joint] == rows[0]["joints"][joint]
    shown = json.loads(run("show", rows[1]["code"], "--format", "json").out)
    assert shown["deviation"] == rows[1]["deviation"]
    saved = json.loads(run("show", tmp_path / "both.json", "--format", "json").out)
    assert [one["deviation"] for one in saved] == [row["deviation"] for row in rows]


@pytest.mark.parametrize(
    ("options", "wrong"),
    [
        (["--hold", "Q"], "there is no joint 'Q' to hold; there are O, D, B"),
        (["--hold", "crank1"], "there is no joint 'crank1' to hold"),
        (["--pins-only"], "pins_only is no bound on the improvement of a mechanism of many bars"),
        (["--rank-by", "score"], "are not improved in 'score', but in deviation, size, min_transmission"),
        (["--in-place"], "--in-place is for a linkage of two dyads"),
        (["--catalogue"], "--catalogue is for a linkage of two dyads"),
        (["--along", 30], "stays where it is: give the stroke alone"),
        (["--radius", 30, "--angle", 300], "arcs below a half circle"),
    ],
)
def test_improve_refuses_what_it_does_not_honour(run: Run, leg: Path, options: list[Any], wrong: str) -> None:
    stroke = [] if "--angle" in options else ["--stroke", 30]
    done = run("improve", leg, *stroke, *options)
    assert done.code == 2
    assert wrong in done.line
