"""The instant against its own definitions, in 50 digits where the definition is one of the finite motion."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import mpmath as mp  # type: ignore[import-untyped]  # it ships no types
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from catalogue.curvature_theory.analysis import DEAD_POINT, DEGENERATE, PARALLEL, REGULAR, Curvature, curvature
from catalogue.curvature_theory.configuration import configuration
from catalogue.curvature_theory.dead_points import dead_points
from catalogue.curvature_theory.finite_pole import finite_pole, noise
from catalogue.kinematics.linkage import FAMILIES, PR, RP, RR, Linkage
from catalogue.kinematics.types import Array
from catalogue.series.pairs import linkage_of, tangent_circle_pair

Maker = Callable[..., Linkage]
Follower = Callable[..., tuple[Any, Any]]
Pair = tuple[tuple[Any, Any], tuple[Any, Any]]
#: Trammels and Oldham couplings move cyclically: they have no principal pairs.
ACYCLIC = [family for family in FAMILIES if family not in ("elliptic-trammel", "oldham")]
SEED = 30
EPS = float(np.finfo(float).eps)
every_family = pytest.mark.parametrize("family", FAMILIES)
every_acyclic = pytest.mark.parametrize("family", ACYCLIC)
seeds = st.integers(0, 2**32 - 1)
scales = st.tuples(st.floats(-3, 3), st.floats(-np.pi, np.pi)).map(lambda v: 10 ** v[0] * np.exp(1j * v[1]))
shifts = st.complex_numbers(max_magnitude=100)


def plane(points: Array) -> Array:
    """Return (..., 2) as complex numbers."""
    return np.asarray(points[..., 0] + 1j * points[..., 1])


def sphere(pivots: Array, centre: Array, unit: Array) -> Array:
    """Return homogeneous points (n, ..., 3) on the unit sphere: chordal distances are distances there."""
    extra = (1,) * (pivots.ndim - 2)
    z = (plane(pivots) - pivots[..., 2] * centre.reshape(-1, *extra)) / unit.reshape(-1, *extra)
    z = np.where(pivots[..., 2] != 0, z, 0)
    norm = 1 + np.abs(z) ** 2
    up = np.where(pivots[..., 2] != 0, (np.abs(z) ** 2 - 1) / norm, 1.0)
    return np.stack([2 * z.real / norm, 2 * z.imag / norm, np.where(np.isnan(z), np.nan, up)], axis=-1)


def apart(one: Array, other: Array, centre: Array, unit: Array) -> Array:
    """Return the distance of two sets of two pairs (n, 2, 2, 3) in the better of their orders, shape (n,)."""
    p, q = sphere(one, centre, unit), sphere(other, centre, unit)
    straight, crossed = np.abs(p - q), np.abs(p - q[:, ::-1])
    return np.asarray(np.minimum(straight.max(axis=(1, 2, 3)), crossed.max(axis=(1, 2, 3))))


@pytest.mark.slow
@every_family
@given(seed=seeds, scale=scales, shift=shifts, mirror=st.booleans())
def test_a_similarity_carries_the_instant_along(
    random_linkages: Maker, family: str, seed: int, scale: complex, shift: complex, mirror: bool
) -> None:
    linkage = random_linkages(family, 5, seed)
    before, after = curvature(linkage), curvature(linkage.moved(scale, shift, mirror))
    size, digits = abs(scale), 1e-9 * (1 + abs(shift / scale))

    def carried(z: Array) -> Array:
        return np.asarray(scale * (z.conj() if mirror else z) + shift)

    assert (before.state == after.state).all()
    unit = before.rho0 * size
    assert (np.abs(after.rho0 / unit - 1) < digits).all()
    for name in ("pole", "undulation", "cuspidation"):
        old, new = carried(plane(getattr(before, name))), plane(getattr(after, name))
        known = np.isfinite(old)
        np.testing.assert_array_equal(known, np.isfinite(new))
        assert (np.abs(new - old)[known] < (digits * (unit + size))[known]).all()
    turn = scale / size
    axes = plane(before.axes)
    axes = turn * (axes.conj() * [-1, 1] if mirror else axes)  # right-handed for both
    assert np.abs(plane(after.axes) - axes).max() < digits
    for name, sign in (("kappa", 1), ("kappa_star", 1), ("s", -1 if mirror else 1)):
        old, new = getattr(before, name) * before.rho0 * sign, getattr(after, name) * unit
        assert (np.abs(new - old) < digits * (1 + np.abs(old))).all()
    pairs = before.principal_pairs.copy()
    moved = np.where(pairs[..., 2] != 0, carried(plane(pairs)), turn * plane(pairs))
    pairs[..., 0], pairs[..., 1] = moved.real, moved.imag
    clear = separate(linkage, before)
    off = apart(pairs, after.principal_pairs, plane(after.pole), unit)
    assert (off[clear] < digits).all()
    if family in ACYCLIC:
        np.testing.assert_array_equal(np.isnan(off), np.isnan(before.principal_pairs).any(axis=(1, 2, 3)))


def separate(linkage: Linkage, instant: Curvature) -> Array:
    """Return where the principal pairs are real and apart from one another: rounding splits double ones."""
    pole, unit = plane(instant.pole), instant.rho0
    both = np.concatenate([linkage.pivots, instant.principal_pairs], axis=1)
    ball = sphere(both, pole, unit)
    gap = np.abs(ball[:, :, None] - ball[:, None, :]).max(axis=(3, 4)) + 9 * np.eye(4)
    return np.asarray(np.isfinite(gap).all(axis=(1, 2)) & (gap.min(axis=(1, 2)) > 0.03))


@pytest.mark.slow
@every_family
@given(seed=seeds)
def test_inversion_gives_the_dual_instant(random_linkages: Maker, family: str, seed: int) -> None:
    """kappa -> -kappa*, s -> -s, axes turned by 180 degrees, undulation <-> cuspidation, pairs exchanged."""
    linkage = random_linkages(family, 20, seed)
    one, dual = curvature(linkage), curvature(linkage.inverted())
    unit = one.rho0[:, None]
    np.testing.assert_allclose(dual.pole, one.pole, atol=1e-12)
    np.testing.assert_allclose(dual.axes, -one.axes, atol=1e-11)
    np.testing.assert_allclose(dual.rho0, one.rho0, rtol=1e-11)
    for name, other in (("kappa", "kappa_star"), ("kappa_star", "kappa"), ("s", "s")):
        expected = -getattr(one, other) * one.rho0
        assert (np.abs(getattr(dual, name) * one.rho0 - expected) < 1e-11 * (1 + np.abs(expected))).all()
    np.testing.assert_allclose(dual.undulation / unit, one.cuspidation / unit, atol=1e-9)
    np.testing.assert_allclose(dual.cuspidation / unit, one.undulation / unit, atol=1e-9)
    clear = separate(linkage, one)
    off = apart(dual.principal_pairs[:, :, ::-1], one.principal_pairs, plane(one.pole), one.rho0)
    assert (off[clear] < 1e-9).all()
    names, duals = configuration(linkage, one), configuration(linkage.inverted(), dual)
    exchange = str.maketrans("PNTCDV", "NPCTVD")
    assert [sorted(name.translate(exchange)) for name in names] == [sorted(name) for name in duals]


def canonical(linkage: Linkage, instant: Curvature) -> tuple[Array, Array, Array]:
    """Return sine and cosine of the rays in the pole axes and the signed distances (n, 2, 2), infinite at infinity."""
    ray, axes = linkage.rays, plane(instant.axes)
    sin, cos = ((ray * axes[:, None, k].conj()).real for k in (1, 0))
    r = ((linkage.points - plane(instant.pole)[:, None, None]) * ray[..., None].conj()).real
    return sin, cos, np.where(linkage.finite, r, np.inf)


@pytest.mark.slow
@every_family
@given(seed=seeds)
def test_driving_and_guided_pairs_obey_euler_savary_and_lie_on_the_cubics(
    random_linkages: Maker, family: str, seed: int
) -> None:
    linkage = random_linkages(family, 20, seed)
    instant = curvature(linkage)
    guided, real = Linkage.valid(instant.principal_pairs)
    assume(real.any() or family not in ACYCLIC)
    for pairs, of in ((linkage, instant), (guided, instant[real])):
        sin, cos, r = canonical(pairs, of)
        unit = of.rho0[:, None]
        q, q_star = sin * unit / r[..., 0], sin * unit / r[..., 1]
        size = 1 + np.abs(q) + np.abs(q_star)
        assert (np.abs(q_star - q - 1) < 1e-8 * size).all()
        for name, value in (("kappa", q), ("kappa_star", q_star)):
            # sin cos/r = kappa cos + s sin: no division where the ray is an axis
            gap = value * cos - getattr(of, name)[:, None] * unit * cos - of.s[:, None] * unit * sin
            assert (np.abs(gap) < 1e-8 * (size + np.abs(of.s * of.rho0)[:, None])).all()


@pytest.mark.slow
@every_family
@given(seed=seeds)
def test_the_parameters_of_the_two_cubics_differ_by_the_inflection_circle(
    random_linkages: Maker, family: str, seed: int
) -> None:
    instant = curvature(random_linkages(family, 50, seed))
    off = (instant.kappa_star - instant.kappa) * instant.rho0 - 1
    assert (np.abs(off) < 8 * EPS * (1 + np.abs(instant.kappa * instant.rho0))).all()


@pytest.mark.slow
@every_family
@given(seed=seeds)
def test_axes_are_orthonormal_and_right_handed(random_linkages: Maker, family: str, seed: int) -> None:
    x, y = plane(curvature(random_linkages(family, 20, seed)).axes).T
    np.testing.assert_allclose(np.abs(x), 1, rtol=1e-14)
    np.testing.assert_allclose(1j * x, y, atol=1e-14)


@pytest.mark.slow
@every_acyclic
@given(seed=seeds)
def test_the_guided_pairs_drive_the_same_instant(random_linkages: Maker, family: str, seed: int) -> None:
    """Principal pairs are an involution: those of the linkage of the guided pairs are the driving pairs."""
    linkage = random_linkages(family, 100, seed)
    instant = curvature(linkage)
    guided, real = Linkage.valid(
        np.where(separate(linkage, instant)[:, None, None, None], instant.principal_pairs, np.nan)
    )
    linkage, instant = linkage[real], instant[real]
    ray = guided.rays
    clear = np.abs((ray[:, 0].conj() * ray[:, 1]).imag) > 0.2
    assert clear.sum() > 5
    again = curvature(guided)
    off = apart(again.principal_pairs, linkage.pivots, plane(instant.pole), instant.rho0)
    assert np.median(off[clear]) < 1e-12
    assert (off[clear] < 1e-7).all()
    np.testing.assert_allclose(again.kappa[clear] / instant.kappa[clear], 1, rtol=1e-6)


# -- contact with the finite motion ---------------------------------------------------------------------------------


def gap(pair: Array, d: Any, turn: Any) -> Any:
    """Return how far the pair is from its constraint after the displacement z -> d + turn z, in 50 digits."""
    fixed, moving = (mp.mpc(float(x), float(y)) for x, y, _ in pair)
    if not pair[0][2]:
        return (mp.conj(fixed) * (d + turn * moving - moving)).real
    if not pair[1][2]:
        return (mp.conj(turn * moving) * (fixed - d)).real - (mp.conj(moving) * fixed).real
    size = abs(moving - fixed) + abs(moving)
    return (abs(d + turn * moving - fixed) ** 2 - abs(moving - fixed) ** 2) / size


def exponents(of: Callable[[Any, Any], Any], pivots: Array, follow: Follower, crank: int | None = None) -> Array:
    """Return the exponents with which the even and the odd part of a function of the pose vanish.

    Infinite where no more is left of it than the rounding of what was asked for to doubles.
    """
    with mp.workdps(50):
        parts = []
        for h in (0.02, 0.01):
            there, back = (of(*follow(pivots, t, crank)) for t in (h, -h))
            parts.append((abs(there + back), abs(there - back)))
        pairs = list(zip(*parts, strict=True))
        return np.array([float(mp.log(far / near, 2)) if near > 4 * EPS else np.inf for far, near in pairs])


def calm(linkage: Linkage, instant: Curvature) -> Array:
    """Return where the motion is so smooth that 0.02 of the angle is little: neither pole nor pivots far or near."""
    r = np.abs(linkage.points - plane(instant.pole)[:, None, None])
    r = np.where(linkage.finite, r, 1)
    return np.asarray(((r > 0.3) & (r < 5)).all(axis=(1, 2)) & (instant.rho0 > 0.3) & (instant.rho0 < 5))


@pytest.mark.slow
@every_family
def test_the_pole_does_not_move_and_runs_along_the_tangent(
    random_linkages: Maker, follow: Follower, family: str
) -> None:
    linkage = random_linkages(family, 40, SEED)
    instant = curvature(linkage)
    for n in np.flatnonzero(calm(linkage, instant))[:4]:
        pole, normal = plane(instant.pole)[n], plane(instant.axes)[n, 1]

        def along(d: Any, turn: Any, pole: complex = pole, axis: complex = -1j * normal) -> Any:
            return ((d + (turn - 1) * mp.mpc(pole)) * mp.conj(mp.mpc(axis))).real

        def across(d: Any, turn: Any, pole: complex = pole, axis: complex = normal) -> Any:
            return along(d, turn, pole, axis)

        even, odd = exponents(across, linkage.pivots[n], follow)
        assert 1.9 < even < 2.1
        assert odd > 2.9
        even, odd = exponents(along, linkage.pivots[n], follow)  # the acceleration of the pole is along the normal
        assert even > 3.9
        assert odd > 2.9
        # (1): it is rho0 theta^2 in magnitude, towards the inflection circle
        with mp.workdps(50):
            second = (across(*follow(linkage.pivots[n], 1e-6)) + across(*follow(linkage.pivots[n], -1e-6))) / 4e-12
        assert float(second) == pytest.approx(instant.rho0[n], rel=1e-9)


@pytest.mark.slow
@every_family
def test_points_of_the_cubic_have_stationary_curvature(random_linkages: Maker, follow: Follower, family: str) -> None:
    linkage = random_linkages(family, 60, SEED + 1)
    instant = curvature(linkage)
    found = 0
    for n in np.flatnonzero(calm(linkage, instant))[:3]:
        unit, pole, (x, y) = instant.rho0[n], plane(instant.pole)[n], plane(instant.axes)[n]
        for phi in (0.4, 1.2, 2.1):
            a, a_star = (
                getattr(instant, name)[n] * unit / np.sin(phi) + instant.s[n] * unit / np.cos(phi)
                for name in ("kappa", "kappa_star")
            )
            if any(1e-9 < abs(value) < 0.1 or abs(value) > 3 for value in (a, a_star)):
                continue
            ray = (np.cos(phi) * x + np.sin(phi) * y) * unit
            ends = [(pole + ray / v, 1) if abs(v) > 0.1 else (ray / unit, 0) for v in (a, a_star)]
            pair = np.array([[z.real, z.imag, w] for z, w in ends])
            even, odd = exponents(partial(gap, pair), linkage.pivots[n], follow)
            assert even > 3.9
            assert odd > 4.9
            found += 1
    assert found > 1


@pytest.mark.parametrize("first", [0, 1])
def test_slider_cranks_in_cardan_motion_have_no_principal_pairs(first: int) -> None:
    """Crank and coupler of one length, the slider in line with the crank's pivot: every point of the circle that rolls
    is guided exactly, whichever dyad comes first."""
    turn = np.array([0.3, 1.0, 2.2, -0.8])
    pivots = np.zeros((len(turn), 2, 2, 3))
    pivots[:, 0, :, 2] = 1
    pivots[:, 0, 1, 0], pivots[:, 0, 1, 1] = np.cos(turn), np.sin(turn)
    pivots[:, 1, 0, 1] = pivots[:, 1, 1, 2] = 1
    pivots[:, 1, 1, 0] = 2 * np.cos(turn)
    instant = curvature(Linkage(pivots[:, [first, 1 - first]]))
    assert np.isfinite(instant.pole).all()
    assert np.isnan(instant.principal_pairs[:, -2:]).all()


@pytest.mark.slow
@every_acyclic
def test_principal_pairs_hold_five_positions(random_linkages: Maker, follow: Follower, family: str) -> None:
    linkage = random_linkages(family, 150, SEED + 2)
    instant = curvature(linkage)
    chosen = np.flatnonzero(calm(linkage, instant) & np.isfinite(instant.principal_pairs).all(axis=(1, 2, 3)))[:5]
    assert len(chosen) == 5
    for n in chosen:
        for pair in instant.principal_pairs[n]:
            if np.abs(plane(pair) - plane(instant.pole)[n]).min() < 0.1 * instant.rho0[n]:
                continue  # so near the pole that 0.02 is no small angle
            even, odd = exponents(partial(gap, pair), linkage.pivots[n], follow)
            assert odd > 4.9
            assert even > 5.8


@pytest.mark.slow
@every_acyclic
def test_undulation_and_cuspidation_hold_four_positions(random_linkages: Maker, follow: Follower, family: str) -> None:
    linkage = random_linkages(family, 60, SEED + 3)
    instant = curvature(linkage)
    found = 0
    for n in np.flatnonzero(calm(linkage, instant))[:5]:
        pole = plane(instant.pole)[n]
        for name in ("undulation", "cuspidation"):
            z = plane(getattr(instant, name))[n]
            if abs(z - pole) < 0.2:
                continue
            normal = (z - pole) / abs(z - pole)
            pair = np.array([[normal.real, normal.imag, 0], [z.real, z.imag, 1]])
            pair = pair if name == "undulation" else pair[::-1]
            even, odd = exponents(partial(gap, pair), linkage.pivots[n], follow)
            assert even > 3.9
            assert odd > 4.9
            found += 1
    assert found > 3


def parallel(second: int, seed: int, n: int) -> Linkage:
    """Return n linkages of a crank along (1, 2) and a dyad of the given kind whose ray is parallel."""
    draw = np.random.default_rng(seed)
    along, across = (1 + 2j) / np.sqrt(5), (-2 + 1j) / np.sqrt(5)
    z = draw.uniform(0.5, 1.5, size=(n, 2, 2)) * draw.choice([-1, 1], size=(n, 2, 2)) * along
    z[:, :, 1] += z[:, :, 0]
    z[:, 0] += 0.7 * across
    z[:, 1] -= draw.uniform(0.4, 1.0, size=(n, 1)) * across
    w = np.ones((n, 2, 2))
    if second != RR:
        k = 0 if second == PR else 1
        z[:, 1, k], w[:, 1, k] = along, 0
    return Linkage(np.stack([z.real, z.imag, w], axis=-1))


@pytest.mark.slow
@pytest.mark.parametrize("second", [RR, PR, RP])
def test_principal_pairs_of_parallel_cranks_hold_five_positions(follow: Follower, second: int) -> None:
    linkage = parallel(second, SEED, 30)
    for some in (linkage, linkage[:, ::-1] if second == RR else Linkage(linkage.pivots[:, ::-1])):
        crank = int(np.flatnonzero(some.dyads[0] == RR)[0])
        instant = curvature(some)
        assert (instant.state == PARALLEL).all()
        chosen = np.flatnonzero(np.isfinite(instant.principal_pairs).all(axis=(1, 2, 3)))[:4]
        assert len(chosen) == 4
        for n in chosen:
            for pair in instant.principal_pairs[n]:
                even, odd = exponents(partial(gap, pair), some.pivots[n], follow, crank)
                assert odd > 4.8
                assert even > 5.5


@pytest.mark.parametrize("zero", ["k", "k_star"])
def test_straight_guides_of_parallel_cranks_hold_five_positions(follow: Follower, zero: str) -> None:
    """Series IV, IV*: one principal pair is a slot, or a straight path."""
    k = 1 if zero == "k_star" else 0
    pivots = np.array([[[[-1.3, 1, 1], [0, 1, 1]], [[0.9, -0.4, 1], [0, -0.4, 1]]]])[:, :, :: 1 if k else -1]
    linkage = Linkage(pivots).moved(2 - 1j, 3 + 1j)
    instant = curvature(linkage)
    assert getattr(instant, zero)[0] == pytest.approx(0, abs=1e-14)
    at_infinity = instant.principal_pairs[0, :, 1 - k, 2] == 0
    assert at_infinity.sum() == 1
    for pair in instant.principal_pairs[0]:
        even, odd = exponents(partial(gap, pair), linkage.pivots[0], follow, 0)
        assert odd > 4.9
        assert even > 5.8


# -- dead points ----------------------------------------------------------------------------------------------------


def stretched(pivots: list[float], angle: float) -> Linkage | None:
    """Return the four-bar with these pivots on the x axis, its first crank turned by the angle, on a branch near by."""
    with mp.workdps(50):
        a, p, b, q = (mp.mpf(v) for v in pivots)
        p_new = a + (p - a) * mp.expj(angle)
        base, coupler, crank = b - p_new, abs(q - p), abs(q - b)
        x = (coupler**2 - crank**2 + abs(base) ** 2) / (2 * abs(base))
        if coupler < abs(x):
            return None
        ends = [p_new + base / abs(base) * mp.mpc(x, side * mp.sqrt(coupler**2 - x**2)) for side in (1, -1)]
        q_new = ends[0]
        z = np.array([[complex(a), complex(p_new)], [complex(b), complex(q_new)]])
    return Linkage(np.stack([z.real, z.imag, np.ones((2, 2))], axis=-1))


CHAINS = [[0.0, 1.0, 3.0, 3.8], [0.0, 1.0, 2.2, 0.9], [0.0, -0.7, 1.0, -0.3]]


@pytest.mark.parametrize("chain", CHAINS)
def test_the_instant_near_a_dead_point_tends_to_that_of_a_branch(chain: list[float]) -> None:
    at = stretched(chain, 0)
    assert at is not None
    assert curvature(at).state[0] == DEAD_POINT
    branches = dead_points(at)
    assert (branches.state == REGULAR).all()
    errors = []
    for angle in (0.04, 0.01):
        near = stretched(chain, angle)
        assert near is not None
        instant = curvature(near)
        branch = branches[int(np.argmin(np.hypot(*(branches.pole - instant.pole).T)))]
        unit = branch.rho0[0]
        off = [np.hypot(*(instant.pole - branch.pole)[0]), abs(instant.rho0 - branch.rho0)[0]]
        off += [
            unit**2 * abs(getattr(instant, name) - getattr(branch, name))[0] for name in ("kappa", "kappa_star", "s")
        ]
        errors.append(np.array(off) / unit)
        if np.isfinite(branch.principal_pairs).all():
            pairs = apart(instant.principal_pairs, branch.principal_pairs, plane(branch.pole), branch.rho0)
            errors[-1] = np.append(errors[-1], pairs)
    assert (errors[1] < 0.5 * errors[0] + 1e-9).all()
    assert errors[1].max() < 0.1


def test_a_fully_stretched_chain_is_immobile() -> None:
    pivots: Any = [[[0, 0, 1], [1, 0, 1]], [[3, 0, 1], [2, 0, 1]]]
    found = dead_points(Linkage(pivots))
    assert np.isnan(found.pole).all()
    assert (found.state == DEAD_POINT).all()
    assert all("immobile" in why for why in found.reason)


@pytest.mark.slow
def test_towards_a_dead_point_noise_is_never_returned() -> None:
    draw = np.random.default_rng(SEED)
    chains = [chain for chain in draw.normal(size=(60, 4)).tolist() if stretched(chain, 1e-5)]
    assert len(chains) > 20
    for chain in chains:
        states = []
        for angle in 10.0 ** -np.arange(2, 8, 0.5):
            near = stretched(chain, angle)
            if near is None:
                continue
            near = near.moved(np.exp(1j), 1 - 2j)
            found = curvature(near)
            states.append(found.state[0])
            if found.state[0] == REGULAR:
                exact = textbook(near.pivots[0])
                assert abs(found.kappa[0] - exact["kappa"]) < 0.02 * (abs(exact["kappa"]) + 1 / exact["rho0"])
            else:
                assert np.isnan(found.kappa[0])
        assert states[-1] == DEAD_POINT


def test_noise_is_by_how_much_rounding_of_the_pivots_can_change_the_cubic() -> None:
    """Pivots moved at random, by 1e-10 of the linkage, change kappa and s by no more than sixty times what is told
    of a rounding, where that is much; and where it is told to be, it is."""
    draw = np.random.default_rng(4)
    z = draw.normal(size=(4000, 2, 2)) + 1j * draw.normal(size=(4000, 2, 2))
    linkage, by = four_bars(z), 1e-10
    told, here = noise(linkage) / EPS, finite_pole(linkage)
    changed = np.zeros(len(z))
    for _ in range(6):
        step = draw.uniform(-1, 1, z.shape) + 1j * draw.uniform(-1, 1, z.shape)
        there = finite_pole(four_bars(z + by * np.abs(z).max((1, 2), keepdims=True) * step))
        for name in ("kappa", "s"):
            value = here["rho0"] * here[name]
            change = np.abs(here["rho0"] * there[name] - value) / (1 + np.abs(value))
            changed = np.fmax(changed, change / by)
    much = told > 100
    assert much.sum() > 100
    assert (changed < 60 * np.maximum(told, 30)).all()
    assert np.median(changed[much] / told[much]) > 0.03
    # of how little is left of the projections of the inflection circle's diameter on the rays where they nearly agree
    projected = np.abs((linkage.rays * (here["axes"][:, 1] @ [1, -1j])[:, None]).real)
    left = np.abs(linkage.sine) / projected.sum(1)
    np.testing.assert_allclose(told, 1 / (np.abs(linkage.sine) * left**2), rtol=1e-6)


def four_bars(z: Array) -> Linkage:
    """Return linkages of complex pivots (n, 2, 2)."""
    return Linkage(np.stack([z.real, z.imag, np.ones(z.shape)], axis=-1))


# -- numbers that do not exist --------------------------------------------------------------------------------------


def cyclic(n: int, seed: int) -> Linkage:
    """Return isosceles slider-cranks: crank = coupler, the slider's line through the fixed pivot."""
    draw = np.random.default_rng(seed)
    angle, place = draw.uniform(0.2, 1.3, n), 10 ** draw.uniform(-3, 3, n) * np.exp(1j * draw.uniform(0, 7, n))
    z = np.stack([0 * angle, np.exp(1j * angle), 0 * angle + 1j, 2 * np.cos(angle)], axis=-1).reshape(n, 2, 2)
    linkage = Linkage(np.stack([z.real, z.imag, np.tile([[1, 1], [0, 1]], (n, 1, 1))], axis=-1))
    return linkage.moved(place, place * (draw.normal(size=n) + 1j * draw.normal(size=n)) * 5)


