"""DXF: what an independent reader recovers from the text."""

from __future__ import annotations

import io
import math
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial import ConvexHull

import catalogue
from catalogue.errors import InvalidRequest, MissingExtra
from catalogue.export.outlines import rounded_hull
from catalogue.guides.dwell import DwellCandidate
from tests.curves import off_spline

ezdxf: Any = pytest.importorskip("ezdxf", reason="comes with the extra `cad`, of which `test` is made")

FAMILIES = ("four-bar", "slider-crank", "inverted-slider-crank", "swinging-block", "elliptic-trammel", "oldham")
CRANK_ROCKER = {"ground": 4, "crank": 1, "coupler": 3.5, "rocker": 3, "along": 2, "across": 1}
Six = dict[str, catalogue.Stretch]
Read = Callable[[str], Any]


_MADE: dict[Any, str] = {}


def text(guide: catalogue.PlacedGuide, **options: Any) -> str:
    """Return the drawing, each made once."""
    key = (type(guide), repr(guide.pivots), *options.items())
    if key not in _MADE:
        _MADE[key] = str(guide.export(format="dxf", **options))
    return _MADE[key]


def pivots(guide: catalogue.PlacedGuide) -> list[complex]:
    return [complex(x, y) for dyad in guide.pivots for x, y, w in dyad if w] + [complex(*guide.guided)]


@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES)
def test_the_pivots_are_recovered(six: Six, read_dxf: Read, family: str) -> None:
    guide = six[family]
    circles = [
        placed(one.point()) for _, one, placed in read_dxf(text(guide)).placed()
        if one.kind == "CIRCLE" and one.layer == "PIVOTS"
    ]  # fmt: skip
    expected = pivots(guide)
    for z in expected:
        assert min(abs(z - at) for at in circles) <= 1e-9 * guide.size
    for at in circles:
        assert min(abs(z - at) for z in expected) <= 1e-9 * guide.size


@pytest.mark.parametrize("family", FAMILIES)
def test_a_block_begins_in_its_first_pivot_and_runs_to_its_second(six: Six, read_dxf: Read, family: str) -> None:
    guide, drawing = six[family], read_dxf(text(six[family]))
    lengths = guide.lengths
    for name in (name for name in lengths if name.startswith("crank")):
        first, second = (one.point() for one in drawing.blocks[name.upper().replace(" ", "_")] if one.kind == "CIRCLE")
        assert first == 0
        assert second == pytest.approx(lengths[name], abs=1e-9 * guide.size)
    point = complex(lengths["point along"], lengths["point across"])
    holes = [one.point() for one in drawing.blocks["COUPLER"] if one.kind == "CIRCLE"]
    assert min(abs(point - hole) for hole in holes) <= 1e-9 * guide.size
    assert len(holes) == 1 + guide.linkage.finite[0, :, 1].sum()


@pytest.mark.slow
@pytest.mark.parametrize(("unit", "code", "metric"), [("mm", "4", "1"), ("in", "1", "0"), ("m", "6", "1")])
def test_units_are_told_and_nothing_is_converted(six: Six, read_dxf: Read, unit: str, code: str, metric: str) -> None:
    drawing = read_dxf(text(six["four-bar"], unit=unit))
    assert (drawing.header["$INSUNITS"], drawing.header["$MEASUREMENT"]) == (code, metric)
    assert drawing.entities[0].point() == read_dxf(text(six["four-bar"])).entities[0].point()


@pytest.mark.parametrize("family", FAMILIES)
def test_the_audit_is_clean_and_all_layers_are_declared(six: Six, read_dxf: Read, family: str) -> None:
    written = text(six[family])
    auditor = ezdxf.read(io.StringIO(written)).audit()
    assert (auditor.errors, auditor.fixes) == ([], [])
    drawing = read_dxf(written)
    every = [*drawing.entities, *(one for block in drawing.blocks.values() for one in block)]
    assert {layer for one in every for layer in one.all(8)} <= {*drawing.tables["LAYER"]}
    types = {name.upper() for name in drawing.tables["LTYPE"]}
    assert {"CONTINUOUS"} | {name.upper() for one in every for name in one.all(6)} <= types
    assert {one.one(3) for one in drawing.of("DIMENSION")} <= {*drawing.tables["DIMSTYLE"]}


