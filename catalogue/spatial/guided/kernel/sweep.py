"""Move bodies along their paths by `native.curve`, from corner to corner, and measure them."""

from __future__ import annotations

from math import isfinite, sqrt
from typing import NamedTuple

from ....kinematics.types import Floats, Integers, Mask
from ...continuation.newton import Accuracy
from ...native.compiling import ONE, ZERO, compiled, inlined, kept
from ...native.curve import (
    BRANCH,
    DOUBTFUL,
    EDGE,
    LONG,
    REACHED,
    SINGULAR,
    STUCK,
    TURNING,
    across,
    at,
    between,
    toward,
    up_to_dead_point,
)
from ...native.elimination import eliminate
from ...native.newton import corrected, factored
from .guides import HALF, VERSION, apex, locate
from .pose import at_drivers, by_y, distance, lifted, local, off_edge, turned


class Ways(NamedTuple):
    """Input and results of n bodies."""

    path: Floats  # (n, s, k): values of the drivers in units
    stop: Integers  # (n, s): mask of corners of the paths; nodes reached by repeated steps are added
    states: Floats  # (n, s, 4 + f): the first one is the start
    reached: Integers  # (n,): number of reached nodes; 0 for a body without start
    why: Integers  # (n,): reason of the end
    end: Floats  # (n,): end of the motion, in nodes from the first
    steps: Integers  # (n,)


class Scales(NamedTuple):
    """Factors from units to the given lengths; the first axis counts bodies."""

    unit: Floats  # (n,)
    centre: Floats  # (n, 3)
    ratio: Floats  # (n,): unit of length over the diameter of the body
    base: Floats  # (n, 3): base point of the body, as given
    coordinates: Floats  # (n, p, 2): units of the surface coordinates u and w
    smooth: Mask  # (n, d): whether w is free in a chart other than the guide's


class Measured(NamedTuple):
    """Measures of n times s positions."""

    quaternion: Floats
    translation: Floats
    points: Floats
    coordinates: Floats
    residual: Floats
    condition: Floats
    good: Mask  # whether the position has no remark


@kept
def led(plan, b, ways, nodes, limits, accuracy, held, w, version=VERSION):  # noqa: ARG001  # part of its types
    """Move bodies along their paths, from corner to corner; see `guided.walk`."""
    for i in range(len(ways.reached)):
        begin, sign, last, leap = ZERO, 0.0, ways.path.shape[1] - ONE, True
        if ways.reached[i] == 0:
            continue
        taken(ways, i, begin, w)
        while True:
            end = min(begin + ONE, last)
            while not ways.stop[i, end]:
                end += 1
            here = set_out(plan, b, i, ways.path[i], begin, end, held, nodes, w)
            sign = here if sign == 0 else sign
            lost = here == 0 or here != sign
            if lost and leap and begin > 0:  # return to the corner and repeat by steps
                begin, leap = begin - ONE, False
                taken(ways, i, begin, w)
                continue
            ways.reached[i], ways.end[i] = begin + 1, begin
            if begin == last:
                break
            width, leap = nodes.drive[0], leap and end == begin + 1
            if lost:
                ways.why[i] = BRANCH if here != 0 else SINGULAR
            elif leap and leapt(plan, b, i, width, held, nodes, limits, accuracy, w):
                stored(ways, i, end, w)
                ways.steps[i], begin = ways.steps[i] + 1, end
                continue
            else:
                side(plan, b, i, ways, begin, end, width, sign, nodes, limits, accuracy, held, w)
            done, begin, leap = begin, ways.reached[i] - 1, True
            if ways.why[i] == DOUBTFUL and (
                begin > done or end > done + 1
            ):  # repeat from its last node, with this node and the next one as corners
                ways.stop[i, begin], ways.stop[i, begin + 1], ways.why[i] = True, True, REACHED
            if ways.why[i] != REACHED:
                break
            taken(ways, i, begin, w)


@inlined
def taken(ways, i, j, w):
    """Copy the state at node j of a path to the working state."""
    for r in range(ways.states.shape[2]):
        w.y[r] = ways.states[i, j, r]


@inlined
def stored(ways, i, j, w):
    """Store the working state at node j of a path."""
    for r in range(ways.states.shape[2]):
        ways.states[i, j, r] = w.y[r]


