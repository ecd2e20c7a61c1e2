"""Leading errors: golden coefficients, the closed formulas row by row, 100 digits, and the measured deviation."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from catalogue.curvature_theory.analysis import curvature
from catalogue.curvature_theory.leading_error import (
    CHEBYSHEV,
    CIRCLE,
    EXACT,
    LINE,
    leading_error,
    leading_error_of_pairs,
    path_singularity,
)
from catalogue.curvature_theory.leading_error import EXACT as EXACT_SERIES
from catalogue.curvature_theory.taylor import CHART_CHOICE
from catalogue.guidance.coupler_curve import coupler_curve
from catalogue.guidance.trace import extended, trace
from catalogue.kinematics.linkage import FAMILIES, PR, RP, Linkage
from catalogue.kinematics.types import Array, Complexes
from catalogue.plugin.registry import Registry
from catalogue.series.pairs import (
    circle_pair,
    linkage_of,
    normal_pair,
    pair,
    parallel_pair,
    point,
    ray_pair,
    slide_pair,
    slider_pair,
    tangent_circle_pair,
    tangent_pair,
)
from catalogue.testing.contact import taylor

Case = dict[str, Any]
Maker = Callable[..., Linkage]
GOLDEN = Path(__file__).parents[1] / "golden"
HERE = json.loads((GOLDEN / "leading_errors.json").read_text("utf-8"))
every_family = pytest.mark.parametrize("family", FAMILIES)
seeds = st.integers(0, 2**32 - 1)


def plane(points: Array) -> Array:
    """Return homogeneous points as complex numbers, directions as such."""
    with np.errstate(invalid="ignore"):
        return np.asarray((points[..., 0] + 1j * points[..., 1]) / np.where(points[..., 2] != 0, points[..., 2], 1))


# -- golden numbers ---------------------------------------------------------------------------------------------------
@pytest.fixture(scope="module")
def by_angle(golden: list[Case]) -> SimpleNamespace:
    """Return the guided pairs whose error is known as a power of the coupler's angle."""
    cases = {case["id"]: case for case in golden}
    rows = HERE["by_angle"]
    mine = [cases[row["id"]] for row in rows]
    pole = np.array([complex(*case["pole"]) for case in mine])
    linkage, pairs = Linkage([case["pivots"] for case in mine]), np.array([row["pair"] for row in rows], dtype=float)
    return SimpleNamespace(
        rows=rows,
        linkage=linkage,
        pairs=pairs,
        pole=pole,
        rho0=np.array([case["rho0"] for case in mine]),
        positions=np.array([EXACT + 1 if row["positions"] == "all" else row["positions"] for row in rows]),
        ray=np.array([complex(*row["ray"]) for row in rows]),
        found=leading_error_of_pairs(linkage, pairs, pole=pole),
    )


def test_orders_of_golden_pairs_are_found(by_angle: SimpleNamespace) -> None:
    assert len(by_angle.rows) == 338
    np.testing.assert_array_equal(by_angle.found.positions, by_angle.positions)
    slot = by_angle.pairs[:, 1, 2] == 0
    np.testing.assert_array_equal(by_angle.found.circle, ~slot & (by_angle.pairs[:, 0, 2] != 0))


def test_golden_coefficients_by_the_angle_are_met(by_angle: SimpleNamespace) -> None:
    """With the coupler's angle theta a point at r* moves by u = r* theta; from a cusp u = rho0 theta^2/2."""
    power, cusp, rho0 = by_angle.positions, by_angle.found.cusp, by_angle.rho0
    known = power <= EXACT
    want = np.array([row.get("c", 0.0) for row in by_angle.rows])
    slot = by_angle.pairs[:, 1, 2] == 0
    arm = np.where(slot, plane(by_angle.pairs[:, 0]), plane(by_angle.pairs[:, 1])) - by_angle.pole
    reach = np.where(cusp, np.sqrt(rho0 / 2), np.abs(arm)) ** np.where(known, power, 1)
    side = np.sign((by_angle.found.normal * by_angle.ray.conj()).real) * np.where(slot & (power % 2 == 1), -1, 1)
    got = side * by_angle.found.coefficient * reach / rho0
    assert known.sum() == 322
    assert cusp.sum() == 25
    # against the ray the sense of u is given by the angle, so the sign of an odd power is that of the ray
    np.testing.assert_allclose(got[known], want[known], rtol=1e-9, atol=1e-11)


def test_golden_straight_guides_are_met() -> None:
    cases = json.loads((GOLDEN / "straight_guides.json").read_text("utf-8"))
    guided = np.array([complex(*case["guided"]) for case in cases])
    found = leading_error(Linkage([case["pivots"] for case in cases]), guided)
    power = np.array([case["power"] for case in cases])
    np.testing.assert_array_equal(found.power, power)
    normal = np.array([-1j * complex(*case["direction"]) for case in cases])
    side = np.sign((found.normal * normal.conj()).real) ** (power + 1)
    np.testing.assert_allclose(side * found.coefficient, [case["c"] for case in cases], rtol=1e-10)
    laws = np.array([case["strokes"][0]["law"] for case in cases])
    np.testing.assert_allclose(found.law(np.array([case["strokes"][0]["stroke"] for case in cases])), laws, rtol=1e-10)


