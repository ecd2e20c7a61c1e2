"""Series parallel: the contract, the golden cases, and the leading coefficients of the deviation."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
import pytest

from catalogue.curvature_theory.instant import Instant
from catalogue.kinematics.linkage import Linkage
from catalogue.testing import SeriesContract, load

PARALLEL = load("parallel")


class TestParallel(SeriesContract):
    """Including k* = -k, coincident pairs, and [4] that is a driving pair."""

    series = PARALLEL
    special: ClassVar = {
        "four-bar general": [
            {"k": 0.7, "k_star": -0.7, "y2": 0.6},
            {"k": 0.5, "k_star": 1.5 * 2.5**2 / 2, "y2": 1.5},
            {"k": 0.8, "k_star": -0.5 * 2.5 / 0.8, "y2": 0.5},
        ]
    }
    absent: ClassVar = [("four-bar coincident pairs", "[4]")]


def test_golden_members_are_synthesised(golden_members: Callable[[Any], int]) -> None:
    assert golden_members(PARALLEL) == 5


def test_mechanisms_of_other_series_are_no_members(golden: list[dict[str, Any]]) -> None:
    others = [case["pivots"] for case in golden if case["series"] != "P_parallel" and case["family"] == "four-bar"]
    residual, margin = PARALLEL.classify(Instant(Linkage(others)))
    with np.errstate(invalid="ignore"):
        assert not ((residual < 1e-6) & (margin > 1e-6)).any()


@pytest.mark.parametrize(("k", "k_star", "y2"), [(1.0, -0.4, 0.6), (0.8, 2.5, -0.4), (2.0, 0.3, 2.0)])
def test_deviations_tend_to_their_laws(
    law: Callable[..., Any], tends_to_one: Callable[[Any], bool], k: float, k_star: float, y2: float
) -> None:
    y3 = max(np.roots([1, 1 + y2, k * k_star / y2]), key=abs)
    c5 = (k + k_star) * (y3 - 1) * (y3 - y2) / (8 * (k_star - k) ** 4)
    free = {"k": k, "k_star": k_star, "y2": y2}
    assert tends_to_one(law(PARALLEL, "four-bar general", free, "[3]", 5, c5))
