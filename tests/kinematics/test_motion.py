"""Finite motion: every pose satisfies the constraints, on the reference position's branch, to its turning points."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath as mp  # type: ignore[import-untyped]  # it ships no types
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from catalogue.curvature_theory.analysis import curvature
from catalogue.kinematics.linkage import FAMILIES, PR, RP, RR, Linkage
from catalogue.kinematics.motion import BLOCK, CHARTS, COUPLER, CRANK_1, CRANK_2, Motion, conditioning, motion
from catalogue.kinematics.types import Array

Maker = Callable[..., Linkage]
Follower = Callable[..., tuple[Any, Any]]
SEED = 20

#: The charts of each family that are not impossible.
DRIVEN = [
    (family, chart)
    for family, kinds in FAMILIES.items()
    for chart in CHARTS
    if chart == COUPLER or kinds[chart - 1] == RR
]
every_chart = pytest.mark.parametrize(("family", "chart"), DRIVEN)


def nearness(linkage: Linkage, moved: Callable[[int, complex], Array], n: int) -> Array:
    """Return how near a crank's end comes to the fixed point of the other dyad, in parts of the crank and the way
    between them in the reference position, at most 1: in a crank chart they fix the turn where they lie apart."""
    nearest = np.array(1.0)
    for i in range(2):
        (fixed, moving), other = linkage.points[n, i], linkage.points[n, 1 - i, 0]
        if linkage.dyads[n, i] == RR and linkage.finite[n, 1 - i, 0]:
            apart = np.abs(moved(n, moving) - other) / (abs(moving - fixed) + abs(moving - other))
            nearest = np.minimum(nearest, apart)
    return nearest


def gaps(linkage: Linkage, moved: Callable[[int, complex], Array], turn: Array) -> Array:
    """Return how far each dyad is from its constraint: distances, one dyad and one kind after the other."""
    found = []
    for n in range(len(linkage)):
        for i in range(2):
            (fixed, moving), kind = linkage.points[n, i], linkage.dyads[n, i]
            if kind == RR:
                gap = np.abs(moved(n, moving) - fixed) - abs(moving - fixed)
            elif kind == PR:
                gap = ((moved(n, moving) - moving) * fixed.conjugate()).real
            else:  # two points of the coupler line carry the line
                first, second = moved(n, fixed), moved(n, fixed + 1j * moving)
                gap = ((fixed - first) * (second - first).conj()).imag
            found.append(gap)
        assert (np.abs(np.abs(turn[:, n]) - 1) * nearness(linkage, moved, n) ** 2).max() < 2e-14
    return np.abs(found)


def within(motion: Motion, part: float, most: float = 3.0) -> Array:
    """Return parameters from one turning point to the other, but for the parts 1 - `part` next to them."""
    low, high = np.clip(motion.interval, -most, most) * part
    return np.linspace(low, high, 31)


@pytest.mark.slow
@every_chart
@example(seed=3142612)
@given(seed=st.integers(0, 2**32 - 1))
def test_every_pose_satisfies_both_dyads(random_linkages: Maker, family: str, chart: int, seed: int) -> None:
    linkage = random_linkages(family, 6, seed)
    moved = motion(linkage, chart)
    t = within(moved, 0.9)
    d, x, _ = moved.pose(t)
    apart = gaps(linkage, lambda n, z: z + d[:, n] + x[:, n] * (z - moved.origin[n]), 1 + x)
    assert apart.max() < 1e-11 * (1 + np.abs(d).max())


@pytest.mark.slow
@every_chart
def test_poses_agree_with_the_loop_closed_by_newton(
    random_linkages: Maker, follow: Follower, family: str, chart: int
) -> None:
    linkage = random_linkages(family, 3, SEED)
    moved = motion(linkage, chart)
    for part in (-0.97, -0.4, 0.7, 0.97):
        low, high = np.clip(moved.interval, -3, 3)
        t = np.where(part < 0, low, high) * abs(part)
        d, x, _ = moved.pose(t[None])
        for n in range(len(linkage)):
            d_exact, turn = follow(linkage.pivots[n], t[n], None if chart == COUPLER else chart - 1)
            assert abs(complex(turn) - 1 - x[0, n]) < 1e-12
            assert abs(complex(d_exact) - (d[0, n] - x[0, n] * moved.origin[n])) < 1e-12 * (1 + abs(d[0, n]))


@every_chart
@pytest.mark.parametrize("t", [1e-3, -1e-8, 1e-12])
def test_short_displacements_keep_their_digits(
    random_linkages: Maker, follow: Follower, family: str, chart: int, t: float
) -> None:
    linkage = random_linkages(family, 4, SEED + 1)
    z = np.array([0.3 + 0.2j, -1, 2j, 1.5])
    along = np.exp(1j * np.arange(4))
    moved = motion(linkage, chart)
    u, v = moved.point(z, along)(np.full((1, 4), t))
    for n in range(4):
        with mp.workdps(50):
            d, turn = follow(linkage.pivots[n], t, None if chart == COUPLER else chart - 1)
            exact = complex((d + (turn - 1) * mp.mpc(z[n])) / mp.mpc(along[n]))
        assert abs(u[0, n] + 1j * v[0, n] - exact) < 2e-14 / moved.conditioning[n] * abs(exact)


@every_chart
def test_the_deviation_from_the_tangent_keeps_its_digits(
    random_linkages: Maker, follow: Follower, family: str, chart: int
) -> None:
    """Along the velocity the offset from the tangent is of second order: eps |displacement| remains of it."""
    linkage = random_linkages(family, 4, SEED + 2)
    z = np.array([0.3 + 0.2j, -1, 2j, 1.5])
    moved = motion(linkage, chart, origin=z)
    velocity = moved.velocity_of(z)
    along = velocity / np.abs(velocity)
    t = 1e-4
    _, v = moved.point(z, along)(np.full((1, 4), t))
    for n in range(4):
        with mp.workdps(50):
            d, turn = follow(linkage.pivots[n], t, None if chart == COUPLER else chart - 1)
            exact = float(((d + (turn - 1) * mp.mpc(z[n])) / mp.mpc(along[n])).imag)
        assert abs(v[0, n] - exact) < 1e-14 / moved.conditioning[n] * t * abs(velocity[n])


@every_chart
def test_the_motion_ends_at_its_turning_points(random_linkages: Maker, family: str, chart: int) -> None:
    moved = motion(random_linkages(family, 200, SEED), chart)
    assert (moved.interval[0] < 0).all()
    assert (moved.interval[1] > 0).all()
    for side in (0, 1):
        ends = np.isfinite(moved.interval[side])
        end = moved[ends].interval[side]
        for part, inside in ((1 - 1e-9, True), (1 + 1e-9, False)):
            d, x, _ = moved[ends].pose(end[None] * part)
            known = np.isfinite(x if chart != COUPLER else d)
            assert known.all() if inside else not known.any()
        whole = moved[~ends].pose(np.array([[1.0], [10.0], [1e6]]) * (2 * side - 1) * np.ones(sum(~ends)))
        assert np.isfinite(whole[:2]).all()
    if family in ("elliptic-trammel", "oldham"):
        assert np.isinf(moved.interval).all()
    elif family != "swinging-block":
        assert np.isinf(moved.interval).any()
        assert np.isfinite(moved.interval).any()


@pytest.mark.slow
@every_chart
def test_the_branch_is_continuous_up_to_the_turning_points(random_linkages: Maker, family: str, chart: int) -> None:
    """Sixteen times as many steps, largest jump less than a third: none is left in the limit, ends included."""
    moved = motion(random_linkages(family, 60, SEED + 3), chart)
    low, high = np.clip(moved.interval, -20, 20) * (1 - 1e-12)
    jumps = []
    for steps in (2001, 32001):
        node = 0.5 - 0.5 * np.cos(np.linspace(0, np.pi, steps))[:, None]  # root-like at the ends: crowd them there
        d, x, _ = moved.pose(low + (high - low) * node)
        d /= 1 + np.abs(d)  # a swinging block runs off to infinity
        jumps.append((np.abs(np.diff(d, axis=0)) + np.abs(np.diff(x, axis=0))).max(axis=0))
    assert np.isfinite(jumps).all()
    assert (jumps[1] < 0.3 * jumps[0]).all()


def test_four_bars_turn_fully_where_grashof_says_so(random_linkages: Maker) -> None:
    linkage = random_linkages("four-bar", 2000, SEED)
    z = linkage.points
    ground, coupler = np.abs(z[:, 0, 0] - z[:, 1, 0]), np.abs(z[:, 0, 1] - z[:, 1, 1])
    first, second = np.abs(z[:, 0, 1] - z[:, 0, 0]), np.abs(z[:, 1, 1] - z[:, 1, 0])
    links = np.sort([ground, coupler, first, second], axis=0)
    grashof = links[0] + links[3] < links[1] + links[2]
    for chart, link in ((COUPLER, coupler), (CRANK_1, first), (CRANK_2, second)):
        fully = np.isinf(motion(linkage, chart).interval).all(axis=0)
        np.testing.assert_array_equal(fully, grashof & ((link == links[0]) | (ground == links[0])))
        assert 0.01 < fully.mean() < 0.5


def test_slider_cranks_turn_fully_where_the_coupler_reaches(random_linkages: Maker) -> None:
    linkage = random_linkages("slider-crank", 2000, SEED)
    z, ray = linkage.points, linkage.rays
    crank, coupler = np.abs(z[:, 0, 1] - z[:, 0, 0]), np.abs(z[:, 0, 1] - z[:, 1, 1])
    offset = np.abs(((z[:, 0, 0] - z[:, 1, 1]) * ray[:, 1].conj()).real)
    fully = np.isinf(motion(linkage, CRANK_1).interval).all(axis=0)
    np.testing.assert_array_equal(fully, crank + offset < coupler)
    assert 0.01 < fully.mean() < 0.5


def test_inverted_slider_cranks_turn_fully_where_the_slide_stays_clear(random_linkages: Maker) -> None:
    linkage = random_linkages("inverted-slider-crank", 2000, SEED)
    z, ray = linkage.points, linkage.rays
    crank, ground = np.abs(z[:, 0, 1] - z[:, 0, 0]), np.abs(z[:, 0, 0] - z[:, 1, 0])
    offset = np.abs(((z[:, 0, 1] - z[:, 1, 0]) * ray[:, 1].conj()).real)
    fully = np.isinf(motion(linkage, CRANK_1).interval).all(axis=0)
    np.testing.assert_array_equal(fully, np.abs(crank - ground) > offset)
    assert 0.1 < fully.mean() < 0.9


@pytest.mark.parametrize(("family", "chart"), [pair for pair in DRIVEN if pair[1] != COUPLER])
def test_coupler_and_crank_charts_trace_one_curve(random_linkages: Maker, family: str, chart: int) -> None:
    linkage = random_linkages(family, 50, SEED)
    by_crank, by_coupler = motion(linkage, chart), motion(linkage, COUPLER)
    clear = np.minimum(by_crank.conditioning, by_coupler.conditioning) > 0.2
    assert clear.sum() > 5
    by_crank, by_coupler = by_crank[clear], by_coupler[clear]
    rate = np.abs(by_crank.velocity[1])
    near = np.minimum(0.03, 0.03 * np.abs(by_crank.interval).min(axis=0)) / np.maximum(rate, 1)
    t = np.linspace(-near, near, 9)
    d, x, _ = by_crank.pose(t)
    half = np.tan(np.angle(1 + x) / 2)
    d_coupler, x_coupler, _ = by_coupler.pose(half)
    z = 0.4 - 0.7j
    expected = d + x * (z - by_crank.origin)
    np.testing.assert_allclose(d_coupler + x_coupler * (z - by_coupler.origin), expected, rtol=1e-11, atol=1e-14)
    assert np.abs(expected[0]).min() > 1e-5


@every_chart
def test_longdouble_carries_its_digits_through(
    random_linkages: Maker, follow: Follower, family: str, chart: int
) -> None:
    linkage = random_linkages(family, 3, SEED)
    moved = motion(linkage, chart, dtype=np.longdouble)
    eps = float(np.finfo(np.longdouble).eps)
    t = (np.clip(moved.interval[1], 0, 2) / 2).astype(float)
    z = 0.7 - 0.4j
    u, v = moved.point(np.full(3, z, dtype=np.clongdouble))(t[None].astype(np.longdouble))
    assert u.dtype == np.longdouble
    for n in range(3):
        with mp.workdps(50):
            d, turn = follow(linkage.pivots[n], t[n], None if chart == COUPLER else chart - 1)
            exact = d + (turn - 1) * mp.mpc(z)
            for value, part in ((u[0, n], exact.real), (v[0, n], exact.imag)):
                off = abs(value - np.longdouble(mp.nstr(part, 30)))
                assert off < 300 * eps / float(moved.conditioning[n]) ** 2 * (1 + abs(complex(exact)))


WATT = [[[-1, 0.6, 1], [0, 0.6, 1]], [[1, -0.6, 1], [0, -0.6, 1]]]
EQUAL_SENSE = [[[0, 0, 1], [2, 0, 1]], [[1, 1, 1], [2, 1, 1]]]


@pytest.mark.parametrize("pivots", [WATT, EQUAL_SENSE])
def test_parallel_cranks_move_in_the_crank_charts_only(follow: Follower, pivots: Any) -> None:
    linkage = Linkage(pivots)
    found = conditioning(linkage)[:, 0]
    assert found[COUPLER] == 0
    assert found[[CRANK_1, CRANK_2]].min() > 0.4
    for chart in (CRANK_1, CRANK_2):
        moved = motion(linkage, chart)
        assert moved.velocity[1] == pytest.approx(0, abs=1e-15)
        for t in (1e-6, -0.1, 0.2):
            d, x, _ = moved.pose(np.array([[t]]))
            d_exact, turn = follow(linkage.pivots[0], t, chart - 1)
            assert complex(d_exact) == pytest.approx(complex(d[0, 0] - x[0, 0] * moved.origin[0]), rel=1e-13)
            assert abs(complex(turn) - 1 - x[0, 0]) < 1e-13 * t * t + 1e-16


def test_an_empty_batch_moves_nowhere() -> None:
    moved = motion(Linkage(np.zeros((0, 2, 2, 3))), COUPLER)
    path = moved.point(np.zeros(0, dtype=complex))
    assert path(np.zeros((4, 0)))[0].shape == (4, 0)
    assert path.window(np.zeros(0), np.zeros(0), np.linspace(-1, 1, 5))[1].shape == (5, 0)
    assert moved.pose(np.zeros((3, 0)))[0].shape == (3, 0)


def test_impossible_charts_say_so(random_linkages: Maker) -> None:
    for family, kinds in FAMILIES.items():
        linkage = random_linkages(family, 5, SEED)
        for i, kind in enumerate(kinds):
            if kind in (PR, RP):
                moved = motion(linkage, CRANK_1 + i)
                assert not moved.conditioning.any()
                assert not moved.interval.any()


def test_change_points_are_singular_in_every_chart() -> None:
    pivots: Any = [[[0, 0, 1], [1, 0, 1]], [[3, 0, 1], [2.5, 0, 1]]]
    assert conditioning(Linkage(pivots)).max() < 1e-15


@pytest.mark.parametrize("branch", [0, 1])
def test_poses_beside_a_change_point_satisfy_both_dyads_on_the_branch_of_the_pole(branch: int) -> None:
    """Four pivots of four-bars on the x axis, parted into cranks in all ways."""
    along = np.random.default_rng(SEED).normal(size=(20, 2, 2))
    linkage = Linkage(np.stack([along, 0 * along, 1 + 0 * along], axis=-1))
    pole = curvature(linkage, branch).pole @ (1, 1j)
    linkage, pole = linkage[np.isfinite(pole)], pole[np.isfinite(pole)]
    assert len(linkage) > 10
    moved = motion(linkage, COUPLER, pole=pole)
    d, x, _ = moved.pose(within(moved, 0.9, 0.3))
    assert gaps(linkage, lambda n, z: d[:, n] + z + x[:, n] * (z - moved.origin[n]), 1 + x).max() < 1e-9
    d, x, _ = moved.pose(np.full((1, len(linkage)), 1e-6))
    np.testing.assert_allclose(moved.origin - d[0] / x[0], pole, rtol=1e-4, atol=1e-4)  # what stays where it is


def test_dead_points_of_a_crank_are_singular_in_its_chart_only() -> None:
    # coupler in line with the second crank: the first crank cannot drive
    pivots: Any = [[[0, 0, 1], [0, 1, 1]], [[3, 1, 1], [2, 1, 1]]]
    found = conditioning(Linkage(pivots))[:, 0]
    assert found[CRANK_1] < 1e-15
    assert found[[COUPLER, CRANK_2]].min() > 0.5


@every_chart
def test_velocity_is_the_derivative_of_the_motion(random_linkages: Maker, family: str, chart: int) -> None:
    linkage = random_linkages(family, 20, SEED)
    z = np.linspace(-1, 1, 20, dtype=complex) + 0.3j
    moved = motion(linkage, chart)
    clear = moved.conditioning > 0.2
    h = 1e-6 * np.minimum(1, np.abs(moved.interval).min(axis=0))
    d, x, _ = moved.pose(np.stack([-h, h]))
    for found, path in zip(moved.velocity, (d, x), strict=True):
        slope = (path[1] - path[0]) / (2 * h)
        np.testing.assert_allclose(found[clear], slope[clear], rtol=1e-8, atol=1e-8)
    u, v = moved.point(z)(np.stack([-h, h]))
    slope = (u[1] - u[0] + 1j * (v[1] - v[0])) / (2 * h)
    np.testing.assert_allclose(moved.velocity_of(z)[clear], slope[clear], rtol=1e-8, atol=1e-8)


@every_chart
@pytest.mark.parametrize("n", [1, 7, BLOCK // 9 + 5])
def test_a_window_is_the_path_at_its_nodes(random_linkages: Maker, family: str, chart: int, n: int) -> None:
    few = random_linkages(family, 7, SEED)
    linkage = few[np.arange(n) % 7]
    z = np.linspace(-1, 1, n, dtype=complex) + 0.1j
    moved = motion(linkage, chart)
    path = moved.point(z, np.exp(1j * np.linspace(0, 6, n)))
    low, high = np.clip(moved.interval, -1, 1) * np.linspace(0.1, 0.9, n)
    nodes = np.linspace(-1, 1, 9)
    expected = path(0.5 * (low + high) + 0.5 * (high - low) * nodes[:, None])
    for found, wanted in zip(path.window(low, high, nodes), expected, strict=True):
        np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-13)
        assert np.isfinite(found).all()


def test_a_batch_of_charts_is_the_charts_one_by_one(random_linkages: Maker) -> None:
    linkage = random_linkages("four-bar", 9, SEED)
    charts = np.arange(9) % 3
    together = motion(linkage, charts)
    t = np.full((1, 9), 0.01)
    for n in range(9):
        alone = motion(linkage[n], int(charts[n]))
        assert together.conditioning[n] == alone.conditioning[0]
        np.testing.assert_array_equal(together.interval[:, n], alone.interval[:, 0])
        for a, b, c in zip(
            together.pose(t)[:2], alone.pose(t[:, :1])[:2], together[[n]].pose(t[:, :1])[:2], strict=True
        ):
            assert a[0, n] == pytest.approx(b[0, 0], rel=1e-13)
            assert a[0, n] == pytest.approx(c[0, 0], rel=1e-13)


@pytest.mark.parametrize("chart", CHARTS)
def test_a_similarity_carries_the_motion_along(random_linkages: Maker, chart: int) -> None:
    linkage = random_linkages("four-bar", 50, SEED)
    scale, z = 3 - 4j, 0.4 + 0.3j
    t = np.linspace(-0.01, 0.01, 5)[:, None] * np.ones(50)
    u, v = motion(linkage, chart).point(np.full(50, z))(t)
    for mirror in (False, True):
        carried, point = linkage.moved(scale, 2 + 5j, mirror), scale * (z.conjugate() if mirror else z) + 2 + 5j
        u_carried, v_carried = motion(carried, chart).point(np.full(50, point))(-t if mirror else t)
        expected = scale * (u - 1j * v if mirror else u + 1j * v)
        np.testing.assert_allclose(u_carried + 1j * v_carried, expected, rtol=1e-9, atol=1e-11)


def test_golden_displacements_are_met(golden: list[dict[str, Any]]) -> None:
    """Coupler turned by 0.05 rad, of every golden linkage that is at no dead point."""
    cases = [case for case in golden if "displaced" in case and case["configuration"] != "dead-point"]
    assert len(cases) > 150
    assert {case["family"] for case in cases} == set(FAMILIES)
    linkage = Linkage([case["pivots"] for case in cases])
    moved = motion(linkage, COUPLER)
    pole = np.array([complex(*case["pole"]) for case in cases])
    scale = np.array([case["scale"] for case in cases])
    for k in range(2):
        theta, x, y = np.array([case["displaced"][k] for case in cases]).T
        u, v = moved.point(pole)(np.tan(theta / 2)[None])
        off = np.abs(u[0] - x + 1j * (v[0] - y)) / scale
        assert {case["id"]: error for case, error in zip(cases, off, strict=True) if not error < 1e-12} == {}


@pytest.mark.parametrize("scale", [1e-150, 1e-60, 1e60, 1e150])
@pytest.mark.parametrize("family", FAMILIES)
def test_the_motion_does_not_depend_on_the_unit_of_length(random_linkages: Maker, family: str, scale: float) -> None:
    """Poses and where charts end, of linkages whose lengths, multiplied eight times, are no number any more."""
    unit = 2.0 ** round(np.log2(scale))
    linkage = random_linkages(family, 20, seed=3)
    pivots = linkage.pivots.copy()
    pivots[..., :2] *= np.where(pivots[..., 2:] == 0, 1.0, unit)
    other, z = Linkage.trusted(pivots), np.full(20, 0.3 + 0.4j)
    for chart in (chart for name, chart in DRIVEN if name == family):
        one, two = motion(linkage, chart, z), motion(other, chart, unit * z)
        assert np.array_equal(one.interval, two.interval)
        assert np.array_equal(one.conditioning, two.conditioning, equal_nan=True)
        t = np.linspace(-0.9, 0.9, 5)[:, None] * np.clip(np.where(one.interval[1] > 0, one.interval[1], 0), 0, 3)
        assert np.array_equal(unit * one.pose(t).point(z), two.pose(t).point(unit * z), equal_nan=True)
        assert np.array_equal(unit * one.velocity_of(z), two.velocity_of(unit * z), equal_nan=True)
