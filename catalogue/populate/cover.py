"""Select a cover of the sampled guides: of similar ones only one is traced and stored.

A stored guide is a start, and a guide that refinement reaches from a neighbour need not be stored.
Neighbours are determined before guides are traced, from their geometry at the design position:
pivots, guided point, tangent of its path and centre of its circle, scaled by their common size. As
in `candidates.select` a point is represented by the line to it from an eye one unit above the
guided point, and the distance of two points is the sine of the angle between their lines: a metric,
0 to 1, which includes points at infinity.

The order is random: the probability of each guide grows with its distance from the guides before it
(the seeding of Arthur and Vassilvitskii 2007, with a higher power), so that any first part of the
order is a cover. An order that always takes the farthest guide (Gonzalez 1985) would begin with the
extremes, which few requests are near. Guides that are hard to manufacture have less weight.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..candidates.select import equivalent_views
from ..guidance.kinds import RETURNS, STRAIGHT
from ..kinematics.linkage import RR, Linkage
from ..kinematics.types import Array, Complexes, Floats, Integers, Mask, Objects
from .rows import at_design


class CoverOptions(NamedTuple):
    """Distances and weights of the cover."""

    near: float = 0.02  #: distance from a selected guide up to which another one is dropped
    #: Transmission angle of a sound linkage at the design position [deg]: the least value that
    #: textbooks recommend.
    sound_angle: float = 40.0
    sound_link: float = 0.1  #: shortest link of a sound linkage [size]
    least_weight: float = 0.25  #: weight of a linkage far from both limits
    returning: float = 0.25  #: weight of returning points, which few requests need
    #: Power of the distance in the probability. Measured on 500 to 2000 guides of each of seven
    #: members: for the first 20, or 80, the mean distance to the nearest is a tenth to a seventh
    #: less than for as many random guides, the ninth decile a quarter less.
    power: int = 4


COVER = CoverOptions()


@dataclass(frozen=True)
class Designs:
    """Geometry of n guides at the design position."""

    points: Array  # unit vectors to the pivots of both dyads and to the centre of the nominal, shape (n, 5, 3)
    kind: Objects
    weight: Floats  # weight of the distance from the cover, up to 1


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
        # reverse the tangent so that the centre lies to its left
        tangent = np.where(radius.imag < 0, -tangent, tangent)
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
    weight = _proportion_score(linkage, size) * np.where(returns, COVER.returning, 1.0)
    return Designs(vectors.astype(np.float32), kind, weight)


def order(designs: Designs, cells: Integers) -> Iterator[int]:
    """Yield the next of n designs: first the soundest of each cell, then those farthest from them.

    `cells` (n,) are the numbers of the cells. A cell keeps a member even if it is close to a member
    of another cell.
    """
    kinds, group = np.unique(designs.kind, return_inverse=True)
    places = [np.flatnonzero(group == k) for k in range(len(kinds))]
    parts = [np.ascontiguousarray(designs.points[place].transpose(1, 0, 2)) for place in places]
    straight = np.isin(kinds, STRAIGHT)
    best = np.lexsort((-designs.weight, cells))
    best = best[np.append(True, np.diff(cells[best]) != 0)]
    first = iter(best[np.argsort(-designs.weight[best], kind="stable")].tolist())
    gap = np.ones(len(cells))
    # exponential variables: the largest ratio of weight to variable is a draw by weight
    lot = np.random.default_rng(1895).exponential(size=len(cells))
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
    poses = equivalent_views(one[None], mirror=straight)
    cosine = np.abs(others @ poses).min(axis=0).max(axis=1)  # of the largest distance, in the best orientation
    return np.asarray(np.sqrt(np.maximum(1 - cosine**2, 0.0)))


def _proportion_score(linkage: Linkage, size: Floats) -> Floats:
    """Score the proportions of linkages at their design positions, (n,).

    It is between `COVER.least_weight` and 1.
    """
    z = linkage.points
    with np.errstate(all="ignore"):
        links = np.stack(
            [np.where(linkage.dyads[:, i] == RR, np.abs(z[:, i, 1] - z[:, i, 0]), np.inf) for i in (0, 1)]
            + [np.where(linkage.finite[:, :, j].all(1), np.abs(z[:, 0, j] - z[:, 1, j]), np.inf) for j in (0, 1)]
        )
        shortest = np.minimum(links.min(axis=0) / (COVER.sound_link * size), 1.0)
        angle = np.minimum(np.nan_to_num(at_design(linkage)) / COVER.sound_angle, 1.0)
    return np.asarray(COVER.least_weight + (1 - COVER.least_weight) * np.minimum(shortest, angle))
