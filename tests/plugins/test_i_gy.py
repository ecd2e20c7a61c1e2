"""Series I.Gy: the contract and the golden cases."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import pytest

from catalogue.testing import SeriesContract, load

I_GY = load("I.Gy")


class TestIGy(SeriesContract):
    """Members lack what is a driving pair of theirs, or falls into a pole."""

    series = I_GY
    absent: ClassVar = [
        ("four-bar pseudo-undulation", "[4]"),
        ("four-bar pseudo-cuspidation", "[4]"),
        ("slider-crank general", "undulation"),
        ("slider-crank pseudo-cuspidation", "undulation"),
        ("slider-crank pseudo-cuspidation", "[4]"),
        ("inverted-slider-crank general", "cuspidation"),
        ("inverted-slider-crank pseudo-undulation", "[4]"),
        ("inverted-slider-crank pseudo-undulation", "cuspidation"),
    ]


@pytest.mark.parametrize("series", [I_GY])
def test_golden_members_are_synthesised(golden_members: Callable[[Any], int], series: Any) -> None:
    assert golden_members(series) >= 15
