"""Taylor series of the path of a coupler point about the reference position, for batches.

A series is an array (TERMS, n): the coefficient of t^k in row k, where t is the parameter of the
best conditioned chart.  The closed form of `motion` is evaluated on series instead of numbers, so
that it holds wherever the motion does: for parallel cranks, pivots at infinity and, on a given
branch, at change points.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ..kinematics.linkage import Linkage
from ..kinematics.motion import CRANK_1, CRANK_2, Motion, Path, motion
from ..kinematics.power_series import taylor_product as times
from ..kinematics.power_series import taylor_quotient as over
from ..kinematics.power_series import taylor_root as root
from ..kinematics.types import Complexes, Floats, Indices, Scalar

#: Number of coefficients: t^0 ... t^8. No guide that is not exact has a contact beyond t^6.
TERMS = 9


class ChartChoice(NamedTuple):
    """Limits of the choice of a chart for a series."""

    good: float = 0.5  #: conditioning of the coupler chart above which crank charts are not tried
    singular: float = 1e-12  #: least conditioning of a chart that has a series
    block: int = 4096  #: number of linkages at once: their series stay in the cache


CHART_CHOICE = ChartChoice()


class Jet(NamedTuple):
    """Taylor series of the paths of one coupler point per linkage.

    z is the complex displacement, (TERMS, n) [length], with row 0 of zeros; `turn` the rate of the
    coupler's angle by the parameter, (n,).  NaN at a change point whose branch is not given.
    """

    z: Complexes
    turn: Floats


def jet(linkage: Linkage, point: Complexes, pole: Complexes | None = None) -> Jet:
    """Compute the Taylor series of the paths of coupler points (n,).

    The poles (n,) select the branch of linkages at a change point.
    """
    z, turn = np.full((TERMS, len(linkage)), np.nan, dtype=complex), np.full(len(linkage), np.nan)
    for start in range(0, len(linkage), CHART_CHOICE.block):
        rows = np.arange(start, min(start + CHART_CHOICE.block, len(linkage)))
        at = None if pole is None else np.asarray(pole)[rows]
        for where, moving in charts(linkage[rows], point[rows], at):
            chosen = rows[where]
            z[:, chosen] = path_series(moving.point(point[chosen]))
            turn[chosen] = moving.velocity[1].imag
    return Jet(z, turn)


def charts(
    linkage: Linkage, point: Complexes, pole: Complexes | None, dtype: object = float
) -> list[tuple[Indices, Motion]]:
    """Choose the best conditioned chart of each linkage: pairs of indices and motion, by chart."""
    coupler = motion(linkage, 0, point, dtype, pole)
    best = np.nan_to_num(coupler.conditioning)
    chart = np.zeros(len(linkage), dtype=int)
    poor = np.flatnonzero(best < CHART_CHOICE.good)
    cranks = {}
    for crank in (CRANK_1, CRANK_2):
        if poor.size:
            cranks[crank] = motion(linkage[poor], crank, dtype=dtype)
            good = np.nan_to_num(cranks[crank].conditioning)
            better = good > best[poor]
            chart[poor[better]], best[poor[better]] = crank, good[better]
    regular = best > CHART_CHOICE.singular
    out = [(where := np.flatnonzero(regular & (chart == 0)), coupler[where])]
    for crank, moving in cranks.items():
        mine = regular[poor] & (chart[poor] == crank)
        out.append((poor[mine], moving[mine]))
    return [(where, moving) for where, moving in out if where.size]


def path_series(path: Path) -> Complexes:
    """Compute the series of a path: the closed form of `Path` on series instead of numbers."""
    forms, circle = path.forms, path.circle
    h, g, n, k, j2, b_x, b_y, l_x, l_y = (_polynomial(f) for f in forms[:9])
    with np.errstate(all="ignore"):
        hh = times(h, h)
        mixed = circle * _shift_coefficients(hh) - times(j2, h) + times(g, n)
        q = over(mixed, k + root(times(k, k) - circle * _shift_coefficients(mixed)))
        if path.branch.any():
            divided = circle * hh + _polynomial(forms[9])
            with_sign = path.branch * root(times(k, k) - np.where(circle > 0, divided, 0))
            other = np.where(k[0] * path.branch < 0, k - with_sign, over(divided, k + with_sign))
            q = np.where(path.branch == 0, q, other)
        inside = l_x + 1j * l_y - times(h + 1j * q, over(b_x + 1j * b_y, n))
    for i in range(2, TERMS):  # divided by 1 + t^2
        inside[i] -= inside[i - 2]
    return _shift_coefficients(inside)


def _polynomial(form: Floats) -> Floats:
    out = np.zeros((TERMS, form.shape[-1]), dtype=form.dtype)
    out[:3] = form
    return out


def _shift_coefficients(a: npt.NDArray[Scalar]) -> npt.NDArray[Scalar]:
    """Multiply a series by t."""
    return np.concatenate([np.zeros_like(a[:1]), a[:-1]])


def norm_squared(a: Complexes) -> Floats:
    """Re^2 + Im^2 of a complex series."""
    return times(a.real, a.real) + times(a.imag, a.imag)
