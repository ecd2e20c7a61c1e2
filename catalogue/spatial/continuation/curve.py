"""Curves of poses: what equations offer to be followed, nodes on curves, cubics between nodes."""

from __future__ import annotations

from typing import Any, NamedTuple, Self

import numpy as np

from ...kinematics.types import Array

#: Change of the part of an interval [1] below which it is found: Newton's method corrects poses.
NEAR = 1e-9


class Limits(NamedTuple):
    """Control of the steps along a curve, lengths in radians and units."""

    aim: float  # first correction of a step that is aimed at
    refused: float  # above it a step is refused
    first: float  # lengths of steps: the first, and bounds
    longest: float
    shortest: float
    contraction: float  # largest ratio of the second correction to the first: else another curve is near
    at_branch: float  # a shorter step that would still change the orientation of the curve is at a branch point
    bow: float  # distance of a step's chord from the mean of the tangents at its ends, as a part of its length
    turn: float  # cosine of the largest turn of the tangent
    last: float  # a correction below this is the last: the next would be less than a rounding error
    margin: float = -1.0  # slope of the drive that counts as none, per cube of the angle turned; below 0: any


class Curve:
    """Equations of n mechanisms of one freedom: curves of poses along which a drive changes.

    States are of shape (n, numbers), steps of the unknowns and tangents of shape (n, m).

    Attributes
    ----------
    weight : ndarray, shape (numbers,)
        Weights of the squares of a rate of length 1.
    periodic : bool
        Whether the drive is known but for whole turns.
    redundant : bool
        Whether conditions imply others.
    spins : bool
        Whether a body spins idly: it follows no curve.
    """

    weight: Any
    periodic: Any = False
    redundant: Any = False
    spins: Any = False

    def __call__(self, y: Array) -> tuple[Array, Array, Array, Array]:
        """Evaluate residual (n, m - 1), its Jacobian, drive (n,) and its gradient (n, m)."""
        raise NotImplementedError

    def take(self, index: Array) -> Self:
        """Return the curves of some mechanisms, in any order and number."""
        raise NotImplementedError

    def moved(self, y: Array, step: Array) -> Array:
        """Return states after a step of all unknowns."""
        raise NotImplementedError

    def lifted(self, y: Array, step: Array) -> Array:
        """Return the rates (n, numbers) of states from those of the unknowns."""
        raise NotImplementedError

    def unitary(self, y: Array) -> Array:
        """Return states with quaternions of length 1, if equations need them so."""
        return y

    def selected(self, y: Array) -> Self:  # noqa: ARG002, redundant ones do
        """Select independent conditions in states."""
        return self

    def compiled_step(self, march: Any) -> Any:  # noqa: ARG002, as others
        """Try a step of a `tracing.March` compiled; None where that cannot be."""
        return None


class Trace(NamedTuple):
    """Nodes of one curve, or of many.

    Attributes
    ----------
    s : ndarray, shape (k,)
        Arc length [rad, units].
    y, rate : ndarray, shape (k, numbers)
        States, and their derivatives by s.
    drive, slope : ndarray, shape (k,)
        The driven scalar, and its derivative by s.
    tangent : ndarray, shape (k, m)
    reason : str
        Why it ends; empty where it was to.
    """

    s: Array
    y: Array
    rate: Array
    drive: Array
    slope: Array
    tangent: Array
    reason: str = ""

    def take(self, index: Any) -> Trace:
        """Return some nodes."""
        return self._replace(**{name: v[index] for name, v in zip(self._fields[:-1], self[:-1], strict=True)})

    def at(self, s: Array) -> Array:
        """Return states at arc lengths by the cubics between nodes, shape (n, numbers)."""
        i = np.clip(np.searchsorted(self.s, s) - 1, 0, len(self.s) - 2)
        h = (self.s[i + 1] - self.s[i])[:, None]
        t = (s - self.s[i])[:, None] / h
        return np.asarray(cubic(t, h, self.y[i], self.y[i + 1], self.rate[i], self.rate[i + 1]))

    def where(self, value: Array) -> Array:
        """Invert a monotonic drive: return arc lengths at given values."""
        direction = np.sign(self.drive[-1] - self.drive[0]) or 1.0
        i = np.clip(np.searchsorted(direction * self.drive, direction * value) - 1, 0, len(self.s) - 2)
        return np.asarray(self.s[i] + self.part(i, value) * (self.s[i + 1] - self.s[i]))

    def part(self, i: Array, value: Array) -> Array:
        """Invert a monotonic drive: return parts of the intervals from nodes i."""
        h, direction = self.s[i + 1] - self.s[i], np.sign(self.drive[i + 1] - self.drive[i])
        g = self.drive[i], self.drive[i + 1], self.slope[i], self.slope[i + 1]
        low, high = np.zeros_like(value), np.ones_like(value)
        t = np.clip((value - g[0]) / np.where(g[1] == g[0], 1, g[1] - g[0]), 0, 1)
        for _ in range(40):  # Newton's method, kept between bounds: slow at a dead point
            off = cubic(t, h, *g) - value
            low, high = np.where(direction * off < 0, t, low), np.where(direction * off < 0, high, t)
            with np.errstate(all="ignore"):
                better = t - off / cubic_slope(t, h, *g)
            t, before = np.where((better >= low) & (better <= high), better, (low + high) / 2), t
            if not (np.abs(t - before) > NEAR).any():
                break
        return np.asarray(t)

    def joined(self, other: Trace) -> Trace:
        """Return this one backwards, and then the other, which begins at the same node."""
        signs = {"s": -1, "y": 1, "rate": -1, "drive": 1, "slope": -1, "tangent": -1}
        both = [np.concatenate([sign * getattr(self, k)[:0:-1], getattr(other, k)]) for k, sign in signs.items()]
        return Trace._make([*both, other.reason])


