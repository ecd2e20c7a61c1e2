"""Series I.GG: the contract, the golden cases, and the leading coefficients of the deviation."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
import pytest

from catalogue.testing import SeriesContract, load

I_GG = load("I.GG")


def conditioned(kappa: float, phi1: float, ratio: float) -> dict[str, float]:
    """Return parameters with cot(phi2) = -(1 + 2 ratio) tan(phi1): eq. (29), and (29)* with the inverse ratio."""
    return {"kappa": kappa, "phi1": phi1, "phi2": float(np.arctan2(1, -(1 + 2 * ratio) * np.tan(phi1)))}


class TestIGG(SeriesContract):
    """Including parameters at which orders rise."""

    series = I_GG
    special: ClassVar = {
        "four-bar general": [
            {"kappa": 0.7, "phi1": 0.6, "phi2": np.pi - 0.6},  # symmetric
            conditioned(0.6, 0.8, 0.6 / 1.6),  # pseudo-undulation
            conditioned(0.6, 0.8, 1.6 / 0.6),  # pseudo-cuspidation
            conditioned(-2.2, 1.0, 1.2 / 2.2),  # the same of diverging cranks
            {"kappa": -0.5, "phi1": 0.4, "phi2": np.pi / 2 - 0.4},  # both together
        ],
        "four-bar symmetric": [{"kappa": 0.5, "phi1": np.arctan(7**-0.5)}],  # double cuspidation (30)*
    }


def test_golden_members_are_synthesised(golden_members: Callable[[Any], int]) -> None:
    assert golden_members(I_GG) > 20


def test_residual_is_that_of_the_theory_on_every_golden_four_bar(golden_residuals: Callable[[Any], int]) -> None:
    assert golden_residuals(I_GG) > 50


def roots(kappa: float, cot1: float, cot2: float) -> Any:
    """Return q3, q4 of eq. (26)."""
    return np.roots([1, -(4 * kappa + 1), 2 * kappa**2 + kappa * (kappa + 1) * (1 + cot1 * cot2)])


@pytest.mark.parametrize(("kappa", "phi1", "phi2"), [(0.3, 0.7, 2.0), (2 / 3, 0.9, 2.5), (-0.4, 0.6, 1.0)])
def test_deviation_of_balls_point_and_of_a_pair_tend_to_their_laws(
    law: Callable[..., Any], tends_to_one: Callable[[Any], bool], kappa: float, phi1: float, phi2: float
) -> None:
    free = {"kappa": kappa, "phi1": phi1, "phi2": phi2}
    cot1, cot2 = 1 / np.tan(phi1), 1 / np.tan(phi2)
    q3, q4 = roots(kappa, cot1, cot2)
    assert tends_to_one(law(I_GG, "four-bar general", free, "undulation", 4, q3 * q4 / 8))
    large = q3 if abs(q3 - kappa) > abs(q4 - kappa) else q4
    c5 = kappa * (kappa + 1) * (cot1 + cot2) * (large - kappa) * (large + 1) ** 5 / 8
    assert tends_to_one(law(I_GG, "four-bar general", free, "[3]", 5, c5))


@pytest.mark.parametrize(("kappa", "phi1"), [(1.0, 0.9), (-2.2, 1.0)])
def test_deviation_of_a_pseudo_undulation_tends_to_its_law(
    law: Callable[..., Any], tends_to_one: Callable[[Any], bool], kappa: float, phi1: float
) -> None:
    cot2 = -(1 + 2 * kappa / (kappa + 1)) * np.tan(phi1)
    c5 = kappa**2 * (kappa + 1) * (1 / np.tan(phi1) + cot2) / 8
    free = {"kappa": kappa, "phi1": phi1}
    assert tends_to_one(law(I_GG, "four-bar pseudo-undulation", free, "undulation", 5, c5))


@pytest.mark.parametrize("kappa", [2.0, 1.0, 0.5])
def test_deviation_of_roberts_guide_tends_to_its_law(
    law: Callable[..., Any], tends_to_one: Callable[[Any], bool], kappa: float
) -> None:
    c6 = kappa**2 * (2 * kappa + 1) ** 2 / 8
    assert tends_to_one(law(I_GG, "four-bar double undulation", {"kappa": kappa}, "undulation", 6, c6))
