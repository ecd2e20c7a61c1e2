"""The step that makes the linearised cost least inside linearised constraints, for many guides at once: convex
quadratic programmes, solved by an interior-point method.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..candidates.feasibility import EXACT, weight
from ..kinematics.types import Array, Floats
from .subproblem import Subproblem

#: Most iterations; what is left of complementarity, rows and gradient at which they stop; and of complementarity alone,
#: below which the others, if they do not fall by half, are rounding, that of large multipliers, and would but grow.
ITERATIONS, CLOSE, CLOSEST = 50, 1e-6, 1e-9
#: Programmes solved together at most.
BLOCK = 128
#: Multipliers start at this power of the largest cost, which is what penalties bring them to in the end.
FIRST = 0.6
#: Part of the way to the border of the positive orthant that a step goes.
INSIDE = 0.99


def solve(weight: Floats, cost: Floats, rows: Floats, right: Floats) -> tuple[Floats, Floats]:
    """Minimise  x diag(weight) x / 2 + cost x  subject to  rows x <= right.

    Predictor and corrector from a start that need not be feasible (S. Mehrotra, SIAM J. Optim. 2 (1992) 575-601).  All
    coefficients should be of order 1.  A programme leaves the iteration as soon as it is solved.

    Parameters
    ----------
    weight, cost : ndarray, shape (n, p)
        Weights of at least 0; together with the rows they must determine x.
    rows : ndarray, shape (n, k, p)
    right : ndarray, shape (n, k)

    Returns
    -------
    x : ndarray, shape (n, p)
        The last iterate, also where the rows contradict one another; NaN where they do not determine x in double
        precision.
    multipliers : ndarray, shape (n, k)
        Of the rows, all positive.
    """
    n, k, p = rows.shape
    if n > BLOCK:  # what a processor has at hand: else its memory is what takes time
        each = [slice(i, i + BLOCK) for i in range(0, n, BLOCK)]
        parts = [solve(weight[s], cost[s], rows[s], right[s]) for s in each]
        return np.concatenate([x for x, _ in parts]), np.concatenate([y for _, y in parts])
    solution, multipliers = np.zeros((n, p)), np.ones((n, k))
    x, slack, active, before = np.zeros((n, p)), np.maximum(right, 1.0), np.arange(n), np.full(n, np.inf)
    dual = np.ones((n, k)) * np.maximum(np.abs(cost).max(1, keepdims=True), 1.0) ** FIRST
    turned = np.ascontiguousarray(np.swapaxes(rows, 1, 2))
    for _ in range(ITERATIONS):
        ratio = dual / slack
        outside = (rows @ x[..., None])[..., 0] + slack - right
        uphill = weight * x + cost + (turned @ dual[..., None])[..., 0]
        gap = (slack * dual).mean(1, keepdims=True)
        residual = np.maximum(np.abs(uphill).max(1), np.abs(outside).max(1))
        left = (gap[:, 0] > CLOSE) | ((residual > CLOSE) & ((gap[:, 0] > CLOSEST) | (residual < 0.5 * before)))
        before = residual[left]
        if not left.all():
            solution[active], multipliers[active] = x, dual
            active, x, slack, dual, ratio = active[left], x[left], slack[left], dual[left], ratio[left]
            rows, turned, right, weight, cost = rows[left], turned[left], right[left], weight[left], cost[left]
            outside, uphill, gap = outside[left], uphill[left], gap[left]
            if not len(active):
                break
        normal = (turned * ratio[:, None]) @ rows
        diagonal = np.einsum("nii->ni", normal)
        diagonal += weight + 1e-16 * np.abs(diagonal).max(1, keepdims=True)

        def newton(
            target: Floats,
            rows: Floats = rows,
            turned: Floats = turned,
            normal: Floats = normal,
            outside: Floats = outside,
            uphill: Floats = uphill,
            slack: Floats = slack,
            dual: Floats = dual,
        ) -> tuple[Array, Floats, Floats]:
            pull = (dual * outside + target) / slack
            dx = -_solved(normal, uphill[..., None] + turned @ pull[..., None])[..., 0]
            ds = -outside - (rows @ dx[..., None])[..., 0]
            return dx, ds, (target - dual * ds) / slack

        dx, ds, dy = newton(-slack * dual)
        after = ((slack + _far(slack, ds) * ds) * (dual + _far(dual, dy) * dy)).mean(1, keepdims=True)
        centring = (after / gap) ** 3
        dx, ds, dy = newton(centring * gap - slack * dual - ds * dy)
        length = INSIDE * _far(slack, ds)  # the quadratic term, which would have both go as far, is of little weight
        x, slack, dual = x + length * dx, slack + length * ds, dual + INSIDE * _far(dual, dy) * dy
    solution[active], multipliers[active] = x, dual
    return solution, multipliers


def _solved(matrix: Floats, right: Floats) -> Array:
    """Return the solutions of linear systems, NaN of singular ones: the others do not depend on these."""
    try:
        return np.asarray(np.linalg.solve(matrix, right))
    except np.linalg.LinAlgError:
        regular = np.linalg.slogdet(matrix)[0] != 0  # by the same elimination
        out = np.full(right.shape, np.nan)
        out[regular] = np.linalg.solve(matrix[regular], right[regular])
        return out


def _far(value: Floats, step: Floats) -> Floats:
    """Return the longest part of a step, at most all of it, after which no value is below 0, shape (n, 1)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = np.where(step < 0, -value / step, np.inf)
    return np.asarray(np.minimum(reach.min(1, keepdims=True), 1.0))


