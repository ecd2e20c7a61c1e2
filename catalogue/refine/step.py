"""Steps of least linearised cost within linearised constraints, for many guides at once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..candidates.feasibility import EXACT_DEVIATION, weight
from ..kinematics.types import Floats, Mask
from .interior_point import solve
from .subproblem import Subproblem


class StepOptions(NamedTuple):
    """Options of the convex programme of a step."""

    #: Margin inside the constraints that the programme keeps [strokes, right angles].
    margin: float = 2e-5
    #: Weight of the squared step [squared radii], which makes the linear programme strictly convex.
    pull: float = 1e-3
    #: Cost of an increase of measures that the cost does not depend on, and of unneeded slack.
    slight: float = 1e-3
    balanced: float = 1e-4  #: residual of stationarity up to which multipliers prove a bound
    regular: float = 1e-9  #: quadratic cost of variables without one, which makes the programme regular
    widest: float = 1e-4  #: largest relative margin inside the tolerance


STEP = StepOptions()

#: Constraints that share a slack.
SHARED_SLACK = ("collapse", "distance from the moving pivots", "radius")


@dataclass(frozen=True)
class Step:
    """Steps of n guides, and a bound on the possible reduction of the linearised cost.

    The bound includes the penalties; it follows by duality.
    """

    displacement: Floats  #: steps, (n, p); NaN where the problem is not finite
    bound: Floats  #: bounds, (n,); NaN where the multipliers do not balance the cost, as after too few iterations


def take_step(
    problem: Subproblem, radius: Floats, penalty: Floats, margin: float = STEP.margin, share: Floats | float = 1.0
) -> Step:
    """Compute the steps |s_k| <= radius with the least linearised cost and penalised violation.

    Constraints are elastic: each kind has a slack; rarely violated kinds share one.

    Parameters
    ----------
    radius : ndarray, shape (n,)
    penalty : ndarray, shape (n,)
        Cost of a violation: of a length per stroke, of an angle per right angle, of a ratio per 1.
    margin : float
        Margin inside the constraints that the steps keep.
    share : float or ndarray, shape (n,)
        Part of the tolerance that the steps may use; less than 1 where the linear model is too
        optimistic.
    """
    scaling = _scaling(problem, radius)
    programme = _programme(problem, scaling, radius, penalty, margin, share)
    x, multipliers = solve(*programme)
    p = problem.jacobian.shape[2]
    step = (scaling.back @ x[:, :p, None])[..., 0]
    at_rest = programme.cost[:, p] * scaling.worst / scaling.unit
    at_rest = at_rest + penalty * _violation(problem, scaling.unit, margin)
    bound = _dual_bound(scaling, programme, multipliers, radius, at_rest)
    return Step(np.where(scaling.finite[:, None], step, np.nan), bound)


@dataclass(frozen=True)
class _Scaling:
    """Coordinates of the steps of n guides, with all coefficients of order 1 or less."""

    finite: Mask  #: whether a problem is finite, (n,)
    worst: Floats  #: largest errors, (n,)
    unit: Floats  #: units of the errors, (n,)
    error: Floats  #: errors in these units, (n, m)
    effect: Floats  #: derivatives of the errors by the coordinates, (n, m, p)
    stretch: Floats  #: coordinates of unit steps in the singular directions, (n, p)
    turn: Floats  #: singular directions, (n, p, p)
    back: Floats  #: map from the coordinates to the steps, (n, p, p)


def _scaling(problem: Subproblem, radius: Floats) -> _Scaling:
    """Scale the singular directions of the Jacobian, however ill-conditioned it is.

    Each direction is scaled by the larger of its effect on the errors and the radius.
    """
    worst = np.abs(problem.error).max(1)
    only_deviation = set(problem.marginal) == {"deviation"}
    unit = np.maximum(worst, EXACT_DEVIATION if only_deviation else problem.allowed)
    finite = np.isfinite(problem.jacobian).all((1, 2)) & np.isfinite(problem.error).all(1) & (unit > 0)
    with np.errstate(all="ignore"):
        error = np.where(finite[:, None], problem.error / unit[:, None], 1.0)
        jacobian = np.where(finite[:, None, None], problem.jacobian / unit[:, None, None], 0.0)
    _, singular, turn = np.linalg.svd(jacobian, full_matrices=False)
    stretch = np.maximum(singular, 1 / radius[:, None])
    back = np.swapaxes(turn, 1, 2) / stretch[:, None]
    return _Scaling(finite, worst, unit, error, jacobian @ back, stretch, turn, back)


class _Programme(NamedTuple):
    """Arguments of `solve`; the last 2 p rows bound the steps by the radius."""

    weight: Floats  #: diagonal of the quadratic term, (n, width)
    cost: Floats  #: linear term, (n, width)
    rows: Floats  #: coefficients of the constraints, (n, k, width)
    right: Floats  #: right sides of the constraints, (n, k)


def _programme(
    problem: Subproblem, scaling: _Scaling, radius: Floats, penalty: Floats, margin: float, share: Floats | float
) -> _Programme:
    columns = _Columns(problem)
    cost = _costs(problem, scaling, columns, penalty)
    square = np.full(cost.shape, STEP.regular)
    square[:, : columns.steps] = STEP.pull / (scaling.stretch * radius[:, None]) ** 2
    blocks = [*_elastic_rows(problem, scaling, columns, margin, share), *_box(scaling, radius)]
    return _Programme(square, cost, *_assemble(blocks, columns.width))


class _Columns:
    """The columns of a programme.

    In order: the steps, the largest error, the ranked measures, and the slacks of the constraints,
    the first of which is shared.
    """

    def __init__(self, problem: Subproblem) -> None:
        self.steps = self.error = int(problem.jacobian.shape[2])
        self.measures = {name: self.error + 1 + i for i, name in enumerate(problem.measures)}
        self.shared = self.error + 1 + len(self.measures)
        own = [name for name in ("deviation", *problem.limits) if name not in SHARED_SLACK]
        self.own = {name: self.shared + 1 + i for i, name in enumerate(own)}
        self.width = self.shared + 1 + len(own)

    def slack(self, name: str) -> int:
        """Return the column of the slack of a constraint."""
        return self.own.get(name, self.shared)


def _costs(problem: Subproblem, scaling: _Scaling, columns: _Columns, penalty: Floats) -> Floats:
    """Return the cost of each column, shape (n, width)."""
    cost = np.zeros((len(penalty), columns.width))
    if "deviation" in problem.marginal:
        cost[:, columns.error] = problem.marginal["deviation"] * scaling.unit / problem.allowed
    for name, column in columns.measures.items():
        cost[:, column] = problem.marginal[name] + STEP.slight
    cost[:, columns.shared :] = penalty[:, None]
    for name, column in columns.own.items():
        cost[:, column] *= weight(name, problem.relaxed)
    return cost


#: Rows  slope . steps + columns <= right  of n programmes: slopes (n, k, p), right sides (n, k),
#: and values of the other columns.
_Block = tuple[Floats, Floats, Mapping[int, Floats | float]]


def _elastic_rows(
    problem: Subproblem, scaling: _Scaling, columns: _Columns, margin: float, share: Floats | float
) -> Iterator[_Block]:
    """Yield the rows of the errors, of the constraints and of the ranked measures."""
    n, back = len(scaling.back), scaling.back
    yield scaling.effect, -scaling.error, {columns.error: -1.0}
    yield -scaling.effect, scaling.error, {columns.error: -1.0}
    still = np.zeros((n, 1, columns.steps))
    inside = share * (1 - min(5 * margin, STEP.widest))
    allowed = (inside * problem.allowed / scaling.unit)[:, None]
    yield still, allowed, {columns.error: 1.0, columns.slack("deviation"): -1.0}
    for name, limit in problem.limits.items():
        right, error = _add_error(problem, scaling, columns, name)
        yield limit.slope @ back, right - limit.value - margin, {columns.slack(name): -1.0, **error}
    for name, piece in problem.measures.items():
        right, error = _add_error(problem, scaling, columns, name)
        right = right + piece.value.max(1, keepdims=True)
        yield piece.slope @ back, right - piece.value, {columns.measures[name]: -1.0, **error}
    for column in range(columns.shared, columns.width):
        yield still, np.zeros((n, 1)), {column: -1.0}


def _add_error(
    problem: Subproblem, scaling: _Scaling, columns: _Columns, name: str
) -> tuple[Floats, Mapping[int, Floats]]:
    """Return the terms of the largest error in the rows that depend on it.

    They are its current share of the right sides, (n, 1) or 0, and coefficients by column.
    """
    if name not in problem.by_error:
        return np.zeros((1, 1)), {}
    rate = problem.by_error[name][:, None]
    return rate * scaling.worst[:, None], {columns.error: rate * scaling.unit[:, None]}


def _box(scaling: _Scaling, radius: Floats) -> Iterator[_Block]:
    """Yield the rows that keep the steps within the radius."""
    box = scaling.back / radius[:, None, None]
    for side in (box, -box):
        yield side, np.ones(box.shape[:2]), {}


def _assemble(blocks: Sequence[_Block], width: int) -> tuple[Floats, Floats]:
    """Return rows (n, k, width) and right sides (n, k)."""
    rows = []
    for slope, right, columns in blocks:
        block = np.zeros((*right.shape, width))
        block[..., : slope.shape[2]] = slope
        for column, value in columns.items():
            block[..., column] = value
        rows.append(block)
    return np.concatenate(rows, axis=1), np.concatenate([right for _, right, _ in blocks], axis=1)


def _dual_bound(
    scaling: _Scaling, programme: _Programme, multipliers: Floats, radius: Floats, at_rest: Floats
) -> Floats:
    """Return the bounds (n,) that multipliers (n, k) prove; those of the radius are not used.

    See `certificate`.
    """
    p = scaling.stretch.shape[1]
    count = multipliers.shape[1] - 2 * p
    proof, rows, right = multipliers[:, :count], programme.rows[:, :count], programme.right[:, :count]
    force = (proof[:, None] @ rows[..., :p])[:, 0]  # force on the scaled coordinates
    pulled = (force[:, None] @ (scaling.stretch[..., None] * scaling.turn))[:, 0]
    bound = at_rest + (proof * right).sum(1) + radius * np.abs(pulled).sum(1)
    # residual of stationarity for errors, measures and slacks: as these are of order 1, the bound
    # grows with it
    unbalanced = np.abs(programme.cost[:, p:] + (proof[:, None] @ rows[..., p:])[:, 0]).sum(1)
    return np.where(unbalanced <= STEP.balanced, bound + 2 * unbalanced, np.nan)


def _violation(problem: Subproblem, unit: Floats, margin: float) -> Floats:
    """Return the violation of the constraints before the step, as measured by slacks, (n,)."""
    broken = [np.maximum(limit.value + margin, 0).max(1) for limit in problem.limits.values()]
    deviation = np.maximum(np.abs(problem.error).max(1) - problem.allowed, 0) / unit
    return np.asarray(weight("deviation") * deviation + np.sum(broken, axis=0))
