"""Say how an answer came about, and of an empty one what to relax and how near the nearest miss is."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from sqlalchemy import and_, case, func

from ..guide.reach import LEVELS
from ..store import Database, Guide, Reach
from .find import Trail
from .narrow import basis, conditions, joined, loosest, stretch
from .request import Constraints, Request

#: Constraints by a number: the stored column, whether the least or the greatest is the nearest miss, and its unit.
NUMBERS: dict[str, tuple[Any, bool, str]] = {
    "max_size": (Reach.size, True, ""),
    "max_link": (Reach.max_link, True, ""),
    "max_ground": (Reach.max_ground, True, ""),
    "max_arm": (Reach.max_arm, True, ""),
    "min_link": (Reach.min_link, False, ""),
    "min_transmission": (Reach.min_transmission, False, " degrees"),
    "order": (Guide.contact_order, False, ""),
}


@dataclass(frozen=True)
class Relaxation:
    """What giving up one constraint would bring.

    Attributes
    ----------
    name : str
    excluded : int
        Stored guides that this constraint alone excludes.
    freed : int
        Stored guides that satisfy all the others.
    nearest : float or None
        The value nearest to the bound among those, in the user's unit.
    """

    name: str
    excluded: int
    freed: int
    nearest: float | None


def relaxations(database: Database, request: Request, wanted: Constraints) -> tuple[int, list[Relaxation]]:
    """Return how many stored guides could serve without constraints, and what relaxing each constraint would bring."""
    level = loosest(request)
    tests = conditions(request, wanted, level)
    columns: list[Any] = [func.count().label("all")]
    scale: Any = request.stroke
    if request.kind == "circle":
        scale = request.stroke * Reach.sweep / request.sweep  # type: ignore[union-attr]
    for name, test in tests.items():
        others = and_(*(t for n, t in tests.items() if n != name)) if len(tests) > 1 else test.is_not(None)
        columns.append(func.coalesce(func.sum(case((test, 0), else_=1)), 0).label(f"excluded {name}"))
        columns.append(func.coalesce(func.sum(case((others, 1), else_=0)), 0).label(f"freed {name}"))
        if name in NUMBERS:
            column, least, unit = NUMBERS[name]
            value = column * (1.0 if unit or name == "order" else scale / (stretch(request, level) if least else 1.0))
            best = func.min if least else func.max
            columns.append(best(case((others, value + 0.0))).label(f"nearest {name}"))
    row = {k: v[0] for k, v in database.read(joined(*columns).where(basis(request, level))).items()}
    found = []
    for name in tests:
        nearest = row.get(f"nearest {name}")
        value = float(nearest) if nearest is not None and nearest == nearest else None
        found.append(Relaxation(name, int(row[f"excluded {name}"]), int(row[f"freed {name}"]), value))
    return int(row["all"]), found


def nearest_deviation(database: Database, request: Request, wanted: Constraints) -> float | None:
    """Return the least deviation, in the user's unit, that stored guides reach which meet the constraints."""
    for level in sorted(LEVELS):
        if level <= loosest(request):
            continue
        looser = replace(request, deviation=min(10.0**level, 0.1) * request.stroke)
        query = joined(func.min(Reach.deviation).label("least")).where(
            basis(looser, level), *conditions(looser, wanted, level).values()
        )
        least = database.read(query.having(func.count() > 0))["least"]
        if len(least) and np.isfinite(least[0]):
            return float(least[0]) * request.stroke
    return None


def explain(database: Database, request: Request, wanted: Constraints, trail: Trail, count: int) -> str:
    """Return the explanation of an answer with `count` candidates."""
    total, relaxed = relaxations(database, request, wanted)
    seconds = ", ".join(f"{step} {1000 * s:.0f} ms" for step, s in trail.seconds.items())
    what = f"straight line of {request.stroke:g}" if request.kind == "line" else (
        f"arc of chord {request.stroke:g} and radius {request.radius:g}"
    )  # fmt: skip
    lines = [f"{what} within {request.deviation:g}: {total} stored guides hold that over a stroke of some size"]
    lines += [f"  {r.name} alone excludes {r.excluded} of them" for r in relaxed]
    lines.append(f"  {trail.traced} of the rest, the most promising of each series, were traced; {count} are shown")
    lines += [f"  on the finite motion {name} removed {number}" for name, number in trail.removed.items()]
    if not count:
        lines.append(advice(database, request, wanted, trail, relaxed))
    lines.append(f"loaded: {database.path}; no plugin was needed; {seconds}")
    return "\n".join(lines)


def advice(
    database: Database, request: Request, wanted: Constraints, trail: Trail, relaxed: list[Relaxation] | None = None
) -> str:
    """Return one line for an empty answer: what to relax and the nearest miss."""
    if relaxed is None:
        relaxed = relaxations(database, request, wanted)[1]
    useful = [r for r in relaxed if r.freed and r.excluded]
    if trail.traced and not useful:
        worst = max(trail.removed, key=lambda name: trail.removed[name], default="deviation")
        failed = trail.removed.get(worst, 0)
        return f"no guide found: relax {worst}, {failed} of {trail.traced} traced candidates failed it"
    if useful:
        best = max(useful, key=lambda r: (r.freed, r.excluded))
        bound = getattr(wanted, best.name)
        near = f"; the nearest has {best.nearest:.4g}{NUMBERS[best.name][2]}" if best.nearest is not None else ""
        asked = f" {bound:g}" if isinstance(bound, int | float) and not isinstance(bound, bool) else ""
        return f"no guide found: relax {best.name}{asked}, {best.freed} stored guides satisfy everything else{near}"
    least = nearest_deviation(database, request, wanted)
    if least is not None:
        asked = f"{request.deviation:g}"
        return f"no guide found: relax the deviation {asked}; stored guides that meet the rest reach {least:.3g}"
    names = " and ".join(r.name for r in relaxed) or "the deviation"
    return f"no guide found: {names} exclude one another; relax more than one of them"
