"""Tables of the motion: what is read back from CSV, a workbook and Parquet is the motion."""

from __future__ import annotations

import csv
import io
import sys
import zipfile
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

import catalogue
from catalogue.errors import InvalidRequest, MissingExtra

Six = dict[str, catalogue.Stretch]
SHEET = "{http://schemas.openxmlformats.org/spreadsheetml/2006/main}"


def workbook(data: bytes) -> list[list[Any]]:
    """Return the cells of the first sheet, row by row, from the XML."""
    with zipfile.ZipFile(io.BytesIO(data)) as file:
        shared = [
            "".join(t.text or "" for t in one.iter(f"{SHEET}t"))
            for one in ElementTree.fromstring(file.read("xl/sharedStrings.xml"))  # written here
        ]
        sheet = ElementTree.fromstring(file.read("xl/worksheets/sheet1.xml"))
    rows = []
    for row in sheet.iter(f"{SHEET}row"):
        cells = [(cell.get("t"), cell.findtext(f"{SHEET}v") or "") for cell in row]
        rows.append([shared[int(text)] if kind == "s" else float(text) for kind, text in cells])
    return rows


def test_csv_is_the_motion_over_the_stroke(six: Six) -> None:
    guide = six["four-bar"]
    rows = list(csv.DictReader(io.StringIO(str(guide.export(format="csv", unit="in", positions=7)))))
    moved = guide.motion(7)
    assert [float(row["guided x [in]"]) for row in rows] == moved.points["guided"].real.tolist()
    assert [float(row["deviation [in]"]) for row in rows] == moved.deviation.tolist()
    assert [float(row["drive [deg]"]) for row in rows] == moved.drive.tolist()
    assert all(heading.endswith("]") or heading == "reason" for heading in rows[0])


def test_the_circuit_is_chosen(six: Six) -> None:
    guide = six["four-bar"]
    rows = list(csv.reader(io.StringIO(str(guide.export(format="csv", over="circuit", columns=["crank 1"])))))
    turned = [float(row[0]) for row in rows[1:]]
    assert len(turned) == 73
    assert max(turned) - min(turned) == pytest.approx(360)


def test_columns_are_chosen_in_the_order_asked_for(six: Six) -> None:
    asked = ["transmission", "guided x [length]", "drive", "A1*"]
    head = str(six["slider-crank"].export(format="csv", columns=asked)).splitlines()[0]
    assert head == (
        "transmission [deg],guided x [length],drive [deg],A1* x [length],A1* y [length],A1* vx [length/rad],"
        "A1* vy [length/rad],A1* ax [length/rad^2],A1* ay [length/rad^2]"
    )
    with pytest.raises(InvalidRequest, match="no column 'transmision'; there are transmission"):
        six["slider-crank"].export(format="csv", columns=["transmision"])


def test_a_workbook_holds_every_number(six: Six, tmp_path: Path) -> None:
    pytest.importorskip("xlsxwriter", reason="comes with the extra `cad`, of which `test` is made")
    guide, file = six["oldham"], tmp_path / "motion.xlsx"
    made = guide.export(file, positions=5, columns=["guided", "deviation"])
    assert file.read_bytes() == made == guide.export(format="xlsx", positions=5, columns=["guided", "deviation"])
    heading, *rows = workbook(file.read_bytes())
    moved = guide.motion(5)
    assert heading[:2] + heading[-1:] == ["guided x [length]", "guided y [length]", "deviation [length]"]
    np.testing.assert_allclose([row[0] for row in rows], moved.points["guided"].real, rtol=1e-15)
    np.testing.assert_allclose([row[-1] for row in rows], moved.deviation, rtol=1e-15)


def test_the_heading_row_alone_stays_in_view(six: Six) -> None:
    pytest.importorskip("xlsxwriter", reason="comes with the extra `cad`, of which `test` is made")
    made = six["four-bar"].export(format="xlsx", positions=3)
    assert isinstance(made, bytes)
    with zipfile.ZipFile(io.BytesIO(made)) as file:
        sheet = ElementTree.fromstring(file.read("xl/worksheets/sheet1.xml"))
    (pane,) = sheet.iter(f"{SHEET}pane")
    assert {name: pane.get(name) for name in ("state", "xSplit", "ySplit")} == {
        "state": "frozen", "xSplit": None, "ySplit": "1"
    }  # fmt: skip


def test_parquet_holds_every_number(six: Six) -> None:
    parquet = pytest.importorskip("pyarrow.parquet", reason="comes with the extra `parquet`, of which `test` is made")
    guide = six["four-bar"]
    made = guide.export(format="parquet", positions=9)
    assert isinstance(made, bytes)
    table = parquet.read_table(io.BytesIO(made)).to_pydict()
    assert table["guided y [length]"] == guide.motion(9).points["guided"].imag.tolist()


@pytest.mark.parametrize(
    ("module", "format", "extra"), [("xlsxwriter", "xlsx", "cad"), ("pyarrow", "parquet", "parquet")]
)
def test_tables_need_their_extras(
    six: Six, monkeypatch: pytest.MonkeyPatch, module: str, format: str, extra: str
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(MissingExtra, match=rf'pip install "mechanism-catalogue\[{extra}\]"'):
        six["four-bar"].export(format=format)


def test_a_linkage_without_a_stroke_has_a_table_of_its_circuit() -> None:
    guide = catalogue.guide({"ground": 4, "crank": 1, "coupler": 3.5, "rocker": 3, "along": 2, "across": 1})
    rows = list(csv.DictReader(io.StringIO(str(guide.export(format="csv", positions=5)))))
    assert float(rows[-1]["drive [deg]"]) - float(rows[0]["drive [deg]"]) == pytest.approx(360)
    with pytest.raises(InvalidRequest, match="no stroke"):
        guide.export(format="csv", over="stroke")
