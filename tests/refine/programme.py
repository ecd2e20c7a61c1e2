"""Linear problems as paths have them, and their solution by linear programming."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linprog

from catalogue.candidates.feasibility import WEIGHTS
from catalogue.guidance.minimum_zone import grid
from catalogue.kinematics.types import Array
from catalogue.refine.quantities import Pieces
from catalogue.refine.subproblem import GRID, Subproblem

N, P = 12, 9


def smooth(size: float, limits: int, *, broken: float = 0.0, seed: int = 1) -> Subproblem:
    """Return problems of smooth errors of a size, with columns whose effects fall off fast; the deviation is ranked.

    Parameters
    ----------
    limits : int
        Rows of the one constraint, up to four of which are active.
    broken : float
        By how much the first two rows are broken.
    """
    draw = np.random.default_rng(seed)
    x = grid(GRID.nodes).nodes
    waves = np.cos(np.arange(9)[:, None] * np.arccos(x))
    error = size * draw.normal(size=(N, 9)) @ waves
    jacobian = np.swapaxes((draw.normal(size=(N, P, 9)) * 0.2 ** np.arange(9)) @ waves, 1, 2)
    value = -draw.uniform(0, 0.02, size=(N, limits))
    value[:, :4] = 0.0
    value[:, :2] += broken
    rows = {"rows": Pieces(value, draw.normal(size=(N, limits, P)))} if limits else {}
    worst = np.abs(error).max(1)
    return Subproblem(error, jacobian, rows, {}, {"deviation": np.ones(N)}, worst, {})


def cost_of(problem: Subproblem, i: int, step: Array, penalty: float) -> float:
    """Return what the linear model costs after a step, violations included; deviations in parts of the allowed."""
    left = np.abs(problem.error[i] + problem.jacobian[i] @ step).max()
    after = {name: (p.value[i] + p.slope[i] @ step).max() for name, p in {**problem.limits, **problem.measures}.items()}
    total = sum(by[i] * after[name] for name, by in problem.marginal.items() if name in after)
    if "deviation" in problem.marginal:
        total += problem.marginal["deviation"][i] * left / problem.allowed[i]
    over = max(left / problem.allowed[i] - 1, 0.0)
    return float(total + penalty * (WEIGHTS.deviation * over + sum(max(after[name], 0.0) for name in problem.limits)))


def best_of(problem: Subproblem, i: int, radius: float, penalty: float) -> float:
    """Return the least such cost of a step |s_k| <= radius, by HiGHS: exact for problems with one constraint."""
    p = problem.jacobian.shape[2]
    kinds = [*problem.limits, *problem.measures]
    width = p + 2 + len(kinds)  # the steps [radius], the largest error [allowed], how far it is over, the rest
    a, b = [], []

    def add(slope: Array, right: Array, *columns: tuple[int, float]) -> None:
        block = np.zeros((len(right), width))
        block[:, :p] = slope * radius
        for column, value in columns:
            block[:, column] = value
        a.append(block)
        b.append(right)

    unit = problem.allowed[i]
    for sign in (1, -1):
        add(sign * problem.jacobian[i] / unit, -sign * problem.error[i] / unit, (p, -1.0))
    add(np.zeros((1, p)), np.ones(1), (p, 1.0), (p + 1, -1.0))
    cost = np.zeros(width)
    cost[p + 1] = WEIGHTS.deviation * penalty
    if "deviation" in problem.marginal:
        cost[p] = problem.marginal["deviation"][i]
    bounds: list[tuple[float | None, float | None]] = [(-1, 1)] * p + [(0, None), (0, None)]
    for k, name in enumerate(kinds):
        piece = {**problem.limits, **problem.measures}[name]
        add(piece.slope[i], -piece.value[i], (p + 2 + k, -1.0))
        limit = name in problem.limits
        cost[p + 2 + k] = penalty if limit else problem.marginal[name][i]
        bounds.append((0, None) if limit else (None, None))
    found = linprog(cost, A_ub=np.concatenate(a), b_ub=np.concatenate(b), bounds=bounds)
    assert found.status == 0
    assert found.fun is not None
    return float(found.fun)
