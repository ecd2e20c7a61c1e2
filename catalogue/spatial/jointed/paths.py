"""Follow a path of the values of all scalars by `continuation`."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import PchipInterpolator

from ...kinematics.types import Array
from ..continuation.tracing import LONG, trace_toward
from .curve import Curve, tangents, wrapped
from .newton import solved
from .system import System

#: Least arc length between points of a path [rad, units]; between closer points it is smooth.
MIN_ARC = 0.02


@dataclass(frozen=True)
class Course:
    """Monotone cubic interpolation of the values of all scalars.

    Attributes
    ----------
    factors : ndarray, shape (4, p - 1, n, f)
        Coefficients of the cubics from point to point.
    who : ndarray, shape (m,)
        Numbers of the mechanisms that follow it.
    """

    factors: Array
    who: Array

    @staticmethod
    def through(points: Array) -> Course:
        """Return the course through points (p, n, f), p at least 2."""
        smooth = PchipInterpolator(np.arange(len(points)), points, axis=0)
        return Course(smooth.c, np.arange(points.shape[1]))

    def take(self, index: Array) -> Course:
        """Return the course of some mechanisms."""
        return replace(self, who=self.who[index])

    def __call__(self, at: Array) -> tuple[Array, Array]:
        """Return values (m, f) and rates at parameters (m,); linear beyond the last point."""
        end = self.factors.shape[1]
        within = np.minimum(at, end)
        i = np.clip(within.astype(int), 0, end - 1)
        a, b, c, d = self.factors[:, i, self.who]
        t = (within - i)[:, None]
        rates = (3 * a * t + 2 * b) * t + c
        return ((a * t + b) * t + c) * t + d + (at - within)[:, None] * rates, rates


@dataclass(frozen=True)
class PathCurve(Curve):
    """Poses along a course; the drive, parameter / `speed`, is the last number of a state."""

    course: Course | None = None
    speed: float = 1.0
    periodic = False

    @property
    def weight(self) -> Array:
        return np.append(self.system.weight, 1.0)

    def take(self, index: Array) -> PathCurve:
        assert self.course is not None
        return replace(
            self,
            system=self.system.take(index),
            held=self.held[index],
            rows=None if self.rows is None else self.rows[index],
            course=self.course.take(index),
        )

    def __call__(self, y: Array) -> tuple[Array, Array, Array, Array]:
        assert self.course is not None
        f, values, jacobian = self._independent(y[:, :-1])
        asked, rates = self.course(self.speed * y[:, -1])
        off = wrapped(self.system, values - asked)
        along, by = np.zeros((*jacobian.shape[:2], 1)), np.zeros((len(y), jacobian.shape[2] + 1))
        along[:, f.shape[1] :, 0], by[:, -1] = -self.speed * rates, 1
        return np.concatenate([f, off], axis=1), np.concatenate([jacobian, along], axis=2), y[:, -1], by

    def selected(self, y: Array) -> PathCurve:
        return super().selected(y[:, :-1])

    def unitary(self, y: Array) -> Array:
        return np.concatenate([self.system.unitary(y[:, :-1]), y[:, -1:]], axis=1)

    def moved(self, y: Array, step: Array) -> Array:
        return np.concatenate([self.system.moved(y[:, :-1], step[:, :-1]), y[:, -1:] + step[:, -1:]], axis=1)

    def lifted(self, y: Array, step: Array) -> Array:
        return np.concatenate([self.system.lifted(y[:, :-1], step[:, :-1]), step[:, -1:]], axis=1)

    def compiled_step(self, march: object) -> None:
        """Return None: steps are made by numpy."""


def follow(system: System, y: Array, points: Array) -> tuple[Array, Array]:
    """Follow a path of all scalars through points (p, n, f) from states (n, numbers).

    Returns
    -------
    states : ndarray, shape (p, n, numbers)
        NaN at points beyond the end of a motion.
    reached : ndarray, shape (n,)
        Progress of each mechanism, in points from the first.
    """
    end, n = len(points) - 1, len(y)
    states, reached = np.full((end + 1, *y.shape), np.nan), np.zeros(n)
    states[0] = y
    gone = float(np.abs(np.diff(points, axis=0)).max((1, 2), initial=0).sum())
    speed = end / max(gone, MIN_ARC * end) if end else 1.0
    who, here = np.arange(n if end else 0), np.concatenate([y, np.zeros((n, 1))], axis=1)
    while len(who):
        curve = PathCurve(system, np.zeros((n, 0)), course=Course.through(points), speed=speed).take(who)
        _, j, _, by = curve.selected(here)(here)
        traces = trace_toward(curve, here, tangents(j, by)[0], np.full(len(who), end / speed))
        last = traces.last
        came = np.where(traces.reason == "", end, np.minimum(speed * traces.nodes.drive[last], end))
        passed = (np.arange(end + 1)[:, None] > reached[who]) & (np.arange(end + 1)[:, None] <= came)
        point, one = np.nonzero(passed)
        if len(point):
            states[point, who[one]] = traces.between(one, point / speed)[0][:, :-1]
        reached[who] = came
        more = traces.reason == LONG
        who, here = who[more], traces.nodes.y[last[more]]
    return states, reached


def corrected(system: System, states: Array, values: Array) -> Array:
    """Correct states (p, n, numbers) to values (p, n, f) of all scalars; NaN where that fails."""
    p, n = states.shape[:2]
    flat, wanted = states.reshape(p * n, -1), values.reshape(p * n, -1)
    some = np.flatnonzero(np.isfinite(flat).all(1))
    who = np.tile(np.arange(n), p)[some]
    curve = Curve(system.take(who), wanted[some, :-1])
    out = np.full_like(flat, np.nan)
    found, good = solved(curve, flat[some], wanted[some, -1])
    found[~good] = np.nan
    out[some] = found
    return out.reshape(states.shape)
