"""What is looser and tighter: points against the rules one by one, neighbours against all pairs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from catalogue import CircularArc, Request, StraightLine
from catalogue.problem.order import Order

LINE = StraightLine(150, 0.05)
KEYWORDS = st.fixed_dictionaries(
    {},
    optional={
        "max_size": st.sampled_from([200, 400]),
        "min_transmission": st.sampled_from([0, 30, 60]),
        "pins_only": st.booleans(),
        "families": st.sampled_from([["four-bar"], ["four-bar", "oldham"]]),
        "pivots_in": st.sampled_from([(-1, -1, 1, 1), (-2, -1, 1, 2), (-9, -9, 9, math.inf)]),
        "keep_out": st.lists(st.sampled_from([(0, 0, 1, 1), (2, 2, 3, 3)]), max_size=2, unique=True),
    },
)


def _request(one: tuple[float, dict[str, Any]]) -> Request:
    return Request.of(StraightLine(150, one[0]), **one[1])


REQUESTS = st.lists(
    st.tuples(st.sampled_from([0.01, 0.05, 0.2]), KEYWORDS).map(
        _request
    ),
    min_size=1, max_size=12, unique=True,
)  # fmt: skip


def sides(region: Any) -> list[float]:
    """Return the sides of a box, larger where it is looser."""
    if region is None:
        return [math.inf] * 4
    x0, y0, x1, y1 = region.box
    return [-x0, -y0, x1, y1]


def is_tighter(one: Request, other: Request) -> bool:
    """Compare two requests for one path bound by bound."""
    a, b = one.constraints, other.constraints
    box, outer = (sides(one.pivots_in) for one in (a, b))
    return (
        one.path.deviation <= other.path.deviation
        and (a.max_size or math.inf) <= (b.max_size or math.inf)
        and a.min_transmission >= b.min_transmission
        and a.pins_only >= b.pins_only
        and (not b.families or (bool(a.families) and {*a.families} <= {*b.families}))
        and {*b.keep_out} <= {*a.keep_out}
        and all(x <= y for x, y in zip(box, outer, strict=True))
    )


def neighbours(requests: Sequence[Request]) -> dict[int, tuple[set[int], set[int]]]:
    return {i: ({*map(int, below)}, {*map(int, near)}) for i, below, near in Order.of(requests).tighter()}


@pytest.mark.slow
@settings(max_examples=200, deadline=None)
@given(REQUESTS)
def test_tighter_requests_are_those_with_no_looser_bound(requests: list[Request]) -> None:
    found = neighbours(requests)
    count = range(len(requests))
    for i in count:
        below = {j for j in count if j != i and is_tighter(requests[j], requests[i])}
        assert found[i][0] == below
        between = {j for j in below if not any(j != k and is_tighter(requests[j], requests[k]) for k in below)}
        assert found[i][1] == between


def test_tighter_requests_come_first() -> None:
    requests = [Request.of(StraightLine(150, d), max_size=s) for d in (0.2, 0.05, 0.1) for s in (400, 200)]
    seen: set[int] = set()
    for index, below, _ in Order.of(requests).tighter():
        assert {*below} <= seen
        seen.add(index)
    assert len(seen) == len(requests)


@pytest.mark.parametrize(
    "other",
    [Request.of(StraightLine(151, 0.2)), Request.of(CircularArc(150, 0.2)), Request.of(LINE, limit=3),
     Request.of(LINE, rank_by="size"), Request.of(LINE, slots=True), Request.of(LINE, play=0.1),
     Request.of(LINE, pivots_in=[(0, 0), (9, 0), (0, 9)])],
)  # fmt: skip
def test_requests_that_differ_in_more_than_bounds_are_not_compared(other: Any) -> None:
    assert neighbours([Request.of(LINE), other]) == {0: (set(), set()), 1: (set(), set())}


@pytest.mark.slow
@settings(max_examples=100, deadline=None)
@given(REQUESTS)
def test_looser_requests_are_those_that_others_are_tighter_than(requests: list[Request]) -> None:
    found = {index: {*map(int, above)} for index, above in Order.of(requests).looser({*range(0, len(requests), 2)})}
    count = range(len(requests))
    assert found == {
        i: {j for j in count if j != i and is_tighter(requests[i], requests[j])} for i in count if i % 2 == 0
    }


def test_every_second_value_of_each_bound_is_explored_and_the_loosest() -> None:
    deviations, sizes = (0.01, 0.02, 0.03, 0.04), (200, 300, 400)
    requests = [Request.of(StraightLine(150, d), max_size=s) for d in deviations for s in sizes]
    explored = {(requests[i].path.deviation, requests[i].constraints.max_size) for i in Order.of(requests).explored()}
    assert explored == {(d, s) for d in (0.02, 0.04) for s in (200, 400)}
