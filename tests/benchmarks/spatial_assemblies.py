"""Assemblies of random mechanisms: closed elimination beside an exhaustive search and random starts, in one run.

``python -m tests.benchmarks.spatial_assemblies [COUNT]`` writes ``data/reports/assemblies.md``.
"""

from __future__ import annotations

import os

os.environ["OPENBLAS_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = "1"

import contextlib
import io
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from tests.benchmarks.measuring import table, title, wanted_count
from tests.spatial import exhaustive
from tests.spatial.conftest import driven, random_mechanisms, solver

REPORT = Path(__file__).parents[2] / "data" / "reports" / "assemblies.md"
EXPLAINED = """\
{n} random mechanisms of each class, guides of all kinds, at their own driver values.  The exhaustive search drops boxes
of the charts that can hold no assembly, and shares no formula with the catalogue (`tests/spatial/exhaustive.py`).
Starts are made until each assembly was found five times and they are even in number.  Times are those of one processor.
"""
S = solver()


def timed(call: Callable[[], Any]) -> tuple[Any, float]:
    begun = time.process_time()
    found = call()
    return found, time.process_time() - begun


def rows(n: int) -> list[list[str]]:
    """Return a row per class and way."""
    out = []
    for name in ("III", "V"):
        m, start = random_mechanisms(S, name, n, seed=2026)
        q = driven(m, start)
        S.assemblies(m, q)
        eliminated, once = timed(partial(S.assemblies, m, q))
        sought, twice = timed(partial(S.assemblies, m, q, method="multi-start"))
        begun = time.process_time()
        every = np.array([exhaustive.count(m, q, i) for i in range(n)])
        thrice = time.process_time() - begun
        for way, count, seconds in (
            ("elimination", eliminated.count, once),
            ("multi-start", sought.count, twice),
            ("exhaustive search", every, thrice),
        ):
            most = f"{count.min()} to {count.max()}"
            off = str(int((count != every).sum()))
            out.append([f"{name}, {way}", str(count.sum()), most, off, f"{seconds:.2f}", f"{1e3 * seconds / n:.2f}"])
    return out


def main() -> None:
    """Write the table."""
    n = wanted_count(200)
    found = rows(n)
    text = io.StringIO()
    with contextlib.redirect_stdout(text):
        title("Assemblies of guided bodies")
        print(EXPLAINED.format(n=n))
        head = [
            "class and way",
            "assemblies",
            "of one mechanism",
            "mechanisms with another count",
            "s",
            "ms a mechanism",
        ]
        table(head, found)
    report = text.getvalue().replace("tests/benchmarks/spatial_assemblies.py", "-m tests.benchmarks.spatial_assemblies")
    REPORT.write_text(report, "utf-8")
    print(report)


if __name__ == "__main__":
    main()
