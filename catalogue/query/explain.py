"""Say how an answer came about, and of an empty one what to relax and how near the nearest miss is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from sqlalchemy import and_, case, func, true

from ..guide.measures import Measures
from ..linkage import Array
from ..store import Database
from .complete import reaches
from .conditions import basis, conditions
from .constraints import Constraints
from .find import answer
from .narrow import joined
from .promise import levels, loosest
from .ranking import Ranking
from .region import Region
from .request import Request
from .trail import Trail

#: Constraints by a number, with the criterion that brings the nearest miss to the top and how it is measured.
NUMBERS: dict[str, tuple[str, Callable[[Measures], Array]]] = {
    "max_size": ("size", lambda m: m.size),
    "max_link": ("max_link", lambda m: m.max_link),
    "max_ground": ("max_ground", lambda m: m.max_ground),
    "max_arm": ("max_arm", lambda m: m.max_arm),
    "min_transmission": ("transmission", lambda m: m.min_transmission),
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
    """

    name: str
    excluded: int
    freed: int


def relaxations(database: Database, request: Request, wanted: Constraints) -> tuple[int, list[Relaxation]]:
    """Return how many stored guides could serve without constraints, and what relaxing each constraint would bring."""
    some = levels(request, 1)
    tests = conditions(request, wanted, some[0], {})
    columns: list[Any] = [func.count().label("all")]
    for name, test in tests.items():
        others = and_(true(), *(t for n, t in tests.items() if n != name))
        columns.append(func.coalesce(func.sum(case((test, 0), else_=1)), 0).label(f"excluded {name}"))
        columns.append(func.coalesce(func.sum(case((others, 1), else_=0)), 0).label(f"freed {name}"))
    row = {k: int(v[0]) for k, v in database.read(joined(*columns).where(basis(request, wanted, some))).items()}
    return row["all"], [Relaxation(name, row[f"excluded {name}"], row[f"freed {name}"]) for name in tests]


def nearest_miss(database: Database, request: Request, wanted: Constraints, name: str) -> str:
    """Return how near the nearest guide comes that meets all constraints but one, measured on its finite motion."""
    kept = {f.name: getattr(wanted, f.name) for f in fields(wanted) if f.name != name}
    without = Constraints(**kept)
    criterion, read = NUMBERS.get(name, ("balance", None))
    found = answer(database, request, without, Ranking({criterion: 1.0}), limit=12, effort=1, trail=Trail())
    if found is None:
        return ""
    if read is not None:
        return f"; the nearest has {read(found.measures)[0]:.4g}"
    region = getattr(wanted, name)
    if isinstance(region, Region):
        planes = (0,) if name == "fixed_pivots_in" else (0, 1)
        out = np.where(found.linkage.finite[:, :, planes], region.outside(found.linkage.points[:, :, planes]), 0.0)
        return f"; among the best the nearest stands {out.max(axis=(1, 2)).min():.4g} outside"
    return ""


def nearest_deviation(database: Database, request: Request, wanted: Constraints) -> float | None:
    """Return the least deviation, measured, of a guide that meets all constraints; None if there is none."""
    looser = replace(request, deviation=0.1 * request.stroke)
    found = answer(database, looser, wanted, Ranking({"deviation": 1.0}), limit=1, effort=1, trail=Trail())
    return None if found is None else float(found.traced.fit.deviation[0])


def explain(database: Database, request: Request, wanted: Constraints, trail: Trail, count: int) -> str:
    """Return the explanation of an answer with `count` candidates."""
    total, relaxed = relaxations(database, request, wanted)
    lines = [f"{_what(request)}: {total} stored guides hold {10.0 ** loosest(request):.0e} of a stroke"]
    lines += [f"  {r.name} alone excludes {r.excluded} of them" for r in relaxed]
    lines.append(f"  {trail.traced} of the rest, the most promising of each series, were traced; {count} are shown")
    if trail.certain and count:
        lines.append("  nothing that was not traced promises to be better")
    lines += [f"  on the finite motion {name} removed {number}" for name, number in trail.removed.items()]
    if not count:
        lines.append(advice(database, request, wanted, trail, relaxed))
    lines.append(f"loaded: {database.path}; no plugin was needed; {_seconds(trail)}")
    return "\n".join(lines)


