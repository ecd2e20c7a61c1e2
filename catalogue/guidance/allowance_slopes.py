"""Derivatives of allowances by pivots, deviations and tolerances, for refinement."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..kinematics.motion import Motion, motion
from ..kinematics.types import Floats
from .allowance import ALLOWANCE, Reach, References, Response, Zone, intervals_of, response, scattered
from .circuit_curve import CIRCUIT, CircuitCurve, CircuitMotion
from .coupler_curve import CouplerCurve
from .minimum_zone import grid
from .sensitivity import COUNT, displaced, pose_jacobian, ways
from .trace import Traced
from .wide_arc import along_circuits

#: Step of finite differences by the pivots, and by the parameter as a fraction of its window
#: [strokes].
PIVOT_STEP = 1e-5


class Slopes(NamedTuple):
    """Derivatives of allowances, of shape (n,) except the first; 0 where unknown."""

    by_pivots: Floats  #: derivatives by pivots and guided point through the change of the sensitivities, (n, 10)
    by_deviation: Floats
    by_tolerance: Floats


def slopes(
    asked: float | Floats, guides: CouplerCurve | CircuitCurve, traced: Traced, zone: Zone, *, rough: bool = True
) -> Slopes:
    """Return the derivatives of the allowances for tolerances, () or (n,) [length].

    Sensitivities are differentiated by finite differences, at fixed places along the nominals.
    """
    with np.errstate(all="ignore"):
        intervals = intervals_of(traced, zone, rough)
        here = response(guides, traced, zone, intervals)
        at = np.maximum(asked, here.deviation * (1 + ALLOWANCE.least_left))
        found = References.of(here, zone.free).strongest(at, ALLOWANCE.rough_references)
        good = np.isfinite(found.across).all((1, 2)) & np.isfinite(here.deviation)
        found = replace(found, across=np.where(good[:, None, None], found.across, 0.0))
        reach = Reach.of(found, at)
        scatter = reach.scatter()
        by_rate, by_deviation, by_tolerance = _influence(here, found, reach, at, reach.shares(scatter))
        by_rate = np.swapaxes(here.carried, 1, 2) @ by_rate  # from the stations to the nodes
        changes = _second_differences(guides, traced, grid(intervals).nodes, np.moveaxis(here.moved, 1, 0))
        changes = np.where(scattered(guides.linkage), changes, 0.0)
        left = (asked - here.deviation) / (at - here.deviation)
        by_pivots = (scatter * left)[:, None] * np.einsum("kjni,nji->nk", changes, by_rate)
    one, two = (np.where(good, np.nan_to_num(scatter * part), 0.0) for part in (by_deviation, by_tolerance))
    return Slopes(np.where(good[:, None] & np.isfinite(by_pivots), by_pivots, 0.0), one, two)


def _influence(
    here: Response, found: References, reach: Reach, asked: Floats, shares: Floats
) -> tuple[Floats, Floats, Floats]:
    """Differentiate the logarithm of the allowance.

    Returns
    -------
    ndarray, shape (n, m, 10)
        Derivatives by the sensitivities at the stations.
    ndarray, ndarray, shape (n,) each
        Derivatives by the deviation, if all distances scale with it, and by the tolerance.
    """
    row = np.arange(len(asked))[:, None]
    weights = np.zeros((*reach.reference.shape, here.error.shape[1]))
    np.put_along_axis(weights, found.stations[row, reach.reference], found.weights[row, reach.reference], axis=2)
    moved = ((reach.direction @ np.swapaxes(here.across, 1, 2)) * weights).sum(-1)
    by_rate = -np.swapaxes(weights, 1, 2) @ (np.nan_to_num(shares / moved)[..., None] * reach.direction)
    per_margin = np.nan_to_num(shares / reach.margin)
    used = np.nan_to_num((asked[:, None] - reach.margin) / here.deviation[:, None])
    return by_rate, -(per_margin * used).sum(1), per_margin.sum(1)


def _second_differences(guides: CouplerCurve | CircuitCurve, traced: Traced, nodes: Floats, here: Floats) -> Floats:
    """Difference `PoseJacobian.across` at nodes by each coordinate, shape (10, m, n, 10).

    The stations and the directions of the nominals are kept. NaN where a displaced linkage is
    invalid.
    """
    n, t, tangent = len(guides), traced.parameters(nodes), ways(guides, traced, nodes)
    each = np.tile(np.arange(n), COUNT)
    linkage, point, good = displaced(
        guides.linkage[each], guides.point[each], np.repeat(PIVOT_STEP * np.eye(COUNT), n, axis=0)
    )
    each = each[good]
    pole = None if guides.pole is None else guides.pole[each]
    charts = guides.motion.chart[each]
    if (charts == CIRCUIT).any():
        moving: Motion | CircuitMotion = along_circuits(linkage, point).motion
    else:
        moving = motion(linkage, charts, point, pole=pole)
    place, window = guides.motion.pose(t).point(guides.point), PIVOT_STEP * (t[-1] - t[0])
    speed = ((guides.motion.pose(t + window).point(guides.point) - place) * tangent.conj()).real / window
    t, tangent, place, speed = t[:, each], tangent[:, each], place[:, each], speed[:, each]
    t = t - ((moving.pose(t).point(point) - place) * tangent.conj()).real / speed
    changed = np.full((len(nodes), COUNT * n, COUNT), np.nan)
    changed[:, good] = pose_jacobian(moving, point, t, tangent).across
    by_step = changed.reshape(len(nodes), COUNT, n, COUNT).swapaxes(0, 1)
    return np.asarray((by_step - here) / PIVOT_STEP)
