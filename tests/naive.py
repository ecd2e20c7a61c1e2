"""The slow and obvious ways: loops closed by circles and lines, narrowest strip and annulus by search.

They share no formula with the catalogue.  Closures work on numpy arrays (of `longdouble`) and on single numbers of
mpmath alike.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import mpmath as mp  # type: ignore[import-untyped]  # it ships no types
import numpy as np
from scipy.optimize import least_squares, linprog, minimize
from scipy.spatial import ConvexHull

Array = Any
#: exp(i angle) and square root.
FAST: tuple[Any, Any] = (lambda a: np.exp(1j * a), np.sqrt)
EXACT: tuple[Any, Any] = (mp.expj, mp.sqrt)


# -- closing the loop -----------------------------------------------------------------------------------------------
def dot(a: Any, b: Any) -> Any:
    return (a.conjugate() * b).real


def circle_circle(c: Any, r: Any, c2: Any, r2: Any, side: int, root: Any) -> Any:
    """Return a common point of two circles."""
    apart = c2 - c
    square = dot(apart, apart)
    along = (square + r * r - r2 * r2) / (2 * square)
    return c + apart * (along + 1j * side * root(r * r / square - along * along))


def circle_line(c: Any, r: Any, normal: Any, offset: Any, side: int, root: Any) -> Any:
    """Return a common point of a circle and the line of all z with normal . z = offset; |normal| = 1."""
    away = offset - dot(normal, c)
    return c + normal * (away + 1j * side * root(r * r - away * away))


class Loop:
    """One linkage, closed for a given angle of a crank or the coupler, or a given way of a slider.

    Parameters
    ----------
    pivots : (2, 2, 3) numbers
    point : complex
        Guided point.
    exact : bool
        50 digits instead of extended precision.
    """

    def __init__(self, pivots: Any, point: complex, exact: bool = False) -> None:
        self.expj, self.root = EXACT if exact else FAST
        number: Any = (
            (lambda x, y: mp.mpc(float(x), float(y))) if exact else (lambda x, y: np.clongdouble(complex(x, y)))
        )
        dyads = [[(number(x, y), w != 0) for x, y, w in pair] for pair in pivots]
        kinds = ["RR" if f[1] and m[1] else "PR" if m[1] else "RP" for f, m in dyads]
        if (kinds[0] != "RR" and kinds[1] == "RR") or kinds == ["RP", "PR"]:
            dyads, kinds = dyads[::-1], kinds[::-1]
        self.kind = ".".join(kinds)
        (self.a, _), (self.a_star, _) = dyads[0]
        (self.b, _), (self.b_star, _) = dyads[1]
        if kinds[0] == "PR":
            self.a = self.a / abs(self.a)
        if kinds[1] == "PR":
            self.b = self.b / abs(self.b)
        if kinds[1] == "RP":
            self.b_star = self.b_star / abs(self.b_star)
        self.point = number(point.real, point.imag)
        if kinds[0] == "RP":  # there is no first moving pivot: the guided point stands for it
            self.normal, self.a_star = self.a_star / abs(self.a_star), self.point

    @property
    def drives(self) -> list[str]:
        """Ways to drive it; the coupler of a parallelogram does not turn."""
        first, second = self.a_star - self.a, self.b_star - self.b
        if self.kind == "RR.RR" and abs(first - second) < 1e-9 * abs(first):
            return ["crank", "other crank"]
        return {
            "RR.RR": ["coupler", "crank", "other crank"],
            "RR.PR": ["coupler", "crank", "slider"],
            "RR.RP": ["coupler", "crank"],
            "PR.PR": ["coupler"],
            "PR.RP": ["coupler"],
            "RP.RP": ["coupler"],
        }[self.kind]

    def close(self, drive: str, t: Any) -> Any:
        """Return the guided point at a parameter (an angle, or a way) that is 0 in the reference position."""
        first, turn = self.pose(drive, t)
        return first + turn * (self.point - self.a_star)

    def pose(self, drive: str, t: Any) -> tuple[Any, Any]:
        """Return moving pivot 1 and the turn of the coupler at a parameter that is 0 in the reference position."""
        zero = 0 * t[:1] if isinstance(t, np.ndarray) else 0 * t
        side = min((1, -1), key=lambda s: self._off(self._pose(drive, zero, s)))
        return self._pose(drive, t, side)

    def _off(self, pose: tuple[Any, Any]) -> float:
        """Return how far a pose is from the reference position."""
        first, turn = pose
        gap = abs(first - self.a_star) + abs(turn - 1) * abs(self.point - self.a_star)
        return float(gap if isinstance(gap, mp.mpf) else np.nan_to_num(np.atleast_1d(gap)[0], nan=1e300))

    def _pose(self, drive: str, t: Any, side: int) -> tuple[Any, Any]:
        """Return the position of moving pivot 1 and the turn of the coupler."""
        a, b, a_star, b_star = self.a, self.b, self.a_star, self.b_star
        turn = self.expj(t)
        bar = b_star - a_star
        if self.kind == "PR.PR":
            # moving pivots on their lines: two linear equations for pivot 1
            p, q = dot(a, a_star), dot(b, b_star) - dot(b, turn * bar)
            area = (a.conjugate() * b).imag
            return 1j * (a * q - b * p) / area, turn
        if self.kind in ("PR.RP", "RP.RP"):
            # a slide's line keeps its distance from the pivot that it passes; the slider its line
            normal, p = a, dot(a, a_star)
            if self.kind == "RP.RP":
                normal = turn * self.normal
                p = dot(normal, a) - dot(self.normal, a - a_star)
            other = turn * b_star
            q = dot(other, b) - dot(b_star, b - a_star)
            area = (normal.conjugate() * other).imag
            return 1j * (normal * q - other * p) / area, turn
        r = abs(a_star - a)
        if drive == "coupler":
            if self.kind == "RR.RR":
                return circle_circle(a, r, b - turn * bar, abs(b_star - b), side, self.root), turn
            if self.kind == "RR.PR":
                return circle_line(a, r, b, dot(b, b_star) - dot(b, turn * bar), side, self.root), turn
            normal = turn * b_star
            return circle_line(a, r, normal, dot(normal, b) - dot(b_star, b - a_star), side, self.root), turn
        if drive == "crank":
            first = a + turn * (a_star - a)
            if self.kind == "RR.RR":
                second = circle_circle(first, abs(bar), b, abs(b_star - b), side, self.root)
            elif self.kind == "RR.PR":
                second = circle_line(first, abs(bar), b, dot(b, b_star), side, self.root)
            else:  # the normal of the slide, of which b keeps its distance from moving pivot 1
                away = b - first
                share = dot(b_star, b - a_star) / abs(away)
                normal = away / abs(away) * (share + 1j * side * self.root(1 - share * share))
                return first, normal / b_star
            return first, (second - first) / bar
        second = b + turn * (b_star - b) if drive == "other crank" else b_star + 1j * b * t
        first = circle_circle(second, abs(bar), a, r, side, self.root)
        return first, (second - first) / bar

    def over(self, stroke: float, points: int) -> Array | None:
        """Return points of the path from x = 0 to x = stroke, or None if no drive leads through all of it.

        The reference position must lie in between.
        """
        led = self._led(stroke, points)
        return None if led is None else self.close(*led)

    def slides(self, stroke: float, points: int) -> list[tuple[str, complex, complex]] | None:
        """Return of each slide its kind and the extreme places, in the reference position, of the pin on its rail or of
        the fixed pivot on its slot while the path runs from x = 0 to x = stroke; None as of `over`."""
        led = self._led(stroke, points)
        if led is None:
            return None
        first, turn = self.pose(*led)
        found = []
        for kind, f, m in zip(self.kind.split("."), (self.a, self.b), (self.a_star, self.b_star), strict=True):
            if kind == "RR":
                continue
            if kind == "PR":
                along, places = 1j * f, first + turn * (m - self.a_star)
            else:
                normal = self.normal if self.kind == "RP.RP" and f is self.a else m
                along, places = 1j * normal, self.a_star + (f - first) / turn
            run = dot(along, places)
            found.append((kind, complex(places[run.argmin()]), complex(places[run.argmax()])))
        return found

    def _led(self, stroke: float, points: int) -> tuple[str, Array] | None:
        """Return a drive that leads through a stroke, and its parameters on the way."""
        for drive in self.drives:
            ends = [self._end(drive, x) for x in (0.0, stroke)]
            if all(e is not None for e in ends):
                share = 0.5 - 0.5 * np.cos(np.pi * np.arange(points, dtype=np.longdouble) / (points - 1))
                low, high = ends
                return drive, low + (high - low) * share
        return None

    def _end(self, drive: str, x: float) -> Any:
        """Return the first parameter, to either side of the reference position, at which the path is at x."""
        scale = abs(self.b_star - self.a_star) if drive == "slider" else 1.0
        steps = scale * np.linspace(0, 3, 3001, dtype=np.longdouble)
        for sign in (1, -1):
            with np.errstate(all="ignore"):
                way = (self.close(drive, sign * steps).real - x) * math.copysign(1, x - float(self.point.real))
            beyond = np.flatnonzero(~(way < 0))  # reached, or the loop is open
            if not beyond.size or not way[beyond[0]] >= 0:
                continue
            if not (np.diff(way[: beyond[0] + 1]) > 0).all():
                continue  # turned back
            low, high = steps[max(beyond[0] - 1, 0)], steps[beyond[0]]
            for _ in range(70):
                middle = (low + high) / 2
                with np.errstate(all="ignore"):
                    ahead = (self.close(drive, np.array([sign * middle])).real[0] - x) * math.copysign(
                        1, x - float(self.point.real)
                    )
                if np.isnan(ahead):  # the coupler of a parallelogram does not turn: it cannot drive
                    return None
                low, high = (middle, high) if ahead < 0 else (low, middle)
            return sign * low
        return None


# -- the narrowest strip and annulus ----------------------------------------------------------------------------------
def narrowest_strip(u: Array, v: Array, amplitude: float = 1.0) -> float:
    """Return half the width of the narrowest strip that holds the points (u, amplitude v): one side on a hull edge."""
    a, b, _ = ConvexHull(np.stack([u, v], 1)).equations.T
    # edges lie along a u + b v = const; in true proportions b becomes b / amplitude
    width = np.ptp(np.outer(a, u) + np.outer(b, v), axis=1) / np.hypot(a, b / amplitude)
    return 0.5 * float(width.min())


def strip_of(path: Array) -> float:
    """Return half the width of the narrowest strip that holds a path of complex numbers, of any precision."""
    path = np.asarray(path)
    chord = (path[-1] - path[0]) / abs(path[-1] - path[0])
    w = (path - path[0]) * chord.conjugate()
    u, v = (np.array([p.real for p in w]), np.array([p.imag for p in w]))
    scale = max(abs(v)) or 1
    return narrowest_strip(u.astype(float), (v / scale).astype(float), float(scale))


def narrowest_annulus(path: Any) -> tuple[float, float]:
    """Return half the width and the curvature of the narrowest annulus near a circular path, in 40 digits.

    Newton on centre and radius; each step is a linear programme that makes the largest distance least.
    """
    with mp.workdps(40):
        z = [mp.mpc(mpf(p.real), mpf(p.imag)) for p in path]
        n = len(z)
        first, middle, last = z[0], z[n // 2], z[-1]
        # centre of the circle through both ends and the middle
        p, q = middle - first, last - first
        centre = first + 1j * (abs(p) ** 2 * q - abs(q) ** 2 * p) / (2 * (p * mp.conj(q)).imag)
        radius = abs(middle - centre)
        for _ in range(4):
            far = [abs(p - centre) for p in z]
            rest = [f - radius for f in far]
            scale = max(abs(r) for r in rest)
            g = np.array([float(r / scale) for r in rest])
            rays = [(p - centre) / f for p, f in zip(z, far, strict=True)]
            columns = np.array([[float(r.real), float(r.imag), 1.0] for r in rays])
            basis, upper = np.linalg.qr(columns)  # the columns are nearly dependent for a short arc
            basis *= math.sqrt(n)
            bound = np.ones((n, 1))
            found = linprog(
                [0, 0, 0, 1],
                A_ub=np.block([[-basis, -bound], [basis, -bound]]),
                b_ub=np.concatenate([-g, g]),
                bounds=[(None, None)] * 4,
                method="highs",
            )
            assert found.x is not None
            step = found.x[:3]
            move = mp.lu_solve(mp.matrix(upper.tolist()), mp.matrix((step * math.sqrt(n)).tolist())) * scale
            centre, radius = centre + mp.mpc(move[0], move[1]), radius + move[2]
        far = [abs(p - centre) for p in z]
        return float((max(far) - min(far)) / 2), float(1 / radius)


def mpf(value: Any) -> Any:
    """Return a number of any precision as one of mpmath, without loss."""
    if isinstance(value, mp.mpf):
        return value
    high = float(value)
    return mp.mpf(high) + mp.mpf(float(value - type(value)(high)))


def narrowest(path: Any, circle: bool) -> float:
    """Return half the width of the narrowest annulus or strip that holds a path."""
    return narrowest_annulus(path)[0] if circle else strip_of(path)


# -- circuits ---------------------------------------------------------------------------------------------------------
class Chain:
    """Linkages of one family, closed at an angle of one of their cranks, or (lead 2) of the coupler, from the given
    position on.

    Parameters
    ----------
    pivots : (n, 2, 2, 3) numbers
        Of dyads in one order; (2, 2, 3), one linkage, with `exact`.
    lead : int
        Number of the dyad whose crank leads; 2: the coupler.
    exact : bool
        Numbers of mpmath.
    """

    def __init__(self, pivots: Any, lead: int, exact: bool = False) -> None:
        self.lead, (self.expj, self.root) = lead, EXACT if exact else FAST
        first = np.asarray(pivots, float) if exact else np.asarray(pivots, float)[0]
        self.kinds = ["RR" if f[2] and m[2] else "PR" if m[2] else "RP" for f, m in first]

        def number(i: int, j: int) -> Any:
            x, y, _ = np.moveaxis(np.asarray(pivots, float)[..., i, j, :], -1, 0)
            return mp.mpc(float(x), float(y)) if exact else x + 1j * y

        self.fixed, self.moving = ([number(i, j) for i in (0, 1)] for j in (0, 1))

    def pose(self, t: Any, side: int) -> tuple[Any, Any]:
        """Return d and turn of z -> d + turn z at an angle from the given position on; `side` chooses between the two
        ways to close the chain."""
        turn = self.expj(t)
        if self.lead == 2:
            return self._led_by_coupler(turn), turn
        i = self.lead
        fixed, moving = self.fixed[i], self.moving[i]
        pin = fixed + turn * (moving - fixed)
        goal, end, kind = self.fixed[1 - i], self.moving[1 - i], self.kinds[1 - i]
        if kind == "RP":  # the normal of the slide, of which its pivot keeps its distance from the crank pin
            away = goal - pin
            share = dot(end, goal - moving) / abs(away)
            coupler = away / abs(away) * (share + 1j * side * self.root(1 - share * share)) / end
        else:
            bar = end - moving
            if kind == "RR":
                reached = circle_circle(pin, abs(bar), goal, abs(end - goal), side, self.root)
            else:
                reached = circle_line(pin, abs(bar), goal, dot(goal, end), side, self.root)
            coupler = (reached - pin) / bar
        return pin - coupler * moving, coupler

    def _led_by_coupler(self, turn: Any) -> Any:
        """Return where the coupler goes: normal . d = level, for each dyad."""
        (m, p), (n, q) = (
            (b, dot(b, a - turn * a)) if kind == "PR" else (turn * b, dot(turn * b, a - turn * a))
            for kind, a, b in (
                (kind, moving, fixed) if kind == "PR" else (kind, fixed, moving)
                for kind, fixed, moving in zip(self.kinds, self.fixed, self.moving, strict=True)
            )
        )
        return 1j * (n * p - m * q) / (n.conjugate() * m).imag

    def angle(self, d: Any, turn: Any) -> Any:
        """Return at which angle of the lead a pose stands."""
        if self.lead == 2:
            return np.angle(turn)
        fixed, moving = self.fixed[self.lead], self.moving[self.lead]
        return np.angle((d + turn * moving - fixed) / (moving - fixed))

    def gaps(self, d: Any, turn: Any) -> Any:
        """Return how far the dyads of poses (m, n) are from being closed, (2, m, n): by distances of pivots."""
        found = []
        for kind, fixed, moving in zip(self.kinds, self.fixed, self.moving, strict=True):
            at = d + turn * moving
            if kind == "RR":
                found.append(np.abs(at - fixed) - np.abs(moving - fixed))
            elif kind == "PR":
                found.append(dot(fixed + 0 * at, at - moving))
            else:  # two points of the coupler's line carry it
                on, other = d + turn * fixed, d + turn * (fixed + 1j * moving)
                found.append(((fixed - on) * (other - on).conjugate()).imag)
        return np.abs(found)

    def followed(self, angles: Any, start: tuple[Any, Any]) -> tuple[Any, Any]:
        """Return the poses at the lead's angles (m, n) from the first two on, (2, n) each: of the two ways
        to close the chain each time the one nearest to where the last two poses point."""
        d, turn = list(start[0]), list(start[1])
        far = abs(self.moving[0] - self.fixed[0])
        for t in angles[2:]:
            ways = [self.pose(t, side) for side in ((1,) if self.lead == 2 else (1, -1))]
            wanted = 2 * d[-1] - d[-2], 2 * turn[-1] - turn[-2]
            off = [np.abs(a - wanted[0]) + far * np.abs(b - wanted[1]) for a, b in ways]
            second = np.nan_to_num(off[-1], nan=np.inf) < np.nan_to_num(off[0], nan=np.inf)
            d.append(np.where(second, ways[-1][0], ways[0][0]))
            turn.append(np.where(second, ways[-1][1], ways[0][1]))
        return np.array(d), np.array(turn)

    def count(self, grid: int = 4096) -> Any:
        """Return how many circuits there are, (n,): where the crank cannot go all the way round, one in each range of
        its angles, as both ways to close the chain meet in the ends of the range."""
        if self.lead == 2:
            return np.full(len(self.fixed[0]), 2 if {*self.kinds} == {"PR", "RP"} else 1)
        with np.errstate(all="ignore"):
            closed = np.isfinite(self.pose(np.linspace(0, 2 * np.pi, grid, endpoint=False)[:, None], 1)[1])
        return np.where(closed.all(0), 2, (closed & ~np.roll(closed, 1, 0)).sum(0))


def ways_round(pivots: Any, point: complex) -> list[tuple[Callable[[Array], Array], bool]]:
    """Return the ways of a coupler point on all circuits of one linkage, as functions of a phase from 0 to 2 pi, and
    whether they are closed: over all angles of a crank that turns fully, or to and fro over a range of them."""
    cranks = [i for i in (0, 1) if pivots[i, :, 2].all()]
    chains = [Chain(pivots[None], i) for i in cranks or [2]]
    if not cranks:
        return [(partial(_through, chains[0], point, low, high), closed)
                for low, high, closed in _open_ranges(chains[0])]  # fmt: skip
    turns = [_ranges(chain) for chain in chains]
    chain, ranges = next(((c, r) for c, r in zip(chains, turns, strict=True) if r is None), (chains[0], turns[0]))
    if ranges is None:
        return [(partial(_carried, chain, point, side), True) for side in (1, -1)]
    return [(partial(_to_and_fro, chain, point, low, high), True) for low, high in ranges]


def _through(chain: Chain, point: complex, low: float, high: float, s: Array) -> Array:
    return _carried(chain, point, 1, low + (high - low) * s / (2 * np.pi))


def _to_and_fro(chain: Chain, point: complex, low: float, high: float, s: Array) -> Array:
    t = np.clip(0.5 * (low + high) - 0.5 * (high - low) * np.cos(s), low, high)
    return np.where(np.mod(s, 2 * np.pi) < np.pi, *(_carried(chain, point, side, t) for side in (1, -1)))


def _carried(chain: Chain, point: complex, side: int, t: Array) -> Array:
    with np.errstate(all="ignore"):
        d, turn = chain.pose(t, side)
    return d + turn * point


def _ranges(chain: Chain, grid: int = 4096) -> list[tuple[float, float]] | None:
    """Return the ranges of the crank's angle in which the chain can be closed; None if at all of them."""
    step = 2 * np.pi / grid

    def open_at(t: Any) -> Any:
        return ~np.isfinite(_carried(chain, 0j, 1, np.atleast_1d(t)))

    shut = ~open_at(step * np.arange(grid))
    if shut.all():
        return None
    found = []
    for first in np.flatnonzero(shut & ~np.roll(shut, 1)):
        last = first
        while shut[(last + 1) % grid]:
            last += 1
        ends = [(first * step, (first - 1) * step), (last * step, (last + 1) * step)]
        found.append((_last(open_at, *ends[0]), _last(open_at, *ends[1])))
    return found


