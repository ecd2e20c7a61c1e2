"""Trace a curve of poses, compiled, to a drive value or dead point; interpolate poses.

A plan has these fields: `keep`, rows of the conditions; `redundant`, whether some imply others;
`scalars`, the last entry of the last row says whether the drive is known up to whole turns;
`weight`, weights of a rate in its norm; `idle`, conditions against idle rotations.
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np

from ...kinematics.types import Floats
from ..continuation import curve as formulas
from .compiling import ONE, ZERO, compiled, inlined
from .elimination import substitute
from .equations import lifted, moved, unitary
from .newton import around, evaluated, factored, lacking, largest, select

cubic, cubic_slope, rises = inlined(formulas.cubic), inlined(formulas.cubic_slope), inlined(formulas.rises)

#: Least value of t^2 (1 - t)^2, at fraction t of an interval, that reveals the error of its cubic.
MIN_ERROR_FACTOR = 1e-3
#: Least divisor.
TINY = 1e-9
#: Reasons for the end of a curve.  SINGULAR: numpy repeats the step.  EDGE and DOUBTFUL, a pose
#: that may not be on the curve, occur for bodies on guides only.
REACHED, TURNING, BRANCH, STUCK, LONG, SINGULAR, EDGE, DOUBTFUL = range(8)


class Nodes(NamedTuple):
    """Preallocated arrays of the nodes of a curve."""

    s: Floats
    y: Floats
    rate: Floats
    drive: Floats
    slope: Floats
    tangent: Floats


def nodes(unknowns: int, most: int, numbers: int) -> Nodes:
    """Allocate the arrays of `most` nodes."""
    m = unknowns
    shapes = ((most,), (most, numbers), (most, numbers), (most,), (most,), (most, m))
    return Nodes(*(np.empty(shape) for shape in shapes))


@inlined
def at(plan, geometry, g, y, w):
    """Compute residuals and the drive in one state, with their Jacobian."""
    evaluated(plan, geometry, g, y, w, True)


@inlined
def across(plan, held, w, border):
    """Compute Newton's step across a tangent, and the unit vector along the curve.

    Return the sign of the determinant.
    """
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


@inlined
def size_of(v):
    """Return the length of a vector."""
    total = 0.0
    for i in range(len(v)):
        total += v[i] * v[i]
    return sqrt(total)


@inlined
def stepped(plan, geometry, g, held, h, back, nodes, k, b, w):
    """Try a step from node k, with previous node b; store state, rates and tangent in `w`.

    Returns
    -------
    sign : int
        Sign of the bordered determinant; 0 if singular.
    first, second : float
        Sizes of the corrections.
    value, slope : float
        The drive, and its derivative.
    """
    y, m, drive = w.y, len(w.step), len(w.value) - 1
    t = 1 + h / back
    for i in range(len(y)):
        y[i] = cubic(t, back, nodes.y[b, i], nodes.y[k, i], nodes.rate[b, i], nodes.rate[k, i])
    unitary(plan, y)
    at(plan, geometry, g, y, w)
    if across(plan, held, w, nodes.tangent[k]) == 0:
        return 0, 0.0, 0.0, 0.0, 0.0
    first = size_of(w.step)
    moved(plan, y, w.step)
    for i in range(m):
        w.tangent[i] = w.along[i]
    at(plan, geometry, g, y, w)
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


@inlined
def good_step(plan, h, nodes, k, first, second, w, limits):
    """Return whether a step stays on its smooth curve, without the test of the determinant.

    Besides: its arc length, the permitted ratio of the next step to it, and the square of the
    rotation of the tangent.  Corrections grow like the fourth power of a step, the rotation like
    the step, the bow like its square.
    """
    chord, cosine, turn = 0.0, 0.0, 0.0
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
        turn += (w.tangent[i] - nodes.tangent[k, i]) ** 2
    turned, bent = turn / (2 - 2 * limits.turn), bow / max(limits.bow * arc, TINY) ** 2
    good = first <= min(limits.refused, 0.1 * h) and second <= max(limits.contraction * first, limits.last)
    change = min(limits.aim / max(first, TINY), 0.5 / max(bent, TINY)) ** 0.25
    change = min(max(min(change, 0.7 / sqrt(max(turned, TINY))), 0.3), 2.0)
    return good and turned <= 1 and bent <= 1, arc, change if first == first else 0.3, turn


@inlined
def write_node(nodes, k, s, value, slope, w):
    """Write the pose of the last step as node k."""
    nodes.s[k], nodes.drive[k], nodes.slope[k] = s, value, slope
    for i in range(len(w.y)):
        nodes.y[k, i], nodes.rate[k, i] = w.y[i], w.rate[i]
    for j in range(len(w.tangent)):
        nodes.tangent[k, j] = w.tangent[j]


@compiled
def step(plan, geometry, g, held, h, orientation, nodes, k, b, to, limits, w):
    """Try a step from node k, with previous node b, and write it as node `to`.

    Return the next step length, whether the step was accepted, whether it would have changed the
    orientation, and whether a matrix was singular.
    """
    if plan.redundant:  # conditions that imply all others at the start of the step
        at(plan, geometry, g, nodes.y[k], w)
        select(plan, held, w)
        orientation = factored(nodes.tangent[k], w)
    sign, first, second, value, slope = stepped(plan, geometry, g, held, h, nodes.s[k] - nodes.s[b], nodes, k, b, w)
    if sign == 0:
        return h, False, False, True
    good, arc, change, turn = good_step(plan, h, nodes, k, first, second, w, limits)
    if good and limits.margin >= 0:
        mean = (value - nodes.drive[k]) / arc
        good = rises(nodes.slope[k], slope, mean, limits.margin * turn**1.5)
    crossing = sign != orientation
    if good and not crossing:
        write_node(nodes, to, nodes.s[k] + arc, value, slope, w)
        return min(change * h, limits.longest), True, False, False
    return min(min(change, 0.5) * h, limits.longest), False, crossing, False


@compiled
def toward(plan, geometry, g, held, orientation, h, target, nodes, limits, w):
    """Trace a curve from node 1 until its drive passes a target or reverses.

    Return the last node, the reason of the end, and the number of attempted steps.
    """
    direction, most = np.sign(target - nodes.drive[1]), len(nodes.s) - 2
    k = ONE
    if direction == 0:
        return k, REACHED, ZERO
    for n in range(most):
        h, made, crossing, singular = step(plan, geometry, g, held, h, orientation, nodes, k, k - 1, k + 1, limits, w)
        if singular:
            return k, SINGULAR, n + 1
        k += made
        passed = made and direction * (nodes.drive[k] - target) >= 0
        if made and not passed and direction * nodes.slope[k] <= 0:
            return k, TURNING, n + 1
        if h < (limits.at_branch if crossing else limits.shortest):
            return k, BRANCH if crossing else STUCK, n + 1
        if passed:
            return k, REACHED, n + 1
    return k, LONG, most


@compiled
def slope_at(plan, geometry, g, held, nodes, i, s, limits, w):
    """Return the slope of the drive at an arc length near node i; store the pose in `w`."""
    h, drive = nodes.s[i + 1] - nodes.s[i], len(w.value) - 1
    t = (s - nodes.s[i]) / h
    for j in range(len(w.y)):
        w.y[j] = cubic(t, h, nodes.y[i, j], nodes.y[i + 1, j], nodes.rate[i, j], nodes.rate[i + 1, j])
    unitary(plan, w.y)
    for n in range(8):
        at(plan, geometry, g, w.y, w)
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
    """Find the pose near nodes i and i + 1 with a stationary drive; return its arc length.

    Uses false position if the slope changes sign between them; else a secant, for the pose is just
    outside.
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
            else:  # Anderson and Björck's factor: without it one end would never move
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
    """Replace node k by the dead point before it."""
    s = stationary(plan, geometry, g, held, nodes, k - 1, limits, w)
    at(plan, geometry, g, w.y, w)
    value = w.value[len(w.value) - 1]
    if plan.scalars[-1, 4]:
        value = nodes.drive[k - 1] + around(value - nodes.drive[k - 1])
    for j in range(len(w.tangent)):
        w.tangent[j] = w.along[j]
    lifted(plan, w.y, w.tangent, w.rate)
    write_node(nodes, k, s, value, 0.0, w)


