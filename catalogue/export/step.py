"""A guide as a STEP file: links as named solids in place, and the guided path."""

from __future__ import annotations

import tempfile
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import MissingExtra
from ..units import MILLIMETRES
from .formats import Options
from .levels import POSES, stack_levels
from .links import placed_over, taken_apart
from .outlines import Outline, Part, Sizes, parts

if TYPE_CHECKING:
    from ..guides.kinds import Guide

#: Time of creation in the file: fixed, so that the same guide gives the same file.
EPOCH = "2000-01-01T00:00:00"


def solids(guide: Guide, options: Options) -> str:
    """Return the file, in millimetres.

    Raises
    ------
    MissingExtra
        If build123d is not installed.
    """
    try:
        cad: Any = import_module("build123d")  # by name: it ships types, and is seldom installed
    except ImportError as error:
        raise MissingExtra('step needs build123d: pip install "mechanism-catalogue[step]"') from error
    links = taken_apart(guide)
    sizes = Sizes.of(links, options.bar_width, options.hole)
    unit, rise = MILLIMETRES[options.written], MILLIMETRES[options.written] * sizes.thickness
    made: list[Any] = []
    cut = parts(links, sizes)
    levels = stack_levels(cut, placed_over(guide, links, POSES))
    for part in cut:
        origin = unit * part.link.origin
        solid = cad.Solid.extrude(_face(cad, part, unit), cad.Vector(0, 0, rise))
        solid = solid.moved(
            cad.Location((origin.real, origin.imag, levels.of[part.link.name] * rise), (0, 0, part.link.angle))
        )
        solid.label = part.link.name
        made.append(solid)
    places = [(z.real, z.imag, levels.top * rise) for z in (unit * links.path).tolist()]
    path = cad.Edge.make_spline(places, parameters=links.knots.tolist())
    path.label = "path"
    label = "; ".join(part for part in (links.title, *levels.notes(), *links.notes, options.assumption) if part)
    whole = cad.Compound(label=label, children=[*made, path])
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "guide.step"
        cad.export_step(whole, file, timestamp=EPOCH)
        return file.read_text("utf-8")


def _face(cad: Any, part: Part, unit: float) -> Any:
    """Return a part as a face with slots and holes, in its link's frame [mm]."""
    holes = [
        cad.Wire(cad.Edge.make_circle(0.5 * unit * part.bore, cad.Plane((unit * z.real, unit * z.imag, 0))))
        for z in part.holes.values()
    ]
    return cad.Face(_wire(cad, part.edge, unit), [*(_wire(cad, slot, unit) for slot in part.slots.values()), *holes])


def _wire(cad: Any, outline: Outline, unit: float) -> Any:
    edges = []
    corners = [unit * z for z in outline.corners]
    for start, end, bulge in zip(corners, corners[1:] + corners[:1], outline.bulges, strict=True):
        ends = [(z.real, z.imag) for z in (start, end)]
        if bulge:
            top = 0.5 * (start + end) - 0.5j * bulge * (end - start)
            edges.append(cad.Edge.make_three_point_arc(ends[0], (top.real, top.imag), ends[1]))
        else:
            edges.append(cad.Edge.make_line(*ends))
    return cad.Wire(edges)
