"""Compiled entry points: loops over many states, curves or mechanisms."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ....kinematics.types import Floats, Integers
from ...native.compiling import ONE, compiled, kept, version
from ...native.curve import TURNING, Nodes, between, step, toward, up_to_dead_point
from ...native.elimination import substitute
from ...native.newton import corrected, factored, select
from .pose import CYLINDRICAL, FREE, PRISMATIC, REVOLUTE, evaluate

#: Distance beyond the end of a motion at which a value of the drive is reached [units or rad].
END_TOLERANCE = 1e-12
#: Of these kernels.
VERSION = version(__file__)


class Sweep(NamedTuple):
    """Input and results of the sweep of a batch.

    Attributes
    ----------
    start : Nodes
        Start poses; their tangents point in the direction of growing drive.
    orientation : ndarray, shape (n,)
        Sign of the Jacobian bordered by that tangent.
    target : ndarray, shape (n, 2)
        Least and greatest value of the drive to reach.
    goal : ndarray, shape (s,)
        Values of the drive.
    states, found : ndarray, shape (n, s, numbers), (n, s)
        States at the goals; 1 with a pose, 0 without, -1 where a matrix was singular.
    end, why : ndarray, shape (n, 2)
        Values that the drive reached, and the reasons of its ends.
    """

    start: Floats
    orientation: Floats
    target: Floats
    goal: Floats
    states: Floats
    found: Integers
    end: Floats
    why: Integers


@kept
def evaluated(plan, geometry, w, y, value, jacobian, version=VERSION):  # noqa: ARG001  # part of its types
    """Evaluate many states."""
    one = len(geometry.points) == 1
    for i in range(len(y)):
        evaluate(plan, geometry, 0 if one else i, y[i], w, True)
        for r in range(len(w.value)):
            value[i, r] = w.value[r]
            for c in range(w.jacobian.shape[1]):
                jacobian[i, r, c] = w.jacobian[r, c]


@kept
def rated(plan, geometry, w, held, y, rotation, shift, basis, twist, version=VERSION):  # noqa: ARG001  # part of its types
    """Compute poses, rates of unknowns and twists per freedom in many states."""
    m, free = plan.moves.shape[1], len(plan.keep) - held.shape[1]
    for i in range(len(y)):
        g = 0 if len(geometry.points) == 1 else i
        evaluate(plan, geometry, g, y[i], w, True)
        for b in range(len(w.rotation)):
            for j in range(3):
                shift[i, b, j] = w.shift[b, j]
                for k in range(3):
                    rotation[i, b, j, k] = w.rotation[b, j, k]
        if plan.redundant:
            select(plan, held[i], w)
        regular = factored(w.jacobian[plan.stated[-1]], w) != 0
        for k in range(len(plan.stated)):
            for j in range(m):
                w.along[j] = 0.0
            w.along[free + k] = 1.0
            substitute(w.matrix, m, w.interchanged, w.along)
            for j in range(m):
                basis[i, j, k] = w.along[j] if regular else np.nan
                w.along[j] = basis[i, j, k]
            carried(plan, w, twist, i, k)


@compiled
def carried(plan, w, twist, i, k):
    """Write twists `twist[i, k]` of all bodies, velocity first, at rates `w.along`."""
    for j in range(len(plan.joints)):
        joint_kind, b, on, u = plan.joints[j, 0], plan.joints[j, 1], plan.joints[j, 2], plan.joints[j, 3]
        if joint_kind == FREE:
            vx, vy, vz = w.along[u + 3], w.along[u + 4], w.along[u + 5]
            rx, ry, rz = w.along[u], w.along[u + 1], w.along[u + 2]
            px, py, pz = w.arm[j, 0], w.arm[j, 1], w.arm[j, 2]
            vx, vy, vz = vx + py * rz - pz * ry, vy + pz * rx - px * rz, vz + px * ry - py * rx
        else:
            turn = 0.0 if joint_kind == PRISMATIC else w.along[u]
            slide = 0.0 if joint_kind == REVOLUTE else w.along[u + (joint_kind == CYLINDRICAL)]
            rx, ry, rz = turn * w.axis[j, 0], turn * w.axis[j, 1], turn * w.axis[j, 2]
            vx = turn * w.arm[j, 0] + slide * w.axis[j, 0]
            vy = turn * w.arm[j, 1] + slide * w.axis[j, 1]
            vz = turn * w.arm[j, 2] + slide * w.axis[j, 2]
        twist[i, k, b, 0] = twist[i, k, on, 0] + vx
        twist[i, k, b, 1] = twist[i, k, on, 1] + vy
        twist[i, k, b, 2] = twist[i, k, on, 2] + vz
        twist[i, k, b, 3] = twist[i, k, on, 3] + rx
        twist[i, k, b, 4] = twist[i, k, on, 4] + ry
        twist[i, k, b, 5] = twist[i, k, on, 5] + rz


@kept
def solved(plan, geometry, w, held, y, target, found, accuracy, version=VERSION):  # noqa: ARG001  # part of its types
    """Correct states in place to given values of the drive; fill `found` as `corrected` does."""
    for i in range(len(y)):
        g = 0 if len(geometry.points) == 1 else i
        found[i] = corrected(plan, geometry, g, held[i], y[i], target[i], w, accuracy)


@kept
def steps(plan, geometry, w, held, h, orientation, nodes, limits, good, crossing, version=VERSION):  # noqa: ARG001  # part of its types
    """Try a step of many curves; nodes (n, 3) are the previous, the last and the next."""
    for i in range(len(h)):
        g = 0 if len(geometry.points) == 1 else i
        own = Nodes(nodes.s[i], nodes.y[i], nodes.rate[i], nodes.drive[i], nodes.slope[i], nodes.tangent[i])
        h[i], good[i], crossing[i], singular = step(
            plan, geometry, g, held[i], h[i], orientation[i], own, 1, 0, 2, limits, w
        )
        if singular:
            return False
    return True


@kept
def swept(plan, geometry, w, held, sweep, nodes, limits, accuracy, version=VERSION):  # noqa: ARG001  # part of its types
    """Sweep mechanisms from their design poses both ways; `nodes` is work space."""
    for c in range(len(sweep.orientation)):
        g = 0 if len(geometry.points) == 1 else c
        for side in range(2):
            sign = 2 * side - 1
            set_out(sweep.start, c, sign, nodes, limits)
            sense, first, target = sign * sweep.orientation[c], limits.first, sweep.target[c, side]
            k, why, _ = toward(plan, geometry, g, held[c], sense, first, target, nodes, limits, w)
            if why == TURNING:
                up_to_dead_point(plan, geometry, g, held[c], nodes, k, limits, w)
            sweep.end[c, side], sweep.why[c, side] = nodes.drive[k], why
            i, bulge = ONE, 0.0
            for n in range(len(sweep.goal)):
                value = sweep.goal[n]
                if (value >= nodes.drive[1]) == (side == 1) and sign * (value - nodes.drive[k]) <= END_TOLERANCE:
                    i, bulge = between(nodes, i, k, sign, value, bulge, w)
                    sweep.found[c, n] = corrected(plan, geometry, g, held[c], w.y, value, w, accuracy)
                    bulge = bulge if sweep.found[c, n] == 1 else 0.0
                    for j in range(len(w.y)):
                        sweep.states[c, n, j] = w.y[j]
                        w.off[j] = w.y[j] - w.off[j]


@compiled
def set_out(start, g, sign, nodes, limits):
    """Write the first pose of a curve as node 1, a straight predecessor as node 0."""
    nodes.s[0], nodes.s[1] = -limits.first, 0.0
    nodes.drive[1], nodes.slope[1] = start.drive[g], sign * start.slope[g]
    for j in range(nodes.tangent.shape[1]):
        nodes.tangent[1, j] = sign * start.tangent[g, j]
    for j in range(nodes.y.shape[1]):
        rate = sign * start.rate[g, j]
        nodes.y[1, j], nodes.y[0, j] = start.y[g, j], start.y[g, j] - limits.first * rate
        nodes.rate[1, j] = nodes.rate[0, j] = rate
