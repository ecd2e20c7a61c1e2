"""``--config``: read options of a command from a TOML file."""

from __future__ import annotations

import tomllib
from typing import Any

import click

from ..errors import InvalidRequest, quoted
from ..find.names import SINGULAR
from ..folders import expanded

#: Options by the names of a `Request`.
OPTIONS = {**SINGULAR, "desires": "desire"}
#: Options not permitted in the file.
NOT_ASKED = ("config", "force", "legend", "help")


def options_from_file(file: str, command: click.Command) -> dict[str, Any]:
    """Read option values by parameter name from a TOML file, or from a request in TOML.

    Raises
    ------
    InvalidRequest
        If the file cannot be read, or has an unknown key.
    """
    try:
        given = tomllib.loads(expanded(file).read_text("utf-8-sig"))
    except (OSError, ValueError, RecursionError) as error:  # invalid TOML, UTF-8 or file name
        raise InvalidRequest(f"cannot read {file}: {error}") from None
    known = {
        one.opts[0].lstrip("-"): one
        for one in command.params
        if isinstance(one, click.Option) and one.name not in NOT_ASKED
    }
    found: dict[str, Any] = {}
    for key, value in given.items():
        name = key.replace("_", "-")
        if name == "path":
            if value != command.name:
                raise InvalidRequest(f"{file}: path is {quoted(value)}, but the command is `find {command.name}`")
            continue
        name = OPTIONS.get(name, name)
        if name == "rank-by" and isinstance(value, list):
            name = "pareto"
        if isinstance(value, dict) and name == "desire":
            value = [f"{what}={':'.join(map(str, numbers))}" for what, numbers in value.items()]
        if name not in known:
            from difflib import get_close_matches

            near = get_close_matches(name, known, n=1)
            raise InvalidRequest(
                f"{file}: `find {command.name}` has no option {quoted(key)}"
                + (f"; did you mean {near[0]!r}?" if near else "")
            )
        found[str(known[name].name)] = _value(f"{file}: {key}", value, known[name])
    return found


def _value(name: str, value: object, one: click.Option) -> Any:
    """Convert a value to words of the command line; that of a switch to True or False."""
    if one.is_flag:
        if not isinstance(value, bool):
            raise InvalidRequest(f"{name} must be true or false, not {quoted(value)}")
        return value
    if isinstance(value, list) and one.nargs > 1:
        return [_to_word(name, part) for part in _flatten(value)]
    if isinstance(value, list) and one.multiple:
        return [_to_word(name, part) for part in value]
    return [_to_word(name, value)] if one.multiple else _to_word(name, value)


def _to_word(name: str, value: object) -> str:
    if isinstance(value, list):
        return ",".join(_to_word(name, part) for part in value)
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise InvalidRequest(f"{name} cannot be {quoted(value)}")
    return str(value)


def _flatten(value: list[Any]) -> list[Any]:
    return [part for one in value for part in (one if isinstance(one, list) else [one])]
