"""A data sheet as a page of HTML: animated on the screen, to scale on paper."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..markup import Markup, element, fill, join
from ..units import ASSUMED, millimetres
from .curves import LAYOUT, Curve, Drive, curves
from .datasheet import Content, Table, content, paper_of
from .frame import Frame, largest_scale
from .moving import compute_poses, drawing
from .moving_style import DARK, LIGHT, properties
from .svg import Clock, number, polyline, text
from .units import Scale, length
from .words import describe_guide

if TYPE_CHECKING:
    from ..guides.kinds import Guide


class HtmlSheet(NamedTuple):
    """Layout of the data sheet as a page [mm]."""

    margin: float = 14.0  #: margin of the paper
    below: float = 182.0  #: height of the part below the drawing
    point: float = 0.36  #: size of a point of the symbols


PAPER = HtmlSheet()

#: Width and height of a curve [mm].
CURVE = (86.0, 20.0)

_PAGE = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>$title</title>
<link rel="icon" href="data:,">
<style>
:root { $light color-scheme: light dark }
@media (prefers-color-scheme: dark) { @media screen { :root { $dark } } }
@page { size: ${wide}mm ${high}mm; margin: 0 }
body { margin: 0 auto; box-sizing: border-box; width: ${wide}mm; padding: ${margin}mm;
  background: var(--guide-paper); color: var(--guide-ink); font: 2.7mm/1.5 "DejaVu Sans", Verdana, sans-serif;
  -webkit-print-color-adjust: exact; print-color-adjust: exact }
h1 { margin: 0; font: bold 7.4mm/1.1 STIXGeneral, "STIX Two Text", Georgia, serif; display: flex; gap: 3mm;
  align-items: baseline }
h1 em { font-weight: normal; font-size: 5mm } h1 code { margin-left: auto; font-size: 3.8mm; font-weight: normal }
h2 { font-size: 2.9mm; margin: 0 } p { margin: 0 } .grey, th, td:first-child, h1 code { color: var(--guide-grey) }
header, .drawing { border-bottom: 0.25mm solid var(--guide-faint); padding-bottom: 1.5mm; margin-bottom: 2mm }
.drawing svg { display: block; width: 100%; height: auto }
.tables { display: grid; grid-template-columns: 29fr 33fr 33fr; gap: 6mm }
table { border-collapse: collapse; width: 100%; font-size: 2.45mm } td, th { padding: 0; white-space: nowrap;
  text-align: right; font-weight: normal; font-variant-numeric: tabular-nums }
td:first-child { text-align: left } th { font-size: 2.2mm }
.curves { display: grid; grid-template-columns: 1fr 1fr; gap: 1mm 8mm; margin-top: 2mm }
.curves svg { width: 100%; height: auto; overflow: visible }
.axis { stroke: var(--guide-grey); fill: none; stroke-width: 0.25 } .zero { stroke: var(--guide-faint) }
.curves text { font-size: 2.3px; fill: var(--guide-grey) } .curves .name { font-size: 2.6px; fill: var(--guide-ink) }
footer { border-top: 0.25mm solid var(--guide-faint); margin-top: 2mm; padding-top: 1.5mm; font-size: 2.55mm }
.small { font-size: 2.3mm }
</style>
<body>
<header><h1>$series <em>$kind</em> <code>$code</code></h1><p class="grey">$facts</p></header>
<div class="drawing">$drawing</div>
<div class="tables">$tables</div>
<p class="grey small">$note</p><p class="grey small">$stops</p>
<div class="curves">$curves</div>
<footer>$theory<p class="grey small">$provenance</p></footer>
</body>
</html>
"""


def sheet_html(guide: Guide, *, paper: str = "a4", unit: str | None = None, scale: str | None = None) -> Markup:
    """Return the data sheet of a guide as a self-contained page.

    See `catalogue.Candidate.sheet`.
    """
    wide, high = paper_of(paper)
    told = content(here := guide.in_unit(unit), guide.code)
    svg = _drawing(here, scale, wide - 2 * PAPER.margin, high - PAPER.below)
    drive, shown = curves(here)
    return fill(
        _PAGE,
        title=describe_guide(here, told.code),
        light=properties(LIGHT),
        dark=properties(DARK),
        wide=number(wide),
        high=number(high),
        margin=number(PAPER.margin),
        series=told.series,
        kind=told.kind,
        code=told.code,
        facts="   ·   ".join(told.facts),
        drawing=svg,
        tables=_tables(told),
        note=told.lengths.note,
        stops=told.limits.note,
        curves=join(_curve(drive, one) for one in shown[:4]),
        theory=join(element("p", line) for line in told.theory),
        provenance=told.provenance,
    )


