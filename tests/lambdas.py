"""Lambda linkages whose crank turns by a given angle over the stroke, symmetric and free ones."""

from __future__ import annotations

import numpy as np

from catalogue import StraightLine
from catalogue.candidates.batch import CandidateBatch, Origin
from catalogue.candidates.placement import measured, place_on_path
from catalogue.guide.coupler_curve import coupler_curve
from catalogue.guide.placement import at_stroke
from catalogue.kinematics.linkage import Linkage
from catalogue.kinematics.motion import CRANK_1
from catalogue.kinematics.types import Array
from catalogue.problem.constraints import Constraints
from catalogue.problem.problem import Problem
from catalogue.problem.ranking import Ranking
from catalogue.refine.subproblem import ClassParameters

LINE = Problem.of(StraightLine(1, 0.01), Constraints(), Ranking({"deviation": 1.0}))
#: Rotation of the crank [deg]; frame over crank in Norton's table (coupler, rocker and arm 1.5 times that less 0.5);
#: full band over stroke of that table, and of the best proportions.
TABLE = [(60, 2.9, 2.655e-6, 2.515e-6), (120, 2.625, 1.031e-4, 9.255e-5), (180, 2.2, 9.632e-4, 8.925e-4)]


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
