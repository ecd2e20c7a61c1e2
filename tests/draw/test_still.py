"""Drawings of all six families, lines and arcs: what they show, what they are written to, what they leave alone."""

from __future__ import annotations

import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.text import Text

import catalogue
from catalogue.draw import draw
from catalogue.draw.datasheet_pdf import sheet_figure
from catalogue.draw.machine import Plate, Rail
from catalogue.draw.poses import still_poses
from catalogue.draw.still import deviation_along, path_beyond, still
from catalogue.draw.svg import plate
from catalogue.draw.symbols import BLOCK, Pen, rounded
from catalogue.errors import InvalidRequest, MissingExtra
from catalogue.guides.candidate import Candidate
from catalogue.kinematics.linkage import FAMILIES, PR, RP, RR
from catalogue.paper import DRIVER
from catalogue.testing import load
from tests.curves import apart, nearest
from tests.draw.samples import ARC, BARS, EVERY, EXACT, LONG, MADE, NAMES, candidate

every = pytest.mark.parametrize("made", EVERY, ids=NAMES)


def elements(file: Path) -> dict[str, ET.Element]:
    """Return the elements of an SVG that have a name."""
    return {e.attrib["id"]: e for e in ET.parse(file).iter() if "id" in e.attrib}


def line(figure: Figure, gid: str) -> Any:
    """Return the coordinates of a drawn line."""
    (found,) = [line for axes in figure.axes for line in axes.lines if line.get_gid() == gid]
    return found.get_xydata()


def lines(made: Candidate) -> dict[str, Any]:
    """Return the lines of a still by name."""
    return {one.name: one.z for one in still(made).lines}


def test_the_samples_are_of_all_families() -> None:
    assert {m.family for m in MADE.values()} == set(FAMILIES)
    assert [m.family for m in MADE.values()] == list(MADE)


@every
def test_drawn_path_is_the_path_of_the_candidate(made: Candidate) -> None:
    drawn, path = line(draw(made), "path") @ [1, 1j], made.path(4001) @ [1, 1j]
    assert apart(drawn, path) < 1e-4 * np.abs(path - path[0]).max()
    np.testing.assert_allclose(drawn[[0, -1]], path[[0, -1]], atol=1e-12 * made.size)


@every
def test_path_goes_on_smoothly_beyond_the_stroke(made: Candidate) -> None:
    path, before, after = (lines(made)[name] for name in ("path", "path-before", "path-after"))
    ends = sorted([path[0], path[-1]], key=lambda z: z.real)
    assert abs(ends[0].real) < 1e-2 * made.stroke
    assert abs(ends[1].real - made.stroke) < 1e-2 * made.stroke
    inner = (path[0], path[-1])
    assert len(before) > 1
    assert len(after) > 1
    for tail, end, inside in zip((before, after), inner, (path[1], path[-2]), strict=True):
        assert abs(tail[0] - end) < 1e-6 * made.stroke
        assert ((tail[1] - tail[0]) * (end - inside).conjugate()).real > 0
        assert np.abs(np.diff(tail)).sum() < made.stroke


@every
def test_dyads_keep_their_constraints_in_every_pose(made: Candidate) -> None:
    shown = still_poses(made)
    for i, kind in enumerate(shown.kinds):
        fixed, moving = shown.fixed[i], shown.moving[:, i]
        if kind == RR:
            held = np.abs(moving - fixed)
        elif kind == PR:
            held = (moving * fixed.conj()).real
        else:
            rod = shown.carried(shown.rods[i])
            held = np.abs(((rod - fixed) * moving.conj()[:, None]).real).max(1)
            assert held.max() < 1e-9 * made.size
            along = ((rod - fixed) * (1j * moving).conj()[:, None]).real
            assert (along.min(1) <= 1e-9).all()  # the line reaches the block in every pose
            assert (along.max(1) >= -1e-9).all()
        assert np.ptp(held) < 1e-9 * made.size
    coupler = shown.carried(shown.home)
    sides = np.abs(coupler - np.roll(coupler, 1, axis=1))
    np.testing.assert_allclose(sides - sides[0], 0, atol=1e-9 * made.size)
    np.testing.assert_allclose(coupler[shown.middle, 2], complex(*made.guided), atol=1e-9 * made.size)
    np.testing.assert_allclose(coupler[[0, -1], 2], shown.path[[0, -1]], atol=1e-6 * made.stroke)


