"""Ten practical requests: what the first ten answers are like, and what an earlier search gave.

    python tests/benchmarks/practical.py DB                      # writes data/reports/practical.md and .svg
    python tests/benchmarks/practical.py DB --record FILE        # what is found, as JSON

`practical_before.json` was recorded so with revision 18e2582, which filtered stored guides by all constraints, refined
what already met them, made their deviation small, and ranked by size and transmission angle alone.
"""

from __future__ import annotations

import contextlib
import io
import json
from pathlib import Path
from statistics import median
from typing import Any

from measuring import arguments, table, title

import catalogue
from catalogue import CircularArc, StraightLine

HERE = Path(__file__).parent
REPORT = HERE.parents[1] / "data" / "reports" / "practical"
INF = float("inf")
REQUESTS: dict[str, tuple[Any, dict[str, Any]]] = {
    "anything straight": (StraightLine(150, 0.05), {}),
    "pins, 40 degrees": (StraightLine(150, 0.05), {"pins_only": True, "min_transmission": 40}),
    "in a box": (
        StraightLine(150, 0.05),
        {"pins_only": True, "min_transmission": 40, "fixed_pivots_in": (-300, -50, 300, 200)},
    ),
    "crane jib": (
        StraightLine(12, 0.06),
        {"pins_only": True, "min_transmission": 25, "fixed_pivots_in": (-20, -25, 0, -4), "max_link": 30},
    ),
    "axle guide": (StraightLine(120, 0.3), {"pins_only": True, "max_size": 400, "min_transmission": 45}),
    "leg": (StraightLine(200, 2), {"pins_only": True, "full_rotation": True, "max_size": 700}),
    "press": (StraightLine(80, 0.2), {"full_rotation": True, "min_drive_angle": 100, "max_link": 300}),
    "recorder": (StraightLine(20, 0.01), {"pins_only": True, "max_size": 60}),
    "hinged door": (
        CircularArc(stroke=300, radius=500, deviation=0.2),
        {"pins_only": True, "min_transmission": 40, "max_size": 900},
    ),
    "any arc": (CircularArc(stroke=100, radius=None, deviation=0.05), {"max_size": 200, "min_transmission": 40}),
}
COLUMNS = ("size", "transmission", "allowance", "shortest")
EXPLAINED = """\
The first ten answers to each request in its standard ranking: how many there are, the median of their sizes over the
stroke, of their least transmission angles, of their allowances (the scatter of the pivots that the path forgives, over
the deviation asked for), the shortest crank, coupler or frame among them, over the stroke, and of how many series and
families they are.  *Before* is revision 18e2582 with its catalogue of 226,789 guides; it was not asked for series.
"""


def measured(candidate: Any, deviation: float) -> dict[str, Any]:
    """Return what an answer is like, from its pivots and its sensitivity; lengths in strokes."""
    s = candidate.stroke
    pivots = [[complex(x, y) if w else None for x, y, w in dyad] for dyad in candidate.pivots]
    (one, a), (two, b) = pivots
    ends = [(one, a), (two, b), (a, b), (one, two)]
    links = [abs(q - p) for p, q in ends if p is not None and q is not None]
    rms = candidate.sensitivity().rms[0]
    return {
        "size": candidate.size / s,
        "transmission": candidate.min_transmission,
        "allowance": (deviation - candidate.deviation) / (2 * rms) / deviation,
        "shortest": min(links) / s if links else None,
        "series": candidate.series,
        "family": candidate.family,
    }


def found(database: str) -> dict[str, list[dict[str, Any]]]:
    """Return what the first ten answers to every request are like."""
    with catalogue.open(database, build=False) as cat:
        return {
            name: [measured(c, request.deviation) for c in cat.find(request, limit=10, **wanted)]
            for name, (request, wanted) in REQUESTS.items()
        }


def summary(answers: list[dict[str, Any]]) -> list[str]:
    """Return the cells of a row: number, medians, the shortest link of all, numbers of series and families."""
    sorts = [{a[name] for a in answers if name in a} for name in ("series", "family")]
    kinds = [str(len(sort)) if sort else "-" for sort in sorts]
    if not answers:
        return ["0", *("-" for _ in COLUMNS), *kinds]
    size, angle, allowance = (median(a[name] for a in answers) for name in COLUMNS[:3])
    return [
        str(len(answers)),
        f"{size:.2f}",
        f"{angle:.0f}",
        f"{allowance:.3f}",
        f"{min(a['shortest'] or INF for a in answers):.2f}",
        *kinds,
    ]


def draw(before: dict[str, Any], after: dict[str, Any], path: Path) -> None:
    """Draw size, transmission and allowance of all answers, before on the left of each request, after on the right."""
    from matplotlib.figure import Figure

    figure = Figure((9, 7), layout="constrained")
    axes = figure.subplots(3, 1, sharex=True)
    labels = ("size / stroke", "transmission angle [deg]", "allowance / deviation")
    for axis, name, label in zip(axes, COLUMNS, labels, strict=False):
        for shift, colour, answers, text in ((-0.15, "0.6", before, "before"), (0.15, "#a03020", after, "now")):
            places = [(i + shift, a[name]) for i, key in enumerate(REQUESTS) for a in answers[key]]
            axis.plot(
                *zip(*places, strict=True), "o", color=colour, markersize=4, alpha=0.7, label=text, linestyle="none"
            )
        axis.set_ylabel(label)
        axis.grid(axis="y", color="0.9")
        axis.spines[["top", "right"]].set_visible(False)
    axes[0].legend(frameon=False, ncols=2, loc="lower right", bbox_to_anchor=(1, 1))
    axes[2].set_xticks(range(len(REQUESTS)), list(REQUESTS), rotation=30, ha="right")
    figure.savefig(path, metadata={"Date": None})


def main() -> None:
    parser = arguments()
    parser.add_argument("database")
    parser.add_argument("--record", type=Path)
    options = parser.parse_args()
    after = found(options.database)
    if options.record:
        options.record.write_text(json.dumps(after, indent=1) + "\n", "utf-8")
        return
    before = json.loads((HERE / "practical_before.json").read_text("utf-8"))
    text = io.StringIO()
    with contextlib.redirect_stdout(text):
        title("Ten practical requests, before and now")
        print(EXPLAINED)
        rows = []
        for name in REQUESTS:
            rows += [[name, "before", *summary(before[name])], ["", "now", *summary(after[name])]]
        table(["request", "", "answers", "size", "degrees", "allowance", "shortest link", "series", "families"], rows)
        print("![Size, transmission angle and allowance of each answer](practical.svg)")
    REPORT.with_suffix(".md").write_text(text.getvalue(), "utf-8")
    draw(before, after, REPORT.with_suffix(".svg"))
    print(text.getvalue(), end="")


if __name__ == "__main__":
    main()
