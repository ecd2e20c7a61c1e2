"""The bound by duality against linear programming."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog

from catalogue import Catalogue, StraightLine
from catalogue.guide.minimax import grid
from catalogue.guide.span import span
from catalogue.query.constraints import Constraints
from catalogue.query.find import answer
from catalogue.query.ranking import Ranking
from catalogue.query.trail import Trail
from catalogue.refine import Task, certified
from catalogue.refine.certificate import alternations, lower_bound
from catalogue.refine.linear import NODES, Linear, linearised

N, P, REGION = 20, 9, 0.01


def smooth(seed: int, size: float, limits: int) -> Linear:
    """Return problems as paths have them: smooth errors of a size, columns whose effects fall off fast."""
    draw = np.random.default_rng(seed)
    x = grid(NODES).nodes
    waves = np.cos(np.arange(9)[:, None] * np.arccos(x))
    fading = 0.2 ** np.arange(9)
    error = size * draw.normal(size=(N, 9)) @ waves
    jacobian = np.swapaxes((draw.normal(size=(N, P, 9)) * fading) @ waves, 1, 2)
    value = -draw.uniform(0, 0.02, size=(N, limits))
    value[:, :4] = 0.0  # these are active
    return Linear(error, jacobian, value, draw.normal(size=(N, limits, P)))


def by_programming(problem: Linear, i: int, region: float) -> float:
    """Return the least largest error, by HiGHS; in units of the error, for its tolerances."""
    unit = np.abs(problem.error[i]).max()
    p = problem.jacobian.shape[2]
    jacobian, one = problem.jacobian[i] * region / unit, np.ones((len(problem.error[i]), 1))
    free = np.zeros((len(problem.value[i]), 1))
    a = [[jacobian, -one], [-jacobian, -one], [problem.slope[i], free]]
    b = [-problem.error[i] / unit, problem.error[i] / unit, -problem.value[i] / region]
    found = linprog([0] * p + [1], A_ub=np.block(a), b_ub=np.concatenate(b), bounds=[(-1, 1)] * p + [(0, None)])
    assert found.status == 0
    return float(found.fun * unit)


@pytest.mark.parametrize("size", [1.0, 1e-3, 1e-7])
@pytest.mark.parametrize("limits", [0, 5, 40])
def test_the_bound_is_that_of_linear_programming(size: float, limits: int) -> None:
    problem = smooth(limits, size, limits)
    bound = lower_bound(problem, REGION)
    largest = np.abs(problem.error).max(1)
    for i in range(N):
        best = by_programming(problem, i, REGION)
        assert bound[i] <= best + 1e-6 * largest[i], "it is a bound"
        assert bound[i] >= best - 2e-3 * largest[i], "and a good one"


def test_a_stationary_problem_has_no_gap() -> None:
    """A Chebyshev polynomial over its lower ones: no combination of those lowers it, however long the steps."""
    x = grid(NODES).nodes
    error = np.tile(np.cos(6 * np.arccos(x)), (3, 1))
    jacobian = np.tile(np.stack([np.cos(k * np.arccos(x)) for k in range(6)], axis=1), (3, 1, 1))
    problem = Linear(error, jacobian, np.zeros((3, 0)), np.zeros((3, 0, 6)))
    for region in (1e-3, 1.0, 1e3):
        np.testing.assert_allclose(lower_bound(problem, region), 1.0, atol=0.02)
    assert alternations(error).tolist() == [7, 7, 7]


def test_alternations_are_of_equal_height() -> None:
    x = grid(NODES).nodes
    wave = np.cos(3 * np.arccos(x))
    assert alternations(np.stack([wave, wave * (1 + x), 0.5 * wave + 0.5, -wave])).tolist() == [4, 1, 1, 4]


def test_what_is_not_finite_has_no_bound() -> None:
    problem = smooth(1, 1.0, 2)
    error = problem.error.copy()
    error[3, 4] = np.nan
    bound = lower_bound(replace(problem, error=error), REGION)
    assert np.isnan(bound[3])
    assert np.isfinite(np.delete(bound, 3)).all()


def test_the_bound_of_found_guides_is_that_of_linear_programming(small: Catalogue) -> None:
    request, wanted = StraightLine(1, 1e-2), Constraints(families=["four-bar"], max_size=4.0, min_transmission=30)
    found = answer(
        small.database, request, wanted, Ranking({"deviation": 1.0}), limit=8, effort=1, trail=Trail(),
        refine=True,
    )  # fmt: skip
    assert found is not None
    some = found[np.flatnonzero(found.traced.relative > 1e-10)]
    task, n = Task(request, wanted), len(some.point)
    problem = linearised(some, span(some.linkage, some.point), task, np.zeros(n))
    bound, largest = lower_bound(problem, REGION), np.abs(problem.error).max(1)
    gap = certified(some, task, np.zeros(n)).gap
    np.testing.assert_allclose(gap, 1 - bound / largest, atol=1e-9)
    for i in range(n):
        best = by_programming(problem, i, REGION)
        assert bound[i] == pytest.approx(best, abs=5e-3 * largest[i])
