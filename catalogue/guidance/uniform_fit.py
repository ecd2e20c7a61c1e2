"""Best uniform fits of two terms by Stiefel's exchange of single points, in any order.

`minimum_zone.exchange` alternates along a path, which is right as long as the terms are a Haar
system there. Sine and cosine are no Haar system beyond half a turn, and a path that returns over
itself has no order of points.

Source: Stiefel, Numerische Methoden der Tschebyscheff-Approximation, 1959; the exchange is a step
of the dual simplex method.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..kinematics.types import Floats, Indices


class UniformFit(NamedTuple):
    """Limits of the exchanges of a minimax fit."""

    exchanges: int = 60  #: largest number of exchanges of a point; a path with a dozen waves takes five
    #: Part of the largest error that the lower bound by three points may fall short of.
    reached: float = 1e-9
    rounded: float = 1e-14  #: error that counts as rounding [largest value]


UNIFORM_FIT = UniformFit()

#: Index of the next of three points, cyclically.
NEXT = np.array([1, 2, 0])
#: Index of the previous of three points, cyclically.
PREVIOUS = np.array([2, 0, 1])


def uniform_fit(terms: Floats, values: Floats, chosen: Indices | None = None) -> tuple[Floats, Floats, Indices]:
    """Fit two terms to values so that the largest error is least.

    Parameters
    ----------
    terms : ndarray, shape (2, m, n)
        Terms of n fits at m points.
    values : ndarray, shape (m, n)
    chosen : ndarray of int, shape (3, n), optional
        Approximate points of the largest errors.

    Returns
    -------
    ndarray, shape (2, n)
        The coefficients.
    ndarray, shape (n,)
        The largest errors.
    ndarray of int, shape (3, n)
        Points at which the errors have this size, which proves that it is minimal.
    """
    if chosen is None:
        order = np.argsort(terms[1], axis=0)
        chosen = order[[0, len(order) // 2, -1]]  # points far apart
    chosen = chosen.copy()
    fit, largest = np.zeros(terms.shape[::2]), np.zeros(values.shape[1])
    open_, rounding = np.arange(values.shape[1]), UNIFORM_FIT.rounded * np.abs(values).max(0, initial=0.0)
    for _ in range(UNIFORM_FIT.exchanges):
        at, column = chosen[:, open_], open_
        here, known = terms[:, at, column], values[at, column]  # (2, 3, k), (3, k)
        with np.errstate(all="ignore"):
            fit[:, open_], level, weights = _equalise(here, known)
            errors = values[:, open_] - (terms[:, :, open_] * fit[:, None, open_]).sum(0)
            worst = np.abs(errors).argmax(0)
            each = np.arange(len(open_))
            farthest = errors[worst, each]
            largest[open_] = np.abs(farthest)
            more = np.abs(farthest) > level * (1 + UNIFORM_FIT.reached) + rounding[open_]
            if not more.any():
                break
            leaving = _leaving_point(
                np.where(weights < 0, -1, 1) * here, np.abs(weights), np.sign(farthest) * terms[:, worst, open_]
            )
        some = open_[more]
        chosen[leaving[more], some] = worst[more]
        open_ = some
    return fit, largest, chosen


def _equalise(terms: Floats, values: Floats) -> tuple[Floats, Floats, Floats]:
    """Fit two terms (2, 3, n) to three values (3, n) with equal errors.

    Returns
    -------
    ndarray, shape (2, n)
        The coefficients.
    ndarray, shape (n,)
        The error.
    ndarray, shape (3, n)
        Weights that are orthogonal to both terms, and whose sum with the values is the error; their
        absolute values add up to 1.
    """
    weights = _cross(terms[:, NEXT], terms[:, PREVIOUS])
    weights = weights / (np.abs(weights).sum(0) * np.where((weights * values).sum(0) < 0, -1, 1))
    level = np.asarray((weights * values).sum(0))
    rest = values - level * np.where(weights < 0, -1.0, 1.0)
    return _interpolate(terms, rest, np.abs(weights).argmax(0)), level, weights


def _cross(a: Floats, b: Floats) -> Floats:
    """Return the cross products of pairs (2, ...)."""
    return np.asarray(a[0] * b[1] - a[1] * b[0])


def _interpolate(terms: Floats, values: Floats, without: Indices) -> Floats:
    """Interpolate values (3, k) by terms (2, 3, k) at two of three points."""
    column = np.arange(terms.shape[2])
    (a, b), (p, q) = ([part[..., (without + i) % 3, column] for i in (1, 2)] for part in (terms, values))
    return np.stack([p * b[1] - q * a[1], q * a[0] - p * b[0]]) / _cross(a, b)


def _leaving_point(terms: Floats, weights: Floats, entering: Floats) -> Indices:
    """Return which of three signed terms (2, 3, k) leaves for another, (2, k).

    It is the one whose weight vanishes first.
    """
    whole, moved = _cross(terms[:, NEXT], terms[:, PREVIOUS]), terms - entering[:, None]
    # shares of the three terms in the entering one, which add up to 1: areas of triangles
    parts = _cross(moved[:, NEXT], moved[:, PREVIOUS])
    shares = parts / whole.sum(0)
    ratio = np.where(shares > 0, weights / np.where(shares > 0, shares, 1.0), np.inf)
    return np.asarray(ratio.argmin(0))
