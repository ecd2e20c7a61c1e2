"""Series II.y0 and II*.y0: the contract and the golden cases."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import pytest

from catalogue.testing import SeriesContract, load

II_Y0, II_STAR_Y0 = load("II.y0"), load("II*.y0")


class TestIIy0(SeriesContract):
    """Members lack what is a driving pair of theirs, or falls into a pole."""

    series = II_Y0
    absent: ClassVar = [("slider-crank pseudo-cuspidation", "[4]"), ("swinging-block general", "cuspidation")]


class TestIIStary0(SeriesContract):
    """Members lack what is a driving pair of theirs, or falls into a pole."""

    series = II_STAR_Y0
    absent: ClassVar = [("inverted-slider-crank pseudo-undulation", "[4]"), ("swinging-block general", "undulation")]


@pytest.mark.parametrize("series", [II_Y0, II_STAR_Y0])
def test_golden_members_are_synthesised(golden_members: Callable[[Any], int], series: Any) -> None:
    assert golden_members(series) >= 7
