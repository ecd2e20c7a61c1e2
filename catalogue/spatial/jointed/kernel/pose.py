"""Equations of one pose: positions of bodies, ends and vectors, residuals, Jacobian."""

from __future__ import annotations

from math import atan2, cos, sin, sqrt
from typing import NamedTuple

import numpy as np

from ....kinematics.types import Floats, Integers
from ...native import equations
from ...native.compiling import compiled

#: Kinds of joints, numbered as in `tree`.
REVOLUTE = 0
PRISMATIC = 1
CYLINDRICAL = 2
FREE = 5
UNKNOWN, TRAVEL, LENGTH, ANGLE, SUM = range(5)


class Plan(NamedTuple):
    """A system without its geometry: joints as rows of integers, conditions, scalars."""

    joints: Integers  # (joints, 7): kind, body, body it hangs on, unknown, number, point, direction
    lead: Floats  # (joints,)
    ends: Integers  # (2, e): body, point
    vectors: Integers  # (2, v): body, direction
    distances: Integers
    offsets: Integers
    angles: Integers
    idle: Integers
    moves: Floats  # (rows and scalars, unknowns)
    scalars: Integers  # (scalars, 5): kind, integer parameters, whether its value is known up to whole turns
    weights: Floats  # of the parts of sums
    keep: Integers  # rows of the curve's conditions: independent conditions and held scalars
    redundant: bool  # whether some conditions are implied by others
    stated: Integers  # rows of held and driving scalars, without the parts of sums
    weight: Floats  # (numbers,)


class Geometry(NamedTuple):
    """Hard points, directions and constants of a batch; the first axis counts mechanisms."""

    points: Floats
    directions: Floats
    lengths: Floats
    components: Floats
    cosines: Floats


class Work(NamedTuple):
    """Work arrays and results of an evaluation and a step."""

    rotation: Floats  # (bodies, 3, 3)
    shift: Floats  # (bodies, 3)
    axis: Floats  # (joints, 3): axes, where they are
    arm: Floats  # (joints, 3): velocity of the origin in a rotation about the axis; of a free body its point
    ends: Floats  # (e, 3)
    vectors: Floats  # (v, 3)
    wrench: Floats  # (rows and scalars, 6)
    value: Floats  # (rows and scalars,)
    jacobian: Floats  # (rows and scalars, unknowns)
    matrix: Floats  # (unknowns, unknowns): factored
    interchanged: Integers  # (unknowns,): interchanged rows of an elimination
    step: Floats  # (unknowns,)
    along: Floats  # (unknowns,)
    tangent: Floats  # (unknowns,)
    y: Floats  # (numbers,)
    rate: Floats  # (numbers,)
    off: Floats  # (numbers,)
    rows: Integers  # like `keep`, with the conditions that imply all others where they were selected
    left: Floats  # (conditions, unknowns): what remains of their Jacobian while `rows` are selected


def work(plan: Plan, numbers: int) -> Work:
    """Allocate the arrays of one pose."""
    bodies, rows, m = len(plan.joints) + 1, len(plan.moves), plan.moves.shape[1]
    rotation = np.zeros((bodies, 3, 3))
    rotation[0] = np.eye(3)
    triples = (bodies, bodies, bodies, plan.ends.shape[1], plan.vectors.shape[1])
    return Work._make(
        [
            rotation,
            *(np.zeros((n, 3)) for n in triples),
            np.zeros((rows, 6)),
            np.zeros(rows),
            np.zeros((rows, m)),
            np.zeros((m, m)),
            np.zeros(m, np.int64),
            *(np.zeros(n) for n in (m, m, m, numbers, numbers, numbers)),
            plan.keep.copy(),
            np.zeros((rows - len(plan.scalars), m)),
        ]
    )


