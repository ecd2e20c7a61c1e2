"""The linear problem of placed guides: distances from the nominal and constraints with their derivatives.

The nominal stays where it is and the linkage moves under it: translations and rotations of the whole linkage stand for
those of the nominal.  Only the radius of an arc is a coordinate of its own.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..guide.minimax import exchange, grid
from ..guide.span import Span
from ..linkage import Array
from ..query.lay import Answers
from ..query.request import FULLEST, Request
from .derivatives import swayed
from .limits import bounds, limits
from .task import Task

#: Intervals between the points at which the distance is linearised; every other one is where transmission is read.
NODES = 32
#: A radius that is given is held within this part of it; one that is not given does not grow beyond so many strokes.
HELD, FLATTEST = 0.9e-3, 50.0


@dataclass(frozen=True)
class Linear:
    """Errors and constraints of n guides, linearised in p coordinates.

    Attributes
    ----------
    error : ndarray, shape (n, m)
        Distances from the nominal along the path, whose largest is to become least [length].
    jacobian : ndarray, shape (n, m, p)
        Their derivatives; coordinates are scaled so that a step of 1 is large.
    value, slope : ndarray, shape (n, k) and (n, k, p)
        Inequalities: value + slope s <= 0.
    """

    error: Array
    jacobian: Array
    value: Array
    slope: Array

    def inside(self, margin: float) -> Linear:
        """Return the problems with all inequalities tightened."""
        return replace(self, value=self.value + margin)

    def repeated(self, times: int) -> Linear:
        """Return all problems again and again."""
        return Linear(*(np.tile(a, (times,) + (1,) * (a.ndim - 1)) for a in vars(self).values()))


def linearised(now: Answers, guides: Span, task: Task, spare: Array) -> Linear:
    """Return the linear problem of placed guides.

    Parameters
    ----------
    guides : Span of n
        Of the same guides.
    spare : ndarray, shape (n,)
        By how much the price of each may rise.

    Returns
    -------
    Linear
        Its coordinates are those of `task.moves` and, for an arc, the radius in strokes.
    """
    nodes, fit, request = grid(NODES).nodes, now.traced.fit, task.request
    low, high = now.traced.low.astype(float), now.traced.high.astype(float)
    u, v = guides.path.window(low, high, nodes)
    z = guides.point + (u + 1j * v) * guides.tangent
    t = 0.5 * (high + low) + 0.5 * (high - low) * nodes[:, None]
    start, along, curvature = fit.start.astype(complex), fit.along.astype(complex), fit.curvature.astype(float)
    stroke, bend = fit.stroke.astype(float), None
    if task.nominal is not None:
        error, tangent = task.nominal.off(z), task.nominal.along(z)[1]
    elif request.kind == "line":
        error, tangent = ((z - start) * along.conj()).imag, along
    else:
        side, radius = np.sign(curvature), 1 / np.abs(curvature)
        depth = np.sqrt(radius**2 - 0.25 * stroke**2)
        spoke = start + along * (0.5 * stroke + 1j * side * depth) - z  # to the centre
        inward = spoke / np.abs(spoke)
        tangent = -1j * side * inward
        error = _centred(side * (radius - np.abs(spoke)), tangent * along.conj())
        bend = side * (1 - radius / depth * (inward.conj() * 1j * along * side).real)  # the ends of the arc stay
    by = swayed(guides.motion, guides.point, t, tangent)
    basis = task.moves.basis(now, request.stroke)
    to = bounds(now, request, task.wanted, task.rank, spare)
    value, slope = limits(now, guides.motion, t[::2], by.every(2), request, task.wanted, to)
    jacobian, slope = np.moveaxis(by.across, 0, 1) @ basis, slope @ basis
    if bend is not None:
        jacobian = np.concatenate([jacobian, bend.T[..., None] * request.stroke], axis=-1)
        value, slope = _with_radius(value, slope, curvature, request)
    return Linear(*_at_peaks(error.T, jacobian), value, slope)


def _at_peaks(error: Array, jacobian: Array) -> tuple[Array, Array]:
    """Return errors (n, m) and derivatives (n, m, p) carried from the nodes to where, between two nodes each, the error
    is largest: one of four points."""
    fine = grid(NODES).fine
    error, jacobian = error @ fine.T, fine @ jacobian
    n, m = error.shape
    worst = np.argmax(np.abs(error[:, 1:]).reshape(n, -1, 4), axis=2) + 1 + np.arange(0, m - 1, 4)
    at = np.concatenate([np.zeros((n, 1), int), worst], axis=1)
    return np.take_along_axis(error, at, 1), np.take_along_axis(jacobian, at[..., None], 1)


def _centred(error: Array, inward: Array) -> Array:
    """Return distances from circles (m, n) after these, which ran through the ends of the paths, are best placed.

    `inward` are the unit vectors to the centre, 1 in the middle of the path; a shift of the circle changes a distance
    by a polynomial of degree 1 in their tangent, times their cosine.
    """
    middle = len(error) // 2
    start = np.repeat(np.array([[0], [middle], [len(error) - 1]]), error.shape[1], axis=1)
    tangent = inward.imag / inward.real
    (a, b), _, _ = exchange(tangent, error, start, 1 / inward.real, peaks=False)
    return np.asarray(error - (a + b * tangent) * inward.real)


def _with_radius(value: Array, slope: Array, curvature: Array, request: Request) -> tuple[Array, Array]:
    """Return the inequalities with those of the radius, one more coordinate [strokes]."""
    radius = 1 / np.abs(curvature) / request.stroke
    if request.radius is None:
        least, most = np.minimum(radius, 1 / FULLEST), np.maximum(radius, FLATTEST)
    else:
        given = np.full(len(radius), request.radius / request.stroke)
        least, most = given * (1 - HELD), given * (1 + HELD)
    rows = np.zeros((len(slope), slope.shape[1] + 2, slope.shape[2] + 1))
    rows[:, :-2, :-1] = slope
    rows[:, -2, -1], rows[:, -1, -1] = 1.0, -1.0
    return np.concatenate([value, np.stack([radius - most, least - radius], axis=1)], axis=1), rows
