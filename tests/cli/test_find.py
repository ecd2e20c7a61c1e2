"""``catalogue find``: clean output, one clear line for what cannot be answered."""

from __future__ import annotations

import csv
import io
import json
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from catalogue import Catalogue, StandStill, StraightLine
from catalogue.guides.candidate import COLUMNS

Run = Callable[..., Any]
LINE = ("find", "straight-line", "--stroke", 150, "--deviation", 0.05)
ARC = ("find", "circular-arc", "--stroke", 100, "--radius", 120, "--deviation", 0.05)


def uncoded(text: str) -> list[dict[str, Any]]:
    """Return the rows of printed JSON without the codes of the answers."""
    rows = json.loads(text)
    assert all(row.pop("code") for row in rows)
    return list(rows)


@pytest.mark.slow
def test_json_is_what_the_library_finds(run: Run, small_db: Path, small: Catalogue) -> None:
    done = run(*LINE, "--fixed-pivots-in", -400, -400, 400, 400, "--min-transmission", 30, "--format", "json",
               "--db", small_db)  # fmt: skip
    assert done.code == 0
    assert done.err == ""
    found = small.find(StraightLine(150, 0.05), fixed_pivots_in=(-400, -400, 400, 400), min_transmission=30)
    assert uncoded(done.out) == json.loads(found.to_json())


@pytest.mark.slow
def test_processes_find_the_same_to_the_last_digit(small_db: Path, environment: dict[str, str]) -> None:
    """The hash of strings, and with it the order of sets, is another one in each process."""
    command = [sys.executable, "-m", "catalogue", *map(str, LINE), "--min-transmission", "40", "--rank-by",
               "size=1,balance=2,transmission", "--format", "json", "--db", str(small_db)]  # fmt: skip
    found = [
        subprocess.run(command, env={**environment, "PYTHONHASHSEED": seed}, capture_output=True, check=True).stdout
        for seed in "123"
    ]
    assert found[0] == found[1] == found[2]


@pytest.mark.slow
@pytest.mark.usefixtures("searched_once")
def test_every_option_reaches_the_library(run: Run, small_db: Path, small: Catalogue) -> None:
    done = run(
        *LINE, "--family", "four-bar", "--family", "slider-crank", "--series", "I.GG", "--series", "II*.xy",
        "--configuration", "XX", "--configuration", "NN", "--order", 3, "--fixed-pivots-in", -900, -900, 900, 900,
        "--pivots-in", -1000, -1000, 1000, 1000, "--max-size", 2000, "--max-link", 900, "--min-link", 5,
        "--max-ground", 900, "--min-ground", 4, "--max-arm", 800, "--min-transmission", 11,
        "--rank-by", "size=2,deviation=1", "--per-series", 3, "--effort", 2, "--limit", 5, "--pins-only",
        "--format", "json", "--db", small_db,
    )  # fmt: skip
    found = small.find(
        StraightLine(150, 0.05), families=["four-bar", "slider-crank"], series=["I.GG", "II*.xy"],
        configurations=["XX", "NN"], order=3, fixed_pivots_in=(-900, -900, 900, 900),
        pivots_in=(-1000, -1000, 1000, 1000), max_size=2000, max_link=900, min_link=5, max_ground=900, min_ground=4,
        max_arm=800, min_transmission=11, rank_by={"size": 2, "deviation": 1}, per_series=3, effort=2, limit=5,
        pins_only=True,
    )  # fmt: skip
    assert len(found) == 5
    assert uncoded(done.out) == json.loads(found.to_json())
    done = run(*LINE, "--pareto", "size, transmission", "--distinct", 0.1, "--format", "json", "--db", small_db)
    found = small.find(StraightLine(150, 0.05), rank_by=["size", "transmission"], distinct=0.1)
    assert uncoded(done.out) == json.loads(found.to_json())
    assert found[0].front == 1
    turning = json.loads(run(*LINE, "--full-rotation", "--limit", 3, "--format", "json", "--db", small_db).out)
    assert len(turning) == 3
    assert all(row["rotates"] for row in turning)


