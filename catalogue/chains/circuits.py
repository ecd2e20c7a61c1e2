"""Circuits of chains: the motion through dead and change points, as a function of a phase.

From an end of its drive a chain runs to the next one in a *leg*.  There a dyad is stretched out or
folded; its branch changes, and the drive runs back.  The angle of the drive is  (low + high)/2 -
(high - low)/2 cos(phase)  on a leg, in which poses are smooth at both ends.  If the dyads only
touch such a position, at a change point, the leg continues there on another branch, as the smooth
motion does.  Where slides become parallel the chain runs to infinity, and the circuit is open.

The ends are zeros of the squared sines of `poses`, found by bisection; minima below `CHANGE` are
change points.  Near them `charts` keep the digits that a small difference of lengths loses.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev

from ..errors import InvalidLinkage
from ..kinematics.circuits import OPEN, SWING, TURN
from ..kinematics.motion import CHANGE, Pose
from ..kinematics.types import Array, Floats, Indices, Mask
from .chain import Chain
from .charts import CHART, NODES, Charts, fit_charts
from .poses import Poses, poses
from .structure import PRP, RPP


@dataclass(frozen=True)
class FollowOptions:
    """Limits of the search for dead and change points.

    Attributes
    ----------
    steps, pushed_steps : int
        Number of sampled positions of the drive between which ends are sought: per turn; over the
        range `farthest` of a sliding drive, which usually ends in a small part of it.
    max_turn : float
        Largest change of a bar's direction between two positions; where it is exceeded, their
        number is quadrupled [rad].
    refinements : int
        Largest number of quadruplings.
    farthest : float
        Range of a sliding drive within which ends are sought [size of the chain].
    shallow : float
        Sampled minimum of a squared sine above which it has no zero nearby: between two positions
        bars turn by less than `max_turn`.
    minimum_rounds, minimum_samples : int
        Rounds of the search for a minimum, each of which narrows the bracket to an eighth, and
        samples per round.
    secants, bisections : int
        Numbers of steps to the end of a piece: by secants, then by bisection; the latter is more
        than a double has bits.
    nearest : float
        Half the width of a bracket that secants leave to bisection, over its place [steps].
    together : float
        Distance of two minima below which they are one change point [steps].
    dead : float
        Squared sine at the end of a piece below which a further dyad is at its dead point too.
    max_pieces : int
        Most pieces of a circuit, from one dead or change point to the next.
    max_turns : int
        Largest number of turns of the drive after which a chain with change points is back.
    """

    steps: int = 192
    pushed_steps: int = 1536
    max_turn: float = 0.4
    refinements: int = 2
    farthest: float = 20.0
    shallow: float = 0.05
    minimum_rounds: int = 9
    minimum_samples: int = 17
    secants: int = 25
    bisections: int = 60
    nearest: float = 1e-15
    together: float = 1e-3
    dead: float = 1e-12
    max_pieces: int = 64
    max_turns: int = 4


FOLLOW = FollowOptions()


class Event(IntEnum):
    """Event at the end of a piece; `NONE` stands for no piece."""

    BACK = 0
    DEAD_POINT = 1
    CHANGE_POINT = 2
    INFINITY = 3
    NONE = 4


#: Fields of `ChainCircuits` whose last axis runs along the chains.
PER_CHAIN = ("of", "kind", "period", "phase", "width", "low", "high", "bounds", "branch")


@dataclass(frozen=True)
class ChainCircuits:
    """Circuits of n chains through their given poses; arrays of shape (n,) unless said.

    Attributes
    ----------
    chain : Chain
    bar : int
        The bar that carries the guided point.
    of : ndarray of int
        Numbers of the chains.
    kind : ndarray of int
        `TURN`, `SWING` or `OPEN`; see `kinematics.circuits`.
    period, phase : ndarray
        Period of the whole circuit; phase of the given pose [rad].
    width : ndarray
        Width of a leg in phase [rad].
    low, high : ndarray, shape (l, n)
        Drive at the start and the end of each leg [rad or length].
    bounds : ndarray, shape (p, n)
        Phases at which the pieces end; infinite where there are fewer.
    branch : ndarray, shape (p, d, n)
        Signs of the dyads on each piece.
    charts : Charts
        Charts at the ends of the pieces.
    """

    chain: Chain
    bar: int
    of: Indices
    kind: Array
    period: Floats
    phase: Floats
    width: Floats
    low: Floats
    high: Floats
    bounds: Floats
    branch: Floats
    charts: Charts

    def __len__(self) -> int:
        return len(self.of)

    def __getitem__(self, index: Any) -> ChainCircuits:
        arrays = {name: getattr(self, name)[..., index] for name in PER_CHAIN}
        return replace(self, chain=self.chain[index], charts=self.charts[index], **arrays)

    @property
    def is_immobile(self) -> Mask:
        """Whether a chain cannot move, (n,): always False, as no chain is given at a dead point."""
        return np.zeros(len(self), bool)

    @property
    def leg_count(self) -> Indices:
        """Number of legs, (n,)."""
        return np.rint(self.period / self.width).astype(int)

    def phase_of(self, drive: Floats, branch: Floats) -> Floats:
        """Return the phases of drives (n,) with those signs of the dyads (d, n); NaN beyond."""
        phase = np.full(len(self), np.nan)
        for leg, (low, high) in enumerate(zip(self.low, self.high, strict=True)):
            turned = np.where(self.kind == TURN, drive, self.width * (leg + _share(drive, low, high)))
            here = (leg < self.leg_count) & ((self.kind == TURN) | ((drive - low) * (high - drive) >= 0))
            here &= (self.drive(turned[None])[1][:, 0] == branch).all(0)
            phase = np.where(here & np.isnan(phase), turned, phase)
        return phase

    def drive(self, s: Floats) -> tuple[Floats, Array, Floats | None]:
        """Return drive (m, n), branch and known sines (d, m, n) at phases (m, n)."""
        inside = np.where(self.kind == OPEN, np.clip(s, 0, self.period), np.mod(s, self.period))
        known = np.where(np.isnan(inside), 0.0, inside)
        count = np.isfinite(self.bounds).sum(0)
        piece = np.minimum((known >= self.bounds[:, None]).sum(0), count - 1)
        leg = np.minimum((known / self.width).astype(int), self.leg_count - 1)
        column = np.arange(len(self))
        low, high = self.low[leg, column], self.high[leg, column]
        share = 0.5 * np.pi * (inside / self.width - leg)
        begun, left = (high - low) * np.sin(share) ** 2, (high - low) * np.cos(share) ** 2
        turns = self.kind == TURN
        drive = np.where(share > 0.25 * np.pi, high - left, low + begun)
        drive = np.where(turns, inside, drive)
        branch = np.moveaxis(self.branch[piece, :, column], -1, 0)
        return np.where(turns, s, drive), branch, self._near(drive, np.abs(begun), np.abs(left), piece, count)

    def _near(self, drive: Floats, begun: Floats, left: Floats, piece: Array, count: Array) -> Floats | None:
        """Return the sines of dyads near the ends of pieces, by their charts."""
        if not self.charts.reach.any():
            return None
        column, found = np.broadcast_to(np.arange(len(self)), drive.shape), None
        # x is negative at the end of a piece, positive at the start of the next one
        before = np.where(piece > 0, piece - 1, count - 1)
        for end, side, way in ((piece, -1.0, left), (before, 1.0, begun)):
            reach = self.charts.reach[end, column]
            dead = self.charts.is_dead[end, column]
            x = side * np.where(dead, np.sqrt(way), np.abs(drive - self.charts.drive[end, column]))
            near = np.abs(x) < reach
            if near.any():
                found = np.full((len(self.chain.structure.dyads), *drive.shape), np.nan) if found is None else found
                found[:, near] = self.charts.sines(end[near], column[near], x[near])
        return found

    def poses(self, s: Floats) -> Poses:
        """Compute the poses of all bars at phases (m, n)."""
        return poses(self.chain, *self.drive(s))

    def pose(self, s: Floats) -> Pose:
        """Return the poses of the bar with the guided point at phases (m, n)."""
        found = self.poses(s)
        return Pose(found.at[self.bar] - found.origin[self.bar], found.turn[self.bar] - 1, found.origin[self.bar])


def circuits(chain: Chain, bar: int) -> ChainCircuits:
    """Follow n chains round the circuits on which they are given.

    Parameters
    ----------
    chain : Chain
    bar : int
        Number of the bar that carries the guided point.

    Raises
    ------
    InvalidLinkage
        If a circuit has more than 64 pieces.

    Examples
    --------
    >>> from catalogue.chains.structure import Structure
    >>> bars = {"frame": "AD", "crank": "AB", "coupler": "BC", "rocker": "CD"}
    >>> chain = Chain.of(Structure.of(bars, drive="crank"), {"A": 0, "D": 4, "B": 3j, "C": 2 + 3j})
    >>> found = circuits(chain, bar=2)
    >>> found.kind.tolist() == [SWING], len(found.low)
    (True, 2)
    """
    found, followed = followed_circuits(chain, bar)
    if len(followed) < len(chain):
        raise InvalidLinkage(
            f"a circuit has more than {FOLLOW.max_pieces} dead and change points, or {FOLLOW.max_turns} turns of its "
            "drive"
        )
    return found


def followed_circuits(chain: Chain, bar: int) -> tuple[ChainCircuits, Indices]:
    """Follow chains round their circuits, and return the numbers of those that come back, (k,)."""
    walk = _Walk(chain, np.ones(len(chain)), np.zeros(len(chain)), chain.branch)
    pieces = walk.run()
    lost = walk.lost
    some = np.flatnonzero(walk.open & ~lost)
    if len(some):  # start again from the end at infinity
        back = _Walk(chain[some], -walk.way[some], walk.at[some], walk.sign[:, some])
        pieces = pieces.replaced(some, back.run())
        lost[some] = back.lost
    found = pieces.circuits(chain, bar, walk)
    kept = np.flatnonzero(~lost & ~np.isnan(found.phase))
    return replace(found[kept], of=np.arange(len(kept))), kept


@dataclass(frozen=True)
class _Pieces:
    """Pieces of n walks, in order; arrays (p, n), signs (p, d, n)."""

    start: Floats
    end: Floats
    event: Array
    sign: Floats

    def replaced(self, some: Indices, by: _Pieces) -> _Pieces:
        """Replace the walks of some chains."""
        count = max(len(self.start), len(by.start))
        found = []
        for mine, theirs, fill in zip(self._arrays(), by._arrays(), (np.nan, np.nan, Event.NONE, 0.0), strict=True):
            grown = np.full((count, *mine.shape[1:]), fill, mine.dtype)
            grown[: len(mine)] = mine
            grown[..., some] = fill
            grown[: len(theirs), ..., some] = theirs
            found.append(grown)
        return _Pieces(*found)

    def _arrays(self) -> tuple[Array, ...]:
        return self.start, self.end, self.event, self.sign

    def circuits(self, chain: Chain, bar: int, walk: _Walk) -> ChainCircuits:
        """Join the pieces to circuits, parametrised by a phase."""
        n, column, turns = len(chain), np.arange(len(chain)), walk.turning
        count = (self.event != Event.NONE).sum(0)
        number = np.arange(len(self.start))[:, None]
        # a swing is followed from the middle of a leg: the pieces of its last leg come first
        swings = ~turns & ~walk.open
        dead = (self.event == Event.DEAD_POINT) & (number < count)
        turned = np.where(swings, count - 1 - np.where(dead, number, -1).max(0) - 1, 0)
        kept = np.where(swings, count - 1, count)
        order = np.where(number < turned, number + kept - turned, number - turned)
        there = number < kept
        order = np.where(there, order, 0)
        start, end, event = (np.take_along_axis(values, order, 0) for values in (self.start, self.end, self.event))
        sign = np.take_along_axis(self.sign, order[:, None], 0)
        begin = np.where(swings, self.start[count - 1, column], start[0])
        first = there & swings & (order == 0)
        start[first] = np.broadcast_to(begin, start.shape)[first]
        leg = np.zeros(start.shape, int)
        leg[1:] = np.cumsum(event[:-1] == Event.DEAD_POINT, axis=0)
        leg = np.where(there, leg, 0)
        legs = leg.max(0) + 1
        low, high = (np.zeros((int(legs.max()), n)) for _ in "01")
        for p in range(len(start)):
            here = there[p]
            begins = here if p == 0 else here & (event[p - 1] == Event.DEAD_POINT)
            low[leg[p][begins], column[begins]] = start[p][begins]
            high[leg[p][here], column[here]] = end[p][here]
        width = np.where(turns, walk.period, np.where(walk.open, 2 * np.pi / legs, np.pi))
        bounds = np.full(start.shape, np.inf)
        phase = np.where(turns, 0.0, np.nan)
        for p in range(len(start)):
            swung = width * (leg[p] + _share(end[p], low[leg[p], column], high[leg[p], column]))
            bounds[p] = np.where(there[p], np.where(turns, end[p], swung), np.inf)
            home = there[p] & ((start[p] <= 0) == (end[p] >= 0)) & (sign[p] == chain.branch).all(0) & np.isnan(phase)
            given = width * (leg[p] + _share(np.zeros(n), low[leg[p], column], high[leg[p], column]))
            phase = np.where(home, given, phase)
        kind = np.where(turns, TURN, np.where(walk.open, OPEN, SWING))
        period = np.where(turns, walk.period, width * legs)
        start, end = (np.where(there, values, np.nan) for values in (start, end))
        zeros = [there & (event == one) for one in (Event.DEAD_POINT, Event.CHANGE_POINT)]
        charts = fit_charts(chain, start, end, sign, *zeros)
        return ChainCircuits(chain, bar, column, kind, period, phase, width, low, high, bounds, sign, charts)


def _share(drive: Floats, low: Floats, high: Floats) -> Floats:
    """Return the share of a leg's phase at a position of the drive."""
    with np.errstate(all="ignore"):
        return np.asarray(2 / np.pi * np.arcsin(np.sqrt(np.clip((drive - low) / (high - low), 0, 1))))


