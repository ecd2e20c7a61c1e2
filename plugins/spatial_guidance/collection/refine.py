"""Refine specimens by the Levenberg-Marquardt method on their finite motion.

Points of the body move together with their guides, so that the mechanism stays assembled and
coincident points stay together.  The guided point and the end of the first driver's range move too.
A step is accepted only if the mechanism keeps its classification, and nearly its size and the range
of its drive.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from catalogue.plugin import Array, Goal, Measured, PathRequest

from .classification import classify
from .measures import Motion, fitted, measure, run
from .minimum_zone import Fit
from .plain_data import alike, strokes

Parameters = Mapping[str, Any]


class Descent(NamedTuple):
    """Steps of the refinement, and limits of a refined mechanism."""

    steps: int = 8  #: largest number of steps
    little: float = 0.03  #: relative reduction of the deviation below which a step is the last one
    difference: float = 1e-6  #: step of finite differences [sizes of the body]
    farthest: float = 0.3  #: longest displacement of a step [sizes of the body]
    size: float = 1.05  #: largest size over the first
    condition: float = 2.0  #: largest condition number over the first
    range: float = 0.9  #: least range of the drive over the first
    exact: float = 1e-9  #: deviation below which refinement gains nothing [strokes]


DESCENT = Descent()
#: Dampings tried in each step.
DAMPINGS = 10.0 ** np.arange(-8, 1)


def refine(parameters: Sequence[Parameters], request: PathRequest, _goal: Goal) -> list[Parameters]:
    """Reduce the deviation of mechanisms from the request; keep those for which that fails.

    Bounds are not regarded: answers are checked afterwards.
    """
    out = list(parameters)
    for index in alike(parameters):
        for i, p in zip(index, _refine([parameters[i] for i in index], request), strict=True):
            out[i] = p
    return out


def _refine(given: list[Parameters], request: PathRequest) -> list[Parameters]:
    """Refine mechanisms of one class with the same drivers together."""
    first = measure(given, request)
    now, best, tags = list(given), list(first), [classify(p) for p in given]
    motion = run(strokes(given))
    # Points move together with their guides, so that the pose at the start of the stroke is
    # unchanged.
    turns, sizes = motion.rotation[:, 0], strokes(given).mechanisms.diameter
    open_ = [i for i, m in enumerate(first) if not m.reason and m.deviation > DESCENT.exact * request.stroke]
    for _ in range(DESCENT.steps):
        if not open_:
            break
        tried = _measure_steps([(now[i], turns[i], float(sizes[i])) for i in open_], request)
        going = []
        for i, found in zip(open_, tried, strict=True):
            better = [(m, p) for m, p in found if _is_acceptable(m, first[i]) and m.deviation < best[i].deviation]
            better = [(m, p) for m, p in better if _same(tags[i], classify(p))]
            if better:
                before = best[i].deviation
                best[i], now[i] = min(better, key=lambda pair: pair[0].deviation)
                if DESCENT.exact * request.stroke < best[i].deviation <= (1 - DESCENT.little) * before:
                    going.append(i)
        open_ = going
    return now


def _is_acceptable(m: Measured, first: Measured) -> bool:
    """Tell whether a mechanism nearly keeps size, conditioning and range of its drive."""
    if m.reason:
        return False
    now, then = m.metrics, first.metrics
    return (
        now["size"] <= DESCENT.size * then["size"]
        and now["condition"] <= DESCENT.condition * then["condition"]
        and now["range"] >= DESCENT.range * then["range"]
    )


def _same(one: Any, other: Any) -> bool:
    return one.series == other.series and set(one.special) <= set(other.special)


def _measure_steps(
    given: list[tuple[Parameters, Array, float]], request: PathRequest
) -> list[list[tuple[Measured, Parameters]]]:
    """Measure the mechanisms that result from steps of each damping.

    `given` are mechanisms, each with its turn and size; the result has a list of pairs for each.
    """
    varied, counts = [], []
    for p, turn, size in given:
        count = 3 * len(_coincident_points(p)) + 4
        varied += [
            _moved(p, v, turn, size) for v in np.concatenate([np.zeros((1, count)), DESCENT.difference * np.eye(count)])
        ]
        counts.append(count + 1)
    motion = run(strokes(varied))
    near: list[list[Parameters]] = []
    for one, end, (p, turn, size) in zip(counts, np.cumsum(counts), given, strict=True):
        own = motion[end - one : end]
        steps = _steps(own, request) if (own.reason == "").all() else []
        near.append([_moved(p, step, turn, size) for step in steps if np.abs(step).max() < DESCENT.farthest])
    every = [p for some in near for p in some]
    measured = iter(measure(every, request) if every else [])
    return [[(next(measured), p) for p in some] for some in near]


def _steps(motion: Motion, request: PathRequest) -> list[Array]:
    """Compute the step of each damping, by finite differences of the motion."""
    chord = np.sqrt(((motion.path[:, -1] - motion.path[:, 0]) ** 2).sum(1))
    off = _distances(
        motion.path, fitted(motion, request.kind, None if request.sweep is None else chord / request.sweep)
    )
    u, s, v = np.linalg.svd(((off[1:] - off[0]) / DESCENT.difference).T, full_matrices=False)
    return [-(v.T * (s / (s * s + (d * s[0]) ** 2))) @ (u.T @ off[0]) for d in DAMPINGS]


def _distances(path: Array, fit: Fit) -> Array:
    """Compute the distances of paths from their lines or circles, shape (n, 2 f) [strokes]."""
    local = (path - fit.start[:, None]) @ np.swapaxes(fit.axes, 1, 2)
    side = local[..., 1]
    if np.isfinite(fit.radius).all():
        half, radius = 0.5 * fit.stroke[:, None], fit.radius[:, None]
        side = np.hypot(local[..., 0] - half, side + np.sqrt(np.maximum(radius**2 - half**2, 0))) - radius
    return np.asarray(np.concatenate([side, local[..., 2]], axis=1) / fit.stroke[:, None])


def _coincident_points(p: Parameters) -> list[list[int]]:
    """Group the points of the body that coincide."""
    found: dict[tuple[float, ...], list[int]] = {}
    for i, point in enumerate(p["body"]):
        found.setdefault(tuple(point), []).append(i)
    return list(found.values())


def _moved(p: Parameters, v: Array, turn: Array, size: float) -> Parameters:
    """Displace points with their guides, the guided point and the end of the drive."""
    groups = _coincident_points(p)
    body, guides = np.array(p["body"]), [dict(g) for g in p["guides"]]
    for points, d in zip(groups, size * v[:-4].reshape(-1, 3), strict=True):
        for i in points:
            body[i] = body[i] + turn.T @ d
            guides[i]["origin"] = (np.array(guides[i]["origin"]) + d).tolist()
    path = [list(one) for one in p["path"]]
    path[1][0] += v[-1] * (path[1][0] - path[0][0])
    point = (np.array(p["point"]) + size * v[-4:-1]).tolist()
    return {**p, "body": body.tolist(), "guides": guides, "path": path, "point": point}
