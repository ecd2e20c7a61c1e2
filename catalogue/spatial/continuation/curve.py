"""Curves of poses: interface of their equations, nodes, cubics between nodes."""

from __future__ import annotations

from typing import Any, NamedTuple, Self

import numpy as np

from ...kinematics.types import Array

#: Tolerance of a position in an interval [intervals]; Newton's method corrects poses afterwards.
PART_TOLERANCE = 1e-9


class Limits(NamedTuple):
    """Control of the steps along a curve, lengths in radians and units."""

    aim: float  # first correction at which step control aims
    refused: float  # largest first correction of an accepted step
    first: float  # length of the first step, then bounds of all steps
    longest: float
    shortest: float
    contraction: float  # largest ratio of the second correction to the first; above it another curve is near
    at_branch: float  # step length below which a change of orientation means a branch point
    bow: float  # largest difference of a chord from the mean tangent at its ends [arc lengths]
    turn: float  # cosine of the largest rotation of the tangent in a step
    last: float  # correction at which the iteration stops: the next one would be rounding
    margin: float = -1.0  # slope of a stationary drive per cube of the angle of rotation; below 0: no test


class Curve:
    """Equations of n mechanisms with one degree of freedom: curves of poses, with a drive.

    States are of shape (n, numbers), steps of the unknowns and tangents of shape (n, m).

    Attributes
    ----------
    weight : ndarray, shape (numbers,)
        Weights of the squares of a rate in its norm.
    periodic : bool
        Whether the drive is an angle known up to whole turns.
    redundant : bool
        Whether some conditions imply others.
    spins : bool
        Whether a body spins idly; its rotation has no curve.
    """

    weight: Any
    periodic: Any = False
    redundant: Any = False
    spins: Any = False

    def __call__(self, y: Array) -> tuple[Array, Array, Array, Array]:
        """Evaluate residual (n, m - 1), its Jacobian, drive (n,) and its gradient (n, m)."""
        raise NotImplementedError

    def take(self, index: Array) -> Self:
        """Return the curves of selected mechanisms; repeats are permitted."""
        raise NotImplementedError

    def moved(self, y: Array, step: Array) -> Array:
        """Return states after a step of all unknowns."""
        raise NotImplementedError

    def lifted(self, y: Array, step: Array) -> Array:
        """Return the rates (n, numbers) of states from those of the unknowns."""
        raise NotImplementedError

    def unitary(self, y: Array) -> Array:
        """Return states with normalised quaternions, if the equations have quaternions."""
        return y

    def selected(self, y: Array) -> Self:  # noqa: ARG002, redundant ones do
        """Select independent conditions in states."""
        return self

    def compiled_step(self, march: Any) -> Any:  # noqa: ARG002, as others
        """Try a compiled step of a `tracing.March`; None if not supported."""
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
        Reason of the end; empty at the target.
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
        """Interpolate states at arc lengths by the cubics between nodes, shape (n, numbers)."""
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
        """Invert a monotonic drive: return positions in the intervals from nodes i, 0 to 1."""
        h, direction = self.s[i + 1] - self.s[i], np.sign(self.drive[i + 1] - self.drive[i])
        g = self.drive[i], self.drive[i + 1], self.slope[i], self.slope[i + 1]
        low, high = np.zeros_like(value), np.ones_like(value)
        t = np.clip((value - g[0]) / np.where(g[1] == g[0], 1, g[1] - g[0]), 0, 1)
        for _ in range(40):  # Newton's method, safeguarded by bounds: slow at a dead point
            off = cubic(t, h, *g) - value
            low, high = np.where(direction * off < 0, t, low), np.where(direction * off < 0, high, t)
            with np.errstate(all="ignore"):
                better = t - off / cubic_slope(t, h, *g)
            t, before = np.where((better >= low) & (better <= high), better, (low + high) / 2), t
            if not (np.abs(t - before) > PART_TOLERANCE).any():
                break
        return np.asarray(t)

    def joined(self, other: Trace) -> Trace:
        """Return this trace reversed, followed by another one from its first node."""
        signs = {"s": -1, "y": 1, "rate": -1, "drive": 1, "slope": -1, "tangent": -1}
        both = [np.concatenate([sign * getattr(self, k)[:0:-1], getattr(other, k)]) for k, sign in signs.items()]
        return Trace._make([*both, other.reason])


class Traces(NamedTuple):
    """Nodes of n curves, one curve after the other.

    Attributes
    ----------
    who : ndarray, shape (k,)
        Number of the curve of each node.
    nodes : Trace
    reason : ndarray of str, shape (n,)
        Reason of each end; empty at the target.
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

        Return also the slopes of the drives, and the arc lengths between the neighbouring nodes.
        """
        nodes = self.nodes
        span = 2 * max(
            np.abs(value).max(), 1e-300
        )  # offset that separates consecutive curves; last nodes may be farther apart
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
    """Evaluate Hermite's cubic at fraction t of an interval h with ends a, b.

    da and db are the derivatives at the ends.
    """
    u = 1 - t
    return u * u * ((1 + 2 * t) * a + t * h * da) + t * t * ((3 - 2 * t) * b - u * h * db)


def cubic_slope(t: Any, h: Any, a: Any, b: Any, da: Any, db: Any) -> Any:
    """Differentiate `cubic` by the fraction t."""
    return 6 * t * (1 - t) * (b - a) + h * ((1 - t) * (1 - 3 * t) * da + t * (3 * t - 2) * db)


def around(angle: Any) -> Any:
    """Reduce angles by whole turns to between -pi and pi [rad]."""
    return (angle + np.pi) % (2 * np.pi) - np.pi


def rises(first: Any, last: Any, mean: Any, least: Any) -> Any:
    """Tell whether the cubic of a drive rises along a whole step.

    If not, dead points may be inside. The cubic is given by its slopes at the ends and its mean
    slope; `least` is the smallest slope of a rising drive.
    """
    linear, square = 6 * mean - 4 * first - 2 * last, 3 * (first + last - 2 * mean)
    dips = (square > 0) & (linear < 0) & (linear > -2 * square)
    return (last <= 0) | np.logical_not(dips) | (first - linear * linear / (4 * square) >= least)
