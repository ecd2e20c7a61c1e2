"""The linearised problem of placed guides: distances, constraints, measures, derivatives.

The nominal is fixed and the linkage moves relative to it: translations and rotations of the whole
linkage replace those of the nominal. Only the curvature of an arc of any radius is an additional
coordinate.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from ..candidates.batch import CandidateBatch, curves, in_best_charts, near_path
from ..candidates.feasibility import (
    EXACT_DEVIATION,
    PIVOT_REGIONS,
    cost,
    drive_violations,
    excess,
    feasibility,
    swept_violations,
    values,
)
from ..guidance.allowance import Zone
from ..guidance.circuit_curve import CircuitCurve
from ..guidance.coupler_curve import CouplerCurve
from ..guidance.fixed_nominal import Nominal
from ..guidance.metrics import LEAST_ARM
from ..guidance.minimum_zone import concentric, exchange, grid, rise_over
from ..guidance.sensitivity import COUNT, displaced, pose_jacobian
from ..kinematics.batch import take
from ..kinematics.linkage import Linkage
from ..kinematics.types import Array, Complexes, Floats, Indices, Mask
from ..problem.path import FULLEST
from ..problem.problem import Problem
from ..problem.ranking import RISING, Ranking
from ..quantities import DEGREES, DRIVE, SIZES, TRANSMISSIONS
from .model import Judged
from .quantities import BETWEEN_STATIONS, POINTS_ONLY, Pieces, Quantities


class Linearisation(NamedTuple):
    """Grids and finite differences of the linearised problem."""

    #: Least unit of the moves of a pivot, which is its distance from the guided point otherwise
    #: [strokes].
    least_unit: float = 0.1
    nodes: int = 32  #: number of intervals between the points at which the distance is linearised
    fewer: int = 16  #: number of intervals between the points at which transmission is evaluated
    flattest: float = 50.0  #: radius of the flattest arc, if none is given [strokes]
    bend_step: float = 1e-6  #: step of finite differences by curvatures [1/stroke]
    pivot_step: float = 1e-5  #: step of finite differences by pivots, in their units
    worse: float = 0.02  #: step of finite differences of the cost by measures, towards larger cost
    #: Distance of a constraint within which its finite differences are computed [strokes, rad].
    near: float = 0.05


GRID = Linearisation()

#: Index of the coordinate that never moves: the guided point is in the middle of its stroke.
FIXED_COORDINATE = 8


class Parametrisation(Protocol):
    """Coordinates of the moves of placed guides, p each, in units of a large step."""

    def basis(self, found: CandidateBatch) -> Floats:
        """Return the derivatives (n, 10, p) of coordinates by the steps.

        The coordinates are those of `catalogue.guidance.sensitivity`.
        """

    def moved(self, found: CandidateBatch, step: Floats) -> tuple[Linkage, Complexes, Mask]:
        """Return the valid linkages and guided points after steps (n, p), and their mask (n,)."""


@dataclass(frozen=True)
class PivotCoordinates:
    """Coordinates of the pivots and the guided point, in units of their distance from that point.

    After each step the linkage is placed along the path again. That also rotates and shifts held
    pivots, by less and less as the steps become shorter.
    """

    frozen: Mask | None = None  #: mask (10,) of fixed coordinates: x and y of A1, A1*, A2, A2* and the guided point

    def basis(self, found: CandidateBatch) -> Floats:
        unit = units(found.linkage, found.point)
        if self.frozen is not None:
            unit[:, self.frozen] = 0.0
        return unit[:, :, None] * np.eye(COUNT)

    def moved(self, found: CandidateBatch, step: Floats) -> tuple[Linkage, Complexes, Mask]:
        change = (self.basis(found) @ step[..., None])[..., 0]
        return displaced(found.linkage, found.point, change)


def units(linkage: Linkage, point: Complexes) -> Floats:
    """Return the units of moves: distances of the pivots from guided points, shape (n, 10).

    The guided point itself moves only across the path.
    """
    arm = np.abs(linkage.points - point[:, None, None]).reshape(-1, 4)
    unit = np.where(linkage.finite.reshape(-1, 4), np.maximum(arm, GRID.least_unit), 1.0)
    unit = np.repeat(np.concatenate([unit, np.ones((len(unit), 1))], axis=1), 2, axis=1)
    unit[:, FIXED_COORDINATE] = 0.0
    return unit


@dataclass(frozen=True)
class Subproblem:
    """Distances, constraints and measures of n guides, linearised in p coordinates.

    Coordinates are scaled so that a step of 1 is large.
    """

    error: Floats  #: distances from the nominal along the path, (n, m) [strokes]
    jacobian: Floats  #: their derivatives, (n, m, p)
    limits: Mapping[str, Pieces]  #: constraints: value + slope s <= 0
    measures: Mapping[str, Pieces]  #: arguments of the cost: for each measure, the largest value + slope s
    marginal: Mapping[str, Floats]  #: increase of the cost per unit of each measure, (n,)
    allowed: Floats  #: tolerance of the distances, (n,) [strokes]
    by_error: Mapping[str, Floats]  #: increase of constraints and measures per unit of the largest error, (n,)
    relaxed: str = ""  #: name of the constraint whose violation is minimised

    def __getitem__(self, index: Indices) -> Subproblem:
        """Return the problems of guides by their numbers, in this order, with repetitions."""

        def some(every: Mapping[str, Pieces]) -> dict[str, Pieces]:
            return {name: Pieces(p.value[index], p.slope[index]) for name, p in every.items()}

        marginal, by_error = ({k: part[index] for k, part in d.items()} for d in (self.marginal, self.by_error))
        error, jacobian, allowed = self.error[index], self.jacobian[index], self.allowed[index]
        rows = some(self.limits), some(self.measures)
        return Subproblem(error, jacobian, *rows, marginal, allowed, by_error, self.relaxed)


def linearise(
    problem: Problem,
    found: CandidateBatch,
    guides: CouplerCurve | CircuitCurve,
    moves: Parametrisation,
    nominal: Nominal | None = None,
) -> Subproblem:
    """Return the linear problem of placed guides, in the coordinates of `moves`.

    For an arc of any radius the curvature is an additional coordinate. If a `nominal` in place is
    given, distances are measured from it.
    """
    many = problem.is_wide or "deviation" in (problem.ranking.only, problem.relaxed)
    intervals = GRID.nodes if many else GRID.fewer
    nodes = grid(intervals).nodes
    low, high = found.traced.low.astype(float), found.traced.high.astype(float)
    u, v = guides.path.window(low, high, nodes)
    z: Complexes = guides.point + (u + 1j * v) * guides.tangent
    t = 0.5 * (high + low) + 0.5 * (high - low) * nodes[:, None]
    bend = _curvature(problem, found)
    rise = found.traced.fit.rise if problem.is_wide else None  # the arc is best-placed already
    error, tangent, by_bend = distance(z, bend, rise, 0.5 * problem.path.stroke)
    if nominal is None and rise is None:
        error = centred(error, z, bend)
    by = pose_jacobian(guides.motion, guides.point, t, tangent)
    basis = moves.basis(found)
    pose = guides.motion.pose(t[::2])
    read = Quantities.of(problem, found, pose, by[::2], found.measures.min_transmission)
    limited, measures = _limits(problem, found, read), {}
    if not problem.relaxed:
        measures = {name: read.ranked(name) for name in sorted(problem.ranking.quantities - {"deviation", "allowance"})}
    if rough := without_derivatives(problem):
        limited |= differences(problem, found, guides.motion.chart, rough, basis, nominal)
    limits_, measures_, by_error = _scatter_pieces(problem, found, guides)
    limited, measures = limited | limits_, measures | measures_
    limited, measures = ({name: p.in_basis(basis) for name, p in every.items()} for every in (limited, measures))
    jacobian = np.moveaxis(by.across, 0, 1) @ basis
    if problem.curvature is None:
        jacobian = np.concatenate([jacobian, by_bend.T[..., None]], axis=-1)
        limited, measures = ({k: wider(p) for k, p in d.items()} for d in (limited, measures))
        limited["radius"] = _radius(bend, jacobian.shape[-1])
    marginal = marginals(problem, found)
    allowed = np.full(len(found), problem.deviation)
    return Subproblem(
        *at_peaks(error.T, jacobian, intervals), limited, measures, marginal, allowed, by_error, problem.relaxed
    )


def _curvature(problem: Problem, found: CandidateBatch) -> Floats:
    """Return the curvatures of the nominals, positive for a centre above, shape (n,)."""
    if problem.curvature is not None:
        return np.full(len(found), problem.curvature)
    fit = found.traced.fit
    return np.asarray(np.where(fit.along.real < 0, -1.0, 1.0) * fit.curvature.astype(float))


def distance(
    z: Complexes, bend: Floats, rise: Floats | None = None, half: float = 0.5
) -> tuple[Floats, Complexes, Floats]:
    """Return signed distances of points (m, n) from arcs over the chord from 0 to 1.

    Return also unit vectors along the arcs there, and the derivatives of the distances by the
    curvature. Arcs near a half circle or beyond are given by `rise` (n,) and half their chord,
    `half`.
    """
    middle = z - half

    def signed(k: Floats) -> tuple[Floats, Complexes]:
        x, y = middle.real, middle.imag - (rise_over(np.ones(()), k) if rise is None else rise)
        way: Complexes = (1 - k * y + 1j * k * x).astype(complex)
        return (2 * y - k * (x * x + y * y)) / (1 + np.abs(way)), way / np.abs(way)

    distance, along = signed(bend)
    by = (signed(bend + GRID.bend_step)[0] - signed(bend - GRID.bend_step)[0]) / (2 * GRID.bend_step)
    return distance, along, by


def centred(error: Floats, z: Complexes, bend: Floats) -> Floats:
    """Convert distances (m, n) from nominals through the ends to those from best-placed ones."""
    _, run, weight = concentric(z.real - 0.5, z.imag - rise_over(np.ones(()), bend), bend)
    fine = grid(len(error) - 1).fine
    peaks, along, by = fine @ error, fine @ run, fine @ weight
    start = np.repeat(np.array([[0], [len(peaks) // 2], [len(peaks) - 1]]), error.shape[1], axis=1)
    (a, b), _, _ = exchange(along, peaks, start, by, peaks=False)
    return np.asarray(error - (a + b * run) / weight)


def limits(problem: Problem, read: Quantities) -> dict[str, Pieces]:
    """Compute the violations of each constraint by guides, in strokes and right angles."""
    wanted, found = problem.constraints, {"collapse": read.collapse()}
    found["distance from the moving pivots"] = read("least_arm").less(-LEAST_ARM)
    for row in (*SIZES, *TRANSMISSIONS):
        if bound := getattr(wanted, row.name):
            sign = 1.0 if row.is_upper else -1.0
            unit = 90.0 if row.unit == DEGREES else 1.0
            found[row.name] = read(row.piece).less(sign * bound / unit)
    if wanted.full_rotation:
        found["full_rotation"] = read("full_rotation")
    for name in PIVOT_REGIONS:
        if getattr(wanted, name) is not None:
            found[name] = read(name)
    if has_room(problem):
        found["swept_in"] = read("swept_in")
    if drives := [name for name in DRIVE if getattr(wanted, name) is not None]:
        from .driving import Driving

        driving = Driving(read)
        found |= {name: driving(name) for name in drives}
    return found


def has_room(problem: Problem) -> bool:
    """Tell whether the workspace of the links is convex, so that it has smooth pieces."""
    room = problem.constraints.swept_in
    return room is not None and room.is_convex and not problem.constraints.slots


def without_derivatives(problem: Problem) -> list[str]:
    """Return the constraints that have no derivatives in closed form."""
    wanted = problem.constraints
    rough = [name for name in ("keep_out", "min_lift") if getattr(wanted, name)]
    if wanted.slots:
        rough += [row.name for row in SIZES if row.measure in POINTS_ONLY and getattr(wanted, row.name)]
    if wanted.swept_in is not None and not has_room(problem):
        rough.append("swept_in")
    return rough


def is_raced(problem: Problem) -> bool:
    """Tell whether poses at stations suffice for all constraints.

    They do not suffice for keep-out zones and returning points.
    """
    wanted = problem.constraints
    if wanted.returns or wanted.play or problem.relaxed or problem.in_place or problem.is_wide:
        return False
    return not without_derivatives(problem)


def _limits(problem: Problem, found: CandidateBatch, read: Quantities) -> dict[str, Pieces]:
    """Return the constraints, shifted to their values as measured between the stations."""
    made = limits(problem, read)
    measured = drive_violations(problem, found)
    for row in SIZES:
        if row.measure in BETWEEN_STATIONS and (bound := getattr(problem.constraints, row.name)) is not None:
            measured[row.name] = excess(row, getattr(found.measures, row.measure), bound)
    if has_room(problem):
        measured["swept_in"] = swept_violations(problem, found)["swept_in"]
    return {name: p.raised(measured[name]) if name in measured else p for name, p in made.items()}


def differences(
    problem: Problem, found: CandidateBatch, chart: Array, names: list[str], basis: Floats, nominal: Nominal | None
) -> dict[str, Pieces]:
    """Return constraints with finite differences of their violations.

    Differences are taken on the finite motion of guides near a bound; for other guides the
    constraint is taken as constant.
    """
    here = feasibility(problem, found, signed=True)
    amounts = np.stack([here.amounts[name] for name in names])
    near = np.flatnonzero(np.isfinite(amounts).all(0) & (amounts > -GRID.near).any(0))
    slopes = np.zeros((len(names), len(found), COUNT))
    moved = np.flatnonzero(np.abs(basis).max(axis=(0, 2)) > 0)
    if len(near):
        each, coordinate = np.tile(near, len(moved)), np.repeat(moved, len(near))
        step = GRID.pivot_step * (coordinate[:, None] == np.arange(COUNT))
        linkage, point, good = displaced(found.linkage[each], found.point[each], step)
        each, coordinate = each[good], coordinate[good]
        there = curves(linkage, point, found.pole[each], chart[each])
        after = feasibility(problem, near_path(problem, take(found.origin, each), there, nominal), signed=True)
        with np.errstate(invalid="ignore"):
            change = np.stack([after.amounts[name] for name in names]) - amounts[:, each]
        slopes[:, each, coordinate] = np.where(np.isfinite(change), change, 0.0) / GRID.pivot_step
    value = np.where(np.isfinite(amounts), amounts, -1e3)
    return {name: Pieces(value[k][:, None], slopes[k][:, None]) for k, name in enumerate(names)}


def _scatter_pieces(
    problem: Problem, found: CandidateBatch, guides: CouplerCurve | CircuitCurve
) -> tuple[dict[str, Pieces], dict[str, Pieces], dict[str, Floats]]:
    """Return the constraint and the measures that depend on the scatter of the pivots.

    They are minus the allowance over its bound, minus the allowance over the tolerance, and the
    expected deviation over the tolerance. Return also their derivatives by the largest error.
    """
    limits: dict[str, Pieces] = {}
    measures: dict[str, Pieces] = {}
    wanted, ranked, asked = problem.constraints, problem.ranking.quantities, problem.deviation
    if not (problem.needs_allowance or (wanted.play and "deviation" in ranked)):
        return limits, measures, {}
    from ..guidance.allowance_slopes import slopes

    by_error, zone = {}, Zone(*problem.zone)
    if problem.needs_allowance:
        by = slopes(asked, guides, found.traced, zone)
        for name, unit, parts in (("min_allowance", wanted.min_allowance, limits), ("allowance", asked, measures)):
            if unit is not None and (name in ranked or parts is limits):
                less = -np.nan_to_num(found.allowance / unit) + (parts is limits)
                parts[name] = Pieces(less[:, None], -by.by_pivots[:, None] / unit)
                by_error[name] = -by.by_deviation / unit
    if wanted.play and "deviation" in ranked:
        by = slopes(found.expected, guides, found.traced, zone)
        with np.errstate(all="ignore"):
            rate = np.nan_to_num(1 / (asked * by.by_tolerance), posinf=0.0)
        expected = np.nan_to_num(found.expected / asked, posinf=0.0)
        measures["expected"] = Pieces(expected[:, None], -(by.by_pivots * rate[:, None])[:, None])
        by_error["expected"] = -by.by_deviation * rate
    return limits, measures if not problem.relaxed else {}, by_error


def marginals(problem: Problem, found: CandidateBatch) -> dict[str, Floats]:
    """Return the increase of the cost per unit by which each measure becomes worse, (n,) each."""
    if problem.relaxed:
        return {}
    here = values(problem, found)
    ranking, deviation = problem.ranking, "expected" if problem.constraints.play else "deviation"
    if ranking.only == "deviation":
        return {deviation: 1 / np.maximum(here["deviation"], 1e-300)}
    rises = marginal_costs(ranking, here)
    return {deviation if name == "deviation" else name: rise for name, rise in rises.items()}


def marginal_costs(ranking: Ranking, values: Mapping[str, Floats]) -> dict[str, Floats]:
    """Return the increase of the cost per unit by which each ranked quantity worsens, (n,) each."""
    base, out = ranking.cost(values), {}
    for name in sorted(ranking.quantities):
        worse = values[name] + (-GRID.worse if name in RISING else GRID.worse)
        with np.errstate(invalid="ignore"):
            rise = (ranking.cost({**values, name: worse}) - base) / GRID.worse
        out[name] = np.where(np.isfinite(rise), np.maximum(rise, 0.0), 0.0)
    return out


def wider(pieces: Pieces) -> Pieces:
    """Extend the slopes of pieces by a coordinate on which they do not depend."""
    return Pieces(pieces.value, np.concatenate([pieces.slope, np.zeros((*pieces.slope.shape[:2], 1))], axis=-1))


def _radius(bend: Floats, count: int) -> Pieces:
    """Return the bounds on the curvature, the last coordinate, of an arc of any radius.

    The bounds exclude flat arcs and full circles.
    """
    slope = np.zeros((len(bend), 2, count))
    slope[:, 0, -1], slope[:, 1, -1] = 1.0, -1.0
    flattest, fullest = np.maximum(bend, -1 / GRID.flattest), np.minimum(bend, -FULLEST)
    return Pieces(np.stack([bend - flattest, fullest - bend], axis=1), slope)


def at_peaks(error: Floats, jacobian: Floats, intervals: int) -> tuple[Floats, Floats]:
    """Interpolate errors (n, m) and derivatives (n, m, p) to the largest errors.

    They are sought on four points per interval.
    """
    fine = grid(intervals).fine
    error, jacobian = error @ fine.T, fine @ jacobian
    n, m = error.shape
    worst = np.argmax(np.abs(error[:, 1:]).reshape(n, -1, 4), axis=2) + 1 + np.arange(0, m - 1, 4)
    at = np.concatenate([np.zeros((n, 1), int), worst], axis=1)
    return np.take_along_axis(error, at, 1), np.take_along_axis(jacobian, at[..., None], 1)


@dataclass(frozen=True)
class LinkageModel:
    """Placed linkages of two dyads.

    Attributes
    ----------
    problem : Problem
    moves : Parametrisation
        Coordinates of the moves.
    nominal : Nominal or None
        The path itself, if guides stay in place.
    """

    problem: Problem
    moves: Parametrisation
    nominal: Nominal | None

    def judged(self, guides: CandidateBatch) -> Judged:
        broken = feasibility(self.problem, guides)
        return Judged(cost(self.problem, guides), broken.total, broken.all)

    def refinable(self, guides: CandidateBatch, met: Mask) -> Mask:
        active = np.isfinite(guides.deviation) & ~guides.curve.cusp
        if self.problem.ranking.only == "deviation":
            active = active & ((guides.traced.relative > EXACT_DEVIATION) | ~met)
        return np.asarray(active)

    def deviation(self, guides: CandidateBatch) -> Floats:
        return np.asarray(guides.deviation / self.problem.deviation)

    def linearised(self, guides: CandidateBatch) -> Subproblem:
        return linearise(self.problem, guides, guides.curve, self.moves, self.nominal)

    def moved(self, guides: CandidateBatch, step: Floats) -> tuple[CandidateBatch, Indices]:
        # the last coordinate of an arc of any radius is its curvature, which is measured anew
        step = step[:, :-1] if self.problem.curvature is None else step
        linkage, point, valid = self.moves.moved(guides, step)
        kept = np.flatnonzero(valid)
        there = curves(linkage, point, guides.pole[kept], guides.curve.motion.chart[kept])
        return near_path(self.problem, take(guides.origin, kept), there, self.nominal), kept

    def charted(self, guides: CandidateBatch) -> CandidateBatch:
        return in_best_charts(self.problem, guides) if self.nominal is None else guides
