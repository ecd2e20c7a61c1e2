"""Commands whose tables help and ``--legend`` explain, column by column; requests from files of TOML."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from typing import Any

import click

from ..errors import InvalidRequest, quoted
from ..find.columns import TABLE, Column
from ..folders import expanded
from .options import option

#: Options that are no part of a request.
NOT_ASKED = ("config", "force", "legend", "help")


class Tabled(click.Command):
    """A command that prints a table: `table` names its columns, `columns` says what these and those of CSV mean."""

    def __init__(self, *args: Any, table: Sequence[str], columns: Mapping[str, Column], **more: Any) -> None:
        super().__init__(*args, **more)
        self.table, self.columns = table, columns
        self.params.append(_legend())

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write what the columns of the table mean."""
        with formatter.section("Columns of the table"):
            formatter.write_dl([(one.plain, one.told) for one in map(self.columns.__getitem__, self.table)])
        super().format_epilog(ctx, formatter)


def print_legend(table: Sequence[str], columns: Mapping[str, Column]) -> None:
    """Print what each column means: those of the table, in its order, then those that only CSV and JSON have."""
    from .tables import print_table

    names = [*table, *(name for name in columns if name not in {*table, *TABLE})]
    rows = [
        [columns[name].plain if name in table else "", "" if name in TABLE and name != "code" else name,
         columns[name].unit, columns[name].meaning]
        for name in names
    ]  # fmt: skip
    print_table("Columns", ["column", "in CSV and JSON", "unit", "~meaning"], rows, "length: in the unit of the output")


def _legend() -> click.Option:
    def told(ctx: click.Context, param: click.Parameter, given: bool) -> None:  # noqa: ARG001  # click gives it
        if given and not ctx.resilient_parsing and isinstance(ctx.command, Tabled):
            print_legend(ctx.command.table, ctx.command.columns)
            ctx.exit()

    return click.Option(
        ["--legend"], is_flag=True, is_eager=True, expose_value=False, callback=told,
        help="Say what each column means, and exit.",
    )  # fmt: skip


def _configured(ctx: click.Context, param: click.Parameter, file: str | None) -> None:  # noqa: ARG001  # click gives it
    if file is not None and not ctx.resilient_parsing:
        ctx.default_map = {**(ctx.default_map or {}), **request_of(file, ctx.command)}


def request_of(file: str, command: click.Command) -> dict[str, Any]:
    """Return what a file of TOML gives to the options of a command, by their parameters.

    Raises
    ------
    InvalidRequest
        If it cannot be read, or has a key that no option has.
    """
    try:
        given = tomllib.loads(expanded(file).read_text("utf-8-sig"))
    except (OSError, ValueError, RecursionError) as error:  # no TOML, no UTF-8, no name of a file
        raise InvalidRequest(f"cannot read {file}: {error}") from None
    known = {
        one.opts[0].lstrip("-"): one
        for one in command.params
        if isinstance(one, click.Option) and one.name not in NOT_ASKED
    }
    found: dict[str, Any] = {}
    for key, value in given.items():
        name = key.replace("_", "-")
        if name not in known:
            from difflib import get_close_matches

            near = get_close_matches(name, known, n=1)
            raise InvalidRequest(
                f"{file}: `find {command.name}` has no option {quoted(key)}"
                + (f"; did you mean {near[0]!r}?" if near else "")
            )
        found[str(known[name].name)] = _value(f"{file}: {key}", value, known[name])
    return found


def _value(name: str, value: Any, one: click.Option) -> Any:
    """Return a value as the words of the command line that it stands for; of a switch True or False."""
    if one.is_flag:
        if not isinstance(value, bool):
            raise InvalidRequest(f"{name} must be true or false, not {quoted(value)}")
        return value
    if isinstance(value, list) and (one.multiple or one.nargs > 1):
        return [_word(name, part) for part in value]
    return [_word(name, value)] if one.multiple else _word(name, value)


def _word(name: str, value: Any) -> str:
    if isinstance(value, list):
        return ",".join(_word(name, part) for part in value)
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise InvalidRequest(f"{name} cannot be {quoted(value)}")
    return str(value)


CONFIG = option(
    "--config", "FILE", "Read options from a file of TOML, such as stroke = \"6in\"; those given here win.",
    is_eager=True, expose_value=False, callback=_configured,
)  # fmt: skip