@compiled
def placed(plan, points, directions, y, w):
    """Compute the poses of bodies and the screws of their joints."""
    r, t = w.rotation, w.shift
    for j in range(len(plan.joints)):
        joint_kind, b, on, n = plan.joints[j, 0], plan.joints[j, 1], plan.joints[j, 2], plan.joints[j, 4]
        p, d = plan.joints[j, 5], plan.joints[j, 6]
        px, py, pz = points[p, 0], points[p, 1], points[p, 2]
        if joint_kind == FREE:
            s, u, v, o = y[n], y[n + 1], y[n + 2], y[n + 3]
            q = 2 * s * s - 1
            r[b, 0, 0], r[b, 0, 1], r[b, 0, 2] = 2 * u * u + q, 2 * (u * v - s * o), 2 * (u * o + s * v)
            r[b, 1, 0], r[b, 1, 1], r[b, 1, 2] = 2 * (u * v + s * o), 2 * v * v + q, 2 * (v * o - s * u)
            r[b, 2, 0], r[b, 2, 1], r[b, 2, 2] = 2 * (u * o - s * v), 2 * (v * o + s * u), 2 * o * o + q
            w.arm[j, 0], w.arm[j, 1], w.arm[j, 2] = px + y[n + 4], py + y[n + 5], pz + y[n + 6]
            for i in range(3):
                t[b, i] = w.arm[j, i] - (r[b, i, 0] * px + r[b, i, 1] * py + r[b, i, 2] * pz)
            continue
        ax, ay, az = directions[d, 0], directions[d, 1], directions[d, 2]
        place(
            r, t, b, on, joint_kind, y[n], plan.lead[j], y[n + (joint_kind == CYLINDRICAL)], (px, py, pz), (ax, ay, az)
        )
        if on:
            ax, ay, az = turned(r, on, ax, ay, az)
            px, py, pz = turned(r, on, px, py, pz)
            px, py, pz = px + t[on, 0], py + t[on, 1], pz + t[on, 2]
        w.axis[j, 0], w.axis[j, 1], w.axis[j, 2] = ax, ay, az
        advance = plan.lead[j]
        w.arm[j, 0] = py * az - pz * ay + advance * ax
        w.arm[j, 1] = pz * ax - px * az + advance * ay
        w.arm[j, 2] = px * ay - py * ax + advance * az


@compiled
def turned(r, b, x, y, z):
    """Rotate a vector by the rotation of a body."""
    return (
        r[b, 0, 0] * x + r[b, 0, 1] * y + r[b, 0, 2] * z,
        r[b, 1, 0] * x + r[b, 1, 1] * y + r[b, 1, 2] * z,
        r[b, 2, 0] * x + r[b, 2, 1] * y + r[b, 2, 2] * z,
    )


@compiled
def place(r, t, b, on, joint_kind, angle, lead, slide, p, a):
    """Compute the pose of one body: rotation by an angle about its joint axis, shift along it."""
    s, c, far = 0.0, 1.0, slide
    if joint_kind != PRISMATIC:
        s, c = sin(angle), cos(angle)
        far = lead * angle + (slide if joint_kind == CYLINDRICAL else 0.0)
    k = 1 - c
    (x, y, z), (px, py, pz) = a, p
    m = (
        (c + k * x * x, k * x * y - s * z, k * x * z + s * y),
        (k * x * y + s * z, c + k * y * y, k * y * z - s * x),
        (k * x * z - s * y, k * y * z + s * x, c + k * z * z),
    )
    tx = px - (m[0][0] * px + m[0][1] * py + m[0][2] * pz) + far * x
    ty = py - (m[1][0] * px + m[1][1] * py + m[1][2] * pz) + far * y
    tz = pz - (m[2][0] * px + m[2][1] * py + m[2][2] * pz) + far * z
    if on:
        (r[b, 0, 0], r[b, 1, 0], r[b, 2, 0]) = turned(r, on, m[0][0], m[1][0], m[2][0])
        (r[b, 0, 1], r[b, 1, 1], r[b, 2, 1]) = turned(r, on, m[0][1], m[1][1], m[2][1])
        (r[b, 0, 2], r[b, 1, 2], r[b, 2, 2]) = turned(r, on, m[0][2], m[1][2], m[2][2])
        tx, ty, tz = turned(r, on, tx, ty, tz)
        tx, ty, tz = tx + t[on, 0], ty + t[on, 1], tz + t[on, 2]
    else:
        (r[b, 0, 0], r[b, 0, 1], r[b, 0, 2]) = m[0]
        (r[b, 1, 0], r[b, 1, 1], r[b, 1, 2]) = m[1]
        (r[b, 2, 0], r[b, 2, 1], r[b, 2, 2]) = m[2]
    t[b, 0], t[b, 1], t[b, 2] = tx, ty, tz


