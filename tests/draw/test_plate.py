"""Plates: curves satisfy their equations, every configuration has its cell, files hold what they should."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from matplotlib.text import Text

from catalogue.cli import run
from catalogue.cli.plate import _files
from catalogue.curvature_theory.analysis import PARALLEL
from catalogue.curvature_theory.instant import Instant
from catalogue.draw.cells import CELLS, Cell, cells
from catalogue.draw.cubics import cubic, hyperbola
from catalogue.draw.lettering import _fit, legend
from catalogue.draw.plate import file_name, plate
from catalogue.draw.vignette import VIGNETTE, Vignette
from catalogue.errors import CatalogueError, InvalidRequest, MissingExtra, PluginError
from catalogue.kinematics.types import Array
from catalogue.paper import blank
from catalogue.plugin.registry import Registry
from catalogue.series.sampling import draw as sample
from catalogue.series.series import Guided

SERIES = Registry().series
OLDHAM = SERIES["II.ooo"].inversion("II*.ooo", "inverse cyclic motion")  # of a family that few series have
EVERY = {**SERIES, OLDHAM.code: OLDHAM}
every = pytest.mark.parametrize("code", EVERY)


@cache
def shown(code: str) -> list[Cell]:
    return cells(EVERY[code])


SVG = "{http://www.w3.org/2000/svg}"
PARAMETERS = [(0.7, 0.4), (-1.4, 2.0), (3.0, -0.1), (1e-5, 1.0), (1.0, 1e-5), (-1.0, 1e-8), (1e3, 0.5)]
SPLIT = [(0.7, 0.0), (0.0, -0.4), (0.0, 0.0), (1e-12, 0.3), (0.3, -1e-12)]


# -- curves -------------------------------------------------------------------------------------------------------
def remainder(z: Array, kappa: float, s: float) -> Array:
    """Return the polynomial of the cubic at the points z, relative to the size of its terms."""
    x, y = z.real, z.imag
    return np.asarray(np.abs((x * x + y * y) * (kappa * x + s * y) - x * y) / (1 + np.abs(z) ** 3 * np.hypot(kappa, s)))


@pytest.mark.parametrize(("kappa", "s"), PARAMETERS + SPLIT)
def test_points_satisfy_the_cubic_equation(kappa: float, s: float) -> None:
    for part in cubic(kappa, s, 10.0):
        z = part[np.isfinite(part)]
        assert len(z) > 2
        assert remainder(z, kappa, s).max() < 1e-11


@pytest.mark.parametrize(("kappa", "s"), PARAMETERS)
def test_undivided_curve_runs_without_gaps_to_the_reach(kappa: float, s: float) -> None:
    (part,) = cubic(kappa, s, 10.0)
    step = np.abs(np.diff(part)) / (1 + np.abs(part[1:]))
    assert np.nanmax(step) < 0.1
    assert np.nanmax(np.abs(part)) > 9
    assert np.nanmin(np.abs(part)) < 1e-9  # through the pole


@pytest.mark.parametrize(("kappa", "s"), SPLIT)
def test_degenerate_cubic_is_a_circle_and_an_axis_or_two_axes(kappa: float, s: float) -> None:
    found = cubic(kappa, s, 10.0)
    assert len(found) == 2
    straight = [np.abs(part.real * part.imag).max() == 0 for part in found]
    assert sum(straight) == (2 if max(abs(kappa), abs(s)) < 1e-9 else 1)
    for part in found:
        if len(part) > 3:
            centre = 0.5 * (part[0] + part[180])
            np.testing.assert_allclose(np.abs(part - centre), abs(centre), atol=1e-12)


@pytest.mark.parametrize(("kappa", "s"), [*PARAMETERS[:3], (0.7, 0.0), (-0.4, 0.0), (0.0, 0.6)])
def test_euler_and_savary_carry_one_curve_to_the_other(kappa: float, s: float) -> None:
    part = cubic(kappa, s, 10.0)[0]
    z = part[np.isfinite(part) & (np.abs(part) > 1e-3)]
    with np.errstate(all="ignore"):
        moving = z * z.imag / (z.imag + np.abs(z) ** 2)
    z, moving = z[np.abs(moving) < 10], moving[np.abs(moving) < 10]
    assert len(z) > 50
    assert remainder(moving, kappa + 1, s).max() < 1e-9


@pytest.mark.parametrize("k", [0.3, -2.0])
def test_hyperbola_of_parallel_cranks(k: float) -> None:
    for branch in hyperbola(k, 8.0):
        np.testing.assert_allclose(branch.real * branch.imag, -k, rtol=1e-12)
        assert np.abs(branch).max() >= 7.9
    assert all((axis.real * axis.imag == 0).all() for axis in hyperbola(0.0, 8.0))
    assert cubic(np.nan, 0.0, 1.0) == hyperbola(np.nan, 1.0) == []


# -- cells --------------------------------------------------------------------------------------------------------
@pytest.mark.slow
@every
def test_every_configuration_of_the_sample_has_a_cell(code: str) -> None:
    met, series = set(), EVERY[code]
    for member in series.members:
        block = sample(series, member, 0, 0)
        instant = Instant(block.linkage, np.zeros(len(block.linkage), complex))
        met |= {(member.family, str(name)) for name in instant.configuration}
    found = shown(code)
    assert {(cell.family, cell.configuration) for cell in found} == met
    special = {(m.family, m.name) for m in series.members}
    if len(met) + len(series.members) <= CELLS.most:
        assert {(cell.family, cell.member) for cell in found} == special
    assert len(found) <= max(CELLS.most, len(met))


@every
def test_cells_hold_pivots_and_guided_pairs_of_their_curves(code: str) -> None:
    for cell in shown(code):
        at = cell.curvature
        driving = cell.linkage.pivots[0]
        # what is drawn as a principal pair lies on the cubics, as the pivots do
        pairs = [driving[0], driving[1], *(g.pairs[0] for g in cell.guided if g.label.startswith("["))]
        for fixed, moving in pairs:
            for point, k, kappa in ((fixed, at.k, at.kappa), (moving, at.k_star, at.kappa_star)):
                if point[2] == 0:
                    continue
                z = np.array([complex(*point[:2])])
                if at.state[0] == PARALLEL:
                    assert abs(z.real * z.imag + k)[0] < 1e-8 * (1 + abs(k[0]))
                else:
                    x, y = z.real, z.imag
                    cubed = (x * x + y * y) * (kappa * at.rho0 * x + at.s * at.rho0 * y) - x * y
                    assert abs(cubed[0]) < 1e-6 * (1 + abs(z[0]) ** 3)
            if at.state[0] != PARALLEL and fixed[2] and moving[2]:
                a, b = complex(*fixed[:2]), complex(*moving[:2])
                assert abs((a * b.conjugate()).imag) < 1e-8 * (1 + abs(a * b))  # on one ray
                # Euler-Savary without denominators: A* (y + |A|^2) = A y
                assert abs(b * (a.imag + abs(a) ** 2) - a * a.imag) < 1e-7 * (1 + abs(a) ** 3)


@pytest.mark.slow
def test_the_name_of_a_pair_outside_the_frame_stands_inside_on_the_side_of_the_pair() -> None:
    cell = max(shown("II.xy"), key=lambda one: one.linkage.size[0])
    for way in np.exp([0.2j, 1.8j, 4j]):
        far = np.array([[[50 * way.real, 50 * way.imag, 1], [60 * way.real, 60 * way.imag, 1]]])
        axes = Figure(figsize=(4, 4)).add_axes((0, 0, 1, 1))
        Vignette(axes, replace(cell, guided=[Guided("[3]", far, 4)]), 288, "cell-").draw()
        low, high = (complex(*corner) for corner in zip(axes.get_xlim(), axes.get_ylim(), strict=True))
        centre, half = 0.5 * (low + high), 0.5 * (high - low).real
        (at,) = [complex(*text.get_position()) for text in axes.texts if text.get_text() == "[3]"]
        off = (at - centre) / half
        assert 0.6 < max(abs(off.real), abs(off.imag)) < 1
        assert abs(np.angle(off / (55 * way - centre))) < np.radians(20)


@pytest.mark.parametrize("code", ["II.xy", "IV.l", "II.ooo"])
def test_a_cell_is_the_least_square_about_circles_linkage_and_points_that_are_near(code: str) -> None:
    for cell in shown(code):
        vignette = Vignette(Figure(figsize=(4, 4)).add_axes((0, 0, 1, 1)), cell, 288, "cell-")
        z = [0j, 0.5 + 1j, -0.5 - 1j] if cell.curvature.state[0] != PARALLEL else [0j]
        z += [complex(x, y) for dyad in cell.linkage.pivots[0] for x, y, w in dyad if w]
        z += [complex(x, y) for g in cell.guided for x, y, w in g.pairs[0] if w and np.hypot(x, y) <= CELLS.far]
        z += vignette.joint.tolist()
        off = np.array(z) - vignette.centre
        assert max(np.ptp(off.real), np.ptp(off.imag)) == pytest.approx(
            2 * vignette.half * (1 - 2 * VIGNETTE.border / 288)
        )
        for side in (off.real, off.imag):
            assert side.max() == pytest.approx(-side.min())


def test_slots_that_are_guided_are_two_lines_as_long_as_paths_beside_their_point() -> None:
    cell = next(one for one in shown("II*.xy") if any(guided.pairs[0, 1, 2] == 0 for guided in one.guided))
    axes = Figure(figsize=(4, 4)).add_axes((0, 0, 1, 1))
    vignette = Vignette(axes, cell, 288, "cell-")
    vignette.draw()
    slots = [line for line in axes.lines if "-slot-" in (line.get_gid() or "")]
    assert slots
    lengths = [np.hypot(*np.diff(line.get_xydata(), axis=0)[0]) for line in slots]
    np.testing.assert_allclose(lengths, 2 * VIGNETTE.path * vignette.point)
    one, other = (np.asarray(line.get_xydata(), float).mean(0) for line in slots[:2])
    assert 0 < np.hypot(*(one - other)) < 0.5 * lengths[0]


@pytest.mark.slow
@pytest.mark.parametrize("points", [150, 300])
def test_marks_are_of_one_size_on_paper_whatever_the_cell(points: int) -> None:
    size, halves = [], set()
    for cell in shown("II.xy"):
        axes = Figure(figsize=(points / 72, points / 72), dpi=72).add_axes((0, 0, 1, 1))
        vignette = Vignette(axes, cell, points, "cell-")
        vignette.draw()
        halves.add(round(vignette.half, 3))
        (dot,) = [patch for patch in axes.patches if patch.get_gid() == "cell-pole"]
        assert isinstance(dot, Polygon)
        size.append(np.ptp(axes.transData.transform(dot.get_xy()), axis=0))
    assert len(halves) > 1
    np.testing.assert_allclose(size, np.full((len(size), 2), size[0][0]), rtol=1e-6)
    assert 2 < size[0][0] < 8


def test_lines_of_the_legend_stand_beside_their_words_in_the_middle_of_the_sheet() -> None:
    figure = Figure(figsize=(11, 8))
    legend(figure, shown("II.xy"), 11, 8)
    lines = [line.get_xdata() for line in figure.findobj(Line2D)]
    boxes = [text.get_window_extent() for text in figure.texts]
    words = [np.array([box.x0, box.x1]) / figure.bbox.width for box in boxes]
    assert len(lines) == len(words) == 5
    ends = np.concatenate([np.concatenate(pair) for pair in zip(lines, words, strict=True)])
    assert (np.diff(ends) > 0).all()
    assert ends[0] == pytest.approx(1 - ends[-1], abs=0.005)
    assert ends[0] > 0


# -- plates -------------------------------------------------------------------------------------------------------
@pytest.mark.slow
@every
def test_a_plate_holds_every_part_inside_its_sheet_and_clear_of_the_others(code: str, tmp_path: Path) -> None:
    figure = plate(EVERY[code], file := tmp_path / "plate.svg")
    has_parts(code, file.read_text(encoding="utf-8"))
    captions = [(text, text.get_window_extent()) for text in figure.texts]
    assert clear(captions) == []
    for text, box in captions:
        assert figure.bbox.x0 <= box.x0 < box.x1 <= figure.bbox.x1, text.get_gid()
    for axes in figure.axes:
        assert clear([(text, text.get_window_extent()) for text in axes.texts]) == []
        frame = axes.get_window_extent()
        for artist in (*axes.texts, *axes.patches, *(line for line in axes.lines if not line.get_clip_on())):
            box = artist.get_window_extent()
            for low, high, a, b in ((frame.x0, frame.x1, box.x0, box.x1), (frame.y0, frame.y1, box.y0, box.y1)):
                assert a >= low - 1, artist.get_gid()
                assert b <= high + 1, artist.get_gid()


def has_parts(code: str, text: str) -> None:
    """Assert that a plate in SVG has the words and elements of its series."""
    series = EVERY[code]
    found = {e.attrib["id"]: e for e in ET.fromstring(text).iter() if "id" in e.attrib}
    assert {"code", "title", "facts", "legend-1", "rule-outer"} <= set(found)
    for words in (series.code, series.title.split("(")[0].strip()):
        assert f"<!-- {words}" in text
    for i, cell in enumerate(shown(code), 1):
        wanted = {f"cell-{i}-{part}" for part in ("configuration", "parameters", "orders", "coupler", "circling-1")}
        wanted |= {f"cell-{i}-guided-{j + 1}" for j in range(len(cell.guided))}
        if cell.curvature.state[0] != PARALLEL:
            wanted |= {f"cell-{i}-inflection-circle", f"cell-{i}-return-circle"}
        assert wanted <= set(found)
        (orders,) = re.findall(rf'<g id="cell-{i}-orders">\s*<!-- (.*?) -->', text)
        for g in cell.guided:
            assert g.label.removeprefix("ray ") in orders


def clear(boxes: list[tuple[Text, Any]]) -> list[tuple[str, str]]:
    """Return the texts that cover one another."""
    return [
        (one.get_text(), other.get_text())
        for i, (one, a) in enumerate(boxes)
        for other, b in boxes[:i]
        if a.overlaps(b)
    ]


def test_a_text_that_is_too_long_fills_the_width_there_is() -> None:
    figure = blank(6, 1)
    for words in ("a short one", 12 * "words and more "):
        text = figure.text(0.0, 0.5, words, size=9)
        _fit(text, 4.0)
        wide = text.get_window_extent().width / figure.dpi
        assert 3.7 < wide <= 4.0 if len(words) > 20 else text.get_fontsize() == 9


@pytest.mark.slow
def test_circles_touch_the_tangent_in_the_pole() -> None:
    axes = plate(EVERY["II.xy"]).axes[0]
    (line,) = [line for line in axes.lines if line.get_gid() == "cell-1-inflection-circle"]
    z = line.get_xydata() @ np.array([1, 1j])
    np.testing.assert_allclose(np.abs(z - 0.5j), 0.5, atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(("suffix", "start"), [("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF")])
def test_same_series_gives_same_file(suffix: str, start: bytes, tmp_path: Path) -> None:
    files = [tmp_path / f"{name}.{suffix}" for name in "ab"]
    for file in files:
        plate(SERIES["II.ooo"], str(file))
    one, two = (file.read_bytes() for file in files)
    assert one == two
    assert one.startswith(start)


@pytest.mark.slow
def test_file_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidRequest, match=r"\.png, \.svg or \.pdf"):
        plate(SERIES["II.ooo"], tmp_path / "plate.jpg")
    with pytest.raises(InvalidRequest, match="there is no folder"):
        plate(SERIES["II.ooo"], tmp_path / "no" / "plate.png")
    (tmp_path / "plate.png").mkdir()
    with pytest.raises(InvalidRequest, match="cannot write"):
        plate(SERIES["II.ooo"], tmp_path / "plate.png")


@pytest.mark.parametrize(
    ("code", "name"),
    [("II*.xy", "II-star.xy"), ("I.GG", "I.GG"), ("../a b", "a-b"), ("**", "star-star"), ("/", "series")],
)
def test_names_of_files_are_safe(code: str, name: str) -> None:
    assert file_name(code) == name


def test_every_series_has_a_file_of_its_own() -> None:
    codes = ["III.Kx", "iii.kx", "III.KX", "II*.x0", "II-star.x0"]
    files = _files([replace(SERIES["II.ooo"], code=code) for code in codes])
    assert len({file.casefold() for file in files}) == len(codes)


# -- command ------------------------------------------------------------------------------------------------------
def command(monkeypatch: pytest.MonkeyPatch, *words: object) -> int:
    monkeypatch.setattr(sys, "argv", ["catalogue", *map(str, words)])
    return run()


@pytest.mark.slow
def test_plate_is_named_after_its_series(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    assert command(monkeypatch, "plate", "IV*.l") == 0
    assert [file.name for file in tmp_path.iterdir()] == ["IV-star.l.svg"]
    assert command(monkeypatch, "plate", "IV*.l", "--out", "watt.pdf") == 0
    assert (tmp_path / "watt.pdf").read_bytes().startswith(b"%PDF")


def test_unknown_series_is_answered_with_those_there_are(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(PluginError, match=r"no plugin provides series II\.zz; there are .*I\.GG"):
        command(monkeypatch, "plate", "II.zz")


@pytest.mark.slow
def test_without_matplotlib_the_extra_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for module in ("matplotlib.figure", "matplotlib.backends.backend_agg"):
        monkeypatch.setitem(sys.modules, module, None)
    monkeypatch.chdir(tmp_path)
    for words in (["plate", "I.GG"], ["atlas", "--out", tmp_path]):
        with pytest.raises(MissingExtra, match=r"mechanism-catalogue\[plot\]") as caught:
            command(monkeypatch, *words)
        assert caught.value.exit_code == 6


@pytest.mark.slow
def test_atlas_links_every_plate(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    some = {code: SERIES[code] for code in ("II.ooo", "II*.xy")}
    monkeypatch.setattr("catalogue.plugin.registry.Registry", lambda _: SimpleNamespace(series=some))
    folder = tmp_path / "new" / "atlas"
    assert command(monkeypatch, "atlas", "--out", folder) == 0
    page = (folder / "index.html").read_text(encoding="utf-8")
    links = [part.split('"')[0] for part in page.split('href="')[1:]]
    assert len(links) == len(some)
    assert sorted(links) == sorted(file.name for file in folder.glob("*.svg"))
    for series in some.values():
        assert f"<b>{series.code}</b> <i>{series.title}" in page
    out, told = capsys.readouterr()
    assert (out, told.count("\n")) == ("", 1)


@pytest.mark.parametrize("where", ["file", "file/below"])
def test_folder_that_cannot_be_made_is_refused_in_one_line(
    where: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(CatalogueError, match="cannot write to") as caught:
        command(monkeypatch, "atlas", "--out", tmp_path / where)
    assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_folder_that_cannot_be_written_is_refused_in_one_line(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / f"{file_name(next(iter(SERIES)))}.svg").mkdir()
    with pytest.raises(InvalidRequest, match="cannot write"):
        command(monkeypatch, "atlas", "--out", tmp_path)


@pytest.mark.slow
def test_commands_import_matplotlib_only_to_draw() -> None:
    code = (
        "import catalogue.cli.plate, catalogue.draw.plate, sys; "
        "assert not [m for m in sys.modules if 'matplotlib' in m]"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=Path(__file__).parents[2], env={**os.environ})


@pytest.mark.slow
def test_drawing_leaves_pyplot_and_settings_alone() -> None:
    code = """
import sys, matplotlib
from catalogue.draw.plate import plate
from catalogue.plugin.registry import Registry
before = matplotlib.rcParams.copy()
plate(Registry().get('II.ooo'))
assert 'matplotlib.pyplot' not in sys.modules
assert matplotlib.rcParams.copy() == before
"""
    subprocess.run([sys.executable, "-c", code], check=True, cwd=Path(__file__).parents[2])
