"""The equations of one pose and Newton's method on them, compiled by numba: what `tree`, `system`, `newton` and
`tracing` do for many poses at once by numpy, without surfaces and curves.

Each function is that of the same name there, with its formulas and tests; `compiled` calls them.  All are in one module
because numba, which keeps what it has compiled, looks only at the file of the function that is called from outside.
"""

from __future__ import annotations

from math import atan2, cos, pi, sin, sqrt
from typing import Any, NamedTuple

import numpy as np
from numba import njit

REVOLUTE, PRISMATIC, CYLINDRICAL, FREE = 0, 1, 2, 5
UNKNOWN, TRAVEL, LENGTH, ANGLE = range(4)
#: Why a curve ended: it was to, or the reasons of `tracing`; a matrix was singular, which numpy solves.
REACHED, TURNING, BRANCH, STUCK, LONG, SINGULAR = range(6)
#: A matrix is factored anew where the step by an old one is larger than this part of the step before.
SLOW = 0.05
#: Predicted error of a pose at which its correction ends.
NONE_LEFT = 1e-15
#: How far beyond an end of its way a value of the drive still counts as reached.
BESIDE = 1e-12
#: Of a part t of an interval, t^2 (1 - t)^2 from which the error of a cubic is told.
LEAST_BULGE = 1e-3


class Plan(NamedTuple):
    """A system but for its geometry: joints by rows of integers, rows of conditions, scalars."""

    joints: Any  # (joints, 7): sort, body, body it hangs on, unknown, number, point, direction
    lead: Any  # (joints,)
    ends: Any  # (2, e): body, point
    ways: Any  # (2, v): body, direction
    distances: Any
    offsets: Any
    angles: Any
    idle: Any
    moves: Any  # (rows and scalars, unknowns)
    scalars: Any  # (scalars, 4): sort and its integers
    keep: Any  # rows of the conditions of the curve: those in use, and of what is held
    weight: Any  # (numbers,)


class Geometry(NamedTuple):
    """Hard points, directions and constants of a batch of mechanisms, the first axis theirs."""

    points: Any
    directions: Any
    lengths: Any
    components: Any
    cosines: Any


class Work(NamedTuple):
    """What an evaluation and a step leave behind."""

    rotation: Any  # (bodies, 3, 3)
    shift: Any  # (bodies, 3)
    axis: Any  # (joints, 3): axes, where they are
    arm: Any  # (joints, 3): velocity of the origin about an axis; of a free body where its point is
    ends: Any  # (e, 3)
    ways: Any  # (v, 3)
    wrench: Any  # (rows and scalars, 6)
    value: Any  # (rows and scalars,)
    jacobian: Any  # (rows and scalars, unknowns)
    matrix: Any  # (unknowns, unknowns): factored
    order: Any  # (unknowns,)
    step: Any  # (unknowns,)
    along: Any  # (unknowns,)
    tangent: Any  # (unknowns,)
    y: Any  # (numbers,)
    rate: Any  # (numbers,)
    off: Any  # (numbers,)


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


class Accuracy(NamedTuple):
    """Of a pose: the constants of `newton`."""

    last: Any
    near: Any
    enough: Any


class Nodes(NamedTuple):
    """Room for the nodes of a `Trace`."""

    s: Any
    y: Any
    rate: Any
    drive: Any
    slope: Any
    tangent: Any
    jacobian: Any


#: Arrays come from outside and stay there while a function runs: not to count who uses them makes it four times faster.
class Sweep(NamedTuple):
    """What is asked of a batch, and what is answered.

    Attributes
    ----------
    start : Nodes
        Of each, the pose from which it sets out; its tangent the way on which the drive grows.
    orientation : ndarray, shape (n,)
        Sign of the Jacobian bordered by that tangent.
    target : ndarray, shape (n, 2)
        How far to go down, and up.
    goal : ndarray, shape (s,)
        Values of the drive.
    states, found : ndarray, shape (n, s, numbers), (n, s)
        At the goals, and whether there is a pose: -1 where a matrix was singular, 0 where there is none.
    end, why : ndarray, shape (n, 2)
        Where the drive came to, and why no farther.
    """

    start: Any
    orientation: Any
    target: Any
    goal: Any
    states: Any
    found: Any
    end: Any
    why: Any