def _last(beyond: Callable[[float], Any], inside: float, outside: float) -> float:
    """Return the last number that is not beyond, by halving."""
    for _ in range(60):
        middle = 0.5 * (inside + outside)
        inside, outside = (inside, middle) if beyond(middle) else (middle, outside)
    return inside


def _open_ranges(chain: Chain) -> list[tuple[float, float, bool]]:
    """Return the ranges of the coupler's angle, to 0.03 rad from where the point is at infinity."""
    if {*chain.kinds} != {"PR", "RP"}:
        return [(0.0, 2 * np.pi, True)]
    slide = chain.kinds.index("RP")
    line, normal = complex(chain.fixed[1 - slide][0]), complex(chain.moving[slide][0])
    at = (cmath.phase(line) - cmath.phase(normal)) % math.pi
    return [(at + k * math.pi + 0.03, at + (k + 1) * math.pi - 0.03, False) for k in (0, 1)]


# -- straight stretches ----------------------------------------------------------------------------------------------
def straightness(z: Array) -> tuple[float, float]:
    """Return half the width of the narrowest strip that holds a path, and how far its ends are apart along the strip;
    infinite and 0 unless it runs forward along its chord, within 84 degrees of the direction of its middle."""
    if z[-1] == z[0]:
        return math.inf, 0.0
    w = (z - z[0]) / (z[-1] - z[0]) * abs(z[-1] - z[0])
    steps = np.diff(w)
    middle = min(max(int((w.real < 0.5 * w.real[-1]).sum()), 1), len(w) - 2) if len(w) > 2 else 0
    tangent = w[middle + 1] - w[middle - 1] if middle else steps[0]
    if not ((steps.real > 0).all() and (dot(tangent, steps) > 0.1 * abs(tangent) * np.abs(steps)).all()):
        return math.inf, 0.0
    # the width as a function of the slope has one minimum
    low, high, golden = -1.0, 1.0, 0.5 * (math.sqrt(5) - 1)
    for _ in range(36):
        first, second = high - golden * (high - low), low + golden * (high - low)
        less = _width(w, first) < _width(w, second)
        low, high = (low, second) if less else (first, high)
    slope = 0.5 * (low + high)
    return 0.5 * _width(w, slope), float(w[-1].real + slope * w[-1].imag) / math.hypot(1, slope)


