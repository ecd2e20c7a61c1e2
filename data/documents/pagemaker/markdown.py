"""Marks of Markdown."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence


def plain(text: str) -> str:
    """Return text in which Markdown sees no marks."""
    return re.sub(r"([*_\[\]`|<>\\])", r"\\\1", text)


def cell(text: str) -> str:
    """Return text for a cell of a table; what stands in backquotes is code."""
    parts = re.split(r"``?([^`]+)``?", " ".join(text.split()))
    return "".join(f"`{part}`".replace("|", "\\|") if i % 2 else plain(part) for i, part in enumerate(parts))


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table."""
    return "\n".join(f"| {' | '.join(line)} |" for line in [head, ["---"] * len(head), *rows])
