"""Moving drawings as files: true millimetres at the stated scale, dimensions, layers; films; what is refused."""

from __future__ import annotations

import io
import re
import shutil
import subprocess
import xml.etree.ElementTree as ET
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import TextPath
from PIL import Image

import catalogue
from catalogue.draw.frame import room
from catalogue.draw.moving_file import moving_file
from catalogue.draw.moving_layers import LAYERS
from catalogue.draw.picture import film
from catalogue.draw.poses import poses
from catalogue.draw.units import Scale, length
from catalogue.errors import InvalidRequest
from catalogue.guides.placed import PlacedGuide
from catalogue.units import MILLIMETRES
from tests.curves import apart
from tests.draw.samples import ARC, BARS, DWELL, EVERY, LONG, MADE, NAMES, OPEN, OWN

SVG = "{http://www.w3.org/2000/svg}"
every = pytest.mark.parametrize("made", [*EVERY, OWN, OPEN, DWELL], ids=[*NAMES, "own", "open", "dwell"])


def drawn_path(root: ET.Element) -> Any:
    (path,) = [e for e in root.iter(f"{SVG}path") if e.attrib.get("class") == "path"]
    return np.array(re.findall(r"-?[\d.]+", path.attrib["d"]), float).reshape(-1, 2) @ [1, 1j]


@pytest.mark.parametrize(("unit", "scale"), [("mm", None), ("mm", "1:5"), ("cm", "1:10"), ("in", "1:50"), ("m", None)])
def test_a_length_on_paper_is_true_at_the_stated_scale(unit: str, scale: str | None) -> None:
    root = ET.fromstring(moving_file(ARC, unit=unit, scale=scale))
    width, height = (float(root.attrib[name].removesuffix("mm")) for name in ("width", "height"))
    assert root.attrib["viewBox"] == f"0 0 {width:g} {height:g}"  # so that a unit of it is a millimetre
    said = "".join(root.itertext())
    (told,) = re.findall(r"scale ([\d.]+:[\d.]+)", said)
    ratio = Scale.named(told).ratio
    if scale is not None:
        assert told == scale
    path = drawn_path(root)
    real = ARC.path(201) @ np.array([1, 1j])
    assert abs(path[-1] - path[0]) == pytest.approx(abs(real[-1] - real[0]) * MILLIMETRES[unit] * ratio, abs=0.02)
    bar = [e for e in root.iter(f"{SVG}path") if e.attrib.get("class") == "dimension"][-1]
    numbers = np.array(re.findall(r"-?[\d.]+", bar.attrib["d"]), float).reshape(-1, 2)
    (step,) = re.findall(rf"([\d.]+) {unit} +· +scale", said)
    assert np.ptp(numbers[:, 0]) == pytest.approx(float(step) * MILLIMETRES[unit] * ratio, abs=0.02)


@every
def test_controls_stand_on_the_paper_below_the_facts(made: PlacedGuide) -> None:
    root = ET.fromstring(moving_file(made))
    height = float(root.attrib["height"].removesuffix("mm"))
    boxes = [float(e.attrib["y"]) for e in root.iter(f"{SVG}rect") if e.attrib.get("class") == "box"]
    facts = [float(e.attrib["y"]) for e in root.iter(f"{SVG}text") if "fact" in e.attrib.get("class", "")]
    assert max(facts) < min(boxes)
    assert height - 12 < max(boxes) + 3.2 < height


def test_a_slider_has_room_along_its_line_and_across() -> None:
    """As much, turned by a quarter turn, upwards as there was to the right."""
    made = MADE["slider-crank"]
    for turn in (0.1, 0.7, 1.3):
        borders = []
        for z in np.exp([1j * turn, 1j * (turn + 0.5 * np.pi)]):
            guided = z * complex(*made.guided)
            turned = catalogue.guide(made.linkage.moved(z, 0j), [guided.real, guided.imag])
            _, border = room(poses(turned).machine, 1.0)
            borders.append(border)
        same = (borders[0][:, 0] == borders[0][:, 1]) & (borders[0][:, 2] == borders[0][:, 3])  # no bearing, no link
        np.testing.assert_allclose(borders[1][same][:, [2, 3, 0, 1]], borders[0][same])
        assert np.ptp(borders[0][same], axis=1).max() > 0


