"""Pairs in the canonical frame: pole at the origin, rho0 = 1, inflection pole (0, 1).

A pair is a fixed and a moving point, homogeneous, shape (n, 2, 3).  Arguments are arrays of shape
(n,). Source: Allievi 1895, secs. 3, 11-18.
"""

from __future__ import annotations

import numpy as np

from ..kinematics.types import Floats, Mask


def point(x: object, y: object, w: object = 1.0) -> Floats:
    """Return homogeneous points (n, 3) from coordinates, which are broadcast."""
    return np.stack(np.broadcast_arrays(*(np.asarray(c, dtype=float) for c in (x, y, w))), axis=-1)


def pair(fixed: Floats, moving: Floats) -> Floats:
    """Return pairs from fixed and moving points (n, 3)."""
    return np.stack(np.broadcast_arrays(fixed, moving), axis=1)


def linkage_of(*pairs: Floats) -> Floats:
    """Return pivots (n, 2, 2, 3) from two pairs."""
    return np.stack(np.broadcast_arrays(*pairs), axis=1)


def half_turn(points: Floats) -> Floats:
    """Turn homogeneous points (..., 3) by half a turn about the origin."""
    return np.asarray(points * np.array([-1.0, -1.0, 1.0]))


def circle_pair(kappa: Floats, phi: Floats) -> Floats:
    """Return the pair on r = sin(phi)/kappa, r* = sin(phi)/(kappa + 1): eq. (12), s = 0."""
    x, y = np.sin(phi) * np.cos(phi), np.sin(phi) ** 2
    return pair(point(x / kappa, y / kappa), point(x / (kappa + 1), y / (kappa + 1)))


def normal_pair(q: Floats) -> Floats:
    """Return the pair of A = (0, 1/q) on the pole normal.

    A* = (0, 1/(q + 1)).  A slider for q = 0, a slide for q = -1.
    """
    return pair(point(0, 1, q), point(0, 1, q + 1))


def tangent_pair(a1: Floats) -> Floats:
    """Return the pair on the pole tangent, A = (1/a1, 0), A* the pole; a slider for a1 = 0."""
    return pair(point(1, 0, a1), point(0 * a1, 0))


def slider_pair(x: Floats, y: Floats) -> Floats:
    """Return a slider pair: the point of the inflection circle on the ray (x, y), and its line."""
    return pair(point(x, y, 0), point(x * y, y * y))


def slide_pair(x: Floats, y: Floats) -> Floats:
    """Return a slide pair: the point of the return circle on the ray (x, y), and its slot."""
    return pair(point(-x * y, -y * y), point(x, y, 0))


def ray_pair(kappa: Floats, s: Floats, t: Floats) -> Floats:
    """Return the pair of the cubics on the ray with tangent t (12).

    1/r = kappa/sin + s/cos, 1/r* = (kappa + 1)/sin + s/cos.
    """
    w, far = kappa + s * t, 1 + t * t
    return pair(point(t, t * t, w * far), point(t, t * t, (w + 1) * far))


def tangent_circle_pair(s: Floats, t: Floats) -> Floats:
    """Return the pair for kappa = 0 at the tangent t, A on r = cos/s: eq. (44)."""
    w, far = s * t, 1 + t * t
    return pair(point(1, t, s * far), point(t, t * t, (w + 1) * far))


def parallel_pair(y: Floats, k: Floats, k_star: Floats) -> Floats:
    """Return the pair at the height y of the parallel transformation, A = (-k/y, y): eqs. (57)."""
    return pair(point(-k / y, y), point(-k_star / y, y))


def roots(total: Floats, product: Floats) -> tuple[Floats, Floats]:
    """Return the roots of t^2 - total t + product = 0, the larger one first; NaN if imaginary.

    A discriminant within rounding of zero counts as zero.
    """
    square = total * total - 4 * product
    square = np.where(np.abs(square) < 1e-10 * (total * total + np.abs(product)), 0.0, square)
    with np.errstate(invalid="ignore", divide="ignore"):
        large = 0.5 * (total + np.copysign(np.sqrt(square), total))
        return large, np.where(large == 0, 0.0, product / large)


def alike(t: Floats, u: Floats | float) -> Mask:
    """Tell where two tangents are equal within rounding, for values within the domains."""
    return np.asarray(np.abs(t - u) < 1e-9 * (1 + np.abs(t)))


def without(pairs: Floats, taken: Mask) -> Floats:
    """Return pairs (n, 2, 3), NaN where `taken`: other elements include them."""
    return np.where(taken[:, None, None], np.nan, pairs)
