"""Moves of placed guides that keep link lengths or pivots."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..candidates.batch import CandidateBatch
from ..guidance.sensitivity import COUNT, displaced
from ..kinematics.batch import take
from ..kinematics.link_lengths import link_lengths
from ..kinematics.linkage import Linkage
from ..kinematics.types import Complexes, Floats, Mask
from .subproblem import PivotCoordinates


class Projection(NamedTuple):
    """Options of the projection to the held lengths after a step."""

    difference: float = 1e-6  #: step of finite differences of lengths by coordinates [strokes]
    rounds: int = 6  #: largest number of corrections of the lengths
    close: float = 1e-13  #: error of the lengths at which corrections stop [strokes]


PROJECTION = Projection()


@dataclass(frozen=True)
class HeldLengths:
    """Coordinates of pivots and guided point for moves that keep named lengths.

    The lengths have given values [strokes]. `frozen` coordinates, (10,), are fixed, and fixed
    pivots stay `within` a distance of their `places`, (2,) [strokes].
    """

    values: dict[str, float]
    frozen: Mask | None = None
    places: Complexes | None = None
    within: float = 0.0

    @property
    def free(self) -> PivotCoordinates:
        """The coordinates without held lengths."""
        return PivotCoordinates(self.frozen)

    def basis(self, found: CandidateBatch) -> Floats:
        unit = self.free.basis(found)
        if not self.values:
            return unit
        by = self._slopes(found.linkage, found.point) @ unit  # (n, k, 10)
        return np.asarray(unit @ (np.eye(COUNT) - np.linalg.pinv(by) @ by))

    def moved(self, found: CandidateBatch, step: Floats) -> tuple[Linkage, Complexes, Mask]:
        linkage, point, good = displaced(found.linkage, found.point, (self.basis(found) @ step[..., None])[..., 0])
        if self.places is not None:
            linkage = self._drawn_back(linkage)
        if not self.values or not len(linkage):
            return linkage, point, good
        linkage, point, closed = self.closed(linkage, point, self.free.basis(take(found, np.flatnonzero(good))))
        good[good] = closed
        return linkage, point, good

    def closed(self, linkage: Linkage, point: Complexes, unit: Floats) -> tuple[Linkage, Complexes, Mask]:
        """Find the nearest linkages with the held lengths, and a mask of those that exist.

        The projection is orthogonal in units (n, 10, 10).
        """
        there = np.ones(len(linkage), bool)
        for _ in range(PROJECTION.rounds):
            missing = np.stack([self.values[name] - here for name, here in self._lengths(linkage, point)], axis=1)
            if (np.abs(missing) <= PROJECTION.close).all():
                break
            by = self._slopes(linkage, point) @ unit
            with np.errstate(all="ignore"):
                move = (unit @ (np.linalg.pinv(by) @ missing[..., None]))[..., 0]
            linkage, point, good = displaced(linkage, point, np.nan_to_num(move))
            unit = unit[good]
            there[there] = good
        missing = np.stack([self.values[name] - here for name, here in self._lengths(linkage, point)], axis=1)
        closed = (np.abs(missing) <= 1e3 * PROJECTION.close).all(1)
        there[there] = closed
        return linkage[closed], point[closed], there

    def _drawn_back(self, linkage: Linkage) -> Linkage:
        """Move fixed pivots back to within the tolerance of their prescribed places."""
        assert self.places is not None
        away = linkage.points[:, :, 0] - self.places
        far = np.maximum(np.abs(away) / self.within, 1.0)
        z = np.where(linkage.finite[:, :, 0], self.places + away / far, linkage.points[:, :, 0])
        pivots = linkage.pivots.copy()
        pivots[:, :, 0, 0], pivots[:, :, 0, 1] = z.real, z.imag
        return Linkage.trusted(pivots)

    def _lengths(self, linkage: Linkage, point: Complexes) -> list[tuple[str, Floats]]:
        found = link_lengths(linkage, point)
        return [(name, found[name]) for name in self.values]

    def _slopes(self, linkage: Linkage, point: Complexes) -> Floats:
        """Return the derivatives of the lengths by the coordinates, shape (n, k, 10)."""
        n, k = len(linkage), len(self.values)
        each = np.tile(np.arange(n), 2 * COUNT)
        ahead = PROJECTION.difference * np.eye(COUNT)
        steps = np.repeat(np.concatenate([ahead, -ahead]), n, axis=0)
        pivots = linkage.pivots[each].copy()
        pivots[..., :2] += steps[:, :8].reshape(-1, 2, 2, 2)
        moved = Linkage.trusted(pivots)
        values = [here for _, here in self._lengths(moved, point[each] + steps[:, 8] + 1j * steps[:, 9])]
        high, low = np.stack(values, axis=-1).reshape(2, COUNT, n, k)
        return np.asarray(np.moveaxis(high - low, 0, -1) / (2 * PROJECTION.difference))
