"""What refinement returns, measured by means that share nothing with it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import linprog

from catalogue import Catalogue, CircularArc, StraightLine
from catalogue.candidates.batch import CandidateBatch, near_path
from catalogue.candidates.feasibility import EXACT_DEVIATION, cost, feasibility
from catalogue.guidance.fixed_nominal import Nominal, in_place
from catalogue.kinematics.linkage import RR
from catalogue.kinematics.types import Array
from catalogue.refine.sqp import Refinement
from catalogue.refine.subproblem import PivotCoordinates, distance, linearise
from catalogue.search.exact_guides import parallelograms
from tests.refine.starts import problem_of, started

pytestmark = pytest.mark.slow

LINE, ARC, FREE = StraightLine(1, 5e-3), CircularArc(1, 5e-3, 1), CircularArc(1, 5e-3)
BOX = (-1.5, -1.5, 2.5, 1.5)
WISHES: list[tuple[Any, Any, dict[str, Any]]] = [
    (LINE, "size", {"families": ["four-bar"], "min_transmission": 30.0, "max_link": 2.0}),
    (LINE, "transmission", {"families": ["four-bar"], "fixed_pivots_in": BOX, "max_size": 3.0}),
    (LINE, "size", {"families": ["four-bar"], "full_rotation": True, "min_link": 0.15}),
    (LINE, "deviation", {"families": ["four-bar"], "pivots_in": BOX, "min_transmission": 20.0}),
    (ARC, "size", {"families": ["four-bar"], "min_transmission": 30.0}),
    (FREE, "score", {"families": ["four-bar"], "min_transmission": 30.0}),
]


def poses(found: CandidateBatch, i: int, count: int = 401) -> tuple[Array, Array]:
    """Return the guided point and both moving pivots all over the stroke."""
    guides = found[np.array([i])].curve
    t = np.linspace(found.traced.low[i], found.traced.high[i], count)[:, None].astype(float)
    d, x, _ = guides.motion.pose(t)
    z, o = np.append(guides.linkage.points[0, :, 1], guides.point), guides.motion.origin
    every = z + d + x * (z - o)
    return every[:, 2], every[:, :2]


def off_line(path: Array) -> float:
    """Return half the width of the narrowest strip, by linear programming on a thousandth of the stroke."""
    turned = path * np.exp(-1j * np.angle(path[-1] - path[0]))  # so that the tilt is as small as the deviation
    off, unit = turned.imag - turned.imag[0], np.ptp(turned.imag)
    columns, one = np.stack([np.ones(len(path)), turned.real], axis=1), np.ones((len(path), 1))
    a, b = np.block([[-columns, -one], [columns, -one]]), np.concatenate([-off, off]) / unit
    found = linprog([0, 0, 1], A_ub=a, b_ub=b, bounds=[(None, None)] * 3)
    assert found.fun is not None
    assert found.x is not None
    return float(found.fun * unit / np.hypot(1, found.x[1] * unit))


def off_arc(path: Array, radius: float | None) -> float:
    """Return the largest distance from the best arc (of a radius), by linear programmes about the last centre."""
    centre, size = _through(path[0], path[len(path) // 2], path[-1])
    size = radius or size
    for _ in range(30):
        away = path - centre
        unit = away / np.abs(away)
        left = np.abs(away) - size  # moves with the centre like - unit . step, with the radius like - 1
        free = np.ones(len(path)) if radius is None else np.zeros(len(path))
        columns = np.stack([unit.real, unit.imag, free], axis=1)
        one, scale = np.ones((len(path), 1)), np.abs(left).max()
        a, b = np.block([[-columns, -one], [columns, -one]]), np.concatenate([-left, left]) / scale
        step = linprog([0, 0, 0, 1], A_ub=a, b_ub=b, bounds=[(-0.05 / scale, 0.05 / scale)] * 3 + [(0, None)]).x * scale
        centre, size = centre + complex(*step[:2]), size + step[2] * (radius is None)
        if np.abs(step[:2]).max() < 1e-6:
            break
    return float(np.abs(np.abs(path - centre) - size).max())


def _through(a: complex, b: complex, c: complex) -> tuple[complex, float]:
    w = (c - a) / (b - a)
    centre = (b - a) * (w - abs(w) ** 2) / (w - w.conjugate()) + a
    return centre, abs(a - centre)


def breaks(found: CandidateBatch, i: int, request: Any, wish: dict[str, Any]) -> list[str]:
    """Return which constraints a four-bar breaks, by brute force."""
    path, pins = poses(found, i)
    assert (found.linkage.dyads[i] == RR).all()
    fixed, middle = found.linkage.points[i, :, 0], found.linkage.points[i, :, 1]
    off = off_line(path) if request.kind == "line" else off_arc(path, request.radius)
    assert off == pytest.approx(found.deviation[i], rel=5e-3)
    corners = np.concatenate([fixed, middle, path[::25]])
    links = np.abs([middle[0] - fixed[0], middle[1] - fixed[1], middle[1] - middle[0]])
    angle = []
    for k in (0, 1):
        ray, bar = pins[:, 1 - k] - fixed[1 - k], pins[:, 1] - pins[:, 0]
        angle.append(np.degrees(np.arcsin(np.abs((ray.conj() * bar).imag) / np.abs(ray * bar)).min()))
    a, b, c, d = sorted([*links, abs(fixed[1] - fixed[0])])
    truth = {
        "deviation": off <= request.deviation * (1 + 5e-3),
        "stroke": abs(abs(path[-1] - path[0]) - 1) < 1e-2 * request.deviation + 1e-6 + 2 * off**2,
        "max_size": np.abs(corners[:, None] - corners).max() <= wish.get("max_size", np.inf) * (1 + 1e-9),
        "max_link": links.max() <= wish.get("max_link", np.inf) * (1 + 1e-9),
        "min_link": links.min() >= wish.get("min_link", 0) * (1 - 1e-9),
        # the measure reads 17 places
        "min_transmission": max(angle) >= wish.get("min_transmission", 0) - 0.5,
        "full_rotation": not wish.get("full_rotation") or a + d <= b + c + 1e-9,
    }
    for name, points in (("fixed_pivots_in", fixed), ("pivots_in", np.concatenate([fixed, middle]))):
        if name in wish:
            x0, y0, x1, y1 = wish[name]
            r = 1e-8
            inside = (
                (points.real >= x0 - r) & (points.real <= x1 + r) & (points.imag >= y0 - r) & (points.imag <= y1 + r)
            )
            truth[name] = bool(inside.all())
    return [name for name, holds in truth.items() if not holds]


@pytest.mark.parametrize(("request_", "rank_by", "wish"), WISHES, ids=str)
def test_the_best_meet_all_constraints_and_cost_less(
    small: Catalogue, request_: Any, rank_by: Any, wish: dict[str, Any]
) -> None:
    problem = problem_of(request_, rank_by, **wish)
    start = started(small, problem, 12)
    met = feasibility(problem, start).all
    run = Refinement.of(problem, start).run(8)
    good = np.isfinite(run.best_cost)
    np.testing.assert_array_equal(feasibility(problem, run.best).all, good)
    np.testing.assert_allclose(cost(problem, run.best)[good], run.best_cost[good], rtol=1e-9)
    for i in np.flatnonzero(good)[:3]:
        assert breaks(run.best, i, request_, wish) == []
    assert good[met].all(), "nothing that was found is lost"
    gain = cost(problem, start)[met] - run.best_cost[met]
    assert (gain >= 0).all()
    assert good.sum() >= max(met.sum(), 3)
    if met.sum() >= 3:
        assert np.median(gain) > 0.02


@pytest.mark.parametrize(
    ("wish", "rank_by"),
    [
        ({"families": ["four-bar"], "fixed_pivots_in": (-1.5, -1.0, 2.5, 1.0)}, "size"),
        ({"families": ["four-bar"], "max_size": 2.0, "min_transmission": 25.0}, "score"),
        ({"families": ["four-bar"], "max_link": 1.0}, "transmission"),
    ],
    ids=str,
)
def test_broken_starts_are_repaired(small: Catalogue, wish: dict[str, Any], rank_by: str) -> None:
    problem = problem_of(LINE, rank_by, **wish)
    start = started(small, problem_of(LINE, rank_by, families=["four-bar"]), 24)
    start = start[np.flatnonzero(~feasibility(problem, start).all)]
    assert len(start) >= 4
    before = feasibility(problem, start).total
    run = Refinement.of(problem, start).run(12)
    repaired = np.isfinite(run.best_cost)
    assert repaired.sum() >= 0.3 * len(start)
    for i in np.flatnonzero(repaired)[:3]:
        assert breaks(run.best, i, LINE, wish) == []
    left = feasibility(problem, run.best).total
    assert (left <= before + 1e-12).all()
    assert (left[~repaired] > 0).all()


def test_what_breaks_least_is_kept_where_nothing_meets(small: Catalogue) -> None:
    problem = problem_of(LINE, "size", families=["four-bar"], pivots_in=(3, 3, 4, 4), max_arm=0.5)
    start = started(small, problem_of(LINE, "size", families=["four-bar"]), 8)
    run = Refinement.of(problem, start).run(4)
    assert np.isinf(run.best_cost).all()
    np.testing.assert_allclose(feasibility(problem, run.best).total, run.nearest, rtol=1e-9)
    assert (run.nearest < feasibility(problem, start).total).sum() > 0.5 * len(start)


def test_a_batch_is_refined_as_its_parts(small: Catalogue) -> None:
    problem = problem_of(LINE, "size", families=["four-bar"], min_transmission=20.0)
    start = started(small, problem, 6)
    whole = Refinement.of(problem, start).run(2)
    for i in (0, 3):
        alone = Refinement.of(problem, start[np.array([i])]).run(2)
        np.testing.assert_allclose(alone.best_cost, whole.best_cost[i : i + 1], rtol=1e-3)


def test_refinement_goes_on_where_it_was(small: Catalogue) -> None:
    problem = problem_of(LINE, "size", families=["four-bar"])
    start = started(small, problem, 6)
    whole, parts = Refinement.of(problem, start).run(4), Refinement.of(problem, start).run(2)
    some = np.array([4, 1])
    np.testing.assert_allclose(parts[some].run(2).best_cost, whole.best_cost[some], rtol=1e-3)
    assert whole.rounds == 4
    assert whole.evaluated > len(start)


@pytest.mark.slow
def test_all_that_is_measured_is_counted(small: Catalogue, monkeypatch: pytest.MonkeyPatch) -> None:
    problem = problem_of(LINE, "size", families=["four-bar"])
    counted = []

    def measured(*given: Any) -> CandidateBatch:
        counted.append(len(found := near_path(*given)))
        return found

    monkeypatch.setattr("catalogue.refine.subproblem.near_path", measured)
    run = Refinement.of(problem, started(small, problem, 4)).run(2)
    assert run.evaluated == sum(counted) > 0


@pytest.mark.slow
def test_frozen_pivots_stay_under_a_nominal_that_stays(small: Catalogue) -> None:
    problem = problem_of(LINE, "deviation", families=["four-bar"])
    start = started(small, problem, 4)
    nominal = Nominal(1.0)
    frozen = np.zeros(10, bool)
    frozen[[0, 1, 4, 5]] = True
    run = Refinement.of(problem, start, PivotCoordinates(frozen), nominal).run(4)
    np.testing.assert_allclose(run.best.linkage.points[:, :, 0], start.linkage.points[:, :, 0], atol=1e-12)
    best = run.best.deviation
    np.testing.assert_allclose(best, in_place(run.best.curve, nominal).fit.deviation.astype(float), rtol=1e-6)


# -- the linear model ------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("rank_by", ["deviation", "size"])
@pytest.mark.parametrize("request_", [LINE, ARC, FREE], ids=["line", "arc", "any arc"])
def test_linear_errors_are_those_of_the_moved_linkage(small: Catalogue, request_: Any, rank_by: str) -> None:
    """The deviation after a short step is the largest linear error, once the nominal is placed anew.

    What the linear model says of where the guide is must be what is measured: else a guide that uses its tolerance
    seems to break it.
    """
    problem = problem_of(request_, rank_by, families=["four-bar"])
    found = started(small, problem_of(request_, "size", families=["four-bar"]), 12)
    found = found[np.flatnonzero(found.traced.relative > 1e-4)]
    assert len(found) >= 3
    n = len(found)
    linear = linearise(problem, found, found.curve, PivotCoordinates())
    np.testing.assert_allclose(np.abs(linear.error).max(1), found.deviation, rtol=0.02)
    draw = np.random.default_rng(5)
    unit = np.einsum("nii->ni", PivotCoordinates().basis(found))
    z = found.linkage.points.reshape(n, 4) - found.point[:, None]
    step = np.minimum(1e-4, 0.3 * found.deviation)[:, None] * draw.normal(size=(n, 10))
    linkage, point, good = PivotCoordinates().moved(found, step)
    assert good.all()
    after = replace(found, linkage=linkage, point=point)
    after = near_path(problem, found.origin, after.curve)
    error = linear.error + (linear.jacobian[..., :10] @ step[..., None])[..., 0]
    assert np.median(np.abs(after.deviation / found.deviation - 1)) > 1e-3, "the step does something"
    for i in range(n):
        shift, turn = np.zeros(10), np.zeros(10)  # of the linkage, as good as of the nominal
        shift[1::2] = 1
        turn[:8] = np.stack([-z[i].imag, z[i].real], axis=1).ravel()
        columns = [
            linear.jacobian[i, :, :10] @ np.divide(v, unit[i], where=unit[i] > 0, out=0 * v) for v in (shift, turn)
        ]
        if problem.curvature is None:
            columns.append(linear.jacobian[i, :, 10])
        left = _least(error[i], np.stack(columns, axis=1))
        assert left == pytest.approx(after.deviation[i], rel=0.05)


@pytest.mark.slow
def test_linear_errors_from_a_nominal_that_stays(small: Catalogue) -> None:
    problem = problem_of(LINE, "deviation", families=["four-bar"])
    found, nominal = started(small, problem_of(LINE, "size", families=["four-bar"]), 12), Nominal(1.0)
    found = replace(found, traced=in_place(found.curve, nominal))
    found = found[np.flatnonzero(np.isfinite(found.deviation) & (found.deviation > 1e-5))]
    assert len(found) >= 3
    linear = linearise(problem, found, found.curve, PivotCoordinates(), nominal)
    np.testing.assert_allclose(np.abs(linear.error).max(1), found.deviation, rtol=0.02)
    step = 0.1 * found.deviation[:, None] * np.random.default_rng(5).normal(size=(len(found), 10))
    linkage, point, _ = PivotCoordinates().moved(found, step)
    there = in_place(replace(found, linkage=linkage, point=point).curve, nominal).fit.deviation.astype(float)
    left = np.abs(linear.error + (linear.jacobian @ step[..., None])[..., 0]).max(1)
    np.testing.assert_allclose(left, there, rtol=0.03)


@pytest.mark.parametrize("bend", [-1.9, -0.4, 1e-9, 0.7, 1.9])
def test_distances_from_an_arc_are_those_from_its_centre(bend: float) -> None:
    z = (np.linspace(0.02, 0.98, 25) + 0.05j * np.random.default_rng(2).normal(size=25))[:, None]

    def off(k: float) -> tuple[Array, Array]:
        """Return distances, positive to the left of the way from 0 to 1, and how far points are from the centre."""
        centre = 0.5 + 1j * np.sign(k) * np.sqrt(k**-2 - 0.25)
        return np.sign(k) * (1 / abs(k) - np.abs(z - centre)), z - centre

    length, along, by = distance(z, np.array([bend]))
    want, out = off(bend)
    np.testing.assert_allclose(length, want, atol=1e-6 if abs(bend) < 1e-6 else 1e-12)
    np.testing.assert_allclose(along, np.sign(bend) * 1j * out / np.abs(out), atol=1e-6)
    if abs(bend) > 1e-6:
        np.testing.assert_allclose(by, (off(bend + 1e-5)[0] - off(bend - 1e-5)[0]) / 2e-5, atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["swept_in", "keep_out"])
def test_down_its_differences_a_near_constraint_is_broken_less(small: Catalogue, name: str) -> None:
    bent = [(-0.3, -0.4), (1.2, -0.4), (1.2, 0.5), (0.4, 0.3), (-0.3, 0.5)]  # of a convex room they are written down
    wish = {"families": ["four-bar"], name: bent if name == "swept_in" else (0.2, 0.3, 0.6, 0.7)}
    problem = problem_of(LINE, **wish)
    found = started(small, problem_of(LINE, families=["four-bar"]), 12)
    pieces = linearise(problem, found, found.curve, PivotCoordinates()).limits[name]
    here = feasibility(problem, found, signed=True).amounts[name]
    np.testing.assert_allclose(pieces.value[:, 0], here, atol=1e-9)
    slope, size = pieces.slope[:, 0], np.abs(pieces.slope).max((1, 2))
    near = here > -0.01
    assert near.sum() > 4
    assert (size[near] > 0).all()
    assert (size[here < -0.2] == 0).all(), "of far ones nobody needs them"
    step = -1e-4 * slope[near] / size[near, None]
    linkage, point, good = PivotCoordinates().moved(found[near], step)
    assert good.all()
    moved = near_path(problem, found[near].origin, replace(found[near], linkage=linkage, point=point).curve)
    assert (feasibility(problem, moved, signed=True).amounts[name] < here[near]).all()


def _least(error: Array, columns: Array) -> float:
    """Return the least largest error."""
    one, scale = np.ones((len(error), 1)), np.abs(error).max()
    found = linprog(
        [0] * columns.shape[1] + [1],
        A_ub=np.block([[columns, -one], [-columns, -one]]),
        b_ub=np.concatenate([-error, error]) / scale,
        bounds=[(None, None)] * (columns.shape[1] + 1),
    )
    return float(found.fun * scale)


@pytest.mark.slow
def test_what_is_exact_is_led_into_its_constraints_and_stays_exact() -> None:
    """Among exact guides a smaller deviation is rounding, for which no constraint is given up."""
    problem = problem_of(CircularArc(1, 1e-3, 1.0), "deviation", families=["four-bar"], max_size=1.6)
    made = parallelograms(problem, 40, np.random.default_rng(2))
    assert made is not None
    outside = made[np.flatnonzero((made.measures.size > 1.65) & (made.measures.size < 2.2))]
    assert len(outside) > 5
    led = Refinement.of(problem, outside).run(12)
    found = np.isfinite(led.best_cost)
    assert found.mean() > 0.5
    assert (led.best.measures.size[found] <= 1.6 + 1e-9).all()
    assert (led.best.deviation[found] < EXACT_DEVIATION).mean() > 0.5
