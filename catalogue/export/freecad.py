"""A guide as a FreeCAD macro: a spreadsheet of parameters, and links as solids in place."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .. import __version__
from ..units import MILLIMETRES
from .formats import Options
from .levels import POSES, stack_levels
from .links import Links, placed_over, taken_apart
from .outlines import Outline, Sizes, parts
from .parameters import parameters, positional

if TYPE_CHECKING:
    from ..guides.kinds import Guide

MACRO = '''\
"""A guide ({family}) of mechanism-catalogue {version}, as solids; run it as a macro of FreeCAD, or by freecadcmd."""

import FreeCAD
import Part
from FreeCAD import Placement, Rotation, Vector

MILLIMETRES = {millimetres!r}  # in which FreeCAD reckons, of the unit of all lengths below: {unit}{assumption}
THICKNESS = {thickness!r}
HOLE = {hole!r}  # diameter

# name, value, unit, what it is
PARAMETERS = [
{parameters}]

# name, level, place of the origin, angle [deg], outline, slots and holes in coordinates of the
# link; a corner is (x, y, tangent of a quarter of the angle of the arc to the next one)
{notes}LINKS = [
{links}]

# point of the path, parameter of the spline through it
PATH = [
{path}]


def vector(x, y, z=0.0):
    return Vector(MILLIMETRES * x, MILLIMETRES * y, MILLIMETRES * z)


def wire(corners):
    edges = []
    for (x0, y0, bulge), (x1, y1, _) in zip(corners, corners[1:] + corners[:1]):
        start, end = vector(x0, y0), vector(x1, y1)
        if bulge:
            top = vector(0.5 * (x0 + x1 + bulge * (y1 - y0)), 0.5 * (y0 + y1 - bulge * (x1 - x0)))
            edges.append(Part.Arc(start, top, end).toShape())
        else:
            edges.append(Part.makeLine(start, end))
    return Part.Wire(edges)


def solid(outline, slots, holes):
    whole = Part.Face(wire(outline)).extrude(vector(0, 0, THICKNESS))
    for slot in slots:
        whole = whole.cut(Part.Face(wire(slot)).extrude(vector(0, 0, THICKNESS)))
    for x, y in holes:
        whole = whole.cut(Part.makeCylinder(0.5 * MILLIMETRES * HOLE, MILLIMETRES * THICKNESS, vector(x, y)))
    return whole


document = FreeCAD.newDocument("guide")
sheet = document.addObject("Spreadsheet::Sheet", "Parameters")
for row, (name, value, unit, what) in enumerate(PARAMETERS, 1):
    sheet.set("A%d" % row, name)
    sheet.set("B%d" % row, "=%s %s" % (value, unit))
    sheet.set("C%d" % row, what)
    sheet.setAlias("B%d" % row, name)

for name, level, (x, y), angle, outline, slots, holes in LINKS:
    part = document.addObject("Part::Feature", name.replace(" ", "_"))
    part.Label = name
    part.Shape = solid(outline, slots, holes)
    part.Placement = Placement(vector(x, y, level * THICKNESS), Rotation(Vector(0, 0, 1), angle))

curve = Part.BSplineCurve()
curve.interpolate(
    Points=[vector(x, y, {top} * THICKNESS) for x, y, _ in PATH], Parameters=[knot for *_, knot in PATH]
)
path = document.addObject("Part::Feature", "path")
path.Shape = curve.toShape()
document.recompute()
'''


def macro(guide: Guide, options: Options) -> str:
    """Return the macro: plain Python that does not import this package."""
    links = taken_apart(guide)
    sizes = Sizes.of(links, options.bar_width, options.hole)
    rows = [
        f"    ({p.name!r}, {positional(p.value)!r}, {p.unit!r}, {p.comment!r}),\n" for p in parameters(guide, options)
    ]
    told = []
    cut = parts(links, sizes)
    levels = stack_levels(cut, placed_over(guide, links, POSES))
    for part in cut:
        link = part.link
        told.append(
            f"    (\n        {link.name!r}, {levels.of[link.name]}, {_xy(link.origin)}, {link.angle!r},\n"
            f"        {_corners(part.edge)},\n        [{', '.join(map(_corners, part.slots.values()))}],\n"
            f"        [{', '.join(map(_xy, part.holes.values()))}],\n    ),\n"
        )
    return MACRO.format(
        family=links.title,
        version=__version__,
        unit=options.written,
        assumption=options.assumption and f"; {options.assumption}",
        millimetres=MILLIMETRES[options.written],
        thickness=sizes.thickness,
        hole=sizes.hole,
        parameters="".join(rows),
        links="".join(told),
        notes="".join(f"# {line}\n" for line in [*levels.notes(), *links.notes]),
        top=levels.top,
        path="".join(f"    ({z.real!r}, {z.imag!r}, {u!r}),\n" for z, u in zip(*_path_and_knots(links), strict=True)),
    )


def _path_and_knots(links: Links) -> tuple[list[complex], list[float]]:
    """Return the points of the path, and the parameters of its spline at them."""
    return links.path.tolist(), links.knots.tolist()


def _xy(z: complex) -> str:
    return f"({float(z.real)!r}, {float(z.imag)!r})"


def _corners(outline: Outline) -> str:
    corners = zip(outline.corners, outline.bulges, strict=True)
    return "[" + ", ".join(f"({float(z.real)!r}, {float(z.imag)!r}, {float(b)!r})" for z, b in corners) + "]"
