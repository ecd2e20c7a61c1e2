"""Newton's method on the equations of one pose at a given value of the drive."""

from __future__ import annotations

import numpy as np

from ..continuation import curve as formulas
from .compiling import compiled, inlined
from .elimination import eliminate, substitute
from .equations import evaluate, moved, unitary

around = inlined(formulas.around)

#: Ratio of a step to the one before above which the matrix is factored anew.
REFACTOR_RATIO = 0.05
#: Predicted error of a pose below which its correction ends.
CONVERGED = 1e-15


@compiled
def evaluated(plan, geometry, g, y, w, jacobian):
    """Evaluate a state; the only call of the equations, which are slow to compile."""
    evaluate(plan, geometry, g, y, w, jacobian)


@inlined
def lacking(plan, held, w):
    """Write the negative residual of the curve as right side of a step."""
    rows = len(w.value) - len(plan.scalars)
    free = len(plan.keep) - len(held)
    for i in range(len(plan.keep)):
        row = w.rows[i]
        off = w.value[row]
        if i >= free:
            off -= held[i - free]
            if plan.scalars[row - rows, 4]:
                off = around(off)
        w.step[i] = -off


@inlined
def factored(last, w):
    """Factor the Jacobian of the curve with one more row; return the sign of its determinant.

    0: the matrix is singular.
    """
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
    """Select independent conditions by elimination with full pivoting of their Jacobian."""
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


@inlined
def largest(v):
    """Return the largest absolute value of a component; NaN if any is NaN."""
    most = 0.0
    for i in range(len(v)):
        if not abs(v[i]) <= most:
            most = abs(v[i])
    return most


@compiled
def corrected(plan, geometry, g, held, y, target, w, accuracy):
    """Correct a state, in place, to a value of the drive.

    Return 1 on success, 0 on failure, -1 if a matrix is singular.

    After the first Newton step the Jacobian of the step before is used while it contracts well.
    """
    m, drive = len(w.step), len(w.value) - 1
    periodic = plan.scalars[-1, 4] == 1
    unitary(plan, y)
    anew, near, size = True, True, 0.0
    for k in range(12):
        evaluated(plan, geometry, g, y, w, anew)
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
        if not size > accuracy.last and (anew or size * size <= CONVERGED * before):
            break
        anew = k > 0 and not size <= REFACTOR_RATIO * before
        if not size < np.inf:
            break
    return 1 if size <= accuracy.enough and near else 0
