"""``catalogue find dwell``: a rocker that stands still while a crank turns on."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from ..progress import busy
from .options import Db, Effort, Families, Format, Limit, Order, Output, PinsOnly, Plugins, SeriesCodes
from .tables import print_results, print_table

if TYPE_CHECKING:
    from ..find.dwell_results import DwellResults


def dwell(
    angle: Annotated[float, typer.Option(metavar="DEG", help="By how much the crank turns meanwhile, at least.")],
    residual: Annotated[
        float, typer.Option(metavar="DEG", help="Band of angles in which the rocker may stray meanwhile.")
    ],
    swing: Annotated[float, typer.Option(metavar="DEG", help="How far the rocker swings over a turn, at least.")],
    min_transmission: Annotated[
        float, typer.Option(metavar="DEG", help="Least transmission angle over the full turn.")
    ] = 0.0,
    family: Families = None,
    series: SeriesCodes = None,
    order: Order = 0,
    pins_only: PinsOnly = False,
    effort: Effort = 1,
    limit: Limit = 12,
    format: Output = Format.table,
    db: Db = None,
    plugins: Plugins = None,
) -> None:
    """Let a rocker stand still while a crank turns on: a circular guide and the dyad at its centre.

    catalogue find dwell --angle 90 --residual 0.5 --swing 30
    """
    from ..api import open
    from ..find.dwell_results import StandStill

    def table(found: DwellResults) -> None:
        columns = [">id", "series", "family", ">dwell", ">residual", ">swing", ">transmission", ">size"]
        rows = [
            [d.id, d.series, d.family, f"{d.angle:.1f}\u00b0", f"{d.residual:.3g}\u00b0", f"{d.swing:.1f}\u00b0",
             f"{d.min_transmission:.1f}\u00b0", f"{d.size:.3g}"]
            for d in found
        ]  # fmt: skip
        caption = "sizes in crank lengths; --format json gives all pivots"
        print_table(f"Dwells of {angle:g}\u00b0", columns, rows, caption)

    with open(db, plugins=plugins or ()) as catalogue, busy("trying rockers"):
        found = catalogue.find_dwells(
            StandStill(angle, residual, swing), limit=limit, effort=effort, families=family or (),
            series=series or (), order=order, pins_only=pins_only, min_transmission=min_transmission,
        )  # fmt: skip
    print_results(found, table, format)