class Traces(NamedTuple):
    """Nodes of n curves, one curve after the other.

    Attributes
    ----------
    who : ndarray, shape (k,)
        Which curve each node is of.
    nodes : Trace
    reason : ndarray of str, shape (n,)
        Why each ends; empty where it was to.
    tried : ndarray, shape (n,)
        Number of steps.
    """

    who: Array
    nodes: Trace
    reason: Array
    tried: Array

    def one(self, i: int) -> Trace:
        """Return the nodes of one curve."""
        return self.nodes.take(self.who == i)._replace(reason=str(self.reason[i]))

    def between(self, who: Array, value: Array) -> tuple[Array, Array, Array]:
        """Interpolate states (m, numbers) of curves `who` at values of growing drives.

        With them the slopes of the drives, and the arcs between the nodes beside them.
        """
        nodes = self.nodes
        span = 2 * max(np.abs(value).max(), 1e-300)  # of curves one after the other; last nodes may be farther
        key = np.minimum(nodes.drive, 0.75 * span) + self.who * span
        i = np.minimum(np.searchsorted(key, value + who * span, side="right") - 1, self.last[who] - 1)
        h, t = nodes.s[i + 1] - nodes.s[i], nodes.part(i, value)
        slope = cubic_slope(t, h, nodes.drive[i], nodes.drive[i + 1], nodes.slope[i], nodes.slope[i + 1]) / h
        t, across = t[:, None], h[:, None]
        return cubic(t, across, nodes.y[i], nodes.y[i + 1], nodes.rate[i], nodes.rate[i + 1]), slope, h

    @property
    def last(self) -> Array:
        """Last node of each curve, shape (n,)."""
        return np.asarray(np.searchsorted(self.who, np.arange(len(self.reason)), side="right") - 1)


# -- formulas of arrays, which `native` compiles for one pose --------------------------------------
def cubic(t: Any, h: Any, a: Any, b: Any, da: Any, db: Any) -> Any:
    """Evaluate Hermite's cubic at the part t of an interval h: ends a, b and their derivatives."""
    u = 1 - t
    return u * u * ((1 + 2 * t) * a + t * h * da) + t * t * ((3 - 2 * t) * b - u * h * db)


def cubic_slope(t: Any, h: Any, a: Any, b: Any, da: Any, db: Any) -> Any:
    """Differentiate `cubic` by the part t."""
    return 6 * t * (1 - t) * (b - a) + h * ((1 - t) * (1 - 3 * t) * da + t * (3 * t - 2) * db)


def around(angle: Any) -> Any:
    """Reduce angles by whole turns to between -pi and pi [rad]."""
    return (angle + np.pi) % (2 * np.pi) - np.pi


def rises(first: Any, last: Any, mean: Any, least: Any) -> Any:
    """Check that the cubic of a drive rises all along a step: else two dead points may lie between.

    It is given by its slopes at the ends and on average, `least` being the least that counts.
    """
    linear, square = 6 * mean - 4 * first - 2 * last, 3 * (first + last - 2 * mean)
    dips = (square > 0) & (linear < 0) & (linear > -2 * square)
    return (last <= 0) | np.logical_not(dips) | (first - linear * linear / (4 * square) >= least)
