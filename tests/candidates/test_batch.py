"""Guides laid along a path run from its start to its end, in every way in which they may be laid."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from catalogue import CircularArc, StraightLine
from catalogue.candidates.batch import every_flip, final, flip, in_best_charts, measured, near_path
from catalogue.candidates.feasibility import pivot_violations
from catalogue.guidance.coupler_curve import coupler_curve
from catalogue.guidance.placement import mirrored_places
from catalogue.guidance.sensitivity import displaced
from catalogue.kinematics.batch import join
from tests.precision import EXTENDED

LINE, ARC, ANY = StraightLine(1, 1e-3), CircularArc(1, 1e-3, 1.5), CircularArc(1, 1e-3)
FAMILIES = ["four-bar", "slider-crank", "inverted-slider-crank"]


def heights(request: Any, path: Any) -> Any:
    """Return how high a path is above the line, or the arc that bulges up."""
    if request is LINE:
        return path.imag
    centre = complex(0.5, -np.sqrt(1.5**2 - 0.25))
    return np.abs(path - centre) - 1.5


@pytest.mark.slow
@pytest.mark.parametrize("request_", [LINE, ARC], ids=["line", "arc"])
def test_every_flip_runs_along_the_path(batch: Any, naive: SimpleNamespace, request_: Any) -> None:
    problem, found = batch(request_, count=12, families=FAMILIES)
    found = found[np.flatnonzero(found.deviation < 1e-3)][:4]
    ways = every_flip(problem, len(found))
    assert len(ways) == (4 if request_ is LINE else 2)
    seen = []
    for reverse, over in ways:
        linkage, point, pole = flip(found.linkage, found.point, found.pole, reverse, over)
        laid = measured(problem, found.origin, linkage, point, pole)
        # of starts the deviation is read in few places, between ends that are found to half of the digits
        np.testing.assert_allclose(laid.deviation, found.deviation, rtol=1e-6 if EXTENDED else 1e-4, atol=1e-14)
        np.testing.assert_allclose(laid.measures.size, found.measures.size, rtol=1e-9)
        for pivots, guided, deviation in zip(linkage.pivots, point, laid.deviation, strict=True):
            path = naive.Loop(pivots, complex(guided)).over(1.0, 301)
            assert path is not None
            assert np.abs(heights(request_, path)).max() <= 2.1 * deviation + 1e-12
            assert abs(complex(path[0])) < 4 * deviation + 1e-12
            assert abs(complex(path[-1]) - 1) < 4 * deviation + 1e-12
        seen.append(linkage.points[0, 0])
    assert min(abs(a - b).max() for i, a in enumerate(seen) for b in seen[:i]) > 1e-3, "the ways differ"


@pytest.mark.slow
def test_a_guide_is_laid_in_the_way_in_which_its_pivots_stand_best(batch: Any) -> None:
    """No other way breaks the region less; a region below the path finds the mirror images of one above."""
    above, below = (-1.0, 0.05, 2.0, 3.0), (-1.0, -3.0, 2.0, -0.05)
    problem, found = batch(LINE, count=30, fixed_pivots_in=above)
    broken = pivot_violations(problem, found.linkage, found.measures.slides)["fixed_pivots_in"]
    for reverse, over in every_flip(problem, len(found)):
        other, _, _ = flip(found.linkage, found.point, found.pole, reverse, over)
        slides = mirrored_places(found.measures.slides, 1.0, reverse, over)
        there = pivot_violations(problem, other, slides)["fixed_pivots_in"]
        assert (broken <= there + 1e-9).all()
    mirrored, images = batch(LINE, count=30, fixed_pivots_in=below)
    np.testing.assert_array_equal(images.origin.id, found.origin.id)
    again = pivot_violations(mirrored, images.linkage, images.measures.slides)["fixed_pivots_in"]
    np.testing.assert_allclose(again, broken, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("request_", [LINE, ARC, ANY], ids=["line", "arc", "any arc"])
def test_the_final_deviation_is_that_of_a_fine_path(batch: Any, shown: Any, again: Any, request_: Any) -> None:
    problem, found = batch(request_, count=16, families=FAMILIES)
    found = final(problem, found[np.flatnonzero(found.deviation < 2e-3)][:4])
    for c in shown(problem, request_, found):
        a = again(c, 1.5 if request_ is ARC else None)
        assert c.deviation == pytest.approx(a.deviation, rel=5e-3, abs=1e-14), c
        if request_ is ANY:
            assert c.radius == pytest.approx(a.radius, rel=1e-2)


@pytest.mark.parametrize("request_", [LINE, ARC], ids=["line", "arc"])
def test_parts_of_a_batch_make_the_batch(batch: Any, request_: Any) -> None:
    _, found = batch(request_, count=12)
    index = np.array([7, 2, 9])
    put_together = join(found[:5], found[5:8], found[8:])
    exchanged = found.replaced(index, found[index[::-1]])
    order = np.arange(len(found))
    order[index] = index[::-1]
    for one, other in ((put_together, found), (exchanged, found[order])):
        np.testing.assert_array_equal(one.linkage.pivots, other.linkage.pivots)
        np.testing.assert_array_equal(one.deviation, other.deviation)
        np.testing.assert_array_equal(one.origin.series, other.origin.series)
        np.testing.assert_array_equal(one.measures.box, other.measures.box)


@pytest.mark.slow
@pytest.mark.parametrize("request_", [LINE, ARC, ANY], ids=["line", "arc", "any"])
def test_a_displaced_guide_is_laid_along_the_path_again(batch: Any, naive: SimpleNamespace, request_: Any) -> None:
    """Its trace, seen from mid-stroke and in the frame of the path, is the one that is measured there anew."""
    problem, found = batch(request_, count=40, families=FAMILIES)
    found = found[np.flatnonzero(found.deviation < 5e-3)]
    turn, draw = 1.1 * np.exp(0.2j), np.random.default_rng(4)
    step = 3e-3 * draw.normal(size=(len(found), 10))
    linkage, point, good = displaced(found.linkage, found.point, step)
    found = found[np.flatnonzero(good)]
    away = np.full(len(found), turn if problem.fixed_curvature is None else np.exp(0.2j))
    moved = coupler_curve(linkage.moved(away, 0.1 * away), away * (point + 0.1), chart=found.chart)
    laid = near_path(problem, found.origin, moved)
    laid = laid[np.flatnonzero(np.isfinite(laid.deviation))]
    assert len(laid) > 0.5 * len(found)
    again = measured(problem, laid.origin, laid.linkage, laid.point, laid.pole)
    # the window of the one is laid about its mid-stroke, that of the other ends on the nominal: second order in the
    # deviation, but in the end all that a steep path rises there
    np.testing.assert_allclose(laid.deviation, again.deviation, rtol=3e-2)
    np.testing.assert_allclose(laid.measures.size, again.measures.size, rtol=1e-3)
    np.testing.assert_allclose(laid.traced.fit.stroke, 1.0, atol=1e-12)
    way = np.sign(laid.traced.fit.along.real)
    assert (way * laid.traced.fit.along).real == pytest.approx(1.0)
    run = [path for p, z in zip(laid.linkage.pivots, laid.point, strict=True)
           if (path := naive.Loop(p, complex(z)).over(1.0, 301)) is not None]  # fmt: skip
    assert len(run) > 0.9 * len(laid)
    if problem.curvature is None:
        assert min(path[150].imag for path in run) > 0, "arcs bulge up"
    ends = np.abs([[path[0], path[-1] - 1] for path in run])
    assert ends.max() < 4 * laid.deviation.max()


@pytest.mark.slow
def test_an_arc_that_turns_over_is_none(batch: Any) -> None:
    problem, found = batch(ANY, count=20, families=["four-bar"])
    over = np.ones(len(found), bool)
    linkage, point, _ = flip(found.linkage, found.point, found.pole, ~over, over)
    assert np.isfinite(found.deviation).any()
    assert np.isnan(near_path(problem, found.origin, coupler_curve(linkage, point)).deviation).all()


def test_guides_are_measured_in_their_best_chart(batch: Any) -> None:
    problem, found = batch(LINE, count=20, families=["four-bar"])
    same = in_best_charts(problem, found)
    np.testing.assert_array_equal(same.deviation, found.deviation)
    other = replace(found, chart=(found.chart + 1) % 3)
    back = in_best_charts(problem, other)
    np.testing.assert_array_equal(back.chart, found.chart)
    np.testing.assert_allclose(back.deviation, found.deviation, rtol=1e-6)