@every
def test_file_is_whole_and_says_what_it_shows(made: PlacedGuide) -> None:
    text = moving_file(made, code="abcdefg")
    root = ET.fromstring(text)
    title = root.find(f"{SVG}title")
    assert title is not None
    assert title.text is not None
    assert title.text.startswith("abcdefg")
    said = "".join(root.itertext())
    for name, value in made.lengths.items():
        assert f"{name} = {length(value, 'mm')}" in said
    boxes = [e.attrib for e in root.iter() if e.attrib.get("role") == "checkbox"]
    layers = [name for name in LAYERS if name != "turn" or made in EVERY]  # the path of others is that already
    assert [box["data-layer"] for box in boxes if "data-layer" in box] == (list(LAYERS) if made is OPEN else layers)
    for box in boxes[:-1]:  # a box is ticked if its layer is shown
        assert (box["aria-checked"] == "false") == (f"hide-{box['data-layer']}" in root.attrib["class"].split())
    assert "http" not in text.replace("http://www.w3.org/2000/svg", "")
    width, height = (float(part) for part in root.attrib["viewBox"].split()[2:])
    path = drawn_path(root)
    assert (path.real > 0).all()
    assert (path.real < width).all()
    assert (path.imag > 0).all()
    assert (path.imag < height).all()
    facts = [
        (float(e.attrib["x"]), float(e.attrib["y"])) for e in root.iter(f"{SVG}text") if e.attrib["class"] == "fact"
    ]
    assert len(set(facts)) == len(facts) > len(made.lengths)
    assert all(0 < x < width and 0 < y < height for x, y in facts)
    columns = {float(e.attrib["x"]) for e in root.iter(f"{SVG}text") if re.search(r" = | at \(", e.text or "")}
    assert all(b - a >= 60 for a, b in pairwise(sorted(columns)))


def test_usual_scales() -> None:
    usual = {1.0: "1:1", 0.99: "1:2", 0.49: "1:2.5", 0.2: "1:5", 0.049: "1:25", 7.3: "5:1", 3: "2.5:1", 300: "250:1"}
    for ratio, said in usual.items():
        assert str(Scale.fitting(ratio)) == said
        assert Scale.named(said).ratio <= ratio


@pytest.mark.parametrize(("value", "unit", "said"), [
    (123.456789, "mm", "123.46 mm"), (0.0123456, "in", "0.01235 in"), (-1e-9, "mm", "0 mm"), (-2.5, "mm", "−2.5 mm"),
    (1500, "mm", "1500 mm"), (1.23456, "m", "1.2346 m"),
])  # fmt: skip
def test_lengths_as_they_are_written(value: float, unit: str, said: str) -> None:
    assert length(value, unit) == said


