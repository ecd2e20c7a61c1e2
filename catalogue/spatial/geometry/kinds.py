"""Base classes of surfaces and curves, in their local axes X, Y, Z.

A new surface is a subclass of a few lines:

1. `parameters` are its names of the shape, `lengths` says which of them (and which of u, w) are
lengths. 2. `point` and `implicit` are written with numpy's functions, so that they also take series
(`power_series.Taylor`). 3. `locate` inverts `point`; NaN where the chart does not reach.

Derivatives follow from the formulas by Taylor arithmetic, exact to rounding.  A quadric gives its
coefficients instead of `implicit`, which is faster: all quadrics of a batch are evaluated together,
whatever their kind.
"""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from ...kinematics.types import Array
from .power_series import Taylor, coefficients, variable

#: Three coordinates, arrays of one shape or series.
Point = tuple[Any, Any, Any]


class Kind:
    """A surface, or a curve.

    Attributes
    ----------
    name : str
        As in a database or a file.
    parameters : tuple of str
        Names of the parameters p, in order.
    lengths : str
        Names of the parameters and coordinates that are lengths and scale with the mechanism.
    conditions : int
        1 for a surface, 2 for a curve.
    spans : tuple of float or None
        Ranges of u and w that cover the guide, for random starts: half the span of an angle or a
        number, None for a length.
    smooth : Kind or None
        The chart in which w is free when u is driven, if this one is singular there (u is the same
        in both).
    bounded : bool
        Whether the chart covers only a part of the zeros of the implicit functions: the guide has
        an edge.
    """

    name: ClassVar[str]
    parameters: ClassVar[tuple[str, ...]] = ()
    lengths: ClassVar[tuple[str, ...]] = ()
    conditions: ClassVar[int] = 1
    spans: ClassVar[tuple[float | None, float | None]] = (np.pi, None)
    smooth: ClassVar[Kind | None] = None
    bounded: ClassVar[bool] = False

    def valid(self, p: Array) -> Array:
        """Return a mask (n,) of parameters p (parameters, n) in their domain."""
        return np.asarray((p > 0).all(0))

    def reaches(self, u: Array, w: Array, p: Array) -> Array:  # noqa: ARG002, other kinds are bounded
        """Return a mask of (u, w) in the domain of the chart."""
        return np.isfinite(u) & np.isfinite(w)

    def point(self, u: Any, w: Any, p: Array) -> Point:
        """Return the point at (u, w)."""
        raise NotImplementedError

    def implicit(self, x: Point, p: Array) -> tuple[Any, ...]:
        """Return the functions that vanish on the guide, as many as `conditions`."""
        raise NotImplementedError

    def locate(self, x: Array, p: Array) -> tuple[Array, Array]:
        """Return (u, w) of points x (3, n) on the guide.

        w is NaN for a curve; both are NaN outside the chart.
        """
        raise NotImplementedError

    def apex(self, x: Array, p: Array) -> Array:  # noqa: ARG002, other kinds have one
        """Return distances of points x (3, n) from the apex; infinity if the guide has none."""
        return np.full(x.shape[1:], np.inf)

    def gradients(self, x: Array, p: Array) -> tuple[Array, Array]:
        """Return the implicit functions (conditions, n) at x (3, n), and their gradients
        (conditions, 3, n).
        """
        a, b, c = (variable(x[i], np.eye(3)[i][:, None]) for i in range(3))
        series = np.stack([coefficients(f, 1, (3, x.shape[1])) for f in self.implicit((a, b, c), p)])
        return series[:, 0, 0], series[:, 1]

    def distances(self, x: Array, p: Array) -> Array:
        """Return series (order + 1, conditions, n) of the distances of moving points.

        To first order: functions over the lengths of their gradients; x is (order + 1, 3, n).
        """
        values, slopes = self.gradients(x[0], p)
        if len(x) > 1:
            functions = self.implicit((Taylor(x[:, 0]), Taylor(x[:, 1]), Taylor(x[:, 2])), p)
            values = np.stack([coefficients(f, len(x) - 1, x.shape[2:]) for f in functions], axis=1)
        return np.asarray(values.reshape(len(x), *slopes.shape[::2]) / np.sqrt((slopes**2).sum(1)))

    def tangents(self, u: Array, w: Array, p: Array) -> tuple[Array, Array]:
        """Return the points (3, n) at (u, w), and X_u, X_w, shape (2, 3, n)."""
        seeds = variable(u, np.array([[1.0], [0]])), variable(w, np.array([[0.0], [1]]))
        c = np.stack([coefficients(x, 1, (2, len(u))) for x in self.point(*seeds, p)], axis=1)
        return c[0, :, 0], np.moveaxis(c[1], 1, 0)

    def curvatures(self, u: Array, w: Array, p: Array) -> Array:
        """Return X_uu, X_uw, X_ww, shape (3, 3, n)."""
        along = np.array([[1.0], [0], [1]]), np.array([[0.0], [1], [1]])
        first, second = (variable(v, d, 2) for v, d in zip((u, w), along, strict=True))
        c = np.stack([coefficients(x, 2, (3, len(u))) for x in self.point(first, second, p)], axis=1)[2]
        uu, ww, both = np.moveaxis(c, 1, 0)
        return np.stack([2 * uu, both - uu - ww, 2 * ww])

    def scaled(self, p: Array, unit: Array) -> Array:
        """Return the parameters with lengths divided by a unit (n,)."""
        return np.array(
            [v / unit if k in self.lengths else v for k, v in zip(self.parameters, p, strict=True)]
        ).reshape(p.shape)

    def coordinate_unit(self, axis: int, unit: Array) -> Array:
        """Return the unit of u (axis 0) or w (axis 1): that of length, or 1."""
        return unit if "uw"[axis] in self.lengths else np.ones_like(unit)


