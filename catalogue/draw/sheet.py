"""The drawing of one guide: title, linkage with ghosts, and the deviation along the stroke."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..guides.kinds import has_bars, has_stroke
from ..paper import FAINT, GREY, INK, PATH, SANS, SERIF, blank, literal
from .pen_machine import pen_machine
from .still import deviation_along, still
from .symbols import Pen
from .units import rounded
from .words import facts, family, is_exact, plain

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..guides.candidate import Candidate
    from ..guides.chain_stretch import ChainStretch
    from ..guides.kinds import Guide


class SheetLayout(NamedTuple):
    """Layout of the sheet [inch]."""

    width: float = 8.0  #: width of the sheet
    margin: float = 0.6  #: margin
    low: float = 2.2  #: smallest height of the drawing
    high: float = 6.4  #: largest height of the drawing
    border: float = 0.45  #: margin within the drawing
    title: float = 1.1  #: height of the title
    scale: float = 0.62  #: height of the scale bar
    deviation: float = 1.2  #: height of the deviation plot
    exactly: float = 0.4  #: height of the deviation plot of an exact guide
    labels: float = 0.65  #: height of its labels
    name: float = 23.0  #: font size of the name [pt]
    kind: float = 16.0  #: font size of the kind of guide [pt]
    gap: float = 0.017  #: gap between name and kind [widths of the sheet]


SHEET = SheetLayout()


def sheet(guide: Guide) -> Figure:
    """Draw a guide at mid-stroke with ghosts at the ends, its path and its deviation.

    A guide without a stroke is drawn in its given position, with its path over the circuit.
    """
    shown = still(guide)
    x0, y0, x1, y1 = shown.box
    inner = SHEET.width - 2 * SHEET.margin
    inch = max((x1 - x0) / (inner - 2 * SHEET.border), (y1 - y0) / (SHEET.high - 2 * SHEET.border))
    height = max(SHEET.low, (y1 - y0) / inch + 2 * SHEET.border)
    strip = 0.0
    if has_stroke(guide):
        strip = SHEET.exactly if is_exact(guide) else SHEET.deviation
    labels = SHEET.labels if strip else 0.2
    total = SHEET.title + height + SHEET.scale + strip + labels
    figure = blank(SHEET.width, total)
    _title(figure, guide, total)

    axes = figure.add_axes(
        (SHEET.margin / SHEET.width, (labels + strip) / total, inner / SHEET.width, (height + SHEET.scale) / total),
        gid="linkage",
    )
    axes.set_axis_off()
    centre, middle = 0.5 * (x0 + x1), 0.5 * (y0 + y1)
    axes.set_xlim(centre - 0.5 * inner * inch, centre + 0.5 * inner * inch)
    axes.set_ylim(middle - (0.5 * height + SHEET.scale) * inch, middle + 0.5 * height * inch)
    axes.set_aspect("equal")
    pen = Pen(axes, inch / 72)
    pen_machine(pen, shown)
    if has_bars(guide):
        literal(figure)  # joints have the names that a user gives them
    _scale(pen, guide.unit)
    if has_stroke(guide):
        inset = figure.add_axes(
            (SHEET.margin / SHEET.width, labels / total, inner / SHEET.width, strip / total), gid="deviation"
        )
        _deviation(inset, guide)
    return figure


def onto(axes: Axes, guide: Guide) -> None:
    """Draw a guide into axes, with equal scales and fitting limits."""
    shown = still(guide)
    x0, y0, x1, y1 = shown.box
    box = axes.get_window_extent()
    dots = getattr(axes.get_figure(), "dpi", 100.0) / 72
    spare = min(0.5 * 72 * SHEET.border, 0.12 * min(box.width, box.height) / dots)
    scale = max((x1 - x0) / (box.width / dots - 2 * spare), (y1 - y0) / (box.height / dots - 2 * spare))
    half = 0.5 * scale * np.array([box.width, box.height]) / dots
    axes.set_xlim(0.5 * (x0 + x1) - half[0], 0.5 * (x0 + x1) + half[0])
    axes.set_ylim(0.5 * (y0 + y1) - half[1], 0.5 * (y0 + y1) + half[1])
    axes.set_aspect("equal")
    pen_machine(Pen(axes, scale), shown)


def _title(figure: Figure, guide: Guide, total: float) -> None:
    """Write the title: name and main numbers of the guide."""
    left, line = SHEET.margin / SHEET.width, 1 - 0.58 / total
    series, configuration = getattr(guide, "series", getattr(guide, "name", "")), getattr(guide, "configuration", "")
    head = figure.text(
        left,
        line,
        series,
        gid="series",
        family=SERIF,
        weight="bold",
        size=SHEET.name,
        color=INK,
        parse_math=False,
    )
    width = head.get_window_extent().width / figure.bbox.width + SHEET.gap if series else 0.0
    kind = family(guide) + (f", configuration {configuration}" if configuration else "")
    tail = figure.text(
        left + width,
        line,
        kind,
        gid="family",
        family=SERIF,
        style="italic",
        size=SHEET.kind,
        color=INK,
        parse_math=False,
    )
    share = (1 - 2 * left) / (width + tail.get_window_extent().width / figure.bbox.width)
    if share < 1:  # a long name is written smaller
        head.set_fontsize(share * SHEET.name)
        tail.set(fontsize=share * SHEET.kind, x=left + head.get_window_extent().width / figure.bbox.width + SHEET.gap)
    told = "   ·   ".join(facts(guide, guide.unit or "", plain))
    figure.text(left, 1 - 0.85 / total, told, gid="facts", family=SANS, size=8.8, color=GREY)


def _scale(pen: Pen, unit: str | None) -> None:
    """Draw a scale bar of a round length under the linkage."""
    x, y = pen.axes.get_xlim()[0], pen.axes.get_ylim()[0] + 30 * pen.point
    length = rounded(110 * pen.point)
    tick = 3j * pen.point
    ends = x + 1j * y + np.array([0, length])
    pen.line(np.array([ends[0] + tick, ends[0], ends[1], ends[1] + tick]), "scale", color=GREY, linewidth=0.9, zorder=1)
    x = ends[1].real + 6 * pen.point
    pen.axes.text(
        x, y, f"{length:g} {unit or ''}".rstrip(), gid="scale-length", family=SANS, size=7.5, color=GREY, va="bottom"
    )


def _deviation(axes: Axes, guide: Candidate | ChainStretch) -> None:
    """Plot the magnified deviation along the stroke, within its band."""
    from matplotlib.ticker import MaxNLocator

    nominal = "straight line" if guide.radius is None else "circular arc"
    along = "arc" if guide.is_wide else "stroke"
    exact = is_exact(guide)
    half = guide.deviation
    box = axes.get_window_extent()
    # half the height that the strip would have without magnification
    flat = 0.5 * guide.run_length * box.height / box.width
    times = 1.0 if exact else rounded(flat / (1.15 * half))
    axes.set_facecolor("none")
    axes.set_xlim(0, guide.run_length)
    axes.set_ylim(-flat / times, flat / times)
    axes.axhline(0, color=FAINT, linewidth=0.8, zorder=1)
    if not exact:
        axes.axhspan(-half, half, facecolor=PATH, alpha=0.09, linewidth=0, gid="band", zorder=0)
        for side in (-half, half):
            axes.axhline(side, color=PATH, alpha=0.55, linewidth=0.7, linestyle=(0, (5, 3)), zorder=1)
    position, error = deviation_along(guide)
    error = np.zeros_like(error) if exact else error
    axes.plot(position, error, color=PATH, linewidth=1.6, solid_capstyle="round", gid="error", clip_on=False, zorder=3)
    said = (
        f"exact {nominal}: no deviation but rounding"
        if exact
        else f"deviation from the {nominal}, drawn {plain(times)} times as large as the {along}"
    )
    axes.set_title(said, loc="left", family=SANS, size=8, color=INK, pad=4, gid="magnification")
    if not exact:
        band = f"half the width of the band: {plain(half)} {guide.unit or ''}".rstrip()
        axes.set_title(band, loc="right", family=SANS, size=8, color=PATH, pad=4)
    said = f"position along the {along}" + (f" [{guide.unit}]" if guide.unit else "")
    axes.set_xlabel(said, family=SANS, size=8, color=INK, labelpad=4)
    axes.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 2.5, 5, 10]))
    tick = 0.0 if exact else rounded(1.05 * half, (1, 2, 3, 4, 5, 6, 8))
    axes.set_yticks([0] if exact else [-tick, 0, tick])
    axes.set_yticklabels(["0"] if exact else ["−" + plain(tick), "0", plain(tick)])
    for name, spine in axes.spines.items():
        spine.set_visible(name == "bottom")
        spine.set(color=GREY, linewidth=0.8)
    axes.tick_params(labelsize=7.5, labelcolor=GREY, color=GREY, width=0.8, length=3, labelfontfamily=SANS)
    axes.tick_params(
        axis="y", length=0, labelsize=7.5 if exact or tick >= 1e-4 else 6.5
    )  # as powers of ten they are long
