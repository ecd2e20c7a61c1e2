"""Series general: the contract, the golden cases, and the leading coefficients of the deviation."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
import pytest

from catalogue.curvature_theory.instant import Instant
from catalogue.kinematics.linkage import Linkage
from catalogue.series.series import Member
from catalogue.testing import SeriesContract, load
from catalogue.testing.base import real
from catalogue.testing.sample import even

GENERAL = load("general")


class TestGeneral(SeriesContract):
    """A slider is the undulation, a slide the cuspidation; with the outer two cranks it is the larger root, [3]."""

    series = GENERAL
    absent: ClassVar = [
        *(
            (f"{family} {member}", label)
            for family, label, named in (
                ("slider-crank", "undulation", "cuspidation"),
                ("inverted-slider-crank", "cuspidation", "undulation"),
            )
            for member in ("general", "fifth order", f"pseudo-{named}", f"double {named}")
        ),
        *(
            (f"swinging-block {member}", label)
            for member in ("general", "fifth order")
            for label in ("undulation", "cuspidation")
        ),
        ("four-bar double undulation, outer cranks", "[3]"),
        ("four-bar double cuspidation, outer cranks", "[3]"),
    ]


def test_golden_members_are_synthesised(golden_members: Callable[[Any], int]) -> None:
    assert golden_members(GENERAL) == 30


def test_every_golden_linkage_is_general_or_within_reach_of_a_degeneration(golden: list[dict[str, Any]]) -> None:
    mine = [case for case in golden if case["family"] in GENERAL.families and case.get("kappa") is not None]
    residual, margin = GENERAL.classify(Instant(Linkage([case["pivots"] for case in mine])))
    degenerate = np.array([min(abs(case[name]) for name in ("kappa", "kappa_star", "s")) for case in mine])
    assert (degenerate > 0).sum() > 20 < (degenerate == 0).sum()
    assert np.all(residual[degenerate > 0] == 0)
    assert np.all(margin[degenerate > 0] > 1e-3)
    assert not (margin[degenerate == 0] > 1e-9).any()


@pytest.mark.parametrize("member", [m for m in GENERAL.members if m.name != "general"], ids=lambda m: m.key)
def test_members_of_higher_order_have_what_they_are_named_after(member: Member) -> None:
    sample = even(GENERAL, member, size=24).valid
    what, _, named = member.name.partition(",")[0].replace("pseudo-", "pseudo ").partition(" ")
    best = np.zeros(len(sample.linkage))
    for guided in sample.guided:
        if what == "fifth":  # whose pairs may be imaginary
            best = np.fmax(best, guided.order)
        elif guided.label == named:
            best = np.where(real(guided), guided.order, 0)
    assert (best >= {"pseudo": 4, "fifth": 5, "double": 5}[what]).all()


@pytest.mark.parametrize(
    ("kappa", "psi", "phi1", "phi2"), [(0.7, 1.0, 0.6, 1.2), (-0.4, 0.8, 1.1, -0.9), (0.5, 1.2, -0.5, 0.8)]
)
def test_deviations_tend_to_their_laws(
    law: Callable[..., Any], tends_to_one: Callable[[Any], bool], kappa: float, psi: float, phi1: float, phi2: float
) -> None:
    big, t1, t2 = np.tan([psi, phi1, phi2])
    a, b = kappa * big, (kappa + 1) * big
    t3, t4 = sorted(np.roots([1, t1 + t2 - a - b, a * b / (t1 * t2)]), key=abs, reverse=True)
    free = {"kappa": kappa, "psi": psi, "phi1": phi1, "phi2": phi2}
    sine = a / np.hypot(1, a)
    c4 = (a + t1) * (a + t2) * (a + t3) * (a + t4) / (8 * big**2 * a**2 * sine**3)
    assert tends_to_one(law(GENERAL, "four-bar general", free, "undulation", 4, c4.real))
    if np.isreal(t3):
        sine = t3 / np.hypot(1, t3)
        star = (kappa + 1 + t3 / big) / sine
        e3 = t1 * t2 * (t3 + t4) + t3 * t4 * (t1 + t2)
        c5 = sine * (t3 - t1) * (t3 - t2) * (e3 - a - b) * star**5 / (8 * big**3 * t3)
        assert tends_to_one(law(GENERAL, "four-bar general", free, "[3]", 5, c5))


#: Golden coefficients of the guides with four inflections.
FOUR_INFLECTIONS = [
    ("four-bar double undulation, lower cranks", {"kappa": 0.5, "psi": np.arctan(1.4)}, 11.131141775735806),
    ("four-bar double undulation, upper cranks", {"kappa": 1.3 / 1.7, "psi": np.arctan(1.7)}, 18.35),
    ("inverted-slider-crank double undulation", {"alpha": np.arctan(-1.4)}, 39.444220464226426),
]


@pytest.mark.parametrize(("key", "free", "c6"), FOUR_INFLECTIONS)
def test_deviation_of_four_inflections_tends_to_its_law(
    law: Callable[..., Any], tends_to_one: Callable[[Any], bool], key: str, free: dict[str, float], c6: float
) -> None:
    assert tends_to_one(law(GENERAL, key, free, "undulation", 6, c6))