@pytest.mark.parametrize("inverse", [False, True])
def test_cyclic_motions_have_no_principal_pairs(random_linkages: Maker, inverse: bool) -> None:
    trammels = random_linkages("elliptic-trammel", 200, SEED)
    for linkage in (trammels, cyclic(200, SEED)):
        instant = curvature(linkage.inverted() if inverse else linkage)
        curved = instant.kappa_star if inverse else instant.kappa
        assert np.abs(curved * instant.rho0).max() < 1e-12
        assert np.abs(instant.s * instant.rho0).max() < 1e-12
        assert np.isnan(instant.principal_pairs).all()
        assert all("undetermined" in why for why in instant.reason)


def test_parallelograms_translate() -> None:
    sides = np.array([[0, 1 + 2j], [3 - 1j, 4 + 1j]])
    linkage = Linkage(np.stack([sides.real, sides.imag, np.ones((2, 2))], axis=-1)[None])
    instant = curvature(linkage[[0] * 20].moved(np.exp(1j * np.arange(20)), 7 * np.arange(20)))
    assert (instant.state == PARALLEL).all()
    for name in ("k", "k_star", "principal_pairs"):
        assert np.isnan(getattr(instant, name)).all()
    assert all("translates" in why for why in instant.reason)


def missing(instant: Curvature) -> Array:
    """Return where a number is NaN that the state does not exclude by definition."""
    names = ["pole", "axes", "rho0", "kappa", "kappa_star", "s", "undulation", "cuspidation", "principal_pairs"]
    arrays = [getattr(instant, name).reshape(len(instant), -1) for name in names]
    return np.asarray(np.isnan(np.concatenate(arrays, axis=1)).any(axis=1))