def test_golden_circular_and_return_guides_are_met() -> None:
    rows = HERE["by_length"]
    linkage, pairs = Linkage([row["pivots"] for row in rows]), np.array([row["pair"] for row in rows], dtype=float)
    found = leading_error_of_pairs(linkage, pairs)
    power = np.array([row["power"] for row in rows])
    np.testing.assert_array_equal(found.positions, power)
    at = plane(pairs)
    up = np.where(at[:, 1].imag < 0, -1, 1) * at[:, 1]
    along = np.array([row["along"] for row in rows])
    ray = np.select([along == "A to A*", along == "canonical"], [at[:, 1] - at[:, 0], up], 1)
    side = np.sign((found.normal * ray.conj()).real) ** (power + 1)
    sigma = np.where(found.cusp, (2 * curvature(linkage).rho0) ** (power / 2), 1)
    assert found.cusp.sum() == 4
    np.testing.assert_allclose(side * found.coefficient / sigma, [row["c"] for row in rows], rtol=1e-9)
    radius = np.abs(at[:, 1] - at[:, 0])
    np.testing.assert_allclose(np.abs(found.curvature * radius), 1, rtol=1e-9)


def test_golden_singularities_of_paths_are_met(by_angle: SimpleNamespace) -> None:
    rows = [i for i, row in enumerate(by_angle.rows) if "path" in row]
    want = [[EXACT if n == "all" else n for n in by_angle.rows[i]["path"]] for i in rows]
    z = plane(by_angle.pairs[rows, 1])
    p, q = path_singularity(by_angle.linkage[rows], z, pole=by_angle.pole[rows])
    assert len(rows) == 284
    np.testing.assert_array_equal(np.stack([p, q], axis=1), want)


# -- the closed formulas ----------------------------------------------------------------------------------------------
@every_family
def test_master_formulas_hold(family: str, random_linkages: Maker) -> None:
    """c3 on the inflection circle, c4 on the circling-point curve, c5 at the principal pairs, in the general mode."""
    linkage = random_linkages(family, 60, 11)
    k = curvature(linkage)
    cyclic = family in ("elliptic-trammel", "oldham")
    pole, x, y = plane_of(k.pole), plane_of(k.axes[:, 0]), plane_of(k.axes[:, 1])
    t_pivots = (linkage.rays / y[:, None]).real / (linkage.rays / x[:, None]).real

    def compare(phi: Array, r_star: Array, m: int, c: Array, circle: bool) -> None:
        ray = np.cos(phi) * x + np.sin(phi) * y
        real = np.isfinite(c * r_star) & (np.abs(np.cos(phi)) > 0.03) & (np.abs(r_star) > 0.03) & (np.abs(r_star) < 30)
        found = leading_error(linkage[real], (pole + r_star * ray)[real], circle=circle, order=m - 1)
        side = np.sign((found.normal * ray[real].conj()).real) ** (m + 1)
        assert real.sum() > 10
        error = np.abs(side * found.coefficient - c[real]) / (np.abs(c[real]) + 1 / np.abs(r_star[real]) ** (m - 1))
        assert np.quantile(error, 0.9) < 1e-9
        assert error.max() < 1e-6

    phi = np.random.default_rng(1).uniform(0.2, 2.9, len(linkage))
    c3 = (k.kappa * np.cos(phi) + k.s * np.sin(phi)) / (2 * k.rho0 * np.sin(phi) ** 3)
    compare(phi, k.rho0 * np.sin(phi), 3, c3, False)
    if cyclic:
        return
    pairs = k.principal_pairs
    t_pairs = np.stack([ratio(plane(pairs[:, i, 1]) - pole, y, x) for i in (0, 1)], axis=1)
    t1, t2, t3, t4 = (*t_pivots.T, *t_pairs.T)
    t = np.tan(phi)
    r_star = 1 / (k.kappa_star / np.sin(phi) + k.s / np.cos(phi))
    c4 = -(k.rho0**3) * np.sin(phi) * (t - t1) * (t - t2) * (t - t3) * (t - t4) * k.s**2 / (8 * t**2 * r_star**4)
    compare(phi, r_star, 4, c4, True)
    e1, e3 = t1 + t2 + t3 + t4, t1 * t2 * (t3 + t4) + t3 * t4 * (t1 + t2)
    phi = np.mod(np.arctan2(t3, 1), np.pi)
    r_star = 1 / (k.kappa_star / np.sin(phi) + k.s / np.cos(phi))
    c5 = k.rho0**4 * np.sin(phi) * (t3 - t1) * (t3 - t2) * (e3 - e1) * k.s**3 / (8 * t3 * r_star**5)
    compare(phi, r_star, 5, c5, True)


def plane_of(points: Array) -> Array:
    return np.asarray(points[..., 0] + 1j * points[..., 1])


def ratio(z: Array, y: Array, x: Array) -> Array:
    return np.asarray((z / y).real / (z / x).real)


Row = tuple[Array, Array, Array, int, Array, bool]
ROWS: dict[str, Callable[[np.random.Generator, int], Row]] = {}


def row(name: str) -> Callable[[Any], Any]:
    """Enter a formula: pivots with rho0 = 1 and the pole at the origin, guided point, ray, m, c_m, circle or line."""

    def enter(formula: Any) -> Any:
        ROWS[name] = formula
        return formula

    return enter


