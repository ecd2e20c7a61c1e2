"""Options that several commands share."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

Db = Annotated[
    Path | None,
    typer.Option(
        "--db",
        envvar="CATALOGUE_DB",
        metavar="FILE",
        help="Database file.",
        show_default="in the user's data directory",
    ),
]
Plugins = Annotated[
    list[str] | None,
    typer.Option(
        "--plugins", metavar="DIR", help="Folder with plugins, besides those of CATALOGUE_PLUGINS; may be repeated."
    ),
]


class Format(StrEnum):
    """How an answer is printed."""

    table = "table"
    json = "json"
    csv = "csv"


Output = Annotated[Format, typer.Option("--format", help="How to print; messages go to standard error in any case.")]
