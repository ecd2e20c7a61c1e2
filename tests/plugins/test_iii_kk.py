"""Series III.KK and III*.KK: the contract, the golden cases, and the leading coefficients of the deviation."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
import pytest

from catalogue.curvature_theory.instant import Instant
from catalogue.kinematics.linkage import Linkage
from catalogue.testing import SeriesContract, load

III_KK, III_STAR_KK = load("III.KK"), load("III*.KK")
#: Perpendicular cranks with (47); [3] in the pole; r1 = S/2; [3] is the driving pair.
SPECIAL = [
    {"psi": 0.7, "phi2": np.pi / 4 + 0.35, "phi4": 0.35 - np.pi / 4},
    {"psi": np.arctan(1.5), "phi2": np.arctan(0.4), "phi4": np.arctan(1.1)},
    {"psi": np.arctan(-10.5), "phi2": np.arctan(0.6), "phi4": np.arctan(1.4)},
    {"psi": np.arctan(2.0), "phi2": np.arctan(0.6), "phi4": np.arctan(0.8)},
]  # fmt: skip


class TestIIIKK(SeriesContract):
    """The slide of the inverted slider-crank is its cuspidation; with (47) the cuspidation is [3]."""

    series = III_KK
    special: ClassVar = {"four-bar general": SPECIAL}
    absent: ClassVar = [
        ("inverted-slider-crank general", "cuspidation"),
        ("inverted-slider-crank fifth order", "cuspidation"),
        ("four-bar pseudo-cuspidation", "[3]"),
        ("four-bar double cuspidation", "[3]"),
    ]


@pytest.mark.parametrize(("series", "count"), [(III_KK, 8), (III_STAR_KK, 14)])
def test_golden_members_are_synthesised(golden_members: Callable[[Any], int], series: Any, count: int) -> None:
    assert golden_members(series) == count


@pytest.mark.parametrize(("series", "name"), [(III_KK, "kappa"), (III_STAR_KK, "kappa_star")])
def test_residual_is_the_curvature_of_every_golden_cubic(golden: list[dict[str, Any]], series: Any, name: str) -> None:
    mine = [case for case in golden if case["family"] in series.families and case.get(name) is not None]
    residual, _ = series.classify(Instant(Linkage([case["pivots"] for case in mine])))
    there = np.isfinite(residual)
    expected = np.abs([case[name] for case in mine])
    assert there.sum() > 80
    np.testing.assert_allclose(residual[there], expected[there], rtol=1e-9, atol=1e-11)


@pytest.mark.parametrize(("psi", "phi2", "phi4"), [(0.7, 0.5, 1.1), (1.1, -0.4, 0.9), (0.5, -1.2, -0.2)])
def test_deviations_tend_to_their_laws(
    law: Callable[..., Any], tends_to_one: Callable[[Any], bool], psi: float, phi2: float, phi4: float
) -> None:
    free = {"psi": psi, "phi2": phi2, "phi4": phi4}
    big, t2, t4 = np.tan([psi, phi2, phi4])
    t3 = big - t2 - t4
    cos = 1 / np.hypot(1, t3)
    star = (1 + t3 / big) / (t3 * cos)
    c5 = t3 * cos * (t3 - t2) * (t3 - t4) * (t2 * t3 * t4 - big) * star**5 / (8 * big**3 * t3)
    assert tends_to_one(law(III_KK, "four-bar general", free, "[3]", 5, c5))
    sine = big / np.hypot(1, big)  # the undulation point of the inversion: S and t change their signs together
    c4 = (-big - t2) * (-big - t4) * (-big - (big - t2 - t4)) / (8 * big**3 * sine**3)
    if abs(c4) > 0.01:
        assert tends_to_one(law(III_STAR_KK, "four-bar general", free, "undulation", 4, c4))


@pytest.mark.parametrize(("psi", "phi2"), [(-np.pi / 4, -0.9828), (0.9, 1.2)])
def test_deviation_of_a_pseudo_undulation_tends_to_its_law(
    law: Callable[..., Any], tends_to_one: Callable[[Any], bool], psi: float, phi2: float
) -> None:
    t0, t2 = -np.tan([psi, -phi2])
    t4 = -2 * t0 - t2
    sine = np.abs(t0) / np.hypot(1, t0)
    c5 = (t0 - t2) * (t0 - t4) * (1 + t2 * t4) / (8 * t0**3 * sine**4)
    assert tends_to_one(law(III_STAR_KK, "four-bar pseudo-undulation", {"psi": psi, "phi2": phi2}, "undulation", 5, c5))


@pytest.mark.parametrize("psi", [1.04, 0.75, -0.9])
def test_deviation_of_perpendicular_cranks_tends_to_its_law(
    law: Callable[..., Any], tends_to_one: Callable[[Any], bool], psi: float
) -> None:
    t0 = np.tan(psi)
    c6 = (3 * t0**2 - 1) * (1 + t0**2) * np.hypot(1, t0) ** 5 / (8 * t0**9)
    assert tends_to_one(law(III_STAR_KK, "four-bar double undulation", {"psi": psi}, "undulation", 6, c6))
