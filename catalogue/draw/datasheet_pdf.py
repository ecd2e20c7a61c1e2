"""A data sheet as a page of PDF, the drawing to scale in true millimetres."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..guides.kinds import has_stroke
from ..paper import FAINT, GREY, INK, PAPER, SANS, SERIF, blank
from ..units import ASSUMED, millimetres
from .curves import curves, panel
from .datasheet import ROOM, Content, Table, content, paper_of
from .pen_machine import pen_machine
from .still import still
from .symbols import Pen
from .units import Scale, length

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..guides.kinds import Guide
    from .machine import Machine


class PdfSheet(NamedTuple):
    """Layout of the data sheet [mm]."""

    margin: float = 14.0  #: margin of the page
    title: float = 31.0  #: foot of the title
    below: float = 158.0  #: height of the part below the drawing
    line: float = 4.1  #: height of a line of a table
    border: float = 9.0  #: margin within the drawing
    curves: float = 20.0  #: height of a curve
    gap: float = 12.5  #: gap between two curves


PAGE = PdfSheet()

INCH = 25.4


def sheet_figure(guide: Guide, *, paper: str = "a4", unit: str | None = None, scale: str | None = None) -> Figure:
    """Return the data sheet of a guide as a figure of the size of the paper.

    See `catalogue.Candidate.sheet`.
    """
    width, height = paper_of(paper)
    told = fit_to_page(content(here := guide.in_unit(unit), guide.code), height)
    figure = blank(width / INCH, height / INCH)
    page = _Page(figure, width, height)
    _draw_title(page, told)
    rows = max(ROOM.lines, told.lines)
    top, deep = PAGE.title + 2, height - PAGE.title - 2 - PAGE.below - PAGE.line * (rows - ROOM.lines)
    _drawing(page, here, scale, top, deep)
    foot = top + deep + 7
    _tables(page, told, foot)
    _curves(page, here, height - PAGE.margin - 29 - 2 * PAGE.curves - PAGE.gap)
    _draw_notes(page, told, height - PAGE.margin - 15)
    return figure


def fit_to_page(told: Content, height: float) -> Content:
    """Omit lengths and joints that do not fit on the page, and state their number."""
    most = ROOM.lines + int((height - PAGE.title - 2 - PAGE.below - ROOM.drawing) / PAGE.line)

    def short(table: Table) -> Table:
        left = len(table.rows) + any(table.columns) - most
        if left <= 0:
            return table
        more = (f"and {left + 1} more", *[""] * (len(table.columns) - 1))
        return replace(
            table,
            rows=[*table.rows[: len(table.rows) - left - 1], more],
            note=f"{table.note}; `export` has all in JSON",
        )

    return replace(told, lengths=short(told.lengths), pivots=short(told.pivots), limits=short(told.limits))


class _Page:
    """A page with positions in millimetres from its upper left corner."""

    def __init__(self, figure: Figure, width: float, height: float) -> None:
        self.figure, self.width, self.height = figure, width, height

    def text(self, x: float, y: float, words: str, size: float = 8.0, **style: Any) -> Any:
        style = {"family": SANS, "color": INK, "va": "baseline", **style}
        return self.figure.text(x / self.width, 1 - y / self.height, words, size=size, parse_math=False, **style)

    def rule(self, y: float) -> None:
        from matplotlib.lines import Line2D

        ends = [PAGE.margin / self.width, 1 - PAGE.margin / self.width]
        self.figure.add_artist(Line2D(ends, [1 - y / self.height] * 2, color=FAINT, linewidth=0.8))

    def axes(self, x: float, y: float, width: float, height: float, gid: str) -> Axes:
        place = (x / self.width, 1 - (y + height) / self.height, width / self.width, height / self.height)
        return self.figure.add_axes(place, gid=gid)


def _draw_title(page: _Page, told: Content) -> None:
    head = page.text(PAGE.margin, 21, told.series, 21, family=SERIF, weight="bold", gid="series")
    wide = head.get_window_extent().width / page.figure.bbox.width * page.width + 3 if told.series else 0.0
    page.text(PAGE.margin + wide, 21, told.kind, 14, family=SERIF, style="italic", gid="kind")
    page.text(
        page.width - PAGE.margin, 21, told.code, 11, family="DejaVu Sans Mono", color=GREY, ha="right", gid="code"
    )
    page.text(PAGE.margin, 27, "   ·   ".join(told.facts), 8.2, color=GREY, gid="facts")
    page.rule(PAGE.title)


def _drawing(page: _Page, guide: Guide, scale: str | None, top: float, deep: float) -> None:
    """Draw the guide to scale, with the dimension of its stroke and a scale bar."""
    wide = page.width - 2 * PAGE.margin
    to_scale(page.axes(PAGE.margin, top, wide, deep, "linkage"), guide, scale, wide, deep)
    page.rule(top + deep + 2)


def to_scale(axes: Axes, guide: Guide, scale: str | None, wide: float, deep: float) -> None:
    """Draw a guide in axes of a size in millimetres, with a scale bar."""
    unit = guide.unit or ASSUMED
    shown = still(guide)
    x0, y0, x1, y1 = shown.box
    per = millimetres(unit)
    sides = ((wide - 2 * PAGE.border, x1 - x0), (deep - 8 - 2 * PAGE.border, y1 - y0))
    room = min(free / side if side > 0 else np.inf for free, side in sides)
    to = Scale.named(scale) if scale is not None else Scale.fitting(room / per)
    ratio = to.ratio * per  # millimetres on paper per unit
    axes.set_axis_off()
    axes.set_xlim(0.5 * (x0 + x1) - 0.5 * wide / ratio, 0.5 * (x0 + x1) + 0.5 * wide / ratio)
    middle = 0.5 * (y0 + y1) - 4 / ratio
    axes.set_ylim(middle - 0.5 * deep / ratio, middle + 0.5 * deep / ratio)
    pen = Pen(axes, INCH / 72 / ratio)
    pen_machine(pen, shown)
    if has_stroke(guide):
        _dimension(pen, shown, length(guide.stroke, unit))
    step = to.bar(unit, 45.0)
    left, low = axes.get_xlim()[0], axes.get_ylim()[0] + 1.5 / ratio
    tick = 1.2j / ratio
    ends = left + 1j * low + np.array([0, step])
    pen.line(np.array([ends[0] + tick, ends[0], ends[1], ends[1] + tick]), "scale", color=GREY, linewidth=0.9, zorder=1)
    said = f"{length(step, unit)}   ·   scale {to}"
    axes.text(ends[1].real + 2 / ratio, low, said, family=SANS, size=7.5, color=GREY, va="bottom", gid="scale-length")


def _dimension(pen: Pen, shown: Machine, words: str) -> None:
    """Draw the dimension line of the stroke, opposite the fixed pivots."""
    start, end = shown.path[0], shown.path[-1]
    along = (end - start) / abs(end - start)
    up = 1j * along
    others = shown.places
    if ((others - start) * np.conj(up)).real.sum() > 0:
        up = -up
    p = pen.point
    a, b = start + 18 * p * up, end + 18 * p * up
    style = {"color": GREY, "linewidth": 0.7, "zorder": 2.5}
    for z in (start, end):
        pen.line(np.array([z + 5 * p * up, z + 21 * p * up]), "extension", **style)
    pen.line(np.array([a, b]), "dimension", **style)
    for z, way in ((a, along), (b, -along)):
        pen.line(z + 5 * p * np.array([way * np.exp(0.3j), 0, way * np.exp(-0.3j)]), "arrow", **style)
    angle = (np.degrees(np.angle(along)) + 90) % 180 - 90
    at = 0.5 * (a + b)
    pen.axes.text(
        at.real,
        at.imag,
        words,
        rotation=angle,
        rotation_mode="anchor",
        ha="center",
        va="center",
        family=SANS,
        size=7.5,
        color=INK,
        gid="stroke",
        bbox={"facecolor": PAPER, "edgecolor": "none", "pad": 1.2},
        zorder=13,
    )


def _tables(page: _Page, told: Content, top: float) -> None:
    inner = page.width - 2 * PAGE.margin
    for table, left, share in ((told.lengths, 0.0, 0.29), (told.pivots, 0.325, 0.335), (told.limits, 0.695, 0.305)):
        _table(page, table, PAGE.margin + left * inner, top, share * inner)
    foot = top + (max(ROOM.lines, told.lines) + 1.2) * PAGE.line
    for k, table in enumerate((told.lengths, told.limits)):
        page.text(PAGE.margin, foot + 3.6 * k, table.note, 6.6, color=GREY)


def _table(page: _Page, table: Table, left: float, top: float, wide: float) -> None:
    page.text(left, top, table.heading, 8.5, weight="bold")
    stops = {2: (1.0,), 3: (0.68, 1.0), 4: (0.55, 0.78, 1.0)}[len(table.columns)]
    y = top
    if any(table.columns):
        y += PAGE.line
        for stop, words in zip(stops, table.columns[1:], strict=True):
            page.text(left + stop * wide, y, words, 6.6, color=GREY, ha="right")
    for row in table.rows:
        y += PAGE.line
        page.text(left, y, row[0], 7.2, color=GREY)
        for stop, words in zip(stops, row[1:], strict=True):
            page.text(left + stop * wide, y, words, 7.2, ha="right")


def _curves(page: _Page, guide: Guide, top: float) -> None:
    drive, shown = curves(guide)
    across = 0.5 * (page.width - 2 * PAGE.margin - PAGE.gap)
    for k, one in enumerate(shown[:4]):
        x, y = PAGE.margin + 5 + (k % 2) * (across + PAGE.gap), top + (k // 2) * (PAGE.curves + PAGE.gap)
        axes = page.axes(x, y, across - 5, PAGE.curves, one.name.split(" [")[0])
        panel(axes, drive.values, one, size=7.0)
        if k + 2 >= len(shown[:4]):
            axes.set_xlabel(drive.label, family=SANS, size=6.6, color=GREY, labelpad=1.5)


def _draw_notes(page: _Page, told: Content, top: float) -> None:
    page.rule(top - 3.5)
    for k, line in enumerate(told.theory):
        page.text(PAGE.margin, top + 4.1 * (k + 0.3), line, 7.4)
    page.text(PAGE.margin, page.height - PAGE.margin + 2.5, told.provenance, 6.8, color=GREY, gid="provenance")
