"""The sheet of one candidate: title, linkage with ghosts, and the deviation along the stroke."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .mechanism import drawn
from .paper import SANS, SERIF, blank, kind_of, write
from .scene import EXACT, Scene, scene
from .symbols import FAINT, GREY, INK, PATH, Pen

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..find.candidate import Candidate

# All in inches: the width of the sheet, its margin, the drawing's least and greatest height and its border, and the
# heights of the title, the scale under the drawing, the deviation (of an exact guide) and its labels.
WIDTH, MARGIN, LOW, HIGH, BORDER = 8.0, 0.6, 2.2, 6.4, 0.45
TITLE, SCALE, DEVIATION, EXACTLY, LABELS = 1.1, 0.62, 1.2, 0.4, 0.65
#: Names of families as they stand in a title.
NAMES = {
    "four-bar": "four-bar linkage",
    "inverted-slider-crank": "inverted slider-crank",
    "swinging-block": "swinging-block slider",
    "elliptic-trammel": "elliptic trammel",
    "oldham": "Oldham linkage",
}


def draw(candidate: Candidate, file: str | Path | None = None) -> Figure:
    """Draw a candidate in mid-stroke with ghosts at the ends of the stroke, its path and its deviation; see
    `catalogue.Candidate.plot`.
    """
    kind = None if file is None else kind_of(file)
    shown = scene(candidate)
    x0, y0, x1, y1 = shown.box
    inner = WIDTH - 2 * MARGIN
    inch = max((x1 - x0) / (inner - 2 * BORDER), (y1 - y0) / (HIGH - 2 * BORDER))
    height = max(LOW, (y1 - y0) / inch + 2 * BORDER)
    strip = EXACTLY if _exact(candidate) else DEVIATION
    total = TITLE + height + SCALE + strip + LABELS
    figure = blank(WIDTH, total)
    _title(figure, candidate, total)

    axes = figure.add_axes(
        (MARGIN / WIDTH, (LABELS + strip) / total, inner / WIDTH, (height + SCALE) / total), gid="linkage"
    )
    axes.set_axis_off()
    centre, middle = 0.5 * (x0 + x1), 0.5 * (y0 + y1)
    axes.set_xlim(centre - 0.5 * inner * inch, centre + 0.5 * inner * inch)
    axes.set_ylim(middle - (0.5 * height + SCALE) * inch, middle + 0.5 * height * inch)
    axes.set_aspect("equal")
    pen = Pen(axes, inch / 72)
    drawn(pen, shown)
    _scale(pen)

    inset = figure.add_axes((MARGIN / WIDTH, LABELS / total, inner / WIDTH, strip / total), gid="deviation")
    _deviation(inset, candidate, shown)
    if file is not None and kind is not None:
        write(figure, Path(file), kind)
    return figure


def _title(figure: Figure, candidate: Candidate, total: float) -> None:
    """Say which guide it is, and what it does."""
    left, line = MARGIN / WIDTH, 1 - 0.58 / total
    head = figure.text(
        left, line, candidate.series, gid="series", family=SERIF, weight="bold", size=23, color=INK,
    )  # fmt: skip
    width = head.get_window_extent().width / figure.bbox.width
    kind = f"{NAMES.get(candidate.family, candidate.family)}, configuration {candidate.configuration}"
    figure.text(left + width + 0.017, line, kind, gid="family", family=SERIF, style="italic", size=16, color=INK)
    told = [
        f"stroke {candidate.stroke:g}",
        *([] if candidate.radius is None else [f"radius {candidate.radius:.4g}"]),
        "exact" if _exact(candidate) else f"deviation {_plain(candidate.deviation)}",
        f"least transmission angle {candidate.min_transmission:.0f}°",
    ]
    figure.text(left, 1 - 0.85 / total, "   ·   ".join(told), gid="facts", family=SANS, size=8.8, color=GREY)


def _exact(candidate: Candidate) -> bool:
    return candidate.deviation < EXACT * candidate.stroke


def _plain(value: float) -> str:
    """Return a number with three digits, small ones as a multiple of a power of ten."""
    if value >= 1e-4:
        return f"{value:.3g}"
    power = math.floor(math.log10(value))
    return rf"${value / 10**power:.2f}\times 10^{{{power}}}$"


def _round(value: float, steps: tuple[int, ...] = (1, 2, 5)) -> float:
    """Return the greatest of the steps times a power of ten that is not above the value."""
    power = 10.0 ** math.floor(math.log10(value))
    return max(m * power for m in steps if m * power <= value or m == 1)


def _scale(pen: Pen) -> None:
    """Draw a scale of a round length under the linkage."""
    x, y = pen.axes.get_xlim()[0], pen.axes.get_ylim()[0] + 30 * pen.point
    length = _round(110 * pen.point)
    tick = 3j * pen.point
    ends = x + 1j * y + np.array([0, length])
    pen.line(np.array([ends[0] + tick, ends[0], ends[1], ends[1] + tick]), "scale", color=GREY, linewidth=0.9, zorder=1)
    x = ends[1].real + 6 * pen.point
    pen.axes.text(x, y, f"{length:g}", gid="scale-length", family=SANS, size=7.5, color=GREY, va="bottom")


def _deviation(axes: Axes, candidate: Candidate, shown: Scene) -> None:
    """Draw the distance from the nominal against the position along the stroke, in the band that holds it."""
    from matplotlib.ticker import MaxNLocator

    nominal = "straight line" if candidate.radius is None else "circular arc"
    exact = _exact(candidate)
    # a multiple of 1000 that brings the deviation above 1
    power = 0 if exact else max(0, 3 * math.ceil(-math.log10(candidate.deviation) / 3))
    times = {0: "", 3: " × 1000"}.get(power, rf" $\times\, 10^{{{power}}}$")
    half = 1.0 if exact else candidate.deviation * 10.0**power
    error = np.zeros_like(shown.error) if exact else shown.error * 10.0**power
    axes.set_facecolor("none")
    axes.set_xlim(0, candidate.stroke)
    axes.set_ylim(-1.35 * half, 1.35 * half)
    axes.axhline(0, color=FAINT, linewidth=0.8, zorder=1)
    if not exact:
        axes.axhspan(-half, half, facecolor=PATH, alpha=0.09, linewidth=0, gid="band", zorder=0)
        for side in (-half, half):
            axes.axhline(side, color=PATH, alpha=0.55, linewidth=0.7, linestyle=(0, (5, 3)), zorder=1)
    axes.plot(
        shown.position, error, color=PATH, linewidth=1.6, solid_capstyle="round", gid="error", clip_on=False, zorder=3
    )
    said = (
        f"exact {nominal}: no deviation but rounding"
        if exact
        else f"deviation{times} from the {nominal}, in the unit of the stroke"
    )
    axes.set_title(said, loc="left", family=SANS, size=8, color=INK, pad=4)
    if not exact:
        band = f"half the width of the band: {half:.3g}"
        axes.set_title(band, loc="right", family=SANS, size=8, color=PATH, pad=4)
    axes.set_xlabel("position along the stroke", family=SANS, size=8, color=INK, labelpad=4)
    axes.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 2.5, 5, 10]))
    tick = _round(1.05 * half, (1, 2, 3, 4, 5, 6, 8))
    axes.set_yticks([0] if exact else [-tick, 0, tick])
    for name, spine in axes.spines.items():
        spine.set_visible(name == "bottom")
        spine.set(color=GREY, linewidth=0.8)
    axes.tick_params(labelsize=7.5, labelcolor=GREY, color=GREY, width=0.8, length=3, labelfontfamily=SANS)
    axes.tick_params(axis="y", length=0)