def up(n: int) -> Array:
    return np.full(n, 1j)


def on_normal(q: Array) -> Array:
    return 1j / (q + 1)


def on_circle(phi: Array) -> Array:
    return np.asarray(np.sin(phi) * np.exp(1j * phi))


def crank(draw: np.random.Generator, n: int) -> tuple[Array, Array]:
    """Return kappa and a direction, clear of other series."""
    kappa = np.where(draw.random(n) < 0.5, draw.uniform(0.2, 2, n), draw.uniform(-0.8, -0.6, n))
    return kappa, draw.uniform(0.3, 1.3, n)


def beside(draw: np.random.Generator, n: int) -> Array:
    """Return 1/r of a pair on the pole normal, clear of 0, 1/2, 1 and -1."""
    return np.where(draw.random(n) < 0.5, draw.uniform(0.15, 0.4, n), draw.uniform(1.2, 1.8, n))


@row("I.GG, inflection pole")
def i_gg(draw: np.random.Generator, n: int) -> Row:
    (a, phi1), phi2 = crank(draw, n), draw.uniform(1.8, 2.8, n)
    c = -(a / 8) * (2 * a + (a + 1) * (1 + 1 / (np.tan(phi1) * np.tan(phi2))))
    return linkage_of(circle_pair(a, phi1), circle_pair(a, phi2)), up(n), up(n), 4, c, False


@row("I.GG, inflection pole, (29)")
def i_gg_29(draw: np.random.Generator, n: int) -> Row:
    a, phi1 = crank(draw, n)
    phi2 = np.arctan2(1, -(1 + 2 * a / (a + 1)) * np.tan(phi1))
    c = -(a**2) * (a + 1) * (1 / np.tan(phi1) + 1 / np.tan(phi2)) / 8
    return linkage_of(circle_pair(a, phi1), circle_pair(a, phi2)), up(n), up(n), 5, c, False


@row("I.GG, inflection pole, (30)")
def i_gg_30(draw: np.random.Generator, n: int) -> Row:
    a = draw.uniform(0.2, 2, n)
    phi = np.arctan2(1, np.sqrt(1 + 2 * a / (a + 1)))
    c = a**2 * (2 * a + 1) ** 2 / 8
    return linkage_of(circle_pair(a, phi), circle_pair(a, np.pi - phi)), up(n), up(n), 6, c, False


@row("I.GG, [3]")
def i_gg_3(draw: np.random.Generator, n: int) -> Row:
    a, phi1, phi2 = draw.uniform(0.2, 2, n), draw.uniform(0.3, 1.3, n), draw.uniform(1.9, 2.8, n)
    cot = 1 / np.tan(phi1), 1 / np.tan(phi2)
    root = np.sqrt((2 * a + 1) ** 2 - 4 * a * (a + 1) * cot[0] * cot[1])
    i3 = a + 0.5 * (2 * a + 1 + root)
    c = a * (a + 1) * (cot[0] + cot[1]) * (i3 - a) * (i3 + 1) ** 5 / 8
    return linkage_of(circle_pair(a, phi1), circle_pair(a, phi2)), on_normal(i3), up(n), 5, c, True


@row("I.Gy, inflection pole")
def i_gy(draw: np.random.Generator, n: int) -> Row:
    (a, phi1), i3 = crank(draw, n), beside(draw, n)
    return linkage_of(circle_pair(a, phi1), normal_pair(i3)), up(n), up(n), 4, -i3 * (4 * a + 1 - i3) / 8, False


@row("I.Gy, inflection pole, (31)")
def i_gy_31(draw: np.random.Generator, n: int) -> Row:
    a, phi1 = crank(draw, n)
    l3, t1 = 3 * a + 1, np.tan(phi1)
    c = a * l3 * (a + l3) * (t1 - (a + 1) / (l3 * t1)) / 8
    return linkage_of(circle_pair(a, phi1), normal_pair(4 * a + 1)), up(n), up(n), 5, c, False


@row("I.Gy, [4]")
def i_gy_4(draw: np.random.Generator, n: int) -> Row:
    (a, phi1), i3 = crank(draw, n), beside(draw, n)
    l3, l4, t1 = i3 - a, 3 * a + 1 - i3, np.tan(phi1)
    t2 = a * (a + 1) / (l3 * l4 * t1)
    c = (l4 - l3) * (t1 + t2) * l3 * l4 * (l4 + a + 1) ** 5 / 8
    return linkage_of(circle_pair(a, phi1), normal_pair(i3)), on_normal(l4 + a), up(n), 5, c, True


@row("I.Gy, [2]")
def i_gy_2(draw: np.random.Generator, n: int) -> Row:
    (a, phi1), i3 = crank(draw, n), beside(draw, n)
    l3, l4, t1 = i3 - a, 3 * a + 1 - i3, np.tan(phi1)
    t2 = a * (a + 1) / (l3 * l4 * t1)
    phi2 = np.mod(np.arctan(t2), np.pi)
    r2 = np.sin(phi2) / (a + 1)
    c = -np.sin(phi2) * (t2 - t1) * (t1 + t2) * l3**2 * l4 / (8 * r2**5 * t2)
    ray = np.exp(1j * phi2)
    return linkage_of(circle_pair(a, phi1), normal_pair(i3)), r2 * ray, ray, 5, c, True


