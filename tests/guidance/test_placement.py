"""Placed guides: their path runs from (0, 0) to (stroke, 0), and they are given in mid-stroke."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from catalogue.guidance.coupler_curve import CouplerCurve, coupler_curve
from catalogue.guidance.placement import PLACEMENT, at_stroke, mirrored, placed
from catalogue.guidance.reach import Ladder, reach
from catalogue.guidance.trace import Traced
from catalogue.kinematics.linkage import Linkage
from catalogue.kinematics.types import Array
from tests.precision import EXTENDED

Drawn = Callable[..., tuple[CouplerCurve, np.ndarray]]
STROKE = 150.0


@pytest.fixture(scope="module", params=[False, True], ids=["line", "circle"])
def case(
    request: pytest.FixtureRequest, drawn: Drawn, scanned: Callable[[bool], Ladder]
) -> tuple[bool, CouplerCurve, Traced]:
    """Guides of all series at the reach of 1e-3."""
    circle = request.param
    guides, _ = drawn(circle)
    half, found = reach(guides, scanned(circle), 1e-3, circle=circle)
    there = np.isfinite(half)
    return circle, guides[there], found[there]


def path_of(linkage: Linkage, point: Array, low: Array, high: Array) -> Array:
    guides = coupler_curve(linkage, point)
    t = low + (high - low) * np.linspace(0, 1, 201)[:, None]
    d, x, _ = guides.motion.pose(t)
    return np.asarray(point + d + x * (point - guides.motion.origin))


@pytest.mark.slow
def test_path_runs_from_0_to_the_stroke(case: tuple[bool, CouplerCurve, Traced]) -> None:
    circle, guides, found = case
    linkage, point, _ = placed(guides, found, STROKE)
    now = at_stroke(coupler_curve(linkage, point), STROKE, circle=circle)
    good = np.isfinite(now.fit.deviation)
    assert good.mean() > 0.97  # the others end where their path turns
    path = path_of(linkage[good], point[good], now.low[good], now.high[good])
    first, last = np.where(now.fit.along.real[good] > 0, path[[0, -1]], path[[-1, 0]])
    slack = 2.0 * now.fit.deviation[good] + 1e-6 * STROKE
    assert np.all(np.abs(first) < slack)
    assert np.all(np.abs(last - STROKE) < slack)
    if not circle:
        assert np.all(np.abs(path.imag) <= slack)
        assert np.all(np.abs(now.fit.along.imag[good]) < 2e-2)
    np.testing.assert_allclose(now.fit.stroke[good], STROKE, rtol=1e-8)


def test_linkage_is_given_in_mid_stroke(case: tuple[bool, CouplerCurve, Traced]) -> None:
    _, guides, found = case
    linkage, point, _ = placed(guides, found, STROKE)
    np.testing.assert_allclose(point.real, STROKE / 2, atol=1e-6 * STROKE)
    # it is the same linkage: its lengths have only been multiplied
    scale = STROKE / found.fit.stroke
    for i in (0, 1):
        for one, other in (((i, 0), (i, 1)), ((0, i), (1, i))):
            there = guides.linkage.finite[:, one[0], one[1]] & guides.linkage.finite[:, other[0], other[1]]
            before, after = (np.abs(m.points[:, one[0], one[1]] - m.points[:, other[0], other[1]])[there]
                             for m in (guides.linkage, linkage))  # fmt: skip
            np.testing.assert_allclose(after, before * scale[there], rtol=1e-9)


def test_deviation_is_kept_by_placing(case: tuple[bool, CouplerCurve, Traced]) -> None:
    circle, guides, found = case
    linkage, point, _ = placed(guides, found, STROKE)
    now = at_stroke(coupler_curve(linkage, point), STROKE, circle=circle)
    ratio = now.relative / found.relative
    # a slightly different window: its ends are those of the path, not of the tangent
    clear = (found.relative > 1e-9) & np.isfinite(ratio)
    assert np.quantile(np.abs(ratio[clear] - 1), 0.95) < (0.05 if circle else 0.02)


@pytest.mark.slow
def test_mirrored_guides_are_mirror_images(case: tuple[bool, CouplerCurve, Traced]) -> None:
    circle, guides, found = case
    linkage, point, _ = placed(guides, found, STROKE)
    n = len(point)
    before = at_stroke(coupler_curve(linkage, point), STROKE, circle=circle)
    for reverse in (False, True):
        for over in (False, True):
            laid, there = mirrored(linkage, point, STROKE, np.full(n, reverse), np.full(n, over))

            def image(z: Array, reverse: bool = reverse, over: bool = over) -> Array:
                x = STROKE - z.real if reverse else z.real
                return np.asarray(x + 1j * (-z.imag if over else z.imag))

            np.testing.assert_allclose(there, image(point), atol=1e-9 * STROKE)
            finite = linkage.finite
            np.testing.assert_allclose(laid.points[finite], image(linkage.points[finite]), atol=1e-6)
            after = at_stroke(coupler_curve(laid, there), STROKE, circle=circle)
            good = before.relative > 1e-9
            np.testing.assert_allclose(after.fit.deviation[good], before.fit.deviation[good], rtol=1e-4)
            np.testing.assert_allclose(np.abs(after.fit.curvature), np.abs(before.fit.curvature), rtol=1e-5)


def test_mirroring_chooses_for_each_guide_on_its_own(case: tuple[bool, CouplerCurve, Traced]) -> None:
    _, guides, found = case
    linkage, point, _ = placed(guides, found, STROKE)
    pick = np.arange(len(point)) % 2 == 0
    laid, there = mirrored(linkage, point, STROKE, pick, ~pick)
    np.testing.assert_allclose(there[pick].real, STROKE - point[pick].real)
    np.testing.assert_allclose(there[~pick].imag, -point[~pick].imag)
    assert np.all(laid.family == linkage.family)


@pytest.mark.slow
def test_a_guide_laid_anew_is_the_same(drawn: Drawn) -> None:
    """The window is about the guided point as seen from the circle that fits it: laid there, it need not move."""
    guides, _ = drawn(circle=True)
    guides = guides[(guides.extent.min(0) > 0.5) & ~guides.cusp]
    first = at_stroke(guides, 0.9, circle=True)
    linkage, point, _ = placed(guides, first, 0.9)
    again = at_stroke(coupler_curve(linkage, point), 0.9, circle=True)
    kept = np.flatnonzero((first.relative < 0.02) & np.isfinite(again.relative))
    assert len(kept) > 100
    off = np.abs(again.relative / first.relative - 1)[kept]
    assert np.quantile(off, 0.99) < 5e-4
    assert off.max() < 3e-3


@pytest.mark.slow
@pytest.mark.parametrize("circle", [False, True], ids=["line", "circle"])
def test_a_laid_guide_is_measured_over_the_stroke_where_it_lies(drawn: Drawn, circle: bool) -> None:
    """The guided point is halfway along the line, or the chord, on which the guide is laid: windows need not move."""
    guides, _ = drawn(circle=circle)
    guides = guides[(guides.extent.min(0) > 0.5) & ~guides.cusp]
    first = at_stroke(guides, 0.9, circle=circle)
    linkage, point, _ = placed(guides, first, 0.9)
    again = at_stroke(coupler_curve(linkage, point), 0.9, circle=circle)
    kept = np.flatnonzero((first.relative < 2e-3) & np.isfinite(again.relative))
    assert len(kept) > 100
    fit = again.fit[kept]
    back = fit.along.real < 0
    start = np.where(back, fit.start + fit.stroke * fit.along, fit.start)
    assert np.abs(start.real).max() < 1e-10
    assert np.abs(fit.along.imag).max() < 1e-9
    np.testing.assert_allclose(fit.stroke, 0.9, rtol=1e-10)


@pytest.mark.slow
@pytest.mark.parametrize("stroke", [1e-6, 0.01, 0.3])
def test_at_stroke_is_exact(drawn: Drawn, stroke: float) -> None:
    guides, _ = drawn(circle=False)
    guides = guides[guides.extent.min(0) > 0.2]
    found = at_stroke(guides, stroke, circle=False)
    np.testing.assert_allclose(found.fit.stroke, stroke, rtol=1e-9)
    assert np.isnan(at_stroke(guides, 10 * guides.extent.max(0), circle=False).fit.deviation).all()


@pytest.mark.slow
@pytest.mark.skipif(not EXTENDED, reason="deviations below 1e-12 of the stroke need extended precision")
def test_at_stroke_measures_deviations_below_1e_13_of_it(naive: Any, drawn: Drawn) -> None:
    guides, order = drawn(circle=False)
    guides = guides[(order == 4) & (guides.extent.min(0) > 0.4)][:12]
    assert len(guides) > 5
    stroke = 0.0015
    found = at_stroke(guides, stroke, circle=False)
    assert (found.relative < PLACEMENT.fine).mean() > 0.8
    for n, linkage in enumerate(guides.linkage):
        turned = complex(np.conj(guides.tangent[n]))
        laid = linkage.moved(turned, stroke / 2 - turned * guides.point[n])
        path = naive.Loop(laid.pivots[0].tolist(), stroke / 2 + 0j).over(stroke, 801)
        expected = naive.strip_of(path)
        assert float(found.fit.deviation[n]) == pytest.approx(expected, rel=1e-2, abs=2e-18)
    assert found.relative.min() < 1e-13


@pytest.mark.slow
def test_a_known_circle_need_not_be_sought(drawn: Drawn, scanned: Callable[[bool], Ladder]) -> None:
    guides, _ = drawn(circle=True)
    half, found = reach(guides, scanned(True), 1e-3, circle=True)
    some = np.isfinite(half) & ~guides.cusp
    guides, found = guides[some], found[some]
    linkage, point, _ = placed(guides, found, STROKE)
    here, known = coupler_curve(linkage, point), found.fit.curvature * found.fit.stroke / STROKE
    sought = at_stroke(here, STROKE, circle=True)
    given = at_stroke(here, STROKE, circle=True, curvature=known)
    both = np.isfinite(sought.fit.deviation) & np.isfinite(given.fit.deviation)
    assert both.mean() > 0.95
    assert np.isfinite(given.fit.deviation[~both]).sum() >= np.isfinite(sought.fit.deviation[~both]).sum()
    np.testing.assert_allclose(given.fit.stroke[both], STROKE, rtol=1e-9)
    off = np.abs(given.fit.curvature / sought.fit.curvature - 1)[both]
    assert np.quantile(off, 0.95) < 1e-4
    assert np.quantile(np.abs(given.relative / sought.relative - 1)[both], 0.9) < 1e-2
