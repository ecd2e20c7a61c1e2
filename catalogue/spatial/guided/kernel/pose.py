"""Equations of the pose of one body, in the form of `native.equations`.

A state is a quaternion, the free coordinates, and y; the drivers are q0 + y q1.
"""

from __future__ import annotations

from math import sqrt
from typing import Any, NamedTuple

import numpy as np

from ....kinematics.types import Floats, Integers
from ...native import equations
from ...native.compiling import compiled, inlined
from .guides import HALF, HELIX, TORUS, chart, function


class Plan(NamedTuple):
    """Data common to all bodies of a batch; the last five fields serve `native.curve`."""

    points: Integers  # (rows,): number of the point of each equation of undriven points
    driven: Integers  # (d, 4): point, column of its free coordinate, drivers of u and of w; -1 for none
    keep: Integers
    redundant: bool
    scalars: Integers
    weight: Floats
    idle: Integers


def plan(points: Any, driven: Any, free: int) -> Plan:
    """Return a plan for bodies with `free` free coordinates."""
    weight = np.concatenate([np.full(4, 4.0), np.ones(free + 1)])
    others = np.arange(3 + free), False, np.zeros((1, 5), np.int64), weight, np.zeros((1, 0), np.int64)
    return Plan(np.array(points, np.int64), np.array(driven, np.int64), *others)


class Bodies(NamedTuple):
    """Bodies and their guides in units; the first axis counts bodies."""

    arms: Floats  # (n, p, 3)
    frames: Floats  # (n, p, 3, 3)
    origins: Floats  # (n, p, 3)
    kinds: Integers  # (n, p): numbers
    charts: Integers  # (n, d): of the driven points, regular where w is free
    shapes: Floats  # (n, p, 2)
    quadrics: Floats  # (n, rows, 7)
    reach: Floats  # (n,)


class Work(NamedTuple):
    """Work arrays and results of a step: m equations, k drivers, f free coordinates."""

    rotation: Floats  # (3, 3)
    arms: Floats  # (p, 3): points relative to the base, in world axes
    places: Floats  # (d, 3): driven points
    tangents: Floats  # (d, 2, 3): X_u, X_w
    drivers: Floats  # (m, k)
    metric: Floats  # (f,): arc length per unit of each free coordinate
    travel: Floats  # (k,): arc length per unit of each driver
    q: Floats  # (k,)
    q0: Floats  # (k,)
    q1: Floats  # (k,)
    inverse: Floats  # (m, 2 m): Jacobian and unit matrix, during elimination
    value: Floats  # (m + 1,): y last
    jacobian: Floats  # (m + 1, m + 1)
    matrix: Floats  # (m + 1, m + 1): factored
    interchanged: Integers  # (m + 1,): row with which each was interchanged
    step: Floats  # (m + 1,)
    along: Floats  # (m + 1,)
    tangent: Floats  # (m + 1,)
    y: Floats  # (5 + f,)
    rate: Floats  # (5 + f,)
    off: Floats  # (5 + f,)
    rows: Integers  # as `keep`
    left: Floats  # none


@inlined
def turn(y, r):
    """Compute the rotation matrix of a quaternion."""
    s, a, b, c = y[0], y[1], y[2], y[3]
    k = 2 / (s * s + a * a + b * b + c * c)
    r[0, 0], r[0, 1], r[0, 2] = 1 - k * (b * b + c * c), k * (a * b - s * c), k * (a * c + s * b)
    r[1, 0], r[1, 1], r[1, 2] = k * (a * b + s * c), 1 - k * (a * a + c * c), k * (b * c - s * a)
    r[2, 0], r[2, 1], r[2, 2] = k * (a * c - s * b), k * (b * c + s * a), 1 - k * (a * a + b * b)


@inlined
def turned(r, x, y, z):
    """Rotate a vector of the body, or of a guide, to world axes."""
    return (
        r[0, 0] * x + r[0, 1] * y + r[0, 2] * z,
        r[1, 0] * x + r[1, 1] * y + r[1, 2] * z,
        r[2, 0] * x + r[2, 1] * y + r[2, 2] * z,
    )


@inlined
def local(b, i, a, x, y, z):
    """Return a world point in the axes of the guide of point a."""
    r, o = b.frames[i, a], b.origins[i, a]
    x, y, z = x - o[0], y - o[1], z - o[2]
    return (
        r[0, 0] * x + r[1, 0] * y + r[2, 0] * z,
        r[0, 1] * x + r[1, 1] * y + r[2, 1] * z,
        r[0, 2] * x + r[1, 2] * y + r[2, 2] * z,
    )


