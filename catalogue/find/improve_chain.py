"""Refine mechanisms of many bars from where they are: move their joints within bounds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from ..candidates.feasibility import EXACT_DEVIATION, WEIGHTS
from ..collections.bounds import bounds, with_constraints
from ..collections.goal import Bound, Goal
from ..collections.spec import Places
from ..errors import InvalidLinkage, InvalidRequest, quoted
from ..given import names as named
from ..given import whole
from ..guides.chain_stretch import ChainStretch
from ..guides.own_chain import GRID, OwnChain
from ..guides.results import ChainImprovement, Measured
from ..kinematics.circuits import TURN
from ..kinematics.types import Complexes, Floats
from ..plugin.chain_measures import MEASURES, chain_measures, places_of
from ..plugin.refine_mechanisms import MOVED, Legs, on_one_leg, refined
from ..problem.constraints import Constraints
from ..problem.path import PathRequest, path_request
from ..series.chain_family import ChainFamily
from ..series.series import Parameter
from .chain_regions import outside
from .measure import measure

#: Name that holds all joints of the frame.
FIXED = "fixed-pivots"


class Moves(NamedTuple):
    """Sizes and numbers of the moves of joints."""

    reach: float = 0.4  #: largest move of a coordinate [size]
    starts: int = 10  #: number of displaced copies to start from, per unit of effort
    scatter: float = 0.04  #: standard deviation of a coordinate of such a copy [size]
    larger: float = 1.1  #: largest size if it is not bounded [sizes before]
    stretches: int = 4  #: number of stretches of a moved mechanism that are compared
    same: float = 1e-6  #: largest difference of equal strokes [strokes]
    gain: float = 0.01  #: least part by which an improvement lowers what is ranked


MOVES = Moves()


def improve_chain(
    one: OwnChain,
    request: PathRequest,
    *,
    hold: str | Sequence[str] = (),
    rank_by: str = "deviation",
    effort: int = 1,
    **constraints: Any,
) -> ChainImprovement:
    """Improve a mechanism over a stroke by moving its joints.

    The mechanism stays where it is.  Without `max_size` it becomes at most a tenth larger.  Both
    ends of the stroke must lie between two dead points of the drive.

    Parameters
    ----------
    one : OwnChain
    request : StraightLine or CircularArc
        Stroke, and the permitted deviation.
    hold : str or sequence of str
        Names of joints to keep where they are in the given pose, or ``fixed-pivots`` for all joints
        of the frame.
    rank_by : str
        ``deviation``, or a measure of `catalogue.plugin.chain_measures`, such as ``size`` or
        ``min_transmission``.
    effort : int
        Multiple of the usual number of starts.
    **constraints
        Bounds on what is measured, such as `max_size`, `min_transmission`, `max_link`, and regions
        in the frame of the mechanism, such as `fixed_pivots_in`; others are refused.

    Returns
    -------
    ChainImprovement

    Raises
    ------
    InvalidRequest
        If the guided point does not cover the stroke, a held joint is unknown, or another
        constraint or ranking is given.

    Examples
    --------
    >>> from catalogue import StraightLine, mechanism
    >>> bars = {"frame": "AD", "crank": "AB", "coupler": "BCP", "rocker": "CD"}
    >>> joints = {"A": [0, 0], "D": [2, 0], "B": [0, 1], "C": [2, 2.5], "P": [4, 4]}
    >>> chebyshev = mechanism({"joints": joints, "bars": bars, "drive": "crank", "point": "P"})
    >>> found = chebyshev.improve(StraightLine(3, deviation=0.01), hold="fixed-pivots")
    >>> found.improved.deviation < 0.5 * found.before.deviation
    True
    """
    request, effort = path_request("improve", request), whole("effort", effort, 1)
    one = one.in_unit(request.unit)
    if request.is_wide:
        raise InvalidRequest("mechanisms of many bars are improved along arcs below a half circle: ask for less")
    if any(request.start) or request.along:
        raise InvalidRequest("a mechanism of many bars stays where it is: give the stroke alone, without a place")
    if not isinstance(rank_by, str) or rank_by not in ("deviation", *MOVED):
        known = ", ".join(["deviation", *MOVED])
        raise InvalidRequest(f"mechanisms of many bars are not improved in {quoted(rank_by)}, but in {known}")
    free = _free(one, named("hold", [hold] if isinstance(hold, str) else hold))
    wanted = Constraints.of(constraints)
    task = _Task(one, request, free, rank_by, _bounds(wanted, request), wanted)
    start = task.before()
    if not any(bound.name == "size" and np.isfinite(bound.high) for bound in task.bounds):
        size = Bound("size", -np.inf, MOVES.larger * start.size, request.stroke)
        task = replace(task, bounds=[*task.bounds, size])
    legs = task.legs(start, 1 + MOVES.starts * effort)
    best = None if legs is None else task.best(start, legs)
    if best is not None:
        told = ""
    elif legs is None:
        told = "its drive passes a dead point on the stroke: ask for a part of it, or let another bar drive"
    else:
        told = "no way found to improve it within these bounds: relax one, or hold less"
    rows = [start, *([best] if best is not None else [])]
    return ChainImprovement(rows, told, which=("before", "improved")[: len(rows)])


def _bounds(wanted: Constraints, request: PathRequest) -> list[Bound]:
    """Return the bounds on measures; refuse other constraints but regions."""
    if wanted.pins_only:
        raise InvalidRequest("pins_only is no bound on the improvement of a mechanism of many bars: leave it out")
    what = "a mechanism of many bars"
    return bounds(what, MEASURES, request.stroke, with_constraints(what, MEASURES, {}, wanted))


def _free(one: OwnChain, hold: Sequence[str]) -> list[str]:
    """Return the joints that may move."""
    frame = one.bars["frame"]
    known = [*one.joints, FIXED]
    if wrong := [name for name in hold if name not in known]:
        raise InvalidRequest(f"there is no joint {quoted(wrong[0])} to hold; there are {', '.join(known)}")
    held = {joint for name in hold for joint in (frame if name == FIXED else [name])}
    free = [joint for joint in one.joints if joint not in held]
    if not free:
        raise InvalidRequest("all joints are held: nothing is left to improve")
    return free


@dataclass(frozen=True)
class _Task:
    """A mechanism to improve over a stroke, with its free joints and bounds."""

    one: OwnChain
    request: PathRequest
    free: list[str]
    rank_by: str
    bounds: Sequence[Bound]
    wanted: Constraints

    @property
    def curved(self) -> bool:
        """Whether the path is an arc."""
        return self.request.kind == "circle"

    def measured(self, one: OwnChain) -> Measured:
        """Measure the stretches of a mechanism over the stroke."""
        radius = self.request.radius if self.curved else None
        how: dict[str, Any] = {"radius": radius} if radius is not None else {"arc": self.curved}
        return measure(one, stroke=self.request.stroke, limit=MOVES.stretches, **how)

    def before(self) -> ChainStretch:
        """Return the stretch to improve: the given one, if it has the stroke, else the best."""
        one = self.one
        if isinstance(one, ChainStretch) and (one.radius is not None) == self.curved and self.spans(one):
            return one
        found = self.measured(one)
        if not found:
            raise InvalidRequest(found.explain())
        best: ChainStretch = found[0]
        return best

    def spans(self, one: ChainStretch) -> bool:
        """Tell whether a stretch has the stroke of the request."""
        return abs(one.stroke - self.request.stroke) < MOVES.same * self.request.stroke

    def legs(self, start: ChainStretch, count: int) -> Legs | None:
        """Return the path of a stretch, repeated; None over a dead point."""
        values = {one.name: np.array([0.5 * sum(one.domain[0])]) for one in self.family(start).parameters}
        legs, of = on_one_leg(self.family(start), values, np.array([start._window]).T)
        return legs[np.zeros(count, int)] if len(of) else None

    def family(self, start: ChainStretch) -> ChainFamily:
        """Return the family of the mechanisms with moved joints, in the size of the chain."""
        places = (start.chain.z[:, 0] - centre_of(start)) / start.chain.size[0]
        return _family(start, places, [start.chain.structure.joints.index(name) for name in self.free])

    def best(self, start: ChainStretch, legs: Legs) -> ChainStretch | None:
        """Return the best improvement of a stretch and of displaced copies; None without any."""
        if self.rank_by == "deviation" and self.cost(start) < EXACT_DEVIATION * start.stroke:
            return None
        size, family = float(start.chain.size[0]), self.family(start)
        rng = np.random.default_rng(1)
        values = {}
        for parameter in family.parameters:
            middle = 0.5 * sum(parameter.domain[0])
            values[parameter.name] = middle + MOVES.scatter * np.concatenate([[0.0], rng.normal(size=len(legs) - 1)])
        goal = Goal(self.rank_by, self.bounds, partial(self.outside, centre_of(start)) if self.wanted.regions else None)
        unit = float(start.stroke) / size
        found = refined(family, values, legs, goal, self.request, unit)
        moved, _ = family.placed(found.values)
        best: ChainStretch | None = None
        least = self.cost(start)
        least -= MOVES.gain * abs(least) if np.isfinite(least) else 0.0
        for column in moved.T:
            joints = zip(family.structure.joints, (centre_of(start) + size * column).tolist(), strict=True)
            there = {name: [at.real, at.imag] for name, at in joints if name in self.free}
            for one in self.stretches({**start.joints, **there}):
                if (cost := self.cost(one)) < least:
                    best, least = one, cost
        return best

    def stretches(self, joints: Mapping[str, list[float]]) -> list[ChainStretch]:
        """Return the stretches of the mechanism with moved joints, the best first."""
        try:
            return [*self.measured(OwnChain.of({**self.one.given, "joints": dict(joints)}))]
        except (InvalidLinkage, InvalidRequest):  # it does not close, or is at a dead point
            return []

    def measures(self, one: ChainStretch) -> dict[str, float]:
        """Return the bounded and ranked measures of a stretch."""
        names = {bound.name for bound in self.bounds} | ({self.rank_by} - {"deviation"})
        at = one.circuit.poses(np.linspace(*one._window, GRID.positions)[:, None])
        found = chain_measures(_family(one, one.chain.z[:, 0], []), at, np.ones(1), names)
        turns = {"turns": float(one.circuit.kind[0] == TURN)} if "turns" in names else {}
        return {name: float(value[0]) for name, value in found.items()} | turns

    def outside(self, origin: complex, places: Places) -> Floats:
        """Return how far places, in strokes from an origin, leave the regions [strokes]."""
        stroke = self.request.stroke
        there = (origin + stroke * z for z in (places.fixed, places.joints, places.bars))
        return outside(Places(*there), self.wanted) / stroke

    def cost(self, one: ChainStretch) -> float:
        """Return the ranked number, less is better; infinite where a bound is violated."""
        found = self.measures(one)
        if not all(bound.holds(found[bound.name]) for bound in self.bounds):
            return np.inf
        if self.wanted.regions:
            at = one.circuit.poses(np.linspace(*one._window, GRID.positions)[:, None])
            if outside(places_of(at, lambda z: z), self.wanted)[0] > WEIGHTS.rounding * one.stroke:
                return np.inf
        if self.rank_by == "deviation":
            return one.deviation
        over = one.deviation > self.request.deviation
        return np.inf if over else found[self.rank_by] * (-1.0 if MEASURES[self.rank_by].more else 1.0)


def centre_of(one: OwnChain) -> complex:
    """Return the mean of the joints in the given pose."""
    return complex(one.chain.z[:, 0].mean())


def _family(one: OwnChain, places: Complexes, free: Sequence[int]) -> ChainFamily:
    """Make a family with the coordinates of free joints as parameters [size]."""
    structure = one.chain.structure
    parameters = [
        Parameter(
            f"{axis}{joint}",
            ((value - MOVES.reach, value + MOVES.reach),),
            f"{axis} of joint {structure.joints[joint]}",
        )
        for joint in free
        for axis, value in (("x", float(places[joint].real)), ("y", float(places[joint].imag)))
    ]

    def pose(p: Mapping[str, Floats]) -> dict[str, Any]:
        return {
            name: p[f"x{joint}"] + 1j * p[f"y{joint}"] if joint in free else places[joint]
            for joint, name in enumerate(structure.joints)
        }

    def directions(p: Mapping[str, Floats]) -> list[Any]:
        at = pose(p)
        ways = zip(one.slides, one.chain.u[:, 0], strict=True)
        return [at[slide["along"][1]] - at[slide["along"][0]] if "along" in slide else u for slide, u in ways]

    return ChainFamily("own", "own mechanism", "the user", structure, one.point, parameters, pose, directions)