@every
def test_drawn_deviation_fills_its_band(made: Candidate) -> None:
    position, error = deviation_along(made)
    assert (np.diff(position) > 0).all()
    np.testing.assert_allclose(position[[0, -1]], [0, made.stroke], atol=1e-4 * made.stroke)
    if made is not EXACT:
        np.testing.assert_allclose([error.max(), -error.min()], made.deviation, rtol=2e-3)


@every
def test_deviation_is_magnified_by_what_the_strip_says(made: Candidate) -> None:
    (_, strip) = draw(made).axes
    said = strip.get_title(loc="left")
    if made is EXACT:
        assert said == "exact straight line: no deviation but rounding"
        return
    (times,) = re.findall(r"^deviation from the .*, drawn (\d+) times as large as the", said)
    nought, *sides = [line.get_ydata()[0] for line in strip.lines if np.ptp(line.get_ydata()) == 0]
    np.testing.assert_allclose([nought, *sides], [0, -made.deviation, made.deviation], rtol=2e-3)
    along, across = (np.diff(strip.transData.transform([(0, 0), ends]), axis=0)[0] for ends in ((1, 0), (0, 1)))
    assert across[1] / along[0] == pytest.approx(float(times))
    low, high = strip.get_ylim()
    assert low < -made.deviation
    assert high > made.deviation


@pytest.mark.slow
def test_bearings_stand_the_right_way_up() -> None:
    for made in (MADE["four-bar"], ARC):
        figure = draw(made)
        for i in (1, 2):
            pivot = complex(*made.pivots[i - 1][0][:2])
            (foot,) = [line for line in figure.axes[0].lines if line.get_gid() == f"ground-{i}-hatching-line"]
            assert (foot.get_xydata()[:, 1] < pivot.imag).all()


@every
def test_a_guide_is_drawn_where_it_stands(made: Candidate) -> None:
    """Turned and moved as a whole, with its path: the drawing is turned and moved with it."""
    origin, turn = 20 + 15j, np.exp(2j)

    def carried(pivot: list[float]) -> list[float]:
        z = turn * complex(pivot[0], pivot[1]) + origin * pivot[2]
        return [z.real, z.imag, pivot[2]]

    there = replace(
        made,
        pivots=[[carried(pivot) for pivot in dyad] for dyad in made.pivots],
        guided=carried([*made.guided, 1.0])[:2],
        start=[origin.real, origin.imag],
        along=float(np.degrees(2)),
    )
    one, other = still_poses(made), still_poses(there)
    there_now, here = (shown.carried(shown.home) for shown in (other, one))
    np.testing.assert_allclose(there_now, origin + turn * here, atol=1e-6 * made.size)
    for name in ("path", "path-before", "path-after"):
        assert apart(lines(there)[name], origin + turn * lines(made)[name]) < 1e-4 * made.stroke
    assert apart(other.path, there.path(4001) @ [1, 1j]) < 1e-4 * made.stroke
    np.testing.assert_allclose(deviation_along(there)[1], deviation_along(made)[1], atol=1e-6 * made.stroke)
    for i, pivot in enumerate(there.linkage.points[0, :, 0]):
        assert abs(other.fixed[i] - pivot) < 1e-9 * made.size
        assert abs(other.moving[other.middle, i] - there.linkage.points[0, i, 1]) < 1e-6 * made.size


def test_deviation_is_positive_where_the_path_is_above() -> None:
    for made in (MADE["four-bar"], ARC):
        path, (position, error) = still(made).path, deviation_along(made)
        u, v = path.real, path.imag
        smooth = np.polyval(np.polyfit(u, v, 1 if made.radius is None else 2), u)
        seen = np.interp(u, position, error)
        assert np.corrcoef(v - smooth, seen)[0, 1] > 0.5


