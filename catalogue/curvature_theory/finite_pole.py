"""The instant with a finite pole.

With the signed distances r, r* of the pivots from the pole along a unit ray e, and  g = r*/(r - r*)
(0 for a slider, -1 for a slide):

    diameter vector of the inflection circle   i (m2 e1 - m1 e2)/(e1 x e2),   m = r g
    h = (g2 - g1)/(rho0 e1 x e2),  s = h X1 X2,  kappa = g1/rho0 - h X2 Y1,  kappa* = kappa + 1/rho0

(X, Y) = components of e in the pole axes.  No reciprocal of a length is taken, so that a pivot at
the pole or at infinity is an ordinary value.

Digits lost in double precision by 60 random linkages:

========================================  ======  =====
linkages                                  median  worst
========================================  ======  =====
generic                                   0.1     2.6
s = 0, or kappa = s = 0, to 1e-4 ... -12  0.5     2
rays at an angle of 1e-2                  1.2     3.3
rays at an angle of 1e-4                  3.7     5.2
rays at an angle of 1e-6                  5.1     7.2
coincident principal pairs                half of all digits
========================================  ======  =====

All losses but the last are inherent in the rounding of the pivots.

Source: Allievi 1895, eqs. (3), (12), (15), (16), (22), rewritten without tangents and without
division by s.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..kinematics.linkage import PR, RP, Linkage
from ..kinematics.types import Complexes, Floats

#: Distance from the pole below which a pivot stands at it, over the length that amplifies rounding.
AT_POLE = 4 * np.finfo(float).eps
#: Rounding allowance of the discriminant of the principal pairs.
CLAMP = 100 * np.finfo(float).eps


class PoleRounding(NamedTuple):
    """Limits up to which numbers count as zero."""

    #: reciprocal of the distance beyond which a point is at infinity [1/rho0]
    infinite: float = 2e-15
    cancelled: float = 0.03  #: ratio of kappa + V to its largest term below which too many digits have cancelled
    #: Largest value, in its natural unit, that counts as zero where it would be a divisor.
    vanishing: float = 1e-11


POLE = PoleRounding()


def pole_of(linkage: Linkage) -> Complexes:
    """Compute the poles, complex (n,): intersections of the rays."""
    e, z, finite = linkage.rays, linkage.points, linkage.finite
    best = np.full(len(linkage), np.inf)
    b1, b2 = np.zeros_like(e[:, 0]), np.zeros_like(e[:, 0])
    for i in (0, 1):
        for j in (0, 1):  # draw each ray from its pivot nearest to the other ray: that keeps the most digits
            apart = np.where(finite[:, 0, i] & finite[:, 1, j], np.abs(z[:, 0, i] - z[:, 1, j]), np.inf)
            b1, b2 = np.where(apart < best, z[:, 0, i], b1), np.where(apart < best, z[:, 1, j], b2)
            best = np.minimum(best, apart)
    with np.errstate(all="ignore"):
        return np.asarray(b1 + e[:, 0] * (((b2 - b1).conj() * e[:, 1]).imag / linkage.sine))


def distances(linkage: Linkage, pole: Complexes) -> tuple[Floats, Floats, Floats]:
    """Compute r, r* (n, 2) along the rays, and g = r*/(r - r*)."""
    e, kind = linkage.rays[:, :, None], linkage.dyads
    z = linkage.points
    length = (e.conj() * (z[..., :1] - z[..., 1:])).real[..., 0]
    r = (e.conj() * (z - pole[:, None, None])).real
    r = np.where(np.abs(r) <= AT_POLE * np.maximum(np.abs(z), _lever(linkage, length)[:, None, None]), 0.0, r)
    with np.errstate(all="ignore"):
        g = np.where(kind == PR, 0.0, np.where(kind == RP, -1.0, r[..., 1] / length))
        # a pivot exactly at the pole: keep r - r* = length
        g = np.where((kind != PR) & (kind != RP) & (r[..., 0] == 0), -1.0, g)
    r = np.where(linkage.finite, r, np.inf)
    return r[..., 0], r[..., 1], g


def _lever(linkage: Linkage, length: Floats) -> Floats:
    """Compute the amplification of rounding of the pivots in the pole, shape (n,) [length].

    It is the least distance between pivots of both rays, times the error of the directions of short
    cranks, over the sine of the angle between the rays.
    """
    z, finite = linkage.points, linkage.finite
    apart = np.where(finite[:, 0, :, None] & finite[:, 1, None], np.abs(z[:, 0, :, None] - z[:, 1, None]), np.inf)
    with np.errstate(all="ignore"):
        short = np.where(finite.all(-1), np.abs(z).max(-1) / np.abs(length), 1.0).max(-1)
        return np.asarray(apart.min((1, 2)) * np.maximum(short, 1.0) / np.abs(linkage.sine))


def noise(linkage: Linkage) -> Floats:
    """Bound the relative error of kappa and s by rounding of the pivots, shape (n,)."""
    q, sine = pole_of(linkage), linkage.sine
    with np.errstate(all="ignore"):
        m = _moments(linkage, *distances(linkage, q))
        left = np.abs(m[:, 1] * linkage.rays[:, 0] - m[:, 0] * linkage.rays[:, 1]) / np.abs(m).sum(-1)
        return np.asarray(np.finfo(float).eps / (np.abs(sine) * left * left))


def _moments(linkage: Linkage, r: Floats, r_star: Floats, g: Floats) -> Floats:
    """Compute m = r r*/(r - r*): projections of the inflection diameter on the rays, (n, 2)."""
    m = np.where(linkage.dyads == PR, r_star, r * g)
    return np.where((r == 0) | (r_star == 0), 0.0, m)


def finite_pole(linkage: Linkage) -> dict[str, Floats]:
    """Compute the fields of `Curvature` for linkages whose rays meet in one point."""
    q, sine = pole_of(linkage), linkage.sine
    r, r_star, g = distances(linkage, q)
    with np.errstate(all="ignore"):
        m = _moments(linkage, r, r_star, g)
        diameter = 1j * (m[:, 1] * linkage.rays[:, 0] - m[:, 0] * linkage.rays[:, 1]) / sine
        rho0 = np.abs(diameter)
        y = diameter / rho0
        x = -1j * y
        cos, sin = (linkage.rays * x.conj()[:, None]).real, m / rho0[:, None]
        h = (g[:, 1] - g[:, 0]) / sine  # here and below: lengths in units of rho0
        cross = h[:, None] * cos[:, ::-1] * sin
        pair = np.argmin(np.abs(g), axis=1)[:, None]
        kappa = np.take_along_axis(g - cross, pair, 1)[:, 0]
        exact = (r_star == 0).any(1), (r == 0).any(1)
        kappa = np.where(exact[0], 0.0, np.where(exact[1], -1.0, kappa))
        star = np.where(exact[1], 0.0, np.take_along_axis(1 + g - cross, pair, 1)[:, 0])
        s = h * cos[:, 0] * cos[:, 1]
        a, a_star = rho0[:, None] / r, rho0[:, None] / r_star
        pairs = principal_pairs(kappa, star, s, h, cos, sin, a, a_star)
        undulation = _singular_point(s, -kappa, 1.0)
        cuspidation = _singular_point(s, -star, -1.0)
        # where the inflection circle is a point no unit of length remains: NaN
        axes = np.stack([np.stack([x.real, x.imag], -1), np.stack([y.real, y.imag], -1)], axis=1)
        pole = np.stack([q.real, q.imag], -1)
        place = np.where(pairs[..., 2:] != 0, pole[:, None, None], 0.0)
        scale = np.where(pairs[..., 2] != 0, rho0[:, None, None], 1.0)[..., None]
        xy = np.einsum("nijk,nkl->nijl", pairs[..., :2] * scale, axes) + place
        return {
            "pole": pole,
            "axes": axes,
            "rho0": rho0,
            "kappa": kappa / rho0,
            "kappa_star": star / rho0,
            "s": s / rho0,
            "undulation": pole + rho0[:, None] * np.einsum("nk,nkl->nl", undulation, axes),
            "cuspidation": pole + rho0[:, None] * np.einsum("nk,nkl->nl", cuspidation, axes),
            "principal_pairs": np.concatenate(
                [xy, np.where(np.isnan(pairs[..., 2:]), np.nan, pairs[..., 2:])], axis=-1
            ),
        }


def principal_pairs(
    kappa: Floats, star: Floats, s: Floats, h: Floats, cos: Floats, sin: Floats, a: Floats, a_star: Floats
) -> Floats:
    """Compute the two unknown principal pairs in the canonical frame with rho0 = 1.

    Parameters
    ----------
    kappa, star, s, h : ndarray, shape (n,)
        1/R, 1/R*, 1/S and 1/OQ times rho0.
    cos, sin : ndarray, shape (n, 2)
        Directions of the two known rays.
    a, a_star : ndarray, shape (n, 2)
        rho0/r and rho0/r* of the known pairs; infinite for a pivot at the pole.

    Returns
    -------
    ndarray, shape (n, 2, 2, 3)
        Pair, (fixed, moving), homogeneous.  NaN where they are imaginary, and for cyclic motions,
        which have no pairs of their own.

    Source: Allievi 1895, eq. (22), as V^2 - bV + g = 0 in V = s tan(phi), which stays regular in
    the modes I, II, III.
    """
    b = kappa + star - h * (cos[:, 0] * sin[:, 1] + cos[:, 1] * sin[:, 0])
    first = a[:, 0] - h * cos[:, 1], a_star[:, 1] - h * cos[:, 0]
    second = a[:, 1] - h * cos[:, 0], a_star[:, 0] - h * cos[:, 1]
    huge = [np.maximum(np.abs(u), np.abs(v)) for u, v in (first, second)]
    c = np.where(huge[0] <= huge[1], first[0] * first[1], second[0] * second[1])
    # divide the quartic by its two known roots; where it vanishes identically every point of the
    # cubic is guided exactly
    rest = np.abs(h * h * cos[:, 0] * cos[:, 1]), np.abs(h * b), np.abs(c)
    unit = np.maximum(1.0, h * h)
    cyclic = np.maximum(np.maximum(rest[0], rest[1]), rest[2]) <= POLE.vanishing * unit
    product = cos[:, 0] * cos[:, 1] * c
    square = b * b - 4 * product
    square = np.where((square < 0) & (square > -CLAMP * np.maximum(kappa**2, star**2)), 0.0, square)
    v1 = 0.5 * (b + np.copysign(np.sqrt(square), b))
    tiny = np.finfo(float).eps * 16 * np.maximum(np.abs(kappa), np.abs(star))
    # both pairs on the pole normal with V = 0: their directions would be quotients of rounding
    # errors
    none = np.abs(v1) <= tiny
    v1, v2 = np.where(none, 0.0, v1), np.where(none, 0.0, product / v1)
    in_pole = none & (np.abs(s) > tiny)  # with kappa = 0 or kappa* = 0: both on the pole tangent, U = U* = 0
    u, u_star = (np.where(in_pole, 0.0, w * s / v1) for w in (kappa, star))
    alpha = _pair(s, np.where(none & ~in_pole, 1.0, v1), v1, u, u_star, kappa, star, s)
    sines = h * v1 * sin[:, 0] * sin[:, 1]
    beta = _pair(h * v1, np.where(none & (np.abs(c) <= tiny), 1.0, c), v2, sines / star, sines / kappa, kappa, star, s)
    beta = np.where(in_pole[:, None, None], alpha, beta)
    return np.where(cyclic[:, None, None, None], np.nan, scaled(np.stack([alpha, beta], axis=1)))


def _pair(x: Floats, y: Floats, v: Floats, u: Floats, u_star: Floats, kappa: Floats, star: Floats, s: Floats) -> Floats:
    """Compute the pair (A, A*) on the ray (x, y).

    1/r = (kappa + V)/Y, or (s + U)/X where kappa + V has cancelled.
    """
    norm = np.copysign(np.hypot(x, y), y)
    x, y = x / norm, y / norm
    both = []
    for w, other in ((kappa + v, s + u), (star + v, s + u_star)):
        large = np.maximum(np.maximum(np.abs(kappa), np.abs(star)), np.abs(v))
        swap = (np.abs(x) > np.abs(y)) & (np.abs(w) < POLE.cancelled * large) & np.isfinite(other)
        both.append(
            np.stack([np.where(swap, x * x, x * y), np.where(swap, x * y, y * y), np.where(swap, other, w)], -1)
        )
    return np.stack(both, axis=1)


def scaled(pairs: Floats) -> Floats:
    """Scale homogeneous points to w = 1, or to a unit direction at infinity.

    A point beyond rho0/`POLE.infinite` counts as infinite.
    """
    w = pairs[..., 2]
    length = np.hypot(pairs[..., 0], pairs[..., 1])
    far = np.abs(w) <= POLE.infinite * length
    out = pairs / np.where(far, length, w)[..., None]
    out[..., 2] = np.where(np.isnan(w) | np.isnan(length), np.nan, np.where(far, 0.0, 1.0))
    return np.where(np.isnan(out).any(axis=(-1, -2), keepdims=True), np.nan, out)


def _singular_point(x: Floats, y: Floats, side: float) -> Floats:
    """Compute the undulation (side 1) or cuspidation point (side -1), rho0 = 1.

    It lies on the inflection or return circle, in the direction (x, y) from the pole.  NaN for y =
    0: then it is the pole, where the path has a cusp, or, with x = 0 too, the whole circle.
    """
    norm = np.hypot(x, y)
    sin, cos = y / norm, x / norm
    none = np.abs(y) < POLE.vanishing
    return np.where(none[:, None], np.nan, side * np.stack([sin * cos, sin * sin], axis=-1))
