"""Statements of the book that are wrong, each with a counterexample (Allievi 1895)."""

from __future__ import annotations

import numpy as np
import pytest

from catalogue.curvature_theory.analysis import DEAD_POINT, PARALLEL, curvature
from catalogue.curvature_theory.configuration import configuration
from catalogue.curvature_theory.dead_points import dead_points
from catalogue.curvature_theory.leading_error import leading_error, path_singularity
from catalogue.guidance.coupler_curve import CouplerCurve, coupler_curve
from catalogue.kinematics.linkage import Linkage
from catalogue.kinematics.motion import conditioning
from catalogue.kinematics.types import Array
from catalogue.series.pairs import circle_pair, linkage_of, pair, parallel_pair, point, ray_pair


def four_bar(a: complex, a_star: complex, b: complex, b_star: complex) -> Linkage:
    return Linkage([[[z.real, z.imag, 1] for z in dyad] for dyad in ((a, a_star), (b, b_star))])


def test_section_4_poles_of_a_dead_point_need_not_be_real() -> None:
    """One link equals the sum of the other three: the stretched chain is immobile, and no pole is returned."""
    stretched = four_bar(0, 1, 3, 2)
    assert curvature(stretched).state[0] == DEAD_POINT
    assert np.isnan(dead_points(stretched).pole).all()
    assert "immobile" in curvature(stretched).reason[0]
    assert conditioning(stretched).max() == pytest.approx(0)
    # with the coupler turned, the moving pivots would have to be less than their distance apart from each other
    for turn in (1e-3, -0.1):
        first, second = np.exp(1j * np.linspace(-np.pi, np.pi, 721)), 3 + np.exp(1j * np.linspace(-np.pi, np.pi, 721))
        gap = second[None] - first[:, None]
        assert np.abs(gap).min() == pytest.approx(1)
        assert np.abs(gap - np.exp(1j * turn)).min() > 0.2 * abs(turn) ** 2
    mobile = four_bar(0, 1, 3, 4.2)
    assert np.isfinite(dead_points(mobile).pole).all()


def test_section_12_pseudo_undulation_and_pseudo_cuspidation_coexist() -> None:
    """Series I.GG with kappa = -1/2 and cot(phi1) cot(phi2) = 1."""
    phi = np.array([0.5])
    linkage = Linkage(linkage_of(circle_pair(np.array([-0.5]), phi), circle_pair(np.array([-0.5]), np.pi / 2 - phi)))
    printed = [[-0.8415, -0.4597], [0.8415, 0.4597], [-0.8415, -1.5403], [0.8415, 1.5403]]
    np.testing.assert_allclose(linkage.pivots[0, ..., :2].reshape(4, 2), printed, atol=1e-4)
    assert configuration(linkage, curvature(linkage))[0] == "XX"
    assert np.concatenate(path_singularity(linkage, np.array([1j]))).tolist() == [0, 3]
    assert np.concatenate(path_singularity(linkage.inverted(), np.array([-1j]))).tolist() == [0, 3]


def test_e1_watts_path_touches_the_line_where_the_book_puts_inflections() -> None:
    """Cranks sqrt(m^2 + n^2), fixed pivots as far apart as the coupler's ends: the path touches the line at +-n.

    Its inflections are at +-sqrt(3/5) n, for any distance of the cranks and not 4 n only."""
    m, n = 1.0, 0.3
    for distance in (4 * n, 1.7):
        fixed = m + 0.5j * distance
        crank, half = np.hypot(m, n), 0.5 * distance  # moving pivots B, -B with |B| = half, |A - B| = crank
        cosine = (abs(fixed) ** 2 + half**2 - crank**2) / (2 * abs(fixed) * half)
        moving = half * fixed / abs(fixed) * np.exp(1j * np.arccos(cosine))
        linkage = four_bar(fixed, moving, -fixed, -moving)
        here = coupler_curve(linkage, np.zeros(1, dtype=complex))
        u, v = _path(here, np.linspace(-1.1, 1.1, 4401) * n)
        z = (u + 1j * v) * here.tangent
        x, y = z.real * np.sign(z.imag[-1]), z.imag * np.sign(z.imag[-1])  # the guiding line is x = 0
        between = np.abs(x[np.abs(y) < n]).max()
        assert np.abs(np.interp([-n, n], y, x)).max() < 1e-4 * between
        assert np.abs(np.interp([-0.99 * n, 0.99 * n, -1.01 * n, 1.01 * n], y, x)).max() < 5e-3 * between
        beside = np.abs(np.interp([-1.1 * n, 1.1 * n], y, x))
        assert (beside > 0.1 * between).all()
        assert (np.sign(np.interp([0.9 * n, 1.1 * n], y, x)) == np.sign(np.interp(0.5 * n, y, x))).all()
        bend = np.gradient(np.gradient(v, u), u)[5:-5]
        at = u[5:-5][np.flatnonzero(np.sign(bend[1:]) != np.sign(bend[:-1]))]
        outer = np.abs(at[np.abs(at) > 0.1 * n])
        assert len(outer) == 2
        np.testing.assert_allclose(outer, np.sqrt(3 / 5) * n, rtol=0.03)


