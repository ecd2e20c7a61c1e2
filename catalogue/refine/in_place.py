"""Minimax refinement of guides of which some pivots are given: the rest moves, the nominal does not."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..guide.in_place import along, distance, in_place
from ..guide.minimax import grid
from ..guide.span import Span, span
from ..guide.trace import Traced
from ..linkage import Array, Linkage
from ..query.request import Request
from .derivatives import across_nominal, displaced
from .refine import DAMPINGS, EXACT, GAIN, NODES, ROUNDS, least
from .step import minimax_step


def refined_in_place(
    linkage: Linkage, point: Array, request: Request, free: Array, good: Callable[[Span, Traced], Array]
) -> tuple[Linkage, Array]:
    """Return linkages and guided points whose largest distance from the nominal is as small as can be.

    Parameters
    ----------
    linkage : Linkage of n
        Near the nominal in the reference position.
    point : complex ndarray, shape (n,)
    request : StraightLine or CircularArc
    free : ndarray of bool, shape (10,)
        Which coordinates may move: x and y of A1, A1*, A2, A2* and of the guided point.
    good : callable
        From spans and what was traced of them to which satisfy the constraints; those that do stay so.
    """
    pivots, point = linkage.pivots.copy(), point.copy()
    guides = span(linkage, point)
    traced = in_place(guides, request.stroke, request.radius)
    deviation, kept = traced.fit.deviation.copy(), good(guides, traced)
    open_ = np.flatnonzero(deviation > EXACT * request.stroke)
    for _ in range(ROUNDS):
        if not len(open_):
            break
        guides = span(Linkage._trusted(pivots[open_]), point[open_])
        error, by = _linearised(guides, in_place(guides, request.stroke, request.radius), request)
        step, _ = minimax_step(error, by * free, np.zeros((*error.shape, 0)), DAMPINGS)
        which = np.tile(np.arange(len(open_)), len(step))
        moves = np.nan_to_num(step.reshape(len(which), -1)) * free
        moved, at, valid = displaced(guides.linkage[which], guides.point[which], moves)
        which = which[valid]
        tried = span(moved, at)
        measured = in_place(tried, request.stroke, request.radius)
        ok = good(tried, measured) | ~kept[open_][which]
        value = np.where(ok, measured.fit.deviation, np.inf)
        value = np.where(np.isnan(value), np.inf, value)
        first = least(value, which)
        first = first[value[first] < deviation[open_[which[first]]]]
        gained = open_[which[first]]
        enough = value[first] < (1 - GAIN) * deviation[gained]
        pivots[gained], point[gained], deviation[gained] = moved.pivots[first], at[first], value[first]
        kept[gained] |= good(tried[first], measured[first])
        open_ = gained[enough]
    return Linkage._trusted(pivots), point


def _linearised(guides: Span, traced: Traced, request: Request) -> tuple[Array, Array]:
    """Return distances from the nominal (m, n) and their derivatives (m, n, 10)."""
    nodes = grid(NODES).nodes
    u, v = guides.path.window(traced.low, traced.high, nodes)
    z = guides.point + (u + 1j * v) * guides.tangent
    t = 0.5 * (traced.high + traced.low) + 0.5 * (traced.high - traced.low) * nodes[:, None]
    heading = along(z, request.stroke, request.radius)[1]
    return distance(z, request.stroke, request.radius), across_nominal(guides.motion, guides.point, t, heading)
