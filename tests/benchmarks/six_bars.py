"""Compare the best six-bar with the best four-bar in the same envelope.

    python tests/benchmarks/six_bars.py [--db FILE] [--limit 4]

Each request is answered by four-bars and by six-bars of all families, refined; both keep its bounds on size and
transmission angle, and are ranked by deviation.  Specimens of the six-bars are drawn first where the database has none.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from measuring import arguments, table, title

import catalogue
from catalogue import CircularArc, StraightLine
from catalogue.problem.path import PathRequest

#: Stroke of all requests [mm], and the tolerance, which all that is ranked keeps.
STROKE, TOLERANCE = 100.0, 1.0
#: Requests: path, largest size [mm], least transmission angle [deg].
REQUESTS: list[tuple[str, PathRequest, float, float]] = [
    ("line, small", StraightLine(STROKE, TOLERANCE, unit="mm"), 250, 0),
    ("line, driven well", StraightLine(STROKE, TOLERANCE, unit="mm"), 400, 40),
    ("line", StraightLine(STROKE, TOLERANCE, unit="mm"), 400, 20),
    ("line, large", StraightLine(STROKE, TOLERANCE, unit="mm"), 800, 30),
    ("line, very small", StraightLine(STROKE, TOLERANCE, unit="mm"), 200, 20),
    ("arc of 300", CircularArc(STROKE, TOLERANCE, 300, unit="mm"), 400, 20),
    ("arc of 100", CircularArc(STROKE, TOLERANCE, 100, unit="mm"), 400, 20),
    ("arc of 100, small", CircularArc(STROKE, TOLERANCE, 100, unit="mm"), 250, 20),
    ("arc of 70, driven well", CircularArc(STROKE, TOLERANCE, 70, unit="mm"), 500, 40),
    ("any arc", CircularArc(STROKE, TOLERANCE, unit="mm"), 300, 30),
]


def told(found: Sequence[tuple[float, ...]]) -> list[str]:
    """Return deviation, size and transmission angle of the first answer."""
    return [f"{found[0][0]:.2g}", *(f"{value:.0f}" for value in found[0][1:])] if found else ["none", "", ""]


def main() -> None:
    """Search, compare, print."""
    parser = arguments()
    parser.add_argument("--db", type=Path, help="a database (default: as of any command)")
    parser.add_argument("--limit", type=int, default=4, help="number of six-bars asked for")
    given = parser.parse_args()
    title("Six-bars and four-bars in one envelope")
    rows, spent = list[list[str]](), [0.0, 0.0]
    with catalogue.open(given.db) as cat:
        for name, request, size, transmission in REQUESTS:
            bounds: dict[str, Any] = {"max_size": size, "min_transmission": transmission, "rank_by": "deviation"}
            begin = time.process_time()
            four = cat.find(request, families=["four-bar"], limit=1, **bounds)
            middle = time.process_time()
            six = cat.find_in("six-bars", request, limit=given.limit, refine=True, quiet=True, **bounds)
            spent = [spent[0] + middle - begin, spent[1] + time.process_time() - middle]
            best = [(one.deviation, one.size, one.min_transmission) for one in four]
            others = [(one.deviation, one.metrics["size"], one.metrics["min_transmission"]) for one in six]
            family = six[0].family if six else ""
            rows.append([name, f"{size:.0f}", f"{transmission:.0f}", *told(best), *told(others), family])
            print(rows[-1], flush=True)
    heads = ["request", "size ≤", "angle ≥", "four-bar", "size", "angle", "six-bar", "size", "angle", "family"]
    table(heads, rows)
    print(f"\nprocessor time: four-bars {spent[0]:.0f} s, six-bars {spent[1]:.0f} s")


if __name__ == "__main__":
    main()