@pytest.mark.parametrize("made", [MADE["four-bar"], ARC], ids=["line", "arc"])
def test_a_film_shows_all_of_a_linkage_in_the_middle_and_not_distorted(
    made: PlacedGuide, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[Any] = []

    def stop(axes: Any, *_: Any) -> None:
        seen.append(axes)
        raise LookupError

    monkeypatch.setattr("catalogue.draw.symbols.Pen.__init__", lambda _, axes, *__: stop(axes))
    with pytest.raises(LookupError):
        film(made)
    (x0, x1), (y0, y1) = seen[0].get_xlim(), seen[0].get_ylim()
    box = poses(made).machine.box
    assert x1 - x0 > box[2] - box[0]
    assert y1 - y0 > box[3] - box[1]
    assert (x0 + x1, y0 + y1) == pytest.approx((box[0] + box[2], box[1] + box[3]))
    wide, high = seen[0].figure.get_size_inches()
    assert (x1 - x0) / wide == pytest.approx((y1 - y0) / high)


@pytest.mark.slow
@pytest.mark.parametrize("made", [MADE["four-bar"], DWELL], ids=["stroke", "dwell"])
def test_a_film_moves_and_comes_back(made: PlacedGuide) -> None:
    with Image.open(io.BytesIO(film(made))) as picture:
        assert picture.n_frames > 20  # type: ignore[attr-defined]
        assert picture.info["loop"] == 0
        frames = []
        for k in range(picture.n_frames):  # type: ignore[attr-defined]
            picture.seek(k)
            frames.append(np.asarray(picture.convert("L"), float))
    differ = [np.abs(a - b).mean() for a, b in zip(frames, frames[1:] + frames[:1], strict=True)]
    assert min(differ) > 0
    assert max(differ) < 12  # nothing jumps, at the seam neither


@pytest.mark.parametrize("name", ["a.svg", pytest.param("a.gif", marks=pytest.mark.slow)])
def test_plot_lets_it_move(name: str, tmp_path: Path) -> None:
    assert ARC.plot(tmp_path / name, moving=True) is None
    content = (tmp_path / name).read_bytes()
    assert content.startswith(b"<svg" if name == "a.svg" else b"GIF89a")
    ARC.plot(tmp_path / ("b" + name), moving=True)
    assert (tmp_path / ("b" + name)).read_bytes() == content
    if name == "a.svg":
        assert ARC.code in content.decode()


@pytest.mark.parametrize("made", [OWN, OPEN, DWELL], ids=["own", "open", "dwell"])
def test_what_has_no_stroke_is_drawn_too(made: PlacedGuide) -> None:
    figure = made.plot()
    (axes,) = figure.axes
    (path,) = [line for line in axes.lines if line.get_gid() == "path"]
    assert len(path.get_xydata()) > 100
    assert "error" not in {line.get_gid() for line in axes.lines}


@pytest.mark.slow
def test_a_guide_is_drawn_into_axes() -> None:
    figure = Figure(figsize=(6, 3))
    left, right = figure.subplots(1, 2)
    assert ARC.plot(ax=right) is figure
    assert not left.lines
    (path,) = [line for line in right.lines if line.get_gid() == "path"]
    assert apart(path.get_xydata() @ [1, 1j], ARC.path(4001) @ [1, 1j]) < 1e-4 * ARC.stroke
    assert right.get_aspect() == 1
    figure.draw_without_rendering()
    box = right.get_window_extent()
    for artist in right.patches:
        assert box.x0 - 1 <= artist.get_window_extent().x0
        assert artist.get_window_extent().x1 <= box.x1 + 1


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"file": "a.png", "moving": True}, "a .png cannot move"),
        ({"moving": True}, "say to which file"),
        ({"file": "a.jpg"}, r"choose \.png, \.svg, \.pdf or \.gif"),
        ({"file": "a.svg", "moving": True, "unit": "ell"}, "no unit 'ell'"),
        ({"file": "a.svg", "moving": True, "scale": "half"}, "a scale is written as"),
        ({"file": "a.svg", "moving": True, "scale": "0:1"}, "a scale is written as"),
        ({"file": "a.svg", "scale": "1:2"}, "only a moving SVG"),
    ],
)
def test_what_cannot_be_drawn_is_refused(
    given: dict[str, Any], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InvalidRequest, match=said):
        ARC.plot(**given)
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("chromium") is None, reason="chromium is not installed")
def test_two_poses_differ_in_a_browser(tmp_path: Path) -> None:
    """A browser shows it moving: the same file at two times gives two pictures."""
    pictures = []
    for time in (0.0, 2.0):
        page = tmp_path / f"{time}.html"
        script = f"const s=document.querySelector('svg');s.pauseAnimations();s.setCurrentTime({time})"
        page.write_text(f"<!doctype html>{moving_file(ARC)}<script>{script}</script>", "utf-8")
        out = tmp_path / f"{time}.png"
        subprocess.run(
            ["chromium", "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
             f"--user-data-dir={tmp_path / 'profile'}", f"--screenshot={out}", page.as_uri()],
            check=True, capture_output=True, timeout=60,
        )  # fmt: skip
        with Image.open(out) as picture:
            pictures.append(np.asarray(picture.convert("L"), float))
    assert np.abs(pictures[0] - pictures[1]).max() > 100


@pytest.mark.parametrize("made", [ARC, DWELL, LONG], ids=["arc", "dwell", "a long name"])
def test_a_title_ends_on_the_paper(made: Any) -> None:
    root = ET.fromstring(moving_file(made))
    (title,) = [e for e in root.iter(f"{SVG}text") if e.attrib["class"] == "series"]
    points = [e.attrib.get("style", "--guide-point:0.38px") for e in (title,)]
    point = float(points[0].partition("--guide-point:")[2].partition("px")[0].partition(";")[0])
    assert (point < 0.38) == (made is LONG), "names that have room keep their size"
    bold, italic = {"weight": "bold"}, {"style": "italic"}
    serif: dict[str, Any] = {"series": (bold, 21), "family": (italic, 16)}
    end = float(title.attrib["x"])
    for part in title:
        face, size = serif[part.attrib.get("class", "series")]
        font = FontProperties(family="DejaVu Serif", **face)  # wider than those of the drawing
        end += TextPath((0, 0), part.text or "", size=size * point, prop=font).get_extents().x1
    assert end < float(root.attrib["viewBox"].split()[2])


@pytest.mark.parametrize("made", [ARC, DWELL, BARS.measure(stroke=3)[0]], ids=["arc", "dwell", "many bars"])
def test_facts_end_on_the_paper(made: Any) -> None:
    """Their widths in the font of the drawing are those that matplotlib sets."""
    root = ET.fromstring(moving_file(made, code="a2bcdef"))
    width, font = float(root.attrib["viewBox"].split()[2]), FontProperties(family="DejaVu Sans")
    size = 9 * float(root.attrib["style"].partition("--guide-point:")[2].partition("px")[0].partition(";")[0])
    facts = [e for e in root.iter(f"{SVG}text") if e.attrib["class"] == "fact"]
    assert len(facts) > 4
    for fact in facts:
        end = float(fact.attrib["x"]) + TextPath((0, 0), fact.text or "", size=size, prop=font).get_extents().x1
        assert end < width - 4, fact.text
