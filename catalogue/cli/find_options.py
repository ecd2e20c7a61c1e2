"""Options of `catalogue find straight-line` and `circular-arc`."""

from __future__ import annotations

import click

from ..problem.criteria import CRITERIA, DISTINCT
from ..quantities import BOUNDS, DEGREES, DESIRED, DRIVES, RATIO, Bound
from ..units import LENGTH
from .completion import complete_column
from .options import COMMON, EFFORT_HELP, FAMILY, LIMIT, ORDER, PINS_ONLY, SERIES, number, option, several, switch
from .tables import FORCE, OUTPUT, PICTURE
from .units import DESIRE, UNIT, ZONE, angle, length

#: Options that define the path.
DEVIATION = length(
    "--deviation",
    None,
    required=True,
    help="Tolerance: largest deviation of the path from the best-fitting line, or arc of the given radius.",
)
STROKE = length("--stroke", "L", "Length of the path (chord of an arc); or give --from and --to.")
RADIUS = length("--radius", "R", "Radius of the arc, which bulges to the left of its chord.", show_default="best fit")
ANGLE = angle("--angle", "DEG", "Angle of the arc, up to 350; give two of --stroke, --radius and --angle.")
PLACE = (
    length("--from", "X Y", "Start of the path.", nargs=2),
    length("--to", "X Y", "End of the path, instead of --stroke.", nargs=2),
    angle("--along", "DEG", "Direction of the path, with --stroke; 0 is +x.", default=0.0),
)
PLOT = option(
    "--plot",
    "FILE|DIR",
    "Draw the best answer (PNG, SVG, PDF or animated GIF by suffix), or all into a folder.",
    PICTURE,
)


def bound(row: Bound) -> click.Option:
    """Build the option of a bound on a measure."""
    kind, metavar = KINDS[row.unit]
    return kind(f"{row.option} --{row.name.replace('_', '-')} {row.name}", metavar, row.text, default=row.default)


#: Options and placeholders of bounds by their units.
KINDS = {LENGTH: (length, "L"), DEGREES: (angle, "DEG"), RATIO: (number, "X")}
_DESIRED = [row.criterion for row in DESIRED]
#: Constraints, ranking, search and output.
OPTIONS = (
    FAMILY,
    SERIES,
    several(
        "--configuration",
        "LETTERS",
        "Only this configuration (where the pivots stand); may be repeated.",
        shell_complete=complete_column("configuration"),
    ),
    ORDER,
    switch("--slots", "Guide a slot in the coupler over a fixed point; the path is seen from the coupler."),
    switch("--returns", "Guide points that travel the path to one end, rest there, and travel back."),
    PINS_ONLY,
    length(
        "--fixed-pivots-in",
        "X0 Y0 X1 Y1",
        "Box for the fixed pivots and rails; -inf and inf leave a side open.",
        nargs=4,
    ),
    length("--pivots-in", "X0 Y0 X1 Y1", "Box for all pivots, rails and slots at mid-stroke.", nargs=4),
    length("--fixed-pivots", "X1 Y1 X2 Y2", "Prescribed positions of the fixed pivots.", nargs=4),
    length("--moving-pivots", "X1 Y1 X2 Y2", "Prescribed positions of the moving pivots at mid-stroke.", nargs=4),
    length("--crank", "X Y X* Y*", "Prescribed fixed pivot and, at mid-stroke, moving pivot of one crank.", nargs=4),
    length("--within", "L", "Largest distance of a pivot from its prescribed position.", default=0.0),
    *(bound(row) for row in BOUNDS.values() if row not in (*DRIVES, BOUNDS["min_lift"])),
    switch("--full-rotation", "A crank must turn fully."),
    bound(BOUNDS["min_lift"]),
    length("--swept-in", "X0 Y0 X1 Y1", "Box for all links over the whole stroke.", nargs=4),
    several(
        "--keep-out",
        "X0,Y0,X1,Y1",
        "Box, or polygon of three or more points, that no link may enter over the stroke; may be repeated.",
        ZONE,
    ),
    *(bound(row) for row in DRIVES),
    length(
        "--play", "L", "Standard deviation of pivot position, for the expected deviation and the ranking.", default=0.0
    ),
    option(
        "--rank-by",
        "NAME[=W],...",
        f"Criterion of the ranking: {', '.join(CRITERIA)}; several with weights.",
        show_default="score",
    ),
    several(
        "--desire desires",
        "NAME=BEST:WORST[:WEIGHT]",
        "Desirability in the score, 1 from BEST on, 0 from WORST on, of "
        f"{', '.join(_DESIRED[:-1])} or {_DESIRED[-1]}; may be repeated.",
        DESIRE,
    ),
    option("--pareto", "NAME,NAME,...", "Rank by Pareto fronts of these criteria, without weights."),
    number(
        "--distinct",
        "D",
        "Minimum distance between two answers as designs, 0 to 1: 0.05 is a pivot moved by a twentieth of the stroke.",
        default=DISTINCT,
    ),
    option(
        "--per-series",
        "N",
        "At most N answers of one series while others have answers; 0: no limit.",
        int,
        show_default="a quarter of the limit",
    ),
    option("--effort", "N", f"{EFFORT_HELP}; 0: end with the first answers.", int, default=1),
    switch(
        "--refine/--no-refine",
        "Optimise the pivots for the ranking, subject to the tolerance and all constraints.",
        default=True,
    ),
    switch("--cognates", "Also offer cognates of four-bars and slider-cranks: same path, other pivots."),
    length("--round-to", "L", "Round all lengths to multiples of L; keep linkages that still meet the request."),
    LIMIT,
    several(
        "--start starts",
        "CODE|FILE",
        "Also start from this answer, or those of a file: if it meets the constraints, the best answer is no "
        "worse. May be repeated.",
    ),
    option(
        "--collection",
        "NAME",
        "Search mechanisms of another kind, from a plugin (`catalogue plugins` lists them). Goes with "
        "--family, --series, --special, --where, bounds on its metrics (such as --max-size), --rank-by (deviation "
        "or a metric), --limit, --effort, --refine and the output options; of planar ones also with --pins-only, "
        "--full-rotation, the place, and regions (--fixed-pivots-in, --pivots-in, --swept-in, --keep-out).",
    ),
    several("--special", "NAME", "Only this well-known mechanism of the collection, such as RSSR; may be repeated."),
    several(
        "--where",
        "METRIC>=X",
        "Bound on a metric of the collection by >= or <=, e.g. 'size<=3'; a length in your unit. May be repeated.",
    ),
    switch("--explain", "Report candidates removed by each constraint, and times."),
    PLOT,
    option("--save", "FILE", "Save the answers to a file for later commands.", OUTPUT),
    FORCE,
    UNIT,
    *COMMON,
)
#: Constraints and ranking of `improve`.
IMPROVE = tuple(
    one
    for one in OPTIONS
    if one.name
    in {
        "pins_only",
        "fixed_pivots_in",
        "pivots_in",
        *BOUNDS,
        "full_rotation",
        "swept_in",
        "keep_out",
        "play",
        "rank_by",
        "plot",
        "unit",
        "format",
        "db",
        "plugins",
        "share",
    }
)
