"""Products and roots of polynomials, against roots that are given."""

from __future__ import annotations

import numpy as np
import pytest

from catalogue.kinematics.polynomials import product, real_roots
from catalogue.kinematics.types import Array


def of_roots(roots: Array) -> Array:
    """Return the coefficients, from the constant on, of polynomials with these roots, shape (n, d)."""
    return product(*(np.stack([-root, np.ones(len(root))], axis=-1) for root in roots.T))


@pytest.mark.parametrize("degree", [1, 2, 3, 4, 5, 7])
def test_roots_are_those_of_the_factors(degree: int) -> None:
    draw = np.random.default_rng(degree)
    roots = np.cumsum(draw.uniform(0.3, 1, (20, degree)), axis=1) - 2
    found = real_roots(draw.uniform(1, 3, (20, 1)) * of_roots(roots))
    np.testing.assert_allclose(np.sort(found, axis=1), roots, rtol=1e-6, atol=1e-8)


def test_complex_roots_are_none() -> None:
    """(t - 2)(t^2 + t + 1), and (t - 2)(t + 3)(t - 1) beside it."""
    found = np.sort(real_roots(np.array([[-2.0, -1, -1, 1], [6.0, -7, 0, 1]])), axis=1)
    wanted = np.array([[2, np.nan, np.nan], [-3, 1, 2]])
    np.testing.assert_allclose(found, wanted, rtol=1e-12)


def test_what_has_no_coefficients_has_no_roots_and_spoils_no_other() -> None:
    found = real_roots(np.array([[1.0, 1, 0], [np.nan, 0, 1], [-4.0, 0, 1]]))
    assert np.isnan(found[:2]).all()
    np.testing.assert_allclose(np.sort(found[2]), [-2, 2], rtol=1e-15)
