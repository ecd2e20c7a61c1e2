"""``catalogue study``: ask many requests, of a table or a grid, as one map."""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..errors import InvalidRequest
from ..progress import AGAIN
from .options import DB, ENGINE, PATH, PLUGINS, Argument, option
from .tables import FORCE, OUTPUT

if TYPE_CHECKING:
    import pandas as pd

    from ..study.run import State


@click.command(
    params=[
        Argument(
            "file", "FILE", "Requests: TOML with a table [grid] or tables [[request]], CSV or Parquet.", type=PATH
        ),
        option(
            "--out",
            "FILE",
            "Results file; a study that was killed goes on from it.",
            PATH,
            show_default="FILE with the suffix .study",
        ),
        ENGINE,
        option("--table", "FILE", "Write a row a request, as CSV or Parquet by suffix.", OUTPUT),
        option("--map", "FILE", "Draw the map of the two largest axes as a page of HTML.", OUTPUT),
        option(
            "--value",
            "NAME",
            "Value of the map: score, size, deviation, min_transmission or allowance.",
            default="score",
        ),
        option("--front", "FILE", "Draw the Pareto front of the first request as a page of HTML.", OUTPUT),
        FORCE,
        DB,
        PLUGINS,
    ]
)
def study(
    file: Path,
    out: Path | None,
    engine: str,
    table: Path | None,
    map: Path | None,
    value: str,
    front: Path | None,
    db: Path | None,
    plugins: Sequence[str],
) -> None:
    """Ask many requests as one map: no answer is worse than that to a tighter request.

    Tighter requests come first; their answers are starts of looser ones. Requests without an answer
    carry advice. The table is the same on every engine, and after a kill: run the command again to
    continue.

    \b
    catalogue study chart.toml --engine processes:4 --table chart.csv --map chart.html
    """
    from ..api import open
    from ..study.study import Study

    if table is not None and table.suffix not in (".csv", ".parquet"):
        raise InvalidRequest(f"--table {table} has neither suffix, .csv nor .parquet")
    asked = Study.read(file, out or file.with_suffix(".study"))
    with open(db, plugins=plugins) as catalogue, _progress() as report:
        asked.run(catalogue, engine=engine, report=report)
    found = asked.to_pandas()
    if table is not None:
        _write(found, table)
    if map is not None:
        asked.map(map, value=value)
    if front is not None:
        asked.front(front)
    counts = Counter(found["status"])
    told = {"answers": "with answers", "none": "without, with advice", "failed": "failed"}
    print(
        f"{len(found)} requests: {', '.join(f'{counts[name]} {text}' for name, text in told.items() if counts[name])}"
    )
    print(f"results: {asked.path}")


def _write(found: pd.DataFrame, table: Path) -> None:
    from ..folders import replacing

    with replacing(table) as part:
        if table.suffix == ".csv":
            part.write(found.to_csv(index=False).encode())
        else:
            found.to_parquet(part, index=False)


@contextmanager
def _progress() -> Iterator[Callable[[State], None]]:
    """Yield a function that prints progress on standard error, now and then, with the time left."""
    last = time.monotonic()

    def report(state: State) -> None:
        nonlocal last
        if time.monotonic() - last > AGAIN:
            last = time.monotonic()
            told = f"round {state.round}: {state.done} of {state.wanted} requests"
            print(f"{told}, about {state.left:.0f} s left", file=sys.stderr, flush=True)

    yield report
