"""The equations of the pose of one body, their solution, and the corrector of a step."""

from __future__ import annotations

from math import inf, sqrt
from typing import Any, NamedTuple

import numpy as np

from ...native.compiling import compiled, inlined
from ...native.elimination import eliminate
from .guides import HALF, HELIX, TORUS, chart, function


class Plan(NamedTuple):
    """What all bodies of a batch have in common."""

    points: Any  # (rows,): point of each equation of an undriven point
    driven: Any  # (d, 4): point, column of its free coordinate, drivers of u and of w; -1 for none


class Bodies(NamedTuple):
    """Bodies and their guides in units, the first axis theirs."""

    arms: Any  # (n, p, 3)
    frames: Any  # (n, p, 3, 3)
    origins: Any  # (n, p, 3)
    kinds: Any  # (n, p): numbers
    charts: Any  # (n, d): of the driven points, regular where w is free
    shapes: Any  # (n, p, 2)
    quadrics: Any  # (n, rows, 7)
    reach: Any  # (n,)


class Limits(NamedTuple):
    """The constants of `newton`, `predictor_corrector`, `continuation` and `filling`."""

    last: Any
    noise: Any
    corrections: Any
    first: Any
    second: Any
    turn: Any
    margin: Any
    bow: Any
    wanted_first: Any
    wanted_turn: Any
    wanted_bow: Any
    longer: Any
    shorter: Any
    longest: Any
    shortest: Any
    at_branch: Any
    few: Any
    near: Any
    alike: Any


class Work(NamedTuple):
    """What an evaluation and a correction leave behind; m equations, k drivers, f free coordinates."""

    rotation: Any  # (3, 3)
    arms: Any  # (p, 3): from the base, in the world
    places: Any  # (d, 3): driven points
    tangents: Any  # (d, 2, 3): X_u, X_w; that of a free coordinate of length 1
    value: Any  # (m,)
    jacobian: Any  # (m, m)
    drivers: Any  # (m, k)
    metric: Any  # (f,)
    travel: Any  # (k,)
    system: Any  # (m + 1, 2 m + k + 3): matrix and right sides
    interchanged: Any  # (m + 1,): with which row each was
    q: Any  # (k,)
    trial: Any  # (4 + f,): state
    along: Any  # (m + 1,): tangent
    rates: Any  # (m, k)
    shift: Any  # (m + 1,): sum of the corrections


@inlined
def turn(y, r):
    """Find the rotation matrix of a quaternion."""
    s, a, b, c = y[0], y[1], y[2], y[3]
    k = 2 / (s * s + a * a + b * b + c * c)
    r[0, 0], r[0, 1], r[0, 2] = 1 - k * (b * b + c * c), k * (a * b - s * c), k * (a * c + s * b)
    r[1, 0], r[1, 1], r[1, 2] = k * (a * b + s * c), 1 - k * (a * a + c * c), k * (b * c - s * a)
    r[2, 0], r[2, 1], r[2, 2] = k * (a * c - s * b), k * (b * c + s * a), 1 - k * (a * a + b * b)


@inlined
def turned(r, x, y, z):
    """Return a vector of the body, or of a guide, in the world."""
    return (
        r[0, 0] * x + r[0, 1] * y + r[0, 2] * z,
        r[1, 0] * x + r[1, 1] * y + r[1, 2] * z,
        r[2, 0] * x + r[2, 1] * y + r[2, 2] * z,
    )


@inlined
def local(b, i, a, x, y, z):
    """Return a point of the world in the axes of the guide of point a."""
    r, o = b.frames[i, a], b.origins[i, a]
    x, y, z = x - o[0], y - o[1], z - o[2]
    return (
        r[0, 0] * x + r[1, 0] * y + r[2, 0] * z,
        r[0, 1] * x + r[1, 1] * y + r[2, 1] * z,
        r[0, 2] * x + r[1, 2] * y + r[2, 2] * z,
    )


@inlined
def put(plan, b, i, y, q, w):
    """Find where a state has the points, and the tangents of the driven ones."""
    turn(y, w.rotation)
    for a in range(w.arms.shape[0]):
        w.arms[a, 0], w.arms[a, 1], w.arms[a, 2] = turned(w.rotation, b.arms[i, a, 0], b.arms[i, a, 1], b.arms[i, a, 2])
    for d in range(len(plan.driven)):
        a, column, one, other = plan.driven[d, 0], plan.driven[d, 1], plan.driven[d, 2], plan.driven[d, 3]
        free = y[column + 1] if column >= 0 else 0.0
        x, s, t = chart(
            b.charts[i, d], q[one] if one >= 0 else free, q[other] if other >= 0 else free,
            b.shapes[i, a, 0], b.shapes[i, a, 1],
        )  # fmt: skip
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
                size = 1 / size
                v[0], v[1], v[2] = v[0] * size, v[1] * size, v[2] * size


