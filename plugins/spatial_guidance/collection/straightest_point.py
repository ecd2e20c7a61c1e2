"""Find the point of a moving body with the straightest, or most circular, path.

A point's path is an affine function of the poses.  All points of a grid in the body are evaluated
over all windows of the motion at once; a compass search improves the best point for each length of
window.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from catalogue.plugin import Array

from .minimum_zone import through


class PointSearch(NamedTuple):
    """Trial points of a body, and trial windows of its motion."""

    whole: int = 48  #: number of intervals between the poses of the motion
    part: int = 12  #: number of sampled intervals of a window
    side: int = 5  #: number of points of the grid along each axis
    width: float = 2.0  #: width of the grid [sizes of the body]
    farthest: float = 2.0  #: largest distance of a point from the middle [sizes of the body]
    steps: int = 48  #: number of steps of the compass search; a step without gain halves the length
    least_stroke: float = 0.1  #: least stroke [sizes of the body]
    flattest: float = 0.25  #: least stroke over radius
    fullest: float = 1.8  #: largest stroke over radius
    #: Least distance from an exactly guided point [sizes of the body]: a nearer point would need
    #: only a slide or a crank.
    clearance: float = 0.25


POINT_SEARCH = PointSearch()

#: Length of windows, and distance between their starts [nodes].
WINDOWS = ((48, 48), (24, 6), (12, 6))

Gap = Callable[[Array], Array]


def line_gap(x: Array) -> Array:
    """Compute the distance of paths x (..., k, 3) from a line nearby [strokes].

    The distance is infinite where a path turns back.
    """
    with np.errstate(all="ignore"):
        chord = x[..., -1, :] - x[..., 0, :]
        stroke = np.sqrt((chord**2).sum(-1))
        along = chord / stroke[..., None]
        d = x - x.mean(-2, keepdims=True)
        s = (d * along[..., None, :]).sum(-1)
        slope = (s[..., None] * d).sum(-2) / (s * s).sum(-1)[..., None]
        off = d - s[..., None] * slope[..., None, :]
        gap = np.sqrt((off**2).sum(-1).max(-1)) / stroke
    return np.where((np.diff(s, axis=-1) > 0).all(-1), gap, np.inf)


def circle_gap(x: Array) -> Array:
    """Compute the distance of paths x (..., k, 3) from a circle nearby [strokes].

    The circle passes through ends and middle; the distance is infinite where a path turns back.
    """
    with np.errstate(all="ignore"):
        chord = x[..., -1, :] - x[..., 0, :]
        stroke = np.sqrt((chord**2).sum(-1))
        centre, normal, radius = through(x[..., 0, :], x[..., x.shape[-2] // 2, :], x[..., -1, :])
        d = x - centre[..., None, :]
        h = (d * normal[..., None, :]).sum(-1)
        rho = np.sqrt(np.maximum((d * d).sum(-1) - h * h, 0))
        gap = np.sqrt(((rho - radius[..., None]) ** 2 + h * h).max(-1)) / stroke
        s = (d * chord[..., None, :]).sum(-1)
        fair = (
            (np.diff(s, axis=-1) > 0).all(-1)
            & (stroke > POINT_SEARCH.flattest * radius)
            & (stroke < POINT_SEARCH.fullest * radius)
        )
    return np.where(fair, gap, np.inf)


GAPS: dict[str, Gap] = {"line": line_gap, "circle": circle_gap}


def best(
    rotation: Array, translation: Array, kind: str, centre: Array, size: Array, barred: Array, flat: Array
) -> list[tuple[Array, Array, Array]]:
    """Find the best point and window for each length of window.

    Parameters
    ----------
    rotation, translation : ndarray, shape (n, 49, 3, 3), (n, 49, 3)
        Poses at even steps of the drivers.
    kind : str
        ``line`` or ``circle``.
    centre, size : ndarray, shape (n, 3), (n,)
        Middle and size of the body.
    barred : ndarray, shape (n, p, 3)
        Points of the body that guides keep exactly on a line or circle; NaN without.
    flat : ndarray, shape (n,)
        Whether the body moves parallel to the plane z = 0: then all points above and below barred
        ones are barred too.

    Returns
    -------
    list of tuple of ndarray
        Point (n, 3), first node of its window (n,) and gap (n,) [strokes].
    """
    gap = GAPS[kind]
    ticks = np.linspace(-POINT_SEARCH.width / 2, POINT_SEARCH.width / 2, POINT_SEARCH.side)
    cells = np.stack(np.meshgrid(ticks, ticks, ticks, indexing="ij"), axis=-1).reshape(-1, 3)
    tried = centre[:, None] + size[:, None, None] * cells
    n, every, out = len(rotation), np.arange(len(rotation)), []
    lift = np.where(flat[:, None], (1.0, 1.0, 0.0), (1.0, 1.0, 1.0))

    def fair(points: Array) -> Array:
        apart = (points[:, :, None] - barred[:, None]) * lift[:, None, None]
        near = (apart**2).sum(-1) < (POINT_SEARCH.clearance * size[:, None, None]) ** 2
        out = ((points - centre[:, None]) ** 2).sum(-1) > (POINT_SEARCH.farthest * size[:, None]) ** 2
        return np.asarray(~(near.any(-1) | out))

    def judged(points: Array, r: Array, t: Array) -> Array:
        """Compute the gaps (n, m) of points (n, m, 3) over windows (n, k, ...)."""
        x = t[:, None] + np.einsum("nkij,nmj->nmki", r, points)
        stroke = np.sqrt(((x[:, :, -1] - x[:, :, 0]) ** 2).sum(-1))
        return np.where(fair(points) & (stroke > POINT_SEARCH.least_stroke * size[:, None]), gap(x), np.inf)

    for length, shift in WINDOWS:
        firsts = np.arange(0, POINT_SEARCH.whole - length + 1, shift)
        steps = np.arange(0, length + 1, length // POINT_SEARCH.part)
        tables = np.stack([judged(tried, rotation[:, f + steps], translation[:, f + steps]) for f in firsts], axis=1)
        chosen = tables.reshape(n, -1).argmin(1)
        first, cell = firsts[chosen // len(cells)], chosen % len(cells)
        r, t = rotation[every[:, None], first[:, None] + steps], translation[every[:, None], first[:, None] + steps]
        point, value = tried[every, cell], tables.reshape(n, -1)[every, chosen]
        step = 0.5 * size * POINT_SEARCH.width / (POINT_SEARCH.side - 1)
        ways = np.concatenate([np.eye(3), -np.eye(3)])
        for _ in range(POINT_SEARCH.steps):
            around = point[:, None] + step[:, None, None] * ways
            gaps = judged(around, r, t)
            nearest = gaps.argmin(1)
            better = gaps[every, nearest] < value
            point = np.where(better[:, None], around[every, nearest], point)
            value = np.where(better, gaps[every, nearest], value)
            step = np.where(better, 1.5 * step, 0.5 * step)
        out.append((point, first, value))
    return out
