"""Data sheets: true to scale on one page, every number that of the guide; curves over the drive."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from catalogue.curvature_theory.analysis import curvature
from catalogue.draw.curves import curves
from catalogue.draw.datasheet import PAPERS, content
from catalogue.draw.datasheet_html import sheet_html
from catalogue.draw.datasheet_pdf import PAGE, sheet_figure
from catalogue.draw.units import Scale
from catalogue.errors import InvalidRequest, MissingExtra
from catalogue.guides.placed import PlacedGuide
from catalogue.units import MILLIMETRES
from tests.draw.samples import ARC, DWELL, EVERY, EXACT, MADE, NAMES, OPEN, OWN

every = pytest.mark.parametrize("made", [*EVERY, OWN, OPEN, DWELL], ids=[*NAMES, "own", "open", "dwell"])
#: Part of a width by which a number on its border may round beyond it.
ROUNDED = 1e-15
FORGIVING = replace(MADE["four-bar"], allowance=0.0237, drive_angle=31.4, rotates=[1])


def number(text: str) -> float:
    return float(text.replace("−", "-").removeprefix("±"))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("paper", "unit", "scale"), [("a4", "mm", None), ("letter", "in", "1:100"), ("a4", "cm", None)]
)
def test_drawing_is_true_to_its_scale_on_the_page(paper: str, unit: str, scale: str | None) -> None:
    figure = sheet_figure(ARC, paper=paper, unit=unit, scale=scale)
    np.testing.assert_allclose(figure.get_size_inches() * 25.4, PAPERS[paper])
    axes = figure.axes[0]
    (said,) = [text.get_text() for text in axes.texts if text.get_gid() == "scale-length"]
    (told,) = re.findall(r"scale ([\d.:]+)$", said)
    if scale is not None:
        assert told == scale
    ends = axes.transData.transform(ARC.path(2)) / figure.dpi * 25.4
    drawn, real = np.hypot(*(ends[1] - ends[0])), np.hypot(*np.diff(ARC.path(2), axis=0)[0])
    assert drawn == pytest.approx(real * MILLIMETRES[unit] * Scale.named(told).ratio, rel=1e-9)
    (bar,) = [line for line in axes.lines if line.get_gid() == "scale"]
    run = np.ptp(axes.transData.transform(bar.get_xydata())[:, 0]) / figure.dpi * 25.4
    step = float(said.split()[0])
    assert run == pytest.approx(step * MILLIMETRES[unit] * Scale.named(told).ratio)


@pytest.mark.parametrize("made", [ARC, MADE["oldham"], OWN], ids=["arc", "oldham", "own"])
def test_the_linkage_is_drawn_between_the_margins(made: PlacedGuide) -> None:
    figure = sheet_figure(made)
    axes, width = figure.axes[0], PAPERS["a4"][0]
    place = axes.get_position()
    for x in (place.x0, 1 - place.x1):
        assert x * width == pytest.approx(PAGE.margin)
    for line in axes.lines:
        at = axes.transAxes.inverted().transform(axes.transData.transform(line.get_xydata()))
        assert np.nanmin(at) >= -ROUNDED
        assert np.nanmax(at) <= 1 + ROUNDED


@pytest.mark.slow
@pytest.mark.parametrize(
    ("made", "paper"),
    [*((made, "letter") for made in (*EVERY, OWN, OPEN, DWELL)), (ARC, "a4")],
    ids=[*NAMES, "own", "open", "dwell", "a4"],
)
def test_nothing_is_cut_off_or_written_over(made: PlacedGuide, paper: str) -> None:
    figure = sheet_figure(made, paper=paper)
    page = figure.bbox
    figure.draw_without_rendering()
    boxes = [(text.get_text(), text.get_window_extent()) for text in figure.texts if text.get_text()]
    for words, box in boxes:
        assert page.x0 <= box.x0, words
        assert box.x1 <= page.x1, words
        assert page.y0 <= box.y0, words
        assert box.y1 <= page.y1, words
    for k, (words, box) in enumerate(boxes):
        for others, other in boxes[k + 1 :]:
            across = min(box.x1, other.x1) - max(box.x0, other.x0)
            upwards = min(box.y1, other.y1) - max(box.y0, other.y0)
            assert across < 1 or upwards < 2, (words, others)


@pytest.mark.slow
@pytest.mark.parametrize("made", [ARC, OWN], ids=["arc", "own"])
def test_theory_and_provenance_stand_below_all_else(made: PlacedGuide) -> None:
    told = content(made, made.code)
    height = {text.get_text(): text.get_position()[1] for text in sheet_figure(made).texts if text.get_text()}
    foot = [height.pop(line) for line in (*told.theory, told.provenance)]
    ordered = [min(height.values()), *foot, 0.0]
    assert ordered == sorted(ordered, reverse=True)


@every
def test_the_cubics_told_are_those_of_the_linkage(made: PlacedGuide) -> None:
    """rho0 over the diameters and the third length, to four digits; what is 0 but for rounding is told as 0."""
    found = curvature(made.linkage)
    (line,) = [line for line in content(made, made.code).theory if line.startswith("Cubics")]
    told = [number(word) for word in re.findall(r"= ([−\d.e-]+\d|\d)", line)]
    exact = [float(v[0] * found.rho0[0]) for v in (found.kappa, found.kappa_star, found.s)]
    assert told == pytest.approx(exact, rel=6e-4, abs=1e-9)


@every
def test_numbers_are_those_of_the_guide(made: PlacedGuide) -> None:
    told = content(made, made.code)
    for (name, said, _), (known, value) in zip(told.lengths.rows, made.lengths.items(), strict=True):
        assert name == known
        assert number(said) == pytest.approx(value, abs=6e-4)
    finite = [point[:2] for dyad in made.pivots for point in dyad if point[2]] + [made.guided]
    rows = [row for row in told.pivots.rows if not row[0].startswith(("rail", "slot", "joint", "pivot"))]
    for row, (x, y) in zip(rows, finite, strict=True):
        np.testing.assert_allclose([number(row[1]), number(row[2])], [x, y], atol=6e-4)
    assert made.code in told.provenance
    assert len(told.theory) in (2, 3)


@pytest.mark.parametrize("name", [*MADE][1:])
def test_lines_of_sliders_and_slides_are_told_by_their_directions(name: str) -> None:
    """Against the x axis: that of the pin of a slider as it moves; of a slide in the position that is listed."""
    made = MADE[name]
    told = {
        row[0]: float(row[1].rstrip("°"))
        for row in content(made, made.code).pivots.rows
        if row[0].startswith(("rail", "slot"))
    }
    ends = made.motion(2).points
    assert told
    for line, angle in told.items():
        i = int(line[-1])
        x, y, _ = made.pivots[i - 1][1]
        way = np.diff(ends[f"A{i}*"])[0] if "slider" in line else complex(-y, x)
        assert np.sin(np.angle(way) - np.radians(angle)) == pytest.approx(0, abs=1e-5)


def test_tolerances_come_from_the_allowance() -> None:
    """Two standard deviations: scattered so, 95 of 100 machines of that length or place are within."""
    told = content(FORGIVING.in_unit("mm"), "")
    assert {row[3] for row in told.pivots.rows[:4]} == {"±0.047"}  # 2 * 0.0237, rounded down
    assert {row[2] for row in told.lengths.rows} == {"±0.067"}  # a distance scatters by sqrt(2) more
    rng = np.random.default_rng(5)
    z = np.array(FORGIVING.pivots)[..., :2] + 0.0237 * rng.standard_normal((20_000, 2, 2, 2))
    crank = np.hypot(*(z[:, 0, 1] - z[:, 0, 0]).T)
    assert np.mean(np.abs(crank - FORGIVING.lengths["crank 1"]) < 0.067) == pytest.approx(0.954, abs=0.01)
    assert "standard deviation of pivot position 0.023 mm" in told.lengths.note
    none = content(replace(FORGIVING, allowance=-1.0), "")
    assert {row[2] for row in none.lengths.rows} == {"–"}
    assert "none left" in none.lengths.note


def test_limits_are_named() -> None:
    limits = {name: said for name, said in content(FORGIVING.in_unit("in"), "").limits.rows}  # noqa: C416  # mypy needs the pair
    assert limits["rotation of the drive"] == "31.4°"
    assert limits["turns fully"] == "crank 1"
    assert limits["min. transmission angle"] == f"{FORGIVING.min_transmission:.1f}°"
    stops = content(OWN, OWN.code).limits.note
    for angle in OWN.dead_points["crank 2"]:
        assert f"{angle:.1f}" in stops


@every
def test_html_is_whole_and_loads_nothing(made: PlacedGuide) -> None:
    page = sheet_html(made, paper="letter")
    assert "<script" not in page
    assert "$" not in page
    assert not re.findall(r"(?:src|href)=\"(?!data:,)", page)
    assert "size: 215.9mm 279.4mm" in page
    svg = page[page.index("<svg") : page.index("</div>")]
    root = ET.fromstring(svg)
    assert root.attrib["width"].endswith("mm")
    for row in content(made, made.code).pivots.rows:
        for cell in row:
            assert cell in page


def test_drawing_of_the_html_is_true_to_its_scale() -> None:
    page = sheet_html(ARC, unit="mm", scale="1:4")
    root = ET.fromstring(page[page.index("<svg") : page.index("</div>")])
    width, _ = (float(part) for part in root.attrib["viewBox"].split()[2:])
    assert root.attrib["width"] == f"{width:g}mm"
    (path,) = [e for e in root.iter("{http://www.w3.org/2000/svg}path") if e.attrib.get("class") == "path"]
    z = np.array(re.findall(r"-?[\d.]+", path.attrib["d"]), float).reshape(-1, 2)
    real = np.hypot(*np.diff(ARC.path(2), axis=0)[0])
    assert np.hypot(*(z[-1] - z[0])) == pytest.approx(real / 4, abs=0.02)


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("chromium") is None, reason="chromium is not installed")
@pytest.mark.parametrize(("made", "paper"), [(FORGIVING, "letter"), (DWELL, "a4")], ids=["four-bar", "dwell"])
def test_html_is_printed_on_one_page(made: PlacedGuide, paper: str, tmp_path: Path) -> None:
    made.sheet(tmp_path / "a.html", paper=paper)
    subprocess.run(
        ["chromium", "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
         f"--user-data-dir={tmp_path / 'profile'}", "--no-pdf-header-footer", f"--print-to-pdf={tmp_path / 'a.pdf'}",
         (tmp_path / "a.html").as_uri()],
        check=True, capture_output=True, timeout=60,
    )  # fmt: skip
    written = (tmp_path / "a.pdf").read_bytes()
    assert len(re.findall(rb"/Type\s*/Page\b", written)) == 1


@pytest.mark.slow
@pytest.mark.parametrize("name", ["a.pdf", "a.html"])
def test_same_guide_gives_the_same_file(name: str, tmp_path: Path) -> None:
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
        ARC.sheet(tmp_path / folder / name)
    one, two = ((tmp_path / folder / name).read_bytes() for folder in ("one", "two"))
    assert one == two
    assert one.startswith(b"%PDF" if name == "a.pdf" else b"<!doctype html>")


@pytest.mark.parametrize(
    ("file", "given", "said"),
    [
        ("a.png", {}, r"choose \.pdf or \.html"),
        ("a.pdf", {"paper": "a5"}, "unknown paper 'a5'; choose from a4, letter"),
        ("a.pdf", {"unit": "yd"}, "no unit 'yd'"),
        ("a.html", {"scale": "2"}, "a scale is written as"),
        ("no/a.pdf", {}, "there is no folder"),
    ],
)
def test_what_cannot_be_written_is_refused(file: str, given: dict[str, Any], said: str, tmp_path: Path) -> None:
    with pytest.raises(InvalidRequest, match=said):
        ARC.sheet(tmp_path / file, **given)
    assert not list(tmp_path.iterdir())


def test_html_needs_no_matplotlib_and_pdf_names_the_extra(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for module in ("matplotlib.figure", "matplotlib.backends.backend_agg"):
        monkeypatch.setitem(sys.modules, module, None)
    ARC.sheet(tmp_path / "a.html")
    with pytest.raises(MissingExtra, match=r'pip install "mechanism-catalogue\[plot\]"'):
        ARC.sheet(tmp_path / "a.pdf")


def test_curves_are_those_of_the_motion() -> None:
    over, shown = curves(ARC.in_unit("mm"))
    drive = over.values
    by_name = {one.name: one.values for one in shown}
    assert over.label == f"angle of crank {ARC.motion(2).driver} from the start [°]"
    assert list(by_name) == [
        "deviation [mm]", "speed of the guided point [mm/rad]", "transmission angle [°]", "mechanical advantage"
    ]  # fmt: skip
    assert np.abs(by_name["deviation [mm]"]).max() == pytest.approx(ARC.deviation, rel=1e-2)
    assert by_name["transmission angle [°]"].min() == pytest.approx(ARC.min_transmission, abs=0.1)
    guided = ARC.motion(len(drive)).points["guided"]
    chords = np.abs(np.gradient(guided, np.radians(drive)))
    np.testing.assert_allclose(by_name["speed of the guided point [mm/rad]"][3:-3], chords[3:-3], rtol=1e-3)
    _, exact = curves(EXACT)
    assert "mechanical advantage" not in {one.name for one in exact}  # the coupler drives: there is none
    _, dwell = curves(DWELL)
    assert np.ptp(dwell[0].values) == pytest.approx(DWELL.swing, rel=1e-3)
    assert dwell[0].values[0] == 0
    assert dwell[1].values.min() == pytest.approx(DWELL.min_transmission, abs=0.01)


@pytest.mark.slow
def test_curves_are_drawn(tmp_path: Path) -> None:
    figure = ARC.plot_curves(tmp_path / "curves.svg", unit="mm")
    assert len(figure.axes) == 4
    assert (tmp_path / "curves.svg").read_bytes().startswith(b"<?xml")
    with pytest.raises(InvalidRequest, match=r"choose \.png, \.svg or \.pdf"):
        ARC.plot_curves(tmp_path / "curves.gif")
