"""Guides measured where they stand."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

import catalogue
from catalogue.guidance.coupler_curve import coupler_curve
from catalogue.guidance.fixed_nominal import Nominal, in_place
from catalogue.guidance.placement import at_stroke
from catalogue.kinematics.linkage import Linkage


@pytest.fixture(scope="module", params=["line", "circle"])
def found(small: catalogue.Catalogue, request: pytest.FixtureRequest) -> list[catalogue.Candidate]:
    wish = catalogue.StraightLine(2.0, 0.004) if request.param == "line" else catalogue.CircularArc(2.0, 0.01, 3.0)
    return list(small.find(wish, limit=20, per_series=0))


@pytest.mark.slow
def test_placed_guides_hold_the_nominal_as_well_as_their_best_one_but_for_its_radius(
    found: list[catalogue.Candidate],
) -> None:
    for c in found:
        traced = in_place(c.span(), Nominal(c.stroke, np.inf if c.radius is None else c.radius), 128)
        # the ends of an arc are on the best circle but for the deviation, so that it lies as far off at most
        slack = 1 + 1e-6 if c.radius is None else 3.0
        assert c.deviation * (1 - 1e-6) - 1e-14 <= traced.fit.deviation[0] <= slack * c.deviation + 1e-14


@pytest.mark.slow
def test_deviation_is_that_of_a_naive_loop_over_the_same_line(
    found: list[catalogue.Candidate], naive: SimpleNamespace
) -> None:
    seen = 0
    for c in found:
        path = naive.Loop(c.pivots, complex(*c.guided)).over(c.stroke, 2001) if c.radius is None else None
        if path is not None:
            seen += 1
            traced = in_place(c.span(), Nominal(c.stroke), 128)
            assert float(np.abs(path.imag).max()) == pytest.approx(traced.fit.deviation[0], rel=1e-4)
    assert seen > 10 or found[0].radius is not None


@pytest.mark.slow
def test_a_shifted_guide_deviates_by_the_shift_more(found: list[catalogue.Candidate]) -> None:
    seen = 0
    for c in found:
        off, radius = 0.01 * c.stroke, np.inf if c.radius is None else c.radius
        pole = None if c.pole is None else np.array([complex(*c.pole) + 1j * off])
        moved = coupler_curve(c.linkage.moved(1.0, 1j * off), np.array([complex(*c.guided) + 1j * off]), pole=pole)
        deviation = in_place(moved, Nominal(c.stroke, radius)).fit.deviation[0]
        if np.isfinite(deviation):  # the shifted arc runs a little farther than some guides do
            seen += 1
            # the ends of an arc lie off the best-placed one by the deviation, and so once more between them
            slack = 2 if c.radius is None else 3
            assert deviation == pytest.approx(off, abs=slack * c.deviation + 1e-6)
    assert seen > 0.7 * len(found)


def test_a_guide_read_backwards_is_the_same(found: list[catalogue.Candidate]) -> None:
    c = next(c for c in found if c.pole is None)
    radius = np.inf if c.radius is None else c.radius
    mirrored = coupler_curve(c.linkage.moved(-1.0, c.stroke, True), np.array([c.stroke - np.conj(complex(*c.guided))]))
    back, there = (in_place(g, Nominal(c.stroke, radius)) for g in (mirrored, c.span()))
    assert back.fit.deviation == pytest.approx(there.fit.deviation, rel=1e-4)


def test_a_point_that_does_not_run_so_far_has_no_deviation(found: list[catalogue.Candidate]) -> None:
    guides = found[0].span()
    assert np.isnan(in_place(guides, Nominal(1000.0)).fit.deviation).all()
    assert np.isfinite(at_stroke(guides, found[0].stroke, circle=found[0].radius is not None).fit.deviation).all()


@pytest.mark.parametrize("radius", [np.inf, 0.7, 40.0])
def test_points_of_the_nominal_lie_on_it(radius: float) -> None:
    nominal = Nominal(1.0, radius)
    z, across = nominal.at(np.linspace(0, 1, 11))
    np.testing.assert_allclose(nominal.off(z), 0, atol=1e-14)
    np.testing.assert_allclose(nominal.off(z + 0.1 * across), 0.1, atol=1e-13)
    np.testing.assert_allclose(z[[0, -1]], [0, 1], atol=1e-13)
    run, heading = nominal.along(z)
    assert (np.diff(run) > 0).all()
    assert run[5] == pytest.approx(0, abs=1e-13)
    np.testing.assert_allclose(heading, -1j * across, atol=1e-13)
    if np.isfinite(radius):
        assert np.abs(z - nominal.centre) == pytest.approx(radius)
        assert z[5].imag > 0


@pytest.mark.slow
@pytest.mark.parametrize("radius", [None, 2.0])
def test_with_given_pivots_the_deviation_is_from_the_nominal_fixed_in_place(
    small: catalogue.Catalogue, naive: SimpleNamespace, radius: float | None
) -> None:
    """A loop closed by circles, from a little before the first end to a little beyond the last: between the feet of the
    ends the largest distance from the line or arc that starts in (0, 0) and ends in (1, 0)."""
    wish = catalogue.CircularArc(1.0, 0.01, radius) if radius else catalogue.StraightLine(1.0, 0.01)
    seen, before = 0, 0.02
    for c in small.find(wish, fixed_pivots=((-0.3, 0.5), (1.1, -0.8)), limit=4):
        pivots = [[[x + before * w, y, w] for x, y, w in pair] for pair in c.pivots]
        path = naive.Loop(pivots, complex(*c.guided) + before).over(1.0 + 2 * before, 40001)
        if path is None:
            continue
        seen += 1
        z = np.asarray(path).astype(complex) - before
        if radius is None:
            run, off = z.real, z.imag
        else:
            out = z - (0.5 - 1j * np.sqrt(radius**2 - 0.25))
            run = 0.5 + (np.pi / 2 - np.angle(out)) / (2 * np.arcsin(0.5 / radius))  # 0 and 1 at the ends
            off = np.abs(out) - radius
        expected = np.abs(off[(run >= 0) & (run <= 1)]).max()
        assert c.deviation == pytest.approx(expected, rel=2e-3)
    assert seen >= 2


@pytest.mark.parametrize("nodes", [4, 6, 8])
def test_a_path_that_few_nodes_do_not_resolve_is_read_at_more(nodes: int) -> None:
    linkage = Linkage(np.array([[[0, 0, 1], [0.2, 1, 1]], [[1, 0, 1], [1.3, 0.9, 1]]]))
    point = np.array([0.7 + 0.8j])
    back = np.conj(coupler_curve(linkage, point).tangent)
    guides = coupler_curve(linkage.moved(back, 0.25 - back * point), np.array([0.25 + 0j]))
    few, many = (in_place(guides, Nominal(0.5), n).fit for n in (nodes, 64))
    assert few.deviation == pytest.approx(many.deviation, rel=1e-6)
    assert few.unresolved[0] < 1e-4 * few.deviation[0]
