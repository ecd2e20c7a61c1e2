"""The lift of the way back: against circuits closed in another way, and in requests."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import catalogue
from catalogue import Candidate, Catalogue, StraightLine
from catalogue.errors import InvalidRequest

LEG = StraightLine(150, 0.5)


def lifted(naive: SimpleNamespace, c: Candidate) -> float:
    """Return the largest distance of the circuit from the line through the path of an answer."""
    guided, path = complex(*c.guided), c.path(101) @ np.array([1, 1j])
    along = (path[-1] - path[0]) / abs(path[-1] - path[0])
    for way, _ in naive.ways_round(np.array(c.pivots), guided):
        z = np.asarray(way(np.linspace(0, 2 * np.pi, 20001))).astype(complex)
        if np.abs(z - guided).min() < 1e-2 * c.stroke:
            return float(np.abs(((z - path[50]) * along.conjugate()).imag).max())
    raise AssertionError("the answer is on no circuit")


@pytest.mark.slow
def test_every_answer_lifts_as_far_as_is_asked(small: Catalogue, naive: SimpleNamespace) -> None:
    found = small.find(LEG, min_lift=60, limit=4)
    assert len(found) == 4
    for c in found:
        assert c.lift is not None
        assert c.driver in c.rotates
        assert c.lift >= 60
        assert lifted(naive, c) == pytest.approx(c.lift, rel=1e-4, abs=2 * c.deviation)


@pytest.mark.slow
def test_a_crank_that_swings_has_no_lift(small: Catalogue) -> None:
    found = small.find(LEG, limit=8)
    for c in found:
        assert (c.lift is None) == (c.driver not in c.rotates)
    swinging = catalogue.guide({"ground": 3, "crank": 4, "coupler": 2.5, "rocker": 3.5, "along": 1.2, "across": 0.4})
    (stretch,) = swinging.measure(stroke=1.0, limit=1)
    assert stretch.rotates == []
    assert stretch.lift is None


def test_lift_goes_with_points_that_run_along_their_path(small: Catalogue) -> None:
    kinds: Any = ({"slots": True}, {"returns": True})
    for kind in kinds:
        with pytest.raises(InvalidRequest, match="min_lift is of points that run along the path"):
            small.find(LEG, min_lift=5, **kind)


@pytest.mark.slow
def test_ranking_by_uniformity_finds_steadier_guides(small: Catalogue) -> None:
    wanted: Any = {"families": ["four-bar"], "max_size": 400.0, "min_transmission": 40.0}
    by_score, by_uniformity = (
        [c.uniformity or 0.0 for c in small.find(LEG, rank_by=rank, limit=3, **wanted)]
        for rank in ("score", "uniformity")
    )
    assert by_uniformity == sorted(by_uniformity, reverse=True)
    assert by_uniformity[0] > 0.95 > max(by_score)
