"""Stored guides as starts: ranked by estimated cost and violation, a varied shortlist."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from ..candidates.batch import CandidateBatch, Origin, every_flip, measured, place_on_path, slides_on_path
from ..candidates.feasibility import best_orientation, excess, fill_missing
from ..candidates.select import ranks
from ..errors import DatabaseError
from ..guidance.arc_window import at_sweep
from ..guidance.coupler_curve import CouplerCurve, coupler_curve
from ..guidance.kinds import POINTS, RETURNS, SLOTS
from ..guidance.reach import LEVELS, REACH
from ..guidance.trace import Traced, trace
from ..kinematics.batch import take
from ..kinematics.linkage import SLIDING, Linkage
from ..kinematics.types import Array, Floats, Indices, Mask
from ..problem.problem import Problem
from ..quantities import DEGREES, DRIVES, RANKED, SIZES, STORED
from ..store import JOINED, PIVOT_NAMES, Database
from ..units import LENGTH

#: Number of guides per member read for a unit of effort, in order of coverage.
GUIDES_PER_EFFORT = 2000
#: Weight of the violation of a length or angle by a stored reach, relative to the cost.
VIOLATION_WEIGHT = 3.0
#: Least and largest factor by which a stored stroke is stretched to use the tolerance.
STRETCH_RANGE = (0.5, 2.0)
#: Least and largest such factor for arcs that are cut to a given sweep.
CUT_RANGE = (0.02, 1.5)
#: Typical exponent of the stroke to which the deviation is proportional.
STROKE_EXPONENT = 4.5
#: Typical exponent of the tolerance to which the stroke is proportional.
TOLERANCE_EXPONENT = 0.22
#: Violation by a deviation of 2.718 tolerances, on a logarithmic scale [radians].
DEVIATION_VIOLATION = 0.1
#: Violation by a straight line whose distance from a flat arc is the tolerance [radians].
LINE_VIOLATION = 0.02
#: Violation if no crank turns fully [radians].
NO_TURN_VIOLATION = 0.3
#: Violation assumed for an unknown angle [radians].
UNKNOWN_VIOLATION = 0.5
#: Number of corrections of the window of a return guide.
CORRECTIONS = 4
#: Fraction of the tolerance that a return guide should use.
USED_TOLERANCE = 0.995
#: Differences in size [strokes] and transmission angle [right angles] below which two starts of a
#: series count as one.
SAME_START = (0.15, 0.12)
#: Allowance of a typical stored guide without deviation [requested tolerances].
TYPICAL_ALLOWANCE = 4.0
#: Largest sagitta of an arc for which straight guides are starts, and conversely [strokes].
MAX_SAGITTA = 0.05
#: Largest file whose seal is checked before a search [bytes]: checking a larger one takes longer
#: than the search.
MAX_CHECKED_SIZE = 100_000_000


@dataclass(frozen=True)
class Reaches:
    """Stored reaches; arrays of shape (n,), boxes (n, 4) as in `Measures` [stroke, deg]."""

    stored: Mapping[str, Floats]  #: stored quantities by name

    guide: Array
    level: Array
    series: Array
    family: Array
    configuration: Array
    order: Array
    sweep: Floats
    deviation: Floats
    rotates: Array
    fixed_box: Floats
    box: Floats

    def __len__(self) -> int:
        return len(self.guide)

    def __getitem__(self, name: str) -> Floats:
        """Return a stored quantity by its name."""
        return self.stored[name]

    @cached_property
    def series_number(self) -> Array:
        """Number of each reach's series among the series present."""
        return np.asarray(np.unique(self.series.astype(str), return_inverse=True)[1])

    @cached_property
    def family_number(self) -> Array:
        """Number of each reach's family among the families present."""
        return np.asarray(np.unique(self.family.astype(str), return_inverse=True)[1])


class ChangedError(DatabaseError):
    """Guides found by one read are missing at the next: replaced by a build, or damaged."""


def stored_reaches(problem: Problem, database: Database, effort: int = 1) -> Reaches:
    """Return the stored reaches that may suit a problem; their number grows with the effort.

    They are kept in memory until the file changes.
    """
    what = (tuple(kinds(problem)), levels(problem), GUIDES_PER_EFFORT * effort)
    size, *_ = stamp = database.stamp()
    kept = _KEPT.setdefault(database, {})
    if kept.get("stamp") != stamp:
        kept.clear()
        if size <= MAX_CHECKED_SIZE:
            database.check(rules=False)
        kept["stamp"] = stamp
    if what not in kept:
        kept[what] = read(database, *what)
    reaches: Reaches = kept[what]
    return reaches