compiled = njit(cache=True, error_model="numpy", fastmath={"contract"}, _nrt=False)


def work(plan: Plan, numbers: int) -> Work:
    """Return room for one pose."""
    bodies, rows, m = len(plan.joints) + 1, len(plan.moves), plan.moves.shape[1]
    rotation = np.zeros((bodies, 3, 3))
    rotation[0] = np.eye(3)
    vectors = (bodies, bodies, bodies, plan.ends.shape[1], plan.ways.shape[1])
    return Work._make([
        rotation, *(np.zeros((n, 3)) for n in vectors), np.zeros((rows, 6)), np.zeros(rows), np.zeros((rows, m)),
        np.zeros((m, m)), np.zeros(m, np.int64), *(np.zeros(n) for n in (m, m, m, numbers, numbers, numbers)),
    ])  # fmt: skip


def nodes(plan: Plan, most: int, numbers: int) -> Nodes:
    """Return room for nodes."""
    m = plan.moves.shape[1]
    shapes = ((most,), (most, numbers), (most, numbers), (most,), (most,), (most, m), (most, m - 1, m))
    return Nodes(*(np.empty(shape) for shape in shapes))


@compiled
def placed(plan, points, directions, y, w):
    """Put bodies where their joints have them, with the screws of the joints."""
    r, t = w.rotation, w.shift
    for j in range(len(plan.joints)):
        sort, b, on, n = plan.joints[j, 0], plan.joints[j, 1], plan.joints[j, 2], plan.joints[j, 4]
        p, d = plan.joints[j, 5], plan.joints[j, 6]
        px, py, pz = points[p, 0], points[p, 1], points[p, 2]
        if sort == FREE:
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
        hung(r, t, b, on, sort, y[n], plan.lead[j], y[n + (sort == CYLINDRICAL)], (px, py, pz), (ax, ay, az))
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
    """Return a vector as a body has turned it."""
    return (
        r[b, 0, 0] * x + r[b, 0, 1] * y + r[b, 0, 2] * z,
        r[b, 1, 0] * x + r[b, 1, 1] * y + r[b, 1, 2] * z,
        r[b, 2, 0] * x + r[b, 2, 1] * y + r[b, 2, 2] * z,
    )


@compiled
def hung(r, t, b, on, sort, angle, lead, slide, p, a):
    """Put one body where its joint has it: turned by an angle about an axis, and moved along it."""
    s, c, far = 0.0, 1.0, slide
    if sort != PRISMATIC:
        s, c = sin(angle), cos(angle)
        far = lead * angle + (slide if sort == CYLINDRICAL else 0.0)
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
    """Find where all ends and all ways are."""
    for e in range(plan.ends.shape[1]):
        b, p = plan.ends[0, e], plan.ends[1, e]
        x, y, z = points[p, 0], points[p, 1], points[p, 2]
        if b:
            x, y, z = turned(w.rotation, b, x, y, z)
            x, y, z = x + w.shift[b, 0], y + w.shift[b, 1], z + w.shift[b, 2]
        w.ends[e, 0], w.ends[e, 1], w.ends[e, 2] = x, y, z
    for v in range(plan.ways.shape[1]):
        b, d = plan.ways[0, v], plan.ways[1, v]
        x, y, z = directions[d, 0], directions[d, 1], directions[d, 2]
        if b:
            x, y, z = turned(w.rotation, b, x, y, z)
        w.ways[v, 0], w.ways[v, 1], w.ways[v, 2] = x, y, z


@compiled
def push(w, row, end, x, y, z):
    """Note the wrench of a force at an end."""
    e, f = w.ends, w.wrench
    f[row, 0], f[row, 1], f[row, 2] = x, y, z
    f[row, 3] = e[end, 1] * z - e[end, 2] * y
    f[row, 4] = e[end, 2] * x - e[end, 0] * z
    f[row, 5] = e[end, 0] * y - e[end, 1] * x


