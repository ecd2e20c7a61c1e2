"""Series II.ooo: the contract and the golden cases; its guides are exact, which the contract measures."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

from catalogue.testing import SeriesContract, load

II_OOO = load("II.ooo")


class TestIIooo(SeriesContract):
    """The crank of the isosceles slider-crank is the pair of the centre."""

    series = II_OOO
    absent: ClassVar = [("slider-crank isosceles", "centre")]


def test_golden_members_are_synthesised(golden_members: Callable[[Any], int]) -> None:
    assert golden_members(II_OOO) == 5


def test_residual_is_that_of_the_theory_on_every_golden_slider_crank(golden_residuals: Callable[[Any], int]) -> None:
    assert golden_residuals(II_OOO) > 20
