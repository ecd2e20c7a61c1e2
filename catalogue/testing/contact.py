"""Order of contact of guided pairs, from the closed loop alone, in 100 digits.

A guided pair is a dyad that the linkage does not have.  Its *gap*, the violation of its constraint
by the finite motion, vanishes to the order of contact.  Newton's method closes the loop: it makes
the gaps of the two dyads of the linkage vanish.

Positions are parametrised by the distance s along the tangent of the motion in (d, angle), which is
regular unless the linkage is at a change point; there the branch is used that turns about the
origin, the pole of a canonical frame. The Taylor coefficients of a gap are computed from positions
at very small distances; the first one that does not vanish is that of s^(order + 1). For slots
(moving pivot at infinity) the gap is that of the inverse motion.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import mpmath as mp  # type: ignore[import-untyped]  # it ships no types
import numpy as np

from ..kinematics.types import Array, Floats

DIGITS = 100
#: Number of positions on each side of the reference position.
SIDE = 5
#: Distance of these positions: each further term of the series is smaller by 1e-8.
STEP = mp.mpf(10) ** -8
#: Value of s at which the terms of the Taylor series are compared [sizes of the linkage].
NEAR = 0.3
#: Ratio to the largest term below which a term counts as zero: the pivots have 16 digits.
ZERO = 1e-9
#: Largest gap of an exact guide.
EXACT_GAP = 1e-14


class Dyad:
    """The constraint of a pair: gap and gradient over a pose z -> d + exp(i angle) z."""

    def __init__(self, pair: Floats) -> None:
        (x, y, w), (x_star, y_star, w_star) = ([mp.mpf(v) for v in pivot] for pivot in pair)
        self.fixed, self.moving = mp.mpc(x, y) / (w or 1), mp.mpc(x_star, y_star) / (w_star or 1)
        self.slider, self.slide = not w, not w_star

    def gap(self, pose: Any) -> tuple[Any, list[Any]]:
        """Return the gap [length] and its derivatives by (Re d, Im d, angle)."""
        d, turn = mp.mpc(pose[0], pose[1]), mp.expj(pose[2])
        if self.slide:
            normal, arm = turn * self.moving, self.fixed - d
            value = (mp.conj(normal) * arm).real - (mp.conj(self.moving) * self.fixed).real
            return value, [-normal.real, -normal.imag, (mp.conj(1j * normal) * arm).real]
        spoke = turn * self.moving
        if self.slider:
            value, normal = (mp.conj(self.fixed) * (d + spoke - self.moving)).real, self.fixed
        else:
            length, normal = abs(self.moving - self.fixed), d + spoke - self.fixed
            value, normal = (abs(normal) ** 2 - length**2) / (2 * length), normal / length
        return value, [normal.real, normal.imag, (mp.conj(normal) * 1j * spoke).real]


def pose(dyads: list[Dyad], s: Any, start: Any = None) -> Any:
    """Find the pose at the distance s along the tangent of the motion.

    It is (Re d, Im d, angle); Newton's method begins at `start`.

    Raises
    ------
    ArithmeticError
        If the loop does not close there.
    """
    first, second = (dyad.gap([mp.mpf(0)] * 3)[1] for dyad in dyads)
    tangent = [first[i - 2] * second[i - 1] - first[i - 1] * second[i - 2] for i in range(3)]
    speed = mp.sqrt(sum(c * c for c in tangent))
    change = speed < mp.mpf(10) ** -12
    tangent = [mp.mpf(0), mp.mpf(0), mp.mpf(1)] if change else [c / speed for c in tangent]
    if change and not s:
        return [mp.mpf(0)] * 3
    now = start or [s * c for c in tangent]
    for _ in range(40):
        gaps = [dyad.gap(now) for dyad in dyads]
        along = sum(t * c for t, c in zip(tangent, now, strict=True)) - s
        step = mp.lu_solve(mp.matrix([g[1] for g in gaps] + [tangent]), mp.matrix([g[0] for g in gaps] + [along]))
        now = [c - step[i] for i, c in enumerate(now)]
        if mp.norm(step) < mp.mpf(10) ** (15 - DIGITS):
            return now
    raise ArithmeticError("the loop does not close")


def taylor(pivots: Floats, pairs: list[Array]) -> list[Array]:
    """Compute the Taylor coefficients of each pair's constraint gap, from s^0 to s^8."""
    with mp.workdps(DIGITS):
        dyads = [Dyad(dyad) for dyad in pivots]
        poses = [pose(dyads, j * STEP) for j in range(-SIDE, SIDE + 1)]
        out = []
        for given in pairs:
            guide = Dyad(given)
            c = _inverse_vandermonde() * mp.matrix([guide.gap(at)[0] for at in poses])
            out.append(np.array([float(c[k] / STEP**k) for k in range(2 * SIDE - 1)]))
        return out


def contact_order(coefficients: Floats) -> int | None:
    """Read the order of contact from Taylor coefficients; None if all of them vanish."""
    terms = np.abs(coefficients) * NEAR ** np.arange(len(coefficients))
    there = np.flatnonzero(terms > max(ZERO * terms.max(), 1e-15))
    return int(there[0]) - 1 if there.size else None


def largest_gap(pivots: Floats, pairs: list[Array]) -> list[float]:
    """Compute the largest gap of each pair over s from -0.3 to 0.3.

    Positions at which the loop does not close are left out.
    """
    with mp.workdps(DIGITS):
        dyads = [Dyad(dyad) for dyad in pivots]
        poses = []
        for side in (-1, 1):
            at = None
            for j in range(1, 7):
                try:
                    at = pose(dyads, mp.mpf(side * 0.3) * j / 6, at)
                except ArithmeticError:
                    break
                poses.append(at)
        return [float(max(abs(Dyad(given).gap(at)[0]) for at in poses)) for given in pairs]


@lru_cache
def _inverse_vandermonde() -> Any:
    nodes = range(-SIDE, SIDE + 1)
    return mp.matrix([[mp.mpf(j) ** k for k in range(2 * SIDE + 1)] for j in nodes]) ** -1
