"""Tables on a terminal."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from rich import box
from rich.console import Console
from rich.table import Table

from ..query.candidate import Candidate
from ..query.found import Found
from ..series import EXACT


def print_table(
    title: str, columns: Sequence[tuple[str, str]], rows: Iterable[Sequence[str]], caption: str = ""
) -> None:
    """Print a table; each column is a heading and ``left`` or ``right``."""
    table = Table(title=title, caption=caption, box=box.SIMPLE_HEAD, title_justify="left", caption_justify="left")
    for heading, side in columns:
        table.add_column(heading, justify="right" if side == "right" else "left", overflow="fold")
    for row in rows:
        table.add_row(*row)
    console = Console()
    if not console.is_terminal:
        console = Console(width=max(100, 14 * len(columns)))
    console.print(table)


def print_candidates(found: Found) -> None:
    """Print the answers of a `find`."""
    first = found[0]
    arc = first.radius is not None
    radii = [c.radius or 0.0 for c in found]
    same = max(radii) <= 1.004 * min(radii)
    what = f"an arc of chord {first.stroke:g}" if arc else f"a straight line of {first.stroke:g}"
    what += f" and radius {first.radius:.4g}" if arc and same else ""
    columns = [
        ("id", "right"), ("series", "left"), ("family", "left"), ("conf.", "left"), ("order", "right"),
        ("deviation", "right"), ("size", "right"), ("longest link", "right"), ("arm", "right"),
        ("transmission", "right"), ("turns", "left"), ("score", "right"),
    ]  # fmt: skip
    rows = [_row(c) for c in found]
    if not same:
        columns.append(("radius", "right"))
        rows = [[*row, f"{radius:.4g}"] for row, radius in zip(rows, radii, strict=True)]
    caption = "`catalogue show ID --plot FILE` draws one; --format json gives all pivots"
    print_table(f"Guides for {what}", columns, rows, caption)


def _row(c: Candidate) -> list[str]:
    return [
        "-" if c.id is None else str(c.id),
        c.series,
        c.family,
        c.configuration,
        "exact" if c.order == EXACT else str(c.order),
        f"{c.deviation:.3g}",
        f"{c.size:.4g}",
        "-" if c.max_link is None else f"{c.max_link:.4g}",
        "-" if c.max_arm is None else f"{c.max_arm:.4g}",
        f"{c.min_transmission:.1f}\u00b0",
        " ".join(f"crank {k}" for k in c.rotates) or "-",
        "-" if c.score is None else f"{c.score:.0f}",
    ]
