"""Narrowest strip and annulus against slow searches that share nothing with them."""

from __future__ import annotations

from typing import Any

import mpmath as mp  # type: ignore[import-untyped]  # it ships no types
import numpy as np
import pytest
from numpy.polynomial import chebyshev
from scipy.optimize import linprog, minimize

from catalogue.guidance.minimum_zone import Fit, concentric, exchange, grid, largest, minimum_zone, resolved, times
from catalogue.kinematics.types import Array
from tests.precision import EXTENDED

NODES = 32
DENSE = np.sin(np.linspace(-np.pi / 2, np.pi / 2, 3001))


def waves(count: int, seed: int, share: float = 0.4) -> Array:
    """Return Chebyshev coefficients of an error with `count` oscillations and a mixture of fewer ones."""
    draw = np.random.default_rng([count, seed])
    c = share * draw.normal(size=count + 2) / np.arange(1, count + 3)
    c[:2] = 0
    c[-1] = 1
    return np.asarray(c)


def run(seed: int, t: Array) -> Array:
    """Return a run along the line that is not uniform in the parameter."""
    a, b = np.random.default_rng([7, seed]).uniform(-0.1, 0.1, 2)
    return np.asarray(t + a * t * t + b * t**3)


def placed(u: Array, v: Array, angle: float = 0.0, shift: complex = 0.0, scale: float = 1.0) -> tuple[Array, Array]:
    c, s = (np.asarray(f(u.dtype.type(angle))) for f in (np.cos, np.sin))
    return scale * (c * u - s * v) + shift.real, scale * (s * u + c * v) + shift.imag


def one(u: Array, v: Array, circle: bool, nodes: int = NODES) -> Fit:
    return minimum_zone(u[:, None], v[:, None], circle, grid(nodes, u.dtype))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("count", "exponent"),
    [(2, -2), (8, -2), (3, -4), (5, -6), (7, -8), (8, -10), (4, -11), (2, -12), (6, -13), (8, -13)],
)
def test_strip_is_the_narrowest(naive: Any, count: int, exponent: int) -> None:
    kind = np.longdouble if exponent < -10 else np.float64
    amplitude = 10.0**exponent
    for seed in (1, 2):
        c = waves(count, seed)
        t = grid(NODES, np.dtype(kind)).nodes
        u, v = run(seed, t), kind(amplitude) * chebyshev.chebval(t, c.astype(kind))
        found = one(*placed(u, v, 0.3 * seed, complex(0.1 * seed, -0.2)), circle=False)
        expected = naive.narrowest_strip(run(seed, DENSE), chebyshev.chebval(DENSE, c), amplitude)
        assert float(found.deviation[0]) == pytest.approx(expected, rel=1e-3)
        assert float(found.stroke[0]) == pytest.approx(np.ptp(run(seed, DENSE)), rel=amplitude)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("count", "exponent", "angle"),
    [(3, -3, 2.0), (3, -3, 1e-3), (4, -5, 0.03), (5, -8, 2.9), (6, -9, 1.0), (8, -10, 0.3), (3, -12, 0.3),
     (6, -13, 2.9), (6, -13, 1e-3)],
)  # fmt: skip
def test_annulus_is_the_narrowest(naive: Any, count: int, exponent: int, angle: float) -> None:
    """The path lies on an arc of that central angle and unit chord, displaced along the normal."""
    kind = np.longdouble
    amplitude, seed = 10.0**exponent, count
    c = waves(count, seed)

    def arc(t: Any, sine: Any, cosine: Any, radius: Any, wave: Any) -> tuple[Any, Any]:
        turn = run(seed, t) * 0.5 * angle
        return (radius + wave) * sine(turn), (radius + wave) * cosine(turn) - radius

    t = grid(NODES, np.dtype(kind)).nodes
    radius = kind(0.5) / np.sin(kind(0.5) * kind(angle))
    x, y = arc(t, np.sin, np.cos, radius, kind(amplitude) * chebyshev.chebval(t, c.astype(kind)))
    found = one(*placed(x, y, 0.7, 1 + 2j), circle=True)
    with mp.workdps(40):
        exact = [
            arc(mp.mpf(float(s)), mp.sin, mp.cos, 1 / (2 * mp.sin(mp.mpf(angle) / 2)), amplitude * mp.mpf(float(w)))
            for s, w in zip(DENSE[::4], chebyshev.chebval(DENSE[::4], c), strict=True)
        ]
    expected, curvature = naive.narrowest_annulus([mp.mpc(*p) for p in exact])
    assert float(found.deviation[0]) == pytest.approx(expected, rel=1e-3)
    assert float(found.curvature[0]) == pytest.approx(-curvature, rel=1e-3, abs=30 * amplitude)


