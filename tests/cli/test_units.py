"""Lengths and angles in the units of a workshop; requests from files."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
import pytest
from hypothesis import given
from hypothesis import strategies as st

from catalogue.cli import units
from catalogue.cli.config import options_from_file
from catalogue.cli.find import straight_line
from catalogue.errors import InvalidRequest
from catalogue.units import ASSUMPTION

Run = Callable[..., Any]
LINE = ("find", "straight-line", "--no-refine", "--limit", 1, "--format", "json")


def read(text: Any, unit: str = "", type_: Any = units.LENGTH) -> tuple[float, str]:
    """Return what a text is read as, and the unit of output afterwards."""
    with click.Context(click.Command("x")) as ctx:
        if unit:
            ctx.meta[units.KEY] = unit
        return type_.convert(text, None, ctx), ctx.meta.get(units.KEY, "")


@pytest.mark.parametrize(
    ("text", "unit", "number"),
    [
        ("80", "", 80.0), ("-1e-3", "", -0.001), ("inf", "", math.inf), ("1/8", "", 0.125), ("80mm", "mm", 80.0),
        ("80 MM", "mm", 80.0), ("2.5 cm", "cm", 2.5), ("1m", "m", 1.0), ("3.5in", "in", 3.5), ('3 1/2"', "in", 3.5),
        ('3-1/2"', "in", 3.5), ("1/8in", "in", 0.125), ("-3 1/2 in", "in", -3.5), ("50um", "mm", 0.05),
        ("50\u00b5m", "mm", 0.05), ("2ft", "ft", 2.0), ("2'", "ft", 2.0), (".5inch", "in", 0.5), ("0mm", "mm", 0.0),
        ("1e-999999999mm", "mm", 0.0),
    ],
)  # fmt: skip
def test_lengths_are_read(text: str, unit: str, number: float) -> None:
    assert read(text) == (number, unit)


@pytest.mark.parametrize(
    ("text", "unit", "number"),
    [("1in", "mm", 25.4), ("25.4mm", "in", 1.0), ("1cm", "mm", 10.0), ("1m", "cm", 100.0), ("0.1in", "mm", 2.54),
     ("7/64in", "mm", 2.778125), ("80", "in", 80.0), ("1ft", "m", 0.3048)],
)  # fmt: skip
def test_lengths_are_converted_exactly(text: str, unit: str, number: float) -> None:
    assert read(text, unit) == (number, unit)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "x",
        "3..5in",
        "1/0in",
        "3 mmm",
        "5 apples",
        "1e999in",
        "--",
        "in",
        "3 4in",
        "1e5000/2",
        "1_000",
        "1e999",
        "\u0661\u0662",
        "\uff11mm",
        "1_000mm",
        "inf mm",
    ],
)
def test_nonsense_is_no_length(text: str) -> None:
    with pytest.raises(click.BadParameter, match=r"is no length: write 80, 80mm, 2\.5cm"):
        read(text)


@pytest.mark.parametrize(
    ("text", "number"),
    [("30", 30.0), ("30deg", 30.0), ("30\u00b0", 30.0), ("0.5rad", math.degrees(0.5)), ("-1 rad", -57.29577951308232)],
)
def test_angles_are_read(text: str, number: float) -> None:
    assert read(text, type_=units.ANGLE) == (number, "")
    with pytest.raises(click.BadParameter, match=r"is no angle: write 30, 30deg or 0\.5rad"):
        read("30mm", type_=units.ANGLE)


@given(st.text(max_size=20))
def test_any_text_is_a_length_or_refused(text: str) -> None:
    try:
        number, unit = read(text)
    except click.BadParameter:
        return
    assert isinstance(number, float)
    assert unit in {"", *units.UNITS}


@given(st.floats(1e-6, 1e6), st.sampled_from([*units.UNITS]), st.sampled_from([*units.UNITS]))
def test_there_and_back_is_the_same(number: float, one: str, other: str) -> None:
    there, _ = read(f"{number!r}{one}", other)
    assert read(f"{there!r}{other}", one)[0] == pytest.approx(number, rel=1e-15)


@pytest.mark.slow
@pytest.mark.usefixtures("searched_once")
def test_a_request_in_inches_is_the_same_in_millimetres(run: Run, small_db: Path) -> None:
    inches = run(
        *LINE, "--stroke", '6"', "--deviation", "1/500in", "--max-size", "500mm", "--unit", "mm", "--db", small_db
    )
    plain = run(*LINE, "--stroke", 152.4, "--deviation", 0.0508, "--max-size", 500, "--unit", "mm", "--db", small_db)
    assert inches.code == 0
    assert inches.out == plain.out
    shown = run(*LINE[:-2], "--stroke", '6"', "--deviation", 0.002, "--keep-out", "1ft,1ft,2ft,2ft", "--db", small_db)
    assert "Guides for a straight line of 6 in" in shown.out
    guide = run("show", "watt", "--stroke", "6in", "--db", small_db).out
    for told in ("Laid from (0, 0) to (6, 0), in mid-stroke; deviation", " in\n", "length [in]", "x [in]", "y [in]"):
        assert told in guide


@pytest.mark.slow
def test_an_answer_is_shown_with_the_unit_of_its_lengths(run: Run, small_db: Path) -> None:
    [found] = json.loads(run(*LINE, "--stroke", 6, "--deviation", 0.02, "--db", small_db).out)
    cells = [line.split() for line in run("show", found["code"], "--unit", "in").out.splitlines()]
    assert next(line for line in cells if line[:1] == ["stroke"])[:3] == ["stroke", "6", "in"]
    assert next(line for line in cells if line[:1] == ["size"])[2] == "in"
    plain = [line.split() for line in run("show", found["code"]).out.splitlines()]
    assert next(line for line in plain if line[:1] == ["stroke"])[2] == "length"


def test_every_length_of_a_request_may_have_a_unit(run: Run, small_db: Path) -> None:
    """None is taken for a plain number: an impossible one is told of in the unit of output."""
    done = run(
        *LINE, "--stroke", "150mm", "--deviation", "0.05mm", "--min-link", "4in", "--max-link", "5cm", "--db", small_db
    )
    assert "min_link 101.6 is above max_link 50" in done.line
    done = run("measure", "-", "--stroke", "three", stdin="{}")
    assert "'three' is no length" in done.err


def test_a_file_holds_a_request_and_the_command_line_wins(run: Run, small_db: Path, tmp_path: Path) -> None:
    (file := tmp_path / "press.toml").write_text(
        'stroke = "15cm"\ndeviation = "0.05mm"\nmin-link = 4\nmax_link = 5\npins-only = true\n'
        'family = ["four-bar"]\nfixed-pivots-in = [-9, -9, 9, 9]\nkeep-out = [[0, 0, 1, 1], "2,2,3,3"]\n'
    )  # fmt: skip
    done = run(*LINE, "--config", file, "--unit", "mm", "--min-link", 7, "--db", small_db)
    assert "min_link 7 is above max_link 5" in done.line
    held = options_from_file(str(file), straight_line)
    assert held["keep_out"] == ["0,0,1,1", "2,2,3,3"]
    assert held["pins_only"] is True


def test_options_win_over_the_file_and_the_file_over_the_environment(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The database that is asked is told by its name: none of them is one."""
    names = [tmp_path / f"{place}.db" for place in ("options", "config", "environment")]
    for file in names:
        file.write_text("no database" * 100)
    (config := tmp_path / "x.toml").write_text(f"stroke = 1\ndeviation = 0.1\ndb = {str(names[1])!r}\n")
    monkeypatch.setenv("CATALOGUE_DB", str(names[2]))
    given = (("--db", names[0], "--config", config), ("--config", config, "--db", names[0]), ("--config", config))
    asked = [run(*LINE, *options) for options in (*given, ("--stroke", 1, "--deviation", 0.1))]
    assert [names.index(Path(done.line.split()[1])) for done in asked] == [0, 0, 1, 2]
    told = " ".join(run(*LINE, "--help").out.split())
    assert "Command-line options override it; it overrides CATALOGUE_DB" in told


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("storke = 1", "`find straight-line` has no option 'storke'; did you mean 'stroke'?"),
        ("config = 'x'", "has no option 'config'"),
        ("stroke = ", "cannot read"),
        ("pins-only = 1", "pins-only must be true or false, not 1"),
        ("stroke = true", "stroke cannot be True"),
        ("[stroke]\nlength = 1", "stroke cannot be {'length': 1}"),
    ],
)
def test_a_file_that_is_no_request_is_told_in_one_line(run: Run, tmp_path: Path, text: str, said: str) -> None:
    (file := tmp_path / "x.toml").write_text(text)
    done = run(*LINE, "--config", file)
    assert done.code == 2
    assert said in done.line
    with pytest.raises(InvalidRequest):
        options_from_file(str(tmp_path / "none.toml"), straight_line)


