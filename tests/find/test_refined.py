"""Refinement minimises what is ranked while every constraint holds, and says how good the answer is."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import catalogue
from catalogue import Catalogue, CircularArc, Found, StraightLine
from tests.find.test_find import check

pytestmark = pytest.mark.slow

Ask = Callable[..., Found]
LINE, ARC = StraightLine(150, 0.05), CircularArc(100, 0.05, 100)


@pytest.mark.parametrize(("criterion", "part"), [("deviation", 0.5), ("size", 0.9)])
def test_refinement_gains_much(ask: Ask, criterion: str, part: float) -> None:
    """Of what is ranked, beside the best as it is stored."""
    wish: dict[str, Any] = {
        "families": ["four-bar"], "rank_by": criterion, "max_link": 400.0, "max_ground": 300.0, "max_arm": 300.0,
        "min_transmission": 35, "limit": 6,
    }  # fmt: skip
    plain, fine = ask(LINE, refine=False, **wish), ask(LINE, **wish)
    value = [getattr(c, criterion) for c in fine]
    assert value[0] < part * getattr(plain[0], criterion)
    assert value == sorted(value)
    assert all(c.deviation <= 0.05 for c in fine)


def test_bounds_are_used_to_the_full(ask: Ask) -> None:
    """A longer linkage is straighter: steps run along the bounds, not against them."""
    wish: dict[str, Any] = {
        "families": ["four-bar"], "max_link": 300.0, "max_ground": 300.0, "max_arm": 300.0, "min_transmission": 30.0,
    }  # fmt: skip
    found = ask(LINE, rank_by="deviation", limit=4, **wish)
    assert len(found) == 4
    tight = []
    for c in found:
        near = [300 - (c.max_link or 0), 300 - (c.max_ground or 0), 300 - (c.max_arm or 0), c.min_transmission - 30]
        assert min(near) >= -1e-6
        tight.append(min(near))
    assert np.median(tight) < 0.1


@pytest.mark.parametrize(
    ("request_", "rank_by", "wish"),
    [
        (LINE, "size", {}),
        (ARC, "size", {"min_link": 110}),
        (LINE, "score", {}),
    ],  # else arcs stay as small as their chord
    ids=str,
)
def test_the_tolerance_is_kept_whatever_is_ranked(
    ask: Ask, again: Any, request_: Any, rank_by: str, wish: dict[str, Any]
) -> None:
    """A smaller guide uses it, and does not exceed it on a path as fine as it may be."""
    found = ask(request_, rank_by=rank_by, families=["four-bar"], limit=4, **wish)
    for c in found:
        check(c, request_, again)
        assert c.deviation <= request_.deviation
    if rank_by == "size":
        assert max(c.deviation for c in found) > 0.5 * request_.deviation


def test_refined_guides_say_how_good_they_are(small: Catalogue, ask: Ask) -> None:
    """Refined ones have a gap, alternate and have drifted; what is stored has none of that."""
    wish: dict[str, Any] = {"series": ["II.xy"], "rank_by": "deviation", "max_size": 700.0, "limit": 5}
    for c in ask(LINE, **wish):
        assert c.gap is not None
        assert c.alternations is not None
        assert c.gap >= 0
        assert 3 <= c.alternations <= 8
        row = [m for m in small.classify(c.linkage)[0].near if m.series == c.series]
        assert c.drift is not None
        assert not row or c.drift <= row[0].residual + 1e-12  # of mid-stroke, one of the instants
    for c in ask(LINE, refine=False, **wish):
        assert c.gap is c.alternations is c.drift is None


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


def test_any_radius_will_do(ask: Ask, again: Any) -> None:
    free = CircularArc(100, 0.05)
    found = ask(free, families=["four-bar"], rank_by="deviation", max_size=250.0, limit=4)
    assert len(found) == 4
    for c in found:
        check(c, free, again, max_size=250.0)
    assert np.ptp([c.radius for c in found]) > 1.0, "each has a radius of its own"


def test_round_lengths_are_round_and_still_guide(ask: Ask, again: Any) -> None:
    found = ask(StraightLine(150, 0.5), families=["four-bar"], round_to=1.0, limit=3)
    assert found
    for c in found:
        a = again(c)
        assert a.deviation <= 0.5 * (1 + 1e-3)
        (one, two), (three, four) = [[complex(x, y) for x, y, _ in pair] for pair in c.pivots]
        for length in (abs(one - two), abs(three - four), abs(two - four)):
            assert length == pytest.approx(round(length), abs=1e-6)


def test_a_bounded_allowance_denies_no_guide_that_uses_up_both_it_and_the_tolerance(small: Catalogue) -> None:
    """The allowance depends on the deviation too: linearised by the sensitivity alone, nothing was found here."""
    found = small.find(
        StraightLine(1, 0.0016268), families="four-bar", rank_by="transmission", min_allowance=0.0001262,
        max_size=1.1302, limit=1,
    )  # fmt: skip
    (best,) = found
    assert best.min_transmission > 62
    assert best.deviation <= 0.0016268
    assert best.allowance is not None
    assert best.allowance >= 0.0001262 * (1 - 1e-6)
    assert best.size <= 1.1302 * (1 + 1e-9)