def explain_constructed(request: Request, wanted: Constraints, trail: Trail, count: int) -> str:
    """Return the explanation of an answer with `count` guides that were made for given pivots."""
    what = "one crank" if wanted.given == "crank" else f"both {wanted.given} pivots"
    lines = [
        f"{_what(request)}, {what} given: the series have {trail.solved} linkages for that, "
        f"{trail.completed} more were completed along the path",
        f"  {trail.traced} carry the point from end to end; the straightest were refined; {count} are shown",
    ]
    lines += [f"  on the finite motion {name} removed {number}" for name, number in trail.removed.items()]
    if not count:
        lines.append(_advice_constructed(request, wanted, trail))
    lines.append(f"nothing was read from the database; {_seconds(trail)}")
    return "\n".join(lines)


def _advice_constructed(request: Request, wanted: Constraints, trail: Trail) -> str:
    if wanted.given == "crank" and not trail.traced and not reaches(wanted.places, request):
        return (
            "no guide found: this crank with its arm to the point is too short for the path, or in line with the arm "
            "in mid-stroke; lengthen or move it"
        )
    if not trail.solved + trail.completed:
        return "no guide found: there is no linkage with these pivots; move them, or give a tolerance (within)"
    if not trail.traced:
        return (
            f"no guide found: of {trail.solved + trail.completed} linkages with these pivots none carries the point "
            "from end to end; move them, or give a tolerance (within)"
        )
    worst = max(trail.removed, key=lambda name: trail.removed[name])
    least = f"; the nearest holds {trail.least:.3g}" if trail.least > request.deviation else ""
    return (
        f"no guide found: relax {worst}, which {trail.removed[worst]} refined linkages with these pivots failed{least}"
    )


def _what(request: Request) -> str:
    radius = "any radius" if request.radius is None else f"radius {request.radius:g}"
    what = f"straight line of {request.stroke:g}" if request.kind == "line" else (
        f"arc of chord {request.stroke:g} and {radius}"
    )  # fmt: skip
    return f"{what} within {request.deviation:g}"


def _seconds(trail: Trail) -> str:
    return ", ".join(f"{step} {1000 * s:.0f} ms" for step, s in trail.seconds.items())


def advice(
    database: Database, request: Request, wanted: Constraints, trail: Trail, relaxed: list[Relaxation] | None = None
) -> str:
    """Return one line for an empty answer: what to relax and the nearest miss."""
    if relaxed is None:
        relaxed = relaxations(database, request, wanted)[1]
    useful = [r for r in relaxed if r.freed and r.excluded]
    if useful:
        best = max(useful, key=lambda r: r.excluded)
        bound = getattr(wanted, best.name)
        asked = f" {bound:g}" if isinstance(bound, int | float) and not isinstance(bound, bool) else ""
        near = nearest_miss(database, request, wanted, best.name)
        return f"no guide found: relax {best.name}{asked}, which alone excludes {best.excluded} stored guides{near}"
    if trail.traced:
        worst = max(trail.removed, key=lambda name: trail.removed[name], default="deviation")
        failed = trail.removed.get(worst, 0)
        return f"no guide found: relax {worst}, {failed} of {trail.traced} traced candidates failed it"
    least = nearest_deviation(database, request, wanted)
    if least is not None:
        asked = f"{request.deviation:g}"
        return f"no guide found: relax the deviation {asked}; the straightest that meets the rest holds {least:.3g}"
    names = " and ".join(r.name for r in relaxed) or "the deviation"
    return f"no guide found: {names} exclude one another; relax more than one of them"
