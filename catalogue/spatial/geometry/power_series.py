"""Truncated power series for numpy functions: a formula gives values or derivatives.

A formula written with ``np.sin``, ``np.sqrt``, ``+``, ``*`` ... takes arrays and `Taylor` alike.
The recurrences are the usual ones (Griewank and Walther, Evaluating Derivatives, ch. 13): each
coefficient costs a sum over the lower ones.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

from ...kinematics.power_series import taylor_product, taylor_quotient, taylor_root
from ...kinematics.types import Array


class Taylor(NDArrayOperatorsMixin):
    """A batch of series  sum_k c[k] t^k,  truncated after the last k.

    Parameters
    ----------
    c : ndarray, shape (order + 1, ...)
        Coefficients: derivatives divided by k!.
    """

    __slots__ = ("c",)

    def __init__(self, c: Array) -> None:
        self.c = c

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        rule = RULES.get(ufunc)
        return rule(*inputs) if rule and method == "__call__" and not options else NotImplemented


def _multiply(x: Any, y: Any) -> Taylor:
    if not isinstance(x, Taylor):
        return Taylor(x * y.c)
    if not isinstance(y, Taylor):
        return Taylor(x.c * y)
    return Taylor(taylor_product(x.c, y.c))


def _divide(x: Any, y: Any) -> Taylor:
    if not isinstance(y, Taylor):
        return Taylor(x.c / y)
    return Taylor(taylor_quotient(_coefficients_like(x, y), y.c))


def _coefficients_like(x: Any, y: Taylor) -> Array:
    """Return the coefficients of x, a constant or a series, with the shape of y."""
    if isinstance(x, Taylor):
        return x.c
    c = np.zeros((len(y.c), *np.broadcast_shapes(np.shape(x), y.c.shape[1:])))
    c[0] = x
    return c


def _add(x: Any, y: Any) -> Taylor:
    some = x if isinstance(x, Taylor) else y
    return Taylor(_coefficients_like(x, some) + _coefficients_like(y, some))


def _sqrt(x: Taylor) -> Taylor:
    with np.errstate(divide="ignore", invalid="ignore"):  # the derivative is infinite at 0
        return Taylor(taylor_root(x.c))


def _waves(sign: float, sine: Callable[[Array], Array], cosine: Callable[[Array], Array]) -> Callable[[Taylor], Any]:
    """Return the pair (s, c) of  s' = c x',  c' = sign s x'."""

    def pair(x: Taylor) -> tuple[Taylor, Taylor]:
        s, c = [sine(x.c[0])], [cosine(x.c[0])]
        for k in range(1, len(x.c)):
            s.append(sum((j / k) * x.c[j] * c[k - j] for j in range(1, k + 1)))
            c.append(sum((sign * j / k) * x.c[j] * s[k - j] for j in range(1, k + 1)))
        return Taylor(np.stack(s)), Taylor(np.stack(c))

    return pair


def _arctan2(y: Any, x: Any) -> Taylor:
    """(x dy - y dx) / (x^2 + y^2), integrated."""
    some = x if isinstance(x, Taylor) else y
    a, b = _coefficients_like(y, some), _coefficients_like(x, some)
    c = np.empty_like(b)
    c[0] = np.arctan2(a[0], b[0])
    if len(c) > 1:
        k = np.arange(1.0, len(c)).reshape(-1, *[1] * (c.ndim - 1))
        turning = taylor_product(b[:-1], k * a[1:]) - taylor_product(a[:-1], k * b[1:])
        c[1:] = taylor_quotient(turning, (taylor_product(a, a) + taylor_product(b, b))[:-1]) / k
    return Taylor(c)


_circular = _waves(-1, np.sin, np.cos)
_hyperbolic = _waves(1, np.sinh, np.cosh)

RULES: dict[Any, Callable[..., Taylor]] = {
    np.add: _add,
    np.subtract: lambda x, y: _add(x, -y),
    np.negative: lambda x: Taylor(-x.c),
    np.multiply: _multiply,
    np.true_divide: _divide,
    np.square: lambda x: _multiply(x, x),
    np.power: lambda x, n: x if n == 1 else _multiply(x, x ** (n - 1)),
    np.sqrt: _sqrt,
    np.sin: lambda x: _circular(x)[0],
    np.cos: lambda x: _circular(x)[1],
    np.arctan2: _arctan2,
    np.sinh: lambda x: _hyperbolic(x)[0],
    np.cosh: lambda x: _hyperbolic(x)[1],
}


def variable(value: Array, direction: Array, order: int = 1) -> Taylor:
    """Return the series  value + direction t."""
    value, direction = np.broadcast_arrays(value, direction)
    c = np.zeros((order + 1, *value.shape))
    c[0], c[1] = value, direction
    return Taylor(c)


def coefficients(x: Any, order: int, shape: tuple[int, ...]) -> Array:
    """Return the coefficients of a series, or of a constant, shape (order + 1, *shape)."""
    c = np.zeros((order + 1, *shape))
    if isinstance(x, Taylor):
        c[:] = x.c
    else:
        c[0] = x
    return c