class Revolved(Kind):
    """A surface of revolution about Z, or a curve about it: (rho cos u, rho sin u, z), u the
    azimuth.
    """

    def profile(self, u: Any, w: Any, p: Array) -> tuple[Any, Any]:
        """Return rho (w) and z, to which a multiple of u may be added."""
        raise NotImplementedError

    def slopes(self, w: Array, p: Array) -> tuple[Any, Any, Any]:
        """Return d rho/dw, dz/dw and dz/du."""
        raise NotImplementedError

    def point(self, u: Any, w: Any, p: Array) -> Point:
        """Return the point at (u, w)."""
        rho, z = self.profile(u, w, p)
        return rho * np.cos(u), rho * np.sin(u), z

    def tangents(self, u: Array, w: Array, p: Array) -> tuple[Array, Array]:
        """Return points and tangents by the formulas, which is faster than by series."""
        c, s = np.cos(u), np.sin(u)
        rho, z = self.profile(u, w, p)
        by_w, dz, dz_u = self.slopes(w, p)
        x, t = np.empty((3, len(u))), np.empty((2, 3, len(u)))
        x[0], x[1], x[2] = rho * c, rho * s, z
        t[0, 0], t[0, 1], t[0, 2] = -x[1], x[0], dz_u
        t[1, 0], t[1, 1], t[1, 2] = by_w * c, by_w * s, dz
        return x, t


class Quadric(Kind):
    """A quadric.

    It is a X^2 + b Y^2 + c Z^2 + f X + g Y + h Z + e = 0."""

    def quadrics(self, p: Array) -> Array:
        """Return (a, b, c, f, g, h, e) of each function, shape (conditions, 7, n)."""
        raise NotImplementedError

    def implicit(self, x: Point, p: Array) -> tuple[Any, ...]:
        """Return the functions."""
        return tuple(sum(((q[i] * x[i] + q[i + 3]) * x[i] for i in range(3)), start=q[6]) for q in self.quadrics(p))

    def gradients(self, x: Array, p: Array) -> tuple[Array, Array]:
        """Return functions and gradients by the coefficients, which is faster than by series."""
        q = self.quadrics(p)
        return ((q[:, :3] * x + q[:, 3:6]) * x).sum(1) + q[:, 6], 2 * q[:, :3] * x + q[:, 3:6]


def rows(n: int, *functions: dict[str, Any]) -> Array:
    """Return coefficients of quadrics from those that are not zero, by letter."""
    out = np.zeros((len(functions), 7, n))
    for q, letters in zip(out, functions, strict=True):
        for letter, value in letters.items():
            q["abcfghe".index(letter)] = value
    return out
