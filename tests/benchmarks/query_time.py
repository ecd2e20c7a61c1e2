"""Warm query time against the number of stored guides, cold process time, and import time.

``python tests/benchmarks/query_time.py FOLDER``: the databases are made in FOLDER, once.
"""

from __future__ import annotations

import os
import sqlite3
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path
from typing import Any

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # as the command does

import numpy as np
import pandas as pd
from measuring import seconds, table, title

import catalogue
from catalogue import CircularArc, StraightLine
from catalogue.query.constraints import Constraints
from catalogue.query.criteria import DISTINCT
from catalogue.query.find import answer
from catalogue.query.promise import loosest
from catalogue.query.ranking import Ranking
from catalogue.query.trail import Trail

RANKING = Ranking(per_series=4, distinct=DISTINCT)
LINE = StraightLine(stroke=150, deviation=0.05)
QUERIES: dict[str, tuple[Any, dict[str, Any]]] = {
    "line": (LINE, {}),
    "line, fixed pivots in a box, 30 degrees": (
        LINE,
        {"fixed_pivots_in": (-400, -400, 400, 400), "min_transmission": 30},
    ),
    "line, pins only, size below 450": (LINE, {"pins_only": True, "max_size": 450}),
    "arc": (CircularArc(stroke=100, radius=150, deviation=0.05), {}),
    "arc, fixed pivots in a box": (
        CircularArc(stroke=150, radius=400, deviation=0.1),
        {"fixed_pivots_in": (-400, -400, 400, 400)},
    ),
}
BOXES = tuple(f"{name}_{side}" for name in ("fixed", "all") for side in ("x0", "y0", "x1", "y1"))


def databases(folder: Path) -> dict[str, Path]:
    """Return files with about 1e4, 1e5 and 1e6 guides: two built ones, and every tenth mechanism of the smaller."""
    folder.mkdir(parents=True, exist_ok=True)
    files = {f"1e{k}": folder / f"1e{k}.db" for k in (4, 5, 6)}
    for name in ("1e5", "1e6"):
        if not files[name].exists():
            part = files[name].with_suffix(".part.db")
            print(f"building {name} guides", file=sys.stderr)
            with catalogue.open(part, build=False) as cat:
                cat.build(count=int(float(name)))
            part.rename(files[name])
    if not files["1e4"].exists():
        _tenth(files["1e5"], files["1e4"])
    return files


def _tenth(whole: Path, path: Path) -> None:
    part = path.with_suffix(".part")
    part.unlink(missing_ok=True)
    with closing(sqlite3.connect(whole)) as source, closing(sqlite3.connect(part)) as target:
        source.backup(target)
        target.execute("DELETE FROM reach WHERE guide_id IN (SELECT id FROM guide WHERE mechanism_id % 10 <> 0)")
        target.execute("DELETE FROM guide WHERE mechanism_id % 10 <> 0")
        target.execute("DELETE FROM mechanism WHERE id % 10 <> 0")
        target.commit()
        target.execute("ANALYZE")
        target.execute("VACUUM")
    part.rename(path)


def scanned(frame: pd.DataFrame, request: Any, wanted: dict[str, Any]) -> np.ndarray[Any, Any]:
    """Filter and rank all reaches in memory, as the SQL does; the 400 best."""
    s = request.stroke
    line = request.kind == "line"
    least: Any = (
        s / max(1.0, request.relative / 10.0 ** loosest(request)) ** (1 / 3)
        if line
        else (s * frame["sweep"].to_numpy() / request.sweep)
    )
    good = (frame["kind"].to_numpy() == request.kind) & (frame["level"].to_numpy() <= loosest(request))
    if not line:
        good &= frame["sweep"].to_numpy() >= request.sweep
    if wanted.get("pins_only"):
        good &= frame["family"].to_numpy() == "four-bar"
    if "max_size" in wanted:
        good &= frame["size"].to_numpy() * least <= wanted["max_size"]
    if "min_transmission" in wanted:
        good &= frame["min_transmission"].to_numpy() >= wanted["min_transmission"]
    if "fixed_pivots_in" in wanted:
        x0, y0, x1, y1 = (frame[f"fixed_{side}"].to_numpy() for side in ("x0", "y0", "x1", "y1"))
        a, b, c, d = wanted["fixed_pivots_in"]
        either = np.zeros(len(frame), bool)
        for left, right in ((x0 - 0.5, x1 - 0.5), (0.5 - x1, 0.5 - x0)):
            for low, high in ((y0, y1), (-y1, -y0)):
                inside = (left * least >= a - s / 2) & (right * least <= c - s / 2)
                either |= inside & (low * least >= b) & (high * least <= d)
        good &= either | np.isnan(x0)
    k = np.flatnonzero(good)
    cost = (
        frame["size"].to_numpy()[k] - frame["min_transmission"].to_numpy()[k] / 90
        if line
        else (
            frame["size"].to_numpy()[k] * frame["sweep"].to_numpy()[k] / request.sweep
            - frame["min_transmission"].to_numpy()[k] / 90
        )
    )
    best = np.argpartition(cost, min(400, len(k) - 1))[:400] if len(k) else np.zeros(0, int)
    return k[best[np.argsort(cost[best])]]


