"""Refine mechanisms of many bars from where they are: move their joints within bounds."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from ..errors import InvalidLinkage, InvalidRequest, quoted
from ..given import names as named
from ..given import whole
from ..guides.chain_stretch import ChainStretch
from ..guides.own_chain import OwnChain
from ..guides.results import ChainImprovement, Measured
from ..kinematics.types import Complexes, Floats
from ..plugin.refine_mechanisms import refined
from ..problem.constraints import Constraints
from ..problem.path import PathRequest, path_request
from ..series.chain_family import ChainFamily
from ..series.series import Parameter
from .measure import measure

#: Name that holds all joints of the frame.
FIXED = "fixed-pivots"


@dataclass(frozen=True)
class Moves:
    """Sizes and numbers of the moves of joints.

    Attributes
    ----------
    reaches : tuple of float
        Largest moves of a coordinate, tried in turn [size]: a bound violated by a long move may
        hold after a shorter one.
    repeats : int
        Number of successive refinements, each over the best stretch of the one before.
    gain : float
        Least gain of a refinement that is followed by another [deviations].
    starts : int
        Number of displaced copies to start from, per unit of effort.
    scatter : float
        Standard deviation of a coordinate of such a copy [size].
    scales : tuple of float
        Scales of the copies about the frame, used in turn: smaller copies turn more over the
        stroke, and meet bounds on the size.
    shares : tuple of float
        Fractions of a refinement to try where the whole of it violates a bound.
    larger : float
        Largest size if it is not bounded [sizes before].
    exact : float
        Deviation below which differences are rounding [strokes].
    """

    reaches: tuple[float, ...] = (0.4, 0.1, 0.02)
    repeats: int = 4
    gain: float = 0.01
    starts: int = 10
    scatter: float = 0.04
    scales: tuple[float, ...] = (1.0, 0.9, 0.8, 0.7)
    shares: tuple[float, ...] = (1.0, 0.5, 0.2)
    larger: float = 1.1
    exact: float = 1e-12


MOVES = Moves()


def improve_chain(
    one: OwnChain,
    request: PathRequest,
    *,
    hold: str | Sequence[str] = (),
    rank_by: str | Mapping[str, float] = "deviation",
    effort: int = 1,
    **constraints: Any,
) -> ChainImprovement:
    """Reduce the deviation of a mechanism over a stroke by moving its joints.

    The mechanism stays where it is.  Without `max_size` it becomes at most a tenth larger.

    Parameters
    ----------
    one : OwnChain
    request : StraightLine or CircularArc
        Stroke, and the deviation to reach.
    hold : str or sequence of str
        Names of joints to keep where they are in the given pose, or ``fixed-pivots`` for all joints
        of the frame.
    rank_by : str
        ``deviation`` only.
    effort : int
        Multiple of the usual number of starts.
    **constraints
        `max_size` and `min_transmission`; others are refused.

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
    if rank_by != "deviation":
        raise InvalidRequest(f"mechanisms of many bars are improved in deviation only, not in {quoted(rank_by)}")
    wanted, free = _bounds(constraints), _free(one, named("hold", [hold] if isinstance(hold, str) else hold))
    task = _Task(one, request, free, wanted)
    start = task.before()
    most = wanted.max_size if constraints.get("max_size") is not None else MOVES.larger * start.size
    best = replace(task, wanted=replace(wanted, max_size=most)).best(start, effort)
    told = "" if best is not None else "no way found to improve it within these bounds: relax one, or hold less"
    rows = [start, *([best] if best is not None else [])]
    return ChainImprovement(rows, told, which=("before", "improved")[: len(rows)])


