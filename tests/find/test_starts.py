"""Answers as starts: nothing that was found gets lost."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

import catalogue
from catalogue import Catalogue, CircularArc, InvalidRequest, StraightLine
from catalogue.find import find
from catalogue.search import search, starts
from catalogue.search.search import Search

LINE = StraightLine(100, 0.1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("request_", "constraints", "rank_by"),
    [
        (
            StraightLine(100, 0.02),
            {"families": "four-bar", "min_transmission": 70, "fixed_pivots_in": (0, 10, 100, 60)},
            "size",
        ),
        (LINE, {"pins_only": True, "fixed_pivots_in": (-50, 0, 150, 60)}, "transmission"),
        (CircularArc(100, 0.1), {"families": "four-bar", "fixed_pivots_in": (-40, 20, 140, 160)}, "transmission"),
    ],
)
def test_a_looser_request_has_no_worse_answer(
    small: Catalogue, monkeypatch: pytest.MonkeyPatch, request_: Any, constraints: dict[str, Any], rank_by: str
) -> None:
    """Even if hardly anything is tried for it."""
    tight = small.find(request_, **constraints, rank_by=rank_by, limit=3, effort=2)
    monkeypatch.setattr(starts, "STORED_STARTS", 1)
    monkeypatch.setattr(starts, "DRAWN_LINKAGES", 5)
    poor = replace(search.BUDGET, per_kind=1, tried=1, rounds=1, dense=0, farther=0, broad=0, hops=0)
    monkeypatch.setattr(find, "Search", partial(Search, budget=poor))
    looser = replace(request_, deviation=1.2 * request_.deviation)
    alone = small.find(looser, **constraints, rank_by=rank_by, limit=1)
    from_these = small.find(looser, **constraints, rank_by=rank_by, limit=1, starts=tight)
    name, sign = {"transmission": ("min_transmission", -1.0)}.get(rank_by, (rank_by, 1.0))
    before, now = (sign * getattr(found[0], name) for found in (tight, from_these))
    without = sign * getattr(alone[0], name) if alone else np.inf
    assert now <= before + 1e-9 * abs(before)
    assert without > now + 1e-4 * abs(now), "of itself it would not be found"


@pytest.mark.slow
def test_an_answer_is_found_where_it_was_when_the_frame_is_another(small: Catalogue) -> None:
    here = StraightLine(100, 0.1, start=(30, -20), along=35)
    found = small.find(here, families="four-bar", min_transmission=40, limit=1, effort=2)
    again = small.find(LINE, families="four-bar", min_transmission=40, limit=1, starts=found, refine=False)
    np.testing.assert_allclose(again[0].pivots, found[0].at_home().pivots, atol=1e-9)
    assert again[0].series == found[0].series


@pytest.mark.slow
def test_a_start_of_another_stroke_is_taken_in_its_shape(small: Catalogue) -> None:
    found = small.find(StraightLine(10, 0.01), families="four-bar", min_transmission=40, limit=1, effort=2)
    again = small.find(LINE, families="four-bar", min_transmission=40, limit=1, starts=found, refine=False)
    np.testing.assert_allclose(np.array(again[0].pivots)[..., :2], 10 * np.array(found[0].pivots)[..., :2], atol=1e-8)


@pytest.mark.slow
def test_starts_of_other_sorts_are_left_out(small: Catalogue) -> None:
    found = small.find(LINE, families="four-bar", limit=3)
    again = small.find(LINE, families="slider-crank", limit=3, starts=found)
    assert {one.family for one in again} == {"slider-crank"}


@pytest.mark.slow
def test_a_stretch_of_a_linkage_of_ones_own_is_a_start(small: Catalogue) -> None:
    own = catalogue.guide([[[0, 0, 1], [100, 0, 1]], [[250, 0, 1], [150, 200, 1]]], (125, 220))
    stretch = catalogue.measure(own, stroke=20)[0]
    found = small.find(StraightLine(20, 2), starts=[stretch], refine=False, limit=100)
    assert any(np.allclose(one.pivots, stretch.at_home().pivots, atol=1e-6) for one in found)


@pytest.mark.parametrize(
    ("starts", "wanted", "said"),
    [
        (5, {}, "starts are several guides, not 5"),
        ("abc", {}, "starts are several guides, not 'abc'"),
        ([5], {}, "a search starts from answers, as find and measure give them, not 5"),
    ],
)
def test_what_is_no_start_is_told(small: Catalogue, starts: Any, wanted: dict[str, Any], said: str) -> None:
    with pytest.raises(InvalidRequest, match=said):
        small.find(LINE, starts=starts, **wanted)


@pytest.mark.slow
def test_starts_beside_given_pivots_are_refused(small: Catalogue) -> None:
    found = small.find(LINE, limit=1)
    for wanted in ({"slots": True}, {"fixed_pivots": ((0, 50), (60, 50))}):
        with pytest.raises(InvalidRequest, match="found without starts"):
            small.find(LINE, starts=found, **wanted)