@row("I.yy, inflection pole")
def i_yy(draw: np.random.Generator, n: int) -> Row:
    i3, i4 = beside(draw, n), draw.uniform(-0.8, -0.2, n)
    return linkage_of(normal_pair(i3), normal_pair(i4)), up(n), up(n), 4, -i3 * i4 / 8, False


@row("II, circle of undulations")
def ii_circle(draw: np.random.Generator, n: int) -> Row:
    i3, a1, phi = beside(draw, n), draw.uniform(0.3, 2, n), draw.uniform(0.3, 2.8, n)
    phi2 = np.arctan2(1, i3 * (1 - i3) / a1)
    c = a1 * np.sin(phi2 - phi) / (8 * np.sin(phi) ** 4 * np.sin(phi2))
    return linkage_of(tangent_pair(a1), normal_pair(i3)), on_circle(phi), np.exp(1j * phi), 4, c, False


@row("II.xoy, circle of undulations")
def ii_xoy(draw: np.random.Generator, n: int) -> Row:
    i3, phi = beside(draw, n), draw.uniform(0.3, 2.8, n)
    c = -i3 * (1 - i3) / (8 * np.sin(phi) ** 3)
    return linkage_of(tangent_pair(0 * i3), normal_pair(i3)), on_circle(phi), np.exp(1j * phi), 4, c, False


@row("II.yy, circle of undulations")
def ii_yy(draw: np.random.Generator, n: int) -> Row:
    i3, phi = beside(draw, n), draw.uniform(0.3, 2.8, n)
    c = -i3 * (1 - i3) / (8 * np.sin(phi) ** 3)
    return linkage_of(normal_pair(i3), normal_pair(1 - i3)), on_circle(phi), np.exp(1j * phi), 4, c, False


@row("II.xy, pseudo-undulation (42)")
def ii_xy(draw: np.random.Generator, n: int) -> Row:
    i3, a1 = beside(draw, n), draw.uniform(0.3, 2, n)
    phi2 = np.arctan2(1, i3 * (1 - i3) / a1)
    c = -a1 * i3 / (8 * np.sin(phi2) ** 4)
    return linkage_of(tangent_pair(a1), normal_pair(i3)), on_circle(phi2), np.exp(1j * phi2), 5, c, False


@row("II.xy, [4]")
def ii_xy_4(draw: np.random.Generator, n: int) -> Row:
    i3, a1 = beside(draw, n), draw.uniform(0.3, 2, n)
    i4 = 1 - i3
    c = (i4 - i3) * (i4 + 1) ** 5 * a1 / 8
    return linkage_of(tangent_pair(a1), normal_pair(i3)), on_normal(i4), up(n), 5, c, True


@row("II.x0, [3]")
def ii_x0(draw: np.random.Generator, n: int) -> Row:
    i3, phi2 = beside(draw, n), draw.uniform(0.3, 1.3, n)
    a1, t2 = i3 * (1 - i3) * np.tan(phi2), np.tan(phi2)
    c = t2 * (i3 + 1) ** 5 * i3**2 * (1 - i3) / 8
    pivots = linkage_of(tangent_pair(a1), slider_pair(np.cos(phi2), np.sin(phi2)))
    return pivots, on_normal(i3), up(n), 5, c, True


def inverse_tangent_pair(j1: Array) -> Array:
    """Pair on the pole tangent with its fixed pivot at the pole: A* = (1/j1, 0)."""
    return pair(point(0 * j1, 0), point(1, 0, j1))


@row("II*.xy, inflection pole")
def iis_xy(draw: np.random.Generator, n: int) -> Row:
    j3, j1 = -beside(draw, n), draw.uniform(0.3, 2, n)
    c = -(j3 - 1) * (-1 - j3 - 1) / 8
    return linkage_of(inverse_tangent_pair(j1), normal_pair(j3 - 1)), up(n), up(n), 4, c, False


@row("II*.yy, inflection pole")
def iis_yy(draw: np.random.Generator, n: int) -> Row:
    j3 = -beside(draw, n)
    c = -(j3 - 1) * (-2 - j3) / 8
    return linkage_of(normal_pair(j3 - 1), normal_pair(-2 - j3)), up(n), up(n), 4, c, False


@row("II*.y0, inflection pole")
def iis_y0(draw: np.random.Generator, n: int) -> Row:
    j3, phi2 = -beside(draw, n), draw.uniform(0.3, 1.3, n)
    pivots = linkage_of(normal_pair(j3 - 1), slide_pair(np.cos(phi2), np.sin(phi2)))
    return pivots, up(n), up(n), 4, -(j3 - 1) * (-2 - j3) / 8, False


@row("II*.x0, inflection pole")
def iis_x0(draw: np.random.Generator, n: int) -> Row:
    phi2, j1 = draw.uniform(0.3, 1.3, n), draw.uniform(0.3, 1, n)
    pivots = linkage_of(inverse_tangent_pair(j1), slide_pair(np.cos(phi2), np.sin(phi2)))
    return pivots, up(n), up(n), 4, -(2 - j1 / np.tan(phi2)) / 8, False


