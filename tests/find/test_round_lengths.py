"""Answers of round lengths: placed where they guide best, not where they stood before rounding."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from catalogue import Candidate, Catalogue, CircularArc, StraightLine

pytestmark = pytest.mark.slow

#: Points of a circuit, and points between the starts of two windows.
POINTS, APART = 2001, 10


def least_deviation(naive: SimpleNamespace, c: Candidate) -> float:
    """Return the least half width of strips over the stroke on the circuit of an answer."""
    best, guided = np.inf, complex(*c.guided)
    for way, closed in naive.ways_round(np.array(c.pivots), guided):
        z = np.asarray(way(np.linspace(0, 2 * np.pi, POINTS))).astype(complex)
        if np.nanmin(np.abs(z - guided)) > 1e-2 * c.stroke:
            continue  # another circuit
        z = np.concatenate([z[:-1], z]) if closed else z
        for first in range(0, POINTS - 1, APART):
            far = np.flatnonzero(np.abs(z[first : first + POINTS] - z[first]) >= c.stroke)
            if len(far) and np.isfinite(z[first : first + far[0] + 1]).all():
                best = min(best, naive.strip_of(z[first : first + far[0] + 1]))
    return float(best)


@pytest.mark.parametrize(
    ("request_", "step"), [(StraightLine(20, 0.05), 1.0), (StraightLine(150, 0.3), 5.0)], ids=["20", "150"]
)
def test_rounded_answers_have_no_better_stretch(
    small: Catalogue, again: Any, naive: SimpleNamespace, request_: StraightLine, step: float
) -> None:
    found = small.find(request_, round_to=step, limit=5)
    assert len(found) == 5
    for c in found:
        for name, length in c.lengths.items():
            assert length == pytest.approx(step * round(length / step), abs=1e-9 * c.size), name
        assert again(c).deviation == pytest.approx(c.deviation, rel=1e-3)
        assert least_deviation(naive, c) > 0.99 * c.deviation, (c.family, c.lengths)


def test_rounded_answers_stay_in_their_box(small: Catalogue) -> None:
    box = (-150.0, -20.0, 300.0, 250.0)
    found = small.find(StraightLine(150, 0.5), round_to=1.0, pins_only=True, fixed_pivots_in=box, limit=6)
    assert found
    for c in found:
        for (x, y, _), _ in c.pivots:
            assert -150 <= x <= 300
            assert -20 <= y <= 250


def test_rounded_arcs_keep_the_radius_asked(small: Catalogue, again: Any) -> None:
    found = small.find(CircularArc(100, 0.5, 120), round_to=1.0, pins_only=True, limit=4)
    assert found
    for c in found:
        assert again(c, 120.0).deviation == pytest.approx(c.deviation, rel=2e-3)
