"""Steps of one body along a path of the drivers from corner to corner, with marks to interpolate between."""

from __future__ import annotations

from math import inf, sqrt
from typing import Any, NamedTuple

import numpy as np

from ...native.compiling import compiled, inlined
from .pose import correct, moved, off_edge, velocity

#: Why a walk ended, in the order of `compiled.REASONS`.
GOES_ON, TURNING, BRANCH, STUCK, EDGE = range(5)
#: Nodes reached, marks left and whether rates are known, at first: numba compiles another version for a literal.
START: Any = np.int64(1), np.int64(0), np.bool_(False)


class Track(NamedTuple):
    """Where a body is on its way: what `Walk` and `Front` have of one, and room; m equations."""

    state: Any  # (4 + f,)
    metric: Any  # (f,)
    tangent: Any  # (m + 1,)
    before: Any  # (m + 1,)
    rates: Any  # (m, k): by the drivers, at the last node
    q0: Any  # (k,)
    q1: Any  # (k,)
    z: Any  # (m + 1,): predicted step
    row: Any  # (m + 1,)
    rate: Any  # (m,)


class Marks(NamedTuple):
    """States and derivatives along the way, in its order."""

    corner: Any  # (most,): the last node before
    t: Any  # (most,): part of the way to the next
    value: Any  # (most, 4 + f)
    slope: Any  # (most, 4 + f)


@compiled
def walk(plan, b, i, path, stops, count, marked, states, marks, limits, t, w):
    """Lead a body from a state, in `t.state`, past the values of a path that are stops, and write the states there.

    Returns how many stops were reached, why no more, where the motion ended in stops from the first, how many steps
    were tried and marks left, and the sign of the determinant.
    """
    m = len(w.value)
    reached, many, rated = START
    y, width, length, step, end, steps = 0.0, 1.0, limits.longest / 8, 1.0, 0.0, 0
    line(path, stops, count, reached, width, t)
    hold(t)
    copy(t.state, w.trial)
    _, sign, _, _ = correct(plan, b, i, t.q0, t.q1, 0.0, t.row, inf, limits, w)
    width, many = landed(path, stops, count, reached, marked, rated, states, marks, many, t, w)
    rated = reached > 0
    while reached < count:
        line(path, stops, count, reached, width, t)
        h = min(max((width - y) / max(t.tangent[m], 1e-300), -length), length)
        land, size = abs(h) < length, abs(h)
        predicted(h, step, land, width - y, t)
        moved(t.state, t.z, t.metric, w.trial)
        new, enough = width if land else y + t.z[m], max(limits.first * size, limits.last)
        new, turned, first, found = correct(plan, b, i, t.q0, t.q1, new, t.row, enough, limits, w)
        good, stretch = judged(h, new - y, first, found, limits, t, w)
        steps += 1
        if not (good and turned == sign and w.along[m] > 0):
            why, at = refused(size, good, turned != sign, limits), y + h * t.tangent[m]
            if why == GOES_ON and good and turned == sign:
                at = turning(plan, b, i, h, w.along[m], y, step, limits, t, w)
                why = TURNING if at <= width else GOES_ON
            if why != GOES_ON:
                return reached, why, stopped(reached, at, width), steps, many, sign
            length = size / 2
            continue
        if beyond_edge(plan, b, i, new, t, w):
            return reached, EDGE, stopped(reached, y + h * t.tangent[m], width), steps, many, sign
        length, step = lengthened(size, stretch, length, land, limits), h
        if land:
            reached += 1
            y, end = 0.0, reached - 1.0
            width, many = landed(path, stops, count, reached, marked, rated, states, marks, many, t, w)
        else:
            y = new
            many = advanced(y, width, reached, marked, marks, many, t, w)
        rated = land
    return reached, GOES_ON, end, steps, many, sign


@inlined
def refused(size, good, flipped, limits):
    """Return why a motion ends with a step that is refused; GOES_ON where a shorter one may do."""
    if good and flipped and size < limits.at_branch:
        return BRANCH
    if not good and size < limits.shortest:
        return STUCK
    return GOES_ON


@inlined
def beyond_edge(plan, b, i, y, t, w):
    """Return whether the state that was tried has a point on the half of a guide that its chart does not reach."""
    for j in range(len(w.q)):
        w.q[j] = t.q0[j] + y * t.q1[j]
    return off_edge(plan, b, i, w.trial, w.q, w)


@inlined
def lengthened(size, stretch, length, land, limits):
    """Return the length of the next step after one of a size; one that was cut short by a stop shortens no other."""
    better = size * stretch
    if land and better >= size:
        better = max(length, better)
    return min(better, limits.longest)


@inlined
def advanced(y, width, reached, marked, marks, many, t, w):
    """Take the state that was tried, between two stops, and leave a mark there; return the number of marks."""
    m = len(w.value)
    copy(w.trial, t.state)
    copy(w.metric, t.metric)
    copy(t.tangent, t.before)
    copy(w.along, t.tangent)
    if marked:
        for j in range(m):
            t.rate[j] = w.along[j] / w.along[m] * width
        many = mark(marks, many, reached - 1, y / width, t)
    return many


@inlined
def copy(one, other):
    """Overwrite the second by the first."""
    for j in range(len(one)):
        other[j] = one[j]


@inlined
def hold(t):
    """Let the corrector leave y as it is."""
    m = len(t.row) - 1
    for j in range(m):
        t.row[j] = 0.0
    t.row[m] = 1.0


@inlined
def stopped(reached, y, width):
    """Return where a motion ends, in stops from the first."""
    return reached - 1 + min(y / width, 1.0)


