"""Errors, limits and measures of linkages at stations, linearised in the coordinates of the pivots.

They become hinges (`hinges`): errors bounded by the tolerance and limits by 0, strictly; measures
reduced, each weighted by its marginal cost.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..guidance.inverse import of_machine
from ..guidance.metrics import best_turning_cranks, transmission
from ..guidance.sensitivity import COUNT, PoseJacobian, displaced, jacobian_at
from ..guidance.slides import slide_ends, slide_runs
from ..guidance.stations import Stationed
from ..kinematics.batch import Rows
from ..kinematics.motion import Pose
from ..kinematics.types import Floats, Mask
from ..problem.path import FULLEST
from ..problem.problem import Problem
from ..problem.ranking import RISING
from .hinges import Hinges
from .quantities import NONE, Pieces, Quantities
from .subproblem import GRID, limits, marginal_costs, units, wider

#: Margin that steps keep from the tolerance, before and after costs are considered [tolerances].
ERROR_MARGIN = (0.04, 0.05)
#: Margin that steps keep from limits in these two phases [strokes, right angles].
LIMIT_MARGIN = (4e-3, 2e-3)


class RaceModel(NamedTuple):
    """Weights and targets of a race."""

    free_error: float = 2e-3  #: error beyond the margin that costs nothing [tolerances]
    #: violation beyond the margin that costs nothing [strokes, right angles]
    free_violation: float = 2e-4
    #: violation with the weight of an error as large as the tolerance [strokes]
    unit: float = 0.05
    part: float = 0.1  #: unit of ranked errors [tolerances]
    #: Cost of a violation as large as the tolerance, in units of the ranking: small, as the next
    #: round corrects the violation, and a path that never leaves a curved limit is slow.
    price: float = 0.01
    shrink: float = 0.3  #: target of a linkage's deviation, relative to its own, where the least is sought
    #: Number of standard deviations of the error at one station that represents the allowance of a
    #: path.
    allowance: float = 2.2
    #: least part of the tolerance for errors, whatever the requested allowance
    least_left: float = 0.2
    sharpest: float = -1.9  #: curvature of the sharpest nominal [1/stroke]


RACE_MODEL = RaceModel()


@dataclass(frozen=True)
class Linear(Rows):
    """Linear model of n linkages at their stations; arrays of shape (n, ...).

    Attributes
    ----------
    machine : Stationed
    slope : ndarray, shape (n, m, p)
        Derivatives of the errors at the stations.
    limit, limit_slope : ndarray, shape (n, l), (n, l, p)
        Constraints, violated where positive.
    measure, measure_slope : ndarray, shape (n, q), (n, q, p)
        Pieces of the ranked measures, minus the largest piece of each measure.
    rate : ndarray, shape (n, q)
        Marginal cost of the measure of each piece.
    tolerance, aim : ndarray, shape (n,)
        Largest permitted error, and target of the error after a step.
    cost, violation : ndarray, shape (n,)
        Cost; total violation of tolerance and limits.
    """

    machine: Stationed
    slope: Floats
    limit: Floats
    limit_slope: Floats
    measure: Floats
    measure_slope: Floats
    rate: Floats
    tolerance: Floats
    aim: Floats
    cost: Floats
    violation: Floats

    @classmethod
    def of(cls, problem: Problem, machine: Stationed) -> Linear:
        """Linearise a problem at linkages."""
        by = machine.jacobian
        read = _quantities(problem, machine, by)
        unit = units(machine.linkage, machine.point)[:, None]
        slope = np.moveaxis(by.across, 0, 1) * unit
        bounds = list(limits(problem, read).values())
        scatter = np.sqrt((by.across**2).sum(-1).max(0))
        left = problem.deviation - RACE_MODEL.allowance * scatter * (problem.constraints.min_allowance or 0.0)
        tolerance = np.maximum(left, RACE_MODEL.least_left * problem.deviation)
        aim = tolerance
        if problem.ranking.only == "deviation":
            aim = np.minimum(RACE_MODEL.shrink * machine.deviation, tolerance)
        ranked = _Ranked.of(problem, read, machine, by, scatter)
        bounds, pieces = ([Pieces(p.value, p.slope * unit) for p in part] for part in (bounds, ranked.pieces))
        if problem.curvature is None:
            slope = np.concatenate([slope, machine.by_curvature[..., None]], axis=2)
            bounds, pieces = ([wider(piece) for piece in part] for part in (bounds, pieces))
            bounds.append(_radius_pieces(machine.curvature, slope.shape[2]))
        rates = ranked.rates
        if ranked.by_error is not None:
            part = RACE_MODEL.part * problem.deviation
            pieces.append(_both_sides(machine.error / part, slope / part))
            rates = [*rates, RACE_MODEL.part * ranked.by_error]
        limit, limit_slope = _join(bounds)
        measure, measure_slope, rate = _below_largest(pieces, rates, slope.shape)
        with np.errstate(all="ignore"):
            beyond = np.maximum(np.log(machine.deviation / tolerance), 0.0)
        broken = beyond + np.maximum(limit, 0.0).max(1) / RACE_MODEL.unit
        good = machine.reached & np.isfinite(broken) & np.isfinite(slope).all((1, 2))
        good &= np.isfinite(limit_slope).all((1, 2)) & np.isfinite(measure_slope).all((1, 2))
        good &= machine.curvature > RACE_MODEL.sharpest
        cost, violation = np.asarray(ranked.cost, float), np.where(good, broken, np.inf)
        rows = limit, limit_slope, measure, measure_slope
        return cls(machine, slope, *rows, rate, tolerance, aim, cost, violation)

    def __len__(self) -> int:
        return len(self.cost)

    @property
    def bounded(self) -> int:
        """Number of errors and limits per linkage."""
        return int(self.slope.shape[1] + self.limit.shape[1])

    def hinges(self, inside: Mask, aspired: Floats, error: Floats | None = None) -> Hinges:
        """Return errors, limits and measures as hinges, measures only where `inside`, shape (n,).

        The target of a measure is a reduction by `aspired`, (n,); the slope of the hinge of its
        largest piece is that of the cost.
        """
        spare, apart = (np.where(inside, *every[::-1]) for every in (ERROR_MARGIN, LIMIT_MARGIN))
        error = self.machine.error if error is None else error
        scale, weight = self.aim[:, None], np.sqrt(self.rate / aspired[:, None]) * inside[:, None]
        parts = (
            (error / scale, self.slope / scale[..., None]),
            ((self.limit + apart[:, None]) / RACE_MODEL.unit, self.limit_slope / RACE_MODEL.unit),
            (weight * (self.measure + aspired[:, None]), weight[..., None] * self.measure_slope),
        )
        value, slope = (np.concatenate(every, axis=1) for every in zip(*parts, strict=True))
        return Hinges(slope, value, 1 - spare, (error.shape[1], self.limit.shape[1]))

    def merit(self, inside: Mask) -> Floats:
        """Compute merits, less is better; infinite for a linkage whose poses do not exist."""
        spare = np.where(inside, RACE_MODEL.free_error, ERROR_MARGIN[0])
        apart = np.where(inside, RACE_MODEL.free_violation, LIMIT_MARGIN[0])
        error = np.abs(self.machine.error) / self.tolerance[:, None] - (1 - spare[:, None])
        limit = (self.limit + apart[:, None]) / RACE_MODEL.unit
        beyond = 0.5 * ((np.maximum(error, 0) ** 2).sum(1) + (np.maximum(limit, 0) ** 2).sum(1))
        merit = np.where(inside, self.cost + RACE_MODEL.price * beyond, beyond)
        return np.where(np.isfinite(self.violation), merit, np.inf)


def _quantities(problem: Problem, machine: Stationed, by: PoseJacobian) -> Quantities:
    """Evaluate the measures of linkages at every other station."""
    linkage, every = machine.linkage, machine.pose
    pose = Pose(every.d[::2], every.x[::2], every.origin)
    built, seen, plane = linkage, pose, 1
    if problem.constraints.slots:
        built, seen = of_machine(linkage, pose)
        plane = 0
    at = [seen.point(linkage.points[:, i, plane]) for i in (0, 1)]
    turns = best_turning_cranks(built) if problem.constraints.full_rotation else None
    least, driver, _ = transmission(built, at, seen.x, turns)
    slides = slide_ends(linkage, slide_runs(linkage, pose))
    return Quantities(problem, linkage, machine.point, driver, slides, pose, by[::2], least)


@dataclass(frozen=True)
class _Ranked:
    """Ranked measures of n linkages, without the errors of their paths."""

    cost: Floats  #: cost, (n,)
    pieces: list[Pieces]  #: pieces of each measure, by the original coordinates
    rates: list[Floats]  #: marginal cost of each measure, (n,)
    #: marginal cost of the largest error [tolerances], (n,); None where errors have a target
    #: instead
    by_error: Floats | None

    @classmethod
    def of(cls, problem: Problem, read: Quantities, machine: Stationed, by: PoseJacobian, scatter: Floats) -> _Ranked:
        """Evaluate the ranked measures, their pieces and marginal costs."""
        ranking, asked = problem.ranking, problem.deviation
        names = sorted(ranking.quantities - {"deviation", "allowance"})
        pieces = [read.ranked(name) for name in names]
        values = {}
        for name, piece in zip(names, pieces, strict=True):
            worst = piece.value.max(1)
            there = worst > NONE
            if name in RISING:
                values[name] = np.where(there, -worst, np.inf)
            else:
                values[name] = np.where(there, worst, 0.0)
        values["deviation"] = machine.deviation / asked
        values["allowance"] = (asked - machine.deviation) / (RACE_MODEL.allowance * scatter * asked)
        marginal = marginal_costs(ranking, values)
        cost, rates, by_error = ranking.cost(values), [marginal[name] for name in names], marginal.get("deviation")
        if ranking.only == "deviation":
            return cls(cost, pieces, rates, None)
        if (rate := marginal.get("allowance")) is not None:
            forgiven = values["allowance"]
            slope = (forgiven / scatter)[:, None] * _scatter_slope(machine, by)
            pieces.append(Pieces(-forgiven[:, None], slope[:, None]))
            rates.append(rate)
            by_error = (0.0 if by_error is None else by_error) + rate / (RACE_MODEL.allowance * scatter)
        return cls(cost, pieces, rates, by_error)


def _both_sides(error: Floats, slope: Floats) -> Pieces:
    """Return errors (n, m) and their negatives as pieces, so that both sides are bounded."""
    return Pieces(np.concatenate([error, -error], axis=1), np.concatenate([slope, -slope], axis=1))


def _scatter_slope(machine: Stationed, by: PoseJacobian) -> Floats:
    """Compute the derivatives of the largest scatter by the coordinates, shape (n, 10).

    They are finite differences at the station of the largest scatter, to which displaced linkages
    move by their first derivatives.
    """
    square = (by.across**2).sum(-1)
    step = np.tile(GRID.pivot_step * np.eye(COUNT), (len(machine), 1))
    each, moved = np.repeat(np.arange(len(machine)), COUNT), np.tile(np.arange(COUNT), len(machine))
    linkage, point, good = displaced(machine.linkage[each], machine.point[each], step)
    each, moved = each[good], moved[good]
    at = np.argmax(square, axis=0)[each]
    d, x, origin = machine.pose
    shift = d[at, each] + GRID.pivot_step * by.shift[at, each, moved]
    turn = (1 + x[at, each]) * np.exp(1j * GRID.pivot_step * by.angle[at, each, moved])
    pose = Pose(shift[None], turn[None] - 1, origin[each])
    after = jacobian_at(linkage, point, pose, machine.nominal[1][at, each]).across[0]
    slope = np.zeros((len(machine), COUNT))
    slope[each, moved] = (np.sqrt((after**2).sum(-1)) - np.sqrt(square[at, each])) / GRID.pivot_step
    return np.nan_to_num(slope)


def _below_largest(
    pieces: list[Pieces], marginal: list[Floats], shape: tuple[int, ...]
) -> tuple[Floats, Floats, Floats]:
    """Return pieces minus the largest of their measure, slopes, and marginal costs (n, q)."""
    n, _, p = shape
    if not pieces:
        return np.zeros((n, 0)), np.zeros((n, 0, p)), np.zeros((n, 0))
    below = [Pieces(p.value - p.value.max(1, keepdims=True), p.slope) for p in pieces]
    rate = np.repeat(marginal, [p.value.shape[1] for p in pieces], axis=0).T
    return *_join(below), rate


def _join(pieces: list[Pieces]) -> tuple[Floats, Floats]:
    """Return all pieces, (n, l), with slopes, (n, l, p)."""
    return np.concatenate([p.value for p in pieces], axis=1), np.concatenate([p.slope for p in pieces], axis=1)


def _radius_pieces(bend: Floats, count: int) -> Pieces:
    """Return the bounds on curvatures, the last coordinates, from both sides."""
    slope = np.zeros((len(bend), 2, count))
    slope[:, 0, -1], slope[:, 1, -1] = 1.0, -1.0
    return Pieces(np.stack([bend + 1 / GRID.flattest, -FULLEST - bend], axis=1), slope)
