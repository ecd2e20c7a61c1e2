"""Values of candidates by name, and their violations of the constraints of a problem."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..guidance.drive import SampledPoses, drive_metrics
from ..guidance.metrics import LEAST_ARM, min_transmission_turn, rotation_margin
from ..guidance.placement import mirrored_places
from ..guidance.return_path import lift
from ..guidance.slides import rails
from ..guidance.swept_area import intrusion, link_ends, link_segments, protrusion
from ..kinematics.linkage import Linkage
from ..kinematics.types import Array, Complexes, Floats, Indices, Mask
from ..problem.problem import Problem
from ..problem.region import Region
from ..quantities import BOUNDS, DEGREES, DRIVE_METRICS, DRIVES, MEASURES, SIZES, Bound
from .batch import CandidateBatch, every_flip, flip

#: Regions of pivots, with the pivots (0 fixed, 1 moving) that they must contain. Rails count as
#: fixed pivots, slots as moving ones.
PIVOT_REGIONS = {"fixed_pivots_in": (0,), "pivots_in": (0, 1)}


class ViolationWeights(NamedTuple):
    """Weights and tolerances of violations."""

    #: Weight of the logarithm of the deviation beside lengths in strokes and angles in radians: a
    #: guide may deviate on its way to a region of its pivots. Of 0.1 to 0.001 this answers nine
    #: hard requests of `tests/benchmarks/recall.py` best.
    deviation: float = 0.01
    relaxed: float = 0.02  #: weight of a relaxed constraint
    #: Amount up to which a constraint is satisfied [strokes, rad]: rounding of both.
    rounding: float = 1e-9
    #: Difference of violations up to which they are equal, so that the given orientation wins ties
    #: [strokes].
    tie: float = 1e-12
    stroke: float = 1e-6  #: difference up to which a stroke is the requested one [strokes]


WEIGHTS = ViolationWeights()

#: Largest sizes of an answer [strokes]: by default, and where other requested lengths or `max_size`
#: are large (see `farthest`). A much longer link stands for a slider, and rounding of its pivots
#: exceeds the deviation of the guide.
FARTHEST = 100.0, 1e3
#: Deviation over stroke up to which a guide counts as exact: such deviations are rounding. Added to
#: every ranked deviation, it leaves the order unchanged and makes a reduction below it worthless.
EXACT_DEVIATION = 1e-12


class SweptGrid(NamedTuple):
    """Positions at which the swept area is tested."""

    #: Intervals between the Chebyshev points of the stroke; four times as many places are tested.
    intervals: int = 16
    most: int = 256  #: largest number of intervals, which is quadrupled while the error exceeds `missed`
    #: Largest error of the grid in the place of a pivot or slide [sizes]; it is large where a block
    #: swings near its pivot.
    missed: float = 1e-4


SWEPT_GRID = SweptGrid()


@dataclass(frozen=True)
class Feasibility:
    """Violations of n candidates, by constraint; 0 where it holds.

    Lengths are in strokes, angles in radians, ratios in parts of the bound; the deviation is the
    logarithm of deviation over tolerance.  Infinite where the path is shorter than the stroke.
    """

    amounts: Mapping[str, Floats]
    relaxed: str = ""

    @cached_property
    def total(self) -> Floats:
        """Weighted sum of the violations, shape (n,)."""
        weighed = [amount * weight(name, self.relaxed) for name, amount in self.amounts.items()]
        return np.asarray(np.sum(weighed, axis=0))

    @cached_property
    def all(self) -> Mask:
        """Whether candidates satisfy all constraints, shape (n,)."""
        return np.asarray((np.stack(list(self.amounts.values())) <= WEIGHTS.rounding).all(axis=0))

    @property
    def counts(self) -> dict[str, int]:
        """Numbers of candidates that violate each constraint."""
        return {name: number for name, a in self.amounts.items() if (number := int((a > WEIGHTS.rounding).sum()))}


def weight(name: str, relaxed: str = "") -> float:
    """Return the weight of a violation in the total; `relaxed` names a relaxed constraint."""
    return WEIGHTS.relaxed if name == relaxed else WEIGHTS.deviation if name == "deviation" and not relaxed else 1.0


def nearer_arm(found: CandidateBatch) -> Floats:
    """Return the distances of guided points from nearer moving pivots, as traced, (n,)."""
    arms = np.abs(found.linkage.points[:, :, 1] - found.point[:, None])
    return np.asarray(np.fmin.reduce(np.where(found.linkage.finite[:, :, 1], arms, np.nan), axis=1))


def machine(problem: Problem, found: CandidateBatch) -> Linkage:
    """Return the linkages as built: those of slots are traced as their inversions."""
    return found.linkage.inverted() if problem.constraints.slots else found.linkage


def values(problem: Problem, found: CandidateBatch) -> dict[str, Floats]:
    """Return the arguments of a ranking; see `catalogue.problem.ranking.Ranking.cost`."""
    m = found.measures
    with np.errstate(all="ignore"):
        return {
            **{row.criterion: fill_missing(row, getattr(m, row.measure)) for row in SIZES},
            "transmission": transmission(problem, found) / 90,
            "deviation": (np.nan_to_num(found.expected, nan=np.inf) + EXACT_DEVIATION) / problem.deviation,
            "allowance": np.where(np.isfinite(found.allowance), found.allowance, 0.0) / problem.deviation,
            **{
                row.criterion: np.nan_to_num(bounded(problem, found, row))
                for row in DRIVES
                if row.criterion in problem.ranking.quantities
            },
        }


def fill_missing(row: Bound, value: Floats) -> Floats:
    """Replace missing values of a measure by the value that costs assume."""
    return value if row.absent is None else np.nan_to_num(value, nan=row.absent)


def bounded(problem: Problem, found: CandidateBatch, row: Bound) -> Floats:
    """Return the measure to which a bound applies, shape (n,) [strokes, deg]."""
    m = found.measures
    if row.source == MEASURES:
        return np.asarray(getattr(m, row.measure))
    if row.source == DRIVE_METRICS:
        works = drive_metrics(found.curve, found.traced, m, inverse=problem.constraints.slots)
        return np.asarray(getattr(works, row.measure))
    made: dict[str, Callable[[], Floats]] = {
        "allowance": lambda: found.allowance,
        "lift": lambda: lift(found.curve, found.traced, m),
        "min_transmission_turn": lambda: min_transmission_turn(machine(problem, found), m.driver),
    }
    return made[row.measure]()


def transmission(problem: Problem, found: CandidateBatch) -> Floats:
    """Return the least transmission angles that are ranked, shape (n,) [deg].

    They are the minima over the stroke or, if the crank must turn fully, over the turn; 0 where it
    does not.
    """
    over_stroke, driver = found.measures.min_transmission, found.measures.driver
    if not problem.constraints.full_rotation:
        return over_stroke
    return np.minimum(over_stroke, np.nan_to_num(min_transmission_turn(machine(problem, found), driver)))


def cost(problem: Problem, found: CandidateBatch) -> Floats:
    """Return the ranked cost of candidates, shape (n,); 0 where a constraint is relaxed."""
    if problem.relaxed:
        return np.zeros(len(found))
    return problem.ranking.cost(values(problem, found))


def faults(problem: Problem, found: CandidateBatch) -> Indices:
    """Count the measures with desirability 0, shape (n,); none unless the score is ranked."""
    if problem.relaxed or "score" not in problem.ranking.weights:
        return np.zeros(len(found), int)
    return problem.ranking.faults(values(problem, found))


def feasibility(problem: Problem, found: CandidateBatch, *, signed: bool = False) -> Feasibility:
    """Compute the violations of candidates, all measured on their finite motion.

    With `signed` they are negative where a constraint holds with a margin.
    """

    def over(value: Floats, missing: float = 0.0) -> Floats:
        return np.where(np.isnan(value), missing, value)

    wanted, m = problem.constraints, found.measures
    amounts: dict[str, Floats] = {}
    with np.errstate(all="ignore"):
        reached = np.isfinite(found.deviation) & (
            np.abs(found.traced.fit.stroke.astype(float) - problem.path.stroke) <= WEIGHTS.stroke
        )
        amounts["deviation"] = over(np.log(np.maximum(found.deviation, 1e-300) / problem.deviation))
        for row in SIZES:
            if (bound := getattr(wanted, row.name)) is not None:
                amounts[row.name] = over(excess(row, getattr(m, row.measure), bound))
        if (bound := wanted.min_allowance) is not None:
            amounts["min_allowance"] = over((bound - found.allowance) / bound)
        amounts["max_size" if wanted.max_size is None else "distance of the pivots"] = over(m.size - farthest(problem))
        amounts["distance from the moving pivots"] = over(LEAST_ARM - nearer_arm(found))
        if problem.is_wide:  # with coincident fixed pivots both cranks would turn as one body
            amounts["distance of the fixed pivots"] = over(LEAST_ARM - bounded(problem, found, BOUNDS["min_ground"]))
        if wanted.min_transmission:
            amounts["min_transmission"] = over(np.radians(wanted.min_transmission - m.min_transmission))
        if wanted.full_rotation:
            amounts["full_rotation"] = over(-np.fmax(*rotation_margin(machine(problem, found)).T), missing=1.0)
        if (bound := wanted.min_lift) is not None:
            amounts["min_lift"] = over((bound - lift(found.curve, found.traced, m)) / bound, missing=1.0)
        if wanted.min_transmission_turn:
            turn = min_transmission_turn(machine(problem, found), m.driver)
            amounts["min_transmission_turn"] = over(np.radians(wanted.min_transmission_turn - np.nan_to_num(turn)))
        amounts |= drive_violations(problem, found) | pivot_violations(problem, found.linkage, m.slides)
        amounts |= swept_violations(problem, found)
        for name, amount in amounts.items():
            amounts[name] = np.where(reached, amount if signed else np.maximum(amount, 0.0), np.inf)
    return Feasibility(amounts, problem.relaxed)


def excess(row: Bound, value: Floats, bound: float) -> Floats:
    """Return the violations of a bound, negative inside."""
    return value - bound if row.is_upper else bound - value


def farthest(problem: Problem) -> float:
    """Return the largest size of an answer, which replaces a missing `max_size` [strokes].

    It is the first of `FARTHEST`, or ten times a longer requested length up to the second. With
    `max_size` it is the second.
    """
    wanted = problem.constraints
    if wanted.max_size is not None:
        return FARTHEST[1]
    regions = (r.box for r in (wanted.fixed_pivots_in, wanted.pivots_in, wanted.swept_in) if r is not None)
    places = (z for z in (wanted.fixed_pivots, wanted.moving_pivots, wanted.crank) if z is not None)
    bend = problem.fixed_curvature
    lengths = [*np.ravel([*regions]), *np.abs(np.ravel([*places])), wanted.shortest, 1 / bend if bend else 0.0]
    finite = [float(abs(v)) for v in lengths if abs(v) < FARTHEST[1]]
    return min(max(FARTHEST[0], *(10 * v for v in finite)), FARTHEST[1])


def drive_violations(problem: Problem, found: CandidateBatch) -> dict[str, Floats]:
    """Compute the violations of bounds on the drive, negative inside."""
    bounds = [(row, bound) for row in DRIVES if (bound := getattr(problem.constraints, row.name)) is not None]
    if not bounds:
        return {}
    works = drive_metrics(found.curve, found.traced, found.measures, inverse=problem.constraints.slots)
    amounts = {}
    for row, bound in bounds:
        amount = excess(row, getattr(works, row.measure), bound) / (180 / np.pi if row.unit == DEGREES else bound)
        amounts[row.name] = np.where(np.isnan(amount), 1.0, amount)
    return amounts


def swept_violations(problem: Problem, found: CandidateBatch, nodes: int = SWEPT_GRID.intervals) -> dict[str, Floats]:
    """Compute the distances by which links leave the region or enter keep-out zones."""
    wanted, amounts = problem.constraints, {}
    if wanted.swept_in is not None or wanted.keep_out:
        poses, built = SampledPoses.of(found.curve, found.traced, nodes, inverse=wanted.slots), machine(problem, found)
        if (room := wanted.swept_in) is not None:
            swept = link_ends(built, poses)[..., None] if room.is_convex else link_segments(built, poses)
            amounts["swept_in"] = protrusion(room, swept)
        if wanted.keep_out:
            swept = link_segments(built, poses)
            amounts["keep_out"] = np.max([intrusion(zone, swept) for zone in wanted.keep_out], axis=0)
        rough = np.flatnonzero(poses.unresolved > SWEPT_GRID.missed * found.measures.size)
        if len(rough) and nodes < SWEPT_GRID.most:
            for name, amount in swept_violations(problem, found[rough], 4 * nodes).items():
                amounts[name][rough] = amount
    return amounts


def pivot_violations(problem: Problem, linkage: Linkage, slides: Complexes) -> dict[str, Floats]:
    """Compute distances of pivots, rails and slots outside their regions, by region, (n,).

    `slides` are the ends (n, 2, 2) of rails and slots, see `Measures.slides`; pivots at infinity
    are exempt.
    """
    amounts = {}
    for name in PIVOT_REGIONS:
        if (region := getattr(problem.constraints, name)) is not None:
            out = np.maximum(_distance_outside(region, region_places(name, linkage, slides)), 0.0).sum(axis=1)
            amounts[name] = out if region.is_convex else out + _excess_between_ends(region, name, linkage, slides)
    return amounts


def region_places(name: str, linkage: Linkage, slides: Complexes) -> Complexes:
    """Return the places that a region of pivots must hold: pivots, and ends of rails and slots.

    Returns
    -------
    ndarray, complex, shape (n, k)
        NaN where there is none.
    """
    planes = PIVOT_REGIONS[name]
    pivots = np.where(linkage.finite, linkage.points, np.nan)[:, :, planes].reshape(len(linkage), -1)
    return np.concatenate([pivots, _ends_within(name, linkage, slides).reshape(len(linkage), -1)], axis=1)


def _ends_within(name: str, linkage: Linkage, slides: Complexes) -> Complexes:
    """Return the ends (n, 2, 2) of rails and slots bound to a region, else NaN."""
    return slides if 1 in PIVOT_REGIONS[name] else rails(linkage, slides)


def _distance_outside(region: Region, z: Complexes) -> Floats:
    """Return the distances of places out of a region, negative inside, 0 for NaN."""
    there = np.isfinite(z)
    return np.where(there, region.outside(np.where(there, z, 0)), 0.0)


def _excess_between_ends(region: Region, name: str, linkage: Linkage, slides: Complexes) -> Floats:
    """Compute the distances by which rails and slots leave a concave region, (n,)."""
    ends = _ends_within(name, linkage, slides)
    out = np.zeros(ends.shape[:2])
    there = np.isfinite(ends).all(axis=-1)
    if there.any():
        out[there] = np.maximum(protrusion(region, ends[there][None, :, None]), 0.0)
    return np.asarray(out.sum(axis=1))


def best_orientation(
    problem: Problem, linkage: Linkage, point: Complexes, pole: Complexes, slides: Complexes
) -> tuple[Linkage, Complexes, Complexes]:
    """Reverse or mirror placed guides where this lowers the violations of pivot regions.

    Parameters
    ----------
    linkage : Linkage
        n linkages in mid-stroke, their paths from (0, 0) to (1, 0) [strokes].
    point, pole : complex ndarray, shape (n,)
        Guided points and poles there [strokes].
    slides : complex ndarray, shape (n, 2, 2)
        Ends of rails and slots there, NaN of cranks [strokes].

    Returns
    -------
    tuple of Linkage, complex ndarray, complex ndarray
        Linkages, points and poles, shape (n,), in the orientation of least violation.
    """
    best: tuple[Array, ...] | None = None
    for reverse, over in every_flip(problem, len(point)):
        there, z, p = flip(linkage, point, pole, reverse, over)
        violations = pivot_violations(problem, there, mirrored_places(slides, 1.0, reverse, over)).values()
        total = np.sum([*violations, np.zeros(len(z))], axis=0)
        now = (total, there.pivots, z, p)
        if best is None:
            best = now
            if not total.any():
                break
            continue
        better = total < best[0] - WEIGHTS.tie
        best = tuple(
            np.where(better.reshape(-1, *(1,) * (new.ndim - 1)), new, old) for new, old in zip(now, best, strict=True)
        )
    assert best is not None
    return Linkage.trusted(best[1].copy()), best[2], best[3]