@pytest.mark.slow
def test_dwells_are_scaled_with_their_crank(run: Run, small_db: Path) -> None:
    asked = (
        "find",
        "dwell",
        "--angle",
        60,
        "--residual",
        1,
        "--swing",
        "20deg",
        "--limit",
        1,
        "--format",
        "json",
        "--db",
        small_db,
    )
    (one,), (inch,) = (json.loads(run(*asked, *more).out) for more in ((), ("--crank-length", "2in", "--unit", "mm")))
    assert inch["size"] == pytest.approx(50.8 * one["size"])
    assert inch["swing"] == one["swing"]
    for name, value in one["lengths"].items():
        assert inch["lengths"][name] == pytest.approx(50.8 * value)
    assert one["lengths"]["rod"] == pytest.approx(math.dist(one["guided"], one["joint"]))


@given(st.text(alphabet="0123456789_.eE+- \u0661\uff11\u00b2", max_size=8))
def test_a_number_is_read_alike_with_and_without_a_unit(text: str) -> None:
    """One that is refused with a unit is refused without it, and the other way round."""

    def told(text: str) -> float | None:
        try:
            return read(text, "mm")[0]
        except click.BadParameter:
            return None

    assert told(text) == told(f"{text}mm")


def test_other_digits_are_no_number_of_an_option_either(run: Run, small_db: Path) -> None:
    for flag, value in (
        ("--limit", "1_0"),
        ("--distinct", "0_1"),
        ("--limit", "\u0661"),
        ("--min-uniformity", "\uff11"),
    ):
        done = run(*LINE[:2], "--stroke", 100, "--deviation", 0.5, flag, value, "--db", small_db)
        assert done.code == 2
        assert "is not a valid" in done.err
    done = run(*LINE, "--stroke", 100, "--deviation", 0.5, "--rank-by", "size=1_0", "--db", small_db)
    assert "the weight of size must be a number" in done.line


