"""The equations of a batch of mechanisms: residual and Jacobian, without dimensions, the batch
last.

The unknowns are the rotation of the body and the free coordinate of each driven point on a surface.
The first driven point is the base: its coordinates place it on its guide.  An undriven point has
the implicit functions of its guide as equations, divided by their gradients so that a residual is a
distance; each further driven point has three.  Classes I to VI have 4, 3, 3, 5, 4, 6 equations
(Mangeron, Oğuztöreli and Plitea 1970 have 9, 6, 3, 6, 3, 3).  They distinguish a body from its
mirror image, hold for flat bodies and need no chart of undriven points.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from ...kinematics.types import Array
from ..geometry.guides import Guides
from ..geometry.kinds import Quadric
from ..geometry.rotation import cross, matrix
from .mechanism import Mechanisms
from .unknowns import Driven, Equations, Slot


@dataclass(frozen=True)
class System:
    """Equations of `Mechanisms`, made by `of`; dimensionless, origin at the base's guide.

    Attributes
    ----------
    unit, centre : ndarray, shape (n,), (3, n)
    reach : ndarray, shape (n,)
        Largest length in the equations [units]; a residual of a few rounding errors of it is noise.
    arms : ndarray, shape (3, p, n)
        Points of the body, relative to the base.
    frames, origins : ndarray, shape (3, 3, p, n), (3, p, n)
    driven : tuple of Driven
    others : tuple of (Slot, int)
        Undriven points with guides that are no quadrics, and the row of their first equation.
    points : tuple of int
        Number of the point of each equation of undriven points.
    quadrics : ndarray, shape (7, rows, n)
    """

    unit: Array
    centre: Array
    reach: Array
    arms: Array
    frames: Array
    origins: Array
    driven: tuple[Driven, ...]
    others: tuple[tuple[Slot, int], ...]
    points: tuple[int, ...]
    quadrics: Array

    @staticmethod
    def of(mechanisms: Mechanisms) -> System:
        """Return the equations of mechanisms; they are cached."""
        made: dict[str, Any] = mechanisms.__dict__
        if "equations" not in made:
            made["equations"] = System._made(mechanisms)
        system: System = made["equations"]
        return system

    @staticmethod
    def _made(mechanisms: Mechanisms) -> System:
        unit, n = mechanisms.unit, len(mechanisms)
        drivers = mechanisms.drivers
        order = list(dict.fromkeys(i for i, _ in drivers))
        driven, column = [], 3
        for i in order:
            u, w = (drivers.index((i, k)) if (i, k) in drivers else None for k in "uw")
            driver = u, w
            free = None in driver and not mechanisms.curves[i]
            driven.append(Driven(slot_of(i, mechanisms, smooth=driver[1] is None), column if free else None, driver))
            column += free
        others: list[tuple[Slot, int]] = []
        points: list[int] = []
        quadrics: list[Array] = []
        for i in (i for i in range(len(mechanisms.guides)) if i not in order):
            slot, many = slot_of(i, mechanisms), 2 if mechanisms.curves[i] else 1
            some = np.zeros((many, 7, n))
            for kind, where, p in slot.groups:
                if isinstance(kind, Quadric):
                    some[:, :, where] = kind.quadrics(p)
            if not all(isinstance(kind, Quadric) for kind in slot.kinds):
                others.append((slot, len(points)))
            points += [i] * many
            quadrics += list(some)
        body = np.moveaxis(mechanisms.body, 0, -1)
        centre = mechanisms.guides[order[0]].origin.T
        origins = np.stack([(g.origin.T - centre) / unit for g in mechanisms.guides], axis=1)
        shapes = [_lengths(g, unit) for g in mechanisms.guides]
        return System(
            unit,
            centre,
            np.maximum(1, np.maximum(np.abs(origins).max((0, 1)), np.max(shapes, axis=0))),
            np.moveaxis((body - body[order[0]]) / unit, 0, 1),
            np.stack([matrix(g.quaternion.T / np.abs(g.quaternion.T).max(0)) for g in mechanisms.guides], axis=2),
            origins,
            tuple(driven),
            tuple(others),
            tuple(points),
            np.stack(quadrics, axis=1) if quadrics else np.zeros((7, 0, n)),
        )

    def __len__(self) -> int:
        return len(self.unit)

    @property
    def free(self) -> int:
        """Number of free coordinates f."""
        return sum(d.column is not None for d in self.driven)

    @property
    def unknowns(self) -> int:
        """Number of unknowns, and of equations."""
        return 3 + self.free

    def take(self, index: Array) -> Self:
        """Return the equations of selected mechanisms; repeats are permitted."""
        return replace(
            self,
            unit=self.unit[index],
            centre=self.centre[:, index],
            reach=self.reach[index],
            arms=self.arms[..., index],
            frames=self.frames[..., index],
            origins=self.origins[..., index],
            driven=tuple(replace(d, slot=d.slot.take(index)) for d in self.driven),
            others=tuple((slot.take(index), row) for slot, row in self.others),
            quadrics=self.quadrics[..., index],
        )

    def placed(self, d: Driven, state: Array, q: Array) -> tuple[Array, Array]:
        """Return a driven point (3, n) and its tangents (2, 3, n) in the world."""
        i = d.slot.point
        x, t = d.slot.chart(*d.coordinates(state, q))
        frame = self.frames[:, :, i]
        return np.asarray(self.origins[:, i] + np.einsum("ijn,jn->in", frame, x)), np.einsum("ijn,tjn->tin", frame, t)

    def base(self, state: Array, q: Array) -> Array:
        """Return the position of the base, shape (3, n)."""
        return self.placed(self.driven[0], state, q)[0]

    def turned(self, state: Array) -> Array:
        """Return all points relative to the base, shape (3, p, n)."""
        return np.asarray(np.einsum("ijn,jpn->ipn", matrix(state[:4]), self.arms))

    @property
    def _index(self) -> Any:
        """Index of the points of the equations; a slice, without a copy, if no point has two."""
        first, many = self.points[0], len(self.points)
        plain = self.points == tuple(range(first, first + many))
        return slice(first, first + many) if plain else list(self.points)

    def world(self, state: Array, q: Array) -> Array:
        """Return all points, shape (3, p, n)."""
        return np.asarray(self.base(state, q)[:, None] + self.turned(state))

    def local(self, world: Array) -> Array:
        """Return points (3, p, n) in the axes of their guides."""
        return np.asarray(np.einsum("ijpn,ipn->jpn", self.frames, world - self.origins))

    def evaluate(self, state: Array, q: Array) -> Equations:
        """Return residual and derivatives at the driver values q (k, n)."""
        n, r, m = len(self), len(self.points), self.unknowns
        base, tangents = self.placed(self.driven[0], state, q)
        arms = self.turned(state)
        residual, jacobian, drivers = np.empty((m, n)), np.zeros((m, m, n)), np.zeros((m, len(q), n))
        metric, travel = np.ones((self.free, n)), np.ones((len(q), n))
        own, by = self._columns(self.driven[0], tangents, metric, travel)
        if r:
            index = self._index
            arm = arms[:, index]
            value, normal = self._implicit(base[:, None] + arm, index)
            residual[:r] = value
            jacobian[:r, :3] = np.moveaxis(cross(arm, normal), 1, 0)
            for c, t in own:
                jacobian[:r, c] = (normal * t[:, None]).sum(0)
            for k, t in by:
                drivers[:r, k] = (normal * t[:, None]).sum(0)
        for j, d in enumerate(self.driven[1:]):
            at = slice(r + 3 * j, r + 3 * j + 3)
            x, t = self.placed(d, state, q)
            a = arms[:, d.slot.point]
            residual[at] = x - base - a
            zero = np.zeros(n)
            jacobian[at, :3] = np.stack([[zero, -a[2], a[1]], [a[2], zero, -a[0]], [-a[1], a[0], zero]])
            mine, driven = self._columns(d, t, metric, travel)
            for sign, these in ((-1, own), (1, mine)):
                for c, t in these:
                    jacobian[at, c] = sign * t
            for sign, these in ((-1, by), (1, driven)):
                for k, t in these:
                    drivers[at, k] += sign * t
        return Equations(residual, jacobian, drivers, metric, travel)

    @staticmethod
    def _columns(
        d: Driven, t: Array, metric: Array, travel: Array
    ) -> tuple[list[tuple[int, Array]], list[tuple[int, Array]]]:
        """Return the columns and tangents of the free and the driven coordinates; fill `metric`,
        `travel`.
        """
        own, by = [], []
        for axis, k in enumerate(d.driver):
            length = np.sqrt((t[axis] ** 2).sum(0))
            if k is not None:
                by.append((k, t[axis]))
                travel[k] = length
            elif d.column is not None:
                metric[d.column - 3] = length
                with np.errstate(all="ignore"):
                    own.append((d.column, t[axis] / length))
        return own, by

    def _implicit(self, world: Array, index: Any) -> tuple[Array, Array]:
        """Return first-order distances (r, n) and unit normals (3, r, n) at points (3, r, n)."""
        frame = self.frames[:, :, index]
        x = np.einsum("ijrn,irn->jrn", frame, world - self.origins[:, index])
        value = ((self.quadrics[:3] * x + self.quadrics[3:6]) * x).sum(0) + self.quadrics[6]
        gradient = 2 * self.quadrics[:3] * x + self.quadrics[3:6]
        for slot, row in self.others:
            for kind, where, p in slot.groups:
                if not isinstance(kind, Quadric):
                    rows = slice(row, row + kind.conditions)
                    f, g = kind.gradients(x[:, row, where], p)
                    value[rows, where], gradient[:, rows, where] = f, np.moveaxis(g, 0, 1)
        length = np.sqrt((gradient**2).sum(0))
        with np.errstate(all="ignore"):
            return value / length, np.einsum("ijrn,jrn->irn", frame, gradient / length)


def slot_of(point: int, mechanisms: Mechanisms, smooth: bool = False) -> Slot:
    """Return the guides of a point in units; if `smooth`, in charts that are regular in w."""
    guides, unit = mechanisms.guides[point], mechanisms.unit
    p = np.zeros((guides.parameters.shape[1], len(unit)))
    for kind, where, values in guides.each():
        p[: len(values), where] = kind.scaled(values, unit[where])[: len(values)]
    kinds = tuple(kind.smooth if smooth and kind.smooth else kind for kind in guides.kinds)
    return Slot(point, kinds, guides.which, p)


def _lengths(guides: Guides, unit: Array) -> Array:
    """Return the largest length among the parameters, in units, shape (n,)."""
    out = np.zeros(len(unit))
    for kind, where, p in guides.each():
        for name, value in zip(kind.parameters, p, strict=True):
            if name in kind.lengths:
                out[where] = np.maximum(out[where], np.abs(value) / unit[where])
    return out
