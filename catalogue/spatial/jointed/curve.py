"""Equations of the curve of all poses of a mechanism with one degree of freedom."""

from __future__ import annotations

from dataclasses import dataclass, replace
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from ...kinematics.types import Array
from ..continuation import curve as continuation
from ..continuation.curve import around
from . import compiled
from .system import System

if TYPE_CHECKING:
    from ..continuation.tracing import March


@dataclass(frozen=True)
class Curve(continuation.Curve):
    """Poses that meet the conditions with held scalars (n, h); the last scalar is the drive.

    For an overconstrained mechanism the conditions `rows` (n, r) imply all others near the poses
    where they were selected.  Default: those selected in the design pose.
    """

    system: System
    held: Array
    rows: Array | None = None

    def take(self, index: Array) -> Curve:
        return Curve(self.system.take(index), self.held[index], None if self.rows is None else self.rows[index])

    def selected(self, y: Array) -> Self:
        """Return the curves with independent conditions selected anew in states (n, numbers)."""
        if not self.system.redundant:
            return self
        jacobian = self._evaluate_all(y)[1][:, : self.system.rows]
        return replace(self, rows=pivots(jacobian, len(self.system.use)))

    weight = property(attrgetter("system.weight"))
    redundant = property(attrgetter("system.redundant"))
    periodic = property(lambda self: self.system.scalars[-1].periodic)
    spins = property(lambda self: self.system.idle.size > 0)
    unitary = property(attrgetter("system.unitary"))
    moved = property(attrgetter("system.moved"))
    lifted = property(attrgetter("system.lifted"))

    def compiled_step(self, march: March) -> Any:
        return compiled.steps(self.system.fast, self.held, march) if self.system.fast else None

    def jacobian(self, y: Array) -> Array:
        """Return the Jacobian of all conditions and scalars, (n, c + k, m)."""
        return self._evaluate_all(y)[1]

    def values(self, y: Array) -> Array:
        """Return the values of all scalars, (n, k), without dimensions."""
        return self._evaluate_all(y)[0][:, self.system.rows :]

    def _evaluate_all(self, y: Array) -> tuple[Array, Array]:
        """Evaluate all residuals and scalars (n, c + k) and their Jacobian."""
        if self.system.fast:
            return compiled.evaluate(self.system.fast, y)
        residual, values, jacobian = self.system.evaluate(y)
        return np.concatenate([residual, values], axis=1), jacobian

    def every(self, y: Array) -> tuple[Array, Array, Array, Array]:
        """Evaluate the curve with all conditions, redundant ones too."""
        whole = np.broadcast_to(np.arange(self.system.rows), (len(y), self.system.rows))
        return (replace(self, rows=whole) if self.system.redundant else self)(y)

    def __call__(self, y: Array) -> tuple[Array, Array, Array, Array]:
        """Return residual (n, m - 1), Jacobian, value (n,) and gradient of the drive."""
        f, values, jacobian = self._independent(y)
        if values.shape[1] > 1:
            f = np.concatenate([f, wrapped(self.system, values[:, :-1] - self.held)], axis=1)
        return f, jacobian[:, :-1], values[:, -1], jacobian[:, -1]

    def _independent(self, y: Array) -> tuple[Array, Array, Array]:
        """Evaluate independent conditions, scalars, and the Jacobian of both."""
        rows = self.system.rows
        both, jacobian = self._evaluate_all(y)
        f, values = both[:, :rows], both[:, rows:]
        if self.system.redundant:
            use = np.broadcast_to(self.system.use, (len(y), len(self.system.use))) if self.rows is None else self.rows
            f = np.take_along_axis(f, use, axis=1)
            own = np.take_along_axis(jacobian[:, :rows], use[..., None], axis=1)
            jacobian = np.concatenate([own, jacobian[:, rows:]], axis=1)
        return f, values, jacobian


def pivots(jacobian: Array, count: int) -> Array:
    """Select independent rows (n, count) of Jacobians (n, rows, m) by full pivoting."""
    left, (n, _, m) = jacobian.copy(), jacobian.shape
    who, chosen = np.arange(n), np.empty((n, count), int)
    for k in range(count):
        row, column = np.divmod(np.abs(left).reshape(n, -1).argmax(1), m)
        chosen[:, k] = row
        pivot = left[who, row] / left[who, row, column][:, None]
        left -= left[who, :, column][..., None] * pivot[:, None]
        left[who, row] = 0.0
    return np.sort(chosen, axis=1)


def wrapped(system: System, difference: Array) -> Array:
    for k, s in enumerate(system.scalars[: difference.shape[1]]):
        if s.periodic:
            difference[:, k] = around(difference[:, k])
    return difference


def tangents(j: Array, by: Array) -> tuple[Array, Array, Array]:
    """Return unit tangents from Jacobian (n, m - 1, m) and gradient of the drive.

    Besides: the slope of the drive along them, at least 0, and the regularity of the conditions,
    the least over the largest singular value.
    """
    _, s, v = np.linalg.svd(j, full_matrices=True)
    t = v[:, -1]
    slope = (t * by).sum(1)
    regular = s[:, -1] / s[:, 0] if s.shape[1] else np.ones(len(j))
    return np.where(slope < 0, -1, 1)[:, None] * t, np.abs(slope), regular


def signature(curve: Curve, y: Array) -> Array:
    """Return signatures (n, ...) that tell poses apart.

    They are the poses of bodies; of bodies that spin idly the positions of their ends.
    """
    system = curve.system
    rotation, shift = system.poses(y)
    ends, _ = system.attached(rotation, shift)
    idle = {system.vectors[0][w] for w in system.idle[0]}
    bodies = [b for b in range(1, len(system.bodies)) if b not in idle]
    n = len(y)
    parts = rotation[0][:, bodies].reshape(n, -1), shift[0][:, bodies].reshape(n, -1), ends[0].reshape(n, -1)
    return np.concatenate(parts, axis=1)