@pytest.mark.parametrize("circle", [False, True])
def test_fit_does_not_depend_on_place_scale_and_sense(circle: bool) -> None:
    for count in range(2, 9):
        t = grid(NODES).nodes
        u, v = run(count, t), 1e-5 * chebyshev.chebval(t, waves(count, count)) - (0.2 * t * t if circle else 0)
        here = one(u, v, circle)
        for angle, shift, scale in ((2.0, 0.5 - 3j, 1.0), (-1.0, 0j, 1e6), (0.0, 1e-9j, 1e-7)):
            there = one(*placed(u, v, angle, shift, scale), circle)
            # what is left is the rounding of the moved coordinates
            lost = 20 * np.finfo(float).eps * (1 + abs(shift) / scale) / 1e-5
            turn = np.exp(1j * angle) * scale
            assert there.deviation[0] == pytest.approx(scale * here.deviation[0], rel=lost)
            assert there.stroke[0] == pytest.approx(scale * here.stroke[0], rel=1e-9)
            assert abs(there.start[0] - (turn * here.start[0] + shift)) < 1e-9 * scale
            assert abs(there.along[0] - here.along[0] * turn / scale) < 1e-9
            assert there.curvature[0] * scale == pytest.approx(here.curvature[0], rel=1e-8, abs=0)
        back = one(u[::-1], v[::-1], circle)
        assert back.deviation[0] == pytest.approx(here.deviation[0], rel=1e-8)
        assert abs(back.along[0] + here.along[0]) < 1e-9
        assert back.curvature[0] == pytest.approx(-here.curvature[0], rel=1e-9)
        over = one(u, -v, circle)
        assert over.deviation[0] == pytest.approx(here.deviation[0], rel=1e-8)
        assert over.curvature[0] == pytest.approx(-here.curvature[0], rel=1e-9)


def test_the_largest_value_may_lie_beside_the_largest_of_those_read() -> None:
    """Of two maxima the lower one stands on a place that is read, the higher one midway between two."""
    x = np.linspace(-1, 1, 161)[:, None] + np.array([0.0, 0.00625])
    values = np.where(x < 0, np.cos(8 * (x + 0.5)), 1.001 * np.cos(8 * (x - 0.50625)))
    assert (values.argmax(0) < 80).tolist() == [True, False]
    np.testing.assert_allclose(largest(values), 1.001, rtol=1e-5)
    values[7, 0] = np.nan
    assert np.isnan(largest(values)).tolist() == [True, False]


@pytest.mark.parametrize("circle", [False, True])
@pytest.mark.parametrize("exponent", [-500, -300, 300, 500])
def test_a_fit_is_the_same_in_any_unit(circle: bool, exponent: int) -> None:
    """In powers of two, which round nothing: no cube of a length leaves the range of numbers."""
    t = grid(NODES).nodes
    u, v = run(5, t), 1e-3 * chebyshev.chebval(t, waves(5, 5)) - (0.2 * t * t if circle else 0)
    unit = 2.0**exponent
    here, there = one(u, v, circle), one(u * unit, v * unit, circle)
    assert there.deviation[0] == pytest.approx(here.deviation[0] * unit, rel=1e-9, abs=0)
    assert there.curvature[0] * unit == pytest.approx(here.curvature[0], rel=1e-9, abs=0)


