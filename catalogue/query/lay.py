"""Lay traced guides along the path that is asked for, measure them there, and check them against the constraints."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..guide.in_place import Nominal, in_place
from ..guide.kinds import SLOTS
from ..guide.measures import LEAST_ARM, Measures, measure
from ..guide.place import FINE, at_stroke, mid_stroke, mirrored, placed
from ..guide.practice import Moves, practice
from ..guide.room import bars, stays_clear, stays_inside
from ..guide.span import Span, span
from ..guide.trace import Traced, again, trace
from ..linkage import Array, Linkage
from .conditions import flips
from .constraints import PRACTICE, Constraints
from .region import Region
from .request import Request

#: Intervals between the Chebyshev points at which the deviation of an answer is measured: 32 leave up to 0.2 per cent
#: of it open where a dead point is near, or many extremes are as large.
SHOWN = 128


@dataclass(frozen=True)
class Answers:
    """Placed guides with what was measured of them, best first; arrays over the n answers."""

    rows: dict[str, Array]
    linkage: Linkage
    point: Array
    pole: Array
    traced: Traced
    measures: Measures

    def __getitem__(self, index: Array) -> Answers:
        rows = {k: v[index] for k, v in self.rows.items()}
        place = self.linkage[index], self.point[index], self.pole[index]
        return Answers(rows, *place, self.traced[index], self.measures[index])


def canonical(rows: dict[str, Array]) -> Span:
    """Return the stored guides in their canonical frame, whose origin is the pole; those of slots in their motion."""
    z = rows["x"] + 1j * rows["y"]
    return span(linkages(rows), z, pole=np.zeros_like(z))


def linkages(rows: dict[str, Array]) -> Linkage:
    """Return the linkages of stored guides, of slots the inverse ones."""
    pivots = np.array(rows["pivots"]).reshape(-1, 2, 2, 3)
    slot = np.isin(rows["kind"].astype(str), list(SLOTS.values()))[:, None, None, None]
    return Linkage._trusted(np.where(slot, pivots[:, :, ::-1], pivots))


def final(found: Answers, request: Request) -> Answers:
    """Return answers with their deviation measured on a finer grid, and with more digits where double lacks them."""
    here, circle = span(found.linkage, found.point, pole=found.pole), request.kind == "circle"
    if here.cusp.any():
        return replace(found, traced=at_stroke(here, request.stroke, circle=circle))
    traced = again(here, found.traced, circle=circle, nodes=SHOWN)
    fine = traced.relative < FINE
    if fine.any():
        traced = traced.replaced(fine, at_stroke(here[fine], request.stroke, circle=circle))
    return replace(found, traced=traced)


def lay_stored(request: Request, wanted: Constraints, rows: dict[str, Array]) -> Answers:
    """Return stored reaches laid along the path of a request, at the strokes that are stored."""
    guides = canonical(rows)
    circle = request.kind == "circle"
    traced = trace(guides, rows["half"], circle=circle, split=True, centre=rows["centre"], nodes=16)
    return laid(request, wanted, rows, guides, traced)[0]


def laid(
    request: Request, wanted: Constraints, rows: dict[str, Array], guides: Span, traced: Traced
) -> tuple[Answers, dict[str, Array]]:
    """Lay traced guides along the path, measure them there, and return which satisfy each constraint."""
    circle = request.kind == "circle"
    there = np.isfinite(traced.fit.deviation) & (traced.fit.stroke > 0)
    linkage, point = placed(guides, traced, request.stroke)
    with np.errstate(all="ignore"):  # the pole matters at change points, which are the reference position
        pole = np.where(there, -request.stroke / traced.fit.stroke * traced.fit.along.conj() * traced.fit.start, 0)
    turns = [(np.zeros(len(point), bool), circle & (traced.fit.curvature > 0))]  # the arc is to bulge to +y
    bulging, _ = mirrored(linkage, point, request.stroke, *turns[0])
    swept = None
    if wanted.swept_in is not None or wanted.keep_out:
        upright = [mirrored(linkage, z, request.stroke, *turns[0])[1] for z in (point, pole)]
        first = span(bulging, upright[0], pole=upright[1])
        moves = Moves.of(first, at_stroke(first, request.stroke, circle=circle, extend=False))
        swept = bars(bulging, moves)
    reverse, over, inside = _orientation(request, wanted, bulging, swept)
    for turn in (*turns, (reverse, over)):
        _, pole = mirrored(linkage, pole, request.stroke, *turn)
        linkage, point = mirrored(linkage, point, request.stroke, *turn)
    here = span(linkage, point, pole=pole)
    with np.errstate(all="ignore"):
        bend = -np.abs(traced.fit.curvature) * traced.fit.stroke / request.stroke
    now = at_stroke(here, request.stroke, circle=circle, extend=False, curvature=None if here.cusp.any() else bend)
    m = measure(here, now, in_middle=True)
    checks = checked(request, wanted, here, now, m)
    checks["deviation"] &= there
    if placed_in(wanted):
        checks["pivots inside"] = inside
    return Answers(rows, linkage, point, pole, now, m), checks


def in_its_place(
    request: Request, wanted: Constraints, rows: dict[str, Array], guides: Span, nominal: Nominal, nodes: int = 32
) -> tuple[Answers, dict[str, Array]]:
    """Measure guides along a nominal where they stand, and return which satisfy each constraint."""
    linkage, point = mid_stroke(guides, in_place(guides, nominal))
    here = span(linkage, point, pole=guides.pole)
    now = in_place(here, nominal, nodes)
    m = measure(here, now, in_middle=True)
    checks = checked(request, wanted, here, now, m)
    if placed_in(wanted):
        swept = bars(linkage, Moves.of(here, now)) if wanted.swept_in is not None or wanted.keep_out else None
        checks["pivots inside"] = inside_regions(wanted, linkage, swept)
    return Answers(rows, linkage, point, np.full(len(point), complex(np.nan, np.nan)), now, m), checks


def placed_in(wanted: Constraints) -> bool:
    """Whether it matters where the linkage stands."""
    return any(region is not None for region in (wanted.fixed_pivots_in, wanted.pivots_in, wanted.swept_in)) or bool(
        wanted.keep_out
    )


def checked(request: Request, wanted: Constraints, guides: Span, now: Traced, m: Measures) -> dict[str, Array]:
    """Return which guides satisfy each constraint that does not ask where their pivots stand."""
    with np.errstate(invalid="ignore"):
        held = np.abs(now.fit.stroke - request.stroke) <= 1e-6 * request.stroke
        checks = {"stroke": held, "deviation": now.fit.deviation <= request.deviation}
        if request.radius is not None and request.kind == "circle":
            checks["radius"] = np.abs(1 / np.abs(now.fit.curvature) - request.radius) <= 1e-3 * request.radius
        for name in ("max_size", "max_link", "max_ground", "max_arm"):
            bound = getattr(wanted, name)
            if bound is not None:
                checks[name] = ~(getattr(m, name.replace("max_size", "size")) > bound)
        if wanted.min_link is not None:
            checks["min_link"] = ~(m.min_link < wanted.min_link)
        checks["distance from the moving pivots"] = ~(m.max_arm < LEAST_ARM * request.stroke)
        checks["min_transmission"] = m.min_transmission >= wanted.min_transmission
        if wanted.full_rotation:
            checks["full_rotation"] = m.rotates > 0
        bounds = {name: getattr(wanted, name) for name in PRACTICE if getattr(wanted, name) is not None}
        if bounds:
            works = practice(guides, now, m)
            for name, bound in bounds.items():
                side, _, column = name.partition("_")
                value = getattr(works, column)
                checks[name] = value >= bound if side == "min" else value <= bound
    return checks


def _orientation(
    request: Request, wanted: Constraints, linkage: Linkage, swept: Array | None
) -> tuple[Array, Array, Array]:
    """Return how to lay each guide so that it stands inside the regions: reverse, over, and whether it does."""
    n = len(linkage)
    reverse, over, inside = np.zeros(n, bool), np.zeros(n, bool), np.zeros(n, bool)
    for flip in flips(request):
        turn = np.full(n, flip[0]), np.full(n, flip[1])
        laid, _ = mirrored(linkage, np.zeros(n, complex), request.stroke, *turn)
        room = None if swept is None else mirrored(linkage[:1], swept, request.stroke, *(t[:1] for t in turn))[1]
        good = inside_regions(wanted, laid, room)
        new = good & ~inside
        reverse, over, inside = np.where(new, flip[0], reverse), np.where(new, flip[1], over), inside | good
    return reverse, over, inside


def inside_regions(wanted: Constraints, linkage: Linkage, swept: Array | None) -> Array:
    """Return which linkages have their pivots, and their `bars` over the stroke, where they may be."""
    good = _inside(wanted.fixed_pivots_in, linkage, (0,)) & _inside(wanted.pivots_in, linkage, (0, 1))
    if swept is not None:
        if wanted.swept_in is not None:
            good = good & stays_inside(wanted.swept_in, swept)
        for zone in wanted.keep_out:
            good = good & stays_clear(zone, swept)
    return good


def _inside(region: Region | None, linkage: Linkage, planes: tuple[int, ...]) -> Array:
    if region is None:
        return np.ones(len(linkage), bool)
    z, finite = linkage.points[:, :, planes], linkage.finite[:, :, planes]
    return np.asarray((region.holds(z) | ~finite).all(axis=(1, 2)))


def merged(one: Answers, two: Answers, where: Array) -> Answers:
    """Return `one` with the entries `where` (a mask) from `two`, which holds just those."""

    def put(values: Array, by: Array) -> Array:
        out = values.copy()
        out[where] = by
        return out

    pivots = put(one.linkage.pivots, two.linkage.pivots)
    measures = {name: put(value, getattr(two.measures, name)) for name, value in vars(one.measures).items()}
    traced = one.traced.replaced(where, two.traced)
    place = Linkage._trusted(pivots), put(one.point, two.point), put(one.pole, two.pole)
    return Answers(one.rows, *place, traced, Measures(**measures))


def together(one: Answers, two: Answers) -> Answers:
    """Return the answers of both, one after the other."""

    def put(a: Array, b: Array) -> Array:
        return np.concatenate([a, b])

    return Answers(
        {name: put(values, two.rows[name]) for name, values in one.rows.items()},
        Linkage._trusted(put(one.linkage.pivots, two.linkage.pivots)),
        put(one.point, two.point),
        put(one.pole, two.pole),
        one.traced.followed_by(two.traced),
        Measures(**{name: put(value, getattr(two.measures, name)) for name, value in vars(one.measures).items()}),
    )
