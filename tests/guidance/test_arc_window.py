"""Windows of circular guides whose chord is as wide, beside the radius, as is asked for."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from catalogue.guidance.arc_window import SWEEP, at_sweep
from catalogue.guidance.coupler_curve import CouplerCurve
from catalogue.guidance.reach import Ladder, reach
from catalogue.guidance.trace import Traced, trace
from catalogue.kinematics.types import Array

pytestmark = pytest.mark.slow

Drawn = Callable[..., tuple[CouplerCurve, np.ndarray]]
#: Windows tried one after the other, in parts of the widest.
PARTS = np.linspace(0.3, 1.0, 141)


def swept(traced: Traced) -> Array:
    return np.asarray(traced.fit.stroke * np.abs(traced.fit.curvature))


@pytest.fixture(scope="module")
def stored(drawn: Drawn, scanned: Callable[[bool], Ladder]) -> tuple[CouplerCurve, Array, Array]:
    """Guides with their longest windows within 1e-3, and their sweeps there."""
    guides, _ = drawn(circle=True)
    half, found = reach(guides, scanned(True), 1e-3, circle=True)
    some = np.flatnonzero(np.isfinite(half) & ~guides.cusp & (swept(found) > 0.05))
    return guides[some], half[some], swept(found)[some]


@pytest.mark.parametrize("share", [0.6, 0.9, 0.99])
def test_the_sweep_is_the_one_asked_for(stored: tuple[CouplerCurve, Array, Array], share: float) -> None:
    guides, half, known = stored
    sweep = share * float(np.median(known))
    some = known > sweep
    found_half, found = at_sweep(guides[some], half[some], np.zeros(some.sum()), known[some], sweep)
    good = np.isfinite(found.fit.deviation)
    assert good.mean() > 0.9
    assert np.mean(np.abs(swept(found)[good] / sweep - 1) <= SWEEP.reached) > 0.97
    again = trace(guides[some][good], found_half[good], circle=True, split=True, nodes=16)
    np.testing.assert_allclose(swept(again), swept(found)[good], rtol=1e-12)


def test_the_widest_window_is_taken(stored: tuple[CouplerCurve, Array, Array]) -> None:
    guides, half, known = stored
    sweep = 0.7 * float(np.median(known))
    some = np.flatnonzero((known > sweep) & (known < 2 * sweep))
    guides, half, known = guides[some], half[some], known[some]
    found_half, found = at_sweep(guides, half, np.zeros(len(half)), known, sweep)
    each = np.tile(np.arange(len(half)), len(PARTS))
    windows = (PARTS[:, None] * half).ravel()
    scan = swept(trace(guides[each], windows, circle=True, split=True, nodes=16)).reshape(len(PARTS), -1)
    crossed = (scan[:-1] <= sweep) & (scan[1:] >= sweep)
    widest = PARTS[len(PARTS) - 1 - np.argmax(crossed[::-1], axis=0)] * half
    there = crossed.any(0)
    assert there.sum() > 50
    reached = np.abs(swept(found) / sweep - 1) <= SWEEP.reached
    assert reached[there].mean() > 0.95
    step = (PARTS[1] - PARTS[0]) * half
    assert np.mean(np.abs(found_half - widest)[there & reached] < 1.01 * step[there & reached]) > 0.95
