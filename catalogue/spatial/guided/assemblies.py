"""Find all assemblies at given driver values, by closed elimination or from random positions.

Elimination (`closed_form`) finds all.  Newton's method from random starts cannot prove that; the
hits of each assembly, the number of fruitless starts and the parity of the number (even for
algebraic guides) say how likely it is.  `Assemblies.certified` proves that an assembly exists and
is distinct from the others.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from ...given import choice, instance, whole
from ...kinematics.types import Array
from ..continuation.elimination import solve
from .closed_form import FREE, closed_form
from .equations import System
from .mechanism import Mechanisms
from .newton import newton
from .position import MAX_DISTANCE, Positions, conditioning, driver_units, driver_values, off_edge, reported
from .unknowns import moved

#: Largest distance between the points of equal assemblies [units].
SAME_ASSEMBLY = 1e-6
#: Step of the difference quotient for second derivatives [rad, units].
DIFFERENCE_STEP = 1e-5
#: Largest number of random starts.
MAX_STARTS = 1_000_000
EPS = float(np.finfo(float).eps)
#: Starts solved at once.
BLOCK = 4096
#: Starts for a mechanism that can move with fixed drivers.
MOBILE_STARTS = 64
#: Newton steps before a random start is abandoned.
MAX_STEPS = 40


@dataclass(frozen=True, eq=False)
class Assemblies:
    """Assemblies of n mechanisms; those of a mechanism are consecutive.

    Attributes
    ----------
    mechanism : ndarray, shape (a,)
        Number of the mechanism of each assembly.
    positions : Positions
        The a positions.
    hits : ndarray, shape (a,)
        Number of starts that converged to each; 0 if found by elimination.
    certified : ndarray, shape (a,)
        Whether Newton's method provably converges to it (h < 1/2, Newton-Kantorovich, with twice
        the second derivatives at the root), and its ball of convergence meets no other one.
    double : ndarray, shape (a,)
        Whether two assemblies coincide there to rounding; known from elimination.
    complete : ndarray, shape (n,)
        Whether all assemblies were found, by elimination.
    reason : ndarray of str, shape (n,)
        Reason against elimination; empty where it was used.
    starts, fruitless : ndarray, shape (n,)
        Number of random starts; least number of those after the last new assembly.
    even : ndarray, shape (n,)
        Whether the number of assemblies is even, double ones counted twice.  On guides without an
        edge an odd number means that one was missed, or that one is double.
    """

    mechanism: Array
    positions: Positions
    hits: Array
    certified: Array
    double: Array
    complete: Array
    reason: Array
    starts: Array
    fruitless: Array

    @property
    def count(self) -> Array:
        """Number of assemblies of each mechanism, shape (n,)."""
        return np.bincount(self.mechanism, minlength=len(self.starts))

    @property
    def even(self) -> Array:
        twice = np.bincount(self.mechanism[self.double], minlength=len(self.starts))
        return np.asarray((self.count + twice) % 2 == 0)


def assemblies(
    mechanisms: Mechanisms,
    drivers: Any,
    hits: int = 5,
    most: int = 4096,
    seed: int = 1,
    method: Literal["elimination", "multi-start"] = "elimination",
) -> Assemblies:
    """Find the assemblies of mechanisms at given drivers.

    Parameters
    ----------
    mechanisms : Mechanisms
    drivers : array-like, shape (n, k) or (k,)
    hits, most, seed : int
        For mechanisms without elimination: 128 starts, then twice as many in each round, until
        every assembly has `hits` hits and their number is even, or `most` starts are made.
    method : "elimination" or "multi-start"
        Elimination where it applies, or random starts for all.

    Raises
    ------
    InvalidRequest
        If driver values have a wrong shape, a number is out of range, or the method is unknown.
    """
    choice("method", method, ("elimination", "multi-start"))
    hits, most, seed = whole("hits", hits, 1, MAX_STARTS), whole("most", most, 1, MAX_STARTS), whole("seed", seed, 0)
    values = driver_values(instance("mechanisms", mechanisms, Mechanisms), drivers)
    system, q = System.of(mechanisms), values.T / driver_units(mechanisms)
    good = np.isfinite(q).all(0)
    reason = np.full(len(mechanisms), "multi-start was asked for", dtype="U90")
    parts = []
    if method == "elimination":
        closed = closed_form(mechanisms, system, q)
        reason = closed.refused
        there = _is_assembly(mechanisms, system, closed.owner, closed.state, q)
        parts.append((closed.owner[there], closed.state[:, there], np.zeros(there.sum(), int), closed.double[there]))
    search = _Search(mechanisms, system, q, np.random.default_rng(seed))
    search.run(np.flatnonzero(good & (reason != "")), hits, np.where(reason == FREE, MOBILE_STARTS, most))
    parts.append((search.owner, search.states, search.counts, np.zeros(len(search.owner), bool)))
    owner, count, double = (np.concatenate([p[k] for p in parts]) for k in (0, 2, 3))
    order = np.argsort(owner, kind="stable")
    owner, state = owner[order], np.concatenate([p[1] for p in parts], axis=1)[:, order]
    sub, here = system.take(owner), np.ones(len(owner), bool)
    at = reported(mechanisms[owner], sub, state, values[owner], here, search.starts[owner])
    certain = _is_certified(sub, state, q[:, owner], owner, at.points / system.unit[owner, None, None])
    return Assemblies(
        owner, at, count[order], certain, double[order], (reason == "") & good, reason, search.starts, search.fruitless
    )


class _Search:
    """Newton's method from random starts, for some mechanisms of a batch."""

    def __init__(self, mechanisms: Mechanisms, system: System, q: Array, draw: np.random.Generator) -> None:
        self.mechanisms, self.system, self.q, self.draw = mechanisms, system, q, draw
        self.owner, self.states = np.zeros(0, int), np.zeros((4 + system.free, 0))
        self.counts, self.first = np.zeros(0, int), np.zeros(0, int)
        self.starts = np.zeros(len(system), int)
        self.bounded = any(kind.bounded for g in mechanisms.guides for kind in g.kinds)

    @property
    def fruitless(self) -> Array:
        """Number of starts after the last new assembly, shape (n,)."""
        last = np.zeros(len(self.system), int)
        np.maximum.at(last, self.owner, self.first)
        return self.starts - last

    def run(self, some: Array, hits: int, most: Array) -> None:
        """Search until every assembly of each mechanism has enough hits."""
        batch, n = 128, len(self.system)
        while len(some):
            many = np.minimum(batch, most[some] - self.starts[some])
            who = np.repeat(some, many)
            when = np.arange(len(who)) - np.repeat(np.cumsum(many) - many, many) + self.starts[who] + 1
            parts = [(np.arange(len(self.owner)), self.owner, self.states)]
            first = [self.first]
            for low in range(0, len(who), BLOCK):
                block = slice(low, low + BLOCK)
                new = _solve_random_starts(self.mechanisms, self.system, who[block], self.q, self.draw)
                parts.append(new)
                first.append(when[block][new[0]])
            owner, states = np.concatenate([p[1] for p in parts]), np.concatenate([p[2] for p in parts], axis=1)
            weight = np.concatenate([self.counts, np.ones(len(owner) - len(self.owner), int)])
            one, self.counts = _merge_equal(self.system, owner, states, self.q, weight)
            self.owner, self.states, self.first = owner[one], states[:, one], np.concatenate(first)[one]
            self.starts[some] += many
            number, rare = np.bincount(self.owner, minlength=n), np.full(n, hits)
            np.minimum.at(rare, self.owner, self.counts)
            doubtful = (rare < hits) | (number == 0) | ((number % 2 == 1) & (not self.bounded))
            some = some[doubtful[some] & (self.starts < most)[some]]
            batch *= 2


