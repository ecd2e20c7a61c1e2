"""Along the curve of all poses that a mechanism of one freedom can take: coarse steps first, then all poses at once.

The conditions leave a curve; its arc length is regular where any drive has a dead point, so that the curve is followed
without regard to what drives (Allgower and Georg, Introduction to Numerical Continuation Methods).  Nodes on it are as
far apart as a cubic through the last two allows; poses asked for are put on cubics between nodes, and corrected
together by Newton's method.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from ...kinematics.types import Array
from .system import System

#: First correction at a node that is aimed at, above which a step is refused, and steps [rad, units].
AIM, REFUSED, FIRST, LONGEST, SHORTEST = 2e-3, 1e-2, 0.1, 0.8, 1e-7
#: Second correction at a node, at most, over the first: where Newton's method does not contract, another curve is near.
CONTRACTION = 0.2
#: A step shorter than this that would still change the orientation of the curve is at a branch point [rad, units].
AT_BRANCH = 1e-5
#: A drive that turns back less steeply than this [units per rad or unit] rests.
FLAT = 1e-9
#: How far, of a step, its chord may be off the mean of the tangents at its ends: less than this on one smooth curve.
BOW = 0.02
#: Largest turn of the tangent between nodes [cos].
TURN = np.cos(0.7)
#: A Newton step below this is the last: the next would be less than a rounding error.
LAST = 1e-8
#: A pose that is farther than this from where it was looked for is that of another assembly.
NEAR = 0.05
#: Nodes of a curve at most.
MOST = 2000
#: Poses that are corrected together: their arrays stay in the cache.
BLOCK = 2048
TURNING, BRANCH, STUCK, LONG = "dead point", "branch point", "step too small", "no end after 2000 nodes"


@dataclass(frozen=True)
class Curve:
    """The poses that satisfy the conditions and keep held scalars (n, h); the last scalar of the system is read off."""

    system: System
    held: Array

    def take(self, index: Array) -> Curve:
        return Curve(self.system.take(index), self.held[index])

    def __call__(self, y: Array) -> tuple[Array, Array, Array, Array]:
        """Return residual (n, m - 1) and Jacobian of the conditions, value (n,) and gradient (n, m) of the drive."""
        residual, values, jacobian = self.system.evaluate(y)
        rows = self.system.rows
        use = self.system.use
        f, j = residual, jacobian[:, :-1]
        if len(use) < rows:
            keep = np.concatenate([use, np.arange(rows, j.shape[1])])
            f, j = residual[:, use], j[:, keep]
        if values.shape[1] > 1:
            f = np.concatenate([f, _wrapped(self.system, values[:, :-1] - self.held)], axis=1)
        return f, j, values[:, -1], jacobian[:, -1]


def _wrapped(system: System, difference: Array) -> Array:
    for k, s in enumerate(system.scalars[: difference.shape[1]]):
        if s.periodic:
            difference[:, k] = _around(difference[:, k])
    return difference


def _around(angle: Array) -> Array:
    return np.asarray(np.remainder(angle + np.pi, 2 * np.pi) - np.pi)


class Trace(NamedTuple):
    """Nodes of one curve.

    Attributes
    ----------
    s : ndarray, shape (k,)
        Arc length [rad, units].
    y, rate : ndarray, shape (k, numbers)
        States, and their derivatives by s.
    drive, slope : ndarray, shape (k,)
        The driven scalar, and its derivative by s.
    tangent : ndarray, shape (k, m)
    jacobian : ndarray, shape (k, m - 1, m)
        Of the conditions, at or next to the nodes.
    reason : str
        Why it ends; empty where it was to.
    """

    s: Array
    y: Array
    rate: Array
    drive: Array
    slope: Array
    tangent: Array
    jacobian: Array
    reason: str = ""

    def at(self, s: Array) -> Array:
        """Return states at arc lengths by the cubics between nodes, shape (n, numbers)."""
        i = np.clip(np.searchsorted(self.s, s) - 1, 0, len(self.s) - 2)
        h = (self.s[i + 1] - self.s[i])[:, None]
        return _cubic(((s - self.s[i])[:, None]) / h, h, self.y[i], self.y[i + 1], self.rate[i], self.rate[i + 1])

    def where(self, value: Array) -> Array:
        """Return the arc lengths at which the drive, which must run one way, has given values."""
        way = np.sign(self.drive[-1] - self.drive[0]) or 1.0
        i = np.clip(np.searchsorted(way * self.drive, way * value) - 1, 0, len(self.s) - 2)
        h = self.s[i + 1] - self.s[i]
        g = self.drive[i], self.drive[i + 1], self.slope[i], self.slope[i + 1]
        low, high = np.zeros_like(value), np.ones_like(value)
        t = np.clip((value - g[0]) / np.where(g[1] == g[0], 1, g[1] - g[0]), 0, 1)
        for _ in range(6):  # Newton's method, kept between bounds
            off = _cubic(t, h, *g) - value
            low, high = np.where(way * off < 0, t, low), np.where(way * off < 0, high, t)
            with np.errstate(all="ignore"):
                better = t - off / _cubic_slope(t, h, *g)
            t = np.where((better >= low) & (better <= high), better, (low + high) / 2)
        return np.asarray(self.s[i] + t * h)

    def joined(self, other: Trace) -> Trace:
        """Return this one backwards, and then the other, which begins at the same node."""
        both = [
            np.concatenate([sign * getattr(self, name)[:0:-1], getattr(other, name)])
            for name, sign in (
                ("s", -1),
                ("y", 1),
                ("rate", -1),
                ("drive", 1),
                ("slope", -1),
                ("tangent", -1),
                ("jacobian", 1),
            )
        ]
        return Trace._make([*both, other.reason])


def _cubic(t: Array, h: Array, a: Array, b: Array, da: Array, db: Array) -> Array:
    """Return Hermite's cubic at the part t of an interval h."""
    u = 1 - t
    return np.asarray(u * u * ((1 + 2 * t) * a + t * h * da) + t * t * ((3 - 2 * t) * b - u * h * db))


