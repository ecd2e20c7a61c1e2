"""What drives, is held or is read off, compiled: its value as a series, and the wrench that works on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...kinematics.types import Array
from ..geometry.power_series import Taylor
from .system import cross, dots


@dataclass(frozen=True)
class Compiled:
    """Base of those below.

    Attributes
    ----------
    bodies : tuple of int
        The wrench pushes the second from the first.
    unit : float
        Of the value: that of length, or 1.
    angular : bool
        Whether the value is an angle.
    """

    bodies: tuple[int, int]
    unit: float
    angular: bool
    unknown = None
    periodic = False

    def value(self, x: Array, d: Array, y: Array) -> Array:
        """Return the value (K + 1, n) from series of ends, ways and numbers of the state."""
        raise NotImplementedError

    def wrench(self, x: Array, d: Array) -> Array:
        """Return the wrench (n, 6)."""
        raise NotImplementedError


@dataclass(frozen=True)
class CompiledUnknown(Compiled):
    """A coordinate of a joint or a guide."""

    number: int
    unknown: int  # type: ignore[assignment]

    def value(self, x: Array, d: Array, y: Array) -> Array:  # noqa: ARG002
        return np.asarray(y[:, :, self.number])

    def wrench(self, x: Array, d: Array) -> Array:  # noqa: ARG002
        return np.zeros((len(x), 6))


@dataclass(frozen=True)
class CompiledTravel(Compiled):
    """A component of a point, from where it is in the design pose."""

    end: int
    design: Array
    along: Array

    def value(self, x: Array, d: Array, y: Array) -> Array:  # noqa: ARG002
        out = x[:, :, self.end] @ self.along
        out[0] -= self.design @ self.along
        return np.asarray(out)

    def wrench(self, x: Array, d: Array) -> Array:  # noqa: ARG002
        force = np.broadcast_to(self.along, (len(x), 3))
        return np.concatenate([force, cross(x[:, self.end], force)], axis=1)


@dataclass(frozen=True)
class CompiledLength(Compiled):
    """The distance of two ends."""

    first: int
    second: int

    def value(self, x: Array, d: Array, y: Array) -> Array:  # noqa: ARG002
        e = x[:, :, self.second] - x[:, :, self.first]
        return np.asarray(np.sqrt(Taylor(dots(e, e))).c)

    def wrench(self, x: Array, d: Array) -> Array:  # noqa: ARG002
        e = x[:, self.second] - x[:, self.first]
        force = e / np.sqrt((e * e).sum(1, keepdims=True))
        return np.concatenate([force, cross(x[:, self.second], force)], axis=1)


@dataclass(frozen=True)
class CompiledAngle(Compiled):
    """The angle of a way about an axis, from two directions across it."""

    way: int
    first: Array
    second: Array
    periodic = True

    def value(self, x: Array, d: Array, y: Array) -> Array:  # noqa: ARG002
        p = d[:, :, self.way]
        return np.asarray(np.arctan2(Taylor(p @ self.second), Taylor(p @ self.first)).c)  # type: ignore[call-overload]

    def wrench(self, x: Array, d: Array) -> Array:  # noqa: ARG002
        p = d[:, self.way]
        one, other = (p @ v for v in (self.first, self.second))
        moment = cross(p, one[:, None] * self.second - other[:, None] * self.first) / (one**2 + other**2)[:, None]
        return np.concatenate([np.zeros_like(moment), moment], axis=1)
