"""Answer a request: narrow in SQL, lay along the path, measure on the finite motion, check, rank."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from sqlalchemy import select

from ..errors import InvalidRequest
from ..guide.measures import Measures, measure
from ..guide.place import at_stroke, at_sweep, mirrored, placed
from ..guide.reach import USABLE, Ladder, reach
from ..guide.span import Span, span
from ..guide.trace import Traced, trace
from ..linkage import Array, Linkage
from ..store import Database, Mechanism
from .narrow import flips, loosest, narrow
from .request import Constraints, Region, Request

#: Stored guides that are traced for one answer of effort 1.
CANDIDATES = 400
SINGULAR = {"families": "family", "series": "series", "configurations": "configuration"}
#: Criteria for which a longer stroke of the stored mechanism is better.
SHRINKING = {"balance", "size", "max_link", "max_ground", "max_arm"}


@dataclass
class Trail:
    """How an answer came about: seconds per step, and how many candidates each constraint removed after tracing."""

    seconds: dict[str, float] = field(default_factory=dict)
    traced: int = 0
    removed: dict[str, int] = field(default_factory=dict)
    nearest: dict[str, float] = field(default_factory=dict)

    def timed(self, step: str) -> Callable[[], None]:
        """Start a step; call what is returned when it ends."""
        start = time.perf_counter()

        def stop() -> None:
            self.seconds[step] = self.seconds.get(step, 0.0) + time.perf_counter() - start

        return stop


@dataclass(frozen=True)
class Answers:
    """Placed guides with what was measured of them, best first; arrays over the n answers."""

    rows: dict[str, Array]
    linkage: Linkage
    point: Array
    traced: Traced
    measures: Measures

    def __getitem__(self, index: Array) -> Answers:
        rows = {k: v[index] for k, v in self.rows.items()}
        return Answers(rows, self.linkage[index], self.point[index], self.traced[index], self.measures[index])


def answer(
    database: Database,
    request: Request,
    wanted: Constraints,
    rank: dict[str, float],
    *,
    limit: int,
    per_series: int,
    effort: int,
    trail: Trail,
) -> Answers | None:
    """Return at most `limit` verified answers, best first, or None if there is none."""
    stop = trail.timed("narrow in the database")
    rows = narrow(database, request, wanted, rank, max(CANDIDATES * effort, 4 * limit))
    stop()
    trail.traced = len(rows["id"])
    if not trail.traced:
        return None
    stop = trail.timed("trace and place")
    measured = _measured(request, wanted, rank, rows, trail)
    stop()
    if measured is None or not measured[1].any():
        return None
    found, good = measured
    order = np.flatnonzero(good)[np.argsort(price(found, request, rank)[good], kind="stable")]
    return _final(found[_varied(found.rows["series"][order], order, limit, per_series)], request)


def _final(found: Answers, request: Request) -> Answers:
    """Return what is shown, its deviation measured in extended precision where double does not resolve it."""
    traced = at_stroke(span(found.linkage, found.point), request.stroke, circle=request.kind == "circle")
    return replace(found, traced=traced)


def price(found: Answers, request: Request, rank: dict[str, float]) -> Array:
    """Return what each answer is ranked by: the weighted sum of its criteria, less is better, shape (n,)."""
    m, s = found.measures, request.stroke
    terms = {
        "balance": m.size / s - m.min_transmission / 90,
        "size": m.size / s,
        "max_link": np.nan_to_num(m.max_link) / s,
        "max_ground": np.nan_to_num(m.max_ground) / s,
        "max_arm": m.max_arm / s,
        "transmission": 1 - m.min_transmission / 90,
        "deviation": found.traced.fit.deviation.astype(float) / request.deviation,
    }
    return np.asarray(sum(weight * terms[name] for name, weight in rank.items()))


def _varied(series: Array, order: Array, limit: int, per_series: int) -> Array:
    """Return the first `limit` of `order`, at most `per_series` of a series as long as there are others."""
    count: dict[str, int] = {}
    first: list[int] = []
    rest: list[int] = []
    for code, i in zip(series, order, strict=True):
        count[code] = count.get(code, 0) + 1
        (first if not per_series or count[code] <= per_series else rest).append(i)
    return np.array(sorted((first + rest)[:limit], key=list(order).index), dtype=int)


def _measured(
    request: Request, wanted: Constraints, rank: dict[str, float], rows: dict[str, Array], trail: Trail
) -> tuple[Answers, Array] | None:
    """Trace the rows at their best stroke; where that breaks a constraint, at the stroke that is stored."""
    pivots = rows["pivots"].reshape(-1, 2, 2, 3)
    guides = span(Linkage._trusted(np.ascontiguousarray(pivots)), rows["x"] + 1j * rows["y"])
    traced = _chosen(request, rank, rows, guides)
    there = np.isfinite(traced.fit.deviation) & (traced.fit.stroke > 0)
    if not there.any():
        trail.removed = {"deviation": len(there)}
        return None
    rows, guides, traced = {k: v[there] for k, v in rows.items()}, guides[there], traced[there]
    found, checks = _laid(request, wanted, rows, guides, traced)
    good = np.logical_and.reduce(list(checks.values()))
    if request.kind == "line" and SHRINKING & set(rank) and not good.all():
        stored = ~good & (rows["level"] <= loosest(request))
        traced = trace(guides, rows["half"], circle=False, split=True, centre=rows["centre"], nodes=16)
        second, second_checks = _laid(request, wanted, rows, guides, traced)
        use = stored & np.logical_and.reduce(list(second_checks.values()))
        found = _merged(found, second, use)
        checks = {k: np.where(use, second_checks[k], v) for k, v in checks.items()}
        good = np.logical_and.reduce(list(checks.values()))
    trail.removed = {name: int((~v).sum()) for name, v in checks.items() if not v.all()}
    return found, good


def lay_stored(request: Request, wanted: Constraints, rows: dict[str, Array]) -> Answers:
    """Return stored reaches laid along the path of a request, at the strokes that are stored."""
    guides = span(Linkage._trusted(rows["pivots"].reshape(-1, 2, 2, 3).copy()), rows["x"] + 1j * rows["y"])
    circle = request.kind == "circle"
    traced = trace(guides, rows["half"], circle=circle, split=True, centre=rows["centre"], nodes=16)
    return _laid(request, wanted, rows, guides, traced)[0]


def _chosen(request: Request, rank: dict[str, float], rows: dict[str, Array], guides: Span) -> Traced:
    """Return the guides traced over the stroke that serves the request best."""
    if request.kind == "circle":
        half = rows["half"] * request.sweep / rows["sweep"]  # type: ignore[union-attr]
        return at_sweep(guides, half, rows["centre"], request.sweep)[1]  # type: ignore[union-attr]
    if not SHRINKING & set(rank) or "deviation" in rank:
        return trace(guides, rows["half"], circle=False, split=True, centre=rows["centre"], nodes=16)
    spare = np.maximum(request.relative / np.maximum(rows["deviation"], 1e-16), 1.0)
    powers = np.array([1 / 3, 1 / 4, 1 / 5.5, 0.0])
    half = rows["half"] * np.minimum(spare ** powers[:, None], 3.0)
    low, high = guides.extent
    half = np.minimum(half, USABLE * np.minimum(low / (1 - rows["centre"]), high / (1 + rows["centre"])))
    relative = np.stack(
        [trace(guides, h, circle=False, split=True, centre=rows["centre"], nodes=16).relative for h in half]
    )
    return reach(guides, Ladder(half, relative, rows["centre"]), request.relative * 0.999, circle=False)[1]


def _laid(
    request: Request, wanted: Constraints, rows: dict[str, Array], guides: Span, traced: Traced
) -> tuple[Answers, dict[str, Array]]:
    """Lay traced guides along the path, measure them there, and return which satisfy each constraint."""
    circle = request.kind == "circle"
    linkage, point = placed(guides, traced, request.stroke)
    n = len(point)
    if circle:  # the arc is to bulge to +y
        linkage, point = mirrored(linkage, point, request.stroke, np.zeros(n, bool), traced.fit.curvature > 0)
    reverse, over, inside = _orientation(request, wanted, linkage)
    linkage, point = mirrored(linkage, point, request.stroke, reverse, over)
    here = span(linkage, point)
    now = at_stroke(here, request.stroke, circle=circle, extend=False)
    m = measure(here, now)
    with np.errstate(invalid="ignore"):
        held = np.abs(now.fit.stroke - request.stroke) <= 1e-6 * request.stroke
        checks = {"stroke": held, "deviation": now.fit.deviation <= request.deviation}
        if circle:
            checks["radius"] = np.abs(1 / np.abs(now.fit.curvature) - request.radius) <= 1e-3 * request.radius
        for name in ("max_size", "max_link", "max_ground", "max_arm"):
            bound = getattr(wanted, name)
            if bound is not None:
                checks[name] = ~(getattr(m, name.replace("max_size", "size")) > bound)
        if wanted.min_link is not None:
            checks["min_link"] = ~(m.min_link < wanted.min_link)
        checks["min_transmission"] = m.min_transmission >= wanted.min_transmission
        if wanted.full_rotation:
            checks["full_rotation"] = m.rotates > 0
        if wanted.fixed_pivots_in is not None or wanted.pivots_in is not None:
            checks["pivots inside"] = inside
    return Answers(rows, linkage, point, now, m), checks


def _orientation(request: Request, wanted: Constraints, linkage: Linkage) -> tuple[Array, Array, Array]:
    """Return how to lay each guide so that its pivots stand inside the regions: reverse, over, and whether they do."""
    n = len(linkage)
    reverse, over, inside = np.zeros(n, bool), np.zeros(n, bool), np.zeros(n, bool)
    for flip in flips(request):
        laid, _ = mirrored(linkage, np.zeros(n, complex), request.stroke, np.full(n, flip[0]), np.full(n, flip[1]))
        good = _inside(wanted.fixed_pivots_in, laid, (0,)) & _inside(wanted.pivots_in, laid, (0, 1))
        new = good & ~inside
        reverse, over, inside = np.where(new, flip[0], reverse), np.where(new, flip[1], over), inside | good
    return reverse, over, inside


def _inside(region: Region | None, linkage: Linkage, planes: tuple[int, ...]) -> Array:
    if region is None:
        return np.ones(len(linkage), bool)
    z, finite = linkage.points[:, :, planes], linkage.finite[:, :, planes]
    return np.asarray((region.holds(z) | ~finite).all(axis=(1, 2)))


def _merged(one: Answers, two: Answers, use: Array) -> Answers:
    """Return `one` with the entries `use` (a mask) from `two`."""
    pick = np.flatnonzero(use)
    pivots = one.linkage.pivots.copy()
    pivots[pick] = two.linkage.pivots[pick]
    values = {
        name: np.where(use if value.ndim == 1 else use[:, None], getattr(two.measures, name), value)
        for name, value in vars(one.measures).items()
    }
    return Answers(
        one.rows,
        Linkage._trusted(pivots),
        np.where(use, two.point, one.point),
        one.traced.replaced(use, two.traced[use]),
        Measures(**values),
    )


def check_names(database: Database, wanted: Constraints) -> None:
    """Raise `InvalidRequest` if a family, series or configuration is asked for that the database does not hold."""
    columns = {"families": Mechanism.family, "series": Mechanism.series, "configurations": Mechanism.configuration}
    for name, column in columns.items():
        asked = getattr(wanted, name)
        if asked:
            held = sorted(set(database.read(select(column.label("name")).distinct())["name"]))
            unknown = [a for a in asked if a not in held]
            if unknown:
                raise InvalidRequest(
                    f"the database holds no {SINGULAR[name]} {unknown[0]!r}; it holds "
                    f"{', '.join(held)}. `catalogue build --series CODE` adds a series"
                )
