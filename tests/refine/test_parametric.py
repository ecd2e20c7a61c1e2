"""Refinement within a class of linkages: symmetric lambda linkages from the proportions of the textbooks."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

from catalogue.guidance.coupler_curve import coupler_curve
from catalogue.kinematics.types import Array
from catalogue.refine.certificate import certified
from catalogue.refine.sqp import Refinement
from tests.lambdas import LINE, TABLE, band, four_bars, lambdas, placed

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(("rotation", "frame", "table", "best"), TABLE)
def test_lambda_linkages_are_the_best_of_their_kind(rotation: float, frame: float, table: float, best: float) -> None:
    moves = lambdas(rotation)
    start = placed(moves, np.array([frame, 1.5 * frame - 0.5]))
    assert band(start) == pytest.approx(table, rel=1e-3)
    found = Refinement.of(LINE, start, moves).run(12).best
    assert band(found) == pytest.approx(best, rel=1e-3)
    q = moves.read(found.linkage, found.point)
    there = np.abs(placed(moves, q).linkage.pivots)
    # refinement lays guides by the path at 16 nodes, which places the line to a hundredth of the deviation
    np.testing.assert_allclose(there, np.abs(found.linkage.pivots), atol=0.01 * band(found))
    certificate = certified(LINE, found, moves)
    assert certificate.gap[0] < 0.01
    assert certificate.alternations[0] == 7  # an even path with six inflections

    def log_band(p: Array) -> float:
        return float(np.log(band(placed(moves, p))))

    naive = minimize(log_band, q[0] * 1.001, method="Nelder-Mead", options={"xatol": 1e-8, "fatol": 1e-6})
    assert band(found) <= np.exp(naive.fun) * (1 + 1e-3)


@pytest.mark.parametrize(("rotation", "frame", "table", "best"), TABLE[:1])
def test_they_are_stationary_among_all_four_bars(rotation: float, frame: float, table: float, best: float) -> None:
    """With as much rotation of the crank: from the textbook's proportions the free linkage comes to the symmetric one,
    or a little farther."""
    held = placed(lambdas(rotation), np.array([frame, 1.5 * frame - 0.5]))
    moves = four_bars(rotation)
    start = placed(moves, moves.read(held.linkage, held.point))
    assert band(start) == pytest.approx(table, rel=1e-3)
    found = Refinement.of(LINE, start, moves).run(8).best
    assert 0.99 * best < band(found) < 1.002 * best
    assert certified(LINE, found, moves).gap[0] < 0.01
    z, guides = found.linkage.points[0], coupler_curve(found.linkage, found.point)
    d, x, _ = guides.motion.pose(np.stack([found.traced.low, found.traced.high]))
    end = z[0, 1] + d[:, 0] + x[:, 0] * (z[0, 1] - guides.motion.origin[0]) - z[0, 0]
    assert abs(np.degrees(np.angle(end[1] / end[0]))) == pytest.approx(rotation, abs=0.01)
