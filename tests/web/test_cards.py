"""Numbers and curves of a card: what it writes is what the guide has, and every curve lies in its drawing."""

from __future__ import annotations

import json
import re
import sys
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from catalogue.draw.curves import curves
from catalogue.draw.svg import ticks
from catalogue.draw.words import family as described_family
from catalogue.errors import MissingExtra
from catalogue.export import export
from catalogue.guides.candidate import Candidate
from catalogue.markup import NOTHING
from catalogue.web import guides
from catalogue.web.cards import Number, card, coordinate, figure, numbers
from catalogue.web.charts import CHART, charts
from catalogue.web.guides import best
from catalogue.web.own import measured
from tests.draw.samples import ARC, MADE

every = pytest.mark.parametrize("made", [*MADE.values(), ARC], ids=[*MADE, "arc"])


def test_lengths_to_build_by_have_four_digits_and_those_that_are_compared_three() -> None:
    shown = {number.label: number.text for number in numbers(ARC)}
    assert ARC.radius is not None
    for name, value, digits in (
        ("Size", ARC.size, 4), ("Radius", ARC.radius, 4), ("Deviation", ARC.deviation, 3)
    ):  # fmt: skip
        assert float(shown[name]) == pytest.approx(value, rel=0.5 * 10.0 ** (1 - digits))
        assert len(re.sub(r"^0\.0*|\.", "", shown[name])) <= digits
    assert "Radius" not in {number.label for number in numbers(MADE["four-bar"])}


@pytest.mark.parametrize(
    ("value", "size", "said"),
    [
        (1234567.8, 2e6, "1234568"),
        (12.3456789, 50, "12.34568"),
        (-0.5, 1, "−0.5"),
        (-1e-9, 1, "0"),
        (2e7, 3e7, "20000000"),
    ],
)
def test_coordinates_have_seven_digits_of_the_size(value: float, size: float, said: str) -> None:
    assert coordinate(value, size) == said


@every
def test_curves_run_from_edge_to_edge_of_their_drawing_as_the_values_do(made: Candidate) -> None:
    over, found = curves(made.in_unit("mm"))
    drive = over.values
    drawn = charts(made.in_unit("mm"))
    assert len(drawn) == len(found) > 0
    for curve, text in zip(found, drawn, strict=True):
        lines = [line.attrib["points"].split() for line in ET.fromstring(text).iter("polyline")]
        x, y = np.array([point.split(",") for line in lines for point in line], float).T
        assert (x >= CHART.left).all()
        assert (x <= CHART.width - CHART.right).all()
        assert (y >= CHART.top - 0.1).all()
        assert (y <= CHART.height - CHART.below + 0.1).all()
        if np.isfinite(curve.values).all() and not curve.zero:
            assert (x[0], x[-1]) == pytest.approx((CHART.left, CHART.width - CHART.right), abs=0.1)
            share = (x - CHART.left) / (CHART.width - CHART.left - CHART.right) * (drive[-1] - drive[0]) + drive[0]
            way = np.argsort(drive)
            there = np.interp(share, drive[way], curve.values[way])
            assert np.corrcoef(there, -y)[0, 1] > 0.99


@every
def test_ticks_of_a_curve_stand_where_their_value_is(made: Candidate) -> None:
    over, found = curves(made.in_unit("mm"))
    name, drive = over.of, over.values
    for curve, text in zip(found, charts(made.in_unit("mm")), strict=True):
        root = ET.fromstring(text)
        told = [(float(one.attrib["y"]), number(one.text)) for one in root.iter("text") if "dy" in one.attrib]
        assert 2 <= len(told) <= CHART.ticks + 2
        y, value = np.array(told).T
        slope, zero = np.polyfit(value, y, 1)
        assert np.abs(zero + slope * value - y).max() < 0.2
        lines = [line.attrib["points"].split() for line in root.iter("polyline")]
        drawn = np.array([point.split(",")[1] for line in lines for point in line], float)
        shown = (drawn - zero) / slope
        assert shown.min() == pytest.approx(np.nanmin(curve.values), abs=0.2 / abs(slope))
        angles = [float(str(one.text).rstrip("°")) for one in root.iter("text") if str(one.text).endswith("°")]
        assert angles[0] == 0
        assert max(angles) <= abs(drive[-1] - drive[0]) * (1 + 1e-9)
        assert name in "".join(root.itertext())


