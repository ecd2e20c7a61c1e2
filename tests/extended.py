"""The formulas of the series in 100 digits: the same code, given mpmath's numbers instead of numpy's.

A plugin computes with numpy's functions.  `Exchanged.many_digits` exchanges them, as long as it lasts, for functions
that work on arrays of mpmath's numbers, in the plugins, in `catalogue.series.pairs` and in `catalogue.series.series`.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import mpmath  # type: ignore[import-untyped]  # it ships no types
import numpy as np

from catalogue.plugin.registry import Registry
from catalogue.testing.contact import DIGITS

NUMBERS: Any = mpmath.MPContext()
NUMBERS.dps = DIGITS


def without_error(divide: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    """Return a division that gives NaN for x/0, as numpy's does (or an infinity)."""

    def division(a: Any, b: Any) -> Any:
        try:
            return divide(a, b)
        except ZeroDivisionError:
            return NUMBERS.nan

    return division


for name in ("__truediv__", "__rtruediv__"):
    setattr(NUMBERS.mpf, name, without_error(getattr(NUMBERS.mpf, name)))


def elementwise(function: Callable[..., Any], count: int = 1) -> Any:
    """Return a function of `count` numbers as one of arrays of them; NaN where it leaves the real numbers."""

    def one(*values: Any) -> Any:
        out = NUMBERS.nan if any(NUMBERS.isnan(v) for v in values) else function(*values)
        return NUMBERS.nan if isinstance(out, NUMBERS.mpc) else out

    return np.frompyfunc(one, count, 1)


class Digits:
    """What plugins use of numpy, in many digits; what is not here is numpy's own, which takes objects."""

    pi = +NUMBERS.pi
    sin, cos, tan = elementwise(NUMBERS.sin), elementwise(NUMBERS.cos), elementwise(NUMBERS.tan)
    arctan, arccos, sqrt = elementwise(NUMBERS.atan), elementwise(NUMBERS.acos), elementwise(NUMBERS.sqrt)
    arctan2, hypot = elementwise(NUMBERS.atan2, 2), elementwise(NUMBERS.hypot, 2)
    copysign = elementwise(lambda x, sign: -abs(x) if sign < 0 else abs(x), 2)

    def isnan(self, x: Any) -> Any:
        """Return where numbers are NaN."""
        return np.asarray(np.frompyfunc(NUMBERS.isnan, 1, 1)(x), dtype=bool)

    def isfinite(self, x: Any) -> Any:
        """Return where numbers are neither NaN nor infinite."""
        return np.asarray(np.frompyfunc(NUMBERS.isfinite, 1, 1)(x), dtype=bool)

    def asarray(self, values: Any, dtype: Any = None) -> Any:
        """Keep the digits of what is asked for as floats."""
        return np.asarray(values, dtype=object if dtype is float else dtype)

    def full_like(self, a: Any, value: Any) -> Any:
        """Return that value, as often as there are numbers in `a`."""
        return np.full(np.shape(a), NUMBERS.mpf(value), dtype=object)

    def __getattr__(self, name: str) -> Any:
        return getattr(np, name)


class Exchanged:
    """All series, with the means to have them compute with many digits."""

    def __init__(self) -> None:
        self.registry = Registry()
        plugins = [name for name in sys.modules if name.startswith("catalogue_plugin_")]  # just loaded
        modules = [sys.modules[name] for name in ("catalogue.series.pairs", "catalogue.series.series", *plugins)]
        self._modules = [module for module in modules if hasattr(module, "np")]

    @contextmanager
    def many_digits(self) -> Iterator[None]:
        """Compute with many digits."""
        for module in self._modules:
            vars(module)["np"] = Digits()
        try:
            yield
        finally:
            for module in self._modules:
                vars(module)["np"] = np
