"""The options of `catalogue find straight-line` and `circular-arc`."""

from __future__ import annotations

from ..problem.criteria import CRITERIA, DISTINCT
from .completion import held
from .options import COMMON, EFFORT, FAMILY, LIMIT, ORDER, PINS_ONLY, SERIES, number, option, several, switch
from .tables import FORCE, OUTPUT, PICTURE
from .units import DESIRE, UNIT, ZONE, angle, length

#: Options that say what path it is to be.
DEVIATION = length(
    "--deviation", None, required=True,
    help="Largest distance from the best-placed line, or arc of exactly the radius given, in that unit.",
)  # fmt: skip
STROKE = length("--stroke", "L", "Length of the path (chord of an arc), in any unit; or say --from and --to.")
RADIUS = length(
    "--radius", "R", "Radius of the arc, which bulges to the left of its way.", show_default="whatever fits best"
)
ANGLE = angle(
    "--angle", "DEG", "Angle of the arc, up to 350; give two of --stroke, --radius and --angle.",
)  # fmt: skip
PLACE = (
    length("--from", "X Y", "Where the path starts.", nargs=2),
    length("--to", "X Y", "Where it ends, instead of --stroke.", nargs=2),
    angle("--along", "DEG", "Direction of the path, with --stroke.", default=0.0),
)
PLOT = option("--plot", "FILE|DIR", "Draw the best one: PNG, SVG, PDF or moving GIF by the suffix; in a folder all.",
              PICTURE)  # fmt: skip
#: All others.
OPTIONS = (
    FAMILY,
    SERIES,
    several("--configuration", "LETTERS", "Only this one; may be repeated.",
            shell_complete=held("configuration")),
    ORDER,
    switch("--slots", "Slots that the coupler carries over a fixed point, seen from the coupler."),
    switch("--returns", "Points that run along the path to one of its ends, rest, and run back along it."),
    PINS_ONLY,
    length("--fixed-pivots-in", "X0 Y0 X1 Y1", "Box for the fixed pivots and rails; -inf and inf leave a side "
           "open.", nargs=4),
    length("--pivots-in", "X0 Y0 X1 Y1", "Box for all pivots, rails and slots in mid-stroke.", nargs=4),
    length("--fixed-pivots", "X1 Y1 X2 Y2", "Exactly where the fixed pivots stand.", nargs=4),
    length("--moving-pivots", "X1 Y1 X2 Y2", "Where the moving ones are in mid-stroke.", nargs=4),
    length("--crank", "X Y X* Y*", "Fixed and, in mid-stroke, moving pivot of one crank.", nargs=4),
    length("--within", "L", "How far off given pivots may stand.", default=0.0),
    length("--max-size", "L", "Largest diameter of pivots, rails, slots and path; 100 strokes if not given."),
    length("--max-link", "L", "Longest crank or coupler."),
    length("--min-link", "L", "Shortest crank or coupler."),
    length("--max-ground", "L", "Largest distance of the fixed pivots."),
    length("--min-ground", "L", "Shortest distance of the fixed pivots."),
    length("--max-arm", "L", "Largest distance of the guided point from the nearer moving pivot."),
    length("--max-travel", "L", "Longest travel of a slide in its rail or slot over the stroke."),
    angle("--min-transmission", "DEG", "Least transmission angle over the stroke, the better crank driving.",
           default=0.0),
    angle("--min-transmission-turn", "DEG", "The same over the whole turn of the driver, which then turns fully.",
           default=0.0),
    length("--min-allowance", "L",
           "Least scatter of the pivots (standard deviation of each coordinate) that the path forgives in 95 of 100."),
    switch("--full-rotation", "A crank must be able to turn fully."),
    length("--min-lift", "L", "Least lift of the point off its path on the way back, the crank turning on: of a leg."),
    length("--swept-in", "X0 Y0 X1 Y1", "Box for the whole linkage over the stroke.", nargs=4),
    several("--keep-out", "X0,Y0,X1,Y1",
            "Box, or polygon of three or more points, that no link may enter over the stroke; may be repeated.", ZONE),
    angle("--min-drive-angle", "DEG", "Least angle of the driving crank over the stroke."),
    angle("--max-drive-angle", "DEG", "Largest one."),
    angle("--max-rotation", "DEG", "Largest turn of the coupler over the stroke."),
    number("--min-uniformity", "X", "Least over largest speed along the path, the crank turning steadily."),
    number("--min-advantage", "X", "Least force along the path over force at the crank pin."),
    length("--play", "L", "Standard deviation of every pivot coordinate, for `expected` and ranking.", default=0.0),
    option("--rank-by", "NAME[=W],...", f"What to rank by: {', '.join(CRITERIA)}; several with weights.",
           show_default="score"),
    several("--desire desires", "NAME=BEST:WORST[:WEIGHT]",
            "What makes the score, 1 from BEST, 0 from WORST on: size, transmission, allowance, min_link, min_ground, "
            "travel. "
            "Repeatable.",
            DESIRE),
    option("--pareto", "NAME,NAME,...", "The Pareto front of these criteria instead, none weighed."),
    number("--distinct", "D",
           "No two guides nearer as designs than D, 0 to 1: 0.05 is a pivot moved by a twentieth of the stroke; of "
           "such only the best is listed.", default=DISTINCT),
    option("--per-series", "N", "At most N of one series while there are others; 0: no bound.", int,
           show_default="a quarter of the limit"),
    EFFORT,
    switch("--refine/--no-refine",
           "Move the pivots until what is ranked is best within the deviation and all constraints.", default=True),
    switch("--cognates", "Offer the cognates of four-bars and slider-cranks too: same path, other pivots."),
    length("--round-to", "L", "Make all lengths multiples of L, and keep those that still serve."),
    LIMIT,
    several("--start starts", "CODE|FILE",
            "Start from this answer too, or those of a file: where a constraint is loosened none that is worse comes "
            "first. Repeatable."),
    option("--collection", "NAME",
           "Find mechanisms of another kind, which a plugin collects (`catalogue plugins` lists them). With "
           "--family, --series, --special, --where, --rank-by deviation or one of its metrics, --limit, the output; "
           "--refine only if it is asked for."),
    several("--special", "NAME", "Only this well-known mechanism of the collection, such as RSSR; may be repeated."),
    several("--where", "METRIC>=X",
            "Bound a metric of the collection by >= or <=, e.g. 'size<=3'; a length in your unit. May be repeated."),
    switch("--explain", "Say what each constraint removed and how long it took."),
    PLOT,
    option("--save", "FILE", "Keep what is listed in a file, from which it is read again anywhere.", OUTPUT),
    FORCE,
    UNIT,
    *COMMON,
)  # fmt: skip
#: Those that say what an improved linkage must satisfy, and how it is ranked.
IMPROVE = tuple(one for one in OPTIONS if one.name in {
    "pins_only", "fixed_pivots_in", "pivots_in", "max_size", "max_link", "min_link", "max_ground", "min_ground",
    "max_arm", "max_travel", "min_transmission", "min_transmission_turn", "min_allowance", "full_rotation", "min_lift",
    "swept_in", "keep_out", "min_drive_angle", "max_drive_angle", "max_rotation", "min_uniformity", "min_advantage",
    "play", "rank_by", "effort", "plot", "unit", "format", "db", "plugins",
})  # fmt: skip
