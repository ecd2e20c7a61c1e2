"""The command ``catalogue``: one module per command, with its options.

Here the commands are put together; `options` and `find_options` are what several of them share, `tables` prints,
`reading` reads linkages from files.  Only `main` and `app` are for others.  The module of a command is imported when
the command is called for, or listed; it imports `api` and what lies below, late, so that ``--help`` is quick.
"""

from __future__ import annotations

import logging
import os
import signal
import sys
import threading
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from pathlib import Path
from typing import Any

import click

from .. import interrupt
from ..errors import CatalogueError, InvalidRequest, PluginError, printable, quoted, shortened
from ..installed import fault, is_whole

#: Unknown where another package has put its own `__init__` in the place of ours, which `main` tells of.
VERSION = getattr(sys.modules[__name__.rpartition(".")[0]], "__version__", "unknown")
#: Exit code where the reader of our output has gone.
UNREAD = 141
#: Letters of an error, at most: a name that is too long for a file is too long for a line.
LINE = 1000


def main() -> None:
    """Run the command line; every expected error is one line on standard error and a documented exit code."""
    guarded = signal.getsignal(signal.SIGINT) is interrupt.end
    try:
        code = _outcome(guarded)
    except KeyboardInterrupt:  # once more, while the first was told of
        code = interrupt.INTERRUPTED
    if guarded:
        signal.signal(signal.SIGINT, interrupt.end)
        if code == interrupt.INTERRUPTED:  # at once: of a Ctrl-C in `exec` Python remembers to die at its end
            with suppress(OSError, ValueError):
                sys.stdout.flush()
            os._exit(code)
    if "catalogue.plugin.registry" in sys.modules and sys.stdout is not sys.__stdout__ and _is_file(sys.stdout):
        sys.stdout = sys.stderr  # what a plugin prints at the very end is no answer
    sys.exit(code)


def _outcome(guarded: bool) -> int:
    """Run the command, tell what went wrong, and return the exit code; what is `guarded` ends at once until then."""
    _keep_standard_output()
    # The matrices are small: more threads of linear algebra cost more than they bring.  NumPy reads this when imported.
    for name in ("OMP", "OPENBLAS", "MKL"):
        os.environ.setdefault(f"{name}_NUM_THREADS", "1")
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # closed by who called us
            setattr(sys, name, Path(os.devnull).open("w", encoding="utf-8"))  # noqa: SIM115  # for good
    sys.unraisablehook = _interrupt_again
    assert logging.lastResort is not None  # of Python's own
    logging.lastResort.addFilter(_is_no_interrupt)
    try:
        if guarded:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        if not is_whole():
            raise PluginError(fault())
        code = run()
        if sys.stdout is not None:
            sys.stdout.flush()  # a full disk is told of here, not when Python ends
    except CatalogueError as error:
        code = _told(str(error), error.exit_code)
    except (KeyboardInterrupt, click.Abort) as error:
        where = f" in {error}" if str(error) else ""
        code = _told(interrupt.TOLD.replace(";", f"{where};"), interrupt.INTERRUPTED)
    except BrokenPipeError:
        code = _unwritten(UNREAD)
    except OSError as error:
        what = error.filename or "what is to be printed"
        code = _unwritten(_told(f"{what} cannot be read or written: {error.strerror}", InvalidRequest.exit_code))
    except UnicodeEncodeError as error:
        code = _told(f"{quoted(error.object)} is no text that can be read or written here", InvalidRequest.exit_code)
    except MemoryError:
        code = _told("there is not enough memory: ask for less at once", InvalidRequest.exit_code)
    return code


def _told(text: str, code: int) -> int:
    """Print what went wrong as one line of bounded length, and return the exit code."""
    with suppress(OSError):  # nobody can be told
        print(f"catalogue: {shortened(text, LINE)}", file=sys.stderr, flush=True)
    return code