class _Walk:
    """Walks of n chains from one dead or change point to the next; arrays (n,), signs (d, n)."""

    def __init__(self, chain: Chain, way: Floats, at: Floats, sign: Floats) -> None:
        n = len(chain)
        self.chain, self.way, self.at, self.sign = chain, way.copy(), at.copy(), sign.copy()
        self.first = (way.copy(), at.copy(), sign.copy())
        turn = 2 * np.pi * chain.structure.turns
        self.reach = FOLLOW.farthest * chain.size if chain.structure.is_pushed else np.full(n, turn)
        self.open: Mask = np.zeros(n, bool)
        self.lost: Mask = np.zeros(n, bool)
        self.turning: Mask = np.zeros(n, bool)
        self.period = np.zeros(n)

    def run(self) -> _Pieces:
        """Walk until the chains are back where they started, or at infinity."""
        some, n, d = np.arange(len(self.chain)), len(self.chain), len(self.sign)
        pieces: list[tuple[Array, ...]] = []
        while len(some):
            if len(pieces) > FOLLOW.max_pieces:
                self.lost[some] = True
                break
            at, way, sign = self.at[some], self.way[some], self.sign[:, some]
            end, event, dead = _next_event(self.chain[some], at, way, self.reach[some], sign)
            end, event = self._stopped(some, end, event)
            piece = (np.full(n, np.nan), np.full(n, np.nan), np.full(n, int(Event.NONE)), np.zeros((d, n)))
            for values, new in zip(piece, (at, end, event, sign), strict=True):
                values[..., some] = new
            pieces.append(piece)
            self.at[some] = end
            self.sign[:, some] = np.where(dead & (event != Event.BACK), -sign, sign)
            self.way[some] = np.where(event == Event.DEAD_POINT, -way, way)
            self.open[some] = event == Event.INFINITY
            some = some[(event != Event.BACK) & (event != Event.INFINITY)]
        return _Pieces(*(np.array(values) for values in zip(*pieces, strict=True)))

    def _stopped(self, some: Indices, end: Floats, event: Array) -> tuple[Floats, Array]:
        """Return where chains stop and why.

        They stop before the event if they pass their start in the direction and on the branches in
        which they left it.
        """
        way, home, sign = (values[..., some] for values in self.first)
        at, reach = self.at[some], self.reach[some]
        like = (self.sign[:, some] == sign).all(0) & (self.way[some] == way)
        swings = like & ((home - at) * way > 0) & ((end - home) * way > 0)
        turns = np.floor((at - home) * way / reach + 1e-9) + 1
        ahead = home + way * turns * reach
        passed = like & ~swings & ((end - ahead) * way >= -1e-9 * reach) & (not self.chain.structure.is_pushed)
        self.lost[some] = turns > FOLLOW.max_turns
        self.turning[some], self.period[some] = passed, turns * reach
        event = np.where(
            swings | passed | self.lost[some], Event.BACK, np.where(event == Event.BACK, Event.CHANGE_POINT, event)
        )
        return np.where(swings, home, np.where(passed, ahead, end)), event


