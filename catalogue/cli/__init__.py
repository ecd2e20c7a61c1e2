"""The command ``catalogue``: one module per command, with its options.

Here the commands are put together; `options` and `find_options` are what several of them share, `tables` prints,
`reading` reads linkages from files.  Only `main` and `app` are for others; the modules import `api` and what lies
below, late, so that ``--help`` is quick.
"""

from __future__ import annotations

import os
import sys
import warnings
from functools import cache
from typing import Annotated

import typer

from .. import __version__
from ..errors import CatalogueError

#: Exit code after Ctrl-C.
INTERRUPTED = 130


def main() -> None:
    """Run the command line; every expected error is one line on standard error and a documented exit code."""
    _only_one_catalogue()
    # The matrices are small: more threads of linear algebra cost more than they bring.  NumPy reads this when imported.
    for name in ("OMP", "OPENBLAS", "MKL"):
        os.environ.setdefault(f"{name}_NUM_THREADS", "1")
    try:
        code = run(app())
        if code == INTERRUPTED:  # made of Ctrl-C by typer, without a word
            raise KeyboardInterrupt
    except CatalogueError as error:
        print(f"catalogue: {error}", file=sys.stderr)
        code = error.exit_code
    except KeyboardInterrupt:
        print("catalogue: interrupted; what was finished is kept", file=sys.stderr)
        code = INTERRUPTED
    except BrokenPipeError:  # the reader of our output has gone
        sys.stderr.close()
        code = 141
    sys.exit(code)


@cache
def app() -> typer.Typer:
    """Return the commands, put together."""
    from . import build, census, classify, dwell, find, plate, plugins, show

    commands = typer.Typer(
        name="catalogue",
        help="A design catalogue of guide mechanisms: linkages that carry a point along a straight line or an arc.",
        epilog="The first `find` builds the database, in half a minute or so. Exit codes: 0 answered, 1 nothing found, "
        "2 bad request, 3 bad linkage, 4 database, 5 plugin, 6 missing package, 130 interrupted.",
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        add_completion=False,
    )
    commands.callback()(common)
    find.app.command("dwell")(dwell.dwell)
    commands.add_typer(find.app, name="find")
    several = (build.build, classify.classify, census.census, show.show, plate.plate, plate.atlas, plugins.plugins)
    for command in several:
        commands.command()(command)
    return commands


def _version(wanted: bool) -> None:
    if wanted:
        print(f"mechanism-catalogue {__version__}")
        raise typer.Exit


def common(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Options before the command."""


def run(command: typer.Typer) -> int:
    """Run a command; warnings of plugins become lines on standard error."""
    warnings.showwarning = lambda message, *_, **__: print(f"catalogue: {message}", file=sys.stderr)
    try:
        command()
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else 1
    return 0


def _only_one_catalogue() -> None:
    """Another distribution installs a package of the same name; together they overwrite each other's files."""
    from importlib.metadata import PackageNotFoundError, distribution

    try:
        distribution("catalogue")
    except PackageNotFoundError:
        return
    print(
        "catalogue: the distribution `catalogue` is installed beside `mechanism-catalogue` and both own the package "
        "`catalogue`; uninstall both, then install the one you need, or use a virtual environment for each",
        file=sys.stderr,
    )
    sys.exit(5)
