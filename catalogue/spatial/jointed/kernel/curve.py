"""Steps along the curve of the poses, by predictor and corrector, to a value of the drive or a dead point."""

from __future__ import annotations

from math import sqrt
from typing import Any, NamedTuple

import numpy as np

from ...native.compiling import compiled
from ...native.elimination import substitute
from .newton import around, factored, lacking, largest, moved, select, unitary
from .pose import CYLINDRICAL, FREE, Plan, evaluate

#: Why a curve ended: it was to, or the reasons of `tracing`; a matrix was singular, which numpy solves.
REACHED, TURNING, BRANCH, STUCK, LONG, SINGULAR = range(6)


class Limits(NamedTuple):
    """Of a step: the constants of `tracing`."""

    aim: Any
    refused: Any
    first: Any
    longest: Any
    shortest: Any
    contraction: Any
    at_branch: Any
    bow: Any
    turn: Any
    last: Any


class Nodes(NamedTuple):
    """Room for the nodes of a `Trace`."""

    s: Any
    y: Any
    rate: Any
    drive: Any
    slope: Any
    tangent: Any
    jacobian: Any


def nodes(plan: Plan, most: int, numbers: int) -> Nodes:
    """Return room for nodes."""
    m = plan.moves.shape[1]
    shapes = ((most,), (most, numbers), (most, numbers), (most,), (most,), (most, m), (most, m - 1, m))
    return Nodes(*(np.empty(shape) for shape in shapes))


@compiled
def lifted(plan, y, step, out):
    """Find the rates of a state when the unknowns have those given."""
    for j in range(len(plan.joints)):
        joint_kind, u, n = plan.joints[j, 0], plan.joints[j, 3], plan.joints[j, 4]
        if joint_kind == FREE:
            hx, hy, hz = step[u] / 2, step[u + 1] / 2, step[u + 2] / 2
            s, vx, vy, vz = y[n], y[n + 1], y[n + 2], y[n + 3]
            out[n] = -(hx * vx + hy * vy + hz * vz)
            out[n + 1] = s * hx + (hy * vz - hz * vy)
            out[n + 2] = s * hy + (hz * vx - hx * vz)
            out[n + 3] = s * hz + (hx * vy - hy * vx)
            for i in range(3):
                out[n + 4 + i] = step[u + 3 + i]
        else:
            out[n] = step[u]
            if joint_kind == CYLINDRICAL:
                out[n + 1] = step[u + 1]


@compiled
def cubic(t, h, a, b, da, db):
    """Return Hermite's cubic at the part t of an interval h."""
    u = 1 - t
    return u * u * ((1 + 2 * t) * a + t * h * da) + t * t * ((3 - 2 * t) * b - u * h * db)


@compiled
def across(plan, held, w, border):
    """Find Newton's step across a tangent, and the unit vector along the curve; return the sign of the determinant."""
    sign = factored(border, w)
    if sign != 0:
        lacking(plan, held, w)
        m = len(border)
        w.step[m - 1] = 0.0
        substitute(w.matrix, m, w.interchanged, w.step)
        for i in range(m):
            w.along[i] = 0.0
        w.along[m - 1] = 1.0
        substitute(w.matrix, m, w.interchanged, w.along)
        size = 0.0
        for i in range(m):
            size += w.along[i] * w.along[i]
        size = sqrt(size)
        for i in range(m):
            w.along[i] /= size
    return sign


@compiled
def size_of(v):
    """Return the length of a vector."""
    total = 0.0
    for i in range(len(v)):
        total += v[i] * v[i]
    return sqrt(total)