def _next_event(
    chain: Chain, at: Floats, way: Floats, reach: Floats, sign: Floats, steps: int = 0, rounds: int = 0
) -> tuple[Floats, Array, Mask]:
    """Find the next dead or change point of chains (n,) from a position of their drives.

    Returns
    -------
    ndarray, ndarray of int, ndarray of bool
        Drive and event there, (n,), and which dyads change their branch, (d, n).  `BACK` stands for
        none within reach.
    """
    n = len(chain)
    steps = steps or (FOLLOW.pushed_steps if chain.structure.is_pushed else FOLLOW.steps * chain.structure.turns)
    step = 1.02 * reach * way / steps

    def squares(which: Indices, t: Floats) -> Floats:
        return poses(chain[which], at[which] + step[which] * t, sign[:, which]).sines

    t = np.arange(steps + 1.0)
    found = poses(chain, at + step * t[:, None], sign)
    bad = ~(found.sines >= -CHANGE).all(0)
    first = np.where(bad.any(0), bad.argmax(0), steps + 1)
    sound = (t[:-1, None] + 1) < first
    with np.errstate(all="ignore"):
        rough = (np.where(sound, np.abs(np.diff(found.turn, axis=1)).max(0), 0) > FOLLOW.max_turn).any(0)
    # brackets of the first end: the drive is feasible at `low`, not at `high`
    low, high = first - 1.0, first.astype(float)
    ends = first <= steps
    touch = np.full(n, np.inf)
    inner = found.sines[:, 1:-1]
    dip = (inner < FOLLOW.shallow) & (inner <= found.sines[:, :-2]) & (inner < found.sines[:, 2:])
    dyad, row, which = np.nonzero(dip & (t[1:-1, None] < first))
    if len(which):
        own = np.arange(len(which))
        place, least = _minimum(lambda x: squares(which, x)[dyad, :, own].T, row + 1.0)
        exact = _double_zero(lambda x: squares(which, x)[dyad, :, own].T, place)
        crossed = least < -CHANGE
        touched = ~crossed & (least <= CHANGE)
        # dyads driven through another one at its change point have theirs at the same drive: the
        # first one determines it
        for k in np.flatnonzero(touched)[np.lexsort((dyad[touched], which[touched]))]:
            if place[k] < touch[which[k]] - FOLLOW.together:
                touch[which[k]] = exact[k]
        for k in np.flatnonzero(crossed & (row < low[which])):
            if row[k] < low[which[k]]:
                low[which[k]], high[which[k]], ends[which[k]] = float(row[k]), place[k], True
    some = np.flatnonzero(ends)
    with np.errstate(all="ignore"):
        low[some], high[some] = _narrowed(lambda x: _least(squares(some, x[None])[:, 0]), low[some], high[some])
    touches = touch < np.where(ends, low - 1e-6, np.inf)
    place = np.where(touches, touch, np.where(ends, low, steps / 1.02))
    end = at + step * place
    there = squares(np.arange(n), place[None])[:, 0]
    bends = np.array([group.kind not in (PRP, RPP) for group in chain.structure.dyads], bool).reshape(-1, 1)
    passed = squares(np.arange(n), np.where(ends, high, place)[None])[:, 0] < 0
    dead = bends & np.where(touches, there <= 2 * CHANGE, ends & (passed | (there <= FOLLOW.dead)))
    event = np.where(
        touches,
        Event.CHANGE_POINT,
        np.where(~ends, Event.BACK, np.where(dead.any(0), Event.DEAD_POINT, Event.INFINITY)),
    )
    if chain.structure.is_pushed:
        event = np.where(event == Event.BACK, Event.INFINITY, event)
    again = np.flatnonzero(rough)
    if len(again) and rounds < FOLLOW.refinements:
        fine = _next_event(chain[again], at[again], way[again], reach[again], sign[:, again], 4 * steps, rounds + 1)
        for values, new in zip((end, event, dead), fine, strict=True):
            values[..., again] = new
    return end, event, dead


