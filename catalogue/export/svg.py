"""A guide as an SVG drawing in true size: linkage in the given position, path, parts to cut.

Groups have the names of the layers of the DXF.  Width and height are in millimetres; coordinates
are in the unit of the guide, y downwards.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..kinematics.splines import cubic
from ..markup import Markup, element
from ..units import MILLIMETRES
from .layout import PART_LAYOUT, laid_out
from .levels import POSES, stack_levels
from .links import Links, placed_over, taken_apart
from .outlines import Outline, Part, Sizes, parts

if TYPE_CHECKING:
    from ..guides.kinds import Guide
    from .formats import Options

#: Colours of the groups.
COLOURS = {
    "FRAME": "#777",
    "LINKS": "#04c",
    "PIVOTS": "#d00",
    "WHEELS": "#777",
    "PATH": "#e80",
    "CUT": "#000",
    "NAMES": "#000",
}


@dataclass(frozen=True)
class Strokes:
    """Lines and letters of the drawing.

    Attributes
    ----------
    width : float
        Width of lines [mm].
    advance : float
        Width of the widest letter over the height of a capital.
    capital : float
        Height of a capital over the size of the font.
    """

    width: float = 0.2
    advance: float = 0.75
    capital: float = 0.72


STROKES = Strokes()


def written_svg(guide: Guide, options: Options) -> str:
    """Return the drawing as the text of an SVG file."""
    links = taken_apart(guide)
    cut = parts(links, Sizes.of(links, options.bar_width, options.hole))
    layout = laid_out(cut, stack_levels(cut, placed_over(guide, links, POSES)), links)
    groups: dict[str, list[Markup]] = {name: [] for name in COLOURS}
    corners: list[complex] = [*links.path.tolist()]
    for part in cut:
        layer = "FRAME" if part.link.kind == "frame" else "LINKS"
        edges, holes = _part_elements(part, part.link.origin, part.link.turn)
        groups[layer].append(element("g", *edges, id=part.link.name))
        groups["PIVOTS"] += holes
        corners += part.edge.placed(part.link.origin, part.link.turn).points()
    for part, shift in layout.parts:
        edges, holes = _part_elements(part, shift)
        groups["CUT"].append(element("g", *edges, *holes, id=f"cut {part.link.name}"))
        corners += part.edge.placed(shift).points()
    for _, centre, radius in links.wheels:
        groups["WHEELS"].append(_circle(centre, radius))
        corners += [centre + radius * way for way in (1, 1j, -1, -1j)]
    groups["PATH"].append(element("path", d=_bezier(links)))
    for text, z in layout.texts:
        groups["NAMES"].append(element("text", text, x=_number(z.real), y=_number(-z.imag)))
        corners += [z, z + layout.letter * (STROKES.advance * len(text) + 1j)]
    hairline = STROKES.width / MILLIMETRES[options.written]
    drawn = [_group(name, content, hairline, layout.letter) for name, content in groups.items() if content]
    note = [element("desc", options.assumption)] if options.assumption else []
    return f"{element('svg', element('title', links.title), *note, *drawn, **_frame(corners, options, links))}\n"


def _frame(corners: Sequence[complex], options: Options, links: Links) -> dict[str, str]:
    """Return the attributes that give the drawing its true size."""
    every, border = np.array(corners), PART_LAYOUT.space * links.size
    x, y = float(every.real.min()) - border, float(every.imag.max()) + border
    wide, high = float(every.real.max()) + border - x, y - float(every.imag.min()) + border
    millimetres = MILLIMETRES[options.written]
    return {
        "xmlns": "http://www.w3.org/2000/svg",
        "width": f"{_number(wide * millimetres)}mm",
        "height": f"{_number(high * millimetres)}mm",
        "viewBox": f"{_number(x)} {_number(-y)} {_number(wide)} {_number(high)}",
    }


def _group(name: str, content: list[Markup], hairline: float, letter: float) -> Markup:
    """Return a group in its colour: lines, or letters."""
    if name == "NAMES":
        style = {"fill": COLOURS[name], "font-family": "sans-serif", "font-size": _number(letter / STROKES.capital)}
    else:
        style = {"fill": "none", "stroke": COLOURS[name], "stroke-width": _number(hairline)}
    return element("g", *content, id=name, **style)


def _part_elements(part: Part, origin: complex, turn: complex = 1 + 0j) -> tuple[list[Markup], list[Markup]]:
    """Return edge and slots of a part, and its holes, at a place."""
    edges = [_outline(edge.placed(origin, turn)) for edge in (part.edge, *part.slots.values())]
    return edges, [_circle(origin + turn * z, 0.5 * part.bore) for z in part.holes.values()]


def _outline(outline: Outline) -> Markup:
    """Return an outline as a path of lines and arcs."""
    steps = [f"M{_point(outline.corners[0])}"]
    for k, bulge in enumerate(outline.bulges):
        start, end = outline.corners[k], outline.corners[(k + 1) % len(outline.corners)]
        if bulge:
            sweep = 4 * math.atan(abs(bulge))
            radius = _number(0.5 * abs(end - start) / math.sin(0.5 * sweep))
            steps.append(f"A{radius} {radius} 0 {int(sweep > math.pi)} {int(bulge < 0)} {_point(end)}")
        else:
            steps.append(f"L{_point(end)}")
    return element("path", d=f"{' '.join(steps)} Z")


def _bezier(links: Links) -> str:
    """Return the spline of the path as cubic Bézier curves, which represent it exactly."""
    spline = cubic(links.knots, links.path)
    breaks = np.unique(spline.t)
    step = np.diff(breaks)[:, None] / 3
    ends, slopes = spline(breaks), spline.derivative()(breaks)
    first, second = ends[:-1] + step * slopes[:-1], ends[1:] - step * slopes[1:]
    curves = [" ".join(_point(complex(*z)) for z in three) for three in zip(first, second, ends[1:], strict=True)]
    return f"M{_point(complex(*ends[0]))} C{' '.join(curves)}"


def _circle(centre: complex, radius: float) -> Markup:
    return element("circle", cx=_number(centre.real), cy=_number(-centre.imag), r=_number(radius))


def _point(z: complex) -> str:
    return f"{_number(z.real)} {_number(-z.imag)}"


def _number(value: float) -> str:
    """Return a number with twelve digits and without an exponent."""
    return np.format_float_positional(value + 0.0, precision=12, fractional=False, trim="-")