@inlined
def where(nodes, i, direction, value):
    """Return the fraction of the interval from node i at which the drive has a value."""
    h, low, high = nodes.s[i + 1] - nodes.s[i], 0.0, 1.0
    a, b, da, db = nodes.drive[i], nodes.drive[i + 1], nodes.slope[i], nodes.slope[i + 1]
    t = min(max((value - a) / (b - a if b != a else 1.0), 0.0), 1.0)
    for _ in range(6):
        off = cubic(t, h, a, b, da, db) - value
        if direction * off < 0:
            low = t
        else:
            high = t
        better = t - off / cubic_slope(t, h, a, b, da, db)
        if not low <= better <= high:
            better = (low + high) / 2
        gone, t = abs(better - t), better
        if gone < 1e-9:
            break
    return t


@inlined
def between(nodes, i, last, direction, value, bulge, w):
    """Interpolate the pose at a value of the drive between nodes, from node i.

    The error of the cubic is nearly proportional to t^2 (1 - t)^2.  The pose before had the error
    `off` at the value `bulge` of this factor; the cubic is corrected in proportion.  Return the
    node before the pose, and the factor; `off` becomes the uncorrected cubic.
    """
    drive = nodes.drive
    if last == 1:
        for j in range(len(w.y)):
            w.y[j] = w.off[j] = nodes.y[1, j]
        return 1, 0.0
    first = i
    if direction * drive[i] >= direction * value:
        i = 1
    while i < last - 1 and direction * drive[i + 1] < direction * value:
        i += 1
    t, h = where(nodes, i, direction, value), nodes.s[i + 1] - nodes.s[i]
    new = (t * (1 - t)) ** 2
    share = new / bulge if i == first and bulge > MIN_ERROR_FACTOR else 0.0
    for j in range(len(w.y)):
        there = cubic(t, h, nodes.y[i, j], nodes.y[i + 1, j], nodes.rate[i, j], nodes.rate[i + 1, j])
        w.y[j], w.off[j] = there + (share * w.off[j] if share > 0 else 0.0), there
    return i, new
