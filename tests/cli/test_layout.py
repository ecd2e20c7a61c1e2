"""Tables at every width: no line is longer, every code and number is whole."""

from __future__ import annotations

import importlib
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from catalogue.cli import layout, tables
from catalogue.cli.layout import Heading
from catalogue.cli.tables import print_table, tell
from catalogue.guides.candidate import COLUMNS, Candidate
from catalogue.guides.columns import CANDIDATE, DWELL, STRETCH
from catalogue.guides.dwell import DwellCandidate
from catalogue.guides.stretch import Stretch

Run = Callable[..., Any]
WIDTHS = (60, 80, 100, 140)
#: Where all columns have room.
ALL = 400
AXLE = Path(__file__).parents[2] / "data" / "spatial" / "five_link_axle.toml"
MINE = '{"crank": 100, "rocker": 250, "ground": 220, "coupler": 250, "along": 125, "across": 80}'
#: What must not be broken over lines: numbers with their signs and exponents.
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e-?\d+)?")


@pytest.fixture
def mine(tmp_path: Path) -> Path:
    (file := tmp_path / "mine.json").write_text(MINE)
    return file


def fits(text: str, width: int) -> None:
    """Assert that no line is longer than the width, nor ends in blanks."""
    assert text
    for line in text.splitlines():
        assert len(line) <= width, line
        assert line == line.rstrip()


def at_widths(run: Run, monkeypatch: pytest.MonkeyPatch, arguments: tuple[Any, ...]) -> dict[int, str]:
    """Return what a command prints at each width."""
    printed = {}
    for width in WIDTHS:
        monkeypatch.setenv("COLUMNS", str(width))
        done = run(*arguments)
        assert done.code == 0, done.err
        fits(done.out, width)
        printed[width] = done.out
    return printed


FIND = ("find", "straight-line", "--stroke", 150, "--deviation", 0.05, "--no-refine", "--limit", 5)
ANSWERED = {
    "find": FIND,
    "arc": ("find", "circular-arc", "--stroke", 150, "--deviation", 0.05, "--no-refine", "--limit", 5, "--play", 0.01,
            "--pareto", "size,transmission"),
    "dwell": ("find", "dwell", "--angle", 60, "--residual", 1, "--swing", 20, "--limit", 3, "--crank-length", "40mm"),
    "measure": ("measure", "MINE", "--stroke", 120, "--deviation", 3),
    "improve": ("improve", "MINE", "--stroke", 120, "--deviation", 0.3, "--hold", "fixed-pivots", "--no-catalogue"),
}  # fmt: skip
SWEEP = ("spatial", "sweep", AXLE, "--drive", "travel", "--hold", "rack", "--from", -80, "--to", 80, "--steps", 3)


@pytest.mark.slow
@pytest.mark.parametrize("name", ANSWERED)
def test_tables_of_answers_fit_every_width(
    run: Run, monkeypatch: pytest.MonkeyPatch, small_db: Path, mine: Path, name: str
) -> None:
    """They are sought once and printed at each width; what `show` makes of them too."""
    command = importlib.import_module(f"catalogue.cli.{'find' if name == 'arc' else name}")
    answers: list[tuple[str, Any]] = []

    def printed_at_each(found: Any, table: Any, output: str, **_: Any) -> None:
        answers.extend(zip(found.remember(), found, strict=True))
        for width in (*WIDTHS, ALL):
            monkeypatch.setenv("COLUMNS", str(width))
            print(end="\f")
            tables.print_results(found, table, output)

    monkeypatch.setattr(command, "print_results", printed_at_each)
    done = run(*(mine if word == "MINE" else word for word in ANSWERED[name]), "--db", small_db)
    texts = dict(zip((*WIDTHS, ALL), done.out.split("\f")[1:], strict=True))
    for width, text in texts.items():
        fits(text, width)
        told = text.splitlines()
        for code, _ in answers:
            (line,) = (line for line in told if code in line)
            assert line.startswith(code) or name == "improve"
        assert {*NUMBER.findall(text.partition("left out")[0])} <= {*NUMBER.findall(texts[ALL])}  # none is broken
    code, one = answers[0]
    for text in at_widths(run, monkeypatch, ("show", code)).values():
        assert all(f"{x:.8g}" in text for x in one.guided)
        assert all(f" {value:.6g}\n" in text for value in one.lengths.values())