@row("II*.x0, inflection pole, (41)*")
def iis_x0_41(draw: np.random.Generator, n: int) -> Row:
    phi2 = draw.uniform(0.3, 1.3, n)
    pivots = linkage_of(inverse_tangent_pair(2 * np.tan(phi2)), slide_pair(np.cos(phi2), np.sin(phi2)))
    return pivots, up(n), up(n), 5, -np.tan(phi2) / 4, False


@row("II*.xy, inflection pole, r3* = -rho0/2")
def iis_xy_3(draw: np.random.Generator, n: int) -> Row:
    j1 = draw.uniform(0.3, 2, n)
    return linkage_of(inverse_tangent_pair(j1), normal_pair(0 * j1 - 3)), up(n), up(n), 5, -3 * j1 / 8, False


@row("II*.y0, inflection pole, r3* = -rho0/2")
def iis_y0_3(draw: np.random.Generator, n: int) -> Row:
    phi2 = draw.uniform(0.3, 1.3, n)
    pivots = linkage_of(normal_pair(0 * phi2 - 3), slide_pair(np.cos(phi2), np.sin(phi2)))
    return pivots, up(n), up(n), 5, -3 * np.tan(phi2) / 4, False


@row("II*.xoy, inflection pole, r3* = -rho0/2")
def conchoid(draw: np.random.Generator, n: int) -> Row:  # noqa: ARG001, all makers are called alike
    zero = np.zeros(n)
    return linkage_of(inverse_tangent_pair(zero), normal_pair(zero - 3)), up(n), up(n), 6, zero + 3 / 8, False


def tangents(draw: np.random.Generator, n: int) -> tuple[Array, Array, Array]:
    """Return S and two tangents, of cranks on the circle of series III or III*."""
    return draw.uniform(0.5, 2, n), draw.uniform(-3, -0.4, n), draw.uniform(0.3, 0.45, n)


@row("III.KK, [3]")
def iii_kk(draw: np.random.Generator, n: int) -> Row:
    big, t2, t4 = tangents(draw, n)
    t3 = big - t2 - t4
    phi = np.arctan(t3) % np.pi
    r3 = 1 / (1 / (big * np.cos(phi)) + 1 / np.sin(phi))
    c = np.sin(phi) * (t3 - t2) * (t3 - t4) * (t2 * t3 * t4 - big) / (8 * big**3 * t3 * r3**5)
    pivots = linkage_of(tangent_circle_pair(1 / big, t2), tangent_circle_pair(1 / big, t4))
    return pivots, r3 * np.exp(1j * phi), np.exp(1j * phi), 5, c, True


def starred(big: Array, t: Array) -> Array:
    """Pair on the circle r* = S cos(phi) of series III*."""
    return ray_pair(np.full_like(t, -1.0), 1 / big, t)


@row("III*.KK, undulation")
def iiis_kk(draw: np.random.Generator, n: int) -> Row:
    big, t2, t4 = tangents(draw, n)
    t3, phi = -big - t2 - t4, np.arctan(big)
    c = -(big - t2) * (big - t3) * (big - t4) / (8 * big**3 * np.sin(phi) ** 3)
    return linkage_of(starred(big, t2), starred(big, t4)), on_circle(phi), np.exp(1j * phi), 4, c, False


@row("III*.KK, undulation, (47)*")
def iiis_kk_47(draw: np.random.Generator, n: int) -> Row:
    big, t2, _ = tangents(draw, n)
    t4, phi = -2 * big - t2, np.arctan(big)
    c = (big - t2) * (big - t4) * (1 + t2 * t4) / (8 * big**3 * np.sin(phi) ** 4)
    return linkage_of(starred(big, t2), starred(big, t4)), on_circle(phi), np.exp(1j * phi), 5, c, False


@row("III*.KK, undulation, (47)* and perpendicular cranks")
def iiis_kk_6(draw: np.random.Generator, n: int) -> Row:
    big = draw.uniform(0.8, 2, n)
    t2, t4, phi = -big + np.hypot(big, 1), -big - np.hypot(big, 1), np.arctan(big)
    c = (3 * big**2 - 1) * (1 + big**2) / (8 * big**4 * np.sin(phi) ** 5)
    return linkage_of(starred(big, t2), starred(big, t4)), on_circle(phi), np.exp(1j * phi), 6, c, False


@row("III*.Kx, undulation, (49)*")
def iiis_kx(draw: np.random.Generator, n: int) -> Row:
    big, _, t3 = tangents(draw, n)
    t4, phi, phi3 = -2 * big - t3, np.arctan(big), np.arctan(t3)
    j1 = (1 / (big * np.cos(phi3)) + 2 * np.sin(phi3)) / np.cos(phi3)
    c = (big - t3) * (1 + t3 * t4) * big / (8 * big**3 * np.sin(phi) ** 4)
    pivots = linkage_of(inverse_tangent_pair(j1), starred(big, t3))
    return pivots, on_circle(phi), np.exp(1j * phi), 5, c, False


def heights(draw: np.random.Generator, n: int) -> tuple[Array, Array, Array]:
    """Return k, k* and y2 of parallel cranks with y1 = 1 whose guided pairs are real."""
    return draw.uniform(0.3, 2, n), draw.uniform(-2, -0.3, n), draw.uniform(0.2, 0.8, n)


def at_height(y: Array, k_star: Array) -> Array:
    return np.asarray(-k_star / y + 1j * y)


