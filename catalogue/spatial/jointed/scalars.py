"""Scalars as functions of the pose: their values as power series, and their wrenches."""

# ruff: noqa: ARG002  (a scalar need not use every argument of its formulas)

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...kinematics.types import Array
from ..geometry.power_series import Taylor
from .vectors import cross, dots


@dataclass(frozen=True)
class ScalarFunction:
    """Base class of scalars as functions of the pose.

    Attributes
    ----------
    bodies : tuple of int
        Numbers of two bodies.  The wrench of the scalar, which holds its derivatives by the screw
        of a body, acts on the second and, reversed, on the first.
    unit : float
        Unit of the value: the unit of length, or 1.
    angular : bool
        Whether the value is an angle.
    """

    bodies: tuple[int, int]
    unit: float
    angular: bool
    unknown = None
    periodic = False

    def row(self, x: Array, d: Array, screws: Array, moves: Array) -> Array:
        """Return derivatives (n, m) by unknowns; `moves` selects among their screws (n, m, 6)."""
        out = (screws @ self.wrench(x, d)[..., None])[..., 0] * moves
        if self.unknown is not None:
            out[:, self.unknown] = 1.0
        return np.asarray(out)

    def value(self, x: Array, d: Array, y: Array) -> Array:
        """Return the value (K + 1, n) from series of ends, vectors and states."""
        raise NotImplementedError

    def wrench(self, x: Array, d: Array) -> Array:
        """Return the derivatives by the screw of the second body, (n, 6)."""
        raise NotImplementedError


@dataclass(frozen=True)
class CoordinateFunction(ScalarFunction):
    """A coordinate of a joint or a guide."""

    number: int
    unknown: int  # type: ignore[assignment]  # of the others there is none

    def value(self, x: Array, d: Array, y: Array) -> Array:
        return np.asarray(y[:, :, self.number])

    def wrench(self, x: Array, d: Array) -> Array:
        return np.zeros((len(x), 6))


@dataclass(frozen=True)
class TravelFunction(ScalarFunction):
    """Distance of an end from its design place, along a vector of the ground."""

    end: int
    design: int
    along: int

    def value(self, x: Array, d: Array, y: Array) -> Array:
        return dots(x[:, :, self.end] - x[:, :, self.design], d[:, :, self.along])

    def wrench(self, x: Array, d: Array) -> Array:
        force = d[:, self.along]
        return np.concatenate([force, cross(x[:, self.end], force)], axis=1)


@dataclass(frozen=True)
class LengthFunction(ScalarFunction):
    """The distance of two ends."""

    first: int
    second: int

    def value(self, x: Array, d: Array, y: Array) -> Array:
        e = x[:, :, self.second] - x[:, :, self.first]
        return np.asarray(np.sqrt(Taylor(dots(e, e))).c)

    def wrench(self, x: Array, d: Array) -> Array:
        e = x[:, self.second] - x[:, self.first]
        force = e / np.sqrt((e * e).sum(1, keepdims=True))
        return np.concatenate([force, cross(x[:, self.second], force)], axis=1)


@dataclass(frozen=True)
class AngleFunction(ScalarFunction):
    """The angle of a vector about an axis, from two vectors of the ground across it."""

    vector: int
    first: int
    second: int
    periodic = True

    def value(self, x: Array, d: Array, y: Array) -> Array:
        one, other = (Taylor(dots(d[:, :, self.vector], d[:, :, k])) for k in (self.first, self.second))
        return np.asarray(np.arctan2(other, one).c)  # type: ignore[call-overload]  # numpy asks a Taylor for it

    def wrench(self, x: Array, d: Array) -> Array:
        p, first, second = d[:, self.vector], d[:, self.first], d[:, self.second]
        one, other = ((p * v).sum(-1, keepdims=True) for v in (first, second))
        moment = cross(p, one * second - other * first) / (one**2 + other**2)
        return np.concatenate([np.zeros_like(moment), moment], axis=1)


@dataclass(frozen=True)
class SumFunction(ScalarFunction):
    """A weighted sum of scalars; `moves` (k, m) selects the unknowns that move each."""

    parts: tuple[ScalarFunction, ...]
    weights: tuple[float, ...]
    moves: Array

    @property
    def periodic(self) -> bool:  # type: ignore[override]  # of the others it is known beforehand
        return any(part.periodic for part in self.parts)

    def row(self, x: Array, d: Array, screws: Array, moves: Array) -> Array:
        rows = (part.row(x, d, screws, own) for part, own in zip(self.parts, self.moves, strict=True))
        return np.asarray(sum(weight * row for weight, row in zip(self.weights, rows, strict=True)))

    def value(self, x: Array, d: Array, y: Array) -> Array:
        values = (part.value(x, d, y) for part in self.parts)
        return np.asarray(sum(weight * value for weight, value in zip(self.weights, values, strict=True)))
