"""Points of the circling-point curve whose path has a circle of curvature of a chosen radius.

Polar coordinates (r, phi) about the pole, (X, Y) = (cos phi, sin phi): a pair on the curves has

    1/r* = kappa*/Y + s/X,   1/r = kappa/Y + s/X,
    r - r* = X^2 Y / (rho0 (kappa* X + s Y)(kappa X + s Y)),

so that |r - r*| = R is a form of degree 6 in X, Y.  In w = exp(2 i phi) it is a polynomial of
degree 6 whose leading coefficient never vanishes; its roots on the unit circle are the points.
Newton's method improves each.  Where a cubic contains an axis, that axis has points of its own:
with s = 0 the pole normal, with kappa* = 0 the pole tangent, whose points run about the pole.

Source: Allievi 1895, eqs. (4), (12); the form of degree 6 is not in the book.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..errors import InvalidRequest
from ..kinematics.linkage import homogeneous
from ..kinematics.polynomials import product
from ..kinematics.types import Floats
from .analysis import Curvature
from .finite_pole import POLE


class RootTest(NamedTuple):
    """Errors of the roots of the form of degree 6."""

    #: largest distance from the unit circle: double roots have half of the digits
    distance: float = 1e-5
    radius: float = 1e-9  #: largest relative error of the radius
    newton: int = 4  #: Newton steps that improve a root
    step: float = 1e-6  #: step of the derivative [rad]
    farthest: float = 0.01  #: longest Newton step [rad]: a longer one leads to another root


ROOTS = RootTest()


def circling_points(curvature: Curvature, radius: float) -> Floats:
    """Find the pairs of stationary curvature of a given radius.

    The point of such a pair has four positions in common with its circle (order 3), one more if the
    pair is principal.

    Parameters
    ----------
    curvature : Curvature of n
    radius : float
        Radius of the circle [length].

    Returns
    -------
    ndarray, shape (n, 10, 2, 3)
        Centre and point, homogeneous: six on the curve, four on an axis.  NaN where there is none,
        and for linkages without a finite pole.

    Raises
    ------
    InvalidRequest
        If the radius is not a finite number above zero.
    """
    if not (np.isfinite(radius) and radius > 0):
        raise InvalidRequest(f"radius must be a finite number above zero, not {radius:g}")
    rho0 = curvature.rho0
    with np.errstate(all="ignore"):
        size = radius / rho0
        kappa, star, s = curvature.kappa * rho0, curvature.kappa_star * rho0, curvature.s * rho0
        r_star, r, phi = _points_on_curve(kappa, star, s, size)
        axis_star, axis, along = _points_on_axes(star, s, size)
        r_star, r, phi = (np.concatenate(two, axis=1) for two in ((r_star, axis_star), (r, axis), (phi, along)))
        good = np.isfinite(r_star) & np.isfinite(r) & (np.abs(np.abs(r - r_star) / size[:, None] - 1) < ROOTS.radius)
        turn = np.exp(1j * phi)
        plane = curvature.axes[..., 0] + 1j * curvature.axes[..., 1]
        pole = curvature.pole[:, 0] + 1j * curvature.pole[:, 1]
        local = np.stack([r * turn, r_star * turn], axis=-1)
        z = pole[:, None, None] + rho0[:, None, None] * (
            local.real * plane[:, None, None, 0] + local.imag * plane[:, None, None, 1]
        )
    z = np.where(good[..., None], z, complex(np.nan, np.nan))
    return homogeneous(z)


def _points_on_curve(kappa: Floats, star: Floats, s: Floats, size: Floats) -> tuple[Floats, Floats, Floats]:
    """Compute r*, r, phi of the points off the axes (rho0 = 1), (n, 6) each."""
    n = len(size)
    x, y = np.array([1.0, 1.0]), np.array([-1j, 1j])  # 2 cos, 2 sin times exp(i phi), as polynomials in w from w^1 down

    one, other = (k[:, None] * x + s[:, None] * y for k in (star, kappa))
    square = product((x + 1j * y)[None], (x - 1j * y)[None])  # X^2 + Y^2
    right = product(one, other, one, other, np.repeat(square, n, axis=0))
    form = product(*(f[None] for f in (x, x, x, x, y, y))) - (size**2)[:, None] * right
    form = form / form[:, :1]
    there = np.asarray(np.isfinite(form).all(1))
    companion = np.zeros((n, 6, 6), complex)
    companion[:, 0] = np.where(there[:, None], -form[:, 1:], 0)
    companion[:, np.arange(1, 6), np.arange(5)] = 1
    w = np.linalg.eigvals(companion)
    phi = 0.5 * np.angle(w)
    on = there[:, None] & (np.abs(np.abs(w) - 1) < ROOTS.distance)
    kappa, star, s, size = (a[:, None] for a in (kappa, star, s, size))

    def gap(phi: Floats) -> Floats:
        c, d = np.cos(phi), np.sin(phi)
        return np.asarray(np.abs(c * c * d) - size * np.abs((star * c + s * d) * (kappa * c + s * d)))

    for _ in range(ROOTS.newton):
        step = ROOTS.step
        slope = (gap(phi + step) - gap(phi - step)) / (2 * step)
        change = gap(phi) / slope
        phi = np.where(np.abs(change) < ROOTS.farthest, phi - change, phi)
    c, d = np.cos(phi), np.sin(phi)
    off = on & (np.abs(c) > ROOTS.distance) & (np.abs(d) > ROOTS.distance)
    r_star, r = (np.where(off, c * d / (k * c + s * d), np.nan) for k in (star, kappa))
    order = np.argsort(np.where(off, phi, np.inf), axis=1)
    phi, r_star, r = (np.take_along_axis(a, order, 1) for a in (phi, r_star, r))
    again = np.pad(np.abs(np.diff(phi, axis=1)) < ROOTS.distance, ((0, 0), (1, 0)))  # a double root is one point
    return np.where(again, np.nan, r_star), r, phi


def _points_on_axes(star: Floats, s: Floats, size: Floats) -> tuple[Floats, Floats, Floats]:
    """Compute r*, r, phi of the points on the axes (rho0 = 1), (n, 4) each."""
    normal = (np.abs(s) < POLE.vanishing)[:, None]  # r = y, 1/y* - 1/y = 1: y* = (-R +- sqrt(R^2 + 4 R))/2 or R -> -R
    signed = np.stack([size, size, -size, -size], axis=1)
    side = np.array([1, -1, 1, -1])
    y_star = -0.5 * signed + side * np.sqrt(0.25 * signed**2 + signed)
    tangent = (np.abs(star) < POLE.vanishing)[:, None]
    x_star = np.where(side > 0, size[:, None], -size[:, None])
    x_star = np.where(np.arange(4) < 2, x_star, np.nan)
    r_star = np.where(normal, y_star, np.where(tangent, x_star, np.nan))
    r = np.where(normal, y_star / (1 - y_star), 0.0)
    return r_star, r, np.where(normal, np.pi / 2, 0.0) + np.zeros(4)