def read_spline(entity: Any) -> tuple[int, Any, Any]:
    """Return degree, knots and control points of a spline from its group codes."""
    control = np.array([complex(float(x), float(y)) for x, y in zip(entity.all(10), entity.all(20), strict=True)])
    return int(entity.one(71)), np.array([float(t) for t in entity.all(40)]), control


@pytest.mark.parametrize("family", FAMILIES)
def test_the_path_is_a_spline_that_leaves_it_by_nothing(six: Six, read_dxf: Read, family: str) -> None:
    guide = six[family]
    (path,) = read_dxf(text(guide)).of("SPLINE", "PATH")
    z = guide.motion(101).points["guided"]
    assert off_spline(*read_spline(path), z) <= max(1e-3 * guide.deviation, 1e-12 * guide.size)
    assert abs(np.diff(read_spline(path)[2][[0, -1]])[0]) == pytest.approx(60, rel=1e-3)


@pytest.mark.parametrize("family", FAMILIES)
def test_dimensions_say_the_lengths_of_the_links(six: Six, read_dxf: Read, family: str) -> None:
    guide = six[family]
    lengths = sorted(abs(length) for length in guide.lengths.values() if abs(length) > 1e-9 * guide.size)
    told = read_dxf(text(guide)).of("DIMENSION", "DIMENSIONS")
    spans = sorted(abs(one.point(13) - one.point(14)) for one in told)
    assert spans == pytest.approx(lengths, rel=1e-9, abs=1e-9 * guide.size)


def outline(entity: Any) -> np.ndarray[Any, Any]:
    """Return a closed polyline as many points, its arcs included."""
    x, y = ([float(v) for v in entity.all(code)] for code in (10, 20))
    bulges = [0.0] * len(x)
    i = -1
    for code, value in entity.tags:
        i += code == 10
        if code == 42:
            bulges[i] = float(value)
    assert entity.one(70) == "1"
    z = [complex(*p) for p in zip(x, y, strict=True)]
    points: list[complex] = []
    for k, bulge in enumerate(bulges):
        a, b = z[k], z[(k + 1) % len(z)]
        if not bulge:
            points.append(a)
            continue
        radius = abs(b - a) * (1 + bulge**2) / (4 * abs(bulge))
        height = 0.5 * abs(b - a) * bulge  # of the arc, to the right of the chord
        centre = 0.5 * (a + b) + 1j * (b - a) / abs(b - a) * (math.copysign(radius, bulge) - height)
        sweep = 4 * math.atan(bulge)
        points += [centre + (a - centre) * np.exp(1j * sweep * s) for s in np.linspace(0, 1, 400, endpoint=False)]
    return np.array(points)


def area(z: np.ndarray[Any, Any]) -> float:
    return float(0.5 * (z.conj() * np.roll(z, -1)).imag.sum())


@pytest.mark.parametrize("turn", range(0, 360, 45))
def test_dimensions_are_read_from_below_or_from_the_right(read_dxf: Read, turn: int) -> None:
    base = catalogue.guide(CRANK_ROCKER)
    z = np.exp(1j * np.radians(turn + 7))
    guided = z * complex(*base.guided)
    moved = catalogue.guide(base.linkage.moved(z, 0j), [guided.real, guided.imag])
    told = read_dxf(text(moved)).of("DIMENSION", "DIMENSIONS")
    assert len(told) > 3
    for one in told:
        assert -81 < np.degrees(np.angle(one.point(14) - one.point(13))) < 100