@inlined
def put(plan, b, i, y, q, w):
    """Compute the positions of all points, and the tangents at driven ones."""
    turn(y, w.rotation)
    for a in range(w.arms.shape[0]):
        w.arms[a, 0], w.arms[a, 1], w.arms[a, 2] = turned(w.rotation, b.arms[i, a, 0], b.arms[i, a, 1], b.arms[i, a, 2])
    for d in range(len(plan.driven)):
        a, column, one, other = plan.driven[d, 0], plan.driven[d, 1], plan.driven[d, 2], plan.driven[d, 3]
        free = y[column + 1] if column >= 0 else 0.0
        x, s, t = chart(
            b.charts[i, d],
            q[one] if one >= 0 else free,
            q[other] if other >= 0 else free,
            b.shapes[i, a, 0],
            b.shapes[i, a, 1],
        )
        r = b.frames[i, a]
        x0, x1, x2 = turned(r, x[0], x[1], x[2])
        w.places[d, 0], w.places[d, 1], w.places[d, 2] = (
            b.origins[i, a, 0] + x0,
            b.origins[i, a, 1] + x1,
            b.origins[i, a, 2] + x2,
        )
        w.tangents[d, 0, 0], w.tangents[d, 0, 1], w.tangents[d, 0, 2] = turned(r, s[0], s[1], s[2])
        w.tangents[d, 1, 0], w.tangents[d, 1, 1], w.tangents[d, 1, 2] = turned(r, t[0], t[1], t[2])
        for axis in range(2):
            k, v = plan.driven[d, 2 + axis], w.tangents[d, axis]
            size = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
            if k >= 0:
                w.travel[k] = size
            elif column >= 0:
                w.metric[column - 3] = size


@inlined
def evaluate(plan, b, i, y, w, slopes):
    """Compute the residual and y in one state; with `slopes`, their derivatives too."""
    m = len(plan.keep)
    for k in range(len(w.q)):
        w.q[k] = w.q0[k] + y[m + 1] * w.q1[k]
    at_drivers(plan, b, i, y, w, slopes)
    w.value[m] = y[m + 1]
    if slopes:
        by_y(w)


@inlined
def by_y(w):
    """Compute the derivatives by y from those by the drivers."""
    m = len(w.drivers)
    for r in range(m):
        slope = 0.0
        for k in range(len(w.q)):
            slope += w.drivers[r, k] * w.q1[k]
        w.jacobian[r, m] = slope


@inlined
def at_drivers(plan, b, i, y, w, slopes):
    """Compute the residual at drivers `q`; with `slopes`, its derivatives too."""
    put(plan, b, i, y, w.q, w)
    rows = len(plan.points)
    for row in range(rows):
        gx, gy, gz = off_guide(plan, b, i, row, w)
        if slopes:
            guide_slopes(plan, b, i, row, gx, gy, gz, w)
    for d in range(1, len(plan.driven)):
        row = rows + 3 * (d - 1)
        for c in range(3):
            w.value[row + c] = w.places[d, c] - w.places[0, c] - w.arms[plan.driven[d, 0], c]
        if slopes:
            driven_slopes(plan, d, row, w)


@inlined
def off_guide(plan, b, i, row, w):
    """Compute the distance of an undriven point from its guide; return the local unit normal."""
    a = plan.points[row]
    ax, ay, az = w.arms[a, 0], w.arms[a, 1], w.arms[a, 2]
    x, y, z = local(b, i, a, w.places[0, 0] + ax, w.places[0, 1] + ay, w.places[0, 2] + az)
    kind = b.kinds[i, a]
    if kind in (TORUS, HELIX):
        second = row > 0 and plan.points[row - 1] == a
        value, gx, gy, gz = function(kind, second, x, y, z, b.shapes[i, a, 0], b.shapes[i, a, 1])
    else:
        c = b.quadrics[i, row]
        value = (c[0] * x + c[3]) * x + (c[1] * y + c[4]) * y + (c[2] * z + c[5]) * z + c[6]
        gx, gy, gz = 2 * c[0] * x + c[3], 2 * c[1] * y + c[4], 2 * c[2] * z + c[5]
    size = 1 / sqrt(gx * gx + gy * gy + gz * gz)
    w.value[row] = value * size
    return gx * size, gy * size, gz * size


@inlined
def guide_slopes(plan, b, i, row, gx, gy, gz, w):
    """Differentiate the distance of an undriven point from its guide, given the normal g."""
    a = plan.points[row]
    ax, ay, az = w.arms[a, 0], w.arms[a, 1], w.arms[a, 2]
    nx, ny, nz = turned(b.frames[i, a], gx, gy, gz)
    j = w.jacobian[row]
    j[0], j[1], j[2] = ay * nz - az * ny, az * nx - ax * nz, ax * ny - ay * nx
    column = plan.driven[0, 1]
    for axis in range(2):
        k, t = plan.driven[0, 2 + axis], w.tangents[0, axis]
        slope = nx * t[0] + ny * t[1] + nz * t[2]
        if k >= 0:
            w.drivers[row, k] = slope
        elif column >= 0:
            j[column] = slope


