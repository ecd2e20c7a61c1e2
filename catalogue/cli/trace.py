"""``catalogue trace``: the motion of a guide over its drive, as a table."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import click

from ..errors import InvalidRequest
from ..progress import busy
from .completion import references
from .options import DB, PLUGINS, Argument, option, several
from .references import HELP, REFERENCE, resolve
from .units import NAMED_POINT, UNIT, in_output_unit, length


@click.command(
    params=[
        Argument("reference", REFERENCE, HELP, shell_complete=references),
        option("--over", None, "Over the stroke of an answer, or the circuit.", click.Choice(["stroke", "circuit"]),
               show_default="the stroke, if there is one"),
        option("--samples", "N", "Positions; nothing runs farther than 8/(N-1) of its way from one to the next.", int,
               default=73),
        option("--driver", "N", "Number of the crank that drives; 0: the coupler.", int,
               show_default="that of the answer, or the first that turns"),
        length("--point", "X Y", "The coupler point, where it is in the position of the pivots.", nargs=2),
        several("--also", "NAME=X,Y", "A further coupler point, where it is in that position; may be repeated.",
                NAMED_POINT),
        UNIT,
        option("--format", None, "How to print.", click.Choice(["csv", "json"]), default="csv"),
        DB,
        PLUGINS,
    ]
)  # fmt: skip
def trace(
    reference: str, over: str | None, samples: int, driver: int | None, point: tuple[float, float] | None,
    also: Sequence[tuple[str, tuple[float, float]]], format: str, db: Path | None, plugins: Sequence[str],
) -> None:  # fmt: skip
    """Print positions, velocities, accelerations, transmission angle and mechanical advantage over the drive.

    Velocities and accelerations are per radian of the drive, and its square.

    \b
    catalogue trace mine.json --unit mm > motion.csv
    """
    from ..find.candidate import Candidate

    every = in_output_unit(resolve(reference, point, db, plugins))
    if len(every) != 1:
        raise InvalidRequest(f"{reference} holds {len(every)} linkages: one can be traced at a time")
    one, points = every[0], dict(also)
    with busy("moving it"):
        if isinstance(one, Candidate) and over != "circuit":
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