#: Reaches read from each open database, by the arguments of the query.
_KEPT: WeakKeyDictionary[Database, dict[Any, Any]] = WeakKeyDictionary()


def read(database: Database, kinds: Sequence[str], levels: tuple[int, int], cover: int) -> Reaches:
    """Read the reaches of guides of these kinds between two levels of deviation.

    Of each member the first `cover` guides are read, in order of coverage.
    """
    boxes = [f"{which}_{side}" for which in ("fixed", "all") for side in ("x0", "y0", "x1", "y1")]
    columns = {
        **dict.fromkeys(("reach.guide_id", "reach.level", "guide.contact_order", "reach.rotates"), int),
        **dict.fromkeys(("mechanism.series", "mechanism.family", "mechanism.configuration"), str),
        **{f"reach.{name}": float for name in ("sweep", "deviation", *STORED, *boxes)},
    }
    wanted = f"reach.kind IN ({_placeholders(kinds)}) AND reach.level BETWEEN ? AND ? AND reach.cover < ?"
    rows = database.plain(columns, f"{JOINED} WHERE {wanted}", (*kinds, *levels, cover))
    fixed, every = (np.stack([rows.pop(name) for name in boxes[i : i + 4]], axis=1) for i in (0, 4))
    guide, order = rows.pop("guide_id"), rows.pop("contact_order")
    stored = {name: rows.pop(name) for name in STORED}
    return Reaches(guide=guide, order=order, stored=stored, **rows, fixed_box=fixed, box=every)


def _placeholders(values: Sequence[Any]) -> str:
    """Return a placeholder for each value."""
    return ", ".join("?" * len(values))


def kinds(problem: Problem) -> list[str]:
    """Return the kinds of stored guides that may suit a problem; for flat arcs lines too."""
    wanted = problem.constraints
    names = SLOTS if wanted.slots else RETURNS if wanted.returns else POINTS
    flat = problem.fixed_curvature is not None and abs(problem.fixed_curvature) / 8 < MAX_SAGITTA
    return [names["circle"], names["line"]] if flat else [names[problem.path.kind]]


def levels(problem: Problem) -> tuple[int, int]:
    """Return the range of levels of deviation to read.

    These are the requested level and the next looser one; all tighter ones too if the deviation is
    ranked or the radius is given.
    """
    top = int(np.clip(np.floor(np.log10(problem.deviation) + 1e-9), min(LEVELS), max(LEVELS)))
    tightest = min(LEVELS) if "deviation" in problem.ranking.weights or problem.fixed_curvature is not None else top
    return max(tightest, min(LEVELS)), min(top + 1, max(LEVELS))


def eligible(problem: Problem, reaches: Reaches) -> Mask:
    """Tell which reaches have a requested family, series, configuration and order, shape (n,)."""
    wanted = problem.constraints
    good = np.ones(len(reaches), bool)
    sorts = {"families": reaches.family, "series": reaches.series, "configurations": reaches.configuration}
    for name, column in sorts.items():
        if allowed := getattr(wanted, name):
            good &= np.isin(column.astype(str), allowed)
    if wanted.pins_only:
        good &= ~np.isin(reaches.family.astype(str), SLIDING)
    return good & (reaches.order >= wanted.order)


def estimate(problem: Problem, reaches: Reaches) -> tuple[Floats, Floats]:
    """Estimate cost plus violation of stored reaches, and factors of their strokes, (n,) each.

    A straight reach is stretched until it is likely to use the tolerance; the window of an arc is
    cut until its sweep is the requested one.
    """
    with np.errstate(all="ignore"):
        stretch, missing = _stretches(problem, reaches)
        values = _values(problem, reaches, stretch)
        return problem.ranking.cost(values) + VIOLATION_WEIGHT * _estimate_violation(
            problem, reaches, stretch, missing, values
        ), stretch


def _stretches(problem: Problem, reaches: Reaches) -> tuple[Floats, Floats]:
    """Return factors that stretch strokes, and the remaining errors of sweeps, (n,) each."""
    stretch = np.clip((problem.deviation / np.maximum(reaches.deviation, 1e-12)) ** TOLERANCE_EXPONENT, *STRETCH_RANGE)
    if problem.ranking.only == "deviation":
        stretch = np.ones_like(stretch)
    if problem.fixed_curvature is None:
        return stretch, np.zeros(len(reaches))
    curved, sweep = reaches.sweep > 0, abs(problem.fixed_curvature)
    share = sweep / np.where(curved, reaches.sweep, sweep)
    missing = np.where(curved, np.maximum(np.log(share), 0.0), sweep / 8 / problem.deviation * LINE_VIOLATION)
    return np.where(curved, np.clip(share, *CUT_RANGE), stretch), missing