def test_strip_line_holds_the_path_within_its_deviation() -> None:
    """Start and direction are those of the middle line of the strip, not only its width."""
    for count in range(2, 9):
        t = grid(NODES).nodes
        c = waves(count, count)
        u, v = placed(run(count, t), 1e-3 * chebyshev.chebval(t, c), 0.4, 2 - 1j)
        found = one(u, v, circle=False)
        x, y = placed(run(count, DENSE), 1e-3 * chebyshev.chebval(DENSE, c), 0.4, 2 - 1j)
        offset = ((x + 1j * y - found.start[0]) * found.along[0].conj()).imag
        assert np.abs(offset).max() == pytest.approx(found.deviation[0], rel=1e-3)
        assert abs(((u[0] + 1j * v[0] - found.start[0]) * found.along[0].conj()).real) < 1e-12


@pytest.mark.parametrize("size", [1e-3, 0.03, 0.1, 0.2])
@pytest.mark.parametrize("count", [2, 3, 4])
def test_a_wide_strip_off_the_chord_is_the_narrowest_across_itself(size: float, count: int) -> None:
    """Turned by whatever little more, no strip about the path is narrower."""
    compared = 0
    for seed in range(12):
        wave = size * waves(count, seed, share=1.0)
        t = grid(NODES).nodes
        z = run(seed, DENSE[::4]) + 1j * chebyshev.chebval(DENSE[::4], wave)
        if not (np.diff((z * np.conj(z[-1] - z[0])).real) > 0).all():  # what has to run forward
            continue
        found = one(run(seed, t), chebyshev.chebval(t, wave), circle=False)
        turned = np.angle(found.along[0]) + np.linspace(-0.1, 0.1, 401)
        widths = 0.5 * np.ptp((z * np.exp(-1j * turned)[:, None]).imag, axis=1)
        assert found.deviation[0] == pytest.approx(widths.min(), rel=1e-4)
        assert found.deviation[0] == pytest.approx(widths[200], rel=1e-4)
        compared += 1
    assert compared >= 6


def test_nan_paths_stay_nan_and_leave_the_others_alone() -> None:
    t = grid(NODES).nodes
    u, v = np.repeat(t[:, None], 3, 1), np.repeat((0.1 * t**2 + 1e-4 * t**4)[:, None], 3, 1)
    alone = {circle: minimum_zone(u, v, circle, grid(NODES)).deviation for circle in (False, True)}
    v[5, 1] = np.nan
    for circle in (False, True):
        found = minimum_zone(u, v, circle, grid(NODES))
        assert np.isnan(found.deviation).tolist() == [False, True, False]
        np.testing.assert_array_equal(found.deviation[[0, 2]], alone[circle][[0, 2]])


@pytest.mark.parametrize("circle", [False, True])
def test_a_path_is_fitted_as_if_it_were_alone(circle: bool) -> None:
    """What others need more rounds of the exchange leaves it as it is, but for the rounding of matrix products."""
    nodes = grid(NODES)
    paths = []
    for k, count in enumerate((2, 3, 5, 8)):
        u = run(k, nodes.nodes)
        v = 10.0 ** -(2 + k) * chebyshev.chebval(nodes.nodes, waves(count, k)) - (0.2 * u**2 if circle else 0.3 * u)
        paths.append((u, v))
    along, across = (np.stack(part, axis=1) for part in zip(*paths, strict=True))
    together = minimum_zone(along, across, circle, nodes)
    for k, (u, v) in enumerate(paths):
        alone = one(u, v, circle)
        for name in ("deviation", "stroke", "curvature"):
            np.testing.assert_allclose(getattr(together, name)[k], getattr(alone, name)[0], rtol=1e-9, atol=1e-15)