def _width(w: Array, slope: float) -> float:
    across = w.imag - slope * w.real
    return float(across.max() - across.min()) / math.hypot(1, slope)


def longest_stretch(way: Callable[[Array], Array], closed: bool, allowed: float) -> float:
    """Return the longest stroke over which a way runs straight within a deviation: all windows of 300 points, and about
    the three longest of 1500, are tried."""
    phases, best = _even(way, 300), 0.0
    if closed:
        phases = np.concatenate([phases[:-1], phases + 2 * np.pi])
    found = sorted(_windows(way(phases), 300, 1, 300, allowed), reverse=True)
    tried: list[int] = []
    for _, first, last in found:
        if len(tried) < 3 and all(min(abs(first - k), 300 - abs(first - k)) > 0.1 * (last - first) for k in tried):
            tried.append(first)
            low, high = max(first - 3, 0), min(last + 3, len(phases) - 1)
            fine = np.interp(np.linspace(low, high, 1501), np.arange(len(phases)), phases)
            firsts = 1 + int(6 * 1500 / (high - low))
            best = max(best, *(stroke for stroke, _, _ in _windows(way(fine), firsts, 2, 1500, allowed)))
    return best


def straightest_window(way: Callable[[Array], Array], closed: bool, stroke: float) -> float:
    """Return half the least width of a window of a way over a stroke along its strip: those that begin at 800 places
    are tried, and about the four narrowest others, ever nearer; infinite without any that runs forward."""
    phases = _even(way, 800)
    if closed:
        phases = np.concatenate([phases[:-1], phases[:-1] + 2 * np.pi, phases[:1] + 4 * np.pi])
    with np.errstate(all="ignore"):
        z = way(phases)
    z = np.where(np.isfinite(z), z, 1e9)
    ends = np.array([_crossing(z, first, stroke) for first in range(800)])
    begins = np.flatnonzero(np.isfinite(ends))
    if not len(begins):
        return math.inf
    width = np.full(800, np.inf)
    place = begins + (ends[begins] - begins) * np.linspace(0, 1, 41)[:, None]
    before = np.minimum(place.astype(int), len(z) - 2)
    width[begins] = _half_widths(z[before] + (place - before) * (z[before + 1] - z[before]))
    narrow = np.flatnonzero((width <= np.roll(width, 1)) & (width <= np.roll(width, -1)) & np.isfinite(width))
    best = math.inf
    for first in narrow[np.argsort(width[narrow])][:4]:
        if width[first] < 1.3 * min(width.min(), best):
            best = min(best, _narrowest_about(way, closed, phases, ends, int(first), stroke))
    return best


