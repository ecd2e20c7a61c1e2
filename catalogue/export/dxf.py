"""A guide as a DXF drawing: linkage in the given position, path, dimensions, parts to cut.

Layers:

``FRAME``
    the frame with the slots of sliders
``LINKS``
    cranks, blocks and the coupler with the slots of slides
``PIVOTS``
    holes of pivots and guided point, as circles
``PATH``
    the path of the guided point over the stroke, as a spline
``WHEELS``
    pitch circles, of gears
``DIMENSIONS``
    lengths of the links
``NAMES``
    names of pivots and parts
``CUT``
    outlines, slots and holes of all parts, laid out beside the linkage; nothing is added for the
    tool

Each link is a block with its origin in its first pivot and x to the second one; an INSERT holds its
pose.  The header names the unit.  Lengths of unknown unit are written as millimetres, and the
custom property ``UNIT`` says so.
"""

from __future__ import annotations

import io
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InvalidRequest, MissingExtra
from ..kinematics.splines import cubic
from .layout import Layout, laid_out
from .levels import POSES, stack_levels
from .links import SAME, Links, distinct, placed_over, taken_apart
from .outlines import Outline, Part, Sizes, parts

if TYPE_CHECKING:
    from ezdxf.document import Drawing
    from ezdxf.layouts.base import BaseLayout
    from ezdxf.layouts.layout import Modelspace

    from ..guides.kinds import Guide
    from .formats import Options

#: Codes of units in the header (`$INSUNITS`), then the metric units.
UNITS = {"in": 1, "ft": 2, "mm": 4, "cm": 5, "m": 6}
METRIC = ("mm", "cm", "m")
#: Layers with their colours (AutoCAD's numbers; 7 is black or white).
LAYERS = {"FRAME": 8, "LINKS": 5, "PIVOTS": 1, "PATH": 30, "DIMENSIONS": 3, "NAMES": 7, "CUT": 2}
#: Significant digits of a dimension as long as the linkage; the decimals of all follow from it.
DIGITS = 6


def written_dxf(guide: Guide, options: Options) -> str:
    """Return the drawing as the text of a DXF file (R2010); the same guide gives the same text."""
    try:
        from ezdxf import options as settings  # type: ignore[attr-defined]  # its types hide it
    except ImportError as error:
        raise MissingExtra('DXF needs ezdxf: pip install "mechanism-catalogue[cad]"') from error
    links = taken_apart(guide)
    # ezdxf treats ellipses with axes below 1e-12 as points, and squares in its zoom overflow
    smallest, largest = 1e-9, 1e60
    if not smallest <= links.size <= largest:
        raise InvalidRequest(
            f"a DXF holds linkages of {smallest:g} to {largest:g} {options.written}, not of {links.size:.3g}: "
            "choose another unit"
        )
    cut = parts(links, Sizes.of(links, options.bar_width, options.hole))
    fixed = settings.write_fixed_meta_data_for_testing
    settings.write_fixed_meta_data_for_testing = True  # no time of day and no random number in the file
    try:
        document = drawing(guide, links, cut, options)
        out = io.StringIO()
        document.write(out)
    finally:
        settings.write_fixed_meta_data_for_testing = fixed
    return out.getvalue()


def drawing(guide: Guide, links: Links, cut: list[Part], options: Options) -> Drawing:
    """Return the drawing as an object of ezdxf."""
    from ezdxf import zoom
    from ezdxf.filemanagement import new

    document = new("R2010", setup=["linetypes"], units=UNITS[options.written])
    document.header["$MEASUREMENT"] = int(options.written in METRIC)
    if options.assumption:
        document.header.custom_vars.append("UNIT", options.assumption)
    for name, colour in LAYERS.items():
        document.layers.add(name, color=colour)
    space = document.modelspace()
    names = block_names([part.link.name for part in cut])
    for part in cut:
        link = part.link
        _define_block(document, part, names[link.name])
        where = {"layer": "FRAME" if link.kind == "frame" else "LINKS", "rotation": link.angle}
        space.add_blockref(names[link.name], _xy(link.origin), dxfattribs=where)
    _draw_path(space, links)
    if links.wheels:
        document.layers.add("WHEELS", color=LAYERS["FRAME"])
    for _, centre, radius in links.wheels:
        space.add_circle(_xy(centre), radius, dxfattribs={"layer": "WHEELS"})
    layout = laid_out(cut, stack_levels(cut, placed_over(guide, links, POSES)), links)
    _draw_parts_to_cut(space, layout)
    _dimensions(document, links, layout.letter)
    zoom.extents(space)
    return document


def block_names(links: list[str]) -> dict[str, str]:
    """Return names of blocks, such as ``CRANK_1``, in characters of a DXF."""
    return dict(zip(links, distinct([link.upper() for link in links]), strict=True))


