"""Bodies led along their paths: nodes between marks filled in, what is in doubt gone to by steps, and measured."""

from __future__ import annotations

from math import isfinite, sqrt
from typing import Any, NamedTuple

import numpy as np

from ...native.compiling import compiled, inlined, kept
from ...native.elimination import eliminate, substitute
from .guides import HALF, VERSION, apex, locate
from .pose import (
    distance,
    evaluate,
    local,
    moved,
    off_edge,
    turned,
    velocity,
)
from .walk import GOES_ON, Marks, Track, copy, walk

#: No node: numba compiles another version for a literal.
NONE: Any = np.int64(-1)


class Ways(NamedTuple):
    """What is asked of n bodies, and what is answered."""

    path: Any  # (n, s, k): values of the drivers in units
    stop: Any  # (n, s): corners at first
    states: Any  # (n, s, 4 + f): the first is where each begins
    reached: Any  # (n,): how many nodes; 0 for a body that does not begin
    why: Any  # (n,): why not more
    end: Any  # (n,): where the motion ends, in nodes from the first
    steps: Any  # (n,)


class Between(NamedTuple):
    """The polynomial between two marks and room: `filling.Pieces`, and nodes of one body."""

    stops: Any  # (s,)
    places: Any  # (s,): in stops from the first
    good: Any  # (s,)
    at: Any  # (8,)
    factors: Any  # (8, 4 + f)
    level: Any  # (8, 4 + f)
    slope: Any  # (4 + f,)
    other: Any  # (4 + f,)
    dq: Any  # (k,)


class Scales(NamedTuple):
    """What carries units to what was given, the first axis that of the bodies."""

    unit: Any  # (n,)
    centre: Any  # (n, 3)
    ratio: Any  # (n,): unit / diameter
    base: Any  # (n, 3): of the body, as given
    coordinates: Any  # (n, p, 2): units of u and w
    smooth: Any  # (n, d): whether w is free in another chart than the guide's


class Measured(NamedTuple):
    """What is measured of each position, n times s of them."""

    quaternion: Any
    translation: Any
    points: Any
    coordinates: Any
    residual: Any
    condition: Any
    good: Any  # whether there is nothing to say of it


@kept
def led(plan, b, ways, marks, limits, t, x, w, version=VERSION):  # noqa: ARG001  # part of its types
    """Lead bodies along their paths: `follow._led`."""
    s = ways.path.shape[1]
    for i in range(len(ways.reached)):
        if ways.reached[i] == 0:
            continue
        path, states, stop, reached = ways.path[i], ways.states[i], ways.stop[i], 1
        for attempt in range(3):
            marked, begun, count = attempt < 2, reached - 1, NONE + 1
            for j in range(s):
                stop[j] = j == begun or (j > begun and (stop[j] or not marked))
                if stop[j]:
                    x.stops[count] = j
                    count += 1
            copy(states[begun], t.state)
            stops, why, end, steps, many, sign = walk(
                plan, b, i, path, x.stops, count, marked, states, marks, limits, t, w
            )
            ways.steps[i] += steps
            filled(plan, b, i, path, stop, stops, many, sign, states, marks, limits, x, w)
            reached = 0
            while reached < s and x.good[reached]:
                reached += 1
            for j in range(s):
                stop[j] = stop[j] or not x.good[j]
            one, other = x.places[reached - 1], x.places[min(reached, s - 1)]
            part = 0.0
            if why != GOES_ON:
                part = min(max((end - one) / (other - one), 0.0), 1.0) if other != one else 0.0
            ways.why[i], ways.end[i], ways.reached[i] = why, reached - 1 + part, reached
            if reached == s or (why != GOES_ON and other > end):
                break


@inlined
def filled(plan, b, i, path, stop, reached, many, sign, states, marks, limits, x, w):
    """Find the places of nodes, and those that are good, with their states: `filling.fill`."""
    passed, e, fresh = NONE, NONE + 1, NONE
    for j in range(len(stop)):
        if stop[j]:
            passed += 1
            x.places[j], x.good[j] = passed, passed < reached
            continue
        if passed < 0:
            x.places[j], x.good[j] = -1.0, True
            continue
        one, other, part, size = x.stops[passed], x.stops[passed + 1], 0.0, 0.0
        for k in range(path.shape[1]):
            segment = path[other, k] - path[one, k]
            x.dq[k] = segment
            part += (path[j, k] - path[one, k]) * segment
            size += segment * segment
        part /= size
        x.places[j], x.good[j] = passed + part, False
        if passed >= reached:
            continue
        while e + 1 < many and before(marks, e + 1, passed, part):
            e += 1
        if e + 1 == many or marks.corner[e] != passed or marks.corner[e + 1] != passed:
            continue
        if e != fresh:
            piece(marks, many, e, x)
            fresh = e
        if corrected(plan, b, i, path[j], part, sign, limits, x, w):
            x.good[j] = True
            copy(w.trial, states[j])


@inlined
def before(marks, e, corner, t):
    """Return whether a mark is not behind a place."""
    return marks.corner[e] < corner or (marks.corner[e] == corner and marks.t[e] <= t)


