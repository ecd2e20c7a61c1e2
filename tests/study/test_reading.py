"""Requests of a study from grids, tables and files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from catalogue import InvalidRequest, Request, StraightLine
from catalogue.study.reading import grid, of_table, read

GRID = """
stroke = "15cm"
unit = "mm"
fixed_pivots_in = [-100, -100, 200, 100]
[grid]
deviation = [0.05, 0.1]
fixed_pivots_in = {scale = [0.5, 1]}
min_transmission = [30, 40]
"""
TABLE = "stroke [cm], deviation, max_size, family, pins-only\n15, 0.05mm, 40, four-bar, true\n15, 0.1mm,,,\n"


def test_a_grid_spans_its_axes_with_the_last_fastest(tmp_path: Path) -> None:
    (file := tmp_path / "chart.toml").write_text(GRID)
    found = read(file)
    assert len(found) == 8
    assert [one.constraints.min_transmission for one in found[:3]] == [30, 40, 30]
    assert found[0].path == StraightLine(150, 0.05, unit="mm")
    assert [one.constraints.fixed_pivots_in.to_list() for one in (found[0], found[2])] == [
        [-25, -50, 125, 50], [-100, -100, 200, 100],
    ]  # fmt: skip


def test_tables_and_lists_of_requests_are_the_same_from_any_file(tmp_path: Path) -> None:
    (csv := tmp_path / "some.csv").write_text(TABLE)
    found = read(csv)
    assert found == [Request.of(StraightLine(15, 0.005, unit="cm"), max_size=40, families="four-bar", pins_only=True),
                     Request.of(StraightLine(15, 0.01, unit="cm"))]  # fmt: skip
    (toml := tmp_path / "some.toml").write_text(
        "stroke = 15\nunit = 'cm'\n" + "".join(f"[[request]]\n{_lines(one)}" for one in found)
    )
    assert read(toml) == found
    table = pd.DataFrame([one.to_row() for one in found])
    assert of_table(table) == found
    table.to_parquet(tmp_path / "some.parquet")
    assert read(tmp_path / "some.parquet") == found


def _lines(one: Request) -> str:
    return "".join(f"{line}\n" for line in one.to_toml().splitlines() if not line.startswith(("stroke", "unit")))


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("a.toml", "stroke = 150\ndeviation = 1", r"has a table \[grid\], or requests"),
        ("a.toml", "stroke = 150\n[grid]\ndeviation = []", "axis deviation must be a list of one value or more"),
        ("a.toml", "stroke = 150\n[grid]\ndeviation = {scale = [1]}", "of a value of the base"),
        ("a.toml", "stroke = 150\ndeviation = 1\n[grid]\nmax_sise = [1]", "did you mean max_size"),
        ("a.toml", "[grid", "cannot read"),
        ("a.toml", "request = [1]", "requests are tables"),
        ("a.csv", "stroke,deviation\n150,0.1\n150,\n", "row 2: a request needs a deviation"),
        ("a.csv", "stroke,deviation\n", "holds no requests"),
        ("a.csv", "", "cannot read"),
        ("a.txt", "", "none of the suffixes"),
    ],
)
def test_files_without_requests_are_told(name: str, text: str, says: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(InvalidRequest, match=says):
        read(tmp_path / name)


@pytest.mark.parametrize("axes", [{}, 3, {"deviation": 3}, {"deviation": {"scale": ["x"]}, "max_size": [1]}])
def test_axes_that_are_none_are_told(axes: Any) -> None:
    with pytest.raises(InvalidRequest):
        grid({"stroke": 150, "deviation": 0.1}, axes)


def test_a_grid_that_is_far_too_large_is_refused_before_it_is_made() -> None:
    with pytest.raises(InvalidRequest, match="1,000,000 at most"):
        grid({"stroke": 150}, {"deviation": [*range(2000)], "max_size": [*range(2000)]})
