"""What is found by tracing few is what is found by tracing all."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from catalogue import Catalogue, CircularArc, StraightLine
from catalogue.query.constraints import Constraints
from catalogue.query.find import _gathered, _searched
from catalogue.query.ranking import Ranking, price
from catalogue.query.ranking import given as best
from catalogue.query.search import Standing
from catalogue.query.trail import Trail

RANK = {"balance": 1.0}
LINES = [StraightLine(100, 100 * 10**k) for k in (-5.3, -4.0, -3.5, -2.8, -2.0)]
ARCS = [CircularArc(100, 100 / sweep, 100 * 10**k) for sweep, k in ((0.3, -3.2), (0.8, -2.5), (1.5, -4.0))]
WISHES: list[dict[str, Any]] = [
    {},
    {"min_transmission": 40},
    {"fixed_pivots_in": (-200, -200, 300, 200), "pins_only": True},
    {"max_size": 350, "order": 4},
]
HOW = {"limit": 12, "per_series": 4, "count": 400, "distinct": 0.0, "fine": False}
#: Estimates err, so that now and then one of the answers is missed: of the balance, which is a number of order 1.
WORSE = 0.03


@pytest.mark.parametrize("distinct", [0.0, 0.02])
@pytest.mark.parametrize("request_", [*LINES, *ARCS], ids=str)
def test_tracing_few_finds_what_tracing_all_finds(small: Catalogue, request_: Any, distinct: float) -> None:
    how = {**HOW, "limit": 24, "per_series": 8, "distinct": distinct} if distinct else HOW  # as `answer` asks
    for wish in WISHES:
        wanted, ranking = Constraints(**wish), Ranking(RANK, per_series=4, distinct=distinct)
        prices = []
        trails = Trail(), Trail()
        everything = _gathered(small.database, request_, wanted, RANK, trails[0], 100_000, False)
        few = _searched(small.database, request_, wanted, RANK, trails[1], **how)
        for found, good in (everything, few):
            some = found is not None and good.any()
            prices.append(price(best(found, good, request_, ranking, 12), request_, RANK) if some else np.zeros(0))
        assert len(prices[0]) == len(prices[1])
        assert trails[1].traced <= trails[0].traced
        if len(prices[0]):
            assert prices[1][0] <= prices[0][0] + WORSE
            assert prices[1].mean() <= prices[0].mean() + WORSE, wish


def test_few_are_traced(small: Catalogue) -> None:
    found = small.find(LINES[2], limit=12, distinct=0)
    assert len(found) == 12
    told = found.explain()
    assert "nothing that was not traced promises to be better" in told
    all_, few = Trail(), Trail()
    _gathered(small.database, LINES[2], Constraints(), RANK, all_, 100_000, False)
    _searched(small.database, LINES[2], Constraints(), RANK, few, **HOW)
    assert few.traced < 0.1 * all_.traced


def ranked(prices: dict[str, list[float]], limit: int, per_series: int) -> list[tuple[float, str]]:
    """Return what is given: by price, few of a series as long as there are others."""
    first, rest, count = [], [], dict.fromkeys(prices, 0)
    for value, code in sorted((p, c) for c, of in prices.items() for p in of):
        count[code] += 1
        (first if count[code] <= per_series else rest).append((value, code))
    return sorted((first + rest)[:limit])


@given(
    st.dictionaries(st.sampled_from("abcd"), st.lists(st.integers(0, 30).map(float), max_size=6), min_size=1),
    st.integers(1, 8),
    st.integers(1, 4),
    st.sampled_from("abcde"),
    st.integers(0, 60).map(lambda k: k / 2 + 0.25),
)
def test_who_comes_too_late_changes_nothing(
    prices: dict[str, list[float]], limit: int, per_series: int, code: str, price_: float
) -> None:
    """A further answer is given if and only if its price is below the entry for its series."""
    standing = Standing(limit, per_series)
    for name, values in prices.items():
        standing.add(np.array([name] * len(values), dtype=object), np.array(values))
    usual, full = standing.entry()
    before = ranked(prices, limit, per_series)
    after = ranked({**prices, code: [*prices.get(code, []), price_]}, limit, per_series)
    assert (after != before) == (price_ < full.get(code, usual))
