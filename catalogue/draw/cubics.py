"""Cubics of an instant in its canonical frame: rho0 = 1, inflection pole at (0, 1).

On the ray phi a point of either cubic of stationary curvature has  1/r = kappa/sin(phi) +
s/cos(phi), or as a polynomial  (x^2 + y^2)(kappa x + s y) = x y.  With s = 0 it splits into the
circle r = sin(phi)/kappa and the pole normal, with kappa = 0 into the circle r = cos(phi)/s and the
pole tangent, with both into the two axes.  Each part is drawn by itself: as a limit of the
undivided curve it would have a gap or a spike.

Source: Allievi 1895, secs. 6, 17, eqs. (12), (57).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..kinematics.types import Complexes, Floats


class CubicOptions(NamedTuple):
    """Options of drawing the cubics of stationary curvature."""

    zero: float = 1e-9  #: value of kappa and s up to which they are zero [1/rho0]
    #: number of points of a circle, and of a half turn of the ray: at most two degrees apart
    points: int = 361


CUBIC = CubicOptions()


def circle(diameter: complex) -> Complexes:
    """Return the circle on the diameter from the pole to the given point."""
    return np.asarray(0.5 * diameter * (1 + np.exp(2j * np.pi * np.linspace(0, 1, CUBIC.points))))


def line(direction: complex, reach: float) -> Complexes:
    """Return the line through the pole in a direction."""
    return np.asarray(direction * np.array([-reach, 0.0, reach]))


def cubic(kappa: float, s: float, reach: float) -> list[Complexes]:
    """Return the parts, complex, of the curve of stationary curvature.

    Points farther than `reach` from the pole are NaN.

    Parameters
    ----------
    kappa, s : float
        rho0/R and rho0/S of the centring-point curve; rho0/R* and rho0/S give the circling-point
        curve.
    """
    if not np.isfinite(kappa + s):
        return []
    if abs(s) < CUBIC.zero and abs(kappa) < CUBIC.zero:
        return [line(1.0, reach), line(1j, reach)]
    if abs(s) < CUBIC.zero:
        return [circle(1j / kappa), line(1j, reach)]
    if abs(kappa) < CUBIC.zero:
        return [circle(1 / s), line(1.0, reach)]
    away = np.arctan2(-kappa, s)  # angle of the asymptote
    turn = _turns((np.array([0.0, np.pi / 2]) - away) % np.pi)
    with np.errstate(divide="ignore", over="ignore"):
        ray = np.exp(1j * (away + turn))
        r = ray.real * ray.imag / (np.hypot(kappa, s) * np.sin(turn))
    return [np.where(np.abs(r) <= reach, r * ray, complex(np.nan, np.nan))]


def _turns(pole: Floats) -> Floats:
    """Return angles in (0, pi), denser near the asymptote and the pole."""
    near = np.geomspace(1e-9, 0.3, 240)
    all_of_them = [np.linspace(0, np.pi, 2 * CUBIC.points)[1:-1], near, np.pi - near]
    all_of_them += [at + side * np.append(0.0, near) for at in pole for side in (-1, 1)]
    turn = np.unique(np.concatenate(all_of_them))
    return np.asarray(turn[(turn > 0) & (turn < np.pi)])


def hyperbola(k: float, reach: float) -> list[Complexes]:
    """Return the curve x y + k = 0 of the parallel transformation; the two axes for k = 0."""
    if not np.isfinite(k):
        return []
    if abs(k) < CUBIC.zero:
        return [line(1.0, reach), line(1j, reach)]
    grow = np.linspace(-1, 1, CUBIC.points) * np.log(max(2.0, reach / np.sqrt(abs(k))))
    branch = np.sqrt(abs(k)) * (np.exp(grow) - np.copysign(1.0, k) * 1j * np.exp(-grow))
    return [branch, -branch]
