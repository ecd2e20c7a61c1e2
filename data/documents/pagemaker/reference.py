"""The pages of reference for Python: columns of results and public names, as their docstrings have them."""

from __future__ import annotations

import importlib
import inspect
import re
from collections.abc import Mapping, Sequence
from types import GenericAlias
from typing import Any

from numpydoc.docscrape import NumpyDocString

import catalogue

from .markdown import cell, table


def columns() -> str:
    """Return what each column of a result means, in the order in which it is printed."""
    known = _attributes(catalogue.Candidate)
    own = _attributes(catalogue.Stretch)
    return "\n\n".join([
        "# Columns of a result",
        "What `find`, `improve`, `show` and `measure` print with `--format json` or `csv`, the columns of "
        "`Found.to_pandas()` and the attributes of a `catalogue.Candidate`. Lengths are in `unit`, that of a request; "
        "angles are in degrees. `null` (Python `None`): there is no such thing.",
        _columns(catalogue.Candidate.columns(), known),
        "## Of `measure` besides",
        _columns([name for name in catalogue.Stretch.columns() if name not in known], own),
        "## Of a motion",
        "What `trace` prints and `Candidate.motion` returns, a row per position; derivatives are by the angle of the "
        "drive.",
        _columns(list(_attributes(catalogue.GuideMotion)), _attributes(catalogue.GuideMotion)),
    ]) + "\n"  # fmt: skip


def _columns(names: Sequence[str], known: Mapping[str, tuple[str, str]]) -> str:
    rows = []
    for name in names:
        kind, text = known[name]
        meaning, unit = _parted(text)
        rows.append((f"`{name}`", cell(kind), cell(unit), cell(meaning)))
    return table(("column", "type", "unit", "meaning"), rows)


def _parted(text: str) -> tuple[str, str]:
    """Return a meaning without its unit, and the unit, which stands in brackets before a full stop or semicolon."""
    found = re.search(r" \[((?:deg|rad|length|1/)[^\]]*)\]", text)
    return (text.replace(found[0], "", 1), found[1]) if found else (text, "")


def _attributes(of: type) -> dict[str, tuple[str, str]]:
    """Return type and meaning of the attributes that a class documents, and of its properties, by name."""
    found: dict[str, tuple[str, str]] = {}
    for one in NumpyDocString(inspect.getdoc(of) or "")["Attributes"]:
        text = " ".join(one.desc)
        kinds = one.type.split(", ") if one.type.count(",") == one.name.count(",") else None
        for i, name in enumerate(one.name.split(", ")):
            kind = kinds[i] if kinds else one.type
            there = re.match(r"See `(catalogue[\w.]*)\.(\w+)`", text)
            if there:
                _, meaning = _attributes(getattr(importlib.import_module(there[1]), there[2])).get(name, ("", text))
            else:
                meaning = text
            found[name] = (kind.removeprefix("ndarray of ").removeprefix("ndarray"), meaning)
    for name, member in inspect.getmembers(of):
        if name not in found and inspect.getdoc(member) and not callable(member) and not name.startswith("_"):
            found[name] = ("", " ".join((inspect.getdoc(member) or "").split()))
    return found


def python(module: str, title: str, told: Sequence[str] = ()) -> str:
    """Return the page of a module: each public name with its docstring, those that are told elsewhere only by name."""
    there = importlib.import_module(module)
    parts: dict[str, list[str]] = {"Functions": [], "Classes": [], "Errors": []}
    values, elsewhere = [], []
    for name in sorted(there.__all__, key=str.casefold):
        value = getattr(there, name)
        kind, directive = _kind(value)
        if name in told:
            elsewhere.append(f"{{py:obj}}`catalogue.{name}`")
        elif kind:
            members = "\n   :members:" * (directive == "autoclass")
            parts[kind].append(f".. {directive}:: {module}.{name}{members}")
        else:
            values.append((f"`{name}`", f"`{_value(value)}`".replace("|", "\\|")))
    doc = (inspect.getdoc(there) or "").partition("\n\n")[0]
    said = [f"# {title}", f"`{module}`: {cell(doc)}"]
    said += [f"Besides what is told here: {', '.join(elsewhere)}."] if elsewhere else []
    for kind, directives in parts.items():
        if directives:
            said += [f"## {kind}", "```{eval-rst}\n" + "\n\n".join(directives) + "\n```"]
    return "\n\n".join([*said, *(["## Types and values", table(("name", "value"), values)] if values else [])]) + "\n"


def _kind(value: Any) -> tuple[str, str]:
    """Return under which heading a public name stands, and its directive; nothing of a plain value."""
    if isinstance(value, GenericAlias):
        return "", ""
    if inspect.isclass(value):
        return ("Errors", "autoexception") if issubclass(value, Exception) else ("Classes", "autoclass")
    return ("Functions", "autofunction") if callable(value) else ("", "")


def _value(value: Any) -> str:
    """Return a plain value on one line; of a mapping its keys."""
    text = ", ".join(value) if isinstance(value, Mapping) else repr(value)
    return " ".join(text.replace("numpy.", "np.").split())
