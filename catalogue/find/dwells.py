"""Find dwells: stored circular guides with an output dyad at the centre of the arc."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np

from ..candidates.select import ranks
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
from ..store import COLUMNS, Database, Guide, Mechanism, Reach, joined
from .explain import LESS, REMEDIES
from .names import check_names, eligible_series, option

#: Constraints available for a dwell.
GOVERNED = tuple(DwellArguments.__annotations__)


class DwellSearch(NamedTuple):
    """Budget and grids of the search for dwells."""

    share: int = 150  #: stored guides to trace per series and unit of effort
    rounds: int = 4  #: moves per step size
    coarse: int = 120  #: positions per turn to try dyads: every 3 degrees
    fine: int = 2880  #: positions per turn to measure the selected ones: every eighth of a degree
    degrees: int = 360  #: points of the path over the turn for the size
    block: int = 40  #: guides per block of trials: bounds the memory


SEARCH = DwellSearch()

#: Trial lengths of the rocker over that of the rod, about a factor of 1.4 apart.
ROCKERS = np.array([0.35, 0.5, 0.7, 1.0, 1.4, 2.0])
#: Trial directions from the joint to the rocker's pivot, 10 degrees apart.
DIRECTIONS = np.exp(2j * np.pi * np.arange(36) / 36)
#: Step sizes of the pattern search: of the pivot [rods], of the joint [rods x residual].
STEPS = (0.2, 0.1, 0.05, 0.025)
#: Moves of the pattern search: none, and to the eight neighbours.
AROUND = np.array([complex(x, y) for x in (0, -1, 1) for y in (0, -1, 1)])
#: Fractions of the request to try for advice on an empty result, by the number of requirements
#: relaxed.
SHARES = {1: (0.8, 0.5, 0.25), 2: (0.5,), 4: (0.5,)}


def find_dwells(
    database: Database, request: StandStill, constraints: Constraints, *, limit: int, effort: int
) -> DwellResults:
    """Find dwells, at most one per stored guide; see `catalogue.Catalogue.find_dwells`."""
    if not isinstance(request, StandStill):
        raise InvalidRequest(f"find_dwells wants a StandStill, not {quoted(request)}")
    limit, effort = whole("limit", limit, 1), whole("effort", effort, 1)
    if other := [name for name in constraints.active() if name not in GOVERNED]:
        raise InvalidRequest(f"{other[0]} does not go with a dwell; there are {', '.join(GOVERNED)}")
    check_names(database, constraints)
    found = _found(database, request, constraints, limit, effort)
    if len(found):
        laid = [replace(one.for_request(request).scaled(request.crank), unit=request.unit) for one in found]
        return replace(found, candidates=laid)
    if not database.has_guides:
        return found
    return DwellResults([], f"{found.explanation}; {_advice(database, request, constraints, effort)}")


def _advice(database: Database, request: StandStill, constraints: Constraints, effort: int) -> str:
    """Return tested remedies as options: one requirement relaxed, two, or all."""
    asked = {name: getattr(request, name) for name in ("angle", "residual", "swing")}
    if constraints.min_transmission:
        asked["min_transmission"] = constraints.min_transmission
    for count, shares in SHARES.items():
        told = []
        for names in combinations(asked, min(count, len(asked))):
            for share in shares:
                eased = {name: asked[name] / share if name == "residual" else asked[name] * share for name in names}
                eased = {name: float(f"{value:.3g}") for name, value in eased.items()}
                least = eased.pop("min_transmission", constraints.min_transmission)
                try:
                    looser = replace(request, **eased)
                except InvalidRequest:  # the residual is too large for the swing
                    break
                if len(_found(database, looser, replace(constraints, min_transmission=least), 1, effort)):
                    eased |= {"min_transmission": least} if "min_transmission" in names else {}
                    bounds = [f"{option(name)} {value:g} (asked {asked[name]:g})" for name, value in eased.items()]
                    told.append(" with ".join(bounds))
                    break
        if told:
            return f"{REMEDIES}: {', or '.join(told)}; {LESS}"
    return "ask for much less of all"


def _found(database: Database, request: StandStill, constraints: Constraints, limit: int, effort: int) -> DwellResults:
    """Search dwells; explain an empty result."""
    stored = _turning(database, constraints, request, effort)
    if stored is None:
        return DwellResults([], "no dwell found: no stored arc spans so much of a full turn of its crank")
    rows, guides, driver = stored
    pivots, coarse = _tried(rows, guides, driver, request)
    order = np.argsort(-np.nan_to_num(coarse, nan=-1.0), kind="stable")
    order = order[coarse[order] > 0.9 * constraints.min_transmission]
    order = _few_of_each(order, rows["series"], 4 * limit)
    if not len(order):
        told = f"no dwell found: of {len(guides)} arcs none has a dyad that stands so still and swings so far"
        return DwellResults([], told)
    rows = {name: values[order] for name, values in rows.items()}
    guides, driver = guides[order], driver[order]
    rows["joint"], pivots = _moved(rows["joint"], pivots[order], guides, driver, request)
    path, input_ = turned(guides, driver, SEARCH.fine)
    final = dwells(path, rows["joint"], pivots[:, None], request.residual)[:, 0]
    least = _transmission(final, input_, request)
    good = least >= max(constraints.min_transmission, 1e-9)
    order = np.flatnonzero(good)[np.argsort(-least[good], kind="stable")]
    chosen = _few_of_each(order, rows["series"], limit)
    told = f"{len(guides)} dyads were measured over the full turn, {good.sum()} serve"
    if not len(chosen):
        told = f"no dwell found: of {len(guides)} dyads the longest dwell is {np.nanmax(final.angle):.4g} degrees"
    return DwellResults([_dwelling(rows, guides, driver, pivots, path, final, least, i) for i in chosen], told)


def _turning(
    database: Database, constraints: Constraints, request: StandStill, effort: int
) -> tuple[dict[str, Array], CouplerCurve, Array] | None:
    """Retrieve stored arcs at mid-dwell, on turning cranks that cover the requested angle."""
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
    good = np.flatnonzero(turns & (works.drive_angle >= 0.7 * request.angle))
    if not len(good):
        return None
    rows, guides, traced = {k: v[good] for k, v in rows.items()}, guides[good], traced[good]
    linkage, point, _ = mid_stroke(guides, traced)
    fit = traced.fit
    depth = np.copysign(np.sqrt(1 / fit.curvature**2 - 0.25 * fit.stroke**2), fit.curvature)
    rows["joint"] = fit.start + fit.along * (0.5 * fit.stroke + 1j * depth)
    return rows, coupler_curve(linkage, point), works.driver[good]


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
    rows: dict[str, Array], guides: CouplerCurve, driver: Array, request: StandStill
) -> tuple[Complexes, Floats]:
    """Find the rocker pivot with the best transmission angle of each guide.

    NaN if none meets the request.
    """
    pivots, best = np.full(len(guides), complex(np.nan, np.nan)), np.full(len(guides), np.nan)
    for part, path, input_, rod in _blocks(guides, driver, rows["joint"]):
        joint = rows["joint"][part]
        tries = joint[:, None] + rod[:, None] * (ROCKERS[:, None] * DIRECTIONS).reshape(-1)
        found = dwells(path, joint, tries, request.residual, request.swing)
        value = _transmission(found, input_[:, None], request)
        first = np.argmax(value, axis=1)
        chosen = np.arange(len(first)), first
        pivots[part], best[part] = tries[chosen], np.where(value[chosen] > 0, value[chosen], np.nan)
    return pivots, best


def _few_of_each(order: Indices, series: Array, limit: int) -> Indices:
    """Select the first `limit`, at most a third of one series while others remain."""
    late = ranks(series[order].astype(str)) >= -(-limit // 3)
    return np.asarray(order[np.sort(np.argsort(late, kind="stable")[:limit])])


def _moved(
    joint: Complexes, pivots: Complexes, guides: CouplerCurve, driver: Array, request: StandStill
) -> tuple[Complexes, Complexes]:
    """Improve the transmission angle by a pattern search over joints and pivots."""
    joint, pivots = joint.copy(), pivots.copy()
    for part, path, input_, rod in _blocks(guides, driver, joint):
        at = np.arange(len(rod))
        each = np.repeat(at, len(AROUND))
        for step in np.repeat(STEPS, SEARCH.rounds):
            joints = joint[part, None] + step * np.radians(request.residual) * rod[:, None] * AROUND
            tried = pivots[part, None] + step * rod[:, None] * AROUND
            found = dwells(path[:, each], joints.ravel(), tried[each], request.residual, request.swing)
            value = _transmission(found, input_[each, None], request).reshape(len(rod), -1)
            best = np.argmax(value, axis=1)  # the first move is none
            joint[part], pivots[part] = joints[at, best // len(AROUND)], tried[at, best % len(AROUND)]
    return joint, pivots


def diameter(pivots: Complexes, path: Complexes) -> float:
    """Compute the diameter of pivots, slides and path over a turn, all complex."""
    every = np.concatenate([pivots, path[:: max(1, len(path) // SEARCH.degrees)]])
    return float(np.abs(every[:, None] - every).max())


def _dwelling(
    rows: dict[str, Array],
    guides: CouplerCurve,
    driver: Array,
    pivots: Complexes,
    path: Complexes,
    found: Dwell,
    least: Floats,
    i: int,
) -> DwellCandidate:
    z, finite, joint, pivot = guides.linkage.points[i], guides.linkage.finite[i], rows["joint"][i], pivots[i]
    k = int(driver[i]) - 1
    slides = slides_over_turn(guides[np.array([i])], driver[[i]])[0]
    scale = 1 / abs(z[k, 1] - z[k, 0])
    origin, turn = z[k, 0], np.abs(pivot - z[k, 0]) / (pivot - z[k, 0])  # the frame from A to E along +x
    laid = np.where(finite, scale * turn * (z - origin), turn * z)
    points = scale * turn * (np.array([guides.point[i], joint, pivot]) - origin)
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
        size=scale * diameter(np.array([*z[finite], joint, pivot, *slides[np.isfinite(slides)]]), path[:, i]),
        driver=k + 1,
        pivots=np.stack([laid.real, laid.imag, finite], axis=-1).tolist(),
        guided=guided,
        joint=joint_,
        pivot=pivot_,
        drive_from=begin,
        drive_to=begin + float(found.angle[i]),
    )
