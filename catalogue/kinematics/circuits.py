"""Circuits: all positions a linkage reaches without disassembly, as a smooth motion of a phase s.

A crank leads, or the coupler if there is no crank.  With p and q of `closure`:

- Neither p nor q lies between -1 and 1: the crank turns fully, phi = s.  There are two circuits,
  one for each sign of the root.
- Otherwise the crank swings between dead points, phi = m - a cos s.  The root changes its sign at
  them like sin s, so that the circuit, to and fro, is smooth in s.  If both p and q are in that
  range, there are two such circuits.
- At a change point (p = -1 or q = 1) a factor of the root is the sine or cosine of half the angle.
  The motion passes it smoothly, and may take two turns to close.

A leading coupler turns fully, or (swinging block) half a turn from infinity to infinity.

Source: Grashof 1883 for the conditions.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, Self

import numpy as np

from .batch import Columns
from .closure import Closure, Swing, columns, turn_between
from .linkage import PR, RP, RR, Linkage
from .motion import Pose
from .plane_vectors import cross, dot
from .types import Array, Floats, Indices, Integers, Mask

#: Angle of a leading coupler before infinity at which its circuit ends [rad].
NEAR_INFINITY = 0.03
TURN, SWING, OPEN = range(3)
COUPLER = 2


class Carriers(Protocol):
    """k circuits along which bodies carry points: `Circuits`, or those of chains of many bars."""

    @property
    def of(self) -> Indices: ...
    @property
    def kind(self) -> Array: ...
    @property
    def period(self) -> Floats: ...
    @property
    def is_immobile(self) -> Mask: ...
    def __len__(self) -> int: ...
    def __getitem__(self, index: object, /) -> Self: ...
    def pose(self, s: Floats) -> Pose: ...


@dataclass(frozen=True)
class Circuits(Columns):
    """k circuits of n linkages; arrays of shape (k,).

    Attributes
    ----------
    linkage : Linkage
        Linkages (k,), each in its given position.
    of : ndarray of int
        Number of the linkage of each circuit, 0 to n - 1.
    lead : ndarray of int
        Number of the dyad whose crank leads, 0 or 1; 2: the coupler.
    kind : ndarray of int
        `TURN`: the lead turns fully; `SWING`: it swings between dead points; `OPEN`: it runs from
        infinity to infinity.
    centre, half : ndarray
        Parameters of the lead's angle, by kind: phi = centre + s; centre - half cos s; centre +
        half (s / pi - 1) [rad].
    sign : ndarray
        Sign of the root in the equation that closes the linkage.
    period : ndarray
        2 pi, or 4 pi [rad].
    phase : ndarray
        Phase s of the given position; NaN if it is not on this circuit.
    """

    linkage: Linkage
    of: Indices
    lead: Integers
    kind: Integers
    centre: Floats
    half: Floats
    sign: Floats
    period: Floats
    phase: Floats
    closure: Closure

    def __len__(self) -> int:
        return len(self.of)

    @property
    def is_immobile(self) -> Mask:
        """Whether the chain closes in one position only, (k,)."""
        return np.asarray(self.closure.stuck & (self.lead != COUPLER))

    @property
    def is_joined(self) -> Mask:
        """Whether the two circuits of the linkage cross at its change points, (k,)."""
        two = (self.kind == TURN) & self.closure.change.all(0)
        return np.asarray(two & (self.lead != COUPLER))

    def angle(self, s: Floats) -> Floats:
        """Compute the angle of the lead at phases (m, k) [rad].

        It is measured from the axis of the lead; for a coupler from its given position.
        """
        swing, run = self.centre - self.half * np.cos(s), self.centre + self.half * (s / np.pi - 1)
        return np.asarray(np.where(self.kind == TURN, s, np.where(self.kind == SWING, swing, run)))

    def pose(self, s: Floats) -> Pose:
        """Return the poses at phases (m, k)."""
        led = self.lead == COUPLER
        if not led.any():
            return _by_crank(self, s)
        if led.all():
            return _by_coupler(self, s)
        parts = [(np.flatnonzero(some), function) for some, function in ((led, _by_coupler), (~led, _by_crank))]
        poses = [function(self[some], s[:, some]) for some, function in parts]
        order = np.argsort(np.concatenate([some for some, _ in parts]))
        return Pose(*(np.concatenate(values, axis=-1)[..., order] for values in zip(*poses, strict=True)))

    def phases(self, pose: Pose) -> list[float]:
        """Compute the phases of poses (m, 1) of a single circuit [rad].

        They lie within half a period of the phase of the given position.
        """
        at = float(self.phase[0])
        if self.lead[0] == COUPLER:
            turn = np.angle(1 + pose.x[:, 0]) * (1 if self.kind[0] == TURN else np.pi / float(self.half[0]))
            return [at + float(angle) for angle in turn]
        there = circuits(pose.linkages(self.linkage))
        half = 0.5 * float(self.period[0])
        away = there.phase[np.isfinite(there.phase)] - at
        return [at + float(x) for x in np.mod(away + half, 2 * half) - half]


def circuits(linkage: Linkage) -> Circuits:
    """Find all circuits of linkages (n,).

    They are sorted by linkage; the circuit of the given position comes first.  The leading crank is
    the first that turns fully, else the first crank.
    """
    cranks = linkage.dyads == RR
    free = np.full((2, len(linkage)), 3)
    for i in (0, 1):
        some = np.flatnonzero(cranks[:, i])
        if len(some):
            seen = Closure.of(linkage[some], np.full(len(some), i))
            free[i, some] = np.where(seen.dead.any(0), 2, seen.change.any(0))
    lead = np.where(cranks.any(1), np.argmin(free, axis=0), COUPLER)
    closure = Closure.of(linkage, np.minimum(lead, 1))
    led = lead == COUPLER
    parts = [_crank_circuits(closure, np.flatnonzero(~led)), _coupler_circuits(linkage, np.flatnonzero(led))]
    of, kind, centre, half, sign, period, phase = (np.concatenate(values) for values in zip(*parts, strict=True))
    order = np.lexsort((np.isnan(phase), of))
    of = of[order].astype(int)
    centre, half, sign, period, phase = (values[order] for values in (centre, half, sign, period, phase))
    kind = kind[order].astype(int)
    return Circuits(linkage[of], of, lead[of], kind, centre, half, sign, period, phase, closure[of])


def _crank_circuits(every: Closure, rows: Indices) -> tuple[Array, ...]:
    """Find the circuits led by cranks.

    Returns
    -------
    tuple of ndarray, shape (k,)
        Number of the linkage, kind, centre, half, sign, period and phase, as in `Circuits`.
    """
    of = every[rows]
    phi, side = of.angle, np.where(of.side < 0, -1.0, 1.0)
    dead, change = of.dead.sum(0), of.change.sum(0)
    # beyond a change point the root has the sign opposite to `side`
    passed = np.where(of.change[0] & (np.cos(0.5 * phi) < 0), -1.0, 1.0)
    found: list[tuple[Array, ...]] = []

    def add(which: Mask, kind: int, centre: Floats, half: Floats, sign: Floats, turns: int, phase: Floats) -> None:
        columns = (rows, np.full(len(rows), kind), centre, half, sign, np.full(len(rows), 2 * np.pi * turns), phase)
        found.append(tuple(np.asarray(column)[which] for column in columns))

    none, one, nan = np.zeros(len(rows)), np.ones(len(rows)), np.full(len(rows), np.nan)
    root = passed * np.where(of.change[1] & (np.sin(0.5 * phi) < 0), -1.0, 1.0)
    add((dead == 0) & (change == 1), TURN, none, none, one, 2, phi + np.where(root != side, 2 * np.pi, 0))
    for sign in (1.0, -1.0):
        add((dead == 0) & (change != 1), TURN, none, none, sign * one, 1, np.where(sign == side * root, phi, nan))
    by_p = of.dead[0]
    centre, half = np.where(by_p, 0.0, np.pi), np.where(by_p, of.at[0], np.pi - of.at[1])
    away = np.where(by_p, phi, np.mod(phi, 2 * np.pi))
    root = np.where(of.change[0] & (np.cos(0.5 * away) < 0) | of.change[1] & (np.sin(0.5 * away) < 0), -side, side)
    add(dead == 1, SWING, centre, half, one, 1, _swinging(away, centre, half, root))
    centre, half = 0.5 * of.at.sum(0), 0.5 * (of.at[0] - of.at[1])
    for sign in (1.0, -1.0):  # the two circuits mirror each other in the axis
        there = np.where(sign * phi > 0, _swinging(np.abs(phi), centre, half, side), nan)
        add(dead == 2, SWING, sign * centre, sign * half, one, 1, there)
    return tuple(np.concatenate(values) for values in zip(*found, strict=True))


def _swinging(phi: Floats, centre: Floats, half: Floats, side: Floats) -> Floats:
    """Compute the phases of swinging cranks: forth where the root is positive, else back."""
    with np.errstate(all="ignore"):
        low, high = np.maximum(phi - centre + half, 0), np.maximum(centre + half - phi, 0)
        return np.asarray(side * 2 * np.arctan2(np.sqrt(low), np.sqrt(high)))


def _by_crank(some: Circuits, s: Floats) -> Pose:
    """Return poses about the crank pins."""
    of, swing, phi = some.closure, Swing.of(some.kind == SWING, some.centre, some.half, s), s
    if swing is not None:
        phi = s.copy()
        phi[:, swing.which] = swing.phi
    ahead = np.empty(phi.shape, complex)
    cosine, sine = ahead.real, ahead.imag = np.cos(0.5 * phi), np.sin(0.5 * phi)
    root = some.sign * of.root(phi, cosine, sine, swing)
    pin = of.pivot + of.arm * ahead**2
    turn = np.empty_like(pin)
    with np.errstate(all="ignore"):
        for kind in (RR, PR, RP):
            if not (here := of.kind == kind).any():
                continue
            which = columns(here)
            r, f, k, y = of.r[which], of.f[which], of.square[which], root[:, which]
            goal = of.goal[which] if kind == PR else of.goal[which] - pin[:, which]
            side = np.empty(y.shape, complex)
            if kind == PR:
                side.real, side.imag = k - r * (2 * cosine[:, which] ** 2 - 1), r * y
            elif kind == RP:
                side.real, side.imag = k, np.sqrt(2 * r * f) * y
            else:
                square = (r - f) ** 2 + 4 * r * f * sine[:, which] ** 2
                side.real, side.imag = 0.5 + k / square, r * f / square * y
            turn[:, which] = turn_between(goal, of.way[which], side)
    return Pose(pin - of.pin, turn - 1, of.pin)


def _coupler_circuits(linkage: Linkage, rows: Indices) -> tuple[Array, ...]:
    """Find the circuits led by the coupler, as columns like those of `_crank_circuits`."""
    kind = linkage.dyads[rows]
    block = (kind == RP).sum(1) == 1
    none, one = np.zeros(len(rows)), np.ones(len(rows))
    found = [tuple(np.asarray(c)[~block] for c in (rows, TURN + none, none, none, one, 2 * np.pi * one, none))]
    sine = np.where(kind[:, 0] == RP, -1.0, 1.0) * linkage.sine[rows]
    cosine = (linkage.rays[rows, 0].conj() * linkage.rays[rows, 1]).real
    # at these rotations of the coupler the rays are parallel and its point is at infinity
    start = np.arctan2(sine, cosine)
    for k in (0, 1):
        centre, half = np.mod(-start, np.pi) + np.pi * (k - 0.5), (0.5 * np.pi - NEAR_INFINITY) * one
        # for a position closer to infinity than `NEAR_INFINITY` the phase is outside 0 ... 2 pi
        phase = np.pi * (1 - centre / half) if k == 0 else np.full(len(rows), np.nan)
        columns = (rows, OPEN + none, centre, half, one, 2 * np.pi * one, phase)
        found.append(tuple(np.asarray(column)[block] for column in columns))
    return tuple(np.concatenate(values) for values in zip(*found, strict=True))


def _by_coupler(some: Circuits, s: Floats) -> Pose:
    """Return poses about a finite point of the couplers."""
    z, slide = some.linkage.points, some.linkage.dyads == RP
    turn = np.exp(1j * some.angle(s))
    origin = np.where(slide[:, 0], z[:, 0, 0], z[:, 0, 1])
    normal, level = [], []
    for i in (0, 1):
        fixed, moving = z[:, i, 0], z[:, i, 1]
        of_slide = turn * moving
        normal.append(np.where(slide[:, i], of_slide, fixed))
        rest = dot(of_slide, fixed) - dot(moving, fixed - origin)
        level.append(np.where(slide[:, i], rest, dot(fixed, moving) - dot(fixed, turn * (moving - origin))))
    with np.errstate(all="ignore"):
        at = 1j * (normal[0] * level[1] - normal[1] * level[0]) / cross(normal[0], normal[1])
    return Pose(at - origin, turn - 1, origin)
