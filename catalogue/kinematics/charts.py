"""Coefficients of the charts of the motion: circle, line and turning points as forms in the parameter."""

from __future__ import annotations

import numpy as np

from .linkage import PR, RP
from .types import Array

#: Rows of `Motion.forms`, each a polynomial c0 + c1 t + c2 t^2: the line's offset H/t, the circle's constant g/t,
#: N = |B|^2, K = Im(conj(B) b), 2J = 2 Re(conj(b) B), then B itself.  Their common denominator is 1 + t^2.
H, G, N, K, J2, B_X, B_Y = range(7)


def coupler_chart(z: Array, w: Array) -> tuple[Array, ...]:
    """Circle of dyad 1 and line left by dyad 2, for y = d; then limits, scale of K and coefficient of the circle."""
    a, a2 = w[:, 0, 0] * w[:, 0, 1], w[:, 1, 0] * w[:, 1, 1]
    b, b2 = ((w[:, i, 0] * z[:, i, 1] - w[:, i, 1] * z[:, i, 0], w[:, i, 0] * z[:, i, 1]) for i in (0, 1))
    g, g2 = (_real(-2 * z[:, i, 0].conj() * z[:, i, 1]) for i in (0, 1))
    line = (a2 * b[0] - b2[0], a2 * b[1] - b2[1])
    h = 0.5 * (a2 * g - g2)
    full, square, mixed = _complex(line), _product(line, line), _product(b, line)
    long, long2 = np.abs(b[0]), np.abs(b2[0])
    sign = np.where(mixed.imag[0] > 0, -1, 1)
    limit = np.where(a2 == 1, square.real, np.where(a == 0, -sign * mixed.imag, h - mixed.real))
    low = np.where(a2 == 1, (long - long2) ** 2, np.where(a == 0, 0, -long))
    high = np.where(a2 == 1, (long + long2) ** 2, np.where(a == 0, np.inf, long))
    forms = (
        _over_t(h),
        _over_t(g),
        *map(_polynomial, (square.real, -mixed.imag, 2 * mixed.real, full.real, full.imag)),
    )
    return np.stack(forms), limit, low, high, long * long2, a


def crank_chart(z: Array, w: Array, kind: Array) -> tuple[Array, ...]:
    """Circle of the unit vectors 1 + x and line of dyad 2, for y = x; the origin is the crank's moving pivot."""
    lever = z[:, 0, 1] - z[:, 0, 0]
    a, am, w0, w1 = z[:, 1, 0], z[:, 1, 1], w[:, 1, 0], w[:, 1, 1]
    line = (-a * am.conj(), w0 * lever * am.conj())
    h = 0.5 * _real(2 * (w0 * am - w1 * a).conj() * lever)
    h[1] -= w0 * w1 * np.abs(lever) ** 2
    full, square = _complex(line), _product(line, line)
    reach, arm, offset = np.abs(am), np.abs(a - am), (a * am.conj()).real
    slider, slide = kind[:, 1] == PR, kind[:, 1] == RP
    limit = np.where(slider, h - full.real, square.real)
    low = np.where(slider, -reach, np.where(slide, offset**2, (reach * (reach - arm)) ** 2))
    high = np.where(slider, reach, np.where(slide, np.inf, (reach * (reach + arm)) ** 2))
    scale = np.where(slider | slide, np.abs(a) * reach, reach * arm)
    forms = (_over_t(h), 0 * h, *map(_polynomial, (square.real, -full.imag, 2 * full.real, full.real, full.imag)))
    return np.stack(forms), limit, low, high, scale, np.ones_like(w0)


def _real(c: Array) -> Array:
    """Coefficients of (1, Re xi, Im xi) in Re(c xi)."""
    return np.stack([np.zeros_like(c.real), c.real, -c.imag])


def _complex(p: tuple[Array, Array]) -> Array:
    """Coefficients of (1, Re xi, Im xi) in p0 + p1 xi."""
    return np.stack([p[0], p[1], 1j * p[1]])


def _product(p: tuple[Array, Array], q: tuple[Array, Array]) -> Array:
    """Coefficients of (1, Re xi, Im xi) in conj(p0 + p1 xi) (q0 + q1 xi), using |xi|^2 = -2 Re xi."""
    first, second = p[0].conj() * q[1], p[1].conj() * q[0]
    return np.stack([p[0].conj() * q[0], first + second - 2 * p[1].conj() * q[1], 1j * (first - second)])


def _polynomial(f: Array) -> Array:
    """Coefficients of (1, t, t^2) in (1 + t^2) f, where f is linear in xi."""
    return np.stack([f[0], 2 * f[2], f[0] - 2 * f[1]])


def _over_t(f: Array) -> Array:
    """Coefficients of (1, t, t^2) in (1 + t^2) f / t, where f is linear in xi and 0 at t = 0."""
    return np.stack([2 * f[2], -2 * f[1], np.zeros_like(f[0])])


def nearest(form: Array, low: Array, high: Array, side: int) -> Array:
    """Return the nearest t on the given side of 0 where the form reaches a limit; infinite if it never does."""
    best = np.full(form.shape[-1], np.inf, dtype=form.dtype)
    for level in (low, high):
        c = form[0] - level
        a, b = c - 2 * form[1], form[2]  # a t^2 + 2 b t + c = 0
        with np.errstate(all="ignore"):
            root = np.sqrt(b * b - a * c)
            q = -(b + np.where(b < 0, -root, root))
            for t in (side * q / a, side * c / q):
                best = np.where((t > 0) & (t < best), t, best)
    return np.asarray(side * best)