def test_arc_beyond_a_half_circle_is_refused() -> None:
    turn = np.multiply.outer(grid(NODES).nodes, np.array([3.1, 3.2]) / 2)
    found = minimum_zone(np.sin(turn), np.cos(turn), True, grid(NODES))
    assert np.isnan(found.deviation).tolist() == [False, True]


def test_perfect_lines_and_arcs_deviate_by_rounding() -> None:
    t = grid(NODES).nodes
    line = one(*placed(t, 0 * t, 0.3, 5 + 1j), circle=False)
    assert line.deviation[0] < 1e-14
    arc = one(np.sin(t), np.cos(t), circle=True)
    assert arc.deviation[0] < 1e-14
    assert arc.curvature[0] == pytest.approx(-1, rel=1e-12)


@pytest.mark.parametrize("circle", [False, True])
@pytest.mark.parametrize("nodes", [16, 32])
def test_unresolved_bounds_what_a_grid_misses(nodes: int, circle: bool) -> None:
    """Paths with a pole of the parameter beside the window, as near a turning point, and beyond its end."""
    draw = np.random.default_rng(3)
    near, side = draw.uniform(0.7, 4, 500), draw.uniform(-0.7, 0.7, 500)

    def path(t: Array) -> tuple[Array, Array]:
        bump = 1 / ((t[:, None] - side) ** 2 + near**2) - 0.4 * np.sqrt(near + 1 + t[:, None])
        return t[:, None] + 0.05 * bump, 0.1 * bump

    coarse, fine = (minimum_zone(*path(grid(n).nodes), circle, grid(n)) for n in (nodes, 128))
    missed = np.abs(coarse.deviation - fine.deviation)
    assert np.all(missed <= coarse.unresolved + 1e-3 * fine.deviation + 1e-15)
    assert (fine.unresolved < 1e-12).all()
    accepted = resolved(coarse)
    assert np.all(missed[accepted] < 1e-3 * fine.deviation[accepted] + 1e-15)
    assert accepted.any()
    assert not accepted.all() or nodes == 32


# -- arcs of exactly a given radius ----------------------------------------------------------------------------------
CURVATURES = [0.0, 1e-9, 1e-4, 0.3, 0.99, -0.3, -0.99]


def along_arc(curvature: float, s: Array, wave: Array) -> tuple[Array, Array]:
    """Return an arc of length about 2 from the origin both ways, its centre above, with a wave across it."""
    k, turn = np.longdouble(curvature), np.longdouble(curvature) * s
    x = s * np.sinc(turn / np.pi)
    return x - wave * np.sin(turn), 0.5 * k * s * s * np.sinc(0.5 * turn / np.pi) ** 2 + wave * np.cos(turn)


def off_arc(u: Array, v: Array, curvature: float, tilt: float, rise: float) -> float:
    """Return the largest distance of a path, turned about the origin and lifted, from the arc through the origin."""
    x, y = (np.asarray(p, np.longdouble) for p in placed(u, v, tilt))
    y = y + np.longdouble(rise)
    if curvature == 0:
        return float(np.abs(y).max())
    radius = 1 / np.longdouble(curvature)
    return float(np.abs(np.hypot(x, y - radius) - abs(radius)).max())