def _crossing(z: Array, first: int, stroke: float) -> float:
    """Return where, counted in points, a way is first a stroke from one of its points; NaN if nowhere."""
    far = np.abs(z[first + 1 :] - z[first]) >= stroke
    if not far.any():
        return math.nan
    last = first + 1 + int(far.argmax())
    near, beyond = abs(z[last - 1] - z[first]), abs(z[last] - z[first])
    return float(last - 1 + (stroke - near) / (beyond - near))


def _half_widths(z: Array) -> Array:
    """Return half the widths of the narrowest strips of windows (m, n), infinite where they do not run forward."""
    chord = z[-1] - z[0]
    w = (z - z[0]) / chord * np.abs(chord)
    low, high, golden = np.full(w.shape[1], -1.5), np.full(w.shape[1], 1.5), 0.5 * (math.sqrt(5) - 1)

    def width(slope: Array) -> Array:
        across = w.imag - slope * w.real
        return np.ptp(across, axis=0) / np.hypot(1, slope)

    for _ in range(26):
        first, second = high - golden * (high - low), low + golden * (high - low)
        less = width(first) < width(second)
        low, high = np.where(less, low, first), np.where(less, second, high)
    return np.where((np.diff(w.real, axis=0) > 0).all(0), 0.5 * width(0.5 * (low + high)), np.inf)