@compiled
def closed(plan, geometry, g, w):
    """Find what each loop lacks, and the wrench of each."""
    x, d, row = w.ends, w.ways, 0
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
    """Find the values of the scalars, and the wrench of each."""
    x, d = w.ends, w.ways
    for k in range(len(plan.scalars)):
        sort, a, b, c = plan.scalars[k, 0], plan.scalars[k, 1], plan.scalars[k, 2], plan.scalars[k, 3]
        if sort == UNKNOWN:
            w.value[row] = y[a]
        elif sort == TRAVEL:
            fx, fy, fz = d[c, 0], d[c, 1], d[c, 2]
            w.value[row] = (x[a, 0] - x[b, 0]) * fx + (x[a, 1] - x[b, 1]) * fy + (x[a, 2] - x[b, 2]) * fz
            push(w, row, a, fx, fy, fz)
        elif sort == LENGTH:
            ex, ey, ez = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
            length = sqrt(ex * ex + ey * ey + ez * ez)
            w.value[row] = length
            push(w, row, b, ex / length, ey / length, ez / length)
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
    """Find the Jacobian: the products of wrenches and screws."""
    f, out = w.wrench, w.jacobian
    for j in range(len(plan.joints)):
        sort, u = plan.joints[j, 0], plan.joints[j, 3]
        ax, ay, az, vx, vy, vz = w.axis[j, 0], w.axis[j, 1], w.axis[j, 2], w.arm[j, 0], w.arm[j, 1], w.arm[j, 2]
        for row in range(len(f)):
            sign = plan.moves[row, u]
            if sign == 0:  # and stays 0
                continue
            fx, fy, fz, mx, my, mz = f[row, 0], f[row, 1], f[row, 2], f[row, 3], f[row, 4], f[row, 5]
            if sort == FREE:
                out[row, u] = sign * (mx - (vy * fz - vz * fy))
                out[row, u + 1] = sign * (my - (vz * fx - vx * fz))
                out[row, u + 2] = sign * (mz - (vx * fy - vy * fx))
                out[row, u + 3], out[row, u + 4], out[row, u + 5] = sign * fx, sign * fy, sign * fz
            else:
                slide = sign * (fx * ax + fy * ay + fz * az)
                if sort != REVOLUTE:
                    out[row, u + (sort == CYLINDRICAL)] = slide
                if sort != PRISMATIC:
                    out[row, u] = sign * (fx * vx + fy * vy + fz * vz + mx * ax + my * ay + mz * az)
    first = len(plan.moves) - len(plan.scalars)
    for k in range(len(plan.scalars)):
        if plan.scalars[k, 0] == UNKNOWN:
            out[first + k, plan.scalars[k, 2]] = 1.0


@compiled
def evaluate(plan, geometry, g, y, w, jacobian):
    """Find what the conditions lack and the values of the scalars in one state; with their Jacobian, if asked for."""
    placed(plan, geometry.points[g], geometry.directions[g], y, w)
    attached(plan, geometry.points[g], geometry.directions[g], w)
    row = closed(plan, geometry, g, w)
    read(plan, y, w, row)
    if jacobian:
        paired(plan, w)


@compiled
def evaluated(plan, geometry, w, y, value, jacobian):
    """Evaluate many states."""
    one = len(geometry.points) == 1
    for i in range(len(y)):
        evaluate(plan, geometry, 0 if one else i, y[i], w, True)
        for r in range(len(w.value)):
            value[i, r] = w.value[r]
            for c in range(w.jacobian.shape[1]):
                jacobian[i, r, c] = w.jacobian[r, c]


@compiled
def around(angle):
    """Return an angle between -pi and pi."""
    return (angle + pi) % (2 * pi) - pi


@compiled
def lacking(plan, held, w):
    """Put what the conditions of the curve lack, its sign changed, where a step is solved for."""
    rows = len(plan.moves) - len(plan.scalars)
    for i in range(len(plan.keep)):
        row = plan.keep[i]
        off = w.value[row]
        if row >= rows:
            off -= held[row - rows]
            if plan.scalars[row - rows, 0] == ANGLE:
                off = around(off)
        w.step[i] = -off


