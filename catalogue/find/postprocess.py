"""What is made of candidates that were found: cognates, and ones of round lengths."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..candidates.batch import CandidateBatch, Origin, measured, place_on_path, unscaled
from ..guidance.coupler_curve import CouplerCurve, coupler_curve
from ..guidance.placement import at_stroke
from ..guidance.trace import Traced
from ..kinematics.batch import join, take
from ..kinematics.cognates import cognates
from ..kinematics.link_lengths import rounded
from ..problem.problem import Problem
from ..refine.sqp import Refinement


def with_cognates(problem: Problem, found: CandidateBatch, *, refine: bool) -> CandidateBatch:
    """Return candidates followed by the cognates of those that follow the path, four-bars and slider-cranks: these lead
    the same path with other pivots, and are refined, if wanted, where they break a constraint."""
    followed = found[np.flatnonzero(found.deviation <= problem.deviation)]
    linkage, which, number = cognates(followed.linkage, followed.point)
    if not len(linkage):
        return found
    guides = coupler_curve(linkage, followed.point[which], pole=followed.pole[which])
    origin = replace(take(followed.origin, which), cognate=number, family=linkage.family.astype(object))
    traced = at_stroke(guides, 1.0, circle=problem.curved, nodes=16, extend=False)
    others = _laid(problem, origin, guides, traced)
    return join(found, Refinement.of(problem, others).run(3).best if refine else others)


def with_round_lengths(problem: Problem, found: CandidateBatch, step: float) -> CandidateBatch:
    """Return candidates whose lengths are multiples of a step [strokes]; those that can be made so."""
    linkage, point, made = rounded(found.linkage, found.point, step)
    guides = coupler_curve(linkage, point, pole=found.pole[made])
    traced = at_stroke(guides, 1.0, circle=problem.curved, nodes=16, extend=False)
    return _laid(problem, take(found.origin, made), guides, unscaled(traced))


def _laid(problem: Problem, origin: Origin, guides: CouplerCurve, traced: Traced) -> CandidateBatch:
    linkage, point, pole = place_on_path(problem, guides, traced)
    return measured(problem, origin, linkage, point, pole, -np.abs(traced.fit.curvature))
