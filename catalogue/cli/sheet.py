"""``catalogue sheet``: write the data sheet of a guide for the workshop."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import click

from ..errors import InvalidRequest
from .options import DB, PLUGINS, SHARE, Argument, option
from .references import HELP, REFERENCE, keep, resolve
from .tables import FORCE, OUTPUT
from .units import UNIT, length, unit, warn_of_unit


@click.command(
    params=[
        Argument("reference", REFERENCE, HELP),
        option("--out", "FILE", "File to write: PDF or HTML by suffix.", OUTPUT, required=True),
        option("--paper", None, "Paper size.", click.Choice(["a4", "letter"]), default="a4"),
        UNIT,
        option(
            "--scale", "A:B", "Scale of the drawing, such as 1:2.", show_default="the largest standard one that fits"
        ),
        length("--point", "X Y", "Guided point of a linkage from a file, in the position of its pivots.", nargs=2),
        FORCE,
        DB,
        SHARE,
        PLUGINS,
    ]
)
def sheet(
    reference: str,
    out: Path,
    paper: str,
    scale: str | None,
    point: tuple[float, float] | None,
    db: Path | None,
    plugins: Sequence[str],
) -> None:
    """Write a one-page data sheet: drawing, lengths with tolerances, limits, curves.

    Of a mechanism of many bars: drawing, lengths, joints, range of the drive, curves.

    Lengths are in the unit of the guide, or converted to --unit; an unknown unit is taken as
    millimetres, with a note on the sheet.

    \b
    catalogue sheet CODE --out guide.pdf --paper letter
    """
    from ..draw.datasheet_file import KINDS
    from ..paper import kind_of

    kind_of(out, KINDS)
    every = resolve(reference, point, db, plugins, chains=True)
    if len(every) != 1:
        raise InvalidRequest(f"{reference} holds {len(every)} mechanisms: a sheet shows one")
    every[0].sheet(out, paper=paper, unit=unit(), scale=scale)
    keep(every[0])
    print(f"written: {out}", file=sys.stderr)
    warn_of_unit(every[0])
