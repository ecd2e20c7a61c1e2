"""Velocities, accelerations and derivatives by the reference pose, group by group.

All three are tangents of the closing conditions.  With V(W) the velocity of a bar's point at W, a
dyad leaves two unknown speeds, x of its first bar and y of its second (rotations of rods, or
slidings), in one complex equation

    x e + y f = r

=========  =========  ==========
dyad       e          f
=========  =========  ==========
RRR        i (C - A)  -i (C - B)
RRP        i (C - A)  -t
RPR        i (B - A)  t
PRP, RPP   t          -t'
=========  =========  ==========

with t the direction of a slide; r collects the motion of the known bars and of the reference pose.
The equation is singular where the sine of the dyad vanishes, at a dead or change point.

Source: the usual velocity and acceleration analysis; J. J. Uicker, G. R. Pennock, J. E. Shigley,
Theory of Machines and Mechanisms, 2003, ch. 3 and 4.  The derivatives follow by the implicit
function theorem.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..kinematics.plane_vectors import cross
from ..kinematics.rates import DEAD_POINT_SINE
from ..kinematics.types import Array, Complexes, Floats
from .poses import Poses
from .structure import PRP, RPP, RPR, RRP, RRR, Dyad, Link, Turn


class Speed(NamedTuple):
    """Velocity of a bar's origin, and its rotation; arrays (..., m, n)."""

    move: Complexes
    spin: Array


@dataclass(frozen=True)
class Rates:
    """First and second derivatives of all bars by the drive; NaN at dead and change points.

    Attributes
    ----------
    poses : Poses
    velocity, acceleration : complex ndarray, shape (b, m, n)
        Velocity and acceleration of the origin of each bar [length/rad], [length/rad^2]; with a
        driving slider [1], [1/length].
    omega, alpha : ndarray, shape (b, m, n)
        Angular velocity of each bar over that of the drive, and its derivative.
    """

    poses: Poses
    velocity: Complexes
    acceleration: Complexes
    omega: Floats
    alpha: Floats

    def velocity_of(self, bar: int, z: Complexes) -> Complexes:
        """Return the velocities of points z (n,) of a bar, shape (m, n)."""
        return np.asarray(self.velocity[bar] + 1j * self.omega[bar] * self._away(bar, z))

    def acceleration_of(self, bar: int, z: Complexes) -> Complexes:
        """Return the accelerations of points z (n,) of a bar, shape (m, n)."""
        twist = 1j * self.alpha[bar] - self.omega[bar] ** 2
        return np.asarray(self.acceleration[bar] + twist * self._away(bar, z))

    def _away(self, bar: int, z: Complexes) -> Complexes:
        return np.asarray(self.poses.turn[bar] * (z - self.poses.origin[bar]))


@dataclass(frozen=True)
class Slopes:
    """Derivatives of all bars by the reference pose, at a fixed drive.

    The k coordinates are x and y of each joint, then the angle of each slide: k = 2 j + s.

    Attributes
    ----------
    poses : Poses
    move : complex ndarray, shape (b, k, m, n)
        Derivatives of the positions of the bars' origins, which are points fixed in the reference
        plane.
    spin : ndarray, shape (b, k, m, n)
        Derivatives of the angles of the bars [rad].
    """

    poses: Poses
    move: Complexes
    spin: Floats

    def of_joint(self, joint: int) -> Complexes:
        """Return the derivatives of the position of a joint, complex, shape (k, m, n)."""
        here = self.poses
        bar = min(here.chain.structure.on[joint])
        away = here.turn[bar] * (here.chain.z[joint] - here.origin[bar])
        slope = self.move[bar] + 1j * self.spin[bar] * away
        slope[2 * joint] += here.turn[bar]
        slope[2 * joint + 1] += 1j * here.turn[bar]
        return np.asarray(slope)


def rates(poses: Poses) -> Rates:
    """Compute velocities and accelerations by the drive.

    Examples
    --------
    >>> from catalogue.chains.chain import Chain
    >>> from catalogue.chains.poses import poses as closed
    >>> from catalogue.chains.structure import Structure
    >>> bars = {"frame": "AD", "crank": "AB", "coupler": "BC", "rocker": "CD"}
    >>> chain = Chain.of(Structure.of(bars, drive="crank"), {"A": 0, "D": 2, "B": 1j, "C": 2 + 1j})
    >>> parallelogram = rates(closed(chain, np.array([[0.5]]), chain.branch))
    >>> parallelogram.omega[1::2, 0, 0].round(12).tolist()  # of crank and rocker
    [1.0, 1.0]
    """
    first = _Velocities(poses)
    first.run()
    second = _Accelerations(poses, first)
    second.run()
    return Rates(poses, first.move, second.move, first.spin, second.spin)


def slopes(poses: Poses) -> Slopes:
    """Compute the derivatives of all bars by the coordinates of the reference pose."""
    found = _Slopes(poses)
    found.run()
    return Slopes(poses, found.move, found.spin)


