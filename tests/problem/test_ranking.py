"""Costs and scores, written out by hand."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from catalogue import InvalidRequest, StraightLine
from catalogue.problem.criteria import CRITERIA
from catalogue.problem.ranking import DESIRES, Ranking

LINE = StraightLine(150, 0.05)
VALUES = {
    "size": 2.0, "transmission": 37.5 / 90, "allowance": 1.0, "min_link": 0.15, "min_ground": 0.15, "deviation": 0.5,
    "max_link": 1.5, "max_ground": 1.1, "max_arm": 0.7, "travel": 0.75, "uniformity": 0.4,
}  # fmt: skip
#: The same by hand: of the score the mean of the six logarithms.
COST = {
    "score": -(math.log(0.8) + 5 * math.log(0.5)) / 6, "balance": 2.0 - 37.5 / 90, "size": 2.0,
    "deviation": math.log(0.5), "transmission": 1 - 37.5 / 90, "allowance": -1.0, "max_link": 1.5,
    "min_link": -0.15, "max_ground": 1.1, "max_arm": 0.7, "uniformity": 0.6,
}  # fmt: skip
SMALLER = {"size", "deviation", "max_link", "max_ground", "max_arm", "travel"}


def arrays(values: dict[str, float]) -> dict[str, Any]:
    return {name: np.array([value]) for name, value in values.items()}


@pytest.mark.parametrize("name", CRITERIA)
def test_each_criterion_costs_what_it_says(name: str) -> None:
    assert Ranking.of(LINE, name).cost(arrays(VALUES)) == pytest.approx(COST[name], abs=1e-11)  # shares have 12 digits


@given(st.sampled_from(CRITERIA), st.sampled_from(sorted(VALUES)), st.floats(0.01, 3))
def test_no_merit_is_punished(criterion: str, quantity: str, step: float) -> None:
    better = {**VALUES, quantity: VALUES[quantity] * (1 / (1 + step) if quantity in SMALLER else 1 + step)}
    ranking = Ranking.of(LINE, criterion)
    before, after = (float(ranking.cost(arrays(v))[0]) for v in (VALUES, better))
    if quantity in ranking.quantities:
        assert after < before
    else:
        assert after == before


def test_a_mix_weighs_its_criteria() -> None:
    mix = Ranking.of(LINE, "size=2,transmission=0.5")
    assert mix.cost(arrays(VALUES)) == pytest.approx(0.8 * COST["size"] + 0.2 * COST["transmission"])
    assert mix.only is None
    assert mix.quantities == {"size", "transmission"}


def test_the_score_is_the_weighted_geometric_mean_of_the_desirabilities() -> None:
    assert Ranking().score(arrays(VALUES)) == pytest.approx(100 * (0.8 * 0.5**5) ** (1 / 6))
    # in the user's unit: of size 300, half way from 150 to 450, counting three times
    mine = Ranking.of(LINE, desires={"size": (150, 450, 3)})
    assert mine.score(arrays(VALUES)) == pytest.approx(100 * (0.5**3 * 0.5**5) ** (1 / 8))
    assert mine.cost(arrays(VALUES)) == pytest.approx(math.log(2))
    assert set(mine.desires) == set(DESIRES)
    assert Ranking().score(arrays({**VALUES, "transmission": 0.1})) == 0
    perfect = {"size": 1.0, "transmission": 0.7, "allowance": 2.3, "min_link": 0.3, "min_ground": 0.3}
    perfect["travel"] = 0.5
    assert Ranking().score(arrays(perfect)) == pytest.approx(100)
    assert Ranking().score(arrays({**perfect, "travel": 0.0})) == pytest.approx(100)  # pins only
    assert Ranking().score(arrays({**perfect, "travel": 1.0})) == 0  # a rail as long as the stroke guides by itself
    assert Ranking().faults(arrays({**perfect, "travel": 1.0})) == [1]


def test_without_a_wish_the_score_ranks_alone() -> None:
    plain, asked = Ranking(), Ranking.of(StraightLine(1, 1e-3))
    assert dict(plain.weights) == dict(asked.weights)
    np.testing.assert_array_equal(plain.cost(arrays(VALUES)), plain.criterion("score", arrays(VALUES)))


def test_a_higher_score_costs_less() -> None:
    """The ranking by score is the order of the marks, as long as nothing is worthless."""
    draw = np.random.default_rng(2)
    some = {
        "size": draw.uniform(0.5, 5.5, 200), "transmission": draw.uniform(0.2, 1, 200),
        "allowance": draw.uniform(0.08, 3.2, 200), "min_link": draw.uniform(0.06, 0.4, 200),
        "min_ground": draw.uniform(0.06, 0.4, 200), "travel": draw.uniform(0, 0.98, 200),
    }  # fmt: skip
    cost, score = Ranking().cost(some), Ranking().score(some)
    np.testing.assert_array_equal(np.argsort(cost), np.argsort(-score))


def test_a_front_keeps_its_criteria_apart() -> None:
    ranking = Ranking.of(LINE, ["size", "deviation", "size"])
    assert ranking.front == ("size", "deviation")
    assert ranking.per_series == 0
    assert Ranking.of(LINE, limit=12).per_series == 3


@pytest.mark.parametrize(
    ("how", "message"),
    [
        ({"rank_by": ["size"]}, "a front needs two criteria or more"),
        ({"rank_by": []}, "a front needs two criteria or more"),
        ({"rank_by": ["size", "beauty"]}, "cannot rank by beauty"),
        ({"distinct": -0.1}, "distinct must be a number from 0 to below 1"),
        ({"distinct": 1}, "distinct must be a number from 0 to below 1"),
        ({"distinct": math.nan}, "distinct must be a number from 0 to below 1"),
        ({"distinct": "far"}, "distinct must be a number from 0 to below 1"),
        ({"per_series": -1}, "per_series must be at least 0, not -1"),
        ({"desires": {"beauty": (1, 2)}}, "no desirability is made of 'beauty'"),
    ],
)
def test_rankings_refuse(how: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidRequest, match=message):
        Ranking.of(LINE, **how)
