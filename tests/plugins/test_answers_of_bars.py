"""Answers of collections of many bars: measured, moved, exported and drawn as mechanisms of one's own are."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from catalogue import InvalidRequest, StraightLine, mechanism
from catalogue.collections.results import CollectionCandidate
from catalogue.find.answers import recall
from catalogue.find.specimens import _candidate, in_unit, measured
from catalogue.guides.chain_stretch import ChainStretch
from catalogue.guides.codes import remember
from catalogue.plugin.registry import Registry
from catalogue.problem.path import CircularArc, PathRequest

REGISTRY = Registry()
#: A family of each collection: pins, a slide, gears, bars kept parallel.
FAMILIES = [
    (name, family)
    for name in ("six-bars", "exact-cells", "translating-platforms", "geared-five-bars")
    for family in REGISTRY.collection(name).families
]
every = pytest.mark.parametrize(("name", "family"), FAMILIES, ids=[family for _, family in FAMILIES])


@cache
def answer(name: str, family: str, circle: bool = False) -> CollectionCandidate:
    """Return an answer over a stroke of 200 mm that starts in (20, 15) and runs to the upper left."""
    collection = REGISTRY.collection(name)
    request: PathRequest = CircularArc(200, 10, unit="mm") if circle else StraightLine(200, 10, unit="mm")
    drawn = collection.draw(family, np.random.default_rng(2), 20)
    some = [one.parameters for one in drawn if one.kind == request.kind]
    best = min(measured(collection, some, request), key=lambda one: one.metrics["size"])
    return replace(_candidate(collection, 7, 200.0, best, "mm"), start=(20.0, 15.0), along=120.0)


@pytest.mark.slow
@every
def test_an_answer_is_a_stretch_where_its_path_was_asked_for(name: str, family: str) -> None:
    one = answer(name, family)
    made: Any = mechanism(one)
    assert isinstance(made, ChainStretch)
    z = made.motion(501).points[made.point]
    way = np.exp(1j * math.radians(120))
    along, off = ((z - 20 - 15j) / way).real, ((z - 20 - 15j) / way).imag
    assert along[0] == pytest.approx(0, abs=1e-6)
    assert along[-1] == pytest.approx(200, abs=1e-3)
    assert np.abs(off - 0.5 * (off.max() + off.min())).max() == pytest.approx(one.deviation, rel=1e-3, abs=1e-9)
    assert made.size == pytest.approx(one.metrics["size"], rel=1e-3)
    assert made.min_transmission == pytest.approx(one.metrics["min_transmission"], abs=0.1)
    assert made.deviation_again() == pytest.approx(one.deviation, rel=1e-3, abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "family"), FAMILIES[::3])
def test_an_answer_is_exported_and_has_a_sheet(name: str, family: str, tmp_path: Path) -> None:
    made: Any = mechanism(answer(name, family))
    record = json.loads(made.export(format="json"))
    again = mechanism(record)
    assert again.unit == "mm"
    assert again.lengths == pytest.approx(made.lengths)
    made.sheet(tmp_path / "a.html")
    made.export(tmp_path / "a.svg")
    made.export(tmp_path / "a.dxf")


@pytest.mark.slow
def test_an_arc_bulges_to_the_left_of_its_way() -> None:
    one = answer("six-bars", "watt-2", circle=True)
    made: Any = mechanism(one)
    z = (made.motion(101).points[made.point] - 20 - 15j) / np.exp(1j * math.radians(120))
    assert z[50].imag == pytest.approx(one.radius - math.sqrt(one.radius**2 - 100**2), rel=0.1)  # type: ignore[operator]
    assert np.abs(made.deviations(made.motion(501).points[made.point])).max() == pytest.approx(one.deviation, rel=1e-2)


@pytest.mark.slow
def test_an_answer_is_recalled_and_converted_where_it_stands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CATALOGUE_ANSWERS", str(tmp_path / "answers.db"))
    one = answer("six-bars", "watt-1")
    (code,) = remember([one])
    again = recall(code, REGISTRY.collection)
    assert (again.start, again.along) == ((20.0, 15.0), 120.0)
    inch = in_unit(again, "in")
    assert inch.start == pytest.approx((20 / 25.4, 15 / 25.4))
    made: Any = mechanism(inch)
    assert abs(made.motion(3).points["P"][0] - (20 + 15j) / 25.4) <= 1.01 * inch.deviation
    here = replace(one, start=(0.0, 0.0), along=0.0)
    assert "start" not in here.to_dict()  # codes of answers without a place stay


def test_an_answer_in_space_is_refused_by_name() -> None:
    collection = REGISTRY.collection("spatial-guidance")
    assert collection.mechanism is None
    one = replace(answer("six-bars", "watt-1"), collection=collection)
    with pytest.raises(InvalidRequest, match="an answer of spatial-guidance is no planar mechanism of many bars"):
        mechanism(one)