def _values(problem: Problem, reaches: Reaches, stretch: Floats) -> dict[str, Floats]:
    """Return the arguments of a ranking that are known for stored reaches.

    See `candidates.feasibility.values`.
    """
    shorter = 1 / stretch
    deviation = np.maximum(reaches.deviation, 1e-12) * stretch**STROKE_EXPONENT / problem.deviation
    values = {
        "deviation": deviation,
        "allowance": TYPICAL_ALLOWANCE * np.maximum(1 - np.minimum(deviation, 0.7), 0.0),
    }
    for row in RANKED:
        if row.typical is not None:
            values[row.criterion] = np.full(len(reaches), row.typical)
        elif row.measure in reaches.stored:
            value = fill_missing(
                row, reaches[row.measure] * shorter if row.unit == LENGTH else reaches[row.measure] / 90
            )
            values[row.criterion] = value if row.limit is None or not row.is_upper else np.maximum(row.limit, value)
    return values


def _estimate_violation(
    problem: Problem, reaches: Reaches, stretch: Floats, missing: Floats, values: dict[str, Floats]
) -> Floats:
    """Estimate the violations of the constraints by stored reaches, shape (n,)."""
    bounds = problem.constraints
    broken = np.maximum(np.log(values["deviation"]), 0.0) * DEVIATION_VIOLATION + missing
    for row in SIZES:
        if (bound := getattr(bounds, row.name)) is not None:
            over = excess(row, values[row.criterion], bound)
            broken += np.where(np.isnan(over), 0.0, np.maximum(over, 0.0))
    broken += np.maximum(np.radians(bounds.min_transmission - reaches["min_transmission"]), 0.0)
    if bounds.full_rotation:
        broken += np.where(reaches.rotates > 0, 0.0, NO_TURN_VIOLATION)
    for row in DRIVES:
        if row.unit == DEGREES and (bound := getattr(bounds, row.name)) is not None:
            column = reaches[row.measure]
            over = np.maximum(np.radians(excess(row, column * stretch, bound)), 0)
            broken += np.where(np.isnan(column), UNKNOWN_VIOLATION, over)
    return broken + _distance_outside(problem, reaches, 1 / stretch)


def _distance_outside(problem: Problem, reaches: Reaches, shorter: Floats) -> Floats:
    """Return the distances of stored boxes of pivots outside their regions, shape (n,).

    Each guide is in its best orientation.
    """
    regions = {"fixed_pivots_in": reaches.fixed_box, "pivots_in": reaches.box}
    regions = {name: box for name, box in regions.items() if getattr(problem.constraints, name) is not None}
    if not regions:
        return np.zeros(len(reaches))
    least = np.full(len(reaches), np.inf)
    for reverse, over in every_flip(problem, 1):
        out = np.zeros(len(reaches))
        for name, box in regions.items():
            box = box * shorter[:, None]
            x = -box[:, [2, 0]] if reverse[0] else box[:, [0, 2]]
            y = -box[:, [3, 1]] if over[0] else box[:, [1, 3]]
            corners = np.stack([x[:, 0] + 1j * y[:, 0], x[:, 1] + 1j * y[:, 1]], axis=1) + 0.5
            far = np.maximum(getattr(problem.constraints, name).outside(np.nan_to_num(corners, nan=0.5)), 0.0)
            out += np.where(np.isnan(corners), 0.0, far).sum(1)
        least = np.minimum(least, out)
    return least


def shortlist(reaches: Reaches, merit: Floats, count: int, skip: Array | None = None) -> Indices:
    """Return the numbers of the most promising reaches, best first.

    Each guide occurs once; series have equal shares, and the guides are unlike each other.

    Parameters
    ----------
    merit : ndarray, shape (n,)
        Less is better; infinite for reaches that are not eligible.
    skip : ndarray of int, optional
        Guides that earlier shortlists contained.
    """
    order = np.argsort(merit, kind="stable")
    order = order[np.isfinite(merit[order])]
    order = order[np.sort(np.unique(reaches.guide[order], return_index=True)[1])]
    if skip is not None and len(skip):
        order = order[~np.isin(reaches.guide[order], skip)]
    size = np.floor(np.log(reaches["size"][order]) / SAME_START[0]).astype(int)
    angle = np.floor(reaches["min_transmission"][order] / 90 / SAME_START[1]).astype(int)
    series, family = reaches.series_number[order], reaches.family_number[order]
    repeated = ranks(series, family, size, angle)  # number of similar reaches before each
    by = np.argsort(repeated, kind="stable")
    turn = np.empty(len(order), int)
    turn[by] = ranks(series[by])  # order: the first guide of each series, then the second of each
    return order[np.argsort(turn, kind="stable")][:count]


