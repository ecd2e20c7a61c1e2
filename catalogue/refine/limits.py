"""The constraints of a request as smooth inequalities of the pivots, with their first derivatives.

A bound on a largest length is one inequality per length, a least transmission angle one per position, a crank that
turns fully the conditions of Grashof: each is smooth, so that several can be active at once.  Lengths are in strokes,
angles by their sines; coordinates are those of `derivatives`.  What cannot be written so is left to the check on the
finite motion, which decides about all of them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields

import numpy as np

from ..guide.measures import LEAST_ARM
from ..linkage import Array
from ..motion import Motion
from ..query.constraints import Constraints
from ..query.lay import Answers
from ..query.region import Region
from ..query.request import Request
from .derivatives import COUNT, Swayed
from .slopes import FAR, Row, apart, chosen, transmission, turning

#: Checks of `query.lay.laid` that a guide may fail on the way; by how much says `excess`.
NAMES = frozenset(
    ("max_size", "max_link", "min_link", "max_ground", "max_arm", "min_transmission", "pivots inside",
     "distance from the moving pivots")
)  # fmt: skip
#: Which bounds keep a criterion of the ranking from rising, with what the criterion changes by per stroke or degree.
PRICED = {
    "balance": {"max_size": 1.0, "min_transmission": -1 / 90},
    "size": {"max_size": 1.0},
    "max_link": {"max_link": 1.0},
    "max_ground": {"max_ground": 1.0},
    "max_arm": {"max_arm": 1.0},
    "transmission": {"min_transmission": -1 / 90},
}


@dataclass(frozen=True)
class Bounds:
    """Bounds of n guides, shape (n,) each, infinite where there is none [length; degrees]."""

    max_size: Array
    max_link: Array
    min_link: Array
    max_ground: Array
    max_arm: Array
    min_transmission: Array


def bounds(now: Answers, request: Request, wanted: Constraints, rank: Mapping[str, float], spare: Array) -> Bounds:
    """Return the bounds that a request sets, and those that keep each guide's price from rising by more than `spare`.

    Parameters
    ----------
    rank : mapping
        Weights of the criteria besides the deviation; every bound of theirs gets an equal part of what is to spare.
    spare : ndarray, shape (n,)
        May be negative: the price is to fall.
    """
    n = len(now.point)
    found = {f.name: np.full(n, getattr(wanted, f.name) or np.inf) for f in fields(Bounds)}
    found["min_link"] = np.full(n, wanted.min_link or -np.inf)
    found["min_transmission"] = np.full(n, wanted.min_transmission or -np.inf)
    parts = sum(len(PRICED[name]) for name in rank if name in PRICED)
    for name, weight in rank.items():
        for bound, by in PRICED.get(name, {}).items():
            room = spare / (weight * by * parts)
            if bound == "min_transmission":
                found[bound] = np.maximum(found[bound], now.measures.min_transmission + room)
            else:
                is_now = getattr(now.measures, bound.removeprefix("max_") if bound == "max_size" else bound)
                found[bound] = np.fmin(found[bound], is_now + room * request.stroke)
    return Bounds(**found)


def limits(
    now: Answers, moving: Motion, t: Array, by: Swayed | None, request: Request, wanted: Constraints, to: Bounds
) -> Row:
    """Return inequalities of placed guides: values (n, k), negative where they hold, and derivatives (n, k, 10).

    Parameters
    ----------
    t : ndarray, shape (m, n)
        Parameters of the positions at which transmission angles are read.
    by : Swayed
        Of those positions; without it the derivatives are left 0.
    """
    rows = list(_rows(now, moving, t, by, request, wanted, to))
    value = np.stack([np.broadcast_to(v, len(now.point)) for v, _ in rows], axis=1)
    slope = np.stack([s for _, s in rows], axis=1)
    good = np.isfinite(value) & np.isfinite(slope).all(-1)
    return np.where(good, value, FAR), np.where(good[..., None], slope, 0.0)


def excess(now: Answers, request: Request, wanted: Constraints) -> Array:
    """Return by how much measured guides break the constraints, all of them together, shape (n,) [strokes, radians]."""
    m, s, z = now.measures, request.stroke, now.linkage.points.reshape(-1, 4)
    over = [m.max_arm * 0, LEAST_ARM - m.max_arm / s, np.radians(wanted.min_transmission - m.min_transmission)]
    for name in ("max_size", "max_link", "max_ground", "max_arm"):
        if (bound := getattr(wanted, name)) is not None:
            over.append((getattr(m, name.replace("max_size", "size")) - bound) / s)
    if wanted.min_link is not None:
        over.append((wanted.min_link - m.min_link) / s)
    for region, pivots in ((wanted.fixed_pivots_in, (0, 2)), (wanted.pivots_in, (0, 1, 2, 3))):
        for k in pivots if region is not None else ():
            far = np.max([row[0] for row in _inside(region, z[:, k], k)], axis=0) / s
            over.append(np.where(now.linkage.finite.reshape(-1, 4)[:, k], far, 0))
    return np.asarray(np.fmax(over, 0).sum(0))


def _rows(
    now: Answers, moving: Motion, t: Array, by: Swayed | None, request: Request, wanted: Constraints, to: Bounds
) -> Iterator[Row]:
    linkage, s = now.linkage, request.stroke
    z, finite = linkage.points.reshape(-1, 4), linkage.finite.reshape(-1, 4)

    def held(row: Row, bound: Array, sign: float = 1.0) -> Row:
        return sign * (row[0] - bound) / s, sign * row[1] / s

    def length(i: int, j: int) -> Row:
        value, slope = apart(z[:, i], i, z[:, j], j)
        return np.where(finite[:, i] & finite[:, j], value, np.nan), slope

    links = [length(0, 1), length(2, 3), length(1, 3)]
    arms = [apart(now.point, 4, np.where(finite[:, j], z[:, j], np.nan), j) for j in (1, 3)]
    for row in links if np.isfinite(to.max_link).any() else ():
        yield held(row, to.max_link)
    for row in links if np.isfinite(to.min_link).any() else ():
        yield held(row, to.min_link, -1.0)
    if np.isfinite(to.max_ground).any():
        yield held(length(0, 2), to.max_ground)
    if np.isfinite(to.max_arm).any():
        yield held(chosen(~(arms[0][0] > arms[1][0]), *arms), to.max_arm)  # the nearer one
    for row in arms:
        yield held(row, np.full(len(z), LEAST_ARM * s), -1.0)
    for row in (*links, length(0, 2)):  # nothing shrinks to a point, about which the linkage would turn as one body
        yield held(row, np.fmin(row[0], LEAST_ARM * s), -1.0)
    if np.isfinite(to.max_size).any():
        ends = [(np.full(len(z), e + 0j), 5) for e in (0.0, s)]  # the path stays where it is
        every = [*((np.where(finite[:, j], z[:, j], np.nan), j) for j in range(4)), (now.point, 4), *ends]
        for k, (one, i) in enumerate(every[:4]):
            for other, j in every[k + 1 :]:
                yield held(apart(one, i, other, j), to.max_size)
    if np.isfinite(to.min_transmission).any():
        yield from transmission(linkage, moving, t, by, to.min_transmission)
    if wanted.full_rotation:
        yield from turning(now, links, length(0, 2), s)
    for region, pivots in ((wanted.fixed_pivots_in, (0, 2)), (wanted.pivots_in, (0, 1, 2, 3))):
        for k in pivots if region is not None else ():
            for row in _inside(region, np.where(finite[:, k], z[:, k], np.nan), k):
                yield held(row, np.zeros(len(z)))


def _inside(region: Region, z: Array, k: int) -> Iterator[Row]:
    """How far a pivot lies outside each side of a convex region; of another one outside the nearest side alone."""
    corner = region.corners[:, 0] + 1j * region.corners[:, 1]
    side = np.roll(corner, -1) - corner
    side, corner = side[side != 0], corner[side != 0]
    turn = (np.roll(side, -1) * side.conj()).imag
    out = side / np.abs(side) * (-1j if turn.sum() > 0 else 1j)
    if (turn >= 0).all() or (turn <= 0).all():
        for c, normal in zip(corner, out, strict=True):
            by = np.zeros((len(z), COUNT))
            by[:, 2 * k], by[:, 2 * k + 1] = normal.real, normal.imag
            yield ((z - c) * normal.conj()).real, by
        return
    along = np.clip(((z[:, None] - corner) * side.conj()).real / np.abs(side) ** 2, 0, 1)
    away = z[:, None] - corner - along * side
    away = away[np.arange(len(z)), np.argmin(np.where(np.isnan(away), np.inf, np.abs(away)), axis=1)]
    sign = np.where(region.holds(z), -1.0, 1.0)
    with np.errstate(all="ignore"):
        unit = sign * away / np.abs(away)
    by = np.zeros((len(z), COUNT))
    by[:, 2 * k], by[:, 2 * k + 1] = unit.real, unit.imag
    yield sign * np.abs(away), by
