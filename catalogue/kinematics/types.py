"""Names of array types for signatures."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

#: An array of any type; the docstring states which.
Array = npt.NDArray[Any]
#: Real numbers. Some paths need extended precision, which this type does not show: a type for any
#: precision would be lost in arithmetic.
Floats = npt.NDArray[np.float64]
#: Points and vectors of the plane, x + iy; in extended precision if the real numbers are.
Complexes = npt.NDArray[np.complex128]
Mask = npt.NDArray[np.bool_]
#: Indices of rows, as `numpy.flatnonzero` returns them.
Indices = npt.NDArray[np.intp]
#: Other whole numbers: orders, kinds of dyads, charts, counts.
Integers = npt.NDArray[np.intp]
Texts = npt.NDArray[np.str_]
#: Real or complex; argument and result have the same type.
Scalar = TypeVar("Scalar", bound=np.inexact)
Objects = npt.NDArray[np.object_]


def read_only(given: npt.ArrayLike) -> Array:
    """Copy an array and make it read-only, to lend it to a plugin."""
    found = np.array(given)
    found.setflags(write=False)
    return found