@compiled
def stepped(plan, geometry, g, held, h, back, nodes, k, b, w):
    """Try a step from node k of nodes, node b before it; leave the new state, its rates and its tangent in `w`.

    Returns
    -------
    sign : int
        Of the bordered determinant; 0 if singular.
    first, second : float
        Sizes of the corrections.
    value, slope : float
        The drive, and its derivative.
    """
    y, m, drive = w.y, plan.moves.shape[1], len(plan.moves) - 1
    t = 1 + h / back
    for i in range(len(y)):
        y[i] = cubic(t, back, nodes.y[b, i], nodes.y[k, i], nodes.rate[b, i], nodes.rate[k, i])
    unitary(plan, y)
    evaluate(plan, geometry, g, y, w, True)
    if across(plan, held, w, nodes.tangent[k]) == 0:
        return 0, 0.0, 0.0, 0.0, 0.0
    first = size_of(w.step)
    moved(plan, y, w.step)
    for i in range(m):
        w.tangent[i] = w.along[i]
    evaluate(plan, geometry, g, y, w, True)
    sign = across(plan, held, w, w.tangent)
    if sign == 0:
        return 0, 0.0, 0.0, 0.0, 0.0
    second = size_of(w.step)
    value, slope = w.value[drive], 0.0
    if plan.scalars[-1, 4]:
        value = nodes.drive[k] + around(value - nodes.drive[k])
    for i in range(m):
        w.tangent[i] = w.along[i]
        value += w.jacobian[drive, i] * w.step[i]
        slope += w.jacobian[drive, i] * w.along[i]
    moved(plan, y, w.step)
    lifted(plan, y, w.tangent, w.rate)
    return sign, first, second, value, slope


@compiled
def good_step(plan, h, nodes, k, first, second, w, limits):
    """Return whether a step is one along the same smooth curve, but for the sign of its determinant, and its arc."""
    chord, cosine, turning = 0.0, 0.0, 0.0
    for i in range(len(w.y)):
        ahead = w.y[i] - nodes.y[k, i]
        chord += plan.weight[i] * ahead * ahead
        cosine += plan.weight[i] * w.rate[i] * nodes.rate[k, i]
    arc = sqrt(chord) * (1 + (2 - 2 * cosine) / 24)
    bow = 0.0
    if not plan.idle.size:
        for i in range(len(w.y)):
            off = w.y[i] - nodes.y[k, i] - 0.5 * arc * (nodes.rate[k, i] + w.rate[i])
            bow += plan.weight[i] * off * off
    for i in range(len(w.tangent)):
        turning += w.tangent[i] * nodes.tangent[k, i]
    good = first <= min(limits.refused, 0.1 * h) and second <= max(limits.contraction * first, limits.last)
    return good and turning >= limits.turn and bow <= (limits.bow * arc) ** 2, arc


@compiled
def write_node(plan, nodes, k, s, value, slope, w):
    """Write the pose of the last step as node k."""
    nodes.s[k], nodes.drive[k], nodes.slope[k] = s, value, slope
    for i in range(len(w.y)):
        nodes.y[k, i], nodes.rate[k, i] = w.y[i], w.rate[i]
    for j in range(len(w.tangent)):
        nodes.tangent[k, j] = w.tangent[j]
        for i in range(len(plan.keep)):
            nodes.jacobian[k, i, j] = w.jacobian[w.rows[i], j]


@compiled
def step(plan, geometry, g, held, h, orientation, nodes, k, b, to, limits, w):
    """Try a step from node k, b before it, and write it as node `to`.

    Returns the next length of step, whether the step was made, whether it would have changed the orientation, and
    whether a matrix was singular.
    """
    if plan.redundant:  # conditions that stand for all others where the step begins
        evaluate(plan, geometry, g, nodes.y[k], w, True)
        select(plan, held, w)
        orientation = factored(nodes.tangent[k], w)
    sign, first, second, value, slope = stepped(plan, geometry, g, held, h, nodes.s[k] - nodes.s[b], nodes, k, b, w)
    if sign == 0:
        return h, False, False, True
    good, arc = good_step(plan, h, nodes, k, first, second, w, limits)
    crossing = sign != orientation
    change = (limits.aim / max(first, 1e-9)) ** 0.25 if first == first else 0.3
    change = min(max(change, 0.3), 2.0)
    if good and not crossing:
        write_node(plan, nodes, to, nodes.s[k] + arc, value, slope, w)
        return min(change * h, limits.longest), True, False, False
    return min(min(change, 0.5) * h, limits.longest), False, crossing, False


