"""Series IV.l and IV*.l: the contract, the golden cases, and the leading coefficients of the deviation."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import pytest

from catalogue.curvature_theory.instant import Instant
from catalogue.kinematics.linkage import Linkage
from catalogue.testing import SeriesContract, load

IV_L, IV_STAR_L = load("IV.l"), load("IV*.l")
SPECIAL = [{"y2": y2, "k": 0.7} for y2 in (-2.0, -1.0, -0.5)]


class TestIVl(SeriesContract):
    """With equal cranks, y2 = -1, [3] and [4] coincide in the origin, and so does the cuspidation."""

    series = IV_L
    special: ClassVar = {"four-bar general": SPECIAL}
    absent: ClassVar = [("four-bar equal cranks", "[3]"), ("four-bar equal cranks", "cuspidation")]


@pytest.mark.parametrize("series", [IV_L, IV_STAR_L])
def test_golden_members_are_synthesised(golden_members: Callable[[Any], int], series: Any) -> None:
    assert golden_members(series) == 4


@pytest.mark.parametrize("series", [IV_L, IV_STAR_L])
def test_mechanisms_of_other_series_are_no_members(cases: list[dict[str, Any]], series: Any) -> None:
    others = [case["pivots"] for case in cases if not case["id"].startswith("IV")]
    residual, _ = series.classify(Instant(Linkage(others)))
    assert not (residual < 1e-3).any()


@pytest.mark.parametrize(("y2", "k"), [(0.5, 1.2), (-0.7, 0.8), (-2.5, -1.5), (2.0, 3.0)])
def test_deviations_tend_to_their_laws(
    law: Callable[..., Any], tends_to_one: Callable[[Any], bool], y2: float, k: float
) -> None:
    free, y3 = {"y2": y2, "k": k}, -(1 + y2)
    circle = (y3 - 1) * (y3 - y2) / (8 * k**3)
    straight = y2 / (8 * k**3)
    assert tends_to_one(law(IV_L, "four-bar general", free, "[3]", 5, circle))
    assert tends_to_one(law(IV_L, "four-bar general", free, "[4]", 5, straight))
    assert tends_to_one(law(IV_STAR_L, "four-bar general", free, "[4]", 5, straight))
    assert tends_to_one(law(IV_STAR_L, "four-bar general", free, "undulation", 4, y2 * y3 / (8 * k**3)))


@pytest.mark.parametrize("half_separation", [0.6, 1.1])
def test_deviation_of_watts_guide_tends_to_its_law(
    law: Callable[..., Any], tends_to_one: Callable[[Any], bool], half_separation: float
) -> None:
    k = 1 / half_separation  # cranks of length m = 1 at the heights +-b: k = m b, in units of b
    c5 = 1 / (8 * k**3)
    assert tends_to_one(law(IV_STAR_L, "four-bar equal cranks", {"k": k}, "[4]", 5, c5))
