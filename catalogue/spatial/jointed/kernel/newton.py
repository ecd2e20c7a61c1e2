"""Newton's method on the equations of one pose, where the drive is to have a value."""

from __future__ import annotations

from math import pi, sqrt
from typing import Any, NamedTuple

import numpy as np

from ...native.compiling import compiled
from ...native.elimination import eliminate, substitute
from .pose import CYLINDRICAL, FREE, evaluate

#: A matrix is factored anew where the step by an old one is larger than this part of the step before.
SLOW = 0.05
#: Predicted error of a pose at which its correction ends.
NONE_LEFT = 1e-15


class Accuracy(NamedTuple):
    """Of a pose: the constants of `newton`."""

    last: Any
    near: Any
    enough: Any


@compiled
def around(angle):
    """Return an angle between -pi and pi."""
    return (angle + pi) % (2 * pi) - pi


@compiled
def lacking(plan, held, w):
    """Put what the conditions of the curve lack, its sign changed, where a step is solved for."""
    rows = len(plan.moves) - len(plan.scalars)
    free = len(plan.keep) - len(held)
    for i in range(len(plan.keep)):
        row = w.rows[i]
        off = w.value[row]
        if i >= free:
            off -= held[i - free]
            if plan.scalars[row - rows, 4]:
                off = around(off)
        w.step[i] = -off


@compiled
def factored(last, w):
    """Factor the Jacobian of the curve with one more row; return the sign of the determinant, 0 of a singular one."""
    a, m = w.matrix, len(last)
    for i in range(m - 1):
        row = w.rows[i]
        for j in range(m):
            a[i, j] = w.jacobian[row, j]
    for j in range(m):
        a[m - 1, j] = last[j]
    return eliminate(a, m, m, w.interchanged)


@compiled
def select(plan, held, w):
    """Choose the conditions that span all others best, by elimination with full pivoting of their Jacobian."""
    left, (conditions, m) = w.left, w.left.shape
    for r in range(conditions):
        for j in range(m):
            left[r, j] = w.jacobian[r, j]
    for k in range(len(plan.keep) - len(held)):
        row, column, most = 0, 0, -1.0
        for r in range(conditions):
            for j in range(m):
                if abs(left[r, j]) > most:
                    row, column, most = r, j, abs(left[r, j])
        w.rows[k] = row
        for r in range(conditions):
            share = left[r, column] / left[row, column]
            if r != row and share != 0:
                for j in range(m):
                    left[r, j] -= share * left[row, j]
        for j in range(m):
            left[row, j] = 0.0


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
    """Give quaternions the length 1, in place."""
    for j in range(len(plan.joints)):
        if plan.joints[j, 0] == FREE:
            n = plan.joints[j, 4]
            size = sqrt(y[n] * y[n] + y[n + 1] * y[n + 1] + y[n + 2] * y[n + 2] + y[n + 3] * y[n + 3])
            for i in range(4):
                y[n + i] /= size


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
    periodic = plan.scalars[-1, 4] == 1
    unitary(plan, y)
    anew, near, size = True, True, 0.0
    for k in range(12):
        evaluate(plan, geometry, g, y, w, anew)
        if k == 0 and plan.redundant:
            select(plan, held, w)
        lacking(plan, held, w)
        off = w.value[drive] - target
        w.step[m - 1] = -(around(off) if periodic else off)
        if anew and factored(w.jacobian[drive], w) == 0:
            return -1
        substitute(w.matrix, m, w.interchanged, w.step)
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
