"""Linkages of users, and codes of answers, on the command line."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import catalogue
from catalogue import CircularArc, InvalidRequest, StraightLine

Run = Callable[..., Any]
MINE = {"ground": 220, "crank": 100, "coupler": 250, "rocker": 250, "along": 125, "across": 80}


@pytest.mark.slow
def test_measure_prints_what_a_linkage_is_and_where_it_guides(run: Run, mine: Path) -> None:
    done = run("measure", mine, "--stroke", 120)
    assert done.code == 0
    assert done.out.startswith("four-bar: crank 1 100, crank 2 250, frame 220, coupler 250")
    assert "2 circuits: crank 1 turns fully" in done.out
    assert "take the linkage apart" in done.out


@pytest.mark.slow
def test_measure_takes_what_it_printed_by_code(run: Run, mine: Path) -> None:
    rows = json.loads(run("measure", mine, "--stroke", 120, "--format", "json").out)
    assert [row["deviation"] for row in rows] == sorted(row["deviation"] for row in rows)
    shown = json.loads(run("show", rows[0]["code"], "--format", "json").out)
    assert shown == rows[0]
    again = json.loads(run("measure", rows[0]["code"], "--stroke", 120, "--format", "json").out)
    assert again[0]["deviation"] == pytest.approx(rows[0]["deviation"], rel=1e-4)
    assert "deviation" in run("show", rows[0]["code"]).out


@pytest.mark.slow
def test_show_tells_no_order_of_what_is_of_no_stored_guide_and_prints_no_empty_table(run: Run, mine: Path) -> None:
    (row, *_) = json.loads(run("measure", mine, "--stroke", "120", "--format", "json").out)
    told = run("show", row["code"]).out
    assert "deviation" in told
    assert "order" not in told
    own = run("show", mine).out
    assert "meaning" not in own
    assert "crank 1" in own


@pytest.mark.slow
def test_describing_names_all_cranks_that_turn(run: Run, tmp_path: Path) -> None:
    drag, kite, still = (tmp_path / f"{name}.json" for name in ("drag", "kite", "still"))
    point = {"along": 0.5, "across": 0.7}
    drag.write_text(json.dumps({"ground": 1, "crank": 2, "coupler": 2, "rocker": 2, **point}))
    kite.write_text(json.dumps({"ground": 2, "crank": 1, "coupler": 1, "rocker": 2, **point}))
    still.write_text(json.dumps({"ground": 10, "crank": 2, "coupler": 4, "rocker": 4, **point}))
    assert "crank 1 and crank 2 turn fully" in run("measure", drag, "--stroke", 0.5).out
    done = run("measure", kite, "--stroke", 0.5)
    told = " ".join(done.out.split())
    assert "only a guard keeps the linkage from flipping" in told
    assert "take the linkage apart" not in told
    assert "invalid value" not in done.err
    assert "change points: crank 1 at 0.00, 180.00°; crank 2 at 180.00°" in told
    for command in (("measure", "--deviation", 0.01), ("trace",)):
        failed = run(command[0], still, *command[1:])
        assert failed.code in (1, 2)
        assert "cannot move" in failed.err
    assert "cannot move" in " ".join(run("show", still).out.split())


@pytest.mark.slow
def test_every_stretch_that_is_listed_is_taken_by_all_commands(run: Run, mine: Path, tmp_path: Path) -> None:
    """Of one the deviation is above a tenth of the stroke: no guidance to ask for, but what the linkage does."""
    rows = json.loads(run("measure", mine, "--stroke", 230, "--format", "json").out)
    assert max(row["deviation"] for row in rows) > 23
    for code in (row["code"] for row in rows):
        for command in (
            ("show", code), ("show", code, "--plot", tmp_path / "a.svg", "--moving"), ("trace", code),
            ("show", code, "--plot", tmp_path / "a.png"), ("sheet", code, "--out", tmp_path / "a.html"),
            ("export", code, "--out", tmp_path / "a.dxf"), ("measure", code, "--stroke", 230),
        ):  # fmt: skip
            done = run(*command, *(["--force"] if "--plot" in command or "--out" in command else []))
            assert done.code == 0, (command, done.err)
    assert catalogue.recall(code).improve(StraightLine(230, 20))


@pytest.mark.slow
def test_the_longest_stroke_within_a_deviation(run: Run, mine: Path) -> None:
    rows = json.loads(run("measure", mine, "--deviation", 0.05, "--format", "json").out)
    assert all(row["deviation"] <= 0.05 * (1 + 1e-9) for row in rows)
    assert rows[0]["stroke"] == max(row["stroke"] for row in rows) > 50
    assert all(row["allowance"] >= -1e-9 for row in rows)


@pytest.mark.slow
def test_the_allowance_is_a_column_where_a_deviation_is_asked_for(
    run: Run, mine: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "300")
    assert "allowance" in run("measure", mine, "--deviation", 0.05).out
    assert "allowance" not in run("measure", mine, "--stroke", 120).out


@pytest.mark.slow
@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
def test_many_linkages_from_csv(run: Run, tmp_path: Path, delimiter: str) -> None:
    file = tmp_path / "many.csv"
    lines = [delimiter.join(f"{x:.6g}" for x in row) for row in np.random.default_rng(0).normal(size=(12, 10))]
    file.write_text("\ufeff" + "\n".join(lines) + "\n", encoding="utf-8")
    rows = list(csv.DictReader(io.StringIO(run("measure", file, "--stroke", 0.3, "--format", "csv").out)))
    assert [int(row["number"]) for row in rows] == sorted({int(row["number"]) for row in rows})
    assert len(rows) >= 10


@pytest.mark.slow
def test_a_heading_names_lengths(run: Run, tmp_path: Path) -> None:
    file = tmp_path / "many.csv"
    file.write_text(
        "ground,crank,coupler,rocker,along,across,note\n220,100,250,250,125,80,a\n220,90,250,250,125,80,b\n"
    )
    rows = json.loads(run("measure", file, "--stroke", 120, "--format", "json").out)
    assert [row["number"] for row in rows] == [1, 2]
    assert rows[0]["lengths"]["crank 1"] == pytest.approx(100)


@pytest.mark.parametrize(
    ("text", "options", "code", "said"),
    [
        ("{}", (), 2, "linkage 0 has neither"),
        ('{"ground":2,"crank":9,"coupler":1,"rocker":1,"along":0,"across":1}', ("--stroke", 1), 3, "cannot be closed"),
        ('{"ground":220,"crank":100,"coupler":250,"rocker":250}', ("--stroke", 1), 2, "no guided point"),
        ('{"ground":220,"crank":100,"coupler":250,"rocker":250,"along":1}', ("--stroke", 1), 3, "`along` and `across`"),
        ("0,0,1,1,3,0,2,2,1,x\n", ("--stroke", 1), 2, "line 1, column 10: 'x' is no number"),
        ("0,0,1,1,3,0,2,2,1\n", ("--stroke", 1), 2, "9 numbers; 8"),
        ("0,0,1,1,3,0,2,2,1,1\n", (), 2, "over which stroke"),
        ("0,0,1,1,3,0,2,2,1,1\n", ("--stroke", -1), 2, "stroke must be"),
        ("0,0,1,1,3,0,2,2,1,1\n", ("--stroke", 1, "--radius", 0.3), 2, "is impossible: the chord is at most 0.6"),
        ("0,0,1,1,3,0,2,2,1,1\n", ("--radius", 1, "--angle", 351), 2, "nearly closes"),
        ("0,0,1,1,3,0,2,2,1,1\n", ("--radius", 99, "--angle", 270), 1, "over 270\u00b0: ask for another radius"),
        ("[" * 5000, ("--stroke", 1), 2, "no valid JSON"),
    ],
)
def test_what_cannot_be_measured_is_one_line(run: Run, text: str, options: Any, code: int, said: str) -> None:
    done = run("measure", "-", *options, stdin=text)
    assert done.code == code
    assert said in done.line


@pytest.mark.slow
def test_a_stroke_that_nothing_offers_ends_with_1(run: Run, mine: Path) -> None:
    done = run("measure", mine, "--stroke", 5000)
    assert done.code == 1
    assert "runs forward over a stroke of 5000" in done.err or "run forward over a stroke of 5000" in done.err


def test_an_unknown_code_says_so(run: Run) -> None:
    done = run("show", "zzzzzzz")
    assert done.code == 2
    assert "no answer has the code zzzzzzz" in done.line


def test_trace_prints_motion_with_units(run: Run, mine: Path) -> None:
    rows = list(
        csv.DictReader(io.StringIO(run("trace", mine, "--samples", 9, "--unit", "mm", "--also", "end=0,0").out))
    )
    assert len(rows) == 9
    assert {"drive [deg]", "guided x [mm]", "guided vx [mm/rad]", "end x [mm]", "transmission [deg]"} <= {*rows[0]}
    assert float(rows[-1]["drive [deg]"]) - float(rows[0]["drive [deg]"]) == pytest.approx(360)
    assert run("trace", mine, "--over", "stroke").code == 2
    assert run("trace", mine, "--also", "end").code == 2


@pytest.mark.slow
def test_find_saves_plots_and_names_its_answers(run: Run, small_db: Path, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    file, folder = tmp_path / "found.json", tmp_path / "plots"
    asked = ("find", "straight-line", "--stroke", 100, "--deviation", 0.5, "--limit", 2, "--db", small_db)
    rows = json.loads(run(*asked, "--format", "json", "--save", file, "--plot", folder).out)
    assert {path.stem for path in folder.iterdir()} == {row["code"] for row in rows}
    shown = json.loads(run("show", file, "--format", "json").out)
    assert [(one["code"], one["pivots"]) for one in shown] == [(row["code"], row["pivots"]) for row in rows]
    assert json.loads(run("show", rows[1]["code"], "--format", "json").out) == shown[1]
    for option in (("--stroke", 50), ("--level", -3)):
        refused = run("show", rows[1]["code"], *option)
        assert refused.code == 2
        assert f"is shown as it was found: {option[0]} is for a stored guide or a named design" in refused.line
    measured = json.loads(run("measure", file, "--stroke", 100, "--format", "json").out)
    for one, row in zip(measured, rows, strict=True):
        assert one["deviation"] <= row["deviation"] * (1 + 1e-4)


@pytest.mark.parametrize("command", [("find", "straight-line"), ("measure", "{mine}"), ("improve", "{mine}")], ids=str)
def test_what_is_saved_is_not_drawn_over(run: Run, mine: Path, tmp_path: Path, command: tuple[str, str]) -> None:
    file = tmp_path / "same.svg"
    words = [word.replace("{mine}", str(mine)) for word in command]
    done = run(*words, "--stroke", 100, "--deviation", 0.5, "--save", file, "--plot", f"{tmp_path}/x/../same.svg")
    assert done.code == 2
    assert "--save and --plot name the same file" in done.line or "--plot and --save name the same" in done.line
    assert not file.exists()


@pytest.mark.slow
def test_answers_without_a_home_have_no_codes(
    run: Run, mine: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CATALOGUE_ANSWERS", str(tmp_path))  # a folder
    done = run("measure", mine, "--stroke", 120)
    assert done.code == 0
    assert "answers have no codes" in done.err


@pytest.mark.parametrize(
    ("options", "request_"),
    [
        ((), StraightLine(120, 0.4)),
        (("--arc",), CircularArc(120, 0.4)),
        (("--radius", 400), CircularArc(120, 0.4, 400)),
    ],
    ids=str,
)
def test_improve_is_along_an_arc_if_that_or_a_radius_is_given(
    run: Run, mine: Path, monkeypatch: pytest.MonkeyPatch, options: Any, request_: Any
) -> None:
    def refused(_: Any, request: Any, **__: Any) -> None:
        raise InvalidRequest(repr(request))

    monkeypatch.setattr("catalogue.find.improve.improve", refused)
    asked = ("improve", mine, "--stroke", 120, "--deviation", 0.4, "--no-catalogue", *options)
    assert run(*asked).line.endswith(repr(request_))


@pytest.mark.slow
def test_improve_prints_before_improved_and_catalogue(run: Run, mine: Path, small_db: Path) -> None:
    asked = ("improve", mine, "--stroke", 120, "--deviation", 0.4, "--hold", "fixed-pivots", "--db", small_db)
    rows = json.loads(run(*asked, "--format", "json").out)
    assert len(rows) == 3
    assert rows[1]["score"] > rows[0]["score"]
    table = run(*asked, "--no-catalogue").out
    assert "before" in table
    assert "improved" in table
    assert "catalogue " not in table.split("`")[0]
