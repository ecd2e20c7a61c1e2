"""Series II.yy and II*.yy: the contract and the golden cases."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
import pytest

from catalogue.testing import SeriesContract, load

II_YY, II_STAR_YY = load("II.yy"), load("II*.yy")


class TestIIyy(SeriesContract):
    """Members lack what is a driving pair of theirs, or falls into a pole."""

    series = II_YY
    absent: ClassVar = [("inverted-slider-crank general", "cuspidation")]


@pytest.mark.parametrize("series", [II_YY, II_STAR_YY])
def test_golden_members_are_synthesised(golden_members: Callable[[Any], int], series: Any) -> None:
    assert golden_members(series) >= 3


@pytest.mark.parametrize("series", [II_YY, II_STAR_YY])
def test_the_points_of_a_ray_are_seen_from_the_pole_at_the_angle_of_its_label(series: Any) -> None:
    """And they stand on the circle whose diameter is rho0, along the pole normal: at sin(angle) from the pole."""
    member = series.member("four-bar general")
    rays = {g.label: g.pairs for g in series.guided(member.complete({"q3": [0.7]})) if g.label.startswith("ray ")}
    assert set(rays) == {"ray 30", "ray 60"}
    for label, [pair] in rays.items():
        (x, y, _), direction = sorted(pair, key=lambda point: point[2] == 0)  # the other one is at infinity
        angle = np.radians(float(label.removeprefix("ray ")))
        np.testing.assert_allclose(np.abs([x, y]), np.sin(angle) * np.array([np.cos(angle), np.sin(angle)]), rtol=1e-14)
        np.testing.assert_allclose(np.abs(direction[:2]), [np.cos(angle), np.sin(angle)], rtol=1e-14)
        assert x * y > 0