@inlined
def evaluate(plan, b, i, y, q, w, slopes=True):
    """Find residual and derivatives, if not the residual only, in a state y at the driver values q."""
    put(plan, b, i, y, q, w)
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
    """Find how far an undriven point is off its guide; return the unit normal of the guide, in its axes."""
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
    """Find the derivatives of the distance of an undriven point from its guide, of normal g in its axes."""
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
    """Find the derivatives of the difference of where its guide and the body have driven point d, rows `row` to + 2."""
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
def moved(y, step, metric, out):
    """Find the state after a step: rotation [rad], and arcs on the guides in units."""
    x, a, b = step[0] / 2, step[1] / 2, step[2] / 2
    s, u, v, o = y[0], y[1], y[2], y[3]
    p, q = s - (x * u + a * v + b * o), u + s * x + (a * o - b * v)
    r, t = v + s * a + (b * u - x * o), o + s * b + (x * v - a * u)
    size = 1 / sqrt(p * p + q * q + r * r + t * t)
    out[0], out[1], out[2], out[3] = p * size, q * size, r * size, t * size
    for f in range(len(metric)):
        out[4 + f] = y[4 + f] + step[3 + f] / metric[f]


@inlined
def velocity(y, rate, metric, out):
    """Find the derivative of a state along a step."""
    x, a, b = rate[0] / 2, rate[1] / 2, rate[2] / 2
    s, u, v, o = y[0], y[1], y[2], y[3]
    out[0], out[1] = -(x * u + a * v + b * o), s * x + (a * o - b * v)
    out[2], out[3] = s * a + (b * u - x * o), s * b + (x * v - a * u)
    for f in range(len(metric)):
        out[4 + f] = rate[3 + f] / metric[f]


@inlined
def distance(w):
    """Return the largest distance from a guide, in units; NaN if one is."""
    most = 0.0
    for row in range(len(w.value)):
        if not abs(w.value[row]) <= most:
            most = abs(w.value[row])
    return most


@compiled
def correct(plan, b, i, q0, q1, y, row, limit, limits, w):
    """Correct the state in `w.trial`, at q0 + y q1, so that the correction is normal to a row, by Newton's method.

    Returns y, the sign of the bordered determinant, the length of the first correction, and whether it was found.
    """
    m, first, sign, last = len(w.value), inf, 0.0, False
    for j in range(m + 1):
        w.shift[j] = 0.0
    for n in range(limits.corrections):
        for j in range(len(q0)):
            w.q[j] = q0[j] + y * q1[j]
        evaluate(plan, b, i, w.trial, w.q, w)
        sign = bordered(q1, row, w)
        length = 0.0
        for j in range(m + 1):
            w.along[j] = w.system[j, m + 1]
            length += w.along[j] * w.along[j]
            w.shift[j] += w.along[j]
        length = sqrt(length)
        if n == 0:
            first = length
        last = length < limits.last or (n > 0 and distance(w) < limits.noise * b.reach[i])
        moved(w.trial, w.along, w.metric, w.trial)
        y += w.along[m]
        if last or not length <= limit:
            break
        limit = max(limits.second * length, 10 * limits.last)
    tangent(w)
    return y, sign, first, last


@inlined
def bordered(q1, row, w):
    """Solve the equations, y the last unknown, bordered by a row, in `w.system`; return the sign of the determinant.

    Right sides, from column m + 1 on, are those of the correction, of the tangent and of the rates by the drivers.
    """
    m, k, a = len(w.value), len(q1), w.system
    for r in range(m):
        slope = 0.0
        for j in range(k):
            slope += w.drivers[r, j] * q1[j]
            a[r, m + 3 + j] = -w.drivers[r, j]
        for j in range(m):
            a[r, j] = w.jacobian[r, j]
        a[r, m], a[r, m + 1], a[r, m + 2] = slope, -w.value[r], 0.0
    for j in range(m + 1):
        a[m, j] = row[j]
    a[m, m + 1], a[m, m + 2] = 0.0, 1.0
    for j in range(k):
        a[m, m + 3 + j] = 0.0
    return eliminate(a, m + 1, m + 3 + k, w.interchanged)


@inlined
def tangent(w):
    """Take the unit tangent and the rates by the drivers from the solution of the bordered equations."""
    m, a, size = len(w.value), w.system, 0.0
    for j in range(m + 1):
        size += a[j, m + 2] * a[j, m + 2]
    size = 1 / sqrt(size)
    for j in range(m + 1):
        w.along[j] = a[j, m + 2] * size
    for r in range(m):
        for j in range(w.rates.shape[1]):
            w.rates[r, j] = a[r, m + 3 + j]


@inlined
def off_edge(plan, b, i, y, q, w):
    """Return whether a point is on the half of a guide that its chart does not reach."""
    for a in range(b.kinds.shape[1]):
        if b.kinds[i, a] == HALF:
            put(plan, b, i, y, q, w)
            z = local(
                b, i, a, w.places[0, 0] + w.arms[a, 0], w.places[0, 1] + w.arms[a, 1], w.places[0, 2] + w.arms[a, 2]
            )[2]
            if not z >= 0:
                return True
    return False


def work(points: int, driven: int, drivers: int, free: int) -> Work:
    """Return room for one pose."""
    m = 3 + free
    shapes = (
        (3, 3), (points, 3), (driven, 3), (driven, 2, 3), (m,), (m, m), (m, drivers), (free,), (drivers,),
        (m + 1, 2 * m + drivers + 3), (m + 1,), (drivers,), (4 + free,), (m + 1,), (m, drivers), (m + 1,),
    )  # fmt: skip
    made = Work._make(np.zeros(shape) for shape in shapes)
    return made._replace(interchanged=made.interchanged.astype(np.int64))
