"""Three guiding curves: circle, helix, line.

The source announces them without formulas; the conventions are ours.
"""

# ruff: noqa: ARG002  (a kind need not use every argument of its formulas)
from __future__ import annotations

from typing import Any

import numpy as np

from ...kinematics.types import Array
from .kinds import Point, Quadric, Revolved, rows


class Circle(Revolved, Quadric):
    """Radius R about Z in the plane Z = 0."""

    name = "circle"
    parameters = ("R",)
    lengths = ("R",)
    conditions = 2

    def profile(self, u: Any, w: Any, p: Array) -> tuple[Any, Any]:
        return p[0], 0.0

    def slopes(self, w: Array, p: Array) -> tuple[Any, Any, Any]:
        return 0.0, 0.0, 0.0

    def quadrics(self, p: Array) -> Array:
        return rows(p.shape[1], {"a": 0.5 / p[0], "b": 0.5 / p[0], "e": -p[0] / 2}, {"h": 1})

    def locate(self, x: Array, p: Array) -> tuple[Array, Array]:
        return np.arctan2(x[1], x[0]), np.full_like(x[0], np.nan)


class Helix(Revolved):
    """Radius R, advance h per radian along Z, right-handed if h > 0."""

    name = "helix"
    parameters = ("R", "h")
    lengths = ("R", "h")
    conditions = 2

    def valid(self, p: Array) -> Array:
        return np.asarray((p[0] > 0) & (p[1] != 0))

    def profile(self, u: Any, w: Any, p: Array) -> tuple[Any, Any]:
        return p[0], p[1] * u

    def slopes(self, w: Array, p: Array) -> tuple[Any, Any, Any]:
        return 0.0, 0.0, p[1]

    def implicit(self, x: Point, p: Array) -> tuple[Any, ...]:
        u = x[2] / p[1]
        return x[0] - p[0] * np.cos(u), x[1] - p[0] * np.sin(u)

    def locate(self, x: Array, p: Array) -> tuple[Array, Array]:
        return x[2] / p[1], np.full_like(x[0], np.nan)


class Line(Quadric):
    """The axis Z."""

    name = "line"
    lengths = ("u",)
    conditions = 2
    spans = (None, None)

    def valid(self, p: Array) -> Array:
        return np.ones(p.shape[1], bool)

    def point(self, u: Any, w: Any, p: Array) -> Point:
        return 0.0, 0.0, u

    def quadrics(self, p: Array) -> Array:
        return rows(p.shape[1], {"f": 1}, {"g": 1})

    def locate(self, x: Array, p: Array) -> tuple[Array, Array]:
        return x[2], np.full_like(x[0], np.nan)
