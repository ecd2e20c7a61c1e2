"""Tables for a notebook as HTML, in the colours of its page."""

from __future__ import annotations

from collections.abc import Sequence

from .markup import NOTHING, Markup, element, join

#: Largest number of rows in the table: as many as pandas shows.
MOST = 60


def html_table(columns: Sequence[str], rows: Sequence[Sequence[object]], total: int | None = None) -> Markup:
    """Return a table of the first rows.

    Parameters
    ----------
    columns : sequence of str
        Headings; ``>`` at the beginning sets a column to the right.
    rows : sequence of sequence
        Cells; None is a dash.
    total : int, optional
        Number of all rows, if not all are given.
    """
    right = [name.startswith(">") for name in columns]
    head = [_cell("th", name.removeprefix(">"), side) for name, side in zip(columns, right, strict=True)]
    body = []
    for row in rows[:MOST]:
        cells = (_cell("td", "–" if cell is None else str(cell), side) for cell, side in zip(row, right, strict=True))
        body.append(element("tr", *cells))
    left_off = (len(rows) if total is None else total) - min(len(rows), MOST)
    more = element("p", f"… {left_off} more") if left_off else NOTHING
    table = element("table", element("thead", element("tr", *head)), element("tbody", *body))
    return join((table, more))


def _cell(tag: str, words: str, right: bool) -> Markup:
    return element(tag, words, style=f"text-align:{'right' if right else 'left'}")
