"""Answer a request for which pivots are given: closed-form guides of every series, refined where they stand.

The guided point is posed at many places of the path; each series gives the linkages that guide it there, and more are
completed numerically.  They are traced in place, the straightest are refined with the given pivots held, and what comes
of them is checked and ranked.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..errors import InvalidRequest
from ..guide.in_place import Nominal, in_place
from ..guide.span import span
from ..instant import Instant, leading_error
from ..linkage import Array, Linkage
from ..posed import Posed
from ..series import Series
from .complete import completed
from .constraints import Constraints
from .improve import REFINED, improved
from .lay import SHOWN, Answers, in_its_place
from .ranking import Ranking, given
from .request import Request
from .trail import Trail

#: Places of the path, from start to end, at which the point is posed when the fixed pivots are given.
PLACES = np.linspace(0.04, 0.96, 47)
#: Pairs of pivots tried within a tolerance, per unit of effort.
PAIRS = 24
#: Guides that are refined, in terms of those that a search refines; and with how much effort: starts may be far off.
SPARE, EFFORT = 3, 256
#: Which coordinates are held: of A1, A1*, A2, A2*, and of the point, which in mid-stroke may move across only.
HELD = {
    "fixed": np.array([1, 1, 0, 0, 1, 1, 0, 0, 0, 0], bool),
    "moving": np.array([0, 0, 1, 1, 0, 0, 1, 1, 1, 0], bool),
    "crank": np.array([1, 1, 1, 1, 0, 0, 0, 0, 1, 0], bool),
}
#: No pivot stands farther from the middle of the path, in strokes: its rounding would move the path by 1e-12 of that.
FARTHEST = 1e4
#: Nor so many times as far as the stroke is long, and the given pivots are off.
FARTHER = 100.0
#: Designs whose pivots and points differ by less than this part of the stroke are one.
SAME = 1e-3


@dataclass(frozen=True)
class Built:
    """Guides in the position in which their series gives them, with what is known of them."""

    linkage: Linkage
    point: Array
    series: Array
    exact: Array

    def __getitem__(self, index: Array) -> Built:
        return Built(self.linkage[index], self.point[index], self.series[index], self.exact[index])

    def followed_by(self, other: Built) -> Built:
        """Return these and then the others."""
        linkage = Linkage._trusted(np.concatenate([self.linkage.pivots, other.linkage.pivots]))
        rest = ((getattr(self, name), getattr(other, name)) for name in ("point", "series", "exact"))
        return Built(linkage, *(np.concatenate(two) for two in rest))


def constructed(
    series: Mapping[str, Series], request: Request, wanted: Constraints, ranking: Ranking, *, limit: int, effort: int,
    trail: Trail,
) -> Answers | None:  # fmt: skip
    """Return at most `limit` guides with the given pivots, best first, or None if there is none."""
    assert wanted.given is not None
    stop = trail.timed("solve in closed form")
    problems = posed(request, wanted, effort)
    unknown = [code for code in wanted.series if code not in series]
    if unknown:
        raise InvalidRequest(f"no plugin provides series {unknown[0]!r}; there are {', '.join(series)}")
    built = solved([series[code] for code in wanted.series or series], problems, wanted)
    trail.solved = len(built.point)
    stop()
    nominal = _nominal(request, wanted)
    built = built[_near(built.linkage, request, wanted)]
    if not wanted.series and (not wanted.families or "four-bar" in wanted.families):
        stop = trail.timed("complete")
        more = _completed(problems, nominal)
        trail.completed = len(more.point)
        built = built.followed_by(more)
        stop()
    stop = trail.timed("trace in place")
    traced = in_place(span(built.linkage, built.point), nominal)
    order = np.argsort(np.where(np.isnan(traced.fit.deviation), np.inf, traced.fit.deviation), kind="stable")
    order = order[: np.isfinite(traced.fit.deviation).sum()]
    trail.traced = len(order)
    order = _seeds(built, order, request, SPARE * REFINED * effort)
    stop()
    if not len(order):
        return None
    stop = trail.timed("refine")
    ancestors = built[order]
    found, checks = _refined(ancestors, request, wanted, dict(ranking.weights), nominal, effort)
    good = np.logical_and.reduce(list(checks.values()))
    trail.removed = {name: int((~passed).sum()) for name, passed in checks.items() if not passed.all()}
    deviation = np.where(np.isnan(found.traced.fit.deviation), np.inf, found.traced.fit.deviation)
    best = np.argsort(deviation, kind="stable")
    best = best[good[best]]
    trail.least = float(deviation.min())
    stop()
    if not len(best):
        return None
    made = replace(ancestors, linkage=found.linkage, point=found.point)
    best = best[distinct(made[best], request, len(best))]
    return given(found[best], np.ones(len(best), bool), request, ranking, limit)


def posed(request: Request, wanted: Constraints, effort: int) -> Posed:
    """Return the problems that a request with given pivots poses."""
    kind, pivots = wanted.given, np.array([complex(*p) for p in wanted.places])
    assert kind is not None
    far = np.abs(pivots - 0.5 * request.stroke) > FARTHEST * request.stroke
    if far.any():
        x, y = wanted.places[int(far.argmax())]
        raise InvalidRequest(
            f"the pivot ({x:g}, {y:g}) is more than {FARTHEST:g} strokes from the path, where its rounding decides: "
            "move it nearer, or ask for a slider"
        )
    places = PLACES if kind == "fixed" else np.array([0.5])
    pairs = pivots[None]
    if wanted.within:
        drawn = np.random.default_rng(0).random((PAIRS * effort, 4))
        off = np.sqrt(drawn[:, :2]) * np.exp(2j * np.pi * drawn[:, 2:])  # uniform over the disc
        pairs = np.concatenate([pairs, pivots + wanted.within * off])
    nominal = _nominal(request, wanted)
    point, across = nominal.at(np.tile(places, len(pairs)))
    return Posed(kind, np.repeat(pairs, len(places), axis=0), point, np.full(len(point), nominal.centre), across)


def _nominal(request: Request, wanted: Constraints) -> Nominal:
    if request.radius is None:
        what = "a crank is" if wanted.given == "crank" else f"{wanted.given} pivots are"
        raise InvalidRequest(f"give the radius of the arc too, where {what} given")
    return Nominal(request.stroke, request.radius)


def solved(series: Iterable[Series], problems: Posed, wanted: Constraints) -> Built:
    """Return all linkages that the series give, of the families that are wanted."""
    pivots, points, codes = [np.zeros((0, 2, 2, 3))], [np.zeros(0, complex)], [np.zeros(0, "<U9")]
    exact, first = [np.zeros(0, bool)], (problems.pivots == problems.pivots[:1]).all(1)
    for one in series:
        answers = one.answers(problems)
        k = answers.shape[1]
        linkage, good = Linkage.valid(answers.reshape(-1, 2, 2, 3))
        if wanted.families:
            chosen = np.isin(linkage.family, wanted.families)
            good[good] = chosen
            linkage = linkage[chosen]
        pivots.append(linkage.pivots)
        points.append(np.repeat(problems.point, k)[good])
        codes.append(np.full(len(linkage), one.code))
        exact.append(np.repeat(first, k)[good])
    return Built(Linkage._trusted(np.concatenate(pivots)), *(np.concatenate(x) for x in (points, codes, exact)))


def _completed(problems: Posed, nominal: Nominal) -> Built:
    """Return linkages for the given pivots that no series has; they count as general ones."""
    pairs = problems.pivots[:: len(PLACES)] if problems.given == "fixed" else problems.pivots
    pivots, of = completed(problems.given, pairs, nominal)
    linkage, good = Linkage.valid(pivots)
    exact = (pairs[of[good]] == pairs[0]).all(1)
    point = np.broadcast_to(nominal.at(np.array([0.5]))[0], len(linkage))
    return Built(linkage, point, np.full(len(linkage), "general"), exact)


def _near(linkage: Linkage, request: Request, wanted: Constraints) -> Array:
    """Return which linkages have no pivot much farther off than those that are given, shape (n,)."""
    middle = 0.5 * request.stroke
    given_ = max(abs(complex(*p) - middle) for p in wanted.places)
    farthest = min(FARTHER * max(given_, request.stroke), FARTHEST * request.stroke)
    off = np.where(linkage.finite, np.abs(linkage.points - middle), 0.0)
    return np.asarray((off <= farthest).all(axis=(1, 2)))


def _seeds(built: Built, order: Array, request: Request, count: int) -> Array:
    """Return the first `count` of an order that are unlike each other, of the pivots themselves and of those near."""
    exact = built.exact[order]
    some = [group[distinct(built[group], request, count)] for group in (order[exact], order[~exact])]
    return np.concatenate(some)


def distinct(built: Built, request: Request, count: int) -> Array:
    """Return the numbers of the first `count` designs that are unlike those before them."""
    z = np.concatenate([built.linkage.points.reshape(-1, 4), built.point[:, None]], axis=1)
    kept: list[int] = []
    for i in range(len(z)):
        if len(kept) == count:
            break
        if not kept or np.abs(z[kept] - z[i]).max(1).min() > SAME * request.stroke:
            kept.append(i)
    return np.array(kept, dtype=int)


def _refined(
    ancestors: Built, request: Request, wanted: Constraints, rank: dict[str, float], nominal: Nominal, effort: int
) -> tuple[Answers, dict[str, Array]]:
    """Return the refined guides in mid-stroke, and which of them satisfy each constraint."""
    from ..refine import Free

    assert wanted.given is not None
    law = leading_error(ancestors.linkage, ancestors.point, circle=request.kind == "circle", tolerance=1e-7)
    rows = {
        "id": np.full(len(law), -1),
        "series": ancestors.series,
        "family": ancestors.linkage.family,
        "configuration": Instant(ancestors.linkage).configuration,
        "contact_order": law.order,
    }
    found, _ = in_its_place(request, wanted, rows, span(ancestors.linkage, ancestors.point), nominal)
    loose = replace(request, deviation=0.1 * request.stroke)
    moves = Free(HELD[wanted.given])
    found = improved(found, loose, wanted, rank, EFFORT * effort, moves=moves, nominal=nominal)
    found, checks = in_its_place(request, wanted, found.rows, span(found.linkage, found.point), nominal, SHOWN)
    checks["the distance of the pivots"] = _near(found.linkage, request, wanted)
    if wanted.order:
        checks["order"] = law.order >= wanted.order
    return found, checks
