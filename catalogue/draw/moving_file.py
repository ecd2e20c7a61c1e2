"""An animated drawing as a file: to scale in true millimetres, dimensioned, with check boxes.

It moves without its script, which only toggles layers and pauses the motion.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..guides.kinds import has_bars, has_stroke
from ..markup import NOTHING, Markup, element, join
from ..units import ASSUMED, ASSUMPTION, millimetres
from .frame import Frame, largest_scale, size_at
from .moving import compute_poses, drawing
from .moving_layers import layers_of
from .moving_style import colour
from .svg import Clock, group, number, pair, text
from .units import Scale, length
from .words import describe_guide, facts, family, places

if TYPE_CHECKING:
    from ..guides.kinds import Guide


class MovingSheet(NamedTuple):
    """Layout of the moving drawing [mm]."""

    point: float = 0.38  #: size of a point of the symbols
    margin: float = 8.0  #: margin
    narrowest: float = 130.0  #: smallest width of the sheet, for its texts
    widest: float = 240.0  #: largest width of the drawing
    tallest: float = 200.0  #: largest height of the drawing
    head: float = 19.0  #: height of the title, with one line of facts
    letter: float = 1.9  #: mean width of a letter of the facts
    series_letter: float = 4.6  #: mean width of a letter of the name
    family_letter: float = 2.9  #: mean width of a letter of the family's name
    line: float = 4.6  #: height of a line of text
    scale_bar: float = 11.0  #: height of the scale bar
    controls: float = 8.0  #: height of a row of controls
    dimension: float = 16.0  #: room for the dimension of the stroke on both sides of the drawing
    box: float = 37.0  #: width of a check box with its label


SHEET = MovingSheet()

#: Labels of the layers.
WORDS = {
    "turn": "whole path",
    "circle": "inflection circle",
    "cubics": "cubics",
    "centrodes": "centrodes",
    "pole": "pole",
    "velocity": "velocity",
    "names": "names",
}
#: Layers shown at first.
SHOWN = ("names",)

#: Script that toggles layers, pauses the motion and scrubs it.
_SCRIPT = """(function () {
var svg = document.currentScript.ownerSVGElement, bar = svg.querySelector('.bar'), span = +bar.dataset.span;
var play = svg.querySelector('.play'), held = false;
svg.classList.add('scripted');
function hold(now) {
  held = now;
  if (now) svg.pauseAnimations(); else svg.unpauseAnimations();
  play.setAttribute('aria-checked', !now);
}
function act(box) {
  var name = box.dataset.layer;
  if (name) box.setAttribute('aria-checked', !svg.classList.toggle('hide-' + name)); else hold(!held);
}
svg.querySelectorAll('.control').forEach(function (box) {
  box.onclick = function () { act(box); };
  box.onkeydown = function (e) { if (e.key == ' ' || e.key == 'Enter') { e.preventDefault(); act(box); } };
});
function seek(e) {
  var r = bar.getBoundingClientRect();
  hold(true);
  svg.setCurrentTime(span * Math.max(0, Math.min(0.999999, (e.clientX - r.left) / r.width)));
}
bar.onpointerdown = function (e) { bar.setPointerCapture(e.pointerId); seek(e); bar.onpointermove = seek; };
bar.onpointerup = function () { bar.onpointermove = null; };
if (matchMedia('(prefers-reduced-motion: reduce)').matches) hold(true);
})()"""

_SERIF = "font-family:STIXGeneral,'STIX Two Text',Georgia,serif"
_STYLE = f"""
.guide-drawing .controls{{display:none}}.guide-drawing.scripted .controls{{display:inline}}
.guide-drawing .control,.guide-drawing .bar{{cursor:pointer}}.guide-drawing .control:focus{{outline:none}}
.guide-drawing .box{{fill:none;stroke:{colour("grey")};stroke-width:calc(1*var(--guide-point))}}
.guide-drawing .control:focus .box{{stroke:{colour("ink")};stroke-width:calc(2*var(--guide-point))}}
.guide-drawing .tick{{fill:none;stroke:{colour("coupler")};stroke-width:calc(2*var(--guide-point))}}
.guide-drawing [aria-checked=false] .tick{{display:none}}
.guide-drawing .bar{{fill:{colour("faint")}}}
.guide-drawing .series{{{_SERIF};font-weight:bold;font-size:calc(21*var(--guide-point))}}
.guide-drawing .family{{{_SERIF};font-weight:normal;font-style:italic;font-size:calc(16*var(--guide-point))}}
.guide-drawing .fact{{fill:{colour("grey")}}}
.guide-drawing .dimension{{stroke:{colour("grey")};stroke-width:calc(.9*var(--guide-point));fill:none}}
"""


def moving_file(guide: Guide, *, unit: str | None = None, scale: str | None = None, code: str = "") -> Markup:
    """Draw an animated guide as an SVG file, to scale in true millimetres.

    Parameters
    ----------
    guide : Guide
    unit : str, optional
        Unit to convert to; default: that of the guide.  An unknown unit is taken as millimetres,
        with a note.
    scale : str, optional
        Scale such as ``1:2`` or ``5:1``; default: the largest standard scale that fits a sheet.
    code : str
        Code of the guide, for the title.

    Raises
    ------
    InvalidRequest
        If unit or scale is invalid; see also `poses.poses`.
    """
    guide = guide.in_unit(unit)
    unit = guide.unit or ASSUMED
    shown = compute_poses(guide)
    # on a closed circuit the path is drawn already
    layers = [name for name in layers_of(guide) if name != "turn" or not shown.closed]
    per = millimetres(unit)
    drawn = (
        Scale.named(scale)
        if scale is not None
        else Scale.fitting(largest_scale(shown.machine, SHEET.widest, SHEET.tallest, SHEET.point) / per)
    )
    ratio = drawn.ratio * per
    size = size_at(shown.machine, ratio, SHEET.point) + (1 + 1j) * (SHEET.dimension if hasattr(guide, "stroke") else 0)
    told = [f"{name} = {length(value, unit)}" for name, value in guide.lengths.items()] + places(guide, unit)
    width = max(size.real, SHEET.narrowest) + 2 * SHEET.margin
    columns = max(1, int((width - 2 * SHEET.margin) // 60))
    lines = _fact_lines(guide, code, unit, width - 2 * SHEET.margin)
    head = SHEET.head + SHEET.line * (len(lines) - 1)
    rows = math.ceil(len(told) / columns)
    top = head + size.imag + 6
    height = (
        top + SHEET.scale_bar + rows * SHEET.line + SHEET.controls * math.ceil(len(layers) / _boxes_per_row(width)) + 10
    )
    middle = complex(0.5 * width, head + 0.5 * size.imag)
    frame = Frame.centred(shown.machine, ratio, SHEET.point, width, height, middle)
    clock = Clock(5.0, shown.closed, shown.middle, time=shown.time)
    left = (width - 2 * SHEET.margin) / columns
    listed = [
        text(words, complex(SHEET.margin + left * (k // rows), top + SHEET.scale_bar + SHEET.line * (k % rows)), "fact")
        for k, words in enumerate(told)
    ]
    inside = [
        element("style", _STYLE),
        _title(guide, lines, width - 2 * SHEET.margin),
        _dimension(guide, frame, unit),
        _bar(frame, drawn, unit, top),
        *listed,
        _controls(layers, clock, frame, top + SHEET.scale_bar + rows * SHEET.line + 2),
        element("script", _SCRIPT),
    ]
    hidden = [name for name in layers if name not in SHOWN]
    return drawing(
        guide,
        shown,
        frame,
        clock,
        layers,
        hidden,
        describe_guide(guide, code),
        "guide-",
        clip=(head - 1, top),
        inside=join(inside),
        width=f"{number(width)}mm",
        height=f"{number(height)}mm",
    )


def _boxes_per_row(width: float) -> int:
    """Return the number of check boxes per row."""
    return max(1, int((width - 2 * SHEET.margin) // SHEET.box))


def _fact_lines(guide: Guide, code: str, unit: str, width: float) -> list[str]:
    """Return the facts below the title, in lines of a width [mm]."""
    lines: list[str] = []
    for part in filter(None, [code, *facts(guide, unit), "" if guide.unit else ASSUMPTION]):
        longer = f"{lines[-1]} · {part}" if lines else part
        if lines and SHEET.letter * len(longer) <= width:
            lines[-1] = longer
        else:
            lines.append(part)
    return lines


def _title(guide: Guide, lines: list[str], width: float) -> Markup:
    """Return the title, written smaller where it is wider than `width` [mm]; facts below it."""
    series, kind = getattr(guide, "series", "") or getattr(guide, "name", ""), family(guide)
    head = element("tspan", series, "\u2002" if series else "") + element("tspan", kind, class_="family")
    share = min(1.0, width / (SHEET.series_letter * (len(series) + 1) + SHEET.family_letter * len(kind)))
    style = f"--guide-point:{number(share * SHEET.point, 4)}px"
    title = element("text", head, class_="series", x=number(SHEET.margin), y="10", style=style)
    told = [text(line, complex(SHEET.margin, 15.5 + SHEET.line * k), "fact") for k, line in enumerate(lines)]
    return join([title, *told])


def _dimension(guide: Guide, frame: Frame, unit: str) -> Markup:
    """Return the dimension line of the stroke, on the emptier side of the path."""
    if not has_stroke(guide):
        return NOTHING
    stroke, way = guide.stroke, guide.frame
    ends = frame.at(way.origin + stroke * way.direction * np.array([0, 1]))
    along = (ends[1] - ends[0]) / abs(ends[1] - ends[0])
    finite = guide.chain.z[:, 0] if has_bars(guide) else guide.linkage.points[0][guide.linkage.finite[0]]
    side = 1j if ((frame.at(finite) - ends[0]) * np.conj(1j * along)).real.sum() < 0 else -1j
    away = side * along
    line = ends + 6.5 * away
    parts = [f"M{pair(end + 1.5 * away)}L{pair(end + 7.5 * away)}" for end in ends]
    parts.append(f"M{pair(line[0])}L{pair(line[1])}")
    for end, way in ((line[0], along), (line[1], -along)):
        parts.append(f"M{pair(end + 1.8 * way * np.exp(0.3j))}L{pair(end)}L{pair(end + 1.8 * way * np.exp(-0.3j))}")
    middle = 0.5 * (line[0] + line[1])
    angle = math.degrees(math.atan2(along.imag, along.real))
    angle = (angle + 90) % 180 - 90  # never upside down
    words = element(
        "text",
        length(stroke, unit),
        class_="halo",
        text_anchor="middle",
        x="0",
        y=number(-1.0),
        transform=f"translate({pair(middle)}) rotate({number(angle)})",
    )
    return element("path", class_="dimension", d="".join(parts)) + words


def _bar(frame: Frame, scale: Scale, unit: str, top: float) -> Markup:
    """Return a scale bar of a round length, with the scale."""
    step = scale.bar(unit, 45.0)
    right = complex(SHEET.margin + step * frame.scale, top + 4)
    left = complex(SHEET.margin, top + 4)
    data = f"M{pair(left - 1.2j)}L{pair(left)}L{pair(right)}L{pair(right - 1.2j)}"
    said = f"{length(step, unit)}   ·   scale {scale}"
    return element("path", class_="dimension", d=data) + text(said, right + 2 + 0.8j, "fact")


def _controls(layers: Sequence[str], clock: Clock, frame: Frame, top: float) -> Markup:
    """Return the check boxes of the layers, and the bar to pause and scrub the motion."""
    parts, across = [], _boxes_per_row(frame.width)
    for k, name in enumerate(layers):
        at = complex(SHEET.margin + SHEET.box * (k % across), top + SHEET.controls * (k // across))
        parts.append(_box(at, WORDS[name], name in SHOWN, data_layer=name))
    below = top + SHEET.controls * math.ceil(len(layers) / across)
    parts.append(_box(complex(SHEET.margin, below), "motion", True, play=" play"))
    bar = element(
        "rect",
        class_="bar",
        x=number(SHEET.margin + SHEET.box),
        y=number(below + 0.4),
        height="2.4",
        rx="1.2",
        width=number(frame.width - 2 * SHEET.margin - SHEET.box),
        data_span=number(clock.seconds * (1 if clock.closed else 0.5)),
    )
    return group("controls", *parts, bar)


def _box(at: complex, words: str, ticked: bool, play: str = "", **data: str) -> Markup:
    tick = f"M{pair(at + 0.7 + 1.7j)}L{pair(at + 1.4 + 2.4j)}L{pair(at + 2.6 + 0.7j)}"
    return element(
        "g",
        element("rect", class_="box", x=number(at.real), y=number(at.imag), width="3.2", height="3.2", rx="0.6"),
        element("path", class_="tick", d=tick),
        text(words, at + 4.8 + 2.7j, "word"),
        class_=f"control{play}",
        role="checkbox",
        tabindex="0",
        aria_checked="true" if ticked else "false",
        aria_label=words,
        **data,
    )
