"""``catalogue census``: what the catalogue holds, cell by cell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import click

from ..progress import busy
from .options import COMMON
from .tables import print_records


@click.command(params=[*COMMON])
def census(format: str, db: Path | None, plugins: Sequence[str]) -> None:
    """Count the stored mechanisms: series by family by configuration, and say why a cell is empty."""
    from ..api import open
    from ..find import census as counting

    with open(db, plugins=plugins) as catalogue:
        with busy("counting"):
            cells = counting.census(catalogue.database, catalogue.registry)
        series = catalogue.registry.series
    levels = sorted({level for c in cells for level in c.smallest}, reverse=True)
    columns = ["series", "family", "conf.", ">dim.", ">mechanisms", ">guides", *(f">1e{k}" for k in levels), ""]
    rows = [
        [c.series, c.family, c.configuration, c.dimension, c.mechanisms, c.guides,
         *(f"{c.smallest[level]:.3g}" if level in c.smallest else "-" for level in levels), c.remark]
        for c in cells
    ]  # fmt: skip
    title = "Census; under each deviation over stroke the least size over stroke"
    print_records(format, [asdict(c) for c in cells], title, columns, rows)
    if format != "table":
        return
    total = sum(c.guides for c in cells)
    print(f"{len(cells)} cells, {sum(c.mechanisms for c in cells)} mechanisms, {total} guides")
    for one in series.values():
        missing = counting.impossible(one, cells)
        if missing:
            print(f"{one.code}: impossible are " + ", ".join(f"{family} {name}" for family, name in missing))
    print(
        f"Four-bar configurations of the series I, II, II*, III and III*: {counting.LETTER_COUNT} by the letters of "
        f"the dyads; Allievi counts {counting.ALLIEVI_COUNT}."
    )
