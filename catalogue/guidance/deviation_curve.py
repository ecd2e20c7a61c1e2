"""How far a path is off its best circle, point by point, as drawings and tables of motions show it."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.optimize import linprog

from ..kinematics.types import Array

#: Shifts of the centre at most, and the part of the deviation below which one is small enough to be the last.
ROUNDS, STILL = 6, 1e-3


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
        found = linprog(
            [0, 0, 1],
            A_ub=np.block([[sign * terms, -np.ones((len(z), 1))] for sign in (1, -1)]),
            b_ub=np.concatenate([known, -known]),
            bounds=[(None, None)] * 3,
        )
        by = deviation * np.asarray(found.x)
        if np.abs(by[:2]).max() <= STILL * by[2]:
            break
        y, x = y - by[0], x + by[1] / unit
    return np.asarray(far - terms @ by[:2])
