"""Closed elimination: all assemblies of a body with three guided points, one fixed by the drivers.

These are classes III and V with a driven curve, V and VI with both coordinates of a surface driven.
The second point is an intersection of its curve, or of the coordinate curve that its driver
selects, with the sphere about the first point; the third one an intersection of its surface with
the circle about the line of both (`meeting`).  No step needs a guess, so the list is complete;
Newton's method only corrects the last digits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...kinematics.types import Array
from ..geometry.rotation import cross, quaternion
from .equations import System, slot_of
from .mechanism import Mechanisms
from .meeting import MAX_TURNS, circle_and_surface, curve_and_sphere
from .newton import newton
from .roots import Roots
from .unknowns import Slot

NOT_FIXED = "the drivers fix no point, so that there is no closed form"
NO_CURVE = f"the second point is on no line, circle, hyperbola or helix of less than {MAX_TURNS} turns"
NO_QUADRIC = "the third point is on no quadric or torus"
FREE = "the body moves while the drivers stand still: infinitely many assemblies"
#: Largest correction of a point by Newton's method [units]; a larger one leads to another assembly.
MAX_CORRECTION = 1e-5


@dataclass(frozen=True)
class Closed:
    """Assemblies of some of n mechanisms.

    Attributes
    ----------
    owner : ndarray, shape (a,)
    state : ndarray, shape (4 + f, a)
    double : ndarray, shape (a,)
        Whether two assemblies coincide there, to rounding.
    refused : ndarray of str, shape (n,)
        Reason against a closed form; empty where there is one.
    """

    owner: Array
    state: Array
    double: Array
    refused: Array


@dataclass(frozen=True)
class Rail:
    """The curve of a point with one driven coordinate: guide, free coordinate (0 or 1), driven
    value.
    """

    slot: Slot
    axis: int
    other: Array

    @staticmethod
    def of(mechanisms: Mechanisms, system: System, point: int, q: Array) -> Rail:
        for d in system.driven:
            if d.slot.point == point:
                axis = d.driver.index(None)
                return Rail(d.slot, axis, q[d.driver[1 - axis]])
        return Rail(slot_of(point, mechanisms), 0, np.zeros(len(system)))

    def take(self, index: Array) -> Rail:
        return Rail(self.slot.take(index), self.axis, self.other[index])

    def at(self, s: Array) -> Array:
        """Return points (3, n) in the axes of the guide."""
        pair = (s, self.other) if self.axis == 0 else (self.other, s)
        x = np.empty((3, len(s)))
        for kind, where, p in self.slot.groups:
            u, w = (v[where] for v in pair)
            x[:, where] = np.stack([np.broadcast_to(v, u.shape) for v in kind.point(u, w, p)])
        return x


def closed_form(mechanisms: Mechanisms, system: System, q: Array) -> Closed:
    """Return all assemblies at the driver values q (k, n) in units."""
    n, roles = len(system), _point_roles(mechanisms, system)
    if roles is None:
        return Closed(np.zeros(0, int), np.zeros((4 + system.free, 0)), np.zeros(0, bool), np.full(n, NOT_FIXED))
    first, second, third = roles
    fixed = next(d for d in system.driven if d.slot.point == first)
    with np.errstate(all="ignore"):
        x1, _ = system.placed(fixed, np.zeros((4 + system.free, n)), q)
        rail = Rail.of(mechanisms, system, second, q)
        arm = system.arms[:, second] - system.arms[:, first]
        centre = _local(system, second, x1)
        on_rail, plain = curve_and_sphere(
            lambda s: rail.at(np.full(n, s)), centre, np.sqrt((arm * arm).sum(0)), system.reach
        )
        which, owner = np.nonzero(np.isfinite(on_rail.at))
        s, sub = on_rail.at[which, owner], system.take(owner)
        x2 = sub.origins[:, second] + (sub.frames[:, :, second] * rail.take(owner).at(s)).sum(1)
        ring = _circles(sub, roles, x1[:, owner], x2)
        on_ring, quadric = _on_surface(mechanisms[owner], sub, third, ring)
    refused = np.where(plain, "", NO_CURVE).astype("U90")
    refused[owner[~quadric]] = NO_QUADRIC
    free = on_rail.everywhere.copy()
    free[owner[on_ring.everywhere]] = True
    refused[free & (refused == "")] = FREE
    each, of = np.nonzero(np.isfinite(on_ring.at))
    keep = np.flatnonzero((refused == "")[owner[of]])
    each, of = each[keep], of[keep]
    double = on_ring.double[each, of] | on_rail.double[which, owner][of]
    turn = _rotation_of_triangle(sub.take(of), roles, ring[:, :, of], on_ring.at[each, of])
    state = np.concatenate([turn, np.broadcast_to(s[of], (system.free, len(of)))])
    who = owner[of]
    return Closed(who, _correct(system.take(who), state, q[:, who]), double, refused)


def _point_roles(mechanisms: Mechanisms, system: System) -> tuple[int, int, int] | None:
    """Return the indices of the driven point and the points on curve and surface."""
    fixed = [d.slot.point for d in system.driven if d.column is None]
    curves = [d.slot.point for d in system.driven if d.column is not None]
    surfaces: list[int] = []
    for i in dict.fromkeys(system.points):
        (curves if mechanisms.curves[i] else surfaces).append(i)
    if (len(fixed), len(curves), len(surfaces)) != (1, 1, 1):
        return None
    return fixed[0], curves[0], surfaces[0]


def _local(system: System, point: int, world: Array) -> Array:
    return np.asarray((system.frames[:, :, point] * (world - system.origins[:, point])[:, None]).sum(0))


def _circles(system: System, roles: tuple[int, int, int], x1: Array, x2: Array) -> Array:
    """Return the circles of the third points (4, 3, n): centre, two perpendicular radii, axis."""
    along, radius = _triangle(system, roles)[:2]
    axis = (x2 - x1) / np.sqrt(((x2 - x1) ** 2).sum(0))
    side = np.zeros_like(axis)
    side[np.abs(axis).argmin(0), np.arange(axis.shape[1])] = 1
    one = cross(axis, side)
    one *= radius / np.sqrt((one * one).sum(0))
    return np.stack([x1 + along * axis, one, cross(axis, one), axis])


def _triangle(system: System, roles: tuple[int, int, int]) -> tuple[Array, Array, Array]:
    """Return the third point relative to the others' line, and axes (3, 3, n)."""
    a, b, c = (system.arms[:, i] for i in roles)
    axis = (b - a) / np.sqrt(((b - a) ** 2).sum(0))
    along = ((c - a) * axis).sum(0)
    side = (c - a) - along * axis
    radius = np.sqrt((side * side).sum(0))
    return along, radius, np.stack([axis, side / radius, cross(axis, side / radius)], axis=1)


