"""How placed guides may move: by the coordinates of their pivots, or by the parameters of a class of linkages."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..candidates.batch import CandidateBatch
from ..guide.pose_jacobian import COUNT, displaced
from ..kinematics.linkage import Linkage
from ..kinematics.types import Array

#: Moves of a pivot nearer to the guided point than this part of the stroke are measured as if it stood there.
NEAR = 0.1
#: The coordinate that never moves: the guided point is in the middle of its stroke.
ALONG = 8


class Parametrisation(Protocol):
    """How placed guides may move: steps in p numbers each, of which 1 is a large one."""

    def basis(self, found: CandidateBatch) -> Array:
        """Return the derivatives (n, 10, p) of the coordinates of `derivatives` by the steps."""

    def moved(self, found: CandidateBatch, step: Array) -> tuple[Linkage, Array, Array]:
        """Return the linkages and guided points after steps (n, p), those that are valid, and the mask (n,) of them."""


@dataclass(frozen=True)
class PivotCoordinates:
    """The coordinates of the pivots and the guided point [strokes], in their distances from the guided point.

    Attributes
    ----------
    frozen : ndarray of bool, shape (10,), optional
        Which coordinates stay: x and y of A1, A1*, A2, A2*, and the guided point.  Every answer is laid along its path
        anew, which moves frozen pivots by what the path turns or shifts, less and less as the steps become short.
    """

    frozen: Array | None = None

    def basis(self, found: CandidateBatch) -> Array:
        linkage = found.linkage
        finite = linkage.finite.reshape(-1, 4)
        arm = np.abs(linkage.points - found.point[:, None, None]).reshape(-1, 4)
        unit = np.where(finite, np.maximum(arm, NEAR), 1.0)
        unit = np.repeat(np.concatenate([unit, np.ones((len(unit), 1))], axis=1), 2, axis=1)
        unit[:, ALONG] = 0.0
        if self.frozen is not None:
            unit[:, self.frozen] = 0.0
        return unit[:, :, None] * np.eye(COUNT)

    def moved(self, found: CandidateBatch, step: Array) -> tuple[Linkage, Array, Array]:
        change = (self.basis(found) @ step[..., None])[..., 0]
        return displaced(found.linkage, found.point, change)


@dataclass(frozen=True)
class ClassParameters:
    """The parameters of a class of linkages, which the refined ones do not leave.

    Attributes
    ----------
    make : callable
        From parameters (n, p) to pivots (n, 2, 2, 3) and guided points (n,), in mid-stroke, in any frame; of a size
        that leaves the stroke the one asked for.
    read : callable
        From linkages and guided points, in any frame, to their parameters (n, p).
    """

    make: Callable[[Array], tuple[Array, Array]]
    read: Callable[[Linkage, Array], Array]

    def basis(self, found: CandidateBatch) -> Array:
        """By central differences; the last two are a shift across the path and a turn about the guided point."""
        q = self.read(found.linkage, found.point)
        columns = []
        for k in range(q.shape[1]):
            step = np.zeros_like(q)
            step[:, k] = 1e-5
            ends = [self._laid(found, q + sign * step) for sign in (1, -1)]
            columns.append((_coordinates(*ends[0]) - _coordinates(*ends[1])) / 2e-5)
        finite = found.linkage.finite.reshape(-1, 4)
        z = found.linkage.points.reshape(-1, 4) - np.where(finite, found.point[:, None], 0)
        zero = np.zeros((len(z), 1))
        columns.append(_pairs(np.concatenate([1j * finite, 1j + zero], axis=1)))
        columns.append(_pairs(np.concatenate([1j * z, zero], axis=1)))
        return np.stack(columns, axis=-1)

    def moved(
        self,
        found: CandidateBatch,
        step: Array,
    ) -> tuple[Linkage, Array, Array]:
        pivots, point = self._laid(found, self.read(found.linkage, found.point) + step[:, :-2])
        made, good = Linkage.valid(pivots)
        return made, point[good], good

    def _laid(self, found: CandidateBatch, q: Array) -> tuple[Array, Array]:
        """Return pivots and guided points as they are made, carried to where the candidates are."""
        (here, at), (pivots, point) = self.make(self.read(found.linkage, found.point)), self.make(q)
        z, w = (p[..., 0] + 1j * p[..., 1] for p in (here, found.linkage.pivots))
        same = here[..., 2] != 0
        arms = [np.where(same, a - b[:, None, None], 0).reshape(len(at), -1) for a, b in ((z, at), (w, found.point))]
        straight, flipped = ((a.conj() * arms[1]).sum(1) for a in (arms[0], arms[0].conj()))
        over = np.abs(flipped) > np.abs(straight) * (1 + 1e-9)
        turn = np.where(over, flipped, straight)
        turn = turn / np.abs(turn)

        def carried(v: Array, shift: Array | float) -> Array:
            flip = over.reshape(-1, *(1,) * (v.ndim - 1))
            return np.asarray(turn.reshape(flip.shape) * np.where(flip, np.conj(v - shift), v - shift))

        far = pivots[..., 2] == 0
        new = pivots[..., 0] + 1j * pivots[..., 1]
        new = np.where(far, carried(new, 0.0), carried(new, at[:, None, None]) + found.point[:, None, None])
        there = carried(point, at) + found.point
        return np.stack([new.real, new.imag, pivots[..., 2]], axis=-1), there


def _coordinates(pivots: Array, point: Array) -> Array:
    z = (pivots[..., 0] + 1j * pivots[..., 1]).reshape(len(point), 4)
    return _pairs(np.concatenate([z, point[:, None]], axis=1))


def _pairs(z: Array) -> Array:
    """Return complex numbers (n, 5) as x and y, shape (n, 10)."""
    return np.stack([z.real, z.imag], axis=-1).reshape(len(z), -1)
