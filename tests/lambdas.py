"""Lambda linkages whose crank turns by a given angle over the stroke, symmetric and free ones."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from catalogue import StraightLine
from catalogue.candidates.batch import CandidateBatch, Origin, measured, place_on_path
from catalogue.guidance.coupler_curve import coupler_curve
from catalogue.guidance.placement import at_stroke
from catalogue.kinematics.linkage import Linkage
from catalogue.kinematics.motion import CRANK_1
from catalogue.kinematics.types import Array, Complexes, Floats, Mask
from catalogue.problem.constraints import Constraints
from catalogue.problem.problem import Problem
from catalogue.problem.ranking import Ranking

LINE = Problem.of(StraightLine(1, 0.01), Constraints(), Ranking({"deviation": 1.0}))
#: Rotation of the crank [deg]; frame over crank in Norton's table (coupler, rocker and arm 1.5 times that less 0.5);
#: full band over stroke of that table, and of the best proportions.
TABLE = [(60, 2.9, 2.655e-6, 2.515e-6), (120, 2.625, 1.031e-4, 9.255e-5), (180, 2.2, 9.632e-4, 8.925e-4)]


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

    make: Callable[[Floats], tuple[Floats, Complexes]]
    read: Callable[[Linkage, Complexes], Floats]

    def basis(self, found: CandidateBatch) -> Floats:
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
        step: Floats,
    ) -> tuple[Linkage, Complexes, Mask]:
        pivots, point = self._laid(found, self.read(found.linkage, found.point) + step[:, :-2])
        made, good = Linkage.valid(pivots)
        return made, point[good], good

    def _laid(self, found: CandidateBatch, q: Floats) -> tuple[Floats, Complexes]:
        """Return pivots and guided points as they are made, carried to where the candidates are."""
        (here, at), (pivots, point) = self.make(self.read(found.linkage, found.point)), self.make(q)
        z, w = (p[..., 0] + 1j * p[..., 1] for p in (here, found.linkage.pivots))
        same = here[..., 2] != 0
        arms = [np.where(same, a - b[:, None, None], 0).reshape(len(at), -1) for a, b in ((z, at), (w, found.point))]
        straight, flipped = ((a.conj() * arms[1]).sum(1) for a in (arms[0], arms[0].conj()))
        over = np.abs(flipped) > np.abs(straight) * (1 + 1e-9)
        turn = np.where(over, flipped, straight)
        turn = turn / np.abs(turn)

        def carried(v: Complexes, shift: Complexes | float) -> Complexes:
            flip = over.reshape(-1, *(1,) * (v.ndim - 1))
            return np.asarray(turn.reshape(flip.shape) * np.where(flip, np.conj(v - shift), v - shift))

        far = pivots[..., 2] == 0
        new = pivots[..., 0] + 1j * pivots[..., 1]
        new = np.where(far, carried(new, 0.0), carried(new, at[:, None, None]) + found.point[:, None, None])
        there = carried(point, at) + found.point
        return np.stack([new.real, new.imag, pivots[..., 2]], axis=-1), there


def _coordinates(pivots: Floats, point: Complexes) -> Floats:
    z = (pivots[..., 0] + 1j * pivots[..., 1]).reshape(len(point), 4)
    return _pairs(np.concatenate([z, point[:, None]], axis=1))


def _pairs(z: Complexes) -> Floats:
    """Return complex numbers (n, 5) as x and y, shape (n, 10)."""
    return np.stack([z.real, z.imag], axis=-1).reshape(len(z), -1)


def lambdas(rotation: float) -> ClassParameters:
    """Return the lambda linkages of frame q0 and coupler q1, in cranks, whose crank turns so far over a stroke of 1."""
    half = np.radians(0.5 * rotation)

    def apex(frame: Array, coupler: Array, angle: float) -> Array:
        """Return where the point is from the rocker's pivot: twice the height of the triangle on the base."""
        base = frame + np.exp(1j * angle)  # from the crank's end to the pivot, the crank being 1
        away: Array = 2j * base / np.abs(base) * np.sqrt(coupler**2 - 0.25 * np.abs(base) ** 2)
        return away

    def make(q: Array) -> tuple[Array, Array]:
        frame, coupler = q.T
        scale = 1 / np.abs(apex(frame, coupler, half) - apex(frame, coupler, -half))
        end, point = -1 + 0 * frame, frame + apex(frame, coupler, 0.0)
        z = (
            np.stack([np.stack([0 * point, end], 1), np.stack([frame, 0.5 * (end + point)], 1)], 1)
            * scale[:, None, None]
        )
        return np.stack([z.real, z.imag, np.ones(z.shape)], axis=-1), point * scale

    def read(linkage: Linkage, point: Array) -> Array:  # noqa: ARG001, other classes need it
        z = linkage.points
        crank = np.abs(z[:, 0, 1] - z[:, 0, 0])
        bars = np.stack([np.abs(z[:, 1, 0] - z[:, 0, 0]), np.abs(z[:, 1, 1] - z[:, 1, 0])], axis=1)
        return np.asarray(bars / crank[:, None])

    return ClassParameters(make, read)


def four_bars(rotation: float) -> ClassParameters:
    """Return the four-bars whose first crank turns so far over a stroke of 1.

    Parameters: x and y of A2, A2*, and the guided point, in mid-stroke, for A1 in (0, 0) and A1* in (-1, 0).
    """

    def make(q: Array) -> tuple[Array, Array]:
        fixed, moving, point = (q[:, k] + 1j * q[:, k + 1] for k in (0, 2, 4))
        z = np.stack([np.stack([0 * fixed, 0 * fixed - 1], 1), np.stack([fixed, moving], 1)], 1)
        pivots = np.stack([z.real, z.imag, np.ones(z.shape)], axis=-1)
        guides = coupler_curve(Linkage(pivots), point, chart=np.full(len(q), CRANK_1))
        low, high = np.zeros(len(q)), guides.extent.min(0)
        for _ in range(50):
            half = 0.5 * (low + high)
            turned = 2 * np.degrees(np.diff(np.arctan(guides.window(-half, half)), axis=0)[0])
            low, high = np.where(turned < rotation, half, low), np.where(turned < rotation, high, half)
        scale = 0.5 / half
        return pivots * np.stack([scale, scale, np.ones(len(q))], -1)[:, None, None], point * scale

    def read(linkage: Linkage, point: Array) -> Array:
        z = linkage.points
        unit = z[:, 0, 0] - z[:, 0, 1]
        seen = [(p - z[:, 0, 0]) / unit for p in (z[:, 1, 0], z[:, 1, 1], point)]
        return np.stack([part for p in seen for part in (p.real, p.imag)], axis=1)

    return ClassParameters(make, read)


def placed(moves: ClassParameters, q: Array) -> CandidateBatch:
    pivots, point = moves.make(np.atleast_2d(q))
    guides = coupler_curve(Linkage(pivots), point)
    laid = place_on_path(LINE, guides, at_stroke(guides, 1.0, circle=False))
    return measured(LINE, Origin.made(laid[0], "general"), *laid)


def band(guide: CandidateBatch) -> float:
    """Return the full width of the strip over the stroke, on a grid that leaves nothing between its points."""
    found = at_stroke(coupler_curve(guide.linkage, guide.point), 1.0, circle=False, nodes=128)
    return float(2 * found.fit.deviation[0])