def _xy(z: complex) -> tuple[float, float]:
    return z.real, z.imag


def _outline(space: BaseLayout, outline: Outline, layer: str) -> None:
    points = [(z.real, z.imag, bulge) for z, bulge in zip(outline.corners, outline.bulges, strict=True)]
    space.add_lwpolyline(points, format="xyb", close=True, dxfattribs={"layer": layer})


def _define_block(document: Drawing, part: Part, name: str) -> None:
    """Define the block of a link."""
    block = document.blocks.new(name)
    block.units = int(document.units)  # type: ignore[assignment]  # its types want it as it reads it
    layer = "FRAME" if part.link.kind == "frame" else "LINKS"
    for outline in (part.edge, *part.slots.values()):
        _outline(block, outline, layer)
    for z in part.holes.values():
        block.add_circle(_xy(z), 0.5 * part.bore, dxfattribs={"layer": "PIVOTS"})


def _draw_path(space: Modelspace, links: Links) -> None:
    """Draw the path as the cubic spline through its points."""
    spline = cubic(links.knots, links.path)
    space.add_open_spline(
        [(float(p[0]), float(p[1]), 0.0) for p in np.asarray(spline.c)],
        degree=3,
        knots=[float(t) for t in spline.t],
        dxfattribs={"layer": "PATH"},
    )


def _dimensions(document: Drawing, links: Links, letter: float) -> None:
    """Draw the lengths of the links beside them, on the outer side."""
    decimals = max(0, min(8, DIGITS - 1 - math.floor(math.log10(links.size))))
    style = document.dimstyles.new("GUIDE")
    document.header["$DIMSTYLE"] = "GUIDE"
    look: dict[str, Any] = {
        "dimtxt": letter,
        "dimasz": letter,
        "dimexo": 0.5 * letter,
        "dimexe": 0.5 * letter,
        "dimgap": 0.4 * letter,
        "dimdec": decimals,
        "dimtad": 1,
        "dimzin": 8,
        "dimdsep": ord("."),
        "dimtih": 0,
        "dimtoh": 0,
        "dimscale": 1.0,
        "dimlfac": 1.0,
        "dimclrd": 0,
        "dimclre": 0,
        "dimclrt": 0,
    }
    for key, value in look.items():
        style.set_dxf_attrib(key, value)
        document.header[f"${key.upper()}"] = value  # LibreCAD reads these variables
    measured = [ends for ends in links.lengths.values() if abs(ends[1] - ends[0]) > SAME * links.size]
    middle = sum((a + b for a, b in measured), 0j) / (2 * len(measured))
    lines: list[tuple[complex, complex]] = []
    for a, b in sorted(measured, key=lambda ends: abs(ends[1] - ends[0])):
        if not -1.4 < np.angle(b - a) < 1.74:  # letters are read from below, or from the right
            a, b = b, a
        up = 1j * (b - a) / abs(b - a)
        side = up if ((0.5 * (a + b) - middle) * up.conjugate()).real > 0 else -up
        away = 4 * letter
        while any(_run_side_by_side((a + away * side, b + away * side), line, 2.5 * letter) for line in lines):
            away += 3 * letter
        lines.append((a + away * side, b + away * side))
        document.modelspace().add_aligned_dim(
            _xy(a),
            _xy(b),
            distance=away if side == up else -away,
            dimstyle="GUIDE",
            dxfattribs={"layer": "DIMENSIONS"},
        ).render()


def _run_side_by_side(one: tuple[complex, complex], other: tuple[complex, complex], near: float) -> bool:
    """Tell whether two nearly parallel lines run side by side within a distance."""
    along = (one[1] - one[0]) / abs(one[1] - one[0])
    start, end = ((z - one[0]) * along.conjugate() for z in other)
    low, high = sorted((start.real, end.real))
    parallel = abs((end - start).imag) < 0.4 * abs(end - start)
    return (
        parallel
        and min(abs(start.imag), abs(end.imag)) < near
        and low < abs(one[1] - one[0]) - 1e-9 * near
        and high > 1e-9 * near
    )


def _draw_parts_to_cut(space: Modelspace, layout: Layout) -> None:
    """Draw the parts to cut, and all names and notes."""
    for part, shift in layout.parts:
        for outline in (part.edge, *part.slots.values()):
            _outline(space, outline.placed(shift), "CUT")
        for z in part.holes.values():
            space.add_circle(_xy(z + shift), 0.5 * part.bore, dxfattribs={"layer": "CUT"})
    for text, z in layout.texts:
        space.add_text(text, height=layout.letter, dxfattribs={"layer": "NAMES", "insert": _xy(z)})
