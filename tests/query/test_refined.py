"""Refined candidates are straighter, satisfy all that was asked, and are what they say, measured another way."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from catalogue import Candidate, Catalogue, CircularArc, StraightLine
from tests.query.test_find import check

Again = Callable[[Candidate], Any]
LINE, ARC = StraightLine(150, 0.05), CircularArc(100, 100, 0.05)
WISHES: list[dict[str, Any]] = [
    {"families": ["four-bar"], "min_transmission": 45.0},
    {"families": ["slider-crank"]},
    {"series": ["II.xy", "IV*.l"], "max_size": 700.0},
    {"pins_only": True, "rank_by": "deviation", "max_link": 400.0, "max_ground": 300.0},
    {"full_rotation": True, "families": ["four-bar"]},
]


@pytest.mark.parametrize("request_", [LINE, ARC], ids=["line", "arc"])
@pytest.mark.parametrize("wish", WISHES, ids=str)
def test_refined_guides_are_what_they_say(
    small: Catalogue, again: Again, wish: dict[str, Any], request_: StraightLine | CircularArc
) -> None:
    found = small.find(request_, limit=4, refine=True, **wish)
    for c in found:
        assert c.unrefined is not None
        assert c.deviation <= c.unrefined * (1 + 1e-6)
        bounds = {k: v for k, v in wish.items() if k != "rank_by"}
        check(c, request_, again, **bounds)
    assert found or request_ is ARC


def test_refinement_gains_much(small: Catalogue) -> None:
    wish: dict[str, Any] = {
        "families": ["four-bar"], "rank_by": "deviation", "max_link": 400.0, "max_ground": 300.0, "max_arm": 300.0,
    }  # fmt: skip
    plain = small.find(LINE, limit=10, **wish)
    fine = small.find(LINE, limit=10, refine=True, **wish)
    assert all(c.unrefined is None for c in plain)
    assert fine[0].deviation < 0.5 * plain[0].deviation
    assert np.median([c.deviation / (c.unrefined or 1) for c in fine]) < 0.5
    assert [c.deviation for c in fine] == sorted(c.deviation for c in fine)
    assert "refine" in fine.explain()


def test_pivots_stay_in_their_box(small: Catalogue) -> None:
    box = (-300.0, -300.0, 300.0, 300.0)
    found = small.find(LINE, fixed_pivots_in=box, rank_by="deviation", families=["four-bar"], refine=True, limit=8)
    assert found
    for c in found:
        for (x, y, _), _ in c.pivots:
            assert box[0] <= x <= box[2]
            assert box[1] <= y <= box[3]


def test_the_price_hardly_rises(small: Catalogue) -> None:
    """Ranked by size, a guide may become a twentieth of a stroke larger for the sake of straightness."""
    for c in small.find(LINE, families=["four-bar"], rank_by="size", refine=True, limit=8):
        stored = small.find(LINE, families=["four-bar"], rank_by="size", limit=20, per_series=0)
        (before,) = [s.size for s in stored if s.id == c.id] or [np.inf]
        assert c.size <= before + 0.051 * 150


def test_the_unit_does_not_matter(small: Catalogue) -> None:
    """The same request in another unit has the same answer."""
    one = small.find(StraightLine(1, 1e-3), families=["four-bar"], rank_by="deviation", max_size=3.0, refine=True)
    big = small.find(StraightLine(1e4, 10), families=["four-bar"], rank_by="deviation", max_size=3e4, refine=True)
    assert big[0].deviation / 1e4 == pytest.approx(one[0].deviation, rel=0.05)
