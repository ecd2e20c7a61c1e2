"""Series II.x0 and II*.x0: the contract and the golden cases."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import pytest

from catalogue.testing import SeriesContract, load

II_X0, II_STAR_X0 = load("II.x0"), load("II*.x0")


class TestIIx0(SeriesContract):
    """Members lack what is a driving pair of theirs, or falls into a pole."""

    series = II_X0
    absent: ClassVar = [("slider-crank pseudo-cuspidation", "[4]"), ("slider-crank coincident pairs", "[4]")]


@pytest.mark.parametrize("series", [II_X0, II_STAR_X0])
def test_golden_members_are_synthesised(golden_members: Callable[[Any], int], series: Any) -> None:
    assert golden_members(series) >= 10
