"""Narrowest strip and narrowest annulus that hold a path: the deviation of a guide.

The path is a polynomial interpolant in its parameter at Chebyshev points (`Grid`), so that its
extremes between the nodes are known, not sampled.  The best line or circle is found by a
Gauss-Newton iteration whose linear step is a Remez exchange over all paths at once; the signed
distance from a circle of curvature c,

    (2 v - c (u^2 + v^2)) / (1 + |(c u, 1 - c v)|),

is the distance from a line for c = 0 and loses no digits on the way there.  To first order a change
of the circle adds to it  p(X) / (1 + (c X / 2)^2):  p a polynomial of degree 2 in X = 2
tan(theta/2) / c, theta the angle about its centre.

Accuracy: (1) `Fit.unresolved` bounds the error of the interpolant by its last two Chebyshev
coefficients; (2) the extremes are evaluated on four points per node and corrected by a parabola,
with an error below 1e-4 of the deviation for up to eight oscillations per path; (3) the line or
circle alternates on the extremes, so no other one can do better by more than the spread between
them.  Rounding of the path itself is about 4e-16 of the stroke in double precision; use extended
precision below a deviation of 1e-12 of the stroke.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ..kinematics.batch import Columns
from ..kinematics.types import Complexes, Floats, Indices, Mask, Scalar


class MinimumZone(NamedTuple):
    """Limits of the iterations of the minimum zone."""

    exchanges: int = 12  #: largest number of exchanges for the best polynomial
    passes: int = 5  #: largest number of linearisations of a circle
    #: Rise of an arc over half its chord, tan(angle / 4), above which its ends may not be its
    #: farthest points.
    wide: float = 0.86
    moved: float = 1e-5  #: change by a linearisation, over the error, above which another one follows
    rounding: float = 1e-16  #: change that counts as rounding [largest abscissa]
    exceeds: float = 1e-6  #: relative excess over the level above which a point enters the exchange


MINIMUM_ZONE = MinimumZone()


@dataclass(frozen=True)
class Grid:
    """Chebyshev points of a window with their interpolation matrices.

    Attributes
    ----------
    nodes : ndarray, shape (m,)
        Chebyshev-Lobatto points from -1 to 1.
    fine : ndarray, shape (f, m)
        Interpolation from the nodes to cos(pi j / (f - 1)), from -1 to 1, f = 4 (m - 1) + 1.
    coefficients : ndarray, shape (m, m)
        Transformation of values at the nodes to Chebyshev coefficients.
    """

    nodes: Floats
    fine: Floats
    coefficients: Floats


def times(matrix: Floats, values: npt.NDArray[Scalar]) -> npt.NDArray[Scalar]:
    """Multiply a real matrix (f, m) by real or complex values (m, ...).

    NumPy would make the matrix complex, which takes several times as long.
    """
    shape = values.shape[1:]
    columns = np.ascontiguousarray(values).reshape(len(values), math.prod(shape))
    if np.iscomplexobj(columns):
        product = (matrix @ columns.view(columns.real.dtype)).view(columns.dtype)
    else:
        product = matrix @ columns
    return np.asarray(product.reshape(len(matrix), *shape))


@lru_cache
def grid(count: int, kind: object = float) -> Grid:
    """Return the grid of `count` + 1 nodes, in the precision of its paths."""
    pi = 4 * np.arctan(np.longdouble(1))
    j = np.arange(count + 1)
    weight = np.where((j == 0) | (j == count), 0.5, 1.0)
    to = 2 * weight[:, None] * np.cos(pi * np.outer(j, count - j) / count) * weight / count
    i, n = np.arange(4 * count + 1)[:, None], 4 * j
    sine = np.sin(pi * np.arange(8 * count + 1) / (8 * count))
    with np.errstate(divide="ignore", invalid="ignore"):  # barycentric, by differences of cosines
        fine = (-1.0) ** j * weight / (sine[i + n] * np.sign(i - n) * sine[np.abs(i - n)])
        fine /= fine.sum(1, keepdims=True)
    fine[::4] = np.eye(count + 1)
    return Grid(*(matrix.astype(kind) for matrix in (np.sin(pi * (2 * j - count) / (2 * count)), fine, to)))


@dataclass(frozen=True)
class Fit(Columns):
    """Best lines or circles of n paths; arrays of shape (n,).

    Attributes
    ----------
    deviation : ndarray
        Half the width of the narrowest strip or annulus [length].
    stroke : ndarray
        Distance between the ends of the path, along the line or as a chord [length].
    start : complex ndarray
        First end of the path; for a line its foot on the line.
    along : complex ndarray
        Unit vector from the first end to the last.
    curvature : ndarray
        Curvature of the best circle, positive to the left of `along` [1/length]; 0 for a line.
    rise : ndarray
        Height of the middle of the nominal over its chord, positive to the left of `along`; 0 for a
        line [length].
    unresolved : ndarray
        Bound on the error of the interpolant [length].
    """

    deviation: Floats
    stroke: Floats
    start: Complexes
    along: Complexes
    curvature: Floats
    rise: Floats
    unresolved: Floats

    @property
    def centre(self) -> Complexes:
        """Centres of the circles; NaN or infinite for lines."""
        with np.errstate(all="ignore"):
            height = self.rise + 1 / self.curvature
            return np.asarray(self.start + self.along * (0.5 * self.stroke + 1j * height))

    @property
    def is_wide(self) -> Mask:
        """Whether arcs are near a half circle, or beyond."""
        return np.asarray(np.abs(self.rise) > MINIMUM_ZONE.wide * 0.5 * self.stroke)


def rise_over(stroke: Floats, curvature: Floats) -> Floats:
    """Compute the sagitta of arcs up to a half circle, positive to the left."""
    half = 0.5 * stroke
    return np.asarray(-curvature * half**2 / (1 + np.sqrt(np.maximum(1 - (curvature * half) ** 2, 0.0))))


def reference(size: int, last: int) -> Indices:
    """Estimate the alternation points of a best approximation among 0 to `last`, shape (size,)."""
    return np.rint(last / 2 * (1 - np.cos(np.pi * np.arange(size) / (size - 1)))).astype(int)


def minimum_zone(
    u: Floats, v: Floats, circle: bool, nodes: Grid, held: Floats | None = None, *, between: bool = False
) -> Fit:
    """Fit the narrowest strips (`circle` false) or annuli to paths (u, v), (m, n) each.

    NaN paths give NaN.  An annulus is sought near the circle through the ends and the middle of the
    path; the arc must stay below a half circle, else NaN.  With `held`, curvatures (n,) positive to
    the left of the direction from the first end to the last, only the place of the circle is
    fitted: the deviation is then the largest distance from the best-placed arc of exactly that
    radius (0: a straight line).  `between`: see `exchange`.
    """
    size = 4 if circle and held is None else 3
    index = np.repeat(reference(size, len(nodes.fine) - 1)[:, None], u.shape[1], axis=1)
    return alternating(u, v, circle, nodes, held, index, between=between)[0]


def alternating(
    u: Floats, v: Floats, circle: bool, nodes: Grid, held: Floats | None, index: Indices, *, between: bool = False
) -> tuple[Fit, Indices]:
    """Fit minimum zones; return them and their alternation points (4, n), or (3, n) if `held`.

    `index` is a guess of these points.
    """
    ends = nodes.coefficients[-2:]
    unresolved = np.abs(ends @ v).sum(0) + (np.abs(ends @ u).sum(0) if circle else 0)
    middle = len(u) // 2
    first, last, origin = (u[i] + 1j * v[i] for i in (0, -1, middle))
    with np.errstate(all="ignore"):
        chord = (last - first) / np.abs(last - first)
        u, v = nodes.fine @ (u - u[middle]), nodes.fine @ (v - v[middle])
        curvature = np.zeros_like(u[0])
        if held is not None:
            curvature, circle = np.broadcast_to(held, curvature.shape).astype(curvature.dtype), True
        elif circle:
            sagitta, half = ((origin - 0.5 * (first + last)) * chord.conj()).imag, 0.5 * np.abs(last - first)
            curvature = -2 * sagitta / (sagitta**2 + half**2)
            curvature = np.where(np.abs(sagitta) < half, curvature, np.nan)
        if not circle:  # a strip depends linearly on its position, and nearly so on its tilt
            x, y = seen(u, v, np.zeros_like(origin), chord)
            c, error, index = exchange(x, y, index, between=between)
            centre, heading = shifted(origin, chord, c[0], c[1])
            stroke, foot = ((last - first) * heading.conj()).real, ((first - centre) * heading.conj()).imag
            deviation = _strip_half_width(c[1], error, np.take_along_axis(x, index, 0))
            rise = np.zeros_like(curvature)
            return Fit(deviation, stroke, first - 1j * heading * foot, heading, curvature, rise, unresolved), index
        heading, centre, open_ = chord.copy(), np.zeros_like(origin), np.arange(u.shape[1])
        deviation, reach = np.full_like(curvature, np.nan), 0.5 * np.abs(last - first)
        alternates = index.copy()
        for _ in range(MINIMUM_ZONE.passes):
            at, ahead = centre[open_], heading[open_]
            bend, far = curvature[open_], reach[open_]
            y, x, weight = (polar if held is None else concentric)(*seen(u, v, at, ahead), bend)
            c, error, index = exchange(x, y, index, weight, between=between)
            centre[open_], heading[open_], alternates[:, open_] = *shifted(at, ahead, c[0], c[1]), index
            deviation[open_], moved = error, np.abs(c[1])
            if held is None:
                curvature[open_] = bend + 2 * c[2] + 0.5 * c[0] * bend**2
                moved = moved + np.abs(c[2]) * far
            more = np.abs(c[0]) + moved * far > MINIMUM_ZONE.moved * error + MINIMUM_ZONE.rounding * far
            if not more.any():
                break
            if not more.all():
                open_, u, v, index = open_[more], u[:, more], v[:, more], index[:, more]
        stroke = np.abs(last - first)
        rise = rise_over(stroke, curvature)
        return Fit(deviation, stroke, first, chord, curvature, rise, unresolved), alternates


def _strip_half_width(slope: Floats, error: Floats, x: Floats) -> Floats:
    """Compute half widths of strips narrowest across the x axis, extremes at x (3, n).

    Such a strip is narrowest across its own axis too if rotation either way widens it: by half a
    gap between its extremes per unit of slope, more than the tilt reduces it. NaN where this fails.
    """
    grows = 0.5 * np.abs(np.diff(x, axis=0)).min(0) * (1 + slope**2) >= error * np.abs(slope)
    return np.where(grows, error / np.hypot(1, slope), np.nan)


def seen(u: Floats, v: Floats, origin: Complexes, along: Complexes) -> tuple[Floats, Floats]:
    """Return coordinates of points along and across unit vectors `along`, from origins."""
    x, y = u - origin.real, v - origin.imag
    return x * along.real + y * along.imag, y * along.real - x * along.imag


def shifted(origin: Complexes, along: Complexes, offset: Floats, slope: Floats) -> tuple[Complexes, Complexes]:
    """Return origins moved across their directions, and the directions turned."""
    turned: Complexes = along * (1 + 1j * slope)
    return origin + 1j * offset * along, turned / np.hypot(1, slope)


def polar(x: Floats, y: Floats, curvature: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the signed distance from the circle, X, and 1 + (c X / 2)^2.

    See the head of the module.
    """
    root = np.sqrt((curvature * x) ** 2 + (1 - curvature * y) ** 2)
    at = 2 * x / (root + 1 - curvature * y)
    return (2 * y - curvature * (x * x + y * y)) / (1 + root), at, 1 + (0.5 * curvature * at) ** 2