class _Tangent:
    """Solves the tangent of the closing conditions, group by group.

    Subclasses override the terms that velocities, accelerations and derivatives add.
    """

    def __init__(self, poses: Poses, *many: int) -> None:
        bars, m, n = poses.at.shape
        self.poses, self.chain = poses, poses.chain
        self.move = np.zeros((bars, *many, m, n), complex)
        self.spin = np.zeros((bars, *many, m, n))
        #: Speeds of each group: x of its first bar, y of its second.
        self.speeds: list[tuple[Array, Array]] = []

    # terms that differ between velocities, accelerations and derivatives

    def drive(self) -> tuple[float, float]:
        """Return rotation and sliding of the drive."""
        return 0.0, 0.0

    def carried(self, bar: int, place: Complexes) -> Complexes:
        """Return the velocity of a bar's point that is at a place (m, n)."""
        return np.asarray(self.move[bar] + 1j * self.spin[bar] * (place - self.poses.at[bar]))

    def shifted(self, joint: int, one: int, other: int) -> Array | float:  # noqa: ARG002  # other orders use it
        """Return the shift of a joint in bar `one` minus its shift in bar `other`."""
        return 0.0

    def swung(self, slide: int, rail: int, slider: int, speed: Array | float) -> Array | float:  # noqa: ARG002  # other orders use it
        """Return the velocity of a slider relative to its rail, without the sliding along it."""
        return 0.0

    def turned(self, place: Array, pin: Array, speed: Array | float) -> Array | float:  # noqa: ARG002  # other orders use it
        """Compute the centripetal acceleration of a place by a rotation about a pin."""
        return 0.0

    def known(self, group: int) -> tuple[Array | float, Array | float]:  # noqa: ARG002  # other orders use it
        """Return the known speeds of a group, whose squares enter its accelerations."""
        return 0.0, 0.0

    # closing conditions of the groups

    def run(self) -> None:
        with np.errstate(all="ignore"):
            self._driver()
            for number, group in enumerate(self.chain.structure.groups):
                if isinstance(group, Turn):
                    self._turn(group, number)
                else:
                    self._dyad(group, number)

    def _driver(self) -> None:
        structure = self.chain.structure
        bar, link = structure.driver
        spin, sliding = self.drive()
        self.spin[bar] = spin
        if link.is_slide:
            along = self.chain.u[link.joint]
            self.move[bar] = sliding * along + self.swung(link.joint, structure.frame, bar, 0.0)
            return
        self._pinned(bar, self._pin(link, bar), self.poses.joint(link.joint), spin, spin)

    def _pin(self, link: Link, bar: int) -> Complexes:
        """Return the velocity of a bar's point at an outer pin."""
        return np.asarray(self.carried(link.to, self.poses.joint(link.joint)) + self.shifted(link.joint, link.to, bar))

    def _pinned(
        self, bar: int, velocity: Complexes, place: Complexes, spin: Floats | float, known: Floats | float
    ) -> None:
        """Set the motion of a bar from its spin and the velocity of one point."""
        away = self.poses.at[bar] - place
        self.spin[bar] = spin
        self.move[bar] = velocity + 1j * spin * away + self.turned(self.poses.at[bar], place, known)

    def _turn(self, group: Turn, number: int) -> None:
        ratio = group.gear.ratio
        spin = ratio * self.spin[group.wheel] + (1 - ratio) * self.spin[group.carrier]
        self.speeds.append((spin, spin))
        self._pinned(
            group.bar, self._pin(group.pin, group.bar), self.poses.joint(group.pin.joint), spin, self.known(number)[0]
        )

    def _dyad(self, group: Dyad, number: int) -> None:
        {RRR: self._triangle, RRP: self._on_line, RPR: self._along, PRP: self._two_slides, RPP: self._block}[
            group.kind
        ](group, number)

    def _solve(self, e: Complexes, f: Complexes, r: Complexes) -> tuple[Floats, Floats]:
        sine = cross(e, f)
        sine = np.where(np.abs(sine) > DEAD_POINT_SINE * np.abs(e) * np.abs(f), sine, np.nan)
        x, y = cross(r, f) / sine, cross(e, r) / sine
        self.speeds.append((x, y))
        return x, y

    def _triangle(self, group: Dyad, number: int) -> None:
        (one, other), p, q = group.outer, group.first, group.second
        a, b, c = (self.poses.joint(joint) for joint in (one.joint, other.joint, group.inner))
        at_a, at_b, (kx, ky) = self._pin(one, p), self._pin(other, q), self.known(number)
        r = at_b + self.turned(c, b, ky) - at_a - self.turned(c, a, kx) + self.shifted(group.inner, q, p)
        x, y = self._solve(1j * (c - a), -1j * (c - b), np.asarray(r))
        self._pinned(p, at_a, a, x, kx)
        self._pinned(q, at_b, b, y, ky)

    def _slider(self, rail: Link, bar: int, place: Array, sliding: Array | float) -> Array:
        """Return the velocity of a slider's point at a place, without its sliding."""
        return np.asarray(self.carried(rail.to, place) + self.swung(rail.joint, rail.to, bar, sliding))

    def _on_line(self, group: Dyad, number: int) -> None:
        (one, rail), p, q = group.outer, group.first, group.second
        a, c = self.poses.joint(one.joint), self.poses.joint(group.inner)
        along, at_a, (kx, ky) = self._direction(rail.joint, rail.to), self._pin(one, p), self.known(number)
        at_c = self._slider(rail, q, c, ky)
        r = at_c - at_a - self.turned(c, a, kx) + self.shifted(group.inner, q, p)
        x, y = self._solve(1j * (c - a), -along, np.asarray(r))
        self._pinned(p, at_a, a, x, kx)
        self._slid(q, rail, ky, y, along)

    def _slid(self, bar: int, rail: Link, known: Array | float, sliding: Array, along: Array) -> None:
        self.spin[bar] = self.spin[rail.to]
        self.move[bar] = self._slider(rail, bar, self.poses.at[bar], known) + sliding * along

    def _along(self, group: Dyad, number: int) -> None:
        (one, other), p, q = group.outer, group.first, group.second
        a, b = self.poses.joint(one.joint), self.poses.joint(other.joint)
        along, at_a, at_b = self._direction(group.inner, p), self._pin(one, p), self._pin(other, q)
        kx, ky = self.known(number)
        r = at_b - at_a - self.turned(b, a, kx) - self.swung(group.inner, p, q, ky)
        x, _ = self._solve(1j * (b - a), along, np.asarray(r))
        self._pinned(p, at_a, a, x, kx)
        self._pinned(q, at_b, b, x, kx)

    def _two_slides(self, group: Dyad, number: int) -> None:
        (one, other), p, q = group.outer, group.first, group.second
        c, (kx, ky) = self.poses.joint(group.inner), self.known(number)
        along, across = self._direction(one.joint, one.to), self._direction(other.joint, other.to)
        r = self._slider(other, q, c, ky) - self._slider(one, p, c, kx) + self.shifted(group.inner, q, p)
        x, y = self._solve(along, -across, np.asarray(r))
        self._slid(p, one, kx, x, along)
        self._slid(q, other, ky, y, across)

    def _block(self, group: Dyad, number: int) -> None:
        (one, rail), p, q = group.outer, group.first, group.second
        a, at_q, (kx, ky) = self.poses.joint(one.joint), self.poses.at[q], self.known(number)
        self._pinned(p, self._pin(one, p), a, self.spin[rail.to], self._squared(rail.to))
        along, across = self._direction(rail.joint, rail.to), self._direction(group.inner, p)
        inner = Link(True, group.inner, p)
        on_rail, on_bar = self._slider(rail, q, at_q, kx), self._slider(inner, q, at_q, ky)
        x, _ = self._solve(along, -across, on_bar - on_rail)
        self._slid(q, rail, kx, x, along)

    def _squared(self, bar: int) -> Array | float:  # noqa: ARG002  # other orders use it
        """Return the angular velocity of a bar, whose square enters its accelerations."""
        return 0.0

    def _direction(self, slide: int, bar: int) -> Complexes:
        return np.asarray(self.poses.turn[bar] * self.chain.u[slide])


