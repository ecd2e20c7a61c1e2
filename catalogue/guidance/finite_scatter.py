"""Allowances along arcs of any radius, on the finite motion of displaced machines.

The best-fitting circle of free radius moves far where its arc is shallow, and not in proportion to
the scatter. By the linear theory of `allowance` a path leaves its tolerance A at a displacement R u
of the coordinates, along each direction u, and its deviation grows there by m / R per unit. On the
finite motion a machine displaced by R u has the deviation A + d instead of A, and so leaves the
tolerance at R / (1 + d / m).  Corrections are weighted means over the directions: of -ln(1 + d / m)
for the logarithm of the allowance, with their shares in the tail of the scatter as weights; of d
for the deviation kept at a given scatter, with these shares over m as weights.  Machines are
displaced in the directions of the largest shares.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..kinematics.types import Complexes, Floats
from .allowance import ALLOWANCE, Reach, Zone, expected_deviation, reaches, responses, shortest
from .circuit_curve import CircuitCurve
from .coupler_curve import CouplerCurve, coupler_curve
from .minimum_zone import Fit, concentric, seen
from .sensitivity import displaced
from .trace import Traced, over

#: Free coordinates of an arc of any radius; lines and arcs of a given radius keep 95 +- 1 per cent
#: without displaced machines, see tests/benchmarks/allowance.py.
FREE = 3


class FiniteScatter(NamedTuple):
    """Displacements of machines along arcs of free radius."""

    #: Number of directions in which machines are displaced, of 120; with half as many the error of
    #: the probability is 2 %.
    directions: int = 32
    nodes: int = 32  #: intervals between the Chebyshev points of a path
    rounds: int = 6  #: number of Newton steps for the ends of a window
    step: float = 1e-6  #: step of the difference quotient of a speed [windows]
    reached: float = 1e-7  #: error of an end at which the iteration stops [strokes]
    #: Ratio of finite to linear reach along a direction in which the displaced machine does not
    #: move.
    broken: float = 0.5
    left: float = 0.02  #: least margin of the deviation below the tolerance [tolerances]


SCATTER = FiniteScatter()


class Remainder(NamedTuple):
    """Corrections of the linear theory by the finite motion of n guides; 0 where not evaluated."""

    log_allowance: Floats
    deviation: Floats  #: correction of the deviation [length]


def finite_allowances(asked: float | Floats, guides: CouplerCurve | CircuitCurve, traced: Traced, zone: Zone) -> Floats:
    """Compute the allowances of traced guides for an answer, shape (n,) [length].

    They are at most `ALLOWANCE.largest` of the shortest link.

    Parameters
    ----------
    asked : float or ndarray, shape (n,)
        Tolerances [length].
    """
    with np.errstate(all="ignore"):
        here = responses(guides, traced, zone, rough=False)
        good = np.flatnonzero(np.isfinite(here.deviation))
        deviation, asked = here.deviation[good], np.broadcast_to(asked, here.deviation.shape)[good]
        at = np.maximum(asked, deviation * (1 + ALLOWANCE.least_left))
        reach = reaches(here[good], zone.free, at)
        linear = reach.scatter() * (asked - deviation) / (at - deviation)
        more = remainder(at, guides[good], traced[good], zone, reach)
    out = np.full(len(guides), np.nan)
    out[good] = linear * np.exp(more.log_allowance)
    return np.asarray(np.minimum(out, ALLOWANCE.largest * shortest(guides.linkage)))


def finite_expected(scatter: float, guides: CouplerCurve | CircuitCurve, traced: Traced, zone: Zone) -> Floats:
    """Compute the deviations that guides keep with `PROBABILITY`, for an answer, (n,) [length].

    Parameters
    ----------
    scatter : float
        Standard deviation of every coordinate of the pivots and of the guided point [length].
    """
    linear = expected_deviation(scatter, guides, traced, zone)
    good = np.flatnonzero(np.isfinite(linear))
    if not scatter or not len(good):
        return linear
    some, at = guides[good], traced[good]
    with np.errstate(all="ignore"):
        reach = reaches(responses(some, at, zone, rough=False), zone.free, linear[good])
        linear[good] += remainder(linear[good], some, at, zone, reach).deviation
    return linear


def remainder(
    tolerance: Floats, guides: CouplerCurve | CircuitCurve, traced: Traced, zone: Zone, reach: Reach
) -> Remainder:
    """Compute the corrections of allowances by the finite motion, (n,).

    `reach` holds the distances of the paths from their tolerances by the linear theory.
    """
    n, deviation = len(guides), traced.fit.deviation.astype(float)
    found = Remainder(np.zeros(n), np.zeros(n))
    if isinstance(guides, CircuitCurve) or zone.free < FREE:
        return found
    with np.errstate(all="ignore"):
        good = np.flatnonzero((deviation < (1 - SCATTER.left) * tolerance) & (guides.motion.branch == 0))
        if not len(good):
            return found
        some, tolerance, reach = guides[good], tolerance[good], reach[good]
        share = reach.shares(reach.scatter())
        which = np.argsort(-share, axis=1, kind="stable")[:, : SCATTER.directions]
        row = np.arange(len(good))[:, None]
        share, margin = share[row, which], reach.margin[row, which]
        steps = reach.direction[row, which] / reach.nearness[row, which][..., None]
        there = _deviations(some, traced[good], zone, steps.reshape(-1, steps.shape[-1])).reshape(share.shape)
        more = (there - tolerance[:, None]) / margin
        lasts = np.where(np.isfinite(more), 1 / (1 + np.maximum(more, SCATTER.broken - 1)), SCATTER.broken)
        found.log_allowance[good] = (share * np.log(lasts)).sum(1) / share.sum(1)
        weight = share / margin
        found.deviation[good] = (weight * (1 / lasts - 1) * margin).sum(1) / weight.sum(1)
    return Remainder(np.nan_to_num(found.log_allowance), np.nan_to_num(found.deviation))


def _deviations(guides: CouplerCurve, traced: Traced, zone: Zone, steps: Floats) -> Floats:
    """Compute the deviations of machines displaced by steps (k, 10), shape (k,) [length].

    Deviations are measured between fixed positions along the nominals; NaN where a machine does not
    reach these.
    """
    each = np.repeat(np.arange(len(guides)), len(steps) // len(guides))
    linkage, point, valid = displaced(guides.linkage[each], guides.point[each], steps)
    each = each[valid]
    at, fit = traced[each], traced.fit[each]
    moved = coupler_curve(linkage, point, chart=guides.motion.chart[each], least=0.5 * float(fit.stroke.max()))
    low, high = _window(moved, at)
    deviation = over(moved, low, high, circle=zone.circle, nodes=SCATTER.nodes).fit.deviation
    out = np.full(len(steps), np.nan)
    out[valid] = deviation.astype(float)
    return out


def _window(guides: CouplerCurve, traced: Traced) -> tuple[Floats, Floats]:
    """Solve for the parameters at which displaced guides pass the ends of nominals, (n,) each.

    Newton's method starts from the windows of the given guides; NaN where it does not converge.
    """
    fit = traced.fit
    low, high = traced.low.astype(float), traced.high.astype(float)
    ends = np.stack([fit.start, fit.start + fit.stroke * fit.along])
    goal = _positions_along(fit, ends)
    step, found = SCATTER.step * (high - low), []

    def along(t: Floats) -> Floats:
        place: Floats = _positions_along(fit, guides.motion.pose(t[None]).point(guides.point))[0]
        return place

    back = along(low) > along(high)
    for t, wanted in ((low, np.where(back, goal[1], goal[0])), (high, np.where(back, goal[0], goal[1]))):
        missing = np.full(len(t), np.inf)
        for _ in range(SCATTER.rounds):
            now = along(t)
            missing = wanted - now
            t = t + missing * step / (along(t + step) - now)
        found.append(np.where(np.abs(missing) < SCATTER.reached * fit.stroke, t, np.nan))
    return found[0], found[1]


def _positions_along(fit: Fit, z: Complexes) -> Floats:
    """Return the positions of points' feet (m, n) along nominals, from start to end."""
    x, y = seen(z.real, z.imag, fit.start + 0.5 * fit.stroke * fit.along, fit.along)
    place: Floats = concentric(x, y - fit.rise, fit.curvature)[1]
    return place
