"""Series I.yy: the contract and the golden cases."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import pytest

from catalogue.testing import SeriesContract, load

I_YY = load("I.yy")


class TestIyy(SeriesContract):
    """Members lack what is a driving pair of theirs, or falls into a pole."""

    series = I_YY
    absent: ClassVar = [
        ("slider-crank general", "undulation"),
        ("inverted-slider-crank general", "cuspidation"),
        ("swinging-block general", "[1]"),
        ("swinging-block general", "[2]"),
        ("swinging-block general", "undulation"),
        ("swinging-block general", "cuspidation"),
    ]


@pytest.mark.parametrize("series", [I_YY])
def test_golden_members_are_synthesised(golden_members: Callable[[Any], int], series: Any) -> None:
    assert golden_members(series) >= 7