@compiled
def attached(plan, points, directions, w):
    """Compute the positions of all ends and the directions of all vectors."""
    for e in range(plan.ends.shape[1]):
        b, p = plan.ends[0, e], plan.ends[1, e]
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        if b:
            x, y, z = turned(w.rotation, b, x, y, z)
            x, y, z = x + w.shift[b, 0], y + w.shift[b, 1], z + w.shift[b, 2]
        w.ends[e, 0], w.ends[e, 1], w.ends[e, 2] = x, y, z
    for v in range(plan.vectors.shape[1]):
        b, d = plan.vectors[0, v], plan.vectors[1, v]
        x, y, z = directions[d, 0], directions[d, 1], directions[d, 2]
        if b:
            x, y, z = turned(w.rotation, b, x, y, z)
        w.vectors[v, 0], w.vectors[v, 1], w.vectors[v, 2] = x, y, z


@compiled
def push(w, row, end, x, y, z):
    """Add the wrench of a force at an end to a row."""
    e, f = w.ends, w.wrench
    f[row, 0], f[row, 1], f[row, 2] = x, y, z
    f[row, 3] = e[end, 1] * z - e[end, 2] * y
    f[row, 4] = e[end, 2] * x - e[end, 0] * z
    f[row, 5] = e[end, 0] * y - e[end, 1] * x


@compiled
def closed(plan, geometry, g, w):
    """Compute the residual and the wrench of each loop condition."""
    x, d, row = w.ends, w.vectors, 0
    for k in range(plan.distances.shape[1]):
        a, b, length = plan.distances[0, k], plan.distances[1, k], geometry.lengths[g, k]
        ex, ey, ez = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
        w.value[row] = (ex * ex + ey * ey + ez * ez) / (2 * length) - length / 2
        push(w, row, b, ex / length, ey / length, ez / length)
        row += 1
    for k in range(plan.offsets.shape[1]):
        a, b, v = plan.offsets[0, k], plan.offsets[1, k], plan.offsets[2, k]
        far = (x[b, 0] - x[a, 0]) * d[v, 0] + (x[b, 1] - x[a, 1]) * d[v, 1] + (x[b, 2] - x[a, 2]) * d[v, 2]
        w.value[row] = far - geometry.components[g, k]
        push(w, row, b, d[v, 0], d[v, 1], d[v, 2])
        row += 1
    for k in range(plan.angles.shape[1]):
        a, b = plan.angles[0, k], plan.angles[1, k]
        w.value[row] = d[a, 0] * d[b, 0] + d[a, 1] * d[b, 1] + d[a, 2] * d[b, 2] - geometry.cosines[g, k]
        w.wrench[row, 3] = d[b, 1] * d[a, 2] - d[b, 2] * d[a, 1]
        w.wrench[row, 4] = d[b, 2] * d[a, 0] - d[b, 0] * d[a, 2]
        w.wrench[row, 5] = d[b, 0] * d[a, 1] - d[b, 1] * d[a, 0]
        row += 1
    for k in range(plan.idle.shape[1]):
        for i in range(3):
            w.wrench[row, 3 + i] = d[plan.idle[0, k], i]
        row += 1
    return row


@compiled
def read(plan, y, w, row):
    """Compute the value and the wrench of each scalar."""
    x, d = w.ends, w.vectors
    for k in range(len(plan.scalars)):
        scalar_kind, a, b, c = plan.scalars[k, 0], plan.scalars[k, 1], plan.scalars[k, 2], plan.scalars[k, 3]
        if scalar_kind == UNKNOWN:
            w.value[row] = y[a]
        elif scalar_kind == TRAVEL:
            fx, fy, fz = d[c, 0], d[c, 1], d[c, 2]
            w.value[row] = (x[a, 0] - x[b, 0]) * fx + (x[a, 1] - x[b, 1]) * fy + (x[a, 2] - x[b, 2]) * fz
            push(w, row, a, fx, fy, fz)
        elif scalar_kind == LENGTH:
            ex, ey, ez = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
            length = sqrt(ex * ex + ey * ey + ez * ez)
            w.value[row] = length
            push(w, row, b, ex / length, ey / length, ez / length)
        elif scalar_kind == SUM:
            first, total = row - k + a, 0.0
            for i in range(b):
                total += plan.weights[c + i] * w.value[first + i]
            w.value[row] = total
        else:
            px, py, pz = d[a, 0], d[a, 1], d[a, 2]
            one = px * d[b, 0] + py * d[b, 1] + pz * d[b, 2]
            other = px * d[c, 0] + py * d[c, 1] + pz * d[c, 2]
            w.value[row] = atan2(other, one)
            over = one * one + other * other
            vx, vy, vz = (
                one * d[c, 0] - other * d[b, 0],
                one * d[c, 1] - other * d[b, 1],
                one * d[c, 2] - other * d[b, 2],
            )
            w.wrench[row, 3] = (py * vz - pz * vy) / over
            w.wrench[row, 4] = (pz * vx - px * vz) / over
            w.wrench[row, 5] = (px * vy - py * vx) / over
        row += 1