def guided_height(k: Array, k_star: Array, y2: Array) -> Array:
    return 0.5 * (-(1 + y2) + np.sqrt((1 + y2) ** 2 - 4 * k * k_star / y2))


@row("parallel, stationary curvature")
def parallel(draw: np.random.Generator, n: int) -> Row:
    (k, star, y2), y = heights(draw, n), draw.uniform(1.2, 2, n)
    y3 = guided_height(k, star, y2)
    y4 = -(1 + y2) - y3
    c = -(y - 1) * (y - y2) * (y - y3) * (y - y4) / (8 * (star - k) ** 3 * y)
    pivots = linkage_of(parallel_pair(0 * y + 1, k, star), parallel_pair(y2, k, star))
    return pivots, at_height(y, star), np.ones(n), 4, c, True


@row("parallel, [3]")
def parallel_3(draw: np.random.Generator, n: int) -> Row:
    k, star, y2 = heights(draw, n)
    y3 = guided_height(k, star, y2)
    c = -(k + star) * (y3 - 1) * (y3 - y2) / (8 * (star - k) ** 4)
    pivots = linkage_of(parallel_pair(0 * y2 + 1, k, star), parallel_pair(y2, k, star))
    return pivots, at_height(y3, star), np.ones(n), 5, c, True


@row("IV.l, [3]")
def iv_l(draw: np.random.Generator, n: int) -> Row:
    _, star, y2 = heights(draw, n)
    y3 = -(1 + y2)
    c = -(y3 - 1) * (y3 - y2) / (8 * star**3)
    pivots = linkage_of(parallel_pair(0 * y2 + 1, 0 * star, star), parallel_pair(y2, 0 * star, star))
    return pivots, at_height(y3, star), np.ones(n), 5, c, True


@row("IV*.l, pole tangent")
def ivs(draw: np.random.Generator, n: int) -> Row:
    (k, _, y2), x = heights(draw, n), draw.uniform(-1, -0.2, n)
    x4 = y2 * (1 + y2) / k
    pivots = linkage_of(parallel_pair(0 * y2 + 1, k, 0 * k), parallel_pair(y2, k, 0 * k))
    return pivots, x + 0j, np.ones(n), 4, (x4 - x) / (8 * k**2), False


@row("IV*.l, pseudo-undulation")
def ivs_l(draw: np.random.Generator, n: int) -> Row:
    k, _, y2 = heights(draw, n)
    x4 = y2 * (1 + y2) / k
    pivots = linkage_of(parallel_pair(0 * y2 + 1, k, 0 * k), parallel_pair(y2, k, 0 * k))
    return pivots, x4 + 0j, np.ones(n), 5, -y2 / (8 * k**3), False


@row("IV*.x, pole tangent")
def ivs_x(draw: np.random.Generator, n: int) -> Row:
    (k, _, y3), x, x4 = heights(draw, n), draw.uniform(-1, -0.2, n), draw.uniform(0.3, 1, n)
    slider = pair(point(1 + 0 * x4, 0, 0), point(x4, 0))
    return linkage_of(parallel_pair(y3, k, 0 * k), slider), x + 0j, np.ones(n), 4, (x4 - x) / (8 * k**2), False


@pytest.mark.parametrize("name", ROWS)
def test_closed_formulas_hold(name: str) -> None:
    pivots, z, ray, m, c, circle = ROWS[name](np.random.default_rng(7), 40)
    found = leading_error(Linkage(pivots), z, circle=circle, pole=np.zeros(len(z), dtype=complex))
    np.testing.assert_array_equal(found.power, m)
    side = np.sign((found.normal * ray.conj()).real) ** (m + 1)
    np.testing.assert_allclose(side * found.coefficient, c, rtol=1e-9)


# -- digits -----------------------------------------------------------------------------------------------------------
def exact_coefficient(pivots: Array, z: complex, m: int, circle: bool) -> tuple[float, float]:
    """Return |c_m| in 100 digits and the size of the path's own terms of that order."""
    x, y = taylor(pivots, [np.array([[*d, 0], [z.real, z.imag, 1]]) for d in ((1, 0), (0, 1))])
    path = x + 1j * y
    path = path * np.exp(-1j * np.angle(path[1]))
    bend = 2 * path[2].imag / path[1].real ** 2 if circle else 0.0
    square = np.convolve(path.real, path.real) + np.convolve(path.imag, path.imag)
    gap = path.imag - 0.5 * bend * square[: len(path)]
    return abs(gap[m]) / path[1].real ** m, float(np.max(np.abs(path) / path[1].real ** np.arange(len(path))))


NEAR = [1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12]