@compiled
def factored(plan, last, w):
    """Factor the Jacobian of the curve with one more row; return the sign of the determinant, 0 of a singular one."""
    a, order, m = w.matrix, w.order, len(last)
    for i in range(m - 1):
        row = plan.keep[i]
        for j in range(m):
            a[i, j] = w.jacobian[row, j]
    for j in range(m):
        a[m - 1, j] = last[j]
    sign = 1
    for k in range(m):
        p, most = k, abs(a[k, k])
        for i in range(k + 1, m):
            if abs(a[i, k]) > most:
                p, most = i, abs(a[i, k])
        order[k] = p
        if p != k:
            sign = -sign
            for j in range(m):
                a[k, j], a[p, j] = a[p, j], a[k, j]
        if most == 0:
            return 0
        if a[k, k] < 0:
            sign = -sign
        inverse = 1 / a[k, k]
        a[k, k] = inverse
        for i in range(k + 1, m):
            if a[i, k] != 0:
                share = a[i, k] * inverse
                a[i, k] = share
                for j in range(k + 1, m):
                    a[i, j] -= share * a[k, j]
    return sign


@compiled
def solve(w, b):
    """Solve by a factored matrix, in place."""
    a, m = w.matrix, len(b)
    for k in range(m):
        p = w.order[k]
        if p != k:
            b[k], b[p] = b[p], b[k]
    for i in range(m):
        v = b[i]
        for j in range(i):
            v -= a[i, j] * b[j]
        b[i] = v
    for i in range(m - 1, -1, -1):
        v = b[i]
        for j in range(i + 1, m):
            v -= a[i, j] * b[j]
        b[i] = v * a[i, i]


@compiled
def moved(plan, y, step):
    """Move a state by a step of all unknowns, in place."""
    for j in range(len(plan.joints)):
        sort, u, n = plan.joints[j, 0], plan.joints[j, 3], plan.joints[j, 4]
        if sort == FREE:
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
            if sort == CYLINDRICAL:
                y[n + 1] += step[u + 1]
    unitary(plan, y)


@compiled
def unitary(plan, y):
    """Give quaternions the length 1, in place."""
    for j in range(len(plan.joints)):
        if plan.joints[j, 0] == FREE:
            n = plan.joints[j, 4]
            size = sqrt(y[n] * y[n] + y[n + 1] * y[n + 1] + y[n + 2] * y[n + 2] + y[n + 3] * y[n + 3])
            for i in range(4):
                y[n + i] /= size


@compiled
def lifted(plan, y, step, out):
    """Find the rates of a state when the unknowns have those given."""
    for j in range(len(plan.joints)):
        sort, u, n = plan.joints[j, 0], plan.joints[j, 3], plan.joints[j, 4]
        if sort == FREE:
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
            if sort == CYLINDRICAL:
                out[n + 1] = step[u + 1]


@compiled
def cubic(t, h, a, b, da, db):
    """Return Hermite's cubic at the part t of an interval h."""
    u = 1 - t
    return u * u * ((1 + 2 * t) * a + t * h * da) + t * t * ((3 - 2 * t) * b - u * h * db)


@compiled
def largest(v):
    """Return the largest size of a component; NaN if one is."""
    most = 0.0
    for i in range(len(v)):
        if not abs(v[i]) <= most:
            most = abs(v[i])
    return most


@compiled
def corrected(plan, geometry, g, held, y, target, w, accuracy):
    """Correct a state, in place, so that the drive has a value: 1 if that was possible, 0 if not, -1 if singular.

    Newton's method, at first; then with the Jacobian of the step before, as long as that contracts well.
    """
    m, drive = plan.moves.shape[1], len(plan.moves) - 1
    periodic = plan.scalars[-1, 0] == ANGLE
    unitary(plan, y)
    anew, near, size = True, True, 0.0
    for k in range(12):
        evaluate(plan, geometry, g, y, w, anew)
        lacking(plan, held, w)
        off = w.value[drive] - target
        w.step[m - 1] = -(around(off) if periodic else off)
        if anew and factored(plan, w.jacobian[drive], w) == 0:
            return -1
        solve(w, w.step)
        before, size = size, largest(w.step)
        moved(plan, y, w.step)
        if k == 0:
            near = size <= accuracy.near
        if not size > accuracy.last and (anew or size * size <= NONE_LEFT * before):
            break
        anew = k > 0 and not size <= SLOW * before
        if not size < np.inf:
            break
    return 1 if size <= accuracy.enough and near else 0


