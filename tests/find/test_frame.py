"""The store as a data frame, against the tables as sqlite3 reads them."""

from __future__ import annotations

import json
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from catalogue import Catalogue, InvalidRequest

PARAMETER = "parameter_"


@pytest.fixture
def tables(small_db: Path) -> Iterator[sqlite3.Connection]:
    """Return the file of the tests as sqlite3 opens it."""
    connection = sqlite3.connect(f"{small_db.as_uri()}?mode=ro", uri=True)
    connection.row_factory = sqlite3.Row
    yield connection
    connection.close()


def by_key(tables: sqlite3.Connection, name: str, *key: str) -> dict[Any, dict[str, Any]]:
    return {tuple(row[k] for k in key): dict(row) for row in tables.execute(f"SELECT * FROM {name}")}


def same(found: Any, expected: Any) -> bool:
    """Return whether a cell is what is stored, None being no number."""
    return found is None or found != found if expected is None else bool(found == expected)


@pytest.mark.slow
def test_every_cell_is_what_is_stored(small: Catalogue, tables: sqlite3.Connection) -> None:
    guides, mechanisms = by_key(tables, "guide", "id"), by_key(tables, "mechanism", "id")
    frame = small.guides()
    assert [(number,) for number in frame["id"]] == sorted(guides)
    plain = [name for name in frame.columns if not name.startswith(PARAMETER)]
    for row in frame.to_dict("records"):
        guide = guides[(row["id"],)]
        stored = mechanisms[(guide["mechanism_id"],)] | guide
        assert all(same(row[name], stored[name]) for name in plain), row["id"]
        parameters = {name.removeprefix(PARAMETER): row[name] for name in frame.columns if name not in plain}
        assert {name: value for name, value in parameters.items() if value == value} == json.loads(stored["parameters"])


@pytest.mark.slow
def test_every_reach_stands_beside_its_guide(small: Catalogue, tables: sqlite3.Connection) -> None:
    stored, guides = by_key(tables, "reach", "guide_id", "level"), small.guides().set_index("id")
    frame = small.guides(reaches=True)
    assert len(frame) == len(stored)
    own = [name for name in frame.columns if name not in guides.columns and name != "id"]
    assert {"level", "stroke", "deviation", "size", "min_transmission", "fixed_x0", "rotation"} <= {*own}
    for row in frame.to_dict("records"):
        reach = stored[row["id"], row["level"]]
        assert all(same(row[name], reach[name]) for name in own), (row["id"], row["level"])
    np.testing.assert_array_equal(frame["fixed_1_x"], guides["fixed_1_x"].loc[frame["id"]])
    assert frame.groupby("id")["level"].is_monotonic_decreasing.all()


@pytest.mark.parametrize(
    ("wanted", "condition"),
    [
        ({"series": "II.xy"}, "mechanism.series = 'II.xy'"),
        ({"series": ["II.xy", "IV.l"], "kind": "line"}, "mechanism.series IN ('II.xy', 'IV.l') AND kind = 'line'"),
        ({"families": ["four-bar"], "kind": ["slot", "arc"]}, "family = 'four-bar' AND kind IN ('slot', 'arc')"),
        ({"pins_only": True, "order": 4}, "family = 'four-bar' AND contact_order >= 4"),
        ({"configurations": "PP"}, "configuration = 'PP'"),
        ({"kind": "return-line"}, "kind = 'return-line'"),
    ],
)
def test_only_what_is_asked_for(
    small: Catalogue, tables: sqlite3.Connection, wanted: dict[str, Any], condition: str
) -> None:
    join = "FROM guide JOIN mechanism ON mechanism.id = mechanism_id"
    numbers = [row[0] for row in tables.execute(f"SELECT guide.id {join} WHERE {condition} ORDER BY guide.id")]
    assert list(small.guides(**wanted)["id"]) == numbers
    counted = f"SELECT count(*) FROM reach WHERE guide_id IN (SELECT guide.id {join} WHERE {condition})"
    assert len(small.guides(**wanted, reaches=True)) == tables.execute(counted).fetchone()[0]


@pytest.mark.parametrize(
    ("wanted", "message"),
    [
        ({"series": "II.xz"}, r"^the database holds no series 'II\.xz'; .*; did you mean 'II\.xy'\?$"),
        ({"families": ["fourbar"]}, r"no family 'fourbar'; .*; did you mean 'four-bar'\?$"),
        ({"series": "V.qq9"}, r"no series 'V\.qq9'; it holds .* adds a series$"),
        ({"kind": "lines"}, r"^there is no kind 'lines'; there are line, .*; did you mean 'line'\?$"),
        ({"order": "four"}, r"^order must be a whole number"),
    ],
)
def test_names_that_are_not_there_are_refused(small: Catalogue, wanted: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidRequest, match=message):
        small.guides(**wanted)


@pytest.mark.slow
def test_a_find_loads_no_data_frames(small_db: Path) -> None:
    code = (
        "import sys, catalogue\n"
        f"with catalogue.open({str(small_db)!r}, build=False) as cat:\n"
        "    assert cat.find(catalogue.StraightLine(150, 0.5), limit=1)\n"
        "print(sorted({'pandas', 'catalogue.find.frame', 'catalogue.store.schema'} & {*sys.modules}))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120)
    assert done.stdout == "[]\n"


@pytest.mark.slow
def test_frames_of_few_guides_are_the_whole_frame(small: Catalogue) -> None:
    for reaches in (False, True):
        whole = small.guides(reaches=reaches, order=3)
        parts = list(small.guides(reaches=reaches, order=3, chunksize=300))
        assert len(parts) > 3
        assert all(part["id"].nunique() <= 300 for part in parts)
        assert all(list(part.columns) == list(whole.columns) for part in parts)
        joined = pd.concat([part.fillna({"name": ""}) for part in parts], ignore_index=True)
        pd.testing.assert_frame_equal(joined, whole.fillna({"name": ""}), check_dtype=False)
    (empty,) = small.guides(order=98, kind="arc", chunksize=10)
    assert list(empty.columns) == [name for name in small.guides().columns if not name.startswith("parameter_")]
    with pytest.raises(InvalidRequest, match="chunksize must be"):
        small.guides(chunksize=0)
