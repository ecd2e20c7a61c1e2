"""``catalogue find dwell``: search six-bar dwell mechanisms."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..guides.columns import DWELL, LENGTH, Column
from ..guides.columns import TABLE as MADE
from ..progress import busy
from .find import CONFIG
from .find_options import PLOT
from .options import COMMON, EFFORT, FAMILY, LIMIT, ORDER, PINS_ONLY, SERIES, option, switch
from .tables import FORCE, OUTPUT, Tabled, codes, print_results, print_table, row
from .units import UNIT, angle, length, unit, with_unit

if TYPE_CHECKING:
    from ..guides.dwell import DwellResults

#: Columns of the table in order.
TABLE = (
    *("code", "id", "series", "family", "angle", "crank", "residual", "swing", "allowance"),
    *("min_transmission", "size", "rod", "rocker"),
)
#: Title, unit and meaning of each column.
COLUMNS = {
    **MADE,
    **DWELL,
    "crank": Column(
        "crank",
        "deg",
        "number of the driving crank, its angle at start and end of the dwell, measured "
        "from the line of its fixed pivot and the rocker's",
        right=False,
    ),
    "rod": Column("rod", LENGTH, "length of the rod, from guided point to rocker"),
    "rocker": Column("rocker", LENGTH, "length of the rocker, from rod to fixed pivot"),
}
#: Columns to omit on a narrow terminal, the first one first.
SPARE = ("id", "rod", "rocker", "crank", "family", "allowance")


@click.command(
    cls=Tabled,
    table=TABLE,
    columns=COLUMNS,
    params=[
        angle("--angle", "DEG", "Minimum rotation of the crank during the dwell.", required=True),
        angle("--residual", "DEG", "Maximum range of the rocker's angle during the dwell.", required=True),
        angle("--swing", "DEG", "Minimum swing of the rocker over a turn.", required=True),
        angle("--min-transmission", "DEG", "Minimum transmission angle over the full turn.", default=0.0),
        length(
            "--max-size", "L", "Maximum overall size, of all pivots and of the path over the turn; default: 10 cranks."
        ),
        length("--crank-length", "L", "Length of the driving crank; all other lengths scale with it.", default=1.0),
        FAMILY,
        SERIES,
        ORDER,
        PINS_ONLY,
        EFFORT,
        LIMIT,
        switch("--explain", "Report the number of trials, and how close the best one came."),
        option("--save", "FILE", "Save the answers to a file for later commands.", OUTPUT),
        PLOT,
        FORCE,
        UNIT,
        *COMMON,
        CONFIG,
    ],
)
def dwell(
    angle: float,
    residual: float,
    swing: float,
    crank_length: float,
    format: str,
    db: Path | None,
    plugins: Sequence[str],
    family: Sequence[str],
    explain: bool,
    save: Path | None,
    plot: Path | None,
    **options: Any,
) -> None:
    """Find six-bar dwell mechanisms: a rocker rests while the crank turns on.

    A crank-driven linkage guides a point along an arc; a rod as long as its radius leads to the
    rocker. All pivots are refined for the largest transmission angle over the turn.

    \b
    catalogue find dwell --angle 90 --residual 0.5 --swing 30 --crank-length 40mm
    """
    from ..api import open
    from ..guides.dwell import StandStill

    def table(found: DwellResults) -> None:
        rows = [
            row(
                d,
                TABLE,
                code=code,
                min_transmission=f"{d.min_transmission:.1f}\u00b0",
                **{name: f"{d.lengths[name]:.4g}" for name in ("rod", "rocker")},
            )
            for code, d in zip(codes(found), found, strict=True)
        ]
        of = f" of {with_unit(f'{crank_length:g}')}" if crank_length != 1 or unit() else ""
        caption = f"lengths for a driving crank{of or ' of 1'}; `catalogue show CODE` gives all pivots"
        print_table(f"Dwells of {angle:g}\u00b0", TABLE, rows, caption, meanings=COLUMNS, spare=SPARE)

    with open(db, plugins=plugins) as catalogue, busy("trying rockers"):
        found = catalogue.find_dwells(
            StandStill(angle, residual, swing, crank_length, unit()), families=family, **options
        )
    print_results(found, table, format, explain=explain, save=save, plot=plot)
