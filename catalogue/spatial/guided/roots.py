"""Find all real roots of the functions of closed elimination, in batches.

The zeros of its derivative, from an eigenvalue problem or a formula, divide each function into
monotone pieces: a piece with a change of sign has one root, another none.  A stationary value of
rounding size is a double root.  No root is lost or invented, however close two are; a vanishing
leading coefficient (a root at infinity) only adds an unneeded division.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...kinematics.types import Array

EPS = float(np.finfo(float).eps)
#: Largest rounding error of a value [largest terms].
NOISE = 32 * EPS
#: Ratio to the largest coefficient below which the others leave a function constant.
CONSTANT_RATIO = 1e-13
#: A function and its slope.
Function = Callable[[Array], tuple[Array, Array]]


@dataclass(frozen=True)
class Roots:
    """Real roots of m functions.

    Attributes
    ----------
    at : ndarray, shape (k, m)
        Roots; NaN where a function has fewer.
    double : ndarray, shape (k, m)
        Whether the function touches zero without crossing it, to rounding.
    everywhere : ndarray, shape (m,)
        Whether the function vanishes everywhere and so has no single roots.
    """

    at: Array
    double: Array
    everywhere: Array

    @staticmethod
    def none(m: int) -> Roots:
        return Roots(np.zeros((0, m)), np.zeros((0, m), bool), np.zeros(m, bool))

    def put(self, index: Array, other: Roots) -> Roots:
        """Return a copy with the roots of some functions replaced."""
        k, m = max(len(self.at), len(other.at)), self.at.shape[1]
        at, double = np.full((k, m), np.nan), np.zeros((k, m), bool)
        at[: len(self.at)], double[: len(self.at)] = self.at, self.double
        at[:, index], double[:, index] = np.nan, False
        at[: len(other.at), index], double[: len(other.at), index] = other.at, other.double
        everywhere = self.everywhere.copy()
        everywhere[index] = other.everywhere
        return Roots(at, double, everywhere)


def between(f: Function, nodes: Array, noise: Array) -> Roots:
    """Return the roots of functions that are monotone between rising nodes (k, m).

    Values below `noise` (m,) count as zero.
    """
    value = f(nodes)[0]
    zero = np.abs(value) <= noise
    sign = np.where(zero, 0, np.sign(value))
    low, high = nodes[:-1].copy(), nodes[1:].copy()
    crossed = (sign[:-1] * sign[1:] < 0) & (low < high)
    rising = sign[1:] > 0
    x = (low + high) / 2
    for _ in range(80):  # Newton's method, safeguarded by bounds
        with np.errstate(all="ignore"):
            here, slope = f(x)
            up = (here > 0) == rising
            low, high = np.where(up, low, x), np.where(up, x, high)
            trial = x - here / slope
        trial = np.where((trial > low) & (trial < high), trial, (low + high) / 2)
        moved, x = np.abs(trial - x), trial
        if not (moved[crossed] > 4 * EPS * np.maximum(1, np.abs(x[crossed]))).any():
            break
    first = np.concatenate([np.ones((1, nodes.shape[1]), bool), nodes[1:] > nodes[:-1]])
    before = np.concatenate([sign[:1], sign[:-1]])
    after = np.concatenate([sign[1:], sign[-1:]])
    touched = zero & first
    at = np.concatenate([np.where(crossed, x, np.nan), np.where(touched, nodes, np.nan)])
    double = np.concatenate([np.zeros_like(crossed), touched & (before * after >= 0)])
    return Roots(at, double, np.asarray(zero.all(0)))


def trigonometric(c: Array, noise: Array) -> Roots:
    """Return the roots of a trigonometric polynomial in one turn.

    It is c0 + c1 cos x + c2 sin x + c3 cos 2x + c4 sin 2x, with coefficients (5, m).
    """

    def f(x: Array) -> tuple[Array, Array]:
        cos, sin = np.cos(x), np.sin(x)
        twice, double = cos * cos - sin * sin, 2 * sin * cos
        value = c[0] + c[1] * cos + c[2] * sin + c[3] * twice + c[4] * double
        return value, c[2] * cos - c[1] * sin + 2 * (c[4] * twice - c[3] * double)

    first, second = np.hypot(c[1], c[2]), np.hypot(c[3], c[4])
    plain = second <= CONSTANT_RATIO * first
    # the derivative times exp(2 i x), a polynomial in exp(i x)
    lead, next_ = np.where(plain, 1, c[4] + 1j * c[3]), (c[2] + 1j * c[1]) / 2
    zero = np.zeros_like(lead)
    lead = np.where(lead == 0, 1, lead)
    angles = np.sort(np.angle(_polynomial_roots([lead, next_, zero, np.conj(next_), np.conj(lead)])), axis=0)
    one = np.arctan2(c[2], c[1])
    other = one - np.copysign(np.pi, one)
    simple = np.sort(np.stack([one, one, other, other]), axis=0)
    angles = np.where(plain, simple, angles)
    found = between(f, np.concatenate([angles[-1:] - 2 * np.pi, angles, angles[:1] + 2 * np.pi]), noise)
    once = [1, 2, 3, 4, 6, 7, 8, 9]  # selection from five pieces and six nodes
    return Roots(found.at[once], found.double[once], found.everywhere)


def hyperbolic(square: Array, cross: Array, c: Array, half: Array, noise: Array) -> Roots:
    """Return the roots of a hyperbolic polynomial in [-half, half].

    It is c0 + c1 cosh x + c2 sinh x + cosh^2 x s0 + cosh x sinh x k + sinh^2 x s1: `square` is
    (s0, s1), (2, m), `cross` is k (m,), `c` (3, m).
    """

    def f(x: Array) -> tuple[Array, Array]:
        cosh, sinh = np.cosh(x), np.sinh(x)
        value = c[0] + cosh * (c[1] + square[0] * cosh + cross * sinh) + sinh * (c[2] + square[1] * sinh)
        slope = c[1] * sinh + c[2] * cosh + 2 * (square[0] + square[1]) * sinh * cosh + cross * (cosh**2 + sinh**2)
        return value, slope

    total = square[0] + square[1]
    z = _polynomial_roots([total + cross, c[1] + c[2], np.zeros_like(total), c[2] - c[1], cross - total])
    with np.errstate(divide="ignore"):
        cuts = np.clip(np.log(np.abs(z)), -half, half)
    return between(f, np.sort(np.concatenate([cuts, [-half], [half]]), axis=0), noise)


def helical(c: Array, low: Array, high: Array, noise: Array) -> Roots:
    """Return the roots in [low, high] of a wave on a parabola.

    It is c0 + c1 cos x + c2 sin x + c3 x + c4 x^2, with coefficients (5, m) and c4 > 0.
    """

    def order(k: int) -> Function:
        """Return the k-th derivative and the next."""

        def f(x: Array) -> tuple[Array, Array]:
            cos, sin = c[1] * np.cos(x) + c[2] * np.sin(x), c[2] * np.cos(x) - c[1] * np.sin(x)
            each = cos + c[0] + (c[3] + c[4] * x) * x, sin + c[3] + 2 * c[4] * x, 2 * c[4] - cos, -sin
            return each[k], each[k + 1]

        return f

    amplitude, phase = np.hypot(c[1], c[2]), np.arctan2(c[2], c[1])
    with np.errstate(all="ignore"):
        half = np.arccos(2 * c[4] / amplitude)
    turns = np.arange(np.ceil(np.nanmax(high - low, initial=0) / (2 * np.pi)) + 2)[:, None]
    begin = low - np.remainder(low - phase, 2 * np.pi)
    cuts = np.concatenate([begin + 2 * np.pi * turns + s * np.where(np.isfinite(half), half, 0) for s in (-1, 1)])
    for k in (1, 0):
        nodes = np.sort(np.clip(np.concatenate([cuts, [low], [high]]), low, high), axis=0)
        found = between(order(k), nodes, noise if k == 0 else np.zeros_like(noise))
        cuts = np.concatenate([np.where(np.isfinite(found.at), found.at, low), nodes])
    return found


def _polynomial_roots(coefficients: list[Array]) -> Array:
    """Return the roots (4, m) of quartics, highest power first; 1 without leading term."""
    c = np.stack(coefficients)
    bad = ~np.isfinite(c).all(0) | (c[0] == 0)
    c = np.where(bad, np.array([1, 0, 0, 0, -1])[:, None], c)
    companion = np.zeros((c.shape[1], 4, 4), c.dtype)
    companion[:, 0] = (-c[1:] / c[0]).T
    companion[:, 1:, :-1] = np.eye(3)
    return np.asarray(np.linalg.eigvals(companion).T)