def _minimum(function: Any, near: Array) -> tuple[Floats, Floats]:
    """Minimise a function of (m, k) within 1 of places (k,)."""
    low, high = near - 1, near + 1
    share = np.linspace(0, 1, FOLLOW.minimum_samples)[:, None]
    column = np.arange(len(near))
    for _ in range(FOLLOW.minimum_rounds):
        x = low + share * (high - low)
        values = function(x)
        values = np.where(np.isnan(values), -np.inf, values)
        least = values.argmin(0)
        low = x[np.maximum(least - 1, 0), column]
        high = x[np.minimum(least + 1, len(share) - 1), column]
    return x[least, column], values[least, column]


def _double_zero(function: Any, near: Floats) -> Floats:
    """Return the minima of a smooth function near places (k,), by polynomials on either side."""
    series = chebyshev.chebfit(NODES, np.nan_to_num(function(near + NODES[:, None])), CHART.degree)
    first, second = chebyshev.chebder(series), chebyshev.chebder(series, 2)
    off = np.zeros_like(near)
    for _ in range(3):
        slope, bend = (chebyshev.chebval(off, part, tensor=False) for part in (first, second))
        with np.errstate(all="ignore"):
            off = off - np.nan_to_num(slope / bend)
    return np.where(np.abs(off) < 0.1, near + off, near)


