"""A guide keeps its unit to the last file: 14 in are 355.6 mm wherever they are read back, and 355.6 mm are 14 in."""

from __future__ import annotations

import csv
import io
import json
import math
import re
import sys
import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pytest

import catalogue
from catalogue.draw.moving_file import moving_file
from catalogue.units import ASSUMPTION, MILLIMETRES
from tests.export.test_table import workbook

#: Millimetres of what `$INSUNITS` of DXF means, by the standard.
INSUNITS = {1: 25.4, 2: 304.8, 4: 1.0, 5: 10.0, 6: 1000.0}
LINKS = {"ground": 22, "crank": 10, "coupler": 25, "rocker": 25, "along": 12.5, "across": 8}
SVG = "{http://www.w3.org/2000/svg}"


def measured(stroke: float, unit: str | None) -> catalogue.Stretch:
    """Return a stretch of this stroke."""
    links = {name: value * stroke / 14 for name, value in LINKS.items()}
    found: catalogue.Stretch = catalogue.measure(catalogue.guide(links, unit=unit), stroke=stroke, limit=1)[0]
    return found


@pytest.fixture(scope="module")
def inches() -> catalogue.Stretch:
    return measured(14.0, "in")


@pytest.fixture(scope="module")
def metric() -> catalogue.Stretch:
    return measured(355.6, "mm")


def chord(places: Any) -> float:
    """Return the distance of the first and the last of places (x, y)."""
    first, *_, last = places
    return math.dist(first[:2], last[:2])


def of_dxf(text: str, read_dxf: Callable[[str], Any]) -> float:
    """Return the stroke of a drawing [mm]."""
    drawing = read_dxf(text)
    (path,) = drawing.of("SPLINE", "PATH")
    places = [(float(x), float(y)) for x, y in zip(path.all(10), path.all(20), strict=True)]
    return chord(places) * INSUNITS[int(drawing.header["$INSUNITS"])]


def of_macro(text: str) -> float:
    """Return the stroke of the path of a FreeCAD macro, which reckons in millimetres [mm]."""
    plain: dict[str, Any] = {}
    exec(text[text.index("MILLIMETRES =") : text.index("def vector")], plain)  # its constants alone
    return chord(plain["PATH"]) * float(plain["MILLIMETRES"])


def of_motion(rows: list[list[Any]], unit: str) -> float:
    """Return the stroke of a table of the motion [unit]."""
    x, y = (rows[0].index(f"guided {name} [{unit}]") for name in "xy")
    return chord([(float(row[x]), float(row[y])) for row in rows[1:]])


def of_svg(text: str) -> float:
    """Return the stroke that a moving drawing shows, from its millimetres and its scale [mm]."""
    root = ET.fromstring(text)
    (path,) = [e for e in root.iter(f"{SVG}path") if e.attrib.get("class") == "path"]
    places = np.array(re.findall(r"-?[\d.]+", path.attrib["d"]), float).reshape(-1, 2)
    [(drawn, real)] = re.findall(r"scale ([\d.]+):([\d.]+)", "".join(root.itertext()))
    return chord(places) * float(real) / float(drawn)