@inlined
def driven_slopes(plan, d, row, w):
    """Differentiate the gap between guide and body at driven point d, from row `row` on."""
    a = plan.driven[d, 0]
    ax, ay, az = w.arms[a, 0], w.arms[a, 1], w.arms[a, 2]
    w.jacobian[row, 1], w.jacobian[row, 2] = -az, ay
    w.jacobian[row + 1, 0], w.jacobian[row + 1, 2] = az, -ax
    w.jacobian[row + 2, 0], w.jacobian[row + 2, 1] = -ay, ax
    for e in (0, d):
        sign, column = (1.0 if e else -1.0), plan.driven[e, 1]
        for axis in range(2):
            k, t = plan.driven[e, 2 + axis], w.tangents[e, axis]
            for c in range(3):
                if k >= 0:
                    w.drivers[row + c, k] = sign * t[c]
                elif column >= 0:
                    w.jacobian[row + c, column] = sign * t[c]


@inlined
def moved(plan, y, step):
    """Move a state by a step: rotation [rad], coordinates and y."""
    a, b, c = step[0] / 2, step[1] / 2, step[2] / 2
    s, u, v, o = y[0], y[1], y[2], y[3]
    y[0], y[1] = s - (a * u + b * v + c * o), u + s * a + (b * o - c * v)
    y[2], y[3] = v + s * b + (c * u - a * o), o + s * c + (a * v - b * u)
    for j in range(3, len(step)):
        y[1 + j] += step[j]
    unitary(plan, y)


@inlined
def unitary(plan, y):  # noqa: ARG001  # as others
    """Normalise the quaternion."""
    size = 1 / sqrt(y[0] * y[0] + y[1] * y[1] + y[2] * y[2] + y[3] * y[3])
    for j in range(4):
        y[j] *= size


@inlined
def lifted(plan, y, step, out):  # noqa: ARG001  # as others
    """Compute the rates of a state."""
    a, b, c = step[0] / 2, step[1] / 2, step[2] / 2
    s, u, v, o = y[0], y[1], y[2], y[3]
    out[0], out[1] = -(a * u + b * v + c * o), s * a + (b * o - c * v)
    out[2], out[3] = s * b + (c * u - a * o), s * c + (a * v - b * u)
    for j in range(3, len(step)):
        out[1 + j] = step[j]


@inlined
def distance(w):
    """Return the largest distance from a guide, in units; NaN if any distance is NaN."""
    most = 0.0
    for row in range(len(w.value) - 1):
        if not abs(w.value[row]) <= most:
            most = abs(w.value[row])
    return most


@inlined
def off_edge(plan, b, i, y, w):
    """Return whether a point is outside the chart of its guide, with drivers `q`."""
    beyond = False
    for a in range(b.kinds.shape[1]):
        beyond = beyond or (b.kinds[i, a] == HALF and beyond_waist(plan, b, i, a, y, w))
    return beyond


@compiled
def beyond_waist(plan, b, i, a, y, w):
    """Return whether a point is on the other half of its hyperboloid."""
    put(plan, b, i, y, w.q, w)
    z = local(b, i, a, w.places[0, 0] + w.arms[a, 0], w.places[0, 1] + w.arms[a, 1], w.places[0, 2] + w.arms[a, 2])[2]
    return not z >= 0


def work(plan: Plan, points: int, drivers: int) -> Work:
    """Allocate the arrays of one pose."""
    d, m = len(plan.driven), len(plan.keep)
    n, y = m + 1, len(plan.weight)
    shapes = (
        (3, 3),
        (points, 3),
        (d, 3),
        (d, 2, 3),
        (m, drivers),
        (m - 3,),
        (drivers,),
        (drivers,),
        (drivers,),
        (drivers,),
        (m, 2 * m),
        (n,),
        (n, n),
        (n, n),
        (n,),
        (n,),
        (n,),
        (n,),
        (y,),
        (y,),
        (y,),
        (m,),
        (0, 0),
    )
    made = Work._make(np.zeros(shape) for shape in shapes)
    made.jacobian[m, m] = 1.0
    return made._replace(interchanged=np.zeros(n, np.int64), rows=plan.keep.copy())


equations.offer(Plan, (evaluate, moved, unitary, lifted))
