"""Array types: what an array holds, said in signatures; numbers that somebody gives, as an array."""

from __future__ import annotations

from decimal import Decimal
from numbers import Real
from typing import Any

import numpy as np
import numpy.typing as npt

#: Of anything; the docstring says of what.
Array = npt.NDArray[Any]
Floats = npt.NDArray[np.float64]
#: Points and vectors of the plane, x + iy.
Complexes = npt.NDArray[np.complex128]
Mask = npt.NDArray[np.bool_]
#: Numbers of rows, as `numpy.flatnonzero` gives them.
Indices = npt.NDArray[np.intp]


def doubles(given: Any) -> Floats:
    """Return real numbers, or nested sequences of them, as an array of doubles; `ValueError` for anything else: texts,
    truth values, complex numbers, rows of unlike lengths."""
    try:
        found = np.asarray(given)
        real = found.dtype.kind in "iuf" or all(
            isinstance(x, Real | Decimal) and not isinstance(x, bool) for x in found.astype(object).flat
        )
        if real:
            return found.astype(float)
    except (TypeError, ValueError, OverflowError):
        pass
    raise ValueError("these are no real numbers in rows of one length")
