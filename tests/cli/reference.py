"""The reference of the command, made of its own help texts.

python tests/cli/reference.py            # prints it; `> catalogue/cli/README.md` renews the page
"""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from typing import Any

import click

from catalogue.cli import app

HEAD = """\
# The command

What `catalogue COMMAND --help` says, in one page. `tests/cli/reference.py` makes it, a test keeps it as it is.
"""


def reference() -> str:
    """Return the page: every command with its text, arguments and options; what both paths share stands once."""
    commands = _commands(app)
    find = _commands(commands.pop("find"))
    commands |= {f"spatial {name}": command for name, command in _commands(commands.pop("spatial")).items()}
    shared = [option for option in find["straight-line"].params if option.name in _names(find["circular-arc"])]
    parts = [HEAD]
    for name, command in find.items():
        own = [option for option in command.params if name == "dwell" or option.name not in {s.name for s in shared}]
        parts.append(_section(f"find {name}", command.help, own))
    parts.append(_section("find straight-line, circular-arc", "Options of both.", shared))
    parts += [_section(name, command.help, command.params) for name, command in sorted(commands.items())]
    return "\n".join(parts)


def _commands(group: Any) -> dict[str, Any]:
    context = click.Context(group)
    return {name: group.get_command(context, name) for name in group.list_commands(context)}


def _names(command: Any) -> set[str]:
    return {option.name for option in command.params}


def _section(name: str, text: str, options: Any) -> str:
    plain = inspect.cleandoc(text).replace("\b\n", "")  # a mark of click's: the lines that follow are not wrapped
    return "\n".join([f"## {name}\n", plain, "", *_rows(options)])


def _rows(options: Any) -> Iterator[str]:
    shown = [*options]
    if shown:
        yield from ("| option | what it does |", "| --- | --- |")
    for option in shown:
        named = option.param_type_name == "option"
        flags = (
            ", ".join(f"`{flag}`" for flag in (*option.opts, *option.secondary_opts))
            if named
            else f"`{option.name.upper()}`"
        )
        yield f"| {flags} | {' '.join((option.help or '').split()).replace('|', chr(92) + '|')} |"
    if shown:
        yield ""


if __name__ == "__main__":
    print(reference(), end="")
