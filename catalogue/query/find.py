"""Answer a request: narrow in SQL, lay along the path, measure on the finite motion, check, rank."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np

from ..linkage import Array
from ..store import Database
from .constraints import Constraints
from .improve import REFINED, improved, strayed, with_cognates, with_round_lengths
from .lay import Answers, canonical, final, laid, merged, together
from .narrow import narrow
from .ranking import Ranking, given, price
from .request import Request
from .search import search
from .strokes import attempts
from .trail import Trail

#: Stored guides that are traced for one answer of effort 1.
CANDIDATES = 400
#: How many answers are searched for each one that is given, if those are to be unlike each other.
AMONG_LIKE = 2
#: Of the answers that are refined a series may take so much less than its part (a fraction) that others are among them,
#: some being alike in the end.
MODEST = (7, 10)
#: Answers nearer to each other than this are one.
IDENTICAL = 1e-6
#: Constraints on where the pivots stand and how far apart: cognates have other pivots.
PLACES = ("fixed_pivots_in", "pivots_in", "max_size", "max_link", "min_link", "max_ground", "max_arm")


def answer(
    database: Database,
    request: Request,
    wanted: Constraints,
    ranking: Ranking,
    *,
    limit: int,
    effort: int,
    trail: Trail,
    refine: bool = False,
    cognates: bool = False,
    round_to: float | None = None,
) -> Answers | None:
    """Return at most `limit` verified answers, best first, or None if there is none.

    With `round_to` their lengths are made multiples of it, and those that meet the constraints so are kept.
    With `cognates` those of all traced guides are answers too.
    With `refine` the best `REFINED` per unit of effort, at least `limit`, are refined before they are ranked again, in
    more rounds the larger the effort.
    """
    count = max(CANDIDATES * effort, 4 * limit)
    wide = max(REFINED * effort, limit) if refine or round_to is not None else limit
    share = -(-MODEST[0] * ranking.per_series * wide // (MODEST[1] * limit))
    more = replace(ranking, per_series=max(ranking.per_series, share))
    parts = []
    for rank in [{name: 1.0} for name in ranking.front] or [dict(ranking.weights)]:
        if list(rank) == ["balance"] and not cognates and request.radius is not None:
            many = AMONG_LIKE * wide if ranking.distinct else wide
            each = -(-more.per_series * many // wide)
            found, good = _searched(
                database, request, wanted, rank, trail,
                limit=many, per_series=each, count=count, distinct=ranking.distinct, fine=refine or effort > 1,
            )  # fmt: skip
        else:
            found, good = _gathered(database, request, wanted, rank, trail, count, cognates)
        if found is not None and good.any():
            parts.append(found[np.flatnonzero(good)])
    if not parts:
        return None
    found = _united(parts)
    good = np.ones(len(found.point), bool)
    if refine:
        stop = trail.timed("refine")
        found = improved(given(found, good, request, more, wide), request, wanted, dict(ranking.weights), effort)
        found, good = strayed(found, wanted), np.ones(len(found.point), bool)
        stop()
    if round_to is not None:
        stop = trail.timed("round lengths")
        found, good = with_round_lengths(found, round_to, request, wanted)
        stop()
        if not good.any():
            trail.removed["round_to"] = len(good)
            return None
    if ranking.front:  # what was found by two criteria may have been refined to one
        ranking = replace(ranking, distinct=max(ranking.distinct, IDENTICAL))
    return final(given(found, good, request, ranking, limit), request)


def _united(parts: list[Answers]) -> Answers:
    """Return the answers of several searches, each once: those of one guide may differ in their stroke."""
    found = parts[0]
    for part in parts[1:]:
        names = found.rows.keys() & part.rows.keys()
        one, two = (replace(a, rows={k: v for k, v in a.rows.items() if k in names}) for a in (found, part))
        found = together(one, two)
    if len(parts) == 1:
        return found
    what = np.stack([found.rows["id"].astype(float), found.measures.size, found.measures.min_transmission], axis=1)
    return found[np.sort(np.unique(what, axis=0, return_index=True)[1])]


def _searched(
    database: Database, request: Request, wanted: Constraints, rank: dict[str, float], trail: Trail, **how: Any
) -> tuple[Answers | None, Array]:
    """Return what was traced until the best are certain, and which of it meets all constraints; see `search`."""
    trail.seconds["narrow in the database"] = 0.0
    stop = trail.timed("narrow in the database")

    def measured(rows: dict[str, Array]) -> tuple[Answers, Array, Array]:
        done = trail.timed("trace and place")
        found, good = _measured(request, wanted, rank, rows, trail)
        done()
        return found, good, price(found, request, rank)

    found, good, trail.certain = search(database, request, wanted, measured, **how)
    stop()
    trail.seconds["narrow in the database"] -= trail.seconds.get("trace and place", 0.0)
    return found, good


def _gathered(
    database: Database,
    request: Request,
    wanted: Constraints,
    rank: dict[str, float],
    trail: Trail,
    count: int,
    cognates: bool,
) -> tuple[Answers | None, Array]:
    """Return the most promising guides of each series, all traced, and which of them meet all constraints."""
    stop = trail.timed("narrow in the database")
    rows = narrow(database, request, wanted, rank, count)
    if cognates:  # of guides too whose own pivots stand elsewhere, or farther apart
        anywhere = Constraints(**{f.name: getattr(wanted, f.name) for f in fields(wanted) if f.name not in PLACES})
        rows = _both(rows, narrow(database, request, anywhere, rank, count))
    stop()
    if not len(rows["id"]):
        return None, np.zeros(0, bool)
    stop = trail.timed("trace and place")
    found, good = _measured(request, wanted, rank, rows, trail)
    if cognates:
        found, good = with_cognates(found, good, request, wanted)
    stop()
    return found, good


def _measured(
    request: Request, wanted: Constraints, rank: dict[str, float], rows: dict[str, Array], trail: Trail
) -> tuple[Answers, Array]:
    """Trace and lay the rows; return the answers and which of them meet all constraints."""
    trail.traced += len(rows["id"])
    guides = canonical(rows)
    first, *others = attempts(request, wanted, rank)
    found, checks = laid(request, wanted, rows, guides, first(rows, guides))
    for attempt in others:
        open_ = ~np.logical_and.reduce(list(checks.values()))
        if not open_.any():
            break
        some = {k: v[open_] for k, v in rows.items()}
        second, second_checks = laid(request, wanted, some, guides[open_], attempt(some, guides[open_]))
        good = np.logical_and.reduce(list(second_checks.values()))
        open_[open_] = good
        found = merged(found, second[good], open_)
        for name, passed in checks.items():
            passed[open_] = second_checks[name][good]
    for name, passed in checks.items():
        if not passed.all():
            trail.removed[name] = trail.removed.get(name, 0) + int((~passed).sum())
    return strayed(found, wanted), np.logical_and.reduce(list(checks.values()))


def _both(one: dict[str, Array], two: dict[str, Array]) -> dict[str, Array]:
    """Return the rows of both, those of `one` first, none twice."""
    if not len(one["id"]) or not len(two["id"]):
        return two if len(two["id"]) else one
    new = ~np.isin(two["id"], one["id"])
    return {name: np.concatenate([values, two[name][new]]) for name, values in one.items()}
