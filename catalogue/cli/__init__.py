"""The command ``catalogue``: one module per command.

`options` and `find_options` hold shared options, `tables` prints, `reading` reads linkages from
files. Other packages use only `main` and `app`.  A command's module is imported when it runs or is
listed; it imports `api` late, to keep ``--help`` fast.
"""

from __future__ import annotations

import logging
import os
import signal
import sys
import threading
import warnings
from collections.abc import Callable
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any

import click

from .. import interrupt
from ..errors import CatalogueError, InvalidRequest, PluginError, printable, quoted, shortened
from ..installed import fault, is_whole

#: Version; unknown if another package has overwritten our `__init__`, which `main` reports.
VERSION = getattr(sys.modules[__name__.rpartition(".")[0]], "__version__", "unknown")
#: Exit code when the reader of our output has closed the pipe: 128 + SIGPIPE, as shells report it.
UNREAD = 141
#: Longest error message [characters]: more fills a screen, and quotes a name too long for any file.
LINE = 1000


def main() -> None:
    """Run the command line; an expected error is one line and an exit code."""
    guarded = signal.getsignal(signal.SIGINT) is interrupt.end
    try:
        code = _outcome(guarded)
    except KeyboardInterrupt:  # a second Ctrl-C, while the first is reported
        code = interrupt.INTERRUPTED
    if guarded:
        signal.signal(signal.SIGINT, interrupt.end)
        if code == interrupt.INTERRUPTED:  # immediately: after Ctrl-C within `exec`, Python would end by a signal
            with suppress(OSError, ValueError):
                sys.stdout.flush()
            os._exit(code)
    if "catalogue.plugin.registry" in sys.modules and sys.stdout is not sys.__stdout__ and _is_file(sys.stdout):
        sys.stdout = sys.stderr  # what a plugin prints at exit is not part of the answer
    sys.exit(code)


def _outcome(guarded: bool) -> int:
    """Run the command, report errors, and return the exit code.

    Parameters
    ----------
    guarded : bool
        Whether Ctrl-C has ended the process immediately so far; from here on it raises.
    """
    _keep_standard_output()
    # The matrices are small: threads of linear algebra cost more than they save.  NumPy reads this
    # on import.
    for name in ("OMP", "OPENBLAS", "MKL"):
        os.environ.setdefault(f"{name}_NUM_THREADS", "1")
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # closed by the caller
            setattr(sys, name, Path(os.devnull).open("w", encoding="utf-8"))  # noqa: SIM115  # until exit
    sys.unraisablehook = _interrupt_again
    assert logging.lastResort is not None  # Python's own handler
    logging.lastResort.addFilter(_is_no_interrupt)
    try:
        if guarded:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        if not is_whole():
            raise PluginError(fault())
        code = run()
        if sys.stdout is not None:
            sys.stdout.flush()  # report a full disk here, not at exit of Python
    except CatalogueError as error:
        code = _report(str(error), error.exit_code)
    except (KeyboardInterrupt, click.Abort) as error:
        where = f" in {error}" if str(error) else ""
        code = _report(interrupt.MESSAGE.replace(";", f"{where};"), interrupt.INTERRUPTED)
    except BrokenPipeError:
        code = _discard_output(UNREAD)
    except OSError as error:
        what = error.filename or "what is to be printed"
        code = _discard_output(_report(f"{what} cannot be read or written: {error.strerror}", InvalidRequest.exit_code))
    except UnicodeEncodeError as error:
        code = _report(f"{quoted(error.object)} is no text that can be read or written here", InvalidRequest.exit_code)
    except MemoryError:
        code = _report("there is not enough memory: ask for less at once", InvalidRequest.exit_code)
    return code


def _report(text: str, code: int) -> int:
    """Print an error on one line of bounded length, and return the exit code."""
    with suppress(OSError):  # standard error is closed
        print(f"catalogue: {shortened(text, LINE)}", file=sys.stderr, flush=True)
    return code


def _discard_output(code: int) -> int:
    """Discard unwritten output, which Python would retry at exit, and return the exit code."""
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return code


