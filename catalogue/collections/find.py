"""Find in a collection: bound and rank by what is stored, verify on the finite motion."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from sqlalchemy import ColumnElement, Select, and_, case, func, select, true

from ..errors import InvalidRequest, PluginError, one_line
from ..problem.request import Request, whole
from ..store import Database, SpecimenRow
from .bounds import Bound, bounds
from .results import CollectionCandidate, CollectionResults
from .spec import Collection, Measured

#: Specimens that are verified together, and batches of them at most.
BATCH, BATCHES = 32, 32
#: A best circle whose stroke over radius is off by d is off the given circle by about d/16 of the stroke, if the ends
#: may move; more is passed on to be measured.
PER_SWEEP = 1 / 40
#: Rounding of a given radius, relatively.
SAME_RADIUS = 1e-9
#: A stored deviation and that which is measured again agree to this part.
SLACK = 1e-3


@dataclass
class CollectionReport:
    """What became of the specimens: verified, and how many each step removed there."""

    verified: int = 0
    removed: dict[str, int] = field(default_factory=dict)
    nearest: dict[str, float] = field(default_factory=dict)
    seconds: float = 0.0

    def remove(self, name: str, miss: float | None = None) -> None:
        """Count a specimen that fails; `miss` is how far the tested number is off."""
        self.removed[name] = self.removed.get(name, 0) + 1
        if miss is not None:
            self.nearest[name] = min(miss, self.nearest.get(name, miss))


def find_in(
    database: Database,
    collection: Collection,
    request: Request,
    *,
    limit: int = 12,
    rank_by: str = "deviation",
    families: Sequence[str] = (),
    series: Sequence[str] = (),
    where: Mapping[str, Any] | None = None,
) -> CollectionResults:
    """Return the best mechanisms of a collection for a request; see `catalogue.Catalogue.find_in`."""
    limit, clock = whole("limit", limit, 1), time.perf_counter()
    if rank_by != "deviation" and rank_by not in collection.metrics:
        known = ", ".join(["deviation", *collection.metrics])
        raise InvalidRequest(f"cannot rank by {rank_by!r}; {collection.name} has {known}")
    given = bounds(collection, request.stroke, where or {})
    tests = _tests(collection, request, given, _named("family", families, collection.families),
                   _named("series", series, collection.series))  # fmt: skip
    trail, pieces = CollectionReport(), []
    for part in range(BATCHES):
        rows = database.read(_ranked(collection, request, rank_by, list(tests.values()), part))
        if not len(rows["id"]):
            break
        stored = [json.loads(text) for text in rows["parameters"]]
        for i, measured in enumerate(_measured(collection, stored, request)):
            trail.verified += 1
            if _serves(measured, request, given, trail):
                pieces.append(_piece(collection, int(rows["id"][i]), request, measured))
        if len(pieces) >= limit:
            break
    # Stored numbers decide what is verified, measured ones what comes first; the sort is stable.
    pieces.sort(
        key=lambda p: p.deviation if rank_by == "deviation" else _sign(collection, rank_by) * p.metrics[rank_by]
    )
    trail.seconds = time.perf_counter() - clock
    found = pieces[:limit]
    return CollectionResults(
        collection, found, lambda: _explained(database, collection, request, tests, given, trail, found)
    )


def _named(what: str, given: Sequence[str], known: Any) -> tuple[str, ...]:
    names = (given,) if isinstance(given, str) else tuple(given)
    for name in names:
        if name not in known:
            raise InvalidRequest(f"there is no {what} {name!r}; there are {', '.join(known)}")
    return names


def _metric(name: str) -> ColumnElement[float]:
    return func.json_extract(SpecimenRow.metrics, f"$.{name}")


def _sign(collection: Collection, name: str) -> int:
    return -1 if collection.metrics[name].more else 1


def _tests(
    collection: Collection, request: Request, given: list[Bound], families: tuple[str, ...], series: tuple[str, ...]
) -> dict[str, ColumnElement[bool]]:
    """Return what stored specimens must satisfy, by what it is called."""
    row = SpecimenRow
    tests: dict[str, ColumnElement[bool]] = {
        f"deviation {request.deviation:g}": row.deviation <= request.relative * (1 + SLACK)
    }
    if families:
        tests["family"] = row.family.in_(families)
    if series:
        tests["series"] = row.series.in_(series)
    wanted = getattr(request, "sweep", None)
    if wanted is not None and "sweep" in collection.metrics:
        reach = request.relative / PER_SWEEP
        tests[f"radius {request.radius:g}"] = _metric("sweep").between(wanted - reach, wanted + reach)
    for b in given:
        low, high = b.low / b.scale, b.high / b.scale
        slack = SLACK * max(abs(v) for v in (low, high) if abs(v) < float("inf")) if str(b) else 0.0
        tests[str(b)] = _metric(b.name).between(max(low - slack, -1e300), min(high + slack, 1e300))
    return tests


def _held(collection: Collection, request: Request) -> ColumnElement[bool]:
    return and_(SpecimenRow.collection == collection.name, SpecimenRow.kind == request.kind)


def _ranked(
    collection: Collection, request: Request, rank_by: str, tests: list[ColumnElement[bool]], part: int
) -> Select[int, str]:
    row = SpecimenRow
    first = row.deviation if rank_by == "deviation" else _sign(collection, rank_by) * _metric(rank_by)
    return (
        select(row.id, row.parameters)
        .where(_held(collection, request), *tests)
        .order_by(first, row.deviation, row.family, row.block, row.id)
        .limit(BATCH)
        .offset(BATCH * part)
    )


def _measured(collection: Collection, stored: list[Any], request: Request) -> list[Measured]:
    try:
        found = list(collection.measure(stored, request))
    except Exception as error:
        raise PluginError(f"collection {collection.name} cannot be measured: {one_line(error)}") from error
    if len(found) != len(stored):
        raise PluginError(f"collection {collection.name}: {len(found)} of {len(stored)} mechanisms were measured")
    return found


def _serves(measured: Measured, request: Request, given: list[Bound], trail: CollectionReport) -> bool:
    if measured.reason:
        trail.remove(measured.reason)
    elif not _on_radius(measured, request):
        trail.remove(f"radius {request.radius:g}", measured.radius)
    elif not measured.deviation <= request.deviation:
        trail.remove(f"deviation {request.deviation:g}", measured.deviation)
    else:
        failed = next((b for b in given if not b.holds(measured.metrics[b.name])), None)
        if failed is None:
            return True
        trail.remove(str(failed))
    return False


def _on_radius(measured: Measured, request: Request) -> bool:
    """Whether the deviation is from an arc of exactly the radius that is asked for, if one is."""
    wanted = request.radius
    return (
        wanted is None
        or request.kind == "line"
        or (measured.radius is not None and abs(measured.radius - wanted) <= SAME_RADIUS * wanted)
    )


def _piece(collection: Collection, number: int, request: Request, m: Measured) -> CollectionCandidate:
    tags = collection.classify(m.parameters)
    metrics = {name: float(m.metrics[name]) for name in collection.metrics}
    return CollectionCandidate(number, collection, tags.family, tags.series, tags.configuration, tuple(tags.special),
                 float(request.stroke), float(m.deviation), m.radius, metrics, m.parameters)  # fmt: skip


def _explained(
    database: Database, collection: Collection, request: Request, tests: dict[str, Any], given: list[Bound],
    trail: CollectionReport, found: list[CollectionCandidate],
) -> str:  # fmt: skip
    """Return what each bound excludes, what was verified, and for an empty answer the nearest miss."""
    columns: list[Any] = [func.count().label("all")]
    for i, name in enumerate(tests):
        others = and_(true(), *(t for n, t in tests.items() if n != name))
        columns.append(func.coalesce(func.sum(case((tests[name], 0), else_=1)), 0).label(f"excluded {i}"))
        columns.append(func.coalesce(func.sum(case((others, 1), else_=0)), 0).label(f"freed {i}"))
    counted = database.read(select(*columns).where(_held(collection, request)))
    number = {k: int(v[0]) for k, v in counted.items()}
    lines = [f"{collection.name}: {number['all']} specimens guide a point along a {request.kind}"]
    lines += [f"  {name} alone excludes {number[f'excluded {i}']} of them" for i, name in enumerate(tests)]
    lines.append(f"  {trail.verified} of the rest were followed on their finite motion; {len(found)} are shown")
    lines += [f"  there {name} removed {n}" for name, n in trail.removed.items()]
    if not found:
        useful = [i for i in range(len(tests)) if number[f"freed {i}"] and number[f"excluded {i}"]]
        lines.append("no piece found: " + _advice(database, collection, request, tests, given, trail, useful, number))
    lines.append(f"in {1000 * trail.seconds:.0f} ms")
    return "\n".join(lines)


def _advice(
    database: Database, collection: Collection, request: Request, tests: dict[str, Any], given: list[Bound],
    trail: CollectionReport, useful: list[int], number: dict[str, int],
) -> str:  # fmt: skip
    if trail.verified:
        worst = max(trail.removed, key=lambda name: trail.removed[name])
        near = f"; the nearest holds {trail.nearest[worst]:.3g}" if worst in trail.nearest else ""
        return f"relax {worst}, which {trail.removed[worst]} of {trail.verified} failed on the finite motion{near}"
    if not number["all"]:
        return f"{collection.name} holds nothing of this kind; run `catalogue build --collection {collection.name}`"
    if not useful:
        return f"{' and '.join(tests)} exclude one another; relax more than one of them"
    names = list(tests)
    best = names[max(useful, key=lambda i: number[f"excluded {i}"])]
    others = [test for name, test in tests.items() if name != best]
    bound = next((b for b in given if str(b) == best), None)
    if bound is None and not best.startswith("deviation"):
        near = ""
    else:
        value = SpecimenRow.deviation if bound is None else _metric(bound.name)
        scale = request.stroke if bound is None else bound.scale
        least, most = func.min(value).label("least"), func.max(value).label("most")
        seen = database.read(select(least, most).where(_held(collection, request), *others))
        ends = [scale * float(seen[side][0]) for side in ("least", "most")]
        low = bound is not None and ends[1] < bound.low
        near = f"; the nearest has {ends[1] if low else ends[0]:.4g}"
    excluded = number[f"excluded {names.index(best)}"]
    return f"relax {best}, which alone excludes {excluded} stored specimens{near}"
