"""In which order answers come, and which of them are given."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..errors import InvalidRequest
from ..linkage import Array
from .criteria import weights
from .fronts import spread_order
from .lay import Answers
from .likeness import distances, normal_form
from .request import Request, whole

#: Criteria that differ by less than a unit of this decimal are equal in a front: rounding is no merit.
DECIMALS = 9


@dataclass(frozen=True)
class Ranking:
    """An order of preference.

    Attributes
    ----------
    weights : mapping
        Criteria with weights, whose sum ranks; with a front all of them, for what needs one number.
    front : tuple of str
        Criteria that are not to be weighed against each other: answers come by Pareto fronts.
    per_series : int
        At most so many answers of a series as long as there are others; 0: no bound.
    distinct : float
        No two answers are nearer to each other, see `catalogue.query.likeness`; 0: no matter.
    """

    weights: Mapping[str, float] = field(default_factory=lambda: {"balance": 1.0})
    front: tuple[str, ...] = ()
    per_series: int = 0
    distinct: float = 0.0

    @classmethod
    def of(cls, rank_by: Any, per_series: int | None, distinct: Any, limit: int) -> Ranking:
        """Return the ranking that is asked for; see `Catalogue.find`.

        Raises
        ------
        InvalidRequest
            If a criterion is unknown, or a number out of range.
        """
        front: tuple[str, ...] = ()
        if isinstance(rank_by, Sequence) and not isinstance(rank_by, str):
            front = tuple(dict.fromkeys(rank_by))
            if len(front) < 2:
                raise InvalidRequest("a front needs two criteria or more: rank by one with its name")
            rank_by = dict.fromkeys(front, 1.0)
        usual = 0 if front else -(-limit // 3)
        share = usual if per_series is None else whole("per_series", per_series, 0)
        try:
            least = float(distinct)
        except (TypeError, ValueError):
            least = np.nan
        if not 0 <= least < 1:
            raise InvalidRequest(f"distinct must be a number from 0 to below 1, not {distinct!r}")
        return cls(weights(rank_by), front, share, least)


def score(found: Answers, request: Request) -> Array:
    """Return one mark for each answer, 0 to 100, shape (n,).

    The geometric mean of three shares, as Derringer and Suich (1980) join desirabilities: the stroke of the size, the
    sine of the least transmission angle, and one less half the deviation over the one allowed.  100 is a straight path
    of a linkage that is no larger than it and always pushes square.
    """
    m = found.measures
    used = np.clip(found.traced.fit.deviation.astype(float) / request.deviation, 0.0, 1.0)
    with np.errstate(invalid="ignore"):
        share = np.minimum(request.stroke / m.size, 1.0) * np.sin(np.radians(m.min_transmission)) * (1 - 0.5 * used)
        return np.asarray(100 * np.cbrt(share))


def criterion(name: str, found: Answers, request: Request) -> Array:
    """Return a criterion of each answer as a number of order 1 of which less is better, shape (n,)."""
    m, s = found.measures, request.stroke
    if name == "balance":
        return np.asarray(m.size / s - m.min_transmission / 90)
    if name == "transmission":
        return np.asarray(1 - m.min_transmission / 90)
    if name == "deviation":
        return np.asarray((found.traced.fit.deviation.astype(float) + found.rows.get("stray", 0.0)) / request.deviation)
    if name == "score":
        return np.asarray(1 - score(found, request) / 100)
    return np.asarray(np.nan_to_num(getattr(m, name)) / s)


def price(found: Answers, request: Request, rank: Mapping[str, float]) -> Array:
    """Return what each answer is ranked by: the weighted sum of its criteria, less is better, shape (n,)."""
    return np.asarray(sum(weight * criterion(name, found, request) for name, weight in rank.items()))


def forms(found: Answers, request: Request) -> Array:
    """Return answers as designs to be compared, shape (n, 4, 3); see `catalogue.query.likeness`."""
    return normal_form(found.linkage.pivots, request.stroke)


def given(found: Answers, good: Array, request: Request, ranking: Ranking, limit: int) -> Answers:
    """Return the best `limit` of the good answers, in their order; with fronts their number is in the row ``front``."""
    found = found[np.flatnonzero(good)]
    key = found.rows["id"]
    if ranking.front:
        values = np.stack([criterion(name, found, request) for name in ranking.front], axis=1).round(DECIMALS)
        order, number = spread_order(values, key)
        found.rows["front"] = number
        chosen = _varied(found, order, request, ranking, limit)
        return found[chosen[np.lexsort((key[chosen], *values[chosen].T[::-1], number[chosen]))]]
    order = np.lexsort((key, price(found, request, ranking.weights)))
    return found[_varied(found, order, request, ranking, limit)]


def _varied(found: Answers, order: Array, request: Request, ranking: Ranking, limit: int) -> Array:
    """Return the first `limit` of an order that are unlike each other, few of a series as long as there are others."""
    designs = forms(found, request)
    like = np.zeros(len(order), bool)
    count: dict[str, int] = {}
    kept: list[int] = []
    later: list[int] = []
    for last, some in ((False, order.tolist()), (True, later)):
        for i in some:
            code = found.rows["series"][i]
            if like[i]:
                continue
            if len(kept) == limit:
                break
            if not last and ranking.per_series and count.get(code, 0) >= ranking.per_series:
                later.append(i)
                continue
            kept.append(i)
            count[code] = count.get(code, 0) + 1
            if ranking.distinct:
                like |= distances(designs[i : i + 1], designs, mirror=request.kind == "line")[0] < ranking.distinct
    place = np.argsort(order)
    return np.array(sorted(kept, key=place.__getitem__), dtype=int)