def test_every_missing_number_has_its_reason_and_none_else(
    golden: list[dict[str, Any]], random_linkages: Maker
) -> None:
    batches = [Linkage([case["pivots"] for case in golden])]
    batches += [random_linkages(family, 300, SEED) for family in FAMILIES]
    batches += [parallel(kind, SEED, 50) for kind in (RR, PR, RP)]
    seen: set[str] = set()
    for linkage in batches:
        for instant in (curvature(linkage), dead_points(linkage)[:: 50 if len(linkage) > 250 else 9]):
            given_reason = instant.reason != ""
            np.testing.assert_array_equal(given_reason, missing(instant))
            seen |= {part for why in instant.reason for part in why.split("; ")}
    assert len(seen - {""}) >= 8


def test_an_empty_batch_has_an_empty_instant() -> None:
    instant = curvature(Linkage(np.zeros((0, 2, 2, 3))))
    assert len(instant) == len(instant.reason) == 0
    assert instant.principal_pairs.shape == (0, 2, 2, 3)


# -- digits near the degenerations ----------------------------------------------------------------------------------


def textbook(pivots: Array) -> dict[str, Any]:
    """Return the instant by the textbook formulas (3), (15), (16), (22), with tangents, in 60 digits."""
    with mp.workdps(60):
        z = [[mp.mpc(float(x), float(y)) for x, y, _ in pair] for pair in pivots]
        assert all(w for pair in pivots for *_, w in pair)
        ray = [(moving - fixed) / abs(moving - fixed) for fixed, moving in z]
        sine = (mp.conj(ray[0]) * ray[1]).imag
        pole = z[0][0] + ray[0] * (mp.conj(z[1][0] - z[0][0]) * ray[1]).imag / sine
        r = [[(mp.conj(e) * (p - pole)).real for p in pair] for e, pair in zip(ray, z, strict=True)]
        m = [a * b / (a - b) for a, b in r]
        diameter = 1j * (m[1] * ray[0] - m[0] * ray[1]) / sine
        rho0 = abs(diameter)
        y = diameter / rho0
        x = -1j * y
        cos, sin = ([(mp.conj(axis) * e).real for e in ray] for axis in (x, y))
        cot = [c / s for c, s in zip(cos, sin, strict=True)]
        kappa, star = ((cos[0] / r[0][k] - cos[1] / r[1][k]) / (cot[0] - cot[1]) for k in (0, 1))
        s = (sin[0] / r[0][0] - sin[1] / r[1][0]) / (1 / cot[0] - 1 / cot[1])
        half = ((kappa + star) / s - 1 / cot[0] - 1 / cot[1]) / 2
        root = half**2 - kappa * star / s**2 * cot[0] * cot[1]
        pairs = []
        if root >= 0:
            for tangent in (half + mp.sqrt(root), half - mp.sqrt(root)):
                c = 1 / mp.sqrt(1 + tangent**2)
                a = [(value / tangent + s) / c for value in (kappa, star)]
                pairs.append([(c * x + tangent * c * y, value) for value in a])
        return {"pole": pole, "rho0": rho0, "kappa": kappa, "kappa_star": star, "s": s, "pairs": pairs}


