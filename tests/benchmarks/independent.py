"""An independent way to measure placed guides: nothing of it comes from `catalogue`.

Loops are closed by intersecting circles (or a circle and a line) for a given angle of a crank.  A guide is placed: its
guided point runs along a path from (0, 0) to (stroke, 0), arcs bulging to +y, and its pivots are those at the moment at
which the guided point is at x = stroke / 2.  The branch is kept because the side on which the circles meet is kept, and
because the path must advance in x from its beginning to its end.

`Guides` are many four-bars, slider-cranks or inverted slider-cranks, in strokes; `independent_programme` improves them
and `independent_search` searches them.  `independent_figures.measured` knows every pair of dyads.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from scipy.optimize import linprog
from scipy.spatial import ConvexHull, QhullError

Array = np.ndarray[Any, Any]
#: Families of linkages that are searched.
BAR, SLIDER, SLIDE = FAMILIES = ("four-bar", "slider-crank", "inverted-slider-crank")
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
        Fixed and moving pivot of the second dyad; of a slider c is the unit normal of its line; of a slide d is the
        unit normal of a line of the coupler, through c.
    p : complex ndarray, shape (n,)
        Guided point.
    family : str
        One of `FAMILIES`.
    """

    a: Array
    b: Array
    c: Array
    d: Array
    p: Array
    family: str

    def __getitem__(self, index: Any) -> Guides:
        a, b, c, d, p = (getattr(self, name)[index] for name in "abcdp")
        return Guides(a, b, c, d, p, self.family)

    def swapped(self, where: Array) -> Guides:
        """Return four-bars with their cranks exchanged where a mask says so."""
        a, b, c, d = (np.where(where, getattr(self, j), getattr(self, i)) for i, j in ("ac", "bd", "ca", "db"))
        return Guides(a, b, c, d, self.p, BAR)

    def moved(self, factor: Array | complex, shift: Array | complex) -> Guides:
        """Return the guides turned and scaled by a complex factor, then shifted."""
        a, b, c, d, p = (factor * getattr(self, name) + shift for name in "abcdp")
        c = factor / np.abs(factor) * self.c if self.family == SLIDER else c
        d = factor / np.abs(factor) * self.d if self.family == SLIDE else d
        return Guides(a, b, c, d, p, self.family)

    @property
    def pivots(self) -> list[Array]:
        """Finite pivots."""
        return [getattr(self, name) for name in {BAR: "abcd", SLIDER: "abd", SLIDE: "abc"}[self.family]]

    @property
    def links(self) -> list[Array]:
        """Lengths of cranks and coupler, between finite pivots."""
        crank, bar = np.abs(self.b - self.a), np.abs(self.d - self.b)
        return {BAR: [crank, bar, np.abs(self.d - self.c)], SLIDER: [crank, bar], SLIDE: [crank]}[self.family]

    @property
    def frame(self) -> list[Array]:
        """Distance of the fixed pivots, if both are finite."""
        return [] if self.family == SLIDER else [np.abs(self.c - self.a)]

    @property
    def arms(self) -> list[Array]:
        """Distances of the guided point from the finite moving pivots."""
        return [np.abs(self.p - z) for z in ((self.b,) if self.family == SLIDE else (self.b, self.d))]

    def mirrored(self, about: complex = 0) -> Guides:
        """Return the guides mirrored in the x axis (about 0) or in the line x = about."""

        def image(z: Array, free: bool = False) -> Array:
            return np.conj(z) if about == 0 else (0 if free else 2 * about) - np.conj(z)

        c, d = image(self.c, self.family == SLIDER), image(self.d, self.family == SLIDE)
        return Guides(image(self.a), image(self.b), c, d, image(self.p), self.family)


@dataclass(frozen=True)
class Poses:
    """Positions of n guides at m angles of the first crank, shape (m, n); NaN where the loop is open.

    `d` is a normal of a slide; `turn` the unit vector of the coupler, 1 in mid-stroke; `p_slope` the derivative of the
    guided point by the angle.
    """

    b: Array
    d: Array
    p: Array
    turn: Array
    p_slope: Array


