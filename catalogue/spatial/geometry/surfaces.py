"""The six surfaces of Table I, and their regular charts (Mangeron, Oğuztöreli and Plitea 1970).

The formulas are the table's; domains and the other charts are ours.  Each axis of revolution is
local Z.
"""

# ruff: noqa: ARG002  (a kind need not use every argument of its formulas)
from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from ...kinematics.types import Array
from .kinds import Kind, Point, Quadric, Revolved, rows


class Cylinder(Revolved, Quadric):
    """Radius R; u around, w along the axis."""

    name = "cylinder"
    parameters = ("R",)
    lengths = ("R", "w")

    def profile(self, u: Any, w: Any, p: Array) -> tuple[Any, Any]:
        return p[0], w

    def slopes(self, w: Array, p: Array) -> tuple[Any, Any, Any]:
        return 0.0, 1.0, 0.0

    def quadrics(self, p: Array) -> Array:
        return rows(p.shape[1], {"a": 0.5 / p[0], "b": 0.5 / p[0], "e": -p[0] / 2})

    def locate(self, x: Array, p: Array) -> tuple[Array, Array]:
        return np.arctan2(x[1], x[0]), x[2]


class Cone(Revolved, Quadric):
    """Cone with angle delta between axis and generator [rad].

    w is the distance from the axis, negative on the lower nappe.
    """

    name = "cone"
    parameters = ("delta",)
    lengths = ("w",)

    def valid(self, p: Array) -> Array:
        return np.asarray((p[0] > 0) & (p[0] < np.pi / 2))

    def profile(self, u: Any, w: Any, p: Array) -> tuple[Any, Any]:
        return w, w / np.tan(p[0])

    def slopes(self, w: Array, p: Array) -> tuple[Any, Any, Any]:
        return 1.0, 1 / np.tan(p[0]), 0.0

    def quadrics(self, p: Array) -> Array:
        c, s = np.cos(p[0]), np.sin(p[0])
        return rows(p.shape[1], {"a": c * c, "b": c * c, "c": -s * s})

    def locate(self, x: Array, p: Array) -> tuple[Array, Array]:
        nappe = np.where(x[2] < 0, -1.0, 1.0)
        return np.arctan2(nappe * x[1], nappe * x[0]), nappe * np.hypot(x[0], x[1])

    def apex(self, x: Array, p: Array) -> Array:
        return np.asarray(np.sqrt((x * x).sum(0)))


class _Hyperboloid(Revolved, Quadric):
    parameters = ("m", "n")

    def quadrics(self, p: Array) -> Array:
        m, n = p
        return rows(p.shape[1], {"a": 0.5 / m, "b": 0.5 / m, "c": -m / (2 * n * n), "e": -m / 2})


class HyperboloidSinh(_Hyperboloid):
    """One sheet, waist radius m: (m cosh w cos u, m cosh w sin u, n sinh w), regular everywhere."""

    name = "hyperboloid:sinh"
    lengths = ("m", "n")
    spans = (np.pi, 2.0)

    def profile(self, u: Any, w: Any, p: Array) -> tuple[Any, Any]:
        return p[0] * np.cosh(w), p[1] * np.sinh(w)

    def slopes(self, w: Array, p: Array) -> tuple[Any, Any, Any]:
        return p[0] * np.sinh(w), p[1] * np.cosh(w), 0.0

    def locate(self, x: Array, p: Array) -> tuple[Array, Array]:
        return np.arctan2(x[1], x[0]), np.arcsinh(x[2] / p[1])


class HyperboloidAxial(_Hyperboloid):
    """One sheet; w is the axial coordinate."""

    name = "hyperboloid:axial"
    lengths = ("m", "n", "w")
    smooth = HyperboloidSinh()

    def profile(self, u: Any, w: Any, p: Array) -> tuple[Any, Any]:
        return p[0] * np.sqrt(1 + (w / p[1]) ** 2), w

    def slopes(self, w: Array, p: Array) -> tuple[Any, Any, Any]:
        return p[0] * w / (p[1] * np.hypot(w, p[1])), 1.0, 0.0

    def locate(self, x: Array, p: Array) -> tuple[Array, Array]:
        return np.arctan2(x[1], x[0]), x[2]


