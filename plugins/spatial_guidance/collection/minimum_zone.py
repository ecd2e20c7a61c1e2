"""Minimum zones in space: the line or circle with the least maximum distance from a path.

The deviation from a line is the radius of the narrowest round cylinder that contains the path, from
a circle that of the narrowest torus about it.

In the frame of a line or circle nearby a distance is, to first order, the modulus of two
components, each less a combination of known functions: 1 and the abscissa for both components of
the distance from a line; 1, cos and sin of the angle about the axis for the radial and the axial
component of that from a circle.  Lawson's iteration (weights grow with the distance) finds the best
combinations for both components together, in Chebyshev steps; then the frame is updated.  The
weighted mean square never exceeds the least maximum (duality) and bounds the error of the result.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from catalogue.plugin import Array


class Lawson(NamedTuple):
    """Limits of Lawson's iteration."""

    tight: float = 1e-3  #: relative gap between largest modulus and lower bound in the last frame
    loose: float = 0.01  #: relative gap in the frames before the last one
    steps: int = 400  #: largest number of steps
    #: Powers of the distance by which weights grow, in turn: the inverses are the Chebyshev points
    #: of 0.05 ... 1.1, so that slow parts of the error fall too (D. M. Young, J. Math. Phys. 32
    #: (1953) 243-255).  With the power 1 alone it takes four times as many steps.
    powers: tuple[float, ...] = (0.924, 2.277, 1.057, 4.908, 1.407, 14.73)
    least: float = 1e-15  #: least weight [sum of the weights]
    line_frames: int = 3  #: number of frames fitted in turn to find a line
    circle_frames: int = 4  #: number of frames fitted in turn to find a circle


LAWSON = Lawson()


@dataclass(frozen=True)
class Fit:
    """Best lines or circles of n paths.

    Attributes
    ----------
    deviation : ndarray, shape (n,)
        Largest distance of the path from its line or circle.
    bound : ndarray, shape (n,)
        Lower bound, to first order, of the largest distance from any line or circle nearby.
    stroke : ndarray, shape (n,)
        Distance of the ends, along the line or as a chord.
    radius : ndarray, shape (n,)
        Radius; infinite for a line.
    start : ndarray, shape (n, 3)
        Start of the stroke: the foot of the first point on the line; for a circle that point
        itself.
    axes : ndarray, shape (n, 3, 3)
        Rows: the direction of the stroke; the direction in which an arc bulges; the third axis.
    centre, normal : ndarray, shape (n, 3)
        Centre of the circle and normal of its plane; NaN for a line.
    """

    deviation: Array
    bound: Array
    stroke: Array
    radius: Array
    start: Array
    axes: Array
    centre: Array
    normal: Array


def line(x: Array, side: Array | None = None) -> Fit:
    """Find the narrowest cylinders about paths x (n, k, 3).

    `side` (n, 3) directs the second axis.
    """
    origin, along = x.mean(1), unit(x[:, -1] - x[:, 0])
    for last in [False] * (LAWSON.line_frames - 1) + [True]:
        axes = frame(along, across(along) if side is None else side - origin)
        s, *distance = np.moveaxis((x - origin[:, None]) @ np.swapaxes(axes, 1, 2), 2, 0)
        half = np.abs(s).max(1)
        basis = np.stack([np.ones_like(s), s / half[:, None]], axis=1)
        c, bound = lawson(
            np.stack(distance, axis=1), np.stack([basis, basis], axis=1), LAWSON.tight if last else LAWSON.loose
        )
        move = c[:, :, 0, None] * axes[:, 1:]
        tilt = (c[:, :, 1] / half[:, None])[:, :, None] * axes[:, 1:]
        origin, along = origin + move.sum(1), unit(along + tilt.sum(1))
    axes = frame(along, across(along) if side is None else side - origin)
    s, y, z = np.moveaxis((x - origin[:, None]) @ np.swapaxes(axes, 1, 2), 2, 0)
    start = origin + s[:, :1] * along
    none = np.full((len(x), 3), np.nan)
    return Fit(np.hypot(y, z).max(1), bound, s[:, -1] - s[:, 0], np.full(len(x), np.inf), start, axes, none, none)


