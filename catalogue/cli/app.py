"""The commands and what they share."""

from __future__ import annotations

import sys
import warnings
from typing import Annotated, Any

import typer

from .. import __version__
from . import build, census, classify, dwell, find, plate, plugins, show

app = typer.Typer(
    name="catalogue",
    help="A design catalogue of guide mechanisms: linkages that carry a point along a straight line or an arc.",
    epilog="The first `find` builds the database, in a minute or so. Exit codes: 0 answered, 1 nothing found, 2 bad "
    "request, 3 bad linkage, 4 database, 5 plugin, 6 missing package, 130 interrupted.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    add_completion=False,
)
find.app.command("dwell")(dwell.dwell)
app.add_typer(find.app, name="find")
app.command()(build.build)
app.command()(classify.classify)
app.command()(census.census)
app.command()(show.show)
app.command()(plate.plate)
app.command()(plate.atlas)
app.command()(plugins.plugins)


def _version(wanted: bool) -> None:
    if wanted:
        print(f"mechanism-catalogue {__version__}")
        raise typer.Exit


@app.callback()
def common(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Options before the command."""


def run(command: typer.Typer) -> int:
    """Run a command; warnings of plugins become lines on standard error."""

    def show_line(message: Warning | str, *_: Any, **__: Any) -> None:
        print(f"catalogue: {message}", file=sys.stderr)

    warnings.showwarning = show_line
    try:
        command()
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else 1
    return 0
