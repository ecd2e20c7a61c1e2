"""Refinement of mechanisms of many bars within bounds, on their finite motion.

The parameters of a family and both ends of the drive are free. Distances from the nominal are
taken at Chebyshev points of the drive; their derivatives are those of the joints (`chains.rates`),
which are functions of the parameters. Derivatives of measures are differences. The steps are those
of all guides (`refine.sqp`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import NamedTuple

import numpy as np

from ..candidates.feasibility import EXACT_DEVIATION, weight
from ..candidates.select import unlike_rows
from ..chains.chain import Chain
from ..chains.circuits import followed_circuits
from ..chains.poses import Poses, poses
from ..chains.rates import rates, slopes
from ..collections.goal import Goal
from ..guidance.circuit_curve import runs_forward
from ..guidance.minimum_zone import Fit, concentric, grid, minimum_zone, rise_over
from ..kinematics.batch import Rows, put
from ..kinematics.plane_vectors import extreme_pairs
from ..kinematics.types import Complexes, Floats, Indices, Mask
from ..problem.path import PathRequest
from ..refine.model import Judged
from ..refine.quantities import NONE, Pieces
from ..refine.sqp import Refinement
from ..refine.subproblem import Subproblem, at_peaks, centred, distance
from ..series.chain_family import ChainFamily
from .chain_measures import MEASURES, chain_measures, places_of


class RefineOptions(NamedTuple):
    """Options of the refinement of mechanisms."""

    intervals: int = 32  #: number of intervals between the positions of the path
    first: int = 3  #: number of rounds of all mechanisms
    kept: int = 8  #: number of mechanisms that are refined further
    rounds: int = 20  #: largest number of further rounds
    step: float = 1e-6  #: step of finite differences by the parameters [units]
    shortest: float = 0.2  #: least unit of the moves of a parameter
    longest: float = 1.0  #: largest unit of the moves of a parameter
    window: float = 0.5  #: unit of the moves of an end of the drive [ranges]
    directions: int = 24  #: number of directions in which the size is measured
    narrowest: float = 0.2  #: least range of the drive [ranges before]
    #: Part of a bound by which mechanisms stay inside it, since between the positions a measure is
    #: a little larger.
    inside: float = 3e-4
    same: float = 1e-6  #: largest difference of equal phases [rad]
    alike: float = 0.02  #: largest difference of lengths of mechanisms that are alike [strokes]


REFINE = RefineOptions()
#: Measures that change with the parameters step by step, and so can be bounded and ranked here.
MOVED = tuple(name for name in MEASURES if name not in ("bars", "turns"))
#: Constraint that keeps parameters within their domains.
DOMAIN = "domain"
#: Constraint of the regions.
REGIONS = "regions"
#: Constraint of the stroke of a mechanism that keeps its scale [strokes].
STROKE = "stroke"


@dataclass(frozen=True, eq=False)
class Chains(Rows):
    """Parameters of n mechanisms of one family, and their paths.

    Attributes
    ----------
    values, low, high : ndarray, shape (n, p)
        Parameters, and the ends of the intervals that contain them.
    drive : ndarray, shape (n, 2)
        Drive at both ends of the path, from the reference pose.
    branch : ndarray, shape (n, d)
        Signs of the dyads on the path.
    """

    values: Floats
    low: Floats
    high: Floats
    drive: Floats
    branch: Floats


@dataclass(frozen=True, eq=False)
class MeasuredChains(Rows):
    """n mechanisms of one family, measured over their paths; arrays of shape (n,) unless stated.

    Attributes
    ----------
    chains : Chains
    off : ndarray
        Deviation; NaN where the mechanism does not close, or its point runs back [strokes].
    bend : ndarray
        Curvature of the nominal, positive for a centre to the left [1/stroke].
    measures : dict of str to ndarray
        Bounded and ranked measures, lengths in strokes.
    outside : ndarray
        Distance by which the mechanism leaves its regions [strokes].
    """

    chains: Chains
    off: Floats
    bend: Floats
    measures: dict[str, Floats]
    outside: Floats

    def __len__(self) -> int:
        return len(self.off)

    def replaced(self, where: Indices, by: MeasuredChains) -> MeasuredChains:
        """Replace the rows `where` by those of `by`."""
        return put(self, where, by)


@dataclass(frozen=True)
class ChainModel:
    """Mechanisms of a family as the optimiser sees them.

    Attributes
    ----------
    family : ChainFamily
    goal : Goal
    curvature : float or None
        Stroke over the radius; 0 of a line, None of an arc of any radius.
    tolerance : float
        Permitted deviation [strokes].
    stroke : float or None
        Length of the stroke in the unit of the family, of a mechanism that keeps its scale.
    """

    family: ChainFamily
    goal: Goal
    curvature: float | None
    tolerance: float
    stroke: float | None = None

    # -- what the optimiser asks -----------------------------------------------------------
    def judged(self, guides: MeasuredChains) -> Judged:
        broken = [self._excess(guides, *one) for one in self._limits]
        with np.errstate(all="ignore"):
            beyond = np.maximum(np.log(np.maximum(guides.off, 1e-300) / self.tolerance), 0.0)
            total = weight("deviation") * beyond + np.sum(broken, axis=0) + np.maximum(guides.outside, 0.0)
            deviation = np.log((guides.off + EXACT_DEVIATION) / self.tolerance)
        cost = deviation if self.goal.rank_by == "deviation" else self._signed(guides, self.goal.rank_by)
        total = np.where(np.isfinite(guides.off), total, np.inf)
        return Judged(np.where(np.isfinite(total), cost, np.inf), total, total <= 0)

    def refinable(self, guides: MeasuredChains, met: Mask) -> Mask:
        exact = (guides.off <= EXACT_DEVIATION) & met & (self.goal.rank_by == "deviation")
        return np.asarray(np.isfinite(guides.off) & ~exact)

    def deviation(self, guides: MeasuredChains) -> Floats:
        return guides.off / self.tolerance

    def charted(self, guides: MeasuredChains) -> MeasuredChains:
        return guides

    def moved(self, guides: MeasuredChains, step: Floats) -> tuple[MeasuredChains, Indices]:
        here, unit = guides.chains, self._unit(guides.chains)
        p = here.values.shape[1]
        values = np.clip(here.values + unit[:, :p] * step[:, :p], here.low, here.high)
        drive = here.drive + unit[:, p:] * step[:, p : p + 2]
        kept = np.flatnonzero(np.diff(drive)[:, 0] / np.diff(here.drive)[:, 0] > REFINE.narrowest)
        return self.measured(replace(here, values=values, drive=drive)[kept]), kept

    def linearised(self, guides: MeasuredChains) -> Subproblem:
        here = guides.chains
        found, _ = self._poses(here)  # all of them close, as measured
        error, jacobian = at_peaks(*self.errors(guides), REFINE.intervals)
        unit, picked, (n, p) = self._unit(here), extreme_pairs(found.places, REFINE.directions), here.values.shape
        value = self._rows(found, picked)
        slope = {name: np.zeros((*rows.shape, jacobian.shape[2])) for name, rows in value.items()}
        each, coordinate = np.repeat(np.arange(n), p + 2), np.tile(np.arange(p + 2), n)
        shift = REFINE.step * unit[each] * (coordinate[:, None] == np.arange(p + 2))
        many = here[each]
        there, closed = self._poses(replace(many, values=many.values + shift[:, :p], drive=many.drive + shift[:, p:]))
        each, coordinate = each[closed], coordinate[closed]
        for name, after in self._rows(there, picked[..., each]).items():
            change = (after - value[name][each]) / REFINE.step
            slope[name][each, :, coordinate] = np.where(np.isfinite(change), change, 0.0)
        pieces = {name: Pieces(rows, slope[name]) for name, rows in value.items()}
        pieces[DOMAIN] = _in_domain(here, unit, jacobian.shape[2])
        ranked = self.goal.rank_by
        measures = {} if ranked == "deviation" else {ranked: pieces.pop(f"ranked {ranked}")}
        allowed = np.full(n, self.tolerance)
        marginal = {ranked: np.ones(n)}
        if ranked == "deviation":
            marginal[ranked] = self.tolerance / np.maximum(guides.off, EXACT_DEVIATION)
        return Subproblem(error, jacobian, pieces, measures, marginal, allowed, {})

    # -- measuring -------------------------------------------------------------------------
    def measured(self, chains: Chains) -> MeasuredChains:
        """Measure mechanisms over their paths."""
        n = len(chains.drive)
        names = [*dict.fromkeys(name for name, _, _ in self._limits)]
        names += [name for name in [self.goal.rank_by] if name != "deviation" and name not in names]
        off, bend, outside = np.full(n, np.nan), np.zeros(n), np.zeros(n)
        measures = {name: np.full(n, np.nan) for name in names}
        found, some = self._poses(chains)
        if len(some):
            with np.errstate(all="ignore"):
                fit, z = self._fitted(found)
                off[some] = np.where(runs_forward(z), fit.deviation / fit.stroke, np.nan)
                bend[some] = fit.curvature * fit.stroke
                scale = self._scale(found)
                if self.stroke is not None:
                    names.remove(STROKE)
                    measures[STROKE][some] = np.abs(_chord(found.joint(self.family.guided))) * scale
                for name, value in chain_measures(self.family, found, scale, names).items():
                    measures[name][some] = value
                if self.goal.outside is not None:
                    outside[some] = self._outside(found)
        return MeasuredChains(chains, off, bend, measures, outside)

    def _scale(self, found: Poses) -> Floats:
        """Return the unit of the family in strokes, (n,)."""
        if self.stroke is not None:
            return np.full(len(found.chain), 1 / self.stroke)
        return np.asarray(1 / np.abs(_chord(found.joint(self.family.guided))))

    def shape(self, chains: Chains) -> Floats:
        """Return all distances of two joints of a bar, (n, d) [strokes]."""
        found, _ = self._poses(chains)
        z, on = found.chain.z, self.family.structure.on
        pairs = [(i, j) for i, j in combinations(range(len(z)), 2) if {*on[i]} & {*on[j]}]
        scale = self._scale(found)
        return np.stack([scale * np.abs(z[i] - z[j]) for i, j in pairs], axis=1)

    def _poses(self, chains: Chains) -> tuple[Poses, Indices]:
        """Return the poses over the paths of those mechanisms that close, and their numbers."""
        names = [one.name for one in self.family.parameters]
        chain, valid = self.family.chains(dict(zip(names, chains.values.T, strict=True)))
        some = np.flatnonzero(valid)
        low, high = chains.drive[some].T
        nodes = 0.5 + 0.5 * grid(REFINE.intervals).nodes[:, None]
        with np.errstate(all="ignore"):
            found = poses(chain, low + (high - low) * nodes, chains.branch[some].T)
            closed = np.flatnonzero(np.isfinite(found.at).all((0, 1)) & (found.sines > 0).all((0, 1)))
        if len(closed) < len(some):
            found = _some(found, closed)
        return found, some[closed]

    def _fitted(self, found: Poses) -> tuple[Fit, Complexes]:
        """Fit the nominals; return them, and the paths with their chords from 0 to 1."""
        z = found.joint(self.family.guided)
        z = (z - z[0]) / _chord(z)
        held = None if self.curvature is None else self._held(z)
        fit = minimum_zone(z.real, z.imag, self.curvature != 0, grid(REFINE.intervals), held)
        return fit, z

    def _held(self, z: Complexes) -> Floats | None:
        """Return the curvatures to keep, towards the side to which the paths bend."""
        assert self.curvature is not None
        return None if self.curvature == 0 else -self.curvature * np.sign(z[len(z) // 2].imag)

    def _outside(self, found: Poses) -> Floats:
        assert self.goal.outside is not None
        if self.stroke is not None:
            unit = self.stroke
            return self.goal.outside(places_of(found, lambda at: at / unit))
        z = found.joint(self.family.guided)
        start, chord = z[0], _chord(z)
        return self.goal.outside(places_of(found, lambda at: (at - start) / chord))

    # -- bounds and ranking ----------------------------------------------------------------
    @cached_property
    def _limits(self) -> list[tuple[str, float, float]]:
        """Bounded measures with sign and bound: sign (value - bound) <= 0, lengths in strokes."""
        limits = {(STROKE, -1.0): 1.0} if self.stroke is not None else {}
        for one in self.goal.bounds:
            for sign, end in ((-1.0, one.low), (1.0, one.high)):
                if np.isfinite(end) and one.name in MOVED:
                    inside = end / one.scale
                    inside -= sign * REFINE.inside * abs(inside)
                    limits[one.name, sign] = sign * min(sign * inside, sign * limits.get((one.name, sign), inside))
        return [(name, sign, bound) for (name, sign), bound in limits.items()]

    def _excess(self, guides: MeasuredChains, name: str, sign: float, bound: float) -> Floats:
        return np.maximum(sign * (guides.measures[name] - bound) * _unit_of(name), 0.0)

    def _signed(self, guides: MeasuredChains, name: str) -> Floats:
        """Return a ranked measure, less is better."""
        return (-1.0 if MEASURES[name].more else 1.0) * _unit_of(name) * guides.measures[name]

    def _rows(self, found: Poses, picked: Indices) -> dict[str, Floats]:
        """Return limits and ranked measures in pieces (n, k), less is better."""
        scale, rows = self._scale(found), {}
        for name, sign, bound in self._limits:
            value = sign * _unit_of(name) * (self._pieces(name, found, picked, scale) - bound)
            rows[f"{name} {sign:g}"] = value
        if (name := self.goal.rank_by) != "deviation":
            sign = -1.0 if MEASURES[name].more else 1.0
            rows[f"ranked {name}"] = sign * _unit_of(name) * self._pieces(name, found, picked, scale)
        if self.goal.outside is not None:
            rows[REGIONS] = self._outside(found)[:, None]
        return rows

    def _pieces(self, name: str, found: Poses, picked: Indices, scale: Floats) -> Floats:
        """Return the pieces of a measure, (n, k)."""
        if name == STROKE:
            return (scale * np.abs(_chord(found.joint(self.family.guided))))[:, None]
        if name == "min_transmission":
            return found.transmission.T
        if name == "size":
            one, other = (np.take_along_axis(found.places, ends, 0) for ends in picked)
            return (scale * np.abs(one - other)).T
        return chain_measures(self.family, found, scale, [name])[name][:, None]

    # -- errors ----------------------------------------------------------------------------
    def _unit(self, chains: Chains) -> Floats:
        """Return the units of the moves of parameters and drive, (n, p + 2)."""
        values = np.clip(np.abs(chains.values), REFINE.shortest, REFINE.longest)
        window = REFINE.window * np.abs(np.diff(chains.drive))
        return np.concatenate([values, window, window], axis=1)

    def errors(self, guides: MeasuredChains) -> tuple[Floats, Floats]:
        """Return distances from the nominal (n, m) and their derivatives (n, m, p).

        The coordinates are the parameters, both ends of the drive, shift and tilt of the nominal,
        and its curvature if that is free.
        """
        found, _ = self._poses(guides.chains)
        z = found.joint(self.family.guided)
        chord = _chord(z)
        local = (z - z[0]) / chord
        error, along, by_bend = distance(local, guides.bend)
        error = centred(error, local, guides.bend)
        unit = self._unit(guides.chains)
        by_joints = self._joint_slopes(guides.chains, found.chain) * unit.T[None, :-2]
        dz = np.einsum("kmn,kpn->mpn", slopes(found).of_joint(self.family.guided), by_joints)
        speed = rates(found).velocity_of(self.family.bar, found.chain.z[self.family.guided])
        share = (0.5 + 0.5 * grid(REFINE.intervals).nodes)[:, None, None]
        ends = np.concatenate([1 - share, share], axis=1) * unit.T[None, -2:]
        dz = np.concatenate([dz, speed[:, None] * ends], axis=1)
        moved = (dz - dz[0] - local[:, None] * (dz[-1] - dz[0])) / chord
        across = (moved * along.conj()[:, None]).imag
        _, run, by = concentric(local.real - 0.5, local.imag - rise_over(np.ones(()), guides.bend), guides.bend)
        columns = [across, -(1 / by)[:, None], -(run / by)[:, None]]
        if self.curvature is None:
            columns.append(by_bend[:, None])
        jacobian = np.moveaxis(np.concatenate(columns, axis=1), 2, 0)
        return error.T, jacobian

    def _joint_slopes(self, chains: Chains, chain: Chain) -> Floats:
        """Return the derivatives of the reference pose by parameters, (k, p, n)."""
        names = [one.name for one in self.family.parameters]
        found = []
        for row in range(len(names)):
            ends = []
            for side in (1, -1):
                moved = chains.values.copy()
                moved[:, row] += side * REFINE.step
                z, u = self.family.placed(dict(zip(names, moved.T, strict=True)))
                turned = np.angle(u / chain.u)
                ends.append(np.concatenate([np.stack([z.real, z.imag], 1).reshape(-1, z.shape[1]), turned]))
            found.append((ends[0] - ends[1]) / (2 * REFINE.step))
        return np.asarray(np.nan_to_num(np.stack(found, 1)))


def _in_domain(chains: Chains, unit: Floats, width: int) -> Pieces:
    """Return the limits that keep the parameters in their domains."""
    n, p = chains.values.shape
    value = np.concatenate([chains.values - chains.high, chains.low - chains.values], axis=1)
    slope = np.zeros((n, 2 * p, width))
    for k in range(p):
        slope[:, k, k], slope[:, p + k, k] = unit[:, k], -unit[:, k]
    return Pieces(np.maximum(value, NONE), slope)


def _chord(z: Complexes) -> Complexes:
    return np.asarray(z[-1] - z[0])


def _unit_of(name: str) -> float:
    """Return the unit in which a measure is weighed: strokes, right angles, or its own."""
    return 1 / 90 if name != STROKE and MEASURES[name].unit == "deg" else 1.0


def _some(found: Poses, index: Indices) -> Poses:
    """Select mechanisms."""
    at, turn, origin = (values[..., index] for values in (found.at, found.turn, found.origin))
    return Poses(found.chain[index], found.drive[:, index], at, turn, origin, found.sines[..., index])


@dataclass(frozen=True)
class Legs:
    """Paths of n mechanisms between two dead points.

    Attributes
    ----------
    drive : ndarray, shape (2, n)
        Drive at both ends, from the reference pose.
    branch : ndarray, shape (d, n)
        Signs of the dyads.
    """

    drive: Floats
    branch: Floats

    def __len__(self) -> int:
        return len(self.drive.T)

    def __getitem__(self, index: Indices) -> Legs:
        return Legs(self.drive[:, index], self.branch[:, index])


@dataclass(frozen=True)
class Refined:
    """Refined mechanisms (k,): their parameters, their paths, and their numbers."""

    values: dict[str, Floats]
    legs: Legs
    of: Indices


def refined(
    family: ChainFamily,
    values: dict[str, Floats],
    legs: Legs,
    goal: Goal,
    request: PathRequest,
    stroke: float | None = None,
) -> Refined:
    """Refine mechanisms over their windows; return the best of them that are unlike each other.

    Parameters
    ----------
    family : ChainFamily
    values : dict of str to ndarray, shape (n,)
        Parameters.
    legs : Legs
        Their paths.
    goal : Goal
        Bounds, regions, and what is ranked: the deviation, or one of `MOVED`.
    request : StraightLine or CircularArc
        Path and tolerance.
    stroke : float, optional
        Length of the stroke in the unit of the family, of a mechanism that keeps its scale.
    """
    x = np.stack([values[name] for name in values], axis=1)
    model = ChainModel(family, goal, _curvature(request), request.relative, stroke)
    run = Refinement.started(model, model.measured(Chains(x, *_domain(family, x), legs.drive.T, legs.branch.T)))
    for _ in range(REFINE.first):
        run.step(followed=1)
    some = _unlike(model, run)[: REFINE.kept]
    run = run[some].run(REFINE.rounds)
    order = _unlike(model, run)
    best = run.best.chains[order]
    legs = Legs(best.drive.T, best.branch.T)
    return Refined(dict(zip(values, best.values.T, strict=True)), legs, some[order])


def on_one_leg(family: ChainFamily, values: dict[str, Floats], windows: Floats) -> tuple[Legs, Indices]:
    """Return those paths that lie between two dead points.

    Parameters
    ----------
    values : dict of str to ndarray, shape (n,)
        Parameters.
    windows : ndarray, shape (2, n)
        Phases of the ends of the paths [rad].

    Returns
    -------
    legs : Legs
    of : ndarray, shape (k,)
        The numbers of their mechanisms.
    """
    chain, valid = family.chains(values)
    found, closed = followed_circuits(chain, family.bar)
    some = np.flatnonzero(valid)[closed]
    windows = windows[:, some]
    legs = Legs(found.drive(windows)[0], found.drive(windows.mean(0)[None])[1][:, 0])
    back = np.stack([found.phase_of(end, legs.branch) for end in legs.drive]) - windows
    one_leg = (np.abs(np.mod(back + 1, found.period) - 1) < REFINE.same).all(0)
    return legs[one_leg], some[one_leg]


def _curvature(request: PathRequest) -> float | None:
    """Return the stroke over the radius; 0 of a line, None of an arc of any radius."""
    if request.kind == "line":
        return 0.0
    return None if request.radius is None else request.stroke / request.radius


def _unlike(model: ChainModel, run: Refinement[MeasuredChains]) -> Indices:
    """Return the numbers of the mechanisms that differ from all better ones, the best first."""
    order = np.argsort(run.merit, kind="stable")
    order = order[np.isfinite(run.merit[order])]
    shape = model.shape(run.best[order].chains)
    return np.asarray(order[unlike_rows(shape, REFINE.alike)])


def _domain(family: ChainFamily, x: Floats) -> tuple[Floats, Floats]:
    """Return the ends (n, p) of the intervals that contain the parameters."""
    low, high = np.full(x.shape, -np.inf), np.full(x.shape, np.inf)
    for row, parameter in enumerate(family.parameters):
        for a, b in parameter.domain:
            inside = (x[:, row] >= a) & (x[:, row] <= b)
            low[inside, row], high[inside, row] = a, b
    return low, high
