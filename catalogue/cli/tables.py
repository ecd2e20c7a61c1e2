"""Tables on a terminal."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from rich import box
from rich.console import Console
from rich.table import Table

from ..curvature_theory.leading_error import EXACT
from ..find.results import Candidate, Found


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
        ("deviation", "right"), ("allowance", "right"), ("size", "right"), ("links", "right"),
        ("transmission", "right"), ("turns", "left"), ("score", "right"),
    ]  # fmt: skip
    turning = any(c.min_transmission_turn for c in found)
    rows = [_row(c, turning) for c in found]
    if not same:
        columns.append(("radius", "right"))
        rows = [[*row, f"{radius:.4g}"] for row, radius in zip(rows, radii, strict=True)]
    caption = "allowance: scatter of the pivots that the path forgives; transmission: over the stroke (over the turn)\n"
    caption += "`catalogue show ID --plot FILE` draws one; --format json gives all pivots"
    print_table(f"Guides for {what}", columns, rows, caption)


def _degrees(angle: float) -> str:
    return f"{angle:.0f}\u00b0"


def _row(c: Candidate, turning: bool) -> list[str]:
    return [
        "-" if c.id is None else str(c.id),
        c.series,
        c.family,
        c.configuration,
        "exact" if c.order == EXACT else str(c.order),
        f"{c.deviation:.3g}",
        "-" if c.allowance is None else f"{c.allowance:.3g}",
        f"{c.size:.4g}",
        "-" if c.max_link is None or c.min_link is None else f"{c.min_link:.3g}\u2013{c.max_link:.3g}",
        _degrees(c.min_transmission)
        if c.min_transmission_turn is None or not turning
        else f"{_degrees(c.min_transmission)} ({_degrees(c.min_transmission_turn)})",
        " ".join(f"crank {k}" for k in c.rotates) or "-",
        "-" if c.score is None else f"{c.score:.0f}",
    ]
