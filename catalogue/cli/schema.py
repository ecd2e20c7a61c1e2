"""``catalogue schema``: describe the tables, views and columns of a database."""

from __future__ import annotations

from dataclasses import asdict

import click

from .options import FORMAT
from .tables import print_records


@click.command(params=[FORMAT])
def schema(format: str) -> None:
    """Describe the tables, views and columns of a database, with units.

    The database holds this description in its table `description`. The views `guides` and `pivots`
    are meant for plain SQL. Lengths are canonical (origin the pole, x axis the pole tangent, unit
    rho0) or in strokes.
    """
    from ..store.schema import described

    records = [asdict(one) for one in described()]
    print_records(
        format,
        records,
        "What a database holds",
        ["table", "column", "type", "unit", "~meaning"],
        [list(record.values()) for record in records],
        spare=["type"],
    )
