"""Class and special cases of a spatial guidance mechanism.

``planar``: three points of the body, not on one line, stay in planes normal to one direction, on
circles about it or on lines and planes across it, so that the body moves parallel to these planes.
``spherical``: three such points keep their distance from a fixed point, which may be a point of the
body on three surfaces.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations, permutations
from typing import Any

import numpy as np

from catalogue.plugin import Array, Tags
from catalogue.spatial import Mechanisms, matrix

from .plain_data import strokes

#: Sine of an angle below which directions coincide, and distance below which points do [diameters
#: of the body].
ONE = 1e-9
#: Well-known mechanisms by their kinds of guides, sorted.
NAMED: dict[tuple[str, ...], str] = {
    ("sphere",) * 5: "5-SS",
    ("circle", "sphere", "sphere", "sphere"): "RS-3SS",
    ("circle", "circle", "cylinder"): "Altmann",
    ("circle", "circle", "sphere"): "RSSR-SS",
    ("plane",) * 3: "3-plane",
}
#: Configurations that well-known mechanisms may have.
SPECIAL: dict[str, tuple[str, ...]] = {
    **{name: tuple(" ".join(p) for p in sorted(set(permutations(kinds)))) for kinds, name in NAMED.items()},
    "RSSR": ("circle circle *",),
    "RSSP": ("circle line *", "line circle *"),
    "planar": ("*",),
    "spherical": ("*",),
}


def classify(parameters: Mapping[str, Any]) -> Tags:
    """Classify a mechanism: class, degeneration series, guides in order, well-known cases."""
    return classified(strokes([parameters]).mechanisms)[0]


def classified(m: Mechanisms) -> list[Tags]:
    """Classify each of the mechanisms."""
    axes = np.stack([matrix(g.quaternion.T)[:, 2].T for g in m.guides], axis=1)
    origins = np.stack([g.origin for g in m.guides], axis=1)
    out = []
    for j, (body, z, at, series, size) in enumerate(zip(m.body, axes, origins, m.series, m.diameter, strict=True)):
        kinds = [g.kinds[g.which[j]].name.partition(":")[0] for g in m.guides]
        names = []
        if tuple(sorted(kinds)) in NAMED:
            names.append(NAMED[tuple(sorted(kinds))])
        if kinds.count("circle") == 2 and m.name == "III":
            names.append("RSSR")
        if sorted(kinds[:2]) == ["circle", "line"] and m.name == "III":
            names.append("RSSP")
        if planar(kinds, body, z, size):
            names.append("planar")
        if spherical(kinds, body, z, at, str(series), size):
            names.append("spherical")
        out.append(Tags(m.name, str(series), " ".join(kinds), tuple(names)))
    return out


def planar(kinds: list[str], body: Array, axes: Array, size: float) -> bool:
    """Tell whether three points stay in planes normal to one direction."""
    flat = [i for i, k in enumerate(kinds) if k in ("circle", "plane")]
    lines = [i for i, k in enumerate(kinds) if k == "line"]
    for normal in axes[flat]:
        kept = [i for i in flat if np.abs(np.cross(axes[i], normal)).max() < ONE]
        kept += [i for i in lines if abs(axes[i] @ normal) < ONE]
        if _is_not_collinear(body[kept], size):
            return True
    return False


def spherical(kinds: list[str], body: Array, axes: Array, origins: Array, series: str, size: float) -> bool:
    """Tell whether three points keep their distance from a fixed point."""
    if "3" in series.partition(".")[2]:
        return True  # a point on three surfaces is fixed
    held = [i for i, k in enumerate(kinds) if k in ("circle", "sphere")]
    for some in combinations(held, 3):
        # the point is on the axis of each circle, and at the centre of each sphere
        rows = [np.eye(3) - np.outer(axes[i], axes[i]) if kinds[i] == "circle" else np.eye(3) for i in some]
        right = np.concatenate([r @ origins[i] for r, i in zip(rows, some, strict=True)])
        point, *_ = np.linalg.lstsq(np.concatenate(rows), right, rcond=None)
        off = np.abs(np.concatenate(rows) @ point - right).max()
        if off < ONE * size and _is_not_collinear(body[list(some)], size):
            return True
    return False


def _is_not_collinear(points: Array, size: float) -> bool:
    """Tell whether three of the points are not on a line."""
    if len(points) < 3:
        return False
    return bool(np.linalg.svd(points - points.mean(0), compute_uv=False)[1] > ONE * size)