def concentric(x: Floats, y: Floats, curvature: Floats) -> tuple[Floats, Floats, Floats]:
    """Compute the distance from the circle, tan(theta) / c and 1 / cos(theta), at angles theta.

    A circle that is moved but keeps its radius changes the distance by (c0 + c1 tan(theta) / c)
    cos(theta).
    """
    down = 1 - curvature * y
    root = np.hypot(curvature * x, down)
    return (2 * y - curvature * (x * x + y * y)) / (1 + root), x / down, root / down


def exchange(
    x: Floats, g: Floats, index: Indices, by: Floats | None = None, peaks: bool = True, between: bool = False
) -> tuple[Floats, Floats, Indices]:
    """Approximate g uniformly by a polynomial in x of degree len(index) - 2, over `by` (Remez).

    With `peaks`, extremes of the reference between the points are evaluated by parabolas; with
    `between` this holds for all extremes of the path: none exceeds the returned error by more than
    1e-6 of it.  Returns the coefficients (k - 1, n), the largest error (n,), and the reference
    (indices of the alternating extremes, (k, n)).  A path leaves the exchange as soon as its
    reference is final, so that its result and cost do not depend on the other paths.
    """
    size, n = index.shape
    sign = np.where(np.arange(size) % 2 == 0, 1.0, -1.0)[:, None].astype(g.dtype)
    rounding = 4 * np.finfo(g.dtype).eps * np.abs(x[-1] - x[0])
    index, c, level, value = index.copy(), np.empty((size - 1, n), g.dtype), np.empty(n, g.dtype), np.empty(n, g.dtype)
    for peaks_too in (False, True) if between else (False,):
        open_, xs, gs, bs, at = np.arange(n), x, g, by, index
        for _ in range(MINIMUM_ZONE.exchanges):
            column = np.arange(len(open_))
            c[:, open_], level[open_] = _solve_level(xs, gs[at, column], at, sign, bs)
            if peaks_too:
                more, level[open_] = _solve_level(xs, _peaks(c[:, open_], xs, gs, at, bs), at, sign, bs)
                c[:, open_] += more
            residual = _residual(c[:, open_], xs, gs, bs)
            height = interpolate_maxima(np.abs(residual)) if peaks_too else np.abs(residual)
            worst = np.argmax(height, axis=0)
            value[open_] = height[worst, column]
            better = value[open_] > np.abs(level[open_]) * (1 + MINIMUM_ZONE.exceeds) + rounding[open_]
            if not better.any():
                break
            like_first = np.sign(residual[worst, column][better]) == np.sign(level[open_][better])
            at = _replace(at[:, better], worst[better], like_first, len(x) - 1)
            open_, xs, gs, bs = open_[better], xs[:, better], gs[:, better], None if bs is None else bs[:, better]
            index[:, open_] = at
    if not between:
        more, level = _solve_level(
            x, _peaks(c, x, g, index, by) if peaks else _residual_at(c, x, g, index, by), index, sign, by
        )
        c = c + more
    noise = np.where(value <= 4 * rounding, value, 0)  # residuals of rounding size, at which the exchange stopped
    return c, np.maximum(np.abs(level), noise), index


