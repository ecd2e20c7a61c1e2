"""Refined answers of many bars: within their bounds, better than what is stored, measured by sampled places alone."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial import ConvexHull
from scipy.spatial.distance import pdist

import catalogue
from catalogue import Catalogue, CircularArc, StraightLine
from catalogue.find.specimens import stretch_of
from tests.families.conftest import DROPIN

pytestmark = pytest.mark.slow
TIGHT = StraightLine(100, 0.01, unit="mm")


@pytest.fixture(scope="module")
def cat(families_db: Path) -> Iterator[Catalogue]:
    """Return the catalogue of a few specimens of every family and of planar guides."""
    with catalogue.open(families_db, plugins=[DROPIN], build=False) as opened:
        yield opened


def straightness(z: Any) -> float:
    """Return half the width of the narrowest strip about places: it lies along a side of their hull."""
    corners = z[ConvexHull(np.stack([z.real, z.imag], 1)).vertices]
    way = np.roll(corners, -1) - corners
    return float(0.5 * np.ptp((z * (way / abs(way)).conj()[:, None]).imag, axis=1).min())


def joints(one: Any) -> dict[str, Any]:
    """Return the places of the joints of an answer over its stroke, complex, (m,)."""
    points: dict[str, Any] = stretch_of(one).motion(1001).points
    return points


def path_of(one: Any) -> Any:
    """Return the places of the guided point over the stroke."""
    return joints(one)[stretch_of(one).point]


def size(z: dict[str, Any]) -> float:
    every = np.concatenate([np.atleast_1d(at)[::20] for at in z.values()])
    return float(pdist(np.stack([every.real, every.imag], 1)).max())


def test_a_tight_request_is_answered_from_specimens_nearby(cat: Catalogue) -> None:
    bounds: dict[str, Any] = {"max_size": 350, "min_transmission": 30}
    assert not cat.find_in("six-bars", TIGHT, refine=False, quiet=True, **bounds)
    found = cat.find_in("six-bars", TIGHT, quiet=True, **bounds)
    assert len(found) >= 4
    assert len({one.family for one in found}) >= 2
    for one in found:
        z = joints(one)
        path = path_of(one)
        assert abs(path[-1] - path[0]) == pytest.approx(100, rel=1e-3)
        assert straightness(path) == pytest.approx(one.deviation, rel=0.02, abs=1e-9)
        assert one.deviation <= 0.01
        assert 0.99 * size(z) <= one.metrics["size"] <= 350
        assert one.metrics["min_transmission"] >= 30
    assert [one.deviation for one in found] == sorted(one.deviation for one in found)
    assert "moved towards the request" in found.explain()


def test_six_bars_are_as_straight_as_the_four_bars_that_they_start_from(cat: Catalogue) -> None:
    bounds: dict[str, Any] = {"max_size": 300, "min_transmission": 30, "rank_by": "deviation", "limit": 1}
    [four] = cat.find(TIGHT, families=["four-bar"], **bounds)
    [six] = cat.find_in("six-bars", TIGHT, quiet=True, **bounds)
    assert six.deviation < four.deviation
    own = stretch_of(six)
    point = np.array(own.joints[own.point])
    others = [own.joints[name] for bar in own.bars.values() if own.point in bar for name in bar if name != own.point]
    assert min(np.hypot(*(np.array(others) - point).T)) > 0.04 * 100  # no four-bar with a dyad that moves idly


def test_what_is_ranked_is_lowered_within_the_tolerance(cat: Catalogue) -> None:
    line = StraightLine(100, 1, unit="mm")
    for rank_by in ("size", "min_transmission"):
        ranked: dict[str, Any] = {"rank_by": rank_by, "limit": 1, "quiet": True, "families": ["watt-1", "watt-2"]}
        [stored], [moved] = (cat.find_in("six-bars", line, refine=refine, **ranked) for refine in (False, True))
        gain = moved.metrics[rank_by] / stored.metrics[rank_by]
        assert gain < 0.9 if rank_by == "size" else gain > 1.1
        assert moved.deviation <= 1


def test_refined_mechanisms_stay_in_their_region(cat: Catalogue) -> None:
    box = (-50, -150, 150, 30)
    found = cat.find_in(
        "six-bars", StraightLine(100, 0.5, unit="mm"), fixed_pivots_in=box, limit=4, refine=True, quiet=True
    )
    assert found
    for one in found:
        own = stretch_of(one)
        fixed = np.array([own.joints[name] for name in own.bars["frame"]])
        assert (fixed >= np.array(box[:2]) - 1e-6).all()
        assert (fixed <= np.array(box[2:]) + 1e-6).all()


def test_an_arc_of_a_given_radius_is_refined(cat: Catalogue) -> None:
    arc = CircularArc(100, 0.01, 150, unit="mm")
    [one, *_] = cat.find_in("six-bars", arc, max_size=350, refine=True, quiet=True)
    path = path_of(one)
    chord = path[-1] - path[0]
    middle, rise = 0.5 * (path[0] + path[-1]), np.sqrt(150**2 - abs(chord) ** 2 / 4)
    off = min(np.ptp(abs(path - (middle + way * rise * chord / abs(chord)))) for way in (1j, -1j))
    assert off < 5 * 0.01
    assert one.deviation <= 0.01


def test_what_moves_cannot_change_is_ranked_as_stored(cat: Catalogue) -> None:
    line = StraightLine(100, 1, unit="mm")
    for rank_by in ("bars", "sweep", "turns"):
        found = cat.find_in("six-bars", line, rank_by=rank_by, limit=2, families=["watt-1"], refine=True, quiet=True)
        assert found
        assert max(one.deviation for one in found) <= 1