def _path(here: CouplerCurve, u: Array) -> tuple[Array, Array]:
    """Return the path at displacements u along its tangent."""
    where = here[np.zeros(len(u), dtype=int)]
    t, _ = where.window(u, u)
    along, across = where.path(t[None])
    return along[0], across[0]


def test_e2_guided_pairs_of_symmetric_parallel_cranks_do_not_coincide_with_the_pivots() -> None:
    """y1 + y2 = 0 with k k* < 0: they are imaginary, and the zero of c4 at the pivots is simple."""
    one, k, star = np.ones(1), np.array([0.6]), np.array([-0.9])
    linkage = Linkage(linkage_of(parallel_pair(one, k, star), parallel_pair(-one, k, star)))
    at = curvature(linkage)
    assert at.state[0] == PARALLEL
    assert np.isnan(at.principal_pairs).all()
    y = 1 + np.array([1e-3, 5e-4, -5e-4])
    c4 = leading_error(linkage[[0, 0, 0]], -star / y + 1j * y, circle=True).coefficient
    assert c4[0] / c4[1] == pytest.approx(2, rel=5e-3)  # a double zero would give 4
    assert c4[2] / c4[1] == pytest.approx(-1, rel=5e-3)


def test_e3_pseudo_cuspidation_does_not_need_r1_beyond_r3_beyond_half_rho0() -> None:
    """Series III.Kx with rho0 = 2, r1 = 1, r3 = 0.8 satisfies (49); only 1/r3^2 <= 1/r1^2 + 4/rho0^2 is needed."""
    rho0, r1, r3 = 2.0, 1.0, 0.8
    phi = np.pi / 4 + np.arccos(1.25 / np.sqrt(2))  # cos + sin = 1.25
    assert r3 / r1 * np.cos(phi) + 2 * r3 / rho0 * np.sin(phi) == pytest.approx(1)
    assert not r1 > r3 > rho0 / 2
    assert not r1 < r3 < rho0 / 2
    assert 1 / r3**2 <= 1 / r1**2 + 4 / rho0**2
    r3_star = 1 / (1 / r3 + 1 / (rho0 * np.sin(phi)))
    linkage = four_bar(complex(r1), 0j, r3 * np.exp(1j * phi), r3_star * np.exp(1j * phi))
    at = curvature(linkage)
    assert at.rho0[0] == pytest.approx(rho0)
    assert at.kappa[0] == pytest.approx(0, abs=1e-14)
    slot = at.cuspidation[:, 0] + 1j * at.cuspidation[:, 1]
    assert leading_error(linkage.inverted(), slot).order[0] == 4
    # neighbours of other r1 have no pseudo-cuspidation
    other = four_bar(complex(1.2 * r1), 0j, r3 * np.exp(1j * phi), r3_star * np.exp(1j * phi))
    slot = curvature(other).cuspidation[:, 0] + 1j * curvature(other).cuspidation[:, 1]
    assert leading_error(other.inverted(), slot).order[0] == 3


def test_e4_a_fixed_centre_at_the_pole_is_no_solution() -> None:
    """A at the pole, A1 and A2 on the circle of diameter A A*: the contact is 2, whatever rho0, and not 3."""
    big, rho0 = 1.3, np.array([0.5, 1.0, 2.4, 7.0])
    t = np.tan([0.5, 1.1])
    fixed = [big / (1 + v * v) * np.array([1.0, v]) for v in t]
    pairs = []
    for v, (x, y) in zip(t, fixed, strict=True):
        r, sine = np.hypot(x, y), v / np.hypot(1, v)
        share = 1 / (1 + r / (rho0 * sine))
        pairs.append(pair(point(x + 0 * rho0, y), point(x * share, y * share)))
    linkage = Linkage(linkage_of(*pairs))
    at = curvature(linkage)
    np.testing.assert_allclose(at.pole, 0, atol=1e-14)
    np.testing.assert_allclose(at.kappa, 0, atol=1e-14)
    np.testing.assert_allclose(at.s, 1 / big)
    found = leading_error(linkage, np.full(4, big + 0j), circle=True)
    assert set(found.order) == {2}
    np.testing.assert_allclose(np.abs(found.curvature), 1 / big)  # the circle is the right one
    on_cubic = ray_pair(np.zeros(4), rho0 / big, np.full(4, 0.7))[:, 1]  # for comparison, a point of the cubic
    z = np.divide(rho0 * (on_cubic[:, 0] + 1j * on_cubic[:, 1]), on_cubic[:, 2])
    assert set(leading_error(linkage, z, circle=True).order) == {3}