@inlined
def set_out(plan, b, i, path, begin, end, held, nodes, w):
    """Start along the line from one corner of a path to the next.

    The arc length of the line is stored as the drive of node 0, the state as node 1.  Return the
    sign of the determinant.
    """
    m, width = len(plan.keep), 0.0
    w.y[m + 1] = 0.0
    for k in range(path.shape[1]):
        w.q0[k], w.q1[k] = path[begin, k], 0.0
    at(plan, b, i, w.y, w)
    for k in range(path.shape[1]):
        width += (w.travel[k] * (path[end, k] - path[begin, k])) ** 2
    nodes.drive[0] = width = max(sqrt(width), 1e-9)
    for k in range(path.shape[1]):
        w.q1[k] = (path[end, k] - path[begin, k]) / width
    by_y(w)
    sign = across(plan, held, w, w.jacobian[m])
    lifted(plan, w.y, w.along, w.rate)
    nodes.s[1], nodes.drive[1], nodes.slope[1] = 0.0, 0.0, w.along[m]
    for j in range(m + 1):
        nodes.tangent[1, j] = w.along[j]
    for r in range(len(w.y)):
        nodes.y[1, r], nodes.rate[1, r] = w.y[r], w.rate[r]
    return sign


@inlined
def leapt(plan, b, i, width, held, nodes, limits, accuracy, w):
    """Try to reach the next corner in one step; return success."""
    far = width / nodes.slope[1]
    if not far <= limits.first:
        return False
    for r in range(len(w.y)):
        w.y[r] += far * w.rate[r]
    near = Accuracy(accuracy.last, min(accuracy.near, 0.1 * far), accuracy.enough)
    return corrected(plan, b, i, held, w.y, width, w, near) == 1 and not off_edge(plan, b, i, w.y, w)


@compiled
def side(plan, b, i, ways, begin, end, width, sign, nodes, limits, accuracy, held, w):
    """Move a body by steps between two corners of its path; store nodes."""
    path, m, j, why = ways.path[i], len(plan.keep), begin + ONE, LONG
    h = min(limits.first, 1.02 * width / nodes.slope[1])
    nodes.s[0] = -limits.first
    for r in range(len(w.y)):
        nodes.rate[0, r], nodes.y[0, r] = nodes.rate[1, r], nodes.y[1, r] - limits.first * nodes.rate[1, r]
    while why == LONG:
        k, why, tried = toward(plan, b, i, held, sign, h, width, nodes, limits, w)
        ways.steps[i] += tried
        if why == TURNING:
            up_to_dead_point(plan, b, i, held, nodes, k, limits, w)
        off = off_edges(plan, b, i, k, nodes, w)
        if off <= k:
            k, why = off, EDGE
        sure, stop, node, bulge = why == REACHED, nodes.drive[k], ONE, 0.0
        while j <= end:
            value = width if j == end else part(path, begin, end, j) * width
            if value > nodes.drive[k]:
                break
            node, bulge = between(nodes, node, k, 1.0, value, bulge, w)
            good = corrected(plan, b, i, held, w.y, value, w, accuracy) == 1
            if good and not sure:
                at(plan, b, i, w.y, w)
                good = factored(w.jacobian[m], w) == sign
            if not good:
                why = DOUBTFUL
                break
            if off_edge(plan, b, i, w.y, w):
                why, stop = EDGE, value
                break
            for r in range(len(w.y)):
                w.off[r] = w.y[r] - w.off[r]
            stored(ways, i, j, w)
            j += ONE
        if why == LONG and nodes.drive[k] - nodes.drive[1] <= limits.shortest * width:
            why = STUCK
        if why == LONG:  # continue from the last node
            for to in range(2):
                copied(nodes, k - 1 + to, to)
            h = nodes.s[1] - nodes.s[0]
    ways.reached[i], ways.why[i], ways.end[i] = j, REACHED, end
    if j <= end:
        one, other = part(path, begin, end, j - 1) * width, part(path, begin, end, j) * width
        ways.why[i], ways.end[i] = why, j - 1 + min(max((stop - one) / (other - one), 0.0), 1.0)


@inlined
def part(path, begin, end, j):
    """Return the fraction of the distance between corners at value j of a path."""
    along, size = 0.0, 0.0
    for k in range(path.shape[1]):
        segment = path[end, k] - path[begin, k]
        along += (path[j, k] - path[begin, k]) * segment
        size += segment * segment
    if size > 0:
        return along / size
    return 1.0 if j == end else 0.0


