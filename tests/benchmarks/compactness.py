"""How straight four-bars are in how little space: refined answers beside the classical linkages.

``python -m tests.benchmarks.compactness [DATABASE]`` writes ``data/reports/compactness.md`` and ``.svg``.
"""

from __future__ import annotations

import os

os.environ["OPENBLAS_NUM_THREADS"] = "1"  # as the command does

import contextlib
import io
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

import catalogue
from catalogue import Candidate, Catalogue, StraightLine
from catalogue.refine.certificate import certified
from catalogue.refine.sqp import Refinement

sys.path.insert(0, str(Path(__file__).parent))
from measuring import arguments, table, title

from tests.lambdas import LINE, TABLE, band, four_bars, lambdas, placed

REPORT = Path(__file__).parents[2] / "data" / "reports" / "compactness"
EXPLAINED = """\
Half the width of the narrowest strip over the stroke, in strokes, of the straightest four-bar whose pivots, in
mid-stroke, and whose path stand in a box of so long a diagonal.  Each box is tried in {} shapes and places along the
path with `find --rank-by deviation`; the band is measured on the finite motion.  Classical: the best of the symmetric
lambda linkages (both ratios free), of Roberts' symmetric linkages, and of Watt's with cranks that pass the centre.
"""


TURNING = """\
Lambda linkages whose crank turns so far over the stroke: full band over stroke in percent, with the proportions of the
textbooks, and refined from there with the symmetry held (frame and coupler in cranks), and free.  The gap says that
among all four-bars with as much rotation the symmetric ones are stationary; what is straighter turns its crank less.
"""


@dataclass(frozen=True)
class Classical:
    """The best of a classical kind in a box."""

    kind: str
    series: tuple[str, ...]
    compactness: float
    band: float


CLASSICAL = (
    Classical("lambda", ("III*.Kx",), 0.54, 4.5e-4),
    Classical("lambda", ("III*.Kx",), 0.38, 4.6e-5),
    Classical("lambda", ("III*.Kx",), 0.27, 5.5e-6),
    Classical("Roberts", ("I.GG",), 0.71, 5.5e-4),
    Classical("Roberts", ("I.GG",), 0.45, 6.3e-5),
    Classical("Watt", ("IV*.l",), 0.40, 9.3e-4),
)
#: Height over diagonal of the boxes; how much of the height, and of the width beyond the path, lies on one side.
HEIGHTS, BELOW, LEFT = (0.25, 0.45, 0.65, 0.8, 0.9), (0.0, 0.2, 0.5), (0.0, 0.5)


def boxes(diagonal: float) -> list[tuple[float, float, float, float]]:
    """Return boxes of a diagonal that hold the path from (0, 0) to (1, 0)."""
    found = []
    for part, below, left in product(HEIGHTS, BELOW, LEFT):
        height = part * diagonal
        width = np.sqrt(diagonal**2 - height**2)
        if width >= 1:
            x, y = -left * (width - 1), -below * height
            found.append((x, y, x + width, y + height))
    height = np.sqrt(diagonal**2 - 1)  # as high as can be, no wider than the path
    return [*found, *((0.0, -below * height, 1.0, (1 - below) * height) for below in BELOW)]


def compactness(c: Candidate) -> float:
    """Return stroke over diagonal of the box, along the path, that holds the pivots and the path."""
    z = np.array([[x, y] for dyad in c.pivots for x, y, _ in dyad] + [[0.0, 0.0], [c.stroke, 0.0]])
    return float(c.stroke / np.hypot(*np.ptp(z, axis=0)))


def straightest(cat: Catalogue, diagonal: float, series: tuple[str, ...]) -> Candidate | None:
    """Return the straightest four-bar in any of the boxes of a diagonal."""
    wish: dict[str, Any] = {"families": ["four-bar"], "rank_by": "deviation", "limit": 1, "per_series": 0}
    found = [
        c for box in boxes(diagonal) for c in cat.find(StraightLine(1, 0.02), pivots_in=box, series=series, **wish)
    ]
    return min(found, key=lambda c: c.deviation, default=None)


def turning() -> Iterator[list[str]]:
    """Refine lambda linkages of a given rotation of the crank."""
    for rotation, frame, _, _ in TABLE:
        held, free = lambdas(rotation), four_bars(rotation)
        start = placed(held, np.array([frame, 1.5 * frame - 0.5]))
        symmetric = Refinement.of(LINE, start, held).run(10).best
        found = Refinement.of(LINE, placed(free, free.read(start.linkage, start.point)), free).run(10).best
        q = held.read(symmetric.linkage, symmetric.point)[0]
        bands = [f"{100 * band(guide):.4g} %" for guide in (start, symmetric, found)]
        gap = certified(LINE, found, free).gap[0]
        yield [f"{rotation} deg", *bands[:2], f"{q[0]:.4f}, {q[1]:.4f}", bands[2], f"{100 * gap:.2f} %"]


def main() -> None:
    """Write the report."""
    parser = arguments()
    parser.add_argument("database", nargs="?")
    rows, points = [], []
    with catalogue.open(parser.parse_args().database) as cat:
        for classical in CLASSICAL:
            print(classical.kind, classical.compactness, file=sys.stderr)
            cells = [classical.kind, f"{classical.compactness:.2f}", f"{classical.band:.1e}"]
            best: Candidate | None = None
            for series in (classical.series, ()):
                found = straightest(cat, 1 / classical.compactness, series)
                best = min((c for c in (found, best) if c), key=lambda c: c.deviation)
                cells += [f"{best.deviation:.2e}", f"{compactness(best):.2f}"]
                points.append((compactness(best), best.deviation, bool(series)))
            assert best is not None
            rows.append([*cells, best.series])
    text = io.StringIO()
    with contextlib.redirect_stdout(text):
        title("Straightness against compactness")
        print(EXPLAINED.format(len(boxes(2.0))))
        head = ["kind", "stroke/diagonal", "band", "refined, that series", "at", "refined, any", "at", "of series"]
        table(head, rows)
        print(TURNING)
        table(["crank", "textbook", "symmetric", "frame, coupler", "free", "gap"], list(turning()))
        print("![straightness against compactness](compactness.svg)")
    REPORT.with_suffix(".md").write_text(text.getvalue())
    plot(points)


def plot(points: list[tuple[float, float, bool]]) -> None:
    """Draw half band over stroke against stroke over diagonal."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6, 4), layout="constrained")
    axes = figure.add_subplot()
    for kind in dict.fromkeys(c.kind for c in CLASSICAL):
        some = [c for c in CLASSICAL if c.kind == kind]
        axes.semilogy([c.compactness for c in some], [c.band for c in some], "o--", label=f"{kind}, classical", mfc="w")
    for own, label in ((True, "refined, same series"), (False, "refined, any four-bar")):
        axes.semilogy(*zip(*[(x, y) for x, y, o in points if o is own], strict=True), "x" if own else "+", label=label)
    axes.set_xlabel("stroke over diagonal of the box of pivots and path")
    axes.set_ylabel("half band over stroke")
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8)
    figure.savefig(REPORT.with_suffix(".svg"), metadata={"Date": None})


if __name__ == "__main__":
    main()
