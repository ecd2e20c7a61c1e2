"""Which candidates are given, against the obvious slow way to choose them."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from catalogue import CircularArc, StraightLine
from catalogue.candidates.feasibility import cost
from catalogue.candidates.select import SELECTION, distances, normal_form, ranks, select_top
from catalogue.kinematics.batch import join

LINE, ARC = StraightLine(1, 1e-3), CircularArc(1, 1e-3, 1.5)


def chosen(problem: Any, found: Any, limit: int) -> list[int]:
    """Return whom a clerk picks: down the list, nobody like one before, few of a series, others if there is room."""
    price = cost(problem, found)
    form = normal_form(found.linkage.pivots, 1.0)
    apart = distances(form, form, mirror=problem.curvature == 0)
    waiting = sorted(range(len(found)), key=lambda i: (price[i], found.origin.id[i]))
    picked: list[int] = []
    for bounded in (True, False):
        for i in waiting:
            if len(picked) == limit or i in picked:
                continue
            if any(apart[i, j] < max(problem.ranking.distinct, SELECTION.identical) for j in picked):
                continue
            same = sum(found.origin.series[j] == found.origin.series[i] for j in picked)
            if bounded and problem.ranking.per_series and same >= problem.ranking.per_series:
                continue
            picked.append(i)
    return sorted(picked, key=waiting.index)


@pytest.mark.parametrize("request_", [LINE, ARC], ids=["line", "arc"])
@pytest.mark.parametrize("per_series", [0, 1, 3])
@pytest.mark.parametrize("distinct", [0.0, 0.1, 0.4])
def test_a_clerk_chooses_the_same(batch: Any, request_: Any, per_series: int, distinct: float) -> None:
    problem, found = batch(request_, rank_by="balance", per_series=per_series, distinct=distinct)
    found = found[np.flatnonzero(np.isfinite(found.deviation))]
    for limit in (1, 5, 12, len(found)):
        given, front = select_top(replace(problem, limit=limit), found)
        expected = chosen(problem, found, limit)
        assert given.origin.id.tolist() == found.origin.id[expected].tolist()
        assert not front.any()


def test_how_candidates_come_does_not_matter(batch: Any) -> None:
    problem, found = batch(LINE, rank_by="size", per_series=2, distinct=0.05)
    found = found[np.flatnonzero(np.isfinite(found.deviation))]
    mixed = found[np.random.default_rng(4).permutation(len(found))]
    one, other = (select_top(replace(problem, limit=10), some)[0].origin.id.tolist() for some in (found, mixed))
    assert one == other
    counted = Counter(select_top(replace(problem, limit=8), found)[0].origin.series.tolist())
    assert max(counted.values()) <= 2


def test_one_design_is_given_once(batch: Any) -> None:
    """A copy that differs by rounding, or is the mirror image in the line, is the same answer."""
    problem, found = batch(LINE, count=12)
    found = found[np.flatnonzero(np.isfinite(found.deviation))]
    pivots = found.linkage.pivots.copy()
    pivots[..., 1] *= -1
    image = replace(found, linkage=type(found.linkage)(pivots * np.array([1 + 1e-12, 1, 1])))
    problem = replace(problem, limit=100)
    twice, _ = select_top(problem, join(found, image))
    once, _ = select_top(problem, found)
    assert len(twice) == len(once)


def test_a_front_comes_before_the_next(batch: Any) -> None:
    problem, found = batch(LINE, rank_by=["size", "transmission"])
    found = found[np.flatnonzero(np.isfinite(found.deviation))]
    given, front = select_top(replace(problem, limit=30), found)
    assert front.tolist() == sorted(front.tolist())
    assert front[0] == 1
    worse = np.stack([given.measures.size, -given.measures.min_transmission]).round(9)
    for i in range(len(given)):
        better = (worse <= worse[:, [i]]).all(0) & (worse < worse[:, [i]]).any(0)
        assert (front[better] < front[i]).all()


def test_ranks_count_who_is_alike_and_comes_before() -> None:
    draw = np.random.default_rng(3)
    keys = draw.integers(0, 4, (2, 60))
    expected = [sum((keys[:, j] == keys[:, i]).all() for j in range(i)) for i in range(60)]
    assert ranks(*keys).tolist() == expected
    assert ranks(*np.zeros((2, 0))).tolist() == []
