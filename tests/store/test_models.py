"""The tables refuse what cannot be."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from sqlalchemy import CheckConstraint, Connection
from sqlalchemy.exc import IntegrityError

from catalogue.store import PIVOTS, Base, Database

NONE = {f"fixed_{side}": None for side in ("x0", "y0", "x1", "y1")}
ARC = {"kind": "circle", "sweep": 0.1}
ROWS: dict[str, dict[str, Any]] = {
    "batch": {
        "id": 1,
        "series": "I.GG",
        "member": "plain",
        "plugin": "dwell",
        "plugin_version": "1.0",
        "plan": "7f",
        "seed": 0,
        "number": 0,
        "drawn": 8,
        "kept": 1,
        "guides": 1,
        "wanted": 1,
    },
    "mechanism": {
        "id": 1,
        "batch_id": 1,
        "family": "four-bar",
        "configuration": "++",
        "series": "I.GG",
        "member": "plain",
        "name": "Watt's",
        "parameters": "{}",
        **{column.key: float(place % 3 == 2) for place, column in enumerate(PIVOTS)},
        "rho0": 0.5,
        "kappa": -3.0,
        "kappa_star": -1.0,
        "s": 0.0,
    },
    "guide": {
        "id": 1,
        "mechanism_id": 1,
        "series": "I.GG",
        "kind": "line",
        "label": "[2]",
        "x": 1.0,
        "y": 2.0,
        "tangent_x": 0.6,
        "tangent_y": -0.8,
        "curvature": 0.0,
        "contact_order": 2,
        "inflections": 0,
        "cover": 0,
    },
    "reach": {
        "guide_id": 1,
        "level": -4,
        "kind": "line",
        "series": "I.GG",
        "cover": 0,
        "stroke": 1.0,
        "half": 0.5,
        "centre": 0.0,
        "deviation": 0.0,
        "sweep": 0.0,
        "size": 2.0,
        "max_link": 2.0,
        "min_link": 1.0,
        "max_ground": 0.0,
        "max_arm": 0.0,
        "min_transmission": 45.0,
        "rotates": 3,
        "fixed_x0": 0.0,
        "fixed_y0": 0.0,
        "fixed_x1": 1.0,
        "fixed_y1": 0.0,
        "all_x0": -1.0,
        "all_y0": 0.0,
        "all_x1": 1.0,
        "all_y1": 0.0,
        "drive_angle": None,
        "rotation": 20.0,
    },
    "specimens": {
        "id": 1,
        "collection": "swings",
        "family": "pendulum",
        "series": "simple",
        "configuration": "bar",
        "kind": "line",
        "block": 0,
        "place": 0,
        "deviation": 0.0,
        "parameters": "{}",
        "metrics": '{"size": 2.5}',
    },
    "setting": {"key": "seed", "value": "0"},
    "description": {"table_name": "more", "column_name": "", "type": "table", "unit": "", "meaning": "More."},
}

BROKEN: list[tuple[str, dict[str, Any]]] = [
    ("ck_batch_number", {"number": -1}),
    *(("ck_batch_counts", {name: -1}) for name in ("drawn", "kept", "guides")),
    ("ck_batch_counts", {"wanted": 0}),
    *(("ck_mechanism_parameters", {"parameters": text}) for text in ("", "{", "[]", "1")),
    *(("ck_mechanism_pivots", {name: 0.5}) for name in ("fixed_1_w", "moving_1_w", "fixed_2_w", "moving_2_w")),
    *(("ck_mechanism_rho0", {"rho0": value}) for value in (0.0, -0.5)),
    *(("ck_mechanism_curvature_whole", {name: None}) for name in ("kappa", "kappa_star", "s")),
    *(("ck_mechanism_curvature", {"s": 0.0, "kappa_star": value}) for value in (1.0, -1 + 1e-7)),
    ("ck_guide_kind", {"kind": "parabola", "curvature": 1.0}),
    *(("ck_guide_tangent", {"tangent_x": 0.6 + error}) for error in (1e-8, -1e-8)),
    ("ck_guide_curvature", {"curvature": 1e-300}),
    ("ck_guide_curvature", {"kind": "circle"}),
    ("ck_guide_contact_order", {"contact_order": 0}),
    ("ck_guide_inflections", {"inflections": -1}),
    ("ck_guide_cover", {"cover": -1}),
    *(("ck_reach_level", {"level": level}) for level in (0, -13)),
    *(("ck_reach_stroke", {"stroke": value}) for value in (0.0, -1.0)),
    *(("ck_reach_window", wrong) for wrong in ({"half": 0.0}, {"centre": 1.0}, {"centre": -1.5})),
    ("ck_reach_deviation", {"deviation": -1e-9}),
    *(("ck_reach_sweep", {"sweep": value}) for value in (1e-9, -1e-9)),
    ("ck_reach_size", {"size": 0.0}),
    ("ck_reach_max_link", {"max_link": 0.0}),
    ("ck_reach_min_link", {"min_link": 0.0}),
    ("ck_reach_max_ground", {"max_ground": -1.0}),
    ("ck_reach_max_arm", {"max_arm": -1.0}),
    *(("ck_reach_min_transmission", {"min_transmission": value}) for value in (-0.1, 90.1)),
    *(("ck_reach_rotates", {"rotates": value}) for value in (-1, 4)),
    *(("ck_reach_fixed_box", {name: None}) for name in NONE),
    *(("ck_reach_fixed_box", {**NONE, name: 0.0}) for name in NONE),
    *(("ck_reach_fixed_box", {name: 2.0}) for name in ("fixed_x0", "fixed_y0")),
    *(("ck_reach_all_box", {name: 2.0}) for name in ("all_x0", "all_y0")),
    ("ck_specimens_kind", {"kind": "parabola"}),
    ("ck_specimens_block", {"block": -1}),
    ("ck_specimens_place", {"place": -1}),
    ("ck_specimens_deviation", {"deviation": -1e-9}),
    *((f"ck_specimens_{name}", {name: text}) for name in ("parameters", "metrics") for text in ("", "{", "[]", "1")),
]

SOUND: list[tuple[str, dict[str, Any]]] = [
    *((table, {}) for table in ROWS),
    ("mechanism", {"batch_id": None, "name": None}),
    ("mechanism", {"parameters": '{"a": [1, null]}', "fixed_1_w": 0.0}),
    ("mechanism", {"rho0": None, "kappa": None, "kappa_star": None, "s": None}),
    ("mechanism", {"rho0": 1.0, "kappa": 1e9, "kappa_star": 1e9 + 1.5}),  # the tolerance is relative
    ("mechanism", {"rho0": None, "kappa": 1.0, "kappa_star": 5.0}),
    ("guide", {"kind": "circle", "curvature": -1e-300}),
    ("guide", {"tangent_x": 0.6 + 1e-10}),
    ("reach", {"level": -12}),
    ("reach", {"level": -1, "min_transmission": 90.0, "rotates": 0}),
    ("reach", {"max_link": None, "min_link": None, "max_ground": None}),
    ("reach", NONE),
    ("reach", {"min_transmission": 0.0, "all_x0": 1.0}),
]


@pytest.fixture
def connection(database: Database) -> Iterator[Connection]:
    """Return a connection in a transaction that comes to nothing."""
    with database.engine.connect() as opened:
        yield opened


def add(connection: Connection, table: str, **changes: Any) -> None:
    connection.execute(Base.metadata.tables[table].insert().values(ROWS[table] | changes))


def add_parents(connection: Connection, table: str) -> None:
    order = list(ROWS)
    for parent in order[: order.index(table)]:
        add(connection, parent)


@pytest.mark.parametrize(("table", "changes"), SOUND)
def test_sound_row_is_taken(connection: Connection, table: str, changes: dict[str, Any]) -> None:
    add_parents(connection, table)
    add(connection, table, **changes)


def test_circular_reach_is_taken(connection: Connection) -> None:
    add_parents(connection, "guide")
    add(connection, "guide", kind="circle", curvature=1.0)
    add(connection, "reach", **ARC)


@pytest.mark.slow
@pytest.mark.parametrize(("rule", "changes"), BROKEN)
def test_broken_rule_is_named(connection: Connection, rule: str, changes: dict[str, Any]) -> None:
    table = rule.split("_")[1]
    add_parents(connection, table)
    with pytest.raises(IntegrityError, match=f"CHECK constraint failed: {rule}\n"):
        add(connection, table, **changes)


def test_every_rule_is_broken_once() -> None:
    rules = {
        rule.name
        for table in Base.metadata.tables.values()
        for rule in table.constraints
        if isinstance(rule, CheckConstraint)
    }
    assert {rule for rule, _ in BROKEN} == rules


@pytest.mark.parametrize("table", ROWS)
def test_only_optional_columns_may_be_null(connection: Connection, table: str) -> None:
    add_parents(connection, table)
    for column in Base.metadata.tables[table].columns:
        if not column.nullable and column.name != "id":
            with pytest.raises(IntegrityError, match="NOT NULL"):
                add(connection, table, **{column.name: None})


def test_not_a_number_is_null(connection: Connection) -> None:
    add_parents(connection, "reach")
    with pytest.raises(IntegrityError, match=r"NOT NULL constraint failed: reach\.size"):
        add(connection, "reach", size=float("nan"))


@pytest.mark.parametrize(
    ("table", "changes"),
    [("reach", {"rotates": 0.5}), ("batch", {"seed": np.int64(1)})],
    ids=["fraction for an integer", "NumPy integer"],
)
def test_value_of_another_type_is_refused(connection: Connection, table: str, changes: dict[str, Any]) -> None:
    add_parents(connection, table)
    with pytest.raises(IntegrityError, match="cannot store"):
        add(connection, table, **changes)


@pytest.mark.parametrize("changes", [ARC, {"guide_id": 2}, {"series": "I.yy"}, {"cover": 1}])
def test_reach_belongs_to_a_guide_and_says_the_same_of_it(connection: Connection, changes: dict[str, Any]) -> None:
    add_parents(connection, "reach")
    with pytest.raises(IntegrityError, match="FOREIGN KEY"):
        add(connection, "reach", **changes)


@pytest.mark.parametrize(
    ("table", "changes"),
    [("batch", {"id": 2}), ("mechanism", {"id": 2}), ("reach", {"stroke": 2.0}), ("setting", {"value": "1"})],
)
def test_nothing_is_there_twice(connection: Connection, table: str, changes: dict[str, Any]) -> None:
    add_parents(connection, table)
    add(connection, table)
    with pytest.raises(IntegrityError, match="UNIQUE"):
        add(connection, table, **changes)


def test_batch_takes_along_what_came_of_it(connection: Connection) -> None:
    add_parents(connection, "setting")
    connection.exec_driver_sql("DELETE FROM batch")
    for table in ("batch", "mechanism", "guide", "reach"):
        assert connection.exec_driver_sql(f"SELECT count(*) FROM {table}").scalar_one() == 0
