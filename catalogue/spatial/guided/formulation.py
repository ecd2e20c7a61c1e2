"""Singularities of the unknowns of the two notes: Euler angles and curvilinear distances.

Positions are computed by the pose of the body, which is regular there.

Euler angles refer to axes through points of the body, zeta through A1 and A2 (Mangeron, Oğuztöreli
and Plitea 1970, Nota I, (2.2)): det W = sin(nutation) det M is 0 where zeta is along z. Curvilinear
distances (sec. 2 to 4) are singular where a chart of their coordinates is.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...kinematics.types import Array
from ..geometry.rotation import cross, matrix
from .mechanism import Mechanisms

if TYPE_CHECKING:
    from .position import Positions

ALONG_Z = "Euler angles are singular: the line of the first two points is along z"
CHART = "a guide's chart is singular there, and distances with it"
FLAT = "distances do not determine a flat body of four or five points"
COINCIDENT = "distances do not determine points of the body that coincide"
#: Why.
SINGULAR = {"euler-angles": ALONG_Z, "distances": CHART}
#: Sine of the nutation, or arc length per unit of a coordinate, where six digits are lost.
SINGULAR_ARC = 1e-6
#: Ratio of the third to the first extent of a body below which it is flat.
FLAT_EXTENT = 1e-6
#: Distance below which points coincide [units].
COINCIDENT_DISTANCE = 1e-9
#: Ratio to the largest triangle of points below which a triangle is too slender to define axes.
MIN_AREA = 0.1


def lost_at(mechanisms: Mechanisms, positions: Positions) -> Array:
    """Return why positions are singular for a formulation, shape (n,) of str."""
    length = np.sqrt((_vanishing_vectors(mechanisms, positions) ** 2).sum(-1)).min(0, initial=1)
    singular = positions.success & (length <= SINGULAR_ARC)
    return np.where(singular, SINGULAR[mechanisms.formulation], undetermined(mechanisms)).astype("U90")


def first_lost(mechanisms: Mechanisms, positions: Positions) -> Array:
    """Find the first singularity on paths of n mechanisms [nodes]; infinity without one.

    Vectors are interpolated linearly between nodes.
    """
    n = len(mechanisms)
    s = len(positions.success) // n
    arcs = _vanishing_vectors(mechanisms[np.repeat(np.arange(n), s)], positions).reshape(-1, n, s, 3)
    one, chord = arcs[:, :, :-1], np.diff(arcs, axis=2)
    with np.errstate(all="ignore"):
        part = np.clip(-(one * chord).sum(-1) / (chord * chord).sum(-1), 0, 1)
        lost = np.sqrt(((one + part[..., None] * chord) ** 2).sum(-1)) <= SINGULAR_ARC
    at = np.where(lost, np.arange(s - 1) + part, np.inf)
    return np.asarray(at.min((0, 2), initial=np.inf))


def undetermined(mechanisms: Mechanisms) -> Array:
    """Return why a formulation does not determine bodies, shape (n,) of str; empty if it does."""
    out = np.full(len(mechanisms), "", dtype="U90")
    if mechanisms.formulation != "distances":
        return out
    body = mechanisms.body / mechanisms.unit[:, None, None]
    first, second = np.triu_indices(body.shape[1], 1)
    out[(np.linalg.norm(body[:, first] - body[:, second], axis=2) < COINCIDENT_DISTANCE).any(1)] = COINCIDENT
    if body.shape[1] > 3:
        extents = np.linalg.svd(body - body.mean(1, keepdims=True), compute_uv=False)
        out[extents[:, 2] < FLAT_EXTENT * extents[:, 0]] = FLAT
    return out


def _zeta(mechanisms: Mechanisms) -> Array:
    """Return zeta in the bodies, unit vectors (3, n) from the base to a second point."""
    base = mechanisms.drivers[0][0]
    arms = np.moveaxis(mechanisms.body - mechanisms.body[:, base, None], 0, -1)  # (p, 3, n)
    others = [i for i in range(len(arms)) if i != base]
    pairs = [(a, b) for k, a in enumerate(others) for b in others[k + 1 :]]
    normals = np.stack([cross(arms[a], arms[b]) for a, b in pairs])
    area = np.sqrt((normals**2).sum(1))
    chosen = (area > MIN_AREA * area.max(0)).argmax(0)  # the first triangle that is not too slender
    zeta = arms[np.array([a for a, _ in pairs])[chosen], :, np.arange(len(mechanisms))].T
    return np.asarray(zeta / np.sqrt((zeta * zeta).sum(0)))


def _vanishing_vectors(mechanisms: Mechanisms, positions: Positions) -> Array:
    """Return vectors (c, n, 3), one of which vanishes at a singularity.

    For Euler angles it is the horizontal part of zeta, rotated; for distances the tangents, in
    units, along undriven coordinates.
    """
    if mechanisms.formulation == "euler-angles":
        zeta = np.einsum("ijn,jn->in", matrix(positions.quaternion.T), _zeta(mechanisms))
        return np.stack([-zeta[1], zeta[0], np.zeros(len(mechanisms))], axis=1)[None]
    out = []
    for i, guides in enumerate(mechanisms.guides):
        axes = "u" if mechanisms.curves[i] else "uw"
        free = [axis for axis, name in enumerate(axes) if (i, name) not in mechanisms.drivers]
        along = np.empty((2, len(mechanisms), 3))
        for kind, where, given in guides.each():
            unit, chart = mechanisms.unit[where], kind
            p = kind.scaled(given, unit)
            u, w = (positions.coordinates[where, i, axis] / kind.coordinate_unit(axis, unit) for axis in (0, 1))
            w = np.zeros_like(u) if mechanisms.curves[i] else w
            with np.errstate(all="ignore"):
                if kind.smooth and 1 in free:
                    chart = kind.smooth
                    u, w = chart.locate(np.stack(np.broadcast_arrays(*kind.point(u, w, p))), p)
                along[:, where] = np.moveaxis(chart.tangents(u, w, p)[1], 1, 2)
        out += [along[axis] for axis in free]
    return np.stack(out)
