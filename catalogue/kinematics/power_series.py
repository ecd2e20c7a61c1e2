"""Truncated power series, many at once: arrays (order + 1, ...), coefficient of t^k in row k."""

from __future__ import annotations

import numpy as np

from .types import Array


def taylor_product(a: Array, b: Array) -> Array:
    """Return the product of two series of equal order."""
    out = a[0] * b
    for i in range(1, len(b)):
        out[i:] += a[i] * b[:-i]
    return np.asarray(out)


def taylor_quotient(a: Array, b: Array) -> Array:
    """Return the quotient of two series of equal order; the divisor has a constant term."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape), dtype=np.result_type(a, b))
    for i in range(len(b)):
        out[i] = (a[i] - sum(out[j] * b[i - j] for j in range(i))) / b[0]
    return out


def taylor_root(a: Array) -> Array:
    """Return the square root of a series with a positive constant term."""
    out = np.empty_like(a)
    out[0] = np.sqrt(a[0])
    for i in range(1, len(a)):
        out[i] = (a[i] - sum(out[j] * out[i - j] for j in range(1, i))) / (2 * out[0])
    return out