INCHES = (*LINE, "--stroke", '14"', "--deviation", 0.05)


@pytest.mark.slow
def test_an_answer_keeps_its_unit_from_command_to_command(run: Run, small_db: Path, tmp_path: Path) -> None:
    saved = tmp_path / "saved.json"
    [found] = json.loads(run(*INCHES, "--save", saved, "--db", small_db).out)
    code = found["code"]
    assert found["unit"] == "in"
    assert json.loads(saved.read_text("utf-8"))["answers"][0]["unit"] == "in"
    for what in (code, saved):
        cells = [line.split() for line in run("show", what).out.splitlines()]
        assert next(line for line in cells if line[:1] == ["stroke"])[:3] == ["stroke", "14", "in"]
        shown = json.loads(run("show", what, "--unit", "mm", "--format", "json").out)
        assert (shown["unit"], shown["stroke"]) == ("mm", 355.6)
        assert shown["deviation"] == pytest.approx(25.4 * found["deviation"], rel=1e-14)
    (again,) = json.loads(run("measure", code, "--stroke", "355.6mm", "--limit", 1, "--format", "json").out)
    assert (again["unit"], again["stroke"]) == ("mm", pytest.approx(355.6))
    (again,) = json.loads(run("measure", code, "--stroke", 14, "--limit", 1, "--format", "json").out)
    assert (again["unit"], again["stroke"]) == ("in", pytest.approx(14))
    assert "guided x [in]" in run("trace", code, "--samples", 2).out
    assert "guided x [cm]" in run("trace", code, "--samples", 2, "--unit", "cm").out
    for unit, said in ((None, "stroke 14 in "), ("mm", "stroke 355.6 mm ")):
        page = tmp_path / f"{unit}.html"
        assert run("sheet", code, "--out", page, *(("--unit", unit) if unit else ())).code == 0
        assert said in page.read_text("utf-8")
        assert code in page.read_text("utf-8")  # drawn in another unit it is the same answer
    drawing = tmp_path / "guide.dxf"
    assert "no unit" not in run("export", code, "--out", drawing).err
    assert re.search(r"\$INSUNITS\n +70\n1\n", drawing.read_text("utf-8"))


