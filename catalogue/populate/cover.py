"""Select a cover of the sampled guides: of similar ones only one is traced and stored.

A stored guide is a start, and what refinement reaches from a neighbour need not be stored.  Which
guides are neighbours is told before they are traced, from what they are at the design position:
pivots, guided point, tangent of its path and centre of its circle, scaled by the size of it all.
As in `candidates.select` a point is taken as the line to it from an eye one unit above the guided
point, and two points are as far apart as the sine of the angle of their lines: a metric, 0 to 1, in
which points at infinity are as good as any.

The order is drawn: each guide with a chance that grows with how badly those before it cover it (the
seeding of Arthur and Vassilvitskii 2007, with a higher power), so that any beginning of the order
is a cover.  Always to take the one that is covered worst (Gonzalez 1985) would begin with the
extremes, which few requests are near.  What a workshop could hardly make counts less.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..candidates.select import in_every_pose
from ..guidance.kinds import RETURNS, STRAIGHT
from ..kinematics.linkage import RR, Linkage
from ..kinematics.types import Array, Complexes, Floats, Integers, Mask, Objects
from .rows import at_design


class CoverOptions(NamedTuple):
    """Distances and weights of the cover."""

    near: float = 0.02  #: distance from a chosen guide up to which another one is thrown away
    #: Transmission angle of a sound linkage at the design position [deg]: the lower end of
    #: textbooks.
    sound_angle: float = 40.0
    sound_link: float = 0.1  #: shortest link of a sound linkage [size]
    least_weight: float = 0.25  #: weight of a linkage far from both
    returning: float = 0.25  #: weight of points that return, which few requests are about
    #: Power of the chance. Measured on 500 to 2000 guides of each of seven members: with the first
    #: 20, or 80, the mean distance to the nearest is a tenth to a seventh less than with as many
    #: taken at random, the ninth decile a quarter.
    power: int = 4


COVER = CoverOptions()


@dataclass(frozen=True)
class Designs:
    """What n guides are at the design position."""

    points: Array  # unit vectors to the pivots of both dyads and to the centre of the nominal, shape (n, 5, 3)
    kind: Objects
    weight: Floats  # how much being covered badly counts, up to 1


def designs(linkage: Linkage, point: Complexes, centre: Complexes, kind: Objects, pole: Mask) -> Designs:
    """Describe n guides as designs, in the canonical frame; slots by their inverse motion.

    Parameters
    ----------
    linkage : Linkage
    point, centre : complex ndarray, shape (n,)
        Guided points, and centres of their circles (ignored for lines).
    kind : ndarray, shape (n,)
        See `catalogue.guidance.kinds`.
    pole : ndarray of bool, shape (n,)
        Whether the pole is at the origin; else it is at infinity, and all points move along y.
    """
    straight = np.isin(kind, STRAIGHT)
    away = np.abs(point)
    with np.errstate(all="ignore"):
        tangent = np.where(pole & (away > 1e-9), 1j * point / away, 1j)
        radius = np.where(straight, 0, (centre - point) * tangent.conj())
        tangent = np.where(radius.imag < 0, -tangent, tangent)  # the centre lies to the left
        pivots = np.where(linkage.finite, linkage.points, np.nan)
        corners = np.concatenate([pivots.reshape(-1, 4), point[:, None]], axis=1)
        size = np.fmax.reduce(np.abs(corners[:, :, None] - corners[:, None]), axis=(1, 2))
        turned = linkage.points.reshape(-1, 4) - np.where(linkage.finite.reshape(-1, 4), point[:, None], 0)
        turned = np.concatenate([turned, np.where(straight, 1j * tangent, centre - point)[:, None]], axis=1)
        turned = turned * tangent.conj()[:, None]
        finite = np.concatenate([linkage.finite.reshape(-1, 4), ~straight[:, None]], axis=1)
        vectors = np.stack([turned.real, turned.imag, np.where(finite, size[:, None], 0)], axis=-1)
        vectors /= np.linalg.norm(vectors, axis=-1, keepdims=True)
    returns = np.isin(kind, list(RETURNS.values()))
    weight = _soundness(linkage, size) * np.where(returns, COVER.returning, 1.0)
    return Designs(vectors.astype(np.float32), kind, weight)


def order(designs: Designs, cells: Integers) -> Iterator[int]:
    """Yield the next of n designs: first the soundest of each cell, then the worst covered ones.

    `cells` (n,) are the numbers of the cells.  A cell keeps a member even if it is close to another
    cell's.
    """
    kinds, group = np.unique(designs.kind, return_inverse=True)
    places = [np.flatnonzero(group == k) for k in range(len(kinds))]
    parts = [np.ascontiguousarray(designs.points[place].transpose(1, 0, 2)) for place in places]
    straight = np.isin(kinds, STRAIGHT)
    best = np.lexsort((-designs.weight, cells))
    best = best[np.append(True, np.diff(cells[best]) != 0)]
    first = iter(best[np.argsort(-designs.weight[best], kind="stable")].tolist())
    gap = np.ones(len(cells))
    lot = np.random.default_rng(1895).exponential(size=len(cells))  # whose is least in parts of its chance comes first
    while True:
        i = next(first, -1)
        if i < 0:
            chance = np.where(gap > COVER.near, designs.weight * gap, 0.0) ** COVER.power / lot
            i = int(np.argmax(chance))
            if not chance[i]:
                return
        yield i
        k = group[i]
        gap[places[k]] = np.minimum(gap[places[k]], _distances(designs.points[i], parts[k], bool(straight[k])))
        gap[i] = 0.0


def cells_of(*columns: Array) -> Integers:
    """Return the number of each distinct row of some columns of text, shape (n,)."""
    rows = zip(*(column.tolist() for column in columns), strict=True)
    numbers: dict[tuple[str, ...], int] = {}
    return np.array([numbers.setdefault(row, len(numbers)) for row in rows], int)


def _distances(one: Array, others: Array, straight: bool) -> Array:
    """Compute the distance of one design, shape (5, 3), from others, shape (5, n, 3).

    It is the largest distance of a point, minimised over the orientation.
    """
    poses = in_every_pose(one[None], mirror=straight)
    cosine = np.abs(others @ poses).min(axis=0).max(axis=1)  # of the point farthest off
    return np.asarray(np.sqrt(np.maximum(1 - cosine**2, 0.0)))


def _soundness(linkage: Linkage, size: Floats) -> Floats:
    """Return how sound linkages are at their design positions, `COVER.least_weight` to 1, (n,)."""
    z = linkage.points
    with np.errstate(all="ignore"):
        links = np.stack(
            [np.where(linkage.dyads[:, i] == RR, np.abs(z[:, i, 1] - z[:, i, 0]), np.inf) for i in (0, 1)]
            + [np.where(linkage.finite[:, :, j].all(1), np.abs(z[:, 0, j] - z[:, 1, j]), np.inf) for j in (0, 1)]
        )
        shortest = np.minimum(links.min(axis=0) / (COVER.sound_link * size), 1.0)
        angle = np.minimum(np.nan_to_num(at_design(linkage)) / COVER.sound_angle, 1.0)
    return np.asarray(COVER.least_weight + (1 - COVER.least_weight) * np.minimum(shortest, angle))
