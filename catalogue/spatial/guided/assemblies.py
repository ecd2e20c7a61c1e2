"""All ways to assemble a mechanism at given values of its drivers, by Newton's method from random positions.

Random starts cannot prove that nothing was missed; how often each assembly was found says how likely that is.  That
what was found is there, and that no two are one, is certain in the sense of `Assemblies.certified`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...kinematics.types import Array
from .elimination import solve
from .equations import System
from .mechanism import Mechanisms
from .newton import newton
from .position import ASSEMBLED, Positions, conditioning, driver_units, driver_values, off_edge, reported
from .unknowns import State

#: Assemblies whose points are nearer than this, in units, are one.
SAME = 1e-6
#: Difference quotient for the second derivatives [rad, units].
DIFFERENCE = 1e-5
EPS = float(np.finfo(float).eps)
#: Starts that are made at once.
BLOCK = 4096
#: Newton's steps before a random start is given up.
STEPS = 40


@dataclass(frozen=True, eq=False)
class Assemblies:
    """Assemblies of n mechanisms, one after another.

    Attributes
    ----------
    mechanism : ndarray, shape (a,)
        Whose assembly it is.
    positions : Positions
        a of them.
    hits : ndarray, shape (a,)
        How many starts came to it.
    certified : ndarray, shape (a,)
        Whether Newton's method provably converges from there (h < 1/2, Newton-Kantorovich, the second derivatives
        taken at the root and doubled), and its ball of convergence meets no other's.
    starts : ndarray, shape (n,)
    """

    mechanism: Array
    positions: Positions
    hits: Array
    certified: Array
    starts: Array

    @property
    def count(self) -> Array:
        """Number of assemblies of each mechanism, shape (n,)."""
        return np.bincount(self.mechanism, minlength=len(self.starts))


def assemblies(mechanisms: Mechanisms, drivers: Any, hits: int = 5, most: int = 4096, seed: int = 1) -> Assemblies:
    """Find the assemblies of mechanisms at given drivers.

    Starts are made, 128 at first and then twice as many, until every assembly of a mechanism was found `hits` times, or
    `most` starts were made.

    Parameters
    ----------
    mechanisms : Mechanisms
    drivers : array-like, shape (n, k) or (k,)
    hits, most, seed : int
    """
    draw = np.random.default_rng(seed)
    n = len(mechanisms)
    values = driver_values(mechanisms, drivers)
    system, q = System.of(mechanisms), values.T / driver_units(mechanisms)
    good = np.flatnonzero(np.isfinite(q).all(0))
    starts, batch = np.zeros(n, int), 128
    owner, found = np.zeros(0, int), np.zeros((4 + system.free, 0))
    counts, states = np.zeros(0, int), found
    while len(good):
        many = min(batch, most - int(starts[good].max()))
        who = np.repeat(good, many)
        for low in range(0, len(who), BLOCK):
            some = who[low : low + BLOCK]
            new = _searched(mechanisms, system, some, q, draw)
            owner, found = np.concatenate([owner, new[0]]), np.concatenate([found, new[1]], axis=1)
        starts[good] += many
        owner, states, counts = _distinct(system, owner, found, q)
        found = np.repeat(states, counts, axis=1)
        rare = np.full(n, hits)
        np.minimum.at(rare, owner, counts)
        empty = np.bincount(owner, minlength=n) == 0
        good = good[((rare < hits) | empty)[good] & (starts[good] < most)]
        owner, batch = np.repeat(owner, counts), 2 * batch
    owner, states, counts = _distinct(system, owner, found, q)
    state, there = State(states[:4], states[4:]), np.ones(len(owner), bool)
    at = reported(mechanisms[owner], system.take(owner), state, values[owner], there, starts[owner])
    certain = _certified(system.take(owner), state, q[:, owner], owner, at.points / system.unit[owner, None, None])
    return Assemblies(owner, at, counts, certain, starts)


def _searched(
    mechanisms: Mechanisms, system: System, who: Array, q: Array, draw: np.random.Generator
) -> tuple[Array, Array]:
    """Return owners (r,) and states (4 + f, r) of the roots from one random start of each of `who`."""
    sub = system.take(who)
    free = np.zeros((system.free, len(who)))
    for d in sub.driven:
        if d.column is not None:
            axis = d.driver.index(None)
            for kind, where, _ in d.slot.groups:
                span = kind.spans[axis]
                half = sub.reach[where] * 2 if span is None else span
                free[d.column - 3, where] = draw.uniform(-1, 1, len(free[0, where])) * half
    turn = draw.normal(size=(4, len(who)))
    root = newton(sub, State(turn / np.sqrt((turn**2).sum(0)), free), q[:, who], STEPS)
    kept = np.flatnonzero(root.found)
    sub, state, owner = sub.take(kept), root.state[kept], who[kept]
    now = sub.evaluate(state, q[:, owner])
    local = sub.local(sub.world(state, q[:, owner]))
    with np.errstate(invalid="ignore"):
        good = (now.distance <= ASSEMBLED * sub.reach) & ~off_edge(mechanisms[owner], sub, local)
    return owner[good], np.concatenate([state.quaternion, state.free])[:, good]


def _distinct(system: System, owner: Array, states: Array, q: Array) -> tuple[Array, Array, Array]:
    """Return owners, states and numbers of those that differ in the positions of their points."""
    if not len(owner):
        return owner, states, np.zeros(0, int)
    world = system.take(owner).world(State(states[:4], states[4:]), q[:, owner]).reshape(-1, len(owner))
    label = np.full(len(owner), -1)
    left = np.arange(len(owner))
    groups = 0
    while len(left):  # one assembly of every mechanism at a time
        _, first, inverse = np.unique(owner[left], return_index=True, return_inverse=True)
        same = np.abs(world[:, left] - world[:, left[first]][:, inverse]).max(0) < SAME
        label[left[same]] = groups + inverse[same]
        groups += len(first)
        left = left[~same]
    _, first, counts = np.unique(label, return_index=True, return_counts=True)
    order = np.lexsort((world[0, first], owner[first]))
    return owner[first][order], states[:, first][:, order], counts[order]


def _certified(system: System, state: State, q: Array, owner: Array, points: Array) -> Array:
    """Return where a root is one by Newton-Kantorovich, and apart from those of the same owner."""
    now = system.evaluate(state, q)
    kappa, inverse = conditioning(now, np.ones(len(owner)))
    m, n = now.residual.shape
    step = solve(now.jacobian, now.residual[:, None])[0][:, 0]
    error = np.sqrt((step**2).sum(0)) + EPS * kappa * system.reach
    bend = np.zeros(n)
    for c in range(m):
        way = np.zeros((m, n))
        way[c] = DIFFERENCE
        ahead, behind = (system.evaluate(state.moved(s * way, now.metric), q).jacobian for s in (1, -1))
        second = np.einsum("ijn,jkn->ikn", inverse, (ahead - behind) / (2 * DIFFERENCE))
        bend += (second**2).sum((0, 1))
    certain = 2 * error * np.sqrt(bend) < 0.5
    radius = 4 * error * np.maximum(1, np.abs(system.arms).max((0, 1)))  # of the points, twice that of the ball
    for i in range(1, int(np.bincount(owner).max(initial=1))):
        pair = np.flatnonzero(owner[i:] == owner[:-i])
        apart = np.abs(points[pair] - points[pair + i]).max((1, 2))
        close = pair[apart <= radius[pair] + radius[pair + i]]
        certain[close] = certain[close + i] = False
    return np.asarray(certain)
