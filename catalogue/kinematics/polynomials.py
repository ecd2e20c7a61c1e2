"""Polynomials of small degree, many at once."""

from __future__ import annotations

from functools import reduce

import numpy as np

from .types import Array, Floats


def product(*factors: Array) -> Array:
    """Multiply polynomials with coefficients in a common order, shapes (n, k)."""

    def times(a: Array, b: Array) -> Array:
        out = np.zeros((len(a), a.shape[1] + b.shape[1] - 1), dtype=np.result_type(a, b))
        for i in range(b.shape[1]):
            out[:, i : i + a.shape[1]] += a * b[:, i : i + 1]
        return out

    return reduce(times, factors)


def real_roots(coefficients: Floats) -> Floats:
    """Compute the real roots of polynomials by the eigenvalues of companion matrices.

    A root of multiplicity m is accurate to the m-th root of the rounding; a double root may be
    taken for a complex pair.

    Parameters
    ----------
    coefficients : ndarray, shape (n, d + 1)
        Coefficients in ascending order; the last one is not 0.

    Returns
    -------
    ndarray, shape (n, d)
        Roots; NaN where they are complex.
    """
    n, d = coefficients.shape[0], coefficients.shape[1] - 1
    with np.errstate(all="ignore"):
        monic = coefficients[:, :-1] / coefficients[:, -1:]
    there = np.asarray(np.isfinite(monic).all(1))
    companion = np.zeros((n, d, d))
    companion[:, np.arange(1, d), np.arange(d - 1)] = 1
    companion[:, :, -1] = np.where(there[:, None], -monic, 0)
    z = np.linalg.eigvals(companion)
    real = there[:, None] & (np.abs(z.imag) <= 1e-9 * np.abs(z))
    return np.where(real, z.real, np.nan)
