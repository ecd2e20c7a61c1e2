"""Plot columns of a table over the drive, one panel for each."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...errors import InvalidRequest
from ...given import array
from ...kinematics.types import Array
from ...paper import COUPLER, FAINT, GREY, INK, PAPER, blank, kind_of, literal, write

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

#: Panels in a row.
PANELS_PER_ROW = 3
#: Largest number of panels of a sheet.
MAX_PANELS = 24
#: Width and height of a panel [inch].
PANEL_SIZE = (3.2, 2.3)


def plot(drive: Array, heading: str, table: pd.DataFrame, file: str | PathLike[str] | None = None) -> Figure:
    """Plot the columns of a table over the drive; headings are like ``"toe [deg]"``.

    Raises
    ------
    InvalidRequest
        If there is no column or too many, one is not numeric, or the file cannot be written.
    """
    kind = kind_of(file) if file is not None else ""
    names = [str(name) for name in table.columns]
    columns = [
        array(f"column {name}", column, drive.shape) for name, (_, column) in zip(names, table.items(), strict=True)
    ]
    if not 0 < len(names) <= MAX_PANELS:
        raise InvalidRequest(f"{len(names)} columns: choose up to {MAX_PANELS} to be plotted")
    beside = min(PANELS_PER_ROW, len(names))
    rows = -(-len(names) // beside)
    figure = blank(max(beside * PANEL_SIZE[0], 4.5), rows * PANEL_SIZE[1] + 0.3)
    panels = figure.subplots(rows, beside, squeeze=False).ravel()
    for ax, name, y in zip(panels, names, columns, strict=False):
        ax.plot(drive, y, color=COUPLER, lw=1.6)
        ax.set_title(name, fontsize=9.5, color=INK, loc="left")
        ax.grid(color=FAINT, lw=0.6)
        ax.set_facecolor(PAPER)
        ax.tick_params(labelsize=8, colors=GREY, length=2)
        ax.spines[["top", "right"]].set_visible(False)
        ax.spines[["left", "bottom"]].set_color(GREY)
        ax.margins(x=0.02)
        good = y[np.isfinite(y)]
        if len(good) and np.ptp(good) <= 1e-9 * max(1.0, float(np.abs(good).max())):  # rounding is not drawn
            ax.set_ylim(good[0] - 1, good[0] + 1)
    for ax in panels[len(names) :]:
        ax.set_visible(False)
    for ax in panels[max(0, len(names) - beside) : len(names)]:
        ax.set_xlabel(heading, fontsize=9, color=INK)
    literal(figure)
    figure.tight_layout(pad=0.9)
    if file is not None:
        write(figure, Path(file), kind)
    return figure
