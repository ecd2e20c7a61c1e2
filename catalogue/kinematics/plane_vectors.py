"""Products of vectors in the plane, given as complex numbers, and places far apart."""

from __future__ import annotations

import numpy as np

from .types import Complexes, Floats, Indices


def dot(a: Complexes, b: Complexes) -> Floats:
    """Scalar product of plane vectors, as the real part of their complex product."""
    return np.asarray((np.conj(a) * b).real)


def cross(a: Complexes, b: Complexes) -> Floats:
    """Vector product of plane vectors."""
    return np.asarray((np.conj(a) * b).imag)


def extreme_pairs(places: Complexes, count: int) -> Indices:
    """Return the first and the last of m places along several directions.

    The widest of these pairs is nearly the diameter of the places.

    Parameters
    ----------
    places : complex ndarray, shape (m, n)
    count : int
        Number of directions, evenly over a half turn.

    Returns
    -------
    ndarray of int, shape (2, count, n)
        Their numbers.
    """
    along = [(places * np.exp(1j * np.pi * k / count)).real for k in range(count)]
    return np.array([[a.argmin(0) for a in along], [a.argmax(0) for a in along]])