class _Velocities(_Tangent):
    def drive(self) -> tuple[float, float]:
        return (0.0, 1.0) if self.chain.structure.is_pushed else (1.0, 0.0)


class _Accelerations(_Tangent):
    """Second derivatives; the squares of the first ones enter the right side."""

    def __init__(self, poses: Poses, first: _Velocities) -> None:
        super().__init__(poses)
        self.first = first

    def carried(self, bar: int, place: Complexes) -> Complexes:
        twist = 1j * self.spin[bar] - self.first.spin[bar] ** 2
        return np.asarray(self.move[bar] + twist * (place - self.poses.at[bar]))

    def swung(self, slide: int, rail: int, slider: int, speed: Array | float) -> Array | float:  # noqa: ARG002  # other orders use it
        return np.asarray(2j * self.first.spin[rail] * speed * self._direction(slide, rail))

    def turned(self, place: Array, pin: Array, speed: Array | float) -> Array | float:
        return np.asarray(-(speed**2) * (place - pin))

    def known(self, group: int) -> tuple[Array | float, Array | float]:
        return self.first.speeds[group]

    def _squared(self, bar: int) -> Array | float:
        return np.asarray(self.first.spin[bar])


class _Slopes(_Tangent):
    """Derivatives by the coordinates of the reference pose."""

    def __init__(self, poses: Poses) -> None:
        self.places = len(poses.chain.z)
        super().__init__(poses, 2 * self.places + len(poses.chain.u))

    def shifted(self, joint: int, one: int, other: int) -> Array:
        shift = np.zeros(self.move.shape[1:], complex)
        shift[2 * joint] = self.poses.turn[one] - self.poses.turn[other]
        shift[2 * joint + 1] = 1j * shift[2 * joint]
        return shift

    def swung(self, slide: int, rail: int, slider: int, speed: Array | float) -> Array:  # noqa: ARG002  # other orders use it
        here = self.poses
        way = here.at[slider] - here.at[rail] - here.turn[rail] * (here.origin[slider] - here.origin[rail])
        swing = np.zeros(self.move.shape[1:], complex)
        swing[2 * self.places + slide] = 1j * way
        return swing
