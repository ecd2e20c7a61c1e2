"""``catalogue build``: fill the database."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from .options import Db, Plugins


def build(
    count: Annotated[
        int | None, typer.Option(metavar="N", help="Guides wanted.", show_default="100000, or as begun")
    ] = None,
    series: Annotated[
        list[str] | None, typer.Option("--series", metavar="CODE", help="Only this series; may be repeated.")
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of the sampling.", show_default="0, or as begun")] = None,
    processes: Annotated[
        int | None, typer.Option(metavar="N", help="Worker processes.", show_default="one per processor")
    ] = None,
    db: Db = None,
    plugins: Plugins = None,
) -> None:
    """Draw linkages of each series, trace what they guide and store what is in proportion.

    Same seed and count, same content. A build that is interrupted, even killed, loses nothing that was finished: run it
    again and it goes on.
    """
    from ..facade import open
    from ..progress import shown

    with open(db, plugins=plugins or (), build=False) as catalogue:
        with shown(quiet=False, label="building the catalogue") as report:
            done = catalogue.build(count=count, series=series or (), seed=seed, processes=processes, report=report)
        if not done.rows:
            print(
                f"nothing to do: {catalogue.database.path} holds {done.guides} guides of these series", file=sys.stderr
            )
    if done.failed:
        raise typer.Exit(5)