def _drawing(guide: Guide, scale: str | None, wide: float, high: float) -> Markup:
    """Return the animated drawing in true millimetres with a scale bar."""
    unit = guide.unit or ASSUMED
    shown, per = compute_poses(guide), millimetres(unit)
    room = high - 7
    fitting = largest_scale(shown.machine, wide, room, PAPER.point) / per
    to = Scale.named(scale) if scale is not None else Scale.fitting(fitting)
    frame = Frame.centred(shown.machine, to.ratio * per, PAPER.point, wide, high, complex(0.5 * wide, 0.5 * room))
    step = to.bar(unit, 45.0)
    y, end = high - 2.0, 0.3 + step * frame.scale
    bar = element("path", class_="frame", d=f"M0.3 {number(y - 1.2)}V{number(y)}H{number(end)}V{number(y - 1.2)}")
    bar += text(f"{length(step, unit)}   ·   scale {to}", complex(end + 1.5, y), "word")
    clock = Clock(5.0, shown.closed, shown.middle, time=shown.time)
    return drawing(
        guide,
        shown,
        frame,
        clock,
        ("names",),
        (),
        describe_guide(guide),
        "sheet-",
        inside=bar,
        width=f"{number(wide)}mm",
        height=f"{number(high)}mm",
    )


def _tables(told: Content) -> Markup:
    return join(_table(table) for table in (told.lengths, told.pivots, told.limits))


def _table(table: Table) -> Markup:
    head = [element("th", name) for name in table.columns] if any(table.columns) else []
    rows = [element("tr", *(element("td", cell) for cell in row)) for row in table.rows]
    return element("section", element("h2", table.heading), element("table", element("tr", *head), *rows))


def _curve(over: Drive, curve: Curve) -> Markup:
    """Return one curve over the drive, with its range at the axis."""
    wide, high = CURVE
    left, top, bottom = 12.0, 4.5, high - 5.0
    values, drive = curve.values, over.values
    low, top_value = float(np.nanmin(values)), float(np.nanmax(values))
    if curve.zero:
        low, top_value = 0.0, min(top_value, LAYOUT.tallest * float(np.nanmedian(values)))
    span = top_value - low or 1.0
    low_drive, high_drive = float(min(drive[0], drive[-1])), float(max(drive[0], drive[-1]))
    x = left + (drive - low_drive) / (high_drive - low_drive or 1.0) * (wide - left)
    seen = np.where(values > top_value * (1 + 1e-9) if curve.zero else False, np.nan, values)
    y = bottom - (seen - low) / span * (bottom - top)
    parts = [
        text(curve.name, complex(left, 2.6), "name"),
        element("path", class_="axis", d=f"M{left} {top}V{bottom}H{wide}"),
        element("path", d=polyline((x + 1j * y)[::4]), fill="none", stroke=curve.colour, stroke_width="0.5"),
    ]
    if low < 0 < top_value:
        zero = number(bottom + low / span * (bottom - top))
        parts.append(element("path", class_="axis zero", d=f"M{left} {zero}H{wide}"))
    for value, at in ((low, bottom), (top_value, top + 1.5)):
        parts.append(text(f"{value:.3g}".replace("-", "−"), complex(left - 1, at), "", text_anchor="end"))
    for value, at, anchor in ((low_drive, left, "start"), (high_drive, wide, "end")):
        parts.append(text(f"{value:.4g}{over.mark}".replace("-", "−"), complex(at, bottom + 3), "", text_anchor=anchor))
    parts.append(text(over.name, complex(0.5 * (left + wide), bottom + 3), "", text_anchor="middle"))
    return element(
        "svg",
        *parts,
        xmlns="http://www.w3.org/2000/svg",
        viewBox=f"0 0 {number(wide)} {number(high)}",
        role="img",
        aria_label=curve.name,
    )
