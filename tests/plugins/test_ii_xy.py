"""Series II.xy and II*.xy: the contract, the golden cases, and the leading coefficients of the deviation."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
import pytest

from catalogue.testing import SeriesContract, load

II_XY, II_STAR_XY = load("II.xy"), load("II*.xy")
#: [4] is the driving pair; [2] and [4] are the undulation; [4] is the cuspidation.
SPECIAL = [{"a1": 0.6, "q3": q3} for q3 in (0.5, 1.0, 2.0)]


class TestIIxy(SeriesContract):
    """The slide of the inverted slider-crank is its cuspidation."""

    series = II_XY
    special: ClassVar = {"four-bar general": SPECIAL}
    absent: ClassVar = [("inverted-slider-crank general", "cuspidation")]


class TestIIStarxy(SeriesContract):
    """The slider of the slider-crank is its undulation."""

    series = II_STAR_XY
    special: ClassVar = {"four-bar general": SPECIAL}
    absent: ClassVar = [("slider-crank general", "undulation")]


@pytest.mark.parametrize("series", [II_XY, II_STAR_XY])
def test_golden_members_are_synthesised(golden_members: Callable[[Any], int], series: Any) -> None:
    assert golden_members(series) >= 11


@pytest.mark.parametrize("series", [II_XY, II_STAR_XY])
def test_residual_is_that_of_the_theory_on_every_golden_mechanism(
    golden_residuals: Callable[[Any], int], series: Any
) -> None:
    assert golden_residuals(series) > 50


@pytest.mark.parametrize(("a1", "q3"), [(1.5, 1.5), (1.8, -0.5), (3.0, 2.5), (3.0, 0.3)])
def test_deviations_tend_to_their_laws(
    law: Callable[..., Any], tends_to_one: Callable[[Any], bool], a1: float, q3: float
) -> None:
    free, q4 = {"a1": a1, "q3": q3}, 1 - q3
    sine = a1 / np.hypot(q3 * q4, a1)
    coefficients = {
        "[2]": (5, a1 * q3 / (8 * sine**4)),
        "[4]": (5, a1 * (q4 - q3) * (q4 + 1) ** 5 / 8),
        "undulation": (4, q3 * q4 / 8),
    }
    for label, (m, c) in coefficients.items():
        assert tends_to_one(law(II_XY, "four-bar general", free, label, m, c)), label
    inverse = law(II_STAR_XY, "four-bar general", free, "undulation", 4, (q3 + 1) * (q3 - 2) / 8)
    assert tends_to_one(inverse)


def test_favourite_evans_guide_and_its_inversion_tend_to_their_laws(
    law: Callable[..., Any], tends_to_one: Callable[[Any], bool]
) -> None:
    assert tends_to_one(law(II_XY, "four-bar general", {"a1": 1 / 0.9, "q3": 1.0}, "undulation", 5, 0.1388888888888889))
    assert tends_to_one(law(II_STAR_XY, "four-bar general", {"a1": 1 / 0.6, "q3": 2.0}, "undulation", 5, 0.625))
