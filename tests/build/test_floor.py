"""What is stored to spare tracing is what the measures of a guide's reaches say, and what a migration computes."""

from __future__ import annotations

import math
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from alembic import command
from alembic.config import Config

from catalogue import Catalogue
from catalogue.folders import folder
from catalogue.store import Base, Database
from catalogue.store.connecting import connect, engine_for

QUERY = "SELECT r.*, g.curvature FROM reach r JOIN guide g ON g.id = r.guide_id ORDER BY guide_id, level DESC"


def guides(path: Path) -> list[list[dict[str, Any]]]:
    """Return the reaches of each guide, the loosest first."""
    with closing(sqlite3.connect(path)) as connection:
        connection.row_factory = sqlite3.Row
        found: dict[int, list[dict[str, Any]]] = {}
        for row in connection.execute(QUERY):
            found.setdefault(row["guide_id"], []).append(dict(row))
    return list(found.values())


def test_floor_and_spread_are_as_described(small: Catalogue) -> None:
    for reaches in guides(small.database.path)[::7]:
        for k, r in enumerate(reaches):
            angle = r["min_transmission"] / 90
            if r["sweep"]:
                tighter = [t for t in reaches[k + 1 :] if t["stroke"] < r["stroke"] * (1 - 1e-9)]
                least = r["size"] - max(angle, tighter[0]["min_transmission"] / 90 if tighter else 0.0)
            elif k:
                least = reaches[k - 1]["size"] - angle
                if reaches[k - 1]["deviation"] < 0.3 * 10.0 ** (r["level"] + 1):
                    least = min(least, max(1.0, r["size"] / 3) - 2 / 90)
            else:
                least = max(1.0, r["size"] / 10 ** (1 / 3)) - angle
            assert r["floor"] == pytest.approx(min(least, r["size"] - angle), rel=1e-12)
            half = 0.5 * r["sweep"]
            height = -math.copysign(half * (0.25 + 0.0625 * half**2), r["curvature"]) if half else 0.0
            x0, y0, x1, y1 = (r[f"all_{side}"] for side in ("x0", "y0", "x1", "y1"))
            spread = max(x1 - x0, y1 - y0, 0.5 - x0, x1 - 0.5, height - y0, y1 - height)
            assert r["spread"] == pytest.approx(spread, rel=1e-12)


def test_height_of_the_path_is_about_that_of_the_arc() -> None:
    sweep = np.linspace(0.01, 1.0, 20)
    half = 0.5 * sweep
    true = (1 - np.sqrt(1 - half**2)) / sweep
    np.testing.assert_allclose(half * (0.25 + 0.0625 * half**2), true, rtol=0.2 * half.max() ** 4)


def test_an_upgraded_database_holds_the_same(small: Catalogue, tmp_path: Path) -> None:
    """A file of the first revision, filled with the same rows, is brought to what is built today."""
    old = tmp_path / "old.db"
    connect(old, create=True).close()
    config = Config()
    config.set_main_option("script_location", str(folder("migrations")))
    engine = engine_for(old)
    with engine.connect() as opened, opened.begin():
        config.attributes.update(connection=opened, metadata=Base.metadata)
        command.upgrade(config, "0001")
    engine.dispose()
    with closing(sqlite3.connect(old)) as target, target:
        target.execute("ATTACH ? AS built", (str(small.database.path),))
        for table in ("batch", "mechanism", "guide", "reach"):
            names = [row[1] for row in target.execute(f"PRAGMA main.table_info({table})")]
            chosen = ["size - min_transmission / 90" if name == "balance" else name for name in names]
            target.execute(f"INSERT INTO main.{table} SELECT {', '.join(chosen)} FROM built.{table}")
    Database.open(old).close()
    columns = "SELECT guide_id, level, floor, spread FROM reach ORDER BY guide_id, level"
    with closing(sqlite3.connect(old)) as one, closing(sqlite3.connect(small.database.path)) as other:
        upgraded, built = (np.array(c.execute(columns).fetchall()) for c in (one, other))
    np.testing.assert_allclose(upgraded, built, rtol=1e-12, atol=1e-13)