def test_deviation_of_a_nearly_exact_arc_is_not_rounding() -> None:
    four_bar = MADE["four-bar"]
    made = candidate(four_bar.pivots, complex(*four_bar.guided), 0.005, circle=True)
    assert 1e-12 < made.deviation / made.stroke < 1e-11
    error = deviation_along(made)[1]
    np.testing.assert_allclose([error.max(), -error.min()], made.deviation, rtol=2e-3)
    assert np.abs(np.diff(error, 2)).max() < 0.01 * made.deviation  # and smooth


def expected(made: Candidate) -> set[str]:
    names = {"series", "family", "facts", "path", "coupler", "guided", "start-coupler", "end-coupler", "error", "scale"}
    for i, kind in enumerate(made.linkage.dyads[0]):
        symbols = {RR: ("crank", "ground", "fixed-pivot"), PR: ("slider", "guide"), RP: ("slide", "line", "ground")}
        names |= {f"{symbol}-{i + 1}" for symbol in symbols[kind]}
        names |= {
            f"{end}-{dict(zip((RR, PR, RP), ('crank', 'slider', 'line'), strict=True))[kind]}-{i + 1}"
            for end in ("start", "end")
        }
    return names


@every
def test_the_ends_of_the_scale_are_three_points_high(made: Candidate) -> None:
    figure = draw(made)
    (scale,) = [line for line in figure.axes[0].lines if line.get_gid() == "scale"]
    ends = figure.axes[0].transData.transform(scale.get_xydata()) * 72 / figure.dpi
    assert np.ptp(ends[:, 1]) == pytest.approx(3)
    assert np.ptp(ends[:, 0]) > 50


@pytest.mark.slow
@every
def test_svg_holds_every_part(made: Candidate, tmp_path: Path) -> None:
    draw(made, tmp_path / "guide.svg")
    found = elements(tmp_path / "guide.svg")
    assert expected(made) <= set(found)
    assert ("band" in found) == (made is not EXACT)
    assert found["path"].find("{http://www.w3.org/2000/svg}path") is not None


@pytest.mark.slow
@every
def test_nothing_is_cut_off(made: Candidate) -> None:
    figure = draw(made)
    sheet = figure.bbox
    for axes in figure.axes:
        for artist in (*axes.lines, *axes.patches, *axes.texts, *figure.texts):
            box = artist.get_window_extent()
            assert box.x0 >= sheet.x0, artist.get_gid()
            assert box.x1 <= sheet.x1, artist.get_gid()
            assert box.y0 >= sheet.y0, artist.get_gid()
            assert box.y1 <= sheet.y1, artist.get_gid()


@pytest.mark.slow
@every
def test_lengths_are_drawn_to_one_scale(made: Candidate) -> None:
    figure = draw(made)
    figure.draw_without_rendering()
    a, b, c = figure.axes[0].transData.transform([(0, 0), (1, 0), (0, 1)])
    np.testing.assert_allclose(b - a, (c - a)[::-1], atol=1e-9)


@pytest.mark.slow
def test_title_says_what_the_candidate_is() -> None:
    said = " ".join(text.get_text() for text in draw(ARC).texts)
    for part in ("general", "inverted slider-crank", "configuration made", "stroke 100", "radius ", "deviation 0.2"):
        assert part in said
    assert f"minimum transmission angle {ARC.min_transmission:.0f}°" in said
    assert "exact" in " ".join(text.get_text() for text in draw(EXACT).texts)
    tiny = replace(MADE["four-bar"], deviation=3.2e-7)
    assert "3.2 × 10⁻⁷" in " ".join(text.get_text() for text in draw(tiny).texts)


