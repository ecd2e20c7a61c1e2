"""``catalogue census``: count the stored mechanisms by series, family and configuration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import click

from ..guides.columns import Column
from ..progress import busy
from .options import COMMON
from .tables import Tabled, print_records, print_table, tell

#: Columns of the table, and what they mean.
TABLE = ("series", "family", "configuration", "dimension", "mechanisms", "guides", "named", "smallest", "remark")
COLUMNS = {
    "series": Column("series", "", "code of the series, or name of a collection", right=False),
    "family": Column("family", "", "which dyads, such as four-bar", right=False),
    "configuration": Column("conf.", "", "where the pivots stand: letters of the dyads", right=False),
    "dimension": Column("dim.", "", "number of free parameters of its largest member, up to similarity"),
    "mechanisms": Column("mech\u00adanisms", "", "number of stored mechanisms"),
    "guides": Column("guides", "", "number of stored guided points and slots of these mechanisms"),
    "named": Column("named", "", "number of named guides, stored besides the mechanisms and guides before"),
    "smallest": Column("1e-2, ...", "strokes", "smallest size of a stored guide with this deviation over stroke"),
    "remark": Column("remark", "", "reason for an empty cell", right=False),
}


@click.command(cls=Tabled, table=TABLE, columns=COLUMNS, params=[*COMMON])
def census(format: str, db: Path | None, plugins: Sequence[str]) -> None:
    """Count the stored mechanisms by series, family and configuration; explain empty cells."""
    from ..api import open
    from ..find import census as counting

    with open(db, plugins=plugins) as catalogue:
        with busy("counting"):
            cells = counting.census(catalogue.database, catalogue.registry)
        series = catalogue.registry.series
    levels = sorted({level for c in cells for level in c.smallest}, reverse=True)
    columns = [
        "series",
        "family",
        "configuration",
        "dimension",
        "mechanisms",
        "guides",
        "named",
        *(f">1e{k}" for k in levels),
    ]
    rows = [
        [
            c.series,
            c.family,
            c.configuration,
            c.dimension,
            c.mechanisms,
            c.guides,
            c.named,
            *(f"{c.smallest[level]:.3g}" if level in c.smallest else "-" for level in levels),
            c.remark,
        ]
        for c in cells
    ]
    if format != "table":
        print_records(format, [asdict(c) for c in cells], "", [*columns, "remark"], rows, meanings=COLUMNS)
        return
    title = "Census; under each deviation over stroke the least size over stroke"
    held = [row[:-1] for row in rows if not row[-1]]
    print_table(title, columns, held, "--legend explains the columns", meanings=COLUMNS, spare=_omitted_columns(levels))
    empty = sorted({c.remark for c in cells if c.remark})
    for remark in empty:
        tell(f"{remark}: " + ", ".join(f"{c.series} {c.family} {c.configuration}" for c in cells if c.remark == remark))
    mechanisms, guides, named = (sum(getattr(c, name) for c in cells) for name in ("mechanisms", "guides", "named"))
    tell(
        f"{len(cells)} cells, {mechanisms} mechanisms, {guides} guides; with {named} named guides apart, each a "
        f"mechanism of its own, {mechanisms + named} mechanisms and {guides + named} guides are stored"
    )
    for one in series.values():
        missing = counting.impossible(one, cells)
        if missing:
            tell(f"{one.code}: impossible are " + ", ".join(f"{family} {name}" for family, name in missing))
    tell(
        f"Four-bar configurations of the series I, II, II*, III and III*: {counting.LETTER_COUNT} by the letters of "
        f"the dyads; Allievi counts {counting.ALLIEVI_COUNT}."
    )


def _omitted_columns(levels: list[int]) -> list[str]:
    """List the columns to omit on a narrow terminal: every second level first."""
    return ["named", "dimension", "mechanisms", *(f"1e{k}" for k in sorted(levels, key=lambda k: (k % 2 == 0, k)))]