def chordal(exact: tuple[Any, Any], found: Array, pole: Any, unit: Any) -> float:
    """Chordal distance of the point pole + ray/a from a pivot, with the pole as centre."""
    ray, a = exact
    a *= unit
    if not found[2]:
        return float(abs(a) / mp.sqrt(1 + a * a))
    z = (mp.mpc(float(found[0]), float(found[1])) - pole) / unit
    return float(abs(z * a - ray) / mp.sqrt(1 + a * a) / mp.sqrt(1 + abs(z) ** 2))


def digits_lost(linkage: Linkage) -> dict[str, list[float]]:
    instant = curvature(linkage)
    lost: dict[str, list[float]] = {name: [] for name in ("pole", "kappa", "kappa_star", "s", "pairs")}
    for n in range(len(linkage)):
        with mp.workdps(60):
            exact = textbook(linkage.pivots[n])
            unit = exact["rho0"]
            off = {"pole": abs(mp.mpc(complex(plane(instant.pole)[n])) - exact["pole"]) / unit}
            for name in ("kappa", "kappa_star", "s"):
                off[name] = abs(getattr(instant, name)[n] - exact[name]) * unit / max(1, abs(exact[name]) * unit)
            found = instant.principal_pairs[n]
            assert bool(exact["pairs"]) == (not np.isnan(found).any())
            if exact["pairs"]:
                off["pairs"] = max(
                    min(
                        max(chordal(z, p, exact["pole"], unit) for z, p in zip(pair, mine, strict=True))
                        for mine in found
                    )
                    for pair in exact["pairs"]
                )
        for name, value in off.items():
            lost[name].append(max(0.0, float(np.log10(float(value) / EPS + 1))))
    return lost