@pytest.mark.slow
@pytest.mark.parametrize("bars", [False, True], ids=["two dyads", "many bars"])
def test_tiny_deviations_are_told_legibly(bars: bool) -> None:
    """No formula stands raw, titles stand apart, labels stay on the sheet."""
    guide = BARS.measure(deviation=1.0, limit=1)[0] if bars else MADE["four-bar"]
    figure = draw(replace(guide, deviation=8.6e-12 * guide.stroke))
    figure.draw_without_rendering()
    texts = [text.get_text() for text in figure.findobj(Text)]
    assert not [text for text in texts if "times 10" in text]
    assert any("⁻" in text for text in texts)
    strip = figure.axes[-1]
    said = {
        text.get_text().split()[0]: text.get_window_extent()
        for text in strip.get_children()
        if isinstance(text, Text) and text.get_text()
    }
    left, right = said["deviation"], said["half"]
    assert left.x1 < right.x0
    labels = [label.get_window_extent() for label in strip.get_yticklabels()]
    assert min(box.x0 for box in labels) > 0
    assert right.x1 <= figure.bbox.x1


@pytest.mark.slow
@pytest.mark.parametrize(
    ("suffix", "start"), [("png", b"\x89PNG\r\n\x1a\n"), ("PNG", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF")]
)
def test_same_candidate_gives_same_file(suffix: str, start: bytes, tmp_path: Path) -> None:
    files = [tmp_path / f"{name}.{suffix}" for name in "ab"]
    for file in files:
        draw(MADE["four-bar"], str(file))
    one, two = (file.read_bytes() for file in files)
    assert one == two
    assert one.startswith(start)
    assert len(one) > 10_000
    assert not any(word in one for word in (b"dc:date", b"CreationDate"))


@pytest.mark.parametrize("name", ["guide.jpg", "guide", "guide.svg.gz"])
def test_unknown_suffix_is_refused_with_the_possible_ones(name: str, tmp_path: Path) -> None:
    with pytest.raises(InvalidRequest, match=r"\.png, \.svg, \.pdf or \.gif"):
        draw(ARC, tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_missing_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidRequest, match="there is no folder"):
        draw(ARC, tmp_path / "no" / "guide.png")


@pytest.mark.slow
def test_file_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    (tmp_path / "guide.png").mkdir()
    with pytest.raises(InvalidRequest, match="cannot write"):
        draw(ARC, tmp_path / "guide.png")


def test_guide_that_does_not_reach_is_refused() -> None:
    with pytest.raises(InvalidRequest, match="does not lead"):
        draw(replace(MADE["four-bar"], stroke=1e4))


def test_without_matplotlib_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in ("matplotlib.figure", "matplotlib.backends.backend_agg"):
        monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(MissingExtra, match=r'pip install "mechanism-catalogue\[plot\]"'):
        draw(ARC)


@pytest.mark.slow
def test_a_notebook_is_given_a_picture() -> None:
    assert draw(ARC)._repr_png_().startswith(b"\x89PNG")


def run(code: str) -> None:
    subprocess.run([sys.executable, "-c", code], check=True, cwd=Path(__file__).parents[2])


@pytest.mark.slow
def test_importing_does_not_import_matplotlib() -> None:
    run("import catalogue.draw, sys; assert not [m for m in sys.modules if m.startswith('matplotlib')]")


@pytest.mark.slow
def test_drawing_leaves_pyplot_and_settings_alone() -> None:
    run(f"""
import sys, matplotlib
from catalogue.draw import draw
from catalogue.draw.datasheet_pdf import sheet_figure
from catalogue.guides.candidate import Candidate
before = matplotlib.rcParams.copy()
draw(Candidate(**{asdict(ARC)!r}))
assert 'matplotlib.pyplot' not in sys.modules
assert matplotlib.rcParams.copy() == before
""")


@pytest.mark.parametrize(
    "corners", [[0j], [0j, 0j], [0j, 3 + 1j], [0j, 1j, 3j], [0j, 4 + 0j, 1 + 2j], [0j, 1 + 2j, 4 + 0j]]
)
def test_border_of_a_link_keeps_its_distance(corners: list[complex]) -> None:
    border = rounded(np.array(corners), 0.5)
    closed = np.append(corners, corners[0])
    share = np.linspace(0, 1, 401)[:, None]
    inside = (closed[:-1] + share * np.diff(closed)).ravel()
    distance = np.abs(border[:, None] - inside).min(1)
    np.testing.assert_allclose(distance, 0.5, atol=1e-4)


@pytest.mark.slow
def test_linkages_stand_in_the_middle_of_the_sheet_and_their_dots_are_of_one_size() -> None:
    size = []
    for made in EVERY:
        figure = draw(made)
        figure.draw_without_rendering()
        axes = figure.axes[0]
        x0, y0, x1, y1 = still(made).box
        low, high = axes.transData.transform([(x0, y0), (x1, y1)])
        assert 0.5 * (low + high)[0] == pytest.approx(0.5 * figure.bbox.width, abs=0.01)
        assert (low > 0).all()
        assert (high < figure.bbox.max).all()
        (dot,) = [patch for patch in axes.patches if patch.get_gid() == "guided"]
        size.append(np.ptp(axes.transData.transform(dot.get_xy()), axis=0))
    np.testing.assert_allclose(size, np.full((len(EVERY), 2), size[0][0]), rtol=1e-6)


@pytest.mark.parametrize("corners", [[0j], [0j, 3 + 1j], [0j, 1j, 3j], [0j, 4 + 0j, 1 + 2j], [2j, 2j, -2j]])
def test_the_plate_of_a_link_in_a_moving_drawing_is_the_border_about_its_pins(corners: list[complex]) -> None:
    """Its lines keep their distance, and each of its arcs is about a pin; pins that coincide count once."""
    for turn in (1, -1, 1j):
        z = turn * np.array(corners)
        places = np.array(re.findall(r"[ML]([-\d.]+) ([-\d.]+)|A0.5 0.5 0 0 1 ([-\d.]+) ([-\d.]+)", plate(z, 0.5)))
        ends = np.array([[v or w for v, w in zip(row[:2], row[2:], strict=True)] for row in places], float) @ [1, 1j]
        distance = np.abs(ends[:, None] - z).min(1)
        np.testing.assert_allclose(distance, 0.5, atol=0.01)
        apart = z - z[:, None]  # a corner is where some direction has nothing beyond
        run = (apart[..., None] * np.exp(1j * np.linspace(0, 6.28, 300))).real
        beyond = run.max(1, where=apart[..., None] != 0, initial=-1)
        hull = {complex(k) for k in z[(beyond < -1e-9).any(1)]}
        assert {complex(z[np.abs(z - end).argmin()]) for end in ends} == hull


@every
def test_a_path_goes_on_for_the_length_that_is_asked_or_to_where_it_turns(made: Candidate) -> None:
    run, tangent = made.run(), complex(made.span().tangent[0])
    half = np.linspace(0, 0.4 * float(run.circuit.period[0]), 4001) * np.sign(run.high - run.low)
    for more in (0.01 * made.stroke, made.stroke):
        for tail, phases in zip(path_beyond(run, tangent, more), (run.low - half, run.high + half), strict=True):
            path = run.path(phases)
            u = np.abs(((path - path[0]) * tangent.conjugate()).real)
            turn = int((np.diff(u) <= 0).argmax()) if (np.diff(u) <= 0).any() else len(u) - 1
            reached = abs(((tail[-1] - tail[0]) * tangent.conjugate()).real)
            assert reached <= more * (1 + 1e-9)
            assert reached == pytest.approx(more, rel=1e-6) or reached == pytest.approx(u[turn], rel=1e-3)
            assert nearest(tail, path).max() < 1e-4 * made.stroke


@pytest.mark.slow
def test_the_deviation_of_a_path_that_returns_fills_its_band() -> None:
    """The point at the pole of a member of II.y0 runs out and back on one circle."""
    series = load("II.y0")
    pivots = series.members[0].synthesise({"q3": np.array([-2.0, 0.5]), "phi2": np.radians([40.0, 60.0])})
    for linkage in pivots.tolist():
        made = candidate(linkage, 0j, 0.02, circle=True)
        position, error = deviation_along(made)
        np.testing.assert_allclose([error.max(), -error.min()], made.deviation, rtol=2e-3)
        assert position[0] + position[-1] == pytest.approx(2 * made.stroke)
        assert 0 < position.min() < 0.01
        for x, off in zip(position[[0, -1]], error[[0, -1]], strict=True):
            _, end = min(made.path(3)[[0, -1]], key=lambda end: abs(end[0] - x))
            assert off * end > 0  # the upper of the two ends is drawn above


@pytest.mark.parametrize("name", ["inverted-slider-crank", "swinging-block", "oldham"])
def test_the_rod_of_a_slide_is_drawn_along_its_line_through_the_block(name: str) -> None:
    shown = still_poses(MADE[name])
    (coupler,) = [body for body in shown.machine.bodies if body.name == "coupler"]
    lines = {one.name: one for one in coupler.shapes if isinstance(one, Plate)}
    for i, rod in shown.rods.items():
        ends = coupler.places(lines[f"line-{i + 1}"].drawn(0.01 * MADE[name].stroke))
        for at, whole, normal in zip(ends, shown.carried(rod), shown.moving[:, i], strict=True):
            np.testing.assert_allclose(((at - whole) * normal.conj()).real, 0, atol=1e-9 * MADE[name].stroke)
            along = (whole[1] - whole[0]) / abs(whole[1] - whole[0])
            beyond = ((at - whole) * np.conj(along)).real * [-1, 1]
            assert (beyond >= -1e-12 * MADE[name].stroke).all()
            assert beyond.max() > 0


@pytest.mark.parametrize("towards", [1j, -1j])
def test_a_fixed_line_is_hatched_along_all_of_it_and_on_one_side(towards: complex) -> None:
    for turn in np.exp([0, 2j, 4j]):
        axes = Figure().add_subplot()
        Pen(axes, 0.5).hatched(3 * turn, 40 * turn, towards * turn, "line")
        strokes, line = (drawn.get_xydata() @ np.array([1, 1j]) / turn for drawn in axes.lines)
        np.testing.assert_allclose(line, [3, 40], atol=1e-12)
        begin, end = strokes[::3], strokes[1::3]
        assert np.isnan(strokes[2::3]).all()
        np.testing.assert_allclose(begin.imag, 0, atol=1e-12)
        assert (
            3
            < begin.real.min()
            < 3 + np.diff(begin.real).min()
            < 40 - np.diff(begin.real).min()
            < begin.real.max()
            < 40
        )
        np.testing.assert_allclose(np.diff(begin.real), np.diff(begin.real)[0], rtol=1e-9)
        assert (((end - begin) / towards).real > 0).all()


@pytest.mark.parametrize("travel", [0.0, 1e-17j, 1e-17, -1e-17])
def test_the_rail_of_a_slider_that_hardly_moves_runs_along_it(travel: complex) -> None:
    for turn in np.exp([0, 1j, 3j]):
        ends = Rail("rail", turn * np.array([0, travel]), 1j * turn).drawn(1.0) / turn
        np.testing.assert_allclose(np.sort(ends.real), [-(BLOCK[0] + 7), BLOCK[0] + 7], atol=1e-12)
        np.testing.assert_allclose(ends.imag, BLOCK[1], atol=1e-12)


def test_the_line_of_a_slider_lies_on_the_other_side_of_it_than_the_linkage() -> None:
    for turn in np.exp([0, 1j, 3j]):
        for side in (1, -1):
            axes = Figure().add_subplot()
            others = 5 + turn * np.array([8 * side, 1 + 3j * side, 2 - 5j])
            Pen(axes, 0.5).track(5 + 0j, turn, (-4.0, 6.0), others, "guide")
            strokes, line = ((drawn.get_xydata() @ np.array([1, 1j]) - 5) / turn for drawn in axes.lines)
            assert (side * line.real < 0).all()
            np.testing.assert_allclose(line.imag, [-4, 6], atol=1e-12)
            assert (np.abs(strokes[1::3].real) > np.abs(line.real[0])).all()  # hatched on the far side


@pytest.mark.slow
@pytest.mark.parametrize("driver", [None, 1, 2])
def test_stills_and_sheets_mark_the_driving_crank(driver: int | None) -> None:
    made = replace(MADE["four-bar"], driver=driver)
    for figure in (draw(made), sheet_figure(made, unit="mm")):
        marks = [one for axes in figure.axes for one in axes.lines if str(one.get_gid()).startswith("drive-")]
        cranks = {
            str(one.get_gid()): one.get_edgecolor() for axes in figure.axes for one in axes.patches
            if str(one.get_gid()).startswith("crank-")
        }  # fmt: skip
        assert set(cranks) == {"crank-1", "crank-2"}
        assert len(marks) == (0 if driver is None else 3), "an arc with two heads: the crank swings"
        for one in marks:
            x, y, _ = made.pivots[driver - 1][0] if driver else (0.0, 0.0, 1.0)
            away = np.hypot(*(np.asarray(one.get_xydata()) - (x, y)).T)
            assert np.ptp(away) < 0.5 * away.max(), "about its fixed pivot"
        coloured = {name for name, colour in cranks.items() if np.allclose(colour[:3], to_rgb(DRIVER))}
        assert coloured == (set() if driver is None else {f"crank-{driver}"})


@pytest.mark.slow
def test_the_way_back_of_a_turning_crank_is_drawn() -> None:
    links = {"ground": 220, "crank": 100, "coupler": 250, "rocker": 250, "along": 125, "across": 80}
    measured = catalogue.guide(links).measure(stroke=120, limit=4)
    guide = next(one for one in measured if one.driver in one.rotates)
    assert guide.lift is not None
    z = line(draw(guide), "path-turn") @ np.array([1, 1j])
    assert abs(z[0] - z[-1]) < 1e-9 * guide.size, "closed"
    path = guide.path(3) @ np.array([1, 1j])
    along = (path[2] - path[0]) / abs(path[2] - path[0])
    highest = np.abs(((z - path[0]) * along.conjugate()).imag).max()
    assert highest == pytest.approx(guide.lift, rel=1e-3, abs=2 * guide.deviation)
    assert not [one for axes in draw(MADE["four-bar"]).axes for one in axes.lines if one.get_gid() == "path-turn"]


@pytest.mark.slow
def test_every_measured_stretch_is_drawn() -> None:
    links = {"ground": 220, "crank": 100, "coupler": 250, "rocker": 250, "along": 125, "across": 80}
    for stroke, radius in ((120.0, 300.0), (230.0, None)):
        found = catalogue.guide(links).measure(stroke=stroke, radius=radius)
        assert len(found) >= 2
        for one in found:
            path, (_, error) = still(one).path, deviation_along(one)
            ends = one.path(2) @ np.array([1, 1j])
            for end in ends:
                assert np.abs(path - end).min() < 1e-6 * one.stroke
            assert np.abs(error).max() == pytest.approx(one.deviation, rel=1e-2)


@pytest.mark.parametrize("how", [{"stroke": 3}, {"stroke": 2, "radius": 6}], ids=["line", "arc"])
def test_many_bars_are_drawn_on_the_sheet_of_any_guide(how: dict[str, float]) -> None:
    made = BARS.measure(**how)[0]
    figure = draw(made)
    drawn, path = line(figure, "path") @ [1, 1j], made.motion(4001).points["P"]
    assert apart(drawn, path) < 1e-4 * made.stroke
    position, error = line(figure, "error").T
    assert np.ptp(position) == pytest.approx(made.stroke, rel=1e-2)
    assert np.abs(error).max() == pytest.approx(made.deviation, rel=1e-3)
    (start, end) = line(figure, "scale")[1:3] @ [1, 1j]
    (told,) = [text.get_text() for axes in figure.axes for text in axes.texts if text.get_gid() == "scale-length"]
    assert abs(end - start) == pytest.approx(float(told))


@pytest.mark.slow
def test_a_long_name_is_written_smaller_and_literally() -> None:
    figure = draw(LONG)
    name, kind = (one for one in figure.texts if one.get_gid() in ("series", "family"))
    ends = [one.get_window_extent() for one in (name, kind)]
    assert ends[0].x1 < ends[1].x0 < ends[1].x1 < figure.bbox.x1
    assert "$many$" in name.get_text()
    assert not name.get_parse_math()
