"""The instant with the pole at infinity: two parallel rays.

Axes: x along the rays, y across; xi = x - x* along a ray.  With k0 = k* - k every centre obeys
xi y = k0, and the points of stationary curvature  x* y + k* = 0  with centres  x y + k = 0.

Source: Allievi 1895, secs. 16-18, eqs. (52)-(60)*.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..kinematics.linkage import RR, Linkage, homogeneous
from ..kinematics.types import Floats
from .finite_pole import scaled


class ParallelRounding(NamedTuple):
    """Limits of rounding in differences of parallel cranks."""

    parallelogram: float = 1e-12  #: relative difference of lengths of a parallelogram's cranks
    height: float = 8 * np.finfo(float).eps  #: rounding of a height [largest coordinate]
    discriminant: float = 1e-13  #: discriminant of a double root, over its terms
    root: float = 1e-3  #: ratio of the roots below which the smaller one is computed as a limit


PARALLEL_ROUNDING = ParallelRounding()


def parallel_cranks(linkage: Linkage) -> dict[str, Floats]:
    """Compute the fields of `Curvature` for linkages with parallel rays.

    Parallelograms and linkages without a crank give NaN. Polar formulas lose log10(1/angle) digits
    here, these lose none.
    """
    turn = linkage.rays[:, :1, None].conj()
    z, kind = linkage.points * turn, linkage.dyads
    swap = (kind[:, 0] != RR)[:, None, None]
    z, kind = np.where(swap, z[:, ::-1], z), np.where(swap[..., 0], kind[:, ::-1], kind)
    crank = kind[:, 1] == RR
    x, x_star = z[..., 0].real, z[..., 1].real
    finite = np.where(kind == RR, z.imag.mean(-1), np.where(kind == 1, z[..., 1].imag, z[..., 0].imag))
    with np.errstate(all="ignore"):
        xi = x - x_star
        centre = (xi[:, 0] * finite[:, 0] - xi[:, 1] * finite[:, 1]) / (xi[:, 0] - xi[:, 1])
        centre = np.where(crank, centre, finite[:, 1])
        y = finite - centre[:, None]
        y = np.where(crank[:, None], y, y * [1.0, 0.0])
        # take the origin from the pivots that are finite in both dyads
        across = np.where((kind[:, 1] == 2)[:, None], x, x_star)
        origin = (across[:, 0] * y[:, 0] - across[:, 1] * y[:, 1]) / (y[:, 0] - y[:, 1])
        k, k_star = -(x[:, 0] - origin) * y[:, 0], -(x_star[:, 0] - origin) * y[:, 0]
        lever = np.abs(np.concatenate([x, x_star, z.imag.reshape(len(z), -1)], axis=1))
        least = PARALLEL_ROUNDING.height * np.where(np.isfinite(lever), lever, 0).max(1)
        k, k_star = (np.where(np.abs(c) <= least * np.abs(y[:, 0]), 0.0, c) for c in (k, k_star))
        k, k_star = np.where(kind[:, 1] == 2, 0.0, k), np.where(kind[:, 1] == 1, 0.0, k_star)
        # for a slider (slide) the product y1 y2 is 0 and k k*/(y1 y2) becomes x1 x2* (x2 x1*)
        first = np.where(crank, k * k_star / (y[:, 0] * y[:, 1]), 0.0)
        first = np.where(kind[:, 1] == 1, (x[:, 0] - origin) * (x_star[:, 1] - origin), first)
        first = np.where(kind[:, 1] == 2, (x[:, 1] - origin) * (x_star[:, 0] - origin), first)
        alike = np.abs(xi[:, 0] - xi[:, 1]) <= PARALLEL_ROUNDING.parallelogram * np.abs(xi).max(axis=1)
        bad = alike & crank | (kind[:, 0] != RR) | ~np.isfinite(origin)
        pairs = _pairs(y, k, k_star, first, least)
        out = np.where(bad, 0.0, origin + 1j * centre)  # avoid warnings on values that are discarded
    base = linkage.rays[:, 0]
    point = pairs[..., 0] + 1j * pairs[..., 1]
    point = np.where(pairs[..., 2] != 0, point + out[:, None, None], point) * base[:, None, None]
    pole = out * base
    axes = np.stack([np.stack([base.real, base.imag], -1), np.stack([-base.imag, base.real], -1)], axis=1)
    found = {
        "pole": np.stack([pole.real, pole.imag], -1),
        "axes": axes,
        "rho0": np.full(len(linkage), np.inf),
        "kappa": np.zeros(len(linkage)),
        "kappa_star": np.zeros(len(linkage)),
        "s": np.zeros(len(linkage)),
        "k": k,
        "k_star": k_star,
        "principal_pairs": homogeneous(point, pairs[..., 2]),
    }
    for value in found.values():
        value[bad] = np.nan
    return found


def _pairs(y: Floats, k: Floats, k_star: Floats, product: Floats, least: Floats) -> Floats:
    """Compute the pairs at the roots y of a quadratic, homogeneous, shape (n, 2, 2, 3).

    The quadratic is y^2 + (y1 + y2) y + product = 0. Values below `least` (n,) are rounding: a pair
    with y = 0 and k = 0 would otherwise be 0/0.
    """
    b = -(y[:, 0] + y[:, 1])
    b = np.where(np.abs(b) <= least, 0.0, b)
    square = b * b - 4 * product
    rounded = PARALLEL_ROUNDING.discriminant * (b * b + np.abs(product))
    square = np.where((square < 0) & (square > -rounded), 0.0, square)
    large = 0.5 * (b + np.copysign(np.sqrt(square), b))
    small = np.where(large != 0, product / large, 0.0)
    # the first pair (-k/y, y) is at the larger root y; the smaller root may vanish with k k*: its
    # pair, times y in homogeneous coordinates, is divided by the common factor
    tie = y[:, 0] * y[:, 1] * large  # = k k*/small
    one, two = [], []
    for mine, other in ((k, k_star), (k_star, k)):
        one.append(np.stack([-mine, large * large, large], axis=-1))
        usual = np.stack([-mine, small * small, small], axis=-1)
        # equal cranks of opposite sense (Watt): k or k* is 0, the point at infinity on the rays
        infinite = np.where((tie == 0) & (other == 0), 1.0, -tie)
        limit = np.stack([infinite, small * other, other], axis=-1)
        much_smaller = np.abs(small) <= PARALLEL_ROUNDING.root * np.abs(large)
        vanishing = much_smaller & (np.abs(y[:, 0] * y[:, 1]) > 0)
        two.append(np.where(vanishing[:, None], limit, usual))
    return scaled(np.stack([np.stack(one, axis=1), np.stack(two, axis=1)], axis=1))
