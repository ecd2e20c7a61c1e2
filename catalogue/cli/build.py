"""``catalogue build``: fill the database."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import click
from click.exceptions import Exit

from ..errors import InvalidRequest
from .options import DB, ENGINE, PLUGINS, SERIES, option


@click.command(
    params=[
        option(
            "--count",
            "N",
            "Number of guides to store.",
            int,
            show_default="12000, or the share of --series, or as begun; 3000 for a collection",
        ),
        SERIES,
        option("--seed", None, "Seed of the random sampling.", int, show_default="0, or as begun"),
        option("--processes", "N", "Number of worker processes.", int, show_default="one per processor"),
        ENGINE,
        option("--collection", "NAME", "Sample this collection of a plugin instead."),
        DB,
        PLUGINS,
    ]
)
def build(
    count: int | None,
    series: Sequence[str],
    seed: int | None,
    processes: int | None,
    engine: str,
    collection: str | None,
    db: Path | None,
    plugins: Sequence[str],
) -> None:
    """Build the database: sample each series, trace guided points, store sound linkages.

    Of similar linkages one is stored, since a search refines it. A larger count covers the series
    more densely.

    The same seed and count give the same content. An interrupted build, even a killed one, keeps
    its finished part: run the command again to continue.
    """
    from ..api import open
    from ..progress import shown

    if collection is not None and (series or processes is not None or engine != "processes"):
        raise InvalidRequest(
            "--series, --processes and --engine do not go with --collection: one process draws all of it"
        )
    label = "building the catalogue" if collection is None else f"drawing {collection}"
    with open(db, plugins=plugins, build=False) as catalogue:
        with shown(quiet=False, label=label) as report:
            if collection is None:
                done = catalogue.build(
                    count=count, series=series, seed=seed, processes=processes, engine=engine, report=report
                )
                held = f"{catalogue.database.path} holds {done.guides} guides of these series"
            else:
                done = catalogue.build_collection(collection, count=count, seed=seed, report=report)
                held = f"{done.guides} specimens of {collection} are stored"
        if not done.rows:
            print(f"nothing to do: {held}", file=sys.stderr)
    if done.failed:
        raise Exit(5)
