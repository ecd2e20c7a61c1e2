"""Find dwells: stored arcs with an output dyad at the centre of the arc, refined together."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from ..candidates.select import ranks, unlike_rows
from ..candidates.stored import canonical
from ..errors import InvalidRequest, quoted
from ..given import whole
from ..guidance.coupler_curve import CouplerCurve, coupler_curve
from ..guidance.drive import drive_metrics
from ..guidance.dwell import Dwell, dwells, slides_over_turn, turned
from ..guidance.kinds import POINTS
from ..guidance.metrics import measure
from ..guidance.placement import mid_stroke
from ..guidance.trace import trace
from ..guides.dwell import DwellCandidate, DwellResults, StandStill
from ..kinematics.linkage import SLIDING
from ..kinematics.types import Array, Complexes, Floats, Indices
from ..problem.constraints import Constraints, DwellArguments
from ..refine.dwell_model import DWELL, DwellLinkages, DwellModel
from ..refine.sqp import Refinement
from ..store import COLUMNS, Database, Guide, Mechanism, Reach, joined
from .explain import LESS, REMEDIES
from .names import check_names, eligible_series, option

#: Constraints available for a dwell.
GOVERNED = tuple(DwellArguments.__annotations__)


class DwellSearch(NamedTuple):
    """Budget and grids of the search for dwells."""

    share: int = 150  #: stored guides to trace per series and unit of effort
    tried: int = 6  #: dyads to refine per answer
    more: int = 60  #: largest number of dyads to refine beyond that of answers
    first: int = 8  #: rounds of refinement of all of them
    kept: int = 2  #: dyads to refine further, per answer
    rounds: int = 12  #: further rounds
    coarse: int = 60  #: positions per turn to try dyads: every 6 degrees
    fine: int = 2880  #: positions per turn to measure the selected ones: every eighth of a degree
    degrees: int = 360  #: points of the path over the turn for the size
    block: int = 40  #: guides per block of trials: bounds the memory
    nearly: float = 0.7  #: fraction of the requested swing and dwell from which a dyad is refined
    deficit: float = 90.0  #: loss of merit of a dyad without any swing or dwell [deg]
    largest: float = 10.0  #: largest size, if none is given [cranks]
    larger: float = 20.0  #: loss of merit per e-fold beyond the largest size [deg]
    #: Fraction of the requested residual that refined dwells use, where they can: the rest is left
    #: to manufacturing tolerances.
    used: float = 0.85
    alike: float = 0.15  #: largest difference of lengths of answers that are alike [cranks]


SEARCH = DwellSearch()

#: Trial lengths of the rocker over that of the rod, about a factor of 1.4 apart.
ROCKERS = np.array([0.35, 0.5, 0.7, 1.0, 1.4, 2.0])
#: Trial directions from the joint to the rocker's pivot, 10 degrees apart.
DIRECTIONS = np.exp(2j * np.pi * np.arange(36) / 36)
#: Requirements that are relaxed by a larger value.
UPPER = ("residual", "max_size")
#: Fractions of the request to try for advice on an empty result, by the number of requirements
#: relaxed.
SHARES = {1: (0.8, 0.5, 0.25), 2: (0.5,), 5: (0.5,)}


@dataclass(frozen=True)
class Arcs:
    """n stored guides along arcs, in mid-stroke, on cranks that turn fully.

    Attributes
    ----------
    rows : dict of str to ndarray, shape (n,)
        Columns of the database; the place of the joint, at the centre of the arc.
    guides : CouplerCurve
    driver : ndarray, shape (n,)
        Number of the turning crank.
    turned : ndarray, shape (n,)
        Rotation of the crank over the arc [deg].
    """

    rows: dict[str, Array]
    guides: CouplerCurve
    driver: Array
    turned: Floats

    def __getitem__(self, index: Indices) -> Arcs:
        rows = {name: values[index] for name, values in self.rows.items()}
        return Arcs(rows, self.guides[index], self.driver[index], self.turned[index])


def find_dwells(
    database: Database, request: StandStill, constraints: Constraints, *, limit: int, effort: int
) -> DwellResults:
    """Find dwells; see `catalogue.Catalogue.find_dwells`."""
    if not isinstance(request, StandStill):
        raise InvalidRequest(f"find_dwells wants a StandStill, not {quoted(request)}")
    limit, effort = whole("limit", limit, 1), whole("effort", effort, 1)
    if other := [name for name in constraints.active() if name not in GOVERNED]:
        raise InvalidRequest(f"{other[0]} does not go with a dwell; there are {', '.join(GOVERNED)}")
    check_names(database, constraints)
    arcs = _turning(database, constraints, effort)
    found = _found(arcs, request, constraints, limit)
    if len(found):
        laid = [replace(one.for_request(request).scaled(request.crank), unit=request.unit) for one in found]
        return replace(found, candidates=laid)
    if not database.has_guides:
        return found
    return DwellResults([], f"{found.explanation}; {_advice(arcs, request, constraints)}")


def _advice(arcs: Arcs | None, request: StandStill, constraints: Constraints) -> str:
    """Return tested remedies as options: one requirement relaxed, two, or all."""
    asked = {name: getattr(request, name) for name in ("angle", "residual", "swing")}
    asked["max_size"] = request.crank * _largest(request, constraints)
    if constraints.min_transmission:
        asked["min_transmission"] = constraints.min_transmission

    def found(eased: dict[str, float]) -> bool:
        asked_for: dict[str, Any] = {name: value for name, value in eased.items() if hasattr(request, name)}
        bounds: dict[str, Any] = {name: value for name, value in eased.items() if name not in asked_for}
        try:
            looser = replace(request, **asked_for)
        except InvalidRequest:  # the residual is too large for the swing
            return False
        return len(_found(arcs, looser, replace(constraints, **bounds), 1)) > 0

    for count, shares in SHARES.items():
        told = []
        for names in combinations(asked, min(count, len(asked))):
            every = [_eased({name: asked[name] for name in names}, share) for share in shares]
            if len(every) > 1 and not found(every[-1]):  # less would hardly do
                continue
            if offer := next((eased for eased in every if found(eased)), None):
                bounds = [f"{option(name)} {value:g} (asked {asked[name]:g})" for name, value in offer.items()]
                told.append(" with ".join(bounds))
        if told:
            return f"{REMEDIES}: {', or '.join(told)}; {LESS}"
    return "ask for much less of all"


def _eased(asked: dict[str, float], share: float) -> dict[str, float]:
    """Relax requirements to a share of what is asked, to three digits."""
    return {name: float(f"{value / share if name in UPPER else value * share:.3g}") for name, value in asked.items()}


def _found(arcs: Arcs | None, request: StandStill, constraints: Constraints, limit: int) -> DwellResults:
    """Search dwells; explain an empty result."""
    arcs = arcs and arcs[np.flatnonzero(arcs.turned >= SEARCH.nearly * request.angle)]
    if arcs is None or not len(arcs.turned):
        return DwellResults([], "no dwell found: no stored arc spans so much of a full turn of its crank")
    rows, guides, driver = arcs.rows, arcs.guides, arcs.driver
    size = _largest(request, constraints)
    pivots, merit = _tried(rows, guides, driver, request, size)
    order = np.argsort(-merit, kind="stable")
    order = _few_of_each(
        order[np.isfinite(merit[order])], rows["series"], min(SEARCH.tried * limit, limit + SEARCH.more)
    )
    count = len(guides)
    if not len(order):
        return DwellResults(
            [], f"no dwell found: of {count} arcs none has a dyad that stands so still and swings so far"
        )
    rows = {name: values[order] for name, values in rows.items()}
    guides = guides[order]
    start = DwellLinkages(guides.linkage, guides.point, rows["joint"], pivots[order], driver[order])
    found, kept = _refined(start, request, size, lambda order: _few_of_each(order, rows["series"], SEARCH.kept * limit))
    rows = {name: values[kept] for name, values in rows.items()}
    path, input_ = turned(coupler_curve(found.linkage, found.point), found.driver, SEARCH.fine)
    final = dwells(path, found.joint, found.pivot[:, None], request.residual)[:, 0]
    least = _transmission(final, input_, request)
    every = [_dwelling(rows, found, path, final, least, i) for i in range(len(kept))]
    good = (least >= max(constraints.min_transmission, 1e-9)) & (np.array([one.size for one in every]) <= size)
    best = np.flatnonzero(good)[np.argsort(-least[good], kind="stable")]
    chosen = _few_of_each(best[unlike_rows(found.shape()[best], SEARCH.alike)], rows["series"], limit)
    told = f"{count} arcs were tried, {len(order)} dwells refined over the full turn, {good.sum()} serve"
    if not len(chosen):
        told = f"no dwell found: of {count} arcs the longest dwell is {np.nan_to_num(final.angle).max():.4g} degrees"
    return DwellResults([every[i] for i in chosen], told)


def _largest(request: StandStill, constraints: Constraints) -> float:
    """Return the largest size [cranks]."""
    return SEARCH.largest if constraints.max_size is None else constraints.max_size / request.crank


def _refined(
    start: DwellLinkages, request: StandStill, size: float, kept: Callable[[Indices], Indices]
) -> tuple[DwellLinkages, Indices]:
    """Refine dwells for their transmission angle within the request and a size [cranks].

    `kept` selects those to refine to the end, of all in the order of their merit. Return them, and
    their numbers.
    """
    inside = 1 - DWELL.inside
    angle = request.angle + 2 * 360 / SEARCH.fine  # a dwell is measured in whole steps
    model = DwellModel(
        math.radians(angle),
        math.radians(SEARCH.used * request.residual),
        math.radians(request.swing / inside),
        size * inside,
    )
    run = Refinement.started(model, model.measured(start)).run(SEARCH.first)
    some = kept(np.argsort(run.merit, kind="stable"))
    return run[some].run(SEARCH.rounds).best.dwell, some


def _turning(database: Database, constraints: Constraints, effort: int) -> Arcs | None:
    """Retrieve stored arcs in mid-stroke, on turning cranks; None if there are none."""
    parts = []
    for code in eligible_series(database, constraints):
        select = joined(*COLUMNS, Reach.rotates).where(
            Reach.series == code, Reach.kind == POINTS["circle"], Reach.level == -3, Reach.rotates > 0
        )
        if constraints.families:
            select = select.where(Mechanism.family.in_(constraints.families))
        if constraints.configurations:
            select = select.where(Mechanism.configuration.in_(constraints.configurations))
        if constraints.pins_only:
            select = select.where(Mechanism.family.not_in(SLIDING))
        if constraints.order:
            select = select.where(Guide.contact_order >= constraints.order)
        best = Reach.__table__.c["min_transmission"].desc()
        parts.append(database.read(select.order_by(best).limit(SEARCH.share * effort)))
    parts = [p for p in parts if len(p["id"])]
    if not parts:
        return None
    rows = {k: np.concatenate([p[k] for p in parts]) for k in parts[0]}
    guides = canonical(rows)
    traced = trace(guides, rows["half"], circle=True, split=True, centre=rows["centre"], nodes=16)
    works = drive_metrics(guides, traced, measure(guides, traced, turning=True))
    turns = works.driver > 0
    turns &= (rows["rotates"].astype(int) >> np.maximum(works.driver - 1, 0) & 1) > 0
    good = np.flatnonzero(turns)
    if not len(good):
        return None
    rows, guides, traced = {k: v[good] for k, v in rows.items()}, guides[good], traced[good]
    linkage, point, _ = mid_stroke(guides, traced)
    fit = traced.fit
    depth = np.copysign(np.sqrt(1 / fit.curvature**2 - 0.25 * fit.stroke**2), fit.curvature)
    rows["joint"] = fit.start + fit.along * (0.5 * fit.stroke + 1j * depth)
    return Arcs(rows, coupler_curve(linkage, point), works.driver[good], works.drive_angle[good])


def _blocks(guides: CouplerCurve, driver: Array, joint: Complexes) -> Iterator[tuple[slice, Complexes, Floats, Floats]]:
    """Yield blocks of guides: indices, coarse paths and transmission angles, rods."""
    for start in range(0, len(guides), SEARCH.block):
        part = slice(start, start + SEARCH.block)
        path, input_ = turned(guides[part], driver[part], SEARCH.coarse)
        yield (
            part,
            path,
            input_,
            np.abs(0.5 * (path[SEARCH.coarse // 2 - 1] + path[SEARCH.coarse // 2]) - joint[part]),
        )


def _transmission(found: Dwell, input_: Floats, request: StandStill) -> Floats:
    """Return the transmission angles of dyads that meet the request, -1 for others [deg]."""
    serves = (found.angle >= request.angle) & (found.swing >= request.swing)
    return np.where(serves, np.fmin(found.transmission, input_), -1.0)


def _tried(
    rows: dict[str, Array], guides: CouplerCurve, driver: Array, request: StandStill, size: float
) -> tuple[Complexes, Floats]:
    """Find the rocker pivot of each guide that promises most, and its merit.

    The merit is the transmission angle, less where the dyad does not quite serve [deg].  It is
    minus infinity, and the pivot NaN, where no pivot nearly serves.
    """
    pivots, best = np.full(len(guides), complex(np.nan, np.nan)), np.full(len(guides), -np.inf)
    for part, path, input_, rod in _blocks(guides, driver, rows["joint"]):
        joint = rows["joint"][part]
        tries = joint[:, None] + rod[:, None] * (ROCKERS[:, None] * DIRECTIONS).reshape(-1)
        found = dwells(path, joint, tries, request.residual, SEARCH.nearly * request.swing)
        with np.errstate(invalid="ignore"):
            lacking = np.maximum(1 - found.angle / request.angle, 0) + np.maximum(1 - found.swing / request.swing, 0)
            value = np.fmin(found.transmission, input_[:, None]) - SEARCH.deficit * lacking
            value = np.where(found.angle >= SEARCH.nearly * request.angle, value, -np.inf)
        crank = np.abs(np.diff(guides[part].linkage.points[np.arange(len(rod)), driver[part] - 1]))
        far = np.abs(path.T[:, None] - tries[..., None]).max(-1)
        value -= SEARCH.larger * np.maximum(np.log(far / (crank * size)), 0)
        first = np.argmax(value, axis=1)
        chosen = np.arange(len(first)), first
        pivots[part], best[part] = tries[chosen], value[chosen]
    return pivots, best


def _few_of_each(order: Indices, series: Array, limit: int) -> Indices:
    """Select the first `limit`, at most a third of one series while others remain."""
    late = ranks(series[order].astype(str)) >= -(-limit // 3)
    return np.asarray(order[np.sort(np.argsort(late, kind="stable")[:limit])])


def diameter(pivots: Complexes, path: Complexes) -> float:
    """Compute the diameter of pivots, slides and path over a turn, all complex."""
    every = np.concatenate([pivots, path[:: max(1, len(path) // SEARCH.degrees)]])
    return float(np.abs(every[:, None] - every).max())


def _dwelling(
    rows: dict[str, Array], dwell: DwellLinkages, path: Complexes, found: Dwell, least: Floats, i: int
) -> DwellCandidate:
    """Return a dwell on a crank of length 1, with its fixed pivots on +x."""
    linkage, point, joint, pivot = dwell.linkage, dwell.point[i], dwell.joint[i], dwell.pivot[i]
    z, finite, k = linkage.points[i], linkage.finite[i], int(dwell.driver[i]) - 1
    slides = slides_over_turn(coupler_curve(linkage[[i]], dwell.point[[i]]), dwell.driver[[i]])[0]
    scale = 1 / abs(z[k, 1] - z[k, 0])
    origin, turn = z[k, 0], np.abs(pivot - z[k, 0]) / (pivot - z[k, 0])  # the frame from A to E along +x
    laid = np.where(finite, scale * turn * (z - origin), turn * z)
    points = scale * turn * (np.array([point, joint, pivot]) - origin)
    guided, joint_, pivot_ = ([float(p.real), float(p.imag)] for p in points)
    begin = float((np.degrees(np.angle(turn * (z[k, 1] - z[k, 0]))) + found.begin[i] + 180) % 360 - 180)
    return DwellCandidate(
        id=int(rows["id"][i]),
        family=str(rows["family"][i]),
        series=str(rows["series"][i]),
        configuration=str(rows["configuration"][i]),
        order=int(rows["contact_order"][i]),
        angle=float(found.angle[i]),
        residual=float(found.residual[i]),
        swing=float(found.swing[i]),
        min_transmission=float(least[i]),
        size=float(scale) * diameter(np.array([*z[finite], joint, pivot, *slides[np.isfinite(slides)]]), path[:, i]),
        driver=k + 1,
        pivots=np.stack([laid.real, laid.imag, finite], axis=-1).tolist(),
        guided=guided,
        joint=joint_,
        pivot=pivot_,
        drive_from=begin,
        drive_to=begin + float(found.angle[i]),
    )