def _cubic_slope(t: Array, h: Array, a: Array, b: Array, da: Array, db: Array) -> Array:
    """Return the derivative of the cubic by t."""
    return np.asarray(6 * t * (1 - t) * (b - a) + h * ((1 - t) * (1 - 3 * t) * da + t * (3 * t - 2) * db))


def tangents(j: Array, by: Array) -> tuple[Array, Array, Array]:
    """Return unit vectors along curves from the Jacobian of the conditions (n, m - 1, m) and the gradient of the drive.

    With them the slope of the drive, not negative, and how regular the conditions are: the least singular value
    over the largest.
    """
    _, s, v = np.linalg.svd(j, full_matrices=True)
    t = v[:, -1]
    slope = (t * by).sum(1)
    regular = s[:, -1] / s[:, 0] if s.shape[1] else np.ones(len(j))
    return np.where(slope < 0, -1, 1)[:, None] * t, np.abs(slope), regular


def _solve(a: Array, b: Array) -> Array:
    try:
        return np.asarray(np.linalg.solve(a, b))
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.pinv(a) @ b)


class March:
    """Curves on their way from states y (n, numbers), each along its tangent (n, m), with steps of its own.

    `who` says which curves are still on their way; arrays are of those alone.
    """

    def __init__(self, curve: Curve, y: Array, tangent: Array, at: tuple[Array, ...] | None = None) -> None:
        _, j, drive, by = at or curve(y)
        self.curve, self.who = curve, np.arange(len(y))
        self.last: tuple[Array, ...] = (
            np.zeros(len(y)), y, curve.system.lifted(y, tangent), drive, (by * tangent).sum(1), tangent, j,
        )  # fmt: skip
        self.h = np.full(len(y), FIRST)
        self.sign = _orientation(j, tangent)
        self.crossing = np.zeros(len(y), bool)  # whether the last step tried would have changed the orientation
        # where no step was made yet, the node before is one straight behind
        self.before: tuple[Array, ...] = (self.last[0] - FIRST, y - FIRST * self.last[2], *self.last[2:])
        self.nodes: list[list[tuple[Array, ...]]] = [[tuple(v[i] for v in self.last)] for i in self.who]
        self.reason = [""] * len(y)

    def step(self) -> Array:
        """Try a step of every curve; return where one was made.

        A step is refused where Newton's method does not contract, where the cubics would not be near the curve, and
        where the bordered determinant changes its sign, which it does not on one smooth curve (Allgower and Georg,
        ch. 8).
        """
        s, y, rate, drive, _, tangent, _ = self.last
        back = (s - self.before[0])[:, None]
        system = self.curve.system
        guess = system.unitary(_cubic(1 + self.h[:, None] / back, back, self.before[1], y, self.before[2], rate))
        f, j, _, _ = self.curve(guess)
        off, across_guess = _across(f, j, tangent)
        size = np.sqrt((off * off).sum(1))
        near = system.unitary(system.moved(guess, off))
        f, j, value, by = self.curve(near)
        off, new = _across(f, j, across_guess)
        left = np.sqrt((off * off).sum(1))
        y_new = system.moved(near, off)
        rate_new = system.lifted(y_new, new)
        # the arc over the chord: the cubics, and the next guess, rely on it
        ahead = y_new - y
        chord = np.sqrt((system.weight * ahead**2).sum(1))
        arc = chord * (1 + (2 - 2 * (system.weight * rate_new * rate).sum(1)) / 24)
        bow = (system.weight * (ahead - (0.5 * arc)[:, None] * (rate + rate_new)) ** 2).sum(1)
        bow *= not system.idle.size  # a spin that is idle follows no curve of its own
        good = (size <= np.minimum(REFUSED, 0.1 * self.h)) & (left <= np.maximum(CONTRACTION * size, LAST))
        good &= ((new * tangent).sum(1) >= TURN) & (bow <= (BOW * arc) ** 2)
        self.crossing = _orientation(j, new) != self.sign
        good &= ~self.crossing
        if system.scalars[-1].periodic:
            value = drive + _around(value - drive)
        node = (s + arc, y_new, rate_new, value + (by * off).sum(1), (by * new).sum(1), new, j)
        change = np.clip((AIM / np.maximum(size, 1e-9)) ** 0.25, 0.3, 2.0)
        if good.all():
            self.before, self.last = self.last, node
        else:
            change = np.where(good, change, np.minimum(change, 0.5))
            self.before = tuple(_where(good, a, b) for a, b in zip(self.last, self.before, strict=True))
            self.last = tuple(_where(good, a, b) for a, b in zip(node, self.last, strict=True))
        for i in np.flatnonzero(good):
            self.nodes[self.who[i]].append(tuple(v[i] for v in self.last))
        self.h = np.minimum(change * self.h, LONGEST)
        return np.asarray(good)

    def stopped(self) -> Array:
        """Return which curves cannot go on, and note why."""
        stopped = self.h < np.where(self.crossing, AT_BRANCH, SHORTEST)
        for i in np.flatnonzero(stopped):
            self.reason[self.who[i]] = BRANCH if self.crossing[i] else STUCK
        return np.asarray(stopped)

    def end(self, here: Array) -> None:
        """Take some curves off their way."""
        keep = np.flatnonzero(~here)
        self.who, self.h, self.curve = self.who[keep], self.h[keep], self.curve.take(keep)
        self.sign, self.crossing = self.sign[keep], self.crossing[keep]
        self.last, self.before = (tuple(v[keep] for v in node) for node in (self.last, self.before))

    def trace(self, i: int) -> Trace:
        """Return the nodes of one curve."""
        return Trace._make([*(np.stack(column) for column in zip(*self.nodes[i], strict=True)), self.reason[i]])


