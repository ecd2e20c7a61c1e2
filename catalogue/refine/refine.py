"""Minimax refinement of placed guides on their finite motion, inside the constraints of a request.

Each round linearises the distance from the nominal at Chebyshev points (`derivatives`), asks for the step that makes
the largest one least (`step`) under several dampings at once, lays and measures what comes of each on the finite
motion, and keeps the best that satisfies all constraints.  A deviation is never taken from the linear model.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..guide.minimax import grid
from ..guide.place import at_stroke
from ..guide.span import Span, span
from ..linkage import Array
from ..query.lay import Answers, laid, merged
from ..query.request import Constraints, Request
from .derivatives import across_nominal, displaced
from .step import minimax_step

#: Intervals between the points at which the distance is linearised.
NODES = 32
#: Dampings tried in each round: the smaller, the longer the step.
DAMPINGS = 10.0 ** np.array([-1.0, -3.0, -5.0, -7.0, -9.0])
#: Rounds at most; a guide rests when a round gains less than this part.
ROUNDS, GAIN = 20, 0.01
#: Guides below this deviation over stroke are exact but for rounding.
EXACT = 1e-12
#: By how much the price of a guide, its deviation apart, may rise.
SLACK = 0.05


def refined(found: Answers, request: Request, wanted: Constraints, price: Callable[[Answers], Array]) -> Answers:
    """Return guides with their deviation made as small as the constraints allow, from where they stand.

    Points that return are left as they are.

    Parameters
    ----------
    found : Answers
        Placed guides that satisfy the constraints.
    request : StraightLine or CircularArc
    wanted : Constraints
    price : callable
        From answers to what they cost besides their deviation, shape (n,); it may rise by `SLACK`.
    """
    ceiling = price(found) + SLACK
    resting = span(found.linkage, found.point, pole=found.pole).cusp
    open_ = np.flatnonzero((found.traced.relative > EXACT) & ~resting)
    for _ in range(ROUNDS):
        if not len(open_):
            break
        now = found[open_]
        guides = span(now.linkage, now.point, pole=now.pole)
        step, _ = minimax_step(*_linearised(now, guides), DAMPINGS)
        tried, which, good = _tried(now, guides, step, request, wanted)
        good &= price(tried) <= ceiling[open_][which]
        deviation = np.where(good, tried.traced.fit.deviation, np.inf)
        first = least(deviation, which)
        first = first[deviation[first] < now.traced.fit.deviation[which[first]]]
        gained = which[first]
        where = np.zeros(len(found.point), bool)
        where[open_[gained]] = True
        found = merged(found, tried[first], where)
        enough = deviation[first] < (1 - GAIN) * now.traced.fit.deviation[gained]
        open_ = open_[gained[enough]]
    return found


def _linearised(now: Answers, guides: Span) -> tuple[Array, Array, Array]:
    """Return distances from the nominals to the left (m, n), their derivatives (m, n, 10), and how moving the nominals
    would change them (m, n, 2)."""
    nodes, fit = grid(NODES).nodes, now.traced.fit
    low, high = now.traced.low.astype(float), now.traced.high.astype(float)
    u, v = guides.path.window(low, high, nodes)
    z = guides.point + (u + 1j * v) * guides.tangent
    t = 0.5 * (high + low) + 0.5 * (high - low) * nodes[:, None]
    start, along, curvature = fit.start.astype(complex), fit.along.astype(complex), fit.curvature.astype(float)
    stroke = fit.stroke.astype(float)
    if not curvature.any():
        w = (z - start) * along.conj()
        free = np.stack([np.ones_like(w.real), 2 * w.real / stroke - 1], axis=-1)
        return w.imag, across_nominal(guides.motion, guides.point, t, along), free
    depth = np.copysign(np.sqrt(1 / curvature**2 - 0.25 * stroke**2), curvature)
    spoke = start + along * (0.5 * stroke + 1j * depth) - z  # to the centre, which keeps its radius when it moves
    left = np.sign(curvature) * spoke / np.abs(spoke)
    free = np.stack([left.real, left.imag], axis=-1)
    distance = 1 / curvature - np.sign(curvature) * np.abs(spoke)
    return distance, across_nominal(guides.motion, guides.point, t, -1j * left), free


def _tried(
    now: Answers, guides: Span, step: Array, request: Request, wanted: Constraints
) -> tuple[Answers, Array, Array]:
    """Return the guides after each of the steps (k, n, 10), which guide each one comes of, and which meet all
    constraints."""
    k, n, _ = step.shape
    which = np.tile(np.arange(n), k)
    moves = np.nan_to_num(step.reshape(k * n, -1))
    linkage, point, valid = displaced(guides.linkage[which], guides.point[which], moves)
    which = which[valid]
    moved = span(linkage, point, pole=now.pole[which])
    traced = at_stroke(moved, request.stroke, circle=request.kind == "circle", nodes=16, extend=False)
    tried, checks = laid(request, wanted, {name: v[which] for name, v in now.rows.items()}, moved, traced)
    return tried, which, np.logical_and.reduce(list(checks.values()))


def least(value: Array, group: Array) -> Array:
    """Return the index of the least value of each group."""
    order = np.lexsort((value, group))
    return np.asarray(order[np.unique(group[order], return_index=True)[1]])
