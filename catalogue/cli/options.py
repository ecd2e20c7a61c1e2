"""Options that several commands share."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

Db = Annotated[
    Path | None,
    typer.Option(
        envvar="CATALOGUE_DB", metavar="FILE", help="Database file.", show_default="in the user's data directory"
    ),
]
Plugins = Annotated[
    list[str] | None,
    typer.Option(
        "--plugins", metavar="DIR", help="Folder with plugins, besides those of CATALOGUE_PLUGINS; may be repeated."
    ),
]
Families = Annotated[
    list[str] | None, typer.Option("--family", metavar="NAME", help="Only this family; may be repeated.")
]
SeriesCodes = Annotated[
    list[str] | None, typer.Option("--series", metavar="CODE", help="Only this series; may be repeated.")
]
Order = Annotated[int, typer.Option(help="Least order of contact at the design position (99: exact).")]
PinsOnly = Annotated[bool, typer.Option("--pins-only", help="No sliding joint.")]
Effort = Annotated[int, typer.Option(metavar="N", help="How hard to search: starts, rounds and seconds grow with it.")]
Limit = Annotated[int, typer.Option(metavar="N", help="How many guides to list.")]


class Format(StrEnum):
    """How an answer is printed."""

    table = "table"
    json = "json"
    csv = "csv"


Output = Annotated[Format, typer.Option("--format", help="How to print; messages go to standard error in any case.")]