@pytest.mark.slow
def test_an_answer_without_a_unit_is_taken_as_millimetres_aloud(run: Run, small_db: Path, tmp_path: Path) -> None:
    [found] = json.loads(run(*LINE, "--stroke", 14, "--deviation", 0.05, "--db", small_db).out)
    assert found["unit"] is None
    drawing = tmp_path / "guide.dxf"
    done = run("export", found["code"], "--out", drawing)
    assert f"{ASSUMPTION}; --unit names another" in done.err
    assert ASSUMPTION in drawing.read_text("utf-8")
    assert "taken as" not in run("export", found["code"], "--out", drawing, "--force", "--unit", "in").err
    assert re.search(r"\$INSUNITS\n +70\n1\n", drawing.read_text("utf-8"))
    done = run("sheet", found["code"], "--out", tmp_path / "guide.html")
    assert "taken as mm" in done.err
    assert "taken as mm" in (tmp_path / "guide.html").read_text("utf-8")
    assert run("export", "--unit", "mm", "--db", small_db).line.endswith("--unit is for one guide: name it")


@pytest.mark.slow
def test_a_linkage_of_a_file_and_a_named_guide_have_a_unit(run: Run, small_db: Path, tmp_path: Path) -> None:
    mine = tmp_path / "mine.json"
    mine.write_text(
        '{"unit": "inch", "ground": 22, "crank": 10, "coupler": 25, "rocker": 25, "along": 12.5, "across": 8}'
    )
    table = tmp_path / "mine.csv"
    table.write_text("ground,crank,coupler,rocker,along,across,unit\n22,10,25,25,12.5,8,in\n")
    for file in (mine, table):
        equations = run("export", file, "--format", "solidworks").out
        assert '"crank_1" = 10in' in equations
        assert '"crank_1" = 254mm' in run("export", file, "--format", "solidworks", "--unit", "mm").out
        (one,) = json.loads(run("measure", file, "--stroke", "304.8mm", "--limit", 1, "--format", "json").out)
        assert (one["unit"], one["lengths"]["crank 1"]) == ("mm", pytest.approx(254))
    point = ("--point", "2.54", "0", "--unit", "cm")
    assert '"point_across"' in run("export", mine, "--format", "solidworks", *point).out
    record = json.loads(run("export", mine, "--format", "json", *point).out)
    assert (record["unit"], record["guided"]) == ("cm", [2.54, 0.0])
    mine.write_text(
        '{"unit": "parsec", "ground": 22, "crank": 10, "coupler": 25, "rocker": 25, "along": 1, "across": 8}'
    )
    assert (
        "there is no unit 'parsec' of length; there are mm, cm, m, in, ft" in run("measure", mine, "--stroke", 1).line
    )
    watt = run("export", "watt", "--stroke", '14"', "--format", "json", "--db", small_db).out
    assert (json.loads(watt)["unit"], json.loads(watt)["measured"]["stroke"]) == ("in", 14.0)
    metric = json.loads(
        run("export", "watt", "--stroke", '14"', "--format", "json", "--unit", "mm", "--db", small_db).out
    )
    assert (metric["unit"], metric["measured"]["stroke"]) == ("mm", 355.6)


@pytest.mark.slow
def test_mixed_files_are_read_in_one_unit(run: Run, tmp_path: Path) -> None:
    links = {"ground": 22.0, "crank": 10.0, "coupler": 25.0, "rocker": 25.0, "along": 12.5, "across": 8.0}
    metric = {name: 2.54 * value for name, value in links.items()}
    (file := tmp_path / "both.json").write_text(json.dumps([{**links, "unit": "in"}, {**metric, "unit": "cm"}]))
    one, other = json.loads(run("measure", file, "--stroke", 12, "--format", "json").out)
    assert one["unit"] == other["unit"] == "in"
    assert other["deviation"] == pytest.approx(one["deviation"], rel=1e-9)
    given = [[[0, 0], [1, 2]], [[4, 0], [3, 3]]]
    metric_ = [[[2.54 * x, 2.54 * y] for x, y in dyad] for dyad in given]
    file.write_text(json.dumps([{"pivots": given, "unit": "in"}, {"pivots": metric_, "unit": "cm"}]))
    one, other = json.loads(run("classify", file, "--guided", "--format", "json").out)
    for a, b in zip(one["guided"], other["guided"], strict=True):
        assert b["fixed"] == pytest.approx(a["fixed"], rel=1e-9, abs=1e-9)
