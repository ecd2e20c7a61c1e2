"""Which candidates are given: the best that are unlike each other, few of a series as long as there are others."""

from __future__ import annotations

import numpy as np

from ..kinematics.types import Array
from ..problem.problem import Problem
from .batch import CandidateBatch
from .feasibility import cost, values
from .pareto import spread_order
from .similarity import distances, normal_form

#: Criteria that differ by less than a unit of this decimal are equal in a front: rounding is no merit.
DECIMALS = 9
#: Answers nearer to each other than this are one.
IDENTICAL = 1e-6


def select_top(problem: Problem, found: CandidateBatch, limit: int) -> tuple[CandidateBatch, Array]:
    """Return the best candidates in their order, at most `limit`, and the number of the Pareto front of each, from 1;
    0 without fronts.

    Parameters
    ----------
    found : CandidateBatch of n
        All of which meet the constraints.
    """
    ranking, key = problem.ranking, found.origin.id
    number = np.zeros(len(found), int)
    if not ranking.front:
        order = np.lexsort((key, cost(problem, found)))
        chosen = _varied(problem, found, order, limit)
        return found[chosen], number[chosen]
    here = values(problem, found)
    table = np.stack([ranking.criterion(name, here) for name in ranking.front], axis=1).round(DECIMALS)
    order, number = spread_order(table, key)
    chosen = _varied(problem, found, order, limit)
    chosen = chosen[np.lexsort((key[chosen], *table[chosen].T[::-1], number[chosen]))]
    return found[chosen], number[chosen]


def _varied(problem: Problem, found: CandidateBatch, order: Array, limit: int) -> Array:
    """Return the first `limit` of an order that are unlike each other, few of a series as long as there are others."""
    designs, ranking = normal_form(found.linkage.pivots, 1.0), problem.ranking
    apart = max(ranking.distinct, IDENTICAL)
    like = np.zeros(len(order), bool)
    count: dict[str, int] = {}
    kept: list[int] = []
    later: list[int] = []
    for last, some in ((False, order.tolist()), (True, later)):
        for i in some:
            code = str(found.origin.series[i])
            if like[i]:
                continue
            if len(kept) == limit:
                break
            if not last and ranking.per_series and count.get(code, 0) >= ranking.per_series:
                later.append(i)
                continue
            kept.append(i)
            count[code] = count.get(code, 0) + 1
            like |= distances(designs[i : i + 1], designs, mirror=problem.curvature == 0)[0] < apart
    place = np.empty(len(order), int)
    place[order] = np.arange(len(order))
    return np.array(sorted(kept, key=place.__getitem__), dtype=int)
