"""Solve thousands of small linear systems by Gaussian elimination, vectorised over the batch.

``np.linalg.solve`` (LAPACK) raises if one system of the batch is singular and does not return the
sign of the determinant; here only the solution of a singular system is infinite.  For a few regular
systems LAPACK is faster and is used.
"""

from __future__ import annotations

import contextlib

import numpy as np

from ...kinematics.types import Array

#: Number of systems up to which LAPACK is faster.
MAX_LAPACK = 24
#: Logarithm of a determinant, relative to the entries, below which LAPACK is not used.
MIN_LOG_DETERMINANT = -30.0


def solve(matrix: Array, right: Array) -> tuple[Array, Array]:
    """Solve by elimination with row pivoting.

    Parameters
    ----------
    matrix : ndarray, shape (m, m, n)
    right : ndarray, shape (m, k, n)

    Returns
    -------
    solution : ndarray, shape (m, k, n)
        Not finite where the matrix is singular to working precision.
    sign : ndarray, shape (n,)
        Sign of the determinant.
    """
    m, n = matrix.shape[0], matrix.shape[-1]
    if n <= MAX_LAPACK:
        each = np.ascontiguousarray(np.moveaxis(matrix, -1, 0))
        with np.errstate(all="ignore"), contextlib.suppress(np.linalg.LinAlgError):
            one, size = np.linalg.slogdet(each)
            if (size > m * np.log(np.abs(each).max((1, 2), initial=0)) + MIN_LOG_DETERMINANT).all():
                return np.moveaxis(np.linalg.solve(each, np.moveaxis(right, -1, 0)), 0, -1), one
    a = np.concatenate([matrix, right], axis=1)
    sign, every = np.ones(n), np.arange(n)
    with np.errstate(all="ignore"):
        for c in range(m):
            if c < m - 1:
                best = c + np.abs(a[c:, c]).argmax(0)
                top = a[best, c:, every].T
                a[best, c:, every] = a[c, c:].T
                a[c, c:] = top
                sign = np.where(best == c, sign, -sign)
            sign = sign * np.sign(a[c, c])
            a[c, c + 1 :] /= a[c, c]
            if c < m - 1:
                a[c + 1 :, c + 1 :] -= a[c + 1 :, c, None] * a[c, None, c + 1 :]
        x = a[:, m:]
        for c in range(m - 1, 0, -1):
            x[:c] -= a[:c, c, None] * x[c]
    return x, sign


def condition(matrix: Array, inverse: Array) -> Array:
    """Return the condition number in the Frobenius norm, 1 to m times that in the 2-norm."""
    with np.errstate(all="ignore"):
        return np.asarray(np.sqrt((matrix**2).sum((0, 1)) * (inverse**2).sum((0, 1))))
