"""``catalogue schema``: what every table, view and column of a database means."""

from __future__ import annotations

from dataclasses import asdict

import click

from .options import FORMAT
from .tables import print_records


@click.command(params=[FORMAT])
def schema(format: str) -> None:
    """Say what each table, view and column of a database holds, and its unit.

    The same stands in the file itself, in its table `description`. The views `guides` and `pivots` are for reading with
    SQL alone. Lengths are canonical (origin the pole, x axis the pole tangent, unit rho0) or in strokes.
    """
    from ..store.schema import described

    records = [asdict(one) for one in described()]
    print_records(format, records, "What a database holds", ["table", "column", "type", "unit", "~meaning"],
                  [list(record.values()) for record in records], spare=["type"])  # fmt: skip