@pytest.mark.slow
@pytest.mark.parametrize("curvature", CURVATURES)
@pytest.mark.parametrize(("count", "exponent"), [(2, -2), (3, -3), (5, -4), (8, -5)])
def test_an_arc_of_a_given_radius_is_the_best_placed(curvature: float, count: int, exponent: int) -> None:
    """A path with a wave of its own about an arc, and one that is bent a little more than the arc asked for."""
    if 0 < abs(curvature) < 1e-6 and not EXTENDED:
        pytest.skip("the reference subtracts numbers of 1e9: it needs extended precision")
    amplitude, nodes = 10.0**exponent, grid(NODES).nodes
    half = 1.0 if not curvature else float(np.arcsin(abs(curvature)) / abs(curvature))
    for held in (curvature, 0.97 * curvature):
        c = waves(count, count)
        u, v = along_arc(curvature, half * nodes, amplitude * chebyshev.chebval(nodes, c))
        x, y = (np.asarray(p, float) for p in placed(u, v, 0.7, 1 + 2j))
        found = minimum_zone(x[:, None], y[:, None], True, grid(NODES), np.array([held]))
        assert found.curvature[0] == held
        assert found.stroke[0] == pytest.approx(abs(complex(u[-1] - u[0], v[-1] - v[0])), rel=1e-12)
        dense = along_arc(curvature, half * DENSE[::3], amplitude * chebyshev.chebval(DENSE[::3], c))
        best, unit = np.zeros(2), max(amplitude, float(found.deviation[0]))

        def off(p: Array, dense: tuple[Array, Array] = dense, held: float = held, unit: float = unit) -> float:
            tilt, rise = p * unit
            return off_arc(*dense, held, tilt, rise) / unit

        for _ in range(4):  # a simplex may get stuck along the edge of a largest error
            best = minimize(off, best, method="Nelder-Mead", options={"xatol": 1e-6, "fatol": 1e-7, "maxiter": 2000}).x
        tilt, rise = best * unit
        assert found.deviation[0] == pytest.approx(off_arc(*dense, held, tilt, rise), rel=1e-3)


@pytest.mark.parametrize("held", CURVATURES)
def test_an_arc_held_along_a_straight_path(held: float) -> None:
    """Its centre is 1/k - k/4 away, so that middle and ends of a path of length 2 are k/4 off; in both senses."""
    t = grid(NODES).nodes
    for sense in (1, -1):
        x, y = placed(sense * t, 0 * t, 0.3, 1j)
        found = minimum_zone(x[:, None], y[:, None], True, grid(NODES), np.array([held]))
        assert found.deviation[0] == pytest.approx(abs(held) / 4, rel=1e-4, abs=1e-15)


@pytest.mark.parametrize("curvature", [-0.99, -0.3, 0.3, 0.99])
def test_the_best_circle_is_that_of_its_own_radius(curvature: float) -> None:
    """Of all radii the best one is that of the narrowest annulus."""
    t = grid(NODES).nodes
    u, v = (np.asarray(p, float)[:, None] for p in along_arc(curvature, t, 1e-4 * chebyshev.chebval(t, waves(5, 1))))
    free = minimum_zone(u, v, True, grid(NODES))
    same = minimum_zone(u, v, True, grid(NODES), free.curvature)
    assert same.deviation[0] == pytest.approx(free.deviation[0], rel=1e-3)
    for other in (0.999, 1.001):
        assert minimum_zone(u, v, True, grid(NODES), other * free.curvature).deviation[0] > free.deviation[0]


def test_held_paths_are_fitted_as_if_they_were_alone() -> None:
    t = grid(NODES).nodes
    held = np.array([0.0, 0.4, -0.9])
    u = np.repeat(t[:, None], 3, 1)
    v = np.stack([1e-3 * t**3, 0.2 * t**2, -0.4 * t**2 + 1e-5 * t**5], axis=1)
    together = minimum_zone(u, v, True, grid(NODES), held)
    for k in range(3):
        alone = minimum_zone(u[:, [k]], v[:, [k]], True, grid(NODES), held[[k]])
        assert together.deviation[k] == pytest.approx(alone.deviation[0], rel=1e-9)
    np.testing.assert_array_equal(together.curvature, held)