def warm(files: dict[str, Path]) -> None:
    """Time each query on each file, against reading and scanning the tables."""
    rows = []
    for name, path in files.items():
        columns = ", ".join(f"r.{c}" for c in ("kind", "level", "size", "sweep", "min_transmission", *BOXES[:4]))
        joins = "JOIN guide g ON g.id = r.guide_id JOIN mechanism m ON m.id = g.mechanism_id"
        query = f"SELECT {columns}, m.family FROM reach r {joins}"
        with closing(sqlite3.connect(path)) as connection:
            start = time.perf_counter()
            frame = pd.read_sql_query(query, connection)
            loading = time.perf_counter() - start
            guides = connection.execute("SELECT count(*) FROM guide").fetchone()[0]
        with catalogue.open(path, build=False) as cat:
            for label, (request, wanted) in QUERIES.items():
                refined = seconds(lambda r=request, w=wanted, c=cat: c.find(r, limit=20, **w), 9)
                stored = seconds(lambda r=request, w=wanted, c=cat: c.find(r, refine=False, **w), 15)
                trails = [Trail() for _ in range(15)]
                for trail in trails:
                    answer(cat.database, request, Constraints(**wanted), RANKING, limit=12, effort=1, trail=trail)
                sql = float(np.median([trail.seconds["narrow in the database"] for trail in trails]))
                scan = seconds(lambda r=request, w=wanted, f=frame: scanned(f, r, w), 5)
                times = [f"{1000 * f:.0f}" for f in (refined, stored, sql, scan, loading + scan)]
                rows.append((name, guides, label, trails[0].traced, *times))
        del frame
    print(
        "Warm, medians, in ms.  1e5 and 1e6 are built files, 1e4 is every tenth mechanism of 1e5.\n"
        "'refined' is `find` with 20 answers, 'stored' with 12 and without refinement, both verified; 'narrow' is the\n"
        "part of the latter in the database, 'traced' how many guides it traced.  'scan' filters and ranks the same\n"
        "columns in numpy once they are in memory and traces nothing, 'read and scan' reads them first.\n"
    )
    table(["file", "guides", "query", "traced", "refined", "stored", "narrow", "scan", "read and scan"], rows)


def cold(path: Path) -> None:
    """Time whole processes."""
    environment = {**os.environ, "CATALOGUE_DB": str(path)}
    python = [sys.executable, "-c"]
    ways = {
        "python -c pass": [*python, "pass"],
        "import numpy": [*python, "import numpy"],
        "import catalogue": [*python, "import catalogue"],
        "import catalogue; catalogue.open, StraightLine": [*python, "import catalogue as c; c.open, c.StraightLine"],
        "catalogue --version": [sys.executable, "-m", "catalogue", "--version"],
        "catalogue find straight-line (1e5 guides)": [
            sys.executable, "-m", "catalogue", "find", "straight-line", "--stroke", "150", "--deviation", "0.05",
        ],
        "the same with a box, 30 degrees, --format json": [
            sys.executable, "-m", "catalogue", "find", "straight-line", "--stroke", "150", "--deviation", "0.05",
            "--fixed-pivots-in", "-400", "-400", "400", "400", "--min-transmission", "30", "--format", "json",
        ],
    }  # fmt: skip
    rows = []
    for name, words in ways.items():
        run = seconds(lambda w=words: subprocess.run(w, env=environment, check=True, capture_output=True), 7)
        rows.append((name, f"{run:.2f}"))
    print("New processes, median of 7.\n")
    table(["process", "s"], rows)


if __name__ == "__main__":
    title("Query time")
    made = databases(Path(sys.argv[1]))
    cold(made["1e5"])
    warm(made)
