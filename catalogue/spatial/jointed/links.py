"""Replace a guide by an equivalent chain of links and joints.

The last point of a chain of links, a spherical joint, moves on a surface or a curve; the guide may
be built as that chain (Mangeron, Oğuztöreli and Plitea 1970, Nota I; its figures were not
available).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...errors import InvalidRequest
from ...given import instance
from ..geometry.guides import Guides
from ..geometry.rotation import matrix
from .elements import Cylindrical, Element, Link, OnGuide, Prismatic, Revolute, Screw, Spherical
from .hard_points import numbers

#: Joints of the chain from the ground to the point, by kind of guide; the last one is at the point.
PAIRS: dict[str, tuple[str, ...]] = {
    "sphere": ("S", "S"),
    "cylinder": ("C", "S"),
    "cone": ("R", "P", "S"),
    "hyperboloid": ("R", "P", "S"),
    "torus": ("R", "R", "S"),
    "plane": ("P", "P", "S"),
    "circle": ("R", "S"),
    "helix": ("H", "S"),
    "line": ("P", "S"),
}


def links(guide: OnGuide) -> list[Element]:
    """Return links and joints that guide a point on the path or surface of a guide.

    Parameters
    ----------
    guide : OnGuide
        Its kind one of `PAIRS`, in any chart.

    Returns
    -------
    list of elements
        Their bodies are named after the guide: ``"ring 1"``, ``"ring 2"``.

    Raises
    ------
    InvalidRequest
        If the guide is of another kind, or its point is on the axis of rotation of the chain.
    """
    instance("guide", guide, OnGuide)
    guides = Guides(guide.guide, guide.parameters, guide.origin, guide.quaternion)
    kind, _, p = guides.each()[0]
    name = kind.name.partition(":")[0]
    if name not in PAIRS:
        raise InvalidRequest(f"a {kind.name} stands for no chain of revolute, screw, prismatic and spherical joints")
    frame, origin = matrix(guides.quaternion.T)[:, :, 0], guides.origin[0]
    x = numbers(guide.at, "the point of a guide")[0]
    local = frame.T @ (x - origin)
    title = guide.name or f"{guide.body} on {guide.on}"
    if name == "sphere":
        return [Link(guide.on, origin, guide.body, x, name=title)]
    bodies = [f"{title} {i + 1}" for i in range(len(PAIRS[name]) - 1)]
    radial = np.array([local[0], local[1], 0.0])
    rho = float(np.sqrt(radial @ radial))
    if not rho and name not in ("plane", "line"):
        raise InvalidRequest(f"the point of {title} is on the axis of its guide")
    axis, radial = frame[:, 2], radial / (rho or 1.0)
    around = np.array([-radial[1], radial[0], 0.0])
    first: Any = Revolute(bodies[0], origin, axis=axis, on=guide.on)
    more: list[Element] = []
    if name == "cylinder":
        first = Cylindrical(bodies[0], origin, axis=axis, on=guide.on)
    elif name == "helix":
        first = Screw(bodies[0], origin, axis=axis, on=guide.on, lead=2 * np.pi * float(p[1, 0]))
    elif name in ("line", "plane"):
        first = Prismatic(bodies[0], axis if name == "line" else frame[:, 0], on=guide.on)
        more = [Prismatic(bodies[1], frame[:, 1], on=bodies[0])] if name == "plane" else []
    elif name == "torus":
        more = [Revolute(bodies[1], origin + frame @ (p[0, 0] * radial), axis=frame @ around, on=bodies[0])]
    elif name == "cone":
        more = [Prismatic(bodies[1], frame @ local, on=bodies[0])]
    elif name == "hyperboloid":  # along the ruling: it is as far from the axis as the waist, and leans n : m
        m, n = p[:, 0]
        z = local[2] / n
        ruling = np.array([z * radial[0] * m, z * radial[1] * m, 0]) * m / rho + around * m * m / rho + [0, 0, n]
        more = [Prismatic(bodies[1], frame @ ruling, on=bodies[0])]
    return [first, *more, Spherical(guide.body, x, on=bodies[-1])]
