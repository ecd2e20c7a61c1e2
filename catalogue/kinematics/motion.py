"""Finite motion of all six families in closed form.

A pose carries the coupler point z to  z + d + x (z - o),  x = exp(i theta) - 1.  Each dyad (A, w),
(A*, w*), with coordinates relative to the origin o, confines the pose to a generalised circle,

    w w* |d|^2 + 2 Re(conj(w (1 + x) A* - w* A) d) - 2 Re(conj(A) A* x) = 0.

Once a parameter t is chosen (a *chart*) one unknown y is left, and the two dyads together give a
circle and a line in it:

    a |y|^2 + 2 Re(conj(b) y) + g = 0,    Re(conj(B) y) + H = 0.

* Coupler chart: t = tan(theta/2) of the coupler, y = d.
* Crank chart i: t = tan(phi/2) of the crank of dyad i, y = x, and o is the moving pivot of that
  crank.

With xi = exp(i angle) - 1 = 2 t (i - t)/(1 + t^2) every coefficient of circle and line is linear in
(Re xi, Im xi), because |xi|^2 = -2 Re xi.  Times 1 + t^2 each is a quadratic polynomial of t
(*form*), so that over a window of t all forms of all linkages at common nodes are one matrix
product.  The reference position is t = 0, y = 0.  No digits cancel near it, and the root continuous
with it is used.

A chart ends where circle and line touch: at a zero of E - lo or hi - E, for one more linear form
E.  These are the turning points of the parameter.  In the coupler chart the cranks are parallel
there or the linkage is at a dead point; in a crank chart that crank is at a dead point.

At a change point all pivots lie on one line and two branches cross: K and the discriminant vanish
like t and t^2.  Both are divided out in the coupler chart, and the branch with the given pole is
followed on both sides.

Arrays of positions have shape (m, n): positions first, so that every numpy pass runs along the
linkages.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from .batch import Columns
from .linkage import PR, RP, RR, Linkage, homogeneous
from .types import Complexes, Floats, Integers, Mask

#: Rows of `Motion.forms`, each a polynomial c0 + c1 t + c2 t^2: the line's offset H/t, the circle's
#: constant g/t, N = |B|^2, K = Im(conj(B) b), 2J = 2 Re(conj(b) B), then B itself.  Their common
#: denominator is 1 + t^2.
H, G, N, K, J2, B_X, B_Y = range(7)


def coupler_chart(z: Complexes, w: Floats) -> tuple[Floats, ...]:
    """Compute the quadratic equations of the coupler chart, with the displacement d as unknown.

    Dyad 1 gives a circle, both dyads together a line.

    Return forms, limit E, its lower and upper bound, scale of K, coefficient of the circle.
    """
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


def crank_chart(z: Complexes, w: Floats, kind: Integers) -> tuple[Floats, ...]:
    """Compute the equations of the crank chart, with the rotation x of the coupler as unknown.

    The circle is |1 + x| = 1; dyad 2 gives the line. The origin is the moving pivot of the crank.
    Return values are those of `coupler_chart`.
    """
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


def _real(c: Complexes) -> Floats:
    """Return the coefficients of (1, Re xi, Im xi) in Re(c xi)."""
    return np.stack([np.zeros_like(c.real), c.real, -c.imag])


def _complex(p: tuple[Complexes, Complexes]) -> Complexes:
    """Return the coefficients of (1, Re xi, Im xi) in p0 + p1 xi."""
    return np.stack([p[0], p[1], 1j * p[1]])


def _product(p: tuple[Complexes, Complexes], q: tuple[Complexes, Complexes]) -> Complexes:
    """Multiply conj(p0 + p1 xi) by q0 + q1 xi: coefficients of (1, Re xi, Im xi).

    |xi|^2 = -2 Re xi.
    """
    first, second = p[0].conj() * q[1], p[1].conj() * q[0]
    return np.stack([p[0].conj() * q[0], first + second - 2 * p[1].conj() * q[1], 1j * (first - second)])


def _polynomial(f: Floats) -> Floats:
    """Return the coefficients of (1, t, t^2) in (1 + t^2) f, f linear in xi."""
    return np.stack([f[0], 2 * f[2], f[0] - 2 * f[1]])


def _over_t(f: Floats) -> Floats:
    """Compute (1 + t^2) f / t: coefficients of (1, t, t^2).

    f is linear in xi, and 0 at t = 0.
    """
    return np.stack([2 * f[2], -2 * f[1], np.zeros_like(f[0])])


def nearest(form: Floats, low: Floats, high: Floats, side: int) -> Floats:
    """Find the nearest t on one side of 0 where a form reaches a limit.

    `side` is 1 or -1; the result is infinite where the form does not reach the limit.
    """
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


def at_change(
    forms: Floats, circle: Floats, unit: Floats, origin: Complexes, pole: Complexes, change: Mask
) -> tuple[Floats, Floats]:
    """Divide K by t at change points and select the branch by the pole."""
    k = forms[K]
    forms = forms.copy()
    forms[K] = np.where(change, np.stack([k[1], k[2], np.zeros_like(k[0])]), k)
    h, _, n, _, _, b_x, b_y = forms[:, 0]
    best = np.full(len(pole), np.inf)
    branch = np.zeros(len(pole), dtype=forms.dtype)
    with np.errstate(all="ignore"):
        for sign in (1.0, -1.0):
            q = crossing(forms, circle, np.full(len(pole), sign, dtype=forms.dtype))
            y = unit * (q * (b_y - 1j * b_x) - h * (b_x + 1j * b_y)) / n
            off = np.abs(origin + 0.5j * y - pole)  # the pole is where y + 2 i (z - o) vanishes
            nearer = change & (off < best)
            best, branch = np.where(nearer, off, best), np.where(nearer, sign, branch)
    return forms, branch


def crossed(forms: Floats, scale: Floats) -> Mask:
    """Tell where the constant of the circle vanishes as well as K, shape (n,).

    With K = 0 alone the rays are parallel but not on one line.
    """
    h, g, n, j2 = forms[H, 0], forms[G, 0], forms[N, 0], forms[J2, 0]
    return np.asarray(np.abs(g * n - j2 * h) <= 1e-9 * (np.abs(g * n) + np.abs(j2 * h)) + 1e-10 * scale**2)


def divided_constant(forms: Floats) -> Floats:
    """Compute  (g N - 2 J h)/t  at a change point: coefficients, shape (3, n).

    The numerator has no constant term there.
    """
    h, g, n, j2 = forms[H], forms[G], forms[N], forms[J2]
    return np.stack(
        [
            g[0] * n[1] + g[1] * n[0] - j2[0] * h[1] - j2[1] * h[0],
            g[0] * n[2] + g[1] * n[1] - j2[1] * h[1] - j2[2] * h[0],
            g[1] * n[2] - j2[2] * h[1],
        ]
    )


def crossing(forms: Floats, circle: Floats, branch: Floats) -> Floats:
    """Return the root q at t = 0 of linkages at a change point, shape (n,).

    y = (q (B_Y - i B_X) - H (B_X + i B_Y)) / N.
    """
    return root_of(forms[H, 0], forms[K, 0], divided_constant(forms)[0], circle, branch)


def root_of(h: Floats, k: Floats, divided: Floats, circle: Floats, branch: Floats) -> Floats:
    """Compute the root q of linkages at a change point, without the common powers of t."""
    mixed = circle * h * h + divided
    with np.errstate(all="ignore"):
        root = branch * np.sqrt(np.where(circle > 0, k * k - mixed, k * k))
        other = np.where(circle > 0, k - root, np.nan)
        return np.asarray(np.where(k * branch < 0, other, mixed / (k + root)))


COUPLER = 0  #: chart by the rotation of the coupler
CRANK_1 = 1  #: chart by the angle of crank 1
CRANK_2 = 2  #: chart by the angle of crank 2
CHARTS = (COUPLER, CRANK_1, CRANK_2)
#: Number of positions evaluated at once: the temporaries of a block stay in the second-level cache.
BLOCK = 32768
CHANGE = 1e-9  #: |K| over its scale, in all charts, below which a linkage is at a change point
TANGENT_DISTANCE = 1e-6  #: relative distance of E from its bound up to which a change point counts as at the bound


class Pose(NamedTuple):
    """Poses of n couplers at m positions: a point z moves to z + d + x (z - origin), complex.

    d and x have shape (m, n), the origin (n,).
    """

    d: Complexes
    x: Complexes
    origin: Complexes

    def point(self, z: Complexes | Floats) -> Complexes:
        """Return the positions of coupler points (n,), shape (m, n)."""
        return np.asarray(z + self.d + self.x * (z - self.origin))

    def direction(self, z: Complexes) -> Complexes:
        """Rotate coupler directions (n,) to the poses, shape (m, n)."""
        return np.asarray((1 + self.x) * z)

    def pivot(self, linkage: Linkage, i: int) -> Complexes:
        """Compute the position of moving pivot i, or its direction if at infinity, shape (m, n)."""
        z = linkage.points[:, i, 1]
        return np.where(linkage.finite[:, i, 1], self.point(z), self.direction(z))

    def linkages(self, linkage: Linkage) -> Linkage:
        """Return the linkages in these poses: m times n, position by position."""
        z = np.empty((*self.d.shape, 2, 2), complex)
        z[...] = linkage.points
        for i in (0, 1):
            z[..., i, 1] = self.pivot(linkage, i)
        w = np.broadcast_to(linkage.pivots[..., 2], z.shape)
        return Linkage.trusted(homogeneous(z, w).reshape(-1, 2, 2, 3))


@dataclass(frozen=True)
class Motion(Columns):
    """Finite motion of n linkages, each in its own chart; made by `motion`.

    Attributes
    ----------
    chart : ndarray of int, shape (n,)
        `COUPLER`, `CRANK_1` or `CRANK_2`.
    conditioning : ndarray, shape (n,)
        Between 0 (the chart is singular in the reference position) and about 1.
    interval : ndarray, shape (2, n)
        Nearest turning points of the parameter below and above 0; infinite where the parameter
        turns fully.
    forms : ndarray, shape (7, 3, n)
    circle : ndarray, shape (n,)
        The coefficient a of the circle, 0 if it is a line.
    origin, lever : complex ndarray, shape (n,)
        Origin o of the pose; crank vector of the crank charts, 0 in the coupler chart.
    unit : ndarray, shape (n,)
        Unit of the unknown y: 1 in the crank charts; in the coupler chart a power of 2 near the
        linkage's size [length].
    branch : ndarray, shape (n,)
        Sign of the root for t > 0 at a change point, else 0.
    """

    linkage: Linkage
    chart: Integers
    conditioning: Floats
    interval: Floats
    forms: Floats
    circle: Floats
    origin: Complexes
    lever: Complexes
    unit: Floats
    branch: Floats

    def point(self, z: Complexes, along: Complexes | None = None) -> Path:
        """Return the paths of coupler points.

        Parameters
        ----------
        z : complex ndarray, shape (n,)
        along : complex ndarray, shape (n,), optional
            Unit vectors of the first axis of the displacements (default: the x axis).
        """
        crank = self.chart != COUPLER
        axis = np.ones_like(z) if along is None else np.conj(along)
        return self._path(
            np.where(crank, self.lever, z - self.origin) * axis, np.where(crank, z - self.origin, 1) * axis
        )

    def turn(self) -> Path:
        """Return (Re x, Im x) of the pose as a `Path`."""
        crank = self.chart != COUPLER
        return self._path(np.where(crank, 0j, 1), np.where(crank, 1, 0j))

    def pose(self, t: Floats) -> Pose:
        """Return the poses at the parameters t (m, n)."""
        t = np.asarray(t)
        re, im = self._path(np.zeros_like(self.lever), np.ones_like(self.lever))(t)
        y, xi = re + 1j * im, 2 * t * (1j - t) / (1 + t * t)
        crank = self.chart != COUPLER
        return Pose(np.where(crank, self.lever * xi, y), np.where(crank, y, xi), self.origin)

    def _path(self, linear: Complexes, factor: Complexes) -> Path:
        """Return the path of displacements  linear xi + factor y."""
        turned = factor * self.unit * (self.forms[B_X] + 1j * self.forms[B_Y])
        extra = np.stack([2j * linear, -2 * linear, 0 * linear])
        rows = np.concatenate([self.forms[:B_X], [turned.real, turned.imag, extra.real, extra.imag]])
        if self.branch.any():
            rows = np.concatenate([rows, divided_constant(self.forms)[None]])
        return Path(rows, self.circle, self.branch)

    @cached_property
    def velocity(self) -> tuple[Complexes, Complexes]:
        """(dd/dt, dx/dt) in the reference position, complex, shape (n,) each."""
        h, g, n, k, j2, b_x, b_y = self.forms[:, 0]
        with np.errstate(all="ignore"):
            q = (g * n - h * j2) / (2 * k)
            if self.branch.any():
                q = np.where(self.branch == 0, q, crossing(self.forms, self.circle, self.branch))
            y = self.unit * (q * (b_y - 1j * b_x) - h * (b_x + 1j * b_y)) / n
        crank = self.chart != COUPLER
        return np.where(crank, 2j * self.lever, y), np.where(crank, y, 2j)

    def velocity_of(self, z: Complexes) -> Complexes:
        """Compute velocities of coupler points z in the reference position.

        Complex, shape (n,), per unit of the parameter t.
        """
        d, x = self.velocity
        return np.asarray(d + x * (z - self.origin))


@dataclass(frozen=True)
class Path(Columns):
    """Paths of one coupler point per linkage, as displacements (u, v) along given axes.

    NaN beyond a turning point of the chart.
    """

    forms: Floats  # (9, 3, n), at change points (10, 3, n)
    circle: Floats
    branch: Floats

    def __call__(self, t: Floats) -> tuple[Floats, Floats]:
        """Return the displacement (u, v), each (m, n), at the parameters t (m, n)."""
        c = self.forms
        return self._solve((c[:, 2, None] * t + c[:, 1, None]) * t + c[:, 0, None], np.asarray(t))

    def window(self, low: Floats, high: Floats, nodes: Floats) -> tuple[Floats, Floats]:
        """Compute displacements over windows of the parameter.

        Parameters
        ----------
        low, high : ndarray, shape (n,)
            Ends of the window of each linkage.
        nodes : ndarray, shape (m,)
            Places in a window, from -1 to 1.

        Returns
        -------
        tuple of ndarray, shape (m, n)
            Displacements u and v.
        """
        n = self.forms.shape[-1]
        rows = max(1, BLOCK // len(nodes))
        if n > rows:
            u = np.empty((len(nodes), n), dtype=self.forms.dtype)
            v = np.empty_like(u)
            for start in range(0, n, rows):
                part = slice(start, start + rows)
                u[:, part], v[:, part] = self[part].window(low[part], high[part], nodes)
            return u, v
        middle, half = 0.5 * (high + low), 0.5 * (high - low)
        c0, c1, c2 = self.forms[:, 0], self.forms[:, 1], self.forms[:, 2]
        shifted = np.stack([(c2 * middle + c1) * middle + c0, (c1 + 2 * c2 * middle) * half, c2 * half * half], axis=1)
        powers = np.stack([np.ones_like(nodes), nodes, nodes * nodes], axis=1)
        return self._solve(powers @ shifted, middle + half * nodes[:, None])

    def _solve(self, forms: Floats, t: Floats) -> tuple[Floats, Floats]:
        """Intersect circle and line; forms (9 or 10, m, n), t (m, n).  `forms` is overwritten."""
        h, g, n, k, j2, b_x, b_y, l_x, l_y = forms[:9]
        mixed = (self.circle * t * h - j2) * h
        g *= n
        mixed += g
        with np.errstate(all="ignore"):
            root = np.sqrt(k * k - self.circle * t * mixed)
            q = mixed / (k + root)
            # where K has changed its sign use the other form of the same root, which a pair of
            # lines does not have
            if np.fmin.reduce(k, axis=None, initial=np.inf) <= 0:
                q = np.where(k <= 0, np.where(self.circle > 0, (k - root) / t, np.nan), q)
            if len(forms) > 9:
                q = np.where(self.branch == 0, q, root_of(h, k, forms[9], self.circle, self.branch))
            n = 1 / n
            scale = t / (1 + t * t)
            q *= n
            h *= n
            u = q * b_y
            b_y *= h
            h *= b_x
            b_x *= q
            u -= h
            b_x += b_y
            u += l_x
            l_y -= b_x
            u *= scale
            l_y *= scale
        return u, l_y


def motion(
    linkage: Linkage,
    chart: Integers | int,
    origin: Complexes | None = None,
    dtype: Any = float,
    pole: Complexes | None = None,
) -> Motion:
    """Set up the motion of n linkages in charts.

    A crank chart of a dyad that is no crank has conditioning 0 and an empty interval.  In a crank
    chart poses lose digits where the pin of the driving crank comes near the other dyad's fixed
    pivot: the error of the rotation is about 1e-16 over the square of their distance in sizes of
    the linkage.

    Parameters
    ----------
    linkage : Linkage of n
    chart : int or ndarray of int, shape (n,)
    origin : complex ndarray, shape (n,), optional
        Origin of the coupler chart; the guided point keeps most digits.
    dtype : type
        Working precision, float or numpy.longdouble; the latter is double where the platform has no
        extended precision.
    pole : complex ndarray, shape (n,), optional
        Pole in the reference position: selects the branch of linkages at a change point.
    """
    chart = np.broadcast_to(np.asarray(chart), len(linkage))
    pivots = linkage.pivots.astype(dtype)
    z, w = pivots[..., 0] + 1j * pivots[..., 1], pivots[..., 2]
    start = np.zeros(len(linkage), dtype=z.dtype) if origin is None else np.asarray(origin).astype(z.dtype)
    origin = np.where(chart == COUPLER, start, np.where(chart == CRANK_1, z[:, 0, 1], z[:, 1, 1]))
    # dyad 1 is the driving crank of a crank chart; in the coupler chart it gives the circle, if
    # there is a crank
    swap = np.where(chart == COUPLER, linkage.dyads[:, 0] != RR, chart == CRANK_2)[:, None]
    z = np.where(w != 0, z - origin[:, None, None], z)
    # forms are products of up to four lengths, discriminants of eight: in a unit near the size none
    # overflows, and a power of 2 avoids rounding
    unit = np.ldexp(np.ones((), dtype), np.frexp(np.where(w != 0, np.abs(z), 0).max((1, 2)))[1])
    z = np.where(w != 0, z / unit[:, None, None], z)
    z, w = (np.where(swap[..., None], p[:, ::-1], p) for p in (z, w))
    kind = np.where(swap, linkage.dyads[:, ::-1], linkage.dyads)
    crank = chart != COUPLER
    parts = zip(coupler_chart(z, w), crank_chart(z, w, kind), strict=True)
    forms, limit, low, high, scale, circle = (np.where(crank, second, first) for first, second in parts)
    impossible = crank & (kind[:, 0] != RR)
    with np.errstate(all="ignore"):
        conditioning = np.where(impossible, 0, np.abs(forms[K, 0]) / scale)
    interval = np.stack([nearest(limit, low, high, -1), nearest(limit, low, high, 1)])
    interval[:, impossible] = 0
    # exchange the line's two ends, so that the first root is always the right one
    side = np.where(forms[K, 0] < 0, -1, 1)
    forms = np.where(np.isin(np.arange(7), (G, N))[:, None, None], forms, side * forms)
    lever = np.where(crank, unit * (z[:, 0, 1] - z[:, 0, 0]), 0)
    branch = np.zeros(len(linkage), dtype=pivots.dtype)
    change = ~crank & (conditioning < CHANGE) & crossed(forms, scale)
    if pole is not None and change.any():
        forms, branch = at_change(forms, circle, unit, origin, np.asarray(pole), change)
        conditioning = np.where(branch != 0, 1.0, conditioning)
        for level in (low, high):  # here the form touches the limit without crossing it
            touched = change & (np.abs(limit[0] - level) <= TANGENT_DISTANCE * np.abs(limit).max(0))
            limit[:, touched] = np.stack([level, limit[1], np.zeros_like(level)])[:, touched]
        interval = np.where(change, np.stack([nearest(limit, low, high, side) for side in (-1, 1)]), interval)
    unit = np.where(crank, 1, unit)
    return Motion(linkage, chart, conditioning, interval, forms, circle, origin, lever, unit, branch)


def conditioning(linkage: Linkage) -> Floats:
    """Measure the conditioning of each chart in the reference position, shape (3, n).

    Coupler chart: sine of the angle between the two rays. Crank chart: sine of the transmission
    angle while that crank drives. All three vanish only at a change point, where all pivots lie on
    one line.
    """
    return np.asarray(np.nan_to_num(np.stack([motion(linkage, chart).conditioning for chart in CHARTS])))
