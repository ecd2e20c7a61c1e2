"""Sample linkages of a series: a scrambled Sobol sequence over a member's domain, in blocks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple
from zlib import crc32

import numpy as np

from ..kinematics.linkage import Linkage
from ..kinematics.types import Floats, Mask
from .series import Member, Parameters, Series, lent

#: Samples per block: a power of two, which the sequence requires.
BLOCK = 1024
#: Version of the sampling method, to be changed whenever equal seeds would give other content:
#: blocks of different versions are not mixed.
PLAN = "7"


class Proportions(NamedTuple):
    """Proportions of sampled linkages [rho0; parallel cranks: height of crank 1]."""

    farthest: float = 8.0  #: largest distance of a pivot
    shortest: float = 0.05  #: shortest link
    spread: float = 25.0  #: largest ratio of two lengths


PROPORTIONS = Proportions()


@dataclass(frozen=True)
class Drawn:
    """Linkages kept from one block, with all their parameters, free and derived."""

    linkage: Linkage
    free: dict[str, Floats]
    complete: Parameters


def draw(series: Series, member: Member, seed: int, number: int) -> Drawn:
    """Sample block `number` of a member, without invalid or ill-proportioned linkages."""
    from scipy.stats.qmc import Sobol

    mixed = np.random.default_rng([seed, crc32(f"{series.code} {member.key}".encode())])
    shares = np.zeros((BLOCK, 0))
    if member.parameters:
        sequence = Sobol(len(member.parameters), scramble=True, rng=mixed)
        if number:
            sequence.fast_forward(number * BLOCK)
        shares = sequence.random(BLOCK)
    return draw_at(member, shares)


def draw_at(member: Member, shares: Floats) -> Drawn:
    """Build the linkages at shares of a member's domain, without invalid or ill-proportioned ones.

    Parameters
    ----------
    shares : ndarray, shape (n, number of parameters)
        Places in the ranges of the parameters, from 0 to 1.
    """
    free = {p.name: p.spread(shares[:, i]) for i, p in enumerate(member.parameters)}
    complete = member.complete(free)
    linkage, valid = Linkage.valid(member.synthesise(free))
    kept = np.flatnonzero(valid)
    good = in_proportion(linkage)
    kept, linkage = kept[good], linkage[good]
    return Drawn(linkage, {k: v[kept] for k, v in free.items()}, lent({k: v[kept] for k, v in complete.items()}))


def in_proportion(linkage: Linkage) -> Mask:
    """Tell which linkages are in proportion: no far pivot, tiny or too unequal link, (n,)."""
    z, finite = linkage.points, linkage.finite
    far = np.where(finite, np.abs(z), 0).max(axis=(1, 2))
    i, j = np.array([(0, 1), (2, 3), (1, 3), (0, 2)]).T  # cranks, coupler, frame
    flat, there = z.reshape(-1, 4), finite.reshape(-1, 4)
    length = np.where(there[:, i] & there[:, j], np.abs(flat[:, i] - flat[:, j]), np.nan)
    with np.errstate(all="ignore"):
        shortest, longest = np.fmin.reduce(length, axis=1), np.fmax.reduce(length, axis=1)
    bad = (far > PROPORTIONS.farthest) | (shortest < PROPORTIONS.shortest) | (longest > PROPORTIONS.spread * shortest)
    return np.asarray(~bad)