@pytest.mark.slow
@pytest.mark.usefixtures("searched_once")
def test_given_pivots_reach_the_library(run: Run, small_db: Path, small: Catalogue) -> None:
    told = run("find", "straight-line", "--stroke", "1", "--deviation", "0.01", "--fixed-pivots", "-0.3", "0.5", "1.1",
               "-0.8", "--within", "0.1", "--limit", "3", "--format", "json", "--db", small_db)  # fmt: skip
    same = small.find(StraightLine(1, 0.01), fixed_pivots=((-0.3, 0.5), (1.1, -0.8)), within=0.1, limit=3)
    assert uncoded(told.out) == [c.to_dict() for c in same]
    assert len(same) == 3


@pytest.mark.slow
def test_answers_by_code_or_in_a_file_are_starts(run: Run, small_db: Path, tmp_path: Path) -> None:
    least = ("--family", "four-bar", "--min-transmission", 45, "--rank-by", "size")
    tight = (*LINE, *least, "--format", "json", "--db", small_db)
    saved = tmp_path / "saved.json"
    first = json.loads(run(*tight, "--limit", 1, "--save", saved).out)[0]
    for start in (first["code"], saved):
        again = json.loads(run(*tight, "--limit", 1, "--no-refine", "--start", start).out)[0]
        assert again["size"] == pytest.approx(first["size"], rel=1e-9)
        flat = [[n for dyad in row["pivots"] for pivot in dyad for n in pivot] for row in (again, first)]
        assert flat[0] == pytest.approx(flat[1], abs=1e-6)
    refused = run(*tight, "--start", "nathyng7")
    assert refused.code == 2
    assert "no answer has the code nathyng7" in refused.err


@pytest.mark.slow
@pytest.mark.usefixtures("searched_once")
def test_zones_and_practice_reach_the_library(run: Run, small_db: Path, small: Catalogue) -> None:
    told = run(
        *LINE, "--keep-out", "-200,-300,400,-150", "--keep-out", "60 80 90 80 75 140",
        "--swept-in", -300, -300, 450, 450, "--max-rotation", 70, "--play", 0.01,
        "--limit", 3, "--format", "json", "--db", small_db,
    )  # fmt: skip
    zones = [(-200, -300, 400, -150), ((60, 80), (90, 80), (75, 140))]
    same = small.find(
        StraightLine(150, 0.05), keep_out=zones, swept_in=(-300, -300, 450, 450), max_rotation=70, play=0.01, limit=3
    )
    assert uncoded(told.out) == json.loads(same.to_json())
    assert len(same) == 3
    assert run(*LINE, "--keep-out", "1,2,x", "--db", small_db).code == 2
    assert "three or more points" in run(*LINE, "--keep-out", "1,2,3,4,5", "--db", small_db).err


@pytest.mark.slow
@pytest.mark.usefixtures("searched_once")
def test_csv_holds_the_same_rows(run: Run, small_db: Path) -> None:
    rows = json.loads(run(*ARC, "--limit", 4, "--format", "json", "--db", small_db).out)
    done = run(*ARC, "--limit", 4, "--format", "csv", "--db", small_db)
    assert done.err == ""
    read = list(csv.DictReader(io.StringIO(done.out)))
    assert list(read[0]) == ["code", *COLUMNS]
    assert [int(r["id"]) if r["id"] else None for r in read] == [r["id"] for r in rows]
    assert [json.loads(r["pivots"]) for r in read] == [r["pivots"] for r in rows]
    assert [float(r["deviation"]) for r in read] == [r["deviation"] for r in rows]
    assert "\r" not in done.out


@pytest.mark.slow
def test_table_is_readable_and_complete(process: Run, small_db: Path) -> None:
    done = process(*LINE, "--db", small_db, COLUMNS="160")
    assert done.code == 0
    assert done.err == ""
    lines = done.out.splitlines()
    assert "Guides for a straight line of 150" in done.out
    assert sum("°" in line for line in lines) == 12
    for heading in ("id", "series", "family", "conf.", "order", "deviation", "size", "transmission"):
        assert heading in done.out
    assert "…" not in done.out
    assert "`catalogue show CODE`" in done.out
    assert "\x1b" not in done.out