#: How far inside the constraints the linear problem stays [strokes, right angles].
MARGIN = 2e-5
#: Pull towards short steps, in parts of the squared radius, which makes the linear programme a regular one.
PULL = 1e-3
#: Cost of what a measure rises by even where the cost does not depend on it, and of slack that nobody needs.
SLIGHT = 1e-3
#: Constraints that share a slack.
SHARING = ("collapse", "distance from the moving pivots", "radius")
#: Multipliers prove a bound if they balance the cost of what is no step up to this.
BALANCED = 1e-4


@dataclass(frozen=True)
class Step:
    """Steps of n guides, and what the linearised cost, with the penalties, can fall by at most, by duality."""

    step: Floats  #: (n, p), NaN where the problem is not finite
    bound: Floats  #: (n,), NaN where the multipliers do not balance the cost, as after too few iterations


def take_step(
    problem: Subproblem, radius: Floats, penalty: Floats, margin: float = MARGIN, share: Floats | float = 1.0
) -> Step:
    """Return the steps |s_k| <= radius for which the linearised cost and the penalised violation are least.

    In the singular directions of the Jacobian, each scaled by the larger of its effect on the errors and the radius,
    all coefficients are of order 1 or less, however ill-conditioned it is.  Constraints are elastic, each kind with a
    slack of its own, those that are hardly ever broken with one together.

    Parameters
    ----------
    radius : ndarray, shape (n,)
    penalty : ndarray, shape (n,)
        Cost of a broken constraint, per stroke, right angle, or part of the deviation.
    margin : float
        How far inside the constraints the steps lead.
    share : float or ndarray, shape (n,)
        Part of the deviation allowed that the steps may use: less where the linear problem promises too much.
    """
    n, _, p = problem.jacobian.shape
    worst = np.abs(problem.error).max(1)
    scale = np.maximum(worst, EXACT) if set(problem.marginal) == {"deviation"} else np.maximum(worst, problem.allowed)
    good = np.isfinite(problem.jacobian).all((1, 2)) & np.isfinite(problem.error).all(1) & (scale > 0)
    with np.errstate(all="ignore"):
        error = np.where(good[:, None], problem.error / scale[:, None], 1.0)
        jacobian = np.where(good[:, None, None], problem.jacobian / scale[:, None, None], 0.0)
    _, singular, turn = np.linalg.svd(jacobian, full_matrices=False)
    stretch = np.maximum(singular, 1 / radius[:, None])
    back = np.swapaxes(turn, 1, 2) / stretch[:, None]  # from the scaled coordinates to the steps

    own = [name for name in ("deviation", *problem.limits) if name not in SHARING]
    slack = {name: i + 1 for i, name in enumerate(own)}
    measures = list(problem.measures)
    ranked = [*measures, *(["allowance"] if "allowance" in problem.marginal else [])]
    first = p + 1 + len(ranked)  # of the slacks, after the steps, the largest error and the measures
    width = first + 1 + len(slack)
    cost = np.zeros((n, width))
    cost[:, first:] = penalty[:, None]
    for name, column in slack.items():
        cost[:, first + column] *= weight(name, problem.relaxed)
    blocks: list[Floats] = []
    rights: list[Floats] = []

    def add(slope: Floats, right: Floats, columns: dict[int, float]) -> None:
        """Add rows slope s + columns <= right."""
        block = np.zeros((n, right.shape[1], width))
        block[..., :p] = slope
        for column, value in columns.items():
            block[..., column] = value
        blocks.append(block)
        rights.append(right)

    def of(name: str) -> dict[int, float]:
        return {first + slack.get(name, 0): -1.0}

    effect = jacobian @ back
    add(effect, -error, {p: -1.0})
    add(-effect, error, {p: -1.0})
    nothing = np.zeros((n, 1, p))
    inside = share * (1 - min(5 * margin, 1e-4))
    add(nothing, (inside * problem.allowed / scale)[:, None], {p: 1.0, **of("deviation")})
    for name, limit in problem.limits.items():
        add(limit.slope @ back, -limit.value - margin, of(name))
    for i, name in enumerate(measures):
        piece = problem.measures[name]
        most = piece.value.max(1, keepdims=True)
        add(piece.slope @ back, most - piece.value, {p + 1 + i: -1.0})
        cost[:, p + 1 + i] = problem.marginal[name] + SLIGHT
    if "allowance" in problem.marginal:
        cost[:, first - 1] = problem.marginal["allowance"] + SLIGHT
        ratio = scale / problem.allowed
        rms = np.where(np.isfinite(problem.rms) & (problem.rms > 0), problem.rms, np.inf)
        spare = np.maximum(1 - worst / problem.allowed, 0.0) / (2 * rms**2)
        gradient = problem.rms_slope * np.nan_to_num(spare)[:, None]
        row = np.zeros((n, 1, width))
        row[:, 0, :p] = (gradient[:, None] @ back)[:, 0]
        row[:, 0, p], row[:, 0, first - 1] = ratio / (2 * rms), -1.0
        blocks.append(row)
        rights.append((worst / problem.allowed / (2 * rms))[:, None])
    if "deviation" in problem.marginal:
        cost[:, p] = problem.marginal["deviation"] * scale / problem.allowed
    for column in range(first, width):
        add(nothing, np.zeros((n, 1)), {column: -1.0})
    count = sum(block.shape[1] for block in blocks)
    box = back / radius[:, None, None]
    add(box, np.ones((n, p)), {})
    add(-box, np.ones((n, p)), {})
    square = np.full((n, width), 1e-9)
    square[:, :p] = PULL / (stretch * radius[:, None]) ** 2
    rows, right = np.concatenate(blocks, axis=1), np.concatenate(rights, axis=1)
    x, dual = solve(square, cost, rows, right)
    step = (back @ x[:, :p, None])[..., 0]

    proof, at_rest = dual[:, :count], cost[:, p] * worst / scale + penalty * _violation(problem, scale, margin)
    force = (proof[:, None] @ rows[:, :count, :p])[:, 0]  # in the scaled coordinates
    pulled = (force[:, None] @ (stretch[..., None] * turn))[:, 0]
    bound = at_rest + (proof * right[:, :count]).sum(1) + radius * np.abs(pulled).sum(1)
    # what the multipliers leave unbalanced counts in full: errors, measures and slacks are of order 1
    unbalanced = np.abs(cost[:, p:] + (proof[:, None] @ rows[:, :count, p:])[:, 0]).sum(1)
    bound = np.where(unbalanced <= BALANCED, bound + 2 * unbalanced, np.nan)
    return Step(np.where(good[:, None], step, np.nan), bound)


def _violation(problem: Subproblem, scale: Floats, margin: float) -> Floats:
    """Return by how much the constraints are broken before the step, as the slacks count it, shape (n,)."""
    broken = [np.maximum(limit.value + margin, 0).max(1) for limit in problem.limits.values()]
    deviation = np.maximum(np.abs(problem.error).max(1) - problem.allowed, 0) / scale
    return np.asarray(weight("deviation") * deviation + np.sum(broken, axis=0))
