"""What should not matter to a search does not: the same answers, up to the transformation of the request."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from catalogue import CircularArc, Found, StraightLine
from catalogue.problem.request import Request

LINE, ARC = StraightLine(150, 0.05), CircularArc(100, 0.05, 80)
#: Bounds that several answers reach, so that penalties decide.
BOUNDED = {"min_transmission": 40, "pins_only": True, "limit": 6}


def same(one: Found, other: Found) -> None:
    """Assert that two lists hold the same designs in the same order, to the last digit."""
    assert len(one) > 0
    assert [c.pivots for c in one] == [c.pivots for c in other]
    assert [c.guided for c in one] == [c.guided for c in other]


@pytest.mark.parametrize("request_", [LINE, ARC], ids=["line", "arc"])
@pytest.mark.parametrize("plain", ["size=1", "size=1,transmission=0.5", "transmission=1"])
def test_scale_of_weights_changes_no_answer(ask: Callable[..., Found], request_: Request, plain: str) -> None:
    def scaled(by: float) -> dict[str, float]:
        return {name: by * float(weight) for name, weight in (part.split("=") for part in plain.split(","))}

    expected = ask(request_, rank_by=plain, **BOUNDED)
    for by in (1e-3, 7.0, 1e3):
        same(expected, ask(request_, rank_by=scaled(by), **BOUNDED))