def on_cubics(kappa: float, s: float, sin: float, cos: float) -> list[complex]:
    return [(cos + 1j * sin) / (value / sin + s / cos) for value in (kappa, kappa + 1)]


def near_series(series: str, eps: float, draw: np.random.Generator) -> list[list[complex]]:
    """Return two pairs of a linkage whose loci are by `eps` from those of the series, rho0 = 1."""
    kappa, s = draw.choice([-2.0, -0.5, 0.7, 1.5]) * draw.uniform(0.8, 1.2), eps
    if series in ("II.xy", "III.Kx"):
        kappa, s = eps * draw.uniform(0.5, 2), (eps if series == "II.xy" else 1) * draw.uniform(0.5, 2)
        sin = kappa * draw.uniform(0.5, 2)
        first = sin, float(np.sqrt(1 - sin * sin))
    else:
        phi = draw.uniform(0.3, 1.3)
        first = np.sin(phi), np.cos(phi)
    if series in ("I.GG", "III.Kx"):
        phi = draw.uniform(1.8, 2.8)
        second = np.sin(phi), np.cos(phi)
    else:
        tangent = draw.choice([-1, 1]) * draw.uniform(0.3, 1.5) / s
        cos = 1 / np.hypot(1, tangent)
        second = tangent * cos, cos
    return [on_cubics(kappa, s, *first), on_cubics(kappa, s, *second)]


