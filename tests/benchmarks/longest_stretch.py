"""The longest stretches of random linkages within a deviation, beside all windows of their paths sampled densely.

``python tests/benchmarks/longest_stretch.py [--count 20] [--write]``: of each family `count` random linkages of size
about 1, a random coupler point each, within 0.003.  The alternative closes the chain by circles, reads each path in 300
points and looks at the narrowest strip of every window, of the best three again in 1500 (`tests/naive.py`).  `--write`:
the report goes to ``data/reports/longest_stretch.md`` too.
"""

from __future__ import annotations

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # as the command does

import contextlib
import io
import runpy
import time
from pathlib import Path
from typing import Any

import numpy as np
from measuring import arguments, table, title
from numba import njit

from catalogue.guidance.stretches import longest
from catalogue.kinematics.circuits import circuits
from catalogue.kinematics.linkage import FAMILIES, PR, RR, Linkage
from catalogue.kinematics.types import Complexes, Floats

ALLOWED, SEED = 0.003, 2023
EXPLAINED = f"""\
Of each family random linkages of size about 1, a random coupler point each, within {ALLOWED}.  The alternative closes
the chain by circles, reads each path in 300 points and looks at the narrowest strip of every window, of the best three
again in 1500; numba compiles its loops.  `least share`: the stroke over that of the alternative; times are those of the
processor, per linkage.
"""
REPORT = Path(__file__).parents[2] / "data" / "reports" / "longest_stretch.md"
NAIVE: dict[str, Any] = runpy.run_path(str(Path(__file__).parents[1] / "naive.py"))
COMPILED = ("dot", "_width", "straightness", "_windows")


def drawn(family: str, count: int) -> tuple[Linkage, Complexes]:
    """Return random linkages of a family, and a coupler point of each."""
    draw = np.random.default_rng(SEED)
    pivots = np.ones((8 * count, 2, 2, 3))
    pivots[..., :2] = draw.normal(size=(8 * count, 2, 2, 2))
    for i, kind in enumerate(FAMILIES[family]):
        if kind != RR:
            pivots[:, i, 0 if kind == PR else 1, 2] = 0
    linkage = Linkage.valid(pivots)[0][:count]
    return linkage, np.asarray(draw.normal(size=count) + 1j * draw.normal(size=count))


def compile_alternative() -> None:
    """Have numba compile the loops over windows, of which each linkage has some thousand."""
    there = NAIVE["longest_stretch"].__globals__
    there |= {name: njit(there[name]) for name in COMPILED}


def exhaustive(linkage: Linkage, point: Complexes) -> Floats:
    """Return the longest strokes (n,) by the alternative, 0 where there is none."""
    every = [NAIVE["ways_round"](pivots, complex(z)) for pivots, z in zip(linkage.pivots, point, strict=True)]
    return np.array([max((NAIVE["longest_stretch"](*way, ALLOWED) for way in ways), default=0.0) for ways in every])


def ours(linkage: Linkage, point: Complexes) -> Floats:
    """Return the longest strokes (n,), 0 where there is none."""
    found = circuits(linkage)
    at = longest(found, point[found.of], np.full(len(found), ALLOWED), circle=False)
    stroke = np.zeros(len(linkage))
    np.maximum.at(stroke, found.of[at.circuit], at.stroke)
    return stroke


def compared(family: str, count: int) -> list[str]:
    """Return the row of a family."""
    linkage, point = drawn(family, count)
    start = time.process_time()
    mine = ours(linkage, point)
    between = time.process_time()
    other = exhaustive(linkage, point)
    end = time.process_time()
    some = other > 0
    share = mine[some] / other[some]
    return [family, str(len(linkage)), f"{share.min():.5f}", str(int((share < 0.999).sum())),
            str(int((share > 1.001).sum())), f"{1000 * (between - start) / count:.0f}",
            f"{1000 * (end - between) / count:.0f}"]  # fmt: skip


def main(count: int) -> None:
    """Print the report."""
    title("The longest stretch within a deviation, beside all windows")
    print(EXPLAINED)
    compile_alternative()
    rows = [compared(family, count) for family in FAMILIES]
    head = [
        "family",
        "linkages",
        "least share",
        "shorter by 0.1 %",
        "longer by 0.1 %",
        "ms of ours",
        "ms of all windows",
    ]
    table(head, rows)


if __name__ == "__main__":
    parser = arguments()
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    text = io.StringIO()
    with contextlib.redirect_stdout(text):
        main(options.count)
    if options.write:
        REPORT.write_text(text.getvalue(), encoding="utf-8")
    print(text.getvalue(), end="")