@compiled
def copied(nodes, one, to):
    """Copy a node over another."""
    nodes.s[to], nodes.drive[to], nodes.slope[to] = nodes.s[one], nodes.drive[one], nodes.slope[one]
    for r in range(nodes.y.shape[1]):
        nodes.y[to, r], nodes.rate[to, r] = nodes.y[one, r], nodes.rate[one, r]
    for j in range(nodes.tangent.shape[1]):
        nodes.tangent[to, j] = nodes.tangent[one, j]


@inlined
def off_edges(plan, b, i, k, nodes, w):
    """Return the first node, up to k, beyond the edge of a guide; k + 1 without one."""
    for n in range(2, k + 1):
        for d in range(len(w.q)):
            w.q[d] = w.q0[d] + nodes.drive[n] * w.q1[d]
        if off_edge(plan, b, i, nodes.y[n], w):
            return n
    return k + 1


@kept
def measured(plan, b, scales, path, values, states, reached, tests, out, w, version=VERSION):  # noqa: ARG001  # part of its types
    """Measure positions; those with a remark are left to `position.reported`."""
    s = path.shape[1]
    for i in range(len(reached)):
        for j in range(reached[i]):
            n = i * s + j
            for k in range(len(w.q)):
                w.q[k] = path[i, j, k]
            at_drivers(plan, b, i, states[i, j], w, True)
            off = distance(w)
            out.residual[n], out.condition[n] = off * scales.ratio[i], condition(w, scales.ratio[i])
            good = off <= tests[0] * b.reach[i] and out.condition[n] <= tests[1]
            for f in range(len(w.metric)):
                good = good and w.metric[f] >= tests[2]
            for r in range(4):
                out.quaternion[n, r] = states[i, j, r]
            unit, first = scales.unit[i], plan.driven[0, 0]
            for a in range(w.arms.shape[0]):
                p, v = out.points[n, a], w.arms[a]
                px, py, pz = w.places[0, 0] + v[0], w.places[0, 1] + v[1], w.places[0, 2] + v[2]
                p[0] = px * unit + scales.centre[i, 0]
                p[1] = py * unit + scales.centre[i, 1]
                p[2] = pz * unit + scales.centre[i, 2]
                kind, driven, known = b.kinds[i, a], False, False
                for d in range(len(plan.driven)):
                    if plan.driven[d, 0] == a:
                        driven, known = True, kind != HALF and not scales.smooth[i, d]
                if known:
                    continue
                one, other = b.shapes[i, a, 0], b.shapes[i, a, 1]
                x, y, z = local(b, i, a, px, py, pz)
                u, v_ = locate(kind, x, y, z, one, other)
                out.coordinates[n, a, 0] = u * scales.coordinates[i, a, 0]
                out.coordinates[n, a, 1] = v_ * scales.coordinates[i, a, 1]
                good = good and isfinite(u) and (driven or apex(kind, x, y, z, one, other) >= tests[2])
            for d in range(len(plan.driven)):
                a, column = plan.driven[d, 0], plan.driven[d, 1]
                for axis in range(2):
                    k = plan.driven[d, 2 + axis]
                    if k >= 0:
                        out.coordinates[n, a, axis] = values[i, j, k]
                        half = axis == 1 and b.kinds[i, a] == HALF
                        good = good and not (half and path[i, j, k] < b.shapes[i, a, 0])
                    elif column >= 0 and not (axis == 1 and scales.smooth[i, d]):
                        out.coordinates[n, a, axis] = states[i, j, column + 1] * scales.coordinates[i, a, axis]
            c = scales.base[i]
            tx, ty, tz = turned(w.rotation, c[0], c[1], c[2])
            p = out.points[n, first]
            out.translation[n, 0], out.translation[n, 1], out.translation[n, 2] = p[0] - tx, p[1] - ty, p[2] - tz
            out.good[n] = good


@inlined
def condition(w, ratio):
    """Return the condition number of the Jacobian, lengths in diameters of the body.

    See `position.conditioning`.
    """
    m, a = len(w.rows), w.inverse
    one, other = 0.0, 0.0
    for r in range(m):
        for j in range(m):
            v = w.jacobian[r, j]
            if j >= 3:
                v /= w.metric[j - 3]
            a[r, j] = v
            a[r, m + j] = 1.0 if r == j else 0.0
            v *= ratio if j < 3 else 1.0
            one += v * v
    eliminate(a, m, 2 * m, w.interchanged)
    for r in range(m):
        size = 0.0
        for j in range(m):
            size += a[r, m + j] * a[r, m + j]
        other += size / (ratio * ratio) if r < 3 else size
    return sqrt(one * other)
