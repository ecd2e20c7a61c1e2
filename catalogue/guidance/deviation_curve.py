"""How far a path is off its best circle, point by point, as drawings and tables of motions show it."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..kinematics.types import Array

#: Shifts of the centre at most, and the part of the deviation below which one is small enough to be the last.
ROUNDS, STILL = 6, 1e-3
#: Exchanges of a point at most; a path with a dozen waves takes five.
EXCHANGES = 60


def from_circle(z: Array, ends: tuple[Any, Any], radius: float, deviation: float) -> Array:
    """Return the signed distances of an arc's points (m,) from the best-placed circle of a radius; `ends` are those
    of the arc, and `deviation` about the largest distance.  Positive to the left of the way between the ends."""
    half = 0.5 * np.abs(ends[1] - ends[0])
    along = 0.5 * (ends[1] - ends[0]) / half
    w = (z - 0.5 * (ends[0] + ends[1])) * along.conj()
    side = -np.sign(w.imag[np.argmin(np.abs(w.real))])
    # the circle through the ends of the path, seen from the top of its arc; the distance as in `minimum_zone`, which
    # loses no digits on a flat arc
    x, y, c = w.real, w.imag + side * half**2 / (radius + np.sqrt(radius**2 - half**2)), side / radius
    for _ in range(ROUNDS):
        arm = np.hypot(c * x, 1 - c * y)
        far = (2 * y - c * (x * x + y * y)) / (1 + arm)
        # a small shift of the centre adds a cosine and a sine
        cosine, sine = (1 - c * y) / arm, c * x / arm
        unit = np.abs(sine).max()
        terms = np.stack([cosine, sine / unit], 1).astype(float)
        known = (far / deviation).astype(float)
        by = deviation * np.asarray(uniform_fit(terms, known))
        if np.abs(by[:2]).max() <= STILL * by[2]:
            break
        y, x = y - by[0], x + by[1] / unit
    return np.asarray(far - terms @ by[:2])


def uniform_fit(terms: Array, values: Array) -> Array:
    """Fit two terms to values so that the largest error is least, by Stiefel's exchange of single points.

    Unlike `minimum_zone.exchange` it needs no order of the points: a path may return over itself.

    Parameters
    ----------
    terms : ndarray, shape (m, 2)
    values : ndarray, shape (m,)

    Returns
    -------
    ndarray, shape (3,)
        Both coefficients and the largest error.
    """
    order = np.argsort(terms[:, 1])
    chosen = order[[0, len(order) // 2, -1]]  # apart: the errors of a best fit are equal at three points
    for _ in range(EXCHANGES):
        here = terms[chosen]
        weights = np.cross(here[:, 0], here[:, 1])  # no combination of the terms changes the sum of these times it
        total = np.abs(weights).sum()
        weights /= total if weights @ values[chosen] >= 0 else -total
        sign, level = np.where(weights < 0, -1.0, 1.0), weights @ values[chosen]
        system = np.column_stack([here, sign])
        fit = np.append(np.linalg.lstsq(system[:, :2], values[chosen] - level * sign)[0], level)
        errors = values - terms @ fit[:2]
        worst = int(np.abs(errors).argmax())
        if np.abs(errors[worst]) <= level * (1 + 1e-9) + 1e-14 * np.abs(values).max():
            break
        entering = np.append(np.sign(errors[worst]) * terms[worst], 1.0)
        shares = np.linalg.solve(np.vstack([(sign[:, None] * here).T, np.ones(3)]), entering)
        ratio = np.where(shares > 0, np.abs(weights) / np.where(shares > 0, shares, 1.0), np.inf)
        chosen[ratio.argmin()] = worst
    return np.append(fit[:2], np.abs(errors).max())
