"""Watt's, Roberts' and Evans' linkages by their textbook proportions: recognised, and no straighter than ours."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import catalogue
from catalogue import Catalogue, Linkage, StraightLine
from catalogue.guidance.coupler_curve import coupler_curve
from catalogue.guidance.metrics import measure
from catalogue.guidance.placement import at_stroke
from tests.lambdas import lambdas, placed

pytestmark = pytest.mark.slow

HEIGHT = float(np.sqrt(1.2**2 - 0.5**2))
#: Series, pivots, guided point, strokes over which it is used.
TEXTBOOK: dict[str, tuple[str, Any, complex, tuple[float, ...]]] = {
    # equal cranks of length 1 on opposite sides of a coupler of 1.2, in mid position; its middle is guided
    "Watt": ("IV*.l", [[[0, 0, 1], [1, 0, 1]], [[2, -1.2, 1], [1, -1.2, 1]]], 1 - 0.6j, (0.6, 1.0, 1.4)),
    # base 2, coupler 1, cranks and sides of the coupler triangle 1.2; its apex runs along the base
    "Roberts": ("I.GG", [[[-1, 0, 1], [-0.5, HEIGHT, 1]], [[1, 0, 1], [0.5, HEIGHT, 1]]], 0j, (0.5, 1.0, 1.5, 2.0)),
    # grasshopper: beam of 2, bridle of 1 to its middle, its end on a rocker of 2.5; the other end is guided
    "Evans": ("II.xy", [[[0, 0, 1], [1, 0, 1]], [[2, 2.5, 1], [2, 0, 1]]], 0j, (0.5, 1.0, 1.5)),
}
each = pytest.mark.parametrize("name", TEXTBOOK)


@each
def test_textbook_linkage_is_recognised(name: str) -> None:
    series, pivots, *_ = TEXTBOOK[name]
    (one,) = catalogue.classify(pivots)
    assert one.series == [series]
    assert one.nearest is not None
    assert one.nearest.series == series
    assert one.nearest.holds
    assert one.nearest.residual < 1e-12


@each
def test_a_linkage_off_its_proportions_is_still_nearest_to_its_series(name: str) -> None:
    series, pivots, *_ = TEXTBOOK[name]
    draw = np.random.default_rng(8)
    moved = np.array(pivots, dtype=float) + draw.normal(scale=0.01, size=(20, 2, 2, 3)) * [1, 1, 0]
    found = catalogue.classify(moved)
    nearest = [one.nearest.series for one in found if one.nearest]
    assert nearest.count(series) >= 17  # series that meet there may happen to pass nearer
    assert not any(one.nearest.holds for one in found if one.nearest)
    frame = catalogue.classify(moved, tolerance=0.1).to_pandas()
    assert list(frame["nearest"]) == [series] * 20
    assert list(frame["series"]) == [series] * 20
    assert set(frame["family"]) == {"four-bar"}


@each
def test_the_catalogue_holds_one_at_least_as_straight(small: Catalogue, name: str) -> None:
    """At the same stroke, of the same series, no larger."""
    series, pivots, point, strokes = TEXTBOOK[name]
    guides = coupler_curve(Linkage(pivots), np.array([point]))
    for stroke in strokes:
        traced = at_stroke(guides, stroke, circle=False)
        size, deviation = float(measure(guides, traced).size[0]), float(traced.fit.deviation[0])
        assert np.isfinite(deviation)
        found = small.find(
            StraightLine(stroke, deviation), series=[series], max_size=size, rank_by="deviation", limit=1
        )
        assert found, (name, stroke, deviation, size)
        assert found[0].deviation <= deviation
        assert found[0].size <= size * (1 + 1e-9)


@pytest.mark.parametrize(("rotation", "frame"), [(80, 2.825), (100, 2.725)])
def test_lambda_linkages_of_the_textbooks_are_answered_in_their_own_envelope(
    small: Catalogue, rotation: float, frame: float
) -> None:
    """Norton, Design of Machinery, table of Hoeken-type linkages: coupler and rocker 1.5 frame - 0.5, crank 1."""
    table = placed(lambdas(rotation), np.array([frame, 1.5 * frame - 0.5]))
    size, angle, deviation = (float(x[0]) for x in (table.measures.size, table.measures.drive_angle, table.deviation))
    assert angle == pytest.approx(rotation, rel=1e-6)
    found = small.find(
        StraightLine(1.0, deviation), families=["four-bar"], max_size=size * (1 + 1e-9), full_rotation=True,
        min_drive_angle=angle * (1 - 1e-9), rank_by="deviation", limit=1,
    )  # fmt: skip
    assert found[0].deviation <= deviation
    assert found[0].drive_angle is not None
    assert found[0].drive_angle >= angle * (1 - 1e-8)


@pytest.mark.parametrize("stroke", [1.0, 2.0])
def test_a_tall_roberts_linkage_is_answered_in_its_own_envelope(small: Catalogue, stroke: float) -> None:
    """The isosceles one eight times as high as the half of its frame."""
    linkage = Linkage([[[-1.0, 0, 1], [-0.5, 8, 1]], [[1.0, 0, 1], [0.5, 8, 1]]])
    guides = coupler_curve(linkage, np.array([0j]))
    traced = at_stroke(guides, stroke, circle=False)
    size, deviation = float(measure(guides, traced).size[0]), float(traced.fit.deviation[0])
    found = small.find(
        StraightLine(stroke, deviation), families=["four-bar"], max_size=size * (1 + 1e-9), rank_by="deviation", limit=1
    )
    assert found[0].deviation <= deviation
