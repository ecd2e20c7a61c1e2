"""Starts made to measure touch the path to second order, measured on their finite motion."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from catalogue import CircularArc, StraightLine
from catalogue.problem.constraints import Constraints
from catalogue.problem.problem import Problem
from catalogue.problem.ranking import Ranking
from catalogue.search.draws import MAX_LINK, MIN_LINK, summit
from catalogue.search.euler_savary import drawn, starts

LINE, ARC, ANY = StraightLine(1, 1e-3), CircularArc(1, 1e-3, 0.8), CircularArc(1, 1e-3)


def asked(request: Any, **wanted: Any) -> Problem:
    return Problem.of(request, Constraints(**wanted), Ranking())


@pytest.mark.parametrize("family", ["four-bar", "slider-crank"])
@pytest.mark.parametrize(("request_", "radius"), [(LINE, np.inf), (ARC, 0.8)], ids=["line", "arc"])
def test_the_path_has_the_tangent_and_curvature_asked_for(
    naive: SimpleNamespace, request_: Any, radius: float, family: str
) -> None:
    """Central differences of the loop closed in 50 digits, a crank or the coupler turning."""
    problem = asked(request_)
    point = complex(0.5, 0.0 if radius == np.inf else np.sqrt(radius**2) - np.sqrt(radius**2 - 0.25))
    bend = np.full(60, -1 / radius)
    np.testing.assert_allclose(summit(bend), point, atol=1e-15)
    pivots = drawn(problem, family, bend, np.random.default_rng(7))
    pivots = pivots[np.isfinite(pivots).all(axis=(1, 2, 3))][:24]
    assert len(pivots) == 24
    h = naive.mp.mpf(10) ** -8
    with naive.mp.workdps(50):
        for one in pivots:
            loop = naive.Loop(one, point, exact=True)
            low, here, high = (loop.close("crank", t) for t in (-h, 0 * h, h))
            speed, bend = (high - low) / (2 * h), (high - 2 * here + low) / h**2
            turn = speed / abs(speed)
            curvature = float((turn.conjugate() * bend).imag / abs(speed) ** 2) * float(np.sign(float(turn.real)))
            assert float(abs(turn.imag)) < 1e-6
            assert curvature == pytest.approx(-1 / radius, abs=1e-5)


@pytest.mark.parametrize("family", ["four-bar", "slider-crank"])
def test_fixed_pivots_stand_in_the_box_and_links_are_in_proportion(family: str) -> None:
    for name in ("fixed_pivots_in", "pivots_in", "swept_in"):
        problem = asked(LINE, **{name: (0.2, -0.9, 0.7, -0.2)})
        z = drawn(problem, family, np.zeros(400), np.random.default_rng(1))
        z = z[np.isfinite(z).all(axis=(1, 2, 3))]
        assert len(z) > 20
        fixed = z[:, :, 0][z[:, :, 0, 2] == 1]
        assert (fixed[:, 0] >= 0.2).all()
        assert (fixed[:, 0] <= 0.7).all()
        assert (fixed[:, 1] >= -0.9).all()
        assert (fixed[:, 1] <= -0.2).all()
    cranks = np.linalg.norm((z[:, 0, 1] - z[:, 0, 0])[:, :2], axis=1)
    couplers = np.linalg.norm((z[:, 1, 1] - z[:, 0, 1])[:, :2], axis=1)
    for length in (cranks, couplers):
        assert (length > MIN_LINK).all()
        assert (length < MAX_LINK).all()


@pytest.mark.parametrize("request_", [LINE, ARC, ANY], ids=["line", "arc", "any arc"])
def test_some_starts_reach_over_the_stroke(request_: Any) -> None:
    found = starts(asked(request_), "four-bar", 400, np.random.default_rng(2))
    assert found is not None
    assert set(found.linkage.family) == {"four-bar"}
    assert set(found.origin.series) == {"general"}
    assert (found.origin.id == -1).all()
    assert np.isfinite(found.deviation).sum() > 30
    assert np.nanmin(found.deviation) < 0.01