@pytest.mark.slow
def test_explain_goes_to_standard_error(run: Run, small_db: Path) -> None:
    done = run(*LINE, "--explain", "--max-size", 500, "--format", "json", "--db", small_db)
    assert json.loads(done.out)
    assert "starts measured" in done.err
    assert "no plugin loaded" in done.err


@pytest.mark.slow
@pytest.mark.usefixtures("searched_once")
def test_an_empty_answer_is_exit_code_1_and_advice(run: Run, small_db: Path) -> None:
    for output, printed in (("json", "[]\n"), ("table", ""), ("csv", ",".join(["code", *COLUMNS]) + "\n")):
        done = run(*LINE, "--max-size", 10, "--format", output, "--db", small_db)
        assert (done.code, done.out) == (1, printed)
        assert len(done.err.splitlines()) == 1
    relaxed = re.fullmatch(
        r"catalogue: no guide found; tested remedies: --max-size (\S+) \(asked 10\); a smaller change may suffice",
        done.err.strip(),
    )
    assert relaxed
    again = run(*LINE, "--max-size", relaxed[1], "--format", "json", "--db", small_db)
    assert json.loads(again.out)[0]["size"] <= float(relaxed[1])


BAD: list[tuple[tuple[Any, ...], str]] = [
    (("--stroke", "-150"), "stroke must be a finite number above zero, not -150"),
    (("--deviation", "50"), "a deviation of 50 over a stroke of 150 is no guidance"),
    (("--pivots-in", 0, 0, "nan", 5), "pivots_in has a coordinate that is not a number"),
    (("--min-link", 9, "--max-link", 3), "min_link 9 is above max_link 3"),
    (("--rank-by", "beauty"), "cannot rank by beauty; choose from score, balance, size"),
    (("--desire", "beauty=1:2"), "no desirability is made of 'beauty'"),
    (("--pareto", "size"), "a front needs two criteria or more"),
    (("--pareto", "size,deviation", "--rank-by", "size=2"), "--pareto weighs no criterion: leave out --rank-by"),
    (("--distinct", 2), "distinct must be a number from 0 to below 1, not 2.0"),
    (("--family", "five-bar"), "the database holds no family 'five-bar'; it holds"),
    (("--limit", 0), "limit must be at least 1, not 0"),
]


@pytest.mark.parametrize(("options", "message"), BAD, ids=lambda v: str(v) if isinstance(v, tuple) else "")
def test_a_request_that_cannot_be_meant_is_exit_code_2(
    run: Run, small_db: Path, options: tuple[Any, ...], message: str
) -> None:
    done = run(*LINE, *options, "--db", small_db)
    assert done.code == 2
    assert message in done.line


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("find", "straight-line"), "--deviation"),
        (("find", "straight-line", "--deviation", 0.05), "--stroke L, or where it runs, --from X Y --to X Y"),
        ((*LINE, "--to", 1, 2), "leave out --stroke"),
        ((*LINE[:4],), "--deviation"),
        ((*LINE, "--stroke", "long"), "--stroke"),
        ((*LINE, "--bolts", 3), "--bolts"),
        ((*LINE, "--format", "xml"), "xml"),
        ((*LINE, "--fixed-pivots-in", 1, 2), "--fixed-pivots-in"),
        (("find", "parabola"), "parabola"),
        (("fnid",), "No such command 'fnid'. Did you mean 'find'?"),
        (("fnid",), "Usage: catalogue [OPTIONS] COMMAND"),
        ((*LINE, "--max-sise", 3), "--max-size"),
    ],
    ids=str,
)
def test_wrong_usage_is_exit_code_2_and_names_what_is_wrong(run: Run, arguments: Any, message: str) -> None:
    done = run(*arguments)
    assert done.code == 2
    assert done.out == ""
    assert message in done.err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            ("--stroke", 210, "--radius", 100),
            "radius 100 is impossible: the chord is at most 200",
        ),
        (("--radius", 100, "--angle", 0), "angle must be a finite number above zero, not 0"),
        (("--radius", 100, "--angle", 351), "nearly closes: its angle must be 350"),
        (("--radius", 100, "--stroke", 50, "--angle", 270), "contradict one another"),
        (("--angle", 270), "--stroke L (of an arc also --radius R --angle DEG)"),
        (("--radius", 100, "--angle", 270, "--slots"), "--slots cannot be asked for"),
    ],
)
def test_an_arc_that_is_none_is_said_in_one_line(run: Run, small_db: Path, options: Any, message: str) -> None:
    done = run("find", "circular-arc", *options, "--deviation", 0.1, "--db", small_db)
    assert done.code == 2
    assert message in done.line


