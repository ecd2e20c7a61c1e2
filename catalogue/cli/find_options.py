"""The options of `catalogue find`, as parameters of a function that takes them all."""

from __future__ import annotations

from inspect import Parameter
from pathlib import Path
from typing import Annotated, Any

import typer

from ..problem.ranking import CRITERIA, DISTINCT
from .options import Db, Effort, Families, Format, Limit, Order, Output, PinsOnly, Plugins, SeriesCodes

Point = tuple[float, float]


def _parameter(name: str, kind: Any, default: Any = None) -> Parameter:
    return Parameter(name, Parameter.KEYWORD_ONLY, default=default, annotation=kind)


def _option(name: str, kind: Any, metavar: str | None, help: str, *, flag: str = "", **more: Any) -> Parameter:
    """Return an option that may be left out, called `flag` where its name is not the parameter's."""
    named = (flag,) if flag else ()
    return _parameter(name, Annotated[kind | None, typer.Option(*named, metavar=metavar, help=help, **more)])


def _number(name: str, metavar: str | None, help: str, default: Any = None) -> Parameter:
    kind = float if default is not None else float | None
    return _parameter(name, Annotated[kind, typer.Option(metavar=metavar, help=help)], default)


def _flag(name: str, help: str) -> Parameter:
    flag = "--" + name.replace("_", "-")
    return _parameter(name, Annotated[bool, typer.Option(flag, help=help)], False)


def _four(name: str, metavar: str, help: str) -> Parameter:
    return _option(name, tuple[float, float, float, float], metavar, help)


#: Options that say what path it is to be.
DEVIATION = _number(
    "deviation", None, "Largest distance from the best-placed line, or arc of exactly the radius given, in that unit.",
    Parameter.empty,
)  # fmt: skip
STROKE = _number("stroke", "L", "Length of the path (chord of an arc), in any unit; or say --from and --to.")
RADIUS = _option(
    "radius", float, "R", "Radius of the arc, which bulges to the left of its way.", show_default="whatever fits best"
)
PLACE = (
    _option("from_", Point, "X Y", "Where the path starts.", flag="--from"),
    _option("to", Point, "X Y", "Where it ends, instead of --stroke."),
    _number("along", "DEG", "Direction of the path, with --stroke.", 0.0),
)
#: All others.
OPTIONS = (
    _parameter("family", Families),
    _parameter("series", SeriesCodes),
    _option("configuration", list[str], "LETTERS", "Only this one; may be repeated."),
    _parameter("order", Order, 0),
    _flag("slots", "Slots that the coupler carries over a fixed point, seen from the coupler."),
    _flag("returns", "Points that run along the path to one of its ends, rest, and run back along it."),
    _parameter("pins_only", PinsOnly, False),
    _four("fixed_pivots_in", "X0 Y0 X1 Y1", "Box for the fixed pivots; -inf and inf leave a side open."),
    _four("pivots_in", "X0 Y0 X1 Y1", "Box for all pivots in mid-stroke."),
    _four("fixed_pivots", "X1 Y1 X2 Y2", "Exactly where the fixed pivots stand."),
    _four("moving_pivots", "X1 Y1 X2 Y2", "Where the moving ones are in mid-stroke."),
    _four("crank", "X Y X* Y*", "Fixed and, in mid-stroke, moving pivot of one crank."),
    _number("within", "L", "How far off given pivots may stand.", 0.0),
    _number("max_size", "L", "Largest diameter of pivots and path together."),
    _number("max_link", "L", "Longest crank or coupler."),
    _number("min_link", "L", "Shortest crank or coupler."),
    _number("max_ground", "L", "Largest distance of the fixed pivots."),
    _number("max_arm", "L", "Largest distance of the guided point from the nearer moving pivot."),
    _number("min_transmission", "DEG", "Least transmission angle over the stroke, the better crank driving.", 0.0),
    _number(
        "min_transmission_turn", "DEG", "The same over the whole turn of the driver, which then turns fully.", 0.0
    ),
    _number(
        "min_allowance", "L",
        "Least scatter of the pivots (standard deviation of each coordinate) that the path forgives.",
    ),
    _flag("full_rotation", "A crank must be able to turn fully."),
    _four("swept_in", "X0 Y0 X1 Y1", "Box for the whole linkage over the stroke."),
    _option(
        "keep_out", list[str], "X0,Y0,X1,Y1",
        "Box, or polygon of three or more points, that no link may enter over the stroke; may be repeated.",
    ),
    _number("min_drive_angle", "DEG", "Least angle of the driving crank over the stroke."),
    _number("max_drive_angle", "DEG", "Largest one."),
    _number("max_rotation", "DEG", "Largest turn of the coupler over the stroke."),
    _number("min_uniformity", "X", "Least over largest speed along the path, the crank turning steadily."),
    _number("min_advantage", "X", "Least force along the path over force at the crank pin."),
    _number("play", "L", "Standard deviation of every pivot coordinate, for `expected` and ranking.", 0.0),
    _parameter(
        "rank_by",
        Annotated[str, typer.Option(
            metavar="NAME[=W],...", help=f"What to rank by: {', '.join(CRITERIA)}; several with weights."
        )],
        "score",
    ),
    _option(
        "desires", list[str], "NAME=BEST:WORST[:WEIGHT]",
        "What makes the score, 1 from BEST, 0 from WORST on: size, transmission, allowance, min_link. Repeatable.",
        flag="--desire",
    ),
    _option("pareto", str, "NAME,NAME,...", "The Pareto front of these criteria instead, none weighed."),
    _number(
        "distinct", "D", "No two guides nearer as designs than D, 0 to 1: 0.05 is a pivot moved by a twentieth of the "
        "stroke; of such only the best is listed.", DISTINCT,
    ),
    _option(
        "per_series", int, "N", "At most N of one series while there are others; 0: no bound.",
        show_default="a third of the limit",
    ),
    _parameter("effort", Effort, 1),
    _parameter(
        "refine",
        Annotated[bool, typer.Option(
            help="Move the pivots until what is ranked is best within the deviation and all constraints."
        )],
        True,
    ),
    _flag("cognates", "Offer the cognates of four-bars and slider-cranks too: same path, other pivots."),
    _number("round_to", "L", "Make all lengths multiples of L, and keep those that still serve."),
    _parameter("limit", Limit, 12),
    _option(
        "collection", str, "NAME",
        "Find mechanisms of another kind, which a plugin collects (`catalogue plugins` lists them). With "
        "--family, --series, --where, --rank-by deviation or one of its metrics, --limit, the output.",
    ),
    _option(
        "where", list[str], "METRIC>=X",
        "Bound a metric of the collection by >= or <=, e.g. 'size<=3'; a length in your unit. May be repeated.",
    ),
    _flag("explain", "Say what each constraint removed and how long it took."),
    _option("plot", Path, "FILE", "Draw the best one: PNG, SVG or PDF by the suffix."),
    _parameter("format", Output, Format.table),
    _parameter("db", Db),
    _parameter("plugins", Plugins),
)  # fmt: skip
DEFAULTS = {option.name: option.default for option in OPTIONS}
