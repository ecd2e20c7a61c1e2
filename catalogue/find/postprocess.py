"""Derive further candidates: cognates, and linkages of round lengths."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..candidates.batch import CandidateBatch, Origin, keep_lengths, measured, place_on_path, slides_on_path
from ..candidates.feasibility import best_orientation, feasibility
from ..guidance.circuit_curve import CircuitCurve, fitted, on_path
from ..guidance.coupler_curve import CouplerCurve, coupler_curve
from ..guidance.placement import at_stroke
from ..guidance.stretches import straightest
from ..guidance.trace import Traced
from ..kinematics.batch import join, take
from ..kinematics.circuits import circuits
from ..kinematics.cognates import cognates
from ..kinematics.link_lengths import rounded
from ..kinematics.linkage import Linkage
from ..kinematics.motion import CHANGE, conditioning
from ..kinematics.types import Complexes, Indices
from ..problem.problem import Problem
from ..refine.sqp import Refinement

#: Number of stretches to try per rounded linkage: the second best may meet the constraints.
STRETCHES = 2


def with_cognates(problem: Problem, found: CandidateBatch, *, refine: bool) -> CandidateBatch:
    """Append the cognates of four-bars and slider-cranks.

    Optionally refine those that violate a constraint.
    """
    followed = found[np.flatnonzero(found.deviation <= problem.deviation)]
    linkage, which, number = cognates(followed.linkage, followed.point)
    if not len(linkage):
        return found
    guides = coupler_curve(linkage, followed.point[which], pole=followed.pole[which])
    origin = replace(take(followed.origin, which), cognate=number, family=linkage.family.astype(object))
    traced = at_stroke(guides, 1.0, circle=problem.curved, nodes=16, extend=False)
    others = _place(problem, origin, guides, traced)
    return join(found, Refinement.of(problem, others).run(3).best if refine else others)


def with_round_lengths(problem: Problem, found: CandidateBatch, step: float) -> CandidateBatch:
    """Round the lengths of candidates to multiples of a step [strokes], and place them again.

    Rounding moves the straightest stretch of a path. Each rounded linkage is placed where it was
    and on the best stretches of its circuit; the feasible placement of least deviation is kept.
    Linkages without round lengths nearby are left out.
    """
    linkage, point, made = rounded(found.linkage, found.point, step)
    origin, pole = take(found.origin, made), found.pole[made]
    row = np.arange(len(point))
    placed = _place_unscaled(problem, origin, coupler_curve(linkage, point, pole=pole))
    # at a change point only this position tells the branch
    movable = np.flatnonzero(conditioning(linkage).max(0) >= CHANGE)
    if len(movable) and not problem.constraints.returns:
        curve, of = _best_stretches(problem, linkage[movable], point[movable])
        which = movable[of]
        guides = coupler_curve(curve.linkage, curve.point)
        placed = join(placed, _place_unscaled(problem, take(origin, which), guides))
        row = np.concatenate([row, which])
    order = np.lexsort((placed.deviation, ~feasibility(problem, placed).all, row))
    first = np.diff(row[order], prepend=-1) > 0
    return placed[order[first]]


def _best_stretches(problem: Problem, linkage: Linkage, point: Complexes) -> tuple[CircuitCurve, Indices]:
    """Return the straightest stretches of unit stroke on the given circuits.

    Returns
    -------
    CircuitCurve, ndarray of int
        k guides in mid-stroke; the numbers, (k,), of the linkages to which they belong.
    """
    found = circuits(linkage)
    found = found[np.flatnonzero(np.isfinite(found.phase))]
    bend = problem.fixed_curvature
    radius = None if bend is None else 1 / abs(bend)
    at, circle = point[found.of], problem.curved
    best = straightest(found, at, np.ones(len(found)), circle=circle, radius=radius, count=STRETCHES)
    some, z = found[best.circuit], at[best.circuit]
    fit = fitted(some, z, best.low, best.high, circle=circle, radius=radius)
    good = np.flatnonzero(np.isfinite(fit.deviation))
    curve, _ = on_path(some[good], z[good], best.low[good], best.high[good], fit[good])
    return curve, some.of[good]


def _place_unscaled(problem: Problem, origin: Origin, guides: CouplerCurve) -> CandidateBatch:
    """Place guides of fixed lengths along the path, in the best orientation for their pivots."""
    traced = at_stroke(guides, 1.0, circle=problem.curved, nodes=16, extend=False)
    return _place(problem, origin, guides, keep_lengths(traced))


def _place(problem: Problem, origin: Origin, guides: CouplerCurve, traced: Traced) -> CandidateBatch:
    """Place traced guides along the path, in the best orientation for their pivots."""
    placed = best_orientation(problem, *place_on_path(problem, guides, traced), slides_on_path(problem, guides, traced))
    return measured(problem, origin, *placed)
