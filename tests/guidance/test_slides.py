"""Rails and slots against linkages that are closed position by position in another way."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from catalogue.guidance.coupler_curve import coupler_curve
from catalogue.guidance.dwell import slides_over_turn
from catalogue.guidance.metrics import measure
from catalogue.guidance.placement import placed
from catalogue.guidance.slides import extremes, rails, slots, travels
from catalogue.guidance.trace import trace
from catalogue.kinematics.linkage import FAMILIES, RR, Linkage

#: Families with a slide.
SLIDING = [family for family, kinds in FAMILIES.items() if kinds != (RR, RR)]
STROKE = 1.0


@pytest.mark.slow
@pytest.mark.parametrize("circle", [False, True], ids=["line", "arc"])
@pytest.mark.parametrize("family", SLIDING)
def test_travel_and_rails_are_those_of_the_closed_loop(
    random_linkages: Callable[..., Linkage], naive: SimpleNamespace, family: str, circle: bool
) -> None:
    draw = np.random.default_rng(5)
    guides = coupler_curve(random_linkages(family, 60, 8), draw.normal(size=60) + 1j * draw.normal(size=60))
    guides = guides[guides.extent.min(0) > 0.1]
    found = trace(guides, 0.3 * guides.extent.min(0), circle=circle, split=False)
    linkage, point, laid = placed(guides, found, STROKE)
    here = coupler_curve(linkage, point, chart=guides.motion.chart)
    m = measure(here, laid, in_middle=True)
    compared = 0
    for n in range(len(here)):
        # an arc that bends away from its chord may turn back along it: no stretch that the slow way follows
        slides = naive.Loop(linkage.pivots[n], complex(point[n])).slides(STROKE, 4001) if m.size[n] < 30 else None
        if slides is None:
            continue
        close = 2e-5 * m.size[n]
        assert m.travel[n] == pytest.approx(max(abs(a - b) for _, a, b in slides), abs=close)
        mine = [pair for pair in m.slides[n] if np.isfinite(pair).all()]
        for _, *ends in slides:
            off = [min(max(abs(a - p), abs(b - q)) for p, q in (ends, ends[::-1])) for a, b in mine]
            assert min(off) < close
        compared += 1
    assert compared >= 10


def test_cranks_have_neither_rails_nor_slots_nor_travel(random_linkages: Callable[..., Linkage]) -> None:
    linkage = random_linkages("four-bar", 20, 3)
    guides = coupler_curve(linkage, np.full(20, 0.3 + 0.2j))
    m = measure(guides, trace(guides, 0.2 * guides.extent.min(0), circle=False, split=False))
    assert np.isnan(m.travel).all()
    assert np.isnan(m.slides).all()


@pytest.mark.parametrize("family", SLIDING)
def test_an_inversion_turns_rails_into_slots_of_the_same_travel(
    random_linkages: Callable[..., Linkage], family: str
) -> None:
    linkage = random_linkages(family, 40, 4)
    guides = coupler_curve(linkage, np.full(40, 0.3 + 0.2j))
    found = trace(guides, 0.2 * guides.extent.min(0), circle=False, split=False)
    ends = measure(guides, found).slides
    turned = linkage.inverted()
    np.testing.assert_array_equal(rails(linkage, ends), slots(turned, ends))
    np.testing.assert_array_equal(slots(linkage, ends), rails(turned, ends))
    machine = measure(guides, found, inverse=True)
    np.testing.assert_allclose(machine.travel, travels(ends))


def test_travel_of_scott_russell_is_the_tangent_of_its_derivation() -> None:
    """The slider is dead in mid-stroke: travel over stroke is tan(a/2)/2, a half at most."""
    ratios = []
    for turn in np.radians([20, 60, 89]):
        linkage = Linkage([[[0, 0], [1, 0]], [[0, 1, 0], [2, 0, 1]]])
        guides = coupler_curve(linkage, np.array([0j]))
        stroke = 4 * np.sin(turn)
        found = trace(guides, np.array([0.5 * stroke]), circle=False, split=False)
        assert found.fit.stroke[0] == pytest.approx(stroke, rel=1e-6)
        m = measure(guides, found)
        ratios.append(m.travel[0] / stroke)
        assert ratios[-1] == pytest.approx(0.5 * np.tan(0.5 * turn), rel=1e-4)
    assert ratios[0] < ratios[1] < ratios[2] < 0.5


def test_extremes_are_the_ends_or_the_peaks_between_them() -> None:
    t = -np.cos(np.pi * np.arange(13) / 12)
    run = np.stack([t, t**2, -((t - 0.3) ** 2), 0 * t * np.nan], axis=1)
    found: Any = np.einsum("knm,mn->kn", extremes(run), np.nan_to_num(run))
    np.testing.assert_allclose(found[:, 0], [-1, 1, np.nan, np.nan], atol=1e-12)
    np.testing.assert_allclose(found[:, 1], [1, 1, np.nan, 0], atol=1e-12)
    np.testing.assert_allclose(found[:, 2], [-1.69, np.nan, 0, np.nan], atol=2e-4)
    assert np.isnan(found[:, 3]).all()


def test_the_rail_of_a_crank_that_turns_fully_is_two_cranks_long() -> None:
    """On a line through the crank's pivot: from the coupler less the crank to both together."""
    linkage = Linkage([[[0, 0], [0, 1]], [[0, 1, 0], [np.sqrt(8), 0, 1]]])
    guides = coupler_curve(linkage, np.array([1j]))
    (_, (one, other)) = slides_over_turn(guides, np.array([1]))[0]
    assert sorted([one.real, other.real]) == pytest.approx([2, 4], abs=1e-6)
    assert abs(one.imag) + abs(other.imag) < 1e-12
