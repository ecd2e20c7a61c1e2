"""Series II.y0 and II*.y0: the contract and the golden cases."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
import pytest

from catalogue.curvature_theory.instant import Instant
from catalogue.kinematics.linkage import Linkage
from catalogue.testing import SeriesContract, load

II_Y0, II_STAR_Y0 = load("II.y0"), load("II*.y0")


class TestIIy0(SeriesContract):
    """Members lack what is a driving pair of theirs, or falls into a pole."""

    series = II_Y0
    absent: ClassVar = [("slider-crank pseudo-cuspidation", "[4]"), ("swinging-block general", "cuspidation")]


@pytest.mark.parametrize("series", [II_Y0, II_STAR_Y0])
def test_golden_members_are_synthesised(golden_members: Callable[[Any], int], series: Any) -> None:
    assert golden_members(series) >= 7


@pytest.mark.parametrize("series", [II_Y0, II_STAR_Y0])
def test_the_margin_is_how_far_ray_and_crank_are_from_other_series(series: Any) -> None:
    """The ray of the slider from both axes, and q3 from 1."""
    q3, phi2 = np.array([-2.0, 0.5, 2.5, -0.5, 1.2, 0.95]), np.radians([30.0, 75, 85, 10, 45, 60])
    member = series.members[0]
    first, second = (parameter.name for parameter in member.parameters)
    linkage = Linkage(member.synthesise({first: q3, second: phi2}))
    residual, margin = series.classify(Instant(linkage))
    expected = [min(abs(q - 1), np.sin(phi), np.cos(phi)) for q, phi in zip(q3, phi2, strict=True)]
    np.testing.assert_allclose(margin, expected, rtol=1e-9)
    assert residual.max() < 1e-12
