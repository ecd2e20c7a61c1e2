"""Derivatives of errors and constraints against differences of linkages that are moved and measured anew."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from catalogue import Catalogue, CircularArc, StraightLine
from catalogue.guide.measures import rotates
from catalogue.guide.place import at_stroke
from catalogue.guide.span import span
from catalogue.linkage import RR, Array, Linkage
from catalogue.query.constraints import Constraints
from catalogue.query.find import answer
from catalogue.query.lay import Answers
from catalogue.query.ranking import Ranking
from catalogue.query.trail import Trail
from catalogue.refine.derivatives import swayed
from catalogue.refine.limits import bounds, excess, limits
from catalogue.refine.linear import linearised
from catalogue.refine.slopes import apart, turning
from catalogue.refine.task import Free, Task

STEP = 1e-5
POLYGON = [(-4, -3), (5, -3), (5, 3), (0.5, 0.9), (-4, 3)]
WISHES: list[dict[str, Any]] = [
    {"families": ["four-bar"], "max_size": 9.0, "max_link": 6.0, "min_link": 0.1, "max_ground": 6.0, "max_arm": 6.0},
    {"families": ["four-bar"], "min_transmission": 20.0, "full_rotation": True},
    {"families": ["slider-crank"], "min_transmission": 10.0, "full_rotation": True},
    {"families": ["inverted-slider-crank"], "max_size": 9.0},
    {"families": ["elliptic-trammel"], "max_link": 9.0, "min_transmission": 5.0},
    {"families": ["four-bar"], "fixed_pivots_in": (-5, -5, 6, 5), "pivots_in": POLYGON},
]


def tied(found: Answers) -> Array:
    """Return which linkages are symmetric: either crank drives as well, and a step decides which is the better one."""
    z = found.linkage.points
    links = np.abs(z[:, :, 1] - z[:, :, 0])
    return np.asarray(found.linkage.finite.all((1, 2)) & (np.abs(links[:, 0] - links[:, 1]) < 1e-6 * links[:, 0]))


def some(small: Catalogue, request: Any, wish: dict[str, Any]) -> tuple[Answers, Constraints]:
    """Return placed guides, not refined, which are not symmetric."""
    wanted = Constraints(**wish)
    found = answer(
        small.database, request, wanted, Ranking({"size": 1.0}), limit=60, effort=1, trail=Trail(), refine=False
    )
    assert found is not None
    return found[np.flatnonzero(~tied(found))[:6]], wanted


@pytest.mark.parametrize("wish", WISHES, ids=str)
def test_slopes_are_differences(small: Catalogue, wish: dict[str, Any]) -> None:
    """Of all inequalities, at the same places of the path; the nominal stays."""
    request = StraightLine(1, 5e-3)
    found, wanted = some(small, request, wish)
    n = len(found.point)
    to = bounds(found, request, wanted, {"balance": 1.0}, np.full(n, 0.1))
    places = np.linspace(0.1, 0.9, 17)[:, None] * request.stroke

    def at(now: Answers, slopes: bool) -> tuple[Array, Array]:
        """Return values and slopes with the guided point at places of the fixed nominal."""
        guides = span(now.linkage, now.point)
        sign, t = np.sign(guides.tangent.real), np.empty((17, n))
        for i, place in enumerate(places):
            u = sign * (place - now.point.real)
            for _ in range(6):
                t[i] = guides.window(u, u)[0]
                x, y = guides.path(t[i][None])
                u = u + sign * (place - (now.point + (x[0] + 1j * y[0]) * guides.tangent).real)
        by = swayed(guides.motion, now.point, t, np.ones(n)) if slopes else None
        return limits(now, guides.motion, t, by, request, wanted, to)

    _, slope = at(found, True)
    basis = Free().basis(found, 1.0)
    for k in np.flatnonzero(basis.any((0, 1))):
        ends = []
        for sign in (1, -1):
            step = np.zeros((n, basis.shape[2]))
            step[:, k] = sign * STEP
            linkage, point, good = Free().moved(found, 1.0, step)
            assert good.all()
            ends.append(at(replace(found, linkage=linkage, point=point), False)[0])
        want = (ends[0] - ends[1]) / (2 * STEP)
        got = (slope @ basis)[..., k]
        np.testing.assert_allclose(got, want, atol=2e-5 * (1 + np.abs(want).max()), err_msg=f"coordinate {k}")


@pytest.mark.parametrize("request_", [StraightLine(1, 5e-3), CircularArc(1, 1, 5e-3)], ids=["line", "arc"])
def test_the_linear_error_is_that_of_the_moved_linkage(small: Catalogue, request_: Any) -> None:
    """The deviation after a short step is the largest linear error, once the nominal is placed anew."""
    found, wanted = some(small, request_, {"families": ["four-bar"]})
    n = len(found.point)
    task = Task(request_, wanted)
    problem = linearised(found, span(found.linkage, found.point), task, np.zeros(n))
    np.testing.assert_allclose(np.abs(problem.error).max(1), found.traced.fit.deviation, rtol=0.02)
    draw = np.random.default_rng(5)
    step = 1e-4 * draw.normal(size=(n, 10))
    moved, point, _ = Free().moved(found, 1.0, step)
    circle = request_.kind == "circle"
    traced = at_stroke(span(moved, point), 1.0, circle=circle)
    error = problem.error + (problem.jacobian[..., :10] @ step[..., None])[..., 0]
    unit = np.einsum("nii->ni", Free().basis(found, 1.0))
    z = found.linkage.points.reshape(n, 4) - found.point[:, None]
    for i in range(n):
        shift, turn = np.zeros(10), np.zeros(10)  # of the linkage, as good as of the nominal
        shift[1::2] = 1
        turn[:8] = np.stack([-z[i].imag, z[i].real], axis=1).ravel()
        rigid = [
            problem.jacobian[i, :, :10] @ np.divide(v, unit[i], where=unit[i] > 0, out=0 * v) for v in (shift, turn)
        ]
        radius = [problem.jacobian[i, :, 10]] if circle else []
        left = least(error[i], np.stack(rigid + radius, axis=1))
        assert left == pytest.approx(traced.fit.deviation[i], rel=0.05)


def least(error: Array, columns: Array) -> float:
    """Return the least largest error."""
    from scipy.optimize import linprog

    one, scale = np.ones((len(error), 1)), np.abs(error).max()
    found = linprog(
        [0] * columns.shape[1] + [1],
        A_ub=np.block([[columns, -one], [-columns, -one]]),
        b_ub=np.concatenate([-error, error]) / scale,
        bounds=[(None, None)] * (columns.shape[1] + 1),
    )
    return float(found.fun * scale)


@pytest.mark.parametrize("family", ["four-bar", "slider-crank", "inverted-slider-crank"])
def test_a_crank_turns_fully_where_the_inequalities_hold(random_linkages: Callable[..., Linkage], family: str) -> None:
    linkage = random_linkages(family, 2000, 11)
    turns = rotates(linkage)
    now: Any = SimpleNamespace(linkage=linkage, point=np.zeros(2000, complex), measures=SimpleNamespace(rotates=turns))
    z = linkage.points.reshape(-1, 4)
    links = [apart(z[:, i], i, z[:, j], j) for i, j in ((0, 1), (2, 3), (1, 3))]
    rows = turning(now, links, apart(z[:, 0], 0, z[:, 2], 2), 1.0)
    worst = np.nanmax([value for value, _ in rows], axis=0)
    held = (worst <= 0) & (linkage.dyads[np.arange(2000), np.where(turns & 1, 0, 1)] == RR)
    np.testing.assert_array_equal(held, turns > 0)
    assert 20 < held.sum() < 1980


def test_answers_break_nothing(small: Catalogue) -> None:
    request = StraightLine(1, 5e-3)
    for wish in WISHES:
        found, wanted = some(small, request, wish)
        np.testing.assert_array_equal(excess(found, request, wanted), 0)
        if "max_size" in wish:
            tight = replace(wanted, max_size=0.9 * found.measures.size.min())
            np.testing.assert_allclose(excess(found, request, tight), found.measures.size - tight.max_size)
