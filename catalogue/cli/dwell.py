"""``catalogue find dwell``: a rocker that stands still while a crank turns on."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..find.columns import DWELL, LENGTH, Column
from ..find.columns import TABLE as MADE
from ..progress import busy
from .find import CONFIG
from .find_options import PLOT
from .options import COMMON, EFFORT, FAMILY, LIMIT, ORDER, PINS_ONLY, SERIES, option, switch
from .tables import FORCE, OUTPUT, Tabled, codes, print_results, print_table, row
from .units import UNIT, angle, length, unit, with_unit

if TYPE_CHECKING:
    from ..find.dwell_results import DwellResults

#: Columns of the table, what they mean, and which may be left out.
TABLE = ("code", "id", "series", "family", "angle", "crank", "residual", "swing", "allowance", "min_transmission",
         "size", "rod", "rocker")  # fmt: skip
COLUMNS = {
    **MADE,
    **DWELL,
    "crank": Column("crank", "deg", "number of the crank that turns, its angle at the beginning and end of the dwell "
                    "from the line between its fixed pivot and the rocker's", right=False),
    "rod": Column("rod", LENGTH, "from the guided point to the rocker"),
    "rocker": Column("rocker", LENGTH, "from the rod to the rocker's pivot"),
}  # fmt: skip
SPARE = ("id", "rod", "rocker", "crank", "family", "allowance")


@click.command(
    cls=Tabled,
    table=TABLE,
    columns=COLUMNS,
    params=[
        angle("--angle", "DEG", "By how much the crank turns meanwhile, at least.", required=True),
        angle("--residual", "DEG", "Band of angles in which the rocker may stray meanwhile.", required=True),
        angle("--swing", "DEG", "How far the rocker swings over a turn, at least.", required=True),
        angle("--min-transmission", "DEG", "Least transmission angle over the full turn.", default=0.0),
        length("--crank-length", "L", "Length of the driving crank, of which the others are multiples.", default=1.0),
        FAMILY, SERIES, ORDER, PINS_ONLY, EFFORT, LIMIT,
        switch("--explain", "Say how many were looked at, and how near the nearest came."),
        option("--save", "FILE", "Keep what is listed in a file, from which it is read again anywhere.", OUTPUT),
        PLOT, FORCE, UNIT, *COMMON, CONFIG,
    ]
)  # fmt: skip
def dwell(
    angle: float, residual: float, swing: float, crank_length: float, format: str, db: Path | None,
    plugins: Sequence[str], family: Sequence[str], explain: bool, save: Path | None, plot: Path | None, **options: Any,
) -> None:  # fmt: skip
    """Let a rocker stand still while a crank turns on: a circular guide and the dyad at its centre.

    \b
    catalogue find dwell --angle 90 --residual 0.5 --swing 30 --crank-length 40mm
    """
    from ..api import open
    from ..find.dwell_results import StandStill

    def table(found: DwellResults) -> None:
        rows = [
            row(d, TABLE, code=code, min_transmission=f"{d.min_transmission:.1f}\u00b0",
                **{name: f"{d.lengths[name]:.4g}" for name in ("rod", "rocker")})
            for code, d in zip(codes(found), found, strict=True)
        ]  # fmt: skip
        of = f" of {with_unit(f'{crank_length:g}')}" if crank_length != 1 or unit() else ""
        caption = f"lengths for a driving crank{of or ' of 1'}; `catalogue show CODE` gives all pivots"
        print_table(f"Dwells of {angle:g}\u00b0", TABLE, rows, caption, meanings=COLUMNS, spare=SPARE)

    with open(db, plugins=plugins) as catalogue, busy("trying rockers"):
        found = catalogue.find_dwells(
            StandStill(angle, residual, swing, crank_length, unit()), families=family, **options
        )
    print_results(found, table, format, explain=explain, save=save, plot=plot)
