"""Series II.xoy and II*.xoy: the contract and the golden cases."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import pytest

from catalogue.testing import SeriesContract, load

II_XOY, II_STAR_XOY = load("II.xoy"), load("II*.xoy")


class TestIIxoy(SeriesContract):
    """Members lack what is a driving pair of theirs, or falls into a pole."""

    series = II_XOY
    absent: ClassVar = [("slider-crank double cuspidation", "[4]"), ("swinging-block general", "cuspidation")]


@pytest.mark.parametrize("series", [II_XOY, II_STAR_XOY])
def test_golden_members_are_synthesised(golden_members: Callable[[Any], int], series: Any) -> None:
    assert golden_members(series) >= 5