class Commands(click.Group):
    """A group of commands whose modules are imported when a command runs or is listed."""

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
        """Find the command.

        Suggest similar names, also of modules not imported, for an unknown one.
        """
        names = self.list_commands(ctx)
        if args[0] not in names:
            from difflib import get_close_matches

            near = ", ".join(map(repr, get_close_matches(args[0], names)))
            ctx.fail(f"No such command {args[0]!r}." + (f" Did you mean {near}?" if near else ""))
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the summary of each command in full, where click would truncate it."""
        commands = {name: self.get_command(ctx, name) for name in self.list_commands(ctx)}
        with formatter.section("Commands"):
            formatter.write_dl([(name, one.get_short_help_str(1000)) for name, one in commands.items() if one])

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse arguments.

        Without any, print the help and exit with code 2 in all versions of click.
        """
        if not args and not ctx.resilient_parsing:  # not during shell completion
            click.echo(ctx.get_help())
            ctx.exit(2)
        try:
            return super().parse_args(ctx, args)
        except click.NoSuchOption as error:
            named = f"`{ctx.command_path} {' | '.join(self.list_commands(ctx))}`"
            told = f"{error.format_message()} It may be one of a command that has to be named first: {named}."
            raise click.UsageError(told, ctx) from None


FIND = Commands(
    "find",
    modules={"straight-line": "find", "circular-arc": "find", "dwell": "dwell"},
    help="Find linkages that guide a point from (0, 0) to (stroke, 0); all positions are in this frame.",
)
SPATIAL = Commands(
    "spatial",
    modules={"sweep": "spatial", "assemblies": "spatial", "fit": "spatial"},
    help="Move, assemble and fit mechanisms in space, given by their hard points.",
)


@click.group(
    "catalogue",
    cls=Commands,
    modules={
        "build": "build",
        "classify": "classify",
        "census": "census",
        "study": "study",
        "show": "show",
        "sheet": "sheet",
        "measure": "measure",
        "improve": "improve",
        "trace": "trace",
        "plate": "plate",
        "atlas": "plate",
        "export": "export",
        "schema": "schema",
        "serve": "serve",
        "plugins": "plugins",
        "doctor": "doctor",
    },
    commands={"find": FIND, "spatial": SPATIAL},
    epilog="The first `find` builds the database, in about half a minute. Shell completion: "
    '`eval "$(_CATALOGUE_COMPLETE=bash_source catalogue)"` in bash; zsh_source or fish_source in other shells. Exit '
    "codes: 0 answered, 1 nothing found, 2 invalid request, 3 invalid linkage, 4 database, 5 plugin, 6 missing "
    "package, 130 interrupted.",
    context_settings={"show_default": True, "max_content_width": 120},
)
@click.version_option(VERSION, message="mechanism-catalogue %(version)s", help="Print the version and exit.")
def app() -> None:
    """Find, measure and draw guide mechanisms: linkages that guide a point along a path."""


def run() -> int:
    """Run the command in `sys.argv`; print warnings as lines on standard error."""
    warnings.showwarning = lambda message, *_, **__: print(printable(f"catalogue: {message}"), file=sys.stderr)
    try:
        if os.environ.get("_CATALOGUE_COMPLETE"):
            app.main(prog_name="catalogue")  # of shell completion; it ends the process
        # `app.main` would print an empty line on Ctrl-C.
        with app.make_context("catalogue", sys.argv[1:]) as context:
            return app.invoke(context) or 0
    except click.exceptions.Exit as ended:
        return ended.exit_code
    except click.ClickException as error:
        click.UsageError(shortened(error.format_message(), LINE), getattr(error, "ctx", None)).show()
        return error.exit_code


def _keep_standard_output() -> None:
    """Reserve standard output for the command; other writers reach standard error."""
    was = sys.__stdout__
    if was is None or sys.stdout is not was or not (_is_file(was) and _is_file(sys.stderr)):
        return
    own, lines = os.dup(was.fileno()), was.isatty() or -1
    sys.stdout = open(own, "w", lines, was.encoding, "backslashreplace", closefd=False)  # noqa: SIM115  # until exit
    os.dup2(sys.stderr.fileno(), was.fileno())


def _is_file(stream: Any) -> bool:
    try:
        return bool(stream.fileno() >= 0)
    except (AttributeError, OSError, ValueError):
        return False


def _is_no_interrupt(record: logging.LogRecord) -> bool:
    """Filter out Ctrl-C during the closing of a connection: it is raised as well as logged."""
    return not (record.exc_info and isinstance(record.exc_info[1], KeyboardInterrupt))


def _interrupt_again(unraisable: Any, told: Callable[[Any], object] = sys.unraisablehook) -> None:
    """Repeat a Ctrl-C from a garbage collection, from which no exception escapes."""
    if issubclass(unraisable.exc_type, KeyboardInterrupt):
        from ..foreign_code import press_ctrl_c

        threading.Timer(0.05, press_ctrl_c).start()
    else:
        told(unraisable)
