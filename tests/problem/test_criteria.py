"""Criteria and desirabilities: read as they are given, and computed by hand."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from catalogue import InvalidRequest
from catalogue.problem.ranking import DESIRES, WORTHLESS, Desire, weights


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ("size", {"size": 1.0}),
        ("size=2, transmission=0.5", {"size": 0.8, "transmission": 0.2}),
        ("transmission=500,size=2000", {"size": 0.8, "transmission": 0.2}),
        ("size=1e304,transmission=1e304", {"size": 0.5, "transmission": 0.5}),
        ({"deviation": 3}, {"deviation": 1.0}),
        ("size=0.001", {"size": 1.0}),
        ("size,deviation", {"size": 0.5, "deviation": 0.5}),
    ],
)
def test_weights_are_read_as_shares_of_their_sum(given: Any, expected: dict[str, float]) -> None:
    assert weights(given) == expected


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("beauty", "cannot rank by beauty; choose from score, balance, size, deviation, .*max_arm"),
        ("size=1,beauty=2", "cannot rank by beauty"),
        ("", "cannot rank by ; choose|cannot rank by nothing"),
        ({}, "cannot rank by nothing"),
        ("size=0", "the weight of size must be a finite number above zero, not 0"),
        ("size=-1", "the weight of size must be a finite number above zero, not -1"),
        ("size=nan", "the weight of size .* not nan"),
        ("size=much", "the weight of size must be a number, not 'much'"),
        ("size=", "the weight of size must be a number, not ''"),
        (3, "cannot rank by 3"),
    ],
)
def test_weights_refuse(given: Any, message: str) -> None:
    with pytest.raises(InvalidRequest, match=message):
        weights(given)


@pytest.mark.parametrize(
    ("name", "value", "share"),
    [
        ("size", 0.5, 1), ("size", 1, 1), ("size", 2, 0.8), ("size", 3.5, 0.5), ("size", 6, 0), ("size", 60, 0),
        ("transmission", 10 / 90, 0), ("transmission", 37.5 / 90, 0.5), ("transmission", 60 / 90, 1),
        ("transmission", 1, 1), ("allowance", -1, 0), ("allowance", 0.8, 0.4), ("allowance", 2.4, 1),
        ("min_link", 0.05, 0), ("min_link", 0.1, 0.25), ("min_link", math.inf, 1),
        ("min_ground", 0.05, 0), ("min_ground", 0.2, 0.75),
    ],
)  # fmt: skip
def test_desirability_rises_in_proportion_from_the_worst_to_the_best(name: str, value: float, share: float) -> None:
    desire = DESIRES[name]
    assert desire.of_value(np.array([value])) == pytest.approx(share, abs=1e-12)
    if share > WORTHLESS:
        assert desire.cost(np.array([value])) == pytest.approx(-math.log(share), abs=1e-12)


@given(st.sampled_from(sorted(DESIRES)), st.floats(-3, 20), st.floats(1e-6, 5))
def test_what_is_better_costs_less_however_bad_it_is(name: str, value: float, step: float) -> None:
    """And what is past the best costs nothing more."""
    desire = DESIRES[name]
    toward = math.copysign(step, desire.best - desire.worst)
    worse, better = desire.cost(np.array([value, value + toward]))
    past = (value - desire.best) * toward >= 0
    assert better == worse == 0 if past else better < worse


def test_the_cost_has_no_step_where_it_is_continued() -> None:
    desire = DESIRES["size"]
    edge = desire.worst + WORTHLESS * (desire.best - desire.worst)
    h = 1e-5
    low, here, high = desire.cost(np.array([edge - h, edge, edge + h]))
    assert (here - low) / h == pytest.approx((high - here) / h, rel=1e-2)
    assert here == pytest.approx(-math.log(WORTHLESS))


def test_desires_are_read_in_the_unit_of_the_user() -> None:
    assert Desire.of("size", (150, 900), 150) == Desire(1, 6)
    assert Desire.of("size", [150, 900, 2], 150) == Desire(1, 6, 2)
    assert Desire.of("transmission", (45, 18), 90) == Desire(0.5, 0.2)
    assert Desire.of("allowance", (0.02, 0.0), 0.04) == Desire(0.5, 0)


@pytest.mark.parametrize(
    ("name", "given", "message"),
    [
        (
            "beauty",
            (1, 2),
            "no desirability is made of 'beauty'; there are size, transmission, allowance, min_link, min_ground",
        ),
        ("size", (1,), "the desire for size must be BEST, WORST or BEST, WORST, WEIGHT"),
        ("size", 3, "the desire for size must be"),
        ("size", ("150", "900"), "the desire for size must be"),
        ("size", (1, 2, 3, 4), "the desire for size must be"),
        ("size", (900, 150), "the best size must lie below the worst, not 900 and 150"),
        ("size", (150, 150), "the best size must lie below the worst"),
        ("size", (150, math.inf), "the best size must lie below the worst"),
        ("transmission", (20, 60), "the best transmission must lie above the worst"),
        ("size", (150, 900, 0), "the weight of size must be a finite number above zero"),
    ],
)
def test_desires_refuse(name: str, given: Any, message: str) -> None:
    with pytest.raises(InvalidRequest, match=message):
        Desire.of(name, given, 1.0)
