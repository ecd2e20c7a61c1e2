"""The options of `catalogue find` besides the path."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..problem.ranking import CRITERIA, DISTINCT
from .options import Db, Format, Output, Plugins

Box = tuple[float, float, float, float]
Point = tuple[float, float]
Stroke = Annotated[
    float | None,
    typer.Option(metavar="L", help="Length of the path (chord of an arc), in any unit; or say --from and --to."),
]
Deviation = Annotated[
    float,
    typer.Option(help="Largest distance from the best-placed line, or arc of exactly the radius given, in that unit."),
]
Radius = Annotated[
    float | None,
    typer.Option(
        metavar="R", help="Radius of the arc, which bulges to the left of its way.", show_default="whatever fits best"
    ),
]
From = Annotated[Point | None, typer.Option("--from", metavar="X Y", help="Where the path starts.")]
To = Annotated[Point | None, typer.Option("--to", metavar="X Y", help="Where it ends, instead of --stroke.")]
Along = Annotated[float, typer.Option(metavar="DEG", help="Direction of the path, with --stroke.")]
Names = Annotated[list[str] | None, typer.Option("--family", metavar="NAME", help="Only this family; may be repeated.")]
Codes = Annotated[list[str] | None, typer.Option("--series", metavar="CODE", help="Only this series; may be repeated.")]
Configurations = Annotated[
    list[str] | None, typer.Option("--configuration", metavar="LETTERS", help="Only this one; may be repeated.")
]
Order = Annotated[int, typer.Option(help="Least order of contact at the design position (99: exact).")]
Slots = Annotated[
    bool, typer.Option("--slots", help="Slots that the coupler carries over a fixed point, seen from the coupler.")
]
Returns = Annotated[
    bool,
    typer.Option("--returns", help="Points that run along the path to one of its ends, rest, and run back along it."),
]
PinsOnly = Annotated[bool, typer.Option("--pins-only", help="No sliding joint.")]
FixedIn = Annotated[
    Box | None,
    typer.Option(
        "--fixed-pivots-in", metavar="X0 Y0 X1 Y1", help="Box for the fixed pivots; -inf and inf leave a side open."
    ),
]
AllIn = Annotated[
    Box | None, typer.Option("--pivots-in", metavar="X0 Y0 X1 Y1", help="Box for all pivots in mid-stroke.")
]
Pair = tuple[float, float, float, float]
FixedPivots = Annotated[
    Pair | None, typer.Option("--fixed-pivots", metavar="X1 Y1 X2 Y2", help="Exactly where the fixed pivots stand.")
]
MovingPivots = Annotated[
    Pair | None, typer.Option("--moving-pivots", metavar="X1 Y1 X2 Y2", help="Where the moving ones are in mid-stroke.")
]
Crank = Annotated[
    Pair | None,
    typer.Option("--crank", metavar="X Y X* Y*", help="Fixed and, in mid-stroke, moving pivot of one crank."),
]
Within = Annotated[float, typer.Option(metavar="L", help="How far off given pivots may stand.")]
MaxSize = Annotated[float | None, typer.Option(metavar="L", help="Largest diameter of pivots and path together.")]
MaxLink = Annotated[float | None, typer.Option(metavar="L", help="Longest crank or coupler.")]
MinLink = Annotated[float | None, typer.Option(metavar="L", help="Shortest crank or coupler.")]
MaxGround = Annotated[float | None, typer.Option(metavar="L", help="Largest distance of the fixed pivots.")]
MaxArm = Annotated[
    float | None, typer.Option(metavar="L", help="Largest distance of the guided point from the nearer moving pivot.")
]
Transmission = Annotated[
    float, typer.Option(metavar="DEG", help="Least transmission angle over the stroke, the better crank driving.")
]
TransmissionTurn = Annotated[
    float, typer.Option(metavar="DEG", help="The same over the whole turn of the driver, which then turns fully.")
]
Allowance = Annotated[
    float | None,
    typer.Option(
        metavar="L", help="Least scatter of the pivots (standard deviation of each coordinate) that the path forgives."
    ),
]
FullRotation = Annotated[bool, typer.Option("--full-rotation", help="A crank must be able to turn fully.")]
SweptIn = Annotated[
    Box | None, typer.Option("--swept-in", metavar="X0 Y0 X1 Y1", help="Box for the whole linkage over the stroke.")
]
KeepOut = Annotated[
    list[str] | None,
    typer.Option(
        "--keep-out", metavar="X0,Y0,X1,Y1",
        help="Box, or polygon of three or more points, that no link may enter over the stroke; may be repeated.",
    ),
]  # fmt: skip
MinDrive = Annotated[
    float | None, typer.Option(metavar="DEG", help="Least angle of the driving crank over the stroke.")
]
MaxDrive = Annotated[float | None, typer.Option(metavar="DEG", help="Largest one.")]
MaxRotation = Annotated[float | None, typer.Option(metavar="DEG", help="Largest turn of the coupler over the stroke.")]
Uniformity = Annotated[
    float | None, typer.Option(metavar="X", help="Least over largest speed along the path, the crank turning steadily.")
]
Advantage = Annotated[
    float | None, typer.Option(metavar="X", help="Least force along the path over force at the crank pin.")
]
Play = Annotated[
    float, typer.Option(metavar="L", help="Standard deviation of every pivot coordinate, for `expected` and ranking.")
]
RankBy = Annotated[
    str, typer.Option(metavar="NAME[=W],...", help=f"What to rank by: {', '.join(CRITERIA)}; several with weights.")
]
Desires = Annotated[
    list[str] | None,
    typer.Option(
        "--desire", metavar="NAME=BEST:WORST[:WEIGHT]",
        help="What makes the score, 1 from BEST, 0 from WORST on: size, transmission, allowance, min_link. Repeatable.",
    ),
]  # fmt: skip
Pareto = Annotated[
    str | None, typer.Option(metavar="NAME,NAME,...", help="The Pareto front of these criteria instead, none weighed.")
]
Distinct = Annotated[
    float, typer.Option(metavar="D", help="No two guides nearer as designs than D, 0 to 1: 0.05 is a pivot moved by a"
                        " twentieth of the stroke; of such only the best is listed.")
]  # fmt: skip
PerSeries = Annotated[
    int | None, typer.Option(metavar="N", help="At most N of one series while there are others; 0: no bound.",
                             show_default="a third of the limit")
]  # fmt: skip
Effort = Annotated[int, typer.Option(metavar="N", help="How hard to search: starts, rounds and seconds grow with it.")]
Refine = Annotated[
    bool,
    typer.Option(help="Move the pivots until what is ranked is best within the deviation and all constraints."),
]
Cognates = Annotated[
    bool,
    typer.Option("--cognates", help="Offer the cognates of four-bars and slider-cranks too: same path, other pivots."),
]
RoundTo = Annotated[
    float | None, typer.Option(metavar="L", help="Make all lengths multiples of L, and keep those that still serve.")
]
InCollection = Annotated[
    str | None,
    typer.Option(
        "--collection", metavar="NAME",
        help="Find mechanisms of another kind, which a plugin collects (`catalogue plugins` lists them). With "
        "--family, --series, --where, --rank-by deviation or one of its metrics, --limit, the output.",
    ),
]  # fmt: skip
Where = Annotated[
    list[str] | None,
    typer.Option(
        "--where", metavar="METRIC>=X",
        help="Bound a metric of the collection by >= or <=, e.g. 'size<=3'; a length in your unit. May be repeated.",
    ),
]  # fmt: skip
Plot = Annotated[Path | None, typer.Option(metavar="FILE", help="Draw the best one: PNG, SVG or PDF by the suffix.")]
Limit = Annotated[int, typer.Option(metavar="N", help="How many guides to list.")]
Explain = Annotated[bool, typer.Option("--explain", help="Say what each constraint removed and how long it took.")]


def find_options(
    family: Names = None,
    series: Codes = None,
    configuration: Configurations = None,
    order: Order = 0,
    slots: Slots = False,
    returns: Returns = False,
    pins_only: PinsOnly = False,
    fixed_pivots_in: FixedIn = None,
    pivots_in: AllIn = None,
    fixed_pivots: FixedPivots = None,
    moving_pivots: MovingPivots = None,
    crank: Crank = None,
    within: Within = 0.0,
    max_size: MaxSize = None,
    max_link: MaxLink = None,
    min_link: MinLink = None,
    max_ground: MaxGround = None,
    max_arm: MaxArm = None,
    min_transmission: Transmission = 0.0,
    min_transmission_turn: TransmissionTurn = 0.0,
    min_allowance: Allowance = None,
    full_rotation: FullRotation = False,
    swept_in: SweptIn = None,
    keep_out: KeepOut = None,
    min_drive_angle: MinDrive = None,
    max_drive_angle: MaxDrive = None,
    max_rotation: MaxRotation = None,
    min_uniformity: Uniformity = None,
    min_advantage: Advantage = None,
    play: Play = 0.0,
    rank_by: RankBy = "score",
    desires: Desires = None,
    pareto: Pareto = None,
    distinct: Distinct = DISTINCT,
    per_series: PerSeries = None,
    effort: Effort = 1,
    refine: Refine = True,
    cognates: Cognates = False,
    round_to: RoundTo = None,
    limit: Limit = 12,
    collection: InCollection = None,
    where: Where = None,
    explain: Explain = False,
    plot: Plot = None,
    format: Output = Format.table,
    db: Db = None,
    plugins: Plugins = None,
) -> None:
    """The options of every kind of request; never called."""