def number(text: str | None) -> float:
    """Read a number as the page writes it."""
    plain = str(text).translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹−", "-0123456789-"))
    return float(plain.replace(" × 10", "e"))


@given(st.floats(-1e6, 1e6), st.floats(1e-6, 1e6))
def test_ticks_are_round_and_within_their_range(low: float, extent: float) -> None:
    extent = max(extent, 1e-3 * abs(low))
    high = low + extent
    found = ticks(low, high, CHART.ticks)
    assert 2 <= len(found) <= CHART.ticks + 1
    step = found[1] - found[0]
    assert np.diff(found) == pytest.approx(step, rel=1e-6)
    assert low - 1e-6 * extent <= found[0] <= found[-1] <= high + 1e-6 * extent
    assert found[0] - low < step * (1 + 1e-6)
    assert high - found[-1] < step * (1 + 1e-6)


def test_lengths_of_an_own_linkage_have_five_digits_and_those_that_are_rounding_none() -> None:
    links = {"crank": 123.456789, "ground": 246.913578, "coupler": 308.641972, "along": 617.283945}
    own = measured(json.dumps(links | {"rocker": 308.641972, "across": 0}), "", "", "98.7654321", "mm", settled=True)
    shown = {number.label: number.text for number in own.numbers}
    names = {"Crank 1": "crank", "Frame": "ground", "Coupler": "coupler", "Point along": "along"}
    for value, text in ((98.7654321, shown["Stroke"]), *((links[k], shown[name]) for name, k in names.items())):
        assert float(text) == pytest.approx(value, rel=0.5e-4)
        assert len(text.replace(".", "")) == 5
    assert shown["Point across"] == "0"


def test_the_best_of_a_row_is_the_greatest_of_what_rises_and_the_least_of_the_rest() -> None:
    def row(label: str, *values: float | None) -> list[Number | None]:
        return [None if v is None else Number(label, figure(v), value=v) for v in values]

    assert best(row("Deviation", 0.2, None, 0.1, 0.10001)) == {2, 3}  # shown alike
    assert best(row("Transmission", 40, 60, 50)) == {1}
    assert best(row("Deviation", 0.1, 0.1)) == best(row("Deviation", 0.1, None)) == frozenset()
    assert best([Number("Stroke", "1"), Number("Stroke", "2")]) == frozenset()


def test_only_files_are_offered_that_can_be_made(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(guides, "find_spec", lambda name: None if name in ("build123d", "pyarrow") else object())
    assert {*guides.FILES} - {*guides.offered()} == {"step", "parquet"}
    monkeypatch.setattr(guides, "find_spec", lambda _: None)
    assert {*guides.offered()} == {"sheet", "svg", "json", "csv", "solidworks", "fusion", "freecad", "pylinkage"}


@pytest.mark.parametrize("kind", sorted(guides.NEEDED))
def test_a_file_is_refused_without_the_package_that_it_is_said_to_need(
    kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, guides.NEEDED[kind], None)
    with pytest.raises(MissingExtra):
        export(MADE["four-bar"], format=kind)


@every
def test_a_headline_is_the_name_of_a_mechanism(made: Candidate) -> None:
    shown = card(made, "abcdefg", NOTHING, "in words")
    assert shown.name.casefold() == described_family(made).casefold()
    assert shown.name[0].isupper()
    assert (shown.series, shown.kind) == (made.series, "in words")
