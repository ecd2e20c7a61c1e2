"""Poses of all bars of a chain: its groups close in order, in closed form.

A bar carries a point z of the reference pose to  at + turn (z - origin),  where the origin is a
joint of the bar.  A dyad closes at an angle whose squared sine is a product of differences of
lengths, in which no digits are lost near a dead point; its sign is the branch.  With l, c the
lengths of two rods, D the distance of their outer pins, e that of a pin from the line of a slide, h
that of a line from a pin:

====  =============================================
dyad  squared sine
====  =============================================
RRR   ((l + c)^2 - D^2)(D^2 - (l - c)^2) / (2 l c)^2
RRP   (l - e)(l + e) / l^2
RPR   (D - h)(D + h) / D^2
====  =============================================

While it is not negative the dyad closes.  PRP and RPP close while their slides are not parallel:
there the chain runs to infinity.  The sine of the angle between them stands in place of a square.

Source: the closures by two circles, by circle and line, by two lines; see `kinematics.closure`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ..kinematics.closure import turn_between
from ..kinematics.motion import CHANGE
from ..kinematics.plane_vectors import cross, dot
from ..kinematics.types import Complexes, Floats
from .chain import Chain
from .structure import PRP, RPP, RPR, RRP, RRR, Dyad, Link, Turn

#: Least sine of the angle between two slides: nearer to parallel a chain runs to infinity [rad].
NEAR_INFINITY = 0.03


class Directions(NamedTuple):
    """Numbers of directions along which diameters are measured."""

    coarse: int = 36  #: number of directions of a half turn
    fine: int = 10  #: number of finer directions about each one near the diameter


DIRECTIONS = Directions()


@dataclass(frozen=True)
class Poses:
    """Poses of the b bars of n chains at m positions.

    Attributes
    ----------
    chain : Chain
    drive : ndarray, shape (m, n)
        Angle of the drive from its reference pose [rad], or displacement of a driving slider
        [length]. at, turn : complex ndarray, shape (b, m, n) Position of the origin of each bar
        [length], and rotation of the bar as a unit vector.  NaN where the chain does not close.
    origin : complex ndarray, shape (b, n)
        A joint of each bar in the reference pose [length].
    sines : ndarray, shape (d, m, n)
        Squared sines of the dyads; negative where they do not close.
    """

    chain: Chain
    drive: Floats
    at: Complexes
    turn: Complexes
    origin: Complexes
    sines: Floats

    def point(self, bar: int, z: Complexes) -> Complexes:
        """Return the positions of points z (n,) of a bar, shape (m, n)."""
        return np.asarray(self.at[bar] + self.turn[bar] * (z - self.origin[bar]))

    @cached_property
    def transmission(self) -> Floats:
        """Least transmission angle of the dyads, shape (m, n) [deg]; 90 without any."""
        dyads = self.chain.structure.dyads
        if not dyads:
            return np.full(self.drive.shape, 90.0)
        slides = np.array([group.kind in (PRP, RPP) for group in dyads])[:, None, None]
        with np.errstate(invalid="ignore"):
            sines = np.where(slides, self.sines + NEAR_INFINITY, np.sqrt(np.maximum(self.sines, 0)))
        return np.asarray(np.degrees(np.arcsin(np.clip(sines.min(0), 0, 1))))

    @cached_property
    def extent(self) -> Floats:
        """Diameter of all joints at all positions, to 1e-5 of it, shape (n,) [length]."""
        angle = np.pi * np.arange(DIRECTIONS.coarse) / DIRECTIONS.coarse
        wide = np.array([np.ptp((self.places * way).real, axis=0) for way in np.exp(1j * angle)])
        # only directions next to the diameter are as wide as this
        row, column = np.nonzero(wide >= wide.max(0) * np.cos(0.5 * np.pi / DIRECTIONS.coarse))
        widest, places = wide.max(0), self.places[:, column]
        for turn in np.pi / DIRECTIONS.coarse * (np.arange(DIRECTIONS.fine) / DIRECTIONS.fine - 0.5):
            np.maximum.at(widest, column, np.ptp((places * np.exp(1j * (angle[row] + turn))).real, axis=0))
        return np.asarray(widest)

    @cached_property
    def places(self) -> Complexes:
        """All joints at all positions, shape (j m, n)."""
        return np.concatenate([self.joint(j) for j in range(len(self.chain.z))])

    def joint(self, joint: int) -> Complexes:
        """Return the positions of a joint, shape (m, n)."""
        return self.point(min(self.chain.structure.on[joint]), self.chain.z[joint])

    def way(self, slide: int) -> Floats:
        """Return the displacement of a slider from the reference pose, shape (m, n) [length]."""
        structure = self.chain.structure
        rail, slider = (structure.number(name) for name in structure.slides[slide].ends)
        start = self.point(rail, self.origin[slider])
        return np.asarray(dot(self.at[slider] - start, self.turn[rail] * self.chain.u[slide]))


def poses(chain: Chain, drive: Floats, branch: Floats, known: Floats | None = None) -> Poses:
    """Compute the poses of chains.

    Parameters
    ----------
    chain : Chain
    drive : ndarray, shape (m, n) or (m, 1)
        Angle of the drive from its reference pose [rad]; of a slider its way [length].
    branch : ndarray, shape (d, n) or (d, m, n)
        Sign of the sine of each dyad, such as `chain.branch`.
    known : ndarray, shape (d, m, n), optional
        Sines without sign, from `charts`; NaN where they follow from their squares.

    Examples
    --------
    >>> from catalogue.chains.chain import Chain
    >>> from catalogue.chains.structure import Structure
    >>> bars = {"frame": "AD", "crank": "AB", "coupler": "BC", "rocker": "CD"}
    >>> chain = Chain.of(Structure.of(bars, drive="crank"), {"A": 0, "D": 4, "B": 1j, "C": 3 + 2j})
    >>> moved = poses(chain, np.array([[0.0], [np.pi / 2]]), chain.branch)
    >>> moved.joint(3).round(3)[:, 0].tolist()
    [(3+2j), (2+1j)]
    """
    drive = np.asarray(drive, float)
    closing = _Closing(chain, np.broadcast_to(drive, (len(drive), len(chain))))
    signs = branch if branch.ndim == 3 else branch[:, None]
    dyad = 0
    with np.errstate(all="ignore"):
        for group in chain.structure.groups:
            if isinstance(group, Turn):
                closing.turn_bar(group)
            else:
                closing.close(group, dyad, signs[dyad], None if known is None else known[dyad])
                dyad += 1
    return Poses(chain, closing.drive, closing.at, closing.turn, closing.origin, closing.sines)


class _Closing:
    """Poses of n chains, group by group; see `Poses`."""

    def __init__(self, chain: Chain, drive: Floats) -> None:
        structure, n = chain.structure, len(chain)
        self.chain, self.drive = chain, drive
        shape = (len(structure.bars), *drive.shape)
        self.at, self.turn = np.zeros(shape, complex), np.ones(shape, complex)
        self.origin = np.zeros((len(structure.bars), n), complex)
        self.sines = np.empty((len(structure.dyads), *drive.shape))
        self.known: Floats | None = None
        bar, link = structure.driver
        if link.is_slide:
            # any joint of the driving slider serves as its origin
            self.origin[bar] = chain.z[self._any_joint(bar)]
            self.at[bar] = self.origin[bar] + chain.u[link.joint] * drive
        else:
            self.origin[bar] = self.at[bar] = chain.z[link.joint]
            self.turn[bar] = np.exp(1j * drive)

    def _any_joint(self, bar: int) -> int:
        return next(j for j, bars in enumerate(self.chain.structure.on) if bar in bars)

    def _carried(self, bar: int, z: Complexes) -> Complexes:
        return np.asarray(self.at[bar] + self.turn[bar] * (z - self.origin[bar]))

    def _set(self, bar: int, origin: Complexes, at: Complexes, turn: Complexes) -> None:
        self.origin[bar], self.at[bar], self.turn[bar] = origin, at, turn

    def _pin(self, link: Link) -> tuple[Complexes, Complexes]:
        """Return an outer pin in the reference pose, and its present position."""
        z = self.chain.z[link.joint]
        return z, self._carried(link.to, z)

    def turn_bar(self, group: Turn) -> None:
        """Turn a wheel, or a bar kept parallel."""
        rate, ratio = self.chain.structure.rates[group.bar], group.gear.ratio
        if rate is not None:
            turn: Any = np.exp(1j * float(rate) * self.drive)
        else:
            whole = round(ratio)
            turn = _power(self.turn[group.wheel], whole) * _power(self.turn[group.carrier], 1 - whole)
        z, at = self._pin(group.pin)
        self._set(group.bar, z, at, turn)

    def close(self, group: Dyad, number: int, sign: Floats, known: Floats | None) -> None:
        """Close a dyad on a branch."""
        self.known = known
        {RRR: self._triangle, RRP: self._on_line, RPR: self._along}.get(group.kind, self._crossing)(group, number, sign)

    def _root(self, square: Floats, sign: Floats) -> Floats:
        """Return a sine from its square and sign; 0 where rounding made the square negative."""
        root = np.sqrt(np.where((square < 0) & (square > -CHANGE), 0.0, square))
        if self.known is not None:
            root = np.where(np.isnan(self.known), root, self.known)
        return np.asarray(sign * root)

    def _triangle(self, group: Dyad, number: int, sign: Floats) -> None:
        (z_a, a), (z_b, b) = (self._pin(link) for link in group.outer)
        z_c = self.chain.z[group.inner]
        way, back = z_c - z_a, z_c - z_b
        first, second = np.abs(way), np.abs(back)
        goal = b - a
        apart = np.abs(goal)
        outside = (first + second - apart) * (first + second + apart)
        inside = (apart - np.abs(first - second)) * (apart + np.abs(first - second))
        square = self.sines[number] = outside * inside / (2 * first * second) ** 2
        along = 0.5 * (apart**2 + (first - second) * (first + second))
        turn = turn_between(goal, way, along + 1j * first * second * self._root(square, sign))
        end = turn * way - goal
        self._set(group.first, z_a, a, turn)
        closed = end * back.conj()
        self._set(group.second, z_b, b, closed / np.abs(closed))

    def _on_line(self, group: Dyad, number: int, sign: Floats) -> None:
        (z_a, a), rail = self._pin(group.outer[0]), group.outer[1]
        z_c = self.chain.z[group.inner]
        way, turned = z_c - z_a, self.turn[rail.to]
        normal, start = turned * 1j * self.chain.u[rail.joint], self._carried(rail.to, z_c)
        length, off = np.abs(way), dot(normal, start - a)
        square = self.sines[number] = (length - off) * (length + off) / length**2
        turn = turn_between(normal, way, off + 1j * length * self._root(square, sign))
        self._set(group.first, z_a, a, turn)
        self._set(group.second, z_c, a + turn * way, turned)

    def _along(self, group: Dyad, number: int, sign: Floats) -> None:
        (z_a, a), (z_b, b) = (self._pin(link) for link in group.outer)
        normal = 1j * self.chain.u[group.inner]
        goal, off = b - a, dot(normal, z_b - z_a)
        apart = np.abs(goal)
        square = self.sines[number] = (apart - np.abs(off)) * (apart + np.abs(off)) / apart**2
        turn = turn_between(goal, normal, off + 1j * apart * self._root(square, sign))
        self._set(group.first, z_a, a, turn)
        self._set(group.second, z_b, b, turn)

    def _crossing(self, group: Dyad, number: int, sign: Floats) -> None:
        """Close two sliders on one pin (PRP), or a slider on a bar that slides (RPP)."""
        one, other = group.outer
        turned = self.turn[other.to]
        along = turned * self.chain.u[other.joint]
        if group.kind == PRP:
            z = self.chain.z[group.inner]
            start, turn = self._carried(one.to, z), self.turn[one.to]
            across = turn * self.chain.u[one.joint]
        else:  # the pinned bar rotates with the slider
            z, start = self._pin(one)
            turn = turned
            across = turned * self.chain.u[group.inner]
        sine = cross(along, across) * sign
        self.sines[number] = sine - NEAR_INFINITY
        off = start - self._carried(other.to, z)
        at = start - across * cross(along, off) / (sine * sign)
        at = np.where(sine > 0, at, np.nan)
        self._set(group.second, z, at, turned)
        self._set(group.first, z, at if group.kind == PRP else start, turn)


def _power(turn: Complexes, exponent: int) -> Any:
    """Return a whole power of unit vectors."""
    return turn**exponent if exponent >= 0 else turn.conj() ** -exponent
