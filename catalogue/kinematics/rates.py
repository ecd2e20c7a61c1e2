"""Velocities and accelerations of the coupler, per unit angular velocity of the drive.

Each dyad constrains a coupler point P: the moving pivot of a crank or slider, or the coupler point
at the fixed pivot of a slide.  Along the ray n of the dyad the velocity of P vanishes and its
acceleration is known:

    n . v(P) = 0
    n . a(P) = -|v(P)|^2 / length       (crank)
             = 0                        (slider)
             = 2 n . (i omega v(P))     (slide: Coriolis)

The pin of the driving crank has the velocity i (P - A) and the acceleration -(P - A) at unit
angular velocity.  These are three linear equations each for velocity and acceleration of the
coupler.  At a dead point of the driving crank they contradict each other: NaN.

Source: the usual velocity and acceleration analysis; W. Hartenberg and J. Denavit, Kinematic
Synthesis of Linkages, 1964, ch. 4.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .batch import Rows
from .linkage import RP, RR, Linkage
from .plane_vectors import dot
from .types import Complexes, Floats, Integers

#: Largest relative determinant of the three equations at which the drive is at a dead point. It is
#: the sine of the angle between driving and driven ray times coupler length over size.
DEAD_POINT_SINE = 1e-12


@dataclass(frozen=True)
class Rates(Rows):
    """First and second derivatives of n couplers by the angle of their drives.

    Attributes
    ----------
    origin, velocity, acceleration : complex ndarray, shape (n,)
        A coupler point, its velocity [length/rad] and acceleration [length/rad^2].
    omega, alpha : ndarray, shape (n,)
        Angular velocity of the coupler over that of the drive, and its derivative [1/rad].
    """

    origin: Complexes
    velocity: Complexes
    acceleration: Complexes
    omega: Floats
    alpha: Floats

    def velocity_of(self, z: Complexes) -> Complexes:
        """Return the velocities of coupler points z, shape (..., n) [length/rad]."""
        return np.asarray(self.velocity + 1j * self.omega * (z - self.origin))

    def acceleration_of(self, z: Complexes) -> Complexes:
        """Return the accelerations of coupler points z, shape (..., n) [length/rad^2]."""
        return np.asarray(self.acceleration + (1j * self.alpha - self.omega**2) * (z - self.origin))

    def crank(self, linkage: Linkage, i: int) -> tuple[Floats, Floats]:
        """Compute angular velocity and acceleration of crank i, (n,) each.

        NaN if dyad i is no crank.
        """
        spoke, pin = linkage.points[:, i, 1] - linkage.points[:, i, 0], linkage.points[:, i, 1]
        with np.errstate(all="ignore"):
            of = (self.velocity_of(pin), self.acceleration_of(pin))
            spin, gain = (dot(1j * spoke / np.abs(spoke), way / np.abs(spoke)) for way in of)
        crank = linkage.dyads[:, i] == RR
        return np.where(crank, spin, np.nan), np.where(crank, gain, np.nan)


def rates(linkage: Linkage, drive: Integers) -> Rates:
    """Compute the rates of linkages at unit angular velocity of their drives.

    `drive` (n,) is 0 or 1 for the crank of a dyad, 2 for the coupler.  NaN at a dead point of the
    drive, and where the dyad is no crank.
    """
    z, rays, kinds = linkage.points, linkage.rays, linkage.dyads
    row = np.arange(len(linkage))
    held = np.where(kinds == RP, z[:, :, 0], z[:, :, 1])
    crank = np.minimum(drive, 1)
    origin = held.mean(1)
    pivot, pin = z[row, crank].T
    spoke = np.where(drive == 2, 1.0, pin - pivot)
    length = np.abs(spoke)
    tangent = 1j * spoke / length
    unit = np.where(linkage.size > 0, linkage.size, 1.0)  # scale of the unknowns: v and omega have comparable sizes
    rows = [_row(rays[:, i], (held[:, i] - origin) / unit) for i in (0, 1)]
    of_drive = _row(tangent, (pin - origin) / unit)
    of_drive[:, drive == 2] = np.array([[0.0], [0.0], [1.0]])
    speed = np.where(drive == 2, unit, np.where(kinds[row, crank] == RR, length, np.nan))
    zero = np.zeros(len(linkage))
    first = _solved([*rows, of_drive], [zero, zero, speed])
    v, omega = first[0] + 1j * first[1], first[2] / unit
    right = []
    for i in (0, 1):
        at = held[:, i] - origin
        moving = v + 1j * omega * at
        reach = np.abs(z[:, i, 1] - z[:, i, 0])
        own = np.where(kinds[:, i] == RR, -np.abs(moving) * (np.abs(moving) / reach), 0.0)
        own = np.where(kinds[:, i] == RP, 2 * dot(rays[:, i], 1j * omega * moving), own)
        right.append(own + omega**2 * dot(rays[:, i], at))
    driven = np.where(drive == 2, 0.0, omega**2 * dot(tangent, pin - origin))
    second = _solved([*rows, of_drive], [*right, driven])
    return Rates(origin, v, second[0] + 1j * second[1], omega, second[2] / unit)


def _row(normal: Complexes, at: Complexes) -> Floats:
    """Return the coefficients of (Re v, Im v, omega) in normal . (v + i omega at), shape (3, n)."""
    return np.stack([normal.real, normal.imag, dot(normal, 1j * at)])


def _solved(rows: list[Floats], right: list[Floats]) -> Floats:
    """Solve n systems of three linear equations, shape (3, n); NaN where they are singular."""
    a, b, c = rows
    pairs = [np.cross(x, y, axis=0) for x, y in ((b, c), (c, a), (a, b))]
    determinant = (a * pairs[0]).sum(0)
    scale = np.abs(a).max(0) * np.abs(pairs[0]).max(0)
    with np.errstate(all="ignore"):
        found = sum(x * y for x, y in zip(pairs, right, strict=True)) / determinant
    return np.asarray(np.where(np.abs(determinant) <= DEAD_POINT_SINE * scale, np.nan, found))
