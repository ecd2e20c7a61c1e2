"""Intersections of curves with spheres and of circles with surfaces, for closed elimination.

Samples of its chart show whether a curve is a line, a circle, an ellipse, a helix or a hyperbola,
which have a formula, whatever the name of its kind.  Likewise for a surface: along every circle the
implicit function of a quadric or a torus is a trigonometric polynomial of degree 2.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...kinematics.types import Array
from .roots import NOISE, Roots, helical, hyperbolic, trigonometric

#: Largest error of an accepted formula [largest length or value].
FIT_TOLERANCE = 1e-11
#: Ratio to a radius below which a coefficient is rounding.
ROUNDING = 1e-14
#: Largest number of turns of a helix that are searched for roots.
MAX_TURNS = 64


def curve_and_sphere(
    curve: Callable[[float], Array], centre: Array, radius: Array, reach: Array
) -> tuple[Roots, Array]:
    """Return the parameters of intersections of curves with spheres, and a mask (m,).

    The mask is True where a closed formula applies.

    Parameters
    ----------
    curve : callable
        Function of a parameter that returns points (3, m).
    centre, radius : ndarray, shape (3, m), (m,)
    reach : ndarray, shape (m,)
        Largest length of the mechanism.
    """
    quarter, half, turn = (curve(k * np.pi) for k in (0.5, 1.0, 2.0))
    begin = curve(0.0)
    along = (turn - begin) / (2 * np.pi)
    middle, first = (begin + half - np.pi * along) / 2, (begin - half + np.pi * along) / 2
    second = quarter - middle - np.pi / 2 * along
    waves = np.ones(len(radius), bool)
    for s in (1.0, 4.0):
        waves &= _fits(curve(s), middle + np.cos(s) * first + np.sin(s) * second + s * along, reach)
    first, second, along = (np.where(_length(v) > ROUNDING * reach, v, 0) for v in (first, second, along))
    straight = waves & ~(first.any(0) | second.any(0))
    closed = waves & ~straight & ~along.any(0)
    even = np.abs(_dot(first, first) - _dot(second, second)) + np.abs(_dot(first, second))
    slant = np.abs(_dot(first, along)) + np.abs(_dot(second, along))
    wound = waves & ~straight & ~closed & (even + slant < FIT_TOLERANCE * reach**2)
    with np.errstate(all="ignore"):
        wound &= radius < np.pi * MAX_TURNS * _length(along)
    ahead, behind = curve(1.0), curve(-1.0)
    wide = ((ahead + behind) / 2 - begin) / (np.cosh(1) - 1)
    tall = (ahead - behind) / (2 * np.sinh(1))
    open_ = ~waves
    for s in (0.5, -1.5):
        open_ &= _fits(curve(s), begin + (np.cosh(s) - 1) * wide + np.sinh(s) * tall, reach)
    found = Roots.none(len(radius))
    v = middle - centre
    for some, solve in ((straight, _line), (closed, _ellipse), (wound, _helix)):
        i = np.flatnonzero(some)
        if len(i):
            found = found.put(i, solve(v[:, i], first[:, i], second[:, i], along[:, i], radius[i]))
    i = np.flatnonzero(open_)
    if len(i):
        found = found.put(i, _hyperbola((begin - wide - centre)[:, i], wide[:, i], tall[:, i], radius[i]))
    return found, straight | closed | wound | open_


def circle_and_surface(
    surface: Callable[[Array], Array], centre: Array, first: Array, second: Array, reach: Array
) -> tuple[Roots, Array]:
    """Return the angles of intersections of circles with surfaces, and a mask (m,).

    The mask is True where a closed formula applies.

    Parameters
    ----------
    surface : callable
        Implicit functions of the surfaces: from points (3, m) to values (m,).
    centre, first, second : ndarray, shape (3, m)
        A circle is centre + first cos + second sin.
    reach : ndarray, shape (m,)
    """

    def on(angle: float) -> Array:
        return surface(centre + np.cos(angle) * first + np.sin(angle) * second)

    angles = 2 * np.pi / 5 * np.arange(5)
    f = np.stack([on(a) for a in angles])
    waves = np.stack([np.ones(5), *(g(k * angles) for k in (1, 2) for g in (np.cos, np.sin))])
    c = np.array([1, 2, 2, 2, 2])[:, None] / 5 * (waves @ f)
    beside = [
        surface(centre),
        surface(centre + 2 * first),
        surface(centre + 2 * second),
    ]  # points off the surface, where f is not zero
    with np.errstate(all="ignore"):
        scale = np.abs([*f, *beside]).max(0) * (1 + reach / _length(first))
    fits = np.isfinite(scale)
    for a in (0.3, 2.0):
        wave = np.array([1.0, *(g(k * a) for k in (1, 2) for g in (np.cos, np.sin))])
        fits &= np.abs(on(a) - wave @ c) <= FIT_TOLERANCE * scale
    c[3:, np.hypot(c[3], c[4]) <= ROUNDING * scale] = 0
    found = Roots.none(len(scale))
    i = np.flatnonzero(fits)
    return (found.put(i, trigonometric(c[:, i], NOISE * scale[i])) if len(i) else found), fits


def _line(v: Array, first: Array, second: Array, along: Array, radius: Array) -> Roots:
    del first, second
    square = _dot(along, along)
    nearest = -_dot(v, along) / square
    foot = v + nearest * along
    apart = _length(foot)
    inside = (radius - apart) * (radius + apart) / square
    touch = np.abs(radius - apart) <= NOISE * (radius + _length(v))
    half = np.sqrt(np.where(inside > 0, inside, np.nan))
    at = np.where(touch, [nearest, np.full_like(nearest, np.nan)], [nearest - half, nearest + half])
    return Roots(at, np.stack([touch, touch]) & np.isfinite(at), np.zeros(len(radius), bool))


def _ellipse(v: Array, first: Array, second: Array, along: Array, radius: Array) -> Roots:
    del along
    a, b = _dot(first, first), _dot(second, second)
    c = np.stack(
        [
            (_length(v) - radius) * (_length(v) + radius) + (a + b) / 2,
            2 * _dot(v, first),
            2 * _dot(v, second),
            (a - b) / 2,
            _dot(first, second),
        ]
    )
    c[3:, np.hypot(c[3], c[4]) <= ROUNDING * (a + b)] = 0
    return trigonometric(c, NOISE * (_dot(v, v) + radius**2 + a + b))


def _helix(v: Array, first: Array, second: Array, along: Array, radius: Array) -> Roots:
    advance = _length(along)
    foot = -_dot(v, along) / advance**2
    square = _dot(v, v) + _dot(first, first)
    c = np.stack([square - radius**2, 2 * _dot(v, first), 2 * _dot(v, second), 2 * _dot(v, along), _dot(along, along)])
    return helical(c, foot - radius / advance, foot + radius / advance, NOISE * (square + radius**2))


def _hyperbola(v: Array, wide: Array, tall: Array, radius: Array) -> Roots:
    c = np.stack([_dot(v, v) - radius**2, 2 * _dot(v, wide), 2 * _dot(v, tall)])
    square = np.stack([_dot(wide, wide), _dot(tall, tall)])
    with np.errstate(divide="ignore"):
        half = np.arcsinh((_length(v) + radius) / _length(np.where(wide.any(0), tall, 0))) + 1
    noise = NOISE * (_dot(v, v) + radius**2 + square.sum(0))
    return hyperbolic(square, 2 * _dot(wide, tall), c, half, noise)


def _fits(one: Array, other: Array, reach: Array) -> Array:
    with np.errstate(invalid="ignore"):
        return np.asarray(_length(one - other) <= FIT_TOLERANCE * np.maximum(reach, _length(one)))


def _dot(a: Array, b: Array) -> Array:
    return np.asarray((a * b).sum(0))


def _length(a: Array) -> Array:
    return np.asarray(np.sqrt((a * a).sum(0)))
