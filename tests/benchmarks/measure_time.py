"""Time to measure linkages of one's own, beside all windows of a path sampled densely.

``python tests/benchmarks/measure_time.py [--write]``: four-bars with random pivots of size about 1 and a coupler point
each; over a stroke of 0.5, within a deviation of 0.005.  One linkage at a time: the median and the longest of 40, each
the best of some runs, 4 stretches of each.  The alternative closes the chain by circles, reads each path
in 300 points and looks at the narrowest strip of every window, of the best again in 1500; it is asked for one linkage.
A CSV of them is read, measured with the nearest series of each, and written as CSV, by the command in a new process.
`--write`: the report goes to ``data/reports/measure_time.md`` too.
"""

from __future__ import annotations

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # as the command does

import contextlib
import csv
import io
import resource
import runpy
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from measuring import arguments, table, title

from catalogue.find.measure import measure
from catalogue.guides.own_guide import OwnGuide, guide
from catalogue.kinematics.linkage import Linkage
from catalogue.plugin.registry import Registry

COUNT, SINGLE, STROKE, DEVIATION, RUNS = 1000, 40, 0.5, 0.005, 3
NAIVE: dict[str, Any] = runpy.run_path(str(Path(__file__).parents[1] / "naive.py"))
REPORT = Path(__file__).parents[2] / "data" / "reports" / "measure_time.md"


def guides(count: int) -> list[OwnGuide]:
    """Return four-bars that differ, each with a coupler point."""
    draw = np.random.default_rng(12)
    pivots = np.ones((count, 2, 2, 3))
    pivots[..., :2] = draw.normal(size=(count, 2, 2, 2))
    points = pivots[:, :, 1, :2].mean(1) + 0.7 * draw.normal(size=(count, 2))
    return [guide(Linkage(one), tuple(at)) for one, at in zip(pivots, points, strict=True)]


def taken(run: Callable[[], Any], times: int) -> tuple[float, float]:
    """Return the least wall and processor time of several runs, after one that is not counted."""
    run()
    found = []
    for _ in range(times):
        wall, cpu = time.perf_counter(), processor_time()
        run()
        found.append((time.perf_counter() - wall, processor_time() - cpu))
    return min(w for w, _ in found), min(c for _, c in found)


def processor_time() -> float:
    """Return the processor time of this process and of those it has run [s]."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


def command(every: list[OwnGuide], folder: str) -> list[str]:
    """Write linkages to a CSV, and return the command that measures them."""
    path = Path(folder) / "linkages.csv"
    with path.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file).writerows([*np.array(one.pivots)[..., :2].ravel(), *one.guided] for one in every)
    program = [sys.executable, "-c", "from catalogue.cli import main; main()"]
    return [*program, "measure", str(path), "--stroke", str(STROKE), "--format", "csv"]


def naive_stroke(one: OwnGuide) -> float:
    """Return the longest stroke within the deviation, from all windows of a path sampled densely."""
    ways = NAIVE["ways_round"](np.array(one.pivots), complex(*one.guided))
    return max(float(NAIVE["longest_stretch"](way, closed, DEVIATION)) for way, closed in ways)


def main() -> None:
    """Print the report."""
    title("Time to measure linkages of one's own")
    every = guides(COUNT)
    one = every[0]
    series = Registry().series
    folder = tempfile.TemporaryDirectory()
    shell = command(every, folder.name)
    jobs: list[tuple[str, int, Callable[[], Any], int]] = [
        ("one, within a deviation, all windows of samples", 1, lambda: naive_stroke(one), 1),
        ("over a stroke, the best of each", COUNT, lambda: measure(every, stroke=STROKE, limit=1), 2),
        ("the same, with the nearest series", COUNT,
         lambda: measure(every, stroke=STROKE, limit=1, series=lambda: series), 2),
        ("the same, from CSV to CSV, a new process", COUNT,
         lambda: subprocess.run(shell, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=True), 2),
        ("within a deviation, the best of each", COUNT, lambda: measure(every, deviation=DEVIATION, limit=1), 2),
    ]  # fmt: skip
    rows = []
    single: list[tuple[str, Callable[..., Any]]] = [
        ("over a stroke", partial(measure, stroke=STROKE)),
        ("within a deviation", partial(measure, deviation=DEVIATION)),
    ]
    for name, ask in single:
        found = np.array([taken(partial(ask, g), RUNS) for g in every[:SINGLE]])
        for which, (wall, cpu) in (("median", np.median(found, axis=0)), ("longest", found.max(0))):
            rows.append((f"one, {name}, {which} of {SINGLE}", 1, f"{wall:.3f}", f"{cpu:.3f}", f"{1000 * cpu:.2f}"))
    with folder:
        for name, count, run, times in jobs:
            wall, cpu = taken(run, times)
            rows.append((name, count, f"{wall:.3f}", f"{cpu:.3f}", f"{1000 * cpu / count:.2f}"))
    table(["what", "linkages", "s", "s of the processor", "ms per linkage"], rows)
    best = max(row.stroke for row in measure(one, deviation=DEVIATION))
    print(f"Longest stroke of the one linkage: {best:.5f}, from samples {naive_stroke(one):.5f}.")


if __name__ == "__main__":
    parser = arguments()
    parser.add_argument("--write", action="store_true")
    if parser.parse_args().write:
        text = io.StringIO()
        with contextlib.redirect_stdout(text):
            main()
        REPORT.write_text(text.getvalue(), encoding="utf-8")
        print(text.getvalue(), end="")
    else:
        main()
