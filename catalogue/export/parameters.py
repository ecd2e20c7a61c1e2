"""Named parameters of a guide for parametric CAD: SOLIDWORKS, Fusion.

SOLIDWORKS links a text file with a line ``"name" = value`` each (Equations, Global Variables, and
Dimensions > Import). Fusion imports user parameters from CSV (Change Parameters > Import): name,
unit, expression, value, comment, favourite.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..guides.kinds import has_bars
from .links import distinct, rod_and_rocker, taken_apart
from .outlines import Sizes

if TYPE_CHECKING:
    from ..guides.kinds import Guide
    from ..guides.placed import PlacedGuide
    from .formats import Options

#: Length over the size below which it is rounding: it counts as 0.
ROUNDING = 1e-15

#: Meanings of the lengths, by their names without numbers.
MEANINGS = {
    "crank": "length of the crank, pivot to pivot",
    "frame": "distance of the fixed pivots",
    "coupler": "distance of the moving pivots",
    "offset of slider": "distance of the slider's line from the other fixed pivot",
    "offset of slide": "distance of the slide's line from the other moving pivot",
    "point along": "guided point in the coupler, along from moving pivot 1",
    "rod": "from the guided point to the joint with the rocker",
    "rocker": "from its fixed pivot to the joint with the rod",
    "rocker pivot": "from the fixed pivot of the driving crank to that of the rocker",
    "point across": "guided point in the coupler, across, to the left",
}


#: Function that adds a parameter: name, value, meaning.
Told = Callable[[str, Any, str], None]


@dataclass(frozen=True)
class Parameter:
    """A named number; the name is valid in every program: letters, digits and underscores."""

    name: str
    value: float
    unit: str  #: unit of a length, or ``deg``
    comment: str


def parameters(guide: Guide, options: Options) -> list[Parameter]:
    """List link lengths, pivots and slider directions in the given position, part sizes."""
    links = taken_apart(guide)
    found: list[Parameter] = []

    def length(name: str, value: float, meaning: str) -> None:
        rounding = abs(value) < ROUNDING * links.size
        found.append(Parameter(name, 0.0 if rounding else float(value), options.written, meaning))

    def place(name: str, z: complex, meaning: str) -> None:
        length(f"{name}_x", z.real, meaning)
        length(f"{name}_y", z.imag, meaning)

    def angle(name: str, way: complex, meaning: str) -> None:
        degrees = math.degrees(math.atan2(way.imag, way.real))
        found.append(Parameter(name, degrees, "deg", f"{meaning}, from the x axis"))

    if has_bars(guide):
        for name, (start, end) in links.lengths.items():
            length(f"bar {name}", abs(end - start), f"length of {name}")
        for joint, (x, y) in guide.joints.items():
            place(f"joint_{joint}", complex(x, y), f"joint {joint}")
        for slide, along in zip(guide.chain.structure.slides, guide.chain.u[:, 0].tolist(), strict=True):
            angle(f"slide {slide.first} {slide.second} angle", along, f"line of {slide.second} on {slide.first}")
        for wheel, _, radius in links.wheels:
            length(f"wheel {wheel} radius", radius, f"pitch radius of {wheel}")
    else:
        _add_linkage(guide, length, place, angle)
    names = distinct([p.name for p in found])
    found = [replace(p, name=name) for p, name in zip(found, names, strict=True)]
    sizes = Sizes.of(links, options.bar_width, options.hole)
    length("bar_width", sizes.width, "width of bars and blocks")
    length("hole", sizes.hole, "diameter of the holes")
    if options.assumption:
        found = [replace(p, comment=f"{p.comment}; {options.assumption}") if p.unit != "deg" else p for p in found]
    return found


def _add_linkage(guide: PlacedGuide, length: Told, place: Told, angle: Told) -> None:
    """List lengths, pivots and directions of a linkage of two dyads."""
    linkage = guide.linkage
    for name, value in guide.lengths.items():
        length(name.replace(" ", "_"), value, MEANINGS[name.rstrip(" 12")])
    for i, (fixed, moving) in enumerate(linkage.points[0].tolist(), 1):
        for what, z, finite in zip(("fixed", "moving"), (fixed, moving), linkage.finite[0, i - 1], strict=True):
            if finite:
                place(f"{what}_{i}", z, f"{what} pivot {i}")
            else:
                line = "line of the slider, in the frame" if what == "fixed" else "line of the slide, in the coupler"
                angle(f"{what}_{i}_angle", -1j * z, line)
        if linkage.finite[0, i - 1].all():
            angle(f"crank_{i}_angle", moving - fixed, f"crank {i}")
    place("guided", complex(*guide.guided), "guided point")
    if output := rod_and_rocker(guide):
        start, joint = output[-1]
        place("joint", joint, "joint of rod and rocker")
        place("rocker_pivot", start, "fixed pivot of the rocker")


def solidworks(guide: Guide, options: Options) -> str:
    """Return equations, one parameter per line, with units."""
    return "".join(f'"{p.name}" = {positional(p.value)}{p.unit}\n' for p in parameters(guide, options))


def fusion(guide: Guide, options: Options) -> str:
    """Return user parameters as CSV with a heading."""
    out = io.StringIO()
    rows = csv.writer(out, lineterminator="\n")
    rows.writerow(["Name", "Unit", "Expression", "Value", "Comments", "Favorite"])
    for p in parameters(guide, options):
        rows.writerow([p.name, p.unit, f"{positional(p.value)} {p.unit}", positional(p.value), p.comment, "FALSE"])
    return out.getvalue()


def positional(value: float) -> str:
    """Return a number with all digits and without an exponent, which some programs cannot read."""
    return np.format_float_positional(value + 0.0, trim="-")
