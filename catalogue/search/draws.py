"""Common parts of synthesised starts: suitable families, random fixed pivots and curvatures."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..guidance.stations import Stationed
from ..kinematics.linkage import Linkage
from ..kinematics.types import Complexes, Floats, Indices
from ..problem.problem import Problem
from ..problem.region import Region

#: Longest link or arm of a start [strokes].
MAX_LINK = 12.0
#: Shortest link or arm of a start [strokes].
MIN_LINK = 0.06
#: Median of the radii of arcs of any radius, which are log-normal [strokes].
MEDIAN_RADIUS = 1.0
#: Standard deviation of the logarithms of these radii.
RADIUS_SPREAD = 0.7
#: Least of these radii [strokes].
MIN_RADIUS = 0.55
#: Median distance of fixed pivots from mid-stroke, which is log-normal without a region [strokes].
MEDIAN_DISTANCE = 1.0
#: Standard deviation of the logarithm of this distance.
DISTANCE_SPREAD = 0.6


def allowed(problem: Problem, made: Mapping[str, bool]) -> list[str]:
    """Return the families that suit a problem; `made` maps each to whether it has pins only."""
    wanted = problem.constraints
    if wanted.series or wanted.configurations or wanted.order or wanted.slots or wanted.returns:
        return []
    here = [name for name in made if not wanted.families or name in wanted.families]
    return [name for name in here if made[name] or not wanted.pins_only]


def curvatures(problem: Problem, count: int, random: np.random.Generator) -> Floats:
    """Draw the curvatures of the paths of starts [1/stroke]; they vary for arcs of any radius."""
    if problem.curvature is not None:
        return np.full(count, float(problem.curvature))
    return np.asarray(
        -1 / np.clip(np.exp(random.normal(np.log(MEDIAN_RADIUS), RADIUS_SPREAD, count)), MIN_RADIUS, MAX_LINK)
    )


def summit(curvature: Floats) -> Complexes:
    """Return the guided points in mid-stroke for paths of curvatures (n,) [1/stroke]."""
    return np.asarray(0.5 - 0.25j * curvature / (1 + np.sqrt(1 - 0.25 * curvature**2)), complex)


def fixed_pivots(problem: Problem, point: Complexes, random: np.random.Generator) -> Complexes:
    """Draw a fixed pivot for each guided point, in its region or around the path, (n,)."""
    wanted, count = problem.constraints, len(point)
    region = region_of(problem)
    most = wanted.max_size or MAX_LINK
    away = np.minimum(np.exp(random.normal(np.log(MEDIAN_DISTANCE), DISTANCE_SPREAD, count)), 0.8 * most)
    about = point + away * np.exp(2j * np.pi * random.random(count))
    if region is None:
        return np.asarray(about)
    x0, y0, x1, y1 = np.clip(region.box, -MAX_LINK, MAX_LINK)
    return np.asarray(random.uniform(x0, x1, count) + 1j * random.uniform(y0, y1, count))


def likeliest(linkage: Linkage, point: Complexes, curvature: Floats, count: int) -> Indices:
    """Select the linkages with least errors over the stroke, `count` at most."""
    with np.errstate(all="ignore"):
        there = Stationed.followed(linkage, point, curvature)
        away = np.where(there.reached, there.deviation, np.inf)
    order = np.argsort(away, kind="stable")[:count]
    return order[np.isfinite(away[order])]


def region_of(problem: Problem) -> Region | None:
    """Return the region of the fixed pivots; None without one."""
    wanted = problem.constraints
    return next((r for r in (wanted.fixed_pivots_in, wanted.pivots_in, wanted.swept_in) if r is not None), None)
