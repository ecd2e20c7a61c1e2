"""Series III.Kx and III*.Kx: the contract, the golden cases, and the leading coefficients of the deviation."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
import pytest

from catalogue.curvature_theory.instant import Instant
from catalogue.kinematics.linkage import Linkage
from catalogue.testing import SeriesContract, load

III_KX, III_STAR_KX = load("III.Kx"), load("III*.Kx")
#: Eq. (49); r1 = S/2; both; r1 = S, where [4] falls into the pole.
SPECIAL = [
    {"psi": np.arctan(0.8), "phi3": np.arctan(0.5), "a1": (1 + 0.25 - 0.8) / 0.8},
    {"psi": 0.5, "phi3": -1.0, "a1": 2 / np.tan(0.5)},
    {"psi": 0.5, "phi3": np.pi / 4 + 0.25, "a1": 2 / np.tan(0.5)},
    {"psi": np.pi / 4, "phi3": 0.3, "a1": 1.0},
]


class TestIIIKx(SeriesContract):
    """A slide is the cuspidation; of coincident pairs one is given."""

    series = III_KX
    special: ClassVar = {"four-bar general": SPECIAL}
    absent: ClassVar = [
        ("inverted-slider-crank general", "cuspidation"),
        ("swinging-block general", "cuspidation"),
        ("inverted-slider-crank fifth order", "cuspidation"),
        ("four-bar coincident pairs", "[4]"),
    ]


@pytest.mark.parametrize(("series", "count"), [(III_KX, 8), (III_STAR_KX, 10)])
def test_golden_members_are_synthesised(golden_members: Callable[[Any], int], series: Any, count: int) -> None:
    assert golden_members(series) == count


@pytest.mark.parametrize(("series", "mode"), [(III_KX, "III_Kx"), (III_STAR_KX, "III*_Kx")])
def test_mechanisms_of_other_series_are_no_members(golden: list[dict[str, Any]], series: Any, mode: str) -> None:
    others = [case for case in golden if case["series"] != mode and case["family"] in series.families]
    residual, margin = series.classify(Instant(Linkage([case["pivots"] for case in others])))
    assert len(others) > 100
    with np.errstate(invalid="ignore"):
        assert not ((residual < 1e-6) & (margin > 1e-6)).any()


@pytest.mark.parametrize(("psi", "phi3", "a1"), [(1.1, 0.5, 0.4), (0.9, -0.7, 0.7), (1.2, 1.0, -0.5)])
def test_deviations_tend_to_their_laws(
    law: Callable[..., Any], tends_to_one: Callable[[Any], bool], psi: float, phi3: float, a1: float
) -> None:
    free = {"psi": psi, "phi3": phi3, "a1": a1}
    big, t3 = np.tan([psi, phi3])
    t2, t4 = sorted(np.roots([1, t3 - big, big * (big * a1 - 1) / t3]), key=abs, reverse=True)
    cos = 1 / np.hypot(1, t2)
    star = (1 + t2 / big) / (t2 * cos)
    c5 = t2 * cos * t2 * (t2 - t3) * (t2 * t3 * t4 - big) * star**5 / (8 * big**3 * t2)
    assert tends_to_one(law(III_KX, "four-bar general", free, "[2]", 5, c5))
    sine = big / np.hypot(1, big)  # the undulation point of the inversion: S and t change their signs together
    c4 = (big + t2) * (big + t3) * (big + t4) / (8 * big**3 * sine**3)
    assert tends_to_one(law(III_STAR_KX, "four-bar general", free, "undulation", 4, c4))


@pytest.mark.parametrize(("psi", "phi3"), [(-0.6319, -1.0472), (-0.8327, 0.6)])
def test_deviation_of_a_pseudo_undulation_tends_to_its_law(
    law: Callable[..., Any], tends_to_one: Callable[[Any], bool], psi: float, phi3: float
) -> None:
    t0, t3 = np.tan([-psi, phi3])
    c5 = (t0 - t3) * (1 - t3 * (2 * t0 + t3)) * np.hypot(1, t0) ** 4 / (8 * t0**6)
    assert tends_to_one(law(III_STAR_KX, "four-bar pseudo-undulation", {"psi": psi, "phi3": phi3}, "undulation", 5, c5))
