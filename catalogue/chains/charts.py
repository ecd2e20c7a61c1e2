"""Charts of chains through their dead and change points.

Near these points the squared sine of a dyad is a small difference of lengths, and its root, the
sine, loses half the digits.  With x = 0 at the point, the squared sine is  x^2 q(x)  with smooth q:
x is the angle of the drive from a change point, or the root of this angle from a dead point, where
the drive reverses.  A polynomial q is fitted to squared sines at some distance, where they are
accurate; the sine near the point is  x sqrt(q(x)).

Source: analytic continuation through a simple and a double zero.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..kinematics.types import Floats, Indices, Mask
from .chain import Chain
from .poses import poses


@dataclass(frozen=True)
class ChartOptions:
    """Options of the fit of charts.

    Attributes
    ----------
    nodes, degree : int
        Number of places at which squared sines are sampled, and degree of the polynomial.
    widest : float
        Largest reach: from a change point an angle [rad], from a dead point the root of an angle
        [rad^(1/2)]; for a driving slider displacements in sizes replace angles.
    share : float
        Largest reach over the distance of the next point.
    halvings : int
        Largest number of halvings of the reach until the polynomial fits.
    error : float
        Largest error of a fitted squared sine: some tens of rounding errors.
    """

    nodes: int = 18
    degree: int = 11
    widest: float = 0.3
    share: float = 0.4
    halvings: int = 5
    error: float = 1e-14


CHART = ChartOptions()
NODES = np.cos(np.pi * (np.arange(CHART.nodes) + 0.5) / CHART.nodes)


@dataclass(frozen=True)
class Charts:
    """Charts at the ends of the pieces of n circuits; arrays (p, n) unless said.

    Attributes
    ----------
    drive : ndarray
        Drive at the point [rad or length].
    is_dead : ndarray of bool
        Whether it is a dead point.
    reach : ndarray
        Largest |x|; 0 where there is no chart.
    q : ndarray, shape (p, d, c, n)
        Coefficients of q by powers of x over the reach; NaN for dyads without a zero there.
    """

    drive: Floats
    is_dead: Mask
    reach: Floats
    q: Floats

    def __getitem__(self, index: Any) -> Charts:
        return Charts(self.drive[:, index], self.is_dead[:, index], self.reach[:, index], self.q[..., index])

    def sines(self, piece: Indices, column: Indices, x: Floats) -> Floats:
        """Return the absolute sines of all dyads at places x (k,), shape (d, k)."""
        q = self.q[piece, :, :, column]
        t = (x / self.reach[piece, column])[:, None]
        value = np.zeros(q.shape[:2])
        for power in reversed(range(q.shape[2])):
            value = value * t + q[..., power]
        return np.asarray(np.abs(x) * np.sqrt(value).T)


def fit_charts(chain: Chain, start: Floats, end: Floats, sign: Floats, is_dead: Mask, is_change: Mask) -> Charts:
    """Fit charts at the ends of consecutive pieces (p, n).

    Parameters
    ----------
    chain : Chain
    start, end : ndarray, shape (p, n)
        Drive at both ends of each piece; the pieces follow one another cyclically.
    sign : ndarray, shape (p, d, n)
        Branches.
    is_dead, is_change : ndarray of bool, shape (p, n)
    """
    pieces, dyads, n = sign.shape
    q = np.full((pieces, dyads, CHART.degree + 1, n), np.nan)
    charts = Charts(end.copy(), is_dead, np.zeros((pieces, n)), q)
    piece, column = np.nonzero(is_dead | is_change)
    if not len(piece):
        return charts
    known = np.isfinite(end)
    after = np.where(piece + 1 < known.sum(0)[column], piece + 1, 0)
    dead = is_dead[piece, column]
    lengths = np.abs(np.stack([end[p, column] - start[p, column] for p in (piece, after)])).min(0)
    unit = chain.size[column] if chain.structure.is_pushed else np.ones(len(column))
    widest = np.minimum(CHART.share * lengths / unit, CHART.widest)
    widest = np.where(dead, np.minimum(CHART.share * np.sqrt(lengths / unit), CHART.widest), widest)
    reach = widest * np.where(dead, np.sqrt(unit), unit)
    zero = sign[piece, :, column] != sign[after, :, column]
    vander = np.vander(NODES, CHART.degree + 1, increasing=True)
    weight = NODES[:, None] ** 2
    solve = np.linalg.pinv(weight * vander) * weight.T
    open_ = np.arange(len(piece))
    for _ in range(CHART.halvings):
        p, next_, c, w = piece[open_], after[open_], column[open_], reach[open_]
        x = NODES[:, None] * w
        way = np.sign(end[p, c] - start[p, c])
        drive = end[p, c] + way * np.where(dead[open_], -(x**2), x)
        branch = np.where(x[:, None] < 0, sign[p, :, c].T, sign[next_, :, c].T)
        squares = poses(chain[c], drive, np.moveaxis(branch, 1, 0)).sines
        with np.errstate(all="ignore"):
            fit = np.einsum("cj,djk->dck", solve, squares / x**2)
            off = np.abs(np.einsum("jc,dck->djk", vander, fit) * x**2 - squares).max(1)
            good = (off <= CHART.error) | ~zero[open_].T
            # the fitted polynomial must stay positive
            good &= (np.einsum("jc,dck->djk", vander, fit).min(1) > 0) | ~zero[open_].T
        fits = good.all(0)
        some = open_[fits]
        charts.reach[piece[some], column[some]] = reach[some]
        charts.q[piece[some], :, :, column[some]] = np.where(
            zero[some][:, :, None], np.moveaxis(fit[:, :, fits], -1, 0), np.nan
        )
        open_ = open_[~fits]
        reach[open_] *= 0.5
        if not len(open_):
            break
    return charts