@pytest.mark.parametrize("eps", [1e-4, 1e-8, 1e-10, 1e-12])
@pytest.mark.parametrize(
    ("series", "median", "worst"), [("I.GG", 0, 1), ("I.Gy", 0.3, 1.7), ("II.xy", 0.3, 1.3), ("III.Kx", 0.3, 1.3)]
)
def test_no_more_digits_are_lost_near_a_degeneration_than_elsewhere(
    series: str, median: float, worst: float, eps: float
) -> None:
    draw = np.random.default_rng(SEED)
    z = np.array([near_series(series, eps, draw) for _ in range(30)])
    linkage = Linkage(np.stack([z.real, z.imag, np.ones_like(z.real)], axis=-1))
    linkage = linkage[separate(linkage, curvature(linkage))]
    n = len(linkage)
    scale = 10 ** draw.uniform(-2, 2, n) * np.exp(1j * draw.uniform(0, 7, n))
    lost = digits_lost(linkage.moved(scale, scale * draw.normal(size=n)))
    assert len(lost["pairs"]) > 10
    assert {name: max(values) for name, values in lost.items() if max(values) > worst + 1} == {}
    assert {name: np.median(values) for name, values in lost.items() if np.median(values) > median + 0.5} == {}


def test_few_digits_are_lost_in_general(random_linkages: Maker) -> None:
    lost = digits_lost(random_linkages("four-bar", 60, SEED))
    assert {name: max(values) for name, values in lost.items() if max(values) > 3.6} == {}
    assert {name: np.median(values) for name, values in lost.items() if np.median(values) > 0.6} == {}