@inlined
def line(path, stops, count, reached, width, t):
    """Find the straight line on which the drivers are."""
    one, other = stops[reached - 1], stops[min(reached, count - 1)]
    for j in range(path.shape[1]):
        t.q0[j] = path[one, j]
        t.q1[j] = (path[other, j] - path[one, j]) / width


@inlined
def predicted(h, step, land, left, t):
    """Find the step of length h, and the row of its corrector."""
    m = len(t.z) - 1
    for j in range(m + 1):
        t.z[j] = h * t.tangent[j] + 0.5 * h * h / step * (t.tangent[j] - t.before[j])
        t.row[j] = 0.0 if land else t.tangent[j]
    if land:
        t.z[m], t.row[m] = left, 1.0


@inlined
def judged(h, risen, first, found, limits, t, w):
    """Return whether a step stayed on its curve, and how much longer the next may be: `Corrected.judged`."""
    m, f = len(t.z) - 1, len(t.metric)
    a, b, rise = t.tangent[m], w.along[m], risen / h
    linear, square = 6 * rise - 4 * a - 2 * b, 3 * (a + b - 2 * rise)
    turn, along, size = 0.0, 0.0, 0.0
    for j in range(m + 1):
        chord, mean = t.z[j] + w.shift[j], w.along[j] + t.tangent[j]
        if m - f <= j < m:
            chord *= (1 + w.metric[j - m + f] / t.metric[j - m + f]) / 2
        w.shift[j] = chord
        turn += (w.along[j] - t.tangent[j]) ** 2
        along += chord * mean
        size += mean * mean
    off = 0.0
    for j in range(m + 1):
        off += (w.shift[j] - (w.along[j] + t.tangent[j]) * (along / size)) ** 2
    off, turn, size = sqrt(off), sqrt(turn), abs(h)
    dips = square > 0 and linear < 0 and linear > -2 * square
    plain = b <= 0 or not dips or a - linear * linear / (4 * square) >= limits.margin * turn**3
    good = found and plain and off <= max(limits.bow * size, limits.last) and turn <= limits.turn
    if not good:
        return False, 0.0
    one = max(limits.wanted_first * size, limits.last) / first
    other = max(limits.wanted_bow * size, limits.last) / off
    stretch = min(sqrt(min(one, other)), limits.wanted_turn / turn)  # corrections grow like the cube
    return True, min(max(stretch, limits.shorter), limits.longer)


@inlined
def landed(path, stops, count, reached, marked, rated, states, marks, many, t, w):
    """Store a node, and turn towards the next; return the length of the way there, and the number of marks."""
    m, k, node = len(w.value), path.shape[1], reached - 1
    copy(w.trial, t.state)
    copy(w.metric, t.metric)
    here, following = stops[node], stops[min(reached, count - 1)]
    copy(t.state, states[here])
    if marked and node > 0:
        for r in range(m):
            t.rate[r] = 0.0
            for j in range(k):
                t.rate[r] += w.rates[r, j] * (path[here, j] - path[stops[node - 1], j])
        many = mark(marks, many, node - 1, 1.0, t)
    width = 0.0
    for j in range(k):
        width += (w.travel[j] * (path[following, j] - path[here, j])) ** 2
    width = max(sqrt(width), 1e-9)
    for r in range(m):
        ahead, behind = 0.0, 0.0
        for j in range(k):
            ahead += w.rates[r, j] * (path[following, j] - path[here, j])
            behind += t.rates[r, j] * (path[following, j] - path[here, j])
            t.rates[r, j] = w.rates[r, j]
        t.rate[r] = t.tangent[r] = ahead
        t.before[r] = behind if rated else ahead
    if marked:
        many = mark(marks, many, node, 0.0, t)
    t.tangent[m] = t.before[m] = width
    unit(t.tangent)
    unit(t.before)
    return width, many


@inlined
def unit(v):
    """Give a vector the length 1."""
    size = 0.0
    for j in range(len(v)):
        size += v[j] * v[j]
    size = 1 / sqrt(size)
    for j in range(len(v)):
        v[j] *= size


@compiled
def mark(marks, many, corner, part, t):
    """Leave a mark behind those that come before it; return their number, which is no larger than there is room."""
    if many == len(marks.t):
        return many
    k = many
    while k > 0 and marks.corner[k - 1] == corner and marks.t[k - 1] > part:
        marks.corner[k], marks.t[k] = marks.corner[k - 1], marks.t[k - 1]
        copy(marks.value[k - 1], marks.value[k])
        copy(marks.slope[k - 1], marks.slope[k])
        k -= 1
    marks.corner[k], marks.t[k] = corner, part
    copy(t.state, marks.value[k])
    velocity(t.state, t.rate, t.metric, marks.slope[k])
    return many + 1


@compiled
def turning(plan, b, i, h, slope, y, step, limits, t, w):
    """Return y at the turning point within a step of length h, at whose end dy/ds is `slope`: as the function there."""
    m = len(w.value)
    low, high, at_low, at_high, kept, new = 0.0, h, t.tangent[m], slope, 0.0, y
    for _ in range(60):
        s = high - at_high * (high - low) / (at_high - at_low)
        predicted(s, step, False, 0.0, t)
        moved(t.state, t.z, t.metric, w.trial)
        new, _, _, _ = correct(plan, b, i, t.q0, t.q1, y + t.z[m], t.row, inf, limits, w)
        at = w.along[m]
        if not abs(at) > 1e-8:
            break
        if at > 0:
            at_high, at_low, low = (at_high / 2 if kept > 0 else at_high), at, s
            kept = max(kept, 0.0) + 1
        else:
            at_low, at_high, high = (at_low / 2 if kept < 0 else at_low), at, s
            kept = min(kept, 0.0) - 1
    return new
