"""Poses of bodies on guides along straight lines of their drivers, as curves of `continuation`."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ...kinematics.types import Array
from ..continuation.curve import Curve
from .equations import System
from .unknowns import Equations, State

#: Arcs per free coordinate, where the unknowns are the coordinates themselves.
PLAIN = np.ones((1, 1))


@dataclass(frozen=True)
class LineCurve(Curve):
    """Poses of n bodies while their drivers are q0 + y q1, both (k, n); the drive is y.

    A state is a row: the numbers of `like`, a state of the formulation, and y.
    """

    system: System
    like: State
    q0: Array
    q1: Array

    @cached_property
    def weight(self) -> Array:
        turns = len(self.like.quaternion)
        return np.array([4.0 if i < turns == 4 else 1.0 for i in range(turns + len(self.like.free) + 1)])

    def take(self, index: Array) -> LineCurve:
        return replace(self, system=self.system.take(index), q0=self.q0[:, index], q1=self.q1[:, index])

    def state(self, y: Array) -> State:
        """Return rows (n, numbers) as states of the formulation."""
        turns = len(self.like.quaternion)
        return type(self.like)(y[:, :turns].T, y[:, turns:-1].T)

    def drivers(self, y: Array) -> Array:
        """Return the values of the drivers, shape (k, n)."""
        return np.asarray(self.q0 + y[:, -1] * self.q1)

    def __call__(self, y: Array) -> tuple[Array, Array, Array, Array]:
        return self.by_rows(self.system.evaluate(self.state(y), self.drivers(y)), y)

    def by_rows(self, now: Equations, y: Array) -> tuple[Array, Array, Array, Array]:
        """Return equations in states y as a curve has them."""
        m, n = now.residual.shape
        jacobian, by = np.empty((n, m, m + 1)), np.zeros((n, m + 1))
        jacobian[:, :, :m], by[:, m] = np.moveaxis(now.jacobian, -1, 0), 1
        with np.errstate(all="ignore"):
            jacobian[:, :, m - len(now.metric) : m] *= now.metric.T[:, None]
            jacobian[:, :, m] = (now.drivers * self.q1).sum(1).T
        return now.residual.T, jacobian, y[:, -1], by

    def moved(self, y: Array, step: Array) -> Array:
        numbers = self.state(y).moved(step[:, :-1].T, PLAIN).numbers
        return np.concatenate([numbers.T, y[:, -1:] + step[:, -1:]], axis=1)

    def lifted(self, y: Array, step: Array) -> Array:
        return np.concatenate([self.state(y).velocity(step[:, :-1].T, PLAIN).T, step[:, -1:]], axis=1)
