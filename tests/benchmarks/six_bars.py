"""Compare the best six-bar with the best four-bar in the same envelope, and refined dwells with dyads on stored arcs.

    python tests/benchmarks/six_bars.py [--db FILE] [--limit 4] [--dwells]

Each request is answered by four-bars and by six-bars of all families, refined; both keep its bounds on size and
transmission angle, and are ranked by deviation.  Specimens of the six-bars are drawn first where the database has none.
With --dwells, each dwell is answered by the best of all dyads on stored arcs, of any size and within the bound, and by
refinement of all pivots.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from measuring import arguments, table, title

import catalogue
from catalogue import Catalogue, CircularArc, StandStill, StraightLine
from catalogue.find import dwells
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
#: Dwells: rotation of the crank, range of the rocker's angle meanwhile, its swing [deg].
DWELLS = [
    *((90, 0.5, 30), (60, 0.5, 20), (120, 0.5, 30), (150, 1, 40), (60, 0.1, 40)),
    *((90, 0.2, 60), (180, 1, 30), (45, 0.2, 50), (200, 2, 40), (120, 0.2, 20)),
]
#: Largest sizes of dwells [cranks].
SIZES = (10, 5)


def told(found: Sequence[tuple[float, ...]]) -> list[str]:
    """Return deviation, size and transmission angle of the first answer."""
    return [f"{found[0][0]:.2g}", *(f"{value:.0f}" for value in found[0][1:])] if found else ["none", "", ""]


def compare_dwells(cat: Catalogue) -> None:
    """Compare refined dwells with dyads on stored arcs, print."""
    rows, refining = list[list[str]](), dwells.SEARCH
    spent = [0.0, 0.0]
    for dwell in DWELLS:
        row = [f"{dwell[0]:g} / {dwell[1]:g} / {dwell[2]:g}"]
        for refined, sizes in ((False, (1e6, *SIZES)), (True, SIZES)):
            dwells.SEARCH = refining if refined else refining._replace(first=0, rounds=0)
            begin = time.process_time()
            for size in sizes:
                found = cat.find_dwells(StandStill(*dwell), max_size=size)
                row += [f"{found[0].min_transmission:.1f}", f"{found[0].size:.1f}"] if found else ["none", ""]
            spent[refined] += (time.process_time() - begin) / len(sizes)
        rows.append(row)
        print(row, flush=True)
    kinds = ["dyad", *(f"dyad ≤ {size}" for size in SIZES), *(f"refined ≤ {size}" for size in SIZES)]
    table(["dwell / residual / swing", *(head for kind in kinds for head in (kind, "size"))], rows)
    print(
        f"\nprocessor time of a request: dyads {spent[0] / len(DWELLS):.1f} s, refined {spent[1] / len(DWELLS):.1f} s"
    )


def main() -> None:
    """Search, compare, print."""
    parser = arguments()
    parser.add_argument("--dwells", action="store_true", help="compare dwells")
    parser.add_argument("--db", type=Path, help="a database (default: as of any command)")
    parser.add_argument("--limit", type=int, default=4, help="number of six-bars asked for")
    given = parser.parse_args()
    title("Six-bars and four-bars in one envelope")
    rows, spent = list[list[str]](), [0.0, 0.0]
    with catalogue.open(given.db) as cat:
        if given.dwells:
            compare_dwells(cat)
            return
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