def _across(f: Array, j: Array, tangent: Array) -> tuple[Array, Array]:
    """Return Newton's step across a tangent, and the unit vector along the curve."""
    right = np.zeros((*tangent.shape, 2))
    right[:, :-1, 0], right[:, -1, 1] = -f, 1
    z = _solve(np.concatenate([j, tangent[:, None]], axis=1), right)
    off, new = z[..., 0], z[..., 1]
    return off, new / np.sqrt((new * new).sum(1, keepdims=True))


def _orientation(j: Array, tangent: Array) -> Array:
    """Return the signs of the determinants of Jacobians (n, m - 1, m) bordered by tangents."""
    return np.asarray(np.linalg.slogdet(np.concatenate([j, tangent[:, None]], axis=1))[0])


def _where(mask: Array, a: Array, b: Array) -> Array:
    return np.asarray(np.where(mask.reshape(-1, *[1] * (a.ndim - 1)), a, b))


def toward(curve: Curve, y: Array, tangent: Array, target: Array, at: tuple[Array, ...] | None = None) -> list[Trace]:
    """Follow each curve until its drive has passed a target (n,), or turns back."""
    march = March(curve, y, tangent, at)
    way = np.sign(target - march.last[3])
    march.end(way == 0)
    for _ in range(MOST):
        if not len(march.who):
            break
        good, here = march.step(), way[march.who]
        passed = good & (here * (march.last[3] - target[march.who]) >= 0)
        turned = good & ~passed & (here * march.last[4] <= 0)
        ended = passed | turned | march.stopped()
        if ended.any():
            for i in march.who[turned]:
                march.reason[i] = TURNING
            march.end(ended)
    for i in march.who:
        march.reason[i] = LONG
    return [_ended(curve, i, march.trace(i)) for i in range(len(y))]


