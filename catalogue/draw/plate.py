"""The plate of a series, like an engraving: a cell per family and configuration."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from ..paper import INK, blank, kind_of, write
from ..series.series import Series
from .cells import cells
from .lettering import MARGIN, caption, frame, legend, title
from .vignette import Vignette

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class PlateLayout(NamedTuple):
    """Layout of a plate [inch]."""

    title: float = 1.25  #: height of the title
    legend: float = 0.3  #: height of the legend
    gap: float = 0.3  #: gap between two cells
    caption: float = 0.66  #: height of a caption
    large: float = 3.6  #: side of a cell among few
    usual: float = 3.1  #: side of a cell among many
    few: int = 4  #: largest number of cells with large sides
    narrowest: float = 8.4  #: smallest width of the sheet, for its title


PLATE = PlateLayout()


def plate(series: Series, file: str | Path | None = None) -> Figure:
    """Draw a series: axes, circles, cubics, linkage and guided pairs of each cell.

    File, result and errors are those of `catalogue.Candidate.plot`.
    """
    kind = None if file is None else kind_of(Path(file))
    blank(1, 1)  # report a missing matplotlib before the sampling
    shown = cells(series)
    columns = _cells_per_row(len(shown))
    rows = -(-len(shown) // columns)
    side = PLATE.large if len(shown) <= PLATE.few else PLATE.usual
    width = max(PLATE.narrowest, 2 * MARGIN + columns * side + (columns - 1) * PLATE.gap)
    height = 2 * MARGIN + PLATE.title + rows * (side + PLATE.caption) + (rows - 1) * PLATE.gap * 0.5 + PLATE.legend
    figure = blank(width, height)
    frame(figure, width, height)
    title(figure, series, width, height)
    for i, cell in enumerate(shown):
        row, column = divmod(i, columns)
        there = min(columns, len(shown) - row * columns)
        left = 0.5 * (width - there * side - (there - 1) * PLATE.gap) + column * (side + PLATE.gap)
        bottom = height - MARGIN - PLATE.title - (row + 1) * side - row * (PLATE.caption + 0.5 * PLATE.gap)
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
    """Return a name, without suffix, for the files of a series: valid on every file system."""
    plain = re.sub(r"[^A-Za-z0-9.]+", "-", code.replace("*", "-star")).strip(".-")
    return plain or "series"


def _cells_per_row(count: int) -> int:
    """Return the number of cells per row."""
    if count <= PLATE.few:
        return min(count, 2)

    def ill(columns: int) -> float:
        rows = -(-count // columns)
        alone = 3 * (rows * columns - count == columns - 1)
        return rows * columns - count + 1.5 * abs(rows - columns) + alone

    return min((3, 4, 5), key=ill)
