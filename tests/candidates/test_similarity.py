"""The distance of designs is a metric that knows neither scale nor placement nor mirror image."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from catalogue import Catalogue, CircularArc, StraightLine
from catalogue.candidates.select import distances, nearest, normal_form

LINE, ARC = StraightLine(150, 0.05), CircularArc(150, 0.1, 400)
SEEDS = st.integers(0, 2**32 - 1)


def designs(seed: int, count: int, stroke: float = 1.0) -> Any:
    """Return pivots of any kind, some at infinity, laid along a path of that stroke."""
    draw = np.random.default_rng(seed)
    pivots = np.ones((count, 2, 2, 3))
    pivots[..., :2] = draw.normal(scale=2 * stroke, size=(count, 2, 2, 2))
    pivots[draw.random((count, 2)) < 0.3, 0, 2] = 0
    return pivots


def between(one: Any, other: Any, stroke: float = 1.0, mirror: bool = True) -> float:
    return float(distances(normal_form(one[None], stroke), normal_form(other[None], stroke), mirror=mirror)[0, 0])


@pytest.mark.slow
@given(SEEDS)
def test_it_is_a_metric(seed: int) -> None:
    form = normal_form(designs(seed, 6), 1.0)
    for mirror in (False, True):
        d = distances(form, form, mirror=mirror)
        assert np.abs(np.diag(d)).max() < 1e-7
        np.testing.assert_allclose(d, d.T, atol=1e-12)
        assert (d >= 0).all()
        assert (d <= 1 + 1e-12).all()
        assert (d[:, None] <= d[:, :, None] + d[None] + 1e-9).all() or mirror is None


@pytest.mark.slow
@given(SEEDS, st.sampled_from([(1, -1), (-1, 1), (-1, -1)]), st.booleans(), st.floats(0.01, 1000))
def test_mirror_image_exchange_and_scale_are_no_difference(
    seed: int, signs: tuple[int, int], exchange: bool, scale: float
) -> None:
    one, other = designs(seed, 2)
    image = one.copy()
    image[..., 0] -= 0.5 * image[..., 2]
    image[..., :2] *= signs
    image[..., 0] += 0.5 * image[..., 2]
    image = image[::-1] if exchange else image
    assert between(one, image) < 1e-7
    assert between(other, image) == pytest.approx(between(other, one), abs=1e-9)
    longer, other_longer = (p * np.array([scale, scale, 1]) for p in (one, other))
    assert between(longer, other_longer, stroke=scale) == pytest.approx(between(one, other), abs=1e-9)


def test_an_arc_is_not_mirrored_in_its_chord() -> None:
    one = designs(3, 1)[0]
    image = one * np.array([1, -1, 1])
    assert between(one, image) < 1e-7 < 0.1 < between(one, image, mirror=False)


@pytest.mark.slow
@given(SEEDS, st.floats(0, 0.01), st.floats(0, 6.3))
def test_near_the_path_it_is_the_distance_over_the_stroke(seed: int, step: float, angle: float) -> None:
    one = designs(seed, 1)[0]
    one[0, 1] = 0.5, 0, 1
    moved = one.copy()
    moved[0, 1, :2] += step * np.cos(angle), step * np.sin(angle)
    assert between(one, moved) == pytest.approx(step, rel=1e-3, abs=1e-7)


def test_far_away_it_is_the_difference_of_directions() -> None:
    one = designs(5, 1)[0]
    one[0, 0] = 0.0, 1.0, 0.0
    far = one.copy()
    far[0, 0] = 0.5, 1e6, 1.0
    assert between(one, far) < 2e-6


@pytest.mark.slow
@pytest.mark.parametrize("request_", [LINE, ARC], ids=["line", "arc"])
@pytest.mark.parametrize("rank_by", ["score", "size", ["size", "transmission"]], ids=str)
def test_no_two_answers_are_nearer_than_asked(small: Catalogue, request_: Any, rank_by: Any) -> None:
    plain = small.find(request_, rank_by=rank_by, limit=10, refine=False, distinct=0)
    apart = 1.5 * min(c.nearest or 0.0 for c in plain)
    found = small.find(request_, rank_by=rank_by, limit=10, refine=False, distinct=apart)
    assert len(found) >= 8
    assert min(c.nearest or 0.0 for c in found) >= apart > 1e-6
    forms = normal_form(np.array([c.pivots for c in found]), request_.stroke)
    expected: list[Any] = [c.nearest for c in found]
    np.testing.assert_allclose(nearest(forms, mirror=request_.kind == "line"), expected, rtol=1e-9)
    assert found[0].id == plain[0].id, "the best of its cluster stays"


@pytest.mark.slow
def test_one_answer_has_no_neighbour(small: Catalogue) -> None:
    assert small.find(LINE, limit=1, refine=False)[0].nearest is None
