"""Shell completion of values: names in the database, codes of answers, named guides."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable
from contextlib import closing, suppress
from pathlib import Path

import click

from ..errors import printable
from ..folders import answers_file, default_database, folder

Complete = Callable[[click.Context, click.Parameter, str], list[str]]
#: Number of latest answers to offer: more than fit on a screen of completions.
LATEST = 100


def complete_column(column: str) -> Complete:
    """Build a completer of the families, series or configurations in the database."""

    def offered(ctx: click.Context, param: click.Parameter, begun: str) -> list[str]:  # noqa: ARG001  # click gives it
        file = ctx.params.get("db") or default_database()
        query = f"SELECT DISTINCT {column} FROM mechanism ORDER BY {column}"  # nosec B608  # a column of our own
        return _matching(_column(file, query), begun)

    return offered


def references(ctx: click.Context, param: click.Parameter, begun: str) -> list[str]:  # noqa: ARG001  # click gives it
    """Complete named guides and codes of the latest answers."""
    names = [one["name"] for one in json.loads((folder("data") / "named_guides.json").read_text("utf-8"))]
    codes = _column(answers_file(), "SELECT code FROM answer ORDER BY number DESC LIMIT ?", LATEST)
    return _matching([*names, *codes], begun)


def _column(file: Path, query: str, *values: int) -> list[str]:
    """Return the results of a query on a file; nothing if it cannot be read."""
    with (
        suppress(sqlite3.Error, OSError),
        closing(sqlite3.connect(f"{file.resolve().as_uri()}?mode=ro", uri=True)) as one,
    ):
        return [printable(str(row[0])) for row in one.execute(query, values)]
    return []


def _matching(names: list[str], begun: str) -> list[str]:
    return [name for name in names if name.startswith(begun)]