@pytest.mark.slow
@pytest.mark.parametrize(
    "arguments", [SWEEP, ("schema",), ("spatial", "assemblies", *SWEEP[2:7])], ids=lambda a: a[1:2]
)
def test_other_tables_fit_every_width(run: Run, monkeypatch: pytest.MonkeyPatch, arguments: tuple[Any, ...]) -> None:
    printed = at_widths(run, monkeypatch, arguments)
    if arguments != ("schema",):
        numbers = [set(NUMBER.findall(text)) for text in printed.values()]
        assert all(one == numbers[0] for one in numbers)  # in bands none is left out


@pytest.mark.slow
@pytest.mark.parametrize("output", ["csv", "json"])
def test_the_width_does_not_change_what_programs_read(
    run: Run, monkeypatch: pytest.MonkeyPatch, small_db: Path, output: str
) -> None:
    printed = []
    for width in WIDTHS:
        monkeypatch.setenv("COLUMNS", str(width))
        printed.append(run(*FIND, "--format", output, "--db", small_db).out)
    assert len(set(printed)) == 1


@pytest.mark.parametrize(
    "command", [("find", "straight-line"), ("find", "dwell"), ("measure",), ("improve",), ("census",)]
)
def test_the_legend_explains_every_column(run: Run, monkeypatch: pytest.MonkeyPatch, command: tuple[str, ...]) -> None:
    printed = at_widths(run, monkeypatch, (*command, "--legend"))
    monkeypatch.setenv("COLUMNS", "100")
    told = run(*command, "--help").out.partition("Columns of the table:")[2]
    for line in told.split("\n\n")[0].strip().splitlines():
        if line.startswith("  ") and line[2] != " ":
            assert line.split()[0] in printed[140]


def test_every_field_of_an_answer_is_explained_once() -> None:
    assert set(CANDIDATE) == set(COLUMNS)
    assert set(STRETCH) == set(Stretch.columns())
    assert set(DWELL) == {*DwellCandidate.__dataclass_fields__, "lengths"}
    assert all(one.meaning for one in {**STRETCH, **DWELL}.values())
    assert "half the width of the narrowest strip" in str(Candidate.__doc__)


def test_headings_break_at_words_and_soft_hyphens() -> None:
    assert Heading("devi\u00adation").broken(5) == "devi-\nation"
    assert Heading("devi\u00adation").broken(9) == "deviation"
    assert Heading("screw axis at x [mm]").broken(9) == "screw\naxis at x\n[mm]"
    assert Heading("a b").broken(1) == "a\nb"


def printed(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], width: int, **more: Any) -> list[str]:
    """Return the lines of a table of eight columns."""
    monkeypatch.setenv("COLUMNS", str(width))
    names = ["code", *(f">number {k}" for k in range(7))]
    rows = [["abcdefg", *(f"{k}.23456" for k in range(7))], ["gfedcba", *("7.65432" for _ in range(7))]]
    tables.print_table("Title", names, rows, **more)
    return capsys.readouterr().out.splitlines()


def test_what_has_no_room_is_left_out_and_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = printed(monkeypatch, capsys, 60, spare=["number 3", "number 0", "number 6"])
    assert "left out for want of room: number 0, number 3" in lines
    text = "\n".join(lines[:-3])
    assert "0.23456" not in text
    assert "3.23456" not in text
    assert "6.23456" in text
    assert all("left out" not in line for line in printed(monkeypatch, capsys, 100, spare=["number 3"]))


def test_bands_repeat_the_first_columns(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    lines = printed(monkeypatch, capsys, 40, keys=1)
    assert sum(line.startswith("abcdefg") for line in lines) == 3
    assert "".join(lines).count(".23456") == 7


def test_without_either_each_row_is_a_card(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    lines = printed(monkeypatch, capsys, 50)
    assert lines[2] == "abcdefg"
    assert lines[3] == "  number 0 0.23456   number 1 1.23456"
    assert max(map(len, lines)) <= 50


def test_a_pipe_has_a_fixed_width(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("COLUMNS", raising=False)
    assert layout.console().width == layout.TABLE_WIDTH.piped
    monkeypatch.setenv("COLUMNS", "7")
    assert layout.console().width == layout.TABLE_WIDTH.least


def test_no_text_reaches_the_terminal_as_a_command(capsys: pytest.CaptureFixture[str]) -> None:
    bad = "A\x1b[2J\x1b]0;t\x07[red]\x9b\r"
    tell(bad)
    print_table(bad, ["", "~words"], [["", bad]], bad)
    out = capsys.readouterr().out
    assert all(c.isprintable() or c == "\n" for c in out), out
    assert out.count("[red]") == 4
