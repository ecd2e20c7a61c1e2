"""A STEP file is read back by its kernel: parts where they stand, holes at the pivots, millimetres."""

from __future__ import annotations

import math
import sys
from itertools import combinations
from pathlib import Path
from typing import Any

import pytest

import catalogue

FAMILIES = ("four-bar", "slider-crank", "inverted-slider-crank", "swinging-block", "elliptic-trammel", "oldham")
Six = dict[str, catalogue.Stretch]


def read(guide: catalogue.Stretch, file: Path, **options: Any) -> dict[str, Any]:
    """Return the shapes of an exported guide by name."""
    cad: Any = pytest.importorskip("build123d", reason='step needs pip install "mechanism-catalogue[step]"')
    guide.export(file, **options)
    return {shape.label.replace("_", " "): shape for shape in cad.import_step(file).children}


@pytest.mark.slow
@pytest.mark.parametrize(("unit", "millimetres"), [("mm", 1.0), ("in", 25.4)])
def test_a_crank_is_a_bar_with_two_holes_in_millimetres(
    six: Six, tmp_path: Path, unit: str, millimetres: float
) -> None:
    guide = six["four-bar"]
    crank = read(guide, tmp_path / "guide.step", unit=unit, bar_width=20, hole=8)["crank 1"]
    area = 20 * guide.lengths["crank 1"] + math.pi * 100 - 2 * math.pi * 16
    assert crank.is_valid
    assert crank.volume == pytest.approx(area * 6 * millimetres**3, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES)
def test_every_pivot_is_the_axis_of_a_hole(six: Six, tmp_path: Path, family: str) -> None:
    guide = six[family]
    shapes = read(guide, tmp_path / "guide.step", unit="cm")
    assert "path" in shapes
    assert {"frame", "coupler"} < {*shapes}
    axes = [complex(*tuple(edge.arc_center)[:2]) for shape in shapes.values() for edge in shape.edges()
            if edge.geom_type.name == "CIRCLE" and edge.is_closed]  # fmt: skip
    pivots = [complex(x, y) for dyad in guide.pivots for x, y, w in dyad if w]
    for z in (*pivots, complex(*guide.guided)):
        assert min(abs(10 * z - axis) for axis in axes) <= 1e-9 * 10 * guide.size


@pytest.mark.slow
@pytest.mark.parametrize("unit", [None, "mm", "m"])
def test_fourteen_inches_are_355_6_millimetres(tmp_path: Path, unit: str | None) -> None:
    links = {"ground": 22, "crank": 10, "coupler": 25, "rocker": 25, "along": 12.5, "across": 8, "unit": "in"}
    (guide,) = catalogue.guide(links).measure(stroke=14, limit=1)
    (edge,) = read(guide, tmp_path / "guide.step", unit=unit)["path"].edges()
    ends = [complex(*tuple(edge @ at)[:2]) for at in (0, 1)]
    true = [complex(*place) for place in (guide.path()[0], guide.path()[-1])]
    assert abs(ends[1] - ends[0]) == pytest.approx(25.4 * abs(true[1] - true[0]), rel=1e-9)
    assert abs(ends[1] - ends[0]) == pytest.approx(355.6, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("family", FAMILIES)
def test_no_two_solids_overlap(six: Six, tmp_path: Path, family: str) -> None:
    solids = [shape for shape in read(six[family], tmp_path / "guide.step").values() if shape.solids()]
    assert len(solids) > 2
    for one, other in combinations(solids, 2):
        common = one.intersect(other)
        assert (
            sum(part.volume for part in ([common] if hasattr(common, "volume") else common or [])) < 1e-6 * one.volume
        )


def test_without_its_kernel_the_line_says_what_to_install(
    six: Six, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "build123d", None)
    with pytest.raises(catalogue.MissingExtra, match=r"^step needs build123d: pip install"):
        six["four-bar"].export(tmp_path / "guide.step")
    assert not [*tmp_path.iterdir()]
