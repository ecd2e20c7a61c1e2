"""Cognates as answers: they meet the constraints, run along the path of their guide, and let more wishes come true."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from catalogue import Candidate, Catalogue, CircularArc, StraightLine
from tests.query.test_find import check

Again = Callable[[Candidate], Any]


@pytest.mark.parametrize("request_", [StraightLine(150, 0.05), CircularArc(100, 100, 0.05)], ids=["line", "arc"])
@pytest.mark.parametrize("wish", [{"families": ["four-bar"]}, {"families": ["slider-crank"]}, {"min_transmission": 40}])
def test_cognates_are_what_they_say(small: Catalogue, again: Again, request_: Any, wish: dict[str, Any]) -> None:
    found = small.find(request_, limit=40, per_series=0, cognates=True, **wish)
    others = [c for c in found if c.cognate]
    assert others
    for c in others[:6]:
        assert c.family in ("four-bar", "slider-crank")
        check(c, request_, again, **wish)
    assert {c.cognate for c in others} <= {1, 2}
    assert all(c.cognate is None for c in small.find(request_, limit=5, **wish))


def test_a_cognate_has_the_path_of_its_guide(small: Catalogue) -> None:
    found = small.find(StraightLine(150, 0.05), families=["four-bar"], limit=2000, per_series=0, cognates=True,
                       refine=False)  # fmt: skip
    by_id: dict[int, list[Candidate]] = {}
    for c in found:
        by_id.setdefault(c.id, []).append(c)
    pairs = [group for group in by_id.values() if len(group) > 1 and any(not c.cognate for c in group)]
    assert pairs
    for group in pairs[:5]:
        for c in group:
            assert c.deviation == pytest.approx(group[0].deviation, rel=1e-3)


def test_cognates_serve_where_the_guides_do_not(small: Catalogue) -> None:
    """Pivots to one side of the path: there are no fewer answers with cognates than without."""
    box = (-60.0, 30.0, 210.0, 250.0)
    wish: dict[str, Any] = {"families": ["four-bar"], "fixed_pivots_in": box, "limit": 300, "per_series": 0}
    plain = small.find(StraightLine(150, 0.05), **wish)
    more = small.find(StraightLine(150, 0.05), cognates=True, **wish)
    assert len(more) > len(plain)
    for c in more:
        for (x, y, _), _ in c.pivots:
            assert box[0] <= x <= box[2]
            assert box[1] <= y <= box[3]


def test_cognates_are_refined_too(small: Catalogue) -> None:
    found = small.find(
        StraightLine(150, 0.05), families=["four-bar"], cognates=True, refine=True, limit=20, per_series=0
    )
    assert any(c.cognate for c in found)
    assert np.all([c.deviation <= (c.unrefined or 0) * (1 + 1e-6) for c in found])
