"""Series IV.x and IV*.x: the contract, the golden cases, and the leading coefficients of the deviation."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
import pytest

from catalogue.curvature_theory.instant import Instant
from catalogue.kinematics.linkage import Linkage
from catalogue.testing import SeriesContract, load

IV_X, IV_STAR_X = load("IV.x"), load("IV*.x")
#: [2] is the driving crank; [1] and [2] coincide.
SPECIAL = [{"k": 0.8, "x4": 2.5}, {"k": 0.5, "x4": -0.5}]


class TestIVx(SeriesContract):
    """With k x4 = 2 the smaller root is the height of the crank, with k x4 = -1/4 the roots coincide."""

    series = IV_X
    special: ClassVar = {"inverted-slider-crank general": SPECIAL}
    absent: ClassVar = [("inverted-slider-crank coincident pairs", "[2]")]


@pytest.mark.parametrize(("series", "count"), [(IV_X, 4), (IV_STAR_X, 5)])
def test_golden_members_are_synthesised(golden_members: Callable[[Any], int], series: Any, count: int) -> None:
    assert golden_members(series) == count


@pytest.mark.parametrize("series", [IV_X, IV_STAR_X])
def test_mechanisms_of_other_series_are_no_members(golden: list[dict[str, Any]], series: Any) -> None:
    others = [case["pivots"] for case in golden if not case["series"].startswith("IV")]
    residual, margin = series.classify(Instant(Linkage(others)))
    with np.errstate(invalid="ignore"):
        assert not ((residual < 1e-6) & (margin > 1e-6)).any()


@pytest.mark.parametrize(("k", "x4"), [(1.2, 0.7), (0.6, 1.5), (1.5, -0.1), (1.0, 3.0)])
def test_deviations_tend_to_their_laws(
    law: Callable[..., Any], tends_to_one: Callable[[Any], bool], k: float, x4: float
) -> None:
    (slide, crank), free = (IV_X.families[0], IV_STAR_X.families[0]), {"k": k, "x4": x4}
    y = -0.5 * (1 + np.sqrt(1 + 4 * k * x4))
    assert tends_to_one(law(IV_X, f"{slide} general", free, "[1]", 5, y * (y - 1) / (8 * k**3)))
    assert tends_to_one(law(IV_STAR_X, f"{crank} general", free, "undulation", 4, x4 / (8 * k**2)))
