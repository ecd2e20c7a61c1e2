"""Poses of bodies on guides along straight lines of their drivers, as curves of `continuation`."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ...kinematics.types import Array
from ..continuation.curve import Curve
from ..geometry.rotation import turning
from .equations import System
from .unknowns import Equations, moved


@dataclass(frozen=True)
class LineCurve(Curve):
    """Curve of poses of n bodies with drivers q0 + y q1, both (k, n); the drive is y.

    A state is a row: quaternion, free coordinates, and y.
    """

    system: System
    q0: Array
    q1: Array

    @cached_property
    def weight(self) -> Array:
        return np.concatenate([np.full(4, 4.0), np.ones(self.system.free + 1)])

    def take(self, index: Array) -> LineCurve:
        return replace(self, system=self.system.take(index), q0=self.q0[:, index], q1=self.q1[:, index])

    def drivers(self, y: Array) -> Array:
        """Return the values of the drivers, shape (k, n)."""
        return np.asarray(self.q0 + y[:, -1] * self.q1)

    def __call__(self, y: Array) -> tuple[Array, Array, Array, Array]:
        return self.by_rows(self.system.evaluate(y[:, :-1].T, self.drivers(y)), y)

    def by_rows(self, now: Equations, y: Array) -> tuple[Array, Array, Array, Array]:
        """Return equations in states y in the form of a curve."""
        m, n = now.residual.shape
        jacobian, by = np.empty((n, m, m + 1)), np.zeros((n, m + 1))
        jacobian[:, :, :m], by[:, m] = np.moveaxis(now.jacobian, -1, 0), 1
        with np.errstate(all="ignore"):
            jacobian[:, :, m - len(now.metric) : m] *= now.metric.T[:, None]
            jacobian[:, :, m] = (now.drivers * self.q1).sum(1).T
        return now.residual.T, jacobian, y[:, -1], by

    def moved(self, y: Array, step: Array) -> Array:
        return moved(y.T, step.T).T

    def lifted(self, y: Array, step: Array) -> Array:
        return np.concatenate([turning(y[:, :4].T, step[:, :3].T).T, step[:, 3:]], axis=1)
