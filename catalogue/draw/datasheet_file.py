"""Write the data sheet of a guide as PDF or HTML."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ..paper import kind_of, write, write_bytes
from ..units import unit_or_none
from .datasheet import paper_of
from .units import Scale

if TYPE_CHECKING:
    from ..guides.kinds import Guide

#: Formats of a sheet.
KINDS = ("pdf", "html")


def sheet(
    guide: Guide, file: str | Path, *, paper: str = "a4", unit: str | None = None, scale: str | None = None
) -> None:
    """Write the data sheet of a guide; see `catalogue.Candidate.sheet`."""
    kind = kind_of(file, KINDS)
    paper_of(paper)
    unit_or_none(unit)
    if scale is not None:
        Scale.named(scale)
    if kind == "html":
        from .datasheet_html import sheet_html

        write_bytes(sheet_html(guide, paper=paper, unit=unit, scale=scale).encode(), Path(file))
        return
    from .datasheet_pdf import sheet_figure

    write(sheet_figure(guide, paper=paper, unit=unit, scale=scale), Path(file), "pdf")