def _bounds(given: Mapping[str, Any]) -> Constraints:
    """Return the bounds; refuse constraints other than size and transmission angle."""
    wanted, plain = Constraints.of(given), Constraints()
    for one in fields(Constraints):
        if one.name not in ("max_size", "min_transmission") and getattr(wanted, one.name) != getattr(plain, one.name):
            raise InvalidRequest(
                f"{one.name} is no bound on the improvement of a mechanism of many bars; max_size and min_transmission "
                "are"
            )
    return wanted


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
    wanted: Constraints

    @property
    def curved(self) -> bool:
        """Whether the path is an arc."""
        return self.request.kind == "circle"

    def measured(self, one: OwnChain) -> Measured:
        """Measure the stretches of a mechanism over the stroke."""
        radius = self.request.radius if self.curved else None
        how: dict[str, Any] = {"radius": radius} if radius is not None else {"arc": self.curved}
        return measure(one, stroke=self.request.stroke, limit=1, **how)

    def before(self) -> ChainStretch:
        """Return the stretch to improve: the given one, if it has the stroke, else the best."""
        one, request = self.one, self.request
        if isinstance(one, ChainStretch) and (one.radius is not None) == self.curved and one.stroke == request.stroke:
            return one
        found = self.measured(one)
        if not found:
            raise InvalidRequest(found.explain())
        best: ChainStretch = found[0]
        return best

    def best(self, start: ChainStretch, effort: int) -> ChainStretch | None:
        """Return the best improvement of a stretch and of displaced copies."""
        found: ChainStretch | None = None
        if start.deviation < MOVES.exact * start.stroke and self.is_within(start):
            return None
        for first in (start, *self.displaced(start, MOVES.starts * effort)):
            for reach in MOVES.reaches:
                better = self.repeated(first, reach)
                if better is not None and better.deviation < (start if found is None else found).deviation:
                    found = better
                if better is not None:
                    break
        gained = found is not None and (
            found.deviation < (1 - MOVES.gain) * start.deviation or not self.is_within(start)
        )
        return found if gained else None

    def displaced(self, start: ChainStretch, count: int) -> Iterator[ChainStretch]:
        """Yield the best stretches of copies with displaced joints, no larger than permitted."""
        rng, size = np.random.default_rng(1), float(start.chain.size[0])
        centre = np.mean([start.joints[name] for name in start.bars["frame"]], axis=0)
        shrunk = min(1.0, (self.wanted.max_size or np.inf) / start.size)
        for k in range(count):
            joints, scale = dict(start.joints), shrunk * MOVES.scales[k % len(MOVES.scales)]
            for name in self.free:
                place = centre + scale * (np.array(joints[name]) - centre)
                x, y = place + MOVES.scatter * size * rng.normal(size=2)
                joints[name] = [float(x), float(y)]
            yield from self.stretches(joints)[:1]

    def stretches(self, joints: Mapping[str, list[float]]) -> list[ChainStretch]:
        """Return the stretches of the mechanism with moved joints, the best first."""
        try:
            return [*self.measured(OwnChain.of({**self.one.given, "joints": dict(joints)}))]
        except (InvalidLinkage, InvalidRequest):  # the moved mechanism does not close, or is at a dead point
            return []

    def repeated(self, start: ChainStretch, reach: float) -> ChainStretch | None:
        """Refine a stretch until the gain is small; None if the first step leaves the bounds."""
        now, found = start, None
        for _ in range(MOVES.repeats):
            better = self.refined(now, reach)
            if better is None or (found is not None and better.deviation > (1 - MOVES.gain) * found.deviation):
                break
            now = found = better
        return found

    def is_within(self, one: ChainStretch) -> bool:
        """Tell whether a stretch meets the bounds."""
        size, angle = self.wanted.max_size, self.wanted.min_transmission
        return (size is None or one.size <= size) and one.min_transmission >= (angle or 0.0)

    def refined(self, start: ChainStretch, reach: float) -> ChainStretch | None:
        """Refine the free joints of a stretch within a reach [size] and the bounds."""
        z, size = start.chain.z[:, 0], float(start.chain.size[0])
        centre = complex(z.mean())
        structure, places = start.chain.structure, (z - centre) / size
        family = _family(start, places, [structure.joints.index(name) for name in self.free], reach)
        values = {p.name: np.array([0.5 * sum(p.domain[0])]) for p in family.parameters}
        window = np.array([sorted(start._window)]).T
        try:
            better = refined(family, values, window, self.curved)
        except np.linalg.LinAlgError:
            return None
        if better is None or not better.moved[0]:
            return None
        moved, _ = family.placed(better.values)
        for share in MOVES.shares:
            found = zip(structure.joints, (z + share * (centre + size * moved[:, 0] - z)).tolist(), strict=True)
            joints = {name: [at.real, at.imag] for name, at in found if name in self.free}
            within = [one for one in self.stretches({**start.joints, **joints}) if self.is_within(one)]
            if within and (within[0].deviation < start.deviation or not self.is_within(start)):
                return within[0]
        return None


def _family(one: OwnChain, places: Complexes, free: Sequence[int], reach: float) -> ChainFamily:
    """Make a family with the coordinates of free joints as parameters [size]."""
    structure = one.chain.structure
    parameters = [
        Parameter(f"{axis}{joint}", ((value - reach, value + reach),), f"{axis} of joint {structure.joints[joint]}")
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
