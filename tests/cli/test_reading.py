"""Files of linkages: read row for row in every dialect, or refused in one line that says where."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from catalogue.cli.reading import PIVOTS_EXCLUDE, linkages_of, read_rows
from catalogue.cli.rows import Row, rows_of
from catalogue.errors import CatalogueError
from catalogue.guides.columns import DWELL, STRETCH

Run = Callable[..., Any]
WATT = "-1,0.6,0,0.6,1,-0.6,0,-0.6,0.1,0.2"
BARS = "ground,crank,coupler,rocker,along,across"
MINE = "220,100,250,250,125,80"
PIVOTS = "[[[-1, 0.6], [0, 0.6]], [[1, -0.6], [0, -0.6]]]"

NUMBER = st.floats(-1e6, 1e6).map(lambda x: x + 0.0)
WRITTEN = st.sampled_from([repr, "{:+.17g}".format, "{:.17e}".format, lambda x: repr(x).replace("0.", ".", x == 0.5)])
NOTE = st.text(st.characters(codec="utf-8", exclude_categories=["C", "Z"]), max_size=8)
DIALECT = st.tuples(
    st.sampled_from(["\t", ";", "|", ",", " "]), st.sampled_from(["", " ", "  "]),
    st.sampled_from(["\n", "\r\n", "\r"]), st.sampled_from(["", "\ufeff"]), st.sampled_from(["", "\n", "\n\n"]),
)  # fmt: skip


def written(table: list[list[str]], dialect: tuple[str, ...]) -> str:
    delimiter, around, end, mark, tail = dialect
    return (mark + "\n".join(f"{around}{delimiter}{around}".join(row) + around for row in table) + tail).replace(
        "\n", end
    )


def read(folder: Path, text: str) -> list[Row]:
    (folder / "given.csv").write_bytes(text.encode())
    return read_rows(str(folder / "given.csv"))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("given")


@pytest.mark.parametrize("pivot", [2, 3])
@pytest.mark.parametrize("guided", [0, 2])
def test_a_line_of_numbers_is_four_pivots_and_the_guided_point(folder: Path, pivot: int, guided: int) -> None:
    numbers = [float(n) for n in range(1, 4 * pivot + guided + 1)]
    ((_, given_, _),) = read(folder, ",".join(map(str, numbers)))
    assert np.reshape(given_["pivots"], (4, 3))[:, :pivot].ravel().tolist() == numbers[: 4 * pivot]
    assert given_.get("point") == (complex(*numbers[-2:]) if guided else None)


@pytest.mark.slow
@given(
    st.sampled_from([8, 10, 12, 14]).flatmap(lambda n: st.lists(st.lists(NUMBER, min_size=n, max_size=n), min_size=1)),
    st.booleans(), WRITTEN, DIALECT,
)  # fmt: skip
def test_numbers_are_read_row_for_row_in_any_dialect(
    folder: Path, numbers: list[list[float]], headed: bool, form: Callable[[float], str], dialect: tuple[str, ...]
) -> None:
    heading = [[f"x{k}*" for k in range(len(numbers[0]))]] * headed
    rows = read(folder, written([*heading, *([form(x) for x in row] for row in numbers)], dialect))
    assert len(rows) == len(numbers)
    for (_, held, _), row in zip(rows, numbers, strict=True):
        width = 3 if len(row) > 10 else 2
        assert np.array(held["pivots"])[..., :width].ravel().tolist() == row[: 4 * width]
        assert [held[k] for k in held if k == "point"] == [complex(*row[4 * width :])] * (len(row) % 4 == 2)


@pytest.mark.slow
@given(
    st.lists(st.tuples(st.lists(NUMBER, min_size=5, max_size=5), NOTE), min_size=1), WRITTEN, DIALECT,
    st.permutations(["crank", "Coupler", "OFFSET", "along", "across"]),
)  # fmt: skip
def test_lengths_under_a_heading_are_read_row_for_row_in_any_dialect(
    folder: Path, numbers: list[tuple[list[float], str]], form: Callable[[float], str], dialect: tuple[str, ...],
    names: list[str],
) -> None:  # fmt: skip
    quoted = [[*map(form, row), '"' + note.replace('"', '""') + '"'] for row, note in numbers]
    rows = read(folder, written([[*names, "note"], *quoted], dialect))
    assert [held for _, held, _ in rows] == [dict(zip(map(str.lower, names), row, strict=True)) for row, _ in numbers]


@pytest.mark.slow
@given(st.text(), st.integers(0, 2), DIALECT)
def test_no_text_among_the_lines_loses_a_row(text: str, at: int, dialect: tuple[str, ...]) -> None:
    rows = [[*WATT.split(",")], [*WATT.split(",")]]
    rows.insert(at, [text.replace("\ufeff", "")])
    with suppress(CatalogueError):
        assert len(rows_of(written(rows, dialect).removeprefix("\ufeff"), "given.csv")) >= 2


@pytest.mark.parametrize(
    ("text", "code", "said"),
    [
        (f"{WATT.replace(',', ' ')}\n{WATT}\n", 2, "line 1: 1 numbers; 8"),
        (f"{WATT}\n{WATT.replace(',', ' ')}\n", 2, "line 2: 1 numbers; 8"),
        (f"{WATT.replace(',', '|')}\n{WATT}\n", 2, "line 2: 1 numbers; 8 (x, y) or 12 (x, y, w) are wanted, and 2 for "
         "the guided point, with '|' between, as in the whole file"),
        (f'"{WATT}"\n{WATT}\n', 2, "line 1: 1 numbers; 8"),
        (f"{WATT.replace(',', 'mm,')}mm\n{WATT}\n", 2, "line 1, column 1: '-1mm' is no number: write it with a point"),
        ("-1,0;0,6;0,0;0,6;1,0;-0,6;0,0;-0,6;0,1;0,2\n" + WATT.replace(",", ";"), 2, "column 1: '-1,0' is no number"),
        (f"{WATT}\n{WATT.replace(',', ';')}\n", 2, "line 2: 1 numbers"),
        (f"1_0,{WATT[3:]}\n", 2, "line 1, column 1: '1_0' is no number"),
        (f"nan,{WATT[3:]}\n", 3, "line 1, column 1: 'nan' is NaN or infinite"),
        (f'{BARS},note\n{MINE},"3/4\n{MINE},b\n{MINE},c\n', 2, "line 2 is no valid CSV"),
        (f'{BARS},note\n{MINE},a\n{MINE},"b\nc"\n', 2, "line 3 is no valid CSV"),
        (f"{BARS.replace('across', 'acros')}\n{MINE}\n", 2, "line 2: there is no 'acros'; did you mean across?"),
        (f"{BARS},brnach\n{MINE},-1\n", 2, "line 2: there is no 'brnach'; did you mean branch?"),
        (f"{BARS.replace(',', ' [mm],')} [mm],angle [deg],id\n{MINE},3,4\n", 2,
         "line 2: there is no 'ground [mm]'; did you mean ground?"),
        (f"{BARS},made by\n{MINE},me\n", 2, "there is no 'made by'; names of notes are name, note, code, id"),
        (f"{BARS},\n{MINE},\n{MINE},7\n", 2, "line 3: there is no ''"),
        (f"{BARS},Crank\n{MINE},90\n", 2, "line 2: 'Crank' is given twice"),
        (f"{BARS}\n{MINE}\n{MINE.replace('100', '-1')}\n", 3, "line 3: its crank must be above zero"),
        (f"crank,coupler,along,across\n1,2,1,1\n\n{BARS}\n", 2, "line 4: it has 6 columns, the heading 4"),
        (f"{BARS}\n", 2, "holds no linkage"),
        ("", 2, "holds no linkage"),
        ("\ufeff\r\n \r\n", 2, "holds no linkage"),
        ("pivots,guided\n3,4\n", 3, "line 2: a linkage is [[A1, A1*]"),
        ('pivots,guided\n"[[",4\n', 2, "line 2, column pivots: '[[' is no list of numbers in brackets"),
        ('{"crank": 1, "coupler": 2, "crank": 3}', 2, "'crank' is given twice"),
        ('{"crank": 1, "coupler": 2, "Crank": 3}', 2, "'Crank' is given twice"),
        ('{"crank": 1, "coupler": 2, "ofset": 3}', 2, "linkage 0: there is no 'ofset'; did you mean offset?"),
        ('[{"crank": 1, "coupler": 3}, {"crank": 1, "coupler": true}]', 2, "linkage 1: coupler must be a number, not"),
        ('{"crank": 1, "coupler": [3]}', 2, "linkage 0: coupler must be a number, not [3.0]"),
        ('{"crank": 1, "coupler": null}', 2, "linkage 0: coupler must be a number, not None"),
        ('{"crank": 1, "coupler": NaN, "along": 0, "across": 0}', 3, "linkage 0: "),
        ('{"crank": 1, "coupler": 2, "along": Infinity, "across": 0}', 3, "linkage 0: its `along` is NaN or infinite"),
        ('[{"crank": 1, "coupler": 3}, {"crank": 1, "coupler": 3, "angle": 9, "branch": 0}]', 3, "linkage 1: its b"),
        (f'{{"pivots": {PIVOTS}, "point": [0, 0], "guided": [0, 1]}}', 2, "linkage 0: give one guided point"),
        (f'{{"pivots": {PIVOTS}, "guided": [0, 1], "x": 1, "y": 1}}', 2, "linkage 0: give one guided point"),
        (f'{{"pivots": {PIVOTS}, "x": 1}}', 2, "linkage 0: the guided point must be a number"),
        (f'{{"pivots": {PIVOTS}, "guided": [0, 1], "crank": 1}}', 2, "linkage 0: give `pivots` or `crank`, not both"),
        (f'{{"pivots": {PIVOTS}, "guided": [0, true]}}', 2, "a coordinate of "),
        (f"[{PIVOTS.replace('0.6', 'true', 1)}]", 3, "linkage 0: a linkage is [[A1, A1*]"),
        (f"[{PIVOTS}, {PIVOTS.replace('0.6', 'NaN', 1)}]", 3, "linkage 1: a pivot has a NaN"),
        (f"[[{PIVOTS}]]", 3, "linkage 0: a linkage is [[A1, A1*]"),
        (b"name;" + BARS.replace(",", ";").encode() + b"\nK\xfcbel;1;2;3;4;5;6\n", 2, "cannot read "),
    ],
)  # fmt: skip
def test_what_would_be_lost_or_misread_is_refused(
    run: Run, tmp_path: Path, text: str | bytes, code: int, said: str
) -> None:
    content = text.encode() if isinstance(text, str) else text
    (file := tmp_path / "given").write_bytes(content)
    for reference, stdin in ((file, b""), ("-", content)):
        done = run("measure", reference, "--stroke", 0.1, stdin=stdin)
        assert done.code == code
        assert said in done.line


def test_names_are_read_whatever_their_case_and_empty_cells_are_left_out(tmp_path: Path) -> None:
    (file := tmp_path / "given.csv").write_bytes(
        "\ufeffName;Crank;COUPLER;Offset;Branch;\r\nä;1;3;+.5;-1;\r\n\r\n;1;3e0;;;\r\n".encode()
    )
    assert [held for _, held, _ in read_rows(str(file))] == [
        {"crank": 1, "coupler": 3, "offset": 0.5, "branch": -1}, {"crank": 1, "coupler": 3},
    ]  # fmt: skip


@pytest.mark.parametrize("title", ["Guides of the crane, first floor", "guides", "# x1 y1 x1* y1*", "sep=,"])
def test_a_first_line_without_a_number_is_a_heading(tmp_path: Path, title: str) -> None:
    (file := tmp_path / "given.csv").write_text(f"{title}\n{WATT}\n{WATT}\n")
    assert len(read_rows(str(file))) == 2


@pytest.mark.slow
def test_what_the_command_prints_is_read_again(run: Run, mine: Path, tmp_path: Path) -> None:
    printed = run("measure", mine, "--stroke", 120, "--format", "json").out
    rows = json.loads(printed)
    exported = run("export", mine, "--format", "json").out
    sheet = run("measure", mine, "--stroke", 120, "--format", "csv").out
    for text in (printed, sheet):
        (file := tmp_path / "again").write_text(text)
        linkage, points = linkages_of(read_rows(str(file)))
        assert linkage.pivots.tolist() == [row["pivots"] for row in rows]
        assert points.tolist() == [complex(*row["guided"]) for row in rows]
    (file := tmp_path / "again").write_text(exported)
    assert len(read_rows(str(file))) == 1
    assert not PIVOTS_EXCLUDE & {*STRETCH, *DWELL}
