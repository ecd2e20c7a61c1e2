"""The equations of Euler angles: precession psi, nutation theta and spin phi of axes that the
points of the body make.

The origin of the axes is A1, the base; zeta goes through A2, and A3 is in the plane of xi and zeta
(Mangeron, Oğuztöreli and Plitea 1970, Nota I, (2.2)).  Rotation Rz(psi) Rx(theta) Rz(phi); the
matrix W of (2.7) and (3.4) has the columns psi, theta, phi here, in the order of the unknowns, and
its rows are those of the pose, so that its theorems 1 and 2 hold for all six classes.  Each step of
(2.5), and each order of the reduced velocities and accelerations, is a linear system with W.  det W
= sin(theta) det M, M regular where the mechanism is: zeta along z is singular.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from ...kinematics.types import Array
from ..geometry.power_series import Taylor, coefficients
from ..geometry.rotation import cross, matrix, quaternion
from .equations import System
from .mechanism import Mechanisms
from .series import base_series, last_residual
from .unknowns import Equations, State

SINGULAR = "Euler angles are singular: the line of the first two points is along z"
#: Sine of the nutation below which Euler angles are why nothing was found.
FLAT = 1e-4
#: Sine of the nutation below which precession and spin are one.
ONE = 1e-8
#: Part of the largest triangle below which three points make no axes.
SLENDER = 0.1


class Angles(State):
    """Angles psi, theta, phi (3, n) for the quaternion, and free coordinates (f, n)."""

    def moved(self, step: Array, metric: Array) -> Angles:
        with np.errstate(all="ignore"):
            return Angles(self.quaternion + step[:3], self.free + step[3:] / metric)

    def velocity(self, step: Array, metric: Array) -> Array:
        with np.errstate(all="ignore"):
            return np.concatenate([step[:3], step[3:] / metric])


@dataclass(frozen=True)
class EulerAngles(System):
    """The equations of the pose, with Euler angles for unknowns."""

    @staticmethod
    def of(mechanisms: Mechanisms) -> EulerAngles:
        system = System.of(mechanisms)
        return EulerAngles(**{f.name: getattr(system, f.name) for f in fields(System)})

    @cached_property
    def axes(self) -> Array:
        """Unit vectors xi, eta, zeta in the body, as columns, shape (3, 3, n)."""
        first = self.driven[0].slot.point
        others = [i for i in range(self.arms.shape[1]) if i != first]
        pairs = [(a, b) for k, a in enumerate(others) for b in others[k + 1 :]]
        normals = np.stack([cross(self.arms[:, a], self.arms[:, b]) for a, b in pairs])
        area = np.sqrt((normals**2).sum(1))
        chosen = (area > SLENDER * area.max(0)).argmax(0)  # the first that is no needle
        every = np.arange(len(self))
        eta = -normals[chosen, :, every].T
        eta /= np.sqrt((eta * eta).sum(0))
        zeta = self.arms[:, np.array([a for a, _ in pairs])[chosen], every]
        zeta = zeta / np.sqrt((zeta * zeta).sum(0))
        return np.stack([cross(eta, zeta), eta, zeta], axis=1)

    def rotation(self, state: State) -> Array:
        c, s = np.cos(state.quaternion), np.sin(state.quaternion)
        return np.asarray(np.einsum("ijn,kjn->ikn", _euler(c, s), self.axes))

    def stated(self, pose: State, q: Array) -> State:  # noqa: ARG002, as others
        r = np.einsum("ijn,jkn->ikn", matrix(pose.quaternion), self.axes)
        nutation = np.arctan2(np.hypot(r[0, 2], r[1, 2]), r[2, 2])
        return Angles(np.stack([np.arctan2(r[0, 2], -r[1, 2]), nutation, np.arctan2(r[2, 0], r[2, 1])]), pose.free)

    def pose(self, state: State, q: Array) -> State:  # noqa: ARG002, as others
        there = np.isfinite(state.quaternion).all(0)
        turn = quaternion(np.where(there, self.rotation(state), np.eye(3)[:, :, None]))
        return State(np.where(there, turn, np.nan), state.free)

    def lost(self, state: State, q: Array) -> Array:  # noqa: ARG002, as others
        with np.errstate(invalid="ignore"):
            return np.where(np.abs(np.sin(state.quaternion[1])) < FLAT, SINGULAR, "").astype("U90")

    def evaluate(self, state: State, q: Array) -> Equations:
        now = super().evaluate(state, q)
        (psi, theta, _), zero = state.quaternion, np.zeros(len(self))
        k, n = np.stack([zero, zero, zero + 1]), np.stack([np.cos(psi), np.sin(psi), zero])
        sine = np.sin(theta)
        third = np.stack([np.sin(psi) * sine, -np.cos(psi) * sine, np.cos(theta)])
        rotations = np.stack([(now.jacobian[:, :3] * axis).sum(1) for axis in (k, n, third)], axis=1)
        rotations = np.where(np.abs(sine) < ONE, np.nan, rotations)  # else rounding says whether there is a step
        jacobian = np.concatenate([rotations, now.jacobian[:, 3:]], axis=1)
        return Equations(now.residual, jacobian, now.drivers, now.metric, now.travel)


def _euler(c: Array, s: Array, series: bool = False) -> Array:
    """Return Rz Rx Rz (3, 3, n) from cosines and sines of psi, theta, phi; from series (3, k, n)
    the series of it.
    """
    if not series:
        (c1, c2, c3), (s1, s2, s3) = c, s
    else:
        (c1, c2, c3), (s1, s2, s3) = ([Taylor(v) for v in w] for w in (c, s))
    rows = (
        (c1 * c3 - s1 * s3 * c2, -(c1 * s3) - s1 * c3 * c2, s1 * s2),
        (s1 * c3 + c1 * s3 * c2, c1 * c3 * c2 - s1 * s3, -(c1 * s2)),
        (s3 * s2, c3 * s2, c2),
    )
    if not series:
        return np.stack([np.stack(row) for row in rows])
    return np.stack([np.stack([v.c for v in row], axis=1) for row in rows], axis=1)


def euler_series(
    mechanisms: Mechanisms, system: EulerAngles, state: State, q: Array, metric: Array, inverse: Array
) -> tuple[Array, Array]:
    """Return what `series.pose_series` does, the unknown series being those of the angles."""
    order, n = len(q) - 1, len(system)
    angles, free = np.zeros((order + 1, 3, n)), np.zeros((order + 1, system.free, n))
    angles[0], free[0] = state.quaternion, state.free
    body = np.einsum("jin,jpn->ipn", system.axes, system.arms)

    def arms(k: int) -> Array:
        t = Taylor(angles[: k + 1])
        r = _euler(np.cos(t).c.swapaxes(0, 1), np.sin(t).c.swapaxes(0, 1), series=True)
        return np.asarray(np.einsum("oijn,jpn->oipn", r, body))

    for k in range(1, order + 1):
        residual = last_residual(system, mechanisms, arms(k), free[: k + 1], q[: k + 1])
        with np.errstate(invalid="ignore"):
            step = -(inverse * residual).sum(1)
            angles[k], free[k] = step[:3], step[3:] / metric
    psi, theta, _ = (Taylor(angles[:-1, i]) for i in range(3))
    rates = np.arange(1, order + 1)[:, None, None] * angles[1:]
    a, b, c = (Taylor(rates[:, i]) for i in range(3))
    sine = np.sin(theta)
    spin = (
        b * np.cos(psi) + c * np.sin(psi) * sine,
        b * np.sin(psi) - c * np.cos(psi) * sine,
        a + c * np.cos(theta),
    )
    turn = np.stack([coefficients(v, order - 1, (n,)) for v in spin], axis=1)
    return base_series(system, free, q)[:, :, None] + arms(order), turn
