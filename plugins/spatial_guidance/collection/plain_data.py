"""Mechanisms as plain data that JSON can hold, and back.

::

    {"body": [[x, y, z], ...],
     "guides": [{"kind": "circle", "shape": {"R": 1.0}, "origin": [x, y, z], "quaternion": [s, x, y,
     z]}, ...], "drivers": [[point, "u"], ...], "path": [[value, ...], [value, ...]], "start": [[u,
     w or null], ...], "point": [x, y, z]}

``point`` is the guided point, in the frame of the body; ``path`` are the values of the drivers at
both ends of the stroke, linear in between; ``start`` are the coordinates of all points on their
guides at the first end.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from catalogue.plugin import Array
from catalogue.spatial import KINDS, Guides, Mechanisms, matrix, quaternion


@dataclass(frozen=True, eq=False)
class Strokes:
    """Mechanisms of one class, each with a path of its drivers and a guided point.

    Attributes
    ----------
    mechanisms : Mechanisms
    path : ndarray, shape (n, 2, k)
    start : ndarray, shape (n, p, 2)
    point : ndarray, shape (n, 3)
    """

    mechanisms: Mechanisms
    path: Array
    start: Array
    point: Array

    def __len__(self) -> int:
        return len(self.mechanisms)

    def __getitem__(self, index: Any) -> Strokes:
        return Strokes(self.mechanisms[index], self.path[index], self.start[index], self.point[index])

    def moved(self, scale: Array, axes: Array, origin: Array) -> Strokes:
        """Return the strokes in frames with rows `axes` (n, 3, 3) about `origin` (n, 3).

        Lengths are multiplied by `scale` (n,).
        """
        m, unit = self.mechanisms, 1 / scale
        path, start, guides = self.path.copy(), self.start.copy(), []
        for i, g in enumerate(m.guides):
            shape = g.parameters.copy()
            for kind, where, p in g.each():
                shape[where, : len(p)] = kind.scaled(p, unit[where]).T
                for axis in (0, 1):
                    by = kind.coordinate_unit(axis, scale[where])
                    start[where, i, axis] *= by
                    if (i, "uw"[axis]) in m.drivers:
                        path[where, :, m.drivers.index((i, "uw"[axis]))] *= by[:, None]
            turned = quaternion(np.einsum("nij,jkn->ikn", axes, matrix(g.quaternion.T))).T
            place = scale[:, None] * np.einsum("nij,nj->ni", axes, g.origin - origin)
            kinds = [g.kinds[k] for k in g.which]
            guides.append(Guides(kinds, shape, place, turned))
        body = scale[:, None, None] * m.body
        return Strokes(Mechanisms(body, guides, m.drivers), path, start, scale[:, None] * self.point)


def plain(strokes: Strokes) -> list[dict[str, Any]]:
    """Convert each mechanism to plain data."""
    m, out = strokes.mechanisms, []
    for j in range(len(m)):
        guides = []
        for g in m.guides:
            kind = g.kinds[g.which[j]]
            shape = dict(zip(kind.parameters, g.parameters[j].tolist(), strict=False))
            place = {"origin": g.origin[j].tolist(), "quaternion": g.quaternion[j].tolist()}
            guides.append({"kind": kind.name, "shape": shape, **place})
        start = [[None if np.isnan(v) else v for v in row] for row in strokes.start[j].tolist()]
        out.append(
            {
                "body": m.body[j].tolist(),
                "guides": guides,
                "drivers": [list(d) for d in m.drivers],
                "path": strokes.path[j].tolist(),
                "start": start,
                "point": strokes.point[j].tolist(),
            }
        )
    return out


def alike(parameters: Sequence[Mapping[str, Any]]) -> list[Array]:
    """Return groups of indices of mechanisms of one class with the same drivers."""
    groups: dict[Any, list[int]] = {}
    for j, p in enumerate(parameters):
        curves = tuple(KINDS[g["kind"]].conditions for g in p["guides"])
        groups.setdefault((curves, tuple((i, k) for i, k in p["drivers"])), []).append(j)
    return [np.array(index) for index in groups.values()]


def strokes(parameters: Sequence[Mapping[str, Any]]) -> Strokes:
    """Convert plain data of one class with the same drivers to arrays.

    Raises
    ------
    InvalidLinkage, InvalidRequest
        If the data make no mechanism.
    """
    guides = []
    for i in range(len(parameters[0]["guides"])):
        each = [p["guides"][i] for p in parameters]
        width = max(len(KINDS[g["kind"]].parameters) for g in each)
        shape = np.ones((len(each), width))
        for row, g in zip(shape, each, strict=True):
            values = [g["shape"][name] for name in KINDS[g["kind"]].parameters]
            row[: len(values)] = values
        places = [np.array([g[name] for g in each], float) for name in ("origin", "quaternion")]
        guides.append(Guides([g["kind"] for g in each], shape, *places))
    body, path, start, point = (
        np.array([p[name] for p in parameters], float) for name in ("body", "path", "start", "point")
    )
    return Strokes(Mechanisms(body, guides, [tuple(d) for d in parameters[0]["drivers"]]), path, start, point)
