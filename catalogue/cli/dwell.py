"""``catalogue find dwell``: a rocker that stands still while a crank turns on."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..progress import busy
from .options import COMMON, EFFORT, FAMILY, LIMIT, ORDER, PINS_ONLY, SERIES, number
from .tables import codes, print_results, print_table

if TYPE_CHECKING:
    from ..find.dwell_results import DwellResults


@click.command(
    params=[
        number("--angle", "DEG", "By how much the crank turns meanwhile, at least.", required=True),
        number("--residual", "DEG", "Band of angles in which the rocker may stray meanwhile.", required=True),
        number("--swing", "DEG", "How far the rocker swings over a turn, at least.", required=True),
        number("--min-transmission", "DEG", "Least transmission angle over the full turn.", default=0.0),
        FAMILY, SERIES, ORDER, PINS_ONLY, EFFORT, LIMIT, *COMMON,
    ]
)  # fmt: skip
def dwell(
    angle: float, residual: float, swing: float, format: str, db: Path | None, plugins: Sequence[str],
    family: Sequence[str], **options: Any,
) -> None:  # fmt: skip
    """Let a rocker stand still while a crank turns on: a circular guide and the dyad at its centre.

    \b
    catalogue find dwell --angle 90 --residual 0.5 --swing 30
    """
    from ..api import open
    from ..find.dwell_results import StandStill

    def table(found: DwellResults) -> None:
        columns = ["code", ">id", "series", "family", ">dwell", ">residual", ">swing", ">transmission", ">size"]
        rows = [
            [code, d.id, d.series, d.family, f"{d.angle:.1f}\u00b0", f"{d.residual:.3g}\u00b0", f"{d.swing:.1f}\u00b0",
             f"{d.min_transmission:.1f}\u00b0", f"{d.size:.3g}"]
            for code, d in zip(codes(found), found, strict=True)
        ]  # fmt: skip
        caption = "sizes in crank lengths; `catalogue show CODE` gives all pivots"
        print_table(f"Dwells of {angle:g}\u00b0", columns, rows, caption)

    with open(db, plugins=plugins) as catalogue, busy("trying rockers"):
        found = catalogue.find_dwells(StandStill(angle, residual, swing), families=family, **options)
    print_results(found, table, format)
