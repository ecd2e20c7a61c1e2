"""Dimensionless equations of a mechanism, for many poses at once.

Joints that carry no body close loops.  Each closing condition has a unit *wrench* between its two
bodies, each unknown a *screw* of its bodies (`tree`); their reciprocal products are the Jacobian,
for positions, rates and reactions (Hunt, Kinematic Geometry of Mechanisms, ch. 12).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ...kinematics.types import Array
from . import compiled
from .hard_points import directions
from .located_guide import LocatedGuide
from .tree import Tree, span
from .vectors import cross, dots, series

#: Cached properties that all mechanisms of a batch share.
SHARED_CACHE = ("plan", "design", "weight", "starts", "_groups", "_pairs")


@dataclass(frozen=True)
class OnKind:
    """A point (an end) on a guide of body `on`, and the rows of its conditions."""

    end: int
    on: int
    guide: LocatedGuide
    rows: slice


@dataclass(frozen=True)
class System(Tree):
    """The tree of a mechanism and its loop conditions; made by `Formulation.system`.

    Attributes
    ----------
    ends : tuple of (list, list)
        Body and hard point of every attachment; `vectors` body and direction of every vector.
    distances : ndarray, shape (2, r)
        Pairs of ends; `lengths` (N, r) their distances.
    offsets : ndarray, shape (3, r)
        Two ends and a vector: their difference has a constant component along it.
    angles : ndarray, shape (2, r)
        Pairs of vectors that keep their angle.
    idle : ndarray, shape (1, r)
        Vectors about which a body spins idly.
    facing : ndarray, shape (2, r)
        Pairs of vectors that point the same way in every pose.
    moves : ndarray, shape (c, m)
        1 if an unknown moves only the second body of a row, -1 only the first, else 0.
    use : ndarray of int, shape (r,)
        Numbers of a largest set of independent conditions.
    singular : bool
        Whether the design pose has more freedoms than its neighbours, or is isolated.
    scalars : tuple of `scalars.ScalarFunction`
        The held ones, then the driving one; their rows come last.
    """

    ends: tuple[list[int], list[int]]
    vectors: tuple[list[int], list[int]]
    distances: Array
    offsets: Array
    angles: Array
    guides: tuple[OnKind, ...]
    idle: Array
    moves: Array
    rows: int
    scalars: tuple[Any, ...]
    use: Array
    centre: Array
    unit: float
    names: tuple[str, ...]
    facing: Array
    specs: tuple[Any, ...]
    labels: tuple[str, ...]
    labelled: tuple[str, ...]
    singular: bool = False

    @cached_property
    def plan(self) -> Any:
        """The plan of the compiled evaluation, without geometry; None if not supported."""
        return compiled.plan(self)

    @cached_property
    def fast(self) -> compiled.Fast | None:
        """The compiled evaluation of these equations; None if not supported."""
        return compiled.fast(self)

    @property
    def redundant(self) -> bool:
        """Whether the mechanism is overconstrained: some conditions imply others."""
        return len(self.use) < self.rows

    def take(self, index: Array) -> System:
        """Return the system of selected mechanisms of the batch; repeats are permitted."""
        if len(self.points) == 1:
            return self
        some = replace(self, points=self.points[index], directions=self.directions[index])
        vars(some).update({name: vars(self)[name] for name in SHARED_CACHE if name in vars(self)})
        return some

    def with_points(self, points: Array) -> System:
        """Return the system with other hard points (n, h, 3), in units."""
        return replace(self, points=points, directions=directions(self.specs, points))

    @cached_property
    def lengths(self) -> Array:
        """Distances in the design pose, shape (N, r)."""
        point = np.asarray(self.ends[1], int)
        e = self.points[:, point[self.distances[1]]] - self.points[:, point[self.distances[0]]]
        return np.asarray(np.sqrt((e * e).sum(-1)))

    def attached(self, rotation: Array, shift: Array) -> tuple[Array, Array]:
        """Return ends (K + 1, n, e, 3) and vectors (K + 1, n, v, 3)."""
        out = []
        for groups, given, count in (
            (self._groups[0], self.points, len(self.ends[0])),
            (self._groups[1], self.directions, len(self.vectors[0])),
        ):
            v = np.zeros((*rotation.shape[:2], count, 3))
            for body, where, which in groups:
                if body == 0:
                    v[0][:, where] = given[:, which]
                else:
                    v[:, :, where] = given[:, which] @ np.swapaxes(rotation[:, :, body], -1, -2)
                    if given is self.points:
                        v[:, :, where] += shift[:, :, body, None]
            out.append(v)
        return out[0], out[1]

    @cached_property
    def _groups(self) -> tuple[list[tuple[int, Any, Any]], ...]:
        """Ends and vectors grouped by body: their positions, and their points or directions."""
        out = []
        for bodies, which in (self.ends, self.vectors):
            b, w = np.asarray(bodies, int), np.asarray(which, int)
            out.append([(int(k), span(np.flatnonzero(b == k)), span(w[b == k])) for k in np.unique(b)])
        return tuple(out)

    @cached_property
    def _pairs(self) -> list[Any]:
        """Indices of the ends and vectors of distances, offsets and angles, one array for each
        role.
        """
        return [span(v) for v in (*self.distances, *self.offsets, *self.angles)]

    def residual(self, x: Array, d: Array, rotation: Array, shift: Array) -> Array:
        """Return the conditions as series, shape (K + 1, n, rows)."""
        out = np.zeros((*x.shape[:2], self.rows))
        a, b, c, _ = self.starts
        if a:
            e = x[:, :, self._pairs[1]] - x[:, :, self._pairs[0]]
            out[..., :a] = dots(e, e) / (2 * self.lengths)
            out[0, :, :a] -= self.lengths / 2
        if b > a:
            e = x[:, :, self._pairs[3]] - x[:, :, self._pairs[2]]
            out[..., a:b] = dots(e, d[:, :, self._pairs[4]])
            out[0, :, a:b] -= self.constants[0]
        if c > b:
            out[..., b:c] = dots(d[:, :, self._pairs[5]], d[:, :, self._pairs[6]])
            out[0, :, b:c] -= self.constants[1]
        for guide in self.guides:
            local = self._local(guide, x, rotation, shift)
            off = guide.guide.kind.distances(np.swapaxes(local, 1, 2), guide.guide.shapes(x.shape[1]))
            out[..., guide.rows] = np.swapaxes(off, 1, 2)
        return out

    @cached_property
    def starts(self) -> tuple[int, int, int, int]:
        a = self.distances.shape[1]
        b = a + self.offsets.shape[1]
        c = b + self.angles.shape[1]
        return a, b, c, self.rows - self.idle.shape[1]

    @cached_property
    def constants(self) -> tuple[Array, Array]:
        x, d = self.points[:, self.ends[1]], self.directions[:, self.vectors[1]]
        first, second, along = self.offsets
        one, other = self.angles
        return ((x[:, second] - x[:, first]) * d[:, along]).sum(-1), (d[:, one] * d[:, other]).sum(-1)

    @staticmethod
    def _local(guide: OnKind, x: Array, rotation: Array, shift: Array) -> Array:
        """Return the point of a guide in its axes, (K + 1, n, 3)."""
        at = x[:, :, guide.end]
        if guide.on:
            back = np.swapaxes(rotation[:, :, guide.on], -1, -2)
            at = series(back, (at - shift[:, :, guide.on])[..., None], np.matmul)[..., 0]
        at = at.copy()
        at[0] -= guide.guide.origin
        return np.asarray(at @ guide.guide.frame)

    def evaluate(self, y: Array) -> tuple[Array, Array, Array]:
        """Return residuals (n, c), scalars (n, k) and their Jacobian (n, c + k, unknowns)."""
        n = len(y)
        rotation, shift = self.poses(y)
        screws = self.screws(y, rotation, shift)
        x, d = self.attached(rotation, shift)
        residual = self.residual(x, d, rotation, shift)[0]
        wrench = np.zeros((n, self.rows, 6))
        force, moment = wrench[..., :3], wrench[..., 3:]
        a, b, c, g = self.starts
        x0, d0 = x[0], d[0]
        if a:
            force[:, :a] = (x0[:, self._pairs[1]] - x0[:, self._pairs[0]]) / self.lengths[..., None]
            moment[:, :a] = cross(x0[:, self._pairs[1]], force[:, :a])
        if b > a:
            force[:, a:b] = d0[:, self._pairs[4]]
            moment[:, a:b] = cross(x0[:, self._pairs[3]], force[:, a:b])
        if c > b:
            moment[:, b:c] = cross(d0[:, self._pairs[6]], d0[:, self._pairs[5]])
        for guide in self.guides:
            local = self._local(guide, x, rotation, shift)[0]
            _, slopes = guide.guide.kind.gradients(local.T, guide.guide.shapes(n))
            normal = np.moveaxis(slopes / np.sqrt((slopes**2).sum(1, keepdims=True)), 2, 0) @ guide.guide.frame.T
            force[:, guide.rows] = (rotation[0, :, None, guide.on] @ normal[..., None])[..., 0] if guide.on else normal
            moment[:, guide.rows] = cross(x0[:, None, guide.end], force[:, guide.rows])
        if g < self.rows:
            moment[:, g : self.rows] = d0[:, self.idle[0]]
        values = np.empty((n, len(self.scalars)))
        for k, scalar in enumerate(self.scalars):
            values[:, k] = scalar.value(x, d, y[None])[0]
        jacobian = np.empty((n, self.rows + len(self.scalars), self.unknowns))
        jacobian[:, : self.rows] = (wrench @ np.swapaxes(screws, 1, 2)) * self.moves[: self.rows]
        for k, scalar in enumerate(self.scalars, self.rows):
            jacobian[:, k] = scalar.row(x0, d0, screws, self.moves[k])
        return residual, values, jacobian