@compiled
def piece(marks, many, e, x):
    """Find the divided differences of the polynomial through marks e and e + 1 and their neighbours."""
    behind = e > 0 and marks.corner[e - 1] == marks.corner[e]
    ahead = e + 2 < many and marks.corner[e + 2] == marks.corner[e]
    count = 4 + 2 * (behind + ahead)
    for k in range(4):
        n = e if k == 0 else e + 1 if k == 1 else e - 1 if k == 2 and behind else e + 2
        if 2 * k < count:
            x.at[2 * k] = x.at[2 * k + 1] = marks.t[n]
            copy(marks.value[n], x.level[2 * k])
            copy(marks.value[n], x.level[2 * k + 1])
    copy(x.level[0], x.factors[0])
    rows = x.level.shape[1]
    for k in range(1, 8):
        for r in range(rows):
            x.factors[k, r] = 0.0
        if k >= count:
            continue
        for n in range(count - k):
            over = 1 / (x.at[n + k] - x.at[n])
            for r in range(rows):
                x.level[n, r] = (x.level[n + 1, r] - x.level[n, r]) * over
        if k == 1:
            for n in range(0, count, 2):
                which = e if n == 0 else e + 1 if n == 2 else e - 1 if n == 4 and behind else e + 2
                copy(marks.slope[which], x.level[n])
        copy(x.level[0], x.factors[k])


@inlined
def corrected(plan, b, i, q, part, sign, limits, x, w):
    """Find the pose at a node, in `w.trial`; return whether it is beyond doubt."""
    m, rows, a = len(w.value), len(w.trial), w.system
    for r in range(rows):
        value, slope = x.factors[7, r], 0.0
        for k in range(6, -1, -1):
            off = part - x.at[k]
            slope = slope * off + value
            value = value * off + x.factors[k, r]
        w.trial[r], x.slope[r] = value, slope
    evaluate(plan, b, i, w.trial, q, w)
    for r in range(m):
        slope = 0.0
        for k in range(len(q)):
            slope += w.drivers[r, k] * x.dq[k]
        for j in range(m):
            a[r, j] = w.jacobian[r, j]
        a[r, m], a[r, m + 1] = -w.value[r], -slope
    if eliminate(a, m, m + 2, w.interchanged) != sign:
        return False
    first, speed, off = 0.0, 0.0, 0.0
    for r in range(m):
        w.along[r], w.shift[r] = a[r, m], a[r, m + 1]
        first += a[r, m] * a[r, m]
        speed += a[r, m + 1] * a[r, m + 1]
    for k in range(len(q)):
        speed += (w.travel[k] * x.dq[k]) ** 2
    first, speed = sqrt(first), sqrt(speed)
    velocity(w.trial, w.shift, w.metric, x.other)
    for r in range(rows):
        scale = 2.0 if r < 4 else w.metric[r - 4]
        off += ((x.other[r] - x.slope[r]) * scale) ** 2
    if not (sqrt(off) <= limits.alike * speed and first <= limits.near * speed * (x.at[2] - x.at[0]) + limits.last):
        return False
    moved(w.trial, w.along, w.metric, w.trial)
    length, settled = first, False
    for _ in range(limits.few + 1):
        # what is left after a correction by a matrix that is not renewed is of the order of it times the first
        if settled or length * first < limits.last * limits.last:
            return not off_edge(plan, b, i, w.trial, q, w)
        evaluate(plan, b, i, w.trial, q, w, False)
        for r in range(m):
            w.along[r] = -w.value[r]
        substitute(a, m, w.interchanged, w.along)
        limit, length = limits.second * length, 0.0
        for r in range(m):
            length += w.along[r] * w.along[r]
        length, settled = sqrt(length), distance(w) < limits.noise * b.reach[i]
        if not (settled or length <= limit):
            return False
        moved(w.trial, w.along, w.metric, w.trial)
    return False


@kept
def measured(plan, b, scales, path, values, states, reached, tests, out, w, version=VERSION):  # noqa: ARG001  # part of its types
    """Measure positions: `position.reported`; what is not plainly good is left to it."""
    s = path.shape[1]
    for i in range(len(reached)):
        for j in range(reached[i]):
            n = i * s + j
            evaluate(plan, b, i, states[i, j], path[i, j], w)
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
    """Return the condition number of the Jacobian, lengths being in diameters: `position.conditioning`."""
    m, a = len(w.value), w.system
    one, other = 0.0, 0.0
    for r in range(m):
        for j in range(m):
            a[r, j] = v = w.jacobian[r, j]
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


def room(rows: int, drivers: int, nodes: int, most: int) -> tuple[Marks, Track, Between]:
    """Return room for one body on its way: states of so many numbers."""
    m = rows - 1
    track = Track._make(
        np.zeros(v) for v in (rows, m - 3, m + 1, m + 1, (m, drivers), drivers, drivers, m + 1, m + 1, m)
    )
    marks = Marks(np.zeros(most, np.int64), *(np.zeros(v) for v in (most, (most, rows), (most, rows))))
    between = Between(
        np.zeros(nodes, np.int64), np.zeros(nodes), np.zeros(nodes, bool),
        *(np.zeros(v) for v in (8, (8, rows), (8, rows), rows, rows, drivers)),
    )  # fmt: skip
    return marks, track, between
