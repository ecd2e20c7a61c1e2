"""Deviations of a path from its best circle, point by point, for drawings and tables."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..kinematics.types import Complexes, Floats
from .uniform_fit import uniform_fit


class CentreShift(NamedTuple):
    """Iteration of the centre of an arc."""

    rounds: int = 6  #: largest number of shifts
    last: float = 1e-3  #: length of a shift at which the iteration stops [deviations]


CENTRE_SHIFT = CentreShift()


def from_circle(z: Complexes, ends: tuple[Any, Any], radius: float, deviation: float) -> Floats:
    """Return the signed distances of an arc's points (m,) from the best-placed circle of a radius.

    `ends` are those of the arc, `deviation` is approximately the largest distance. Distances are
    positive to the left of the direction from end to end.
    """
    half = 0.5 * np.abs(ends[1] - ends[0])
    along = 0.5 * (ends[1] - ends[0]) / half
    w = (z - 0.5 * (ends[0] + ends[1])) * along.conj()
    top = w.imag[np.argmin(np.abs(w.real))]
    side, depth = -np.sign(top), np.sqrt(np.maximum(radius**2 - half**2, 0.0))
    # the circle through the ends of the path, relative to the top of its arc; the distance as in
    # `minimum_zone`, which loses no digits on a flat arc
    rise = half**2 / (radius + depth) if np.abs(top) <= half else radius + depth
    x, y, c = w.real, w.imag + side * rise, side / radius
    for _ in range(CENTRE_SHIFT.rounds):
        arm = np.hypot(c * x, 1 - c * y)
        far = (2 * y - c * (x * x + y * y)) / (1 + arm)
        # a small shift of the centre changes distances by a cosine and a sine
        cosine, sine = (1 - c * y) / arm, c * x / arm
        unit = np.abs(sine).max()
        terms = np.stack([cosine, sine / unit]).astype(float)
        known = (far / deviation).astype(float)
        fit, largest, _ = uniform_fit(terms[..., None], known[:, None])
        by = deviation * fit[:, 0]
        if np.abs(fit).max() <= CENTRE_SHIFT.last * largest[0]:
            break
        y, x = y - by[0], x + by[1] / unit
    return np.asarray(far - by @ terms)