def _on_surface(mechanisms: Mechanisms, system: System, point: int, ring: Array) -> tuple[Roots, Array]:
    """Return the angles at which circles meet a surface, and a mask of closed formulas."""
    slot = slot_of(point, mechanisms)
    centre = _local(system, point, ring[0])
    first, second = ((system.frames[:, :, point] * v[:, None]).sum(0) for v in ring[1:3])

    def surface(x: Array) -> Array:
        value = np.empty(x.shape[1])
        for kind, where, p in slot.groups:
            value[where] = kind.implicit((x[0, where], x[1, where], x[2, where]), p)[0]
        return value

    return circle_and_surface(surface, centre, first, second, system.reach)


def _rotation_of_triangle(system: System, roles: tuple[int, int, int], ring: Array, angle: Array) -> Array:
    """Return rotations (4, n) from the triangle in the body to the one in the world."""
    radius, body = _triangle(system, roles)[1:]
    out = (np.cos(angle) * ring[1] + np.sin(angle) * ring[2]) / radius
    world = np.stack([ring[3], out, cross(ring[3], out)], axis=1)
    return quaternion((world[:, None] * body[None]).sum(2))


def _correct(system: System, state: Array, q: Array) -> Array:
    """Correct states by Newton's method; keep those that it would move too far."""
    if not q.shape[1]:
        return state
    root = newton(system, state, q)
    with np.errstate(all="ignore"):
        apart = np.abs(system.world(root.state, q) - system.world(state, q)).max((0, 1))
        near = root.found & (apart < MAX_CORRECTION * system.reach)
    return np.where(near, root.state, state)
