"""Reach: the longest stroke within a relative deviation."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from catalogue.curvature_theory.leading_error import EXACT
from catalogue.guidance.coupler_curve import CouplerCurve
from catalogue.guidance.reach import LEVELS, REACH, Ladder, reach, scan
from catalogue.guidance.trace import SPLITTING, trace

Scanned = Callable[[bool], Ladder]
Drawn = Callable[..., tuple[CouplerCurve, np.ndarray]]
both_kinds = pytest.mark.parametrize("circle", [False, True], ids=["line", "circle"])


@pytest.mark.slow
@both_kinds
def test_reach_holds_and_grows_with_the_tolerance(drawn: Drawn, scanned: Scanned, circle: bool) -> None:
    guides, order = drawn(circle)
    ladder = scanned(circle)
    before = np.zeros(len(guides))
    for level in sorted(LEVELS):
        half, traced = reach(guides, ladder, 10.0**level, circle=circle)
        there = np.isfinite(half)
        again = trace(guides, half, circle=circle, split=True, centre=ladder.centre, nodes=16)
        assert np.all(again.relative[there] <= 10.0**level * 1.001 + 4e-15)
        np.testing.assert_array_equal(traced.relative[there] <= 10.0**level, True)
        # an exact guide is cut short where it could branch off: how close to that place is chance
        # and where the deviation jumps from rung to rung, two steps leave some of the way
        grown = half / np.where(before > 0, before, np.nan)
        assert not np.any(grown[there] < np.where(order == EXACT, REACH.ratio, 0.75)[there]), "looser, yet shorter"
        assert not (before > 0).any() or np.nanquantile(grown, 0.01) > 0.95
        assert not np.any(~there & (before > 0))
        before = np.where(there, half, 0)
    assert (before > 0).mean() > 0.9


@pytest.mark.slow
@both_kinds
@pytest.mark.parametrize("level", [-3, -5, -7])
def test_a_little_more_does_not_hold(drawn: Drawn, scanned: Scanned, circle: bool, level: int) -> None:
    """Unless the mechanism ends there.  With two secant steps most strokes are within 2 %, nearly all within 10 %."""
    guides, _ = drawn(circle)
    ladder = scanned(circle)
    half, _ = reach(guides, ladder, 10.0**level, circle=circle)
    longest = half * 1.005 >= ladder.half[0]
    held = {}
    for more in (1.02, 1.1):
        longer = trace(guides, half * more, circle=circle, split=True, centre=ladder.centre, nodes=32)
        held[more] = (longer.relative <= 10.0**level) & ~longest
    some = np.isfinite(half) & ~longest
    assert held[1.02].sum() < 0.15 * some.sum()
    assert held[1.1].sum() < 0.03 * some.sum()
    better, _ = reach(guides, ladder, 10.0**level, circle=circle, steps=8)
    longer = trace(guides, better * 1.02, circle=circle, split=True, centre=ladder.centre, nodes=32)
    assert ((longer.relative <= 10.0**level) & some).sum() < 0.03 * some.sum()


@pytest.mark.slow
def test_scan_stays_within_the_usable_extent(drawn: Drawn, scanned: Scanned) -> None:
    guides, order = drawn(circle=False)
    ladder = scanned(False)
    low, high = guides.extent
    assert np.all((1 - ladder.centre) * ladder.half[0] <= REACH.usable * low * (1 + 1e-12))
    assert np.all((1 + ladder.centre) * ladder.half[0] <= REACH.usable * high * (1 + 1e-12))
    assert set(np.unique(ladder.centre)) <= {0.0, SPLITTING.off_centre, -SPLITTING.off_centre}
    assert np.all(ladder.centre[order != 4] == 0)
    assert (ladder.centre[order == 4] != 0).any()
    assert np.all(np.diff(ladder.half, axis=0) < 0)


def test_no_reach_where_no_stroke_holds(drawn: Drawn) -> None:
    guides, order = drawn(circle=False)
    some = guides[(order == 3)]
    ladder = scan(some, circle=False, three=np.zeros(len(some), bool))
    half, traced = reach(some, ladder, 1e-17, circle=False)
    assert np.isnan(half).mean() > 0.9
    assert np.isnan(traced.fit.deviation[np.isnan(half)]).all()
