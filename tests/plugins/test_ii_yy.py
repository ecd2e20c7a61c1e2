"""Series II.yy and II*.yy: the contract and the golden cases."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import pytest

from catalogue.testing import SeriesContract, load

II_YY, II_STAR_YY = load("II.yy"), load("II*.yy")


class TestIIyy(SeriesContract):
    """Members lack what is a driving pair of theirs, or falls into a pole."""

    series = II_YY
    absent: ClassVar = [("inverted-slider-crank general", "cuspidation")]


class TestIIStaryy(SeriesContract):
    """Members lack what is a driving pair of theirs, or falls into a pole."""

    series = II_STAR_YY
    absent: ClassVar = [("slider-crank general", "undulation")]


@pytest.mark.parametrize("series", [II_YY, II_STAR_YY])
def test_golden_members_are_synthesised(golden_members: Callable[[Any], int], series: Any) -> None:
    assert golden_members(series) >= 3
