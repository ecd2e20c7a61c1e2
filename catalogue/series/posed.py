"""Posed problems: a point to be guided, the kind of its path, and given pivots.

A series may have closed-form solutions. A problem is one pair, the centre A and the point A*, one
of which may be at infinity: without a centre the path is a straight line, without a point the
coupler carries a straight slot over the centre. The inverse problem exchanges the two, and fixed
pivots with moving ones. So a series that solves problems of given fixed pivots has an inversion
that solves those of moving ones.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import wraps
from typing import NamedTuple

import numpy as np

from ..kinematics.linkage import homogeneous
from ..kinematics.plane_vectors import dot
from ..kinematics.types import Array, Complexes, Floats, Mask, read_only


class PosedTolerance(NamedTuple):
    """Tolerances for special positions in a posed problem."""

    #: Distance from the pole up to which a point counts as at the pole, and so is not guided to
    #: order 3 [distances of the pivots].
    at_pole: float = 1e-9
    mirrored: float = 1e-9  #: difference up to which two points are mirror images [their distance]


POSED = PosedTolerance()


@dataclass(frozen=True)
class Posed:
    """n problems: guide a coupler point, in one position, along a line or circle; read only.

    Attributes
    ----------
    given : str
        ``fixed`` or ``moving``: both such pivots; ``crank``: the fixed and the moving pivot of one
        crank.
    pivots : complex ndarray, shape (n, 2)
        The given pivots in the posed position.
    point, centre : complex ndarray, shape (n,)
        The guided point, and the centre of its path; NaN where at infinity, which must hold for the
        whole batch.
    axis : complex ndarray, shape (n,)
        Unit vectors across the path, from the centre to the point.
    """

    given: str
    pivots: Complexes
    point: Complexes
    centre: Complexes
    axis: Complexes

    def __post_init__(self) -> None:
        for name in ("pivots", "point", "centre", "axis"):
            object.__setattr__(self, name, read_only(getattr(self, name)))

    @property
    def path(self) -> str:
        """``line``, ``circle`` or ``slot``."""
        return "line" if np.isnan(self.centre).all() else "slot" if np.isnan(self.point).all() else "circle"

    @property
    def inverted(self) -> Posed:
        """The problems of the inverse motion."""
        swap = {"fixed": "moving", "moving": "fixed", "crank": "crank"}
        pivots = self.pivots[:, ::-1] if self.given == "crank" else self.pivots
        return Posed(swap[self.given], pivots, self.centre, self.point, -self.axis)

    def reciprocals(self, pole: Complexes) -> tuple[Floats, Floats]:
        """Reciprocal distances 1/r and 1/r* of centre and point from poles on the axis.

        0 at infinity, NaN at the pole.
        """
        near = POSED.at_pole * np.abs(pole[:, None] - self.pivots).sum(1)
        r, r_star = (dot(self.axis, z - pole) for z in (self.centre, self.point))
        one, other = (np.where(np.isnan(x), 0, np.where(np.abs(x) > near, 1 / x, np.nan)) for x in (r, r_star))
        return one, other


Solve = Callable[[Posed], Floats | None]


def dual(solve: Solve) -> Solve:
    """Derive the solver of the inverse problems from `solve`."""

    @wraps(solve)
    def solved(posed: Posed) -> Floats | None:
        found = solve(posed.inverted)
        return None if found is None else found[..., ::-1, :]

    return solved


def unit(a: Array) -> Complexes:
    """Normalise vectors."""
    return np.asarray(a / np.abs(a))


def four_bars(fixed: Complexes, moving: Sequence[tuple[Complexes, Complexes]]) -> Floats:
    """Assemble pivots (n, k, 2, 2, 3) from the fixed and moving pivots of k solutions.

    NaN where they are not finite.
    """
    both = np.stack([np.stack(pair, axis=-1) for pair in moving], axis=1)  # (n, k, 2)
    z = np.stack(np.broadcast_arrays(fixed[:, None], both), axis=-1)
    z = np.where(np.isfinite(z).all(axis=(2, 3), keepdims=True), z, complex(np.nan, np.nan))
    return homogeneous(z)


def circle_through(a: Complexes, b: Complexes, c: Complexes) -> Complexes:
    """Compute the centres of circles through three points; NaN or infinite for collinear ones."""
    p, q = b - a, c - a
    return np.asarray(a + 1j * (p * np.abs(q) ** 2 - q * np.abs(p) ** 2) / (2 * (np.conj(p) * q).imag))


def equidistant(start: Complexes, along: Complexes, a: Complexes, b: Complexes) -> Complexes:
    """Compute the points of lines that are equidistant from two given points."""
    p, q = a - start, b - start
    return np.asarray(start + along * (np.abs(p) ** 2 - np.abs(q) ** 2) / (2 * dot(along, p - q)))


def on_ray(pole: Complexes, point: Complexes, normal: Complexes, inverse_diameter: Floats) -> Complexes:
    """Compute the moving points of fixed ones by Euler and Savary: 1/r* = 1/r + 1/(rho0 sin)."""
    ray = unit(point - pole)
    return np.asarray(pole + ray / (1 / np.abs(point - pole) + inverse_diameter / dot(normal, ray)))


def mirror_images(start: Complexes, axis: Complexes, a: Complexes, b: Complexes) -> Mask:
    """Tell where two points are mirror images in lines, shape (n,)."""
    middle, apart = 0.5 * (a + b) - start, np.abs(a - b)
    near = POSED.mirrored * apart
    return np.asarray((np.abs(dot(1j * axis, middle)) < near) & (np.abs(dot(axis, a - b)) < near))


def poles_by_two_cranks(posed: Posed) -> list[tuple[Complexes, Complexes, int]]:
    """Compute the poles in four configurations: the ray of one crank is a pole axis.

    The other crank stands on a circle through the pole, which gives a quadratic for each. Return
    (pole, unit vector from it, number of the crank).
    """
    local = (posed.pivots - posed.centre[:, None]) * posed.axis.conj()[:, None]
    found: list[tuple[Array, Array, int]] = []
    for which in (0, 1):
        (x1, y1), (x2, y2) = ((local[:, i].real, local[:, i].imag) for i in (which, 1 - which))
        square = x2 * x2 + y2 * y2
        b = y1 * y2 - x1 * x2 - square
        root = np.sqrt(b * b - 4 * x1 * x2 * square)
        large = -0.5 * (b + np.copysign(root, b))
        for q in (large / x2, x1 * square / large):
            top = 1j * (square - q * x2) / y2
            found.append((posed.centre + posed.axis * q, posed.axis * unit(top - q), which))
    return found
