"""The curve of the deviation from a circle, beside a general solver of linear programmes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog

from catalogue.guidance.deviation_curve import from_circle
from catalogue.guidance.uniform_fit import uniform_fit
from catalogue.kinematics.types import Floats


def by_programme(terms: Floats, values: Floats) -> float:
    """Return the least largest error."""
    above = np.block([[sign * terms, -np.ones((len(values), 1))] for sign in (1, -1)])
    found = linprog([0, 0, 1], A_ub=above, b_ub=np.concatenate([values, -values]), bounds=[(None, None)] * 3)
    assert found.x is not None
    return float(found.x[2])


@pytest.mark.parametrize("returning", [False, True])
@pytest.mark.parametrize("noise", [0.0, 0.3])
def test_the_largest_error_is_that_of_the_linear_programme(returning: bool, noise: float) -> None:
    rng = np.random.default_rng(3)
    for waves in range(1, 13):
        angle = np.linspace(-1, 1, int(rng.integers(5, 300))) * rng.uniform(0.01, 3.0)
        angle = np.concatenate([angle, angle[::-1]]) if returning else angle
        terms = np.stack([np.cos(angle), np.sin(angle) / np.abs(np.sin(angle)).max()], 1)
        values = 3 * rng.normal() + np.cos(waves * angle + rng.uniform(0, 6)) + noise * rng.normal(size=len(angle))
        fit, errors, _ = uniform_fit(terms.T[..., None], values[:, None])
        c, error = fit[:, 0], errors[0]
        assert error == pytest.approx(by_programme(terms, values), rel=1e-9)
        assert error == pytest.approx(np.abs(values - terms @ c).max(), rel=1e-12)


def test_distances_from_a_circle_are_those_of_the_nearest_one() -> None:
    """A circle moved by hand: what is left is the wave alone, as no circle of that radius takes any of it away."""
    angle = np.pi / 2 + np.linspace(-1, 1, 201)
    wave = 1e-3 * np.cos(9 * np.pi * np.linspace(-1, 1, 201) / 2 * 1.0)
    z = (5.0 + wave) * np.exp(1j * angle) + 0.7 - 4.2j
    error = from_circle(z[::-1], (z[-1], z[0]), 5.0, 1e-3)
    assert np.abs(error).max() == pytest.approx(1e-3, rel=0.02)
    assert error.max() == pytest.approx(-error.min(), rel=1e-6)
