"""Answers printed: tables on a terminal, CSV and JSON; and written, to files that are not there."""

from __future__ import annotations

import csv
import json
import os
import re
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click
from click.exceptions import Exit

from ..errors import InvalidRequest, printable
from ..folders import is_folder

if TYPE_CHECKING:
    from ..find.candidate import Candidate
    from ..find.results import Results

T = TypeVar("T", bound="Results[Any]")


class _Output(click.Path):
    """A file to be written: one that is there, or a link, only with --force."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        file = Path(os.fsdecode(super().convert(value, param, ctx)))
        flag = param.opts[0] if param else "the option"
        if not (ctx and ctx.meta.get(FORCE_KEY)):
            refuse_existing(file, flag)
        return file


def refuse_existing(file: Path, flag: str) -> None:
    """Say that a file is there before work is done for it; a folder may be, for what is written into it."""
    if file.is_symlink() or (file.exists() and not file.is_dir()):
        raise InvalidRequest(f"{file} is there already: name another with {flag}, or overwrite it with --force")


FORCE_KEY = "catalogue.force"
OUTPUT: Any = _Output(path_type=Path)
FORCE = click.Option(
    ["--force"], is_flag=True, is_eager=True, expose_value=False, help="Overwrite a file that is there.",
    callback=lambda ctx, _, given: ctx.meta.update({FORCE_KEY: given}),
)  # fmt: skip


def print_table(title: str, columns: Sequence[str], rows: Iterable[Sequence[Any]], caption: str = "") -> None:
    """Print a table; columns whose heading begins with ``>`` are set to the right, None in a cell is a dash."""
    from rich import box
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    def plain(cell: Any) -> Text:  # brackets in a text are no markup
        text = "-" if cell is None else str(cell)
        return Text(text if text.isprintable() else printable(text))

    table = Table(
        title=Text(title),
        caption=Text(caption) if caption else None,
        box=box.SIMPLE_HEAD,
        title_justify="left",
        caption_justify="left",
    )
    for heading in columns:
        table.add_column(
            Text(heading.removeprefix(">")), justify="right" if heading[:1] == ">" else "left", overflow="fold"
        )
    for row in rows:
        table.add_row(*map(plain, row))
    console = Console()
    if not console.is_terminal:
        console = Console(width=max(100, 14 * len(columns)))
    console.print(table)


def print_json(given: Any) -> None:
    """Print JSON, which knows no NaN."""
    print(json.dumps(given, indent=1, allow_nan=False))


def print_csv(columns: Sequence[str], rows: Iterable[Iterable[Any]]) -> None:
    """Print a heading and rows; lists and mappings stand in a cell as JSON."""
    writer = csv.writer(sys.stdout, lineterminator="\n")
    writer.writerow([heading.removeprefix(">") for heading in columns])
    writer.writerows(
        [json.dumps(v, allow_nan=False) if isinstance(v, list | dict) else printable(v) if isinstance(v, str) else v
         for v in row]
        for row in rows
    )  # fmt: skip


def print_records(output: str, records: Any, title: str, columns: Sequence[str], rows: Sequence[Sequence[Any]]) -> None:
    """Print records as JSON, or what a table shows of them."""
    if output == "json":
        print_json(records)
    elif output == "csv":
        print_csv(columns, rows)
    else:
        print_table(title, columns, rows)


def print_results(
    found: T, table: Callable[[T], None], output: str, *, explain: bool = False, plot: Path | None = None,
    save: Path | None = None,
) -> None:  # fmt: skip
    """Print an answer, each candidate with its code, draw and save it where files are named; tell why it is empty, and
    end with exit code 1."""
    if explain or not found:
        told = found.explain()
        advice = re.search(r"^no \w+ found.*", told, re.MULTILINE)
        print(told if explain or advice is None else f"catalogue: {advice[0]}", file=sys.stderr)
    if output == "json":
        print_json([{"code": code, **c.to_dict()} for code, c in zip(codes(found), found, strict=True)])
    elif output == "csv":
        rows = ([code, *c.to_dict().values()] for code, c in zip(codes(found), found, strict=True))
        print_csv(["code", *found.columns], rows)
    elif found:
        table(found)
    if not found:
        raise Exit(1)
    if save is not None:
        found.save(save)
        print(f"saved: {save}, {len(found)} answers", file=sys.stderr)
    if plot is None:
        return
    if is_folder(plot) or not plot.suffix:
        plot.mkdir(parents=True, exist_ok=True)
        for code, one in zip(codes(found), found, strict=True):
            one.plot(plot / f"{code}.svg")
        print(f"drawn: {len(found)} files in {plot}", file=sys.stderr)
    else:
        found[0].plot(plot)
        print(f"drawn: {plot}", file=sys.stderr)


def codes(found: Results[Any]) -> list[str]:
    """Return the codes of answers, which are kept under them; where they cannot be kept, dashes and a line that says
    so."""
    try:
        return found.remember()
    except InvalidRequest as error:
        print(f"catalogue: answers have no codes: {error}", file=sys.stderr)
        return ["-"] * len(found)


def links(one: Candidate) -> str | None:
    """Return the shortest and the longest link of a candidate as they are printed."""
    if one.max_link is None or one.min_link is None:
        return None
    return f"{one.min_link:.3g}\u2013{one.max_link:.3g}"


def contact(order: int) -> str:
    """Return an order of contact as it is printed."""
    from ..curvature_theory.leading_error import EXACT

    return "exact" if order == EXACT else str(order)
