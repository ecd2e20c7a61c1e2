"""The reference of the command, made of its own help texts.

python tests/cli/reference.py            # prints it; `> catalogue/cli/README.md` renews the page
"""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from typing import Any

from typer.main import get_command

from catalogue.cli import app

HEAD = """\
# The command

What `catalogue COMMAND --help` says, in one page. `tests/cli/reference.py` makes it, a test keeps it as it is.
"""


def reference() -> str:
    """Return the page: every command with its text, arguments and options; what both paths share stands once."""
    commands = get_command(app()).commands  # type: ignore[attr-defined]  # a group has them
    find = commands.pop("find").commands
    shared = [option for option in find["straight-line"].params if option.name in _names(find["circular-arc"])]
    parts = [HEAD]
    for name, command in find.items():
        own = [option for option in command.params if name == "dwell" or option.name not in {s.name for s in shared}]
        parts.append(_section(f"find {name}", command.help, own))
    parts.append(_section("find straight-line, circular-arc", "Options of both.", shared))
    parts += [_section(name, command.help, command.params) for name, command in sorted(commands.items())]
    return "\n".join(parts)


def _names(command: Any) -> set[str]:
    return {option.name for option in command.params}


def _section(name: str, text: str, options: Any) -> str:
    return "\n".join([f"## {name}\n", inspect.cleandoc(text), "", *_rows(options)])


def _rows(options: Any) -> Iterator[str]:
    shown = [option for option in options if option.name != "help"]
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