@pytest.mark.slow
@pytest.mark.parametrize("unit", [None, *MILLIMETRES])
@pytest.mark.parametrize("given", ["inches", "metric"])
def test_fourteen_inches_are_as_many_millimetres_in_every_file(
    given: str, unit: str | None, request: pytest.FixtureRequest, read_dxf: Callable[[str], Any]
) -> None:
    guide: catalogue.Stretch = request.getfixturevalue(given)
    told = unit or guide.unit or ""
    ends = chord(guide.path()) * MILLIMETRES[str(guide.unit)]  # of the path, which is not quite straight [mm]
    assert ends == pytest.approx(355.6, rel=1e-3)
    long, near = 355.6 / MILLIMETRES[told], pytest.approx(ends, rel=1e-9)
    assert of_dxf(str(guide.export(format="dxf", unit=unit)), read_dxf) == near
    assert of_macro(str(guide.export(format="freecad", unit=unit))) == near
    rows = list(csv.reader(io.StringIO(str(guide.export(format="csv", unit=unit)))))
    assert MILLIMETRES[told] * of_motion(rows, told) == near
    book = guide.export(format="xlsx", unit=unit)
    assert isinstance(book, bytes)
    assert MILLIMETRES[told] * of_motion(workbook(book), told) == near
    record = json.loads(str(guide.export(format="json", unit=unit)))
    assert (record["unit"], record["measured"]["stroke"]) == (told, pytest.approx(long, rel=1e-12))
    crank = next(line for line in str(guide.export(format="solidworks", unit=unit)).splitlines() if "crank_1" in line)
    ((value, said),) = re.findall(r"= ([\d.]+)(\w+)", crank)
    assert said == told
    assert float(value) == pytest.approx(254 / MILLIMETRES[told], rel=1e-12)
    row = next(csv.DictReader(io.StringIO(str(guide.export(format="fusion", unit=unit)))))
    assert row["Unit"] == told
    assert float(row["Value"]) == pytest.approx(254 / MILLIMETRES[told], rel=1e-12)
    assert f"lengths in {told}" in str(guide.export(format="pylinkage", unit=unit))
    assert of_svg(moving_file(guide, unit=unit)) == pytest.approx(ends, rel=1e-3)  # two digits of a millimetre


@pytest.mark.slow
def test_a_sheet_tells_the_stroke_in_its_unit(inches: catalogue.Stretch, tmp_path: Path) -> None:
    from catalogue.draw.datasheet_html import sheet_html

    assert "stroke 14 in " in sheet_html(inches)
    page = sheet_html(inches, unit="mm")
    assert "stroke 355.6 mm " in page
    assert "x [mm]" in page
    assert inches.code in page
    inches.plot(tmp_path / "still.svg")
    assert "stroke 14 in" in (tmp_path / "still.svg").read_text("utf-8")
    inches.plot(tmp_path / "metric.svg", unit="mm")
    assert "stroke 355.6 mm" in (tmp_path / "metric.svg").read_text("utf-8")


def test_solids_are_built_in_millimetres(inches: catalogue.Stretch, monkeypatch: pytest.MonkeyPatch) -> None:
    """The numbers are looked at that the kernel is given: it is seldom there, and `test_step` reads what it writes."""
    cad = MagicMock()
    cad.export_step = lambda whole, file, timestamp: Path(file).write_text(timestamp, "utf-8")  # noqa: ARG005
    monkeypatch.setitem(sys.modules, "build123d", cad)
    inches.export(format="step", unit="cm")
    ((places,), _) = cad.Edge.make_spline.call_args
    assert chord([place[:2] for place in places]) == pytest.approx(25.4 * chord(inches.path()), rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("format", ["dxf", "freecad", "solidworks", "fusion"])
def test_a_file_that_must_have_a_unit_says_where_it_took_one(format: str, inches: catalogue.Stretch) -> None:
    unknown = replace(inches, unit=None)
    text = str(unknown.export(format=format))
    if format != "solidworks":  # which has no place for words
        assert ASSUMPTION in text
        assert ASSUMPTION not in str(unknown.export(format=format, unit="mm"))
    assert format == "dxf" or "mm" in text.replace(ASSUMPTION, "")
    assert ASSUMPTION in moving_file(unknown)
    assert "[length]" in str(unknown.export(format="csv"))


@pytest.mark.slow
def test_a_crane_of_twenty_metres_stays_one(read_dxf: Callable[[str], Any]) -> None:
    crane = measured(20.0, "m")
    for unit in (None, "mm", "ft"):
        assert of_dxf(str(crane.export(format="dxf", unit=unit)), read_dxf) == pytest.approx(20_000, rel=1e-3)
        assert of_macro(str(crane.export(format="freecad", unit=unit))) == pytest.approx(20_000, rel=1e-3)
        assert of_svg(moving_file(crane, unit=unit)) == pytest.approx(20_000, rel=1e-3)
