"""Steps that bring linear functions of a few coordinates within bounds, for many linkages.

A hinge is the squared violation of a bound; multipliers shift strict bounds until they hold
(augmented Lagrangian). As long as the set of violated bounds does not change, the sum of the hinges
is quadratic: a damped Newton step on this set finds the minimum, or a better set (semismooth
Newton). No programme is solved.

Source: J. Nocedal and S. J. Wright, Numerical Optimization, 2006, sec. 17.3 (bound-constrained and
augmented Lagrangian); the damping is ours.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..kinematics.types import Floats


class Damping(NamedTuple):
    """Damping as a function of the length of steps over their radius."""

    less: float = 0.2  #: smallest factor of the damping from step to step
    more: float = 30.0  #: largest factor
    tiny: float = 1e-13  #: least damping that rounding requires [largest entry of the matrix]
    least: float = 0.01  #: least damping


DAMPING = Damping()


@dataclass(frozen=True)
class Hinges:
    """Weighted linear functions of p coordinates with their bounds, for n linkages.

    There are k functions with strict bounds on both sides, l with the strict upper bound 0, and q
    that are reduced towards 0 as far as the others permit.

    Attributes
    ----------
    slope : ndarray, shape (n, k + l + q, p)
    value : ndarray, shape (n, k + l + q)
        Values of the functions at step 0.
    bound : ndarray, shape (n,)
        Bounds of the absolute values of the first k.
    sides : (int, int)
        k and l.
    """

    slope: Floats
    value: Floats
    bound: Floats
    sides: tuple[int, int]

    def open(self, step: Floats, multipliers: Floats) -> Floats:
        """Compute the violations of shifted bounds after steps; 0 where a bound holds."""
        two, one = self.sides
        reached = self.value + (self.slope @ step[..., None])[..., 0]
        reached[:, : two + one] += multipliers
        over = np.maximum(reached, 0.0)
        both, bound = reached[:, :two], self.bound[:, None]
        over[:, :two] = both - np.clip(both, -bound, bound)
        return np.asarray(over)


def bring_inside(
    hinges: Hinges,
    start: Floats,
    multipliers: Floats,
    damping: Floats,
    radius: Floats,
    plan: Sequence[int],
) -> tuple[Floats, Floats, Floats]:
    """Return steps (n, p) no longer than a radius in any coordinate.

    Parameters
    ----------
    start : ndarray, shape (n, p)
        Steps from which Newton's method starts.
    multipliers : ndarray, shape (n, k + l)
    damping, radius : ndarray, shape (n,)
        The damping grows where steps are longer than the radius, and falls where they are shorter.
    plan : sequence of int
        Numbers of Newton steps before each update of the multipliers, and after the last one.

    Returns
    -------
    step, multipliers, damping : ndarray
    """
    step, columns = start, np.ascontiguousarray(np.swapaxes(hinges.slope, 1, 2))
    strict, diagonal = sum(hinges.sides), np.arange(step.shape[1])
    for renewal, count in enumerate(plan):
        if renewal:
            multipliers = hinges.open(step, multipliers)[:, :strict]
        for _ in range(count):
            over = hinges.open(step, multipliers)
            square = columns @ (hinges.slope * (over != 0)[..., None])
            most = np.abs(square[:, diagonal, diagonal]).max(1)
            square[:, diagonal, diagonal] += (damping + DAMPING.tiny * most)[:, None]
            pull = (columns @ over[..., None])[..., 0] + damping[:, None] * step
            step = step - np.nan_to_num(np.linalg.solve(square, pull[..., None])[..., 0])
            far = np.abs(step).max(1) / radius
            damping = np.maximum(damping * np.clip(far, DAMPING.less, DAMPING.more), DAMPING.least)
    far = np.maximum(np.abs(step).max(1) / radius, 1.0)
    return step / far[:, None], multipliers, damping
