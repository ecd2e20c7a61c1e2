"""Tables set in the width of a terminal: what does not fit is left out, set in bands, or on cards.

No cell is cut and none but those of words is broken over lines.
"""

from __future__ import annotations

import os
import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ..errors import printable

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

#: Width where nobody looks, unless ``COLUMNS`` says another; the least that is set in.
PIPED, LEAST = 100, 40
#: Letters that a column of words keeps, if it has so many.
WORDS = 28
#: Between two items of a card.
GAP = "   "


@dataclass(frozen=True)
class Heading:
    """The heading of a column, whether it is set to the right, and whether its cells are words that may be broken."""

    title: str
    right: bool = False
    words: bool = False

    @classmethod
    def of(cls, given: str) -> Heading:
        """Return the heading of a text: ``>`` before it sets it to the right, ``~`` lets its cells be broken."""
        return cls(given.lstrip(">~"), given[:1] == ">", given[:1] == "~")

    @property
    def plain(self) -> str:
        """The title in one piece."""
        return self.title.replace("\u00ad", "")

    def broken(self, width: int) -> str:
        """Return the title in lines of that width, as far as its words and soft hyphens allow."""
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


def cell(value: Any) -> str:
    """Return what stands in a cell: a dash for None, no letter that a terminal would obey."""
    text = "-" if value is None else str(value)
    return text if text.isprintable() else printable(text)


def console() -> Console:
    """Return what is printed on: as wide as the terminal, or as ``COLUMNS`` says, else `PIPED`."""
    from rich.console import Console

    one = Console(highlight=False)
    if not one.is_terminal and not os.environ.get("COLUMNS", "").isdigit():
        one = Console(highlight=False, width=PIPED)
    one.width = max(one.width, LEAST)
    return one


def write(console: Console, text: str, style: str = "") -> None:
    """Print lines of text, broken between words where they are too long; no letter that a terminal would obey."""
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
    """Print a table; where it is too wide without the columns that may be spared, the first to go first, print it in
    bands that repeat the first `keys` columns, or if there are none row by row as cards.  Return what was left out."""
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
        least = min(widest, WORDS) if heading.words else widest
        table.add_column(
            Text(title), justify="right" if heading.right else "left", overflow="fold",
            min_width=max([least, *map(len, title.splitlines())]), no_wrap=not heading.words,
        )  # fmt: skip
    for row in rows:
        table.add_row(*(Text(row[k]) for k in shown))
    return table


def _fits(console: Console, table: Table) -> bool:
    """Return whether a table needs no cell broken that must not be."""
    from rich.measure import Measurement

    room = console.options.update(max_width=10_000)
    return Measurement.get(console, room, table).minimum <= console.width


def _print(console: Console, table: Table) -> None:
    """Print a table without blanks at the ends of its lines."""
    with console.capture() as held:
        console.print(table)
    print("\n".join(line.rstrip() for line in held.get().splitlines()), end="\n\n")


def _bands(
    console: Console, headings: Sequence[Heading], rows: Sequence[Sequence[str]], keys: int
) -> Iterator[list[int]]:
    """Yield the columns of each band: as many as there is room for, one at least, after the first `keys`."""
    first = list(range(keys))
    band: list[int] = []
    for k in range(keys, len(headings)):
        if band and not _fits(console, _table(headings, rows, [*first, *band, k])):
            yield [*first, *band]
            band = []
        band.append(k)
    yield [*first, *band]


def _cards(console: Console, headings: Sequence[Heading], rows: Sequence[Sequence[str]]) -> None:
    """Print each row as a card: the first cell, then titles with values, as many on a line as there is room for."""
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
    """Print a line of a card; words of one that is too long go on in the next line."""
    for part in (
        textwrap.wrap(line, console.width - 2, break_on_hyphens=False) if len(line) > console.width - 2 else [line]
    ):
        print(f"  {part}")
