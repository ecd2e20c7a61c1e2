"""Cognates as answers: they meet the constraints, run along the path of their guide, and let more wishes come true."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from catalogue import Candidate, CircularArc, Found, StraightLine
from tests.find.test_find import check

pytestmark = pytest.mark.slow

Ask = Callable[..., Found]


@pytest.mark.parametrize(
    ("request_", "wish"),
    [
        (StraightLine(150, 0.05), {"families": ["slider-crank"]}),
        (StraightLine(150, 0.05), {"families": ["four-bar"], "min_transmission": 40}),
        (CircularArc(100, 0.05, 100), {"families": ["four-bar"]}),
    ],
    ids=str,
)
def test_cognates_are_what_they_say(ask: Ask, again: Any, request_: Any, wish: dict[str, Any]) -> None:
    found = ask(request_, limit=200, per_series=0, cognates=True, **wish)
    others = [c for c in found if c.cognate]
    assert others
    for c in others[:4]:
        check(c, request_, again, **wish)
    assert {c.cognate for c in others} <= {1, 2}
    assert all(c.cognate is None for c in ask(request_, limit=4, refine=False, **wish))


@pytest.mark.slow
def test_a_cognate_has_the_path_of_its_guide(ask: Ask) -> None:
    found = ask(StraightLine(150, 0.05), families=["four-bar"], limit=2000, per_series=0, cognates=True, refine=False)
    by_id: dict[int | None, list[Candidate]] = {}
    for c in found:
        by_id.setdefault(c.id, []).append(c)
    pairs = [group for group in by_id.values() if len(group) > 1 and any(not c.cognate for c in group)]
    assert pairs
    for group in pairs[:5]:
        for c in group:
            assert c.deviation == pytest.approx(group[0].deviation, rel=1e-3)