@pytest.mark.parametrize("family", FAMILIES)
def test_dimensions_stand_on_the_far_side_of_the_middle_of_all(six: Six, read_dxf: Read, family: str) -> None:
    told = read_dxf(text(six[family])).of("DIMENSION", "DIMENSIONS")
    middle = np.mean([one.point(13) + one.point(14) for one in told]) / 2
    for one in told:
        a, b = one.point(13), one.point(14)
        across = 1j * (b - a) / abs(b - a)
        away, side = (((z - (a + b) / 2) * np.conj(across)).real for z in (one.point(10), middle))
        assert away * side < 1e-9 * six[family].size ** 2


def test_bars_are_as_wide_and_holes_as_large_as_asked_for(six: Six, read_dxf: Read) -> None:
    guide = six["four-bar"]
    drawing = read_dxf(text(guide, bar_width=18, hole=6))
    lines, circles = drawing.of("LWPOLYLINE", "CUT"), drawing.of("CIRCLE", "CUT")
    assert [float(one.one(40)) for one in circles] == [3.0] * 9  # three bars of two, and three in the coupler
    bars = [area(outline(one)) for one in lines[:3]]
    lengths = [guide.lengths[name] for name in ("frame", "crank 1", "crank 2")]
    assert bars == pytest.approx([length * 18 + math.pi * 81 for length in lengths], rel=1e-4)
    corners = [0j, guide.lengths["coupler"] + 0j, complex(guide.lengths["point along"], guide.lengths["point across"])]
    round_it = sum(abs(a - b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True))
    plate = abs(area(np.array(corners))) + 9 * round_it + math.pi * 81
    assert area(outline(lines[3])) == pytest.approx(plate, rel=1e-4)


@pytest.mark.parametrize("family", FAMILIES)
def test_parts_lie_apart(six: Six, read_dxf: Read, family: str) -> None:
    drawing = read_dxf(text(six[family]))
    boxes: list[tuple[float, float, float, float]] = []
    for one in drawing.of("LWPOLYLINE", "CUT"):
        z = outline(one)
        box = z.real.min(), z.imag.min(), z.real.max(), z.imag.max()
        if not any(b[0] < box[0] and b[1] < box[1] and b[2] > box[2] and b[3] > box[3] for b in boxes):  # no slot
            boxes.append(box)
    assert len(boxes) == 4
    for i, a in enumerate(boxes):
        for b in boxes[:i]:
            assert a[0] > b[2] or b[0] > a[2] or a[1] > b[3] or b[1] > a[3]
    there = [placed(z) for _, one, placed in drawing.placed() if one.kind == "LWPOLYLINE" for z in outline(one)]
    assert max(z.real for z in there) < min(box[0] for box in boxes)


@pytest.mark.parametrize("family", FAMILIES[1:])
def test_blocks_travel_from_one_end_of_their_slots_to_the_other(six: Six, read_dxf: Read, family: str) -> None:
    """The block of a slider or slide, carried along by the motion, fills its slot and never leaves it."""
    guide, width = six[family], 10.0
    drawing = read_dxf(text(guide, bar_width=width, hole=4))
    moved = guide.motion(5001)
    turned = np.exp(1j * np.radians(moved.coupler))
    slots = 0
    for i, (fixed, moving) in enumerate(guide.pivots, 1):
        if fixed[2] and moving[2]:
            continue
        of, dyad = ("FRAME", fixed) if moving[2] else ("COUPLER", moving)
        along = complex(-dyad[1], dyad[0])  # of the slot in the position given, square to its normal
        pin = complex(*(moving if moving[2] else fixed)[:2])
        if moving[2]:
            run = (moved.points[f"A{i}*"] - pin) / along
        else:  # the pin in the plane of the coupler
            run = ((pin - moved.points["guided"]) / turned - (pin - complex(*guide.guided))) / along
        assert np.abs(run.imag).max() <= 1e-9 * guide.size
        blocks = [(one, placed) for name, one, placed in drawing.placed() if name == of and one.kind == "LWPOLYLINE"]
        ends = []
        for one, placed in blocks[1:]:
            corners = (placed(outline(one)) - pin) / along
            if np.abs(np.abs(corners.imag) - 0.5 * width).max() < 1e-9 * guide.size:
                ends.append((corners.real.min(), corners.real.max()))
        assert (run.real.min() - width, run.real.max() + width) in [
            pytest.approx(e, abs=1e-6 * guide.size) for e in ends
        ]
        slots += 1
    assert slots == (1 if "crank" in family else 2)


