"""Products of vectors in the plane, given as complex numbers."""

from __future__ import annotations

import numpy as np

from .types import Complexes, Floats


def dot(a: Complexes, b: Complexes) -> Floats:
    """Scalar product of plane vectors, as the real part of their complex product."""
    return np.asarray((np.conj(a) * b).real)


def cross(a: Complexes, b: Complexes) -> Floats:
    """Vector product of plane vectors."""
    return np.asarray((np.conj(a) * b).imag)