def _residual(c: Floats, x: Floats, g: Floats, by: Floats | None) -> Floats:
    """Compute the residual of g after subtraction of a polynomial over `by`."""
    found = (c[2] * x + c[1]) * x + c[0] if len(c) == 3 else c[1] * x + c[0]
    return np.asarray(g - (found if by is None else found / by))


def _residual_at(c: Floats, x: Floats, g: Floats, index: Indices, by: Floats | None) -> Floats:
    """Return the residual at points given by their indices, (k, n)."""
    column = np.arange(index.shape[1])
    return _residual(c, x[index, column], g[index, column], None if by is None else by[index, column])


def _solve_level(x: Floats, gs: Floats, index: Indices, sign: Floats, by: Floats | None) -> tuple[Floats, Floats]:
    """Solve for the polynomial (over `by`) with alternating errors at the reference."""
    column = np.arange(index.shape[1])
    xs, both = x[index, column], np.empty((2, *gs.shape), gs.dtype)
    far = xs[-1] - xs[0]  # unit of x, so that no cube of it over- or underflows
    both[0], both[1] = gs, sign
    if by is not None:
        both *= by[index, column]
    # divided differences of values and signs; for the polynomial the highest one vanishes
    divided = [both[:, 0]]
    for k in range(1, len(xs)):
        both = (both[:, 1:] - both[:, :-1]) * (far / (xs[k:] - xs[:-k]))
        divided.append(both[:, 0])
    *rest, (last, of_signs) = divided
    level = last / of_signs
    c = [(values - level * signs) / far**k for k, (values, signs) in enumerate(rest)]
    if len(c) == 2:
        return np.stack([c[0] - c[1] * xs[0], c[1]]), level
    return np.stack([c[0] - c[1] * xs[0] + c[2] * xs[0] * xs[1], c[1] - c[2] * (xs[0] + xs[1]), c[2]]), level


