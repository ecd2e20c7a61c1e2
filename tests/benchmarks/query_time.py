"""Query time: warm, in a new process, and where nothing is found, on the default file and on larger ones.

``python tests/benchmarks/query_time.py FOLDER [COUNT ...]``: the databases are made in FOLDER, once; each COUNT is a
larger file, built with so many guides, 300000 if none is given; 0 for the default file alone.
"""

from __future__ import annotations

import os
import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path
from typing import Any

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # as the command does

from measuring import arguments, seconds, table, title

import catalogue
from catalogue import Catalogue, CircularArc, StraightLine

LINE = StraightLine(stroke=150, deviation=0.05)
BOX = (-400, -400, 400, 400)
QUERIES: dict[str, tuple[Any, dict[str, Any]]] = {
    "line": (LINE, {}),
    "line, fixed pivots in a box, 30 degrees": (LINE, {"fixed_pivots_in": BOX, "min_transmission": 30}),
    "line, pins only, size below 450": (LINE, {"pins_only": True, "max_size": 450}),
    "line, a crank turns fully, 30 degrees over its turn": (LINE, {"min_transmission_turn": 30}),
    "line, straightest": (LINE, {"rank_by": "deviation"}),
    "arc": (CircularArc(stroke=100, radius=150, deviation=0.05), {}),
    "arc, fixed pivots in a box": (CircularArc(stroke=150, radius=400, deviation=0.1), {"fixed_pivots_in": BOX}),
}
#: Nothing meets these.
EMPTY: dict[str, tuple[Any, dict[str, Any]]] = {
    "line within 0.0005, pins only, 70 degrees, size below 170": (
        StraightLine(150, 0.0005),
        {"min_transmission": 70, "max_size": 170, "pins_only": True},
    ),
    "line, pivots in a box of 10 x 10, 40 degrees": (LINE, {"pivots_in": (60, 40, 70, 50), "min_transmission": 40}),
}
TIMES = 5


def databases(folder: Path, counts: list[int]) -> dict[str, Path]:
    """Return the default file and larger ones."""
    folder.mkdir(parents=True, exist_ok=True)
    files = {}
    for name, count in [("default", {}), *((f"{n:,}", {"count": n}) for n in counts if n)]:
        files[name] = folder / f"{name.replace(',', '')}.db"
        if not files[name].exists():
            print(f"building the file {name}", file=sys.stderr)
            part = files[name].with_suffix(".part.db")
            with catalogue.open(part, build=False) as cat:
                cat.build(**count)  # type: ignore[arg-type]  # one keyword or none
            part.rename(files[name])
    return files


def _guides(path: Path) -> int:
    with closing(sqlite3.connect(path)) as connection:
        return int(connection.execute("SELECT count(*) FROM guide").fetchone()[0])


def warm(files: dict[str, Path]) -> None:
    """Time each query on each file, refined and not."""
    rows = []
    for name, path in files.items():
        guides = _guides(path)
        with catalogue.open(path, build=False) as cat:
            for label, (request, wanted) in QUERIES.items():
                number = [0, 0]

                def run(refine: bool, request: Any = request, wanted: Any = wanted, cat: Catalogue = cat) -> None:
                    number[refine] = len(cat.find(request, refine=refine, **wanted))  # noqa: B023  # read at once

                refined, stored = (1000 * seconds(lambda r=r: run(r), TIMES) for r in (True, False))
                rows.append((name, guides, label, f"{refined:.0f}", number[1], f"{stored:.0f}", number[0]))
    print(
        f"Warm, medians of {TIMES}, in ms: the file is open and was asked before; 'found' answers, at most 12.\n"
        "'not refined' is `find(..., refine=False)`, which gives what is stored where it happens to meet all.\n"
    )
    table(["file", "guides", "query", "find", "found", "not refined", "found"], rows)


def empty(files: dict[str, Path]) -> None:
    """Time queries that nothing meets, and the advice that comes with their answer."""
    rows = []
    for name, path in files.items():
        with catalogue.open(path, build=False) as cat:
            for label, (request, wanted) in EMPTY.items():
                answer = cat.find(request, **wanted)
                alone = seconds(lambda r=request, w=wanted, c=cat: c.find(r, **w), 1)
                both = seconds(lambda r=request, w=wanted, c=cat: str(c.find(r, **w).explanation.advice()), 1)
                stored = seconds(lambda r=request, w=wanted, c=cat: c.find(r, refine=False, **w), 1)
                times = (f"{t:.1f}" for t in (alone, both, stored))
                rows.append((name, label, len(answer), *times))
    print("Warm, where nothing is found, in s: the empty answer, the same with what it advises, and not refined.\n")
    table(["file", "query", "found", "find", "with advice", "not refined"], rows)


def cold(path: Path) -> None:
    """Time whole processes."""
    environment = {**os.environ, "CATALOGUE_DB": str(path)}
    python = [sys.executable, "-c"]
    line = [sys.executable, "-m", "catalogue", "find", "straight-line", "--stroke", "150", "--deviation", "0.05"]
    ways = {
        "python -c pass": [*python, "pass"],
        "import numpy": [*python, "import numpy"],
        "import catalogue": [*python, "import catalogue"],
        "import catalogue; catalogue.open, StraightLine": [*python, "import catalogue as c; c.open, c.StraightLine"],
        "catalogue --version": [sys.executable, "-m", "catalogue", "--version"],
        "catalogue find straight-line": line,
        "the same, not refined": [*line, "--no-refine"],
        "the same with a box, 30 degrees, --format json": [
            *line, "--fixed-pivots-in", "-400", "-400", "400", "400", "--min-transmission", "30", "--format", "json",
        ],
    }  # fmt: skip
    rows = []
    for name, words in ways.items():
        run = seconds(lambda w=words: subprocess.run(w, env=environment, check=True, capture_output=True), TIMES)
        rows.append((name, f"{run:.2f}"))
    print(f"New processes on the default file, median of {TIMES}.\n")
    table(["process", "s"], rows)


if __name__ == "__main__":
    parser = arguments()
    parser.add_argument("folder", type=Path)
    parser.add_argument("counts", nargs="*", type=int, default=[300_000])
    given = parser.parse_args()
    title("Query time")
    made = databases(given.folder, given.counts)
    cold(made["default"])
    warm(made)
    empty(made)
