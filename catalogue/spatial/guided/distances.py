"""The equations of curvilinear distances: every two points of the body keep theirs, their guides'
coordinates unknown.

(2.2a.3), (2.2b.2), (2.2c.2), (3.3a.2), (3.3b.1) and (4.4a.2) of Mangeron, Oğuztöreli and Plitea
1970, each divided by twice the distance.  Of the ten of five points one follows from the others:
that with the largest product of its points' volumes is left out, as the determinant is in
proportion to it.  Distances do not know a body from its mirror image, nor nine of them from one
that breaks the tenth: what comes out is fitted by the body, and refused if it does not fit.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from itertools import combinations
from typing import Self

import numpy as np

from ...kinematics.types import Array
from ..geometry.power_series import Taylor, coefficients
from ..geometry.rotation import fitted
from .equations import System, slot_of
from .mechanism import Mechanisms
from .unknowns import Equations, Slot, State

FLAT = "distances do not determine a flat body of four or five points"
COINCIDENT = "distances do not determine points of the body that coincide"
CHART = "a guide's chart is singular there, and distances with it"
#: Third extent of a body, of the first, below which it counts as flat.
THIN = 1e-6
#: Distance of points that counts as none, in units.
NEAR = 1e-9
#: Arc per unit of a coordinate, in units, below or above the inverse of which its chart is the
#: reason.
NO_ARC = 1e-4


class Coordinates(State):
    """Free coordinates of all points (f, n) and nothing else; the quaternion has no rows."""

    def moved(self, step: Array, metric: Array) -> Coordinates:
        with np.errstate(all="ignore"):
            return Coordinates(self.quaternion, self.free + step / metric)

    def velocity(self, step: Array, metric: Array) -> Array:
        with np.errstate(all="ignore"):
            return np.asarray(step / metric)


@dataclass(frozen=True)
class Distances(System):
    """The distances of points on their guides.

    Attributes
    ----------
    slots : tuple of Slot
        Guides of all points.
    unknown, by : tuple of pairs
        Which unknown each u and w is, and which driver; None for neither.
    kept : ndarray, shape (m, n)
        Which pairs of points give the equations.
    unfit : ndarray of str, shape (n,)
        Why distances do not determine the body; empty where they do.
    """

    slots: tuple[Slot, ...]
    unknown: tuple[tuple[int | None, int | None], ...]
    by: tuple[tuple[int | None, int | None], ...]
    kept: Array
    unfit: Array

    @staticmethod
    def of(mechanisms: Mechanisms) -> Distances:
        system, p = System.of(mechanisms), len(mechanisms.curves)
        drivers, count = mechanisms.drivers, 0
        unknown, by, slots = [], [], []
        for i in range(p):
            driven = [drivers.index((i, k)) if (i, k) in drivers else None for k in "uw"]
            free: list[int | None] = [None, None]
            for axis in (0,) if mechanisms.curves[i] else (0, 1):
                if driven[axis] is None:
                    free[axis], count = count, count + 1
            unknown.append((free[0], free[1]))
            by.append((driven[0], driven[1]))
            slots.append(slot_of(i, mechanisms, smooth=driven[1] is None))
        pairs = list(combinations(range(p), 2))
        length = _lengths(system.arms, pairs)
        unfit = np.full(len(system), "", dtype="U90")
        unfit[(length < NEAR).any(0)] = COINCIDENT
        if p > 3:
            extents = np.linalg.svd(
                np.moveaxis(system.arms - system.arms.mean(1, keepdims=True), 2, 0), compute_uv=False
            )
            unfit[extents[:, 2] < THIN * extents[:, 0]] = FLAT
        own = {f.name: getattr(system, f.name) for f in fields(System)}
        kept = _kept(system.arms, pairs, length, count)
        return Distances(**own, slots=tuple(slots), unknown=tuple(unknown), by=tuple(by), kept=kept, unfit=unfit)

    def take(self, index: Array) -> Self:
        slots = tuple(s.take(index) for s in self.slots)
        return replace(super().take(index), slots=slots, kept=self.kept[:, index], unfit=self.unfit[index])

    @property
    def free(self) -> int:
        return len(self.kept)

    @property
    def unknowns(self) -> int:
        return len(self.kept)

    @property
    def pairs(self) -> tuple[Array, Array]:
        """First and second points of all pairs."""
        first, second = np.triu_indices(len(self.slots), 1)
        return first, second

    def coordinates(self, i: int, free: Array, q: Array) -> list[Array]:
        """Return u and w of a point from unknowns (f, ...) and drivers (k, ...)."""
        zero = np.zeros(free.shape[1:])
        return [
            zero if u is None and k is None else (free[u] if u is not None else q[k])
            for u, k in zip(self.unknown[i], self.by[i], strict=True)
        ]

    def on_guides(self, state: State, q: Array) -> tuple[Array, Array]:
        """Return all points (3, p, n), and tangents (2, 3, p, n)."""
        x, t = np.empty(self.arms.shape), np.empty((2, *self.arms.shape))
        for i, slot in enumerate(self.slots):
            local, along = slot.chart(*self.coordinates(i, state.free, q))
            frame = self.frames[:, :, i]
            x[:, i] = self.origins[:, i] + np.einsum("ijn,jn->in", frame, local)
            t[:, :, i] = np.einsum("ijn,tjn->tin", frame, along)
        return x, t

    def world(self, state: State, q: Array) -> Array:
        return self.on_guides(state, q)[0] if isinstance(state, Coordinates) else super().world(state, q)

    def evaluate(self, state: State, q: Array) -> Equations:
        x, t = self.on_guides(state, q)
        first, second = self.pairs
        every = np.arange(len(self))
        length = _lengths(self.arms, list(zip(first, second, strict=True)))[self.kept, every]
        one, other = first[self.kept], second[self.kept]
        e = x[:, one, every] - x[:, other, every]
        m = self.unknowns
        jacobian, drivers = np.zeros((m, m, len(self))), np.zeros((m, len(q), len(self)))
        metric, travel = np.ones((m, len(self))), np.ones((len(q), len(self)))
        with np.errstate(all="ignore"):
            residual = ((e * e).sum(0) - length**2) / (2 * length)
            unit = e / length
            for i in range(len(self.slots)):
                sign = (one == i) * 1.0 - (other == i)
                for axis in (0, 1):
                    u, k = self.unknown[i][axis], self.by[i][axis]
                    along = t[axis, :, i]
                    arc = np.sqrt((along * along).sum(0))
                    slope = sign * (unit * along[:, None]).sum(0)
                    if u is not None:
                        jacobian[:, u], metric[u] = slope / arc, arc
                    elif k is not None:
                        drivers[:, k], travel[k] = slope, arc
        return Equations(residual, jacobian, drivers, metric, travel)

    def stated(self, pose: State, q: Array) -> State:
        local = self.local(super().world(pose, q))
        out = np.zeros((self.free, len(self)))
        for i, slot in enumerate(self.slots):
            for kind, where, p in slot.groups:
                found = kind.locate(local[:, i, where], p)
                for axis, u in enumerate(self.unknown[i]):
                    if u is not None:
                        out[u, where] = found[axis]
        for d in self.driven:
            if d.column is not None:
                u = self.unknown[d.slot.point][d.driver.index(None)]
                assert u is not None  # the driver leaves it free
                out[u] = pose.free[d.column - 3]
        return Coordinates(np.zeros((0, len(self))), out)

    def pose(self, state: State, q: Array) -> State:
        x = self.on_guides(state, q)[0]
        there = np.isfinite(x).all((0, 1))
        turn = np.full((4, len(self)), np.nan)
        turn[:, there] = fitted(np.moveaxis(self.arms, 1, 0)[..., there], np.moveaxis(x, 1, 0)[..., there])
        rows = [self.unknown[d.slot.point][d.driver.index(None)] for d in self.driven if d.column is not None]
        return State(turn, state.free[[u for u in rows if u is not None]])

    def lost(self, state: State, q: Array) -> Array:
        with np.errstate(all="ignore"):
            arc = self.evaluate(state, q).metric
            singular = (~(arc > NO_ARC) | (arc > 1 / NO_ARC)).any(0)
        return np.where(self.unfit != "", self.unfit, np.where(singular, CHART, ""))


def distance_series(
    mechanisms: Mechanisms, system: Distances, state: State, q: Array, metric: Array, inverse: Array
) -> tuple[Array, Array]:
    """Return what `series.pose_series` does, the unknown series being those of the coordinates.

    Order k of a distance e is  e_0 . e_k = - 1/2 sum e_r . e_(k-r),  r from 1 to k - 1.
    """
    del mechanisms
    order, n = len(q) - 1, len(system)
    free = np.zeros((order + 1, system.free, n))
    free[0] = state.free
    first, second = system.pairs
    every = np.arange(n)
    one, other = first[system.kept], second[system.kept]
    length = _lengths(system.arms, list(zip(first, second, strict=True)))[system.kept, every]

    def points(k: int) -> Array:
        out = np.empty((k + 1, *system.arms.shape))
        for i, slot in enumerate(system.slots):
            u, w = system.coordinates(i, np.moveaxis(free[: k + 1], 1, 0), np.moveaxis(q[: k + 1], 1, 0))
            x = np.empty((k + 1, 3, n))
            for kind, where, p in slot.groups:
                local = kind.point(Taylor(u[:, where]), Taylor(w[:, where]), p)
                for axis in range(3):
                    x[:, axis, where] = coefficients(local[axis], k, (p.shape[1],))
            out[:, :, i] = (system.frames[:, :, i] * x[:, None]).sum(2)
        out[0] += system.origins
        return out

    with np.errstate(all="ignore"):
        for k in range(1, order + 1):
            x = points(k)
            e = x[:, :, one, every] - x[:, :, other, every]
            residual = sum((e[r] * e[k - r]).sum(0) for r in range(k + 1)) / (2 * length)
            free[k] = -(inverse * residual).sum(1) / metric
        world = points(order)
        return world, _spin(world)


def _spin(world: Array) -> Array:
    """Return the series of angular velocity (order, 3, n) of moving points.

    Order by order the least squares of  (k + 1) r_(k+1) = sum_j w_j x r_(k-j)  over all points,
    from their mean.
    """
    r = np.moveaxis(world - world.mean(2, keepdims=True), (1, 2), (3, 2))  # (order + 1, n, p, 3)
    zero = np.zeros(r.shape[1:3])
    x, y, z = np.moveaxis(r[0], -1, 0)
    rows = np.stack([np.stack([zero, z, -y], -1), np.stack([-z, zero, x], -1), np.stack([y, -x, zero], -1)], axis=-2)
    matrix = rows.reshape(len(x), -1, 3)  # w x r for all points, (n, 3 p, 3)
    good = np.isfinite(matrix).all((1, 2))
    inverse = np.linalg.pinv(np.where(good[:, None, None], matrix, 0))
    out = np.full((len(world) - 1, len(good), 3), np.nan)
    for k in range(len(out)):
        rest = (k + 1) * r[k + 1] - sum(np.cross(out[j][:, None], r[k - j]) for j in range(k))
        out[k] = (inverse @ rest.reshape(len(good), -1, 1))[..., 0]
    return np.moveaxis(out, 2, 1)


def _lengths(arms: Array, pairs: list[tuple[int, int]]) -> Array:
    return np.stack([np.sqrt(((arms[:, a] - arms[:, b]) ** 2).sum(0)) for a, b in pairs])


def _kept(arms: Array, pairs: list[tuple[int, int]], length: Array, count: int) -> Array:
    """Return which pairs are used, (count, n): all but, of five points, the one of the largest
    self-stress.
    """
    n = arms.shape[-1]
    every = np.repeat(np.arange(len(pairs))[:, None], n, axis=1)
    if count == len(pairs):
        return every
    b = np.concatenate([arms.T, np.ones((n, arms.shape[1], 1))], axis=2)
    volume = np.stack([np.linalg.det(np.delete(b, i, axis=1)) for i in range(arms.shape[1])])
    stress = np.abs(np.stack([volume[j] * volume[k] for j, k in pairs])) * length
    order = np.sort(np.argsort(stress, axis=0, kind="stable")[:count], axis=0)
    return np.asarray(order)
