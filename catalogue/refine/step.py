"""The step that makes the largest of many linearised errors least, for many problems at once."""

from __future__ import annotations

import numpy as np

from ..linkage import Array

#: Rounds of reweighting.  The largest error is within a few per cent of the least possible then, and the step is
#: measured on the finite motion in any case.
ROUNDS = 24
#: Damping of what is free besides the step, against singular equations.
LEAST = 1e-14


def minimax_step(error: Array, jacobian: Array, free: Array, damping: Array) -> tuple[Array, Array]:
    """Return steps s that make max |error + jacobian s + free c| + damping nearly least over s and c.

    Lawson's algorithm: least squares whose weights grow with the errors that are left.

    Parameters
    ----------
    error : ndarray, shape (m, n)
    jacobian : ndarray, shape (m, n, p)
    free : ndarray, shape (m, n, q)
        Columns of order 1 that may be added at no cost: how a nominal moves.
    damping : ndarray, shape (k,)
        Weights of |s|^2 beside the weighted mean square of the error: as many answers.

    Returns
    -------
    step : ndarray, shape (k, n, p)
    left : ndarray, shape (k, n)
        Largest error that is left, to first order.
    """
    m, n, p = jacobian.shape
    columns = np.moveaxis(np.concatenate([jacobian, free], axis=-1), 0, 1)  # (n, m, p + q)
    error = error.T
    ridge = np.full((len(damping), 1, columns.shape[-1]), LEAST)
    ridge[:, :, :p] = np.asarray(damping)[:, None, None]
    ridge = ridge[..., None] * np.eye(columns.shape[-1])
    good = np.isfinite(columns).all((1, 2)) & np.isfinite(error).all(1)
    columns, error = np.where(good[:, None, None], columns, 0), np.where(good[:, None], error, 0)
    weight = np.full((len(damping), n, m), 1 / m)
    for _ in range(ROUNDS):
        weighted = weight[..., None] * columns
        normal = np.swapaxes(weighted, -1, -2) @ columns + ridge
        solved = np.linalg.solve(normal, -(np.swapaxes(weighted, -1, -2) @ error[..., None]))[..., 0]
        left = error + (columns @ solved[..., None])[..., 0]
        weight = weight * np.abs(left)
        total = weight.sum(-1, keepdims=True)
        weight = np.where(total > 0, weight / np.where(total > 0, total, 1), 1 / m)
    return np.where(good[:, None], solved[..., :p], np.nan), np.where(good, np.abs(left).max(-1), np.nan)