def _narrowest_about(
    way: Callable[[Array], Array], closed: bool, phases: Array, ends: Array, first: int, stroke: float
) -> float:
    """Return half the least width of windows that begin less than a point from one of them."""

    def half_widths(places: Array) -> Array:
        after = np.minimum(places.astype(int) + 1, len(ends) - 1)
        between = np.interp(places, np.arange(len(ends)), ends)
        end = np.where(np.isfinite(ends[after]), between, ends[first] + places - first)
        here, there = (np.interp(x, np.arange(len(phases)), phases) for x in (places, end))
        return _windows_over(way, closed, here, there, stroke)

    low, high = max(first - 1.0, 0.0), min(first + 1.0, len(ends) - 1.0)
    places = np.linspace(low, high, 9)
    for _ in range(4):
        found = half_widths(places)
        best, step = int(np.argmin(found)), places[1] - places[0]
        places = np.linspace(max(places[best] - step, 0), min(places[best] + step, len(ends) - 1.0), 7)
    return float(found.min())


def _windows_over(way: Callable[[Array], Array], closed: bool, start: Array, end: Array, stroke: float) -> Array:
    """Return half the widths of windows (n,) from phases to about others, over a stroke along their strips; infinite if
    one does not run forward, within 83 degrees of its middle: those at the limit of 84 depend on how it is sampled."""
    home, chord, found = way(start), np.full(len(start), stroke), np.full(len(start), np.inf)
    good = np.ones(len(start), bool)
    for _ in range(2):
        low, high = start + 0.97 * (end - start), start + 1.03 * (end - start)
        good &= (np.abs(way(low) - home) < chord) & (chord < np.abs(way(high) - home))
        for _ in range(40):
            middle = 0.5 * (low + high)
            near = np.abs(way(middle) - home) < chord
            low, high = np.where(near, middle, low), np.where(near, high, middle)
        z = way(np.linspace(start, high, 401).ravel()).reshape(401, -1)
        good &= np.isfinite(z).all(0) & (closed | (high <= 2 * math.pi))
        for k in np.flatnonzero(good):
            half, length = straightness(z[::4, k])
            good[k] = not math.isinf(half)
            if good[k]:
                chord[k] *= stroke / length
    for k in np.flatnonzero(good):
        if _runs_forward(z[:, k]):
            found[k] = strip_of(z[:, k])
    return found


