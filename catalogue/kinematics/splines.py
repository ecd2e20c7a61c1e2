"""Fit cubic splines to sampled motions, for programs that draw splines."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .sampling import INNER, SAMPLING, Samples, within
from .types import Complexes, Floats


class SplineOptions(NamedTuple):
    """Options of a spline along a curve."""

    error: float = 2e-7  #: largest error [scale]: that of a cubic through 361 even points at a cusp
    #: First number of points: paths of answers then have errors below a thousandth of their
    #: deviation.
    points: int = 361
    #: Number of Newton steps to the foot point: from a quarter of an interval three reach rounding.
    newton: int = 4


SPLINE = SplineOptions()


def place_points(samples: Samples, column: int, error: float = SPLINE.error) -> tuple[Floats, Floats]:
    """Place the points of a cubic spline along a value of a curve.

    Parameters
    ----------
    samples : Samples
    column : int
        Column of the value that the spline follows.
    error : float
        Largest distance of the value from the spline [scale].

    Returns
    -------
    at, knots : ndarray, shape (m,)
        Parameters of the curve at the points; parameters of the spline there, from 0 to 1.
    """
    at = samples.rows(np.linspace(0, 1, SPLINE.points))

    def value(at: Floats) -> Complexes:
        return np.asarray(samples.curve(at)[:, [column]] / samples.scale[column])

    for _ in range(SAMPLING.max_rounds):
        z = value(at)[:, 0]
        knots = spline_parameters(at, z)
        rough = _spline_error(cubic(knots, z), knots, within(value, at)[..., 0]) > error
        if not rough.any() or len(at) > SAMPLING.max_samples:
            break
        at = np.sort(np.append(at, 0.5 * (at[:-1] + at[1:])[rough]))
        at = at if samples.at[-1] > samples.at[0] else at[::-1]
    return at, knots


def cubic(knots: Floats, z: Complexes) -> Any:
    """Interpolate places (m,) at parameters (m,) by a cubic not-a-knot spline.

    It has two real columns, x and y.
    """
    from scipy.interpolate import make_interp_spline

    return make_interp_spline(knots, np.stack([z.real, z.imag], 1), k=3)


def spline_parameters(at: Floats, z: Complexes) -> Floats:
    """Return the parameters of a spline through places (m,), from 0 to 1, shape (m,).

    Their steps are means of two shares: of the phase, in which a cusp is smooth, and of the length,
    in which a sudden motion is smooth.
    """
    run, length = np.abs(np.diff(at)), np.abs(np.diff(z))
    both = run / run.sum() + length / max(float(length.sum()), SAMPLING.rest)
    return np.append(0.0, np.cumsum(both) / both.sum())


def _spline_error(spline: Any, knots: Floats, inner: Complexes) -> Floats:
    """Compute the largest distance of places within each interval from a spline.

    Newton's method finds the foot points; where it fails the distance comes out too large, never
    too small.

    Parameters
    ----------
    spline : BSpline
    knots : ndarray, shape (m,)
    inner : complex ndarray, shape (3, m - 1)
        Places at `INNER` of each interval.

    Returns
    -------
    ndarray, shape (m - 1,)
    """
    u = knots[:-1] + np.multiply.outer(INNER, np.diff(knots))
    slope, least = spline.derivative(), np.full(u.shape, np.inf)
    for _ in range(SPLINE.newton):
        (x, y), (dx, dy) = np.moveaxis(spline(u), -1, 0), np.moveaxis(slope(u), -1, 0)
        off, along = inner - (x + 1j * y), dx + 1j * dy
        least = np.minimum(least, np.abs(off))
        with np.errstate(all="ignore"):
            step = np.nan_to_num((off * along.conj()).real / np.abs(along) ** 2)
        u = np.clip(u + step, knots[:-1], knots[1:])
    return np.asarray(least.max(0))
