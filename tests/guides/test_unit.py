"""The unit of an answer: part of it, of its record and of its request, and what converts it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import fields, replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import catalogue
from catalogue import Catalogue, CircularArc, InvalidRequest, StandStill, StraightLine
from catalogue.find import answers
from catalogue.guides import columns
from catalogue.guides.codes import code_of, record, text_of
from catalogue.guides.placed import PlacedGuide
from catalogue.units import MILLIMETRES, common, converted, factor, power
from tests.draw.samples import ARC, DWELL, MADE, OWN

STRETCH = catalogue.measure(
    catalogue.guide({"ground": 220, "crank": 100, "coupler": 250, "rocker": 250, "along": 125, "across": 80}),
    stroke=120.0, deviation=5.0, limit=1,
)[0]  # fmt: skip
EVERY: dict[str, Any] = {"arc": ARC, "line": MADE["slider-crank"], "own": OWN, "dwell": DWELL, "stretch": STRETCH}
every = pytest.mark.parametrize("one", EVERY.values(), ids=[*EVERY])
units = st.sampled_from([*MILLIMETRES])


def numbers(value: Any) -> Iterator[float]:
    """Yield the numbers of a field, of pivots without w, and none of those at infinity."""
    if isinstance(value, list) and len(value) == 3 and not isinstance(value[0], list):
        yield from value[:2] if value[2] else ()
    elif isinstance(value, list):
        for part in value:
            yield from numbers(part)
    elif isinstance(value, dict):
        yield from value.values()
    elif value is not None:
        yield value


@pytest.mark.slow
@every
@given(st.data())
def test_every_length_is_converted_there_and_back_and_nothing_else(one: PlacedGuide, data: st.DataObject) -> None:
    unit, other = data.draw(units), data.draw(units)
    here = one.in_unit(unit)
    there = here.in_unit(other)
    back = there.in_unit(unit)
    times = MILLIMETRES[unit] / MILLIMETRES[other]
    assert (here.unit, there.unit, type(there)) == (unit, other, type(one))
    names = [f.name for f in fields(one) if f.name in one.meanings] + ["lengths"]  # type: ignore[arg-type]
    for name in names:
        scale = times ** power(one.meanings[name].unit)
        values = [getattr(at, name) for at in (here, there, back)]
        if scale == 1 or values[0] is None or name == "unit":
            continue
        for old, new, again in zip(*map(numbers, values), strict=True):
            assert new == pytest.approx(scale * old, rel=1e-14, abs=1e-12 if name == "lengths" else 0.0)
            assert again == pytest.approx(old, rel=1e-15, abs=1e-12 if name == "lengths" else 0.0)
    for name in {*names} - {"unit", "lengths"}:
        if power(one.meanings[name].unit) == 0:
            assert getattr(there, name) == getattr(one, name)


def test_every_field_that_is_a_number_has_a_column_that_declares_its_unit() -> None:
    for one in EVERY.values():
        held = {f.name for f in fields(one) if not f.name.startswith("_")} - {"name"}
        assert held <= {*one.meanings}, held - {*one.meanings}


@pytest.mark.parametrize(
    ("declared", "found"),
    [("length", 1), ("length/rad", 1), ("length/rad^2", 1), ("1/length", -1), ("length^2", 2), ("deg/length", -1),
     ("rad/length^2", -2), ("deg", 0), ("%", 0), ("", 0), ("1", 0), ("length/length", 0)],
)  # fmt: skip
def test_power_of_a_length_is_that_of_its_declared_unit(declared: str, found: int) -> None:
    assert power(declared) == found


def test_compound_units_are_converted_by_their_declaration(monkeypatch: pytest.MonkeyPatch) -> None:
    """No column has one today: a field of a guide is declared to be one."""
    curved = {**ARC.meanings, "uniformity": columns.Column("curvature", "1/length", "of the arc")}
    monkeypatch.setattr(type(ARC), "meanings", curved)
    inch = replace(ARC, uniformity=254.0, unit="mm").in_unit("in")
    assert inch.uniformity == pytest.approx(254.0 * 25.4)
    moved, told = ARC.in_unit("mm").motion(5), ARC.in_unit("mm").motion(5).to_pandas("in")
    assert told["guided vx [in/rad]"].to_numpy() == pytest.approx(moved.velocities["guided"].real / 25.4)
    assert told["guided ax [in/rad^2]"].to_numpy() == pytest.approx(moved.accelerations["guided"].real / 25.4)
    assert told["coupler acceleration [1/rad]"].tolist() == moved.angular_accelerations["coupler"].tolist()


@given(st.floats(1e-300, 1e300), units, units)
def test_numbers_are_converted_to_the_nearest_double(value: float, one: str, other: str) -> None:
    there = converted(value, factor(one, other))
    assert there == pytest.approx(value * (MILLIMETRES[one] / MILLIMETRES[other]), rel=1e-15)
    assert converted(there, factor(other, one)) == pytest.approx(value, rel=5e-16)
    assert converted(14.0, factor("in", "mm")) == 355.6
    assert converted(355.6, factor("mm", "in")) == 14.0


def test_what_is_no_length_is_left_alone() -> None:
    assert converted([1.0, math.inf, None, 2], factor("in", "mm")) == [25.4, math.inf, None, 50.8]
    assert converted([0.6, 0.8, 0.0], factor("in", "mm")) == [0.6, 0.8, 0.0]
    with pytest.raises(InvalidRequest, match="too large"):
        converted(1e308, factor("in", "mm"))
    with pytest.raises(InvalidRequest, match="lengths in in, mm"):
        common(["in", "mm"])


@every
def test_a_record_says_the_unit_and_one_of_an_older_version_says_none(one: Any) -> None:
    inch = one.in_unit("in")
    held = record(inch)
    assert held["unit"] == "in"
    assert inch.code != one.code != inch.in_unit("mm").code
    older = record(one)
    assert "unit" not in older
    assert code_of(text_of(older)) == one.code
    if one in (OWN, STRETCH):
        assert answers.of_record(held).unit == "in"
        assert answers.of_record(older).unit is None
        with pytest.raises(InvalidRequest, match="no unit 'ell'"):
            answers.of_record({**held, "unit": "ell"})


@pytest.mark.slow
def test_an_answer_has_the_unit_of_its_request(small: Catalogue) -> None:
    asked: dict[str, Any] = {"refine": False, "limit": 1, "families": ["four-bar"]}
    (inch,) = small.find(StraightLine(14, 0.1, unit="in"), **asked)
    (plain,) = small.find(StraightLine(14, 0.1), **asked)
    assert (inch.unit, plain.unit) == ("in", None)
    assert replace(inch, unit=None) == plain
    assert inch.request.unit == "in"
    (metric,) = small.find(StraightLine(355.6, 2.54, unit="mm"), **asked)
    assert inch.in_unit("mm").pivots == [[pytest.approx(p, rel=1e-9) for p in dyad] for dyad in metric.pivots]
    arc = small.find(CircularArc.between((0, 0), (1, 0), 0.01, unit="ft"), refine=False, limit=1)
    assert arc.to_pandas()["unit"].tolist() == ["ft"]


@pytest.mark.slow
def test_dwells_have_the_crank_and_the_unit_that_are_asked_for(small: Catalogue) -> None:
    (one,), (inch,) = (small.find_dwells(StandStill(60, 1, 20, *more), limit=1) for more in ((), (2.0, "in")))
    assert (one.unit, inch.unit) == (None, "in")
    assert inch.size == pytest.approx(2 * one.size)
    assert inch.in_unit("mm").size == pytest.approx(50.8 * one.size)


def test_a_stored_guide_is_laid_in_a_unit(small: Catalogue) -> None:
    laid = small.guide("watt").at(14, unit="in")
    assert (laid.unit, laid.in_unit("mm").stroke) == ("in", 355.6)


def test_guides_of_several_units_are_measured_in_none() -> None:
    links = {"ground": 22, "crank": 10, "coupler": 25, "rocker": 25, "along": 12.5, "across": 8, "unit": "in"}
    inch = catalogue.guide(links)
    assert inch.unit == "in"
    assert inch.measure(stroke=12.0)[0].unit == "in"
    with pytest.raises(InvalidRequest, match="lengths in in, cm: convert them to one unit"):
        catalogue.measure([inch, inch.in_unit("cm")], stroke=12.0)
    with pytest.raises(InvalidRequest, match="lengths in in, mm"):
        catalogue.guide(links, unit="mm")
    for wrong in ("yd", 3, ["mm"]):
        with pytest.raises(InvalidRequest, match="no unit"):
            StraightLine(1, 0.01, unit=wrong)  # type: ignore[arg-type]  # wrong on purpose


@pytest.mark.slow
def test_a_linkage_is_improved_in_the_unit_of_the_request() -> None:
    links = {"ground": 22, "crank": 10, "coupler": 25, "rocker": 25, "along": 12.5, "across": 8}
    inch = catalogue.guide(links, unit="in")
    one = catalogue.improve(inch, StraightLine(12, 0.5), max_size=90)
    other = catalogue.improve(inch, StraightLine(304.8, 12.7, unit="mm"), max_size=90 * 25.4)
    assert ({c.unit for c in one}, {c.unit for c in other}) == ({"in"}, {"mm"})
    assert other.before.in_unit("in").deviation == pytest.approx(one.before.deviation, rel=1e-9)
    assert other.before.pivots[0][0][:2] == pytest.approx([25.4 * v for v in one.before.pivots[0][0][:2]], abs=1e-9)
