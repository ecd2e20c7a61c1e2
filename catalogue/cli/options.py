"""Build options, and define those that several commands share."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from ..problem.criteria import ANSWERS
from ..units import decimal
from .completion import complete_column

#: A file or a folder, existing or not.
PATH: Any = click.Path(path_type=Path)


class _Number(click.types.FloatParamType):
    """A number in the digits that `decimal` accepts."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if isinstance(value, str) and decimal(value) is None:
            self.fail(f"{value!r} is not a valid float.", param, ctx)
        return super().convert(value, param, ctx)


class _Whole(click.types.IntParamType):
    """A whole number in the digits that `decimal` accepts."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if isinstance(value, str) and decimal(value) is None:
            self.fail(f"{value!r} is not a valid integer.", param, ctx)
        return super().convert(value, param, ctx)


#: Parameter types by Python type.
READ = {float: _Number(), int: _Whole()}


class Argument(click.Argument):
    """An argument with a help text."""

    def __init__(self, name: str, metavar: str, help: str, **more: Any) -> None:
        super().__init__([name], metavar=metavar, **more)
        self.help = help

    def get_help_record(self, ctx: click.Context) -> tuple[str, str]:  # noqa: ARG002  # click gives it
        return str(self.metavar), self.help or ""


def option(flag: str, metavar: str | None, help: str, type: Any = str, **more: Any) -> click.Option:
    """Build an option; a parameter name may follow the flag after a space."""
    return click.Option(flag.split(), metavar=metavar, help=help, type=READ.get(type, type), **more)


def number(flag: str, metavar: str | None, help: str, **more: Any) -> click.Option:
    return option(flag, metavar, help, float, **more)


def several(flag: str, metavar: str, help: str, type: Any = str, **more: Any) -> click.Option:
    """Build an option that may be repeated."""
    return option(flag, metavar, help, type, multiple=True, **more)


def switch(flag: str, help: str, **more: Any) -> click.Option:
    return click.Option([flag], is_flag=True, help=help, **more)


DB = option(
    "--db",
    "FILE",
    "Database file.",
    PATH,
    show_default="CATALOGUE_DB, else in the user's data directory",
    is_eager=True,  # before output files, which must be others
)


def _share(ctx: click.Context, param: click.Parameter, address: str | None) -> None:  # noqa: ARG001  # click gives it
    """Set the folder of answers for this process and its workers."""
    if address is not None and not ctx.resilient_parsing:
        from ..guides.shared import SharedFolder

        SharedFolder(address).check()
        os.environ["CATALOGUE_SHARE"] = address


SHARE = option(
    "--share",
    "DIR",
    "Folder in which a team shares answers by their codes, beside your own; or an address that fsspec opens.",
    show_default="CATALOGUE_SHARE",
    is_eager=True,  # before codes are looked up
    expose_value=False,
    callback=_share,
)
PLUGINS = several("--plugins", "DIR", "Folder with plugins, in addition to CATALOGUE_PLUGINS; may be repeated.")
FAMILY = several("--family", "NAME", "Only this family; may be repeated.", shell_complete=complete_column("family"))
SERIES = several("--series", "CODE", "Only this series; may be repeated.", shell_complete=complete_column("series"))
ORDER = option("--order", None, "Minimum order of contact at the design position (99: exact).", int, default=0)
PINS_ONLY = switch("--pins-only", "Revolute joints only, no sliders.")
EFFORT_HELP = "Search N times as long, from more starting points"
EFFORT = option("--effort", "N", f"{EFFORT_HELP}.", int, default=1)
LIMIT = option("--limit", "N", "Maximum number of answers.", int, default=ANSWERS)
FORMAT = option(
    "--format",
    None,
    "Output format; messages always go to standard error.",
    click.Choice(["table", "json", "csv"]),
    default="table",
)
ENGINE = option(
    "--engine",
    "NAME",
    "Where the work is done: serial, processes, processes:N, dask, dask:N or dask:ADDRESS (extra `dask`).",
    default="processes",
)
#: Options of commands that query a database.
COMMON = (FORMAT, DB, SHARE, PLUGINS)


def is_given(name: str) -> bool:
    """Tell whether the user gave an option, on the command line or in a file."""
    source = click.get_current_context().get_parameter_source(name)
    return source in (ParameterSource.COMMANDLINE, ParameterSource.DEFAULT_MAP)