def posed(g: Guides, angle: Array) -> Poses:
    """Return the positions at angles of the first crank from mid-stroke [rad], shape (m, n)."""
    b = g.a + (g.b - g.a) * np.exp(1j * angle)
    if g.family == SLIDE:
        return _posed_slide(g, b)
    bar = g.d - g.b
    length2 = bar.real**2 + bar.imag**2
    if g.family == SLIDER:
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
    return Poses(b, d, p, turn, speed + 1j * rate * (p - b))


def _posed_slide(g: Guides, b: Array) -> Poses:
    """Return the positions of inverted slider-cranks: the line with the normal d keeps its distance from b."""
    away = g.c - b
    length = np.abs(away)
    share = (g.d.conj() * (g.c - g.b)).real / length
    side = np.sign(((g.c - g.b).conj() * g.d).imag)
    normal = away / length * (share + 1j * side * np.sqrt(1 - share * share))
    turn = normal / g.d
    p = b + turn * (g.p - g.b)
    speed = 1j * (b - g.a)
    rate = (normal.conj() * speed).real / ((1j * normal).conj() * away).real
    return Poses(b, normal, p, turn, speed + 1j * rate * (p - b))


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

    The second are NaN for a slider or slide, which does not drive.
    """
    if g.family == SLIDE:
        away = g.c - poses.b
        first = (away.conj() * poses.d).imag / np.abs(away)
        return first, np.full_like(first, np.nan)
    bar = poses.d - poses.b
    length = np.abs(g.d - g.b)
    if g.family == SLIDER:
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
    touching, over a turn that includes the positions in line with the frame [length]; NaN for a slider or slide."""
    around = np.exp(1j * np.pi * np.arange(8) / 4)[:, None]
    bar = np.abs(g.d - g.b)
    if g.family == SLIDE:  # the fixed pivot stays out of the circle that the line touches
        far = np.abs(np.abs(g.c - g.a) - np.abs(g.b - g.a) * around)
        return np.stack([(far - np.abs(dot(g.d, g.c - g.b))).min(0), np.full(len(bar), np.nan)])
    if g.family == SLIDER:
        away = (g.c.conj() * (g.d - g.a)).real - np.abs(g.b - g.a) * around.real  # c is where the angle is 0
        return np.stack([(bar - np.abs(away)).min(0), np.full(len(bar), np.nan)])
    out = []
    for fixed, moving, other, end in ((g.a, g.b, g.c, g.d), (g.c, g.d, g.a, g.b)):
        frame, rocker = other - fixed, np.abs(end - other)
        far = np.abs(np.abs(frame) - np.abs(moving - fixed) * around)
        out.append(np.minimum(bar + rocker - far, far - np.abs(bar - rocker)).min(0))
    return np.stack(out)


def dot(a: Any, b: Any) -> Any:
    """Return the inner product of two vectors."""
    return (np.conj(a) * b).real


def better_driver(g: Guides) -> tuple[Array, Walk]:
    """Return which guides are better driven by their second crank, and how they go by the better one."""
    first = walk(g)
    if g.family != BAR:
        return np.zeros(len(g.p), bool), first
    second = walk(g.swapped(np.ones(len(g.p), bool)))
    angles = [np.where(w.good, least_angle(np.nan_to_num(sines(h, w.poses)[0])), -1.0)
              for h, w in ((g, first), (g.swapped(np.ones(len(g.p), bool)), second))]  # fmt: skip
    use = angles[1] > angles[0]
    poses = Poses(*(np.where(use, getattr(second.poses, f.name), getattr(first.poses, f.name)) for f in fields(Poses)))
    return use, Walk(np.where(use, second.ends, first.ends), poses, np.where(use, second.good, first.good))


def best_driver(g: Guides) -> Guides:
    """Return guides whose first crank is the better driver."""
    use = better_driver(g)[0]
    return g.swapped(use) if use.any() else g


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
