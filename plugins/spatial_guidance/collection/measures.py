"""Measures of a guided body over the stroke of a point, on its finite motion.

The motion is followed at Chebyshev points of the drivers' path.  Between these nodes the
interpolating polynomial is evaluated at four times as many points, which gives the largest distance
with a relative error of about 1e-3.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from catalogue.plugin import LENGTH, Array, Measured, Metric, PathRequest, grid
from catalogue.spatial import follow, matrix

from .minimum_zone import Fit, circle, line, unit
from .plain_data import Strokes, alike, plain, strokes


class Resolution(NamedTuple):
    """Grid of a stroke, and its permitted errors."""

    #: Intervals between the nodes; the interpolant is evaluated at four times as many points.
    nodes: int = 48
    missed: float = 1e-3  #: permitted error of the interpolant [deviations]
    rounding: float = 1e-11  #: permitted error by rounding [strokes]


RESOLUTION = Resolution()


METRICS = {
    "range": Metric(
        "range of the first driving coordinate over the stroke; others go proportionally", "rad", more=True
    ),
    "condition": Metric("worst condition number of the position equations over the stroke", "1"),
    "rotation": Metric("largest angle between two orientations of the body over the stroke", "deg"),
    "uniformity": Metric("least over largest speed of the point along its path, drivers steady", "1", more=True),
    "size": Metric("diameter of all that the guided points of the body pass over the stroke", LENGTH),
    "arm": Metric("distance of the guided point from the nearest point that is on a guide", LENGTH),
    "sweep": Metric("stroke over radius; 0 for a line", "1"),
}


@dataclass(frozen=True, eq=False)
class Motion:
    """Motion along strokes: poses at the nodes, the path at the fine points.

    Attributes
    ----------
    reason : ndarray of str, shape (n,)
        Reason why the end was not reached; else empty.
    rotation : ndarray, shape (n, s, 3, 3)
    points : ndarray, shape (n, s, p, 3)
    condition : ndarray, shape (n,)
    path : ndarray, shape (n, f, 3)
    missed : ndarray, shape (n,)
        Bound on the error of the interpolated path.
    """

    reason: Array
    rotation: Array
    points: Array
    condition: Array
    path: Array
    missed: Array

    def __getitem__(self, index: Any) -> Motion:
        return Motion(*(v[index] for v in vars(self).values()))


def run(given: Strokes) -> Motion:
    """Follow the strokes from end to end; lengths are in diameters of the body."""
    n, at, size = len(given), grid(RESOLUTION.nodes), given.mechanisms.diameter
    given = given.moved(1 / size, np.broadcast_to(np.eye(3), (n, 3, 3)), np.zeros((n, 3)))
    share = 0.5 * (1 + at.nodes)[:, None]
    drivers = given.path[:, :1] + share * (given.path[:, 1:] - given.path[:, :1])
    moved = follow(given.mechanisms, drivers, given.start)
    s = moved.positions
    turn = np.moveaxis(matrix(s.quaternion.T), 2, 0).reshape(n, -1, 3, 3)
    path = s.translation.reshape(n, -1, 3) + np.einsum("nsij,nj->nsi", turn, given.point)
    fine = np.einsum("fs,nsi->nfi", at.fine, path)
    ends = np.einsum("fs,nsi->nfi", at.coefficients[-2:], path - path.mean(1, keepdims=True))
    long = size[:, None, None, None]
    with np.errstate(all="ignore"):
        worst = np.nanmax(np.where(s.success, s.condition, np.nan).reshape(n, -1), axis=1, initial=0)
    return Motion(
        moved.reason,
        turn,
        long * s.points.reshape(n, RESOLUTION.nodes + 1, -1, 3),
        worst,
        long[..., 0] * fine,
        size * np.abs(ends).sum(1).max(1),
    )


def fitted(motion: Motion, kind: str, radius: Array | None = None) -> Fit:
    """Fit the best lines or circles; the second axis points away from the middle of the body."""
    if kind == "circle":
        return circle(motion.path, radius)
    middle = motion.points[:, motion.points.shape[1] // 2].mean(1)
    return line(motion.path, 2 * motion.path.mean(1) - middle)


def known(motion: Motion, fit: Fit) -> Array:
    """Return a mask (n,) of paths that the nodes resolve."""
    return np.asarray(motion.missed <= RESOLUTION.missed * fit.deviation + RESOLUTION.rounding * fit.stroke)


def numbers(given: Strokes, motion: Motion, fit: Fit) -> dict[str, Array]:
    """Return all metrics, shape (n,) each; lengths are in the unit of the mechanism."""
    turn, every = motion.rotation[:, ::4], motion.points[:, ::4]
    cosine = 0.5 * (np.einsum("naij,nbij->nab", turn, turn) - 1)
    swept = np.concatenate([every.reshape(len(every), -1, 3), motion.path[:, ::16]], axis=1)
    far = np.stack([_diameter(cloud) for cloud in swept])
    speed = _speeds(motion.path, fit)
    arm = np.sqrt(((given.mechanisms.body - given.point[:, None]) ** 2).sum(2)).min(1)
    with np.errstate(all="ignore"):
        return {
            "range": np.abs(given.path[:, 1, 0] - given.path[:, 0, 0]),
            "condition": motion.condition,
            "rotation": np.degrees(np.arccos(np.clip(cosine.min((1, 2)), -1, 1))),
            "uniformity": speed.min(1) / speed.max(1),
            "size": far,
            "arm": arm,
            "sweep": np.where(np.isfinite(fit.radius), fit.stroke / fit.radius, 0.0),
        }


def _diameter(cloud: Array) -> float:
    square = (cloud**2).sum(1)
    return float(np.sqrt(max((square[:, None] + square - 2 * cloud @ cloud.T).max(), 0.0)))


def _speeds(path: Array, fit: Fit) -> Array:
    """Compute speeds along the nominal at the fine points (n, f), at a steady drive.

    The unit is arbitrary.
    """
    time = -np.cos(np.linspace(0, np.pi, path.shape[1]))
    velocity = np.gradient(path, time, axis=1, edge_order=2)
    along, side, third = (fit.axes[:, i, None] for i in range(3))
    if not np.isfinite(fit.radius).all():
        return np.asarray((velocity * along).sum(2))
    half = 0.5 * fit.stroke
    depth = np.sqrt(np.maximum(fit.radius**2 - half**2, 0))
    centre = fit.start[:, None] + half[:, None, None] * along - depth[:, None, None] * side
    return np.asarray((velocity * unit(np.cross(path - centre, third))).sum(2))


def measure(parameters: Sequence[Mapping[str, Any]], request: PathRequest) -> list[Measured]:
    """Place each mechanism along the requested path and measure it there."""
    out: list[Measured | None] = [None] * len(parameters)
    for index in alike(parameters):
        given = strokes([parameters[j] for j in index])
        for j, measured in zip(index, _place_and_measure(given, request), strict=True):
            out[j] = measured
    return [m for m in out if m is not None]


def _place_and_measure(given: Strokes, request: PathRequest) -> list[Measured]:
    """Place mechanisms by a first run, and measure them in a second."""
    wanted = request.sweep
    first = run(given)
    sound = np.flatnonzero(first.reason == "")
    out = [Measured.no(f"the motion ends before the stroke does ({reason})") for reason in first.reason]
    if not len(sound):
        return out
    given, first = given[sound], first[sound]
    chord = np.sqrt(((first.path[:, -1] - first.path[:, 0]) ** 2).sum(1))
    fit = fitted(first, request.kind, None if wanted is None else chord / wanted)
    placed = given.moved(request.stroke / fit.stroke, fit.axes, fit.start)
    second = run(placed)
    radius = None if wanted is None else np.full(len(placed), request.stroke / wanted)
    fit = fitted(second, request.kind, radius)
    values, data, resolved = numbers(placed, second, fit), plain(placed), known(second, fit)
    for k, j in enumerate(sound):
        deviation = float(fit.deviation[k] + second.missed[k])
        if second.reason[k]:
            out[j] = Measured.no(f"the motion ends before the stroke does ({second.reason[k]})")
        elif not np.isfinite(deviation):
            out[j] = Measured.no("the path is no arc")
        elif not resolved[k]:
            out[j] = Measured.no("the path is not resolved")
        elif values["uniformity"][k] <= 0:
            out[j] = Measured.no("the point does not run one way")
        else:
            arc = float(fit.radius[k]) if request.kind == "circle" else None
            numbers_ = {name: float(v[k]) for name, v in values.items()}
            out[j] = Measured(deviation, arc, numbers_, data[k])
    return out