@pytest.mark.slow
@pytest.mark.parametrize("what", ["s", "kappa", "kappa*", "parallel"])
def test_digits_are_kept_near_the_degenerations(what: str) -> None:
    """c4 of a point with stationary curvature, c3 of any point beside nearly parallel cranks."""
    for near in NEAR:
        a, s = (near if what == "kappa" else near - 1 if what == "kappa*" else 0.7), near if what == "s" else 0.8
        if what == "parallel":  # the pole at 1/near
            pivots = linkage_of(*(parallel_pair(np.array([y]), np.array([1.0]), np.array([-0.7])) for y in (1.0, 0.6)))
            pivots[:, 1, 1, 1] += near
            z = complex(at_height(np.array([1.5]), np.array([-0.7]))[0])
        else:
            kappa, slope = np.array([a]), np.array([s])
            pivots = linkage_of(*(ray_pair(kappa, slope, np.array([t])) for t in (0.5, -1.7)))
            z = complex(plane(ray_pair(kappa, slope, np.array([2.3]))[:, 1])[0])
        linkage = Linkage(pivots)
        m = 3 if what == "parallel" else 4
        found = leading_error(linkage, np.array([z]), circle=True, order=m - 1).coefficient[0]
        want, size = exact_coefficient(linkage.pivots[0], z, m, True)
        assert abs(abs(found) - want) < 1e-13 * (want + size), near


# -- what they are for ------------------------------------------------------------------------------------------------
STRAIGHT = [("I.GG", "undulation"), ("II.xy", "[2]"), ("IV*.l", "undulation"), ("IV*.l", "[4]"), ("I.GG", "[3]")]


@pytest.mark.parametrize(("code", "label"), STRAIGHT)
@pytest.mark.parametrize("split", [False, True])
def test_measured_deviation_tends_to_the_law(code: str, label: str, split: bool) -> None:
    """The excess over the law falls with the stroke.

    Three inflections are split with the stroke off the centre; `trace` keeps the guided point on a leash there, so that
    the law is only a bound below.
    """
    series = Registry().get(code)
    member = series.members[0]
    share = np.random.default_rng(5).random((400, len(member.parameters)))
    free = {p.name: p.spread(share[:, i]) for i, p in enumerate(member.parameters)}
    linkage = Linkage(member.synthesise(free))
    (guided,) = [g for g in series.guided(member.complete(free)) if g.label == label]
    pairs = guided.pairs
    z = plane(pairs[:, 1])
    here = coupler_curve(linkage, z)
    fair = np.flatnonzero((here.extent.min(0) > 0.5) & (linkage.size < 8) & np.isfinite(z))[:25]
    here, circle = extended(here[fair]), bool(pairs[fair[0], 0, 2] != 0)
    error = leading_error_of_pairs(linkage[fair], pairs[fair])
    assert (error.order == np.broadcast_to(guided.order, len(linkage))[fair]).all()
    held = split and error.order[0] == 4
    assert len(fair) >= 10
    off = []
    for half in (0.04, 0.01):
        halves: Array = np.full(len(fair), half, dtype=np.longdouble)
        found = trace(here, halves, circle=circle, split=split, centre=8**-0.5 if held and not circle else 0.0)
        law = error.law(2 * halves) if split else error.held(2 * halves)
        off.append((found.fit.deviation / law - 1).astype(float))
    if held:
        assert np.nanmin(off[1]) > -0.05
        assert np.nanmedian(off[1]) < 0.5
    else:
        assert np.nanmedian(np.abs(off[1])) < 0.03
        assert np.nanmedian(np.abs(off[1])) < 0.5 * np.nanmedian(np.abs(off[0]))


@pytest.mark.slow
@pytest.mark.parametrize("m", [3, 4, 5, 6])
def test_levels_are_those_of_chebyshev(m: int) -> None:
    """Smallest largest error of u^m beside lower powers, by linear programming's own dual: alternation."""
    x = np.cos(np.linspace(0, np.pi, 801))
    assert CHEBYSHEV[m] == 2.0 ** (1 - m)
    for table, lower in ((LINE, [0, 1]), (CIRCLE, [0, 1, 2])):
        value = table[m]
        basis = np.stack([x**k for k in lower], axis=1)
        weight = np.ones_like(x)
        for _ in range(400):  # Lawson's weights
            c, *_ = np.linalg.lstsq(basis * np.sqrt(weight)[:, None], x**m * np.sqrt(weight), rcond=None)
            off = np.abs(x**m - basis @ c)
            weight = weight * off
            weight /= weight.sum()
        assert off.max() == pytest.approx(value, rel=2e-2)
        assert np.sqrt((weight * off**2).sum()) <= value * (1 + 1e-6)


# -- properties -------------------------------------------------------------------------------------------------------
def test_generic_points_have_the_contact_of_their_nominal(random_linkages: Maker) -> None:
    linkage = random_linkages("slider-crank", 50, 3)
    z = np.random.default_rng(4).normal(size=(50, 2)) @ np.array([1, 1j])
    assert set(leading_error(linkage, z).order) == {1}
    assert set(leading_error(linkage, z, circle=True).order) == {2}
    p, q = path_singularity(linkage, z)
    assert not p.any()
    assert not q.any()


@every_family
def test_paths_are_singular_where_theory_says(family: str, random_linkages: Maker) -> None:
    """A cusp at the pole, an inflection on the inflection circle, an undulation at Ball's point."""
    linkage = random_linkages(family, 40, 9)
    k = curvature(linkage)
    pole, x, y = plane_of(k.pole), plane_of(k.axes[:, 0]), plane_of(k.axes[:, 1])
    cyclic, straight = family == "elliptic-trammel", family in ("slider-crank", "swinging-block")
    for z, want in (
        (pole, (1, EXACT) if cyclic else (1, 0)),
        (pole + k.rho0 * np.sin(0.7) * (np.cos(0.7) * x + np.sin(0.7) * y), (0, EXACT) if cyclic else (0, 1)),
        (plane_of(k.undulation), (0, EXACT) if straight else (0, 2)),  # of a slider its own pivot
    ):
        there = np.isfinite(z)
        p, q = path_singularity(linkage[there], z[there])
        assert set(zip(p.tolist(), q.tolist(), strict=True)) <= {want}


