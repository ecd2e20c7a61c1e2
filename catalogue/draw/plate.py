"""The plate of a series, like an engraving: a cell per family and configuration."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from ..paper import INK, blank, kind_of, write
from ..series.series import Series
from .cells import cells
from .lettering import MARGIN, caption, frame, legend, title
from .vignette import Vignette

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Layout of the plate, all in inches.
TITLE = 1.25
LEGEND = 0.3
GAP = 0.3
CAPTION = 0.66
#: Side of a cell among few.
LARGE = 3.6
#: Side of a cell among many.
USUAL = 3.1
#: Most cells of a plate that count as few.
FEW = 4
#: Smallest width of the sheet, for its title.
NARROWEST = 8.4


def plate(series: Series, file: str | Path | None = None) -> Figure:
    """Draw a series: axes, circles, cubics, linkage and guided pairs of each cell.

    The file, what is returned and what is raised are as for `catalogue.Candidate.plot`.
    """
    kind = None if file is None else kind_of(Path(file))
    blank(1, 1)  # without matplotlib, say so before the sampling
    shown = cells(series)
    columns = _columns(len(shown))
    rows = -(-len(shown) // columns)
    side = LARGE if len(shown) <= FEW else USUAL
    width = max(NARROWEST, 2 * MARGIN + columns * side + (columns - 1) * GAP)
    height = 2 * MARGIN + TITLE + rows * (side + CAPTION) + (rows - 1) * GAP * 0.5 + LEGEND
    figure = blank(width, height)
    frame(figure, width, height)
    title(figure, series, width, height)
    for i, cell in enumerate(shown):
        row, column = divmod(i, columns)
        there = min(columns, len(shown) - row * columns)
        left = 0.5 * (width - there * side - (there - 1) * GAP) + column * (side + GAP)
        bottom = height - MARGIN - TITLE - (row + 1) * side - row * (CAPTION + 0.5 * GAP)
        box = (left / width, bottom / height, side / width, side / height)
        axes = figure.add_axes(box, gid=f"cell-{i + 1}")
        axes.set_facecolor("none")
        axes.set_xticks([])
        axes.set_yticks([])
        for spine in axes.spines.values():
            spine.set(color=INK, linewidth=0.5)
        Vignette(axes, cell, 72 * side, f"cell-{i + 1}-").draw()
        caption(figure, cell, i + 1, box)
    legend(figure, shown, width, height)
    if file is not None and kind is not None:
        write(figure, Path(file), kind)
    return figure


def file_name(code: str) -> str:
    """Return a name for the files of a series that every file system takes, without suffix."""
    plain = re.sub(r"[^A-Za-z0-9.]+", "-", code.replace("*", "-star")).strip(".-")
    return plain or "series"


def _columns(count: int) -> int:
    """Return how many cells stand in a row."""
    if count <= FEW:
        return min(count, 2)

    def ill(columns: int) -> float:
        rows = -(-count // columns)
        alone = 3 * (rows * columns - count == columns - 1)
        return rows * columns - count + 1.5 * abs(rows - columns) + alone

    return min((3, 4, 5), key=ill)