@pytest.mark.parametrize("eps", [1e-3, 1e-5, 1e-8, 1e-12])
@pytest.mark.parametrize("inverse", [False, True])
def test_no_digits_are_lost_near_the_parallel_degenerations(eps: float, inverse: bool) -> None:
    """Series IV, IV*: one root y of the pairs tends to 0, its pivots to infinity and to the axis."""
    draw = np.random.default_rng(SEED)
    y, k = draw.uniform(0.4, 1.5, (20, 2)) * [1, -1], draw.choice([-1, 1], 20) * draw.uniform(0.3, 1.5, 20)
    k_star = eps * draw.uniform(0.5, 2, 20)
    z = np.stack([np.stack([-c[:, None] / y, y], axis=-1) for c in (k, k_star)], axis=2)
    linkage = Linkage(np.concatenate([z, np.ones((20, 2, 2, 1))], axis=-1))
    instant = curvature(linkage.inverted() if inverse else linkage)
    assert (instant.state == PARALLEL).all()
    compared = 0
    for n in range(20):
        with mp.workdps(50):
            (x1, y1), (x1_star, _), (x2, y2), (x2_star, _) = (
                (mp.mpf(float(p[0])), mp.mpf(float(p[1]))) for p in linkage.pivots[n].reshape(4, 3)
            )
            centre = ((x1 - x1_star) * y1 - (x2 - x2_star) * y2) / (x1 - x1_star - x2 + x2_star)
            y1, y2 = y1 - centre, y2 - centre
            origin = (x1 * y1 - x2 * y2) / (y1 - y2)
            values = [-(x - origin) * y1 for x in (x1, x1_star)]
            root = (y1 + y2) ** 2 / 4 - values[0] * values[1] / (y1 * y2)
            found = instant.principal_pairs[n][:, ::-1] if inverse else instant.principal_pairs[n]
            assert np.isnan(found).any() == (root < 0)
            for side in (1, -1) if root >= 0 else ():
                height = -(y1 + y2) / 2 + side * mp.sqrt(root)
                # homogeneous, so that height = 0 is no exception
                pair = [(-value + height * origin, height * (height + centre), height) for value in values]
                off = [
                    max(float(line(exact, mine)) for exact, mine in zip(pair, candidate, strict=True))
                    for candidate in found
                ]
                assert min(off) < 1e-13
                compared += 1
    assert compared > 20


