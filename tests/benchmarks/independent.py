"""An independent way to measure placed guides: nothing of it comes from `catalogue`.

Loops are closed by intersecting circles (or a circle and a line) for a given angle of a crank.  A guide is placed: its
guided point runs along a path from (0, 0) to (stroke, 0), arcs bulging to +y, and its pivots are those at the moment at
which the guided point is at x = stroke / 2.  The branch is kept because the side on which the circles meet is kept, and
because the path must advance in x from its beginning to its end.

`Guides` are many four-bars (RR·RR) or slider-cranks (RR·PR), in strokes; `independent_programme` improves them and
`independent_search` searches them.  `measured` knows every pair of dyads.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import linprog
from scipy.spatial import ConvexHull, QhullError

Array = np.ndarray[Any, Any]
#: A transmission angle below which a linkage is at a dead point [deg].
DEAD = 0.01
#: Stations along the path of a search, and of a final measurement.
COARSE, FINE = 25, 2001


# -- the motion -------------------------------------------------------------------------------------------------------
@dataclass(frozen=True)
class Guides:
    """n linkages in mid-stroke.

    Attributes
    ----------
    a, b : complex ndarray, shape (n,)
        Fixed and moving pivot of the first dyad, a crank.
    c, d : complex ndarray, shape (n,)
        The same of the second; of a slider c is the unit normal of its line.
    p : complex ndarray, shape (n,)
        Guided point.
    slider : bool
        Whether the second dyad is one.
    """

    a: Array
    b: Array
    c: Array
    d: Array
    p: Array
    slider: bool

    def __getitem__(self, index: Any) -> Guides:
        a, b, c, d, p = (getattr(self, name)[index] for name in "abcdp")
        return Guides(a, b, c, d, p, self.slider)

    def swapped(self, where: Array) -> Guides:
        """Return four-bars with their cranks exchanged where a mask says so."""
        a, b, c, d = (np.where(where, getattr(self, j), getattr(self, i)) for i, j in ("ac", "bd", "ca", "db"))
        return Guides(a, b, c, d, self.p, False)

    def moved(self, factor: Array | complex, shift: Array | complex) -> Guides:
        """Return the guides turned and scaled by a complex factor, then shifted."""
        a, b, c, d, p = (factor * getattr(self, name) + shift for name in "abcdp")
        return Guides(a, b, factor / np.abs(factor) * self.c if self.slider else c, d, p, self.slider)

    def mirrored(self, about: complex = 0) -> Guides:
        """Return the guides mirrored in the x axis (about 0) or in the line x = about."""

        def image(z: Array, free: bool = False) -> Array:
            return np.conj(z) if about == 0 else (0 if free else 2 * about) - np.conj(z)

        return Guides(image(self.a), image(self.b), image(self.c, self.slider), image(self.d), image(self.p),
                      self.slider)  # fmt: skip


@dataclass(frozen=True)
class Poses:
    """Positions of n guides at m angles of the first crank, shape (m, n); NaN where the loop is open.

    `p_slope` and the like are not lengths but derivatives by the angle.
    """

    b: Array
    d: Array
    p: Array
    p_slope: Array


def posed(g: Guides, angle: Array) -> Poses:
    """Return the positions at angles of the first crank from mid-stroke [rad], shape (m, n)."""
    b = g.a + (g.b - g.a) * np.exp(1j * angle)
    bar = g.d - g.b
    length2 = bar.real**2 + bar.imag**2
    if g.slider:
        side = np.sign((g.c.conj() * bar).imag)
        away = (g.c.conj() * (g.d - b)).real
        d = b + g.c * (away + 1j * side * np.sqrt(length2 - away * away))
        ray = np.broadcast_to(g.c, d.shape)
    else:
        side = np.sign(((g.c - g.b).conj() * bar).imag)
        apart = g.c - b
        apart2 = apart.real**2 + apart.imag**2
        rocker = np.abs(g.d - g.c)
        along = 0.5 * (1 + (length2 - rocker**2) / apart2)
        d = b + apart * (along + 1j * side * np.sqrt(length2 / apart2 - along * along))
        ray = d - g.c
    turn = (d - b) / bar
    p = b + turn * (g.p - g.b)
    speed = 1j * (b - g.a)  # of b; that of d is square to its ray
    rate = -(speed.conj() * ray).real / ((1j * (d - b)).conj() * ray).real
    return Poses(b, d, p, speed + 1j * rate * (p - b))


@dataclass(frozen=True)
class Walk:
    """The way of n guides along their paths, from x = 0 to x = 1, or NaN.

    Attributes
    ----------
    ends : ndarray, shape (2, n)
        Angles of the first crank at both ends [rad].
    poses : Poses
        At Chebyshev points between them.
    good : ndarray of bool, shape (n,)
        Whether the path reaches both ends and advances all the way.
    """

    ends: Array
    poses: Poses
    good: Array


def walk(g: Guides, stations: int = COARSE, guess: Array | None = None, rounds: int = 25) -> Walk:
    """Follow the guides along their paths by turning the first crank.

    Parameters
    ----------
    guess : ndarray, shape (2, n), optional
        Angles at the ends, from a neighbour.
    """
    target = np.array([[0.0], [1.0]])
    with np.errstate(all="ignore"):
        slope = posed(g, np.zeros((1, len(g.p)))).p_slope[0].real
        known = np.zeros((2, len(g.p)))
        angle = np.clip((target - g.p.real) / slope, -0.4, 0.4) if guess is None else guess
        miss = np.full_like(angle, np.inf)
        for _ in range(rounds):
            now = posed(g, angle)
            miss = target - now.p.real
            open_ = np.isnan(miss)
            step = np.clip(miss / now.p_slope.real, -0.4, 0.4)
            known = np.where(open_, known, angle)
            if not ((np.abs(step) > 1e-12) | open_).any():
                break
            angle = np.where(open_, 0.5 * (known + angle), angle + step)
        share = 0.5 - 0.5 * np.cos(np.pi * np.arange(stations) / (stations - 1))[:, None]
        poses = posed(g, angle[0] + (angle[1] - angle[0]) * share)
        ahead = poses.p_slope.real * np.sign(angle[1] - angle[0])
        good = (np.abs(miss) < 1e-9).all(0) & (ahead > 0).all(0) & ((angle[0] < 0) != (angle[1] < 0))
    return Walk(angle, poses, good)


def sines(g: Guides, poses: Poses) -> tuple[Array, Array]:
    """Return the sines of the transmission angles, signed, the first and the second crank driving, shape (m, n) each.

    The second are NaN for a slider, which does not drive.
    """
    bar = poses.d - poses.b
    length = np.abs(g.d - g.b)
    if g.slider:
        first = (bar.conj() * g.c).imag / length
        return first, np.full_like(first, np.nan)
    first = (bar.conj() * (poses.d - g.c)).imag / (length * np.abs(g.d - g.c))
    second = (bar.conj() * (poses.b - g.a)).imag / (length * np.abs(g.b - g.a))
    return first, second


def least_angle(sine: Array) -> Array:
    """Return the least transmission angle of each column [deg]; 0 where the sine changes its sign."""
    through = (sine.min(0) < 0) & (sine.max(0) > 0)
    return np.where(through, 0.0, np.degrees(np.arcsin(np.clip(np.abs(sine).min(0), 0, 1))))


def turning(g: Guides) -> Array:
    """Return by how much each crank turns fully, shape (2, n): the least distance of the circles about its end from
    touching, over a turn that includes the positions in line with the frame [length]; NaN for a slider."""
    around = np.exp(1j * np.pi * np.arange(8) / 4)[:, None]
    bar = np.abs(g.d - g.b)
    if g.slider:
        away = (g.c.conj() * (g.d - g.a)).real - np.abs(g.b - g.a) * around.real  # c is where the angle is 0
        return np.stack([(bar - np.abs(away)).min(0), np.full(len(bar), np.nan)])
    out = []
    for fixed, moving, other, end in ((g.a, g.b, g.c, g.d), (g.c, g.d, g.a, g.b)):
        frame, rocker = other - fixed, np.abs(end - other)
        far = np.abs(np.abs(frame) - np.abs(moving - fixed) * around)
        out.append(np.minimum(bar + rocker - far, far - np.abs(bar - rocker)).min(0))
    return np.stack(out)


def angle_of_turn(g: Guides, steps: int = 4001) -> float:
    """Return the least transmission angle [deg] of one guide over the whole turn of its first crank; 0 if that does
    not turn fully."""
    angles = np.linspace(0, 2 * np.pi, steps)[:, None]
    return float(least_angle(sines(g, posed(g, angles))[0])[0]) if turning(g)[0, 0] >= 0 else 0.0


# -- deviations -------------------------------------------------------------------------------------------------------
def strip(path: Array) -> tuple[float, complex, complex]:
    """Return half the width of the narrowest strip that holds points, a point of its middle, and its direction."""
    chord = (path[-1] - path[0]) / abs(path[-1] - path[0])
    w = (path - path[0]) * np.conj(chord)
    scale = np.abs(w.imag).max()
    if scale < 1e-15 * abs(path[-1] - path[0]):
        return float(scale), complex(path[0]), complex(chord)
    try:
        hull = ConvexHull(np.stack([w.real, w.imag / scale], axis=1))
    except QhullError:
        return float(scale), complex(path[0]), complex(chord)
    edges = hull.equations[:, :2] / np.array([1.0, scale])  # normals in true proportions
    normals = (edges[:, 0] + 1j * edges[:, 1]) / np.hypot(edges[:, 0], edges[:, 1])
    corners = w[hull.vertices]
    across = (normals.conj()[:, None] * corners).real
    best = int(np.argmin(np.ptp(across, axis=1)))
    normal = normals[best] * (1 if normals[best].imag > 0 else -1)
    middle = 0.5 * ((normal.conjugate() * corners).real.max() + (normal.conjugate() * corners).real.min())
    return 0.5 * float(np.ptp(across[best])), complex(path[0] + chord * normal * middle), complex(-1j * normal * chord)


def arc(path: Array, radius: float | None = None) -> tuple[float, complex, float]:
    """Return the largest distance from the best-placed arc near a path, its centre and its radius.

    Parameters
    ----------
    radius : float, optional
        Of the arc; the best one if not given (half the width of the narrowest annulus).
    """
    z = path.astype(np.clongdouble)
    first, middle, last = z[0], z[len(z) // 2], z[-1]
    if radius is None:
        p, q = middle - first, last - first
        centre = first + 1j * (abs(p) ** 2 * q - abs(q) ** 2 * p) / (2 * (p * q.conjugate()).imag)
        own = abs(first - centre)
    else:
        own = np.longdouble(radius)
        half = abs(last - first) / 2
        bulge = 1j * (last - first) / abs(last - first)
        centre = (first + last) / 2 - bulge * np.sqrt(own**2 - half**2)  # bulging to the left of the way
    best = (np.inf, complex(centre), float(own))
    for _ in range(12):
        ray = z - centre
        far = np.abs(ray)
        rest = (far - own).astype(float)
        if radius is None:
            own += np.longdouble(0.5 * (rest.max() + rest.min()))
            rest = (far - own).astype(float)
        if np.abs(rest).max() >= best[0] * (1 - 1e-12):
            break
        best = (float(np.abs(rest).max()), complex(centre), float(own))
        scale = best[0]
        ray = (ray / far).astype(complex)
        slopes = np.stack([-ray.real, -ray.imag, *([] if radius is not None else [-np.ones(len(z))])], axis=1)
        basis, upper = np.linalg.qr(slopes)
        basis *= np.sqrt(len(z))
        size = basis.shape[1]
        one = np.ones((len(z), 1))
        found = linprog(
            np.eye(size + 1)[-1], np.block([[basis, -one], [-basis, -one]]), np.concatenate([-rest, rest]) / scale,
            bounds=[(None, None)] * size + [(0, None)], method="highs",
        )  # fmt: skip
        if found.x is None:
            break
        step = np.linalg.solve(upper, found.x[:size] * np.sqrt(len(z))) * scale
        centre = centre + step[0] + 1j * step[1]
        if radius is None:
            own = own + step[2]
    return best


# -- one guide, measured finely ---------------------------------------------------------------------------------------
@dataclass(frozen=True)
class Measured:
    """What one placed guide is worth, in the unit of its pivots.

    Attributes
    ----------
    deviation : float
        Half the width of the narrowest strip or annulus, or the largest distance from the best-placed arc of a radius.
    radius : float or None
        Of that arc, negative if it bulges to -y; None for a line.
    size : float
        Diameter of the finite pivots and the path.
    max_link, min_link, max_ground, max_arm : float or None
        Longest and shortest of the cranks and the coupler; distance of the fixed pivots; distance of the guided point
        from the nearer moving pivot.
    min_transmission : float
        The better crank driving, or that which turns fully [deg].
    min_transmission_turn : float
        The same over its whole turn; 0: it does not turn fully; NaN: not known.
    turning : float
        By how much the crank turns fully that does so best [length]; negative: none does; NaN: not known.
    fixed, moving : list of complex
        Finite pivots in mid-stroke.
    off : float
        Largest distance of the ends of the path from (0, 0) and (stroke, 0), and of the guided point from x = stroke/2.
    """

    deviation: float
    radius: float | None
    size: float
    max_link: float | None
    min_link: float | None
    max_ground: float | None
    max_arm: float | None
    min_transmission: float
    min_transmission_turn: float
    turning: float
    fixed: list[complex]
    moving: list[complex]
    off: float


Pivots = Any
Moves = Callable[[Array], tuple[Array, Array]]


def measured(
    pivots: Pivots, guided: Any, stroke: float, *, circle: bool, radius: float | None = None, turns: bool = False,
    stations: int = FINE,
) -> Measured | None:  # fmt: skip
    """Measure one placed linkage; None where its path cannot be followed from x = 0 to x = stroke.

    It is by turning a crank, or the coupler if no crank gets beyond a dead point; at a change point in mid-stroke along
    the branch with the least deviation.

    Parameters
    ----------
    pivots : (2, 2, 3) numbers
        Dyad, (fixed, moving), (x, y, w); w = 0 at infinity: of a fixed pivot the normal of the slider's line, of a
        moving one the normal of a line of the coupler.
    guided : (x, y)
        Guided point in mid-stroke.
    radius : float, optional
        That an arc must have.
    turns : bool
        Whether what drives is a crank that turns fully, where there is one.
    """
    z = np.asarray(pivots, float)
    point = complex(*guided) / stroke
    place = z[..., 0] + 1j * z[..., 1]
    finite = z[..., 2] != 0
    place = np.where(finite, place / np.where(finite, z[..., 2], 1) / stroke, place / np.abs(place))
    best, driver, mark = None, 0, (False, -1.0)
    for first in (0, 1):
        if finite[first].all() or not finite.all(axis=1).any():
            order = [first, 1 - first]
            found = _followed(_moves(place[order], finite[order], point), stations)
            guide = _guide(place[order], finite[order], point)
            own = turns and guide is not None and bool(turning(guide)[0, 0] >= 0)
            if found is not None and (own, found[1]) > mark:
                best, driver, mark = found, first, (own, found[1])
    if best is None or best[1] < DEAD:
        order = [0, 1] if finite[0].all() else [1, 0]
        ways = [] if best is None else [best[0]]
        if finite[order[0]].all() and finite[:, 1].all():
            for turn in (
                _turned(place[order], finite[order], point, side, flip) for side in (1, -1) for flip in (0, 1)
            ):
                found = _followed(turn, stations)
                if found is not None:
                    ways.append(found[0])
        if not ways:
            return None
        best = min(ways, key=lambda w: arc(_up(w))[0] if circle else strip(w)[0]), 0.0
    path, angle = best
    order = [driver, 1 - driver]
    return _summed(place[order], finite[order], point, path, angle, stroke, circle, radius)


def _guide(z: Array, finite: Array, point: complex) -> Guides | None:
    """Return a four-bar or a slider-crank whose crank is the first dyad, None of others."""
    if not (finite[0].all() and finite[1, 1]):
        return None
    (a, b), (c, d) = z.tolist()
    fixed, pin, other, end, guided = (np.array([v]) for v in (a, b, c, d, point))
    return Guides(fixed, pin, other, end, guided, not finite[1, 0])


def _moves(z: Array, finite: Array, point: complex) -> Moves:
    """Return what gives the guided point, and the sine of the transmission angle, for angles of the first dyad's crank,
    or of the coupler if it is none, in strokes: (angles) -> path, sines."""
    (a, b), (c, d) = z.tolist()

    def slides(angle: Array) -> tuple[Array, Array]:
        """No crank: two lines for the guided point at each turn of the coupler."""
        turn = np.exp(1j * angle)
        normals, offsets = [], []
        for (fixed, moving), (stays, _) in zip(z.tolist(), finite.tolist(), strict=True):
            if not stays:  # a pivot of the coupler on a fixed line
                normals.append(fixed + 0 * turn)
                offsets.append(dot(fixed, moving) - dot(fixed, turn * (moving - point)))
            else:  # a line of the coupler through a fixed point
                normals.append(turn * moving)
                offsets.append(dot(turn * moving, fixed) - dot(moving, fixed - point))
        (n, m), (e, f) = normals, offsets
        path = 1j * (n * f - m * e) / (n.conj() * m).imag
        at = [path + turn * (w - point) for w in (b, d)]
        hold = [at[i] if finite[i, 1] else z[i, 0] + 0 * turn for i in (0, 1)]
        arm = turn * b if not finite[0, 1] else hold[1] - at[0]
        return path, sine_between(arm, normals[1])

    def cranks(angle: Array) -> tuple[Array, Array]:
        if finite[1, 1]:
            guide = _guide(z, finite, point)
            assert guide is not None
            poses = posed(guide, angle)
            ray = np.full_like(poses.d, c) if not finite[1, 0] else poses.d - c
            return poses.p, sine_between(poses.d - poses.b, ray)
        first = a + (b - a) * np.exp(1j * angle)
        away = c - first
        share = dot(d, c - b) / np.abs(away)
        side = np.sign((np.conj(c - b) * d).imag)
        normal = away / np.abs(away) * (share + 1j * side * np.sqrt(1 - share * share))
        return first + normal / d * (point - b), sine_between(away, normal)

    return cranks if finite[0].all() else slides


def _turned(z: Array, finite: Array, point: complex, side: int, flip: int) -> Moves:
    """Return the same as `_moves` for angles of the coupler; `flip` changes the side on which the circles meet when the
    coupler comes through mid-stroke, as it does at a change point."""
    (a, b), (c, d) = z.tolist()

    def moves(angle: Array) -> tuple[Array, Array]:
        turn = np.exp(1j * angle)
        at, r = side * (np.where(angle < 0, -1, 1) if flip else 1), abs(b - a)
        if finite[1, 0]:
            apart = c - turn * (d - b) - a
            along = 0.5 * (np.abs(apart) + (r**2 - abs(d - c) ** 2) / np.abs(apart))
            way = apart / np.abs(apart)
        else:
            way, along = c + 0 * turn, dot(c, d - turn * (d - b) - a)
        square = r**2 - along**2
        first = a + way * (along + 1j * at * np.sqrt(np.where(square > -1e-13 * r**2, np.maximum(square, 0), square)))
        path = first + turn * (point - b)
        start = abs(a - b + way.ravel()[0] * (along + 1j * at * np.sqrt(np.maximum(square, 0))).ravel()[0])
        # the first angle asked for is 0: not the reference position if the circles meet on the other side
        return (path if angle.ravel()[0] != 0 or start < 1e-6 * r else np.nan * path), np.ones(angle.shape)

    return moves


def _up(path: Array) -> Array:
    """Return a path mirrored, if need be, so that it bulges to +y."""
    return path if path[len(path) // 2].imag > 0.5 * (path[0].imag + path[-1].imag) else path.conj()


def dot(a: Any, b: Any) -> Any:
    return (np.conj(a) * b).real


def sine_between(a: Array, b: Array) -> Array:
    sine: Array = (np.conj(a) * b).imag / (np.abs(a) * np.abs(b))
    return sine


def _followed(moves: Moves, stations: int) -> tuple[Array, float] | None:
    """Return the path from x = 0 to x = 1 and its least transmission angle [deg]; None if it cannot be followed."""
    steps = np.linspace(0, 2 * np.pi, 6001)[:, None]
    with np.errstate(all="ignore"):
        ends = []
        here = float(moves(steps[:1])[0].real[0, 0])
        for target in (0.0, 1.0):
            found = []
            for sign in (1, -1):
                x = moves(sign * steps)[0].real[:, 0]
                ahead = (x - target) * np.sign(target - here)
                beyond = np.flatnonzero(~(ahead < 0))
                if not beyond.size or not ahead[beyond[0]] >= 0 or not (np.diff(ahead[: beyond[0] + 1]) > 0).all():
                    continue
                low, high = steps[max(beyond[0] - 1, 0), 0], steps[beyond[0], 0]
                for _ in range(60):
                    middle = 0.5 * (low + high)
                    value = (moves(np.array([[sign * middle]]))[0].real[0, 0] - target) * np.sign(target - here)
                    low, high = (middle, high) if value < 0 else (low, middle)
                found.append(sign * high)
            if not found:
                return None
            ends.append(found)
        pair = next(((i, j) for i in ends[0] for j in ends[1] if (i < 0) != (j < 0)), None)
        if pair is None:
            return None
        share = 0.5 - 0.5 * np.cos(np.pi * np.arange(stations) / (stations - 1))[:, None]
        path, sine = moves(pair[0] + (pair[1] - pair[0]) * share)
    if not np.isfinite(path).all():
        return None
    return path[:, 0], float(least_angle(sine)[0])


def _summed(
    z: Array, finite: Array, point: complex, path: Array, angle: float, stroke: float, circle: bool,
    radius: float | None,
) -> Measured:  # fmt: skip
    """Return the measures of a guide, in strokes but for `stroke` and `radius`."""
    (a, b), (c, d) = z.tolist()
    if circle:
        bulge = np.sign(path[len(path) // 2].imag - 0.5 * (path[0].imag + path[-1].imag)) or 1.0
        deviation, _, fitted = arc(path if bulge > 0 else path.conj(), None if radius is None else radius / stroke)
        flat = strip(path)[0] if radius is None else np.inf  # an arc of radius infinity
        deviation, radius = min(deviation, flat), float(bulge * fitted * stroke)
        if radius is not None and flat < np.inf and deviation == flat:
            radius = float(bulge * np.inf)
    else:
        deviation = strip(path)[0]
        radius = None
    pivots = z[finite]
    points = np.concatenate([pivots, path[:: max(1, len(path) // 100)], path[-1:]])
    links = [abs(p - q) for p, q, whole in ((a, b, finite[0].all()), (c, d, finite[1].all()),
                                            (b, d, finite[:, 1].all())) if whole]  # fmt: skip
    arms = [abs(point - q) for q, whole in zip((b, d), finite[:, 1], strict=True) if whole]
    turns = whole_turn = np.nan
    if (guide := _guide(z, finite, point)) is not None:
        turns, whole_turn = float(np.nanmax(turning(guide))), angle_of_turn(guide)
    elif finite.sum() == 3:  # a crank and a line of the coupler: its distance from the crank's end, and the frame
        crank = 0 if finite[0].all() else 1
        (e, f), (g, h) = z[crank].tolist(), z[1 - crank].tolist()
        turns = abs(abs(g - e) - abs(f - e)) - abs(dot(h, g - f))
    off = max(abs(path[0]), abs(path[-1] - 1), abs(point.real - 0.5))
    size = float(np.abs(points[:, None] - points).max())

    def scaled(values: list[float], pick: Callable[[list[float]], float]) -> float | None:
        return float(pick(values)) * stroke if values else None

    return Measured(
        float(deviation) * stroke, radius, size * stroke, scaled(links, max), scaled(links, min),
        abs(a - c) * stroke if finite[:, 0].all() else None, scaled(arms, min), angle, whole_turn, turns * stroke,
        [complex(v) * stroke for v in z[:, 0][finite[:, 0]]], [complex(v) * stroke for v in z[:, 1][finite[:, 1]]],
        off * stroke,
    )  # fmt: skip


def violations(m: Measured, constraints: Mapping[str, Any], asked: float, stroke: float) -> dict[str, float]:
    """Return by how much a guide breaks each constraint, in strokes (degrees over 90), positive where it does.

    Constraints are named as by `catalogue.Catalogue.find`; families and the like are not looked at.

    Parameters
    ----------
    asked : float
        Largest deviation.
    """
    out = {"deviation": (m.deviation - asked) / stroke}
    for name, value in (("size", m.size), ("link", m.max_link), ("ground", m.max_ground), ("arm", m.max_arm)):
        bound = constraints.get(f"max_{name}")
        if bound is not None and value is not None:
            out[f"max_{name}"] = (value - bound) / stroke
    if constraints.get("min_link") is not None and m.min_link is not None:
        out["min_link"] = (constraints["min_link"] - m.min_link) / stroke
    if constraints.get("min_transmission"):
        out["min_transmission"] = (constraints["min_transmission"] - m.min_transmission) / 90
    if constraints.get("full_rotation"):
        out["full_rotation"] = -m.turning / stroke
    for name, places in (("fixed_pivots_in", m.fixed), ("pivots_in", m.fixed + m.moving)):
        box = constraints.get(name)
        if box is not None:
            (x0, x1), (y0, y1) = sorted(box[::2]), sorted(box[1::2])
            out[name] = max(
                (max(x0 - p.real, p.real - x1, y0 - p.imag, p.imag - y1) / stroke for p in places), default=0.0
            )
    return out


def cost(m: Measured, rank_by: str, stroke: float, turns: bool) -> float:
    """Return what is ranked by, less is better: lengths in strokes, balance and transmission in their own unit; where a
    crank is to turn fully its transmission angle is that over the turn."""
    angle = m.min_transmission_turn if turns else m.min_transmission
    if rank_by == "size":
        return m.size / stroke
    if rank_by == "balance":
        return m.size / stroke - angle / 90
    if rank_by == "transmission":
        return 1 - angle / 90
    if rank_by == "deviation":
        return m.deviation / stroke
    raise ValueError(f"no cost is known for {rank_by!r}")