def _ended(curve: Curve, i: int, trace: Trace) -> Trace:
    """Return a trace up to its turning point, if it was ended by one, or to where a branch crosses."""
    if trace.reason == TURNING:
        curve = curve.take(np.array([i]))
        at, tangent = stationary(curve, trace, len(trace.s) - 2)
        _, _, value, _ = curve(at[1][None])
        one: tuple[Any, ...] = (
            at[0], at[1], curve.system.lifted(at[1][None], tangent)[0], value[0], 0.0, tangent[0], trace.jacobian[-1],
        )  # fmt: skip
        if curve.system.scalars[-1].periodic:
            one = (*one[:3], trace.drive[-2] + _around(value - trace.drive[-2])[0], *one[4:])
        arrays = [np.concatenate([v[:-1], np.asarray(w)[None]]) for v, w in zip(trace[:7], one, strict=True)]
        trace = Trace._make([*arrays, TURNING])
    return trace


def unfolded(curve: Curve, trace: Trace) -> Trace:
    """Return a trace with a node between any two between which its drive turns back twice.

    The cubic between two nodes, whose slope is s0 (1 - t)^2 + 2 m t (1 - t) + s1 t^2, says where that may be; the least
    slope of the curve itself decides.
    """
    h, s0, s1 = np.diff(trace.s), trace.slope[:-1], trace.slope[1:]
    m = 3 * np.diff(trace.drive) / h - s0 - s1
    for k in reversed(np.flatnonzero((s0 * s1 > 0) & (m * s0 < 0))):
        way = np.sign(s0[k])

        def slope(s: float, k: int = k, way: float = way) -> float:
            return float(way * across(curve, trace.at(np.array([s])), trace.tangent[k][None])[2][0])  # noqa: B023

        least = minimize_scalar(slope, bounds=(trace.s[k], trace.s[k + 1]), method="bounded", options={"xatol": 1e-9})
        if least.fun < -FLAT:
            trace = _with_node(curve, trace, int(k), float(least.x))
    return trace


def _with_node(curve: Curve, trace: Trace, k: int, s: float) -> Trace:
    """Return a trace with one more node, at an arc length after node k."""
    y, tangent, slope = across(curve, trace.at(np.array([s])), trace.tangent[k][None])
    _, j, value, _ = curve(y)
    if curve.system.scalars[-1].periodic:
        value = trace.drive[k] + _around(value - trace.drive[k])
    node: tuple[Any, ...] = (s, y[0], curve.system.lifted(y, tangent)[0], value[0], slope[0], tangent[0], j[0])
    arrays = [np.insert(v, k + 1, w, axis=0) for v, w in zip(trace[:7], node, strict=True)]
    return Trace._make([*arrays, trace.reason])


