"""A quantity is a row: its fields and keywords agree with it, and few modules name it."""

from __future__ import annotations

import re
from dataclasses import fields
from pathlib import Path

import pytest

import catalogue
from catalogue.guidance.drive import DriveMetrics
from catalogue.guidance.metrics import Measures
from catalogue.problem.criteria import CRITERIA
from catalogue.quantities import (
    BOUNDS,
    DRIVE_METRICS,
    MEASURES,
    QUANTITIES,
    RANKED,
    BoundArguments,
    Bounded,
    Further,
    Measured,
)

ROOT = Path(catalogue.__file__).parent
#: Modules of the core and of plugins that name a quantity or a bound in code: these may only fall.
#: A row, its value, its pieces, and the value of mechanisms of many bars make four.
MODULES = {
    "max_link": 4,
    "min_link": 4,
    "max_ground": 4,
    "min_ground": 3,
    "max_arm": 4,
    "max_travel": 1,
    "travel": 6,
    "min_transmission_turn": 5,
    "drive_angle": 6,
    "min_drive_angle": 2,
    "max_drive_angle": 1,
    "time_ratio": 2,
    "max_rotation": 3,
    "uniformity": 5,
    "min_uniformity": 1,
    "advantage": 6,
    "min_advantage": 1,
    "lift": 3,
    "min_lift": 5,
    "min_allowance": 8,
}


@pytest.mark.slow
@pytest.mark.parametrize("name", MODULES)
def test_no_more_modules_name_a_quantity(name: str) -> None:
    """As a text, an attribute or a field; prose and mechanisms in space do not count."""
    told = re.compile(rf"""["'.]{name}\b|^ +{name}:""", re.MULTILINE)
    paths = [*ROOT.rglob("*.py"), *(ROOT.parent / "plugins").rglob("*.py")]
    planar = [path for path in paths if "spatial" not in path.parts and "spatial_guidance" not in path.parts]
    named = [str(path) for path in planar if told.search(path.read_text(encoding="utf-8"))]
    assert len(named) == MODULES[name], named


def test_every_bound_is_a_field_and_a_keyword() -> None:
    assert {*Bounded.__annotations__} == {*BOUNDS, "full_rotation"}
    assert {*BoundArguments.__annotations__} == {*Bounded.__annotations__} - {"min_transmission"}


def test_every_quantity_is_measured_and_a_field() -> None:
    where = {MEASURES: Measures, DRIVE_METRICS: DriveMetrics}
    for row in QUANTITIES:
        if row.source in where:
            assert row.name in {field.name for field in fields(where[row.source])}
    derived = {"lift"}
    assert {row.name for row in QUANTITIES} - derived <= {*Measured.__annotations__, *Further.__annotations__}


def test_places_are_distinct() -> None:
    for places in (
        [row.legend for row in QUANTITIES],
        [row.sheet[0] for row in QUANTITIES if row.sheet[0]],
        [row.page for row in QUANTITIES if row.page],
    ):
        assert len({*places}) == len(places)


def test_every_criterion_but_joint_ones_has_a_row() -> None:
    assert {*CRITERIA} - {"score", "balance", "deviation"} == {row.criterion for row in RANKED if not row.scores_only}