@compiled
def paired(plan, w):
    """Compute the Jacobian: the products of wrenches and screws."""
    f, out = w.wrench, w.jacobian
    for j in range(len(plan.joints)):
        joint_kind, u = plan.joints[j, 0], plan.joints[j, 3]
        ax, ay, az, vx, vy, vz = w.axis[j, 0], w.axis[j, 1], w.axis[j, 2], w.arm[j, 0], w.arm[j, 1], w.arm[j, 2]
        for row in range(len(f)):
            sign = plan.moves[row, u]
            if sign == 0:  # and stays 0
                continue
            fx, fy, fz, mx, my, mz = f[row, 0], f[row, 1], f[row, 2], f[row, 3], f[row, 4], f[row, 5]
            if joint_kind == FREE:
                out[row, u] = sign * (mx - (vy * fz - vz * fy))
                out[row, u + 1] = sign * (my - (vz * fx - vx * fz))
                out[row, u + 2] = sign * (mz - (vx * fy - vy * fx))
                out[row, u + 3], out[row, u + 4], out[row, u + 5] = sign * fx, sign * fy, sign * fz
            else:
                slide = sign * (fx * ax + fy * ay + fz * az)
                if joint_kind != REVOLUTE:
                    out[row, u + (joint_kind == CYLINDRICAL)] = slide
                if joint_kind != PRISMATIC:
                    out[row, u] = sign * (fx * vx + fy * vy + fz * vz + mx * ax + my * ay + mz * az)
    first = len(plan.moves) - len(plan.scalars)
    for k in range(len(plan.scalars)):
        if plan.scalars[k, 0] == UNKNOWN:
            out[first + k, plan.scalars[k, 2]] = 1.0
        elif plan.scalars[k, 0] == SUM:
            for u in range(out.shape[1]):
                out[first + k, u] = 0.0
                for i in range(plan.scalars[k, 2]):
                    out[first + k, u] += plan.weights[plan.scalars[k, 3] + i] * out[first + plan.scalars[k, 1] + i, u]


@compiled
def evaluate(plan, geometry, g, y, w, jacobian):
    """Compute residuals and scalars in one state; with `jacobian`, their Jacobian too."""
    placed(plan, geometry.points[g], geometry.directions[g], y, w)
    attached(plan, geometry.points[g], geometry.directions[g], w)
    row = closed(plan, geometry, g, w)
    read(plan, y, w, row)
    if jacobian:
        paired(plan, w)


@compiled
def moved(plan, y, step):
    """Move a state by a step of all unknowns, in place."""
    for j in range(len(plan.joints)):
        joint_kind, u, n = plan.joints[j, 0], plan.joints[j, 3], plan.joints[j, 4]
        if joint_kind == FREE:
            hx, hy, hz = step[u] / 2, step[u + 1] / 2, step[u + 2] / 2
            s, vx, vy, vz = y[n], y[n + 1], y[n + 2], y[n + 3]
            y[n] = s - (hx * vx + hy * vy + hz * vz)
            y[n + 1] = vx + s * hx + (hy * vz - hz * vy)
            y[n + 2] = vy + s * hy + (hz * vx - hx * vz)
            y[n + 3] = vz + s * hz + (hx * vy - hy * vx)
            for i in range(3):
                y[n + 4 + i] += step[u + 3 + i]
        else:
            y[n] += step[u]
            if joint_kind == CYLINDRICAL:
                y[n + 1] += step[u + 1]
    unitary(plan, y)


@compiled
def unitary(plan, y):
    """Normalise quaternions, in place."""
    for j in range(len(plan.joints)):
        if plan.joints[j, 0] == FREE:
            n = plan.joints[j, 4]
            size = sqrt(y[n] * y[n] + y[n + 1] * y[n + 1] + y[n + 2] * y[n + 2] + y[n + 3] * y[n + 3])
            for i in range(4):
                y[n + i] /= size


@compiled
def lifted(plan, y, step, out):
    """Compute the rates of a state from the rates of the unknowns."""
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


equations.offer(Plan, (evaluate, moved, unitary, lifted))