class HyperboloidRuled(_Hyperboloid):
    """One sheet by its straight generators.

    u is the azimuth of a generator at the waist, n w the axial coordinate.
    """

    name = "hyperboloid:ruled"
    lengths = ("m", "n")
    spans = (np.pi, 4.0)

    def point(self, u: Any, w: Any, p: Array) -> Point:
        c, s = np.cos(u), np.sin(u)
        return p[0] * (c - w * s), p[0] * (s + w * c), p[1] * w

    tangents = Kind.tangents

    def locate(self, x: Array, p: Array) -> tuple[Array, Array]:
        w = x[2] / p[1]
        return np.arctan2(x[1] - w * x[0], x[0] + w * x[1]), w


class Hyperboloid(_Hyperboloid):
    """Half Z >= 0 of one sheet, as in Table I: w >= m is the distance from the axis.

    The chart is singular at the waist.
    """

    name = "hyperboloid"
    lengths = ("m", "n", "w")
    smooth = HyperboloidSinh()
    bounded = True

    def reaches(self, u: Array, w: Array, p: Array) -> Array:
        return np.asarray(np.isfinite(u) & (w >= p[0]))

    def profile(self, u: Any, w: Any, p: Array) -> tuple[Any, Any]:
        return w, (p[1] / p[0]) * np.sqrt((w - p[0]) * (w + p[0]))

    def slopes(self, w: Array, p: Array) -> tuple[Any, Any, Any]:
        with np.errstate(divide="ignore", invalid="ignore"):  # infinite at the waist
            return 1.0, (p[1] / p[0]) * w / np.sqrt((w - p[0]) * (w + p[0])), 0.0

    def locate(self, x: Array, p: Array) -> tuple[Array, Array]:
        u, w = np.arctan2(x[1], x[0]), np.hypot(p[0], x[2] * p[0] / p[1])
        return np.where(x[2] >= 0, u, np.nan), np.where(x[2] >= 0, w, np.nan)


class Torus(Revolved):
    """Circle of radius r with its centre at distance p from the axis.

    u is the azimuth, w the angle from the top of the circle outwards.

    The implicit function is the quartic over 8 p r, as the product of  (s - p)^2 + Z^2 - r^2  and
    (s + p)^2 + Z^2 - r^2,  s the distance from the axis: no digits are lost as r tends to p.
    """

    name = "torus"
    parameters = ("p", "r")
    lengths = ("p", "r")
    spans = (np.pi, np.pi)

    def profile(self, u: Any, w: Any, p: Array) -> tuple[Any, Any]:
        return p[0] + p[1] * np.sin(w), p[1] * np.cos(w)

    def slopes(self, w: Array, p: Array) -> tuple[Any, Any, Any]:
        return p[1] * np.cos(w), -p[1] * np.sin(w), 0.0

    def implicit(self, x: Point, p: Array) -> tuple[Any, ...]:
        s = np.sqrt(x[0] * x[0] + x[1] * x[1])
        tube = (x[2] - p[1]) * (x[2] + p[1])
        return (((s - p[0]) ** 2 + tube) * ((s + p[0]) ** 2 + tube) / (8 * p[0] * p[1] * p[0]),)

    def gradients(self, x: Array, p: Array) -> tuple[Array, Array]:
        s = np.sqrt(x[0] ** 2 + x[1] ** 2)
        tube = (x[2] - p[1]) * (x[2] + p[1])
        one, other = (s - p[0]) ** 2 + tube, (s + p[0]) ** 2 + tube
        k = 1 / (8 * p[0] * p[1] * p[0])
        with np.errstate(invalid="ignore", divide="ignore"):
            radial = 2 * k * ((s - p[0]) * other + (s + p[0]) * one) / s
        radial = np.where(s > 0, radial, 0)
        return (k * one * other)[None], np.stack([radial * x[0], radial * x[1], 2 * k * x[2] * (one + other)])[None]

    def locate(self, x: Array, p: Array) -> tuple[Array, Array]:
        s = np.hypot(x[0], x[1])
        lemon = np.abs(np.hypot(s + p[0], x[2]) - p[1]) < np.abs(np.hypot(s - p[0], x[2]) - p[1])
        side = np.where(lemon, -1.0, 1.0)  # rho < 0: the inside of a torus that meets its axis
        return np.arctan2(side * x[1], side * x[0]), np.arctan2(side * s - p[0], x[2])

    def apex(self, x: Array, p: Array) -> Array:
        far = np.hypot(np.hypot(x[0], x[1]), np.abs(x[2]) - np.sqrt(np.maximum((p[1] - p[0]) * (p[1] + p[0]), 0)))
        return np.where(p[1] >= p[0], far, np.inf)


