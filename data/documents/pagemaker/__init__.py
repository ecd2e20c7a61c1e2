"""Pages that are made of what the program says of itself: commands, columns, tables, series, named guides, Python.

`write` is called by ``conf.py`` before the sources are read.  Pages are written anew each time, where they differ;
pictures only if the program has changed since.
"""

from __future__ import annotations

import inspect
import re
import textwrap
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import click
import numpy as np

import catalogue
from catalogue.cli import app
from catalogue.curvature_theory.leading_error import EXACT
from catalogue.draw.cells import cells
from catalogue.draw.plate import file_name
from catalogue.folders import folder as folder_of
from catalogue.plugin.registry import Registry
from catalogue.series.named_guides import NamedGuide, named_guides
from catalogue.series.series import Parameter, Series
from catalogue.store.schema import described

from . import pictures
from .markdown import cell, plain, table
from .notebook import notebook
from .reference import columns, python


def write(folder: Path) -> None:
    """Write all pages and pictures into a folder."""
    every = Registry().series
    members = _members(every)
    pages = {
        "commands.md": commands(),
        "columns.md": columns(),
        "tables.md": tables(),
        "named.md": named(members),
        "python.md": python("catalogue", "Python"),
        "spatial.md": python("catalogue.spatial", "Python: mechanisms in space"),
        "plugin.md": python("catalogue.plugin", "Python: what a plugin imports", catalogue.__all__),
        "series.md": index(every),
        "my_x0.py": example(),
        "study.ipynb": notebook((folder.parent / "how-to" / "study.md").read_text("utf-8")),
        **{f"series/{file_name(code)}.md": page(one, every, members) for code, one in every.items()},
    }
    (folder / "series").mkdir(parents=True, exist_ok=True)
    for name, text in pages.items():
        file = folder / name
        if not file.exists() or file.read_text("utf-8") != text:
            file.write_text(text, "utf-8")
    pictures.draw(folder / "pictures", every.values())


def example() -> str:
    """Return the example of the plugins' guide."""
    text = (folder_of("plugins") / "README.md").read_text("utf-8")
    return text.partition("<!-- example-plugin -->\n```python\n")[2].partition("```")[0]


def commands() -> str:
    """Return what every command and option does, as click has it."""
    parts = ["# The command", "What `catalogue COMMAND --help` says, in one page."]
    for name, command, context in _commands(app, click.Context(app, info_name="catalogue")):
        usage = " ".join([context.command_path, *command.collect_usage_pieces(context)])
        text = inspect.cleandoc(command.help or "")
        example = re.compile(r"\x08\n(.+?)(?=\n\n|\Z)", re.S)
        text = example.sub(lambda found: f"```sh\n{found[1]}\n```", text)
        records = [record for one in command.get_params(context) if (record := one.get_help_record(context))]
        parts += [f"## {name}", f"```text\n{usage}\n```", text]
        parts.append(table(("option", "what it does"), [(cell(f"`{flags}`"), cell(told)) for flags, told in records]))
    return "\n\n".join(parts) + "\n"


def _commands(group: Any, context: click.Context, path: str = "") -> Iterator[tuple[str, Any, click.Context]]:
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        inner = click.Context(command, info_name=name, parent=context)
        if hasattr(command, "list_commands"):
            yield from _commands(command, inner, f"{path}{name} ")
        else:
            yield f"{path}{name}", command, inner


def tables() -> str:
    """Return the tables and views of a database with their columns, as `catalogue schema` lists them."""
    parts = ["# Tables of the database",
             "What `catalogue schema` says; every file says it too, in its table `description`. Lengths are canonical "
             "(origin the pole, x axis the pole tangent, unit ρ₀) or in strokes."]  # fmt: skip
    rows: list[tuple[str, ...]] = []
    head = ("column", "type", "unit", "meaning")
    for one in [*described(), None]:
        if one is not None and one.column_name:
            rows.append((f"`{one.column_name}`", one.type, one.unit, cell(one.meaning)))
            continue
        if rows:
            parts.append(table(head, rows))
            rows = []
        if one is not None:
            parts += [f"## `{one.table_name}`", f"{one.meaning} ({one.type})" if one.type == "view" else one.meaning]
    return "\n\n".join(parts) + "\n"


def index(every: Mapping[str, Series]) -> str:
    """Return the list of the series."""
    rows = [
        (f"[{plain(code)}](series/{file_name(code)}.md)", plain(one.title), _link(one.inverse, "series/"),
         ", ".join(one.families))
        for code, one in every.items()
    ]  # fmt: skip
    names = "\n".join(f"{code} <series/{file_name(code)}>" for code in every)
    return "\n\n".join([
        "# The series",
        f"Allievi (1895) sorts linkages by the way their curves of stationary curvature degenerate. The catalogue has "
        f"{len(every)} series; a starred one is the kinematic inversion of its twin, the fixed and the moving plane "
        "exchanged. Each page has the plate of the series, drawn by the same data and formulas from which its linkages "
        "are made. [The words](../theory.md) are explained on a page of their own.",
        table(("series", "what marks it", "inverse", "families"), rows),
        f"```{{toctree}}\n:hidden:\n\n{names}\n```\n",
    ])  # fmt: skip