def _least(squares: Floats) -> Floats:
    """Return the least squared sine of dyads (d, k); negative where any does not close."""
    least = np.fmin.reduce(squares, axis=0, initial=np.inf)
    return np.where(np.isnan(squares).any(0) & (least >= 0), np.nan, least)


def _narrowed(function: Any, low: Floats, high: Floats) -> tuple[Floats, Floats]:
    """Narrow brackets to the last place (k,) where a function is not negative, nor NaN.

    It is so at `low`, not at `high`. Secants (Illinois) come near, bisection as near as doubles do.
    """
    # a piece begins where the function is about zero: it is halved there first
    at_low, at_high = np.full(len(low), np.inf), function(high)
    before = np.zeros(len(low), bool)
    for _ in range(FOLLOW.secants):
        near = FOLLOW.nearest * np.maximum(high, 1.0)
        wide = high - low > 2 * near
        if not wide.any():
            break
        place = high - at_high * (high - low) / (at_high - at_low)
        # beside an end that is the zero itself the bracket closes from the other side
        place = np.clip(place, low + near, high - near)
        place = np.where(wide & np.isfinite(place) & np.isfinite(at_low), place, 0.5 * (low + high))
        value = function(place)
        good = value >= 0
        half = np.where(good == before, 0.5, 1.0)  # of the value at the end that stays twice
        low, high = np.where(good, place, low), np.where(good, high, place)
        at_low, at_high, before = np.where(good, value, half * at_low), np.where(good, half * at_high, value), good
    for _ in range(FOLLOW.bisections):
        middle = 0.5 * (low + high)
        if not ((middle > low) & (middle < high)).any():
            break
        good = function(middle) >= 0
        low, high = np.where(good, middle, low), np.where(good, high, middle)
    return low, high