class SphereZ(Revolved, Quadric):
    """Radius R; poles of the chart on Z."""

    name = "sphere:zpole"
    parameters = ("R",)
    lengths = ("R",)
    spans = (np.pi, np.pi)

    def profile(self, u: Any, w: Any, p: Array) -> tuple[Any, Any]:
        return p[0] * np.cos(w), p[0] * np.sin(w)

    def slopes(self, w: Array, p: Array) -> tuple[Any, Any, Any]:
        return -p[0] * np.sin(w), p[0] * np.cos(w), 0.0

    def quadrics(self, p: Array) -> Array:
        half = 0.5 / p[0]
        return rows(p.shape[1], {"a": half, "b": half, "c": half, "e": -p[0] / 2})

    def locate(self, x: Array, p: Array) -> tuple[Array, Array]:
        return np.arctan2(x[1], x[0]), np.arctan2(x[2], np.hypot(x[0], x[1]))


class Sphere(SphereZ):
    """Radius R; poles of the chart on Y, as in Table I: u from -X towards +Z."""

    name = "sphere"

    def point(self, u: Any, w: Any, p: Array) -> Point:
        x, z, y = super().point(u, w, p)
        return -x, y, z

    def tangents(self, u: Array, w: Array, p: Array) -> tuple[Array, Array]:
        x, t = super().tangents(u, w, p)
        return np.stack([-x[0], x[2], x[1]]), np.stack([-t[:, 0], t[:, 2], t[:, 1]], axis=1)

    def locate(self, x: Array, p: Array) -> tuple[Array, Array]:
        return super().locate(np.stack([-x[0], x[2], x[1]]), p)


class Plane(Revolved, Quadric):
    """Z = 0 in polar coordinates, as in Table I: angle u, distance w.

    w is negative beyond the origin.
    """

    name = "plane"
    lengths: ClassVar[tuple[str, ...]] = ("w",)

    def valid(self, p: Array) -> Array:
        return np.ones(p.shape[1], bool)

    def profile(self, u: Any, w: Any, p: Array) -> tuple[Any, Any]:
        return w, 0.0

    def slopes(self, w: Array, p: Array) -> tuple[Any, Any, Any]:
        return 1.0, 0.0, 0.0

    def quadrics(self, p: Array) -> Array:
        return rows(p.shape[1], {"h": 1})

    def locate(self, x: Array, p: Array) -> tuple[Array, Array]:
        return np.arctan2(x[1], x[0]), np.hypot(x[0], x[1])


class PlaneCartesian(Plane):
    """Z = 0 in Cartesian coordinates, regular everywhere."""

    name = "plane:cartesian"
    lengths = ("u", "w")
    spans = (None, None)

    def point(self, u: Any, w: Any, p: Array) -> Point:
        return u, w, 0.0

    tangents = Kind.tangents

    def locate(self, x: Array, p: Array) -> tuple[Array, Array]:
        return x[0], x[1]