def candidates_of(
    problem: Problem, database: Database, reaches: Reaches, chosen: Indices, stretch: Floats
) -> CandidateBatch:
    """Place chosen reaches along the path, in the best orientation for their pivots."""
    guides, half, centre, origin = _read_guides(problem, database, reaches, chosen)
    low, high = guides.extent
    most = REACH.usable * np.minimum(low / (1 - centre), high / (1 + centre))
    free = bool((reaches.sweep[chosen] > 0).any()) if problem.curved else False
    traced = trace(guides, np.minimum(half * stretch, most), circle=free, split=True, centre=centre, nodes=16)
    if problem.constraints.returns:  # returning points are not refined
        if problem.fixed_curvature is not None:
            sweep = abs(problem.fixed_curvature)
            traced = at_sweep(guides, half, centre, reaches.sweep[chosen], sweep)[1]
        else:
            traced = _fit_to_tolerance(problem, guides, traced, half * stretch, most, centre)
    linkage, point, pole = place_on_path(problem, guides, traced)
    slides = slides_on_path(problem, guides, traced)
    return measured(problem, origin, *best_orientation(problem, linkage, point, pole, slides))


def _fit_to_tolerance(
    problem: Problem, guides: CouplerCurve, traced: Traced, half: Floats, most: Floats, centre: Floats
) -> Traced:
    """Fit the windows of guides to the tolerance by the secant method on logarithms.

    Where the deviation is ranked, only windows that exceed the tolerance are cut.
    """
    power, half = np.full(len(half), STROKE_EXPONENT), np.minimum(half, most)
    for _ in range(CORRECTIONS):
        before, relative = half, traced.relative.astype(float)
        with np.errstate(all="ignore"):
            factor = (USED_TOLERANCE * problem.deviation / relative) ** (1 / power)
        if problem.ranking.only == "deviation":
            factor = np.minimum(factor, 1.0)
        half = np.where(np.isfinite(factor), np.minimum(half * np.clip(factor, *STRETCH_RANGE), most), half)
        traced = trace(guides, half, circle=problem.curved, split=True, centre=centre, nodes=16)
        with np.errstate(all="ignore"):
            slope = np.log(traced.relative.astype(float) / relative) / np.log(half / before)
        power = np.where(np.isfinite(slope), np.clip(slope, 0.5 * STROKE_EXPONENT, 3 * STROKE_EXPONENT), power)
    return traced


def _read_guides(
    problem: Problem, database: Database, reaches: Reaches, chosen: Indices
) -> tuple[CouplerCurve, Floats, Floats, Origin]:
    """Return the guides of chosen reaches in their canonical frame.

    The origin of this frame is the pole; a guide with a slot is given as its inversion. Half
    windows, their middles and the origins of the guides are returned too.
    """
    columns = {
        **dict.fromkeys(("reach.guide_id", "reach.level"), int),
        **dict.fromkeys(("reach.half", "reach.centre", "guide.x", "guide.y"), float),
        **{f"mechanism.{name}": float for name in PIVOT_NAMES},
    }
    ids = reaches.guide[chosen].tolist()
    rows = database.plain(columns, f"{JOINED} WHERE reach.guide_id IN ({_placeholders(ids)})", ids)
    place = {pair: i for i, pair in enumerate(zip(rows["guide_id"].tolist(), rows["level"].tolist(), strict=True))}
    wanted = zip(reaches.guide[chosen].tolist(), reaches.level[chosen].tolist(), strict=True)
    at = np.array([place.get(pair, -1) for pair in wanted], int)
    if (at < 0).any():
        _KEPT.pop(database, None)
        raise ChangedError(f"{database.path} has changed while it was read, or is damaged: try again or build it")
    linkage = Linkage.trusted(database.pivots(rows)[at])
    if problem.constraints.slots:  # then only kinds with slots were read
        linkage = linkage.inverted()
    z = rows["x"][at] + 1j * rows["y"][at]
    part = take(reaches, chosen)
    origin = Origin(part.guide, part.family, part.series, part.configuration, part.order, np.zeros(len(at), int))
    return coupler_curve(linkage, z, pole=np.zeros_like(z)), rows["half"][at], rows["centre"][at], origin
