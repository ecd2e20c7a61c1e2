"""``catalogue find dwell``: a rocker that stands still while a crank turns on."""

from __future__ import annotations

import csv
import json
import sys
from typing import Annotated

import typer

from ..progress import busy
from .find_options import Codes, Effort, Limit, Names, Order, PinsOnly
from .options import Db, Format, Output, Plugins

Angle = Annotated[float, typer.Option(metavar="DEG", help="By how much the crank turns meanwhile, at least.")]
Residual = Annotated[float, typer.Option(metavar="DEG", help="Band of angles in which the rocker may stray meanwhile.")]
Swing = Annotated[float, typer.Option(metavar="DEG", help="How far the rocker swings over a turn, at least.")]
Transmission = Annotated[float, typer.Option(metavar="DEG", help="Least transmission angle over the full turn.")]

COLUMNS = [
    ("id", "right"), ("series", "left"), ("family", "left"), ("dwell", "right"), ("residual", "right"),
    ("swing", "right"), ("transmission", "right"), ("size", "right"),
]  # fmt: skip


def dwell(
    angle: Angle,
    residual: Residual,
    swing: Swing,
    min_transmission: Transmission = 0.0,
    family: Names = None,
    series: Codes = None,
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
    from ..find.dwell_results import DwellCandidate, StandStill

    with open(db, plugins=plugins or ()) as catalogue, busy("trying rockers"):
        found = catalogue.find_dwells(
            StandStill(angle, residual, swing), limit=limit, effort=effort, families=family or (),
            series=series or (), order=order, pins_only=pins_only, min_transmission=min_transmission,
        )  # fmt: skip
    if not found:
        print(f"catalogue: {found.explain()}", file=sys.stderr)
    if format is Format.json:
        print(found.to_json())
    elif format is Format.csv:
        writer = csv.DictWriter(sys.stdout, list(DwellCandidate.__dataclass_fields__), lineterminator="\n")
        writer.writeheader()
        writer.writerows(
            {k: json.dumps(v) if isinstance(v, list) else v for k, v in d.to_dict().items()} for d in found
        )
    elif found:
        from .tables import print_table

        rows = [
            [str(d.id), d.series, d.family, f"{d.angle:.1f}\u00b0", f"{d.residual:.3g}\u00b0", f"{d.swing:.1f}\u00b0",
             f"{d.min_transmission:.1f}\u00b0", f"{d.size:.3g}"]
            for d in found
        ]  # fmt: skip
        print_table(
            f"Dwells of {angle:g}\u00b0", COLUMNS, rows, "sizes in crank lengths; --format json gives all pivots"
        )
    if not found:
        raise typer.Exit(1)