def _runs_forward(z: Array) -> bool:
    """Return whether a path of 401 points runs within 83 degrees of its middle."""
    w = (z - z[0]) / (z[-1] - z[0]) * abs(z[-1] - z[0])
    steps, middle = np.diff(w), min(max(int((w.real < 0.5 * w.real[-1]).sum()), 8), 392)
    tangent = w[middle + 8] - w[middle - 8]
    forward = dot(tangent, steps) > 0.122 * abs(tangent) * np.abs(steps)
    return bool((steps.real > 0).all() and forward.all())


def _windows(z: Array, count: int, step: int, most: int, allowed: float) -> Iterator[tuple[float, int, int]]:
    """Yield for every so many of the first points stroke, first and last point of the longest window within a
    deviation."""
    last = 1
    for first in range(0, count, step):
        last = max(last, first + 1)
        half, stroke = straightness(z[first : last + 1])
        while last > first + 1 and half > allowed:
            last -= 1
            half, stroke = straightness(z[first : last + 1])
        while last + 1 < len(z) and last + 1 - first <= most:
            half, farther = straightness(z[first : last + 2])
            if half > allowed:
                break
            last, stroke = last + 1, farther
        yield stroke, first, last


def _even(way: Callable[[Array], Array], pieces: int) -> Array:
    """Return phases that cut a way into pieces about equally long."""
    s = np.linspace(0, 2 * np.pi, 4001)
    for _ in range(3):
        run = np.concatenate([[0], np.cumsum(abs(np.diff(way(s))))])
        share = run / run[-1] + 1e-3 * np.linspace(0, 1, len(s))
        s = np.interp(np.linspace(0, share[-1], 4001), share, s)
    return np.interp(np.linspace(0, 4000, pieces + 1), np.arange(4001), s)


