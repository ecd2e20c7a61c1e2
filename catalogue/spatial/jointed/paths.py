"""Continuation along a path of the values of all scalars."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator

from ...kinematics.types import Array
from ..continuation.curve import around, cubic
from ..continuation.newton import LAST, solve
from .curve import Curve
from .newton import solved
from .system import System

#: Largest first correction at a node of a path [rad, units]: beyond it the next assembly may be
#: nearer.
REFUSED = 1e-2
#: First correction at a node for which steps aim [rad, units]: that of single drives
#: (`tracing.AIM`).
AIM = 2e-3
#: Largest second correction over the first: Newton's method contracts, or another assembly is near.
CONTRACTION = 0.2
#: First step along a path, in the change of its values [rad, units].
FIRST = 0.1
#: Shortest step [rad, units]: where shorter ones fail the values cannot go on.
SHORTEST = 1e-7
#: How far values between nodes may be off the cubic through them [rad, units]: poses start there.
BOW = 1e-2


@dataclass(frozen=True)
class Course:
    """Values of all scalars along a path: `values` (n, f) and their rates (n, f) by its parameter,
    from 0 to `end`.
    """

    values: Callable[[Any], Array]
    rates: Callable[[Any], Array]
    end: int

    @staticmethod
    def through(points: Array) -> Course:
        """Return the course through points (p, n, f), which overshoots none of their values."""
        if len(points) == 1:
            return Course(lambda _: points[0], lambda _: np.zeros_like(points[0]), 0)
        smooth = PchipInterpolator(np.arange(len(points)), points, axis=0)
        return Course(smooth, smooth.derivative(), len(points) - 1)

    def bow(self, a: float, b: float) -> float:
        """Return how far values between two parameters are off the cubic through both."""
        inner = np.arange(np.floor(a) + 1, np.ceil(b))
        inner = inner if len(inner) < 64 else np.unique(np.linspace(inner[0], inner[-1], 64).round())
        if not len(inner):
            return 0.0
        t, h = ((inner - a) / (b - a))[:, None, None], np.asarray(b - a)
        there = cubic(t, h, self.values(a), self.values(b), self.rates(a), self.rates(b))
        return float(np.abs(there - self.values(inner)).max())


@dataclass(frozen=True)
class Followed:
    """Nodes of a path, as many as steps were made: parameter (k,), states and their rates (k, n,
    numbers).

    States are NaN after a mechanism has stopped; `reached` (n,) is the parameter up to which it
    came.
    """

    parameter: Array
    states: Array
    rates: Array
    reached: Array

    def between(self, parameter: Array) -> Array:
        """Return states (p, n, numbers) at parameters (p,), by cubics between nodes."""
        if len(self.parameter) == 1:
            return np.repeat(self.states, len(parameter), axis=0)
        i = np.clip(np.searchsorted(self.parameter, parameter) - 1, 0, len(self.parameter) - 2)
        h = (self.parameter[i + 1] - self.parameter[i])[:, None, None]
        t = (parameter - self.parameter[i])[:, None, None] / h
        found = cubic(t, h, self.states[i], self.states[i + 1], self.rates[i], self.rates[i + 1])
        here = (t == 0) & np.ones_like(found, bool)  # a mechanism that stops after this node
        return np.asarray(np.where(here, self.states[i], found))


def follow(system: System, y: Array, course: Course) -> Followed:
    """Follow a path of all scalars from states (n, numbers) at its beginning.

    Predictor and corrector: Newton's method on conditions and scalars, from the cubic through the
    last two nodes.
    """
    n, here, step = len(y), 0.0, 1.0
    alive, reached = np.ones(n, bool), np.zeros(n)
    rate, sign = _rates(Curve(system, np.zeros((n, 0))).selected(y), y, course, here)
    nodes = [(here, y, rate)]
    speed = np.abs(course.rates(0.0)).max(initial=0)
    step = min(FIRST / speed if speed > FIRST else 1.0, float(course.end) or 1.0)
    while here < course.end and alive.any():
        to = min(here + step, float(course.end))
        gone = np.abs(course.values(to) - course.values(here)).max(initial=0)
        if course.bow(here, to) > BOW:
            step *= 0.5
            continue
        some = np.flatnonzero(alive)
        found, new_rate, size, good = _step(system, nodes, sign[some], some, course, to)
        if not good.all():
            if max(gone, speed * (to - here)) > SHORTEST and to - here > 1e-12 * course.end:
                step = 0.5 * (to - here)
                continue
            alive[some[~good]] = False
            if not alive.any():
                break
        y, rate = np.full_like(nodes[-1][1], np.nan), np.full_like(nodes[-1][2], np.nan)
        y[some[good]], rate[some[good]] = found[good], new_rate[good]
        nodes.append((to, y, rate))
        here, speed = to, np.abs(course.rates(to)).max(initial=0)
        reached[alive] = here
        step = (to - nodes[-2][0]) * float(np.clip((AIM / max(size[good].max(), 1e-9)) ** 0.25, 0.3, 2.0))
    parameter, states, rates = zip(*nodes, strict=True)
    return Followed(np.array(parameter), np.stack(states), np.stack(rates), reached)


def _step(
    system: System, nodes: Sequence[Any], sign: Array, some: Array, course: Course, to: float
) -> tuple[Array, ...]:
    """Try a step: states, rates, sizes of first corrections, and accepted ones."""
    here, y, rate = nodes[-1]
    if len(nodes) > 1:
        before, y0, rate0 = nodes[-2]
        h = np.asarray(here - before)
        guess = cubic(np.asarray(1 + (to - here) / h), h, y0[some], y[some], rate0[some], rate[some])
    else:
        guess = y[some] + (to - here) * rate[some]
    part = system.take(some)
    guess = part.unitary(guess)
    values = course.values(to)[some]
    curve = Curve(part, values[:, :-1]).selected(y[some])
    if system.redundant:
        sign = np.linalg.slogdet(_square(curve, y[some], values)[1])[0]
    sizes = []
    for _ in range(3):
        f, square = _square(curve, guess, values)
        off = solve(square, -f[..., None])[..., 0]
        guess = part.moved(guess, off)
        sizes.append(np.sqrt((off * off).sum(1)))
        if not sizes[-1].max() > LAST:
            break
    second = sizes[1] if len(sizes) > 1 else np.zeros_like(sizes[0])
    good = (sizes[0] <= REFUSED) & (second <= np.maximum(CONTRACTION * sizes[0], LAST)) & np.isfinite(guess).all(1)
    new_rate, new_sign = _rates(curve, guess, course, to, some)
    return guess, new_rate, sizes[0], good & (new_sign == sign)


def _square(curve: Curve, y: Array, values: Array) -> tuple[Array, Array]:
    """Return what conditions and scalars lack to values (n, f), and their square Jacobian."""
    system, curve = curve.system, replace(curve, held=values[:, :-1])
    f, j, value, by = curve(y)
    last = around(value - values[:, -1]) if system.scalars[-1].periodic else value - values[:, -1]
    return np.concatenate([f, last[:, None]], axis=1), np.concatenate([j, by[:, None]], axis=1)


def _rates(curve: Curve, y: Array, course: Course, at: float, some: Array | None = None) -> tuple[Array, Array]:
    """Solve for rates (n, numbers) by the path's parameter, with signs of Jacobians."""
    wanted = course.rates(at) if some is None else course.rates(at)[some]
    _, square = _square(curve, y, course.values(at) if some is None else course.values(at)[some])
    right = np.zeros(square.shape[:2])
    right[:, -wanted.shape[1] :] = wanted
    return curve.system.lifted(y, solve(square, right[..., None])[..., 0]), np.linalg.slogdet(square)[0]


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
