"""Tables for a notebook, as HTML that a page's own colours fit."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

#: Rows that are shown at most.
MOST = 60


def html_table(columns: Sequence[str], rows: Sequence[Sequence[object]], total: int | None = None) -> str:
    """Return a table of the first rows; columns whose heading begins with ``>`` are set to the right, None in a cell is
    a dash.  `total` is how many rows there are, if they are not all given."""
    right = [name.startswith(">") for name in columns]
    head = "".join(_cell("th", name.removeprefix(">"), side) for name, side in zip(columns, right, strict=True))
    body = ""
    for row in rows[:MOST]:
        cells = (_cell("td", "–" if cell is None else str(cell), side) for cell, side in zip(row, right, strict=True))
        body += f"<tr>{''.join(cells)}</tr>"
    left_off = (len(rows) if total is None else total) - min(len(rows), MOST)
    more = f"<p>… {left_off} more</p>" if left_off else ""
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>{more}"


def _cell(tag: str, words: str, right: bool) -> str:
    return f"<{tag} style='text-align:{'right' if right else 'left'}'>{escape(words)}</{tag}>"
