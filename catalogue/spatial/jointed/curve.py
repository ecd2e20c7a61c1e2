"""The curve of all poses that a mechanism of one freedom can take: its equations, nodes on it, cubics between."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ...kinematics.types import Array
from . import compiled
from .system import System


@dataclass(frozen=True)
class Curve:
    """The poses that satisfy the conditions and keep held scalars (n, h); the last scalar of the system is read off.

    Of an overconstrained mechanism the conditions `rows` (n, r) stand for all others near the poses in which they were
    selected; without them those of the design pose do.
    """

    system: System
    held: Array
    rows: Array | None = None

    def take(self, index: Array) -> Curve:
        return Curve(self.system.take(index), self.held[index], None if self.rows is None else self.rows[index])

    def selected(self, y: Array) -> Curve:
        """Return the curves with the conditions that span all others best in states (n, numbers)."""
        if not self.system.redundant:
            return self
        jacobian = self._every(y)[1][:, : self.system.rows]
        return Curve(self.system, self.held, pivots(jacobian, len(self.system.use)))

    def jacobian(self, y: Array) -> Array:
        """Return the Jacobian of all conditions and scalars, (n, c + k, m)."""
        return self._every(y)[1]

    def values(self, y: Array) -> Array:
        """Return the values of all scalars, (n, k), without dimensions."""
        return self._every(y)[0][:, self.system.rows :]

    def _every(self, y: Array) -> tuple[Array, Array]:
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
        """Return residual (n, m - 1) and Jacobian of the conditions, value (n,) and gradient (n, m) of the drive."""
        rows = self.system.rows
        both, jacobian = self._every(y)
        f, values, j = both[:, :rows], both[:, rows:], jacobian[:, :-1]
        if self.system.redundant:
            use = np.broadcast_to(self.system.use, (len(y), len(self.system.use))) if self.rows is None else self.rows
            f = np.take_along_axis(f, use, axis=1)
            own = np.take_along_axis(j[:, :rows], use[..., None], axis=1)
            j = np.concatenate([own, j[:, rows:]], axis=1)
        if values.shape[1] > 1:
            f = np.concatenate([f, wrapped(self.system, values[:, :-1] - self.held)], axis=1)
        return f, j, values[:, -1], jacobian[:, -1]


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


def around(angle: Array) -> Array:
    return np.asarray(np.remainder(angle + np.pi, 2 * np.pi) - np.pi)


class Trace(NamedTuple):
    """Nodes of one curve.

    Attributes
    ----------
    s : ndarray, shape (k,)
        Arc length [rad, units].
    y, rate : ndarray, shape (k, numbers)
        States, and their derivatives by s.
    drive, slope : ndarray, shape (k,)
        The driven scalar, and its derivative by s.
    tangent : ndarray, shape (k, m)
    jacobian : ndarray, shape (k, m - 1, m)
        Of the conditions, at or next to the nodes.
    reason : str
        Why it ends; empty where it was to.
    """

    s: Array
    y: Array
    rate: Array
    drive: Array
    slope: Array
    tangent: Array
    jacobian: Array
    reason: str = ""

    def at(self, s: Array) -> Array:
        """Return states at arc lengths by the cubics between nodes, shape (n, numbers)."""
        i = np.clip(np.searchsorted(self.s, s) - 1, 0, len(self.s) - 2)
        h = (self.s[i + 1] - self.s[i])[:, None]
        return cubic(((s - self.s[i])[:, None]) / h, h, self.y[i], self.y[i + 1], self.rate[i], self.rate[i + 1])

    def where(self, value: Array) -> Array:
        """Return the arc lengths at which the drive, which must run one way, has given values."""
        direction = np.sign(self.drive[-1] - self.drive[0]) or 1.0
        i = np.clip(np.searchsorted(direction * self.drive, direction * value) - 1, 0, len(self.s) - 2)
        h = self.s[i + 1] - self.s[i]
        g = self.drive[i], self.drive[i + 1], self.slope[i], self.slope[i + 1]
        low, high = np.zeros_like(value), np.ones_like(value)
        t = np.clip((value - g[0]) / np.where(g[1] == g[0], 1, g[1] - g[0]), 0, 1)
        for _ in range(6):  # Newton's method, kept between bounds
            off = cubic(t, h, *g) - value
            low, high = np.where(direction * off < 0, t, low), np.where(direction * off < 0, high, t)
            with np.errstate(all="ignore"):
                better = t - off / cubic_slope(t, h, *g)
            t = np.where((better >= low) & (better <= high), better, (low + high) / 2)
        return np.asarray(self.s[i] + t * h)

    def joined(self, other: Trace) -> Trace:
        """Return this one backwards, and then the other, which begins at the same node."""
        both = [
            np.concatenate([sign * getattr(self, name)[:0:-1], getattr(other, name)])
            for name, sign in (
                ("s", -1),
                ("y", 1),
                ("rate", -1),
                ("drive", 1),
                ("slope", -1),
                ("tangent", -1),
                ("jacobian", 1),
            )
        ]
        return Trace._make([*both, other.reason])


def cubic(t: Array, h: Array, a: Array, b: Array, da: Array, db: Array) -> Array:
    """Return Hermite's cubic at the part t of an interval h."""
    u = 1 - t
    return np.asarray(u * u * ((1 + 2 * t) * a + t * h * da) + t * t * ((3 - 2 * t) * b - u * h * db))


def cubic_slope(t: Array, h: Array, a: Array, b: Array, da: Array, db: Array) -> Array:
    """Return the derivative of the cubic by t."""
    return np.asarray(6 * t * (1 - t) * (b - a) + h * ((1 - t) * (1 - 3 * t) * da + t * (3 * t - 2) * db))


def tangents(j: Array, by: Array) -> tuple[Array, Array, Array]:
    """Return unit vectors along curves from the Jacobian of the conditions (n, m - 1, m) and the gradient of the drive.

    With them the slope of the drive, not negative, and how regular the conditions are: the least singular value
    over the largest.
    """
    _, s, v = np.linalg.svd(j, full_matrices=True)
    t = v[:, -1]
    slope = (t * by).sum(1)
    regular = s[:, -1] / s[:, 0] if s.shape[1] else np.ones(len(j))
    return np.where(slope < 0, -1, 1)[:, None] * t, np.abs(slope), regular


def orientation(j: Array, tangent: Array) -> Array:
    """Return the signs of the determinants of Jacobians (n, m - 1, m) bordered by tangents."""
    return np.asarray(np.linalg.slogdet(np.concatenate([j, tangent[:, None]], axis=1))[0])


def signature(curve: Curve, y: Array) -> Array:
    """Return what tells poses apart, (n, ...): where bodies are, of those that spin idly only where their ends are."""
    system = curve.system
    rotation, shift = system.poses(y)
    ends, _ = system.attached(rotation, shift)
    idle = {system.vectors[0][w] for w in system.idle[0]}
    bodies = [b for b in range(1, len(system.bodies)) if b not in idle]
    n = len(y)
    parts = rotation[0][:, bodies].reshape(n, -1), shift[0][:, bodies].reshape(n, -1), ends[0].reshape(n, -1)
    return np.concatenate(parts, axis=1)
