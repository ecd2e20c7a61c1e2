"""Select answers: the best ones that differ from each other.

The number of answers of one series is limited as long as other series have any.  Several criteria
give Pareto fronts, one after the other, each spread over its range.

The distance of two designs does not depend on scale, placement and mirror image. A candidate is
placed so that its path runs from (0, 0) to (stroke, 0); it may still be mirrored in the line of the
path and across its middle (an arc only across), and its dyads may be exchanged. A pivot is
represented by the line to it from an eye one stroke above the middle of the path; the distance of
two pivots is the sine of the angle between their lines. This is a metric, 0 to 1, also for pivots
at infinity: near the path it is the distance over the stroke, far away that of the directions.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..kinematics.types import Array, Floats, Indices, Integers
from ..problem.problem import Problem
from .batch import CandidateBatch
from .feasibility import cost, faults, values


class SelectionOptions(NamedTuple):
    """Options of the selection of unlike candidates."""

    alike: float = 0.03  #: distance up to which starts are alike, see `distances`
    compared: int = 4  #: candidates compared per candidate kept
    block: int = 4096  #: pairs of designs compared at once
    decimals: int = 9  #: Decimals of criteria in a front: a smaller difference is rounding.
    identical: float = 1e-6  #: distance up to which answers are one


SELECTION = SelectionOptions()


def normal_form(pivots: Floats, stroke: float) -> Floats:
    """Convert pivots (n, 2, 2, 3) to unit vectors (n, 4, 3): dyad by dyad, fixed pivots first."""
    unit = pivots.copy()
    unit[..., 0] -= 0.5 * stroke * unit[..., 2]
    unit[..., 2] *= stroke
    return np.asarray(unit / np.linalg.norm(unit, axis=-1, keepdims=True)).reshape(len(pivots), 4, 3)


def equivalent_views(designs: Floats, *, mirror: bool) -> Floats:
    """Return all equivalent views of designs, unit vectors (m, k, 3).

    The views are those from the other side, with `mirror` also those mirrored in the path, and
    those with the dyads exchanged; shape (k, 3, m * views).
    """
    signs = np.array([(1, 1, 1), (-1, 1, 1), (1, -1, 1), (-1, -1, 1)][: 4 if mirror else 2], designs.dtype)
    seen = designs[:, None] * signs[:, None]
    exchanged = [2, 3, 0, 1, *range(4, designs.shape[1])]
    poses = np.stack([seen, seen[:, :, exchanged]], axis=2)
    return poses.transpose(3, 4, 0, 1, 2).reshape(*designs.shape[1:], -1)


def distances(some: Floats, others: Floats, *, mirror: bool) -> Floats:
    """Compute the distances of designs (m, 4, 3) from others (n, 4, 3); see `normal_form`.

    The distance is the largest one of a pivot, minimised over all views; with `mirror`, for
    straight paths, they include views mirrored in the path. Shape (m, n), 0 to 1; rounding turns 0
    into up to 3e-8.
    """
    poses = equivalent_views(some, mirror=mirror)
    found = np.empty((len(some), len(others)))
    step = max(1, SELECTION.block // max(len(some), 1))
    for start in range(0, len(others), step):
        part = others[start : start + step].transpose(1, 0, 2)
        # cosine of the pivot with the largest distance
        cosine = np.abs(part @ poses).min(axis=0).reshape(part.shape[1], len(some), -1)
        found[:, start : start + step] = np.sqrt(np.maximum(1 - cosine.max(axis=-1).T ** 2, 0.0))
    return found


def nearest(designs: Floats, *, mirror: bool) -> Floats:
    """Return the distance of each design from the nearest other, (n,); NaN for one alone."""
    if len(designs) < 2:
        return np.full(len(designs), np.nan)
    away = distances(designs, designs, mirror=mirror)
    np.fill_diagonal(away, np.inf)
    return np.asarray(away.min(axis=1))


def unlike(pivots: Floats, merit: Floats, count: int, *, mirror: bool) -> Indices:
    """Select the best placed designs (n, 2, 2, 3), each unlike the others.

    Parameters
    ----------
    merit : ndarray, shape (n,)
        Cost to minimise; designs with infinite or NaN merit are omitted.
    count : int
        Largest number.
    mirror : bool
        See `distances`.
    """
    order = np.argsort(merit, kind="stable")
    order = order[np.isfinite(merit[order])][: SELECTION.compared * count]
    designs = normal_form(pivots[order], 1.0)
    kept: list[int] = []
    like = np.zeros(len(order), bool)
    for i in range(len(order)):
        if not like[i] and len(kept) < count:
            kept.append(i)
            like |= distances(designs[i : i + 1], designs, mirror=mirror)[0] < SELECTION.alike
    return order[kept]


def unlike_rows(values: Floats, alike: float) -> Indices:
    """Select the rows (n, d), the best first, that differ from all selected before them.

    Rows are alike if no number differs by more than `alike`.
    """
    kept: list[int] = []
    for i in range(len(values)):
        if not kept or (np.abs(values[i] - values[kept]).max(1) > alike).all():
            kept.append(i)
    return np.array(kept, int)


def fronts(values: Floats) -> Integers:
    """Return the Pareto front of each row of criteria (n, k), less is better; from 1, (n,).

    A row dominates another if no criterion is larger and one is smaller.  Front 1 has the rows that
    none dominates, front 2 those that only front 1 dominates, and so on (Goldberg 1989,
    nondominated sorting).  Criteria must not be NaN.
    """
    number = np.zeros(len(values), int)
    for i in np.lexsort(values.T[::-1]):  # no row is dominated by a later one
        dominating = (values <= values[i]).all(1) & (values < values[i]).any(1)
        number[i] = 1 + number[dominating].max(initial=0)
    return number


def spread_order(values: Floats, key: Integers) -> tuple[Indices, Integers]:
    """Order rows of criteria (n, k) front by front; return the order, and the front of each row.

    A front begins with the best by the first criterion; each next row is the farthest from those
    before it, in ranges of the criteria over the front, so that the first few cover all of it.  A
    `key` (n,) decides between equal rows.
    """
    number = fronts(values)
    order: list[int] = []
    for front in range(1, number.max(initial=0) + 1):
        rows = np.flatnonzero(number == front)
        rows = rows[np.lexsort((key[rows], *values[rows].T[::-1]))]
        low, high = values[rows].min(0), values[rows].max(0)
        place = (values[rows] - low) / np.where(high > low, high - low, 1.0)
        distance, taken = np.full(len(rows), np.inf), 0
        for _ in rows:
            order.append(int(rows[taken]))
            distance = np.minimum(distance, np.abs(place - place[taken]).max(1))
            distance[taken] = -1.0
            taken = int(np.argmax(distance))
    return np.array(order, dtype=int), number


def ranks(*keys: Array) -> Indices:
    """Count the earlier entries with equal keys, int or str arrays (n,), shape (n,)."""
    if not len(keys[0]):
        return np.zeros(0, int)
    order = np.lexsort(keys)  # stable
    new = np.concatenate([[True], np.any([key[order][1:] != key[order][:-1] for key in keys], axis=0)])
    rank = np.empty(len(order), int)
    rank[order] = np.arange(len(order)) - np.maximum.accumulate(np.where(new, np.arange(len(order)), 0))
    return rank


def select_top(problem: Problem, found: CandidateBatch) -> tuple[CandidateBatch, Integers]:
    """Select the requested number of feasible candidates, by faults and cost or by front.

    Returns
    -------
    CandidateBatch, ndarray of int
        Selected candidates, and the numbers of their Pareto fronts, from 1; 0 without fronts.
    """
    ranking, key = problem.ranking, found.origin.id
    number = np.zeros(len(found), int)
    if not ranking.front:
        order = np.lexsort((key, cost(problem, found), faults(problem, found)))
        chosen = _select_varied(problem, found, order)
        return found[chosen], number[chosen]
    here = values(problem, found)
    table = np.stack([ranking.criterion(name, here) for name in ranking.front], axis=1).round(SELECTION.decimals)
    order, number = spread_order(table, key)
    chosen = _select_varied(problem, found, order)
    chosen = chosen[np.lexsort((key[chosen], *table[chosen].T[::-1], number[chosen]))]
    return found[chosen], number[chosen]


def _select_varied(problem: Problem, found: CandidateBatch, order: Indices) -> Indices:
    """Select the first entries of an order, each unlike the others.

    At most the requested number is selected, and few of one series while others have entries.
    """
    designs, ranking = normal_form(found.linkage.pivots, 1.0), problem.ranking
    apart = max(ranking.distinct, SELECTION.identical)
    like = np.zeros(len(order), bool)
    count: dict[str, int] = {}
    kept: list[int] = []
    later: list[int] = []
    for last, some in ((False, order.tolist()), (True, later)):
        for i in some:
            code = str(found.origin.series[i])
            if like[i]:
                continue
            if len(kept) == problem.limit:
                break
            if not last and ranking.per_series and count.get(code, 0) >= ranking.per_series:
                later.append(i)
                continue
            kept.append(i)
            count[code] = count.get(code, 0) + 1
            like |= distances(designs[i : i + 1], designs, mirror=problem.curvature == 0)[0] < apart
    return order[np.isin(order, kept)]