@compiled
def solved(plan, geometry, w, held, y, target, found, accuracy):
    """Correct states, in place, so that the drive has given values; `found` as `corrected` returns it."""
    for i in range(len(y)):
        g = 0 if len(geometry.points) == 1 else i
        found[i] = corrected(plan, geometry, g, held[i], y[i], target[i], w, accuracy)


@compiled
def across(plan, held, w, border):
    """Find Newton's step across a tangent, and the unit vector along the curve; return the sign of the determinant."""
    sign = factored(plan, border, w)
    if sign != 0:
        lacking(plan, held, w)
        m = len(border)
        w.step[m - 1] = 0.0
        solve(w, w.step)
        for i in range(m):
            w.along[i] = 0.0
        w.along[m - 1] = 1.0
        solve(w, w.along)
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
    if plan.scalars[-1, 0] == ANGLE:
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
def noted(plan, nodes, k, s, value, slope, w):
    """Write the pose of the last step as node k."""
    nodes.s[k], nodes.drive[k], nodes.slope[k] = s, value, slope
    for i in range(len(w.y)):
        nodes.y[k, i], nodes.rate[k, i] = w.y[i], w.rate[i]
    for j in range(len(w.tangent)):
        nodes.tangent[k, j] = w.tangent[j]
        for i in range(len(plan.keep)):
            nodes.jacobian[k, i, j] = w.jacobian[plan.keep[i], j]


@compiled
def step(plan, geometry, g, held, h, orientation, nodes, k, b, to, limits, w):
    """Try a step from node k, b before it, and note it as node `to`.

    Returns the next length of step, whether the step was made, whether it would have changed the orientation, and
    whether a matrix was singular.
    """
    sign, first, second, value, slope = stepped(plan, geometry, g, held, h, nodes.s[k] - nodes.s[b], nodes, k, b, w)
    if sign == 0:
        return h, False, False, True
    good, arc = good_step(plan, h, nodes, k, first, second, w, limits)
    crossing = sign != orientation
    change = (limits.aim / max(first, 1e-9)) ** 0.25 if first == first else 0.3
    change = min(max(change, 0.3), 2.0)
    if good and not crossing:
        noted(plan, nodes, to, nodes.s[k] + arc, value, slope, w)
        return min(change * h, limits.longest), True, False, False
    return min(min(change, 0.5) * h, limits.longest), False, crossing, False


@compiled
def steps(plan, geometry, w, held, h, orientation, nodes, limits, good, crossing):
    """Try a step of many curves: nodes (n, 3) of each are the one before, the last, and room for the next."""
    for i in range(len(h)):
        g = 0 if len(geometry.points) == 1 else i
        own = Nodes(
            nodes.s[i], nodes.y[i], nodes.rate[i], nodes.drive[i], nodes.slope[i], nodes.tangent[i], nodes.jacobian[i]
        )
        h[i], good[i], crossing[i], singular = step(
            plan, geometry, g, held[i], h[i], orientation[i], own, 1, 0, 2, limits, w
        )
        if singular:
            return False
    return True


@compiled
def toward(plan, geometry, g, held, orientation, target, nodes, limits, w):
    """Follow a curve from node 1, node 0 before it, until its drive has passed a target, or turns back.

    Returns the last node and why it ended.
    """
    way = np.sign(target - nodes.drive[1])
    if way == 0:
        return 1, REACHED
    k, h = 1, limits.first
    for _ in range(len(nodes.s) - 2):
        h, made, crossing, singular = step(plan, geometry, g, held, h, orientation, nodes, k, k - 1, k + 1, limits, w)
        if singular:
            return k, SINGULAR
        k += made
        passed = made and way * (nodes.drive[k] - target) >= 0
        if made and not passed and way * nodes.slope[k] <= 0:
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
    for _ in range(8):
        evaluate(plan, geometry, g, w.y, w, True)
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
    if plan.scalars[-1, 0] == ANGLE:
        value = nodes.drive[k - 1] + around(value - nodes.drive[k - 1])
    for j in range(len(w.tangent)):
        w.tangent[j] = w.along[j]
    lifted(plan, w.y, w.tangent, w.rate)
    noted(plan, nodes, k, s, value, 0.0, w)


