"""What is stored to spare tracing is what the measures of a guide's reaches say, and what a migration computes."""

from __future__ import annotations

import math
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import catalogue
from catalogue import Catalogue, CircularArc, StraightLine
from catalogue.guide.reach import LEVELS
from catalogue.store import Database

QUERY = "SELECT r.*, g.curvature FROM reach r JOIN guide g ON g.id = r.guide_id ORDER BY guide_id, level DESC"


def guides(path: Path) -> list[list[dict[str, Any]]]:
    """Return the reaches of each guide, the loosest first."""
    with closing(sqlite3.connect(path)) as connection:
        connection.row_factory = sqlite3.Row
        found: dict[int, list[dict[str, Any]]] = {}
        for row in connection.execute(QUERY):
            found.setdefault(row["guide_id"], []).append(dict(row))
    return list(found.values())


def own(reach: dict[str, Any]) -> float:
    return float(reach["size"] - reach["min_transmission"] / 90)


def test_a_line_promises_what_was_measured_farther(small: Catalogue) -> None:
    for reaches in guides(small.database.path)[::7]:
        for k, r in enumerate(reaches):
            if not r["sweep"]:
                if k:
                    assert r["farther"] == pytest.approx(own(reaches[k - 1]), rel=1e-12)
                assert r["floor"] == pytest.approx(min(own(r), r["halfway"], r["farther"]), rel=1e-12)


def test_an_arc_promises_what_the_next_tighter_one_is(small: Catalogue) -> None:
    for reaches in guides(small.database.path)[::7]:
        for k, r in enumerate(reaches):
            if not r["sweep"]:
                continue
            tighter = reaches[k + 1 :]
            if not tighter:
                assert r["inner_sweep"] == 0
            elif tighter[0]["sweep"] < r["sweep"]:
                w = r["inner_sweep"]
                assert w == tighter[0]["sweep"]
                assert r["still"] / w + r["grows"] == pytest.approx(tighter[0]["size"], rel=1e-9)
                turned = r["angle"] + r["turns"] * 2 * math.asin(w / 2)
                assert turned == pytest.approx(tighter[0]["min_transmission"], rel=1e-6, abs=1e-5)
            if r["inner_sweep"] < r["sweep"]:
                turned = r["angle"] + r["turns"] * 2 * math.asin(min(1.0, r["sweep"] / 2))
                assert turned == pytest.approx(r["min_transmission"], rel=1e-6, abs=1e-5)
                size = r["still"] / r["sweep"] + r["grows"]
                assert max(size, 1.0) == pytest.approx(r["size"], rel=1e-6)
                assert r["floor"] <= own(r) + 1e-12
            else:
                assert r["floor"] == math.inf


def test_an_upgraded_database_holds_the_same(
    small: Catalogue, tmp_path: Path, at_revision: Callable[[Path, str], Path]
) -> None:
    """A file of the first revision, filled with the same rows, is brought to what is built today."""
    old = at_revision(tmp_path / "old.db", "0001")
    with closing(sqlite3.connect(old)) as target, target:
        target.execute("ATTACH ? AS built", (str(small.database.path),))
        for table in ("batch", "mechanism", "guide", "reach"):
            names = [row[1] for row in target.execute(f"PRAGMA main.table_info({table})")]
            chosen = ["size - min_transmission / 90" if name == "balance" else name for name in names]
            target.execute(f"INSERT INTO main.{table} SELECT {', '.join(chosen)} FROM built.{table}")
    Database.open(old).close()
    columns = (
        "SELECT guide_id, level, sweep, inner_sweep, farther, still, grows, angle, turns FROM reach "
        "ORDER BY guide_id, level"
    )
    with closing(sqlite3.connect(old)) as one, closing(sqlite3.connect(small.database.path)) as other:
        upgraded, built = (np.array(c.execute(columns).fetchall(), dtype=float) for c in (one, other))
    np.testing.assert_array_equal(upgraded[:, :4], built[:, :4])
    arc, top = built[:, 2] > 0, built[:, 1] == max(LEVELS)
    np.testing.assert_allclose(upgraded[~arc & ~top, 4], built[~arc & ~top, 4], rtol=1e-12, atol=1e-13)
    held = arc & (built[:, 3] > 0) & (built[:, 3] < built[:, 2])
    np.testing.assert_allclose(upgraded[held, 5:7], built[held, 5:7], rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(upgraded[held, 7:], built[held, 7:], rtol=1e-7, atol=1e-6)
    # half-way a migration cannot measure: answers are a little worse
    request = StraightLine(100, 100 * 10**-3.5)
    with catalogue.open(old, build=False) as upgraded_:
        means = [
            np.mean([c.size / 100 - c.min_transmission / 90 for c in cat.find(request, refine=False)])
            for cat in (upgraded_, small)
        ]
    assert means[0] <= means[1] + 0.05


def test_arcs_of_an_older_revision_are_upgraded(
    small: Catalogue, tmp_path: Path, at_revision: Callable[[Path, str], Path]
) -> None:
    """Revision 0004 held size, in strokes of this reach, and transmission angle where the next tighter one begins."""
    old = at_revision(tmp_path / "old.db", "0004")
    short = "(CASE WHEN inner_sweep = 0 THEN 0.5 * sweep ELSE inner_sweep END)"
    made = {
        "inner_size": f"(still + grows * {short}) / sweep",
        "inner_transmission": f"min(max(angle + turns * 2 * asin_({short} / 2), 0.0), 90.0)",
        "floor": "min(floor, size - min_transmission / 90)",
    }
    with closing(sqlite3.connect(old)) as target, target:
        target.create_function("asin_", 1, lambda x: None if x is None else math.asin(min(x, 1.0)))
        target.execute("ATTACH ? AS built", (str(small.database.path),))
        for table in ("batch", "mechanism", "guide", "reach"):
            names = [row[1] for row in target.execute(f"PRAGMA main.table_info({table})")]
            chosen = [made.get(name, name) if table == "reach" else name for name in names]
            target.execute(f"INSERT INTO main.{table} SELECT {', '.join(chosen)} FROM built.{table}")
    Database.open(old).close()
    columns = (
        "SELECT sweep, inner_sweep, floor, halfway, farther, still, grows, angle, turns FROM reach "
        "ORDER BY guide_id, level"
    )
    with closing(sqlite3.connect(old)) as one, closing(sqlite3.connect(small.database.path)) as other:
        upgraded, built = (np.array(c.execute(columns).fetchall(), dtype=float) for c in (one, other))
    np.testing.assert_array_equal(upgraded[:, :2], built[:, :2])
    serves = ~(built[:, 1] == built[:, 0])
    np.testing.assert_array_equal(upgraded[:, 3:5], built[:, 3:5])
    np.testing.assert_array_equal(upgraded[serves, 2], built[serves, 2])
    assert np.isinf(upgraded[~serves, 2]).all()
    held = serves & (built[:, 1] > 0)
    np.testing.assert_allclose(upgraded[held, 5:7], built[held, 5:7], rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(upgraded[held, 7:], built[held, 7:], rtol=1e-7, atol=1e-6)
    request = CircularArc(100, 150, 0.05)
    with catalogue.open(old, build=False) as upgraded_:
        means = [
            np.mean([c.size / 100 - c.min_transmission / 90 for c in cat.find(request, refine=False)])
            for cat in (upgraded_, small)
        ]
    assert means[0] <= means[1] + 0.05
