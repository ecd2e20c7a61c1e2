"""Parts of the equations: guides of a point by kind, driven points, and evaluated equations.

A state is an array (4 + f, n): a unit quaternion, and the free coordinates in units.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ...kinematics.types import Array
from ..geometry.kinds import Kind
from ..geometry.rotation import turned


def moved(state: Array, step: Array, metric: Array | float = 1.0) -> Array:
    """Return states (4 + f, n) after steps (3 + f, n): rotation [rad], arcs [units]."""
    with np.errstate(all="ignore"):
        return np.concatenate([turned(state[:4], step[:3]), state[4:] + step[3:] / metric])


class Equations(NamedTuple):
    """Residual (m, n), Jacobian (m, m, n), derivative by the drivers (m, k, n).

    `metric` (f, n) and `travel` (k, n) are the arc lengths per unit of free coordinates and
    drivers.
    """

    residual: Array
    jacobian: Array
    drivers: Array
    metric: Array
    travel: Array

    @property
    def distance(self) -> Array:
        """Largest distance from a guide, in units, shape (n,)."""
        return np.asarray(np.abs(self.residual).max(0))


@dataclass(frozen=True)
class Slot:
    """The guides of one point: kinds, the kind of each mechanism, parameters (k, n) in units."""

    point: int
    kinds: tuple[Kind, ...]
    which: Array
    parameters: Array

    @cached_property
    def groups(self) -> list[tuple[Kind, Any, Array]]:
        """Each kind, the mechanisms that have it, and its parameters."""
        found: list[tuple[Kind, Any, Array]] = []
        for c, kind in enumerate(self.kinds):
            where: Any = slice(None) if len(self.kinds) == 1 else np.flatnonzero(self.which == c)
            p = self.parameters[: len(kind.parameters), where]
            if p.shape[1]:
                found.append((kind, where, p))
        return found

    def chart(self, u: Array, w: Array) -> tuple[Array, Array]:
        """Return local points (3, n) at (u, w), and X_u, X_w, shape (2, 3, n)."""
        x, t = np.empty((3, len(u))), np.empty((2, 3, len(u)))
        for kind, where, p in self.groups:
            x[:, where], t[:, :, where] = kind.tangents(u[where], w[where], p)
        return x, t

    def take(self, index: Array) -> Slot:
        return replace(self, which=self.which[index], parameters=self.parameters[:, index])


@dataclass(frozen=True)
class Driven:
    """A driven point: index of its free coordinate, and drivers of u and w (None: free)."""

    slot: Slot
    column: int | None
    driver: tuple[int | None, int | None]

    def coordinates(self, state: Array, q: Array) -> list[Array]:
        """Return u and w."""
        fill = np.zeros(q.shape[1]) if self.column is None else state[self.column + 1]
        return [fill if k is None else q[k] for k in self.driver]
