"""Refinement within a class of linkages: symmetric lambda linkages from the proportions of the textbooks."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

from catalogue import StraightLine
from catalogue.guide.place import at_stroke
from catalogue.guide.span import span
from catalogue.linkage import Array, Linkage
from catalogue.query.lay import Answers, laid
from catalogue.query.request import Constraints
from catalogue.refine import Parametric, Task, refined
from catalogue.refine.certificate import alternations
from catalogue.refine.linear import linearised

LINE = StraightLine(1, 0.01)
#: Rotation of the crank [deg]; frame over crank in Norton's table (coupler, rocker and arm 1.5 times that less 0.5);
#: full band over stroke of that table, and of the best proportions.
TABLE = [(60, 2.9, 2.655e-6, 2.515e-6), (120, 2.625, 1.031e-4, 9.255e-5), (180, 2.2, 9.632e-4, 8.925e-4)]


def lambdas(rotation: float) -> Parametric:
    """Return the lambda linkages of frame q0 and coupler q1, in cranks, whose crank turns so far over a stroke of 1."""
    half = np.radians(0.5 * rotation)

    def apex(frame: Array, coupler: Array, angle: float) -> Array:
        """Return where the point is from the rocker's pivot: twice the height of the triangle on the base."""
        base = frame + np.exp(1j * angle)  # from the crank's end to the pivot, the crank being 1
        return 2j * base / np.abs(base) * np.sqrt(coupler**2 - 0.25 * np.abs(base) ** 2)

    def make(q: Array) -> tuple[Array, Array]:
        frame, coupler = q.T
        scale = 1 / np.abs(apex(frame, coupler, half) - apex(frame, coupler, -half))
        end, point = -1 + 0 * frame, frame + apex(frame, coupler, 0.0)
        z = (
            np.stack([np.stack([0 * point, end], 1), np.stack([frame, 0.5 * (end + point)], 1)], 1)
            * scale[:, None, None]
        )
        return np.stack([z.real, z.imag, np.ones(z.shape)], axis=-1), point * scale

    def read(linkage: Linkage, point: Array) -> Array:  # noqa: ARG001
        z = linkage.points
        crank = np.abs(z[:, 0, 1] - z[:, 0, 0])
        return np.stack([np.abs(z[:, 1, 0] - z[:, 0, 0]), np.abs(z[:, 1, 1] - z[:, 1, 0])], axis=1) / crank[:, None]

    return Parametric(make, read)


def placed(moves: Parametric, q: Array) -> Answers:
    pivots, point = moves.make(np.atleast_2d(q))
    guides = span(Linkage(pivots), point)
    return laid(LINE, Constraints(), {}, guides, at_stroke(guides, 1.0, circle=False))[0]


def band(guide: Answers) -> float:
    """Return the full width of the strip over the stroke, on a grid that leaves nothing between its points."""
    found = at_stroke(span(guide.linkage, guide.point), 1.0, circle=False, nodes=128)
    return float(2 * found.fit.deviation[0])


@pytest.mark.parametrize(("rotation", "frame", "table", "best"), TABLE)
def test_lambda_linkages_are_the_best_of_their_kind(rotation: float, frame: float, table: float, best: float) -> None:
    moves = lambdas(rotation)
    start = placed(moves, np.array([frame, 1.5 * frame - 0.5]))
    assert band(start) == pytest.approx(table, rel=1e-3)
    found, _ = refined(start, Task(LINE, Constraints(), moves=moves))
    assert band(found) == pytest.approx(best, rel=1e-3)
    q = moves.read(found.linkage, found.point)
    np.testing.assert_allclose(np.abs(placed(moves, q).linkage.pivots), np.abs(found.linkage.pivots), atol=1e-9)
    problem = linearised(found, span(found.linkage, found.point), Task(LINE, Constraints(), moves=moves), np.zeros(1))
    assert alternations(problem.error)[0] == 7  # an even path with six inflections

    naive = minimize(
        lambda p: np.log(band(placed(moves, p))), q[0] * 1.001, method="Nelder-Mead",
        options={"xatol": 1e-8, "fatol": 1e-6},
    )  # fmt: skip
    assert band(found) <= np.exp(naive.fun) * (1 + 1e-3)
