"""Points, tangents, implicit functions and coordinates of guides, by their number in `KINDS`."""

from __future__ import annotations

from math import atan2, cos, cosh, hypot, inf, nan, sin, sinh, sqrt, tan

import numpy as np

from ...geometry.guides import KINDS
from ...native.compiling import inlined, version

#: Version of these kernels, which includes the numbering of the guides.
VERSION = version(__file__, repr([*KINDS]))

_NUMBER = {name: i for i, name in enumerate(KINDS)}
CYLINDER = _NUMBER["cylinder"]
CONE = _NUMBER["cone"]
SINH = _NUMBER["hyperboloid:sinh"]
AXIAL = _NUMBER["hyperboloid:axial"]
HALF = _NUMBER["hyperboloid"]
RULED = _NUMBER["hyperboloid:ruled"]
TORUS = _NUMBER["torus"]
SPHERE = _NUMBER["sphere"]
SPHERE_Z = _NUMBER["sphere:zpole"]
PLANE = _NUMBER["plane"]
CARTESIAN = _NUMBER["plane:cartesian"]
CIRCLE = _NUMBER["circle"]
HELIX = _NUMBER["helix"]
LINE = _NUMBER["line"]


@inlined
def profile(kind, u, w, p, q):  # noqa: PLR0911, one for each kind
    """Return rho, z and the derivatives d rho/dw, dz/dw, dz/du."""
    if kind == CYLINDER:
        return p, w, 0.0, 1.0, 0.0
    if kind == CONE:
        return w, w / tan(p), 1.0, 1 / tan(p), 0.0
    if kind == SINH:
        return p * cosh(w), q * sinh(w), p * sinh(w), q * cosh(w), 0.0
    if kind == AXIAL:
        return p * sqrt(1 + (w / q) ** 2), w, p * w / (q * hypot(w, q)), 1.0, 0.0
    if kind == HALF:
        root = sqrt((w - p) * (w + p))
        return w, q / p * root, 1.0, q / p * w / root, 0.0
    if kind == TORUS:
        s, c = sin(w), cos(w)
        return p + q * s, q * c, q * c, -q * s, 0.0
    if kind in (SPHERE, SPHERE_Z):
        s, c = sin(w), cos(w)
        return p * c, p * s, -p * s, p * c, 0.0
    if kind == PLANE:
        return w, 0.0, 1.0, 0.0, 0.0
    if kind == CIRCLE:
        return p, 0.0, 0.0, 0.0, 0.0
    return p, q * u, 0.0, 0.0, q  # a helix


@inlined
def chart(kind, u, w, p, q):
    """Return a local point, X_u and X_w."""
    if kind == CARTESIAN:
        return (u, w, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
    if kind == LINE:
        return (0.0, 0.0, u), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)
    c, s = cos(u), sin(u)
    if kind == RULED:
        return (p * (c - w * s), p * (s + w * c), q * w), (-p * (s + w * c), p * (c - w * s), 0.0), (-p * s, p * c, q)
    rho, z, by_w, dz, dz_u = profile(kind, u, w, p, q)
    if kind == SPHERE:
        return (-rho * c, z, rho * s), (rho * s, dz_u, rho * c), (-by_w * c, dz, by_w * s)
    return (rho * c, rho * s, z), (-rho * s, rho * c, dz_u), (by_w * c, by_w * s, dz)


@inlined
def function(kind, second, x, y, z, p, q):
    """Return the first or second implicit function of a torus or a helix, and its gradient."""
    if kind == HELIX:
        u = z / q
        if second:
            return y - p * sin(u), 0.0, 1.0, -p * cos(u) / q
        return x - p * cos(u), 1.0, 0.0, p * sin(u) / q
    s = sqrt(x * x + y * y)
    tube = (z - q) * (z + q)
    one, other = (s - p) ** 2 + tube, (s + p) ** 2 + tube
    k = 1 / (8 * p * q * p)
    radial = 2 * k * ((s - p) * other + (s + p) * one) / s if s > 0 else 0.0
    return k * one * other, radial * x, radial * y, 2 * k * z * (one + other)


@inlined
def locate(kind, x, y, z, p, q):  # noqa: PLR0911, one for each kind
    """Return the coordinates u, w of a point in local axes.

    w is NaN for a curve; u is NaN where the chart has no such point.
    """
    if kind in (CYLINDER, AXIAL):
        return atan2(y, x), z
    if kind == CONE:
        nappe = -1.0 if z < 0 else 1.0
        return atan2(nappe * y, nappe * x), nappe * hypot(x, y)
    if kind == SINH:
        return atan2(y, x), np.arcsinh(z / q)
    if kind == HALF:
        return (atan2(y, x), hypot(p, z * p / q)) if z >= 0 else (nan, nan)
    if kind == RULED:
        w = z / q
        return atan2(y - w * x, x + w * y), w
    if kind == TORUS:
        s = hypot(x, y)
        side = -1.0 if abs(hypot(s + p, z) - q) < abs(hypot(s - p, z) - q) else 1.0
        return atan2(side * y, side * x), atan2(side * s - p, z)
    if kind == SPHERE:
        return atan2(z, -x), atan2(y, hypot(x, z))
    if kind == SPHERE_Z:
        return atan2(y, x), atan2(z, hypot(x, y))
    if kind == PLANE:
        return atan2(y, x), hypot(x, y)
    if kind == CARTESIAN:
        return x, y
    if kind == CIRCLE:
        return atan2(y, x), nan
    return (z / q if kind == HELIX else z), nan


@inlined
def apex(kind, x, y, z, p, q):
    """Return the distance to the nearest apex of a guide, in units."""
    if kind == CONE:
        return sqrt(x * x + y * y + z * z)
    if kind == TORUS and q >= p:
        return hypot(hypot(x, y), abs(z) - sqrt((q - p) * (q + p)))
    return inf
