"""``classify``, ``show``, ``plugins``, ``build`` and help."""

from __future__ import annotations

import csv
import io
import json
import re
import runpy
import shutil
import sqlite3
import subprocess
import sys
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from catalogue import Catalogue, StraightLine
from catalogue import open as catalogue_open
from catalogue.folders import replacing

Run = Callable[..., Any]
SWINGS = Path(__file__).parents[1] / "collections" / "dropin"
WATT = [[[0, 0], [1, 0]], [[2, -1.2], [1, -1.2]]]
EVANS = [[[0, 0, 1], [1, 0, 1]], [[2, 2.5, 1], [2, 0, 1]]]
TRAMMEL = [[[0, 1, 0], [2, 0, 1]], [[1, 0, 0], [0, 1, 1]]]


# -- help ---------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("command", "teaches"),
    [
        ((), ["find", "build", "classify", "show", "plugins", "Exit codes: 0 answered, 1 nothing found, 2 invalid"]),
        (("find",), ["straight-line", "circular-arc", "(0, 0)"]),
        (("find", "straight-line"), ["catalogue find straight-line --stroke 150 --deviation 0.05", "--stroke",
                                     "--fixed-pivots-in", "X0 Y0 X1 Y1", "--min-transmission", "transmission angle",
                                     "--rank-by", "balance", "--desire", "--from", "--db", "CATALOGUE_DB"]),
        (("find", "circular-arc"), ["--radius", "bulges to the left of its chord",
                                    "catalogue find circular-arc --stroke 100"]),
        (("build",), ["--count", "--seed", "--series", "same seed and count give the same content", "to continue"]),
        (("classify",), ["[[A1, A1*], [A2, A2*]]", "w = 0 at infinity", "standard input", "CSV"]),
        (("show",), ["--plot", "PNG, SVG", "--stroke", "--level"]),
        (("plugins",), ["--plugins", "CATALOGUE_PLUGINS", "rejected plugins"]),
    ],
    ids=lambda v: " ".join(v) if isinstance(v, tuple) else "",
)  # fmt: skip
def test_help_teaches(run: Run, monkeypatch: pytest.MonkeyPatch, command: tuple[str, ...], teaches: list[str]) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    done = run(*command, "--help")
    assert done.code == 0
    assert done.err == ""
    plain = " ".join(done.out.split())
    for words in teaches:
        assert words in plain


def test_an_option_before_its_command_names_the_commands(run: Run) -> None:
    done = run("find", "--stroke", 150)
    assert done.code == 2
    assert "named first: `catalogue find straight-line | circular-arc | dwell`" in done.err


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("catalogue cen", ["census"]),
        ("catalogue find straight-line --pins", ["--pins-only"]),
        ("catalogue find straight-line --family four", ["four-bar"]),
        ("catalogue find straight-line --series I.", ["I.GG"]),
        ("catalogue show wat", ["watt"]),
    ],
)
def test_the_shell_completes_commands_options_and_names(
    run: Run, monkeypatch: pytest.MonkeyPatch, small_db: Path, words: str, offered: list[str]
) -> None:
    monkeypatch.setenv("CATALOGUE_DB", str(small_db))
    monkeypatch.setenv("_CATALOGUE_COMPLETE", "bash_complete")
    monkeypatch.setenv("COMP_WORDS", words)
    monkeypatch.setenv("COMP_CWORD", str(len(words.split()) - 1))
    done = run()
    assert {f"plain,{one}" for one in offered} <= {*done.out.split()}
    assert done.err == ""


def test_version(run: Run) -> None:
    import catalogue

    assert run("--version").out == f"mechanism-catalogue {catalogue.__version__}\n"


@pytest.mark.parametrize("command", [(), ("find",)])
def test_no_command_is_help(run: Run, command: tuple[str, ...]) -> None:
    done = run(*command)
    assert done.code == 2
    assert done.err == ""
    assert done.out == run(*command, "--help").out