def line(one: Any, other: Array) -> Any:
    """Sine of the angle of two homogeneous points, as lines through the origin of space."""
    p, q = list(one), [mp.mpf(float(v)) for v in other]
    cross = [p[i] * q[j] - p[j] * q[i] for i, j in ((0, 1), (1, 2), (2, 0))]
    return mp.norm(cross) / mp.norm(p) / mp.norm(q)


@pytest.mark.parametrize("factor", [0.5, 0.99, 1.01, 2, 100])
def test_pairs_of_nearly_parallel_cranks_are_good_on_both_sides_of_the_threshold(factor: float) -> None:
    linkage = parallel(RR, SEED, 40)
    z = linkage.points.copy()
    z[:, 1, 1] = z[:, 1, 0] + (z[:, 1, 1] - z[:, 1, 0]) * np.exp(1j * factor * DEGENERATE.parallel_sine)
    linkage = Linkage(np.stack([z.real, z.imag, np.ones_like(z.real)], axis=-1))
    instant = curvature(linkage)
    assert (instant.state == (PARALLEL if factor < 1 else REGULAR)).all()
    compared = 0
    for n in range(40):
        exact, found = textbook(linkage.pivots[n]), instant.principal_pairs[n]
        assert bool(exact["pairs"]) == (not np.isnan(found).any())
        for pair in exact["pairs"]:
            off = []
            for mine in found:
                with mp.workdps(60):
                    there = [exact["pole"] + ray / a for ray, a in pair]
                    here = [mp.mpc(float(p[0]), float(p[1])) for p in mine]
                    off.append(max(float(abs(p - q) / (1 + abs(q) ** 2)) for p, q in zip(here, there, strict=True)))
            assert min(off) < 1e-6
            compared += 1
    assert compared > 20


def test_a_pivot_at_the_pole_is_named_by_its_letter() -> None:
    # crank in line with the coupler, the other crank perpendicular: its moving pivot is the pole
    pivots = np.array([[[[1, 0, 1], [0, 0, 1]], [[0, 3, 1], [0, 1, 1]]]], dtype=float)
    for linkage, names in ((Linkage(pivots), {"DP", "DX", "DN"}), (Linkage(pivots).inverted(), {"VP", "VX", "VN"})):
        turned = linkage[[0] * 30].moved(np.exp(1j * np.arange(30)), 3 * np.arange(30))
        found = set(configuration(turned, curvature(turned)))
        assert len(found) == 1
        assert found <= names
    assert RP not in linkage.dyads


def test_a_pivot_at_the_pole_gives_kappa_exactly_zero_however_short_a_crank() -> None:
    draw = np.random.default_rng(15)
    n = 400
    at, along, crank = (draw.normal(size=n) + 1j * draw.normal(size=n) for _ in range(3))
    short = along * (1 + 10 ** draw.uniform(-4, 0, n))
    z = np.stack([np.stack([at + crank, at], -1), np.stack([at + along, at + short], -1)], axis=1)
    linkage = Linkage(np.stack([z.real, z.imag, np.ones(z.shape)], axis=-1))
    assert np.all(curvature(linkage).kappa == 0)
    assert np.all(curvature(linkage.inverted()).kappa_star == 0)


def test_two_pairs_that_fall_into_the_pole_are_given_there() -> None:
    one = np.ones(1)
    linkage = Linkage(linkage_of(*(tangent_circle_pair(0.5 * one, t * one) for t in (0.5, 1.5))))
    fixed, moving = np.moveaxis(curvature(linkage).principal_pairs[0], 1, 0)
    np.testing.assert_allclose(fixed, [[2, 0, 1]] * 2, atol=1e-12)
    np.testing.assert_allclose(moving, [[0, 0, 1]] * 2, atol=1e-12)