@compiled
def toward(plan, geometry, g, held, orientation, target, nodes, limits, w):
    """Follow a curve from node 1, node 0 before it, until its drive has passed a target, or turns back.

    Returns the last node and why it ended.
    """
    direction = np.sign(target - nodes.drive[1])
    if direction == 0:
        return 1, REACHED
    k, h = 1, limits.first
    for _ in range(len(nodes.s) - 2):
        h, made, crossing, singular = step(plan, geometry, g, held, h, orientation, nodes, k, k - 1, k + 1, limits, w)
        if singular:
            return k, SINGULAR
        k += made
        passed = made and direction * (nodes.drive[k] - target) >= 0
        if made and not passed and direction * nodes.slope[k] <= 0:
            return k, TURNING
        if h < (limits.at_branch if crossing else limits.shortest):
            return k, BRANCH if crossing else STUCK
        if passed:
            return k, REACHED
    return k, LONG


@compiled
def slope_at(plan, geometry, g, held, nodes, i, s, limits, w):
    """Return the slope of the drive at an arc length next to nodes i and i + 1; the pose and its tangent are in `w`."""
    h, drive = nodes.s[i + 1] - nodes.s[i], len(plan.moves) - 1
    t = (s - nodes.s[i]) / h
    for j in range(len(w.y)):
        w.y[j] = cubic(t, h, nodes.y[i, j], nodes.y[i + 1, j], nodes.rate[i, j], nodes.rate[i + 1, j])
    unitary(plan, w.y)
    for n in range(8):
        evaluate(plan, geometry, g, w.y, w, True)
        if n == 0 and plan.redundant:
            select(plan, held, w)
        if across(plan, held, w, nodes.tangent[i]) == 0:
            break
        moved(plan, w.y, w.step)
        if not largest(w.step) > limits.last:
            break
    slope = 0.0
    for j in range(len(w.along)):
        slope += w.jacobian[drive, j] * w.along[j]
    return slope


@compiled
def stationary(plan, geometry, g, held, nodes, i, limits, w):
    """Find the pose next to nodes i and i + 1 where the drive is stationary; return its arc length.

    By false position, where the slope changes its sign; else the place is a little outside, where a secant finds it.
    """
    a, b = nodes.s[i], nodes.s[i + 1]
    low, high, s = 1.5 * a - 0.5 * b, 1.5 * b - 0.5 * a, b
    f = slope_at(plan, geometry, g, held, nodes, i, a, limits, w)
    v = slope_at(plan, geometry, g, held, nodes, i, b, limits, w)
    if f * v < 0:
        for _ in range(100):
            s = b - v * (b - a) / (v - f)
            new = slope_at(plan, geometry, g, held, nodes, i, s, limits, w)
            if new * v < 0:
                a, f = b, v
            else:  # Anderson and Björck's share keeps the other end from staying
                share = 1 - new / v
                f *= share if share > 0 else 0.5
            gone, b, v = abs(s - b), s, new
            if v == 0 or gone < 1e-13 or abs(b - a) < 1e-13:
                break
        return s
    for _ in range(20):
        if v == f or abs(v) < 1e-10:
            break
        s, a, f = min(max(s - v * (s - a) / (v - f), low), high), s, v
        v = slope_at(plan, geometry, g, held, nodes, i, s, limits, w)
    return s


@compiled
def up_to_dead_point(plan, geometry, g, held, nodes, k, limits, w):
    """Put the dead point that lies before node k in its place."""
    s = stationary(plan, geometry, g, held, nodes, k - 1, limits, w)
    evaluate(plan, geometry, g, w.y, w, True)
    value = w.value[len(plan.moves) - 1]
    if plan.scalars[-1, 4]:
        value = nodes.drive[k - 1] + around(value - nodes.drive[k - 1])
    for j in range(len(w.tangent)):
        w.tangent[j] = w.along[j]
    lifted(plan, w.y, w.tangent, w.rate)
    write_node(plan, nodes, k, s, value, 0.0, w)
