"""Fit tables to the width of the terminal: omit columns, print in bands, or print cards.

No cell is truncated, and only cells of words are wrapped.
"""

from __future__ import annotations

import os
import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from ..errors import printable

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table


class TableWidth(NamedTuple):
    """Widths of tables [characters]."""

    piped: int = 100  #: piped output, unless ``COLUMNS`` is set: the widest that most viewers show
    #: smallest width to fit a table to: below it every cell would be alone on its line
    least: int = 40
    words: int = 28  #: smallest width of a wrapped column of words: about five words a line


TABLE_WIDTH = TableWidth()

#: Space between two items of a card.
GAP = "   "


@dataclass(frozen=True)
class Heading:
    """The heading of a column: title, right alignment, and whether its cells may be wrapped."""

    title: str
    right: bool = False
    words: bool = False

    @classmethod
    def of(cls, given: str) -> Heading:
        """Parse a heading: ``>`` aligns it to the right, ``~`` permits wrapping its cells."""
        return cls(given.lstrip(">~"), given[:1] == ">", given[:1] == "~")

    @property
    def plain(self) -> str:
        """The title without soft hyphens."""
        return self.title.replace("\u00ad", "")

    def broken(self, width: int) -> str:
        """Wrap the title to a width at blanks and soft hyphens."""
        lines = [""]
        for word in self.title.split(" "):
            *begun, last = word.split("\u00ad")
            for i, part in enumerate([*(f"{part}-" for part in begun), last]):
                line = lines[-1].removesuffix("-") if i else lines[-1] + " " * bool(lines[-1])
                if len(line + part) <= width or not lines[-1]:
                    lines[-1] = line + part
                else:
                    lines.append(part)
        return "\n".join(lines)


def cell(value: object) -> str:
    """Format a cell: a dash for None, control characters escaped."""
    text = "-" if value is None else str(value)
    return text if text.isprintable() else printable(text)


def console() -> Console:
    """Create a console of the width of the terminal, of ``COLUMNS``, or else a default."""
    from rich.console import Console

    one = Console(highlight=False)
    if not one.is_terminal and not os.environ.get("COLUMNS", "").isdigit():
        one = Console(highlight=False, width=TABLE_WIDTH.piped)
    one.width = max(one.width, TABLE_WIDTH.least)
    return one


def write(console: Console, text: str, style: str = "") -> None:
    """Print text wrapped between words, control characters escaped."""
    from rich.text import Text

    for line in text.splitlines():
        for part in Text(line if line.isprintable() else printable(line), style).wrap(console, console.width):
            part.rstrip()
            console.print(part, soft_wrap=True)


def write_table(
    console: Console,
    headings: Sequence[Heading],
    rows: Sequence[Sequence[str]],
    *,
    spare: Sequence[int] = (),
    keys: int = 0,
) -> list[int]:
    """Print a table that fits the width, and return the indices of omitted columns.

    Parameters
    ----------
    console : Console
    headings : sequence of Heading
    rows : sequence of sequence of str
    spare : sequence of int
        Columns that may be omitted, the first one first.
    keys : int
        If the table is still too wide, print it in bands that repeat this many first columns; if 0,
        print each row as a card.
    """
    every = list(range(len(headings)))
    if _fits(console, whole := _table(headings, rows, every, whole=True)):
        _print(console, whole)
        return []
    for number in range(len(spare) + 1):
        left = [k for k in every if k not in spare[:number]]
        if _fits(console, table := _table(headings, rows, left)):
            _print(console, table)
            return sorted(spare[:number])
    if not keys:
        _cards(console, headings, rows)
        return []
    for band in _bands(console, headings, rows, keys):
        _print(console, _table(headings, rows, band))
    return []


def _table(
    headings: Sequence[Heading], rows: Sequence[Sequence[str]], shown: Sequence[int], *, whole: bool = False
) -> Table:
    from rich import box
    from rich.table import Table
    from rich.text import Text

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False)
    widths = {k: max((len(row[k]) for row in rows), default=0) for k in shown}
    titles = {k: headings[k].plain if whole else headings[k].broken(widths[k]) for k in shown}
    deep = max(title.count("\n") for title in titles.values())
    for k in shown:
        heading, widest = headings[k], widths[k]
        title = "\n" * (deep - titles[k].count("\n")) + titles[k]
        least = min(widest, TABLE_WIDTH.words) if heading.words else widest
        table.add_column(
            Text(title),
            justify="right" if heading.right else "left",
            overflow="fold",
            min_width=max([least, *map(len, title.splitlines())]),
            no_wrap=not heading.words,
        )
    for row in rows:
        table.add_row(*(Text(row[k]) for k in shown))
    return table


def _fits(console: Console, table: Table) -> bool:
    """Tell whether a table fits the console without breaking an unbreakable cell."""
    from rich.measure import Measurement

    room = console.options.update(max_width=10_000)
    return Measurement.get(console, room, table).minimum <= console.width


def _print(console: Console, table: Table) -> None:
    """Print a table without trailing blanks."""
    with console.capture() as held:
        console.print(table)
    print("\n".join(line.rstrip() for line in held.get().splitlines()), end="\n\n")


def _bands(
    console: Console, headings: Sequence[Heading], rows: Sequence[Sequence[str]], keys: int
) -> Iterator[list[int]]:
    """Yield the columns of each band: the first `keys`, then as many as fit, at least one."""
    first = list(range(keys))
    band: list[int] = []
    for k in range(keys, len(headings)):
        if band and not _fits(console, _table(headings, rows, [*first, *band, k])):
            yield [*first, *band]
            band = []
        band.append(k)
    yield [*first, *band]


def _cards(console: Console, headings: Sequence[Heading], rows: Sequence[Sequence[str]]) -> None:
    """Print each row as a card: the first cell, then lines of titles with values."""
    from rich.text import Text

    for row in rows:
        console.print(Text(row[0], "bold"), soft_wrap=True)
        line = ""
        for heading, value in zip(headings[1:], row[1:], strict=True):
            if value in ("", "-"):
                continue
            item = f"{heading.plain} {value}".strip() if len(headings) > 2 else value
            if line and len(line) + len(GAP + item) > console.width - 2:
                _write_item(console, line)
                line = ""
            line += GAP * bool(line) + item
        _write_item(console, line)
    print()


def _write_item(console: Console, line: str) -> None:
    """Print a line of a card, wrapped between words if too long."""
    for part in (
        textwrap.wrap(line, console.width - 2, break_on_hyphens=False) if len(line) > console.width - 2 else [line]
    ):
        print(f"  {part}")
