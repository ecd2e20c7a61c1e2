"""Refined candidates are straighter, satisfy all that was asked, and are what they say, measured another way."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import catalogue
from catalogue import Candidate, Catalogue, CircularArc, Linkage, StraightLine
from catalogue.query.constraints import Constraints
from catalogue.query.find import answer
from catalogue.query.ranking import Ranking
from catalogue.query.trail import Trail
from catalogue.refine import Free, Task, refined
from tests.query.test_find import check

Again = Callable[[Candidate], Any]
LINE, ARC = StraightLine(150, 0.05), CircularArc(100, 100, 0.05)
WISHES: list[dict[str, Any]] = [
    {"families": ["four-bar"], "min_transmission": 45.0},
    {"families": ["slider-crank"]},
    {"series": ["II.xy", "IV*.l"], "max_size": 700.0},
    {"pins_only": True, "rank_by": "deviation", "max_link": 400.0, "max_ground": 300.0},
    {"full_rotation": True, "families": ["four-bar"]},
]


@pytest.mark.parametrize("request_", [LINE, ARC], ids=["line", "arc"])
@pytest.mark.parametrize("wish", WISHES, ids=str)
def test_refined_guides_are_what_they_say(
    small: Catalogue, again: Again, wish: dict[str, Any], request_: StraightLine | CircularArc
) -> None:
    found = small.find(request_, limit=4, refine=True, **wish)
    for c in found:
        assert c.unrefined is not None
        assert c.deviation <= c.unrefined * (1 + 1e-6)
        bounds = {k: v for k, v in wish.items() if k != "rank_by"}
        check(c, request_, again, **bounds)
    assert found or request_ is ARC


def test_refinement_gains_much(small: Catalogue) -> None:
    wish: dict[str, Any] = {
        "families": ["four-bar"], "rank_by": "deviation", "max_link": 400.0, "max_ground": 300.0, "max_arm": 300.0,
    }  # fmt: skip
    plain = small.find(LINE, limit=10, refine=False, **wish)
    fine = small.find(LINE, limit=10, refine=True, **wish)
    assert all(c.unrefined is None for c in plain)
    assert fine[0].deviation < 0.5 * plain[0].deviation
    assert np.median([c.deviation / (c.unrefined or 1) for c in fine]) < 0.5
    assert [c.deviation for c in fine] == sorted(c.deviation for c in fine)
    assert "refine" in fine.explain()


def test_pivots_stay_in_their_box(small: Catalogue) -> None:
    box = (-300.0, -300.0, 300.0, 300.0)
    found = small.find(LINE, fixed_pivots_in=box, rank_by="deviation", families=["four-bar"], refine=True, limit=8)
    assert found
    for c in found:
        for (x, y, _), _ in c.pivots:
            assert box[0] <= x <= box[2]
            assert box[1] <= y <= box[3]


def test_the_price_hardly_rises(small: Catalogue) -> None:
    """Ranked by size, a guide may become a twentieth of a stroke larger for the sake of straightness."""
    for c in small.find(LINE, families=["four-bar"], rank_by="size", refine=True, limit=8):
        stored = small.find(LINE, families=["four-bar"], rank_by="size", limit=20, per_series=0, refine=False)
        (before,) = [s.size for s in stored if s.id == c.id] or [np.inf]
        assert c.size <= before + 0.051 * 150


def test_the_unit_does_not_matter(small: Catalogue) -> None:
    """The same request in another unit has the same answer."""
    one = small.find(StraightLine(1, 1e-3), families=["four-bar"], rank_by="deviation", max_size=3.0, refine=True)
    big = small.find(StraightLine(1e4, 10), families=["four-bar"], rank_by="deviation", max_size=3e4, refine=True)
    assert big[0].deviation / 1e4 == pytest.approx(one[0].deviation, rel=0.05)


def test_refined_guides_say_how_good_they_are(small: Catalogue) -> None:
    """Refined ones have a gap, alternate and have drifted; what is stored has none of that."""
    wish: dict[str, Any] = {"series": ["II.xy"], "rank_by": "deviation", "max_size": 700.0, "pins_only": True}
    for c in small.find(LINE, effort=2, **wish):
        assert c.gap is not None
        assert c.alternations is not None
        assert 0 <= c.gap < 0.5
        assert 3 <= c.alternations <= 8
        row = [m for m in small.classify(c.linkage)[0].near if m.series == c.series]
        assert c.drift is not None
        assert not row or c.drift <= row[0].residual + 1e-12  # of mid-stroke, one of the instants
    for c in small.find(LINE, refine=False, **wish):
        assert c.gap is c.alternations is c.drift is c.unrefined is None


def test_drift_is_measured_when_it_is_asked_for(small_db: Path) -> None:
    """Only then are the plugins loaded; a copy has what was measured."""
    with catalogue.open(small_db, build=False) as cat:
        first, *_ = cat.find(LINE, limit=3, series=["II.xy"])
        assert "registry" not in vars(cat)
        copied = pickle.loads(pickle.dumps(first))
        assert "registry" in vars(cat)
        assert first.drift is not None
        assert copied.drift == first.drift
        assert copied.to_dict() == first.to_dict()


def test_what_does_not_move_does_not_drift(small: Catalogue) -> None:
    for c in small.find(LINE, families=["oldham", "elliptic-trammel"], series=["II.ooo"], limit=5):
        assert c.drift == pytest.approx(0, abs=1e-9)
        assert c.gap is None  # exact


@pytest.mark.parametrize("rank", ["deviation", "size"])
def test_more_effort_is_no_worse(small: Catalogue, rank: str) -> None:
    wish: dict[str, Any] = {"families": ["four-bar"], "rank_by": rank, "max_size": 500.0, "min_transmission": 30.0}
    best = [getattr(small.find(LINE, effort=e, limit=1, **wish)[0], rank) for e in (1, 2, 4)]
    assert best[1] <= best[0] * (1 + 1e-3)
    assert best[2] <= best[1] * (1 + 1e-3)


def test_bounds_are_used_to_the_full(small: Catalogue) -> None:
    """A longer linkage is straighter: steps run along the bounds, not against them."""
    wish: dict[str, Any] = {
        "families": ["four-bar"], "max_link": 300.0, "max_ground": 300.0, "max_arm": 300.0, "min_transmission": 30.0,
    }  # fmt: skip
    found = small.find(LINE, rank_by="deviation", effort=2, limit=5, **wish)
    for c in found:
        near = [300 - (c.max_link or 0), 300 - (c.max_ground or 0), 300 - (c.max_arm or 0), c.min_transmission - 30]
        assert min(near) >= 0
        assert min(near) < 0.03
        assert c.gap is not None
        assert c.gap < 0.3


def test_any_radius_will_do(small: Catalogue, again: Again) -> None:
    free = CircularArc(100, None, 0.05)
    found = small.find(free, families=["four-bar"], rank_by="deviation", max_size=250.0, limit=6)
    assert found
    for c in found:
        check(c, free, again, max_size=250.0)
    assert np.ptp([c.radius for c in found]) > 1.0, "each has a radius of its own"


def test_frozen_pivots_stay(small: Catalogue) -> None:
    """The fixed pivots are given: they do not move, but for what is left of the path's tilt."""
    request, wanted = StraightLine(1, 1e-2), Constraints(families=["four-bar"], max_size=4.0)
    found = answer(
        small.database, request, wanted, Ranking({"size": 1.0}), limit=8, effort=1, trail=Trail(), refine=False
    )
    assert found is not None
    frozen = np.zeros(10, bool)
    frozen[[0, 1, 4, 5]] = True
    better, _ = refined(found, Task(request, wanted, moves=Free(frozen)), 12)
    gained = better.traced.fit.deviation / found.traced.fit.deviation
    assert np.median(gained) < 0.8
    moved = np.abs(better.linkage.points[:, :, 0] - found.linkage.points[:, :, 0]).max(1)
    assert (moved < 0.05).all()
    assert Linkage(better.linkage.pivots).family.tolist() == ["four-bar"] * len(moved)
