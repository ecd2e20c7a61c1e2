"""``catalogue trace``: print the motion of a guide over its drive as a table."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..errors import InvalidRequest
from ..progress import busy
from .completion import references
from .options import DB, PLUGINS, SHARE, Argument, option, several
from .references import HELP, REFERENCE, resolve
from .units import NAMED_POINT, UNIT, in_output_unit, length

if TYPE_CHECKING:
    from ..guides.chain_motion import ChainMotion
    from ..guides.guide_motion import GuideMotion


@click.command(
    params=[
        Argument("reference", REFERENCE, HELP, shell_complete=references),
        option(
            "--over",
            None,
            "Range of the motion: the stroke of an answer, or the whole circuit.",
            click.Choice(["stroke", "circuit"]),
            show_default="the stroke, if there is one",
        ),
        option(
            "--samples",
            "N",
            "Number of positions; no point moves more than 8/(N-1) of its path between two.",
            int,
            default=73,
        ),
        option(
            "--driver",
            "N",
            "Number of the driving crank; 0: the coupler.",
            int,
            show_default="that of the answer, or the first that turns",
        ),
        several("--distance", "A,B", "Distance of two joints of a mechanism of many bars; may be repeated.", str),
        length("--point", "X Y", "Guided point, in the position of the pivots.", nargs=2),
        several(
            "--also", "NAME=X,Y", "Another coupler point, in the position of the pivots; may be repeated.", NAMED_POINT
        ),
        UNIT,
        option("--format", None, "Output format.", click.Choice(["csv", "json"]), default="csv"),
        DB,
        SHARE,
        PLUGINS,
    ]
)
def trace(
    reference: str,
    over: str | None,
    samples: int,
    driver: int | None,
    point: tuple[float, float] | None,
    distance: Sequence[str],
    also: Sequence[tuple[str, tuple[float, float]]],
    format: str,
    db: Path | None,
    plugins: Sequence[str],
) -> None:
    """Print positions, velocities, accelerations, transmission and advantage over the drive.

    Velocities are per radian of the drive, accelerations per radian squared. Of a mechanism of many
    bars: all bars, all joints, and distances between joints with their ratios to the drive.

    \b
    catalogue trace mine.json --unit mm > motion.csv
    """
    from ..guides.candidate import Candidate
    from ..guides.chain_stretch import ChainStretch
    from ..guides.own_chain import OwnChain

    every = in_output_unit(resolve(reference, point, db, plugins, chains=True))
    if len(every) != 1:
        raise InvalidRequest(f"{reference} holds {len(every)} linkages: one can be traced at a time")
    one, points = every[0], dict(also)
    between = [tuple(one.split(",")) for one in distance]
    if distance and not isinstance(one, OwnChain):
        raise InvalidRequest(f"{reference} has two dyads: --distance is for a mechanism of many bars")
    motion: ChainMotion | GuideMotion
    with busy("moving it"):
        if isinstance(one, ChainStretch):
            motion = one.motion(samples, points=points, driver=driver, between=between, whole=over == "circuit")
        elif isinstance(one, OwnChain) and over != "stroke":
            motion = one.motion(samples, points=points, driver=driver, between=between)
        elif isinstance(one, Candidate) and over != "circuit":
            motion = one.motion(samples, points=points, driver=driver)
        elif over == "stroke":
            raise InvalidRequest(f"{reference} has no stroke: trace an answer of `measure`, or --over circuit")
        elif isinstance(one, Candidate):
            motion = one.motion(samples, points=points, driver=driver, whole=True)
        else:
            motion = one.motion(samples, points=points, driver=driver)
    table = motion.to_pandas()
    if format == "csv":
        table.to_csv(sys.stdout, index=False)
    else:
        print(table.to_json(orient="records", indent=1))
