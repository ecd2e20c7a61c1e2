"""Minimum zones of paths with a cusp, which return along nearly the same line or circle.

The deviation is that of both branches, which diverge far from the cusp. Where this divergence
determines the width of an annulus, a range of radii gives the same width, and an exchange over all
three parameters of a circle has no reference. So the radius is found by golden section, from the
least-squares circle of both branches. For each radius, and for strips, the zone is found by
exchange as in `minimum_zone`. The width is evaluated at the fine points of the grid and at the
ends, where it usually is largest. A grid four times as fine as for other paths keeps the error
between the points below 5e-4 of it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..kinematics.types import Array
from .minimum_zone import Fit, Grid, exchange, polar, rise_over, seen, shifted


class CuspedZone(NamedTuple):
    """Iterations of the minimum zone of a path with a cusp."""

    steps: int = 12  #: largest number of least-squares steps for the radius
    exchanges: int = 8  #: largest number of exchanges for a given radius
    at_rest: float = 1e-12  #: step at which the iteration has converged [strokes]
    #: Largest growth of the largest distance since the last exchange up to which a circle is
    #: accepted.
    settled: float = 1.001
    #: Distance by which points of two branches are separated where they are equally far from the
    #: cusp [strokes].
    apart: float = 1e-11
    #: Trial change of the curvature [deviations / stroke^2]: it moves the middle of the arc by
    #: twice the deviation, more than the narrowest annulus can.
    bracket: float = 16.0
    #: Number of steps of the golden section: they narrow that change to 4e-4, hence the error of
    #: the deviation is below 1e-3.
    sections: int = 17
    golden: float = 0.5 * (5**0.5 - 1)  #: golden ratio
    moved: float = 1e-4  #: change by a step, over the level, above which the iteration continues


CUSP = CuspedZone()


def cusped_zone(u: Array, v: Array, circle: bool, nodes: Grid, held: Array | None = None) -> Fit:
    """Fit strips (`circle` false) or annuli to paths from a cusp at (0, 0).

    The fitted path runs from the cusp to the middle between the path's two ends.  NaN where a
    branch turns back, and where no circle of less than half a turn is found.  With `held`,
    curvatures (n,) positive to the left of the direction from the cusp, only the place of the
    circle is fitted.
    """
    last_nodes = nodes.coefficients[-2:]
    unresolved = np.abs(last_nodes @ v).sum(0) + np.abs(last_nodes @ u).sum(0)
    last = 0.5 * (u[0] + u[-1] + 1j * (v[0] + v[-1]))
    with np.errstate(all="ignore"):
        stroke, along = np.abs(last), last / np.abs(last)
        x, y = _unfold_branches(nodes.fine @ u, nodes.fine @ v)
        x, y = x * along.real + y * along.imag, y * along.real - x * along.imag
        centre, heading, curvature = np.zeros_like(last), np.ones_like(last), np.zeros_like(stroke)
        if held is not None:  # the circle of that curvature through the cusp and the end
            curvature = np.broadcast_to(held, stroke.shape).astype(stroke.dtype)
            heading = np.exp(-1j * np.arcsin(0.5 * curvature * stroke))
        elif circle:
            centre, heading, curvature = _mean_circle(x, y, stroke)
        deviation, foot, heading = _annuli_of_curvature(x, y, stroke, centre, heading, curvature)
        if circle and held is None:
            deviation, curvature = _narrowest_annulus(x, y, stroke, foot, heading, curvature, deviation)
        if circle:
            rise = rise_over(stroke, curvature)
            return Fit(deviation, stroke, np.zeros_like(last), along, curvature, rise, unresolved)
        heading = heading * along
        foot = foot * along
        foot = 1j * heading * (foot * heading.conj()).imag
        stroke = (last * heading.conj()).real
        return Fit(deviation, stroke, foot, heading, curvature, rise_over(stroke, curvature), unresolved)


def _annuli_of_curvature(
    x: Array, y: Array, stroke: Array, centre: Array, heading: Array, curvature: Array
) -> tuple[Array, Array, Array]:
    """Find the narrowest annuli of given curvatures.

    Parameters
    ----------
    x, y : ndarray, shape (f, n)
        Points of both branches.
    centre, heading : complex ndarray, shape (n,)
        A point of each initial circle, and the circle's direction there.

    Returns
    -------
    deviation, centre, heading : ndarray, shape (n,)
        Half widths, NaN where the exchange does not converge or the arc is half a circle; points
        and directions.
    """
    deviation, centre, heading = stroke.copy(), centre.copy(), heading.copy()
    apart = CUSP.apart * stroke * np.arange(len(x))[:, None]
    open_, xs, ys = np.arange(x.shape[1]), x, y
    for _ in range(CUSP.exchanges):
        a, b = seen(xs, ys, centre[open_], heading[open_])
        bend = curvature[open_]
        distance, _, _ = polar(a, b, bend)
        # a circle that is moved but keeps its radius changes distances by (c0 + c1 X) cos, X =
        # tan(theta)/curvature
        inverse_cosine = np.hypot(bend * a, 1 - bend * b) / (1 - bend * b)
        run = a / (1 - bend * b)
        order = np.argsort(run, axis=0)
        run, distance, by = (np.take_along_axis(f, order, 0) for f in (run, distance, inverse_cosine))
        first = np.repeat(np.array([[0], [len(x) // 2], [len(x) - 1]]), len(open_), axis=1)
        (c0, c1), level, _ = exchange(run + apart[:, open_], distance, first, by, peaks=False)
        deviation[open_] = level
        centre[open_], heading[open_] = shifted(centre[open_], heading[open_], c0, c1)
        length = stroke[open_]
        moved = np.abs(c0) + np.abs(c1) * length > CUSP.moved * level + CUSP.at_rest * length
        if not moved.any():
            break
        open_, xs, ys = open_[moved], xs[:, moved], ys[:, moved]
    worst = np.abs(polar(*seen(x, y, centre, heading), curvature)[0]).max(0)
    settled = (worst <= CUSP.settled * deviation + CUSP.at_rest * stroke) & (np.abs(curvature) * stroke < 2)
    return np.where(settled, worst, np.nan), centre, heading


def _narrowest_annulus(
    x: Array, y: Array, stroke: Array, centre: Array, heading: Array, curvature: Array, deviation: Array
) -> tuple[Array, Array]:
    """Find the curvature of the narrowest annulus by golden section about a first estimate.

    The half width is a convex function of the curvature, as long as the circle moves by a few
    deviations.
    """
    reach = CUSP.bracket * deviation / stroke**2
    low, high = curvature - reach, curvature + reach

    def width(bend: Array) -> Array:
        found = _annuli_of_curvature(x, y, stroke, centre, heading, bend)[0]
        return np.where(np.isnan(found), np.inf, found)

    left, right = high - CUSP.golden * (high - low), low + CUSP.golden * (high - low)
    at_left, at_right = width(left), width(right)
    for _ in range(CUSP.sections):
        below = at_left <= at_right
        low, high = np.where(below, low, left), np.where(below, right, high)
        new = np.where(below, high - CUSP.golden * (high - low), low + CUSP.golden * (high - low))
        left, right, at_new = np.where(below, new, right), np.where(below, left, new), width(new)
        at_left, at_right = np.where(below, at_new, at_right), np.where(below, at_left, at_new)
    bend, least = np.where(at_left <= at_right, [left, at_left], [right, at_right])
    better = least < deviation
    return np.where(better, least, deviation), np.where(better, bend, curvature)


def _mean_circle(x: Array, y: Array, stroke: Array) -> tuple[Array, Array, Array]:
    """Fit circles by least squares: a point, its direction and the curvature, (n,) each."""
    half = np.argmin(np.abs(x - 0.5 * stroke), axis=0)[None]
    at_x, at_y = (np.take_along_axis(a, half, 0)[0] for a in (x, y))
    curvature = -2 * at_y / (at_y**2 + at_x * (stroke - at_x))
    centre, heading = at_x + 1j * at_y, np.ones_like(at_x + 1j * at_y)
    open_, xs, ys = np.arange(x.shape[1]), x, y
    for _ in range(CUSP.steps):
        length = stroke[open_]
        a, b = seen(xs, ys, centre[open_], heading[open_])
        distance, at, weight = polar(a, b, curvature[open_])
        run = at / length
        basis = np.stack([1 / weight, run / weight, run * run / weight])
        normal = np.einsum("imn,jmn->nij", basis, basis).astype(float)
        right = np.einsum("imn,mn->ni", basis, distance).astype(float)
        good = np.isfinite(normal).all((1, 2)) & np.isfinite(right).all(1)
        normal, right = np.where(good[:, None, None], normal, np.eye(3)), np.where(good[:, None], right, np.nan)
        c0, c1, c2 = np.linalg.solve(normal, right[..., None])[..., 0].T
        curvature[open_] += 2 * c2 / length**2 + 0.5 * c0 * curvature[open_] ** 2
        centre[open_], heading[open_] = shifted(centre[open_], heading[open_], c0, c1 / length)
        moved = np.abs(c0) + np.abs(c1) + np.abs(c2) > CUSP.at_rest * length
        if not moved.any():
            break
        open_, xs, ys = open_[moved], xs[:, moved], ys[:, moved]
    return centre, heading, curvature


def _unfold_branches(u: Array, v: Array) -> tuple[Array, Array]:
    """Return the cusp and the points of both branches in the order of u.

    NaN where a branch turns back.
    """
    falling = np.diff(u, axis=0) < 0
    turns = (falling[1:] & ~falling[:-1]).any(0)
    order = np.argsort(u, axis=0)
    u, v = np.take_along_axis(u, order, 0), np.where(turns, np.nan, np.take_along_axis(v, order, 0))
    return np.concatenate([0 * u[:1], u]), np.concatenate([0 * v[:1], v])