@compiled
def where(nodes, i, way, value):
    """Return the part of the interval from node i at which the drive has a value."""
    h, low, high = nodes.s[i + 1] - nodes.s[i], 0.0, 1.0
    a, b, da, db = nodes.drive[i], nodes.drive[i + 1], nodes.slope[i], nodes.slope[i + 1]
    t = min(max((value - a) / (b - a if b != a else 1.0), 0.0), 1.0)
    for _ in range(6):
        off = cubic(t, h, a, b, da, db) - value
        if way * off < 0:
            low = t
        else:
            high = t
        better = t - off / (6 * t * (1 - t) * (b - a) + h * ((1 - t) * (1 - 3 * t) * da + t * (3 * t - 2) * db))
        if not low <= better <= high:
            better = (low + high) / 2
        gone, t = abs(better - t), better
        if gone < 1e-9:
            break
    return t


@compiled
def swept(plan, geometry, w, held, sweep, nodes, limits, accuracy):
    """Sweep mechanisms from their design poses both ways; `nodes` is room."""
    for g in range(len(sweep.orientation)):
        for side in range(2):
            sign = 2 * side - 1
            set_out(sweep.start, g, sign, nodes, limits)
            k, why = toward(
                plan, geometry, g, held[g], sign * sweep.orientation[g], sweep.target[g, side], nodes, limits, w
            )
            if why == TURNING:
                up_to_dead_point(plan, geometry, g, held[g], nodes, k, limits, w)
            sweep.end[g, side], sweep.why[g, side] = nodes.drive[k], why
            i, bulge = 1, 0.0
            for n in range(len(sweep.goal)):
                value = sweep.goal[n]
                if (value >= nodes.drive[1]) == (side == 1) and sign * (value - nodes.drive[k]) <= BESIDE:
                    i, bulge = between(nodes, i, k, sign, value, bulge, w)
                    sweep.found[g, n] = corrected(plan, geometry, g, held[g], w.y, value, w, accuracy)
                    bulge = bulge if sweep.found[g, n] == 1 else 0.0
                    for j in range(len(w.y)):
                        sweep.states[g, n, j] = w.y[j]
                        w.off[j] = w.y[j] - w.off[j]


@compiled
def between(nodes, i, last, way, value, bulge, w):
    """Find the pose, on the cubics between nodes 1 to `last`, at a value of the drive, from node i on.

    The cubic is off the curve as t^2 (1 - t)^2, nearly: by so much, of what it was off at the pose before, `off`, where
    that was `bulge`, it is set right.  Returns the node before the pose, and t^2 (1 - t)^2; `off` is the cubic itself.
    """
    drive = nodes.drive
    if last == 1:
        for j in range(len(w.y)):
            w.y[j] = w.off[j] = nodes.y[1, j]
        return 1, 0.0
    first = i
    if way * drive[i] >= way * value:
        i = 1
    while i < last - 1 and way * drive[i + 1] < way * value:
        i += 1
    t, h = where(nodes, i, way, value), nodes.s[i + 1] - nodes.s[i]
    new = (t * (1 - t)) ** 2
    share = new / bulge if i == first and bulge > LEAST_BULGE else 0.0
    for j in range(len(w.y)):
        there = cubic(t, h, nodes.y[i, j], nodes.y[i + 1, j], nodes.rate[i, j], nodes.rate[i + 1, j])
        w.y[j], w.off[j] = there + (share * w.off[j] if share > 0 else 0.0), there
    return i, new


@compiled
def set_out(start, g, sign, nodes, limits):
    """Write the pose from which a curve sets out as node 1, and one straight behind it as node 0."""
    nodes.s[0], nodes.s[1] = -limits.first, 0.0
    nodes.drive[1], nodes.slope[1] = start.drive[g], sign * start.slope[g]
    for j in range(nodes.tangent.shape[1]):
        nodes.tangent[1, j] = sign * start.tangent[g, j]
    for j in range(nodes.y.shape[1]):
        rate = sign * start.rate[g, j]
        nodes.y[1, j], nodes.y[0, j] = start.y[g, j], start.y[g, j] - limits.first * rate
        nodes.rate[1, j] = nodes.rate[0, j] = rate