def stationary(curve: Curve, trace: Trace, i: int) -> tuple[tuple[float, Array], Array]:
    """Return arc length and state next to nodes i and i + 1 where the drive is stationary, and the tangent there.

    A root of the slope; the drive is stationary, so that its error is the square of that of the place.  Nodes are not
    exact: if the slope does not change its sign between them, the place is a little outside, where a secant finds it.
    """

    def at(s: float) -> tuple[Array, Array, float]:
        y, tangent, slope = across(curve, trace.at(np.array([s])), trace.tangent[i][None])
        return y[0], tangent, float(slope[0])

    a, b = float(trace.s[i]), float(trace.s[i + 1])
    f, g = at(a)[2], at(b)[2]
    if f * g < 0:
        s = float(brentq(lambda s: at(s)[2], a, b, xtol=1e-13))
    else:
        low, high, s = 1.5 * a - 0.5 * b, 1.5 * b - 0.5 * a, b
        for _ in range(20):
            if g == f or abs(g) < 1e-10:
                break
            s, a, f = float(np.clip(s - g * (s - a) / (g - f), low, high)), s, g
            g = at(s)[2]
    y, tangent, _ = at(s)
    return (s, y), tangent


def across(curve: Curve, y: Array, tangent: Array) -> tuple[Array, Array, Array]:
    """Return states corrected across tangents (n, m), the tangents there and the slope of the drive."""
    y = curve.system.unitary(y)
    for _ in range(8):
        f, j, _, by = curve(y)
        off, new = _across(f, j, tangent)
        y = curve.system.moved(y, off)
        if not np.abs(off).max() > LAST:
            break
    return y, new, (new * by).sum(1)


def solved(curve: Curve, y: Array, target: Array) -> tuple[Array, Array]:
    """Correct states (n, numbers) so that the drive has given values (n,); return them and where that was possible."""
    y = curve.system.unitary(y)
    found = np.zeros(len(y), bool)
    for low in range(0, len(y), BLOCK):
        some = np.arange(low, min(low + BLOCK, len(y)))
        sub = curve.take(some)
        at, periodic = y[some], curve.system.scalars[-1].periodic
        near = np.ones(len(some), bool)
        for k in range(8):
            f, j, value, by = sub(at)
            off = value - target[some]
            right = -np.concatenate([f, (_around(off) if periodic else off)[:, None]], axis=1)
            step = _solve(np.concatenate([j, by[:, None]], axis=1), right[..., None])[..., 0]
            with np.errstate(all="ignore"):
                size = np.abs(step).max(1)
                at = curve.system.moved(at, step)
            near &= (size <= NEAR) | (k > 0)
            if not (size > LAST).any():
                break
        y[some], found[some] = at, (size <= 1e-6) & near
    return y, found


def newton(curve: Curve, y: Array, target: Array, steps: int = 60) -> tuple[Array, Array]:
    """Solve from rough states (n, numbers), damped; return states and where that was possible."""
    y, periodic = y.copy(), curve.system.scalars[-1].periodic
    open_ = np.arange(len(y))
    found = np.zeros(len(y), bool)
    for _ in range(steps):
        sub = curve.take(open_)
        f, j, value, by = sub(y[open_])
        off = value - target[open_]
        right = -np.concatenate([f, (_around(off) if periodic else off)[:, None]], axis=1)
        with np.errstate(all="ignore"):
            step = _solve(np.concatenate([j, by[:, None]], axis=1), right[..., None])[..., 0]
            size = np.sqrt((step * step).sum(1))
            step *= np.minimum(1, 0.7 / size)[:, None]
        y[open_] = curve.system.unitary(curve.system.moved(y[open_], np.nan_to_num(step)))
        found[open_] = size < LAST
        open_ = open_[~(size < LAST) & np.isfinite(size)]
        if not len(open_):
            break
    return y, found


def signature(curve: Curve, y: Array) -> Array:
    """Return what tells poses apart, (n, ...): where bodies are, of those that spin idly only where their ends are."""
    system = curve.system
    rotation, shift = system.poses(y)
    ends, _ = system.attached(rotation, shift)
    idle = {system.ways[0][w] for w in system.idle[0]}
    bodies = [b for b in range(1, len(system.bodies)) if b not in idle]
    n = len(y)
    parts = rotation[0][:, bodies].reshape(n, -1), shift[0][:, bodies].reshape(n, -1), ends[0].reshape(n, -1)
    return np.concatenate(parts, axis=1)