@pytest.mark.parametrize("places", [1, 2, 3, 9])
def test_a_rounded_hull_has_the_area_of_steiner(places: int) -> None:
    """A + r U + pi r^2, with area and circumference of the hull by qhull, of a line or a place none."""
    draw = np.random.default_rng(places)
    for _ in range(20):
        z, r = draw.normal(size=places) + 1j * draw.normal(size=places), draw.uniform(0.1, 2)
        inside = [*z, z.mean()] if places > 2 else [*z, *z]
        made = rounded_hull([complex(p) for p in draw.permutation(inside)], r)
        hull = ConvexHull(np.stack([z.real, z.imag], 1)) if places > 2 else None
        around = float(hull.area) if hull else 2 * abs(z[0] - z[-1])  # of qhull: the area in a plane is the edge
        corners = np.array(made.corners)
        covered = area(corners)
        for bulge, a, b in zip(made.bulges, corners, np.roll(corners, -1), strict=True):
            sweep = 4 * math.atan(bulge)
            radius = abs(b - a) / 2 / math.sin(sweep / 2) if bulge else 0.0
            covered += radius**2 / 2 * (sweep - math.sin(sweep))
            assert not bulge or radius == pytest.approx(r, rel=1e-6)
        fine = np.array(made.points(400))
        assert area(fine) == pytest.approx(covered, rel=1e-4)
        assert covered == pytest.approx((hull.volume if hull else 0.0) + r * around + math.pi * r**2, rel=1e-9)


@pytest.mark.slow
def test_a_linkage_without_a_stroke_is_drawn_over_its_circuit(read_dxf: Read) -> None:
    guide = catalogue.guide(CRANK_ROCKER)
    (path,) = read_dxf(text(guide)).of("SPLINE")
    z = guide.motion(41).points["guided"]
    assert off_spline(*read_spline(path), z) < 1e-6
    assert abs(np.diff(read_spline(path)[2][[0, -1]])[0]) < 1e-12


@pytest.mark.slow
def test_a_dwell_has_rod_and_rocker(read_dxf: Read) -> None:
    base = catalogue.guide(CRANK_ROCKER)
    dwell = DwellCandidate(
        1, "four-bar", "general", "", 0, 90.0, 0.5, 30.0, 40.0, 5.0, 1, base.pivots, base.guided, [3.0, 4.0], [6.0, 1.0]
    )
    drawing = read_dxf(text(dwell))
    rod = abs(complex(3, 4) - complex(*base.guided))
    for name, length in (("ROD", rod), ("ROCKER", math.hypot(3, 3))):
        first, second = (one.point() for one in drawing.blocks[name] if one.kind == "CIRCLE")
        assert (first, second) == (0, pytest.approx(length))
    told = str(dwell.export(format="solidworks"))
    assert f'"rod" = {rod!r}mm' in told
    assert '"rocker_pivot_x" = 6mm' in told
    circles = [placed(one.point()) for _, one, placed in drawing.placed() if one.kind == "CIRCLE"]
    assert min(abs(z - (6 + 1j)) for z in circles) < 1e-12
    assert len(drawing.of("CIRCLE", "CUT")) == 3 + 2 + 2 + 3 + 2 + 2