@pytest.mark.parametrize("curvature", CURVATURES)
def test_concentric_is_the_distance_and_how_it_changes(curvature: float) -> None:
    draw = np.random.default_rng(2)
    x, y = draw.uniform(-0.9, 0.9, 50), draw.uniform(-0.1, 0.3, 50)
    distance, run, weight = concentric(x, y, np.array(curvature))
    if curvature:
        away = x + 1j * y - 1j / curvature
        if abs(curvature) > 1e-6:
            np.testing.assert_allclose(distance, np.sign(curvature) * (1 / abs(curvature) - np.abs(away)), atol=1e-12)
        np.testing.assert_allclose(run, -x / (curvature * away.imag), rtol=1e-9)
        np.testing.assert_allclose(weight, np.abs(away) / np.abs(away.imag), rtol=1e-9)
    else:
        np.testing.assert_array_equal(distance, y)
        np.testing.assert_array_equal(run, x)
        np.testing.assert_array_equal(weight, 1)
    # a turn about the vertex by c1 shifts the centre by c1 / k: with the lift it is all that a circle can do
    for c0, c1 in ((1e-6, 0.0), (0.0, 1e-6)):
        z = (x + 1j * y) * np.exp(-1j * c1) - 1j * c0
        after = concentric(z.real, z.imag, np.array(curvature))[0]
        np.testing.assert_allclose(distance - after, (c0 + c1 * run) / weight, atol=2e-11)


@pytest.mark.parametrize("size", [3, 4])
def test_the_largest_error_is_least_wherever_its_extremes_are_sought_first(size: int) -> None:
    draw = np.random.default_rng(size)
    x = np.sort(draw.uniform(-1, 1, (60, 1)), axis=0)
    values = draw.normal(size=(60, 40))  # of which each is another function
    first = np.sort([draw.choice(60, size, replace=False) for _ in range(40)], axis=1).T
    c, error, index = exchange(np.repeat(x, 40, axis=1), values, first, peaks=False)
    for k in range(40):
        terms = np.vander(x[:, 0], size - 1, increasing=True)
        one = np.ones((60, 1))
        bound = np.block([[terms, -one], [-terms, -one]])
        given = np.concatenate([values[:, k], -values[:, k]])
        best = linprog([0] * (size - 1) + [1], A_ub=bound, b_ub=given, bounds=(None, None))
        assert error[k] == pytest.approx(best.fun, rel=1e-9)
        assert np.abs(values[:, k] - terms @ c[:, k]).max() == pytest.approx(best.fun, rel=1e-9)
        assert (np.diff(index[:, k]) > 0).all()


@pytest.mark.parametrize("count", [1, 2, 8, 32, 128])
def test_the_grid_interpolates_polynomials(count: int) -> None:
    """Of degree `count` at most, given at the nodes, exactly; by values at the fine points and as Chebyshev series."""
    points = grid(count)
    fine = np.cos(np.pi * np.arange(4 * count, -1, -1) / (4 * count))
    for degree in {0, 1, count // 2, count}:
        series = np.eye(count + 1)[degree]
        values = chebyshev.chebval(points.nodes, series)
        rounding = 1e-15 + 1e-16 * degree**2  # of the places, times the slope there
        np.testing.assert_allclose(points.fine @ values, chebyshev.chebval(fine, series), rtol=0, atol=4 * rounding)
        np.testing.assert_allclose(points.coefficients @ values, series, rtol=0, atol=4 * rounding)


@pytest.mark.parametrize("kind", [float, complex, np.clongdouble])
@pytest.mark.parametrize("shape", [(), (3,), (3, 2), (0, 2)])
def test_complex_values_are_carried_as_real_and_imaginary_part_alone(kind: Any, shape: tuple[int, ...]) -> None:
    rng = np.random.default_rng(5)
    matrix, values = rng.normal(size=(7, 4)), rng.normal(size=(2, 4, *shape))
    carried = times(matrix, (values[0] + (1j * values[1] if kind is not float else 0)).astype(kind))
    assert carried.shape == (7, *shape)
    assert np.allclose(carried.real, np.einsum("fm,m...->f...", matrix, values[0]), rtol=0, atol=1e-14)
    if kind is not float:
        assert np.allclose(carried.imag, np.einsum("fm,m...->f...", matrix, values[1]), rtol=0, atol=1e-14)
