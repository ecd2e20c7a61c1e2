"""Answers printed: tables on a terminal, CSV and JSON."""

from __future__ import annotations

import csv
import json
import re
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from click.exceptions import Exit

if TYPE_CHECKING:
    from ..find.results import Results

T = TypeVar("T", bound="Results[Any]")


def print_table(title: str, columns: Sequence[str], rows: Iterable[Sequence[Any]], caption: str = "") -> None:
    """Print a table; columns whose heading begins with ``>`` are set to the right, None in a cell is a dash."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    table = Table(title=title, caption=caption, box=box.SIMPLE_HEAD, title_justify="left", caption_justify="left")
    for heading in columns:
        table.add_column(heading.removeprefix(">"), justify="right" if heading[:1] == ">" else "left", overflow="fold")
    for row in rows:
        table.add_row(*("-" if cell is None else str(cell) for cell in row))
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
    writer.writerows([json.dumps(v, allow_nan=False) if isinstance(v, list | dict) else v for v in row] for row in rows)


def print_records(output: str, records: Any, title: str, columns: Sequence[str], rows: Sequence[Sequence[Any]]) -> None:
    """Print records as JSON, or what a table shows of them."""
    if output == "json":
        print_json(records)
    elif output == "csv":
        print_csv(columns, rows)
    else:
        print_table(title, columns, rows)


def print_results(
    found: T, table: Callable[[T], None], output: str, *, explain: bool = False, plot: Path | None = None
) -> None:
    """Print an answer, draw its best candidate if a file is named; tell why it is empty, and end with exit code 1."""
    if explain or not found:
        told = found.explain()
        advice = re.search(r"^no \w+ found.*", told, re.MULTILINE)
        print(told if explain or advice is None else f"catalogue: {advice[0]}", file=sys.stderr)
    if output == "json":
        print(found.to_json())
    elif output == "csv":
        print_csv(found.columns, (c.to_dict().values() for c in found))
    elif found:
        table(found)
    if not found:
        raise Exit(1)
    if plot is not None:
        found[0].plot(plot)
        print(f"drawn: {plot}", file=sys.stderr)


def contact(order: int) -> str:
    """Return an order of contact as it is printed."""
    from ..curvature_theory.leading_error import EXACT

    return "exact" if order == EXACT else str(order)