def test_the_same_guide_gives_the_same_file(six: Six, tmp_path: Path) -> None:
    file = tmp_path / "guide.dxf"
    assert text(six["oldham"]) == six["oldham"].export(file) == file.read_text("utf-8")
    assert ezdxf.options.write_fixed_meta_data_for_testing is False


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"hole": 300, "bar_width": 400}, "holes of 300 meet"),
        ({"hole": 20, "bar_width": 20}, "do not fit into bars"),
        ({"hole": -1}, "hole must be"),
        ({"bar_width": 0}, "bar width must be"),
        ({"unit": "furlong"}, "no unit 'furlong' of length; there are mm"),
    ],
)
def test_what_cannot_be_cut_is_refused(six: Six, options: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidRequest, match=message):
        text(six["four-bar"], **options)


@pytest.mark.parametrize("size", [1e-151, 1e-13, 1e70, 1e149])
def test_a_size_that_no_drawing_holds_is_refused(size: float) -> None:
    links = {"ground": 2.2, "crank": 1, "coupler": 2.5, "rocker": 2.5, "along": 1.25, "across": 0.8}
    guide = catalogue.guide({name: size * length for name, length in links.items()})
    with pytest.raises(InvalidRequest, match=r"^a DXF holds linkages of 1e-09 to 1e\+60 mm, not of .*another unit$"):
        guide.export(format="dxf")
    for format in ("freecad", "json", "csv", "solidworks", "fusion"):
        assert guide.export(format=format)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"format": ["dxf"]}, r"there is no format \['dxf'\]"),
        ({"format": "dfx"}, "did you mean 'dxf'"),
        ({"file": 3}, "exported to a file, not to 3"),
        ({"file": "guide"}, "the suffix of guide names no format"),
        ({}, "name a format"),
        ({"format": "csv", "columns": 3}, "columns must be names, not 3"),
        ({"format": "csv", "over": ["stroke"]}, "over must be stroke or circuit"),
        ({"format": "csv", "positions": "many"}, "samples must be"),
        ({"format": "dxf", "unit": ["mm"]}, "no unit"),
        ({"format": "dxf", "hole": "5"}, "hole must be"),
        ({"format": "json", "file": "a\0b.json"}, "cannot write"),
    ],
)
def test_what_cannot_be_meant_is_refused(six: Six, given: Any, message: str) -> None:
    with pytest.raises(InvalidRequest, match=message) as caught:
        six["four-bar"].export(**given)
    assert "\n" not in str(caught.value)


def test_a_coupler_that_runs_to_infinity_needs_a_stroke() -> None:
    guide = catalogue.guide({"height": 100, "offset": 40, "along": 100, "across": 50})
    with pytest.raises(InvalidRequest, match="runs to infinity"):
        text(guide)


def test_dxf_needs_its_extra(six: Six, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ezdxf", None)
    with pytest.raises(MissingExtra, match=r'pip install "mechanism-catalogue\[cad\]"'):
        six["four-bar"].export(format="dxf")


@pytest.mark.slow
@pytest.mark.parametrize("family", ["four-bar", "oldham"])
def test_librecad_draws_it(six: Six, tmp_path: Path, family: str, monkeypatch: pytest.MonkeyPatch) -> None:
    librecad = shutil.which("librecad")
    if librecad is None:
        pytest.skip("librecad is not installed: it comes with the system's packages")
    monkeypatch.setenv("QT_QPA_PLATFORM", "offscreen")
    monkeypatch.setenv("HOME", str(tmp_path))
    file, page, blank = tmp_path / "guide.dxf", tmp_path / "guide.pdf", tmp_path / "blank.pdf"
    six[family].export(file)
    ezdxf.new("R2010").saveas(tmp_path / "blank.dxf")
    for drawn in (page, blank):
        command = [librecad, "dxf2pdf", "-a", "-c", "-o", str(drawn), str(drawn.with_suffix(".dxf"))]
        subprocess.run(command, check=True, capture_output=True, timeout=120)
    assert page.read_bytes().startswith(b"%PDF")
    assert page.stat().st_size > blank.stat().st_size + 5000