@pytest.mark.slow
def test_an_arc_beyond_a_half_circle(run: Run, small_db: Path, tmp_path: Path) -> None:
    asked = ("--radius", 50, "--angle", 270, "--unit", "mm")
    done = run("find", "circular-arc", *asked, "--deviation", 0.4, "--limit", 2, "--db", small_db, "--save",
               tmp_path / "a.json", "--plot", tmp_path / "a.svg")  # fmt: skip
    assert done.code == 0
    assert "an arc of chord 70.7107 mm and radius 50 mm, 270\u00b0" in done.out
    assert "270\u00b0" in (tmp_path / "a.svg").read_text()
    measured = run("measure", tmp_path / "a.json", *asked)
    assert measured.code == 0
    assert "arcs of 270\u00b0" in measured.out


@pytest.mark.parametrize("arguments", [LINE, ("show", 1), ("build",)], ids=["find", "show", "build"])
class TestDatabaseTrouble:
    """Exit code 4 and one line with a remedy."""

    def test_not_a_database(self, run: Run, tmp_path: Path, arguments: Any) -> None:
        file = tmp_path / "notes.txt"
        file.write_text("not a database, but long enough to be one " * 200)
        done = run(*arguments, "--db", file)
        assert done.code == 4
        assert f"{file} is not a database: " in done.line
        assert "--db" in done.line

    def test_damaged(self, run: Run, small_db: Path, tmp_path: Path, arguments: Any) -> None:
        file = tmp_path / "damaged.db"
        whole = bytearray(small_db.read_bytes())
        whole[4096 * 2 :] = b"\xff" * (len(whole) - 4096 * 2)
        file.write_bytes(whole)
        done = run(*arguments, "--db", file)
        assert done.code == 4
        assert "is damaged" in done.line

    def test_folder(self, run: Run, tmp_path: Path, arguments: Any) -> None:
        done = run(*arguments, "--db", tmp_path)
        assert done.code == 4
        assert f"{tmp_path} is a folder: name a file with --db" in done.line

    def test_newer(self, run: Run, tmp_path: Path, arguments: Any) -> None:
        import sqlite3

        from catalogue.store import Database

        file = tmp_path / "newer.db"
        Database.open(file).close()
        with sqlite3.connect(file) as connection:
            connection.execute("UPDATE alembic_version SET version_num = '9999'")
        connection.close()
        done = run(*arguments, "--db", file)
        assert done.code == 4
        assert "was written by a newer version of the catalogue (revision 9999" in done.line

    def test_of_something_else(self, run: Run, tmp_path: Path, arguments: Any) -> None:
        import sqlite3

        file = tmp_path / "songs.db"
        with sqlite3.connect(file) as connection:
            connection.execute("CREATE TABLE songs (title)")
        connection.close()
        done = run(*arguments, "--db", file)
        assert done.code == 4
        assert "is a database, but not one of the catalogue" in done.line

    def test_no_such_folder_can_be_made(self, run: Run, tmp_path: Path, arguments: Any) -> None:
        (tmp_path / "file").write_text("")
        done = run(*arguments, "--db", tmp_path / "file" / "some.db")
        assert done.code == 4
        assert "cannot be used" in done.line


@pytest.mark.slow
def test_database_is_named_by_the_environment(process: Run, small_db: Path) -> None:
    done = process(*LINE, "--limit", 1, "--format", "json", CATALOGUE_DB=str(small_db))
    assert done.code == 0
    assert len(json.loads(done.out)) == 1