def page(series: Series, every: Mapping[str, Series], members: Mapping[str, list[NamedGuide]]) -> str:
    """Return the page of a series: theory, plate, members with their parameters, what they guide."""
    twin = every[series.inverse]
    starred = series.source.startswith("inversion of ")
    told = twin if starred else series
    facts = [
        ("inverse", "itself" if twin is series else _link(series.inverse)),
        ("families", ", ".join(series.families)),
        ("source", f"{twin.source}, inverted" if starred else series.source),
        ("named guides", ", ".join(f"[{d.title}](../named.md#{d.name})" for d in members.get(series.code, [])) or "–"),
    ]
    doc = inspect.cleandoc(inspect.getmodule(told.guided).__doc__ or "")
    parts = [f"# {plain(series.code)}: {plain(series.title)}", _prose(doc), table(("", ""), facts)]
    parts += [f"```{{image}} ../pictures/{pictures.plate_name(series.code)}\n"
              f":alt: Plate of series {series.code}\n:width: 100%\n```",
              "The plate shows a linkage of each family and configuration: pole axes, the two cubics, inflection and "
              "return circle, the linkage, the points that it guides and their paths. A click enlarges."]  # fmt: skip
    parts += ["## Members", _members_table(series)]
    parts += ["## What is guided", _guided(series)]
    formulas = [("Linkages", told.members[0].pivots), ("Guided points", told.guided), ("Membership", told.classify)]
    said = [(what, inspect.getdoc(formula)) for what, formula in formulas]
    parts += ["## Formulas"] if any(text for _, text in said) else []
    if starred and any(text for _, text in said):
        parts.append(f"They are those of {_link(twin.code)}; fixed and moving pivots change places.")
    parts += [f"**{what}.** {_prose(text)}" for what, text in said if text]
    return "\n\n".join(parts) + "\n"


def _members_table(series: Series) -> str:
    rows = [
        (m.family, m.name, "; ".join(f"`{p.name}`: {plain(p.meaning)}, {_domain(p)}" for p in m.parameters) or "none")
        for m in series.members
    ]
    return table(("family", "member", "free parameters"), rows)


def _domain(parameter: Parameter) -> str:
    angle = parameter.meaning.endswith("[rad]")
    ends = [[np.degrees(v) if angle else v for v in interval] for interval in parameter.domain]
    return " or ".join(f"{a:.4g}{'°' * angle} to {b:.4g}{'°' * angle}".replace("-", "−") for a, b in ends)


def _guided(series: Series) -> str:
    """Return what the linkages of the plate guide, by orders of contact."""
    rows = []
    for k, shown in enumerate(cells(series), 1):
        orders: dict[int, list[str]] = {}
        for one in shown.guided:
            orders.setdefault(int(one.order), []).append(one.label)
        told = [f"{'exact' if order == EXACT else f'order {order}'}: {plain(', '.join(labels))}"
                for order, labels in sorted(orders.items(), reverse=True)]  # fmt: skip
        linkage = f"{shown.family}, {shown.member}"
        rows.append((f"Fig.\u00a0{k}", shown.configuration, linkage, "; ".join(told) or "no real pair"))
    return table(("", "configuration", "linkage", "guided, with the order of contact"), rows)


def named(members: Mapping[str, list[NamedGuide]]) -> str:
    """Return the gallery of the named guides."""
    of = {d.name: code for code, designs in members.items() for d in designs}
    parts = ["# Named guides",
             f"{len(named_guides())} linkages of the literature, drawn as published over their usual stroke. "
             "`catalogue show NAME` measures one and names the straightest held of its series beside it."]  # fmt: skip
    for d in named_guides().values():
        nominal = "circle" if d.circle else "straight line"
        error = "exact" if d.order == EXACT else f"deviation {d.deviation / d.stroke:.2g} of the stroke"
        parts += [
            f"({d.name})=\n## {d.title}",
            f"```{{image}} pictures/{d.name}.svg\n:alt: {d.title}\n:width: 100%\n```",
            f"`catalogue show {d.name}` · {d.family} · {nominal}, {error}"
            + (f" · series {_link(of[d.name], 'series/')}" if d.name in of else ""),
            f"{plain(d.place)}",
            f"Proportions: {plain(d.proportions)}.",
            f"Source: {plain(d.source)}.",
        ]
    return "\n\n".join(parts) + "\n"


def _members(every: Mapping[str, Series]) -> dict[str, list[NamedGuide]]:
    """Return the named guides by the series that they belong to."""
    designs = list(named_guides().values())
    found: dict[str, list[NamedGuide]] = {}
    memberships = catalogue.classify(np.concatenate([d.linkage.pivots for d in designs]))
    for design, one in zip(designs, memberships, strict=True):
        for code in one.series:
            found.setdefault(code, []).append(design)
    return {code: found[code] for code in every if code in found}


def _prose(text: str) -> str:
    return "\n\n".join(cell(part) for part in textwrap.dedent(text).split("\n\n"))


def _link(code: str, folder: str = "") -> str:
    return f"[{plain(code)}]({folder}{file_name(code)}.md)"