# -- arcs near a half circle, and beyond ------------------------------------------------------------------------------
def way_through(pivots: Any, point: complex) -> tuple[Callable[[Array], Array], float]:
    """Return the way of a coupler point round the circuit on which it is given, and the phase of where it is."""
    s = np.linspace(0, 2 * np.pi, 40001)
    ways = [way for way, _ in ways_round(pivots, point)]
    near = [np.nan_to_num(np.abs(way(s) - point), nan=np.inf) for way in ways]
    best = int(np.argmin([away.min() for away in near]))
    phase, step = float(s[near[best].argmin()]), float(s[1])
    for _ in range(4):  # to where it is exactly
        fine = phase + np.linspace(-step, step, 2001)
        away = np.nan_to_num(np.abs(ways[best](fine) - point), nan=np.inf)
        phase, step = float(fine[away.argmin()]), step / 500
    return ways[best], phase


def off_arc(z: Array, radius: float, centre: complex) -> tuple[float, complex]:
    """Return by how much places are off the circle of a radius that is placed best, and its centre: the least of what
    linear programmes about the last centre give, from a few places about a first one, and a simplex from there."""
    best = (math.inf, centre)
    for away in (0.0, *(0.1 * radius * np.exp(0.5j * np.pi * k) for k in range(4))):
        here, value = centre + away, float(np.abs(np.abs(z - centre - away) - radius).max())
        for _ in range(60):
            spoke = z - here
            off = np.abs(spoke) - radius
            far = np.abs(off)
            inner = np.flatnonzero((far[1:-1] >= far[:-2]) & (far[1:-1] >= far[2:])) + 1
            at = np.unique(np.concatenate([inner, np.arange(0, len(z), max(len(z) // 100, 1)), [len(z) - 1]]))
            rows = np.column_stack([(spoke / np.abs(spoke)).real, (spoke / np.abs(spoke)).imag])[at]
            ones = -np.ones((len(at), 1))
            found: Any = linprog(
                [0, 0, 1], np.block([[rows, ones], [-rows, ones]]), np.concatenate([off[at], -off[at]]),
                bounds=[(-0.2 * radius, 0.2 * radius)] * 2 + [(0, None)],
            )  # fmt: skip
            step, part = complex(*found.x[:2]), 1.0
            while part > 1e-4 and np.abs(np.abs(z - here - part * step) - radius).max() >= value:
                part *= 0.5
            if part <= 1e-4:
                break
            here += part * step
            value = float(np.abs(np.abs(z - here) - radius).max())
            if abs(part * step) < 1e-13 * radius:
                break
        best = min(best, (value, here), key=lambda one: one[0])
    start = np.array([best[1].real, best[1].imag])
    corners = start + 1e-3 * best[0] * np.array([[0, 0], [1, 0], [0, 1]])
    close: Any = {"xatol": 1e-13 * radius, "fatol": 1e-14 * radius, "maxiter": 400, "initial_simplex": corners}

    def farthest(c: Any) -> float:
        return float(np.abs(np.abs(z - complex(*c)) - radius).max())

    refined: Any = minimize(farthest, start, method="Nelder-Mead", options=close)
    return min(best, (float(refined.fun), complex(*refined.x)), key=lambda one: one[0])


def along_arc(
    way: Callable[[Array], Array], middle: float, centre: complex, radius: float, angle: float
) -> tuple[float, complex, complex]:
    """Return by how much a path is off the best-placed arc of a radius and an angle [rad] whose middle it passes at a
    phase, and its ends: those places that are seen half the angle from the middle, either way, from the centre of the
    circle with the least mean square distance from the path between them."""
    s = middle + np.linspace(-1.9 * np.pi, 1.9 * np.pi, 60001)
    z = way(s)
    mid = len(s) // 2
    for _ in range(40):
        seen = np.unwrap(np.angle((z - centre) / (z[mid] - centre)))
        seen -= seen[mid]
        seen *= np.sign(seen[mid + 1] - seen[mid - 1])
        last = mid + int(np.argmax(seen[mid:] >= angle / 2))
        first = mid - int(np.argmax(-seen[mid::-1] >= angle / 2))
        low = float(np.interp(-angle / 2, seen[first : mid + 1], s[first : mid + 1]))
        high = float(np.interp(angle / 2, seen[mid : last + 1], s[mid : last + 1]))
        fine = np.linspace(low, high, 8001)
        run = np.concatenate([[0], np.abs(np.diff(way(fine))).cumsum()])
        even = way(np.interp(np.linspace(0, run[-1], 4001)[:-1] + run[-1] / 8000, run, fine))
        before = centre

        def off(c: Any, even: Array = even) -> Array:
            return np.abs(even - complex(*c)) - radius

        centre = complex(*least_squares(off, [before.real, before.imag], xtol=1e-15, ftol=1e-15, gtol=1e-15).x)
        if abs(centre - before) < 1e-12 * radius:
            break
    path = way(np.linspace(low, high, 20001))
    return off_arc(path, radius, centre)[0], complex(path[0]), complex(path[-1])


# -- measures ---------------------------------------------------------------------------------------------------------
def inside(polygon: Any, x: float, y: float) -> bool:
    """Return whether a point lies in a polygon: the angles under which it sees the sides add up to a full turn."""
    corners = [complex(a - x, b - y) for a, b in polygon]
    turned = sum(math.atan2((p.conjugate() * q).imag, (p.conjugate() * q).real) for p, q in around(corners))
    return abs(turned) > 3


def around(items: list[Any]) -> Iterator[tuple[Any, Any]]:
    return zip(items, items[1:] + items[:1], strict=True)


def segment(places: Array) -> tuple[complex, complex]:
    """Return the ends of the segment that places on one line fill."""
    end = places[np.abs(places - places[0]).argmax()]
    return complex(end), complex(places[np.abs(places - end).argmax()])


def diameter(points: list[complex]) -> float:
    return max(abs(p - q) for p in points for q in points)
