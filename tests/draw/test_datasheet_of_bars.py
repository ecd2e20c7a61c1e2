"""Data sheets of mechanisms of many bars: true to scale, every number that of the mechanism, nothing made up."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from catalogue import mechanism
from catalogue.draw.curves import curves
from catalogue.draw.datasheet import content
from catalogue.draw.datasheet_html import sheet_html
from catalogue.draw.datasheet_pdf import sheet_figure
from catalogue.draw.units import Scale
from catalogue.units import MILLIMETRES
from tests.chains.known import BICYCLE, JANSEN, PEAUCELLIER


@cache
def leg() -> Any:
    return mechanism(JANSEN, unit="mm")


@cache
def step() -> Any:
    return leg().measure(stroke=30)[0]


@cache
def pushed() -> Any:
    """Return a slider-crank that its slider drives."""
    joints = {"A": [0, 0], "B": [3, 4], "C": [12, 0]}
    bars = {"frame": "A", "crank": "AB", "rod": "BC", "ram": "C"}
    slides = [{"bar": "frame", "slider": "ram", "angle": 0}]
    return mechanism({"joints": joints, "bars": bars, "slides": slides, "drive": "ram", "point": "B"}, unit="in")


def told(table: Any) -> dict[str, list[str]]:
    return {name: rest for name, *rest in table.rows}


@pytest.mark.slow
@pytest.mark.parametrize(("unit", "scale"), [("mm", None), ("in", "1:4"), ("cm", None)])
def test_drawing_is_true_to_its_scale(unit: str, scale: str | None) -> None:
    figure = sheet_figure(step(), unit=unit, scale=scale)
    axes = figure.axes[0]
    (said,) = [text.get_text() for text in axes.texts if text.get_gid() == "scale-length"]
    (named,) = re.findall(r"scale ([\d.:]+)$", said)
    (path,) = [line for line in axes.lines if line.get_gid() == "path"]
    z = axes.transData.transform(np.asarray(path.get_xydata())[[0, -1]]) / figure.dpi * 25.4
    drawn = np.hypot(*(z[1] - z[0]))
    assert drawn == pytest.approx(30 * Scale.named(named).ratio, rel=1e-3)
    assert scale is None or named == scale
    bar = float(said.split()[0]) * MILLIMETRES[unit] * Scale.named(named).ratio
    (line,) = [line for line in axes.lines if line.get_gid() == "scale"]
    assert np.ptp(axes.transData.transform(line.get_xydata())[:, 0]) / figure.dpi * 25.4 == pytest.approx(bar)


def test_tables_hold_lengths_joints_and_limits() -> None:
    sheet = content(step(), "abc")
    assert told(sheet.lengths)["j B C"] == ["50.000"]
    assert told(sheet.pivots)["D"] == ["−38.000", "−7.800"]
    limits = told(sheet.limits)
    assert limits["crank turns"] == ["fully"]
    assert limits["min. transmission angle"] == [f"{step().min_transmission:.1f}°"]
    assert limits["stroke from"] == [f"{step().drive_from:.2f}°"]
    assert sheet.kind == "mechanism of 8 bars"
    inches = content(step().in_unit("in"), "abc")
    assert told(inches.lengths)["crank O B"] == ["0.59055"]


def test_what_does_not_exist_is_absent() -> None:
    whole = content(leg(), "abc")
    words = " ".join([*whole.facts, *told(whole.limits), whole.lengths.note, whole.limits.note, *whole.theory])
    for absent in ("stroke", "deviation", "tolerance", "nan", "crank 1", "Pole"):
        assert absent not in words
    assert len(whole.lengths.columns) == 2
    _, shown = curves(leg())
    assert [one.name for one in shown] == ["speed of foot [mm/rad]", "transmission angle [°]"]


@pytest.mark.slow
def test_the_curve_of_the_deviation_has_its_measure() -> None:
    bike: Any = mechanism(BICYCLE)
    for one in (step(), bike.measure(stroke=40)[0], leg().measure(stroke=60, radius=100)[0]):
        over, shown = curves(one)
        assert shown[0].name == "deviation [mm]"
        assert np.abs(shown[0].values).max() == pytest.approx(one.deviation, rel=1e-3)
        assert over.values[-1] == pytest.approx(one.drive_to - one.drive_from, abs=1e-3)


@pytest.mark.slow
def test_an_exact_guide_has_a_sheet(tmp_path: Path) -> None:
    cell: Any = mechanism(PEAUCELLIER)
    for one in (cell, cell.measure(stroke=3)[0]):
        one.sheet(tmp_path / "cell.pdf")
        assert "nan" not in re.sub(r'src="[^"]*"', "", str(sheet_html(one)))
    assert "exact" in content(cell.measure(stroke=3)[0], "abc").facts


def test_a_slider_that_drives_has_a_way_and_no_angle() -> None:
    over, shown = curves(pushed())
    assert over.label == "way of ram from the start [in]"
    assert "speed of B [1]" in [one.name for one in shown]
    rows = told(content(pushed(), "abc").limits)
    assert rows["ram from"][0].endswith(" in")
    assert told(content(pushed(), "abc").pivots)["ram on frame"] == ["0.0000°", ""]


@pytest.mark.slow
def test_long_tables_leave_the_drawing_its_room_and_say_what_is_missing() -> None:
    more = {f"q{k}": {"G": 30 + 2 * k, "F": 40, "side": "left"} for k in range(12)}
    bars = {**JANSEN["bars"], "lower": ["G", "F", "foot", *more]}
    big: Any = mechanism({**JANSEN, "joints": {**JANSEN["joints"], **more}, "bars": bars, "unit": "mm"})
    figure = sheet_figure(big, paper="letter")
    (line,) = [text.get_text() for text in figure.texts if re.fullmatch(r"and \d+ more", text.get_text())][:1]
    names = {text.get_text() for text in figure.texts}
    shown = sum(name in names for name in big.lengths)
    assert shown + int(line.split()[1]) == len(big.lengths)
    assert figure.axes[0].get_position().height * figure.get_figheight() * 25.4 >= 60
    assert all(name in str(sheet_html(big)) for name in big.lengths)


@pytest.mark.slow
def test_no_row_is_written_over_another() -> None:
    figure = sheet_figure(step())
    lowest = min(t.get_position()[1] for t in figure.texts if t.get_text() == "lower F foot")
    (note,) = [t.get_position()[1] for t in figure.texts if t.get_text() == "lengths between joints of a bar"]
    top = figure.axes[1].get_position().y1
    line = 4.1 / 297
    assert lowest - note > 0.8 * line
    assert note > top


def test_long_names_are_shortened_in_tables() -> None:
    name = "a-very-long-name-of-a-bar-in-the-mechanism"[:40]
    bars = {"frame": "AD", name: "AB", "coupler": "BCP", "rocker": "CD"}
    joints = {"A": [0, 0], "D": [2, 0], "B": [0, 1], "C": [2, 2.5], "P": [4, 4]}
    one: Any = mechanism({"joints": joints, "bars": bars, "drive": name, "point": "P"}, unit="mm")
    assert max(len(row[0]) for row in content(one, "abc").lengths.rows) <= 28