def _solve_random_starts(
    mechanisms: Mechanisms, system: System, who: Array, q: Array, draw: np.random.Generator
) -> tuple[Array, Array, Array]:
    """Solve from random starts; return converged starts (r,), owners, states (4 + f, r)."""
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
    root = newton(sub, np.concatenate([turn / np.sqrt((turn**2).sum(0)), free]), q[:, who], MAX_STEPS)
    kept = np.flatnonzero(root.found)
    state, owner = root.state[:, kept], who[kept]
    good = _is_assembly(mechanisms, system, owner, state, q)
    return kept[good], owner[good], state[:, good]


def _is_assembly(mechanisms: Mechanisms, system: System, owner: Array, state: Array, q: Array) -> Array:
    """Return a mask of assemblies: all points on their guides, none beyond an edge."""
    sub, q = system.take(owner), q[:, owner]
    local = sub.local(sub.world(state, q))
    with np.errstate(invalid="ignore"):
        near = sub.evaluate(state, q).distance <= MAX_DISTANCE * sub.reach
        return np.asarray(near & ~off_edge(mechanisms[owner], sub, local))


def _merge_equal(system: System, owner: Array, states: Array, q: Array, weight: Array) -> tuple[Array, Array]:
    """Return one state of each group with equal points, and the summed weights."""
    if not len(owner):
        return owner, weight
    world = system.take(owner).world(states, q[:, owner]).reshape(-1, len(owner))
    label = np.full(len(owner), -1)
    left = np.arange(len(owner))
    groups = 0
    while len(left):  # one assembly of every mechanism per pass
        _, first, inverse = np.unique(owner[left], return_index=True, return_inverse=True)
        same = np.abs(world[:, left] - world[:, left[first]][:, inverse]).max(0) < SAME_ASSEMBLY
        label[left[same]] = groups + inverse[same]
        groups += len(first)
        left = left[~same]
    _, first, inverse = np.unique(label, return_index=True, return_inverse=True)
    order = np.lexsort((world[0, first], owner[first]))
    return first[order], np.bincount(inverse, weight).astype(int)[order]


def _is_certified(system: System, state: Array, q: Array, owner: Array, points: Array) -> Array:
    """Return a mask of roots proved by Newton-Kantorovich and distinct from the others."""
    now = system.evaluate(state, q)
    kappa, inverse = conditioning(now, np.ones(len(owner)))
    m, n = now.residual.shape
    step = solve(now.jacobian, now.residual[:, None])[0][:, 0]
    error = np.sqrt((step**2).sum(0)) + EPS * kappa * system.reach
    bend = np.zeros(n)
    for c in range(m):
        step = np.zeros((m, n))
        step[c] = DIFFERENCE_STEP
        ahead, behind = (system.evaluate(moved(state, s * step, now.metric), q).jacobian for s in (1, -1))
        second = np.einsum("ijn,jkn->ikn", inverse, (ahead - behind) / (2 * DIFFERENCE_STEP))
        bend += (second**2).sum((0, 1))
    certain = 2 * error * np.sqrt(bend) < 0.5
    radius = 4 * error * np.maximum(1, np.abs(system.arms).max((0, 1)))  # radius for the points, twice that of the ball
    for i in range(1, int(np.bincount(owner).max(initial=1))):
        pair = np.flatnonzero(owner[i:] == owner[:-i])
        apart = np.abs(points[pair] - points[pair + i]).max((1, 2))
        close = pair[apart <= radius[pair] + radius[pair + i]]
        certain[close] = certain[close + i] = False
    return np.asarray(certain)
