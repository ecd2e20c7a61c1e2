"""Answer a request with prescribed pivots: closed-form guides of every series, refined in place.

The design position is placed at many points of the path. There each series solves for linkages that
guide the point, and further linkages are completed numerically. They are traced in place; the
straightest are refined with the prescribed pivots held, then checked and ranked.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..candidates.batch import SHOWN, CandidateBatch, Origin, measure_traced, near_path
from ..candidates.feasibility import feasibility
from ..candidates.select import select_top
from ..curvature_theory.instant import Instant
from ..curvature_theory.leading_error import leading_error
from ..errors import InvalidRequest, PluginError, PluginWarning
from ..guidance.coupler_curve import coupler_curve
from ..guidance.fixed_nominal import Nominal, in_place
from ..kinematics.batch import join, take
from ..kinematics.linkage import Linkage
from ..kinematics.types import Array, Complexes, Indices, Mask
from ..problem.constraints import Constraints
from ..problem.problem import Problem
from ..refine.sqp import Refinement
from ..refine.subproblem import PivotCoordinates
from ..search.starts import SearchReport
from ..series.posed import Posed
from ..series.series import Series
from .find import Selection
from .grid_synthesis import complete_pairs

#: Design positions along the path for prescribed fixed pivots [strokes]: every fiftieth, without
#: the ends.
PLACES = np.linspace(0.04, 0.96, 47)


class PrescribedPivots(NamedTuple):
    """Budget and tolerances of the synthesis for prescribed pivots."""

    pairs: int = 24  #: number of pairs of pivots sampled within their tolerance, per unit of effort
    refined: int = 60  #: number of guides to refine per unit of effort
    #: Rounds of refinement for the deviation, and again for the ranking: starts may be far from an
    #: optimum.
    rounds: int = 12
    #: Largest distance of a pivot from the middle of the path [strokes]: its rounding moves the
    #: path by 1e-12.
    farthest: float = 1e4
    #: largest distance of a pivot over the larger of the stroke and the distance of the prescribed
    #: pivots
    farther: float = 100.0
    rounded: float = 1e-7  #: term of the path over its largest one below which it is rounding
    #: largest error of a closed-form solution: of its circle [radii], of its tangent [rad]
    astray: float = 1e-4
    same: float = 1e-3  #: difference of pivots and points up to which two designs are one [strokes]


LIMITS = PrescribedPivots()

#: Held coordinates of A1, A1*, A2, A2* and the point, which at mid-stroke may move only across the
#: path.
HELD = {
    "fixed": np.array([1, 1, 0, 0, 1, 1, 0, 0, 0, 0], bool),
    "moving": np.array([0, 0, 1, 1, 0, 0, 1, 1, 1, 0], bool),
    "crank": np.array([1, 1, 1, 1, 0, 0, 0, 0, 1, 0], bool),
}


@dataclass(frozen=True)
class Built:
    """Closed-form guides in their design positions, with their origin."""

    linkage: Linkage
    point: Complexes
    series: Array
    exact: Mask

    def __getitem__(self, index: Array) -> Built:
        return take(self, index)


def with_prescribed_pivots(series: Mapping[str, Series], problem: Problem, report: SearchReport) -> Selection | None:
    """Find guides with prescribed pivots, best first; None if there is none."""
    wanted = problem.constraints
    assert wanted.given is not None
    with report.timed("solve in closed form"):
        problems = posed(problem)
        unknown = [code for code in wanted.series if code not in series]
        if unknown:
            raise InvalidRequest(f"no plugin provides series {unknown[0]!r}; there are {', '.join(series)}")
        built = solved([series[code] for code in wanted.series or series], problems, wanted)
        report.solved = len(built.point)
    nominal = _nominal(problem)
    built = built[_is_near(built.linkage, wanted)]
    if not wanted.series and (not wanted.families or "four-bar" in wanted.families):
        with report.timed("complete"):
            more = _complete(problems, nominal)
            report.completed = len(more.point)
            built = join(built, more)
    with report.timed("trace in place"):
        traced = in_place(coupler_curve(built.linkage, built.point), nominal)
        deviation = np.where(np.isnan(traced.fit.deviation), np.inf, traced.fit.deviation)
        order = np.argsort(deviation, kind="stable")[: int(np.isfinite(deviation).sum())]
        report.measured = len(order)
        order = _select_seeds(built, order, LIMITS.refined * max(problem.effort, 1))
    if not len(order):
        return None
    with report.timed("refine"):
        found = _refine(built[order], problem.tightened(), nominal, report)
        report.nearest = found
        good = feasibility(problem, found).all & _is_near(found.linkage, wanted)
        found = found[np.flatnonzero(good)]
    if not len(found):
        return None
    found = found[np.argsort(found.deviation, kind="stable")]
    found = found[distinct(found, len(found))]
    return Selection(*select_top(problem, found))


def posed(problem: Problem) -> Posed:
    """Pose the closed-form problems of a request with prescribed pivots."""
    wanted = problem.constraints
    kind, pivots = wanted.given, np.array([complex(*p) for p in wanted.places])
    assert kind is not None
    far = np.abs(pivots - 0.5) > LIMITS.farthest
    if far.any():
        z = pivots[int(far.argmax())] * problem.scale + problem.shift
        raise InvalidRequest(
            f"the pivot ({z.real:g}, {z.imag:g}) is more than {LIMITS.farthest:g} strokes from the path, where its "
            "rounding decides: move it nearer, or ask for a slider"
        )
    places = PLACES if kind == "fixed" else np.array([0.5])
    pairs = pivots[None]
    if wanted.within:
        drawn = np.random.default_rng(0).random((LIMITS.pairs * max(problem.effort, 1), 4))
        off = np.sqrt(drawn[:, :2]) * np.exp(2j * np.pi * drawn[:, 2:])  # uniform distribution over the disc
        pairs = np.concatenate([pairs, pivots + wanted.within * off])
    nominal = _nominal(problem)
    point, across = nominal.at(np.tile(places, len(pairs)))
    return Posed(kind, np.repeat(pairs, len(places), axis=0), point, np.full(len(point), nominal.centre), across)


def _nominal(problem: Problem) -> Nominal:
    radius, given = problem.path.radius, problem.constraints.given
    if radius is None:
        what = "a crank is" if given == "crank" else f"{given} pivots are"
        raise InvalidRequest(f"give the radius of the arc too, where {what} given")
    return Nominal(1.0, radius)


def solved(series: Iterable[Series], problems: Posed, constraints: Constraints) -> Built:
    """Solve the problems by all series, for the permitted families.

    Keep linkages that guide the point.
    """
    found = [Built(Linkage.trusted(np.zeros((0, 2, 2, 3))), np.zeros(0, complex), np.zeros(0, str), np.zeros(0, bool))]
    exact = (problems.pivots == problems.pivots[:1]).all(1)
    for one in series:
        try:
            answers = one.answers(problems)
        except PluginError as error:
            warnings.warn(one.left_out(error), PluginWarning, stacklevel=2)
            continue
        k = answers.shape[1]
        linkage, good = Linkage.valid(answers.reshape(-1, 2, 2, 3))
        of = np.repeat(np.arange(len(answers)), k)[good]
        chosen = _guides_point(linkage, problems, of)
        if constraints.families:
            chosen &= np.isin(linkage.family, constraints.families)
        linkage, of = linkage[chosen], of[chosen]
        found.append(Built(linkage, problems.point[of], np.full(len(linkage), one.code), exact[of]))
    return join(*found)


def _guides_point(linkage: Linkage, problems: Posed, of: Indices) -> Mask:
    """Tell which linkages guide the point to third order; the others are artefacts of rounding."""
    point, centre, across = problems.point[of], problems.centre[of], problems.axis[of]
    circle = problems.path == "circle"
    law = leading_error(linkage, point, circle=circle, tolerance=LIMITS.rounded)
    with np.errstate(all="ignore"):
        about = np.abs(point + law.normal / law.curvature - centre) / np.abs(point - centre)
        astray = about if circle else np.abs((law.normal * across.conj()).imag)
    return np.asarray((law.order >= 3) & (astray < LIMITS.astray))


def _complete(problems: Posed, nominal: Nominal) -> Built:
    """Complete prescribed pivots numerically, to linkages of the general series."""
    pairs = problems.pivots[:: len(PLACES)] if problems.given == "fixed" else problems.pivots
    pivots, of = complete_pairs(problems.given, pairs, nominal)
    linkage, good = Linkage.valid(pivots)
    exact = (pairs[of[good]] == pairs[0]).all(1)
    point = np.broadcast_to(nominal.at(np.array([0.5]))[0], len(linkage))
    return Built(linkage, point, np.full(len(linkage), "general"), exact)


def _is_near(linkage: Linkage, constraints: Constraints) -> Mask:
    """Tell which linkages have pivots as near as the prescribed ones require, shape (n,)."""
    given = max(abs(complex(*p) - 0.5) for p in constraints.places)
    off = np.where(linkage.finite, np.abs(linkage.points - 0.5), 0.0)
    return np.asarray((off <= min(LIMITS.farther * max(given, 1.0), LIMITS.farthest)).all(axis=(1, 2)))


def _select_seeds(built: Built, order: Indices, count: int) -> Indices:
    """Select the first `count` distinct designs of an order."""
    exact = built.exact[order]
    some = [group[distinct(built[group], count)] for group in (order[exact], order[~exact])]
    return np.concatenate(some)


def distinct(built: Built | CandidateBatch, count: int) -> Indices:
    """Return the indices of the first `count` distinct designs."""
    z = np.concatenate([built.linkage.points.reshape(-1, 4), built.point[:, None]], axis=1)
    kept: list[int] = []
    for i in range(len(z)):
        if len(kept) == count:
            break
        if not kept or np.abs(z[kept] - z[i]).max(1).min() > LIMITS.same:
            kept.append(i)
    return np.array(kept, dtype=int)


def _refine(ancestors: Built, problem: Problem, nominal: Nominal, report: SearchReport) -> CandidateBatch:
    """Refine guides at mid-stroke: first for the deviation, then for the ranking."""
    law = leading_error(ancestors.linkage, ancestors.point, circle=problem.curved, tolerance=LIMITS.rounded)
    n = len(law.order)
    configuration = Instant(ancestors.linkage).configuration.astype(object)
    origin = Origin(
        np.full(n, -1),
        ancestors.linkage.family.astype(object),
        ancestors.series.astype(object),
        configuration,
        law.order,
        np.zeros(n, int),
    )
    assert problem.constraints.given is not None
    start = near_path(problem, origin, coupler_curve(ancestors.linkage, ancestors.point), nominal)
    moves = PivotCoordinates(HELD[problem.constraints.given])
    straight = replace(problem, relaxed="deviation")
    first = Refinement.of(straight, start, moves, nominal).run(LIMITS.rounds)
    second = Refinement.of(problem, first.best, moves, nominal).run(LIMITS.rounds)
    report.refined = first.evaluated + second.evaluated
    found = second.best
    guides = coupler_curve(found.linkage, found.point)
    return measure_traced(problem, found.origin, guides, in_place(guides, nominal, SHOWN))
