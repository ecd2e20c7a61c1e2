"""What a candidate breaks, and by how much, against its numbers measured again by a loop closed another way."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from catalogue import CircularArc, StraightLine
from catalogue.candidates.batch import Origin, measured
from catalogue.candidates.feasibility import (
    EXACT_DEVIATION,
    SWEPT_GRID,
    WEIGHTS,
    cost,
    feasibility,
    swept_violations,
    values,
)
from catalogue.kinematics.linkage import Linkage
from catalogue.problem.constraints import Constraints
from catalogue.problem.problem import Problem
from catalogue.problem.ranking import Ranking
from tests.find.conftest import at_home, coupler_paths

LINE, ARC = StraightLine(1, 1e-3), CircularArc(1, 1e-3, 1.5)
BOX = (-0.4, -0.3, 1.2, 0.9)
BOUNDS: dict[str, Any] = {
    "max_size": 1.6, "max_link": 1.1, "min_link": 0.6, "max_ground": 1.0, "min_ground": 0.9, "max_arm": 0.8,
    "max_travel": 0.1, "min_transmission": 50, "fixed_pivots_in": BOX, "pivots_in": BOX,
}  # fmt: skip


def beyond(z: complex) -> float:
    """Return how far a point stands outside the box."""
    x0, y0, x1, y1 = BOX
    return math.hypot(max(x0 - z.real, 0.0, z.real - x1), max(y0 - z.imag, 0.0, z.imag - y1))


def short_of(low: float, high: float) -> float:
    """Return by how much the first is above the second; 0 where there is no such length."""
    return 0.0 if math.isnan(low - high) else max(low - high, 0.0)


@pytest.mark.slow
@pytest.mark.parametrize("request_", [LINE, ARC], ids=["line", "arc"])
def test_amounts_are_those_of_the_second_measurement(batch: Any, shown: Any, again: Any, request_: Any) -> None:
    problem, found = batch(request_, count=24, families=["four-bar", "slider-crank", "inverted-slider-crank"], **BOUNDS)
    found = found[np.flatnonzero(found.deviation < 0.01)]
    broken = feasibility(problem, found)
    counted = dict.fromkeys(broken.amounts, 0)
    for i, c in enumerate(shown(problem, request_, found)):
        a = again(c, request_.radius if request_ is ARC else None)
        expected = {
            "deviation": max(math.log(a.deviation / 1e-3), 0.0) if a.deviation > 1e-15 else 0.0,
            "max_size": short_of(a.size, 1.6),
            "max_link": short_of(a.max_link, 1.1),
            "min_link": short_of(0.6, a.min_link),
            "max_ground": short_of(a.max_ground, 1.0),
            "min_ground": short_of(0.9, a.max_ground),
            "max_arm": short_of(a.max_arm, 0.8),
            "max_travel": short_of(a.travel, 0.1),
            "min_transmission": math.radians(short_of(50, a.min_transmission)),
            "fixed_pivots_in": sum(map(beyond, a.fixed)),
            "pivots_in": sum(map(beyond, a.fixed + a.moving)),
        }
        # a path that strays far is cut off at other ends
        near = {"deviation": 1e-2 + 2 * a.deviation, "max_size": 3e-3 * a.size, "min_transmission": math.radians(1.5)}
        # where a slide turns back is read between places of the stroke
        near |= dict.fromkeys(("max_travel", "fixed_pivots_in", "pivots_in"), 2e-5 * a.size)
        for name, amount in expected.items():
            if name == "min_transmission" and math.isnan(a.min_transmission):
                continue
            assert broken.amounts[name][i] == pytest.approx(amount, abs=near.get(name, 1e-9)), (name, c)
            counted[name] += amount > 2 * near.get(name, 1e-9)
        total = sum(
            float(v[i]) * (WEIGHTS.deviation if name == "deviation" else 1.0) for name, v in broken.amounts.items()
        )
        assert broken.total[i] == pytest.approx(total)
        assert bool(broken.all[i]) == all(float(v[i]) <= WEIGHTS.rounding for v in broken.amounts.values())
    bounds = BOUNDS.keys() - (
        {"max_travel"} if request_ is ARC else set()
    )  # the arcs of the small catalogue travel less
    assert min(counted[name] for name in bounds) > 0, f"every constraint is broken by somebody: {counted}"
    assert {name: n for name, n in broken.counts.items() if name in bounds}.keys() == bounds


@pytest.mark.slow
@pytest.mark.parametrize("request_", [LINE, ARC], ids=["line", "arc"])
def test_signed_amounts_tell_what_is_left_to_spare(batch: Any, request_: Any) -> None:
    """They are the amounts where these are positive, and move with the bound where they are not."""
    wide = {"max_size": 9.0, "min_link": 0.01, "max_link": 8.0}
    problem, found = batch(request_, count=30, **wide)
    found = found[np.flatnonzero(np.isfinite(found.deviation))]
    plain, signed = feasibility(problem, found), feasibility(problem, found, signed=True)
    for name, amount in plain.amounts.items():
        np.testing.assert_array_equal(np.maximum(signed.amounts[name], 0), amount)
    m = found.measures
    np.testing.assert_allclose(signed.amounts["max_size"], m.size - 9)
    np.testing.assert_allclose(signed.amounts["min_link"], np.nan_to_num(0.01 - m.min_link))
    assert (signed.amounts["max_size"] < 0).any()


def test_what_does_not_reach_over_the_stroke_breaks_everything_beyond_measure(batch: Any) -> None:
    problem, found = batch(LINE, count=20, max_size=5.0)
    lost = replace(found, traced=found.traced.replaced(np.arange(len(found)) == 3, found.traced[np.array([3])]))
    lost.traced.fit.deviation[3] = np.nan
    broken = feasibility(problem, lost)
    assert all(np.isinf(amount[3]) for amount in broken.amounts.values())
    assert not broken.all[3]
    assert np.isfinite(np.delete(broken.total, 3)).any()


@pytest.mark.slow
def test_a_crank_turns_fully_or_the_constraint_is_broken(batch: Any, shown: Any, naive: SimpleNamespace) -> None:
    """By turning it: the loop stays closed all the way round."""
    problem, found = batch(LINE, count=60, pins_only=True)
    problem = problem.with_constraints(full_rotation=True)
    found = found[np.flatnonzero(np.isfinite(found.deviation))]
    met = feasibility(problem, found).amounts["full_rotation"] <= 0
    turn = np.linspace(-np.pi, np.pi, 1441, dtype=np.longdouble)[1:]
    for c, holds in zip(shown(problem, LINE, found), met, strict=True):
        loop = naive.Loop(c.pivots, complex(*c.guided))
        with np.errstate(all="ignore"):
            # the loop tells its branch at the first parameter
            every = [loop.close(drive, np.r_[0 * turn[:1], turn]) for drive in ("crank", "other crank")]
        assert holds == any(np.isfinite(path).all() for path in every), c
    assert met.any()
    assert not met.all()


@pytest.mark.slow
def test_links_stay_in_the_room_and_out_of_what_is_kept_free(batch: Any, shown: Any, naive: SimpleNamespace) -> None:
    """Against five hundred places along each link at four hundred positions of the stroke."""
    outer, kept = (-1.2, -1.2, 2.2, 2.2), (0.2, 0.5, 0.4, 0.7)
    problem, found = batch(LINE, count=40, pins_only=True, swept_in=outer, keep_out=[kept])
    found = found[np.flatnonzero(np.isfinite(found.deviation))]
    amounts = feasibility(problem, found).amounts
    clear = [0, 0, 0, 0]
    for i, c in enumerate(shown(problem, LINE, found)):
        pivots, guided = at_home(c)
        one, two = ([complex(x, y) for x, y, _ in pair] for pair in pivots)
        a, b, p = coupler_paths(naive, pivots, guided, 1.0, [one[1], two[1], guided])
        ends = [(one[0] + 0 * a, a), (two[0] + 0 * b, b), (a, b), (a, p), (b, p)]
        z = np.concatenate([u + (v - u) * s for u, v in ends for s in np.linspace(0, 1, 500)])
        x, y = z.real.astype(float), z.imag.astype(float)
        right, up = np.abs(x - 0.5) - 1.7, np.abs(y - 0.5) - 1.7
        over = np.hypot(np.maximum(right, 0), np.maximum(up, 0)).max()
        into = np.minimum(np.minimum(x - 0.2, 0.4 - x), np.minimum(y - 0.5, 0.7 - y)).max()
        # a link leaves a convex room with its ends; how deep it reaches into another is looked at in a few places
        assert amounts["swept_in"][i] == pytest.approx(over, abs=2e-3), c
        assert amounts["keep_out"][i] <= max(into, 0) + 2e-3, c
        assert (amounts["keep_out"][i] > 0) == (into > 0) or abs(into) < 5e-3, c
        clear = [n + yes for n, yes in zip(clear, (over == 0, over > 0, into <= 0, into > 0), strict=True)]
    assert min(clear) > 0, "of each kind there is one"


def test_cost_and_values_are_those_of_the_candidate(batch: Any, shown: Any) -> None:
    problem, found = batch(LINE, count=30)
    found = found[np.flatnonzero(np.isfinite(found.deviation))]
    here, price = values(problem, found), cost(problem, found)
    for i, c in enumerate(shown(problem, LINE, found)):
        assert here["size"][i] == c.size
        assert here["transmission"][i] == pytest.approx(c.min_transmission / 90)
        assert here["deviation"][i] == pytest.approx((c.deviation + EXACT_DEVIATION) / 1e-3)
        assert here["min_link"][i] == c.min_link or c.min_link is None
        assert here["travel"][i] == (c.travel or 0.0)
        assert here["min_ground"][i] == c.max_ground or c.max_ground is None
        shares = [
            (6 - c.size) / 5, (c.min_transmission - 15) / 45, 0.5 * here["allowance"][i],
            (here["min_link"][i] - 0.05) / 0.2, (here["min_ground"][i] - 0.05) / 0.2,
            1.0 if c.travel is None else (1 - c.travel) / 0.5,
        ]  # fmt: skip
        shares = [min(s, 1.0) for s in shares]
        if min(shares) > 0.02:
            assert price[i] == pytest.approx(-np.mean(np.log(shares)))
        else:
            assert price[i] > -np.log(0.02) / 6
    relaxed = problem.with_constraints(max_size=2.0)
    assert not cost(type(problem)(**{**vars(relaxed), "relaxed": "max_size"}), found).any()


def test_cranks_that_stand_for_sliders_are_no_answer() -> None:
    """Equal cranks turn the coupler's points on circles of their length: ever straighter, the longer they are."""
    far, large = {"fixed_pivots_in": (-50.0, -np.inf, 50.0, 0.0)}, {"max_size": 3000.0}
    for length, wanted, serves in (
        (90.0, {}, True), (200.0, {}, False), (200.0, large, True), (200.0, far, True), (2000.0, large, False),
        (2000.0, far, False),
    ):  # fmt: skip
        problem = Problem.of(StraightLine(1, 1e-3), Constraints(pins_only=True, **wanted), Ranking())
        pivots = np.ones((1, 2, 2, 3))
        pivots[0, :, :, :2] = [[[0.0, -length], [0.0, 0.0]], [[1.0, -length], [1.0, 0.0]]]
        linkage = Linkage(pivots)
        nothing = np.full(1, complex(np.nan, np.nan))
        found = measured(problem, Origin.made(linkage, "parallel"), linkage, np.array([0.5 + 1j]), nothing)
        assert found.deviation[0] < 1e-3
        assert feasibility(problem, found).all[0] == serves


@pytest.mark.slow
def test_room_is_swept_as_dense_positions_say_where_a_slide_runs_fast(random_linkages: Any) -> None:
    """A swinging block near its pivot turns, and lets its slide run, within a small part of the stroke."""
    linkage = random_linkages("swinging-block", 800, 5)
    z = linkage.points
    point = z[:, 0, 1] + np.random.default_rng(5).normal(size=(len(linkage), 2)) @ [1, 1j]
    limits = Constraints(swept_in=(-3, -3, 4, 3))
    problem = Problem.of(StraightLine(1.0, 0.05), limits, Ranking.of(LINE, "score", 0, 0.0, 1))
    nowhere = np.full(len(linkage), complex(np.nan, np.nan))
    found = measured(problem, Origin.made(linkage, "general"), linkage, point, nowhere)
    found = found[np.flatnonzero(np.isfinite(found.deviation))]
    assert len(found) > 100
    told, dense = (swept_violations(problem, found, nodes)["swept_in"] for nodes in (SWEPT_GRID.intervals, 512))
    np.testing.assert_array_less(np.abs(told - dense), 2e-4 * found.measures.size)