def test_ctrl_c_is_one_line_and_exit_code_130(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("catalogue.cli.reading.read_linkages", interrupted)
    done = run("classify", "-")
    assert done.code == 130
    assert done.err == "catalogue: interrupted; what was finished is kept\n"


@pytest.mark.parametrize(
    "words",
    [("show", "watt", "--plot"), ("plate", "I.GG", "--out"), ("export", "watt", "--out")],
    ids=["show", "plate", "export"],
)
@pytest.mark.slow
@pytest.mark.usefixtures("searched_once")
def test_nothing_is_overwritten_without_force(run: Run, small_db: Path, tmp_path: Path, words: tuple[str, ...]) -> None:
    file = tmp_path / "mine.svg"
    file.write_text("precious")
    options = () if words[0] == "plate" else ("--db", small_db)
    refused = run(*words, file, *options)
    assert (refused.code, file.read_text()) == (2, "precious")
    assert refused.line.endswith(f"is there already: name another with {words[-1]}, or overwrite it with --force")
    assert run(*words, file, *options, "--force").code == 0
    assert file.read_text("utf-8") != "precious"


@pytest.mark.parametrize("words", [("show", "watt", "--plot"), ("plate", "I.GG", "--out"), ("export", "1", "--out")])
def test_links_and_what_they_lead_to_are_left_alone(run: Run, tmp_path: Path, words: tuple[str, ...]) -> None:
    """With --force too: ``/dev/stdout`` is a link, perhaps to a file."""
    other, link = tmp_path / "other.svg", tmp_path / "link.svg"
    other.write_text("precious")
    link.symlink_to(other)
    for force in ((), ("--force",)):
        done = run(*words, link, *force)
        assert (done.code, done.line) == (
            2, f"catalogue: {link} is a link, and what it leads to is left alone: name a file with {words[-1]}"
        )  # fmt: skip
    assert link.is_symlink()
    assert other.read_text() == "precious"
    with pytest.raises(OSError, match="a link is there"), replacing(link) as part:
        part.write(b"other")
    assert link.is_symlink()
    assert sorted(tmp_path.iterdir()) == [link, other]


@pytest.mark.slow
def test_nothing_is_left_open(environment: dict[str, str]) -> None:
    command = [sys.executable, "-X", "dev", "-W", "error", "-m", "catalogue", "show", "watt", "--bolts"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 2
    assert "Warning" not in done.stderr


@pytest.mark.slow
def test_help_loads_no_database(environment: dict[str, str]) -> None:
    """Each command imports what it needs when it runs."""
    code = (
        "import atexit, sys; from catalogue.cli import main\n"
        "atexit.register(lambda: print('loaded', *sys.modules)); main()"
    )
    command = [sys.executable, "-c", code, "--help"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    loaded = done.stdout.split("loaded")[1].split()
    assert "catalogue.cli.classify" in loaded
    heavy = {"numpy", "sqlalchemy", "scipy", "pandas", "pluggy", "matplotlib", "alembic", "rich"}
    assert not heavy & {*loaded}


# -- classify -----------------------------------------------------------------------------------------------------
def classified(done: Any) -> list[dict[str, Any]]:
    assert done.code == 0
    assert done.err == ""
    rows: list[dict[str, Any]] = json.loads(done.out)
    return rows


@pytest.mark.slow
@pytest.mark.parametrize(
    ("given", "expected"),
    [
        (WATT, [["IV*.l"]]),
        ([WATT, WATT], [["IV*.l"], ["IV*.l"]]),
        ({"pivots": EVANS}, [["II.xy"]]),
        ([{"pivots": EVANS}, {"pivots": WATT, "id": 7}], [["II.xy"], ["IV*.l"]]),
        ([TRAMMEL], [["II.ooo"]]),
        ([[[[0, 0], [1, 0.3]], [[3, 0.2], [2.4, 1.7]]]], [["general"]]),
    ],
    ids=["one", "two", "object", "objects", "at infinity", "none"],
)
def test_classify_reads_json(run: Run, tmp_path: Path, given: Any, expected: list[list[str]]) -> None:
    file = tmp_path / "given.json"
    file.write_text(json.dumps(given))
    for source, stdin in ((file, ""), ("-", file.read_text())):
        rows = classified(run("classify", source, "--format", "json", stdin=stdin))
        assert [r["series"] for r in rows] == expected
        assert set(rows[0]) == {"family", "configuration", "series", "nearest", "residual", "margin", "remark"}


@pytest.mark.slow
def test_classify_reads_what_find_prints(run: Run, small_db: Path) -> None:
    found = run("find", "straight-line", "--stroke", 1, "--deviation", 1e-3, "--format", "json", "--db", small_db)
    rows = classified(run("classify", "-", "--format", "json", stdin=found.out))
    candidates = json.loads(found.out)
    assert [r["family"] for r in rows] == [c["family"] for c in candidates]


@pytest.mark.slow
@pytest.mark.parametrize("heading", ["", "x1,y1,x1*,y1*,x2,y2,x2*,y2*\n"])
def test_classify_reads_csv(run: Run, heading: str) -> None:
    rows = classified(
        run("classify", "-", "--format", "json", stdin=f"{heading}0,0,1,0,2,-1.2,1,-1.2\n\n0,0,1,0,2,2.5,2,0\n")
    )
    assert [r["nearest"] for r in rows] == ["IV*.l", "II.xy"]
    twelve = "0,1,0,2,0,1,1,0,0,0,1,1\n"
    assert [r["family"] for r in classified(run("classify", "-", "--format", "json", stdin=twelve))] == [
        "elliptic-trammel"
    ]


@pytest.mark.slow
def test_classify_reads_link_lengths(run: Run) -> None:
    links = [{"ground": 4, "crank": 2.4, "coupler": 2, "rocker": 2.4, "angle": 65.3756815, "name": "Roberts"},
             {"crank": 1, "coupler": 1, "angle": 40}, {"pivots": EVANS}]  # fmt: skip
    command = ("classify", "-", "--format", "json", "--tolerance", 1e-6)
    rows = classified(run(*command, stdin=json.dumps(links)))
    assert [r["nearest"] for r in rows] == ["I.GG", "II.ooo", "II.xy"]
    text = "name,ground,crank,offset,angle\na,3,1,0.2,50\nb,3,1,-0.2,50\n"
    assert [r["family"] for r in classified(run(*command, stdin=text))] == ["inverted-slider-crank"] * 2
    for wrong, message in (
        ("crank,coupler,angle\n1,2\n", "line 2: it has 2 columns, the heading 3"),
        ("crank,coupler,angle\n1,2,x\n", "'x' is no number"),
        ('{"crank": 1, "coupler": 2}', "link lengths need the `angle` of the first crank"),
        ('{"crank": 1, "rocker": 2, "angle": 3}', "crank, rocker make no linkage"),
    ):
        done = run(*command, stdin=wrong)
        assert message in done.line
        assert done.code in (2, 3)


@pytest.mark.slow
def test_classify_lists_what_is_guided(run: Run) -> None:
    given = json.dumps([WATT, EVANS])
    command = ("classify", "-", "--radius", 1.5, "--point", 0, 0)
    watt, evans = classified(run(*command, "--format", "json", stdin=given))
    assert [g["label"] for g in watt["guided"]] == ["[4]"]  # equal cranks: [3] coincides with it
    assert {g["order"] for g in watt["guided"]} == {4}
    assert [g["label"] for g in evans["guided"] if g["label"].startswith("radius")]
    assert evans["singularity"] == {"cusps": 0, "inflections": 3}
    done = run(*command, stdin=given)
    assert "What they guide" in done.out
    assert "1: the path has a pseudo-undulation there (p = 0, q = 3)" in done.out
    read = list(csv.DictReader(io.StringIO(run(*command, "--format", "csv", stdin=given).out)))
    assert json.loads(read[1]["singularity"]) == evans["singularity"]
    assert json.loads(read[1]["guided"]) == evans["guided"]
    for option, message in (
        (("--radius", -1), "radius must be a finite number above zero"),
        (("--point", "nan", 0), "finite coordinates"),
        (("--tolerance", 2), "the tolerance must be a residual from 0 up to 1"),
    ):
        done = run("classify", "-", *option, stdin=given)
        assert done.code == 2
        assert message in done.line


@pytest.mark.slow
def test_classify_prints_tables_and_csv(run: Run) -> None:
    text = json.dumps([WATT, EVANS])
    done = run("classify", "-", stdin=text)
    assert done.code == 0
    assert "IV*.l" in done.out
    assert "four-bar" in done.out
    read = list(csv.DictReader(io.StringIO(run("classify", "-", "--format", "csv", stdin=text).out)))
    assert [r["series"] for r in read] == ["IV*.l", "II.xy"]


@pytest.mark.parametrize(
    ("text", "code", "message"),
    [
        ("", 2, "- holds no linkage"),
        ("[]", 2, "- holds no linkage"),
        ("{}", 2, "linkage 0 has neither `pivots` nor link lengths"),
        ("[1, 2", 2, "- is no valid JSON: "),
        ("[1, 2, 3]", 3, "a linkage is [[A1, A1*], [A2, A2*]]"),
        ('["a"]', 3, "a linkage is|pivots must"),
        ("[[[[0, 0], [1, 0]]]]", 3, "a linkage is"),
        ("[[[[0, 0, 1, 1], [1, 0]], [[2, 0], [1, 1]]]]", 3, "a linkage is"),
        ("[[[0, 0], [0, 0]], [[2, 0], [1, 1]]]", 3, "linkage 0: the two pivots of a crank coincide"),
        ("[[[0, 0], [1, NaN]], [[2, 0], [1, 1]]]", 3, "linkage 0: a pivot has a NaN or infinite coordinate"),
        ("[[[0, 0], [1, null]], [[2, 0], [1, 1]]]", 3, "pivot"),
        ("[[[0, 1, 0], [1, 0, 0]], [[2, 0], [1, 1]]]", 3, "linkage 0: a dyad has both pivots at infinity"),
        ('[{"pivots": 3}]', 3, "a linkage is"),
        ('[{"pivots": [[[0,0],[1,0]],[[2,0],[1,1]]]}, 7]', 3, "a linkage is"),
        ("1,2,3\n", 2, "line 1: 3 numbers; 8 (x, y) or 12 (x, y, w) are wanted"),
        ("a,b\n1,2,3,4,5,6,7,eight\n", 2, "line 2, column 8: 'eight' is no number"),
        ("nonsense", 2, "- holds no linkage"),
        ("nan,0,1,0,2,0,1,1\n", 3, "NaN or infinite"),
    ],
)
def test_classify_refuses(run: Run, text: str, code: int, message: str) -> None:
    done = run("classify", "-", "--format", "json", stdin=text)
    assert any(part in done.line for part in message.split("|")), done.line
    assert done.code == code


def test_classify_refuses_files_that_cannot_be_read(run: Run, tmp_path: Path) -> None:
    (tmp_path / "binary").write_bytes(b"\xff\xfe\x00\x01")
    for file in (tmp_path / "absent.json", tmp_path, tmp_path / "binary"):
        done = run("classify", file)
        assert done.code == 2
        assert f"cannot read {file}: " in done.line


# -- show ---------------------------------------------------------------------------------------------------------
@pytest.mark.slow
def test_show_a_guide(run: Run, small_db: Path, small: Catalogue, tmp_path: Path) -> None:
    found = small.find(StraightLine(150, 0.05), families=["four-bar"], limit=1)[0]
    done = run("show", found.id, "--db", small_db)
    assert done.code == 0
    assert done.err == ""
    for words in (f"guide {found.id}: {found.series} four-bar", "straight line", "parameters", "Reach", "guided"):
        assert words in done.out
    laid = json.loads(run("show", found.id, "--stroke", 150, "--format", "json", "--db", small_db).out)
    assert laid["stroke"] == 150
    assert laid["id"] == found.id
    picture = tmp_path / "guide.svg"
    done = run("show", found.id, "--plot", picture, "--db", small_db)
    assert done.code == 0
    assert "<svg" in picture.read_text()
    assert str(picture) in done.err


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("999999999",), "the database holds no guide 999999999"),
        (("9" * 40,), "the database holds no guide 999"),
        (("nobody",), "the database holds no guide nobody"),
        (("1", "--level", "5"), "guide 1 has no reach of level 5; it has -"),
        (("1", "--stroke", "-3"), "stroke must be a finite number above zero, not -3"),
        (("1", "--plot", "{tmp}/guide.xyz"), "xyz"),
        (("spatial-guidance:1", "--level", "-3"), "spatial-guidance:1 is of a collection: --level is for a stored"),
        (("1", "--plot", "{tmp}/absent/guide.png"), "absent"),
    ],
)
def test_show_refuses(run: Run, small_db: Path, tmp_path: Path, arguments: Any, message: str) -> None:
    done = run("show", *(a.replace("{tmp}", str(tmp_path)) for a in arguments), "--db", small_db)
    assert done.code == 2
    assert message in done.line