def _unwritten(code: int) -> int:
    """Let what could not be written be forgotten, which Python would try again at its end, and return the exit code."""
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return code


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
        if not args and not ctx.resilient_parsing:  # as when the shell completes
            click.echo(ctx.get_help())
            ctx.exit(2)
        try:
            return super().parse_args(ctx, args)
        except click.NoSuchOption as error:
            named = f"`{ctx.command_path} {' | '.join(self.list_commands(ctx))}`"
            told = f"{error.format_message()} It may be one of a command that has to be named first: {named}."
            raise click.UsageError(told, ctx) from None

    def make_context(self, *args: Any, **more: Any) -> click.Context:
        with _without_an_empty_line():
            return super().make_context(*args, **more)

    def invoke(self, ctx: click.Context) -> Any:
        with _without_an_empty_line():
            return super().invoke(ctx)


@contextmanager
def _without_an_empty_line() -> Iterator[None]:
    """Let `main` tell of Ctrl-C, before which click would print one."""
    try:
        yield
    except KeyboardInterrupt as error:
        raise click.Abort(*error.args) from None


FIND = Commands(
    "find",
    modules={"straight-line": "find", "circular-arc": "find", "dwell": "dwell"},
    help="Find guides: the point runs from (0, 0) to (stroke, 0) and every position is in that frame and unit.",
)
SPATIAL = Commands(
    "spatial",
    modules={"sweep": "spatial", "assemblies": "spatial", "fit": "spatial"},
    help="Move a mechanism in space that is given by its hard points.",
)


@click.group(
    "catalogue",
    cls=Commands,
    modules={"build": "build", "classify": "classify", "census": "census", "show": "show", "sheet": "sheet",
             "measure": "measure", "improve": "improve", "trace": "trace", "plate": "plate", "atlas": "plate",
             "export": "export", "schema": "schema", "serve": "serve", "plugins": "plugins", "doctor": "doctor"},
    commands={"find": FIND, "spatial": SPATIAL},
    epilog="The first `find` builds the database, in half a minute or so. The shell completes commands, options and "
    "names after `eval \"$(_CATALOGUE_COMPLETE=bash_source catalogue)\"`, others after zsh_source or fish_source. Exit "
    "codes: 0 answered, 1 nothing found, 2 bad request, 3 bad linkage, 4 database, 5 plugin, 6 missing package, "
    "130 interrupted.",
    context_settings={"show_default": True, "max_content_width": 120},
)  # fmt: skip
@click.version_option(VERSION, message="mechanism-catalogue %(version)s", help="Print the version and exit.")
def app() -> None:
    """A design catalogue of guide mechanisms: linkages that carry a point along a straight line or an arc."""


def run() -> int:
    """Run the command of `sys.argv`; warnings of plugins become lines on standard error."""
    warnings.showwarning = lambda message, *_, **__: print(printable(f"catalogue: {message}"), file=sys.stderr)
    try:
        return app.main(prog_name="catalogue", standalone_mode=False) or 0
    except click.ClickException as error:
        click.UsageError(shortened(error.format_message(), LINE), getattr(error, "ctx", None)).show()
        return error.exit_code


def _keep_standard_output() -> None:
    """Move standard output to where only the command writes: what a plugin, or a library in C, writes to its number
    goes to standard error."""
    was = sys.__stdout__
    if was is None or sys.stdout is not was or not (_is_file(was) and _is_file(sys.stderr)):
        return
    own, lines = os.dup(was.fileno()), was.isatty() or -1
    sys.stdout = open(own, "w", lines, was.encoding, "backslashreplace", closefd=False)  # noqa: SIM115  # a number, for good
    os.dup2(sys.stderr.fileno(), was.fileno())


def _is_file(stream: Any) -> bool:
    try:
        return bool(stream.fileno() >= 0)
    except (AttributeError, OSError, ValueError):
        return False


def _is_no_interrupt(record: logging.LogRecord) -> bool:
    """Return whether what is logged, where nobody asked for a log, is not a Ctrl-C that came while a connection was
    closed: it is raised as well."""
    return not (record.exc_info and isinstance(record.exc_info[1], KeyboardInterrupt))


def _interrupt_again(unraisable: Any, told: Callable[[Any], object] = sys.unraisablehook) -> None:
    """Repeat a Ctrl-C that came while Python collected garbage, where no exception gets out of."""
    if issubclass(unraisable.exc_type, KeyboardInterrupt):
        from ..foreign_code import press_ctrl_c

        threading.Timer(0.05, press_ctrl_c).start()
    else:
        told(unraisable)
