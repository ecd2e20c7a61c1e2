"""The command ``catalogue``: one module per command, with its options.

Here the commands are put together; `options` and `find_options` are what several of them share, `tables` prints,
`reading` reads linkages from files.  Only `main` and `app` are for others.  The module of a command is imported when
the command is called for, or listed; it imports `api` and what lies below, late, so that ``--help`` is quick.
"""

from __future__ import annotations

import os
import sys
import warnings
from importlib import import_module
from typing import Any

import click

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
        code = run()
    except CatalogueError as error:
        print(f"catalogue: {error}", file=sys.stderr)
        code = error.exit_code
    except (KeyboardInterrupt, click.Abort):
        print("catalogue: interrupted; what was finished is kept", file=sys.stderr)
        code = INTERRUPTED
    except BrokenPipeError:  # the reader of our output has gone
        sys.stderr.close()
        code = 141
    sys.exit(code)


class Commands(click.Group):
    """Commands by name, each an object of that name in a module that is imported when it is called for, or listed."""

    def __init__(self, *args: Any, modules: dict[str, str], **more: Any) -> None:
        super().__init__(*args, **more)
        self.modules = modules

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002  # click gives it
        return [*self.modules, *self.commands]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in self.modules:
            return super().get_command(ctx, cmd_name)
        module = import_module(f".{self.modules[cmd_name]}", __name__)
        command: click.Command = getattr(module, cmd_name.replace("-", "_"))
        return command

    def resolve_command(self, ctx: click.Context, args: list[str]) -> Any:
        """Return the command; of one that is not there say which is meant, also of those not imported."""
        names = self.list_commands(ctx)
        if args[0] not in names:
            from difflib import get_close_matches

            near = ", ".join(map(repr, get_close_matches(args[0], names)))
            ctx.fail(f"No such command {args[0]!r}." + (f" Did you mean {near}?" if near else ""))
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write what each command does as a whole sentence, which click would cut off at the end of the line."""
        commands = {name: self.get_command(ctx, name) for name in self.list_commands(ctx)}
        with formatter.section("Commands"):
            formatter.write_dl([(name, one.get_short_help_str(1000)) for name, one in commands.items() if one])

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Without arguments print the help and end with exit code 2, as all versions of click do not."""
        if not args:
            click.echo(ctx.get_help())
            ctx.exit(2)
        return super().parse_args(ctx, args)

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command; `main` tells of Ctrl-C, without the empty line that click would print before."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt:
            raise click.Abort from None


FIND = Commands(
    "find",
    modules={"straight-line": "find", "circular-arc": "find", "dwell": "dwell"},
    help="Find guides: the point runs from (0, 0) to (stroke, 0) and every position is in that frame and unit.",
)
SPATIAL = Commands(
    "spatial",
    modules={"sweep": "spatial", "assemblies": "spatial"},
    help="Move a mechanism in space that is given by its hard points.",
)


@click.group(
    "catalogue",
    cls=Commands,
    modules={"build": "build", "classify": "classify", "census": "census", "show": "show", "measure": "measure",
             "improve": "improve", "trace": "trace", "plate": "plate", "atlas": "plate", "export": "export",
             "schema": "schema", "plugins": "plugins"},
    commands={"find": FIND, "spatial": SPATIAL},
    epilog="The first `find` builds the database, in half a minute or so. Exit codes: 0 answered, 1 nothing found, "
    "2 bad request, 3 bad linkage, 4 database, 5 plugin, 6 missing package, 130 interrupted.",
    context_settings={"show_default": True, "max_content_width": 120},
)  # fmt: skip
@click.version_option(__version__, message="mechanism-catalogue %(version)s", help="Print the version and exit.")
def app() -> None:
    """A design catalogue of guide mechanisms: linkages that carry a point along a straight line or an arc."""


def run() -> int:
    """Run the command of `sys.argv`; warnings of plugins become lines on standard error."""
    warnings.showwarning = lambda message, *_, **__: print(f"catalogue: {message}", file=sys.stderr)
    try:
        return app.main(standalone_mode=False) or 0
    except click.ClickException as error:
        error.show()
        return error.exit_code


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
