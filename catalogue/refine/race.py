"""A race: many starts led inside the constraints, and on to where they cost less, in cheap rounds.

Machines stand at a few stations along the nominal (`catalogue.guidance.stations`), where their
errors, limits and measures are linear in the coordinates of the pivots.  A round brings these
inside their bounds (`hinges`), corrects the step by what the errors are after it, and lays the
machines anew.  A start is first led inside with something to spare, whatever it costs; then its
measures aspire to less.  What comes of it is no answer yet: circuits, and what happens between the
stations, are for the refinement (`sqp`) to see.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..candidates.batch import CandidateBatch, measured
from ..candidates.select import unlike
from ..guidance.inverse import of_machine
from ..guidance.metrics import rotates, transmission
from ..guidance.sensitivity import COUNT, PoseJacobian, displaced
from ..guidance.slides import slide_ends, slide_runs
from ..guidance.stations import Stationed
from ..kinematics.batch import Rows, put, take
from ..kinematics.motion import Pose
from ..kinematics.types import Floats, Indices, Mask
from ..problem.problem import Problem
from ..problem.ranking import RISING
from ..problem.request import FULLEST
from .hinges import Hinges, bring_inside
from .quantities import NONE, Pieces, Quantities
from .subproblem import FLATTEST, WORSE, differenced, limits, units

#: Part of the tolerance that steps are to spare before costs count, and afterwards.
SPARE = (0.04, 0.05)
#: What limits are to spare then [strokes, right angles].
APART = (4e-3, 2e-3)
#: Parts of both that are missed at no price.
LITTLE, SLIGHTLY = 2e-3, 2e-4
#: Amount of a broken limit that weighs as much as an error of the whole tolerance [strokes].
UNIT = 0.05
#: By how much a measure aspires to less in a round [strokes, right angles].
ASPIRE = 0.05
#: What a violation costs beside what is ranked, of an error as large as the tolerance.
PRICE = 3.0
#: Radius of the first round, in the units of `units`.
RADIUS = 0.1
#: Largest radius.
WIDEST = 0.6
#: What the radius is multiplied by after a round that helped.
WIDER = 2.5
#: What it is multiplied by after one that did not.
NARROWER = 0.25
#: Damping of the first step.
DAMPING = 0.1
#: Newton steps of a round before and after multipliers are renewed.
PLAN = (4, 2)
#: Newton steps that correct it.
AGAIN = (3,)
#: Part of its deviation that a machine aims at where the least is sought.
SHRINK = 0.3
#: Standard deviations of the error at one station that stand for the allowance of a path.
ALLOWANCE = 2.2
#: Part of the tolerance that is left to errors, whatever allowance is asked for.
LEAST_LEFT = 0.2
#: Sharpest nominal [1/stroke].
SHARPEST = -1.9


def is_raced(problem: Problem) -> bool:
    """Return whether stations show all that decides, as they do not of zones or of returning points."""
    wanted = problem.constraints
    if wanted.returns or wanted.play or problem.relaxed or problem.in_place or problem.is_wide:
        return False
    return not differenced(problem)


@dataclass(frozen=True)
class Linear(Rows):
    """n machines, with what is asked of them linear in the coordinates; arrays of shape (n, ...).

    Attributes
    ----------
    machine : Stationed
    slope : ndarray, shape (n, m, p)
        Of the errors at the stations.
    limit, limit_slope : ndarray, shape (n, l), (n, l, p)
        Broken where positive.
    measure, measure_slope : ndarray, shape (n, q), (n, q, p)
        Pieces of what is ranked, as far as each may still fall: weighed by its marginal cost.
    tolerance, aim : ndarray, shape (n,)
        Largest error allowed, and that which a step aims at.
    cost, violation : ndarray, shape (n,)
        What is ranked; errors and limits beyond their bounds together.
    """

    machine: Stationed
    slope: Floats
    limit: Floats
    limit_slope: Floats
    measure: Floats
    measure_slope: Floats
    tolerance: Floats
    aim: Floats
    cost: Floats
    violation: Floats

    @classmethod
    def of(cls, problem: Problem, machine: Stationed) -> Linear:
        """Return machines with what a problem asks of them."""
        by = machine.jacobian
        read = _quantities(problem, machine, by)
        unit = units(machine.linkage, machine.point)[:, None]
        slope = np.moveaxis(by.across, 0, 1) * unit
        bounds = list(limits(problem, read).values())
        scatter = np.sqrt((by.across**2).sum(-1).max(0))
        left = problem.deviation - ALLOWANCE * scatter * (problem.constraints.min_allowance or 0.0)
        tolerance = np.maximum(left, LEAST_LEFT * problem.deviation)
        aim = tolerance
        if problem.ranking.only == "deviation":
            aim = np.minimum(SHRINK * machine.deviation, tolerance)
        cost, pieces, marginal = _ranked(problem, read, machine.deviation, scatter)
        limit, limit_slope = _joined(bounds, unit)
        measure, measure_slope = _aspiring(pieces, marginal, unit)
        if problem.curvature is None:
            more = machine.by_curvature[..., None]
            slope = np.concatenate([slope, more], axis=2)
            limit_slope, measure_slope = _widened(limit_slope), _widened(measure_slope)
            limit, limit_slope = _with_radius(machine.curvature, limit, limit_slope)
        with np.errstate(all="ignore"):
            beyond = np.maximum(np.log(machine.deviation / tolerance), 0.0)
        broken = beyond + np.maximum(limit, 0.0).max(1) / UNIT
        good = machine.reached & np.isfinite(broken) & np.isfinite(slope).all((1, 2))
        good &= np.isfinite(limit_slope).all((1, 2)) & np.isfinite(measure_slope).all((1, 2))
        good &= machine.curvature > SHARPEST
        return cls(
            machine, slope, limit, limit_slope, measure, measure_slope, tolerance, aim,
            np.asarray(cost, float), np.where(good, broken, np.inf),
        )  # fmt: skip

    def __len__(self) -> int:
        return len(self.cost)

    @property
    def bounded(self) -> int:
        """How many errors and limits there are of each."""
        return int(self.slope.shape[1] + self.limit.shape[1])

    def hinges(self, inside: Mask, error: Floats | None = None) -> Hinges:
        """Return errors, limits and measures as hinges; of those not `inside` no measures count."""
        spare, apart = (np.where(inside, *every[::-1]) for every in (SPARE, APART))
        error = self.machine.error if error is None else error
        scale = self.aim[:, None]
        parts = (
            (error / scale, self.slope / scale[..., None]),
            ((self.limit + apart[:, None]) / UNIT, self.limit_slope / UNIT),
            (self.measure * inside[:, None], self.measure_slope * inside[:, None, None]),
        )
        value, slope = (np.concatenate(every, axis=1) for every in zip(*parts, strict=True))
        return Hinges(slope, value, 1 - spare, (error.shape[1], self.limit.shape[1]))

    def merit(self, inside: Mask) -> Floats:
        """Return what machines are worth, less is better, infinite where they do not run."""
        spare = np.where(inside, LITTLE, SPARE[0])
        apart = np.where(inside, SLIGHTLY, APART[0])
        error = np.abs(self.machine.error) / self.tolerance[:, None] - (1 - spare[:, None])
        limit = (self.limit + apart[:, None]) / UNIT
        beyond = 0.5 * ((np.maximum(error, 0) ** 2).sum(1) + (np.maximum(limit, 0) ** 2).sum(1))
        merit = np.where(inside, self.cost + PRICE * beyond, beyond)
        return np.where(np.isfinite(self.violation), merit, np.inf)


def _quantities(problem: Problem, machine: Stationed, by: PoseJacobian) -> Quantities:
    """Return the measures of machines, read at every other station."""
    linkage, every = machine.linkage, machine.pose
    pose = Pose(every.d[::2], every.x[::2], every.origin)
    built, seen, plane = linkage, pose, 1
    if problem.constraints.slots:
        built, seen = of_machine(linkage, pose)
        plane = 0
    at = [seen.point(linkage.points[:, i, plane]) for i in (0, 1)]
    turns = rotates(built) if problem.constraints.full_rotation else None
    least, driver, _ = transmission(built, at, seen.x, turns)
    slides = slide_ends(linkage, slide_runs(linkage, pose))
    return Quantities(problem, linkage, machine.point, driver, slides, pose, by[::2], least)


def _ranked(
    problem: Problem, read: Quantities, deviation: Floats, scatter: Floats
) -> tuple[Floats, list[Pieces], Floats]:
    """Return what machines cost, (n,), the pieces of their measures, and what the cost rises by
    per unit of each, (q, n); of the last, without pieces, per part of the tolerance."""
    ranking, asked = problem.ranking, problem.deviation
    names = sorted(ranking.quantities - {"deviation", "allowance"})
    pieces = [read(name) for name in names]
    values = {}
    for name, piece in zip(names, pieces, strict=True):
        worst = piece.value.max(1)
        there = worst > NONE
        if name in RISING:
            values[name] = np.where(there, -worst, np.inf)
        else:
            values[name] = np.where(there, worst, 0.0)
    values["deviation"] = deviation / asked
    values["allowance"] = (asked - deviation) / (ALLOWANCE * scatter * asked)
    cost = ranking.cost(values)

    def marginal(name: str) -> Floats:
        worse = values[name] + (-WORSE if name in RISING else WORSE)
        with np.errstate(invalid="ignore"):
            rise = (ranking.cost({**values, name: worse}) - cost) / WORSE
        return np.where(np.isfinite(rise), np.maximum(rise, 0.0), 0.0)

    return cost, pieces, np.array([marginal(name) for name in names])


def _aspiring(pieces: list[Pieces], marginal: Floats, unit: Floats) -> tuple[Floats, Floats]:
    """Return pieces (n, q), and slopes, as far as they are above what their measures aspire to.

    The hinge of the largest piece falls at the rate at which the cost does.
    """
    if not pieces:
        return np.zeros((len(unit), 0)), np.zeros((len(unit), 0, unit.shape[2]))
    weighed = []
    for piece, rate in zip(pieces, marginal, strict=True):
        weight = np.sqrt(rate / ASPIRE)[:, None]
        value = piece.value - (piece.value.max(1, keepdims=True) - ASPIRE)
        weighed.append(Pieces(weight * value, weight[..., None] * piece.slope))
    return _joined(weighed, unit)


def _joined(pieces: list[Pieces], unit: Floats) -> tuple[Floats, Floats]:
    """Return all pieces, (n, l), with slopes in units of the coordinates, (n, l, 10)."""
    value = np.concatenate([piece.value for piece in pieces], axis=1)
    return value, np.concatenate([piece.slope for piece in pieces], axis=1) * unit


def _widened(slope: Floats) -> Floats:
    """Return slopes with those by one more coordinate, on which nothing depends."""
    return np.concatenate([slope, np.zeros((*slope.shape[:2], 1))], axis=2)


def _with_radius(bend: Floats, limit: Floats, slope: Floats) -> tuple[Floats, Floats]:
    """Return limits with those on the curvature, the last coordinate: neither flat nor full."""
    more = np.zeros((len(bend), 2, slope.shape[2]))
    more[:, 0, -1], more[:, 1, -1] = 1.0, -1.0
    value = np.stack([bend + 1 / FLATTEST, -FULLEST - bend], axis=1)
    return np.concatenate([limit, value], axis=1), np.concatenate([slope, more], axis=1)


@dataclass
class Race:
    """n machines under way; arrays of shape (n, ...)."""

    problem: Problem
    here: Linear
    best: Linear  #: the cheapest of each that met all limits, or the nearest to that
    inside: Mask  #: which have met them
    start: Indices  #: which each comes from
    multipliers: Floats  #: (n, m + l), in parts of the tolerance and of `UNIT`
    radius: Floats
    damping: Floats
    taken: int = 0  #: rounds of single machines so far

    @classmethod
    def of(cls, problem: Problem, starts: CandidateBatch) -> Race:
        """Return the race of candidates along the path, of those that stations can follow."""
        linkage, point = starts.linkage, starts.point
        fit, bend = starts.traced.fit, problem.curvature
        if bend is None:
            way = np.where(fit.along.real < 0, -1.0, 1.0)
            curvature = way * fit.curvature.astype(float)
            curvature = np.where(curvature < -1 / FLATTEST, curvature, -1 / FLATTEST)
        else:
            curvature = np.full(len(starts), float(bend))
        with np.errstate(all="ignore"):
            machine = Stationed.followed(linkage, point, curvature)
            some = np.flatnonzero(machine.reached)
            here = Linear.of(problem, machine[some])
        n = len(some)
        return cls(
            problem, here, here, here.violation <= 0, some, np.zeros((n, here.bounded)),
            np.full(n, RADIUS), np.full(n, DAMPING),
        )  # fmt: skip

    def __len__(self) -> int:
        return len(self.start)

    @property
    def merit(self) -> Floats:
        """What the best of each costs, or by how much it misses the limits, which is worse."""
        cost, violation = self.best.cost, self.best.violation
        met = violation <= 0
        worst = np.max(cost, where=met, initial=0.0)
        return np.where(met, cost, worst + 1 + violation)

    def denser(self) -> Race:
        """Return the race with what it has at twice as many stations."""
        with np.errstate(all="ignore"):
            here, best = (Linear.of(self.problem, every.machine.denser()) for every in (self.here, self.best))
        inside = self.inside & (here.violation <= 0)
        none = np.zeros((len(self), here.bounded))
        return replace(self, here=here, best=best, inside=inside, multipliers=none)

    def leaders(self, count: int) -> Race:
        """Return the race of those of the best that are unlike each other."""
        pivots, mirror = self.best.machine.linkage.pivots, self.problem.curvature == 0
        return self._some(unlike(pivots, self.merit, count, mirror=mirror))

    def finalists(self, starts: CandidateBatch) -> CandidateBatch:
        """Return the best of each as candidates, measured on their finite motion; those that do
        not run over the stroke are left out."""
        machine = self.best.machine
        nothing = np.full(len(self), complex(np.nan, np.nan))
        origin = take(starts.origin, self.start)
        found = measured(self.problem, origin, machine.linkage, machine.point, nothing)
        return found[np.flatnonzero(np.isfinite(found.deviation))]

    def _some(self, index: Indices) -> Race:
        """Return the race of some machines, whose families decide which limits there are."""
        with np.errstate(all="ignore"):
            here, best = (Linear.of(self.problem, every.machine[index]) for every in (self.here, self.best))
        none = np.zeros((len(index), here.bounded))
        names = ("inside", "start", "radius", "damping")
        kept = {name: getattr(self, name)[index] for name in names}
        return replace(self, here=here, best=best, multipliers=none, **kept)

    def take_rounds(self, count: int) -> None:
        """Take so many rounds."""
        for _ in range(count):
            self.round()

    def round(self) -> None:
        """Take a step of every machine, where it helps."""
        here, inside = self.here, self.inside
        self.taken += len(here)
        with np.errstate(all="ignore"):
            hinges, none = here.hinges(inside), np.zeros(here.slope.shape[::2])
            step, multipliers, damping = bring_inside(hinges, none, self.multipliers, self.damping, self.radius, PLAN)
            first = self._after(step)
            straight = first.error - (here.slope @ step[..., None])[..., 0]
            errors = np.where(first.reached[:, None], straight, here.machine.error)
            step, multipliers, damping = bring_inside(
                here.hinges(inside, errors), step, multipliers, damping, self.radius, AGAIN
            )
            laid = self._after(step).laid(any_radius=self.problem.curvature is None)
            there = Linear.of(self.problem, laid)
            gained = np.flatnonzero(there.merit(inside) < here.merit(inside))
        self._advance(gained, there[gained], step, multipliers, damping)

    def _after(self, step: Floats) -> Stationed:
        """Return machines after steps (n, p); those that are no linkages then stay."""
        here, machine = self.here, self.here.machine
        coordinates = step[:, :COUNT] * units(machine.linkage, machine.point)
        linkage, point, valid = displaced(machine.linkage, machine.point, coordinates)
        error = machine.error + (here.slope @ step[..., None])[..., 0]
        bend = machine.curvature
        if step.shape[1] > COUNT:
            bend = bend + step[:, COUNT]
        if not valid.all():
            linkage = put(machine.linkage, valid, linkage)
            point = put(machine.point, valid, point)
        return Stationed.settled(linkage, point, bend, error, machine.angle)

    def _advance(self, gained: Indices, to: Linear, step: Floats, multipliers: Floats, damping: Floats) -> None:
        """Go where a round has gained; be more careful elsewhere."""
        length = np.abs(step).max(1)
        self.here = put(self.here, gained, to)
        radius = np.minimum(self.radius, np.maximum(length, 1e-9)) * NARROWER
        radius[gained] = np.minimum(np.maximum(length * WIDER, self.radius), WIDEST)[gained]
        self.radius = radius
        self.multipliers = 0.5 * self.multipliers
        self.multipliers[gained] = multipliers[gained]
        self.damping = damping
        here, best = self.here, self.best
        met = here.violation <= 0
        better = np.where(best.violation <= 0, met & (here.cost < best.cost), met | (here.violation < best.violation))
        self.best = put(best, better, here[better])
        self.inside = self.inside | met