@pytest.mark.slow
def test_a_reader_that_goes_away_is_no_error(environment: dict[str, str], small_db: Path) -> None:
    """As in ``catalogue find ... | head -1``."""
    options = (*LINE, "--limit", 300, "--format", "json", "--db", small_db)
    command = [sys.executable, "-m", "catalogue", *map(str, options)]
    with subprocess.Popen(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, bufsize=0, pipesize=4096
    ) as process:  # a pipe so small that the answer does not fit into it
        assert process.stdout is not None
        assert process.stderr is not None
        assert process.stdout.readline() == b"[\n"
        process.stdout.close()
        err = process.stderr.read()
        code = process.wait(60)
    assert err in (b"", b"searching ...\n")
    assert code in (1, 141)


@pytest.mark.slow
def test_find_imports_only_what_it_needs(environment: dict[str, str], small_db: Path) -> None:
    arguments = [*map(str, LINE), "--no-refine", "--db", str(small_db)]
    code = (
        f"import sys; sys.argv = ['catalogue', *{arguments!r}]\n"
        "from catalogue.cli import main\n"
        "try: main()\n"
        "except SystemExit as end: assert not end.code, end.code\n"
        "heavy = ('pandas', 'matplotlib', 'scipy', 'alembic', 'pluggy', 'catalogue.plugin', 'catalogue.populate',"
        " 'starlette', 'jinja2', 'uvicorn', 'catalogue.web',"
        " 'catalogue.cli.build', 'catalogue.cli.dwell', 'catalogue.cli.show')\n"
        "print([m for m in heavy if m in sys.modules] + [m for m in sys.modules if m.startswith('catalogue_plugin')],"
        " file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=60)
    assert done.stderr.removeprefix("searching ...\n") == "[]\n"  # the line where the machine is slow


@pytest.mark.slow
def test_importing_the_package_imports_nothing_heavy(environment: dict[str, str]) -> None:
    code = (
        "import sys; import catalogue\n"
        "heavy = ('pandas', 'matplotlib', 'scipy', 'sqlalchemy', 'alembic', 'click', 'rich', 'pluggy', 'starlette',"
        " 'jinja2', 'uvicorn')\n"
        "assert not [m for m in heavy if m in sys.modules], [m for m in heavy if m in sys.modules]\n"
        "assert set(catalogue.__all__) <= set(dir(catalogue))\n"
        "for name in catalogue.__all__: getattr(catalogue, name)\n"
        "assert 'scipy.optimize' not in sys.modules and 'matplotlib' not in sys.modules and 'pandas' not in sys.modules"
    )
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=60)
    assert done.stderr == ""


@pytest.mark.slow
@pytest.mark.usefixtures("searched_once")
def test_round_lengths_and_a_drawing_of_the_best(run: Run, small_db: Path, small: Catalogue, tmp_path: Path) -> None:
    drawing = tmp_path / "best.svg"
    done = run("find", "straight-line", "--stroke", 150, "--deviation", 0.5, "--round-to", 1, "--limit", 2,
               "--plot", drawing, "--format", "json", "--db", small_db)  # fmt: skip
    same = small.find(StraightLine(150, 0.5), round_to=1, limit=2)
    assert uncoded(done.out) == json.loads(same.to_json())
    assert drawing.stat().st_size > 10_000
    assert str(drawing) in done.err


@pytest.mark.slow
@pytest.mark.usefixtures("searched_once")
def test_dwells_in_every_format(run: Run, small_db: Path, small: Catalogue) -> None:
    size = ("--crank-length", "40mm", "--max-size", "20cm")
    wish = ("find", "dwell", "--angle", 40, "--residual", 1, "--swing", 20, *size, "--limit", 3, "--db", small_db)
    same = small.find_dwells(StandStill(40, 1, 20, 40, "mm"), max_size=200, limit=3)
    assert all(d.size <= 200 for d in same)
    assert uncoded(run(*wish, "--format", "json").out) == json.loads(same.to_json())
    rows = list(csv.DictReader(io.StringIO(run(*wish, "--format", "csv").out)))
    assert [float(r["angle"]) for r in rows] == [d.angle for d in same]
    assert "Dwells of 40" in run(*wish).out
    nothing = run("find", "dwell", "--angle", 290, "--residual", 0.001, "--swing", 100, "--db", small_db)
    assert nothing.code == 1
    assert "no dwell found" in nothing.err
