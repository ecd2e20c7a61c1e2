"""Link lengths for the workshop, and the nearest linkages of round lengths.

Lengths are, as far as a family has them: cranks, frame, coupler, the offset of a slider's line from
the other fixed pivot, the offset of a slide's line from the other moving pivot, and the place of
the guided point in the coupler, along and across the line from moving pivot 1 to moving pivot 2 (or
the line of the slide). Angles between sliders are not rounded.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .linkage import PR, RP, RR, Linkage
from .plane_vectors import cross, dot
from .types import Complexes, Floats, Mask


class Rounding(NamedTuple):
    """Options of Newton's method for round lengths."""

    rounds: int = 8  #: largest number of steps
    difference: float = 1e-6  #: step of finite differences of lengths [sizes of the linkage]
    close: float = 1e-12  #: error of the lengths at which the iteration stops [sizes of the linkage]


ROUNDING = Rounding()


def link_lengths(linkage: Linkage, point: Complexes) -> dict[str, Floats]:
    """Compute the lengths of linkages by name, shape (n,) each; NaN where a family has none."""
    z, dyads = linkage.points, linkage.dyads
    coordinates = np.concatenate([z.reshape(-1, 4), point[:, None]], axis=1)
    out: dict[str, Floats] = {}
    for kinds in np.unique(dyads, axis=0):
        some = (dyads == kinds).all(1)
        for name, values in _lengths(coordinates[some], tuple(kinds)).items():
            out.setdefault(name, np.full(len(linkage), np.nan))[some] = values
    return out


def rounded(linkage: Linkage, point: Complexes, step: float) -> tuple[Linkage, Complexes, Mask]:
    """Round the lengths of linkages with the least displacement of their joints.

    The sum of the squared displacements of all pivots and the point is minimal; directions of
    pivots at infinity are kept.

    Parameters
    ----------
    linkage : Linkage of n
    point : complex ndarray, shape (n,)
    step : float
        Lengths become multiples of this step [length].

    Returns
    -------
    Linkage, complex ndarray, ndarray of bool
        Linkages and points, and a mask: False where a length would vanish, or the chain cannot be
        closed with round lengths.
    """
    pivots, moved, good = linkage.pivots.copy(), point.copy(), np.zeros(len(linkage), bool)
    for kinds in np.unique(linkage.dyads, axis=0):
        some = np.flatnonzero((linkage.dyads == kinds).all(1))
        z = np.concatenate([linkage.points[some].reshape(-1, 4), point[some, None]], axis=1)
        finite = np.concatenate([linkage.finite[some[0]].reshape(4), [True]])
        z, closed = _newton(z, finite, tuple(kinds), step, linkage.size[some])
        pivots[some, :, :, 0], pivots[some, :, :, 1] = (p[:, :4].reshape(-1, 2, 2) for p in (z.real, z.imag))
        moved[some], good[some] = z[:, 4], closed
    made, valid = Linkage.valid(pivots)
    good &= valid
    return made[good[valid]], moved[good], good


def _newton(z: Complexes, finite: Mask, kinds: tuple[int, ...], step: float, size: Floats) -> tuple[Complexes, Mask]:
    """Find places (n, 5) with round lengths, and a mask (n,) of those that exist."""

    def lengths(at: Complexes) -> Floats:
        return np.stack(list(_lengths(at, kinds).values()), axis=-1)

    wanted = step * np.round(lengths(z) / step)
    positive = [not name.startswith(("offset", "point")) for name in _lengths(z, kinds)]
    there = (wanted[:, positive] > 0).all(1)
    free = np.flatnonzero(finite)
    for _ in range(ROUNDING.rounds):
        missing = wanted - lengths(z)
        columns = []
        for direction in np.kron(np.eye(5)[free], [[1], [1j]]):
            by = ROUNDING.difference * size[:, None] * direction
            columns.append((lengths(z + by) - lengths(z - by)) / (2 * ROUNDING.difference * size[:, None]))
        jacobian = np.stack(columns, axis=-1)
        with np.errstate(all="ignore"):
            ok = np.isfinite(jacobian).all((1, 2)) & np.isfinite(missing).all(1)
        change = np.zeros((len(z), 2 * len(free)))
        change[ok] = (np.linalg.pinv(jacobian[ok]) @ missing[ok, :, None])[..., 0]
        z = z.copy()
        z[:, free] += change[:, 0::2] + 1j * change[:, 1::2]
        there &= ok
    with np.errstate(all="ignore"):
        closed = there & (np.abs(wanted - lengths(z)) <= ROUNDING.close * size[:, None]).all(1)
    return z, np.asarray(closed)


def _lengths(z: Complexes, kinds: tuple[int, ...]) -> dict[str, Floats]:
    """Compute the lengths between places (n, 5).

    The places are A1, A1*, A2, A2* (a direction where at infinity) and the guided point.
    """
    fixed, moving, point = z[:, [0, 2]], z[:, [1, 3]], z[:, 4]
    out = {}
    for i in (0, 1):
        if kinds[i] == RR:
            out[f"crank {i + 1}"] = np.abs(moving[:, i] - fixed[:, i])
    if PR not in kinds:
        out["frame"] = np.abs(fixed[:, 1] - fixed[:, 0])
    if RP not in kinds:
        out["coupler"] = np.abs(moving[:, 1] - moving[:, 0])
    for i, other in ((0, 1), (1, 0)):
        if kinds[i] == PR and kinds[other] != PR:
            out[f"offset of slider {i + 1}"] = dot(fixed[:, i], moving[:, i] - fixed[:, other])
        if kinds[i] == RP and kinds[other] != RP:
            out[f"offset of slide {i + 1}"] = dot(moving[:, i], fixed[:, i] - moving[:, other])
    origin, along = _frame(fixed, moving, kinds)
    share = (point - origin) * along.conj()
    out["point along"], out["point across"] = share.real, share.imag
    return out


def _frame(fixed: Complexes, moving: Complexes, kinds: tuple[int, ...]) -> tuple[Complexes, Complexes]:
    """Return origin and unit x vector of the coupler's coordinates."""
    if RP not in kinds:
        origin, along = moving[:, 0], moving[:, 1] - moving[:, 0]
    else:  # the line of a slide; for two slides the origin is the intersection of their lines
        i = kinds.index(RP)
        along = -1j * moving[:, i]
        origin = moving[:, 1 - i] if kinds[1 - i] != RP else _intersection(moving, fixed)
    return origin, along / np.abs(along)


def in_coupler(linkage: Linkage, place: Complexes) -> Complexes:
    """Convert coupler coordinates, along + i across, to positions, shape (n,)."""
    z, dyads = linkage.points, linkage.dyads
    place = np.broadcast_to(place, len(linkage))
    point = np.empty(len(linkage), complex)
    for kinds in np.unique(dyads, axis=0):
        some = (dyads == kinds).all(1)
        origin, along = _frame(z[some, :, 0], z[some, :, 1], tuple(kinds))
        point[some] = origin + place[some] * along
    return point


def _intersection(normal: Complexes, through: Complexes) -> Complexes:
    """Return where the two lines with these normals through these points meet, shape (n,)."""
    a, b = (dot(normal[:, i], through[:, i]) for i in (0, 1))
    area = cross(normal[:, 0], normal[:, 1])
    return np.asarray(1j * (normal[:, 0] * b - normal[:, 1] * a) / area)