def _replace(index: Indices, new: Indices, like_first: Mask, last: int) -> Indices:
    """Exchange a point of the alternating reference for `new`, so that signs alternate.

    `like_first` tells whether the residuals at `new` and at the first point have equal signs.
    """
    size = len(index)
    below = (index < new).sum(0)  # number of points before it
    # the sign of point k is that of the first times (-1)^k; of the two neighbours of `new` the one
    # of equal sign is replaced
    parity = np.where(like_first, 0, 1)
    left = below - 1
    target = np.where((left >= 0) & (left % 2 == parity), left, below)
    out = index.copy()
    inside = (target >= 0) & (target < size) & (target % 2 == parity)
    column = np.arange(index.shape[1])
    chosen = np.clip(target, 0, size - 1)
    out[chosen[inside], column[inside]] = new[inside]
    if inside.all():
        return out
    front = ~inside & (below == 0)
    out[1:, front], out[0, front] = index[:-1, front], new[front]
    back = ~inside & (below == size)
    out[:-1, back], out[-1, back] = index[1:, back], new[back]
    return np.clip(out, 0, last)


def _peaks(c: Floats, x: Floats, g: Floats, index: Indices, by: Floats | None) -> Floats:
    """Evaluate residuals at the reference, (k, n), inner extremes by parabolas."""
    inner = np.clip(index, 1, len(x) - 2)
    at, low, high = (_residual_at(c, x, g, inner + k, by) for k in (0, -1, 1))
    bend = low - 2 * at + high
    gain = np.where(bend != 0, (high - low) ** 2 / (8 * np.where(bend == 0, 1, bend)), 0)
    gain = np.where(np.abs(gain) <= 0.1 * np.abs(at), gain, 0)  # no extreme there: an end, or rounding
    return np.where(inner == index, at - gain, np.where(index < inner, low, high))


def largest(values: Floats) -> Floats:
    """Compute the maximum of values (m, n) along paths, refined by parabolas, shape (n,)."""
    return np.asarray((values if len(values) < 3 else interpolate_maxima(values)).max(0))


def interpolate_maxima(values: Floats) -> Floats:
    """Replace local maxima of values (m, n) by those of parabolas."""
    low, at, high = values[:-2], values[1:-1], values[2:]
    bend = low - 2 * at + high
    peak = (at >= low) & (at >= high) & (bend < 0)
    found = values.copy()
    found[1:-1] += np.where(peak, (high - low) ** 2 / (8 * np.where(peak, -bend, 1)), 0)
    return found


def resolved(found: Fit, tolerance: float = 1e-4, floor: Floats | float = 4e-16) -> Mask:
    """Tell where the error of the interpolant is below `tolerance`, or below rounding, (n,)."""
    return np.asarray(found.unresolved <= tolerance * found.deviation + floor * found.stroke)