def circle(x: Array, radius: Array | None = None) -> Fit:
    """Find the narrowest tori about paths x (n, k, 3), of given radii (n,) if any.

    NaN where ends and middle of a path are on a line.
    """
    first, middle, last = x[:, 0], x[:, x.shape[1] // 2], x[:, -1]
    with np.errstate(all="ignore"):
        centre, normal, r = through(first, middle, last)
        if radius is not None:
            centre = centre + (1 - radius / r)[:, None] * (middle - centre)
            r = radius
        bound = np.full(len(x), np.nan)
        for final in [False] * (LAWSON.circle_frames - 1) + [True]:
            rho, h, cos, sin, axes = _cylindrical_coordinates(x, centre, normal, middle)
            ones, wide = np.ones_like(cos), np.maximum(np.abs(sin).max(1), 1e-12)[:, None]
            high = np.maximum((1 - cos).max(1), 1e-24)[:, None]
            basis = np.stack([ones, sin / wide, (1 - cos) / high], axis=1)
            radial = basis.copy()
            if radius is not None:  # for a given radius the cosine takes the place of the constant
                radial[:, 0], radial[:, 2] = cos, 0
            off = np.stack([rho - r[:, None], h], axis=1)
            c, bound = lawson(off, np.stack([radial, basis], axis=1), LAWSON.tight if final else LAWSON.loose)
            a, b = c[:, 0], c[:, 1]
            side = a[:, 0] if radius is not None else -a[:, 2] / high[:, 0]
            if radius is None:
                r = r + a[:, 0] + a[:, 2] / high[:, 0]
            lift, tilt = b[:, 0] + b[:, 2] / high[:, 0], np.stack([-b[:, 2] / high[:, 0], b[:, 1] / wide[:, 0]], 1)
            e, f = axes[:, 0], axes[:, 1]
            centre = centre + side[:, None] * e + (a[:, 1] / wide[:, 0])[:, None] * f + lift[:, None] * normal
            normal = unit(normal - (tilt[:, :1] * e + tilt[:, 1:] * f) / r[:, None])
        rho, h, *_ = _cylindrical_coordinates(x, centre, normal, middle)
        chord = last - first
        along = unit(chord)
        return Fit(
            np.hypot(rho - r[:, None], h).max(1),
            bound,
            np.sqrt((chord**2).sum(1)),
            r,
            first,
            frame(along, middle - centre),
            centre,
            normal,
        )


def lawson(values: Array, basis: Array, tight: float) -> tuple[Array, Array]:
    """Fit values by a basis with the least maximum of the modulus of two errors.

    Parameters
    ----------
    values : ndarray, shape (n, 2, k)
    basis : ndarray, shape (n, 2, m, k)
    tight : float
        Relative gap between modulus and lower bound at which the iteration stops.

    Returns
    -------
    ndarray, shape (n, 2, m), ndarray, shape (n,)
        Coefficients, and a lower bound of the least largest modulus.
    """
    n, _, k = values.shape
    weight, best = np.full((n, k), 1 / k), np.full(n, np.inf)
    bound, kept = np.zeros(n), np.zeros(basis.shape[:3])
    scale, eye = np.abs(values).max((1, 2)), np.eye(basis.shape[2])
    who = np.flatnonzero(np.isfinite(values).all((1, 2)) & np.isfinite(basis).all((1, 2, 3)))
    kept[np.setdiff1d(np.arange(n), who)] = np.nan
    for step in range(LAWSON.steps):
        y, f, w = values[who], basis[who], weight[who]
        weighted = f * w[:, None, None]
        normal = weighted @ np.swapaxes(f, 2, 3)
        # a function of the basis may vanish
        normal += 1e-15 * np.trace(normal, axis1=2, axis2=3)[..., None, None] * eye
        c = np.linalg.solve(normal, weighted @ y[..., None])[..., 0]
        error = np.sqrt(((y - (c[:, :, None] @ f)[:, :, 0]) ** 2).sum(1))
        worst = error.max(1)
        bound[who] = np.fmax(bound[who], np.sqrt((w * error**2).sum(1)))
        better = worst < best[who]
        best[who[better]], kept[who[better]] = worst[better], c[better]
        left = best[who] > bound[who] * (1 + tight) + 1e-15 * scale[who]
        grown = w * (error / np.maximum(worst, 1e-300)[:, None]) ** LAWSON.powers[step % len(LAWSON.powers)]
        weight[who] = np.maximum(grown / np.maximum(grown.sum(1, keepdims=True), 1e-300), LAWSON.least)
        who = who[left]
        if not len(who):
            break
    return kept, bound


def through(a: Array, b: Array, c: Array) -> tuple[Array, Array, Array]:
    """Compute centre (..., 3), axis (..., 3) and radius (...) of circles through three points."""
    p, q = a - b, c - b
    normal = np.cross(p, q)
    square = (normal**2).sum(-1, keepdims=True)
    to = np.cross((p**2).sum(-1, keepdims=True) * q - (q**2).sum(-1, keepdims=True) * p, normal) / (2 * square)
    return b + to, normal / np.sqrt(square), np.sqrt((to**2).sum(-1))


def unit(v: Array) -> Array:
    """Return vectors (..., 3) of length 1."""
    return np.asarray(v / np.sqrt((v * v).sum(-1, keepdims=True)))


def across(v: Array) -> Array:
    """Return a unit vector perpendicular to each (n, 3)."""
    return np.cross(v, np.eye(3)[np.abs(v).argmin(1)])


def frame(along: Array, side: Array) -> Array:
    """Return axes (n, 3, 3): the first along, the second as close to `side` as possible."""
    second = unit(side - (side * along).sum(1, keepdims=True) * along)
    return np.stack([along, second, np.cross(along, second)], axis=1)


def _cylindrical_coordinates(
    x: Array, centre: Array, normal: Array, middle: Array
) -> tuple[Array, Array, Array, Array, Array]:
    """Compute cylindrical coordinates of paths about an axis.

    Return the distance from the axis, the height, the cosine and sine of the angle from the
    direction to `middle`, and the unit vectors (n, 2, 3) of the plane of this angle.
    """
    out = middle - centre
    e = unit(out - (out * normal).sum(1, keepdims=True) * normal)
    f = np.cross(normal, e)
    d = x - centre[:, None]
    u, v, h = ((d * axis[:, None]).sum(2) for axis in (e, f, normal))
    rho = np.hypot(u, v)
    return rho, h, u / rho, v / rho, np.stack([e, f], axis=1)
