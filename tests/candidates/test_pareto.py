"""Pareto fronts: nobody on one is dominated from it, and how rows come does not matter."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from catalogue import Catalogue, CircularArc, InvalidRequest, StraightLine
from catalogue.candidates.select import fronts, spread_order

VALUES = st.integers(1, 3).flatmap(
    lambda k: st.lists(st.lists(st.integers(0, 6).map(float), min_size=k, max_size=k), min_size=1, max_size=40)
)
LINE = StraightLine(150, 0.05)


def dominates(a: Any, b: Any) -> bool:
    return bool(np.all(a <= b) and np.any(a < b))


@pytest.mark.slow
@given(VALUES)
def test_fronts_are_peeled_off(rows: list[list[float]]) -> None:
    """Nobody is dominated by a row of the same or a later front, and everybody by one of the front before."""
    values = np.array(rows)
    number = fronts(values)
    for i, row in enumerate(values):
        above = {int(number[j]) for j, other in enumerate(values) if dominates(other, row)}
        assert all(front < number[i] for front in above)
        assert number[i] == 1 or number[i] - 1 in above


@pytest.mark.slow
@given(VALUES, st.randoms(use_true_random=False))
def test_how_rows_come_does_not_matter(rows: list[list[float]], random: Any) -> None:
    values, key = np.array(rows), np.arange(len(rows))
    order, number = spread_order(values, key)
    assert sorted(order.tolist()) == key.tolist()
    assert (np.diff(number[order]) >= 0).all()
    mixed = np.array(random.sample(range(len(rows)), len(rows)))
    again, _ = spread_order(values[mixed], key[mixed])
    assert key[mixed][again].tolist() == order.tolist()


def test_the_beginning_of_a_front_covers_it() -> None:
    x = np.linspace(0, 1, 101)
    order, number = spread_order(np.stack([x, 1 - x], axis=1), np.arange(101))
    assert set(number) == {1}
    assert order[:2].tolist() == [0, 100]
    assert np.sort(x[order[:5]]) == pytest.approx([0, 0.25, 0.5, 0.75, 1])


TERMS = {"size": lambda c: c.size / c.stroke, "transmission": lambda c: 1 - c.min_transmission / 90,
         "deviation": lambda c: c.deviation / 0.05, "max_link": lambda c: (c.max_link or 0.0) / c.stroke}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("names", [["size", "deviation"], ["transmission", "size", "max_link"]], ids=str)
@pytest.mark.parametrize("request_", [LINE, CircularArc(100, 0.05, 100)], ids=["line", "arc"])
def test_no_answer_on_the_front_is_dominated(small: Catalogue, request_: Any, names: list[str]) -> None:
    found = small.find(request_, rank_by=names, limit=20, families=["four-bar"], refine=False, distinct=0)
    assert len(found) >= 12
    values = np.array([[TERMS[name](c) for name in names] for c in found]).round(9)
    front: list[Any] = [c.front for c in found]
    assert front[0] == 1
    assert front == sorted(front)
    for i, own in enumerate(front):
        assert not any(dominates(values[j], values[i]) for j, other in enumerate(front) if other >= own)
    assert values[0, 0] == values[:, 0].min(), "the best by the first criterion comes first"


@pytest.mark.slow
def test_refined_fronts_hold_nobody_twice(small: Catalogue) -> None:
    found = small.find(LINE, rank_by=["size", "transmission"], limit=8, families=["four-bar"])
    assert len(found) == 8
    assert min(c.nearest or 1.0 for c in found) > 1e-6
    front = [c for c in found if c.front == 1]
    assert len(front) >= 3
    size, angle = np.array([c.size for c in front]), np.array([c.min_transmission for c in front])
    order = np.argsort(size)
    assert (np.diff(angle[order]) > 0).all(), "what is larger transmits better"
    assert {c.front for c in small.find(LINE, refine=False)} == {None}


@pytest.mark.parametrize("names", [["size"], [], ["size", "beauty"]], ids=str)
def test_impossible_fronts_are_refused(small: Catalogue, names: list[str]) -> None:
    with pytest.raises(InvalidRequest, match=r"two criteria or more|cannot rank by beauty"):
        small.find(LINE, rank_by=names)
