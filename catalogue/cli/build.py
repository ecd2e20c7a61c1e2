"""``catalogue build``: fill the database."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from ..errors import InvalidRequest
from .options import Db, Plugins, SeriesCodes


def build(
    count: Annotated[
        int | None,
        typer.Option(metavar="N", help="Guides wanted.", show_default="12000, or as begun; 3000 of a collection"),
    ] = None,
    series: SeriesCodes = None,
    seed: Annotated[int | None, typer.Option(help="Seed of the sampling.", show_default="0, or as begun")] = None,
    processes: Annotated[
        int | None, typer.Option(metavar="N", help="Worker processes.", show_default="one per processor")
    ] = None,
    collection: Annotated[
        str | None, typer.Option("--collection", metavar="NAME", help="Draw the specimens of this collection instead.")
    ] = None,
    db: Db = None,
    plugins: Plugins = None,
) -> None:
    """Draw linkages of each series, trace what they guide and store what is in proportion.

    Of linkages that are alike one is stored: a search refines what it finds. A larger count makes a finer net.

    Same seed and count, same content. A build that is interrupted, even killed, loses nothing that was finished: run it
    again and it goes on.
    """
    from ..api import open
    from ..progress import shown

    if collection is not None and (series or processes is not None):
        raise InvalidRequest("--series and --processes do not go with --collection: one process draws all of it")
    label = "building the catalogue" if collection is None else f"drawing {collection}"
    with open(db, plugins=plugins or (), build=False) as catalogue:
        with shown(quiet=False, label=label) as report:
            if collection is None:
                done = catalogue.build(
                    count=count, series=series or (), seed=seed, processes=processes, report=report
                )  # fmt: skip
                held = f"{catalogue.database.path} holds {done.guides} guides of these series"
            else:
                done = catalogue.build_collection(collection, count=count, seed=seed, report=report)
                held = f"{done.guides} specimens of {collection} are stored"
        if not done.rows:
            print(f"nothing to do: {held}", file=sys.stderr)
    if done.failed:
        raise typer.Exit(5)