@pytest.mark.slow
@given(seed=seeds, log=st.floats(-3, 3), angle=st.floats(-3, 3), mirror=st.booleans())
def test_coefficients_follow_similarities(
    random_linkages: Maker, seed: int, log: float, angle: float, mirror: bool
) -> None:
    """c_m has the dimension of length^(1 - m); a mirror image keeps its size."""
    linkage = random_linkages("four-bar", 5, seed)
    z = plane_of(curvature(linkage).undulation)
    scale = 10**log * np.exp(1j * angle)
    moved = linkage.moved(scale, 3 - 2j, mirror)
    w = scale * (np.conj(z) if mirror else z) + 3 - 2j
    one, other = leading_error(linkage, z, order=3), leading_error(moved, w, order=3)
    np.testing.assert_allclose(np.abs(other.coefficient) * 10 ** (3 * log), np.abs(one.coefficient), rtol=1e-5)


def test_a_batch_is_its_linkages(random_linkages: Maker) -> None:
    linkage = random_linkages("inverted-slider-crank", CHART_CHOICE.block + 30, 2)
    z = np.random.default_rng(1).normal(size=(len(linkage), 2)) @ np.array([1, 1j])
    found = leading_error(linkage, z, circle=True)
    for i in (0, CHART_CHOICE.block - 1, CHART_CHOICE.block, CHART_CHOICE.block + 29):
        alone = leading_error(linkage[i], z[i : i + 1], circle=True)
        np.testing.assert_allclose(found[i : i + 1].coefficient, alone.coefficient, rtol=1e-12)


def test_without_a_branch_change_points_have_no_error() -> None:
    linkage = Linkage(linkage_of(normal_pair(np.array([0.4])), normal_pair(np.array([-0.6]))))
    for z in (1j, 0.3 + 0.2j):
        assert np.isnan(leading_error(linkage, np.array([z])).coefficient[0])
    p, q = path_singularity(linkage, np.array([1j]))
    assert (p[0], q[0]) == (-1, -1)


def test_imaginary_pairs_have_no_error(random_linkages: Maker) -> None:
    linkage = random_linkages("four-bar", 60, 5)
    pairs = curvature(linkage).principal_pairs[:, 0]
    found = leading_error_of_pairs(linkage, pairs)
    imaginary = np.isnan(pairs).any((1, 2))
    assert imaginary.any()
    np.testing.assert_array_equal(np.isnan(found.coefficient), imaginary)
    assert set(found.order[~imaginary]) == {4}


def test_exact_guides_have_no_error() -> None:
    linkage = Linkage([[[1, 0, 0], [0, 1, 1]], [[0, 1, 0], [2, 0, 1]]])  # trammel
    k = curvature(linkage)
    z = plane_of(k.pole) + k.rho0 * 0.5 * (plane_of(k.axes[:, 1]) + np.exp(0.4j))
    found = leading_error(linkage, z)
    assert found.order[0] == EXACT == EXACT_SERIES
    assert found.coefficient[0] == found.law(1.0)[0] == found.held(1.0)[0] == 0


def test_the_kinds_of_pivots_do_not_matter_to_the_inverse_motion(random_linkages: Maker) -> None:
    """A straight slot is a straight path of the inverse motion."""
    linkage = random_linkages("slider-crank", 20, 6)
    z = plane_of(curvature(linkage).cuspidation)
    pairs = np.zeros((20, 2, 3))
    pairs[:, 0] = np.stack([z.real, z.imag, np.ones(20)], axis=1)
    pairs[:, 1, 0] = 1
    slot = leading_error_of_pairs(linkage, pairs)
    path = leading_error(linkage.inverted(), z)
    np.testing.assert_allclose(slot.coefficient, path.coefficient)
    assert set(slot.order) == {3}
    assert {PR, RP} == {int(linkage.dyads.max()), int(linkage.inverted().dyads.max())}


@pytest.mark.slow
@pytest.mark.parametrize("unit", [2.0**-40, 2.0**40])
def test_leading_errors_do_not_depend_on_the_unit_of_length(
    random_linkages: Callable[..., Linkage], unit: float
) -> None:
    """Nor does the side to which they are counted, which the coupler's turn says unless it stands still."""
    for family in FAMILIES:
        linkage = random_linkages(family, 20, seed=6)
        pivots = linkage.pivots.copy()
        pivots[..., :2] *= np.where(pivots[..., 2:] == 0, 1.0, unit)
        z: Complexes = np.full(20, 0.3 + 0.4j)
        for circle in (False, True):
            one = leading_error(linkage, z, circle=circle)
            two = leading_error(Linkage.trusted(pivots), np.asarray(unit * z, complex), circle=circle)
            assert np.array_equal(one.positions, two.positions)
            assert np.abs(one.normal - two.normal).max() < 1e-12
            scaled = two.coefficient * unit ** (two.power - 1)
            assert np.allclose(scaled, one.coefficient, rtol=1e-9, atol=0)
