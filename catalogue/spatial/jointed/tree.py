"""Poses of bodies carried by joints, the spanning tree of a mechanism: dimensionless, for many
states.

Every body has the frame of the design pose: hard points are body coordinates, and the pose of each
body starts at the identity.  A body is carried by the first revolute, prismatic or cylindrical
joint stated for it, or is free.  Each unknown moves its bodies about a *screw* (Hunt, Kinematic
Geometry of Mechanisms, ch. 12).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ...kinematics.types import Array
from ..geometry.power_series import Taylor, coefficients
from ..geometry.rotation import turned, turning
from .located_guide import LocatedGuide
from .vectors import EYE, cayley, cross, series, skew, waves
from .vectors import rotation as rotation_of

REVOLUTE, PRISMATIC, CYLINDRICAL, SURFACE, CURVE, FREE = range(6)
#: Number of unknowns of each kind of joint.
UNKNOWNS = (1, 1, 2, 2, 1, 6)
#: Number of state entries of each kind of joint.
NUMBERS = (1, 1, 2, 2, 1, 7)


def span(index: Sequence[int] | Array) -> Any:
    """Return indices as a slice if they are evenly spaced: a slice selects without a copy."""
    i = [int(k) for k in index]
    step = i[1] - i[0] if len(i) > 1 else 1
    if i and step > 0 and i == list(range(i[0], i[-1] + 1, step)):
        return slice(i[0], i[-1] + 1, step)
    return np.asarray(i, int)


@dataclass(frozen=True)
class Placed:
    """Bodies on joints of one kind: indices of bodies, carrying bodies, unknowns, state entries.

    `lead` is the advance of screw joints [units/rad]; empty without screws.
    """

    joint_kind: int
    bodies: list[int]
    on: list[int]
    unknown: list[int]
    number: list[int]
    point: list[int]
    direction: list[int]
    guide: LocatedGuide | None = None
    lead: tuple[float, ...] = ()

    @cached_property
    def here(self) -> Any:
        return span(self.bodies)

    def numbers(self, k: int = 0) -> Any:
        """Return, for each of these joints, the index of its k-th entry in a state."""
        return self._spans[k][0]

    def unknowns(self, k: int = 0) -> Any:
        """Return, for each of these joints, the index of its k-th unknown."""
        return self._spans[k][1]

    @cached_property
    def _spans(self) -> list[tuple[Any, Any]]:
        size = UNKNOWNS[self.joint_kind]
        return [(span([c + k for c in self.number]), span([c + k for c in self.unknown])) for k in range(size)]


@dataclass(frozen=True)
class Tree:
    """Bodies on their joints; the leading axis N of the geometry is 1 or the size of the batch.

    Attributes
    ----------
    points, directions : ndarray, shape (N, h, 3), (N, d, 3)
        Hard points and unit vectors, in units, about a centre.
    placed : tuple of Placed
    unknowns, numbers : int
        Number of unknowns; length of a state.
    """

    bodies: tuple[str, ...]
    points: Array
    directions: Array
    placed: tuple[Placed, ...]
    unknowns: int
    numbers: int

    @cached_property
    def design(self) -> Array:
        """Return the state of the design pose, shape (numbers,)."""
        y = np.zeros(self.numbers)
        for p in self.placed:
            if p.joint_kind == FREE:
                y[p.number] = 1
            elif p.guide:
                y[p.number[0] : p.number[0] + len(p.guide.start)] = p.guide.start
        return y

    @cached_property
    def weight(self) -> Array:
        """Weights of the squares of a rate in its norm, shape (numbers,)."""
        w = np.ones(self.numbers)
        for p in self.placed:
            if p.joint_kind == FREE:
                w[np.asarray(p.number)[:, None] + np.arange(4)] = 4
        return w

    # -- poses -----------------------------------------------------------------------------------
    def poses(self, y: Array, x: Array | None = None) -> tuple[Array, Array]:
        """Return series of rotations (K + 1, n, b, 3, 3) and translations.

        Parameters
        ----------
        y : ndarray, shape (n, numbers)
            States.
        x : ndarray, shape (K + 1, n, unknowns), optional
            A motion from these states as a series; its first coefficient is 0.
        """
        n, order = len(y), 1 if x is None else len(x)
        rotation = np.zeros((order, n, len(self.bodies), 3, 3))
        shift = np.zeros((order, n, len(self.bodies), 3))
        rotation[0, :, 0] = EYE
        for p, axes in zip(self.placed, self._joint_axes, strict=True):
            if p.joint_kind == FREE:
                turn, move = self._free_poses(p, y, x)
            elif p.guide:
                turn, move = self._pose_on_guide(p, y, x)
            else:
                turn, move = self._poses_on_joints(p, axes, y, x)
            if any(p.on):
                on = rotation[:, :, p.on]
                move = series(on, move[..., None], np.matmul)[..., 0] + shift[:, :, p.on]
                turn = series(on, turn, np.matmul)
            rotation[:, :, p.here], shift[:, :, p.here] = turn, move
        return rotation, shift

    def _coordinates(self, y: Array, x: Array | None, number: Any, unknown: Any) -> Array:
        if x is None:
            return np.asarray(y[None, :, number])
        out = x[:, :, unknown].copy()
        out[0] = y[:, number]
        return out

    def _poses_on_joints(self, p: Placed, axes: tuple[Array, ...], y: Array, x: Array | None) -> tuple[Array, Array]:
        order, n = 1 if x is None else len(x), len(y)
        axis, at, along, across, turning = axes
        if p.joint_kind == PRISMATIC:
            turn, move = np.zeros((order, n, len(p.bodies), 3, 3)), np.zeros((order, n, len(p.bodies), 3))
            turn[0] = EYE
        else:
            q = self._coordinates(y, x, p.numbers(), p.unknowns())
            s, c = (np.sin(q)[..., None, None], np.cos(q)[..., None, None]) if order == 1 else waves(q)
            turn = c * across + s * turning
            turn[0] += along
            move = -(turn @ at[..., None])[..., 0]
            move[0] += at
            if p.lead:
                move = move + (q * p.lead)[..., None] * axis
        if p.joint_kind != REVOLUTE:
            one = 1 if p.joint_kind == CYLINDRICAL else 0
            slide = self._coordinates(y, x, p.numbers(one), p.unknowns(one))
            move = move + slide[..., None] * axis
        return turn, move

    @cached_property
    def _joint_axes(self) -> list[tuple[Array, ...]]:
        """Axes and points of joints, and the constant parts of their rotations."""
        out: list[tuple[Array, ...]] = []
        for p in self.placed:
            at = self.points[:, p.point]
            axis = self.directions[:, p.direction] if p.joint_kind < SURFACE else np.zeros_like(at)
            along = axis[..., :, None] * axis[..., None, :]
            out.append((axis, at, along, EYE - along, skew(axis)))
        return out

    @cached_property
    def _constant_screws(self) -> Array:
        """Constant screws (N, unknowns, 6): joints on the ground, translations of free bodies."""
        out = np.zeros((len(self.points), self.unknowns, 6))
        for p, (axis, at, *_) in zip(self.placed, self._joint_axes, strict=True):
            if p.joint_kind == FREE:
                for u in p.unknown:
                    out[:, u : u + 3, 3:] = out[:, u + 3 : u + 6, :3] = EYE
            elif not p.guide and not any(p.on):
                self._write_screws(out, p, axis, at)
        return out

    @staticmethod
    def _write_screws(out: Array, p: Placed, axis: Array, at: Array) -> None:
        if p.joint_kind != PRISMATIC:
            out[:, p.unknown, 3:], out[:, p.unknown, :3] = axis, cross(at, axis)
            if p.lead:
                out[:, p.unknown, :3] += np.asarray(p.lead)[:, None] * axis
        if p.joint_kind != REVOLUTE:
            out[:, [k + (p.joint_kind == CYLINDRICAL) for k in p.unknown], :3] = axis

    def _pose_on_guide(self, p: Placed, y: Array, x: Array | None) -> tuple[Array, Array]:
        """Return rotation and translation of a guided point, as of a body without rotation."""
        assert p.guide is not None
        two = np.arange(UNKNOWNS[p.joint_kind])
        q = self._coordinates(y, x, p.number[0] + two, p.unknown[0] + two)
        local = p.guide.kind.point(Taylor(q[..., 0]), Taylor(q[..., -1]), p.guide.shapes(len(y)))
        c = np.stack([coefficients(v, len(q) - 1, (len(y),)) for v in local], axis=-1)
        world = c @ p.guide.frame.T
        world[0] += p.guide.origin - self.points[:, p.point[0]]
        turn = np.zeros((len(q), len(y), 1, 3, 3))
        turn[0] = np.eye(3)
        return turn, world[:, :, None]

    def _free_poses(self, p: Placed, y: Array, x: Array | None) -> tuple[Array, Array]:
        number = np.asarray(p.number)[:, None] + np.arange(7)
        state = y[:, number]  # (n, f, 7)
        turn, at = rotation_of(state[..., :4])[None], self.points[:, p.point]
        move = state[None, ..., 4:]
        if x is not None and len(x) > 1:
            d = x[:, :, np.asarray(p.unknown)[:, None] + np.arange(6)]
            turn = series(
                cayley(d[..., :3]), np.concatenate([turn, np.zeros((len(x) - 1, *turn.shape[1:]))]), np.matmul
            )
            move = np.concatenate([move, d[1:, ..., 3:]])
        move = move - (turn @ at[..., None])[..., 0]
        move[0] += at
        return turn, move

    def screws(self, y: Array, rotation: Array, shift: Array) -> Array:
        """Return the screws (n, unknowns, 6) of all unknowns: velocity of the origin, rotation."""
        out = np.empty((len(y), self.unknowns, 6))
        out[:] = self._constant_screws
        for p, (axis, at, *_) in zip(self.placed, self._joint_axes, strict=True):
            if p.joint_kind == FREE:
                for i, (k, c) in enumerate(zip(p.unknown, p.number, strict=True)):
                    out[:, k : k + 3, :3] = np.swapaxes(skew(at[:, i] + y[:, c + 4 : c + 7]), 1, 2)
            elif p.guide:
                size = UNKNOWNS[p.joint_kind]
                u, w = y[:, p.number[0]], y[:, p.number[0] + size - 1]
                _, t = p.guide.kind.tangents(u, w, p.guide.shapes(len(y)))
                world = np.moveaxis(t[:size], 2, 0) @ p.guide.frame.T
                out[:, p.unknown[0] : p.unknown[0] + size, :3] = world @ np.swapaxes(rotation[0][:, p.on[0]], 1, 2)
            elif any(p.on):
                on = rotation[0][:, p.on]
                here = (on @ at[..., None])[..., 0] + shift[0][:, p.on]
                self._write_screws(out, p, (on @ axis[..., None])[..., 0], here)
        return out

    def numbered(self, y: Array, x: Array) -> Array:
        """Return the state as series (K + 1, n, numbers); entries of free bodies are constant."""
        out = np.zeros((len(x), *y.shape))
        out[0] = y
        for p in self.placed:
            if p.joint_kind != FREE:
                for k in range(UNKNOWNS[p.joint_kind]):
                    out[1:, :, p.numbers(k)] = x[1:, :, p.unknowns(k)]
        return out

    # -- states ----------------------------------------------------------------------------------
    def moved(self, y: Array, step: Array) -> Array:
        """Return the states after a step (n, unknowns) of all unknowns."""
        out = y.copy()
        for p in self.placed:
            if p.joint_kind == FREE:
                for number, unknown in zip(p.number, p.unknown, strict=True):
                    quaternion, spin = y[:, number : number + 4], step[:, unknown : unknown + 3]
                    out[:, number : number + 4] = turned(quaternion.T, spin.T).T
                    out[:, number + 4 : number + 7] += step[:, unknown + 3 : unknown + 6]
            else:
                for k in range(UNKNOWNS[p.joint_kind]):
                    out[:, p.numbers(k)] += step[:, p.unknowns(k)]
        return out

    def unitary(self, y: Array) -> Array:
        """Return states with quaternions of length 1."""
        y = y.copy()
        for p in self.placed:
            if p.joint_kind == FREE:
                for number in p.number:
                    q = y[:, number : number + 4]
                    q /= np.sqrt((q * q).sum(1, keepdims=True))
        return y

    def lifted(self, y: Array, step: Array) -> Array:
        """Return the rates (n, numbers) of states from the rates (n, unknowns) of the unknowns."""
        out = np.empty_like(y)
        for p in self.placed:
            if p.joint_kind == FREE:
                for number, unknown in zip(p.number, p.unknown, strict=True):
                    quaternion, spin = y[:, number : number + 4], step[:, unknown : unknown + 3]
                    out[:, number : number + 4] = turning(quaternion.T, spin.T).T
                    out[:, number + 4 : number + 7] = step[:, unknown + 3 : unknown + 6]
            else:
                for k in range(UNKNOWNS[p.joint_kind]):
                    out[:, p.numbers(k)] = step[:, p.unknowns(k)]
        return out