# -- plugins and build --------------------------------------------------------------------------------------------
BROKEN = '"""Divides by zero."""\nx = 1 / 0\n'
RAISING = '''"""Raises when it is asked for pivots."""
from catalogue.plugin import Member, Parameter, Series, hookimpl

def pivots(p):
    raise RuntimeError("no pivots today")

@hookimpl
def catalogue_series():
    member = Member("general", "four-bar", [Parameter("a", ((0.0, 1.0),), "anything")], pivots)
    return [Series("V.no", "never", "V*.no", "nowhere", [member], lambda i: (1 / 0, 1 / 0), lambda p: [])]
'''


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A plugin folder with a good series, one that fails at import, one that raises inside `pivots`."""
    made = tmp_path_factory.mktemp("plugins")
    shutil.copy(Path(__file__).parents[1] / "plugins" / "dropin" / "my_x0.py", made)
    (made / "broken.py").write_text(BROKEN)
    (made / "raising.py").write_text(RAISING)
    return made


@pytest.mark.slow
def test_plugins_lists_what_was_left_out(process: Run, folder: Path) -> None:
    done = process("plugins", "--format", "json", CATALOGUE_PLUGINS=str(folder))
    assert done.code == 5
    assert done.err == ""
    records = {r["name"]: r for r in json.loads(done.out)}
    assert records["broken"]["error"] == "ZeroDivisionError: division by zero"
    assert records["my_x0"]["series"] == ["my.x0"]
    assert records["iv_l"]["series"] == ["IV.l", "IV*.l"]
    assert records["iv_l"]["version"]
    assert all(not r["error"] for name, r in records.items() if name != "broken")


@pytest.mark.slow
def test_plugins_prints_a_table(run: Run, folder: Path) -> None:
    done = run("plugins")
    assert done.code == 0
    assert done.err == ""
    assert "II*.xy" in done.out
    done = run("plugins", "--plugins", folder)
    assert done.code == 5
    assert (
        "left out: ZeroDivisionError" in "".join(done.out.split("\n")).replace("  ", " ")
        or "ZeroDivisionError" in done.out
    )
    rows = list(csv.reader(io.StringIO(run("plugins", "--format", "csv").out)))
    assert rows[0] == ["plugin", "version", "adds", "from"]


@pytest.mark.slow
def test_a_plugin_folder_that_is_not_there(run: Run, tmp_path: Path) -> None:
    for command in (("plugins",), ("classify", "-"), ("build", "--db", tmp_path / "some.db")):
        done = run(*command, "--plugins", tmp_path / "absent", stdin=json.dumps(WATT))
        assert done.code == 5
        assert f"plugin folder {tmp_path / 'absent'} does not exist" in done.line


@pytest.mark.parametrize("text", ["II.xy", "II*.xy"])
def test_two_plugins_of_one_series(run: Run, tmp_path: Path, text: str) -> None:
    source = (Path(__file__).parents[1] / "plugins" / "dropin" / "my_x0.py").read_text()
    (tmp_path / "again.py").write_text(source.replace('"my.x0"', f'"{text}"'))
    done = run("plugins", "--plugins", tmp_path)
    assert done.code == 5
    assert f"{text} is claimed by two plugins" in done.line
    assert "again.py" in done.line
    assert "ii_xy.py" in done.line


@pytest.fixture(scope="module")
def extended(process: Run, folder: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Any]:
    """A database with the dropped-in series, and how its build went."""
    file = tmp_path_factory.mktemp("extended") / "extended.db"
    done = process("build", "--count", 300, "--series", "my.x0", "--series", "V.no", "--series", "IV*.l", "--db", file,
                   CATALOGUE_PLUGINS=str(folder))  # fmt: skip
    return file, done


@pytest.mark.slow
def test_build_uses_a_dropped_in_series_and_survives_the_broken_ones(extended: tuple[Path, Any]) -> None:
    file, done = extended
    assert done.code == 5
    assert done.out == ""
    lines = done.err.strip().splitlines()
    assert any("plugin broken" in line and "ZeroDivisionError: division by zero" in line for line in lines)
    assert any("V.no four-bar general is left out: RuntimeError: no pivots today" in line for line in lines)
    assert any("series V.no is left out: ZeroDivisionError" in line for line in lines)  # named guides are classified
    assert any("guides" in line and "rows/s" in line for line in lines)
    assert len(lines) == 4
    with closing(sqlite3.connect(file)) as connection:
        (check,) = connection.execute("PRAGMA integrity_check").fetchone()
        held = dict(connection.execute("SELECT series, count(*) FROM guide GROUP BY series"))
    assert check == "ok"
    assert held["my.x0"] > 100
    assert held["IV*.l"] > 100
    assert "V.no" not in held


@pytest.mark.slow
def test_find_uses_a_dropped_in_series(run: Run, extended: tuple[Path, Any]) -> None:
    file, _ = extended
    with closing(sqlite3.connect(file)) as connection:
        connection.execute("UPDATE setting SET value = 'yes' WHERE key = 'complete'")
        connection.commit()
    # found without the plugin: the database holds all that is needed
    done = run("find", "circular-arc", "--stroke", 10, "--radius", 12, "--deviation", 0.01, "--series", "my.x0",
               "--format", "json", "--db", file)  # fmt: skip
    assert done.code == 0
    found = json.loads(done.out)
    assert {c["series"] for c in found} == {"my.x0"}
    assert {c["family"] for c in found} == {"slider-crank"}


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
def test_classify_uses_a_dropped_in_series(process: Run, folder: Path) -> None:
    pivots = [[[-1, 0, 1], [0, 0, 1]], [[0.8, 0.6, 0], [0.48, 0.36, 1]]]  # crank to the pole, coupler along the ray
    good = folder.parent / "good"
    good.mkdir(exist_ok=True)
    shutil.copy(folder / "my_x0.py", good)
    done = process("classify", "-", "--format", "json", "--plugins", good, stdin=json.dumps(pivots))
    (row,) = json.loads(done.out)
    assert "my.x0" in row["series"]
    assert done.code == 0
    # the others only cost a line
    done = process("classify", "-", "--format", "json", "--plugins", folder, stdin=json.dumps(pivots))
    assert done.code == 0
    assert "my.x0" in json.loads(done.out)[0]["series"]
    assert "plugin broken" in done.err


@pytest.mark.slow
def test_build_again_does_nothing_and_more_goes_on(process: Run, tmp_path: Path) -> None:
    file = tmp_path / "some.db"
    first = process("build", "--count", 200, "--series", "IV*.l", "--seed", 4, "--db", file)
    assert first.code == 0
    assert first.out == ""
    assert "rows/s" in first.err
    again = process("build", "--count", 200, "--series", "IV*.l", "--seed", 4, "--db", file)
    assert again.code == 0
    assert "nothing to do" in again.err
    with closing(sqlite3.connect(file)) as connection:
        assert {s for (s,) in connection.execute("SELECT DISTINCT series FROM guide")} >= {"IV*.l"}
        assert dict(connection.execute("SELECT key, value FROM setting"))["complete"] == "yes"


@pytest.mark.slow
def test_build_draws_a_collection(run: Run, tmp_path: Path) -> None:
    options = ("--collection", "swings", "--plugins", SWINGS, "--db", tmp_path / "some.db")
    for told in ("drawing swings", "nothing to do"):
        done = run("build", *options, "--count", 20)
        assert done.code == 0
        assert told in done.err
    for wrong in (("--series", "I.GG"), ("--processes", 1)):
        done = run("build", *options, *wrong)
        assert done.code == 2
        assert (
            done.line
            == "catalogue: --series, --processes and --engine do not go with --collection: one process draws all of it"
        )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--count", 0), "count must be at least 1, not 0"),
        (("--count", -5), "count must be at least 1, not -5"),
        (("--seed", -1), "seed must be at least 0, not -1"),
        (("--series", "V.zz"), "unknown series V.zz; there are general, I.GG"),
        (("--processes", -1), "processes must be at least 1, not -1"),
    ],
)
def test_build_refuses(run: Run, tmp_path: Path, options: tuple[Any, ...], message: str) -> None:
    done = run("build", *options, "--db", tmp_path / "some.db")
    assert done.code == 2
    assert message in done.line


@pytest.mark.slow
def test_a_full_disk_is_one_line_and_the_file_still_opens(environment: dict[str, str], tmp_path: Path) -> None:
    """A limit on the size of files stands in for the disk."""
    resource = pytest.importorskip("resource", reason="only POSIX limits the size of files")
    file = tmp_path / "full.db"
    limit = 600_000

    def no_larger() -> None:
        import signal

        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    command = [sys.executable, "-m", "catalogue", "build", "--count", "500", "--series", "IV*.l", "--db", str(file)]
    done = subprocess.run(
        command, env=environment, capture_output=True, text=True, timeout=120, preexec_fn=no_larger
    )  # fmt: skip
    assert done.returncode == 4, done.stderr
    *busy, line = done.stderr.strip().splitlines()
    assert all(one.startswith("building the catalogue") for one in busy), done.stderr
    assert str(file) in line
    with closing(sqlite3.connect(file)) as connection:
        assert connection.execute("PRAGMA integrity_check").fetchone() == ("ok",)
    # with room again it is finished
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr


def test_the_page_of_the_command_says_what_its_help_says() -> None:
    here = Path(__file__)
    page = here.parents[2] / "catalogue" / "cli" / "README.md"
    made = runpy.run_path(str(here.with_name("reference.py")))["reference"]()
    assert page.read_text("utf-8") == made, "renew it: python tests/cli/reference.py > catalogue/cli/README.md"


@pytest.mark.parametrize(
    ("content", "code", "said"),
    [
        (b"\xff\xfe0\x00,\x00", 2, "cannot read"),
        (b"0,0,1,1,3,0,2,2\n0,0,1,nan,3,0,2,2\n", 3, "line 2, column 4: 'nan' is NaN or infinite"),
        (b"9" * 400 + b",0,1,1,3,0,2,2\n", 3, "line 1, column 1: '999"),
        (b"0,0,1,1,3,0,2," + b"2" * 140_000, 2, "is no valid CSV: field larger than field limit"),
        (b"[" * 100_000, 2, "is no valid JSON: it is nested too deeply"),
        (b"[[[" + b"9" * 5000 + b",0],[1,1]]]", 3, "a linkage is [[A1, A1*]"),
        (b'{"pivots": [[["0", "0"], [1, 1]], [[3, 0], [2, 2]]]}', 3, "a linkage is [[A1, A1*]"),
        (b'{"crank": "2", "coupler": 3, "angle": 60}', 2, "crank must be a number, not '2'"),
        (b"0,0;1;1\n", 2, "2 numbers|3 numbers|numbers; 8"),
    ],
    ids=lambda value: repr(value)[:24],
)
def test_files_that_hold_no_linkage_are_told_in_one_line(
    run: Run, tmp_path: Path, content: bytes, code: int, said: str
) -> None:
    (file := tmp_path / "given").write_bytes(content)
    done = run("classify", file)
    assert done.code == code
    assert any(part in done.line for part in said.split("|")), done.line
    assert len(done.line) < 400


@pytest.mark.slow
def test_the_plate_of_a_named_design_is_that_of_its_series(run: Run, tmp_path: Path) -> None:
    one, other = tmp_path / "design.svg", tmp_path / "series.svg"
    assert run("plate", "evans", "--out", one).code == 0
    assert run("plate", "II.xy", "--out", other).code == 0
    assert one.read_bytes() == other.read_bytes()


def test_only_near_names_are_offered(run: Run, small_db: Path) -> None:
    assert "near names" not in run("show", "nosuch", "--db", small_db).line
    assert "near names are evans" in run("show", "evens", "--db", small_db).line


def test_the_card_of_an_answer_keeps_the_meanings_and_few_digits(
    run: Run, code: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    printed, exact = run("show", code).out, json.loads(run("show", code, "--format", "json").out)
    assert "meaning" in printed
    digits = [len(text.replace(".", "").lstrip("0")) for text in re.findall(r"\d+\.\d+", printed)]
    assert max(digits) == 8
    assert max(map(len, printed.splitlines())) <= 80
    assert len(repr(exact["deviation"])) > 12


@pytest.mark.slow
def test_a_sort_without_guides_is_named_with_its_value(run: Run, small_db: Path) -> None:
    asked = ("find", "straight-line", "--stroke", 1, "--deviation", 0.01, "--db", small_db)
    done = run(*asked, "--series", "II.ooo", "--family", "four-bar")
    assert (
        "none is stored for --family four-bar with --series II.ooo and such a path; leave one of" in done.out + done.err
    )


@pytest.mark.slow
def test_a_series_alone_has_its_share_of_the_default_count(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[int] = []
    monkeypatch.setattr("catalogue.populate.fill.fill", lambda *_, count, **__: asked.append(count))
    with catalogue_open(tmp_path / "new.db", build=False) as cat:
        cat.build(series=["II.xy"])
        cat.build(series=["II.xy"], count=7)
        every = len(cat.registry.series)
    assert 12_000 / every / 3 < asked[0] < 3 * 12_000 / every
    assert asked[1] == 7
